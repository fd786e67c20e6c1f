//! A block of a pass: independent samples over the whole film, and chains that start at what they found.
//!
//! Every chain has the same length, and how many there are follows from what the samples found, so that each step
//! carries about the same [Cline2005]. A chain's start is drawn in proportion to its size, and its steps share the mean
//! of all sizes; so it has the right mean from its first state on [Veach1997, sec. 11.3.1], whatever the steps are that
//! it is made of, and however many chains there are.
//!
//! Samples and chains make the same paths. Where one has the density p of a path and the other q, both are weighted by
//! the balance heuristic, so that chains have what is bright and rare, and samples the rest.

use sampling::rng::Rng;
use scene::Scene;

use super::plan::Plan;
use super::space::{Change, EYE, N_STREAMS, Numbers, Technique, change, remember};
use super::target::{Seeds, Target, Value, World, of_technique};
use crate::Counters;
use crate::bdpt::Weighting;

/// What is the same for all blocks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rules {
    pub(super) weighting: Weighting,
    pub(super) max_depth: u32,
    pub(super) survival: Survival,
    /// Steps of chains per sample.
    pub(super) mutations: u32,
    /// Steps of a chain.
    pub(super) chain: u32,
    /// Probability of a step to a new, independent path.
    pub(super) large_steps: f32,
}

/// Which samples a block has: of `of` places, `first`, `first + stride`, and so on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Places {
    pub(super) first: usize,
    pub(super) stride: usize,
    pub(super) of: usize,
}

impl Places {
    fn len(self) -> usize {
        self.of.saturating_sub(self.first).div_ceil(self.stride)
    }
}

/// How much a step of a chain is worth beside an independent sample: steps resemble those before.
const STEP_WORTH: f32 = 0.25;

/// More chains than this times the usual number are never made, however much was found.
const MOST_CHAINS: f64 = 4.0;

/// Samples make all paths of so few scattering events; longer ones by a chance.
const SURE_EVENTS: u32 = 3;

/// Chance of one scattering event more, without media and with them, where long paths carry much.
const PER_EVENT: [f32; 2] = [0.75, 0.95];

/// Paths of more scattering events than this are left out.
pub(super) const MOST_EVENTS: u32 = 200;

/// A path that a chain may start from.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    sample: u64,
    technique: Technique,
    size: f64,
}

/// Where contributions go.
pub(super) type Sink<'a> = &'a mut dyn FnMut([f32; 2], [f32; 3]);

/// A block at work.
pub(super) struct Block<'a> {
    rules: Rules,
    plan: &'a Plan,
    target: Target<'a>,
    /// Of the block.
    key: u64,
    rng: Rng,
    places: Places,
    current: Numbers,
    proposal: Numbers,
    candidates: Vec<Candidate>,
}

impl<'a> Block<'a> {
    pub(super) fn new(rules: Rules, plan: &'a Plan, world: World<'a>, key: u64, places: Places) -> Self {
        Self {
            rules,
            plan,
            target: Target::new(world, rules.weighting, &plan.map),
            key,
            rng: Rng::from_parts(&[key, 1]),
            places,
            current: Numbers::default(),
            proposal: Numbers::default(),
            candidates: Vec::new(),
        }
    }

    /// What was done.
    pub(super) fn counters(&self) -> Counters {
        self.target.counters
    }

    /// Samples, then chains. What `sink` gets over all blocks of a pass adds up to the image times the pixels.
    pub(super) fn run(&mut self, sink: Sink<'_>) {
        let share = 1.0 / self.places.of as f32;
        self.sample(&mut |_, value, survival, own| {
            let factor = share * own.of_sample(value.size, survival);
            sink(value.raster, value.rgb.map(|c| c * factor));
        });
        let Some(found) = Found::new(&self.candidates, self.places.len()) else { return };

        // So many chains that each step carries what a step does where all is as the pilot said.
        let (n, length) = (self.places.len() as f64, f64::from(self.rules.chain));
        let usual = (f64::from(self.rules.mutations) * n / length).max(1.0);
        let wanted = if self.plan.mean > 0.0 { usual * found.mean / self.plan.mean } else { usual };
        let chains = wanted.clamp(1.0, MOST_CHAINS * usual).round() as usize;
        if self.rules.mutations == 0 {
            return;
        }
        let deposit = (found.mean * n / (chains as f64 * length)) as f32 * share;
        let offset = self.rng.next_f64();
        let (mut next, mut before) = (0, 0.0);
        for i in 0..self.candidates.len() {
            let candidate = self.candidates[i];
            before += candidate.size;
            while next < chains && (next as f64 + offset) * found.total < before * chains as f64 {
                self.chain(candidate, deposit, sink);
                next += 1;
            }
        }
    }

    // ---- independent samples ----

