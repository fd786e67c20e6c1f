//! Surfaces and lamps for sixteen paths at once, with the bits that single paths get.
//!
//! What is common is worked out in lanes: triangles at rest, matt surfaces, flat lamps. Everything else is asked one by one
//! and put into its lane: so there is no scene that this does not serve.

mod lamps;
mod surface;

pub use lamps::{LightLanes, PlaceLanes};
pub use surface::{Corners, Given, MattSurface, SurfaceLanes};

use accel::{Hit, accept_all_of};
use math::Ray;

use crate::Scene;

impl Scene {
    /// [`Scene::intersect`] of each ray.
    pub fn intersect_many(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        if !self.hit_filter {
            return self.accel.intersect_many(rays, hits, &mut accept_all_of);
        }
        self.accel.intersect_many(rays, hits, &mut |i, hit| self.is_there(&rays[i], hit));
    }

    /// [`Scene::occluded`] of each ray.
    pub fn occluded_many(&self, rays: &[Ray], occluded: &mut [bool]) {
        if !self.shadow_filter {
            return self.accel.occluded_many(rays, occluded, &mut accept_all_of);
        }
        self.accel.occluded_many(rays, occluded, &mut |i, hit| self.blocks(&rays[i], hit));
    }
}
