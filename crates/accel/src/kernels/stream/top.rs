//! Sixteen rays among the instances.

use std::marker::PhantomData;

use super::bests::Bests;
use super::object;
use super::packet::{Space, sift};
use super::rays::{Beam, Rays};
use crate::accel::Accel;
use crate::hit::{Best, Hit};
use crate::kernels::boxes::NodeRay;
use crate::kernels::lanes::Kernel;
use crate::kernels::traverse::{AtLeaf, leaves};
use crate::layout::{ChildRef, Node};

/// Replaces the best of the rays in `live`, which the beam is around, where something better is in an instance.
#[inline(always)]
pub(super) fn run<K: Kernel, const ANY: bool, F: FnMut(usize, &Hit) -> bool>(
    accel: &Accel,
    local: &Rays,
    beam: &Beam,
    live: u32,
    bests: &mut Bests,
    filter: &mut F,
) {
    if live == 0 {
        return;
    }
    let mut all = Best::nothing(bests.farthest::<K::Rays>(live));
    let node = NodeRay::around(beam);
    let at = &mut Packet::<K, ANY, F> { accel, local, beam, live, bests, filter, kernel: PhantomData };
    leaves::<K::Node, ANY>(&accel.top, &node, &mut all, at);
}

/// A packet on its way.
struct Packet<'a, K, const ANY: bool, F> {
    accel: &'a Accel,
    /// In the world's space.
    local: &'a Rays,
    beam: &'a Beam,
    /// The rays that still look for something.
    live: u32,
    bests: &'a mut Bests,
    filter: &'a mut F,
    kernel: PhantomData<K>,
}

impl<K: Kernel, const ANY: bool, F: FnMut(usize, &Hit) -> bool> AtLeaf for Packet<'_, K, ANY, F> {
    #[inline(always)]
    fn visit(&mut self, leaf: ChildRef, all: &mut Best) {
        let placed = &self.accel.placed[leaf.index()];
        let (entry, met) = self.local.slab(&placed.bounds, &self.bests.t);
        let live = met & self.live;
        if live == 0 {
            return;
        }
        let blas = &self.accel.objects[placed.object as usize];
        let mut rays = Rays::NONE;
        placed.each_to_object(
            (&self.local.o, &self.local.given, &self.local.time),
            (&mut rays.o, &mut rays.given),
        );
        rays.time = self.local.time;
        rays.prepare(blas.reach);
        let space = Space { blas, rays: &rays, instance: leaf.index() as u32, floor: &entry };
        object::<K, ANY, F>(space, live & rays.valid, self.bests, self.filter);
        if ANY {
            self.live &= !self.bests.found;
            all.found = self.live == 0;
        }
        all.t = self.bests.farthest::<K::Rays>(self.live);
    }

    #[inline(always)]
    fn sift(&self, mask: u32, node: &Node) -> u32 {
        sift::<K>(mask, node, (self.local, self.beam), (&self.bests.t, self.live))
    }
}
