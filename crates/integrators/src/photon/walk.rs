//! Walks from the eye that gather photons.
//!
//! A walk goes on over deltas and over rough surfaces without a diffuse lobe; it gathers at the first surface that has
//! one, or where a medium scatters, which is like a diffuse surface at which no rays are sent. Scattering under the
//! surface of a subsurface material is like a delta. Every path from a light to the eye is found in one way only, by its scattering events as seen from the eye:
//!
//! | events                                        | how it is found                                      |
//! |-----------------------------------------------|------------------------------------------------------|
//! | deltas alone                                  | the walk meets the emitter                           |
//! | …, rough or diffuse                           | light sample at the last, weighted against the walk  |
//! | …, rough or diffuse, deltas                   | caustic photons at the last that is no delta         |
//! | deltas and rough, diffuse, some that are no deltas, … | photons at the first diffuse, or final gathering |
//!
//! (With the raw density estimate, photons at the first diffuse surface stand for all that arrives there.)

use std::collections::BinaryHeap;

use math::Ray;
use sampling::Sampler;
use sampling::mis::Heuristic;
use scatter::{LobeFlags, TransportMode};
use scene::{MediumId, Scene};
use spectrum::{Spectrum, Wavelengths};

use super::state::{Before, State};
use crate::Counters;
use crate::common::{
    CameraEstimator, CameraPath, DirectLight, DirectionSample, DirectionSampling, Estimate, Gathered, Kernel,
    LightStrategy, MediumPoint, Near, PathOutput, PhotonMap, Radius, Roulette, Search, Shared, Site, Tools,
    Vertex, direct_in_medium, infinite_light_pdf, light_pdf,
};

/// What a walk does at the first diffuse surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AtDiffuse {
    /// All photons, light that comes straight from lamps included: the raw density estimate.
    Raw,
    /// Photons that were scattered before; lamps by light samples.
    Photons,
    /// Rays, which gather where they end; caustics by photons, lamps by light samples.
    Rays(u32),
}

/// The estimator: what it gathers from, and how.
pub(crate) struct GatherWalk {
    pub(crate) max_depth: u32,
    pub(crate) roulette: Roulette,
    pub(crate) at_diffuse: AtDiffuse,
    pub(crate) kernel: Kernel,
    pub(crate) radius: Radius,
    /// So many photons at the most; zero: all within the radius.
    pub(crate) nearest: usize,
    /// Of this pass.
    pub(crate) shared: Shared,
    pub(crate) global: PhotonMap,
    /// Caustic photons alone; `None`: they are those of the global map.
    pub(crate) caustic: Option<PhotonMap>,
}

/// What a walk writes to.
struct Output<'a> {
    sum: Gathered,
    wl: &'a mut Wavelengths,
    sampler: &'a mut Sampler,
    counters: &'a mut Counters,
    found: BinaryHeap<Near>,
}

const STRATEGY: LightStrategy = LightStrategy::Mis(Heuristic::Power);

impl CameraEstimator for GatherWalk {
    fn shared(&self) -> Option<Shared> {
        Some(self.shared)
    }

    fn radiance(
        &self,
        scene: &Scene,
        path: &mut CameraPath,
        sampler: &mut Sampler,
        out: &mut PathOutput<'_>,
    ) -> Spectrum {
        let mut output = Output {
            sum: Gathered::default(),
            wl: &mut path.wl,
            sampler,
            counters: &mut *out.counters,
            found: BinaryHeap::with_capacity(self.nearest),
        };
        let state = State {
            ray: path.ray,
            from: path.ray.origin,
            around: scene.camera_surroundings(),
            throughput: Spectrum::ONE,
            eta_scale: 1.0,
            depth: 0,
            steps: 0,
            before: Before::Deltas,
            is_gathering: false,
        };
        self.walk(scene, state, &mut output);
        let sum = output.sum;
        sum.radiance(&path.wl)
    }
}

