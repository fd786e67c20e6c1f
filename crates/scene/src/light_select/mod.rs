//! Which light to sample: uniformly, by power, or by what lights may send to the point.
//!
//! | strategy | for a point                                  | cost     |
//! |----------|----------------------------------------------|----------|
//! | uniform  | every light that emits alike                 | O(1)     |
//! | power    | by emitted power, alias method [Walker1977]  | O(1)     |
//! | spatial  | up to 16 lights: each one's importance; more: a tree of importances [Conty2018] | O(n), O(log n) |
//!
//! Light from infinity stands beside the tree. pbrt-v4 gives it n / (n + 1) of the choices; here that is
//! averaged with the share of its irradiance in an estimate of both, so that neither falls below half of pbrt's
//! share where it can contribute, and where no light of the tree can, infinity gets all. Among themselves, half by
//! number and half by irradiance.
//!
//! Every light that can contribute has a positive probability: importances bound what they stand for, and a light
//! gets zero only where its emission cone ends or the receiver is seen edge-on, and the only light of a scene never. Light
//! paths start by power.

mod importance;
mod infinite;
mod tree;

use math::Point;
use sampling::distribution::AliasTable;
use scene_desc::LightSelection;

use crate::lights::{LightBounds, Lights};
use crate::{LightContext, LightId};

use importance::{Clusters, LANES};
use infinite::InfiniteLights;
use tree::Tree;

/// Up to as many lights, a list is faster than a tree and chooses better.
const MOST_LISTED: usize = 16;

/// Chooses lights, for points and for light paths.
#[derive(Clone, Debug)]
pub struct LightSelector {
    strategy: Strategy,
    by_power: Option<AliasTable>,
}

/// The strategies for a point.
#[derive(Clone, Debug)]
enum Strategy {
    Uniform {
        /// Those that emit.
        lights: Vec<LightId>,
        emits: Vec<bool>,
    },
    Power,
    Spatial(Spatial),
}

#[derive(Clone, Debug)]
struct Spatial {
    finite: Finite,
    infinite: InfiniteLights,
}

/// Few lights, weighed one by one.
#[derive(Clone, Debug)]
struct List {
    lights: Vec<LightId>,
    clusters: Vec<Clusters>,
}

/// Lights at finite places.
#[derive(Clone, Debug)]
enum Finite {
    /// The only light that there is: nothing to weigh.
    One(LightId),
    List(List),
    Tree(Tree),
}

impl LightSelector {
    /// For the lights of a scene.
    #[must_use]
    pub fn new(selection: LightSelection, lights: &Lights) -> Self {
        let power: Vec<f32> = lights.ids().map(|l| lights.power(l)).collect();
        let emits: Vec<bool> = power.iter().map(|p| *p > 0.0).collect();
        let by_power = emits.contains(&true).then(|| AliasTable::new(&power)).flatten();
        let strategy = match selection {
            LightSelection::Uniform => {
                Strategy::Uniform { lights: lights.ids().filter(|l| emits[l.index()]).collect(), emits }
            }
            LightSelection::Power => Strategy::Power,
            LightSelection::Spatial => Strategy::Spatial(Spatial::new(lights)),
        };
        Self { strategy, by_power }
    }

    /// Is there anything to choose? Else [`LightSelector::select`] does not look at its number.
    #[inline]
    #[must_use]
    pub fn has_choice(&self) -> bool {
        match &self.strategy {
            Strategy::Uniform { lights, .. } => lights.len() > 1,
            Strategy::Power => true,
            Strategy::Spatial(s) => !matches!(s.finite, Finite::One(_)),
        }
    }

    /// The light that every point gets, with certainty, if there is but one.
    #[inline]
    #[must_use]
    pub fn only(&self) -> Option<LightId> {
        match &self.strategy {
            Strategy::Spatial(Spatial { finite: Finite::One(light), .. }) => Some(*light),
            Strategy::Spatial(_) | Strategy::Uniform { .. } | Strategy::Power => None,
        }
    }

    /// A light for the point, and its probability; `None` if no light reaches it.
    #[inline]
    #[must_use]
    pub fn select(&self, context: &LightContext, u: f32) -> Option<(LightId, f32)> {
        match &self.strategy {
            Strategy::Uniform { lights, .. } => {
                let n = lights.len();
                let i = ((u * n as f32) as usize).min(n.saturating_sub(1));
                lights.get(i).map(|&l| (l, 1.0 / n as f32))
            }
            Strategy::Power => self.select_emission(u),
            Strategy::Spatial(s) => s.select(context, u),
        }
    }

    /// The probability with which [`LightSelector::select`] chooses a light for the point.
    #[must_use]
    pub fn probability(&self, context: &LightContext, light: LightId) -> f32 {
        match &self.strategy {
            Strategy::Uniform { lights, emits } => {
                if emits[light.index()] {
                    1.0 / lights.len() as f32
                } else {
                    0.0
                }
            }
            Strategy::Power => self.emission_probability(light),
            Strategy::Spatial(s) => s.probability(context, light),
        }
    }

