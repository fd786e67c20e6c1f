//! What is found out before the first pass, once: how bright the image is, and by which techniques.
//!
//! The plan is a pure function of scene, settings and seed, and the same for all passes. It decides who does what, and
//! no plan makes the mean wrong: not even that of a pilot that found no light.

use math::Bounds2i;
use rayon::prelude::{IntoParallelIterator, ParallelIterator};
use scene::Scene;

use super::block::{Block, MOST_EVENTS, Places, Rules, Survival};
use super::map::Map;
use super::space::Technique;
use crate::Counters;

/// Keeps the numbers of the pilot apart from those of passes.
const PILOT: u64 = 0x9_1107;

/// Samples of a block of the pilot.
const PER_BLOCK: usize = 512;

/// Shares of the work.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    /// Mean of what an independent sample finds; zero if that is not known.
    pub(super) mean: f64,
    pub(super) map: Map,
    /// How large steps choose.
    pub(super) techniques: Techniques,
}

impl Plan {
    /// Knows nothing.
    pub(super) fn blank(region: Bounds2i, rules: &Rules, has_lens: bool) -> Self {
        let techniques = Techniques::new(rules, has_lens, &[]);
        Self { mean: 0.0, map: Map::even(region), techniques }
    }

    /// Two rounds of `samples` samples: for mean and techniques, and then, with chains, for the map.
    pub(super) fn by_pilot(scene: &Scene, rules: Rules, samples: usize, seed: u64) -> (Self, Counters) {
        let region = scene.settings().sample_bounds();
        let has_lens = scene.camera.has_lens();
        let mut plan = Self::blank(region, &rules, has_lens);
        let mut counters = Counters::default();
        if region.area() == 0 || samples == 0 || rules.max_depth == 0 {
            return (plan, counters);
        }
        let blocks = samples.div_ceil(PER_BLOCK);
        let places = |b| Places { first: b, stride: blocks, of: samples };
        let key = |round: u64, b: usize| {
            [PILOT, seed, round, b as u64].iter().fold(0, |h, &x| math::hash::combine(h, x))
        };

        let rounds: Vec<_> = (0..blocks)
            .into_par_iter()
            .map(|b| {
                let mut block = Block::new(rules, &plan, scene, key(0, b), places(b));
                let mut masses = Masses::default();
                block.sample(&mut |technique, value, survival, _| {
                    masses.add(technique, f64::from(value.size / survival));
                });
                (masses, block.counters())
            })
            .collect();
        let mut masses = Masses::default();
        for (m, c) in &rounds {
            masses.merge(m);
            counters.add(c);
        }
        plan.mean = masses.total() / samples as f64;
        plan.techniques = Techniques::new(&rules, has_lens, &masses.0);

        let rounds: Vec<_> = (0..blocks)
            .into_par_iter()
            .map(|b| {
                let mut block = Block::new(rules, &plan, scene, key(1, b), places(b));
                let mut sums = vec![0.0_f64; plan.map.n_cells()];
                block.run(&mut |raster, rgb| {
                    let size = f64::from(rgb.iter().map(|c| c.abs()).sum::<f32>() / 3.0);
                    if size.is_finite() {
                        sums[plan.map.cell_at(raster)] += size;
                    }
                });
                (sums, block.counters())
            })
            .collect();
        let mut sums = vec![0.0; plan.map.n_cells()];
        for (s, c) in &rounds {
            sums.iter_mut().zip(s).for_each(|(sum, x)| *sum += x);
            counters.add(c);
        }
        plan.map.set(&sums);
        plan.mean = (0..sums.len()).map(|i| sums[i] / f64::from(plan.map.brightness(i))).sum();
        (plan, counters)
    }
}

/// What each technique makes, in the order of [`index`].
#[derive(Clone, Debug, Default)]
struct Masses(Vec<f64>);

impl Masses {
    fn add(&mut self, technique: Technique, mass: f64) {
        let i = index(technique);
        if self.0.len() <= i {
            self.0.resize(i + 1, 0.0);
        }
        self.0[i] += mass;
    }

    fn merge(&mut self, other: &Self) {
        self.0.resize(self.0.len().max(other.0.len()), 0.0);
        self.0.iter_mut().zip(&other.0).for_each(|(a, b)| *a += b);
    }

    fn total(&self) -> f64 {
        self.0.iter().sum()
    }
}

/// Techniques one after the other: 1 event and s = 0 to 3, 2 events and s = 0 to 4, and so on.
fn index(t: Technique) -> usize {
    let n = t.events as usize;
    (n - 1) * (n + 6) / 2 + t.s as usize
}

