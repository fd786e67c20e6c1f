//! The GGX (Trowbridge–Reitz) distribution, anisotropic, with height-correlated Smith masking.
//!
//! | what                  | source                                              |
//! |-----------------------|-----------------------------------------------------|
//! | `d`                   | [Walter2007]; anisotropic [Burley2012]              |
//! | `lambda`, `g1`, `g2`  | [Heitz2014], height-correlated                      |
//! | visible normals       | [Heitz2018] for the density, [Dupuy2023] for the warp (spherical caps) |
//! | `regularize`, `alpha_from_roughness` | pbrt-v4's conventions                |
//!
//! All is written with `s(w) = √(αx² x² + αy² y² + z²)`, the length of the stretched direction: then `1 + Λ =
//! (1 + s/|z|) / 2`, and `G1/|z|`, `G2/(z z')` and `G2/G1` have no tangent and no pole at grazing angles.
//! Left out: slopes' correlation between sides of a transmission (both sides share the height-correlated form).

use std::f32::consts::{PI, TAU};

use math::{LocalDir, Vec3, trig};
use sampling::{Pdf, SolidAngle};

/// Widths of the distribution of slopes along both tangents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx {
    alpha_x: f32,
    alpha_y: f32,
}

impl Ggx {
    /// Widths along the tangents, at least zero. Unless the surface counts as smooth, each is at least 1e-4.
    #[must_use]
    #[inline]
    pub fn new(alpha_x: f32, alpha_y: f32) -> Self {
        let smooth = alpha_x.max(alpha_y) < Self::SMOOTH_BELOW;
        let floor = if smooth { 0.0 } else { 1e-4 };
        Self { alpha_x: alpha_x.max(floor), alpha_y: alpha_y.max(floor) }
    }

    /// A mirror.
    pub const SMOOTH: Self = Self { alpha_x: 0.0, alpha_y: 0.0 };

    /// Surfaces with both widths below this are treated as mirrors (pbrt-v4).
    pub const SMOOTH_BELOW: f32 = 1e-3;

    /// pbrt-v4's roughness: `alpha = √roughness`.
    #[must_use]
    pub fn alpha_from_roughness(roughness: f32) -> f32 {
        trig::safe_sqrt(roughness)
    }

    /// Both widths.
    #[must_use]
    pub fn alpha(&self) -> [f32; 2] {
        [self.alpha_x, self.alpha_y]
    }

    /// Is it to be treated as a mirror?
    #[must_use]
    #[inline]
    pub fn is_smooth(&self) -> bool {
        self.alpha_x.max(self.alpha_y) < Self::SMOOTH_BELOW
    }

    /// The same width both ways?
    #[must_use]
    pub fn is_isotropic(&self) -> bool {
        self.alpha_x == self.alpha_y
    }

    /// Widened, for paths whose caustics would be found too seldom: below 0.3 to twice itself within [0.1, 0.3].
    #[must_use]
    pub fn regularized(&self) -> Self {
        let widen = |a: f32| if a < 0.3 { (2.0 * a).clamp(0.1, 0.3) } else { a };
        Self { alpha_x: widen(self.alpha_x), alpha_y: widen(self.alpha_y) }
    }

    /// `D(m)`: area of facets with normal `m` per steradian and per area of surface; `∫ D (m·n) dm = 1`.
    #[must_use]
    #[inline]
    pub fn d(&self, m: LocalDir) -> f32 {
        let (x, y) = (m.0.x / self.alpha_x, m.0.y / self.alpha_y);
        let q = x * x + y * y + m.0.z * m.0.z;
        1.0 / (PI * self.alpha_x * self.alpha_y * q * q)
    }

    /// `s(w)` of the head.
    #[must_use]
    #[inline]
    pub(crate) fn stretch(&self, w: LocalDir) -> f32 {
        let (x, y) = (self.alpha_x * w.0.x, self.alpha_y * w.0.y);
        (x * x + y * y + w.0.z * w.0.z).sqrt()
    }