    /// A light for a light path to start from, by power, and its probability; `None` if no light emits.
    #[must_use]
    pub fn select_emission(&self, u: f32) -> Option<(LightId, f32)> {
        let choice = self.by_power.as_ref()?.sample(u);
        Some((LightId(choice.index as u32), choice.probability))
    }

    /// The probability with which [`LightSelector::select_emission`] chooses a light.
    #[must_use]
    pub fn emission_probability(&self, light: LightId) -> f32 {
        self.by_power.as_ref().map_or(0.0, |t| t.probability(light.index()))
    }
}

impl Spatial {
    fn new(lights: &Lights) -> Self {
        let bounded: Vec<(LightId, LightBounds)> =
            lights.ids().filter_map(|l| lights.light_bounds(l).map(|b| (l, b))).collect();
        let infinite = InfiniteLights::new(lights);
        let finite = if let ([(one, _)], true) = (bounded.as_slice(), infinite.is_empty()) {
            Finite::One(*one)
        } else if bounded.len() <= MOST_LISTED {
            Finite::List(List {
                lights: bounded.iter().map(|(l, _)| *l).collect(),
                clusters: bounded
                    .chunks(LANES)
                    .map(|four| Clusters::new(four.iter().map(|b| &b.1)))
                    .collect(),
            })
        } else {
            Finite::Tree(Tree::new(&bounded, lights.len()))
        };
        Self { finite, infinite }
    }

    #[inline]
    fn select(&self, context: &LightContext, u: f32) -> Option<(LightId, f32)> {
        match &self.finite {
            Finite::One(light) => Some((*light, 1.0)),
            Finite::List(_) | Finite::Tree(_) => self.select_of_many(context, u),
        }
    }

    fn select_of_many(&self, context: &LightContext, u: f32) -> Option<(LightId, f32)> {
        match &self.finite {
            Finite::One(light) => Some((*light, 1.0)),
            Finite::List(list) => {
                let importances = Importances::new(list, context);
                match self.infinite_or_rest(context.p, importances.sum, u) {
                    Choice::Infinite(chosen) => chosen,
                    Choice::Finite { u, probability } => {
                        importances.choose(u).map(|(i, p)| (list.lights[i], p * probability))
                    }
                }
            }
            Finite::Tree(tree) => {
                let root = tree.importances(context);
                match self.infinite_or_rest(context.p, root.iter().sum(), u) {
                    Choice::Infinite(chosen) => chosen,
                    Choice::Finite { u, probability } => {
                        tree.select(context, root, u).map(|(l, p)| (l, p * probability))
                    }
                }
            }
        }
    }

    fn probability(&self, context: &LightContext, light: LightId) -> f32 {
        // The sum of finite importances counts only beside light from infinity.
        let (sum, own) = match &self.finite {
            Finite::One(one) => return if *one == light { 1.0 } else { 0.0 },
            Finite::List(list) => {
                let importances = Importances::new(list, context);
                let own = list.lights.iter().position(|l| *l == light).map(|i| importances.probability(i));
                (importances.sum, own)
            }
            Finite::Tree(tree) => {
                let has_infinite = !self.infinite.is_empty();
                let sum = if has_infinite { tree.importances(context).iter().sum() } else { 1.0 };
                (sum, tree.probability(context, light))
            }
        };
        let infinite = self.infinite.share(context.p, sum);
        match own {
            Some(p) => p * (1.0 - infinite),
            None => infinite * self.infinite.probability(context.p, light),
        }
    }

    /// First choice: light from infinity, or from a finite place whose importances sum to `finite`.
    fn infinite_or_rest(&self, p: Point, finite: f32, u: f32) -> Choice {
        let share = self.infinite.share(p, finite);
        if u < share {
            let chosen = self.infinite.select(p, u / share);
            return Choice::Infinite(chosen.map(|(l, p)| (l, p * share)));
        }
        Choice::Finite { u: ((u - share) / (1.0 - share)).min(BELOW_ONE), probability: 1.0 - share }
    }
}

const BELOW_ONE: f32 = 1.0 - f32::EPSILON * 0.5;

enum Choice {
    Infinite(Option<(LightId, f32)>),
    Finite {
        /// Uniform again.
        u: f32,
        probability: f32,
    },
}

/// The importances of a short list.
struct Importances {
    values: [f32; MOST_LISTED],
    n: usize,
    sum: f32,
}

impl Importances {
    fn new(list: &List, context: &LightContext) -> Self {
        let mut values = [0.0; MOST_LISTED];
        for (four, clusters) in values.chunks_exact_mut(LANES).zip(&list.clusters) {
            four.copy_from_slice(&clusters.importances(context));
        }
        Self { values, n: list.lights.len(), sum: values.iter().sum() }
    }

    fn probability(&self, i: usize) -> f32 {
        if self.sum > 0.0 { self.values[i] / self.sum } else { 0.0 }
    }

    fn choose(&self, u: f32) -> Option<(usize, f32)> {
        let mut rest = u * self.sum;
        let mut last = None;
        for i in 0..self.n {
            if self.values[i] > 0.0 {
                last = Some(i);
                if rest < self.values[i] {
                    break;
                }
            }
            rest -= self.values[i];
        }
        last.map(|i| (i, self.probability(i)))
    }
}
