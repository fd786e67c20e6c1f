//! Traversal of the 8-wide tree, generic over the lanes.
//!
//! Nearest hit: children are visited by entry distance; the stack holds 64-bit keys with the distance (never negative,
//! so its bits are ordered) in the upper half. Any hit: in the order of the slots, biggest box first.
#![allow(unsafe_code, reason = "unchecked indices; see each SAFETY note")]

use std::marker::PhantomData;
use std::mem::MaybeUninit;

use math::Ray;

use super::lanes::Lanes;
use super::stack::{Stack, biggest_first, nearest_first};
use crate::accel::Accel;
use crate::blas::{Blas, Other};
use crate::hit::{Best, Hit, NO_INSTANCE, NOWHERE, place};
use crate::layout::{ChildRef, FILTER_BIT, Node8, TriBlock, WIDTH, WideTree};
use crate::primitive::{Root, triangle};
use crate::ray_space::RaySpace;

/// A ray in registers.
struct WideRay<L> {
    inv: [L; 3],
    c_near: [L; 3],
    c_far: [L; 3],
    /// Where a node has its near and far planes, see [`Node8::plane`].
    near: [usize; 3],
    far: [usize; 3],
    /// For triangles: where a block has the coordinates along each axis, see [`TriBlock::coordinates`]; the origin along
    /// each; and the shear.
    k: [usize; 3],
    o_k: [L; 3],
    shear: [L; 2],
}

#[inline(always)]
fn splat3<L: Lanes>(v: &[f32; 4]) -> [L; 3] {
    [L::splat(v[0]), L::splat(v[1]), L::splat(v[2])]
}

// No closures on lanes here, and no `array::map`: a closure is a function without the kernel's target features, and
// what is not inlined into the kernel falls back to calls.
impl<L: Lanes> WideRay<L> {
    #[inline(always)]
    fn new(r: &RaySpace) -> Self {
        let up = |i: usize| (r.negative >> i & 1) as usize;
        let k = [(r.k[0] & 3) as usize, (r.k[1] & 3) as usize, (r.k[2] & 3) as usize];
        Self {
            inv: splat3(&r.inv),
            c_near: splat3(&r.c_near),
            c_far: splat3(&r.c_far),
            near: [Node8::plane_at(0, up(0)), Node8::plane_at(1, up(1)), Node8::plane_at(2, up(2))],
            far: [Node8::plane_at(0, 1 - up(0)), Node8::plane_at(1, 1 - up(1)), Node8::plane_at(2, 1 - up(2))],
            k: [TriBlock::axis_at(k[0]), TriBlock::axis_at(k[1]), TriBlock::axis_at(k[2])],
            o_k: [L::splat(r.o[k[0]]), L::splat(r.o[k[1]]), L::splat(r.o[k[2]])],
            shear: [L::splat(r.shear[0]), L::splat(r.shear[1])],
        }
    }

    /// Where one axis's near and far planes are met.
    #[inline(always)]
    fn axis(&self, i: usize, near: L, far: L) -> (L, L) {
        (near.mul_add(self.inv[i], self.c_near[i]), far.mul_add(self.inv[i], self.c_far[i]))
    }

    /// The boxes met before `t_max`, their entries and exits. The operations of [`RaySpace::slab`].
    #[inline(always)]
    fn meet(x: (L, L), y: (L, L), z: (L, L), t_max: f32) -> (u32, L, L) {
        let entry = x.0.max(y.0).max(z.0.max(L::splat(0.0)));
        let (a, b) = (x.1.min(y.1), z.1);
        (entry.le(a.min(b.min(L::splat(t_max)))), entry, a.min(b))
    }

    #[inline(always)]
    fn node_axis(&self, i: usize, node: &Node8) -> (L, L) {
        // SAFETY: these are places of planes.
        let (near, far) = unsafe { (node.plane(self.near[i]), node.plane(self.far[i])) };
        self.axis(i, L::load(near), L::load(far))
    }

