//! What is found out before the first pass, once: how bright the image is, and by which techniques.
//!
//! The plan is a pure function of scene, settings and seed, and the same for all passes. It decides who does what, and
//! no plan makes the mean wrong: not even that of a pilot that found no light.

use math::Bounds2i;
use rayon::prelude::{IntoParallelIterator, ParallelIterator};

use super::block::{Block, MOST_EVENTS, Places, Rules, Survival};
use super::map::Map;
use super::space::{Kinds, Technique};
use super::target::World;
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
    pub(super) fn blank(region: Bounds2i, rules: &Rules, kinds: Kinds) -> Self {
        let techniques = Techniques::new(rules, kinds, &[]);
        Self { mean: 0.0, map: Map::even(region), techniques }
    }

    /// Two rounds of `samples` samples: for mean and techniques, and then, with chains, for the map.
    pub(super) fn by_pilot(world: World<'_>, rules: Rules, samples: usize, seed: u64) -> (Self, Counters) {
        let region = world.scene.settings().sample_bounds();
        let kinds = Kinds::of(world.scene, &rules.weighting);
        let mut plan = Self::blank(region, &rules, kinds);
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
                let mut block = Block::new(rules, &plan, world, key(0, b), places(b));
                let mut masses = Masses::new(kinds);
                block.sample(&mut |technique, value, survival, _| {
                    masses.add(technique, f64::from(value.size / survival));
                });
                (masses, block.counters())
            })
            .collect();
        let mut masses = Masses::new(kinds);
        for (m, c) in &rounds {
            masses.merge(m);
            counters.add(c);
        }
        plan.mean = masses.total() / samples as f64;
        plan.techniques = Techniques::new(&rules, kinds, &masses.sums);

        let rounds: Vec<_> = (0..blocks)
            .into_par_iter()
            .map(|b| {
                let mut block = Block::new(rules, &plan, world, key(1, b), places(b));
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

/// What each technique makes, in the order of [`Kinds::index`].
#[derive(Clone, Debug)]
struct Masses {
    kinds: Kinds,
    sums: Vec<f64>,
}

impl Masses {
    fn new(kinds: Kinds) -> Self {
        Self { kinds, sums: Vec::new() }
    }

    fn add(&mut self, technique: Technique, mass: f64) {
        let i = self.kinds.index(technique);
        if self.sums.len() <= i {
            self.sums.resize(i + 1, 0.0);
        }
        self.sums[i] += mass;
    }

    fn merge(&mut self, other: &Self) {
        self.sums.resize(self.sums.len().max(other.sums.len()), 0.0);
        self.sums.iter_mut().zip(&other.sums).for_each(|(a, b)| *a += b);
    }

    fn total(&self) -> f64 {
        self.sums.iter().sum()
    }
}

/// Part of the large steps that go to any technique, whatever the pilot found.
const ANY: f32 = 0.15;

/// A distribution over techniques.
#[derive(Clone, Debug)]
pub(super) struct Techniques {
    max_events: u32,
    kinds: Kinds,
    survival: Survival,
    /// Of the pilot's masses, summed up to each; empty if it found nothing.
    sums: Vec<f64>,
    /// All chances of [`Survival`] up to `max_events`.
    survivals: f64,
}

impl Techniques {
    fn new(rules: &Rules, kinds: Kinds, masses: &[f64]) -> Self {
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
        Self { max_events, kinds, survival, sums, survivals }
    }

    pub(super) fn sample(&self, [u_kind, u, u_s]: [f32; 3]) -> Technique {
        if let Some(total) = self.sums.last().filter(|_| u_kind >= ANY) {
            let at = self.sums.partition_point(|s| *s <= f64::from(u) * total);
            return self.kinds.at(at);
        }
        let mut rest = f64::from(u) * self.survivals;
        let mut events = 1;
        while events < self.max_events && rest >= f64::from(self.survival.chance(events)) {
            rest -= f64::from(self.survival.chance(events));
            events += 1;
        }
        let n = self.kinds.count(events);
        self.kinds.nth(events, ((u_s * n as f32) as u32).min(n - 1))
    }

    pub(super) fn probability(&self, technique: Technique) -> f32 {
        let n = self.kinds.count(technique.events);
        let any = f64::from(self.survival.chance(technique.events)) / (self.survivals * f64::from(n));
        let Some(total) = self.sums.last() else { return any as f32 };
        let i = self.kinds.index(technique);
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
            manifold: 0,
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
        for (max, chain, masses) in [
            (1, 0, &masses[..3]),
            (3, 0, &masses[..]),
            (3, 0, &[]),
            (u32::MAX, 0, &masses[..]),
            (4, 2, &masses[..]),
        ] {
            let kinds = Kinds { has_lens: false, chain };
            let techniques = Techniques::new(&Rules { max_depth: max, ..RULES }, kinds, masses);
            let (n, mut rng) = (200_000, Rng::from_parts(&[3]));
            let mut counts = [0_u32; 60];
            for _ in 0..n {
                let t = techniques.sample([rng.next_f32(), rng.next_f32(), rng.next_f32()]);
                assert!(t.events >= 1 && t.events <= max && (kinds.has(t) || !masses.is_empty()), "{t:?}");
                if let Some(c) = counts.get_mut(kinds.index(t)) {
                    *c += 1;
                }
            }
            for events in 1..=max.min(4) {
                for i in 0..kinds.count(events) {
                    let t = kinds.nth(events, i);
                    let (p, c) = (techniques.probability(t), counts[kinds.index(t)] as f32 / n as f32);
                    // Five standard deviations.
                    assert!((p - c).abs() < 5.0 * (p / n as f32).sqrt() + 1e-6, "{max} {t:?}: {p} {c}");
                }
            }
        }
    }
}
