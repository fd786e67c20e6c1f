//! Rough metal that gives back what bounces between its facets.
//!
//! | step                | source                                                                  |
//! |---------------------|-------------------------------------------------------------------------|
//! | single scattering   | `conductor`                                                             |
//! | the rest            | `F_ms (1 − E(wo)) (1 − E(wi)) / (π (1 − Ē))` [Kulla2017]                 |
//! | its colour          | `F_ms = F̄² Ē / (1 − F̄ (1 − Ē))`, the sum over bounces                   |
//!
//! `E(μ)` is the albedo of white facets, tabulated once for each distribution and interpolated; `Ē` and `F̄` are means
//! over the hemisphere. Furnace: a white metal returns one, within the interpolation (10⁻³).
//! Left out: anisotropy of the rest, whose width is the geometric mean of both.

use std::f32::consts::FRAC_1_PI;
use std::sync::LazyLock;

use math::{LocalDir, trig};
use sampling::distribution::{chances, choose};
use sampling::{Pdf, SolidAngle};
use spectrum::Spectrum;

use super::conductor::mirror;
use super::diffuse::cosine_on_side_of;
use super::mixture::sample_of;
use super::{BsdfKind, BsdfSample, Conductor, Gloss, Lobe, LobeFlags, TransportMode};
use crate::microfacet::{Distribution, Facets, MIN_COS};

/// A rough metal without loss between facets.
#[derive(Clone, Copy, Debug)]
pub struct CompensatedConductor {
    single: Conductor,
    /// `F_ms / (π (1 − Ē))`; black for a mirror.
    rest: Spectrum,
    /// `F̄`'s largest lane, for the choice of lobe.
    mean: f32,
    alpha: f32,
    distribution: Distribution,
}

impl CompensatedConductor {
    /// The metal with its loss made good.
    #[must_use]
    pub fn new(single: Conductor) -> Self {
        let facets = single.facets();
        let [u, v] = facets.alpha();
        let (alpha, distribution) = ((u * v).sqrt(), facets.distribution());
        // ∫ 2μ F(μ) dμ by the midpoint rule in μ².
        let mean: Spectrum = (0..8).map(|i| single.fresnel(((i as f32 + 0.5) / 8.0).sqrt()) * 0.125).sum();
        let lost = 1.0 - table(distribution).average(alpha);
        let rest = if facets.is_smooth() || lost <= 1e-5 {
            Spectrum::ZERO
        } else {
            mean.map(|f| f * f * (1.0 - lost) / (1.0 - f * lost) * FRAC_1_PI / lost)
        };
        Self { single, rest, mean: mean.max_component(), alpha, distribution }
    }

    fn lost(&self, w: LocalDir) -> f32 {
        (1.0 - table(self.distribution).at(self.alpha, w.abs_cos_theta())).max(0.0)
    }

    /// Chances of the facets' lobe and of the rest.
    fn chances(&self, wo: LocalDir) -> Option<[f32; 2]> {
        let lost = self.lost(wo);
        let rest = if self.rest.is_black() { 0.0 } else { lost.max(0.01) };
        chances([self.mean.max(0.02) * (1.0 - lost).max(0.05), rest * self.mean])
    }
}

/// Albedo of white facets, over `√μ` and `α`.
struct Table {
    albedo: [[f32; N_MU]; N_ALPHA],
    average: [f32; N_ALPHA],
}

const N_MU: usize = 48;
const N_ALPHA: usize = 32;

static GGX: LazyLock<Table> = LazyLock::new(|| Table::new(Distribution::Ggx));
static BECKMANN: LazyLock<Table> = LazyLock::new(|| Table::new(Distribution::Beckmann));

fn table(distribution: Distribution) -> &'static Table {
    match distribution {
        Distribution::Ggx => &GGX,
        Distribution::Beckmann => &BECKMANN,
    }
}

impl Table {
    fn new(distribution: Distribution) -> Self {
        let mut table = Self { albedo: [[0.0; N_MU]; N_ALPHA], average: [0.0; N_ALPHA] };
        for (k, row) in table.albedo.iter_mut().enumerate() {
            let alpha = (k as f32 / (N_ALPHA - 1) as f32).max(Facets::SMOOTH_BELOW);
            for (i, entry) in row.iter_mut().enumerate() {
                let x = i as f32 / (N_MU - 1) as f32;
                *entry = albedo(&Facets::new([alpha; 2], distribution), (x * x).max(1e-4));
            }
        }
        // ∫ 2μ E(μ) dμ of what is interpolated.
        for k in 0..N_ALPHA {
            let n = 512;
            let mean = |i: u32| f64::from(table.row(k, ((i as f32 + 0.5) / n as f32).sqrt()));
            table.average[k] = ((0..n).map(mean).sum::<f64>() / f64::from(n)) as f32;
        }
        table
    }

