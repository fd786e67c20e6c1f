//! Traversal of the wide tree, generic over the lanes.
//!
//! Nearest hit: children are visited by entry distance; the stack holds 64-bit keys with the distance (never negative,
//! so its bits are ordered) in the upper half. Any hit: in the order of the slots, biggest box first.
#![allow(unsafe_code, reason = "unchecked indices; see each SAFETY note")]

use std::marker::PhantomData;
use std::mem::MaybeUninit;

use math::Ray;

use super::lanes::{Kernel, Lanes};
use super::stack::{Stack, biggest_first, nearest_first};
use crate::accel::Accel;
use crate::blas::{Blas, Other};
use crate::hit::{Best, Hit, NO_INSTANCE, NOWHERE, place};
use crate::layout::{ChildRef, FILTER_BIT, Lane, MixedLeaf, NODE, Node, TriBlock, WIDTH, WideTree};
use crate::primitive::{Root, triangle};
use crate::ray_space::RaySpace;

/// A ray in registers, for nodes.
struct NodeRay<L> {
    inv: [L; 3],
    c_near: [L; 3],
    c_far: [L; 3],
    /// Where a node has its near and far planes, see [`Node::plane`].
    near: [usize; 3],
    far: [usize; 3],
}

/// A ray for blocks of triangles: where a block has the coordinates along each axis (see [`TriBlock::coordinates`]),
/// and the origin along each.
#[derive(Clone, Copy)]
struct BlockRay {
    k: [usize; 3],
    o_k: [f32; 3],
}

#[inline(always)]
fn splat3<L: Lanes<NODE>>(v: &[f32; 4]) -> [L; 3] {
    [L::splat(v[0]), L::splat(v[1]), L::splat(v[2])]
}

// No closures on lanes here, and no `array::map`: a closure is a function without the kernel's target features, and
// what is not inlined into the kernel falls back to calls.
impl<L: Lanes<NODE>> NodeRay<L> {
    #[inline(always)]
    fn new(r: &RaySpace) -> Self {
        let up = |i: usize| (r.negative >> i & 1) as usize;
        Self {
            inv: splat3(&r.inv),
            c_near: splat3(&r.c_near),
            c_far: splat3(&r.c_far),
            near: [Node::plane_at(0, up(0)), Node::plane_at(1, up(1)), Node::plane_at(2, up(2))],
            far: [Node::plane_at(0, 1 - up(0)), Node::plane_at(1, 1 - up(1)), Node::plane_at(2, 1 - up(2))],
        }
    }
}

impl BlockRay {
    #[inline(always)]
    fn new(r: &RaySpace) -> Self {
        let k = [(r.k[0] & 3) as usize, (r.k[1] & 3) as usize, (r.k[2] & 3) as usize];
        Self {
            k: [TriBlock::axis_at(k[0]), TriBlock::axis_at(k[1]), TriBlock::axis_at(k[2])],
            o_k: [r.o[k[0]], r.o[k[1]], r.o[k[2]]],
        }
    }
}

/// The boxes met before `t_max`, their entries and exits. The operations of [`RaySpace::slab`].
#[inline(always)]
fn meet<const N: usize, L: Lanes<N>>(x: (L, L), y: (L, L), z: (L, L), t_max: f32) -> (u32, L, L) {
    let entry = x.0.max(y.0).max(z.0.max(L::splat(0.0)));
    let (a, b) = (x.1.min(y.1), z.1);
    (entry.le(a.min(b.min(L::splat(t_max)))), entry, a.min(b))
}

impl<L: Lanes<NODE>> NodeRay<L> {
    /// Where one axis's near and far planes are met.
    #[inline(always)]
    fn axis(&self, i: usize, node: &Node) -> (L, L) {
        // SAFETY: these are places of planes.
        let (near, far) = unsafe { (node.plane(self.near[i]), node.plane(self.far[i])) };
        (
            L::load(near).mul_add(self.inv[i], self.c_near[i]),
            L::load(far).mul_add(self.inv[i], self.c_far[i]),
        )
    }