    #[inline(always)]
    fn node(&self, node: &Node8, t_max: f32) -> (u32, L) {
        let (x, y, z) = (self.node_axis(0, node), self.node_axis(1, node), self.node_axis(2, node));
        let (mask, entry, _) = Self::meet(x, y, z, t_max);
        (mask, entry)
    }

    #[inline(always)]
    fn block_axis(&self, i: usize, block: &TriBlock) -> (L, L) {
        let (a, b, c) = (L::load(&block.v[0][i]), L::load(&block.v[1][i]), L::load(&block.v[2][i]));
        let (lower, upper) = (a.min(b).min(c), a.max(b).max(c));
        self.axis(i, lower.or_if_negative(upper, self.inv[i]), upper.or_if_negative(lower, self.inv[i]))
    }

    /// One corner of all triangles, seen along the ray. The operations of [`RaySpace::sheared`].
    #[inline(always)]
    fn sheared(&self, block: &TriBlock, vertex: usize) -> (L, L) {
        // SAFETY: these are places of coordinates.
        let (x, y, z) = unsafe {
            (
                block.coordinates(vertex, self.k[0]),
                block.coordinates(vertex, self.k[1]),
                block.coordinates(vertex, self.k[2]),
            )
        };
        let z = L::load(z).sub(self.o_k[2]);
        let x = z.mul_add(self.shear[0], L::load(x).sub(self.o_k[0]));
        let y = z.mul_add(self.shear[1], L::load(y).sub(self.o_k[1]));
        (x, y)
    }
}

/// Candidates in a block of triangles.
struct Candidates {
    mask: u32,
    /// Of those, the ones that are hit for sure.
    sure: u32,
    entry: [f32; WIDTH],
    exit: [f32; WIDTH],
}

#[inline(always)]
fn cross<L: Lanes>(p: (L, L), q: (L, L)) -> L {
    p.0.mul(q.1).sub(p.1.mul(q.0))
}

/// Lanes whose triangle the ray's line may pass through, and whose box it meets before `t_max`.
#[inline(always)]
fn block_candidates<L: Lanes>(wide: &WideRay<L>, block: &TriBlock, t_max: f32) -> Option<Candidates> {
    let (a, b, c) = (wide.sheared(block, 0), wide.sheared(block, 1), wide.sheared(block, 2));
    let (u, v, w) = (cross(c, b), cross(a, c), cross(b, a));
    let zero = L::splat(0.0);
    let (least, most) = (u.min(v).min(w), u.max(v).max(w));
    let mask = zero.le(least) | most.le(zero);
    if mask == 0 {
        return None;
    }

    let (x, y, z) = (wide.block_axis(0, block), wide.block_axis(1, block), wide.block_axis(2, block));
    let (met, entry, exit) = WideRay::meet(x, y, z, t_max);
    let mask = mask & met;
    if mask == 0 {
        return None;
    }
    // Not on an edge or corner: then `0 ≤ least` and `least ≤ 0` are not both true.
    let sure = !(least.le(zero) & zero.le(most));
    let mut found = Candidates { mask, sure, entry: [0.0; WIDTH], exit: [0.0; WIDTH] };
    entry.store(&mut found.entry);
    exit.store(&mut found.exit);
    Some(found)
}

/// What is done at a leaf. Its method must be `inline(always)`, see above.
trait AtLeaf {
    fn visit(&mut self, leaf: ChildRef, best: Best) -> Best;
}

