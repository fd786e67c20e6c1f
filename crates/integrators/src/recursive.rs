//! Recursive (distribution) ray tracing [Whitted1980; Cook1984]: at every hit several rays branch off, and each of
//! them again. Lens, time and pixel are distributed over camera samples.
//!
//! With `shadow_rays`, light straight from emitters comes from a light sample, and a ray that hits an emitter during
//! the recursion does not add its emission, so nothing counts twice; after a delta event, where no light sample is
//! possible, it does. What the emitter's surface reflects is traced either way.
//!
//! Cost grows with the product of the branchings: for equal rays `path` spends more of them near the eye. Cannot find
//! what `path` cannot find; without shadow rays delta lights contribute nothing.

use sampling::Sampler;
use scatter::{LobeFlags, TransportMode};
use scene::{Scene, SurfaceInteraction, Surroundings};
use spectrum::{Spectrum, Wavelengths};

use crate::common::{
    CameraEstimator, CameraPath, DirectLight, DirectionSampling, LightStrategy, PathOutput, PixelLoop,
    Roulette, sampler_of,
};
use crate::parameters::{ParameterInfo, ParameterKind, Parameters, shared};
use crate::registry::{IntegratorInfo, Making, refuses_media};
use crate::{Counters, Integrator};

/// For the registry.
pub(crate) const INFO: IntegratorInfo = IntegratorInfo {
    name: "recursive",
    purpose: "distribution ray tracing: several rays at every hit, as the theory begins",
    misses: "what path misses; and its cost explodes with depth unless the branching is 1",
    unbiased: true,
    refuses: refuses_media,
    parameters,
    make,
};

fn parameters() -> Vec<ParameterInfo> {
    vec![
        ParameterInfo {
            name: "branching",
            kind: ParameterKind::Counts("4,2,1"),
            doc: "rays per hit: one number, or one per depth (the last goes on)",
        },
        ParameterInfo {
            name: "sampling",
            kind: ParameterKind::Choice(DirectionSampling::NAMES),
            doc: "density of the rays (delta lobes always by the BSDF)",
        },
        shared::MAX_DEPTH,
        ParameterInfo {
            name: "rr_depth",
            kind: ParameterKind::Integer(8),
            doc: "scattering events before Russian roulette may end a path",
        },
        ParameterInfo {
            name: "shadow_rays",
            kind: ParameterKind::Bool(true),
            doc: "one light sample at every hit",
        },
    ]
}

fn make(p: &Parameters, making: &Making<'_>) -> Box<dyn Integrator> {
    let estimator = Recursive {
        branching: p.counts("branching"),
        directions: DirectionSampling::from_name(p.text("sampling")),
        max_depth: p.limit("max_depth"),
        roulette: Roulette::from(p.integer("rr_depth")),
        shadow_rays: p.bool("shadow_rays"),
    };
    Box::new(PixelLoop { estimator, sampler: sampler_of(making.sampler, making.seed) })
}

struct Recursive {
    branching: Vec<u32>,
    directions: DirectionSampling,
    max_depth: u32,
    roulette: Roulette,
    shadow_rays: bool,
}

/// What one recursion needs besides its place.
struct Walk<'a> {
    scene: &'a Scene,
    sampler: &'a mut Sampler,
    counters: &'a mut Counters,
}

/// How a ray came about.
#[derive(Clone, Copy)]
struct Arrival {
    /// Scattering events so far.
    depth: u32,
    /// Does emission at its end count?
    sees_emitters: bool,
    /// What it is in.
    around: Surroundings,
    /// What the path carries, for roulette alone.
    throughput: Spectrum,
    eta_scale: f32,
}

