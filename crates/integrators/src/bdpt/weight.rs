//! Weights of multiple importance sampling over all ways of making one path [Veach1997, sec. 10.2.1].
//!
//! A path of vertices x₀ (on the light) to `x_k` (on the lens) is made by the strategy (s, t), s + t = k + 1, with the
//! density
//!
//! ```text
//! p_s = ∏_{i < s} a_i · ∏_{i ≥ s} b_i,
//! ```
//!
//! where `a_i` is the density of finding `x_i` from the light's side and `b_i` that from the eye's. Neighbours differ by
//! one ratio, `p_{s+1} / p_s = a_s / b_s`, so all are known up to a common factor after one walk along the path.
//!
//! Three factors make strategies different from that: next-event estimation (s = 1) draws x₀ anew, as seen from x₁;
//! there may be more or fewer light paths than camera paths; and an edge next to a delta lobe cannot be connected.
//! (1, 1) is left to (0, 2): emitters that are seen directly. Nor does (2, 0) show a point lamp through the lens, so that
//! depth 0 is one picture for all integrators.
//!
//! Where photons are gathered, vertex `x_m` may also be found from both sides and merged [Georgiev2012]. That path has
//! the vertices of strategies m and m + 1, `x_m` twice; what it is likely to be found with is
//!
//! ```text
//! p_m a_m N π r² = p_{m+1} b_m N π r²,
//! ```
//!
//! with N light paths and the radius r at `x_m`: the same ladder, one rung further. In a medium it is N 4/3 π r³ σt, since
//! `a_m` leaves out that the walk scatters at `x_m`.

use sampling::mis::Heuristic;

/// A vertex of a complete path.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Link {
    /// Density from the light's side, a.
    pub(crate) from_light: f32,
    /// Density from the eye's side, b.
    pub(crate) from_eye: f32,
    /// Does the path leave it by a delta lobe?
    pub(crate) is_delta: bool,
    /// N π r² where photons are gathered, N 4/3 π r³ σt in media; zero where they are not.
    pub(crate) merge: f32,
    /// Does it leave it by a delta over which [`crate::manifold`] finds light? Known where the weighting asks for it.
    pub(crate) is_passable: bool,
}

/// How a path's place on the light may be found (a ray that hits it is in the links).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LightEnd {
    /// Density of a light path's start.
    pub(crate) emit: f32,
    /// Density of next-event estimation from x₁.
    pub(crate) direct: f32,
    /// Can a ray find it?
    pub(crate) is_hittable: bool,
}

/// A way of making a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Strategy {
    /// So many vertices from the light, the rest from the eye.
    Join(usize),
    /// This vertex from both.
    Merge(usize),
}

/// Which paths the eye's walk may end by finding the emitter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Emitters {
    /// All.
    All,
    /// Those of deltas alone.
    OverDeltas,
    /// Those without scattering.
    Seen,
}

/// Where light paths and eye paths are merged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Merges {
    Nowhere,
    /// At the vertex from which only deltas lead to the eye.
    First,
    Everywhere,
}

/// The strategies that are used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Techniques {
    pub(crate) emitters: Emitters,
    /// Two surfaces, or a light sample and a surface.
    pub(crate) connections: bool,
    /// A light path that reaches the lens.
    pub(crate) lens: bool,
    pub(crate) merges: Merges,
}

impl Techniques {
    /// Bidirectional path tracing.
    pub(crate) const BIDIRECTIONAL: Self =
        Self { emitters: Emitters::All, connections: true, lens: true, merges: Merges::Nowhere };
}

/// What is the same for all paths.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Weighting {
    pub(crate) heuristic: Heuristic,
    pub(crate) techniques: Techniques,
    /// Can a ray find the lens?
    pub(crate) lens_is_hittable: bool,
    /// Light paths per camera path of the whole film.
    pub(crate) light_share: f32,
    /// Most deltas at the end of a path that manifold sampling finds; zero for none.
    pub(crate) manifold: usize,
}

