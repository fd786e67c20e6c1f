//! Bidirectional path tracing [Lafortune1993] [Veach1997, ch. 10]: a walk from the eye and a walk from a light, joined
//! in every way, weighted by multiple importance sampling.
//!
//! One light path belongs to every camera path. What is connected to the lens lands elsewhere on the film: it is a
//! splat, an estimate of the whole film's integral (see `scene::Camera`). Weights leave out Russian roulette, which
//! depends on the throughput and not on the path alone; the mean is right all the same.
//!
//! Cannot find without `manifold`: light of a delta light that reaches a pinhole over delta surfaces at both ends, such as a
//! point lamp's caustic seen in a mirror.

mod layers;
mod links;
mod merging;
mod over_deltas;
mod strategies;
mod weight;

use sampling::Sampler;
use sampling::mis::Heuristic;
use scatter::TransportMode;
use scene::Scene;
use spectrum::Wavelengths;

pub(crate) use merging::Merging;
pub(crate) use strategies::{Contribution, Joint, Subpaths};
pub(crate) use weight::{Emitters, Link, Merges, Techniques, Weighting};

use layers::{LayerSample, Layers};

use crate::common::{CameraStart, LightStart, Near, Roulette, Shared, Subpath, Walk, sampler_of};
use crate::manifold::{self, Manifold};
use crate::parameters::{ParameterInfo, ParameterKind, Parameters, shared};
use crate::registry::{IntegratorInfo, Making, refuses_for_light_paths};
use crate::{Cell, CellOutput, Channels, Counters, Integrator, PassContext, Prepared};

/// For the registry.
pub(crate) const INFO: IntegratorInfo = IntegratorInfo {
    name: "bdpt",
    purpose: "walks from the eye and from the lights, joined in every way: lamps behind shades, caustics",
    misses: "caustics of point lights seen in mirrors or through smooth glass, but for manifold=2; slower than path where light is \
             easy",
    unbiased: true,
    refuses: refuses_for_light_paths,
    parameters,
    make,
};

fn parameters() -> Vec<ParameterInfo> {
    vec![
        shared::MAX_DEPTH,
        shared::RR_DEPTH,
        shared::HEURISTIC,
        ParameterInfo {
            name: "show",
            kind: ParameterKind::Choice(&["image", "strategies"]),
            doc: "strategies: what every strategy (s, t) makes, weighted and unweighted, as layers and on a sheet",
        },
        ParameterInfo {
            name: "show_depth",
            kind: ParameterKind::Integer(5),
            doc: "most scattering events of the paths whose strategies are shown",
        },
        manifold::PARAMETER,
    ]
}

fn make(p: &Parameters, making: &Making<'_>) -> Box<dyn Integrator> {
    let manifold = Manifold::of(making.scene, p);
    let longest = manifold.as_ref().map_or(0, |m| m.longest);
    Box::new(Bidirectional {
        max_depth: p.limit("max_depth"),
        roulette: Roulette::from(p.integer("rr_depth")),
        weighting: Weighting { manifold: longest, ..weighting(making.scene, shared::heuristic(p)) },
        layers: (p.text("show") == "strategies").then(|| {
            let depth = p.limit("max_depth").min(p.integer("show_depth")).min(MOST_SHOWN);
            Layers::new(depth as usize, making.scene.camera.has_lens())
        }),
        merging: None,
        manifold,
        sampler: sampler_of(making.sampler, making.seed),
    })
}

/// Layers of more scattering events than this are more than a film takes.
const MOST_SHOWN: u32 = 30;

/// There are as many light paths as camera paths in the crop, whose share of the film counts.
pub(crate) fn weighting(scene: &Scene, heuristic: Heuristic) -> Weighting {
    Weighting {
        heuristic,
        techniques: Techniques::BIDIRECTIONAL,
        lens_is_hittable: scene.camera.has_lens(),
        light_share: scene.settings().sample_bounds().area() as f32 / scene.camera.n_pixels(),
        manifold: 0,
    }
}

/// Walks from both ends, joined in every way that the weighting allows.
pub(crate) struct Bidirectional {
    pub(crate) max_depth: u32,
    pub(crate) roulette: Roulette,
    pub(crate) weighting: Weighting,
    /// Where each strategy is shown, if they are.
    pub(crate) layers: Option<Layers>,
    /// Photons, if they are merged with.
    pub(crate) merging: Option<Merging>,
    /// Searches for paths that nothing else makes, if any are left to it.
    pub(crate) manifold: Option<Manifold>,
    pub(crate) sampler: Sampler,
}

