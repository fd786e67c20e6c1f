//! Lambert's law on both sides: `ρ/π` back to the side of `wo`, `τ/π` through to the other (paper, leaves).
//!
//! The side is chosen in proportion to the largest lanes of `ρ` and `τ`, as in pbrt-v4.

use std::f32::consts::FRAC_1_PI;

use math::LocalDir;
use sampling::{Pdf, SolidAngle};
use spectrum::Spectrum;

use super::diffuse::cosine_on_side_of;
use super::{BsdfKind, BsdfSample, Gloss, Lobe, LobeFlags, TransportMode};

/// A thin sheet that scatters evenly to both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiffuseTransmission {
    reflectance: Spectrum,
    transmittance: Spectrum,
}

impl DiffuseTransmission {
    /// The two should add up to at most one.
    #[must_use]
    pub fn new(reflectance: Spectrum, transmittance: Spectrum) -> Self {
        Self { reflectance, transmittance }
    }

    /// Chance of reflection; zero for a black sheet.
    fn reflection_probability(&self) -> f32 {
        let (r, t) = (self.reflectance.max_component(), self.transmittance.max_component());
        if r + t > 0.0 { r / (r + t) } else { 0.0 }
    }
}

impl BsdfKind for DiffuseTransmission {
    fn eval(&self, wo: LocalDir, wi: LocalDir, _: TransportMode) -> Spectrum {
        if wo.same_hemisphere(wi) {
            self.reflectance * FRAC_1_PI
        } else if wo.same_hemisphere(-wi) {
            self.transmittance * FRAC_1_PI
        } else {
            Spectrum::ZERO
        }
    }

    fn pdf(&self, wo: LocalDir, wi: LocalDir, _: TransportMode) -> Pdf<SolidAngle> {
        let p_reflect = self.reflection_probability();
        let cosine = wi.abs_cos_theta() * FRAC_1_PI;
        if wo.same_hemisphere(wi) {
            Pdf::new(p_reflect * cosine)
        } else if wo.same_hemisphere(-wi) {
            Pdf::new((1.0 - p_reflect) * cosine)
        } else {
            Pdf::ZERO
        }
    }

    fn sample(&self, wo: LocalDir, u_lobe: f32, u: [f32; 2], _: TransportMode) -> Option<BsdfSample> {
        if self.flags().is_empty() {
            return None;
        }
        let p_reflect = self.reflection_probability();
        let wi = cosine_on_side_of(wo, u)?;
        let cosine = wi.abs_cos_theta() * FRAC_1_PI;
        Some(if u_lobe < p_reflect {
            let (weight, pdf) = (self.reflectance / p_reflect, Pdf::new(p_reflect * cosine));
            BsdfSample::smooth(wi, weight, pdf, Lobe::reflection(Gloss::Diffuse))
        } else {
            let p = 1.0 - p_reflect;
            let (weight, pdf) = (self.transmittance / p, Pdf::new(p * cosine));
            BsdfSample::smooth(-wi, weight, pdf, Lobe::transmission(Gloss::Diffuse))
        })
    }

    fn is_isotropic(&self) -> bool {
        true
    }

    fn flags(&self) -> LobeFlags {
        let flag = |s: Spectrum, f| if s.is_black() { LobeFlags::NONE } else { f };
        flag(self.reflectance, LobeFlags::DIFFUSE_REFLECTION)
            | flag(self.transmittance, LobeFlags::DIFFUSE_TRANSMISSION)
    }

    fn albedo_estimate(&self, _: LocalDir) -> Spectrum {
        self.reflectance + self.transmittance
    }
}