    /// The children met before `t_max`, and where.
    #[inline(always)]
    fn meet(&self, node: &Node, t_max: f32) -> (u32, L) {
        let (mask, entry, _) = meet(self.axis(0, node), self.axis(1, node), self.axis(2, node), t_max);
        (mask, entry)
    }
}

/// Where one axis's near and far planes of the triangles' boxes are met.
#[inline(always)]
fn block_axis<L: Lanes<WIDTH>>(ray: &RaySpace, i: usize, block: &TriBlock) -> (L, L) {
    let (a, b, c) = (L::load(&block.v[0][i]), L::load(&block.v[1][i]), L::load(&block.v[2][i]));
    let (inv, c_near, c_far) = (L::splat(ray.inv[i]), L::splat(ray.c_near[i]), L::splat(ray.c_far[i]));
    // As rounding is monotone, the planes need not be sorted first.
    let (x, y) = (a.min(b).min(c), a.max(b).max(c));
    (
        x.mul_add(inv, c_near).min(y.mul_add(inv, c_near)),
        x.mul_add(inv, c_far).max(y.mul_add(inv, c_far)),
    )
}

/// One corner of all triangles, seen along the ray. The operations of [`RaySpace::sheared`].
#[inline(always)]
fn sheared<L: Lanes<WIDTH>>(ray: &RaySpace, at: &BlockRay, block: &TriBlock, vertex: usize) -> (L, L) {
    // SAFETY: these are places of coordinates.
    let (x, y, z) = unsafe {
        (
            block.coordinates(vertex, at.k[0]),
            block.coordinates(vertex, at.k[1]),
            block.coordinates(vertex, at.k[2]),
        )
    };
    let z = L::load(z).sub(L::splat(at.o_k[2]));
    let x = z.mul_add(L::splat(ray.shear[0]), L::load(x).sub(L::splat(at.o_k[0])));
    let y = z.mul_add(L::splat(ray.shear[1]), L::load(y).sub(L::splat(at.o_k[1])));
    (x, y)
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
fn cross<L: Lanes<WIDTH>>(p: (L, L), q: (L, L)) -> L {
    p.0.mul(q.1).sub(p.1.mul(q.0))
}

/// Lanes whose triangle the ray's line may pass through, and whose box it meets before `t_max`.
#[inline(always)]
fn block_candidates<L: Lanes<WIDTH>>(
    ray: &RaySpace,
    at: &BlockRay,
    block: &TriBlock,
    t_max: f32,
) -> Option<Candidates> {
    let a: (L, L) = sheared(ray, at, block, 0);
    let (b, c) = (sheared(ray, at, block, 1), sheared(ray, at, block, 2));
    let (u, v, w) = (cross(c, b), cross(a, c), cross(b, a));
    let zero = L::splat(0.0);
    let (least, most) = (u.min(v).min(w), u.max(v).max(w));
    let mask = zero.le(least) | most.le(zero);
    if mask == 0 {
        return None;
    }

    let (x, y, z) = (block_axis::<L>(ray, 0, block), block_axis(ray, 1, block), block_axis(ray, 2, block));
    let (met, entry, exit) = meet(x, y, z, t_max);
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
    fn visit(&mut self, leaf: ChildRef, best: &mut Best);
}

/// Visits the leaves that the ray meets, until the tree is exhausted or (`ANY`) something is found.
#[inline(always)]
fn leaves<L: Lanes<NODE>, const ANY: bool>(
    tree: &WideTree,
    ray: &NodeRay<L>,
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
            let (mask, entry) = ray.meet(node, best.t);
            let next = if ANY {
                biggest_first(mask, node, &mut stack)
            } else {
                let mut entries = [0.0; NODE];
                entry.store(&mut entries);
                nearest_first(mask, &entries, node, &mut stack)
            };
            match next.or_else(|| stack.pop_until::<ANY>(best.t)) {
                Some(next) => now = next,
                None => return,
            }
        }
        at.visit(now, best);
        if ANY && best.found {
            return;
        }
        match stack.pop_until::<ANY>(best.t) {
            Some(next) => now = next,
            None => return,
        }
    }
}