impl Integrator for Bidirectional {
    fn prepares(&self) -> bool {
        self.merging.is_some()
    }

    fn prepare(&mut self, ctx: PassContext<'_>) -> Prepared {
        self.merging.as_mut().map(|m| m.prepare(ctx)).unwrap_or_default()
    }

    fn splats(&self) -> bool {
        true
    }

    fn channels(&self) -> Channels {
        self.layers.as_ref().map(Layers::channels).unwrap_or_default()
    }

    fn cell(&self, ctx: PassContext<'_>, cell: Cell, out: &mut CellOutput) {
        let Cell::Tile(bounds) = cell else { return };
        let mut sampler = self.sampler.clone();
        let mut work = Work::default();
        for y in bounds.min[1]..bounds.max[1] {
            for x in bounds.min[0]..bounds.max[0] {
                sampler.start([x, y], ctx.pass);
                self.pixel(ctx.scene, [x, y], &mut sampler, &mut work, out);
            }
        }
    }
}

/// What a cell works with, kept from pixel to pixel so that a path allocates nothing.
#[derive(Default)]
struct Work {
    paths: Subpaths,
    links: Vec<Link>,
    /// Photons around a vertex.
    near: Vec<Near>,
    shown: LayerSample,
}

impl Bidirectional {
    fn pixel(
        &self,
        scene: &Scene,
        pixel: [i32; 2],
        sampler: &mut Sampler,
        work: &mut Work,
        out: &mut CellOutput,
    ) {
        let u = sampler.pixel_2d();
        let raster = [pixel[0] as f32 + u[0], pixel[1] as f32 + u[1]];
        let shared = self.merging.as_ref().map(|m| m.shared);
        let mut wl = match (shared, scene.settings().spectral) {
            (Some(shared), _) => shared.wl,
            (None, true) => Wavelengths::sample_visible(sampler.next_1d()),
            (None, false) => Wavelengths::RGB,
        };
        let walks = Walks { scene, lengths: self.lengths(scene), roulette: self.roulette, shared };
        out.counters.camera_paths += 1;
        walks.eye(raster, sampler, &mut wl, &mut out.counters, &mut work.paths);
        if walks.lengths[1] > 0 {
            out.counters.light_paths += 1;
            walks.light(sampler, &mut wl, &mut out.counters, &mut work.paths);
        }
        work.paths.finish_merges(scene, self.merging.as_ref());

        if let Some(layers) = &self.layers {
            layers.begin(&mut work.shown);
        }
        let mut radiance = self.join(scene, sampler, wl, work, out);
        if let Some(merging) = &self.merging {
            let merged = self.merge(scene, merging, (sampler, wl), work, out);
            radiance = [0, 1, 2].map(|i| radiance[i] + merged[i]);
        }
        if let Some(manifold) = &self.manifold {
            let found = self.over_deltas(scene, manifold, (sampler, wl), work, out);
            radiance = [0, 1, 2].map(|i| radiance[i] + found[i]);
        }
        out.tile.add_sample(pixel, u, radiance);
        if let Some(layers) = &self.layers {
            layers.end(&work.shown, &mut out.tile, pixel, u);
        }
    }

    /// Most scattering events of both walks.
    fn lengths(&self, scene: &Scene) -> [usize; 2] {
        let depth = self.max_depth as usize;
        let Techniques { emitters, connections, lens, .. } = self.weighting.techniques;
        let is_short = emitters == Emitters::Seen && !scene.media.any_emits();
        let eye = if is_short { 1 } else { depth.saturating_add(1) };
        let light = depth.saturating_add(usize::from(scene.camera.has_lens()));
        [eye, if connections || lens { light } else { 0 }]
    }