impl CameraEstimator for Recursive {
    fn radiance(
        &self,
        scene: &Scene,
        path: &mut CameraPath,
        sampler: &mut Sampler,
        out: &mut PathOutput<'_>,
    ) -> Spectrum {
        let mut walk = Walk { scene, sampler, counters: out.counters };
        let arrival = Arrival {
            depth: 0,
            sees_emitters: true,
            around: scene.camera_surroundings(),
            throughput: Spectrum::ONE,
            eta_scale: 1.0,
        };
        self.incoming(&mut walk, path.ray, arrival, &mut path.wl)
    }
}

impl Recursive {
    /// Radiance that arrives along a ray.
    fn incoming(
        &self,
        walk: &mut Walk<'_>,
        mut ray: math::Ray,
        mut a: Arrival,
        wl: &mut Wavelengths,
    ) -> Spectrum {
        let mut radiance = Spectrum::ZERO;
        let from = ray.origin;
        loop {
            walk.counters.rays += 1;
            let Some(hit) = walk.scene.intersect(&ray) else {
                let sky = |l: &_| walk.scene.lights.infinite_emitted(*l, from, ray.dir, wl);
                let seen: Spectrum = walk.scene.lights.infinite().iter().map(sky).sum();
                return if a.sees_emitters { radiance + seen } else { radiance };
            };
            let si = walk.scene.interaction(&ray, &hit);
            if a.sees_emitters {
                radiance += walk.scene.emitted(&si, si.wo, wl).unwrap_or_default();
            }
            if !walk.scene.is_interface(&si, &a.around) {
                return radiance + self.reflected(walk, &si, a, wl);
            }
            a.around = walk.scene.surroundings_after(&si, ray.dir, &a.around);
            ray = si.spawn_ray(ray.dir);
        }
    }

    /// Radiance that a surface sends on along `si.wo`.
    fn reflected(
        &self,
        walk: &mut Walk<'_>,
        si: &SurfaceInteraction,
        a: Arrival,
        wl: &mut Wavelengths,
    ) -> Spectrum {
        if a.depth >= self.max_depth {
            return Spectrum::ZERO;
        }
        let Some(shading) = walk.scene.shade(si, &a.around, wl) else { return Spectrum::ZERO };
        let mut radiance = Spectrum::ZERO;
        if self.shadow_rays && !shading.bsdf.flags().is_within(LobeFlags::SPECULAR) {
            let here = DirectLight {
                scene: walk.scene,
                si,
                shading: &shading,
                around: a.around,
                directions: self.directions,
                guide: None,
                counts: [1, 1],
            };
            radiance += here.sample(LightStrategy::Alone, walk.sampler, wl, walk.counters);
        }

        // Rays branch off.
        let last = self.branching.len() - 1;
        let n = self.branching[last.min(a.depth as usize)];
        let wo = shading.frame.to_local(si.wo);
        let mut sum = Spectrum::ZERO;
        for _ in 0..n {
            let drawn = self.directions.sample(&shading.bsdf, wo, walk.sampler, TransportMode::Radiance);
            let Some(s) = drawn else { continue };
            let dir = shading.frame.to_world(s.wi);
            let next = Arrival {
                depth: a.depth + 1,
                sees_emitters: !self.shadow_rays || s.pdf.is_none(),
                around: walk.scene.surroundings_after(si, dir, &a.around),
                throughput: a.throughput * s.weight,
                eta_scale: a.eta_scale * s.eta * s.eta,
            };
            let Some(paid) = self.roulette.survive(next.depth, next.throughput, next.eta_scale, walk.sampler)
            else {
                continue;
            };
            let next = Arrival { throughput: next.throughput * paid, ..next };
            let ray = si.spawn_ray(dir);
            // A branch may end its secondary wavelengths where others do not.
            let mut branch_wl = *wl;
            let mut incoming = self.incoming(walk, ray, next, &mut branch_wl);
            if branch_wl.is_terminated() && !wl.is_terminated() {
                incoming = Spectrum::from_lanes([4.0 * incoming.lanes()[0], 0.0, 0.0, 0.0]);
            }
            sum += s.weight * incoming * paid;
        }
        radiance + sum / n as f32
    }
}
