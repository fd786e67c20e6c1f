//! What a clear coat lets through to a Lambertian base, and what it sends back to it.
//!
//! | number     | meaning                                                                                |
//! |------------|----------------------------------------------------------------------------------------|
//! | `t(μ)`     | part of the light from `cos θ = μ` outside that reaches the base                        |
//! | `average`  | `∫ 2μ t(μ) dμ`, the same for uniform light                                              |
//! | `internal` | `K`: part of the light that leaves the base evenly that comes back to it                |
//!
//! A smooth boundary has `t` in closed form and `K`, `average` by quadrature over the outside angle, where Fresnel's
//! reflectance has no kink. A rough one has `t` at 16 nodes, evenly spaced in `√μ`, by quadrature over the visible
//! normals, and a cubic between them (error below 2e-3, see the tests); [`CoatProfiles`] interpolates in `α` too.

use math::hash::unit_f32;
use math::{LocalDir, trig};

use super::super::{Dielectric, SampleLobes, TransportMode};
use crate::fresnel;
use crate::microfacet::Facets;

/// Nodes of `t` over `√μ`.
const N_NODES: usize = 16;

/// A clear isotropic coat as a Lambertian base sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoatProfile {
    transmittance: [f32; N_NODES],
    average: f32,
    internal: f32,
}

impl CoatProfile {
    /// Under a smooth boundary.
    #[must_use]
    pub fn smooth(eta: f32, thickness: f32) -> Self {
        let passed = |cos: f32| absorbed(thickness, fresnel::interface(cos, eta).cos_transmitted);
        let reflected = |cos: f32| f64::from(fresnel::dielectric(cos, eta));

        // Over the angles outside that refract: 2μ' dμ' = 2μ dμ / η². The rest of the inside sees total reflection.
        let inverse_eta2 = 1.0 / (eta * eta);
        let from = trig::safe_sqrt(1.0 - eta * eta);
        let partial =
            integrate(from, 1.0, |mu| 2.0 * f64::from(mu) * reflected(mu) * f64::from(passed(mu)).powi(2));
        let beyond = trig::safe_sqrt(1.0 - inverse_eta2);
        let total = integrate(0.0, beyond, |mu| 2.0 * f64::from(mu * absorbed(2.0 * thickness, mu)));
        let average =
            integrate(from, 1.0, |mu| 2.0 * f64::from(mu) * (1.0 - reflected(mu)) * f64::from(passed(mu)));
        let internal = (partial * f64::from(inverse_eta2) + total) as f32;
        Self { transmittance: [0.0; N_NODES], average: average as f32, internal }
    }

    /// Under a boundary of facets of width `alpha` both ways (smooth if below [`Facets::SMOOTH_BELOW`]). Takes
    /// milliseconds: once per material, not per hit.
    #[must_use]
    pub fn new(eta: f32, alpha: f32, thickness: f32) -> Self {
        Self::of(eta, Facets::ggx(alpha, alpha), thickness)
    }

    /// Under a boundary of isotropic facets.
    #[must_use]
    pub fn of(eta: f32, facets: Facets, thickness: f32) -> Self {
        let top = Dielectric::new(eta, facets);
        if top.is_smooth() {
            return Self::smooth(eta, thickness);
        }
        let mut transmittance = [0.0; N_NODES];
        for (i, t) in transmittance.iter_mut().enumerate() {
            *t = rough(&top, node(i), thickness, SampleLobes::Transmission, 4096) as f32;
        }
        let internal = integrate(0.0, 1.0, |mu| {
            let back = rough(&top, -mu, thickness, SampleLobes::Reflection, 2048);
            2.0 * f64::from(mu * absorbed(thickness, mu)) * back
        });
        let mut profile = Self { transmittance, average: 0.0, internal: internal as f32 };
        profile.average = integrate(0.0, 1.0, |mu| 2.0 * f64::from(mu * profile.rough_at(mu))) as f32;
        profile
    }

    /// Made for a rough boundary?
    #[must_use]
    pub fn is_rough(&self) -> bool {
        self.transmittance[N_NODES - 1] > 0.0
    }

    /// `K`.
    #[must_use]
    pub fn internal(&self) -> f32 {
        self.internal
    }

    /// `∫ 2μ t(μ) dμ`.
    #[must_use]
    pub fn average(&self) -> f32 {
        self.average
    }

