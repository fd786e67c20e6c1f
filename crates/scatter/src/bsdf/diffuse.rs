//! Lambert's law: `f = ρ/π`, on the side that `wo` lies on.
//!
//! Both sides reflect alike; nothing passes.

use std::f32::consts::FRAC_1_PI;

use math::LocalDir;
use sampling::{Pdf, SolidAngle, warp};
use spectrum::Spectrum;

use super::{BsdfKind, BsdfSample, Gloss, Lobe, LobeFlags, TransportMode};

/// An ideal matt surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuse {
    reflectance: Spectrum,
}

impl Diffuse {
    /// With reflectance in [0, 1].
    #[must_use]
    pub fn new(reflectance: Spectrum) -> Self {
        Self { reflectance }
    }

    /// The part of the light that is reflected.
    #[must_use]
    #[inline]
    pub fn reflectance(&self) -> Spectrum {
        self.reflectance
    }
}

impl BsdfKind for Diffuse {
    #[inline]
    fn eval(&self, wo: LocalDir, wi: LocalDir, _: TransportMode) -> Spectrum {
        if wo.same_hemisphere(wi) { self.reflectance * FRAC_1_PI } else { Spectrum::ZERO }
    }

    #[inline]
    fn pdf(&self, wo: LocalDir, wi: LocalDir, _: TransportMode) -> Pdf<SolidAngle> {
        if wo.same_hemisphere(wi) { Pdf::new(wi.abs_cos_theta() * FRAC_1_PI) } else { Pdf::ZERO }
    }

    #[inline]
    fn sample(&self, wo: LocalDir, _: f32, u: [f32; 2], _: TransportMode) -> Option<BsdfSample> {
        let wi = cosine_on_side_of(wo, u)?;
        let pdf = Pdf::new(wi.abs_cos_theta() * FRAC_1_PI);
        Some(BsdfSample::smooth(wi, self.reflectance, pdf, Lobe::reflection(Gloss::Diffuse)))
    }

    #[inline]
    fn has_choice(&self) -> bool {
        false
    }

    fn is_isotropic(&self) -> bool {
        true
    }

    #[inline]
    fn flags(&self) -> LobeFlags {
        if self.reflectance.is_black() { LobeFlags::NONE } else { LobeFlags::DIFFUSE_REFLECTION }
    }

    fn albedo_estimate(&self, _: LocalDir) -> Spectrum {
        self.reflectance
    }
}

/// Cosine-weighted on the side of `wo`; `None` where either lies in the surface.
#[inline]
pub(super) fn cosine_on_side_of(wo: LocalDir, u: [f32; 2]) -> Option<LocalDir> {
    let mut wi = warp::cosine_hemisphere(u);
    wi.0.z = wi.0.z.copysign(wo.0.z);
    wo.same_hemisphere(wi).then_some(wi)
}