/// What is the same for all leaves of one structure.
#[derive(Clone, Copy)]
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
    fn offer<F: FnMut(&Hit) -> bool>(self, tagged: u32, candidate: Best, best: &mut Best, filter: &mut F) {
        let item = tagged & !FILTER_BIT;
        let at = if candidate.t > self.entry { candidate.t } else { self.entry };
        if !(candidate.t > 0.0 && best.loses_to(at, self.instance, item)) {
            return;
        }
        let candidate = Best { t: at, instance: self.instance, item, ..candidate };
        if tagged & FILTER_BIT == 0 || self.passes(candidate, filter) {
            *best = candidate;
        }
    }

    #[inline(never)]
    fn passes<F: FnMut(&Hit) -> bool>(self, candidate: Best, filter: &mut F) -> bool {
        filter(&self.blas.hit(&self.resolve(candidate)))
    }

    /// With `u` and `v` filled in.
    #[inline(always)]
    fn resolve(self, best: Best) -> Best {
        if best.place == NOWHERE {
            return best;
        }
        let (block, lane) = ((best.place >> 3) as usize, (best.place & 7) as usize);
        let (u, v) = triangle::barycentrics(self.ray, Lane(&self.blas.blocks[block], lane));
        Best { u, v, place: NOWHERE, ..best }
    }

    #[inline(always)]
    fn block<L: Lanes<WIDTH>, F: FnMut(&Hit) -> bool>(
        self,
        ray: &BlockRay,
        index: usize,
        best: &mut Best,
        filter: &mut F,
    ) {
        debug_assert!(index < self.blas.blocks.len());
        // SAFETY: the references in a tree are to blocks of its own structure, as `Blas::build` writes them.
        let block = unsafe { self.blas.blocks.get_unchecked(index) };
        let Some(c) = block_candidates::<L>(self.ray, ray, block, best.t) else { return };
        let mut mask = c.mask;
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize & (WIDTH - 1);
            mask &= mask - 1;
            let (entry, exit) = (c.entry[lane], c.exit[lane]);
            let mut t = triangle::distance(self.ray, Lane(block, lane), entry, exit);
            if c.sure >> lane & 1 == 0 || t.is_none() {
                t = self.closer_look(block, lane, entry, exit);
            }
            if let Some(t) = t {
                let candidate = Best { t, place: place(index, lane), found: true, ..Best::nothing(t) };
                self.offer(block.items[lane], candidate, best, filter);
            }
        }
    }

    #[cold]
    #[inline(never)]
    fn closer_look(self, block: &TriBlock, lane: usize, entry: f32, exit: f32) -> Option<f32> {
        triangle::finish(self.ray, Lane(block, lane), entry, exit).map(|(t, _, _)| t)
    }

    /// Primitives that are no triangles at rest.
    #[inline(always)]
    fn others<F: FnMut(&Hit) -> bool>(self, leaf: MixedLeaf, best: &mut Best, filter: &mut F) {
        for other in &self.blas.others[leaf.first as usize..(leaf.first + leaf.count) as usize] {
            let (entry, exit) = self.ray.slab(&other.bounds);
            if entry <= exit && entry <= best.t {
                *best = self.other(other, (entry, exit), *best, filter);
            }
        }
    }

    #[inline(never)]
    fn other<F: FnMut(&Hit) -> bool>(
        self,
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

    /// Replaces `best` if something better is in the structure.
    #[inline(always)]
    fn run<K: Kernel, const ANY: bool, F: FnMut(&Hit) -> bool>(
        self,
        node: &NodeRay<K::Node>,
        best: &mut Best,
        filter: &mut F,
    ) {
        let block = BlockRay::new(self.ray);
        let at = &mut BlasLeaf::<K, F> { visit: self, block, filter, kernel: PhantomData };
        leaves::<K::Node, ANY>(&self.blas.tree, node, best, at);
        if !ANY {
            *best = self.resolve(*best);
        }
    }
}

