//! What a point of primary sample space adds to the film, and what chains visit it in proportion to.

use math::hash::combine;
use sampling::Sampler;
use scene::Scene;
use spectrum::Wavelengths;

use super::map::Map;
use super::space::{EYE, JOINT, Kinds, LIGHT, N_STREAMS, Numbers, Technique};
use crate::Counters;
use crate::bdpt::{Contribution, Joint, Link, Subpaths, Walks, Weighting};
use crate::common::{Roulette, Subpath, place_in};
use crate::manifold::Manifold;

/// What a point adds to the film, as an integral over all of its pixels.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Value {
    pub(super) raster: [f32; 2],
    pub(super) rgb: [f32; 3],
    /// What chains visit it in proportion to.
    pub(super) size: f32,
}

/// Seeds of the numbers that are read past the end of the streams.
pub(super) type Seeds = [u64; N_STREAMS];

/// Makes the seed of the joint numbers one technique's own.
pub(super) fn of_technique([eye, light, joint]: Seeds, technique: Technique) -> Seeds {
    let Technique { events, s, chain } = technique;
    [eye, light, combine(joint, u64::from(events) << 32 | u64::from(chain) << 16 | u64::from(s))]
}

/// What paths are made in, and with.
#[derive(Clone, Copy)]
pub(super) struct World<'a> {
    pub(super) scene: &'a Scene,
    pub(super) manifold: Option<&'a Manifold>,
}

/// Makes paths of points. Kept and used again, so that a path allocates nothing.
pub(super) struct Target<'a> {
    pub(super) scene: &'a Scene,
    manifold: Option<&'a Manifold>,
    pub(super) kinds: Kinds,
    pub(super) weighting: Weighting,
    pub(super) map: &'a Map,
    pub(super) counters: Counters,
    paths: Subpaths,
    links: Vec<Link>,
    wl: Wavelengths,
    raster: [f32; 2],
    /// Numbers for joining, of one technique after the other.
    joint: Vec<f32>,
}

impl<'a> Target<'a> {
    pub(super) fn new(world: World<'a>, weighting: Weighting, map: &'a Map) -> Self {
        let World { scene, manifold } = world;
        Self {
            scene,
            manifold,
            kinds: Kinds::of(scene, &weighting),
            weighting,
            map,
            counters: Counters::default(),
            paths: Subpaths::default(),
            links: Vec::new(),
            wl: Wavelengths::RGB,
            raster: [0.0; 2],
            joint: Vec::new(),
        }
    }

    /// Where the place on the film stands in the eye's stream: after the wavelengths.
    pub(super) fn film_number(&self) -> usize {
        usize::from(self.scene.settings().spectral)
    }

    /// The value of a point; numbers that it reads for the first time are appended.
    pub(super) fn evaluate(&mut self, technique: Technique, numbers: &mut Numbers, seeds: Seeds) -> Value {
        let [eye, light, joint] = numbers;
        let lengths = [technique.t().saturating_sub(1), technique.s.saturating_sub(1)];
        self.walk(lengths, [eye, light], [seeds[EYE], seeds[LIGHT]]);
        let Some(vertices) = self.vertices(technique) else { return Value::default() };
        let mut sampler = Sampler::replay(std::mem::take(joint), seeds[JOINT]);
        let value = self.join(technique, vertices, &mut sampler);
        *joint = sampler.into_replayed();
        value.unwrap_or_default()
    }

    /// All that one point makes of paths of up to `events` scattering events, in a fixed order. The values are, bit by
    /// bit, those of [`Target::evaluate`] with the seeds [`of_technique`].
    pub(super) fn evaluate_all(
        &mut self,
        events: u32,
        numbers: &mut Numbers,
        seeds: Seeds,
        mut each: impl FnMut(Technique, &Value),
    ) {
        let kinds = self.kinds;
        let [eye, light, _] = numbers;
        self.walk([events + 1, events + u32::from(kinds.has_lens)], [eye, light], [seeds[EYE], seeds[LIGHT]]);
        let terminated = self.wl.is_terminated();
        for events in 1..=events {
            for technique in (0..kinds.count(events)).map(|i| kinds.nth(events, i)) {
                let mut vertices = self.vertices(technique);
                if terminated {
                    // What ended wavelengths may be no surface of this path.
                    let lengths = [technique.t().saturating_sub(1), technique.s.saturating_sub(1)];
                    self.walk(lengths, [&mut *eye, &mut *light], [seeds[EYE], seeds[LIGHT]]);
                    vertices = self.vertices(technique);
                }
                let Some(vertices) = vertices else { continue };
                let seed = of_technique(seeds, technique)[JOINT];
                let mut sampler = Sampler::replay(std::mem::take(&mut self.joint), seed);
                if let Some(value) = self.join(technique, vertices, &mut sampler) {
                    each(technique, &value);
                }
                self.joint = sampler.into_replayed();
                self.joint.clear();
            }
        }
    }