    /// Smith's `Λ(w) = (s/|z| − 1) / 2`.
    #[must_use]
    pub fn lambda(&self, w: LocalDir) -> f32 {
        0.5 * (self.stretch(w) / w.abs_cos_theta().max(MIN_Z) - 1.0).max(0.0)
    }

    /// Masking `G1 = 1/(1 + Λ)`: the part of the facets facing `w` that it sees.
    #[must_use]
    pub fn g1(&self, w: LocalDir) -> f32 {
        let c = w.abs_cos_theta();
        2.0 * c / (c + self.stretch(w)).max(MIN_Z)
    }

    /// Height-correlated masking and shadowing `G2 = 1/(1 + Λ(wo) + Λ(wi))`.
    #[must_use]
    pub fn g2(&self, wo: LocalDir, wi: LocalDir) -> f32 {
        2.0 * wo.abs_cos_theta() * wi.abs_cos_theta() / self.cross_stretch(wo, wi).max(MIN_Z)
    }

    /// `s(wo)|zi| + s(wi)|zo|`, which is `2 |zo zi| / G2`.
    #[inline]
    pub(crate) fn cross_stretch(&self, wo: LocalDir, wi: LocalDir) -> f32 {
        self.stretch(wo) * wi.abs_cos_theta() + self.stretch(wi) * wo.abs_cos_theta()
    }

    /// `G2/G1(wo)`, the weight of a sample of visible normals; in [0, 1].
    #[must_use]
    #[inline]
    pub fn shadowing(&self, wo: LocalDir, wi: LocalDir) -> f32 {
        let (so, si) = (self.stretch(wo), self.stretch(wi));
        let (co, ci) = (wo.abs_cos_theta(), wi.abs_cos_theta());
        ci * (co + so) / (so * ci + si * co).max(MIN_Z)
    }

    /// Density of the normals that `wo` sees, `G1(wo) |wo·m| D(m) / |z|`, per steradian of `m`.
    #[must_use]
    #[inline]
    pub fn visible_pdf(&self, wo: LocalDir, m: LocalDir) -> Pdf<SolidAngle> {
        Pdf::new(2.0 * self.d(m) * wo.dot(m).abs() / (wo.abs_cos_theta() + self.stretch(wo)).max(MIN_Z))
    }

    /// A normal seen from `wo` (either side), on the side z > 0.
    #[must_use]
    #[inline]
    pub fn sample_visible(&self, wo: LocalDir, u: [f32; 2]) -> LocalDir {
        // Stretch `wo` so that the surface becomes a hemisphere of unit roughness.
        let sign = 1.0_f32.copysign(wo.0.z);
        let v = LocalDir::normalize(sign * Vec3::new(self.alpha_x * wo.0.x, self.alpha_y * wo.0.y, wo.0.z)).0;

        // Reflections off the hemisphere fill the cap z > −v.z uniformly; the half vector is the normal.
        let (sin_phi, cos_phi) = trig::sin_cos(TAU * u[0]);
        let z = (1.0 - u[1]) * (1.0 + v.z) - v.z;
        let sin_theta = trig::safe_sqrt(1.0 - z * z);
        let h = Vec3::new(sin_theta * cos_phi + v.x, sin_theta * sin_phi + v.y, z + v.z);

        // Back to the rough surface. Normals transform by the inverse transpose.
        LocalDir::normalize(Vec3::new(self.alpha_x * h.x, self.alpha_y * h.y, h.z.max(0.0)))
    }
}

/// Guards divisions whose divisor is zero only for a direction in the surface.
const MIN_Z: f32 = 1e-30;

#[cfg(test)]
mod tests {
    use super::*;

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
        let (g, wo) = (Ggx::new(alpha, alpha), direction(mu));
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
            let g = Ggx::new(ax, ay);
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
        let g = Ggx::new(0.3, 0.7);
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
            let g = Ggx::new(alpha, alpha);
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