    /// Merges the eye's walk with photons: radiance of the pixel.
    fn merge(
        &self,
        scene: &Scene,
        merging: &Merging,
        (sampler, wl): (&mut Sampler, Wavelengths),
        work: &mut Work,
        out: &mut CellOutput,
    ) -> [f32; 3] {
        let mut hero = wl;
        hero.terminate_secondary();
        let (depth, mut radiance) = (self.max_depth as usize, [0.0; 3]);
        let Work { paths, links, near, .. } = work;
        let (n, counters) = (paths.eye.vertices.len(), &mut out.counters);
        let mut joint = Joint { scene, weighting: self.weighting, wl, paths, links, sampler, counters };
        for i in 0..n {
            let radius = joint.find_photons(merging, i, near);
            for &near in near.iter() {
                let Some(merged) = joint.merge(merging, (i, radius), near, depth) else { continue };
                let wl = if merged.is_terminated { &hero } else { &wl };
                let rgb = scene.film_rgb(merged.contribution.weighted, wl);
                radiance = [0, 1, 2].map(|c| radiance[c] + rgb[c]);
            }
        }
        radiance
    }

    /// What no connection makes, by manifold sampling: radiance of the pixel.
    fn over_deltas(
        &self,
        scene: &Scene,
        manifold: &Manifold,
        (sampler, wl): (&mut Sampler, Wavelengths),
        work: &mut Work,
        out: &mut CellOutput,
    ) -> [f32; 3] {
        let Work { paths, links, shown, .. } = work;
        let mut radiance = [0.0; 3];
        for i in 0..paths.eye.vertices.len() {
            let left = (self.max_depth as usize).saturating_sub(paths.eye.events(i + 1));
            for n in 1..=manifold.longest.min(left) {
                let (links, counters) = (&mut *links, &mut out.counters);
                let mut joint =
                    Joint { scene, weighting: self.weighting, wl, paths, links, sampler, counters };
                let Some(found) = joint.over_deltas(manifold, i, n) else { continue };
                let rgb = scene.film_rgb(found, &wl);
                radiance = [0, 1, 2].map(|c| radiance[c] + rgb[c]);
                if let Some(layers) = &self.layers {
                    layers.add(shown, (0, i + n + 3), [rgb; 2]);
                }
            }
        }
        radiance
    }

    /// Joins the two walks in every way: the radiance of the pixel; splats are left in `out`.
    fn join(
        &self,
        scene: &Scene,
        sampler: &mut Sampler,
        wl: Wavelengths,
        work: &mut Work,
        out: &mut CellOutput,
    ) -> [f32; 3] {
        let Work { paths, links, shown, .. } = work;
        let (n_eye, n_light) = (paths.eye.vertices.len(), paths.light.vertices.len());
        let per_light_path = scene.camera.n_pixels() / scene.settings().sample_bounds().area() as f32;
        let depth = self.max_depth as usize;
        let mut radiance = [0.0; 3];
        for t in 0..=n_eye + 2 {
            for s in 0..=n_light + 2 {
                // One vertex alone is no path.
                if s + t < 2 || paths.are_hidden(s, t) || paths.events(s, t) > depth {
                    continue;
                }
                let (links, counters) = (&mut *links, &mut out.counters);
                let mut joint =
                    Joint { scene, weighting: self.weighting, wl, paths, links, sampler, counters };
                let Some(c) = joint.strategy(s, t) else { continue };
                let factor = if c.splat.is_some() { per_light_path } else { 1.0 };
                let rgb = scene.film_rgb(c.weighted * factor, &wl);
                match c.splat {
                    Some(at) => out.splats.add(at, rgb),
                    None => radiance = [0, 1, 2].map(|i| radiance[i] + rgb[i]),
                }
                if let Some(layers) = &self.layers {
                    let values = [rgb, scene.film_rgb(c.unweighted * factor, &wl)];
                    match c.splat {
                        Some(at) => layers.splat(&mut out.splats, (s, t), at, values),
                        None => layers.add(shown, (s, t), values),
                    }
                }
            }
        }
        radiance
    }
}

impl Subpaths {
    /// Scattering events of the path by a strategy of at least two vertices: s + t − 2 but for what is under surfaces.
    pub(crate) fn events(&self, s: usize, t: usize) -> usize {
        match (s, t) {
            (0, _) => self.eye.events(t - 2),
            (_, 0) => self.light.events(s - 2),
            _ => self.light.events(s - 1) + self.eye.events(t - 1),
        }
    }