    /// Draws the block's samples; each gets the sample's technique, value and the chance that it is made, and all are
    /// kept as candidates.
    pub(super) fn sample(&mut self, each: &mut dyn FnMut(Technique, &Value, f32, Shares)) {
        let mut candidates = std::mem::take(&mut self.candidates);
        candidates.clear();
        let (shares, of) = (self.shares(), self.rules.survival);
        for i in 0..self.places.len() {
            let sample = i as u64;
            let mut numbers = std::mem::take(&mut self.proposal);
            let u = self.begin(sample, &mut numbers);
            let key = self.key;
            self.target.evaluate_all(
                of.longest(u, self.rules.max_depth),
                &mut numbers,
                seeds(key, sample),
                |technique, value| {
                    let survival = of.chance(technique.events);
                    let size = f64::from(value.size / survival);
                    candidates.push(Candidate { sample, technique, size });
                    each(technique, value, survival, shares);
                },
            );
            self.proposal = numbers;
        }
        self.candidates = candidates;
    }

    /// The first numbers of a sample, which put it into its place on the film; returns one more.
    fn begin(&self, sample: u64, numbers: &mut Numbers) -> f32 {
        numbers.iter_mut().for_each(Vec::clear);
        let mut rng = Rng::from_parts(&[self.key, 2, sample]);
        let region = self.target.scene.settings().sample_bounds();
        let (width, height) = (region.width(), region.height());
        // The pilot has fewer samples than there are pixels, or more.
        let place = self.places.first + sample as usize * self.places.stride;
        let pixel = match self.places.of == width * height {
            true => [place % width, place / width].map(|i| i as f32),
            false => [rng.next_f32() * width as f32, rng.next_f32() * height as f32].map(f32::floor),
        };
        if self.target.film_number() > 0 {
            numbers[EYE].push(rng.next_f32());
        }
        let size = [width as f32, height as f32];
        for a in 0..2 {
            let u = (pixel[a] + rng.next_f32()) / size[a];
            numbers[EYE].push(u.min(1.0_f32.next_down()));
        }
        rng.next_f32()
    }

    fn shares(&self) -> Shares {
        let steps = STEP_WORTH * self.rules.mutations as f32;
        match self.plan.mean {
            mean if mean > 0.0 => Shares { per_size: Some((f64::from(steps) / mean) as f32) },
            _ if self.rules.mutations == 0 => Shares { per_size: Some(0.0) },
            _ => Shares { per_size: None },
        }
    }

    // ---- chains ----

    /// A chain from one of the samples, each step of which carries `deposit`.
    fn chain(&mut self, from: Candidate, deposit: f32, sink: Sink<'_>) {
        let mut current = std::mem::take(&mut self.current);
        let _ = self.begin(from.sample, &mut current);
        let seeds = of_technique(seeds(self.key, from.sample), from.technique);
        let mut technique = from.technique;
        let mut state = self.target.evaluate(technique, &mut current, seeds);
        self.current = current;
        if state.size <= 0.0 {
            return;
        }
        let (shares, of) = (self.shares(), self.rules.survival);
        let mut record = |value: &Value, technique: Technique, chance: f32| {
            if chance > 0.0 {
                let factor = deposit * chance * shares.of_step(value.size, of.chance(technique.events));
                sink(value.raster, value.rgb.map(|c| c * factor));
            }
        };
        for _ in 0..self.rules.chain {
            let (proposed, changes, correction) = self.propose(technique);
            let value = self.evaluate(proposed);
            remember(&mut self.current, &self.proposal, changes, &mut self.rng);
            let acceptance = (value.size / state.size * correction).min(1.0);
            record(&value, proposed, acceptance);
            record(&state, technique, 1.0 - acceptance);
            if self.rng.next_f32() < acceptance {
                (state, technique) = (value, proposed);
                std::mem::swap(&mut self.current, &mut self.proposal);
            }
        }
    }

    /// The value of the proposal; nothing for a path that is too short or too long.
    fn evaluate(&mut self, technique: Technique) -> Value {
        if technique.events == 0 || technique.events > self.rules.max_depth.min(MOST_EVENTS) {
            return Value::default();
        }
        let seeds = [self.rng.next_u64(), self.rng.next_u64(), self.rng.next_u64()];
        let mut numbers = std::mem::take(&mut self.proposal);
        let value = self.target.evaluate(technique, &mut numbers, seeds);
        self.proposal = numbers;
        value
    }

    /// Makes the proposal from the current state: its technique, what was changed, and by how much more often the
    /// step back is proposed.
    fn propose(&mut self, technique: Technique) -> (Technique, [Change; N_STREAMS], f32) {
        let u = self.rng.next_f32();
        let large = self.rules.large_steps;
        let (mut proposed, mut correction) = (technique, 1.0);
        let changes = if u < large {
            let us = [self.rng.next_f32(), self.rng.next_f32(), self.rng.next_f32()];
            proposed = self.plan.techniques.sample(us);
            let [back, there] = [technique, proposed].map(|t| self.plan.techniques.probability(t));
            correction = back / there;
            [Change::ALL_NEW; N_STREAMS]
        } else {
            match (u - large) / (1.0 - large) {
                // All numbers a little.
                v if v < 0.35 => [Change::Nudged; N_STREAMS],
                // One end of the path anew from some number on.
                v if v < 0.75 && technique.t() > 1 => {
                    let kept = (self.rng.next_f32() * 16.0) as usize;
                    [Change::Redrawn(kept), Change::NONE, Change::NONE]
                }
                v if v < 0.85 && technique.s > 1 => {
                    let kept = (self.rng.next_f32() * 16.0) as usize;
                    [Change::NONE, Change::Redrawn(kept), Change::NONE]
                }
                v if v < 0.85 => [Change::Nudged, Change::Nudged, Change::ALL_NEW],
                // A vertex more or less on one side.
                _ => {
                    proposed = self.lengthened(technique);
                    [Change::NONE; N_STREAMS]
                }
            }
        };
        change(&self.current, &mut self.proposal, changes, &mut self.rng);
        (proposed, changes, correction)
    }

