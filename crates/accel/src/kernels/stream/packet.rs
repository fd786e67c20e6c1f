//! Rays that go the same way, through one structure together.
//!
//! At a node the children that the whole [`Beam`] may meet are visited, nearest first, as if it were one ray: what single
//! rays would skip is skipped only if all would. At a leaf the beam picks the triangles, and each is tried for all rays at
//! once, by the very operations of a single ray: so the bits are the same.
#![allow(unsafe_code, reason = "unchecked indices; see each SAFETY note")]

use std::marker::PhantomData;

use super::bests::{Bests, Met};
use super::rays::{Beam, RAYS, Rays, Row};
use crate::blas::Blas;
use crate::hit::{Best, Hit, place};
use crate::kernels::boxes::{BlockBeam, NodeRay, cross, meet};
use crate::kernels::lanes::{Kernel, Lanes};
use crate::kernels::traverse::{AtLeaf, Visit, leaves};
use crate::layout::{ChildRef, FILTER_BIT, Lane, MixedLeaf, NODE, Node, TriBlock, WIDTH};
use crate::primitive::triangle;

/// One structure, and the rays as they are in its space.
#[derive(Clone, Copy)]
pub(super) struct Space<'a> {
    pub(super) blas: &'a Blas,
    pub(super) rays: &'a Rays,
    pub(super) instance: u32,
    /// No hit lies before this.
    pub(super) floor: &'a Row,
}

/// A packet on its way.
struct Packet<'a, K, const ANY: bool, F> {
    space: Space<'a>,
    beam: &'a Beam,
    /// The rays that still look for something.
    live: u32,
    bests: &'a mut Bests,
    filter: &'a mut F,
    kernel: PhantomData<K>,
}

/// Replaces the best of the rays in `live` where something better is in the structure.
#[inline(always)]
pub(super) fn run<K: Kernel, const ANY: bool, F: FnMut(usize, &Hit) -> bool>(
    space: Space<'_>,
    beam: &Beam,
    live: u32,
    bests: &mut Bests,
    filter: &mut F,
) {
    let mut all = Best::nothing(bests.farthest::<K::Rays>(live));
    let node = NodeRay::around(beam);
    let at = &mut Packet::<K, ANY, F> { space, beam, live, bests, filter, kernel: PhantomData };
    leaves::<K::Node, ANY>(&space.blas.tree, &node, &mut all, at);
}

impl<K: Kernel, const ANY: bool, F: FnMut(usize, &Hit) -> bool> AtLeaf for Packet<'_, K, ANY, F> {
    #[inline(always)]
    fn visit(&mut self, leaf: ChildRef, all: &mut Best) {
        let mut mixed = MixedLeaf { block: leaf, first: 0, count: 0 };
        if !leaf.is_block() {
            mixed = self.space.blas.mixed[leaf.index()];
        }
        if mixed.block != ChildRef::EMPTY {
            self.block(mixed.block.index(), all.t);
        }
        if mixed.count != 0 {
            self.others(mixed);
        }
        if ANY {
            self.live &= !self.bests.found;
            all.found = self.live == 0;
        }
        all.t = self.bests.farthest::<K::Rays>(self.live);
    }

    #[inline(always)]
    fn sift(&self, mask: u32, node: &Node) -> u32 {
        let kept = sift::<K>(mask, node, (self.space.rays, self.beam), (&self.bests.t, self.live));
        let mut rest = kept;
        while rest != 0 {
            self.space.blas.fetch(node.children[rest.trailing_zeros() as usize & (NODE - 1)]);
            rest &= rest - 1;
        }
        kept
    }
}

/// Of the children in the mask those whose box a ray in `live` meets: between rays that go apart there is much that none of
/// them does.
#[inline(always)]
pub(super) fn sift<K: Kernel>(
    mut mask: u32,
    node: &Node,
    (rays, beam): (&Rays, &Beam),
    (t_max, live): (&Row, u32),
) -> u32 {
    let t_max = K::Rays::load(t_max);
    let mut kept = 0;
    while mask != 0 {
        let child = mask.trailing_zeros() as usize & (NODE - 1);
        mask &= mask - 1;
        let planes = |i: usize, upper: usize| node.planes[i][upper][child];
        let x = axis::<K>(rays, beam, planes, 0);
        let (y, z) = (axis::<K>(rays, beam, planes, 1), axis::<K>(rays, beam, planes, 2));
        kept |= u32::from(meet(x, y, z, t_max).0 & live != 0) << child;
    }
    kept
}