    /// Both walks, of so many scattering events.
    fn walk(&mut self, lengths: [u32; 2], [eye, light]: [&mut Vec<f32>; 2], seeds: [u64; 2]) {
        let scene = self.scene;
        let mut sampler = Sampler::replay(std::mem::take(eye), seeds[0]);
        self.wl = match scene.settings().spectral {
            true => Wavelengths::sample_visible(sampler.next_1d()),
            false => Wavelengths::RGB,
        };
        self.raster = place_in(&scene.settings().sample_bounds(), sampler.next_2d());
        let lengths = lengths.map(|n| n as usize);
        let walks = Walks { scene, lengths, roulette: Roulette::from(u32::MAX), shared: None };
        let Self { wl, counters, paths, .. } = self;
        walks.eye(self.raster, &mut sampler, wl, counters, paths);
        *eye = sampler.into_replayed();
        if lengths[1] > 0 {
            let mut sampler = Sampler::replay(std::mem::take(light), seeds[1]);
            walks.light(&mut sampler, wl, counters, paths);
            *light = sampler.into_replayed();
        } else {
            paths.light.clear();
        }
    }

    /// How many vertices of the light's walk and of the eye's a technique takes; `None` if they are too short.
    fn vertices(&self, technique: Technique) -> Option<(usize, usize)> {
        let up_to = |path: &Subpath, n: u32| match n {
            0 | 1 => Some(n as usize),
            _ => path.vertices_to(n as usize - 1).map(|vertices| vertices + 1),
        };
        Some((up_to(&self.paths.light, technique.s)?, up_to(&self.paths.eye, technique.t())?))
    }

    /// Joins the two walks; `None` for nothing.
    fn join(&mut self, technique: Technique, (s, t): (usize, usize), sampler: &mut Sampler) -> Option<Value> {
        let (scene, weighting, wl) = (self.scene, self.weighting, self.wl);
        let (paths, links, counters) = (&self.paths, &mut self.links, &mut self.counters);
        let mut joint = Joint { scene, weighting, wl, paths, links, sampler, counters };
        let c = match technique.chain {
            0 => joint.strategy(s, t)?,
            n => {
                let value = joint.over_deltas(self.manifold?, t.checked_sub(2)?, n as usize)?;
                Contribution { unweighted: value, weighted: value, splat: None }
            }
        };

        // Radiance is spread over the region, a splat is an integral over the film already.
        let region = scene.settings().sample_bounds();
        let (raster, pixels) = match c.splat {
            Some(at) => (at, scene.camera.n_pixels()),
            None => (self.raster, region.area() as f32),
        };
        if !region.contains(raster.map(|x| x.floor() as i32)) {
            return None;
        }
        let rgb = scene.film_rgb(c.weighted * pixels, &wl);
        let size = rgb.iter().map(|c| c.abs()).sum::<f32>() / (3.0 * self.map.brightness_at(raster));
        (size > 0.0 && size.is_finite()).then_some(Value { raster, rgb, size })
    }
}

#[cfg(test)]
mod tests {
    use sampling::mis::Heuristic;
    use sampling::rng::Rng;

    use super::*;
    use crate::bdpt::weighting;
    use crate::test_scene::load;

    /// Chains start at paths of samples: what these add, and what a chain makes of the same numbers, must be one thing.
    #[test]
    fn a_path_has_one_value_however_many_others_are_made_beside_it() {
        for (name, spectral, longest) in [
            ("dispersion", true, 0),
            ("dispersion", true, 2),
            ("smoke", false, 0),
            ("wax", false, 0),
            ("wide-lens", false, 0),
        ] {
            let scene = load(name, spectral);
            let map = Map::even(scene.settings().sample_bounds());
            let manifold = Manifold::new(&scene, longest);
            let world = World { scene: &scene, manifold: manifold.as_ref() };
            let weighting = Weighting { manifold: longest as usize, ..weighting(&scene, Heuristic::Power) };
            let mut target = Target::new(world, weighting, &map);
            let mut compared = 0;
            for i in 0..200 {
                let mut rng = Rng::from_parts(&[i]);
                let seeds = [rng.next_u64(), rng.next_u64(), rng.next_u64()];
                let mut found = Vec::new();
                let mut numbers = Numbers::default();
                target
                    .evaluate_all(5, &mut numbers, seeds, |technique, value| found.push((technique, *value)));
                for (technique, value) in found {
                    let mut numbers = Numbers::default();
                    let alone = target.evaluate(technique, &mut numbers, of_technique(seeds, technique));
                    assert_eq!((alone.rgb, alone.raster), (value.rgb, value.raster), "{name} {technique:?}");
                    compared += 1;
                }
            }
            assert!(compared > 100, "{name}: {compared}");
        }
    }
}