    /// One vertex more or less, from the eye, or from the light or over a chain to it; as likely back. No events: there is no such
    /// path.
    fn lengthened(&mut self, t: Technique) -> Technique {
        let none = Technique::default();
        let Technique { events, s, chain } = t;
        // A chain has at least one delta, and no walk from the light beside it.
        let [n, least] = if chain == 0 { [s, 0] } else { [chain, 1] };
        let (events, n) = match (self.rng.next_f32() * 4.0) as u32 {
            0 => (events + 1, n),
            1 => (events - 1, n),
            2 => (events + 1, n + 1),
            _ if n == least => return none,
            _ => (events - 1, n - 1),
        };
        let longer =
            if chain == 0 { Technique { events, s: n, chain } } else { Technique { events, s, chain: n } };
        if self.target.kinds.has(longer) { longer } else { none }
    }
}

/// How a path's contribution is dealt to samples and chains.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shares {
    /// Density of chains over that of samples and over the size; `None`: chains have all.
    per_size: Option<f32>,
}

impl Shares {
    /// Factor on what an independent sample adds, which is made with the chance `survival`.
    fn of_sample(self, size: f32, survival: f32) -> f32 {
        self.per_size.map_or(0.0, |k| 1.0 / (k * size + survival))
    }

    /// Factor on what a state of a chain adds for each unit that it carries.
    fn of_step(self, size: f32, survival: f32) -> f32 {
        self.per_size.map_or(1.0 / size, |k| k / (k * size + survival))
    }
}

/// What the samples found.
struct Found {
    total: f64,
    /// Per sample.
    mean: f64,
}

impl Found {
    fn new(candidates: &[Candidate], samples: usize) -> Option<Self> {
        let total: f64 = candidates.iter().map(|c| c.size).sum();
        (total > 0.0).then(|| Self { total, mean: total / samples as f64 })
    }
}

/// Seeds of a sample's numbers.
fn seeds(key: u64, sample: u64) -> Seeds {
    let mut rng = Rng::from_parts(&[key, 3, sample]);
    [rng.next_u64(), rng.next_u64(), rng.next_u64()]
}

/// How likely a sample is to make long paths.
#[derive(Clone, Copy, Debug)]
pub(super) struct Survival {
    per_event: f32,
}

impl Survival {
    #[cfg(test)]
    pub(super) const WITHOUT_MEDIA: Self = Self { per_event: PER_EVENT[0] };

    pub(super) fn in_scene(scene: &Scene) -> Self {
        Self { per_event: PER_EVENT[usize::from(scene.has_media())] }
    }

    /// The chance that a sample makes paths of so many scattering events.
    pub(super) fn chance(self, events: u32) -> f32 {
        (SURE_EVENTS..events).fold(1.0, |p, _| p * self.per_event)
    }

    /// Most scattering events of a sample's paths.
    fn longest(self, u: f32, max: u32) -> u32 {
        let max = max.min(MOST_EVENTS);
        let mut events = SURE_EVENTS.min(max);
        while events < max && u < self.chance(events + 1) {
            events += 1;
        }
        events
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_as_long_as_their_chances_say() {
        for (max, per_event) in [(1, 0.75), (3, 0.75), (6, 0.75), (u32::MAX, 0.75), (u32::MAX, 0.95)] {
            let survival = Survival { per_event };
            let n = 100_000;
            for events in 1..9.min(max) {
                let made =
                    (0..n).filter(|i| survival.longest((*i as f32 + 0.5) / n as f32, max) >= events).count();
                assert!((made as f32 / n as f32 - survival.chance(events)).abs() < 1e-4, "{max} {events}");
            }
            assert!((0..n).all(|i| survival.longest(i as f32 / n as f32, max) <= max));
        }
    }

    /// What both have of a path, times how often they make it, is the path.
    #[test]
    fn samples_and_chains_share_a_path_without_rest() {
        for k in [0.0, 0.3, 20.0] {
            let shares = Shares { per_size: Some(k) };
            for (size, survival) in [(0.1, 1.0), (3.0, 0.4), (1e6, 0.01)] {
                let sum = survival * shares.of_sample(size, survival) + size * shares.of_step(size, survival);
                assert!((sum - 1.0).abs() < 1e-6, "{k} {size}: {sum}");
            }
        }
        let chains_alone = Shares { per_size: None };
        assert_eq!((chains_alone.of_sample(2.0, 1.0), chains_alone.of_step(2.0, 1.0)), (0.0, 0.5));
    }
}