/// Where each ray meets the planes (by axis, lower or upper) of a box. The operations of `RaySpace::slab`.
#[inline(always)]
fn axis<K: Kernel>(
    rays: &Rays,
    beam: &Beam,
    planes: impl Fn(usize, usize) -> f32,
    i: usize,
) -> (K::Rays, K::Rays) {
    let up = (beam.negative >> i & 1) as usize;
    let (near, far) = (splat::<K>(planes(i, up)), splat::<K>(planes(i, 1 - up)));
    let inv = K::Rays::load(&rays.inv[i]);
    let near = near.mul_add(inv, K::Rays::load(&rays.c_near[i]));
    (near, far.mul_add(inv, K::Rays::load(&rays.c_far[i])))
}

impl<K: Kernel, const ANY: bool, F: FnMut(usize, &Hit) -> bool> Packet<'_, K, ANY, F> {
    #[inline(always)]
    fn block(&mut self, index: usize, t_max: f32) {
        debug_assert!(index < self.space.blas.blocks.len());
        // SAFETY: the references in a tree are to blocks of its own structure, as `Blas::build` writes them.
        let block = unsafe { self.space.blas.blocks.get_unchecked(index) };
        let boxes = BlockBeam::of::<K::Block>(block, self.beam);
        let mut triangles = boxes.meet::<K::Block>(self.beam, t_max);
        while triangles != 0 {
            let lane = triangles.trailing_zeros() as usize & (WIDTH - 1);
            triangles &= triangles - 1;
            self.triangle(block, &boxes, index, lane);
        }
    }

    /// One corner, seen along each ray. The operations of `RaySpace::sheared`.
    #[inline(always)]
    fn sheared(&self, block: &TriBlock, corner: usize, lane: usize) -> (K::Rays, K::Rays) {
        let (rays, [kx, ky, kz]) = (self.space.rays, self.beam.k);
        let axes = &block.v[corner];
        let (x, y, z) = (splat::<K>(axes[kx][lane]), splat::<K>(axes[ky][lane]), splat::<K>(axes[kz][lane]));
        let (x, y) = (x.sub(K::Rays::load(&rays.o[kx])), y.sub(K::Rays::load(&rays.o[ky])));
        self.shear(x, y, z.sub(K::Rays::load(&rays.o[kz])))
    }

    /// The same where all rays have one origin.
    #[inline(always)]
    fn sheared_from(&self, boxes: &BlockBeam, corner: usize, lane: usize) -> (K::Rays, K::Rays) {
        let (axes, [kx, ky, kz]) = (&boxes.v[corner], self.beam.k);
        self.shear(splat::<K>(axes[kx][lane]), splat::<K>(axes[ky][lane]), splat::<K>(axes[kz][lane]))
    }

    #[inline(always)]
    fn shear(&self, x: K::Rays, y: K::Rays, z: K::Rays) -> (K::Rays, K::Rays) {
        let [along_x, along_y] = &self.space.rays.shear;
        (z.mul_add(K::Rays::load(along_x), x), z.mul_add(K::Rays::load(along_y), y))
    }

    /// One triangle for all rays. What `block_candidates` and `Visit::block` do for one ray and all triangles.
    #[inline(always)]
    fn triangle(&mut self, block: &TriBlock, boxes: &BlockBeam, index: usize, lane: usize) {
        let (a, b, c) = if self.beam.origin.is_some() {
            let a = self.sheared_from(boxes, 0, lane);
            (a, self.sheared_from(boxes, 1, lane), self.sheared_from(boxes, 2, lane))
        } else {
            (self.sheared(block, 0, lane), self.sheared(block, 1, lane), self.sheared(block, 2, lane))
        };
        let (u, v, w) = (cross(c, b), cross(a, c), cross(b, a));
        let zero = splat::<K>(0.0);
        let (least, most) = (u.min(v).min(w), u.max(v).max(w));
        let mask = (zero.le(least) | most.le(zero)) & self.live;
        if mask == 0 {
            return;
        }
        let planes = |i: usize, upper: usize| boxes.planes[i][upper][lane];
        let (rays, beam) = (self.space.rays, self.beam);
        let x = axis::<K>(rays, beam, planes, 0);
        let (y, z) = (axis::<K>(rays, beam, planes, 1), axis::<K>(rays, beam, planes, 2));
        let (met, entries, exits) = meet(x, y, z, K::Rays::load(&self.bests.t));
        let mut mask = mask & met;
        if mask == 0 {
            return;
        }
        let (mut entry, mut exit, mut t) = ([0.0; RAYS], [0.0; RAYS], [0.0; RAYS]);
        entries.store(&mut entry);
        exits.store(&mut exit);
        let flat = distances(self.space.rays, Lane(block, lane), [&entry, &exit], &mut t);
        let mut unsure = mask & (least.le(zero) & zero.le(most) | flat);
        while unsure != 0 {
            let i = unsure.trailing_zeros() as usize & (RAYS - 1);
            unsure &= unsure - 1;
            match self.space.visit(&self.space.rays.lane(i), i).closer_look(block, lane, entry[i], exit[i]) {
                Some(better) => t[i] = better,
                None => mask &= !(1 << i),
            }
        }
        let (tagged, instance) = (block.items[lane], self.space.instance);
        if tagged & FILTER_BIT == 0 {
            let met = Met { instance, item: tagged, block: index as u32, slot: lane as u32 };
            return self.bests.take(mask, &t, self.space.floor, met);
        }
        while mask != 0 {
            let i = mask.trailing_zeros() as usize & (RAYS - 1);
            mask &= mask - 1;
            let candidate = Best { place: place(index, lane), found: true, ..Best::nothing(t[i]) };
            let (ray, mut best) = (self.space.rays.lane(i), self.bests.get(i));
            let filter = &mut |hit: &Hit| (self.filter)(i, hit);
            self.space.visit(&ray, i).offer(tagged, candidate, &mut best, filter);
            self.bests.set(i, &best);
        }
    }

    /// Primitives that are no triangles at rest, ray by ray.
    #[inline(never)]
    fn others(&mut self, leaf: MixedLeaf) {
        let mut mask = self.live;
        while mask != 0 {
            let i = mask.trailing_zeros() as usize & (RAYS - 1);
            mask &= mask - 1;
            let (ray, mut best) = (self.space.rays.lane(i), self.bests.get(i));
            let filter = &mut |hit: &Hit| (self.filter)(i, hit);
            self.space.visit(&ray, i).others(leaf, &mut best, filter);
            self.bests.set(i, &best);
        }
    }
}