impl Weighting {
    /// Is any path made by `s` vertices from the light and `t` from the eye?
    pub(crate) fn joins(&self, s: usize, t: usize) -> bool {
        let Techniques { connections, lens, .. } = self.techniques;
        match (s, t) {
            // Emitters that count no more weigh nothing; media that glow always count.
            (0, _) => true,
            (_, 0 | 1) => lens,
            _ => connections,
        }
    }

    /// Is a path made by manifold sampling alone (see `bdpt::over_deltas`)? That is all paths that nothing can be connected in and
    /// whose last vertex that is no delta is as few as [`Self::manifold`] passable ones away from the light.
    pub(crate) fn is_left_to_manifold(&self, links: &[Link]) -> bool {
        if self.manifold == 0 {
            return false;
        }
        let n = links[1..].iter().take_while(|l| l.is_passable).count();
        let from = &links[1 + n..];
        let is_found = (1..=self.manifold).contains(&n) && from.len() > 1 && !from[0].is_delta;
        is_found && from.windows(2).all(|edge| edge[0].is_delta || edge[1].is_delta)
    }

    /// The weight of one way of making a path.
    pub(crate) fn weight(&self, links: &[Link], end: &LightEnd, own: Strategy) -> f32 {
        let base = match own {
            Strategy::Join(s) => s,
            Strategy::Merge(m) => m + 1,
        };
        let own_density = match own {
            Strategy::Join(s) => self.join(links, end, s, 1.0),
            Strategy::Merge(m) => self.merge(links, end, m, f64::from(links[m].from_eye)),
        };
        if own_density <= 0.0 {
            return 0.0;
        }
        let mut sum = 0.0;
        let mut add = |density: f64| {
            let q = density / own_density;
            sum += match self.heuristic {
                Heuristic::Balance => q,
                Heuristic::Power => q * q,
            };
        };

        // Fewer vertices from the light. What finds x₀ is in the factors.
        add(self.join(links, end, base, 1.0));
        let mut ratio = 1.0_f64;
        for fewer in (0..base).rev() {
            if fewer > 0 {
                let [a, b] = [links[fewer].from_light, links[fewer].from_eye].map(f64::from);
                add(self.merge(links, end, fewer, ratio * b));
                ratio *= b / a;
            }
            add(self.join(links, end, fewer, ratio));
        }
        // More of them.
        ratio = 1.0;
        for more in base + 1..=links.len() {
            if more > 1 {
                let [a, b] = [links[more - 1].from_light, links[more - 1].from_eye].map(f64::from);
                add(self.merge(links, end, more - 1, ratio * a));
                ratio *= a / b;
            }
            add(self.join(links, end, more, ratio));
        }
        if f64::is_nan(sum) { 0.0 } else { (1.0 / sum) as f32 }
    }

    /// Density of a strategy: `ratio`, which leaves out x₀, times the density of finding x₀ and the number of paths;
    /// zero if it cannot make the path.
    fn join(&self, links: &[Link], end: &LightEnd, s: usize, ratio: f64) -> f64 {
        let n = links.len();
        let t = n - s;
        let is_possible = self.joins(s, t)
            && match (s, t) {
                (0, _) => end.is_hittable && self.ends_at_emitter(links),
                (2, 0) => self.lens_is_hittable && end.is_hittable,
                (_, 0) => self.lens_is_hittable,
                (1, 1) => false,
                _ => !links[s - 1].is_delta && !links[s].is_delta,
            };
        let of_light = match s {
            0 => links[0].from_eye,
            1 => end.direct,
            _ => end.emit,
        };
        let of_eye = if t <= 1 { self.light_share } else { 1.0 };
        if is_possible { ratio * f64::from(of_light) * f64::from(of_eye) } else { 0.0 }
    }

