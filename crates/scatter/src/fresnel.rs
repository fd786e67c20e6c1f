//! Fresnel's equations: how much light an interface reflects.
//!
//! | function       | source                                                        |
//! |----------------|---------------------------------------------------------------|
//! | `dielectric`   | [Born1999], sec. 1.5.2, unpolarised                           |
//! | `conductor`    | [Born1999], sec. 14.2, complex index `eta + i k`, unpolarised |
//! | `schlick`      | [Schlick1994]                                                 |
//! | `*_average`    | [Duntley1942] (closed form); internal from external by `1 − (1 − F)/η²` |
//!
//! Left out: polarisation. Every event averages both polarisations, as all tracers without Stokes vectors do.

use math::{Vec4, trig};
use spectrum::Spectrum;

/// An interface as light meets it: what part is reflected, and where the rest goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interface {
    /// The part of the light that is reflected, in [0, 1]; one under total internal reflection.
    pub reflectance: f32,
    /// |cos| of the transmitted direction; zero under total internal reflection.
    pub cos_transmitted: f32,
    /// Index of the far side over the near side.
    pub eta: f32,
}

/// Reflection at a dielectric. `cos` is the cosine between `wo` and the normal: negative if `wo` lies inside, where
/// the index is `eta` times that outside.
#[must_use]
#[inline]
pub fn interface(cos: f32, eta: f32) -> Interface {
    let (c, eta) = if cos < 0.0 { (-cos, 1.0 / eta) } else { (cos, eta) };
    let c = c.min(1.0);
    if eta == 1.0 {
        return Interface { reflectance: 0.0, cos_transmitted: c, eta };
    }

    // Snell: sin²θt = sin²θ / η².
    let sin2_t = (1.0 - c * c) / (eta * eta);
    if sin2_t >= 1.0 {
        return Interface { reflectance: 1.0, cos_transmitted: 0.0, eta };
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    let reflectance = between(c, cos_t, eta);
    Interface { reflectance, cos_transmitted: cos_t, eta }
}

/// Reflectance where both cosines are known (both positive): that of `wo`, and that of the refracted direction on the
/// far side, whose index is `eta` times that of the near side. The same from both ends, bit for bit but for rounding.
#[must_use]
#[inline]
pub fn between(cos_near: f32, cos_far: f32, eta: f32) -> f32 {
    let parallel = (eta * cos_near - cos_far) / (eta * cos_near + cos_far);
    let perpendicular = (cos_near - eta * cos_far) / (cos_near + eta * cos_far);
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

/// Reflectance of a dielectric; see [`interface`].
#[must_use]
#[inline]
pub fn dielectric(cos: f32, eta: f32) -> f32 {
    interface(cos, eta).reflectance
}

/// Reflectance of a conductor of complex index `eta + i k` (relative to the outside), for `cos ≥ 0`. A lane without
/// an index (`eta = k = 0`) reflects everything.
#[must_use]
#[inline]
pub fn conductor(cos: f32, eta: Spectrum, k: Spectrum) -> Spectrum {
    let c = cos.clamp(0.0, 1.0);
    let (c2, s2) = (c * c, 1.0 - c * c);
    let (eta2, k2) = (eta.0 * eta.0, k.0 * k.0);

    // a² + b² and 2a, where a + ib = √((η + ik)² − sin²θ).
    let t0 = eta2 - k2 - Vec4::splat(s2);
    let a2_plus_b2 = sqrt(t0 * t0 + 4.0 * eta2 * k2);
    let a = sqrt((0.5 * (a2_plus_b2 + t0)).max(Vec4::ZERO));
    let t1 = a2_plus_b2 + Vec4::splat(c2);
    let t2 = 2.0 * c * a;
    let perpendicular = ratio_or_one(t1 - t2, t1 + t2);
    let t3 = c2 * a2_plus_b2 + Vec4::splat(s2 * s2);
    let t4 = t2 * s2;
    let ratio = ratio_or_one(t3 - t4, t3 + t4);
    Spectrum(0.5 * perpendicular * (Vec4::ONE + ratio))
}

/// `eta` and `k` of a metal with a given reflectance at normal incidence (pbrt's way: `eta = 1`). Reflectances are
/// limited to [0, 0.9999], since one would need an infinite `k`.
#[must_use]
pub fn conductor_from_reflectance(reflectance: Spectrum) -> (Spectrum, Spectrum) {
    let r = reflectance.clamp(0.0, 0.9999);
    (Spectrum::ONE, r.map(|r| 2.0 * (r / (1.0 - r)).sqrt()))
}

/// Schlick's approximation `F0 + (1 − F0)(1 − cos)⁵`.
#[must_use]
pub fn schlick(cos: f32, f0: Spectrum) -> Spectrum {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    let m5 = (m * m) * (m * m) * m;
    f0 + (Spectrum::ONE - f0) * m5
}

/// Reflectance of [`schlick`] under uniform light: `F0 + (1 − F0)/21`.
#[must_use]
pub fn schlick_average(f0: Spectrum) -> Spectrum {
    f0 + (Spectrum::ONE - f0) * (1.0 / 21.0)
}

/// Reflectance `∫ 2 cos F dcos` of a dielectric under uniform light from the side that `wo` lies on: outside for
/// `eta > 1`, and inside with `eta < 1` [Duntley1942].
#[must_use]
pub fn dielectric_average(eta: f32) -> f32 {
    let n = f64::from(eta);
    if (n - 1.0).abs() < 1e-4 {
        return 0.0;
    }
    if n < 1.0 {
        return (1.0 - (1.0 - dielectric_average_external(1.0 / n)) * n * n) as f32;
    }
    dielectric_average_external(n) as f32
}

/// Duntley's closed form, n > 1.
fn dielectric_average_external(n: f64) -> f64 {
    let (n2, n4) = (n * n, n.powi(4));
    let ln = trig::f64::ln;
    0.5 + (n - 1.0) * (3.0 * n + 1.0) / (6.0 * (n + 1.0).powi(2))
        + n2 * (n2 - 1.0).powi(2) / (n2 + 1.0).powi(3) * ln((n - 1.0) / (n + 1.0))
        - 2.0 * n * n2 * (n2 + 2.0 * n - 1.0) / ((n2 + 1.0) * (n4 - 1.0))
        + 8.0 * n4 * (n4 + 1.0) / ((n2 + 1.0) * (n4 - 1.0).powi(2)) * ln(n)
}

/// `a / b`, and one where `b` is zero: an index of zero, or one of one at grazing angles.
#[inline]
fn ratio_or_one(a: Vec4, b: Vec4) -> Vec4 {
    Vec4::select(b.cmpgt(Vec4::ZERO), a / b.max(Vec4::splat(f32::MIN_POSITIVE)), Vec4::ONE)
}

#[inline]
fn sqrt(v: Vec4) -> Vec4 {
    Vec4::new(v.x.sqrt(), v.y.sqrt(), v.z.sqrt(), v.w.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f32, b: f32, tolerance: f32) {
        assert!((a - b).abs() <= tolerance, "{a} is not {b}");
    }

    #[test]
    fn dielectric_reflectances_are_those_of_the_table() {
        // Ground truth, sec. 7: eta, F0, F_avg outside and inside, Brewster's angle and F there, F at 45/60/80°.
        let table = [
            [
                1.33,
                0.020_059_3,
                0.065_930_8,
                0.471_949_1,
                53.0612,
                0.038_556_3,
                0.027_521_4,
                0.059_125_6,
                0.346_916_1,
            ],
            [
                1.5,
                0.04,
                0.091_778_0,
                0.596_345_8,
                56.3099,
                0.073_964_5,
                0.050_239_9,
                0.089_186_7,
                0.387_704_3,
            ],
            [
                1.8,
                0.081_632_7,
                0.134_054_4,
                0.732_732_9,
                60.9454,
                0.139_551_4,
                0.093_523_1,
                0.134_643_3,
                0.418_749_6,
            ],
            [
                2.42,
                0.172_394_9,
                0.212_540_8,
                0.865_538_7,
                67.5485,
                0.250_845_7,
                0.181_521_1,
                0.211_597_6,
                0.433_327_6,
            ],
        ];
        for [eta, f0, external, internal, brewster, f_brewster, f45, f60, f80] in table {
            let at = |degrees: f32| dielectric(trig::cos(degrees.to_radians()), eta);
            close(at(0.0), f0, 2e-7);
            close(dielectric_average(eta), external, 1e-6);
            close(dielectric_average(1.0 / eta), internal, 1e-6);
            close(at(brewster), f_brewster, 2e-6);
            close(at(45.0), f45, 1e-6);
            close(at(60.0), f60, 1e-6);
            close(at(80.0), f80, 2e-6);
        }
    }

    #[test]
    fn the_closed_form_of_the_average_is_the_integral() {
        for eta in [1.01_f32, 1.1, 1.33, 2.0, 3.0, 1.0 / 1.5, 1.0 / 2.42] {
            let n = 200_000;
            let sum: f64 = (0..n)
                .map(|i| {
                    let c = (f64::from(i) + 0.5) / f64::from(n);
                    2.0 * c * f64::from(dielectric(c as f32, eta))
                })
                .sum();
            close(dielectric_average(eta), (sum / f64::from(n)) as f32, 1e-5);
        }
    }

    #[test]
    fn the_inside_sees_total_reflection_beyond_the_critical_angle() {
        let critical = 41.810_31_f32;
        let at = |degrees: f32| dielectric(-trig::cos(degrees.to_radians()), 1.5);
        assert_eq!(at(critical + 0.01), 1.0);
        assert!(at(critical - 0.01) < 1.0);
        close(at(0.0), 0.04, 1e-7);
    }

    #[test]
    fn reflectance_is_the_same_from_both_ends_of_the_path() {
        for i in 1..100 {
            let cos = i as f32 / 100.0;
            let there = interface(cos, 1.5);
            // Near the horizon the slope of F is large, and a cosine has 24 bits.
            close(dielectric(-there.cos_transmitted, 1.5), there.reflectance, 1e-4);
        }
    }

    #[test]
    fn conductor_reflectances_are_those_of_the_table() {
        let (silver, other) = ((0.2, 3.9), (1.0, 6.5));
        let at = |(n, k): (f32, f32), degrees: f32| {
            conductor(trig::cos(degrees.to_radians()), Spectrum::splat(n), Spectrum::splat(k)).lanes()[0]
        };
        close(at(silver, 0.0), 0.951_952_0, 1e-6);
        close(at(silver, 60.0), 0.945_882_4, 1e-6);
        close(at(silver, 80.0), 0.948_407_4, 1e-6);
        close(at(other, 0.0), 0.913_513_5, 1e-6);
        close(at(other, 60.0), 0.898_324_8, 1e-6);
        close(at(other, 80.0), 0.858_717_3, 1e-6);
        // A conductor without absorption is a dielectric.
        for degrees in [0.0, 30.0, 60.0, 85.0] {
            close(at((1.5, 0.0), degrees), dielectric(trig::cos(f32::to_radians(degrees)), 1.5), 1e-6);
        }
    }

    #[test]
    fn conductors_are_finite_in_an_unused_lane_and_at_grazing_angles() {
        let (eta, k) = (Spectrum::from_rgb([0.2, 0.9, 1.0]), Spectrum::from_rgb([3.9, 2.4, 0.0]));
        for cos in [0.0, 1e-30, 1e-4, 0.5, 1.0] {
            let r = conductor(cos, eta, k);
            assert!(r.is_finite() && r.lanes().iter().all(|r| (0.0..=1.000_001).contains(r)), "{cos}: {r:?}");
        }
    }

    #[test]
    fn a_conductor_made_from_a_reflectance_has_it() {
        let wanted = Spectrum::from_lanes([0.1, 0.5, 0.99, 0.0]);
        let (eta, k) = conductor_from_reflectance(wanted);
        for (a, b) in conductor(1.0, eta, k).lanes().iter().zip(wanted.lanes()) {
            close(*a, b, 1e-5);
        }
    }

    #[test]
    fn schlicks_average_is_seven_per_cent_low_for_glass() {
        close(schlick_average(Spectrum::splat(0.04)).lanes()[0], 0.085_714_3, 1e-6);
        close(schlick(0.0, Spectrum::splat(0.04)).lanes()[0], 1.0, 0.0);
        close(schlick(1.0, Spectrum::splat(0.04)).lanes()[0], 0.04, 0.0);
    }
}
