//! Traversal of the 8-wide tree, generic over the lanes.
//!
//! Nearest hit: children are visited by entry distance; the stack holds 64-bit keys with the distance (never negative,
//! so its bits are ordered) in the upper half. Any hit: in the order of the slots, biggest box first.
#![allow(unsafe_code, reason = "unchecked indices; see each SAFETY note")]

use std::marker::PhantomData;
use std::mem::MaybeUninit;

use math::Ray;

use super::lanes::Lanes;
use super::stack::{Met, Stack, nearest_first};
use crate::accel::Accel;
use crate::blas::Blas;
use crate::hit::{Best, Hit, NO_INSTANCE};
use crate::layout::{ChildRef, FILTER_BIT, Node8, TriBlock, WIDTH, WideTree};
use crate::primitive::triangle;
use crate::ray_space::RaySpace;

/// A ray in registers.
struct WideRay<L> {
    o: [L; 3],
    inv: [L; 3],
    o_far: [L; 3],
    inv_far: [L; 3],
    near: [usize; 3],
    /// For triangles: the axes, the origin along each, and the shear.
    k: [usize; 3],
    o_k: [L; 3],
    shear: [L; 2],
}

#[inline(always)]
fn splat3<L: Lanes>(v: [f32; 3]) -> [L; 3] {
    [L::splat(v[0]), L::splat(v[1]), L::splat(v[2])]
}

// No closures on lanes here: a closure is a function without the kernel's target features, and what is not inlined
// into the kernel falls back to calls.
impl<L: Lanes> WideRay<L> {
    #[inline(always)]
    fn new(r: &RaySpace) -> Self {
        Self {
            o: splat3(r.o),
            inv: splat3(r.inv),
            o_far: splat3(r.o_far),
            inv_far: splat3(r.inv_far),
            near: r.near,
            k: r.k,
            o_k: splat3([r.o[r.k[0]], r.o[r.k[1]], r.o[r.k[2]]]),
            shear: [L::splat(r.shear[0]), L::splat(r.shear[1])],
        }
    }

