//! Hair: a rough dielectric cylinder with tilted scales and absorption inside. The first axis runs along the hair, and
//! directions lie all around it.
//!
//! | step                        | source                                             |
//! |-----------------------------|----------------------------------------------------|
//! | `Mp`, longitudinal          | [Eon2011], with the widths of [Chiang2016]        |
//! | `Np`, azimuthal             | [Chiang2016]: trimmed logistic                      |
//! | `Ap`, attenuation           | [Marschner2003; Chiang2016], the sum of the rest in closed form |
//! | tilt of scales, sampling    | [PBR4e, sec. 9.9]                                  |
//!
//! `p` is the number of crossings of the inside: 0 is the reflection, 1 and 2 pass once and twice, 3 all that is left.
//! With `S = Σ Mp Ap Np` the light that leaves is `∫ S Li dω`, so that `f = S / |cos θi|`. Attenuation and tilt are those
//! of `wo` alone: `f` is not reciprocal, and importance flows by `f` with its directions exchanged.

use std::f32::consts::{LN_2, PI, TAU};

use math::{LocalDir, Vec3, trig};
use sampling::distribution::choose;
use sampling::{Pdf, SolidAngle};
use spectrum::Spectrum;

use super::{BsdfKind, BsdfSample, Gloss, Lobe, LobeFlags, TransportMode};
use crate::fresnel;
use crate::microfacet::MIN_COS;

/// Lobes that are told apart.
const P_MAX: usize = 3;

/// A hair where a ray meets it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hair {
    sigma_a: Spectrum,
    /// Where across the hair, in [−1, 1].
    h: f32,
    eta: f32,
    /// Longitudinal variances.
    v: [f32; P_MAX + 1],
    /// Width of the logistic.
    s: f32,
    /// Sine and cosine of once, twice and four times the tilt.
    tilt: [[f32; 2]; 3],
}

/// A direction about the hair.
#[derive(Clone, Copy)]
struct Angles {
    sin: f32,
    cos: f32,
    phi: f32,
}

impl Angles {
    fn of(w: LocalDir) -> Self {
        Self {
            sin: w.0.x.clamp(-1.0, 1.0),
            cos: trig::safe_sqrt(1.0 - w.0.x * w.0.x),
            phi: trig::atan2(w.0.z, w.0.y),
        }
    }
}

/// What a ray along `wo` meets.
struct Crossing {
    gamma_o: f32,
    gamma_t: f32,
    ap: [Spectrum; P_MAX + 1],
}

impl Hair {
    /// `h` in [−1, 1] is where across the hair; `sigma_a` absorption per radius; roughnesses along and around in [0, 1];
    /// `alpha` the tilt of the scales in radians.
    #[must_use]
    pub fn new(sigma_a: Spectrum, h: f32, eta: f32, [beta_m, beta_n]: [f32; 2], alpha: f32) -> Self {
        let (m, n) = (beta_m.clamp(0.01, 1.0), beta_n.clamp(0.01, 1.0));
        let root = 0.726 * m + 0.812 * m * m + 3.7 * trig::pow(m, 20.0);
        let v = root * root;
        let s = (PI / 8.0).sqrt() * (0.265 * n + 1.194 * n * n + 5.372 * trig::pow(n, 22.0));
        let tilt = [1.0, 2.0, 4.0].map(|k| {
            let (sin, cos) = trig::sin_cos(k * alpha);
            [sin, cos]
        });
        let h = h.clamp(-0.999_999, 0.999_999);
        Self { sigma_a, h, eta, v: [v, 0.25 * v, 4.0 * v, 4.0 * v], s, tilt }
    }

    /// Absorption of a hair whose many are about of this colour, at this azimuthal roughness [Chiang2016].
    #[must_use]
    pub fn sigma_a_from_reflectance(color: Spectrum, beta_n: f32) -> Spectrum {
        let b = beta_n;
        let d = 5.969 + b * (-0.215 + b * (2.532 + b * (-10.73 + b * (5.574 + b * 0.245))));
        color.map(|c| {
            let root = trig::ln(c.clamp(1e-4, 1.0)) / d;
            root * root
        })
    }

    /// Absorption in R, G and B of these concentrations of pigment [PBR4e, sec. 9.9.7].
    #[must_use]
    pub fn sigma_a_from_melanin(eumelanin: f32, pheomelanin: f32) -> [f32; 3] {
        let (eu, pheo) = ([0.419, 0.697, 1.37], [0.187, 0.4, 1.05]);
        [0, 1, 2].map(|i| eumelanin * eu[i] + pheomelanin * pheo[i])
    }

