//! Multiplexed Metropolis light transport [Hachisuka2014]: a Markov chain in the space of the random numbers that make
//! a path [Kelemen2002], over the strategies of bidirectional path tracing.
//!
//! A point of primary sample space is three streams of numbers: for the walk from the eye, for the walk from the light
//! and for joining them. The third begins with the number of scattering events (kept by small steps) and the strategy
//! (s, t); the value is the strategy's weighted contribution over the probability of both choices.
//!
//! A block of a pass is one chain, a pure function of (seed, pass, block). It draws its own bootstrap and starts at one
//! of those paths, chosen by size; all that it leaves has the bootstrap's mean as its weight. So every chain has the
//! right mean from its first state on [Veach1997, sec. 11.3.1], and passes average to the right image. Both states of
//! a step are recorded with their expected shares [Veach1997, sec. 11.5].
//!
//! Small steps have sizes between 1/1024 and 1/64, even in their logarithm [Kelemen2002]. Numbers that no state of the
//! chain has read so far are drawn when they are, for both states of the step.
//!
//! Departs from [Hachisuka2014]: one chain visits paths of all lengths (by large steps); lengths are drawn by a geometric
//! distribution, so that there may be no limit. Emitters that are seen directly (depth 0) come from camera rays.
//! Left out: paths of more than some hundred scattering events, which the 24 bits of one number do not reach.

use math::trig;
use sampling::Sampler;
use sampling::rng::Rng;
use scene::Scene;
use spectrum::Wavelengths;

use crate::bdpt::{Joint, Subpaths, Walks, Weighting, weighting};
use crate::common::{DirectionSampling, PixelLoop, Roulette, Subpath, place_in, sampler_of};
use crate::parameters::{ParameterInfo, ParameterKind, Parameters, shared};
use crate::path::Path;
use crate::registry::{IntegratorInfo, Making, refuses_turning_strands};
use crate::{Cell, CellOutput, Counters, Integrator, PassContext};

/// For the registry.
pub(crate) const INFO: IntegratorInfo = IntegratorInfo {
    name: "mlt",
    purpose: "chains that stay where the light is: light that is hard to find, such as through a door ajar",
    misses: "what bdpt misses; where light is easy its noise is blotchy and fades more slowly",
    unbiased: true,
    refuses: refuses_turning_strands,
    parameters,
    make,
};

fn parameters() -> Vec<ParameterInfo> {
    vec![
        shared::MAX_DEPTH,
        shared::HEURISTIC,
        ParameterInfo {
            name: "mutations",
            kind: ParameterKind::Integer(16_384),
            doc: "steps of a chain; a pass has one step per pixel, and so many chains",
        },
        ParameterInfo {
            name: "bootstrap",
            kind: ParameterKind::Integer(4096),
            doc: "independent paths from which a chain's start is chosen and its weight estimated",
        },
        ParameterInfo {
            name: "large_steps",
            kind: ParameterKind::Float(0.3),
            doc: "probability of a step to a new, independent path",
        },
    ]
}

fn make(p: &Parameters, making: &Making<'_>) -> Box<dyn Integrator> {
    let heuristic = shared::heuristic(p);
    let directly = PixelLoop {
        estimator: Path {
            max_depth: 0,
            roulette: Roulette { rr_depth: 0 },
            lights: None,
            directions: DirectionSampling::Bsdf,
            shortcut: (),
            guide: None,
        },
        sampler: sampler_of(making.sampler, making.seed),
    };
    Box::new(Metropolis {
        directly,
        seed: making.seed,
        max_depth: p.limit("max_depth"),
        weighting: weighting(making.scene, heuristic),
        mutations: p.integer("mutations").max(1),
        bootstrap: p.integer("bootstrap").max(1),
        large_steps: p.float("large_steps").clamp(0.0, 1.0),
    })
}

struct Metropolis {
    /// Emitters that the eye sees.
    directly: PixelLoop<Path>,
    seed: u64,
    max_depth: u32,
    weighting: Weighting,
    mutations: u32,
    bootstrap: u32,
    large_steps: f32,
}