    /// `t(μ)` of a rough boundary: Catmull–Rom's cubic, whose ends are continued linearly.
    #[inline]
    pub(crate) fn rough_at(&self, mu: f32) -> f32 {
        let t = &self.transmittance;
        let x = trig::safe_sqrt(mu.min(1.0)) * (N_NODES - 1) as f32;
        let i = (x as usize).min(N_NODES - 2);
        let f = x - i as f32;
        let (b, c) = (t[i], t[i + 1]);
        let a = if i > 0 { t[i - 1] } else { 2.0 * b - c };
        let d = if i + 2 < N_NODES { t[i + 2] } else { 2.0 * c - b };
        let cubic =
            b + 0.5 * f * (c - a + f * (2.0 * a - 5.0 * b + 4.0 * c - d + f * (3.0 * (b - c) + d - a)));
        cubic.max(0.0)
    }

    fn lerp(&self, other: &Self, f: f32) -> Self {
        let mix = |a: f32, b: f32| a + (b - a) * f;
        let mut transmittance = self.transmittance;
        for (a, b) in transmittance.iter_mut().zip(other.transmittance) {
            *a = mix(*a, b);
        }
        let average = mix(self.average, other.average);
        Self { transmittance, average, internal: mix(self.internal, other.internal) }
    }
}

/// `t(μ)` of a smooth boundary.
#[inline]
pub(crate) fn smooth_at(eta: f32, thickness: f32, mu: f32) -> f32 {
    smooth_both(eta, thickness, mu).1
}

/// Its reflectance and `t(μ)`.
#[inline]
pub(crate) fn smooth_both(eta: f32, thickness: f32, mu: f32) -> (f32, f32) {
    let there = fresnel::interface(mu, eta);
    if there.reflectance >= 1.0 {
        return (there.reflectance, 0.0);
    }
    (there.reflectance, (1.0 - there.reflectance) * absorbed(thickness, there.cos_transmitted))
}

/// Profiles of one coat over a range of roughness, for materials whose roughness is a texture.
#[derive(Clone, Debug, PartialEq)]
pub struct CoatProfiles {
    smooth: CoatProfile,
    /// Evenly spaced in `√α`.
    rows: Vec<CoatProfile>,
    sqrt_alpha: [f32; 2],
}

impl CoatProfiles {
    /// Rows over `[alpha_min, alpha_max]`.
    const N_ROWS: usize = 20;

    /// For widths between `alpha_min` and `alpha_max` (equal where the roughness is no texture) of facets that are
    /// distributed and mask each other as those of `kind`: 5 ms for each of up to 20 rows.
    #[must_use]
    pub fn new(eta: f32, thickness: f32, [alpha_min, alpha_max]: [f32; 2], kind: Facets) -> Self {
        let lo = alpha_min.clamp(Facets::SMOOTH_BELOW, 1.0).sqrt();
        let hi = alpha_max.clamp(Facets::SMOOTH_BELOW, 1.0).sqrt();
        let n = if alpha_max < Facets::SMOOTH_BELOW {
            0
        } else if alpha_max <= alpha_min {
            1
        } else {
            Self::N_ROWS
        };
        let row = |i: usize| {
            let s = lo + (hi - lo) * i as f32 / (n.max(2) - 1) as f32;
            let alpha = (s * s).max(Facets::SMOOTH_BELOW);
            CoatProfile::of(eta, kind.of_width(alpha), thickness)
        };
        let rows = (0..n).map(row).collect();
        Self { smooth: CoatProfile::smooth(eta, thickness), rows, sqrt_alpha: [lo, hi] }
    }

    /// The profile at this width; `None` where there is none: the coat is anisotropic, or out of range.
    #[must_use]
    pub fn at(&self, alpha: [f32; 2]) -> Option<CoatProfile> {
        if alpha[0].max(alpha[1]) < Facets::SMOOTH_BELOW {
            return Some(self.smooth);
        }
        let s = trig::safe_sqrt(alpha[0]);
        let [lo, hi] = self.sqrt_alpha;
        if alpha[0] != alpha[1] || s < lo - 1e-4 || s > hi + 1e-4 {
            return None;
        }
        let last = self.rows.len().checked_sub(1)?;
        if last == 0 {
            return Some(self.rows[0]);
        }
        let x = ((s - lo) / (hi - lo) * last as f32).clamp(0.0, last as f32);
        let i = (x as usize).min(last - 1);
        Some(self.rows[i].lerp(&self.rows[i + 1], x - i as f32))
    }
}

/// The `μ` of a node; the first stands a little above the horizon.
fn node(i: usize) -> f32 {
    let x = i as f32 / (N_NODES - 1) as f32;
    (x * x).max(1e-5)
}

/// `e^{−d/μ}`, zero in the layer's plane.
#[inline]
fn absorbed(d: f32, mu: f32) -> f32 {
    if d == 0.0 {
        1.0
    } else if mu > 0.0 {
        trig::exp(-d / mu)
    } else {
        0.0
    }
}