    /// Are the ends of two walks under surfaces, so that nothing joins them?
    pub(crate) fn are_hidden(&self, s: usize, t: usize) -> bool {
        let is_hidden = |path: &Subpath, n: usize| n.checked_sub(2).is_some_and(|i| path.is_hidden(i));
        is_hidden(&self.eye, t) || is_hidden(&self.light, s)
    }
}

/// Makes the two walks of a path.
#[derive(Clone, Copy)]
pub(crate) struct Walks<'a> {
    pub(crate) scene: &'a Scene,
    /// Most surfaces of the eye's walk and of the light's.
    pub(crate) lengths: [usize; 2],
    pub(crate) roulette: Roulette,
    /// Moment and wavelengths, if all paths have the same.
    pub(crate) shared: Option<Shared>,
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
        paths.eye_start = CameraStart::sample(self.scene, raster, self.shared, sampler);
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

#[cfg(test)]
#[allow(clippy::print_stdout, reason = "figures of the test")]
mod tests {
    use testkit::statistics::{Moments, sidak, welch_test};

    use super::*;
    use crate::test_scene::load;

    /// Mean radiance over the whole film of all paths with `depth` scattering events, by every single strategy, over
    /// batches; strategies that do not apply are empty.
    fn pyramid(scene: &Scene, depth: usize, batches: u32, paths_each: u32) -> Vec<Moments> {
        let mut sampler = Sampler::new(sampling::SamplerKind::Independent, 5);
        let (mut paths, mut links, mut counters) = (Subpaths::default(), Vec::new(), Counters::default());
        let walks =
            Walks { scene, lengths: [depth + 1; 2], roulette: Roulette::from(u32::MAX), shared: None };
        let mut moments = vec![Moments::default(); depth + 3];
        for batch in 0..batches {
            let mut sums = vec![0.0; depth + 3];
            for i in 0..paths_each {
                sampler.start_path(u64::from(i), batch);
                let u = sampler.next_2d();
                let resolution = scene.camera.resolution();
                let raster = [0, 1].map(|a| u[a] * resolution[a] as f32);
                let mut wl = Wavelengths::RGB;
                walks.eye(raster, &mut sampler, &mut wl, &mut counters, &mut paths);
                walks.light(&mut sampler, &mut wl, &mut counters, &mut paths);
                for (s, sum) in sums.iter_mut().enumerate() {
                    let weighting = weighting(scene, Heuristic::Power);
                    let (paths, links) = (&paths, &mut links);
                    let (sampler, counters) = (&mut sampler, &mut counters);
                    let mut joint = Joint { scene, weighting, wl, paths, links, sampler, counters };
                    // Both kinds are means over the film: of radiance, or of its integral.
                    *sum += joint.strategy(s, depth + 2 - s).map_or(0.0, |c| {
                        let outside = c
                            .splat
                            .is_some_and(|at| (0..2).any(|a| at[a] < 0.0 || at[a] >= resolution[a] as f32));
                        if outside { 0.0 } else { f64::from(c.unweighted.average()) }
                    });
                }
            }
            for (m, sum) in moments.iter_mut().zip(sums) {
                m.push(sum / f64::from(paths_each));
            }
        }
        moments
    }

    /// Every strategy alone has the same mean, if there are no deltas: Veach's pyramid.
    #[test]
    fn every_strategy_alone_makes_the_same_picture() {
        let mut failures = String::new();
        for (name, depths) in
            [("orthographic", 2..=2), ("points", 2..=2), ("shading-normals", 2..=3), ("wide-lens", 1..=2)]
        {
            let scene = load(name, false);
            let has_delta_light = scene.lights.ids().any(|l| scene.lights.is_delta(l));
            for depth in depths {
                let means = pyramid(&scene, depth, 24, 2000);
                for (s, m) in means.iter().enumerate() {
                    let t = welch_test(m, &means[1]);
                    let strategy = format!("{name} ({s}, {})", depth + 2 - s);
                    println!("{strategy} {:.5} ± {:.5}", m.mean(), m.std_error());
                    let applies = (s > 0 || !has_delta_light) && (s < depth + 2 || scene.camera.has_lens());
                    if applies && !t.is_consistent(sidak(0.01, 26)) {
                        failures += &format!("{strategy}: {t:?}\n");
                    }
                }
            }
        }
        assert!(failures.is_empty(), "{failures}");
    }
}