/// Keeps the numbers of chains apart from those of samplers.
const CHAIN: u64 = 0x3317;

/// Ratio of the chances of one scattering event more and one less.
const PER_DEPTH: f32 = 0.85;

/// The three streams of numbers.
const N_STREAMS: usize = 3;
const EYE: usize = 0;
const LIGHT: usize = 1;
const JOINT: usize = 2;

/// A point of primary sample space: numbers as far as they were read.
type Numbers = [Vec<f32>; N_STREAMS];

/// What a point adds to the film.
#[derive(Clone, Copy, Debug, Default)]
struct Value {
    raster: [f32; 2],
    rgb: [f32; 3],
}

impl Value {
    /// What the chain visits it in proportion to.
    fn size(&self) -> f32 {
        self.rgb.iter().map(|c| c.abs()).sum::<f32>() / 3.0
    }
}

impl Integrator for Metropolis {
    fn splats(&self) -> bool {
        true
    }

    fn light_blocks(&self, scene: &Scene) -> u32 {
        if self.max_depth == 0 { 0 } else { (n_steps(scene) / self.mutations).max(1) }
    }

    fn cell(&self, ctx: PassContext<'_>, cell: Cell, out: &mut CellOutput) {
        match cell {
            Cell::Tile(_) => self.directly.cell(ctx, cell, out),
            Cell::LightBlock(block) => {
                let key = [CHAIN, self.seed, u64::from(ctx.pass), u64::from(block)];
                let blocks = u64::from(self.light_blocks(ctx.scene));
                let total = u64::from(n_steps(ctx.scene));
                let edge = |b: u32| u64::from(b) * total / blocks;
                let chain = Chain {
                    settings: self,
                    scene: ctx.scene,
                    rng: Rng::from_parts(&key),
                    paths: Subpaths::default(),
                    current: Numbers::default(),
                    proposal: Numbers::default(),
                };
                chain.run(edge(block + 1) - edge(block), 1.0 / total as f32, out);
            }
        }
    }
}

/// Steps of a pass: one for every pixel that is rendered.
fn n_steps(scene: &Scene) -> u32 {
    u32::try_from(scene.settings().sample_bounds().area()).unwrap_or(u32::MAX)
}

/// A chain on its way.
struct Chain<'a> {
    settings: &'a Metropolis,
    scene: &'a Scene,
    rng: Rng,
    paths: Subpaths,
    current: Numbers,
    proposal: Numbers,
}

