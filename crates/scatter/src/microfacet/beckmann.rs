//! Beckmann's distribution: slopes of a Gaussian, anisotropic.
//!
//! | what                  | source                                              |
//! |-----------------------|-----------------------------------------------------|
//! | `d`, `Λ`              | [Walter2007; Heitz2014]                             |
//! | visible normals       | slopes in closed form and by inversion [Heitz2014], solved as in [Jakob2014] |
//!
//! With `a = |z| / r` and `r = √(αx² x² + αy² y²)` Smith's function is `Λ = (erf a − 1)/2 + e^{−a²} / (2a√π)`, so that
//! `|z| (1 + 2Λ) = |z| erf a + r e^{−a²} / √π`: no pole at grazing angles.

use std::f32::consts::{FRAC_1_PI, FRAC_2_SQRT_PI};

use math::{LocalDir, Vec3, trig};

/// 1/√π.
const FRAC_1_SQRT_PI: f32 = 0.5 * FRAC_2_SQRT_PI;

/// `D(m)`. Never inlined: where facets are GGX, as mostly, the code around stays small.
#[inline(never)]
pub(super) fn d([ax, ay]: [f32; 2], m: LocalDir) -> f32 {
    let z2 = m.0.z * m.0.z;
    let (x, y) = (m.0.x / ax, m.0.y / ay);
    let exponent = (x * x + y * y) / z2;
    // Beyond, and in the surface, it is nothing to speak of.
    if z2 <= 0.0 || exponent > 80.0 {
        return 0.0;
    }
    FRAC_1_PI * trig::exp(-exponent) / (ax * ay * z2 * z2)
}

/// `|z| (1 + 2Λ)`.
#[inline(never)]
pub(super) fn stretch([ax, ay]: [f32; 2], w: LocalDir) -> f32 {
    let (x, y, z) = (ax * w.0.x, ay * w.0.y, w.abs_cos_theta());
    let r = (x * x + y * y).sqrt();
    // erf is one and the exponential below a unit in the last place from here on.
    if z >= 4.0 * r {
        return z;
    }
    let a = z / r;
    z * trig::erf(a) + r * trig::exp(-a * a) * FRAC_1_SQRT_PI
}

/// A normal seen from `wo` (either side), on the side z > 0.
#[inline(never)]
pub(super) fn sample_visible([ax, ay]: [f32; 2], wo: LocalDir, u: [f32; 2]) -> LocalDir {
    // Stretch `wo` so that slopes have unit roughness.
    let sign = 1.0_f32.copysign(wo.0.z);
    let v = LocalDir::normalize(sign * Vec3::new(ax * wo.0.x, ay * wo.0.y, wo.0.z)).0;
    let sin = (v.x * v.x + v.y * v.y).sqrt();
    let (cos_phi, sin_phi) = if sin > 0.0 { (v.x / sin, v.y / sin) } else { (1.0, 0.0) };

    // Slopes towards and across `wo`, turned to the tangents and made rough again.
    let towards = visible_slope(v.z.max(1e-7), sin, u[0]);
    let across = trig::erf_inv(2.0 * u[1] - 1.0);
    let x = cos_phi * towards - sin_phi * across;
    let y = sin_phi * towards + cos_phi * across;
    LocalDir::normalize(Vec3::new(-ax * x, -ay * y, 1.0))
}

/// The slope `s < cot θ` in the plane of `wo` whose share of what `wo` sees is `u`. The density is
/// `(cos θ − s sin θ) e^{−s²}`, so that with `b = erf s` the share below is proportional to
/// `1 + b + tan θ e^{−s²} / √π`, which grows with `b` from zero at −1. Newton's method within a bracket.
fn visible_slope(cos: f32, sin: f32, u: f32) -> f32 {
    let tan = sin / cos;
    let share = |b: f32, s: f32| 1.0 + b + tan * FRAC_1_SQRT_PI * trig::exp(-s * s);
    let cot = cos / sin.max(1e-20);
    let end = trig::erf(cot);
    let target = u * share(end, cot);
    let (mut lo, mut hi) = (-1.0_f32, end);
    let mut b = lo + (hi - lo) * u;
    let mut s = trig::erf_inv(b);
    for _ in 0..24 {
        let off = share(b, s) - target;
        if off.abs() <= 1e-6 * target.max(1e-3) {
            break;
        }
        if off > 0.0 {
            hi = b
        } else {
            lo = b
        }
        // d share / db = 1 − s tan θ, at least zero.
        let step = b - off / (1.0 - s * tan).max(1e-6);
        b = if step > lo && step < hi { step } else { 0.5 * (lo + hi) };
        s = trig::erf_inv(b);
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::microfacet::Facets;
    use std::f32::consts::TAU;

    #[test]
    fn slopes_have_their_share() {
        for cos in [1.0_f32, 0.8, 0.3, 0.05, 1e-4] {
            let sin = (1.0 - cos * cos).sqrt();
            let mut last = f32::NEG_INFINITY;
            for i in 0..100 {
                let s = visible_slope(cos, sin, (i as f32 + 0.5) / 100.0);
                assert!(s.is_finite() && s >= last, "cos {cos}, {i}: {s} after {last}");
                assert!(s * sin <= cos + 1e-4, "the facet faces away");
                last = s;
            }
        }
    }

    #[test]
    fn the_weak_white_furnace_is_one() {
        for (ax, ay) in [(0.1, 0.1), (0.5, 0.5), (1.0, 1.0), (0.1, 0.6)] {
            let f = Facets::beckmann(ax, ay);
            for mu in [1.0_f32, 0.7, 0.3, 0.05] {
                let r = (1.0 - mu * mu).sqrt();
                let wo = LocalDir::new(0.8 * r, 0.6 * r, mu);
                let n = 100_000_u32;
                let sum: f64 = (0..n)
                    .map(|i| {
                        // Over tan θ = t and φ.
                        let x = (i as f32 + 0.5) / n as f32;
                        let phi = TAU * math::hash::unit_f32(i.wrapping_mul(0x9e37_79b9));
                        let (t, (sin, cos)) = (x / (1.0 - x), trig::sin_cos(phi));
                        let z = 1.0 / (1.0 + t * t).sqrt();
                        let m = LocalDir::new(t * z * cos, t * z * sin, z);
                        let jacobian = TAU * t * z * z * z / ((1.0 - x) * (1.0 - x));
                        let seen = wo.dot(m) > 0.0;
                        f64::from(if seen { f.visible_pdf(wo, m).value() * jacobian } else { 0.0 })
                    })
                    .sum();
                let mean = sum / f64::from(n);
                assert!((mean - 1.0).abs() < 3e-3, "alpha {ax} {ay}, mu {mu}: {mean}");
            }
        }
    }
}
