//! Phase functions: where light goes that a particle scatters.
//!
//! | kind               | source                  |
//! |--------------------|-------------------------|
//! | `Isotropic`        | `1/4π`                  |
//! | `HenyeyGreenstein` | [Henyey1941]            |
//! | `BlendedPhase`     | a sum of some of the others, one of them chosen by the number that draws the angle |
//! | `Rayleigh`         | `3 (1 + cos²) / 16π`; inverse of its distribution by Cardano's formula [Frisvad2011] |
//!
//! `wo` and `wi` both point away from the particle: light that goes straight on has `wi = −wo`. All kinds are
//! sampled exactly, so a sample weighs one. Values are per steradian and integrate to one.
//! Left out: tabulated phase functions and polarisation.

use std::f32::consts::{FRAC_1_PI, TAU};

use math::{Dir, Frame, LocalDir, Vec3, trig};
use sampling::{Pdf, SolidAngle};

use crate::closed_set::closed_set;

/// A direction drawn from a phase function; its weight is one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhaseSample {
    /// Away from the particle, where the path goes on.
    pub wi: Dir,
    /// Its density, which is also the value of the phase function.
    pub pdf: Pdf<SolidAngle>,
}

/// What every phase function does. Laws (`testkit::phase_laws!`): the density integrates to one, and `sample` draws
/// from it.
pub trait PhaseKind: Copy + Into<PhaseFunction> {
    /// Value per steradian where `wo·wi` is `cos`.
    fn at_cos(&self, cos: f32) -> f32;

    /// `wo·wi` for a uniform number.
    fn sample_cos(&self, u: f32) -> f32;

    /// The mean of the cosine between the directions of light before and after.
    fn mean_cosine(&self) -> f32;
}

closed_set! {
    ($)
    /// A phase function, by value.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub enum PhaseFunction dispatch dispatch {
        /// The same in all directions.
        Isotropic,
        /// One parameter from backward to forward.
        HenyeyGreenstein,
        /// Particles much smaller than the wavelength.
        Rayleigh,
        /// A sum of the others.
        BlendedPhase,
    }
}

impl PhaseFunction {
    /// The value per steradian.
    #[must_use]
    pub fn eval(&self, wo: Dir, wi: Dir) -> f32 {
        dispatch!(self, p => p.at_cos(wo.dot(wi)))
    }

    /// The density of [`PhaseFunction::sample`], which equals the value.
    #[must_use]
    pub fn pdf(&self, wo: Dir, wi: Dir) -> Pdf<SolidAngle> {
        Pdf::new(self.eval(wo, wi))
    }

    /// A direction for `wo`.
    #[must_use]
    pub fn sample(&self, wo: Dir, u: [f32; 2]) -> PhaseSample {
        let cos = dispatch!(self, p => p.sample_cos(u[0]));
        let value = dispatch!(self, p => p.at_cos(cos));
        let wi = Dir(about(Frame::from_normal(wo), cos, u[1]));
        PhaseSample { wi, pdf: Pdf::new(value) }
    }

    /// The mean cosine `g` between the directions of light before and after.
    #[must_use]
    pub fn mean_cosine(&self) -> f32 {
        dispatch!(self, p => p.mean_cosine())
    }
}

/// A direction at an angle of given cosine to the frame's normal.
fn about(frame: Frame, cos: f32, u: f32) -> Vec3 {
    let sin = trig::safe_sqrt(1.0 - cos * cos);
    let (s, c) = trig::sin_cos(TAU * u);
    frame.to_world(LocalDir::new(sin * c, sin * s, cos)).0
}

/// The same in all directions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Isotropic;

impl PhaseKind for Isotropic {
    fn at_cos(&self, _: f32) -> f32 {
        0.25 * FRAC_1_PI
    }

    fn sample_cos(&self, u: f32) -> f32 {
        1.0 - 2.0 * u
    }

    fn mean_cosine(&self) -> f32 {
        0.0
    }
}

/// Henyey and Greenstein's phase function of mean cosine `g`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HenyeyGreenstein {
    g: f32,
}

impl HenyeyGreenstein {
    /// Forward for `g > 0`, backward for `g < 0`; limited to [−0.99, 0.99].
    #[must_use]
    pub fn new(g: f32) -> Self {
        Self { g: g.clamp(-0.99, 0.99) }
    }

    /// A direction for `wo` in a local frame, with its density.
    pub(crate) fn sample_local(&self, wo: LocalDir, u: [f32; 2]) -> (LocalDir, Pdf<SolidAngle>) {
        let cos = self.sample_cos(u[0]);
        let wi = LocalDir(about(Frame::from_normal(Dir(wo.0)), cos, u[1]));
        (wi, Pdf::new(self.at_cos(cos)))
    }
}

impl PhaseKind for HenyeyGreenstein {
    fn at_cos(&self, cos: f32) -> f32 {
        // The angle of scattering is that between −wo and wi, hence the plus.
        let g = self.g;
        let denominator = (1.0 + g * g + 2.0 * g * cos).max(1e-8);
        0.25 * FRAC_1_PI * (1.0 - g * g) / (denominator * denominator.sqrt())
    }

    fn sample_cos(&self, u: f32) -> f32 {
        let g = self.g;
        if g.abs() < 1e-3 {
            return 1.0 - 2.0 * u;
        }
        let s = (1.0 - g * g) / (1.0 + g - 2.0 * g * u);
        (-(1.0 + g * g - s * s) / (2.0 * g)).clamp(-1.0, 1.0)
    }

    fn mean_cosine(&self) -> f32 {
        self.g
    }
}

/// Rayleigh's phase function.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rayleigh;

impl PhaseKind for Rayleigh {
    fn at_cos(&self, cos: f32) -> f32 {
        3.0 / 16.0 * FRAC_1_PI * (1.0 + cos * cos)
    }

