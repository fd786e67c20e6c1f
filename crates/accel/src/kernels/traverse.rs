//! Traversal of the wide tree, generic over the lanes.
//!
//! Nearest hit: children are visited by entry distance; the stack holds 64-bit keys with the distance (never negative,
//! so its bits are ordered) in the upper half. Any hit: in the order of the slots, biggest box first.
#![allow(unsafe_code, reason = "unchecked indices; see each SAFETY note")]

use std::marker::PhantomData;
use std::mem::MaybeUninit;

use math::Ray;

use super::boxes::{BlockRay, NodeRay, block_candidates};
use super::lanes::{Kernel, Lanes};
use super::stack::{Stack, biggest_first, nearest_first};
use crate::accel::Accel;
use crate::blas::{Blas, Other};
use crate::hit::{Best, Hit, NO_INSTANCE, NOWHERE, place};
use crate::layout::{ChildRef, FILTER_BIT, Lane, MixedLeaf, NODE, Node, TriBlock, WIDTH, WideTree};
use crate::primitive::{Root, triangle};
use crate::ray_space::RaySpace;

/// What is done at a leaf. Its method must be `inline(always)`, see above.
pub(super) trait AtLeaf {
    fn visit(&mut self, leaf: ChildRef, best: &mut Best);

    /// Of the children in the mask, those worth visiting.
    #[inline(always)]
    fn sift(&self, mask: u32, _: &Node) -> u32 {
        mask
    }
}

/// Visits the leaves that the ray meets, until the tree is exhausted or (`ANY`) something is found.
#[inline(always)]
pub(super) fn leaves<L: Lanes<NODE>, const ANY: bool>(
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
            let mask = at.sift(mask, node);
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
pub(super) struct Visit<'a> {
    pub(super) blas: &'a Blas,
    pub(super) ray: &'a RaySpace,
    pub(super) instance: u32,
    /// No hit lies before this.
    pub(super) entry: f32,
}

impl Visit<'_> {
    /// Takes the candidate if it is better and the filter agrees.
    #[inline(always)]
    pub(super) fn offer<F: FnMut(&Hit) -> bool>(
        self,
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
        if tagged & FILTER_BIT == 0 {
            *best = candidate;
        } else if let Some(passed) = self.pass(candidate, filter) {
            *best = passed;
        }
    }

    /// The candidate with `u` and `v` filled in, if the filter lets it through.
    #[inline(never)]
    fn pass<F: FnMut(&Hit) -> bool>(self, candidate: Best, filter: &mut F) -> Option<Best> {
        let candidate = self.resolve(candidate);
        filter(&self.blas.hit(&candidate)).then_some(candidate)
    }

    /// With `u` and `v` filled in, if it is in this structure.
    #[inline(always)]
    pub(super) fn resolve(&self, best: Best) -> Best {
        if best.place == NOWHERE || best.instance != self.instance {
            return best;
        }
        let (block, lane) = ((best.place >> 3) as usize, (best.place & 7) as usize);
        let (u, v) = triangle::barycentrics(self.ray, Lane(&self.blas.blocks[block], lane));
        Best { u, v, place: NOWHERE, ..best }
    }

    #[inline(always)]
    fn block<L: Lanes<WIDTH>, F: FnMut(&Hit) -> bool>(
        &self,
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
    pub(super) fn closer_look(self, block: &TriBlock, lane: usize, entry: f32, exit: f32) -> Option<f32> {
        triangle::finish(self.ray, Lane(block, lane), entry, exit).map(|(t, _, _)| t)
    }

    /// Primitives that are no triangles at rest.
    #[inline(always)]
    pub(super) fn others<F: FnMut(&Hit) -> bool>(self, leaf: MixedLeaf, best: &mut Best, filter: &mut F) {
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

    /// Replaces `best` if something better is in the structure; a triangle's `u` and `v` are left to [`Visit::resolve`].
    #[inline(always)]
    pub(super) fn run<K: Kernel, const ANY: bool, F: FnMut(&Hit) -> bool>(
        &self,
        node: &NodeRay<K::Node>,
        best: &mut Best,
        filter: &mut F,
    ) {
        let block = BlockRay::new(self.ray);
        let at = &mut BlasLeaf::<K, F> { visit: self, block, filter, kernel: PhantomData };
        leaves::<K::Node, ANY>(&self.blas.tree, node, best, at);
    }
}

/// At the leaves of one structure.
pub(super) struct BlasLeaf<'a, K: Kernel, F> {
    pub(super) visit: &'a Visit<'a>,
    pub(super) block: BlockRay,
    pub(super) filter: &'a mut F,
    pub(super) kernel: PhantomData<K>,
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

/// The nearest hit. `INSTANCES`: there may be some.
#[inline(always)]
pub(super) fn nearest<K: Kernel, const INSTANCES: bool, F>(
    accel: &Accel,
    ray: &Ray,
    filter: &mut F,
) -> Option<Hit>
where
    F: FnMut(&Hit) -> bool,
{
    let best = trace::<K, false, INSTANCES, F>(accel, ray, filter);
    best.found.then(|| accel.hit(&best))
}

/// Is there any hit?
#[inline(always)]
pub(super) fn any<K: Kernel, const INSTANCES: bool, F>(accel: &Accel, ray: &Ray, filter: &mut F) -> bool
where
    F: FnMut(&Hit) -> bool,
{
    trace::<K, true, INSTANCES, F>(accel, ray, filter).found
}

#[inline(always)]
fn trace<K: Kernel, const ANY: bool, const INSTANCES: bool, F>(
    accel: &Accel,
    ray: &Ray,
    filter: &mut F,
) -> Best
where
    F: FnMut(&Hit) -> bool,
{
    let mut best = Best::nothing(ray.t_max);
    let local = RaySpace::unchecked(ray.origin.0, ray.dir.0, ray.time, accel.reach);
    if local.valid && ray.t_max > 0.0 {
        let node = NodeRay::new(&local);
        let visit = Visit { blas: &accel.world, ray: &local, instance: NO_INSTANCE, entry: 0.0 };
        visit.run::<K, ANY, F>(&node, &mut best, filter);
        if !ANY {
            best = visit.resolve(best);
        }
        if INSTANCES && !(ANY && best.found) {
            let mut at = TopLeaf::<K, ANY, F> { accel, ray, outer: &local, filter, kernel: PhantomData };
            leaves::<K::Node, ANY>(&accel.top, &node, &mut best, &mut at);
        }
    }
    best
}

/// At the instances.
pub(super) struct TopLeaf<'a, K: Kernel, const ANY: bool, F> {
    pub(super) accel: &'a Accel,
    pub(super) ray: &'a Ray,
    pub(super) outer: &'a RaySpace,
    pub(super) filter: &'a mut F,
    pub(super) kernel: PhantomData<K>,
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
        let local = RaySpace::unchecked(o, d, self.ray.time, blas.reach);
        if local.valid {
            let visit = Visit { blas, ray: &local, instance: leaf.index() as u32, entry };
            visit.run::<K, ANY, F>(&NodeRay::new(&local), best, self.filter);
            if !ANY {
                *best = visit.resolve(*best);
            }
        }
    }
}
