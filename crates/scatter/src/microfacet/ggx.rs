//! The GGX (Trowbridge–Reitz) distribution, anisotropic.
//!
//! | what                  | source                                              |
//! |-----------------------|-----------------------------------------------------|
//! | `d`                   | [Walter2007]; anisotropic [Burley2012]              |
//! | `stretch`             | `√(αx² x² + αy² y² + z²)`, from the `Λ` of [Heitz2014] |
//! | visible normals       | [Dupuy2023], spherical caps                         |

use std::f32::consts::{PI, TAU};

use math::{LocalDir, Vec3, trig};

/// `D(m)`.
#[inline]
pub(super) fn d([ax, ay]: [f32; 2], m: LocalDir) -> f32 {
    let (x, y) = (m.0.x / ax, m.0.y / ay);
    let q = x * x + y * y + m.0.z * m.0.z;
    1.0 / (PI * ax * ay * q * q)
}

/// `|z| (1 + 2Λ)`: the length of the stretched direction.
#[inline]
pub(super) fn stretch([ax, ay]: [f32; 2], w: LocalDir) -> f32 {
    let (x, y) = (ax * w.0.x, ay * w.0.y);
    (x * x + y * y + w.0.z * w.0.z).sqrt()
}

/// A normal seen from `wo` (either side), on the side z > 0.
#[inline]
pub(super) fn sample_visible([ax, ay]: [f32; 2], wo: LocalDir, u: [f32; 2]) -> LocalDir {
    // Stretch `wo` so that the surface becomes a hemisphere of unit roughness.
    let sign = 1.0_f32.copysign(wo.0.z);
    let v = LocalDir::normalize(sign * Vec3::new(ax * wo.0.x, ay * wo.0.y, wo.0.z)).0;

    // Reflections off the hemisphere fill the cap z > −v.z uniformly; the half vector is the normal.
    let (sin_phi, cos_phi) = trig::sin_cos(TAU * u[0]);
    let z = (1.0 - u[1]) * (1.0 + v.z) - v.z;
    let sin_theta = trig::safe_sqrt(1.0 - z * z);
    let h = Vec3::new(sin_theta * cos_phi + v.x, sin_theta * sin_phi + v.y, z + v.z);

    // Back to the rough surface. Normals transform by the inverse transpose.
    LocalDir::normalize(Vec3::new(ax * h.x, ay * h.y, h.z.max(0.0)))
}

#[cfg(test)]
mod tests {
    use math::{LocalDir, Vec3, trig};
    use std::f32::consts::TAU;

    use crate::microfacet::Facets;

    const ALPHAS: [f32; 5] = [0.1, 0.25, 0.5, 0.75, 1.0];

    fn direction(mu: f32) -> LocalDir {
        LocalDir::new((1.0 - mu * mu).sqrt(), 0.0, mu)
    }

    /// Mean over a rank-1 lattice of `n` numbers `u`.
    fn mean(n: u32, f: impl Fn([f32; 2]) -> f32) -> f64 {
        let at = |i: u32| [(i as f32 + 0.5) / n as f32, math::hash::unit_f32(i.wrapping_mul(0x9e37_79b9))];
        (0..n).map(|i| f64::from(f(at(i)))).sum::<f64>() / f64::from(n)
    }

    /// Directional albedo with F = 1.
    fn energy(alpha: f32, mu: f32) -> f64 {
        let (g, wo) = (Facets::ggx(alpha, alpha), direction(mu));
        mean(40_000, |u| {
            let m = g.sample_visible(wo, u);
            let wi = LocalDir(2.0 * wo.dot(m) * m.0 - wo.0);
            if wi.0.z > 0.0 { g.shadowing(wo, wi) } else { 0.0 }
        })
    }

