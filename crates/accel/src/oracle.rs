//! The definition of a hit, without a tree: every primitive is tried. What all kernels and trees are tested against.

use math::{Bounds, Ray};

use crate::accel::Accel;
use crate::blas::Blas;
use crate::hit::{Best, Hit, NO_INSTANCE, NOWHERE};
use crate::layout::{FILTER_BIT, WIDTH};
use crate::primitive::triangle;
use crate::ray_space::RaySpace;

impl Accel {
    /// [`Accel::intersect`] by trying every primitive: slow, and the definition of the right answer.
    pub fn intersect_by_trying_all(&self, ray: &Ray, filter: &mut dyn FnMut(&Hit) -> bool) -> Option<Hit> {
        let mut best = Best::nothing(if ray.t_max > 0.0 { ray.t_max } else { 0.0 });
        let mut hit = None;
        let mut one = |blas: &Blas, local: &RaySpace, instance: u32, entry: f32| {
            every_candidate(blas, local, &mut |tagged, (t, u, v)| {
                let (item, at) = (tagged & !FILTER_BIT, t.max(entry));
                if !(t > 0.0 && best.loses_to(at, instance, item)) {
                    return;
                }
                let candidate = Best { t: at, instance, item, u, v, place: NOWHERE, found: true };
                let found = blas.hit(&candidate);
                if tagged & FILTER_BIT == 0 || filter(&found) {
                    (best, hit) = (candidate, Some(found));
                }
            });
        };
        let outer = RaySpace::new(ray.origin.0, ray.dir.0, ray.time, self.reach)?;
        one(&self.world, &outer, NO_INSTANCE, 0.0);
        for (placed, i) in self.placed.iter().zip(0..) {
            let (entry, exit) = outer.slab(&placed.bounds);
            let blas = &self.objects[placed.object as usize];
            let (o, d) = placed.to_object(ray.origin.0, ray.dir.0, ray.time);
            if entry <= exit
                && let Some(local) = RaySpace::new(o, d, ray.time, blas.reach)
            {
                one(blas, &local, i, entry);
            }
        }
        hit
    }
}

/// Every primitive that the line meets, as (tagged item, (t, u, v)).
fn every_candidate(blas: &Blas, ray: &RaySpace, offer: &mut dyn FnMut(u32, (f32, f32, f32))) {
    for block in &blas.blocks {
        for lane in (0..WIDTH).filter(|&i| !block.v[0][0][i].is_nan()) {
            let p = block.v.map(|corner| corner.map(|lanes| lanes[lane]));
            let (entry, exit) = ray.slab(&p.iter().fold(Bounds::EMPTY, |b, &q| b.grow(q.into())));
            if entry <= exit
                && let Some(hit) = triangle::finish(ray, &p, entry, exit)
            {
                offer(block.items[lane], hit);
            }
        }
    }
    for other in &blas.others {
        let (entry, exit) = ray.slab(&other.bounds);
        if entry <= exit {
            for root in other.primitive.roots(&blas.curves, ray).into_iter().flatten().filter(|r| r.t > 0.0) {
                offer(other.tagged, (triangle::clamp(root.t, entry, exit), root.u, root.v));
            }
        }
    }
}
