//! Normalised diffusion: how much of the light that enters a surface at one place leaves it at another [Christensen2015].
//!
//! `R(r) = A (e^{−r/d} + e^{−r/3d}) / (8π d r)` with `d = ℓ / s`, `s = 1.9 − A + 3.5 (A − 0.8)²` for light that enters and
//! leaves a flat half space evenly in all directions; ℓ is the mean free path (reduced where scattering is not isotropic).
//! `∫ R dA = A` for every d: what leaves is the albedo's share of what entered, whatever else is approximate. The radius' density
//! `2π r R / A` is a mixture of exponentials, so that radii are drawn without a table.
//!
//! Left out: the rest of the paper, of light that falls in straight.

use std::f32::consts::{PI, TAU};

use math::trig;
use sampling::{Area, Length, Pdf};
use spectrum::Spectrum;

/// A profile, lane by lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiffusionProfile {
    albedo: Spectrum,
    /// d, in scene units.
    shape: Spectrum,
}

/// Widths of both exponentials in d, and the first one's share.
const WIDTHS: [f32; 2] = [1.0, 3.0];
const FIRST: f32 = 0.25;
/// A radius in d beyond which less than 10⁻⁶ of the light leaves, and what is there is left out.
const FAR: f32 = 41.0;
/// Shortest d, in scene units.
const SHORTEST: f32 = 1e-7;

impl DiffusionProfile {
    /// Of effective albedo and reduced mean free path.
    #[must_use]
    pub fn new(albedo: Spectrum, mean_free_path: Spectrum) -> Self {
        let albedo = albedo.clamp(0.0, 1.0);
        let shape = mean_free_path.zip(albedo, |l, a| {
            let off = a - 0.8;
            (l / (1.9 - a + 3.5 * off * off)).max(SHORTEST)
        });
        Self { albedo, shape }
    }

    /// What leaves per area at distance `r` of what entered.
    #[must_use]
    pub fn eval(&self, r: f32) -> Spectrum {
        self.albedo.zip(self.shape, |a, d| a * mixture(r / d) / (d * d))
    }

    /// The share of the light that leaves.
    #[must_use]
    pub fn albedo(&self) -> Spectrum {
        self.albedo
    }

    /// The distance beyond which nothing of a lane is followed.
    #[must_use]
    pub fn reach(&self, lane: usize) -> f32 {
        FAR * self.shape.lanes()[lane]
    }

    /// A distance drawn by a lane's profile.
    #[must_use]
    pub fn sample(&self, lane: usize, u: f32) -> f32 {
        let (width, u) = match u < FIRST {
            true => (WIDTHS[0], u / FIRST),
            false => (WIDTHS[1], (u - FIRST) / (1.0 - FIRST)),
        };
        -trig::ln((1.0 - u).max(f32::MIN_POSITIVE)) * width * self.shape.lanes()[lane]
    }

    /// Density of [`DiffusionProfile::sample`] per distance.
    #[must_use]
    pub fn pdf(&self, lane: usize, r: f32) -> Pdf<Length> {
        let d = self.shape.lanes()[lane];
        Pdf::new(TAU * r * mixture(r / d) / (d * d))
    }

    /// The same per area of a plane, about the point where light entered.
    #[must_use]
    pub fn pdf_area(&self, lane: usize, r: f32) -> Pdf<Area> {
        let d = self.shape.lanes()[lane];
        Pdf::new(mixture(r / d) / (d * d))
    }
}

/// R for an albedo and a d of one; in the very middle, where it has no end, what it is close to it.
fn mixture(r: f32) -> f32 {
    (trig::exp(-r / WIDTHS[0]) + trig::exp(-r / WIDTHS[1])) / (8.0 * PI * r.max(1e-6))
}