impl Chain<'_> {
    /// Bootstrap, then `steps` steps, each counting `share`.
    fn run(mut self, steps: u64, share: f32, out: &mut CellOutput) {
        let Some((mut state, weight)) = self.start(&mut out.counters) else { return };
        let splat = |value: &Value, chance: f32, out: &mut CellOutput| {
            let factor = weight * share * chance / value.size();
            if chance > 0.0 && factor.is_finite() {
                out.splats.add(value.raster, value.rgb.map(|c| c * factor));
            }
        };
        for _ in 0..steps {
            let is_small = self.propose();
            let mut numbers = std::mem::take(&mut self.proposal);
            let proposed = self.evaluate(&mut numbers, &mut out.counters);
            self.proposal = numbers;
            if is_small {
                remember(&mut self.current, &self.proposal, &mut self.rng);
            }
            let acceptance = (proposed.size() / state.size()).min(1.0);
            splat(&proposed, acceptance, out);
            splat(&state, 1.0 - acceptance, out);
            if self.rng.next_f32() < acceptance {
                state = proposed;
                std::mem::swap(&mut self.current, &mut self.proposal);
            }
        }
    }

    /// The first state and the weight of all; `None` if no path of the bootstrap carries light.
    fn start(&mut self, counters: &mut Counters) -> Option<(Value, f32)> {
        let n = self.settings.bootstrap;
        let mut sum = 0.0;
        let mut chosen = None;
        for _ in 0..n {
            let mut numbers = std::mem::take(&mut self.proposal);
            numbers.iter_mut().for_each(Vec::clear);
            let value = self.evaluate(&mut numbers, counters);
            self.proposal = numbers;

            // Keep this one with its share of the sum so far: in the end each is kept in proportion to its size.
            let size = f64::from(value.size());
            sum += size;
            if self.rng.next_f64() * sum < size {
                chosen = Some(value);
                std::mem::swap(&mut self.current, &mut self.proposal);
            }
        }
        chosen.map(|value| (value, (sum / f64::from(n)) as f32))
    }

    /// Makes the proposal from the current state; is it a small step?
    fn propose(&mut self) -> bool {
        let is_large = self.rng.next_f32() < self.settings.large_steps;
        for (stream, (from, to)) in self.current.iter().zip(&mut self.proposal).enumerate() {
            to.clear();
            if is_large {
                continue;
            }
            to.extend_from_slice(from);
            let kept = usize::from(stream == JOINT);
            for x in to.iter_mut().skip(kept) {
                *x = nudged(*x, self.rng.next_f32());
            }
        }
        !is_large
    }

    /// The value of a point; the numbers that it reads for the first time are appended.
    fn evaluate(&mut self, numbers: &mut Numbers, counters: &mut Counters) -> Value {
        let mut samplers = [EYE, LIGHT, JOINT]
            .map(|i| Sampler::replay(std::mem::take(&mut numbers[i]), self.rng.next_u64()));
        let value = self.value(&mut samplers, counters).unwrap_or_default();
        *numbers = samplers.map(Sampler::into_replayed);
        if value.size().is_finite() { value } else { Value::default() }
    }

    fn value(
        &mut self,
        [eye, light, joint]: &mut [Sampler; N_STREAMS],
        counters: &mut Counters,
    ) -> Option<Value> {
        let scene = self.scene;
        let (depth, chance) = depth_of(joint.next_1d(), self.settings.max_depth);
        let has_lens = usize::from(scene.camera.has_lens());
        let (n, u) = (depth + 2 + has_lens, joint.next_1d());
        let s = ((u * n as f32) as usize).min(n - 1);
        let t = depth + 2 - s;

        // The eye's first numbers mean the same whatever the strategy.
        let mut wl = match scene.settings().spectral {
            true => Wavelengths::sample_visible(eye.next_1d()),
            false => Wavelengths::RGB,
        };
        let region = scene.settings().sample_bounds();
        let raster = place_in(&region, eye.next_2d());
        let walks = Walks {
            scene,
            lengths: [t.saturating_sub(1), s.saturating_sub(1)],
            roulette: Roulette { rr_depth: u32::MAX },
            shared: None,
        };
        walks.eye(raster, eye, &mut wl, counters, &mut self.paths);
        if s >= 2 {
            walks.light(light, &mut wl, counters, &mut self.paths);
        }
        // Vertices of the two walks up to so many events.
        let vertices = |path: &Subpath, n: usize| match n {
            0 | 1 => Some(n),
            _ => path.vertices_to(n - 1).map(|vertices| vertices + 1),
        };
        let (s, t) = (vertices(&self.paths.light, s)?, vertices(&self.paths.eye, t)?);
        let (weighting, paths) = (self.settings.weighting, &mut self.paths);
        let c = Joint { scene, weighting, wl, paths, sampler: joint, counters }.strategy(s, t)?;

        // Radiance is spread over the region, a splat is an integral over the film already.
        let (raster, pixels) = match c.splat {
            Some(at) => (at, scene.camera.n_pixels()),
            None => (raster, region.area() as f32),
        };
        let pixel = raster.map(|x| x.floor() as i32);
        let factor = pixels * n as f32 / chance;
        let value = Value { raster, rgb: scene.film_rgb(c.weighted * factor, &wl) };
        region.contains(pixel).then_some(value)
    }
}