    fn row(&self, k: usize, mu: f32) -> f32 {
        let x = trig::safe_sqrt(mu.min(1.0)) * (N_MU - 1) as f32;
        let i = (x as usize).min(N_MU - 2);
        let row = &self.albedo[k];
        row[i] + (row[i + 1] - row[i]) * (x - i as f32)
    }

    fn between(alpha: f32, value: impl Fn(usize) -> f32) -> f32 {
        let y = alpha.clamp(0.0, 1.0) * (N_ALPHA - 1) as f32;
        let k = (y as usize).min(N_ALPHA - 2);
        value(k) + (value(k + 1) - value(k)) * (y - k as f32)
    }

    fn at(&self, alpha: f32, mu: f32) -> f32 {
        Self::between(alpha, |k| self.row(k, mu))
    }

    fn average(&self, alpha: f32) -> f32 {
        Self::between(alpha, |k| self.average[k])
    }
}

/// Albedo of white facets at `cos θ = mu`, by a lattice of visible normals.
fn albedo(facets: &Facets, mu: f32) -> f32 {
    let wo = LocalDir::new(trig::safe_sqrt(1.0 - mu * mu), 0.0, mu);
    let n = 2048_u32;
    let sum: f64 = (0..n)
        .map(|i| {
            let u = [(i as f32 + 0.5) / n as f32, math::hash::unit_f32(i.wrapping_mul(0x9e37_79b9))];
            let wi = mirror(wo, facets.sample_visible(wo, u));
            f64::from(if wi.0.z > 0.0 { facets.shadowing(wo, wi) } else { 0.0 })
        })
        .sum();
    (sum / f64::from(n)) as f32
}

impl BsdfKind for CompensatedConductor {
    fn eval(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Spectrum {
        self.eval_pdf(wo, wi, mode).0
    }

    fn pdf(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Pdf<SolidAngle> {
        self.eval_pdf(wo, wi, mode).1
    }

    fn eval_pdf(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> (Spectrum, Pdf<SolidAngle>) {
        let off = wo.abs_cos_theta() > MIN_COS && wi.abs_cos_theta() > MIN_COS;
        let (true, Some([single, rest])) = (off && wo.same_hemisphere(wi), self.chances(wo)) else {
            return (Spectrum::ZERO, Pdf::ZERO);
        };
        let (f, pdf) = self.single.eval_pdf(wo, wi, mode);
        if self.rest.is_black() {
            return (f, pdf);
        }
        let cosine = Pdf::new(rest * wi.abs_cos_theta() * FRAC_1_PI);
        (f + self.rest * (self.lost(wo) * self.lost(wi)), pdf * single + cosine)
    }

    fn sample(&self, wo: LocalDir, u_lobe: f32, u: [f32; 2], mode: TransportMode) -> Option<BsdfSample> {
        if self.rest.is_black() {
            return self.single.sample(wo, u_lobe, u, mode);
        }
        if wo.abs_cos_theta() <= MIN_COS {
            return None;
        }
        let (lobe, u_lobe) = choose(self.chances(wo)?, u_lobe);
        let (wi, gloss) = match lobe {
            0 => (self.single.sample(wo, u_lobe, u, mode)?.wi, Gloss::Glossy),
            _ => (cosine_on_side_of(wo, u)?, Gloss::Diffuse),
        };
        sample_of(self, wo, wi, (Lobe::reflection(gloss), 1.0), mode)
    }

    fn flags(&self) -> LobeFlags {
        let rest = if self.rest.is_black() { LobeFlags::NONE } else { LobeFlags::DIFFUSE_REFLECTION };
        self.single.flags() | rest
    }

    fn albedo_estimate(&self, wo: LocalDir) -> Spectrum {
        self.single.albedo_estimate(wo)
    }

    fn regularized(&self) -> Self {
        Self::new(self.single.regularized())
    }
}