impl Space<'_> {
    /// For one of the rays, which is `ray` in this space.
    #[inline(always)]
    pub(super) fn visit<'r>(&'r self, ray: &'r crate::ray_space::RaySpace, i: usize) -> Visit<'r> {
        Visit { blas: self.blas, ray, instance: self.instance, entry: self.floor[i & (RAYS - 1)] }
    }
}

#[inline(always)]
fn splat<K: Kernel>(x: f32) -> K::Rays {
    K::Rays::splat(x)
}

/// The `t` of each ray on a triangle's plane, in the interval given, and a bit for each ray that runs along the plane. The operations
/// of `triangle::distance`.
#[inline(always)]
fn distances(rays: &Rays, corners: Lane<'_>, [entry, exit]: [&Row; 2], t: &mut Row) -> u32 {
    let ([ax, ay, az], [nx, ny, nz]) = triangle::normal(corners);
    let mut flat = [0_u32; RAYS];
    for i in 0..RAYS {
        let (dx, dy, dz) = (f64::from(rays.d[0][i]), f64::from(rays.d[1][i]), f64::from(rays.d[2][i]));
        let (ox, oy, oz) = (f64::from(rays.o[0][i]), f64::from(rays.o[1][i]), f64::from(rays.o[2][i]));
        let along = nx * dx + ny * dy + nz * dz;
        let height = nx * (ax - ox) + ny * (ay - oy) + nz * (az - oz);
        t[i] = triangle::clamp(height / along, entry[i], exit[i]);
        flat[i] = u32::from(along == 0.0) << i;
    }
    let mut all = 0;
    for bit in flat {
        all |= bit;
    }
    all
}