/// Part of the large steps that go to any technique, whatever the pilot found.
const ANY: f32 = 0.15;

/// A distribution over techniques.
#[derive(Clone, Debug)]
pub(super) struct Techniques {
    max_events: u32,
    has_lens: bool,
    survival: Survival,
    /// Of the pilot's masses, summed up to each; empty if it found nothing.
    sums: Vec<f64>,
    /// All chances of [`Survival`] up to `max_events`.
    survivals: f64,
}

impl Techniques {
    fn new(rules: &Rules, has_lens: bool, masses: &[f64]) -> Self {
        let (max_events, survival) = (rules.max_depth.min(MOST_EVENTS), rules.survival);
        let mut sums: Vec<f64> = masses
            .iter()
            .scan(0.0, |sum, m| {
                *sum += m;
                Some(*sum)
            })
            .collect();
        if !sums.last().is_some_and(|s| *s > 0.0 && s.is_finite()) {
            sums.clear();
        }
        let survivals = (1..=max_events).map(|n| f64::from(survival.chance(n))).sum();
        Self { max_events, has_lens, survival, sums, survivals }
    }

    pub(super) fn sample(&self, [u_kind, u, u_s]: [f32; 3]) -> Technique {
        if let Some(total) = self.sums.last().filter(|_| u_kind >= ANY) {
            let at = self.sums.partition_point(|s| *s <= f64::from(u) * total);
            let mut events = 1;
            while index(Technique { events: events + 1, s: 0 }) <= at {
                events += 1;
            }
            let s = (at - index(Technique { events, s: 0 })) as u32;
            return Technique { events, s };
        }
        let mut rest = f64::from(u) * self.survivals;
        let mut events = 1;
        while events < self.max_events && rest >= f64::from(self.survival.chance(events)) {
            rest -= f64::from(self.survival.chance(events));
            events += 1;
        }
        let n = Technique::of_events(events, self.has_lens);
        Technique { events, s: ((u_s * n as f32) as u32).min(n - 1) }
    }

    pub(super) fn probability(&self, technique: Technique) -> f32 {
        let n = Technique::of_events(technique.events, self.has_lens);
        let any = f64::from(self.survival.chance(technique.events)) / (self.survivals * f64::from(n));
        let Some(total) = self.sums.last() else { return any as f32 };
        let i = index(technique);
        let mass = match self.sums.get(i) {
            Some(sum) => sum - i.checked_sub(1).map_or(0.0, |i| self.sums[i]),
            None => 0.0,
        };
        (f64::from(ANY) * any + f64::from(1.0 - ANY) * mass / total) as f32
    }
}

#[cfg(test)]
mod tests {
    use sampling::rng::Rng;

    use super::*;
    use crate::bdpt::{Techniques as Ways, Weighting};

    const RULES: Rules = Rules {
        weighting: Weighting {
            heuristic: sampling::mis::Heuristic::Power,
            techniques: Ways::BIDIRECTIONAL,
            lens_is_hittable: false,
            light_share: 1.0,
        },
        max_depth: 0,
        survival: Survival::WITHOUT_MEDIA,
        mutations: 1,
        chain: 1,
        large_steps: 0.1,
    };

    #[test]
    fn techniques_have_the_probabilities_that_are_told() {
        let masses = [0.0, 3.0, 1.0, 0.0, 2.0, 0.0, 4.0];
        for (max, masses) in [(1, &masses[..3]), (3, &masses[..]), (3, &[]), (u32::MAX, &masses[..])] {
            let techniques = Techniques::new(&Rules { max_depth: max, ..RULES }, false, masses);
            let (n, mut rng) = (200_000, Rng::from_parts(&[3]));
            let mut counts = [0_u32; 40];
            for _ in 0..n {
                let t = techniques.sample([rng.next_f32(), rng.next_f32(), rng.next_f32()]);
                assert!(t.events >= 1 && t.events <= max && t.s < t.events + 2, "{t:?}");
                if let Some(c) = counts.get_mut(index(t)) {
                    *c += 1;
                }
            }
            for events in 1..=max.min(4) {
                for s in 0..events + 2 {
                    let t = Technique { events, s };
                    let (p, c) = (techniques.probability(t), counts[index(t)] as f32 / n as f32);
                    // Five standard deviations.
                    assert!((p - c).abs() < 5.0 * (p / n as f32).sqrt() + 1e-6, "{max} {t:?}: {p} {c}");
                }
            }
        }
    }
}
