//! Surfaces and lamps for sixteen paths at once, with the bits that single paths get.
//!
//! What is common is worked out in lanes: triangles at rest, matt surfaces, flat lamps. Everything else is asked one by one
//! and put into its lane: so there is no scene that this does not serve.

mod lamps;
mod surface;

pub use lamps::{LightLanes, PlaceLanes};
pub use surface::{Corners, Given, MattSurface, SurfaceLanes};

use accel::{Hit, accept_all};
use math::Ray;

use crate::Scene;

impl Scene {
    /// [`Scene::intersect`] of each ray.
    pub fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        if !self.hit_filter {
            return self.accel.intersect_batch(rays, hits, &mut accept_all);
        }
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = self.intersect(ray);
        }
    }

    /// [`Scene::occluded`] of each ray.
    pub fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool]) {
        if !self.shadow_filter {
            return self.accel.occluded_batch(rays, occluded, &mut accept_all);
        }
        for (ray, occluded) in rays.iter().zip(occluded) {
            *occluded = self.occluded(ray);
        }
    }
}
