//! Irradiance at a point from rays over its hemisphere, and how it changes as the point moves or its normal turns.
//!
//! | step                         | source                                     |
//! |------------------------------|--------------------------------------------|
//! | strata, even in cos² θ and φ | [Ward1992]                                 |
//! | rotational gradient          | [Ward1992]                                 |
//! | translational gradient       | [Ward1992], [Krivanek2005]                 |
//! | harmonic mean distance       | [Ward1988]                                 |
//!
//! The translational gradient follows from borders between strata: as the point moves, a border at distance r sweeps
//! over the hemisphere, and the stratum on one side gains what the other loses. Of two distances at a border the
//! nearer counts, since that is the surface that moves.

use std::f32::consts::{PI, TAU};

use math::{Frame, LocalDir, Vec3, trig};
use spectrum::Spectrum;

/// How a hemisphere is cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Strata {
    /// From the pole to the horizon.
    n_theta: usize,
    /// Around.
    n_phi: usize,
}

/// What a ray found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    /// Radiance that counts.
    pub(super) radiance: Spectrum,
    /// Infinite if it left the scene.
    pub(super) distance: f32,
}

/// Irradiance, with its changes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Irradiance {
    pub(super) e: Spectrum,
    /// By x, y and z of a small rotation vector of the normal.
    pub(super) by_rotation: [Spectrum; 3],
    /// By x, y and z of a small step in the tangent plane.
    pub(super) by_translation: [Spectrum; 3],
}

impl Strata {
    /// About `n` of them, about as wide as they are high: π times as many around as from pole to horizon.
    pub(super) fn new(n: u32) -> Self {
        let n_theta = ((n as f32 / PI).sqrt().round() as usize).max(2);
        let n_phi = ((n as f32 / n_theta as f32).round() as usize).max(4);
        Self { n_theta, n_phi }
    }

    /// How many there are.
    pub(super) fn len(self) -> usize {
        self.n_theta * self.n_phi
    }

    /// A direction in stratum `i`, in proportion to the cosine.
    pub(super) fn direction(self, i: usize, u: [f32; 2]) -> LocalDir {
        let (j, k) = (i % self.n_theta, i / self.n_theta);
        let sin2 = ((j as f32 + u[0]) / self.n_theta as f32).min(1.0);
        let (sin, cos) = trig::sin_cos(TAU * (k as f32 + u[1]) / self.n_phi as f32);
        let r = sin2.sqrt();
        LocalDir(Vec3::new(r * cos, r * sin, trig::safe_sqrt(1.0 - sin2)))
    }

    /// Irradiance from one ray in each stratum.
    pub(super) fn integrate(self, found: &[Found], frame: &Frame) -> Irradiance {
        let (m, n) = (self.n_theta, self.n_phi);
        let at = |j: usize, k: usize| &found[(k % n) * m + j];
        let around = |phi: f32| {
            let (sin, cos) = trig::sin_cos(phi);
            frame.s * cos + frame.t * sin
        };
        let sin_at = |j: f32| (j / m as f32).sqrt();
        let mut sum = Irradiance::default();
        for k in 0..n {
            let phi = TAU * k as f32 / n as f32;
            let phi_mid = phi + PI / n as f32;
            let (outward, turn, along) =
                (around(phi_mid), around(phi_mid + 0.5 * PI), around(phi + 0.5 * PI));
            let (mut tilted, mut radial, mut lateral) = (Spectrum::ZERO, Spectrum::ZERO, Spectrum::ZERO);
            for j in 0..m {
                let here = at(j, k);
                sum.e += here.radiance;
                // tan θ in the middle of the stratum.
                let sin = sin_at(j as f32 + 0.5);
                tilted += here.radiance * (sin / trig::safe_sqrt(1.0 - sin * sin));

                // The border to the stratum before: from θ_j- to θ_j+ it sweeps sin θ_j+ − sin θ_j- over r.
                let before = at(j, k + n - 1);
                let swept = (sin_at(j as f32 + 1.0) - sin_at(j as f32)) / here.distance.min(before.distance);
                lateral += (here.radiance - before.radiance) * swept;

                // The border to the stratum above: cos² θ sin θ Δφ over r.
                if j > 0 {
                    let above = at(j - 1, k);
                    let sin = sin_at(j as f32);
                    let swept = (1.0 - sin * sin) * sin / here.distance.min(above.distance);
                    radial += (here.radiance - above.radiance) * (swept * TAU / n as f32);
                }
            }
            let share = PI / (m * n) as f32;
            add(&mut sum.by_rotation, turn, tilted * share);
            add(&mut sum.by_translation, along, lateral);
            add(&mut sum.by_translation, outward, radial);
        }
        sum.e *= PI / (m * n) as f32;
        sum
    }
}

