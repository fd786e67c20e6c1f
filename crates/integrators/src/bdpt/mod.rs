//! Bidirectional path tracing [Lafortune1993] [Veach1997, ch. 10]: a walk from the eye and a walk from a light, joined
//! in every way, weighted by multiple importance sampling.
//!
//! One light path belongs to every camera path. What is connected to the lens lands elsewhere on the film: it is a
//! splat, an estimate of the whole film's integral (see `scene::Camera`). Weights leave out Russian roulette, which
//! depends on the throughput and not on the path alone; the mean is right all the same.
//!
//! Cannot find: light of a delta light that reaches a pinhole over delta surfaces at both ends, such as a point
//! lamp's caustic seen in a mirror.

mod strategies;
mod weight;

use sampling::Sampler;
use sampling::mis::Heuristic;
use scatter::TransportMode;
use scene::Scene;
use spectrum::Wavelengths;

pub(crate) use strategies::{Joint, Subpaths};
pub(crate) use weight::Weighting;

use crate::common::{CameraStart, LightStart, Roulette, Walk, sampler_of};
use crate::parameters::{ParameterInfo, ParameterKind, Parameters};
use crate::registry::{IntegratorInfo, Making};
use crate::{Cell, CellOutput, Counters, Integrator, PassContext};

/// For the registry.
pub(crate) const INFO: IntegratorInfo = IntegratorInfo {
    name: "bdpt",
    purpose: "walks from the eye and from the lights, joined in every way: lamps behind shades, caustics",
    misses: "caustics of point lights seen in mirrors or through smooth glass; slower than path where light is easy",
    unbiased: true,
    parameters,
    make,
};

fn parameters() -> Vec<ParameterInfo> {
    vec![
        ParameterInfo {
            name: "max_depth",
            kind: ParameterKind::Limit(Some(5)),
            doc: "most scattering events of a path; 0 shows emitters only, 1 direct light",
        },
        ParameterInfo {
            name: "rr_depth",
            kind: ParameterKind::Integer(3),
            doc: "scattering events of a walk before Russian roulette may end it",
        },
        ParameterInfo {
            name: "heuristic",
            kind: ParameterKind::Choice(&["power", "balance"]),
            doc: "how the weights follow from the densities",
        },
    ]
}

fn make(p: &Parameters, making: &Making<'_>) -> Box<dyn Integrator> {
    let heuristic = if p.text("heuristic") == "balance" { Heuristic::Balance } else { Heuristic::Power };
    Box::new(Bidirectional {
        max_depth: p.limit("max_depth"),
        roulette: Roulette { rr_depth: p.integer("rr_depth") },
        weighting: weighting(making.scene, heuristic),
        sampler: sampler_of(making.sampler, making.seed),
    })
}

/// There are as many light paths as camera paths in the crop, whose share of the film counts.
pub(crate) fn weighting(scene: &Scene, heuristic: Heuristic) -> Weighting {
    Weighting {
        heuristic,
        lens_is_hittable: scene.camera.has_lens(),
        light_share: scene.settings().sample_bounds().area() as f32 / scene.camera.n_pixels(),
    }
}

struct Bidirectional {
    max_depth: u32,
    roulette: Roulette,
    weighting: Weighting,
    sampler: Sampler,
}

impl Integrator for Bidirectional {
    fn splats(&self) -> bool {
        true
    }

    fn cell(&self, ctx: PassContext<'_>, cell: Cell, out: &mut CellOutput) {
        let Cell::Tile(bounds) = cell else { return };
        let mut sampler = self.sampler.clone();
        let mut paths = Subpaths::default();
        for y in bounds.min[1]..bounds.max[1] {
            for x in bounds.min[0]..bounds.max[0] {
                sampler.start([x, y], ctx.pass);
                self.pixel(ctx.scene, [x, y], &mut sampler, &mut paths, out);
            }
        }
    }
}