/// At the leaves of one structure.
struct BlasLeaf<'a, K: Kernel, F> {
    visit: Visit<'a>,
    block: BlockRay,
    filter: &'a mut F,
    kernel: PhantomData<K>,
}

impl<K: Kernel, F: FnMut(&Hit) -> bool> AtLeaf for BlasLeaf<'_, K, F> {
    #[inline(always)]
    fn visit(&mut self, leaf: ChildRef, best: &mut Best) {
        let mut mixed = MixedLeaf { block: leaf, first: 0, count: 0 };
        if !leaf.is_block() {
            mixed = self.visit.blas.mixed[leaf.index()];
        }
        if mixed.block != ChildRef::EMPTY {
            self.visit.block::<K::Block, F>(&self.block, mixed.block.index(), best, self.filter);
        }
        if mixed.count != 0 {
            self.visit.others(mixed, best, self.filter);
        }
    }
}

/// The nearest hit, or any if `ANY`. `INSTANCES`: there may be some.
#[inline(always)]
pub(super) fn trace<K: Kernel, const ANY: bool, const INSTANCES: bool, F>(
    accel: &Accel,
    ray: &Ray,
    filter: &mut F,
) -> Best
where
    F: FnMut(&Hit) -> bool,
{
    let (o, d) = (ray.origin.0, ray.dir.0);
    let mut best = Best::nothing(ray.t_max);
    if ray.t_max > 0.0
        && let Some(span) = RaySpace::span(o, d, accel.reach)
    {
        let local = RaySpace::with_span(o, d, ray.time, span);
        let node = NodeRay::new(&local);
        let visit = Visit { blas: &accel.world, ray: &local, instance: NO_INSTANCE, entry: 0.0 };
        visit.run::<K, ANY, F>(&node, &mut best, filter);
        if INSTANCES && !(ANY && best.found) {
            let mut at = TopLeaf::<K, ANY, F> { accel, ray, outer: &local, filter, kernel: PhantomData };
            leaves::<K::Node, ANY>(&accel.top, &node, &mut best, &mut at);
        }
    }
    // Taken apart, so that it need not be in memory before.
    let Best { t, instance, item, u, v, place, found } = best;
    Best { t, instance, item, u, v, place, found }
}

/// At the instances.
struct TopLeaf<'a, K: Kernel, const ANY: bool, F> {
    accel: &'a Accel,
    ray: &'a Ray,
    outer: &'a RaySpace,
    filter: &'a mut F,
    kernel: PhantomData<K>,
}

impl<K: Kernel, const ANY: bool, F: FnMut(&Hit) -> bool> AtLeaf for TopLeaf<'_, K, ANY, F> {
    #[inline(always)]
    fn visit(&mut self, leaf: ChildRef, best: &mut Best) {
        let placed = &self.accel.placed[leaf.index()];
        let (entry, exit) = self.outer.slab(&placed.bounds);
        if !(entry <= exit && entry <= best.t) {
            return;
        }
        let blas = &self.accel.objects[placed.object as usize];
        let (o, d) = placed.to_object(self.ray.origin.0, self.ray.dir.0, self.ray.time);
        if let Some(span) = RaySpace::span(o, d, blas.reach) {
            let local = RaySpace::with_span(o, d, self.ray.time, span);
            let visit = Visit { blas, ray: &local, instance: leaf.index() as u32, entry };
            visit.run::<K, ANY, F>(&NodeRay::new(&local), best, self.filter);
        }
    }
}