/// Mean of 1/r over rays; zero if all are infinite.
pub(super) fn mean_inverse_distance(found: &[Found]) -> f32 {
    found.iter().map(|f| 1.0 / f.distance).sum::<f32>() / found.len().max(1) as f32
}

fn add(gradient: &mut [Spectrum; 3], direction: Vec3, change: Spectrum) {
    for (g, d) in gradient.iter_mut().zip(direction.to_array()) {
        *g += change * d;
    }
}

#[cfg(test)]
mod tests {
    use math::{Dir, Point};

    use super::*;

    /// Within 0.6 of (0.4, 0.3) on a ceiling at height 1 the radiance is 2 + x, elsewhere 0.2.
    fn ceiling(p: Point, w: Dir) -> Found {
        if w.0.z <= 1e-6 {
            return Found { radiance: Spectrum::ZERO, distance: f32::INFINITY };
        }
        let t = (1.0 - p.0.z) / w.0.z;
        let q = p + w.0 * t;
        let inside = (q.0.x - 0.4).abs() < 0.6 && (q.0.y - 0.3).abs() < 0.6;
        let radiance = if inside { 2.0 + q.0.x } else { 0.2 };
        Found { radiance: Spectrum::splat(radiance), distance: t }
    }

    /// At `p` under a normal.
    fn irradiance(p: Point, n: Dir, strata: Strata) -> Irradiance {
        let frame = Frame::from_normal(n);
        let found: Vec<Found> =
            (0..strata.len()).map(|i| ceiling(p, frame.to_world(strata.direction(i, [0.5; 2])))).collect();
        strata.integrate(&found, &frame)
    }

    fn gradient_lane(g: &[Spectrum; 3]) -> Vec3 {
        Vec3::from_array(g.map(|s| s.lanes()[0]))
    }

    #[test]
    fn gradients_are_those_of_finite_differences() {
        let fine = Strata::new(400_000);
        let coarse = Strata::new(20_000);
        for (p, n) in [
            (Point::new(0.1, -0.2, 0.0), Dir::Z),
            (Point::new(-0.7, 0.5, 0.1), Dir::normalize(Vec3::new(0.1, -0.05, 1.0))),
            (Point::new(0.4, 1.2, 0.0), Dir::normalize(Vec3::new(-0.1, -0.1, 1.0))),
        ] {
            let frame = Frame::from_normal(n);
            let at = |p: Point, n: Dir| irradiance(p, n, fine).e.lanes()[0];
            let found = irradiance(p, n, coarse);
            let h = 0.02;
            for step in [frame.s, frame.t] {
                let numeric = (at(p + step * h, n) - at(p + step * -h, n)) / (2.0 * h);
                let gradient = gradient_lane(&found.by_translation).dot(step);
                assert!(
                    (gradient - numeric).abs() < 0.04 * at(p, n),
                    "{p:?} along {step}: {gradient} {numeric}"
                );

                // Turned by a small angle about `step`.
                let turned = |a: f32| Dir::normalize(n.0 + step.cross(n.0) * a);
                let numeric = (at(p, turned(h)) - at(p, turned(-h))) / (2.0 * h);
                let gradient = gradient_lane(&found.by_rotation).dot(step);
                assert!(
                    (gradient - numeric).abs() < 0.02 * at(p, n),
                    "{p:?} about {step}: {gradient} {numeric}"
                );
            }
        }
    }

    /// Under an even ceiling nothing changes along the floor, and the normal counts with its cosine.
    #[test]
    fn an_even_sky_has_no_gradients() {
        let strata = Strata::new(500);
        let found = vec![Found { radiance: Spectrum::ONE, distance: 3.0 }; strata.len()];
        let frame = Frame::from_normal(Dir::normalize(Vec3::new(0.3, 0.2, 0.9)));
        let e = strata.integrate(&found, &frame);
        assert!((e.e.lanes()[0] - PI).abs() < 1e-4, "{:?}", e.e);
        assert!(gradient_lane(&e.by_translation).length() < 1e-5);
        assert!(gradient_lane(&e.by_rotation).length() < 1e-4);
        assert!((mean_inverse_distance(&found) - 1.0 / 3.0).abs() < 1e-6);
    }

    #[test]
    fn strata_fill_the_hemisphere_in_proportion_to_the_cosine() {
        let strata = Strata::new(300);
        for i in 0..strata.len() {
            for u in [[0.0, 0.0], [0.5, 0.5], [0.999, 0.999]] {
                let w = strata.direction(i, u);
                assert!((w.0.length() - 1.0).abs() < 1e-5 && w.0.z >= 0.0);
            }
        }
        let mean: f32 =
            (0..strata.len()).map(|i| strata.direction(i, [0.5; 2]).0.z).sum::<f32>() / strata.len() as f32;
        assert!((mean - 2.0 / 3.0).abs() < 2e-3, "{mean}");
    }
}