/// Part of the light from `cos θ = mu` that the rough boundary sends to the layer, and that crosses it.
fn rough(top: &Dielectric, mu: f32, thickness: f32, lobes: SampleLobes, n: u32) -> f64 {
    let wo = LocalDir::new(trig::safe_sqrt(1.0 - mu * mu), 0.0, mu);
    // A rank-1 lattice by the golden ratio: every projection is evenly spaced.
    let at = |i: u32| [(i as f32 + 0.5) / n as f32, unit_f32(i.wrapping_mul(0x9e37_79b9))];
    let sum: f64 = (0..n)
        .filter_map(|i| top.sample_lobes(wo, 0.5, at(i), TransportMode::Importance, lobes))
        .map(|s| f64::from(s.weight.lanes()[0] * absorbed(thickness, s.wi.abs_cos_theta())))
        .sum();
    sum / f64::from(n)
}

/// ∫ f over `[a, b]`: four panels of the Gauss–Legendre rule of four points [DLMF, sec. 3.5], narrower at `a`.
fn integrate(a: f32, b: f32, f: impl Fn(f32) -> f64) -> f64 {
    const RULE: [(f32, f64); 4] = [
        (-0.861_136_3, 0.347_854_845_137_453_9),
        (-0.339_981_04, 0.652_145_154_862_546_1),
        (0.339_981_04, 0.652_145_154_862_546_1),
        (0.861_136_3, 0.347_854_845_137_453_9),
    ];
    let edges = [0.0, 0.03, 0.15, 0.5, 1.0].map(|x: f32| a + (b - a) * x);
    edges
        .windows(2)
        .map(|e| {
            let (centre, half) = (0.5 * (e[0] + e[1]), 0.5 * (e[1] - e[0]));
            RULE.iter().map(|&(x, w)| w * f(centre + half * x)).sum::<f64>() * f64::from(half)
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smooth_coat_without_absorption_is_fresnels_average() {
        for eta in [1.1, 1.33, 1.5, 2.42, 1.0 / 1.5] {
            let p = CoatProfile::smooth(eta, 0.0);
            let (k, t) = (fresnel::dielectric_average(1.0 / eta), 1.0 - fresnel::dielectric_average(eta));
            assert!((p.internal() - k).abs() < 2e-3, "{eta}: {} is not {k}", p.internal());
            assert!((p.average() - t).abs() < 2e-3, "{eta}: {} is not {t}", p.average());
        }
        let p = CoatProfile::smooth(1.5, 0.0);
        assert!((p.internal() - 0.596_345_8).abs() < 2e-5 && (p.average() - 0.908_222_0).abs() < 2e-5);
    }

    #[test]
    fn absorption_is_that_of_a_fine_sum() {
        let (eta, d) = (1.5_f32, 0.01_f32);
        let n = 400_000;
        let fine: f64 = (0..n)
            .map(|i| {
                let mu = (f64::from(i) + 0.5) / f64::from(n);
                let f = f64::from(fresnel::dielectric(-mu as f32, eta));
                2.0 * mu * f * trig::f64::exp(-2.0 * f64::from(d) / mu)
            })
            .sum();
        let p = CoatProfile::smooth(eta, d);
        assert!((f64::from(p.internal()) - fine / f64::from(n)).abs() < 1e-4);
    }

    #[test]
    fn nodes_are_enough_for_every_roughness() {
        for alpha in [1e-3, 0.02, 0.1, 0.3, 0.7, 1.0] {
            let (p, top) = (CoatProfile::new(1.5, alpha, 0.01), Dielectric::new(1.5, [alpha; 2]));
            for mu in [0.03, 0.07, 0.22, 0.4, 0.75, 0.97] {
                let exact = rough(&top, mu, 0.01, SampleLobes::Transmission, 20_000);
                let found = f64::from(p.rough_at(mu));
                assert!((found - exact).abs() < 2e-3, "alpha {alpha} mu {mu}: {found} is not {exact}");
            }
        }
    }

    #[test]
    fn textured_roughness_finds_its_profile_between_rows() {
        let profiles = CoatProfiles::new(1.5, 0.01, [0.0, 0.5], Facets::SMOOTH);
        for alpha in [0.0015, 0.01, 0.07, 0.33, 0.5] {
            let (a, b) = (profiles.at([alpha; 2]).unwrap(), CoatProfile::new(1.5, alpha, 0.01));
            assert!((a.internal() - b.internal()).abs() < 1e-3, "{alpha}: {} {}", a.internal(), b.internal());
            for mu in [0.05, 0.3, 0.8] {
                assert!((a.rough_at(mu) - b.rough_at(mu)).abs() < 2e-3, "{alpha} {mu}");
            }
        }
        assert!(profiles.at([0.1, 0.2]).is_none() && profiles.at([0.9; 2]).is_none());
        assert_eq!(profiles.at([0.0; 2]), Some(CoatProfile::smooth(1.5, 0.01)));
    }
}
