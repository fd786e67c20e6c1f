//! What is done one by one: light that paths find, and steps at surfaces that are not for lanes.

use math::lanes::LANES;
use scatter::Bsdf;
use scene::SurfaceInteraction;
use scene::wide::MattSurface;

use super::super::state::Record;
use super::{Groups, Step};
use crate::common::Gathered;
use crate::path::Path;
use crate::walker::{Previous, Walker};

impl Groups<'_, '_> {
    /// What is done one by one in a group: light that paths found, and steps that are none for lanes. Gives the lanes of matt
    /// surfaces, which are now among the corners.
    #[inline(never)]
    pub(super) fn look(&mut self, at: usize) -> u32 {
        self.corners.clear();
        let mut lanes = 0;
        for lane in 0..LANES.min(self.paths.len() - at) {
            if self.look_at(at + lane, lane) {
                lanes |= 1 << lane;
            }
        }
        lanes
    }

    #[inline]
    fn look_at(&mut self, i: usize, lane: usize) -> bool {
        let scene = self.step.scene;
        let Some(hit) = self.paths.hits[i] else {
            if !scene.lights.infinite().is_empty() {
                let record = self.paths.record(i);
                self.step.alone(&record, |path, walk| walk.add(path.sky(walk)));
            }
            return false;
        };
        let shape = scene.shape_at(&hit);
        let kind = scene.is_matt(&hit, shape);
        if kind == MattSurface::No {
            self.go_alone(i);
            return false;
        }
        let mut found: Option<SurfaceInteraction> = None;
        if shape.is_lamp() || kind == MattSurface::OneByOne {
            let si = scene.interaction(&self.paths.rays[i], &hit);
            if shape.is_lamp() {
                let record = self.paths.record(i);
                self.step.alone(&record, |path, walk| walk.add(path.emission(walk, &si)));
            }
            found = Some(si);
        }
        if self.paths.depth(i) >= self.step.path.max_depth {
            return false;
        }
        match (kind, found) {
            (MattSurface::OneByOne, Some(si)) => {
                let around = scene.camera_surroundings();
                let Some(shading) = scene.shade(&si, &around, &mut self.step.wl) else { return false };
                let Bsdf::Diffuse(matt) = &shading.bsdf else { return false };
                self.corners.give(&si, &shading, matt.reflectance(), lane);
                true
            }
            (MattSurface::InLanes | MattSurface::OneByOne | MattSurface::No, _) => {
                scene.put_corners(&hit, shape, lane, &mut self.corners)
            }
        }
    }

    /// A path that meets a surface which is not matt takes the step, and passes what is no surface, alone.
    #[inline(never)]
    fn go_alone(&mut self, i: usize) {
        let (record, mut hit) = (self.paths.record(i), self.paths.hits[i]);
        let (goes_on, record) = self.step.alone(&record, |path, walk| {
            while path.arrive(walk, hit) {
                // Where it began to pass borders does not belong to what is kept.
                if walk.from == walk.ray.origin {
                    return true;
                }
                walk.counters.rays += 1;
                hit = walk.scene.intersect(&walk.ray);
            }
            false
        });
        if goes_on {
            self.alone.push(record);
        }
    }
}

impl Step<'_> {
    /// The walk of a path that goes alone for a while, with what is done there.
    fn alone<T>(&mut self, record: &Record, walk: impl FnOnce(&Path, &mut Walker<'_>) -> T) -> (T, Record) {
        self.sampler.resume(record.state);
        let mut walker = Walker::new(self.scene, (record.ray, &mut self.wl), self.sampler, self.counters);
        walker.depth = record.depth;
        walker.steps = record.depth;
        walker.throughput = record.throughput;
        walker.carried = record.throughput;
        walker.eta_scale = record.eta_scale;
        walker.previous = Previous { rival: record.rival, flight: None };
        walker.radiance = Gathered::of(self.radiance[record.slot as usize]);
        let out = walk(self.path, &mut walker);

        let radiance = walker.radiance();
        let (ray, throughput, rival) = (walker.ray, walker.throughput, walker.previous.rival);
        let (eta_scale, depth) = (walker.eta_scale, walker.depth);
        self.radiance[record.slot as usize] = radiance;
        let state = self.sampler.path_state().unwrap_or(record.state);
        (out, Record { ray, state, throughput, rival, eta_scale, depth, slot: record.slot })
    }
}