impl GatherWalk {
    fn walk(&self, scene: &Scene, mut on: State, out: &mut Output<'_>) {
        loop {
            out.counters.rays += 1;
            let hit = scene.intersect(&on.ray);
            if let Some(medium) = on.around.medium() {
                match self.fly(scene, medium, hit.map_or(f32::INFINITY, |h| h.t), &mut on, out) {
                    Flown::Through => {}
                    Flown::Under => continue,
                    Flown::End => return,
                }
            }
            let Some(hit) = hit else {
                for &light in scene.lights.infinite() {
                    let le = scene.lights.infinite_emitted(light, on.from, on.ray.dir, out.wl);
                    let weight = on.before.weight(|from| infinite_light_pdf(scene, from, light, on.ray.dir));
                    out.sum.add(on.throughput * le * weight, false);
                }
                return;
            };
            let si = scene.interaction(&on.ray, &hit);
            if let (Some(light), Some(le)) = (si.light, scene.emitted(&si, si.wo, out.wl)) {
                let weight = on.before.weight(|from| light_pdf(scene, from, light, &si));
                out.sum.add(on.throughput * le * weight, false);
            }
            let Some(shading) = scene.shade(&si, &on.around, out.wl) else {
                // A border of media is no scattering event.
                on.around = scene.surroundings_after(&si, on.ray.dir, &on.around);
                on.ray = si.spawn_ray(on.ray.dir);
                continue;
            };
            if on.depth >= self.max_depth {
                return;
            }
            let vertex = on.vertex(Site::Surface { si, shading });
            if !self.scatter(scene, &vertex, &mut on, out) {
                return;
            }
        }
    }

    /// Through a medium up to the distance `end`. Where it scatters, the walk collects what arrives and ends.
    fn fly(&self, scene: &Scene, medium: MediumId, end: f32, on: &mut State, out: &mut Output<'_>) -> Flown {
        let ray = Ray { t_max: end, ..on.ray };
        let (media, sampler) = (&scene.media, &mut *out.sampler);
        let is_interior = media.is_interior(medium);
        let flight = match on.depth >= self.max_depth && !is_interior {
            true => media.pass(medium, &ray, out.wl, &mut || sampler.next_1d()),
            false => media.fly(medium, &ray, on.throughput, out.wl, &mut || sampler.next_1d()),
        };
        on.throughput *= flight.factor;
        if on.throughput.is_black() {
            return Flown::End;
        }
        let Some(t) = flight.scatters_at else { return Flown::Through };
        let point = MediumPoint::new(scene, &ray, t, medium);
        if is_interior {
            return self.scatter_under_surface(&point, on, out);
        }

        // Light of lamps, then photons: all, or those that were scattered.
        let gathers_all = on.is_gathering || self.at_diffuse == AtDiffuse::Raw;
        if !gathers_all {
            let mut tools = Tools { sampler: out.sampler, wl: out.wl, counters: out.counters };
            let direct = direct_in_medium(scene, (&point, &on.around), (STRATEGY, |_| 0.0), &mut tools);
            out.sum.add(on.throughput * direct, false);
        }
        let vertex = on.vertex(Site::Medium(point));
        self.gather(scene, &vertex, on, (false, !gathers_all), out);
        if !gathers_all {
            let s = point.phase.sample(point.wo, out.sampler.next_2d());
            let before = Before::Rival(point.light_context(), s.pdf, [1, 1]);
            // A walk that may not scatter.
            let ray = point.spawn_ray(s.wi);
            let look = State { ray, from: ray.origin, depth: self.max_depth, before, ..*on };
            self.walk(scene, look, out);
        }
        Flown::End
    }

    /// The way on under a surface.
    fn scatter_under_surface(&self, point: &MediumPoint, on: &mut State, out: &mut Output<'_>) -> Flown {
        let s = point.phase.sample(point.wo, out.sampler.next_2d());
        on.ray = point.spawn_ray(s.wi);
        on.from = on.ray.origin;
        on.before = on.before.after_delta();
        on.steps += 1;
        let depth = Roulette::depth_in_medium(on.steps);
        match self.roulette.survive(depth, on.throughput, on.eta_scale, out.sampler) {
            Some(paid) => on.throughput *= paid,
            None => return Flown::End,
        }
        Flown::Under
    }

