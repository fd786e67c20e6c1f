//! Path tracing [Kajiya1986]: one walk from the eye per sample, with next-event estimation at every vertex and
//! multiple importance sampling between the two ways of meeting an emitter [Veach1997, ch. 9].
//!
//! Cannot find: light that reaches the eye only over a delta surface from a delta light (caustics of point lights),
//! and in practice hardly any caustic of a small lamp. `bdpt`, `photon`, `sppm` and `vcm` do.
//!
//! Without `shadow_rays` the walk alone finds emitters; delta lights are then invisible and contribute nothing.

use math::Dir;
use sampling::{Pdf, Sampler, SolidAngle};
use scatter::{LobeFlags, TransportMode};
use scene::{LightContext, Scene, SurfaceInteraction};
use spectrum::{Spectrum, Wavelengths};

use crate::Integrator;
use crate::common::{
    CameraEstimator, CameraPath, DirectLight, DirectionSampling, LightStrategy, PathOutput, PixelLoop,
    Roulette, infinite_light_pdf, light_pdf, sampler_of,
};
use crate::parameters::{ParameterInfo, ParameterKind, Parameters, shared};
use crate::registry::{IntegratorInfo, Making};

/// For the registry.
pub(crate) const INFO: IntegratorInfo = IntegratorInfo {
    name: "path",
    purpose: "global illumination by random walks from the eye; the robust default",
    misses: "caustics of point lights and of mirrors' delta reflections of them; small caustics converge slowly",
    unbiased: true,
    parameters,
    make,
};

fn parameters() -> Vec<ParameterInfo> {
    vec![
        shared::MAX_DEPTH,
        shared::RR_DEPTH,
        ParameterInfo {
            name: "shadow_rays",
            kind: ParameterKind::Bool(true),
            doc: "next-event estimation at every vertex",
        },
        ParameterInfo {
            name: "mis",
            kind: ParameterKind::Bool(true),
            doc: "weigh shadow rays against rays that find emitters; false: shadow rays alone",
        },
        shared::HEURISTIC,
        ParameterInfo {
            name: "sampling",
            kind: ParameterKind::Choice(DirectionSampling::NAMES),
            doc: "density of the walk's directions (delta lobes always by the BSDF)",
        },
    ]
}

fn make(p: &Parameters, making: &Making<'_>) -> Box<dyn Integrator> {
    let heuristic = shared::heuristic(p);
    let lights = match (p.bool("shadow_rays"), p.bool("mis")) {
        (false, _) => None,
        (true, false) => Some(LightStrategy::Alone),
        (true, true) => Some(LightStrategy::Mis(heuristic)),
    };
    let estimator = Path {
        max_depth: p.limit("max_depth"),
        roulette: Roulette { rr_depth: p.integer("rr_depth") },
        lights,
        directions: DirectionSampling::from_name(p.text("sampling")),
    };
    Box::new(PixelLoop { estimator, sampler: sampler_of(making.sampler, making.seed) })
}

/// The estimator.
pub(crate) struct Path {
    pub(crate) max_depth: u32,
    pub(crate) roulette: Roulette,
    /// `None`: no shadow rays.
    pub(crate) lights: Option<LightStrategy>,
    pub(crate) directions: DirectionSampling,
}

/// Where the walk came from: what a light sample there would have competed with.
struct Previous {
    /// `None` after the camera or a delta: nothing competes.
    rival: Option<(LightContext, Pdf<SolidAngle>)>,
}

impl CameraEstimator for Path {
    fn radiance(
        &self,
        scene: &Scene,
        path: &mut CameraPath,
        sampler: &mut Sampler,
        out: &mut PathOutput<'_>,
    ) -> Spectrum {
        let (mut ray, wl) = (path.ray, &mut path.wl);
        let mut radiance = Spectrum::ZERO;
        let mut throughput = Spectrum::ONE;
        let mut eta_scale = 1.0;
        let mut previous = Previous { rival: None };
        let mut depth = 0;

        loop {
            // Nearest surface; a path that leaves the scene may find the sky.
            out.counters.rays += 1;
            let Some(hit) = scene.intersect(&ray) else {
                return radiance + throughput * self.sky(scene, ray.dir, &previous, wl);
            };
            let si = scene.interaction(&ray, &hit);

            // The walk itself found an emitter.
            radiance += throughput * self.emission(scene, &si, &previous, wl);
            let Some(shading) = scene.shade(&si, wl) else {
                // A border of media is no scattering event.
                ray = si.spawn_ray(ray.dir);
                continue;
            };
            if depth == self.max_depth {
                return radiance;
            }

            // Next-event estimation.
            if let Some(strategy) = self.lights
                && !shading.bsdf.flags().is_within(LobeFlags::SPECULAR)
            {
                let here = DirectLight {
                    scene,
                    si: &si,
                    shading: &shading,
                    directions: self.directions,
                    counts: [1, 1],
                };
                radiance += throughput * here.sample(strategy, sampler, wl, out.counters);
            }

            // Continue the walk.
            let wo = shading.frame.to_local(si.wo);
            let Some(s) = self.directions.sample(&shading.bsdf, wo, sampler, TransportMode::Radiance) else {
                return radiance;
            };
            throughput *= s.weight;
            eta_scale *= s.eta * s.eta;
            depth += 1;
            previous.rival = s.pdf.map(|pdf| (si.light_context(), pdf));
            ray = si.spawn_ray(shading.frame.to_world(s.wi));

            let Some(paid) = self.roulette.survive(depth, throughput, eta_scale, sampler.next_1d()) else {
                return radiance;
            };
            throughput *= paid;
        }
    }
}

impl Path {
    /// Emission of a surface that the walk found, weighted against the light sample that could have found it.
    fn emission(
        &self,
        scene: &Scene,
        si: &SurfaceInteraction,
        previous: &Previous,
        wl: &Wavelengths,
    ) -> Spectrum {
        let (Some(light), Some(le)) = (si.light, scene.emitted(si, si.wo, wl)) else { return Spectrum::ZERO };
        if le.is_black() {
            return Spectrum::ZERO;
        }
        le * self.weight(previous, |from| light_pdf(scene, from, light, si))
    }

    /// Radiance of all infinite lights along a ray that left the scene.
    fn sky(&self, scene: &Scene, dir: Dir, previous: &Previous, wl: &Wavelengths) -> Spectrum {
        let lights = scene.lights.infinite().iter();
        lights
            .map(|&light| {
                let le = scene.lights.infinite_emitted(light, dir, wl);
                le * self.weight(previous, |from| infinite_light_pdf(scene, from, light, dir))
            })
            .sum()
    }

    fn weight(&self, previous: &Previous, light_pdf: impl Fn(&LightContext) -> Pdf<SolidAngle>) -> f32 {
        match (self.lights, &previous.rival) {
            (None, _) | (_, None) => 1.0,
            (Some(LightStrategy::Alone), Some(_)) => 0.0,
            (Some(LightStrategy::Mis(h)), Some((from, pdf))) => h.weight(*pdf, light_pdf(from)),
        }
    }
}