    /// Where one axis's near and far planes are met.
    #[inline(always)]
    fn axis(&self, i: usize, near: L, far: L) -> (L, L) {
        (near.sub(self.o[i]).mul(self.inv[i]), far.sub(self.o_far[i]).mul(self.inv_far[i]))
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
        let near = self.near[i] & 1;
        self.axis(i, L::load(&node.planes[i][near]), L::load(&node.planes[i][near ^ 1]))
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
}

/// Candidates in a block of triangles.
struct Candidates {
    mask: u32,
    entry: [f32; WIDTH],
    exit: [f32; WIDTH],
}

/// A corner of all triangles, seen along the ray.
#[inline(always)]
fn sheared<L: Lanes>(ray: &WideRay<L>, corner: &[[f32; WIDTH]; 3]) -> [L; 2] {
    let [kx, ky, kz] = ray.k;
    // SAFETY: `k` is a permutation of 0, 1, 2, see `RaySpace`.
    let (x, y, z) = unsafe { (corner.get_unchecked(kx), corner.get_unchecked(ky), corner.get_unchecked(kz)) };
    let z = L::load(z).sub(ray.o_k[2]);
    let x = L::load(x).sub(ray.o_k[0]).sub(ray.shear[0].mul(z));
    let y = L::load(y).sub(ray.o_k[1]).sub(ray.shear[1].mul(z));
    [x, y]
}

#[inline(always)]
fn cross<L: Lanes>(p: [L; 2], q: [L; 2]) -> L {
    p[0].mul(q[1]).sub(p[1].mul(q[0]))
}

/// Lanes whose triangle the ray's line may pass through, and whose box it meets before `t_max`.
#[inline(always)]
fn block_candidates<L: Lanes>(wide: &WideRay<L>, block: &TriBlock, t_max: f32) -> Option<Candidates> {
    let (a, b, c) = (sheared(wide, &block.v[0]), sheared(wide, &block.v[1]), sheared(wide, &block.v[2]));
    let (u, v, w) = (cross(c, b), cross(a, c), cross(b, a));
    let zero = L::splat(0.0);
    let mask = zero.le(u.min(v).min(w)) | u.max(v).max(w).le(zero);
    if mask == 0 {
        return None;
    }

    let (x, y, z) = (wide.block_axis(0, block), wide.block_axis(1, block), wide.block_axis(2, block));
    let (met, entry, exit) = WideRay::meet(x, y, z, t_max);
    let mask = mask & met;
    if mask == 0 {
        return None;
    }
    let mut found = Candidates { mask, entry: [0.0; WIDTH], exit: [0.0; WIDTH] };
    entry.store(&mut found.entry);
    exit.store(&mut found.exit);
    Some(found)
}

/// What is done at a leaf. Its method must be `inline(always)`, see above.
trait AtLeaf {
    fn visit(&mut self, leaf: ChildRef, best: &mut Best);
}

/// Visits the leaves that the ray meets, until the tree is exhausted or (`ANY`) something is found.
#[inline(always)]
fn leaves<L: Lanes, const ANY: bool>(
    tree: &WideTree,
    wide: &WideRay<L>,
    best: &mut Best,
    at: &mut impl AtLeaf,
) {
    if tree.root == ChildRef::EMPTY {
        return;
    }
    let mut keys = MaybeUninit::uninit();
    let mut stack = Stack { keys: &mut keys, height: 0 };
    let mut now = tree.root;
    loop {
        while now.is_node() {
            // SAFETY: the references in a tree are to its own nodes, as `build::collapse` writes them.
            let node = unsafe { tree.nodes.get_unchecked(now.index()) };
            let (mut mask, entry) = wide.node(node, best.t);
            if mask == 0 {
                now = ChildRef::EMPTY;
                break;
            }
            if ANY {
                // In the order of the slots: the last, which is the biggest, comes first.
                let last = 31 - mask.leading_zeros();
                mask ^= 1 << last;
                while mask != 0 {
                    stack.push(u64::from(node.children[mask.trailing_zeros() as usize & (WIDTH - 1)].0));
                    mask &= mask - 1;
                }
                now = node.children[last as usize & (WIDTH - 1)];
            } else {
                let mut met = Met { mask, entry: [0.0; WIDTH], node };
                entry.store(&mut met.entry);
                now = nearest_first(met, &mut stack);
            }
        }
        if now != ChildRef::EMPTY {
            at.visit(now, best);
            if ANY && best.found {
                return;
            }
        }
        // The next that is not behind the best hit.
        loop {
            let Some(key) = stack.pop() else { return };
            if ANY || f32::from_bits((key >> 32) as u32) <= best.t {
                now = ChildRef(key as u32);
                break;
            }
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
        (t, u, v): (f32, f32, f32),
        best: &mut Best,
        filter: &mut F,
    ) {
        let item = tagged & !FILTER_BIT;
        let at = if t > self.entry { t } else { self.entry };
        if !(t > 0.0 && best.loses_to(at, self.instance, item)) {
            return;
        }
        let candidate = Best { t: at, instance: self.instance, item, u, v, found: true };
        if tagged & FILTER_BIT == 0 || filter(&self.blas.hit(&candidate)) {
            *best = candidate;
        }
    }

    #[inline(always)]
    fn block<L: Lanes, F: FnMut(&Hit) -> bool>(
        &self,
        wide: &WideRay<L>,
        block: &TriBlock,
        best: &mut Best,
        filter: &mut F,
    ) {
        let Some(c) = block_candidates(wide, block, best.t) else { return };
        let mut mask = c.mask;
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            if let Some(hit) = triangle::finish(self.ray, &block.corners(lane), c.entry[lane], c.exit[lane]) {
                self.offer(block.items[lane], hit, best, filter);
            }
        }
    }

    /// Primitives that are no triangles at rest.
    #[inline(never)]
    fn others<F: FnMut(&Hit) -> bool>(&self, range: std::ops::Range<usize>, best: &mut Best, filter: &mut F) {
        for other in &self.blas.others[range] {
            let (entry, exit) = self.ray.slab(&other.bounds);
            if !(entry <= exit && entry <= best.t) {
                continue;
            }
            for root in other.primitive.roots(&self.blas.curves, self.ray).into_iter().flatten() {
                if root.t > 0.0 {
                    let t = triangle::clamp(root.t, entry, exit);
                    self.offer(other.tagged, (t, root.u, root.v), best, filter);
                }
            }
        }
    }

    #[inline(always)]
    fn run<L: Lanes, const ANY: bool, F: FnMut(&Hit) -> bool>(
        &self,
        wide: &WideRay<L>,
        best: &mut Best,
        filter: &mut F,
    ) {
        leaves::<L, ANY>(&self.blas.tree, wide, best, &mut BlasLeaf { visit: self, wide, filter });
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
    fn visit(&mut self, leaf: ChildRef, best: &mut Best) {
        let blas = self.visit.blas;
        if leaf.is_block() {
            self.visit.block(self.wide, &blas.blocks[leaf.index()], best, self.filter);
            return;
        }
        let mixed = blas.mixed[leaf.index()];
        if mixed.block != ChildRef::EMPTY {
            self.visit.block(self.wide, &blas.blocks[mixed.block.index()], best, self.filter);
        }
        self.visit.others(mixed.first as usize..(mixed.first + mixed.count) as usize, best, self.filter);
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
    let mut best = Best::nothing(ray.t_max);
    if ray.t_max > 0.0
        && let Some(local) = RaySpace::new(ray.origin.0, ray.dir.0, ray.time, &accel.bounds)
    {
        let wide = WideRay::<L>::new(&local);
        let visit = Visit { blas: &accel.world, ray: &local, instance: NO_INSTANCE, entry: 0.0 };
        visit.run::<L, ANY, F>(&wide, &mut best, filter);
        if INSTANCES && !(ANY && best.found) {
            let mut at = TopLeaf::<L, ANY, F> { accel, ray, outer: &local, filter, lanes: PhantomData };
            leaves::<L, ANY>(&accel.top, &wide, &mut best, &mut at);
        }
    }
    best
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
    fn visit(&mut self, leaf: ChildRef, best: &mut Best) {
        let placed = &self.accel.placed[leaf.index()];
        let (entry, exit) = self.outer.slab(&placed.bounds);
        if !(entry <= exit && entry <= best.t) {
            return;
        }
        let blas = &self.accel.objects[placed.object as usize];
        let (o, d) = placed.to_object(self.ray.origin.0, self.ray.dir.0, self.ray.time);
        if let Some(local) = RaySpace::new(o, d, self.ray.time, &blas.bounds) {
            let visit = Visit { blas, ray: &local, instance: leaf.index() as u32, entry };
            visit.run::<L, ANY, F>(&WideRay::new(&local), best, self.filter);
        }
    }
}