    fn sample_cos(&self, u: f32) -> f32 {
        // c³ + 3c = 2z with z = 2(2u − 1) has the root t − 1/t, t³ = z + √(z² + 1); odd in z, so no cancellation.
        let z = 2.0 * (2.0 * u - 1.0);
        let t = trig::pow(z.abs() + (z * z + 1.0).sqrt(), 1.0 / 3.0);
        (t - 1.0 / t).clamp(0.0, 1.0).copysign(z)
    }

    fn mean_cosine(&self) -> f32 {
        0.0
    }
}

/// A phase function that is no sum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PurePhase {
    /// The same in all directions.
    Isotropic(Isotropic),
    /// One parameter from backward to forward.
    HenyeyGreenstein(HenyeyGreenstein),
    /// Particles much smaller than the wavelength.
    Rayleigh(Rayleigh),
}

/// A sum of up to four phase functions: a mixture of particles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlendedPhase {
    /// With shares that sum to one; those that are not there have none.
    parts: [(f32, PurePhase); Self::MOST_PARTS],
}

impl BlendedPhase {
    /// Parts of a sum.
    pub const MOST_PARTS: usize = 4;

    /// With shares in proportion to these weights; those that are not positive have none. `None` if there are too many, or if
    /// nothing is left.
    #[must_use]
    pub fn new(weighted: &[(f32, PurePhase)]) -> Option<Self> {
        let share = |w: f32| if w > 0.0 && w.is_finite() { w } else { 0.0 };
        let sum: f32 = weighted.iter().map(|(w, _)| share(*w)).sum();
        if weighted.len() > Self::MOST_PARTS || sum <= 0.0 {
            return None;
        }
        let mut parts = [(0.0, PurePhase::Isotropic(Isotropic)); Self::MOST_PARTS];
        for (part, (w, phase)) in parts.iter_mut().zip(weighted) {
            *part = (share(*w) / sum, *phase);
        }
        Some(Self { parts })
    }
}

impl PurePhase {
    fn at_cos(&self, cos: f32) -> f32 {
        match self {
            Self::Isotropic(p) => p.at_cos(cos),
            Self::HenyeyGreenstein(p) => p.at_cos(cos),
            Self::Rayleigh(p) => p.at_cos(cos),
        }
    }

    fn sample_cos(&self, u: f32) -> f32 {
        match self {
            Self::Isotropic(p) => p.sample_cos(u),
            Self::HenyeyGreenstein(p) => p.sample_cos(u),
            Self::Rayleigh(p) => p.sample_cos(u),
        }
    }

    fn mean_cosine(&self) -> f32 {
        match self {
            Self::Isotropic(p) => p.mean_cosine(),
            Self::HenyeyGreenstein(p) => p.mean_cosine(),
            Self::Rayleigh(p) => p.mean_cosine(),
        }
    }
}

impl PhaseKind for BlendedPhase {
    fn at_cos(&self, cos: f32) -> f32 {
        self.parts.iter().filter(|(w, _)| *w > 0.0).map(|(w, p)| w * p.at_cos(cos)).sum()
    }

    fn sample_cos(&self, u: f32) -> f32 {
        let (mut left, mut last) = (u, &self.parts[0].1);
        for (weight, phase) in self.parts.iter().filter(|(w, _)| *w > 0.0) {
            if left < *weight {
                return phase.sample_cos(left / weight);
            }
            (left, last) = (left - weight, phase);
        }
        last.sample_cos(1.0 - f32::EPSILON)
    }

    fn mean_cosine(&self) -> f32 {
        self.parts.iter().map(|(w, p)| w * p.mean_cosine()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean of `f` of the cosine of scattering, −wo·wi.
    fn mean(p: impl PhaseKind, f: impl Fn(f64) -> f64) -> f64 {
        let n = 20_000;
        (0..n).map(|i| f(-f64::from(p.sample_cos((i as f32 + 0.5) / n as f32)))).sum::<f64>() / f64::from(n)
    }

    #[test]
    fn mean_cosines_are_as_stated() {
        // Ground truth, sec. 6: ⟨cos⟩ = g, and ⟨cos²⟩ = 2/5 for Rayleigh.
        for g in [-0.9, -0.3, 0.0, 5e-4, 0.5, 0.85] {
            let p = HenyeyGreenstein::new(g);
            assert!((mean(p, |c| c) - f64::from(g)).abs() < 1e-3, "{g}: {}", mean(p, |c| c));
        }
        assert!((mean(Rayleigh, |c| c * c) - 0.4).abs() < 1e-4);
        assert!(mean(Rayleigh, |c| c).abs() < 1e-5 && mean(Isotropic, |c| c).abs() < 1e-5);
    }

    #[test]
    fn a_blend_has_the_blend_of_the_cosines() {
        let g = |g: f32| PurePhase::HenyeyGreenstein(HenyeyGreenstein::new(g));
        let blend = BlendedPhase::new(&[(3.0, g(0.8)), (1.0, g(-0.4)), (-1.0, g(0.9))]).unwrap();
        assert!((blend.mean_cosine() - 0.5).abs() < 1e-6);
        assert!((mean(blend, |c| c) - 0.5).abs() < 1e-3);
        assert!(
            BlendedPhase::new(&[(0.0, g(0.1))]).is_none() && BlendedPhase::new(&[(1.0, g(0.1)); 5]).is_none()
        );
    }

    #[test]
    fn forward_is_straight_on() {
        let p = PhaseFunction::from(HenyeyGreenstein::new(0.8));
        assert!(p.eval(Dir::Z, -Dir::Z) > 50.0 * p.eval(Dir::Z, Dir::Z));
    }
}
