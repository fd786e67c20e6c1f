//! The border of what light wanders in below a surface: gloss outside, Lambert's law through it and inside.
//!
//! Light that passes forgets its direction, as the diffusion models have it [Jensen2001]: outside, a dielectric
//! reflects it (smooth or by GGX facets); `T = 1 − F` of the rest goes through, evenly into the hemisphere. From inside
//! `1 − r` leaves with density in proportion to `T cos`, and `r = 1 − (1 − F̄) / η²` is reflected evenly. So a smooth
//! border can be lit through by small lamps, as no refracting one can.
//!
//! Over a diffusion profile, which knows where light leaves again and nothing of directions, entering is a delta event, as
//! nothing inside can be connected to; what emerges elsewhere does so through the same border without reflection from inside
//! ([`SoftBorder::emerging`]).
//!
//! Radiance is divided by η² on its way in, importance is not [Veach1997, ch. 5].
//! Departs: of rough borders, F of `T` is taken at a more grazing angle, so that facets that face away from the eye give
//! back no light twice.

use std::f32::consts::FRAC_1_PI;

use math::LocalDir;
use sampling::{Pdf, SolidAngle};
use spectrum::Spectrum;

use super::diffuse::cosine_on_side_of;
use super::{BsdfKind, BsdfSample, Dielectric, Gloss, Lobe, LobeFlags, SampleLobes, TransportMode};
use crate::fresnel;
use crate::microfacet::Facets;

/// A dielectric border that scatters what passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoftBorder {
    gloss: Dielectric,
    /// Reflectance from inside.
    inside: f32,
    /// On the cosine with which T is looked up.
    grazing: f32,
    /// Is a profile below, and no medium? Seen from inside it is black then.
    is_over_profile: bool,
}

impl SoftBorder {
    /// `eta`: index inside (z < 0) over outside; the facets, or their widths along both tangents.
    #[must_use]
    pub fn new(eta: f32, facets: impl Into<Facets>) -> Self {
        let facets = facets.into();
        let [u, v] = facets.alpha();
        let gloss = Dielectric::new(eta, facets);
        let width = if gloss.is_smooth() { 0.0 } else { u.max(v).min(1.0) };
        let is_over_profile = false;
        Self { gloss, inside: Self::inside(eta), grazing: 1.0 - 0.35 * width, is_over_profile }
    }

    /// The same over a diffusion profile.
    #[must_use]
    pub fn over_profile(self) -> Self {
        Self { is_over_profile: true, ..self }
    }

    /// As light sees it that emerges, seen from inside; and the factor on that light, whose share that passes from inside is in
    /// its profile already.
    #[must_use]
    pub fn emerging(self) -> (Self, f32) {
        (Self { inside: 0.0, is_over_profile: false, ..self }, 1.0 / (1.0 - self.inside))
    }

    /// Does light enter here that leaves elsewhere?
    #[must_use]
    pub fn is_over_profile(&self) -> bool {
        self.is_over_profile
    }

    /// Reflectance from inside: all but what light from an even sky outside would get in, over η².
    #[must_use]
    pub fn inside(eta: f32) -> f32 {
        (1.0 - (1.0 - fresnel::dielectric_average(eta)) / (eta * eta)).clamp(0.0, 1.0)
    }

    /// Chance of passing from outside.
    fn transmittance(&self, outside: LocalDir) -> f32 {
        1.0 - fresnel::dielectric(outside.abs_cos_theta() * self.grazing, self.gloss.eta())
    }

    /// Into a profile, with the chance of passing.
    fn entering(&self, passes: f32, mode: TransportMode) -> Option<BsdfSample> {
        let eta = self.gloss.eta();
        let weight = Spectrum::splat(mode.transmission_scale(eta));
        let lobe = Lobe::transmission(Gloss::Specular);
        let sample = BsdfSample::delta(-LocalDir::NORMAL, weight, passes, lobe);
        (passes > 0.0).then_some(BsdfSample { eta, ..sample })
    }

    /// Index of the far side over the near side.
    fn eta_from(&self, wo: LocalDir) -> f32 {
        if wo.0.z > 0.0 { self.gloss.eta() } else { 1.0 / self.gloss.eta() }
    }
}

