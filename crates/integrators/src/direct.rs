//! Direct illumination: light straight from emitters, scattered once (depth 1 of `path`).
//!
//! `sampling` chooses how directions to emitters are drawn: crudely (`uniform`, `cosine`), by the BSDF, by the
//! lights, or by BSDF and lights together (`mis`) [Veach1997, ch. 9]. Whatever it says, what only one technique can
//! find is left to that one: delta lights to light sampling, delta lobes to the BSDF. So all choices have one mean.
//!
//! With `shared`, the random numbers of light samples are the same in every pixel of a pass: the image is smooth and
//! its error correlated.

use math::{Dir, Point};
use sampling::{Pdf, Sampler, SolidAngle};
use scatter::{Density, LobeFlags, TransportMode};
use scene::{LightContext, Scene, SurfaceInteraction, Surroundings};
use spectrum::{Spectrum, Wavelengths};

use crate::common::{
    CameraEstimator, CameraPath, DirectLight, DirectionSampling, LightStrategy, PathOutput, PixelLoop, Tools,
    infinite_light_pdf, light_pdf, sampler_of,
};
use crate::parameters::{ParameterInfo, ParameterKind, Parameters, shared};
use crate::registry::{IntegratorInfo, Making, refuses_media};
use crate::{Counters, Integrator};

/// For the registry.
pub(crate) const INFO: IntegratorInfo = IntegratorInfo {
    name: "direct",
    purpose: "light straight from emitters, by any of the classical densities",
    misses: "everything that is scattered more than once",
    unbiased: true,
    refuses: refuses_media,
    parameters,
    make,
};

fn parameters() -> Vec<ParameterInfo> {
    vec![
        ParameterInfo {
            name: "sampling",
            kind: ParameterKind::Choice(&["mis", "light", "bsdf", "cosine", "uniform"]),
            doc: "how directions to emitters are drawn",
        },
        ParameterInfo {
            name: "light_samples",
            kind: ParameterKind::Integer(1),
            doc: "light samples per camera sample (light, mis)",
        },
        ParameterInfo {
            name: "bsdf_samples",
            kind: ParameterKind::Integer(1),
            doc: "direction samples per camera sample (all but light)",
        },
        shared::HEURISTIC,
        ParameterInfo {
            name: "shared",
            kind: ParameterKind::Bool(false),
            doc: "one set of light samples for all pixels of a pass",
        },
        ParameterInfo {
            name: "max_depth",
            kind: ParameterKind::Limit(Some(1)),
            doc: "0 shows emitters only; more than 1 is 1",
        },
    ]
}

fn make(p: &Parameters, making: &Making<'_>) -> Box<dyn Integrator> {
    let sampling = p.text("sampling");
    let heuristic = shared::heuristic(p);
    let estimator = Direct {
        lights: match sampling {
            "mis" => Some(LightStrategy::Mis(heuristic)),
            "light" => Some(LightStrategy::Alone),
            _ => None,
        },
        directions: DirectionSampling::from_name(sampling),
        light_samples: p.integer("light_samples").max(1),
        direction_samples: p.integer("bsdf_samples").max(1),
        shared: p.bool("shared").then(|| sampler_of(making.sampler, making.seed)),
        max_depth: p.limit("max_depth"),
    };
    Box::new(PixelLoop { estimator, sampler: sampler_of(making.sampler, making.seed) })
}

struct Direct {
    /// `None`: directions alone (and delta lights).
    lights: Option<LightStrategy>,
    directions: DirectionSampling,
    light_samples: u32,
    direction_samples: u32,
    /// Makes the numbers that all pixels of a pass share.
    shared: Option<Sampler>,
    max_depth: u32,
}

impl CameraEstimator for Direct {
    fn radiance(
        &self,
        scene: &Scene,
        path: &mut CameraPath,
        sampler: &mut Sampler,
        out: &mut PathOutput<'_>,
    ) -> Spectrum {
        let eye = path.ray.origin;
        let Some((si, around, mut radiance)) = self.first_surface(scene, path, out.counters) else {
            return self.emitters_behind(scene, eye, path);
        };
        let Some(shading) = scene.shade(&si, &around, &mut path.wl) else { return radiance };
        if self.max_depth == 0 {
            return radiance;
        }
        let here = DirectLight {
            scene,
            si: &si,
            shading: &shading,
            around,
            directions: self.directions,
            guide: None,
            counts: [self.light_samples, self.direction_samples],
        };
        radiance += self.light_samples(&here, sampler, path, out.counters);
        radiance + self.direction_samples(&here, sampler, &path.wl, out.counters)
    }
}

impl Direct {
    /// The first surface that is no border of media, what it is reached through, and the emission met on the way to it (its own too).
    fn first_surface(
        &self,
        scene: &Scene,
        path: &mut CameraPath,
        counters: &mut Counters,
    ) -> Option<(SurfaceInteraction, Surroundings, Spectrum)> {
        let (mut emitted, mut around) = (Spectrum::ZERO, scene.camera_surroundings());
        loop {
            counters.rays += 1;
            let hit = scene.intersect(&path.ray)?;
            let si = scene.interaction(&path.ray, &hit);
            emitted += scene.emitted(&si, si.wo, &path.wl).unwrap_or_default();
            if !scene.is_interface(&si, &around) {
                return Some((si, around, emitted));
            }
            around = scene.surroundings_after(&si, path.ray.dir, &around);
            path.ray = si.spawn_ray(path.ray.dir);
        }
    }