    /// Collects what arrives at a surface and goes on; false if the walk ends.
    fn scatter(&self, scene: &Scene, vertex: &Vertex, on: &mut State, out: &mut Output<'_>) -> bool {
        let Site::Surface { si, shading } = &vertex.site else { return false };
        let flags = shading.bsdf.flags();
        let is_diffuse = flags.intersects(LobeFlags::DIFFUSE);
        let is_smooth = vertex.is_connectible();
        let gathers_all = is_diffuse && (on.is_gathering || self.at_diffuse == AtDiffuse::Raw);
        let n_rays = match self.at_diffuse {
            AtDiffuse::Rays(n) if is_diffuse && !on.is_gathering => n,
            AtDiffuse::Rays(_) | AtDiffuse::Photons | AtDiffuse::Raw => 0,
        };

        // Light of lamps, then photons: all, those that were scattered, or those of caustics.
        let counts = [1, n_rays.max(1)];
        if is_smooth && !gathers_all {
            let here = DirectLight {
                scene,
                si,
                shading,
                around: on.around,
                directions: DirectionSampling::Bsdf,
                guide: None,
                counts,
            };
            let direct = here.sample(STRATEGY, out.sampler, out.wl, out.counters);
            out.sum.add(on.throughput * direct, false);
        }
        if is_smooth {
            let only_caustics = !is_diffuse || n_rays > 0;
            self.gather(scene, vertex, on, (only_caustics, !gathers_all), out);
        }
        for _ in 0..n_rays {
            self.gather_by_ray(scene, vertex, on, counts, out);
        }

        // Go on. A diffuse surface ends the walk, but for its delta lobes and a look for the lamp.
        let wo = shading.frame.to_local(si.wo);
        let sampler = &mut *out.sampler;
        let Some(s) = DirectionSampling::Bsdf.sample(&shading.bsdf, wo, sampler, TransportMode::Radiance)
        else {
            return false;
        };
        if s.pdf.is_some() && is_diffuse {
            if !gathers_all && n_rays == 0 {
                self.look_for_lamp(scene, vertex, on, &s, out);
            }
            return false;
        }
        on.follow(scene, vertex, &s, counts);
        match self.roulette.survive(on.depth, on.throughput, on.eta_scale, out.sampler) {
            Some(paid) => on.throughput *= paid,
            None => return false,
        }
        true
    }

    /// Photons at a vertex: `only_caustics`, or `only_scattered` before, or all.
    fn gather(
        &self,
        scene: &Scene,
        vertex: &Vertex,
        on: &State,
        (only_caustics, only_scattered): (bool, bool),
        out: &mut Output<'_>,
    ) {
        let radius = self.radius.at(scene, vertex);
        let map = self.caustic.as_ref().filter(|_| only_caustics).unwrap_or(&self.global);
        let search = match self.nearest {
            0 => Search::Radius(radius),
            k => Search::Nearest(k, radius),
        };
        // One event here, so many before and after.
        let left = self.max_depth.saturating_sub(on.depth).saturating_sub(1);
        let estimate = Estimate { map, kernel: self.kernel, search };
        let sum = estimate.radiance(vertex, &mut out.found, |photon| {
            let is_wanted = match (only_caustics, only_scattered) {
                (true, _) => photon.is_caustic(),
                (false, true) => photon.depth() > 0,
                (false, false) => true,
            };
            is_wanted && photon.depth() <= left
        });
        out.sum.add_scaled(&sum, on.throughput);
    }

    /// One ray of final gathering.
    fn gather_by_ray(
        &self,
        scene: &Scene,
        vertex: &Vertex,
        on: &State,
        counts: [u32; 2],
        out: &mut Output<'_>,
    ) {
        let Site::Surface { si, shading } = &vertex.site else { return };
        let wo = shading.frame.to_local(si.wo);
        let sampler = &mut *out.sampler;
        let s = DirectionSampling::Bsdf.sample(&shading.bsdf, wo, sampler, TransportMode::Radiance);
        // Deltas are followed by the walk itself.
        let Some(s) = s.filter(|s| s.pdf.is_some()) else { return };
        let mut ray = State { is_gathering: true, ..*on };
        ray.follow(scene, vertex, &s, counts);
        ray.throughput *= 1.0 / counts[1] as f32;
        self.walk(scene, ray, out);
    }

    /// Does the direction that was drawn find a lamp, which the light sample shares with it?
    fn look_for_lamp(
        &self,
        scene: &Scene,
        vertex: &Vertex,
        on: &State,
        s: &DirectionSample,
        out: &mut Output<'_>,
    ) {
        let mut look = State { ..*on };
        look.follow(scene, vertex, s, [1, 1]);
        // A walk that may not scatter.
        look.depth = self.max_depth;
        self.walk(scene, look, out);
    }
}

/// How a way through a medium ends.
enum Flown {
    /// At the next surface, or nowhere.
    Through,
    /// It scattered under a surface and goes on.
    Under,
    /// The walk is done.
    End,
}
