//! Many rays in a tree of a few nodes: there nearly every ray meets every node and most blocks, so that nothing is to be gained from going
//! the same way, only from being sixteen. Rays are dealt to classes (signs of the direction, fastest axis), which is all that a
//! packet needs in common.

use math::{Ray, Vec3};

use super::bests::Bests;
use super::rays::{FEWEST, RAYS, Rays};
use super::{Filter, trace};
use crate::accel::Accel;
use crate::hit::Hit;
use crate::kernels::lanes::Kernel;
use crate::kernels::traverse;

/// A tree of so many nodes, with triangles alone in it, is small.
const NODES: usize = 4;
/// With fewer rays than this, classes are too small.
const LEAST: usize = 48;
/// Rays that are dealt at once.
const DEALT: usize = 256;
/// Eight octants for each of three axes, and places that stay empty.
const CLASSES: usize = 32;

/// Is it worth it to deal so many rays to classes?
pub(super) fn pays(accel: &Accel, n: usize) -> bool {
    let world = &accel.world;
    n >= LEAST && world.tree.nodes.len() <= NODES && world.mixed.is_empty() && accel.placed.is_empty()
}

/// See [`super::nearest`].
#[inline(always)]
pub(super) fn nearest<K: Kernel, const INSTANCES: bool>(
    accel: &Accel,
    rays: &[Ray],
    hits: &mut [Option<Hit>],
    filter: Filter<'_>,
) {
    let (mut local, mut bests) = (Rays::NONE, Bests::NOTHING);
    let (mut some, mut found) =
        ([Ray::new(math::Point(Vec3::ZERO), math::Dir(Vec3::ZERO), 0.0); RAYS], [None; RAYS]);
    let mut first = 0;
    for (rays, hits) in rays.chunks(DEALT).zip(hits.chunks_mut(DEALT)) {
        let mut deal = Deal::new(rays);
        while let Some(hand) = deal.next() {
            let n = hand.gather(rays, &mut some);
            let filter = &mut |i: usize, hit: &Hit| filter(first + hand.of(i), hit);
            let mut single = u32::MAX >> (u32::BITS - n as u32);
            if n as u32 >= FEWEST {
                single =
                    trace::<K, false, true, INSTANCES, _>(accel, &some[..n], &mut local, &mut bests, filter);
                bests.write(accel, &mut found[..n]);
            }
            while single != 0 {
                let i = single.trailing_zeros() as usize & (RAYS - 1);
                single &= single - 1;
                let filter = &mut |hit: &Hit| filter(i, hit);
                found[i] = traverse::nearest::<K, INSTANCES, _>(accel, &some[i], filter);
            }
            for (i, hit) in found[..n].iter().enumerate() {
                hits[hand.of(i)] = *hit;
            }
        }
        first += DEALT;
    }
}

/// See [`super::any`].
#[inline(always)]
pub(super) fn any<K: Kernel, const INSTANCES: bool>(
    accel: &Accel,
    rays: &[Ray],
    blocked: &mut [bool],
    filter: Filter<'_>,
) {
    let (mut local, mut bests) = (Rays::NONE, Bests::NOTHING);
    let mut some = [Ray::new(math::Point(Vec3::ZERO), math::Dir(Vec3::ZERO), 0.0); RAYS];
    let mut first = 0;
    for (rays, blocked) in rays.chunks(DEALT).zip(blocked.chunks_mut(DEALT)) {
        let mut deal = Deal::new(rays);
        while let Some(hand) = deal.next() {
            let n = hand.gather(rays, &mut some);
            let filter = &mut |i: usize, hit: &Hit| filter(first + hand.of(i), hit);
            let (mut single, mut found) = (u32::MAX >> (u32::BITS - n as u32), 0);
            if n as u32 >= FEWEST {
                single =
                    trace::<K, true, true, INSTANCES, _>(accel, &some[..n], &mut local, &mut bests, filter);
                found = bests.found;
            }
            while single != 0 {
                let i = single.trailing_zeros() as usize & (RAYS - 1);
                single &= single - 1;
                let filter = &mut |hit: &Hit| filter(i, hit);
                let is_blocked = traverse::any::<K, INSTANCES, _>(accel, &some[i], filter);
                found = found & !(1 << i) | u32::from(is_blocked) << i;
            }
            for i in 0..n {
                blocked[hand.of(i)] = found >> i & 1 != 0;
            }
        }
        first += DEALT;
    }
}

/// Signs of a direction and its fastest axis. (A packet looks again: rays that would not belong go on their own.)
#[inline(always)]
fn class_of(d: Vec3) -> usize {
    let sign = |x: f32| (x.to_bits() >> 31) as usize;
    let (x, y, z) = (d.x.abs(), d.y.abs(), d.z.abs());
    let is_z = z > x.max(y);
    let is_y = !is_z & (y > x);
    sign(d.x) | sign(d.y) << 1 | sign(d.z) << 2 | usize::from(is_y) << 3 | usize::from(is_z) << 4
}

/// Rays in the order of their classes, in hands of one class.
struct Deal {
    order: [u8; DEALT],
    /// Where each class ends.
    ends: [u16; CLASSES],
    class: usize,
    at: usize,
}

/// Up to sixteen rays of one class.
struct Hand {
    rays: [u8; RAYS],
    n: usize,
}

impl Deal {
    #[inline(always)]
    fn new(rays: &[Ray]) -> Self {
        let (mut classes, mut ends) = ([0_u8; DEALT], [0_u16; CLASSES]);
        for (class, ray) in classes.iter_mut().zip(rays) {
            *class = class_of(ray.dir.0) as u8;
            ends[usize::from(*class) & (CLASSES - 1)] += 1;
        }
        let mut before = 0;
        for end in &mut ends {
            (before, *end) = (before + *end, before);
        }
        let mut order = [0; DEALT];
        for (i, class) in classes[..rays.len()].iter().enumerate() {
            let end = &mut ends[usize::from(*class) & (CLASSES - 1)];
            order[usize::from(*end) & (DEALT - 1)] = i as u8;
            *end += 1;
        }
        Self { order, ends, class: 0, at: 0 }
    }

    /// The next hand: those of one class are as even as can be.
    #[inline(always)]
    fn next(&mut self) -> Option<Hand> {
        while self.class < CLASSES && self.at >= usize::from(self.ends[self.class]) {
            self.class += 1;
        }
        if self.class == CLASSES {
            return None;
        }
        let left = usize::from(self.ends[self.class]) - self.at;
        let n = left.div_ceil(left.div_ceil(RAYS));
        let mut hand = Hand { rays: [0; RAYS], n };
        for (to, from) in hand.rays.iter_mut().zip(&self.order[self.at..self.at + n]) {
            *to = *from;
        }
        self.at += n;
        Some(hand)
    }
}

impl Hand {
    /// Which ray is number `i`.
    #[inline(always)]
    fn of(&self, i: usize) -> usize {
        usize::from(self.rays[i & (RAYS - 1)])
    }

    /// Its rays; returns how many there are.
    #[inline(always)]
    fn gather(&self, rays: &[Ray], into: &mut [Ray; RAYS]) -> usize {
        let n = self.n.clamp(1, RAYS);
        for (i, ray) in into.iter_mut().enumerate().take(n) {
            *ray = rays[self.of(i)];
        }
        n
    }
}