    #[test]
    fn directional_albedos_are_those_of_the_table() {
        // Ground truth, sec. 8: alpha, E(1), E(.5), E(.1), E_avg.
        let table = [
            [0.1, 0.988_30, 0.969_21, 0.883_45, 0.972_05],
            [0.25, 0.915_81, 0.857_26, 0.891_62, 0.882_32],
            [0.5, 0.687_85, 0.698_25, 0.860_11, 0.700_24],
            [0.75, 0.463_92, 0.564_62, 0.810_71, 0.536_30],
            [1.0, 0.306_85, 0.450_69, 0.760_21, 0.409_14],
        ];
        for row in table {
            for (mu, e) in [(1.0, row[1]), (0.5, row[2]), (0.1, row[3])] {
                let found = energy(row[0] as f32, mu);
                assert!((found - e).abs() < 1e-4, "alpha {} mu {mu}: {found} is not {e}", row[0]);
            }
        }
        let half: f64 =
            (0..40).map(|i| (f64::from(i) + 0.5) / 40.0).map(|mu| mu * energy(0.5, mu as f32)).sum();
        assert!((half / 20.0 - 0.700_24).abs() < 3e-4, "{}", half / 20.0);
    }

    #[test]
    fn the_weak_white_furnace_is_one() {
        // ∫ D(m) max(0, wo·m) G1(wo) / |z| dm = 1, which is the integral of the visible normals' density.
        for (ax, ay) in ALPHAS.map(|a| (a, a)).into_iter().chain([(0.1, 0.6), (0.9, 0.2)]) {
            let g = Facets::ggx(ax, ay);
            for mu in [1.0, 0.7, 0.3, 0.05] {
                let wo = LocalDir::normalize(Vec3::new((1.0 - mu * mu) * 0.8, (1.0 - mu * mu) * 0.6, mu));
                // Over tan θ = t/(1 − t) and φ.
                let sum = mean(200_000, |u| {
                    let (t, (sin, cos)) = (u[0] / (1.0 - u[0]), trig::sin_cos(TAU * u[1]));
                    let z = 1.0 / (1.0 + t * t).sqrt();
                    let m = LocalDir::new(t * z * cos, t * z * sin, z);
                    let jacobian = TAU * t * z * z * z / ((1.0 - u[0]) * (1.0 - u[0]));
                    if wo.dot(m) > 0.0 { g.visible_pdf(wo, m).value() * jacobian } else { 0.0 }
                });
                assert!((sum - 1.0).abs() < 2e-3, "alpha {ax} {ay}, mu {mu}: {sum}");
            }
        }
    }

    #[test]
    fn masking_agrees_with_lambda() {
        let g = Facets::ggx(0.3, 0.7);
        for mu in [1.0, 0.6, 0.1, 0.001] {
            let (a, b) = (direction(mu), direction(0.4));
            assert!((g.g1(a) - 1.0 / (1.0 + g.lambda(a))).abs() < 1e-5);
            assert!((g.g2(a, b) - 1.0 / (1.0 + g.lambda(a) + g.lambda(b))).abs() < 1e-5);
            assert!((g.shadowing(a, b) - g.g2(a, b) / g.g1(a)).abs() < 1e-5);
        }
    }

    #[test]
    fn nothing_overflows_at_grazing_angles() {
        for alpha in [1e-3, 0.01, 0.3, 1.0] {
            let g = Facets::ggx(alpha, alpha);
            for z in [0.0, 1e-38, 1e-20, 1e-8, 1e-4] {
                let w = LocalDir::new(1.0, 0.0, z);
                for u in [[0.0, 0.0], [0.999_999_9, 0.999_999_9], [0.5, 0.0], [0.0, 0.5]] {
                    let m = g.sample_visible(w, u);
                    assert!(m.0.is_finite() && m.0.z >= 0.0);
                    assert!(g.visible_pdf(w, m).value().is_finite());
                    assert!(g.g1(w).is_finite() && g.g2(w, w).is_finite() && g.lambda(w).is_finite());
                    assert!((0.0..=1.000_001).contains(&g.shadowing(w, m)));
                }
            }
        }
    }
}