    /// The same of merging at vertex `m`; `ratio` leaves out x₀ and has both densities of `x_m`.
    fn merge(&self, links: &[Link], end: &LightEnd, m: usize, ratio: f64) -> f64 {
        let is_possible = !links[m].is_delta
            && links[m].merge > 0.0
            && match self.techniques.merges {
                Merges::Nowhere => false,
                Merges::Everywhere => true,
                Merges::First => links[m + 1..].iter().rev().skip(1).all(|l| l.is_delta),
            };
        if is_possible { ratio * f64::from(end.emit) * f64::from(links[m].merge) } else { 0.0 }
    }

    fn ends_at_emitter(&self, links: &[Link]) -> bool {
        match self.techniques.emitters {
            Emitters::All => true,
            Emitters::OverDeltas => links[1..links.len() - 1].iter().all(|l| l.is_delta),
            Emitters::Seen => links.len() == 2,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: Techniques = Techniques { merges: Merges::Everywhere, ..Techniques::BIDIRECTIONAL };
    const FIRST: Techniques =
        Techniques { emitters: Emitters::OverDeltas, connections: false, lens: false, merges: Merges::First };

    /// Weights of all strategies of one path add up to one, whatever is possible: what makes the sum unbiased.
    #[test]
    fn weights_of_all_strategies_add_up_to_one() {
        let link = |a: f32, b: f32, is_delta| Link {
            from_light: a,
            from_eye: b,
            is_delta,
            merge: 3.0 * b,
            is_passable: false,
        };
        let path = [
            link(0.0, 0.7, false),
            link(2.0, 0.1, false),
            link(0.5, 30.0, true),
            link(4.0, 0.2, false),
            link(0.01, 5.0, false),
            link(0.3, 8.0, false),
        ];
        for (heuristic, techniques) in [
            (Heuristic::Balance, Techniques::BIDIRECTIONAL),
            (Heuristic::Power, Techniques::BIDIRECTIONAL),
            (Heuristic::Balance, ALL),
            (Heuristic::Power, ALL),
            (Heuristic::Power, FIRST),
        ] {
            for (is_hittable, lens_is_hittable) in
                [(true, true), (true, false), (false, true), (false, false)]
            {
                let weighting =
                    Weighting { heuristic, techniques, lens_is_hittable, light_share: 0.7, manifold: 0 };
                for n in 2..=path.len() {
                    let end = LightEnd { emit: 0.4, direct: 3.0, is_hittable };
                    let mut links = path[..n].to_vec();
                    links[n - 1].merge = 0.0;
                    let weight = |own| weighting.weight(&links, &end, own);
                    let weights: Vec<_> = (0..=n).map(|s| weight(Strategy::Join(s))).collect();
                    let merges: Vec<_> = (1..n - 1).map(|m| weight(Strategy::Merge(m))).collect();
                    let possible = weights.iter().chain(&merges).any(|w| *w > 0.0);
                    let sum: f32 = weights.iter().chain(&merges).sum();
                    assert!(!possible || (sum - 1.0).abs() < 1e-5, "{weights:?} {merges:?}");
                    if techniques == FIRST {
                        // One way alone, and only one vertex is no delta and sees the eye over deltas.
                        assert_eq!(merges.iter().filter(|w| **w > 0.0).count(), usize::from(n > 2));
                        assert!(n == 2 || merges[if n == 4 { 0 } else { n - 3 }] == 1.0, "{merges:?}");
                        continue;
                    }
                    assert_eq!(merges.iter().any(|w| *w > 0.0), techniques == ALL && n > 2);
                    assert_eq!(weights[0] > 0.0, is_hittable);
                    assert_eq!(weights[n] > 0.0, lens_is_hittable && (is_hittable || n > 2));
                }
            }
        }
    }

    /// Merging at m is like joining m + 1 vertices from the light with the eye's own way to the last of them.
    #[test]
    fn merging_weighs_by_the_densities_of_both_walks() {
        let link = |a: f32, b: f32, merge: f32| Link { from_light: a, from_eye: b, merge, ..Link::default() };
        let path = [link(0.0, 2.0, 0.0), link(3.0, 5.0, 0.01), link(7.0, 11.0, 0.02), link(13.0, 17.0, 0.0)];
        let end = LightEnd { emit: 0.5, direct: 0.25, is_hittable: true };
        let heuristic = Heuristic::Balance;
        let weighting =
            Weighting { heuristic, techniques: ALL, lens_is_hittable: false, light_share: 1.0, manifold: 0 };
        let joins = [
            2.0 * 5.0 * 11.0 * 17.0,
            0.25 * 5.0 * 11.0 * 17.0,
            0.5 * 3.0 * 11.0 * 17.0,
            0.5 * 3.0 * 7.0 * 17.0,
        ];
        let merges = [0.5 * 3.0 * 5.0 * 11.0 * 17.0 * 0.01, 0.5 * 3.0 * 7.0 * 11.0 * 17.0 * 0.02];
        let sum: f32 = joins.iter().sum::<f32>() + merges.iter().sum::<f32>();
        for (s, p) in joins.iter().enumerate() {
            let own = weighting.weight(&path, &end, Strategy::Join(s));
            assert!((own - p / sum).abs() < 1e-6, "join {s}");
        }
        for (i, p) in merges.iter().enumerate() {
            let own = weighting.weight(&path, &end, Strategy::Merge(i + 1));
            assert!((own - p / sum).abs() < 1e-6, "merge {}", i + 1);
        }
    }

    #[test]
    fn the_balance_heuristic_is_in_proportion_to_the_densities() {
        let link = |a: f32, b: f32| Link { from_light: a, from_eye: b, ..Link::default() };
        let path = [link(0.0, 2.0), link(3.0, 5.0), link(7.0, 11.0), link(13.0, 17.0)];
        let end = LightEnd { emit: 0.5, direct: 0.25, is_hittable: true };
        let weighting = Weighting {
            heuristic: Heuristic::Balance,
            techniques: Techniques::BIDIRECTIONAL,
            lens_is_hittable: true,
            light_share: 0.1,
            manifold: 0,
        };
        let densities = [
            2.0 * 5.0 * 11.0 * 17.0,
            0.25 * 5.0 * 11.0 * 17.0,
            0.5 * 3.0 * 11.0 * 17.0,
            0.5 * 3.0 * 7.0 * 17.0 * 0.1,
            0.5 * 3.0 * 7.0 * 13.0 * 0.1,
        ];
        let sum: f32 = densities.iter().sum();
        for (s, p) in densities.iter().enumerate() {
            assert!((weighting.weight(&path, &end, Strategy::Join(s)) - p / sum).abs() < 1e-6, "{s}");
        }
    }

    /// Letters from the light to the lens: D scatters, S is a delta that may be passed, X one that may not.
    #[test]
    fn what_nothing_else_connects_is_left_to_manifold_sampling() {
        let weighting = |manifold| Weighting {
            heuristic: Heuristic::Power,
            techniques: Techniques::BIDIRECTIONAL,
            lens_is_hittable: true,
            light_share: 1.0,
            manifold,
        };
        for (path, longest, is_left) in [
            ("SDS", 1, true),
            ("SDS", 0, false),
            ("SSDS", 1, false),
            ("SSDS", 2, true),
            ("SDX", 1, true),
            ("XDS", 1, false),
            ("SDSDS", 1, true),
            ("SDSSDS", 1, true),
            // Connected: to the lens, and between two that scatter.
            ("SD", 1, false),
            ("SDSD", 1, false),
            ("SDDS", 1, false),
            // Next-event estimation.
            ("DS", 1, false),
            // From the eye over deltas alone.
            ("SS", 2, false),
            ("S", 2, false),
            ("SX", 2, false),
            ("", 2, false),
        ] {
            let of = |c: char| Link { is_delta: c != 'D', is_passable: c == 'S', ..Link::default() };
            let links: Vec<_> = "D".chars().chain(path.chars()).chain("D".chars()).map(of).collect();
            assert_eq!(weighting(longest).is_left_to_manifold(&links), is_left, "{path} {longest}");
        }
    }
}