    fn crossing(&self, o: Angles) -> Crossing {
        // Refraction into the cylinder; the index as it seems in the cross-section.
        let cos_o = o.cos.max(1e-6);
        let eta_p = trig::safe_sqrt(self.eta * self.eta - o.sin * o.sin) / cos_o;
        let sin_gamma_t = (self.h / eta_p).clamp(-1.0, 1.0);
        let cos_gamma_t = trig::safe_sqrt(1.0 - sin_gamma_t * sin_gamma_t);
        let sin_theta_t = o.sin / self.eta;
        let cos_theta_t = trig::safe_sqrt(1.0 - sin_theta_t * sin_theta_t).max(1e-6);
        let path = 2.0 * cos_gamma_t / cos_theta_t;
        let t = self.sigma_a.map(|a| trig::exp(-a * path));

        // Reflection, passage, passage with one and with any number of reflections inside.
        let f = fresnel::dielectric(cos_o * trig::safe_sqrt(1.0 - self.h * self.h), self.eta);
        let passed = t * ((1.0 - f) * (1.0 - f));
        let once = passed * t * f;
        let rest = once.zip(t, |once, t| once * t * f / (1.0 - t * f).max(1e-6));
        let ap = [Spectrum::splat(f), passed, once, rest];
        Crossing { gamma_o: trig::safe_asin(self.h), gamma_t: trig::safe_asin(sin_gamma_t), ap }
    }

    /// `wo` as the scales turn it for lobe `p`: sine and cosine.
    fn tilted(&self, o: Angles, p: usize) -> [f32; 2] {
        let turn = |[sin, cos]: [f32; 2]| [o.sin * cos + o.cos * sin, (o.cos * cos - o.sin * sin).abs()];
        match p {
            0 => turn([-self.tilt[1][0], self.tilt[1][1]]),
            1 => turn(self.tilt[0]),
            2 => turn(self.tilt[2]),
            _ => [o.sin, o.cos],
        }
    }

    /// `Mp Np` of each lobe.
    fn shapes(&self, o: Angles, i: Angles, crossing: &Crossing) -> [f32; P_MAX + 1] {
        let phi = i.phi - o.phi;
        let mut shapes = [0.0; P_MAX + 1];
        for (p, shape) in shapes.iter_mut().enumerate() {
            let around = if p < P_MAX { azimuthal(phi, p, self.s, crossing) } else { 1.0 / TAU };
            *shape = longitudinal([i.sin, i.cos], self.tilted(o, p), self.v[p]) * around;
        }
        shapes
    }

    /// Chances of the lobes.
    fn chances(crossing: &Crossing) -> [f32; P_MAX + 1] {
        let weights = crossing.ap.map(Spectrum::average);
        let sum: f32 = weights.iter().sum();
        if sum > 0.0 { weights.map(|w| w / sum) } else { [1.0, 0.0, 0.0, 0.0] }
    }

    /// `S` of the head.
    fn s(&self, wo: LocalDir, wi: LocalDir) -> Spectrum {
        let (o, i) = (Angles::of(wo), Angles::of(wi));
        let crossing = self.crossing(o);
        let shapes = self.shapes(o, i, &crossing);
        crossing.ap.iter().zip(shapes).map(|(a, s)| *a * s).sum()
    }
}

/// The direction of lobe `p` in the cross-section.
fn direction(p: usize, crossing: &Crossing) -> f32 {
    let p = p as f32;
    2.0 * p * crossing.gamma_t - 2.0 * crossing.gamma_o + p * PI
}

/// `Np`.
fn azimuthal(phi: f32, p: usize, s: f32, crossing: &Crossing) -> f32 {
    let off = phi - direction(p, crossing);
    let off = off - TAU * (off * (1.0 / TAU)).round();
    let e = trig::exp(-off.abs() / s);
    e / (s * (1.0 + e) * (1.0 + e)) / (logistic_cdf(PI, s) - logistic_cdf(-PI, s))
}

fn logistic_cdf(x: f32, s: f32) -> f32 {
    1.0 / (1.0 + trig::exp(-x / s))
}

/// A number of the logistic on [−π, π].
fn sample_logistic(u: f32, s: f32) -> f32 {
    let (lo, hi) = (logistic_cdf(-PI, s), logistic_cdf(PI, s));
    let x = -s * trig::ln((1.0 / (lo + u * (hi - lo)) - 1.0).max(1e-30));
    x.clamp(-PI, PI)
}

/// `Mp`: `e^{−b} I₀(a) / (2v sinh(1/v))`, as an exponential of a sum where `v` is small.
fn longitudinal([sin_i, cos_i]: [f32; 2], [sin_o, cos_o]: [f32; 2], v: f32) -> f32 {
    let (a, b) = (cos_i * cos_o / v, sin_i * sin_o / v);
    if v <= 0.1 {
        return trig::exp(log_bessel(a) - b - 1.0 / v + LN_2 + trig::ln(0.5 / v));
    }
    trig::exp(-b) * bessel(a) / (trig::sinh(1.0 / v) * 2.0 * v)
}