impl BsdfKind for SoftBorder {
    fn eval(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Spectrum {
        let f = if self.is_over_profile && (wo.0.z <= 0.0 || wi.0.z <= 0.0) {
            0.0
        } else if wo.same_hemisphere(wi) {
            match wo.0.z > 0.0 {
                true => self.gloss.eval_scalar(wo, wi, mode),
                false => self.inside * FRAC_1_PI,
            }
        } else if wo.same_hemisphere(-wi) {
            let eta = self.eta_from(wo);
            let through = match wo.0.z > 0.0 {
                true => self.transmittance(wo),
                false => self.transmittance(wi) * (eta * eta),
            };
            through * FRAC_1_PI * mode.transmission_scale(eta)
        } else {
            0.0
        };
        Spectrum::splat(f)
    }

    fn pdf(&self, wo: LocalDir, wi: LocalDir, _: TransportMode) -> Pdf<SolidAngle> {
        let cosine = wi.abs_cos_theta() * FRAC_1_PI;
        let passes = if wo.0.z > 0.0 { self.transmittance(wo) } else { 1.0 - self.inside };
        if self.is_over_profile && (wo.0.z <= 0.0 || wi.0.z <= 0.0) {
            Pdf::ZERO
        } else if wo.same_hemisphere(-wi) {
            Pdf::new(passes * cosine)
        } else if !wo.same_hemisphere(wi) {
            Pdf::ZERO
        } else if wo.0.z > 0.0 {
            self.gloss.pdf_lobes(wo, wi, SampleLobes::Reflection) * (1.0 - passes)
        } else {
            Pdf::new(self.inside * cosine)
        }
    }

    fn sample(&self, wo: LocalDir, u_lobe: f32, u: [f32; 2], mode: TransportMode) -> Option<BsdfSample> {
        let is_outside = wo.0.z > 0.0;
        let passes = if is_outside { self.transmittance(wo) } else { 1.0 - self.inside };
        let p_reflect = 1.0 - passes;
        if is_outside && u_lobe < p_reflect {
            let s = self.gloss.sample_lobes(wo, 0.0, u, mode, SampleLobes::Reflection)?;
            let weight = s.weight * (1.0 / p_reflect);
            return Some(match s.pdf() {
                None => BsdfSample::delta(s.wi, weight, p_reflect, s.lobe),
                Some(pdf) => BsdfSample::smooth(s.wi, weight, pdf * p_reflect, s.lobe),
            });
        }
        if self.is_over_profile {
            return self.entering(passes, mode).filter(|_| is_outside);
        }
        let near = cosine_on_side_of(wo, u)?;
        let cosine = near.abs_cos_theta() * FRAC_1_PI;
        if u_lobe < p_reflect {
            let lobe = Lobe::reflection(Gloss::Diffuse);
            return Some(BsdfSample::smooth(near, Spectrum::ONE, Pdf::new(p_reflect * cosine), lobe));
        }
        if passes <= 0.0 {
            return None;
        }
        let (wi, eta) = (-near, self.eta_from(wo));
        let through = if is_outside { passes } else { self.transmittance(wi) * (eta * eta) };
        let weight = Spectrum::splat(through / passes * mode.transmission_scale(eta));
        let lobe = Lobe::transmission(Gloss::Diffuse);
        Some(BsdfSample { eta, ..BsdfSample::smooth(wi, weight, Pdf::new(passes * cosine), lobe) })
    }

    fn flags(&self) -> LobeFlags {
        let gloss = match (self.gloss.is_smooth(), self.gloss.eta() == 1.0) {
            (_, true) => LobeFlags::NONE,
            (true, false) => LobeFlags::SPECULAR_REFLECTION,
            (false, false) => LobeFlags::GLOSSY_REFLECTION,
        };
        if self.is_over_profile {
            return gloss | LobeFlags::SPECULAR_TRANSMISSION;
        }
        gloss | LobeFlags::DIFFUSE_TRANSMISSION | LobeFlags::DIFFUSE_REFLECTION
    }

    fn specular_probability(&self, wo: LocalDir) -> f32 {
        if wo.0.z <= 0.0 {
            return 0.0;
        }
        let passes = self.transmittance(wo);
        let of_gloss = if self.gloss.is_smooth() { 1.0 - passes } else { 0.0 };
        if self.is_over_profile { of_gloss + passes } else { of_gloss }
    }

    fn albedo_estimate(&self, _: LocalDir) -> Spectrum {
        Spectrum::ONE
    }

    fn regularized(&self) -> Self {
        Self { gloss: self.gloss.regularized(), ..*self }
    }
}