/// Visits the leaves that the ray meets, until the tree is exhausted or (`ANY`) something is found.
#[inline(always)]
fn leaves<L: Lanes, const ANY: bool>(
    tree: &WideTree,
    wide: &WideRay<L>,
    mut best: Best,
    at: &mut impl AtLeaf,
) -> Best {
    if tree.root == ChildRef::EMPTY {
        return best;
    }
    let mut keys = MaybeUninit::uninit();
    let mut stack = Stack { keys: &mut keys, height: 0 };
    let mut now = tree.root;
    'next: loop {
        while now.is_node() {
            // SAFETY: the references in a tree are to its own nodes, as `build::collapse` writes them.
            let node = unsafe { tree.nodes.get_unchecked(now.index()) };
            let (mask, entry) = wide.node(node, best.t);
            let Some(next) = (if ANY {
                biggest_first(mask, node, &mut stack)
            } else {
                let mut entries = [0.0; WIDTH];
                entry.store(&mut entries);
                nearest_first(mask, &entries, node, &mut stack)
            }) else {
                match stack.pop_until::<ANY>(best.t) {
                    Some(next) => now = next,
                    None => return best,
                }
                continue 'next;
            };
            now = next;
        }
        best = at.visit(now, best);
        if ANY && best.found {
            return best;
        }
        match stack.pop_until::<ANY>(best.t) {
            Some(next) => now = next,
            None => return best,
        }
    }
}

/// What is the same for all leaves of one structure.
struct Visit<'a> {
    blas: &'a Blas,
    ray: &'a RaySpace,
    instance: u32,
    /// No hit lies before this.
    entry: f32,
}

impl Visit<'_> {
    /// Takes the candidate if it is better and the filter agrees.
    #[inline(always)]
    fn offer<F: FnMut(&Hit) -> bool>(
        &self,
        tagged: u32,
        candidate: Best,
        best: &mut Best,
        filter: &mut F,
    ) {
        let item = tagged & !FILTER_BIT;
        let at = if candidate.t > self.entry { candidate.t } else { self.entry };
        if !(candidate.t > 0.0 && best.loses_to(at, self.instance, item)) {
            return;
        }
        let candidate = Best { t: at, instance: self.instance, item, ..candidate };
        if tagged & FILTER_BIT == 0 || filter(&self.blas.hit(&self.resolve(candidate))) {
            *best = candidate;
        }
    }

    /// With `u` and `v` filled in.
    #[inline(always)]
    fn resolve(&self, best: Best) -> Best {
        if best.place == NOWHERE {
            return best;
        }
        let (block, lane) = ((best.place >> 3) as usize, (best.place & 7) as usize);
        let (u, v) = triangle::barycentrics(self.ray, &self.blas.blocks[block].corners(lane));
        Best { u, v, place: NOWHERE, ..best }
    }

    #[inline(always)]
    fn block<L: Lanes, F: FnMut(&Hit) -> bool>(
        &self,
        wide: &WideRay<L>,
        index: usize,
        mut best: Best,
        filter: &mut F,
    ) -> Best {
        debug_assert!(index < self.blas.blocks.len());
        // SAFETY: the references in a tree are to blocks of its own structure, as `Blas::build` writes them.
        let block = unsafe { self.blas.blocks.get_unchecked(index) };
        let Some(c) = block_candidates(wide, block, best.t) else { return best };
        let mut mask = c.mask;
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize & (WIDTH - 1);
            mask &= mask - 1;
            let (p, entry, exit) = (block.corners(lane), c.entry[lane], c.exit[lane]);
            let t = if c.sure >> lane & 1 != 0 {
                triangle::distance(self.ray, &p, entry, exit)
            } else {
                triangle::careful_distance(self.ray, &p, entry, exit)
            };
            if let Some(t) = t {
                let candidate = Best { t, place: place(index, lane), found: true, ..Best::nothing(t) };
                self.offer(block.items[lane], candidate, &mut best, filter);
            }
        }
        best
    }

    /// Primitives that are no triangles at rest.
    #[inline(always)]
    fn others<F: FnMut(&Hit) -> bool>(
        &self,
        range: std::ops::Range<usize>,
        mut best: Best,
        filter: &mut F,
    ) -> Best {
        for other in &self.blas.others[range] {
            let (entry, exit) = self.ray.slab(&other.bounds);
            if entry <= exit && entry <= best.t {
                best = self.other(other, (entry, exit), best, filter);
            }
        }
        best
    }

    #[inline(never)]
    fn other<F: FnMut(&Hit) -> bool>(
        &self,
        other: &Other,
        (entry, exit): (f32, f32),
        mut best: Best,
        filter: &mut F,
    ) -> Best {
        for Root { t, u, v } in other.primitive.roots(&self.blas.curves, self.ray).into_iter().flatten() {
            if t > 0.0 {
                let t = triangle::clamp(t, entry, exit);
                let candidate = Best { u, v, found: true, ..Best::nothing(t) };
                self.offer(other.tagged, candidate, &mut best, filter);
            }
        }
        best
    }

    /// The best of `best` and what is in the structure.
    #[inline(always)]
    fn run<L: Lanes, const ANY: bool, F: FnMut(&Hit) -> bool>(
        &self,
        wide: &WideRay<L>,
        best: Best,
        filter: &mut F,
    ) -> Best {
        let best = leaves::<L, ANY>(&self.blas.tree, wide, best, &mut BlasLeaf { visit: self, wide, filter });
        if ANY { best } else { self.resolve(best) }
    }
}