/// `I₀(x)`, the modified Bessel function, by its series, for x ≤ 12.
fn bessel(x: f32) -> f32 {
    let q = 0.25 * x * x;
    let (mut sum, mut term) = (1.0, 1.0);
    for k in 1..24 {
        term *= q / (k * k) as f32;
        sum += term;
    }
    sum
}

/// `ln I₀(x)`; by its asymptote from 12 on.
fn log_bessel(x: f32) -> f32 {
    if x > 12.0 {
        return x + 0.5 * (-trig::ln(TAU) - trig::ln(x)) + 0.125 / x + 0.0625 / (x * x);
    }
    trig::ln(bessel(x))
}

impl BsdfKind for Hair {
    fn eval(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Spectrum {
        let (to, from) = match mode {
            TransportMode::Radiance => (wo, wi),
            TransportMode::Importance => (wi, wo),
        };
        let cos = from.abs_cos_theta();
        if cos <= MIN_COS || to.abs_cos_theta() <= MIN_COS {
            return Spectrum::ZERO;
        }
        self.s(to, from) / cos
    }

    fn pdf(&self, wo: LocalDir, wi: LocalDir, _: TransportMode) -> Pdf<SolidAngle> {
        if wo.abs_cos_theta() <= MIN_COS || wi.abs_cos_theta() <= MIN_COS {
            return Pdf::ZERO;
        }
        let (o, i) = (Angles::of(wo), Angles::of(wi));
        let crossing = self.crossing(o);
        let shapes = self.shapes(o, i, &crossing);
        Pdf::new(Self::chances(&crossing).iter().zip(shapes).map(|(c, s)| c * s).sum())
    }

    fn sample(&self, wo: LocalDir, u_lobe: f32, u: [f32; 2], mode: TransportMode) -> Option<BsdfSample> {
        if wo.abs_cos_theta() <= MIN_COS {
            return None;
        }
        let o = Angles::of(wo);
        let crossing = self.crossing(o);
        let (p, u_lobe) = choose(Self::chances(&crossing), u_lobe);

        // Along the hair, about the direction of the mirror.
        let v = self.v[p];
        let [sin_o, cos_o] = self.tilted(o, p);
        let cos = 1.0 + v * trig::ln((u[0] + (1.0 - u[0]) * trig::exp(-2.0 / v)).max(1e-30));
        let sin = trig::safe_sqrt(1.0 - cos * cos);
        let sin_i = (-cos * sin_o + sin * trig::cos(TAU * u[1]) * cos_o).clamp(-1.0, 1.0);
        let cos_i = trig::safe_sqrt(1.0 - sin_i * sin_i);

        // Around it.
        let turn =
            if p < P_MAX { direction(p, &crossing) + sample_logistic(u_lobe, self.s) } else { TAU * u_lobe };
        let (sin_phi, cos_phi) = trig::sin_cos(o.phi + turn);
        let wi = LocalDir(Vec3::new(sin_i, cos_i * cos_phi, cos_i * sin_phi).try_normalize()?);
        let pdf = self.pdf(wo, wi, mode);
        let weight = self.eval(wo, wi, mode) * (wi.abs_cos_theta() / pdf.value());
        let lobe = match wo.same_hemisphere(wi) {
            true => Lobe::reflection(Gloss::Glossy),
            false => Lobe::transmission(Gloss::Glossy),
        };
        (pdf.is_positive() && weight.is_finite()).then(|| BsdfSample::smooth(wi, weight, pdf, lobe))
    }

    fn flags(&self) -> LobeFlags {
        LobeFlags::GLOSSY_REFLECTION | LobeFlags::GLOSSY_TRANSMISSION
    }

    fn albedo_estimate(&self, wo: LocalDir) -> Spectrum {
        self.crossing(Angles::of(wo)).ap.into_iter().sum()
    }

    fn is_reciprocal(&self) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bessels_function_is_that_of_the_tables() {
        for (x, i0) in [(0.0, 1.0), (1.0, 1.266_065_9), (5.0, 27.239_872), (10.0, 2_815.716_6)] {
            assert!((bessel(x) / i0 - 1.0).abs() < 1e-5, "{x}: {}", bessel(x));
        }
        assert!((log_bessel(12.001) - trig::ln(bessel(12.0)) - 0.001).abs() < 1e-3);
    }

    #[test]
    fn colours_come_back_from_their_absorption() {
        let c = Spectrum::from_rgb([0.8, 0.5, 0.2]);
        let sigma = Hair::sigma_a_from_reflectance(c, 0.3).rgb();
        assert!(sigma[0] < sigma[1] && sigma[1] < sigma[2]);
        assert_eq!(Hair::sigma_a_from_reflectance(Spectrum::ONE, 0.3), Spectrum::ZERO);
        assert!(Hair::sigma_a_from_melanin(1.3, 0.0)[2] > 1.7);
    }
}
