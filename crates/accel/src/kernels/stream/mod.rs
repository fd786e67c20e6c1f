//! Many rays at once: sixteen are made ready together, those that go the same way are traced together, and all their hits
//! are finished together. The bits are those of one ray after the other.

mod bests;
mod packet;
mod rays;
mod top;

use math::Ray;

use super::boxes::NodeRay;
use super::lanes::Kernel;
use super::{Filter, traverse};
use crate::accel::Accel;
use crate::hit::{Hit, NO_INSTANCE};
use bests::Bests;
use packet::Space;
use rays::Rays;

use rays::PACKET;
pub(super) use rays::{Beam, RAYS};

/// Directions of rays close by that go the same way differ by less than this along each axis.
const ALIKE: f32 = 0.1;

/// The nearest hit of each ray. `INSTANCES`: there may be some.
#[inline(always)]
pub(super) fn nearest<K: Kernel, const INSTANCES: bool>(
    accel: &Accel,
    rays: &[Ray],
    hits: &mut [Option<Hit>],
    filter: Filter<'_>,
) {
    let (mut local, mut bests) = (Rays::NONE, Bests::NOTHING);
    let mut first = 0;
    for (rays, hits) in rays.chunks(RAYS).zip(hits.chunks_mut(RAYS)) {
        let mut single = u32::MAX >> (u32::BITS - rays.len() as u32);
        if K::PACKETS && go_the_same_way(rays) {
            let filter = &mut |i: usize, hit: &Hit| filter(first + i, hit);
            single = trace::<K, false, INSTANCES, _>(accel, rays, &mut local, &mut bests, filter);
            bests.write(accel, hits);
        }
        while single != 0 {
            let i = single.trailing_zeros() as usize & (RAYS - 1);
            single &= single - 1;
            let filter = &mut |hit: &Hit| filter(first + i, hit);
            hits[i] = traverse::nearest::<K, INSTANCES, _>(accel, &rays[i], filter);
        }
        first += RAYS;
    }
}

/// Is there any hit, for each ray?
#[inline(always)]
pub(super) fn any<K: Kernel, const INSTANCES: bool>(
    accel: &Accel,
    rays: &[Ray],
    blocked: &mut [bool],
    filter: Filter<'_>,
) {
    let (mut local, mut bests) = (Rays::NONE, Bests::NOTHING);
    let mut first = 0;
    for (rays, blocked) in rays.chunks(RAYS).zip(blocked.chunks_mut(RAYS)) {
        let mut single = u32::MAX >> (u32::BITS - rays.len() as u32);
        if K::PACKETS && go_the_same_way(rays) {
            let filter = &mut |i: usize, hit: &Hit| filter(first + i, hit);
            single = trace::<K, true, INSTANCES, _>(accel, rays, &mut local, &mut bests, filter);
            for (i, is_blocked) in blocked.iter_mut().enumerate() {
                *is_blocked = bests.found >> i & 1 != 0;
            }
        }
        while single != 0 {
            let i = single.trailing_zeros() as usize & (RAYS - 1);
            single &= single - 1;
            let filter = &mut |hit: &Hit| filter(first + i, hit);
            blocked[i] = traverse::any::<K, INSTANCES, _>(accel, &rays[i], filter);
        }
        first += RAYS;
    }
}

/// A guess, before they are made ready, whether there is a packet among the rays: most of a few pairs go the same way.
#[inline(always)]
fn go_the_same_way(rays: &[Ray]) -> bool {
    if (rays.len() as u32) < PACKET {
        return false;
    }
    let (mut pairs, mut alike) = (0, 0);
    let mut i = 2;
    while i < rays.len() {
        let d = (rays[i].dir.0 - rays[i - 2].dir.0).abs();
        alike += u32::from((d.x < ALIKE) & (d.y < ALIKE) & (d.z < ALIKE));
        pairs += 1;
        i += 3;
    }
    2 * alike >= pairs
}

/// Traces rays that go the same way together; returns the others. At most sixteen.
#[inline(always)]
fn trace<K: Kernel, const ANY: bool, const INSTANCES: bool, F>(
    accel: &Accel,
    rays: &[Ray],
    local: &mut Rays,
    bests: &mut Bests,
    filter: &mut F,
) -> u32
where
    F: FnMut(usize, &Hit) -> bool,
{
    local.fill(rays, accel.reach);
    bests.clear(rays);
    let (mut rest, mut others) = (local.valid & bests.ahead(), 0);
    let space = Space { blas: &accel.world, rays: local, instance: NO_INSTANCE, floor: &[0.0; RAYS] };
    while rest != 0 {
        let (class, alike) = local.first_class(rest);
        rest &= !alike;
        let Some(beam) = Beam::around::<K::Rays>(local, alike, class, accel.reach) else {
            others |= alike;
            continue;
        };
        packet::run::<K, ANY, F>(space, &beam, alike, bests, filter);
        if INSTANCES {
            let live = if ANY { alike & !bests.found } else { alike };
            top::run::<K, ANY, F>(accel, local, &beam, live, bests, filter);
        }
    }
    if !ANY {
        bests.resolve(space.blas, space.rays, space.instance);
    }
    others
}

/// Through an object: together where rays go the same way in its space too, else one after the other.
#[inline(always)]
fn object<K: Kernel, const ANY: bool, F: FnMut(usize, &Hit) -> bool>(
    space: Space<'_>,
    live: u32,
    bests: &mut Bests,
    filter: &mut F,
) {
    let (mut rest, mut others) = (live, 0);
    while rest != 0 {
        let (class, alike) = space.rays.first_class(rest);
        rest &= !alike;
        match Beam::around::<K::Rays>(space.rays, alike, class, space.blas.reach) {
            Some(beam) => packet::run::<K, ANY, F>(space, &beam, alike, bests, filter),
            None => others |= alike,
        }
    }
    while others != 0 {
        let i = others.trailing_zeros() as usize & (RAYS - 1);
        others &= others - 1;
        let (ray, mut best) = (space.rays.lane(i), bests.get(i));
        let filter = &mut |hit: &Hit| filter(i, hit);
        space.visit(&ray, i).run::<K, ANY, _>(&NodeRay::new(&ray), &mut best, filter);
        bests.set(i, &best);
    }
    if !ANY {
        bests.resolve(space.blas, space.rays, space.instance);
    }
}
