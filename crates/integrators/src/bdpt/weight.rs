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

/// What is the same for all paths.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Weighting {
    pub(crate) heuristic: Heuristic,
    /// Can a ray find the lens?
    pub(crate) lens_is_hittable: bool,
    /// Light paths per camera path of the whole film.
    pub(crate) light_share: f32,
}

impl Weighting {
    /// The weight of the strategy with `s` vertices from the light.
    pub(crate) fn weight(&self, links: &[Link], end: &LightEnd, s: usize) -> f32 {
        let n = links.len();
        let own = self.factor(links, end, s, 1.0);
        if own <= 0.0 {
            return 0.0;
        }
        let mut sum = 1.0;
        let mut add = |s: usize, ratio: f64| {
            let q = self.factor(links, end, s, ratio) / own;
            sum += match self.heuristic {
                Heuristic::Balance => q,
                Heuristic::Power => q * q,
            };
        };

        // Fewer vertices from the light. What finds x₀ is in the factor.
        let mut ratio = 1.0_f64;
        for fewer in (0..s).rev() {
            if fewer > 0 {
                ratio *= f64::from(links[fewer].from_eye) / f64::from(links[fewer].from_light);
            }
            add(fewer, ratio);
        }
        // More of them.
        ratio = 1.0;
        for more in s + 1..=n {
            if more > 1 {
                ratio *= f64::from(links[more - 1].from_light) / f64::from(links[more - 1].from_eye);
            }
            add(more, ratio);
        }
        if f64::is_nan(sum) { 0.0 } else { (1.0 / sum) as f32 }
    }

    /// Density of a strategy: `ratio`, which leaves out x₀, times the density of finding x₀ and the number of paths;
    /// zero if it cannot make the path.
    fn factor(&self, links: &[Link], end: &LightEnd, s: usize, ratio: f64) -> f64 {
        let n = links.len();
        let t = n - s;
        let is_possible = match (s, t) {
            (0, _) => end.is_hittable,
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
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Weights of all strategies of one path add up to one, whatever is possible: what makes the sum unbiased.
    #[test]
    fn weights_of_all_strategies_add_up_to_one() {
        let link = |a: f32, b: f32, is_delta| Link { from_light: a, from_eye: b, is_delta };
        let path = [
            link(0.0, 0.7, false),
            link(2.0, 0.1, false),
            link(0.5, 30.0, true),
            link(4.0, 0.2, false),
            link(0.01, 5.0, false),
            link(0.3, 8.0, false),
        ];
        for heuristic in [Heuristic::Balance, Heuristic::Power] {
            for (is_hittable, lens_is_hittable) in
                [(true, true), (true, false), (false, true), (false, false)]
            {
                let weighting = Weighting { heuristic, lens_is_hittable, light_share: 0.7 };
                for n in 2..=path.len() {
                    let end = LightEnd { emit: 0.4, direct: 3.0, is_hittable };
                    let weights: Vec<_> = (0..=n).map(|s| weighting.weight(&path[..n], &end, s)).collect();
                    let possible = weights.iter().any(|w| *w > 0.0);
                    let sum: f32 = weights.iter().sum();
                    assert!(!possible || (sum - 1.0).abs() < 1e-5, "{weights:?}");
                    assert_eq!(weights[0] > 0.0, is_hittable);
                    assert_eq!(weights[n] > 0.0, lens_is_hittable && (is_hittable || n > 2));
                }
            }
        }
    }

    #[test]
    fn the_balance_heuristic_is_in_proportion_to_the_densities() {
        let link = |a: f32, b: f32| Link { from_light: a, from_eye: b, is_delta: false };
        let path = [link(0.0, 2.0), link(3.0, 5.0), link(7.0, 11.0), link(13.0, 17.0)];
        let end = LightEnd { emit: 0.5, direct: 0.25, is_hittable: true };
        let weighting = Weighting { heuristic: Heuristic::Balance, lens_is_hittable: true, light_share: 0.1 };
        let densities = [
            2.0 * 5.0 * 11.0 * 17.0,
            0.25 * 5.0 * 11.0 * 17.0,
            0.5 * 3.0 * 11.0 * 17.0,
            0.5 * 3.0 * 7.0 * 17.0 * 0.1,
            0.5 * 3.0 * 7.0 * 13.0 * 0.1,
        ];
        let sum: f32 = densities.iter().sum();
        for (s, p) in densities.iter().enumerate() {
            assert!((weighting.weight(&path, &end, s) - p / sum).abs() < 1e-6, "{s}");
        }
    }
}