impl Bidirectional {
    fn pixel(
        &self,
        scene: &Scene,
        pixel: [i32; 2],
        sampler: &mut Sampler,
        paths: &mut Subpaths,
        out: &mut CellOutput,
    ) {
        let u = sampler.pixel_2d();
        let raster = [pixel[0] as f32 + u[0], pixel[1] as f32 + u[1]];
        let mut wl = match scene.settings().spectral {
            true => Wavelengths::sample_visible(sampler.next_1d()),
            false => Wavelengths::RGB,
        };
        let depth = self.max_depth as usize;
        let lengths = [depth.saturating_add(1), depth.saturating_add(usize::from(scene.camera.has_lens()))];
        let walks = Walks { scene, lengths, roulette: self.roulette };
        out.counters.camera_paths += 1;
        out.counters.light_paths += 1;
        walks.eye(raster, sampler, &mut wl, &mut out.counters, paths);
        walks.light(sampler, &mut wl, &mut out.counters, paths);

        let (n_eye, n_light) = (paths.eye.vertices.len(), paths.light.vertices.len());
        let per_light_path = scene.camera.n_pixels() / scene.settings().sample_bounds().area() as f32;
        let mut radiance = [0.0; 3];
        for t in 0..=n_eye + 2 {
            for s in 0..=n_light + 2 {
                // s + t − 2 scattering events; one vertex alone is no path.
                if s + t < 2 || s + t - 2 > depth {
                    continue;
                }
                let counters = &mut out.counters;
                let mut joint =
                    Joint { scene, weighting: self.weighting, wl, paths: &mut *paths, sampler, counters };
                let Some(c) = joint.strategy(s, t) else { continue };
                match c.splat {
                    Some(at) => out.splats.add(at, scene.film_rgb(c.weighted * per_light_path, &wl)),
                    None => {
                        let rgb = scene.film_rgb(c.weighted, &wl);
                        radiance = [0, 1, 2].map(|i| radiance[i] + rgb[i]);
                    }
                }
            }
        }
        out.tile.add_sample(pixel, u, radiance);
    }
}

/// Makes the two walks of a path.
#[derive(Clone, Copy)]
pub(crate) struct Walks<'a> {
    pub(crate) scene: &'a Scene,
    /// Most surfaces of the eye's walk and of the light's.
    pub(crate) lengths: [usize; 2],
    pub(crate) roulette: Roulette,
}

impl Walks<'_> {
    /// The eye's walk through a place on the film.
    pub(crate) fn eye(
        &self,
        raster: [f32; 2],
        sampler: &mut Sampler,
        wl: &mut Wavelengths,
        counters: &mut Counters,
        paths: &mut Subpaths,
    ) {
        paths.eye.clear();
        paths.eye_start = CameraStart::sample(self.scene, raster, sampler);
        if let Some(eye) = paths.eye_start {
            self.walk(TransportMode::Radiance).run(&eye.start, sampler, wl, counters, &mut paths.eye);
        }
    }

    /// The light's walk, at the moment of the eye's.
    pub(crate) fn light(
        &self,
        sampler: &mut Sampler,
        wl: &mut Wavelengths,
        counters: &mut Counters,
        paths: &mut Subpaths,
    ) {
        paths.light.clear();
        let time = paths.eye_start.map_or(0.0, |c| c.start.ray.time);
        paths.light_start = LightStart::sample(self.scene, time, wl, sampler);
        if let Some(light) = paths.light_start {
            self.walk(TransportMode::Importance).run(&light.start, sampler, wl, counters, &mut paths.light);
        }
        paths.finish_light(self.scene);
    }

    fn walk(&self, mode: TransportMode) -> Walk<'_> {
        let [eye, light] = self.lengths;
        let limit = if mode == TransportMode::Radiance { eye } else { light };
        Walk { scene: self.scene, mode, limit, roulette: self.roulette }
    }
}