/// The number of scattering events, at least one, by a geometric distribution cut at `max`, and its probability.
fn depth_of(u: f32, max: u32) -> (usize, f32) {
    let n = max.min(200);
    let sum = (0..n).fold((0.0_f32, 1.0_f32), |(sum, p), _| (sum + p, p * PER_DEPTH)).0;
    let (mut rest, mut p) = (u * sum, 1.0);
    let mut depth = 1;
    while rest >= p && depth < n as usize {
        rest -= p;
        p *= PER_DEPTH;
        depth += 1;
    }
    (depth, p / sum)
}

/// Gives a state its own values of numbers that only a small step from it has read: what the proposal's would have come
/// from. Without them a rejected step would leave no trace, and the chain would not be reversible.
fn remember(current: &mut Numbers, proposal: &Numbers, rng: &mut Rng) {
    for (own, proposed) in current.iter_mut().zip(proposal) {
        for &x in proposed.iter().skip(own.len()) {
            own.push(nudged(x, rng.next_f32()));
        }
    }
}

/// A small step, which wraps around.
fn nudged(x: f32, u: f32) -> f32 {
    // One half of u is the sign, the rest the size 1/64 · 16^-v.
    const LN_RATIO: f32 = 2.772_588_7;
    let (sign, v) = if u < 0.5 { (1.0, 2.0 * u) } else { (-1.0, 2.0 * u - 1.0) };
    let y = x + sign * trig::exp(-LN_RATIO * v) / 64.0;
    let y = y - y.floor();
    if y < 1.0 { y } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_have_the_probabilities_that_are_told() {
        for max in [1, 2, 5, u32::MAX] {
            let n = 100_000;
            let mut counts = [0_u32; 8];
            for i in 0..n {
                let (depth, p) = depth_of((i as f32 + 0.5) / n as f32, max);
                assert!(depth >= 1 && depth <= max as usize && p > 0.0);
                if let Some(c) = counts.get_mut(depth) {
                    *c += 1;
                }
            }
            for (depth, &count) in counts.iter().enumerate().filter(|(_, c)| **c > 0) {
                let told = (0..n).find_map(|i| {
                    let (d, p) = depth_of((i as f32 + 0.5) / n as f32, max);
                    (d == depth).then_some(p)
                });
                assert!((count as f32 / n as f32 - told.unwrap()).abs() < 1e-3, "{max} {depth}");
            }
        }
    }

    #[test]
    fn a_state_keeps_numbers_that_a_small_step_read_first() {
        let mut current: Numbers = [vec![0.5], vec![], vec![0.1, 0.2]];
        let proposal: Numbers = [vec![0.51, 0.999, 0.25], vec![0.75], vec![0.1]];
        remember(&mut current, &proposal, &mut Rng::from_parts(&[1]));
        assert_eq!(current.each_ref().map(Vec::len), [3, 1, 2]);
        assert_eq!((current[0][0], &current[2]), (0.5, &vec![0.1, 0.2]), "what it had stays");
        for (own, proposed) in [(current[0][1], 0.999), (current[0][2], 0.25), (current[1][0], 0.75_f32)] {
            let d = (own - proposed).abs();
            let d = d.min(1.0 - d);
            assert!(d <= 1.0 / 64.0 + 1e-6 && d > 0.0, "{own} is one small step from {proposed}");
        }
    }

    #[test]
    fn small_steps_are_small_symmetric_and_stay_in_the_unit_interval() {
        let n = 1000;
        let mut mean = 0.0;
        for i in 0..n {
            let d = nudged(0.5, (i as f32 + 0.5) / n as f32) - 0.5;
            assert!(d.abs() <= 1.0 / 64.0 + 1e-6 && d.abs() >= 1.0 / 1025.0);
            mean += d / n as f32;
            for x in [0.0, 1e-9, 0.999_999_9] {
                assert!((0.0..1.0).contains(&nudged(x, i as f32 / n as f32)));
            }
        }
        assert!(mean.abs() < 1e-6);
    }
}