/// At the leaves of one structure.
struct BlasLeaf<'a, L, F> {
    visit: &'a Visit<'a>,
    wide: &'a WideRay<L>,
    filter: &'a mut F,
}

impl<L: Lanes, F: FnMut(&Hit) -> bool> AtLeaf for BlasLeaf<'_, L, F> {
    #[inline(always)]
    fn visit(&mut self, leaf: ChildRef, best: Best) -> Best {
        let blas = self.visit.blas;
        let (mut block, mut others) = (leaf, 0..0);
        if !leaf.is_block() {
            let mixed = blas.mixed[leaf.index()];
            (block, others) = (mixed.block, mixed.first as usize..(mixed.first + mixed.count) as usize);
        }
        let mut best = best;
        if block != ChildRef::EMPTY {
            best = self.visit.block(self.wide, block.index(), best, self.filter);
        }
        if !others.is_empty() {
            best = self.visit.others(others, best, self.filter);
        }
        best
    }
}

/// The nearest hit, or any if `ANY`. `INSTANCES`: there may be some.
#[inline(always)]
pub(super) fn trace<L: Lanes, const ANY: bool, const INSTANCES: bool, F>(
    accel: &Accel,
    ray: &Ray,
    filter: &mut F,
) -> Best
where
    F: FnMut(&Hit) -> bool,
{
    let best = Best::nothing(ray.t_max);
    if !(ray.t_max > 0.0) {
        return best;
    }
    let Some(local) = RaySpace::new(ray.origin.0, ray.dir.0, ray.time, accel.reach) else { return best };
    let wide = WideRay::<L>::new(&local);
    let visit = Visit { blas: &accel.world, ray: &local, instance: NO_INSTANCE, entry: 0.0 };
    let best = visit.run::<L, ANY, F>(&wide, best, filter);
    if !INSTANCES || ANY && best.found {
        return best;
    }
    let mut at = TopLeaf::<L, ANY, F> { accel, ray, outer: &local, filter, lanes: PhantomData };
    leaves::<L, ANY>(&accel.top, &wide, best, &mut at)
}

/// At the instances.
struct TopLeaf<'a, L, const ANY: bool, F> {
    accel: &'a Accel,
    ray: &'a Ray,
    outer: &'a RaySpace,
    filter: &'a mut F,
    lanes: PhantomData<L>,
}

impl<L: Lanes, const ANY: bool, F: FnMut(&Hit) -> bool> AtLeaf for TopLeaf<'_, L, ANY, F> {
    #[inline(always)]
    fn visit(&mut self, leaf: ChildRef, best: Best) -> Best {
        let placed = &self.accel.placed[leaf.index()];
        let (entry, exit) = self.outer.slab(&placed.bounds);
        if !(entry <= exit && entry <= best.t) {
            return best;
        }
        let blas = &self.accel.objects[placed.object as usize];
        let (o, d) = placed.to_object(self.ray.origin.0, self.ray.dir.0, self.ray.time);
        let Some(local) = RaySpace::new(o, d, self.ray.time, blas.reach) else { return best };
        let visit = Visit { blas, ray: &local, instance: leaf.index() as u32, entry };
        visit.run::<L, ANY, F>(&WideRay::new(&local), best, self.filter)
    }
}