    fn emitters_behind(&self, scene: &Scene, eye: Point, path: &CameraPath) -> Spectrum {
        let le = |l: &_| scene.lights.infinite_emitted(*l, eye, path.ray.dir, &path.wl);
        scene.lights.infinite().iter().map(le).sum()
    }

    fn light_samples(
        &self,
        here: &DirectLight<'_>,
        sampler: &mut Sampler,
        path: &CameraPath,
        counters: &mut Counters,
    ) -> Spectrum {
        if here.shading.bsdf.flags().is_within(LobeFlags::SPECULAR) {
            return Spectrum::ZERO;
        }
        let mut shared = self.shared.clone();
        if let Some(shared) = &mut shared {
            shared.start_path(0, path.pass);
        }
        let sampler = shared.as_mut().unwrap_or(sampler);
        match self.lights {
            Some(strategy) => {
                (0..self.light_samples).map(|_| here.sample(strategy, sampler, &path.wl, counters)).sum()
            }
            None => here.delta_lights(sampler, &path.wl, counters),
        }
    }

    /// Rays in drawn directions that find emitters.
    fn direction_samples(
        &self,
        here: &DirectLight<'_>,
        sampler: &mut Sampler,
        wl: &Wavelengths,
        counters: &mut Counters,
    ) -> Spectrum {
        let bsdf = &here.shading.bsdf;
        let only_deltas = self.lights == Some(LightStrategy::Alone);
        if only_deltas && !bsdf.flags().intersects(LobeFlags::SPECULAR) {
            return Spectrum::ZERO;
        }
        let wo = here.shading.frame.to_local(here.si.wo);
        let mut sum = Spectrum::ZERO;
        for _ in 0..self.direction_samples {
            let Some(s) = self.directions.sample(bsdf, wo, sampler, TransportMode::Radiance) else {
                continue;
            };
            if only_deltas && s.pdf.is_some() {
                continue;
            }
            let w = here.shading.frame.to_world(s.wi);
            sum += s.weight * self.found(here, w, s.pdf, wl, counters);
        }
        sum / self.direction_samples as f32
    }

    /// Weighted emission that a ray along `w` finds, through borders of media.
    fn found(
        &self,
        here: &DirectLight<'_>,
        w: Dir,
        pdf: Option<Pdf<SolidAngle>>,
        wl: &Wavelengths,
        counters: &mut Counters,
    ) -> Spectrum {
        let scene = here.scene;
        let from = here.shading.light_context(here.si);
        let mut found = Spectrum::ZERO;
        let mut ray = here.si.spawn_ray(w);
        let mut around = scene.surroundings_after(here.si, w, &here.around);
        loop {
            counters.rays += 1;
            let Some(hit) = scene.intersect(&ray) else { break };
            let si = scene.interaction(&ray, &hit);
            if let (Some(light), Some(le)) = (si.light, scene.emitted(&si, si.wo, wl))
                && !le.is_black()
            {
                found += le * self.weight(pdf, || light_pdf(scene, &from, light, &si));
            }
            if !scene.is_interface(&si, &around) {
                return found;
            }
            around = scene.surroundings_after(&si, w, &around);
            ray = si.spawn_ray(w);
        }
        for &light in scene.lights.infinite() {
            let le = scene.lights.infinite_emitted(light, from.p, w, wl);
            found += le * self.weight(pdf, || infinite_light_pdf(scene, &from, light, w));
        }
        found
    }

    fn weight(&self, pdf: Option<Pdf<SolidAngle>>, light_pdf: impl Fn() -> Pdf<SolidAngle>) -> f32 {
        match (self.lights, pdf) {
            (None | Some(LightStrategy::Alone), _) | (_, None) => 1.0,
            (Some(LightStrategy::Mis(h)), Some(pdf)) => {
                h.weight(pdf * self.direction_samples as f32, light_pdf() * self.light_samples as f32)
            }
        }
    }
}

impl DirectLight<'_> {
    /// Delta lights alone, for techniques that cannot find them by rays.
    fn delta_lights(&self, sampler: &mut Sampler, wl: &Wavelengths, counters: &mut Counters) -> Spectrum {
        let ctx: LightContext = self.shading.light_context(self.si);
        let (u_light, u) = (sampler.next_1d(), sampler.next_2d());
        let Some((light, chosen)) = self.scene.light_selector.select(&ctx, u_light) else {
            return Spectrum::ZERO;
        };
        match self.scene.lights.sample(light, &ctx, u, wl) {
            Some(s) if matches!(s.density, Density::Delta { .. }) => {
                let once = Self { counts: [1, 1], ..*self };
                let mut tools = Tools { sampler, wl, counters };
                once.contribution(&ctx, &s, chosen, LightStrategy::Alone, &mut tools)
            }
            _ => Spectrum::ZERO,
        }
    }
}
