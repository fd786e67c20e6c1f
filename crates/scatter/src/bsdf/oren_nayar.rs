//! Oren and Nayar's rough matt surface: V-shaped grooves whose walls follow Lambert's law.
//!
//! | step   | source                                                                            |
//! |--------|-----------------------------------------------------------------------------------|
//! | `f`    | [Oren1994], the qualitative model: `ρ/π (A + B max(0, cos(φi − φo)) sin α tan β)`  |
//! | warp   | cosine                                                                             |
//!
//! `A = 1 − σ²/(2(σ² + 0.33))`, `B = 0.45 σ²/(σ² + 0.09)`, `α` the larger and `β` the smaller angle from the normal.
//! Left out: light between walls (the model loses some energy as σ grows).

use std::f32::consts::FRAC_1_PI;

use math::LocalDir;
use sampling::{Pdf, SolidAngle};
use spectrum::Spectrum;

use super::diffuse::cosine_on_side_of;
use super::{BsdfKind, BsdfSample, Gloss, Lobe, LobeFlags, TransportMode};

/// A rough matt surface. Both sides reflect alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrenNayar {
    reflectance: Spectrum,
    a: f32,
    b: f32,
}

impl OrenNayar {
    /// With reflectance in [0, 1] of the walls, whose slope angles have the standard deviation `sigma`, in radians.
    #[must_use]
    pub fn new(reflectance: Spectrum, sigma: f32) -> Self {
        let s2 = sigma * sigma;
        Self { reflectance, a: 1.0 - 0.5 * s2 / (s2 + 0.33), b: 0.45 * s2 / (s2 + 0.09) }
    }
}

impl BsdfKind for OrenNayar {
    #[inline]
    fn eval(&self, wo: LocalDir, wi: LocalDir, _: TransportMode) -> Spectrum {
        if !wo.same_hemisphere(wi) {
            return Spectrum::ZERO;
        }
        // cos(φi − φo) sin θi sin θo is the product of the horizontal parts; sin α tan β is sin sin over the larger cosine.
        let across = wo.0.x * wi.0.x + wo.0.y * wi.0.y;
        let term = across.max(0.0) / wo.abs_cos_theta().max(wi.abs_cos_theta());
        self.reflectance * (FRAC_1_PI * (self.a + self.b * term))
    }

    #[inline]
    fn pdf(&self, wo: LocalDir, wi: LocalDir, _: TransportMode) -> Pdf<SolidAngle> {
        if wo.same_hemisphere(wi) { Pdf::new(wi.abs_cos_theta() * FRAC_1_PI) } else { Pdf::ZERO }
    }

    fn sample(&self, wo: LocalDir, _: f32, u: [f32; 2], mode: TransportMode) -> Option<BsdfSample> {
        let wi = cosine_on_side_of(wo, u)?;
        let (f, pdf) = self.eval_pdf(wo, wi, mode);
        let weight = f * std::f32::consts::PI;
        Some(BsdfSample::smooth(wi, weight, pdf, Lobe::reflection(Gloss::Diffuse)))
    }

    #[inline]
    fn has_choice(&self) -> bool {
        false
    }

    fn is_isotropic(&self) -> bool {
        true
    }

    fn flags(&self) -> LobeFlags {
        if self.reflectance.is_black() { LobeFlags::NONE } else { LobeFlags::DIFFUSE_REFLECTION }
    }

    fn albedo_estimate(&self, _: LocalDir) -> Spectrum {
        self.reflectance
    }
}
