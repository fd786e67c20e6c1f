//! The closed form of a clear coat over Lambert's law: no walk, no noise, an exact density.
//!
//! | lobe     | value                                     | sampled by                 |
//! |----------|-------------------------------------------|----------------------------|
//! | boundary | delta, or `F D G2 / (4 cos cos)`, times a tint | mirror, or visible normals |
//! | base     | `t(wo) t(wi)` times what [`ClosedForm::new`] is given | cosine         |
//!
//! The lobe is chosen by what each is worth from `wo`. All directions here are on the upper side.

use std::f32::consts::{FRAC_1_PI, PI};

use math::LocalDir;
use sampling::{Pdf, SolidAngle};
use spectrum::Spectrum;

use super::super::conductor::{mirror, mirroring_facet};
use super::super::diffuse::cosine_on_side_of;
use super::super::{BsdfSample, Dielectric, Gloss, Lobe, LobeFlags};
use super::{CoatProfile, smooth_at, smooth_both};
use crate::fresnel;
use crate::microfacet::MIN_COS;

/// Boundary and base.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct ClosedForm {
    top: Dielectric,
    scale: Spectrum,
    thickness: f32,
    profile: CoatProfile,
}

/// What a direction sees of both lobes.
#[derive(Clone, Copy)]
struct Seen {
    /// Of the boundary.
    reflectance: f32,
    /// To the base.
    transmittance: f32,
    /// Chance of sampling the boundary.
    p_top: f32,
}

impl ClosedForm {
    /// `scale` times the transmittances of both directions is `f` of the base; the profile is that of the boundary and
    /// thickness.
    pub(in super::super) fn new(
        top: Dielectric,
        scale: Spectrum,
        thickness: f32,
        profile: CoatProfile,
    ) -> Self {
        Self { top, scale, thickness, profile }
    }

    pub(in super::super) fn top(&self) -> &Dielectric {
        &self.top
    }

    pub(in super::super) fn thickness(&self) -> f32 {
        self.thickness
    }

    /// The same under a widened boundary, which lets as much through.
    pub(in super::super) fn widened(&self) -> Self {
        Self { top: self.top.widened(), ..*self }
    }

    /// Reflectance of the boundary and of all below it at `wo`: exact where the boundary is smooth.
    pub(in super::super) fn albedos(&self, wo: LocalDir, tint: Spectrum) -> [Spectrum; 2] {
        let top = fresnel::dielectric(wo.0.z, self.top.eta());
        [tint * top, self.scale * (PI * self.profile.average() * self.transmittance(wo))]
    }

    pub(in super::super) fn flags(&self) -> LobeFlags {
        let smooth = self.top.is_smooth();
        let top = if smooth { LobeFlags::SPECULAR_REFLECTION } else { LobeFlags::GLOSSY_REFLECTION };
        let base = if self.scale.is_black() { LobeFlags::NONE } else { LobeFlags::DIFFUSE_REFLECTION };
        top | base
    }

    /// What gets from `w` to the base.
    #[inline]
    fn transmittance(&self, w: LocalDir) -> f32 {
        if self.profile.is_rough() {
            self.profile.rough_at(w.0.z)
        } else {
            smooth_at(self.top.eta(), self.thickness, w.0.z)
        }
    }

    /// Chance of sampling the boundary rather than the base; `None` where neither reflects.
    #[inline]
    pub(in super::super) fn top_probability(&self, wo: LocalDir, tint: Spectrum) -> Option<f32> {
        self.seen(wo, tint).map(|s| s.p_top)
    }

    /// What does not depend on the other direction; `None` where neither lobe reflects.
    #[inline]
    fn seen(&self, wo: LocalDir, tint: Spectrum) -> Option<Seen> {
        let (reflectance, transmittance) = if self.profile.is_rough() {
            (fresnel::dielectric(wo.0.z, self.top.eta()), self.profile.rough_at(wo.0.z))
        } else {
            smooth_both(self.top.eta(), self.thickness, wo.0.z)
        };
        let top = (tint * reflectance).max_component();
        let base = (self.scale * (PI * self.profile.average() * transmittance)).max_component();
        let sum = top + base;
        (sum > 0.0).then(|| Seen { reflectance, transmittance, p_top: top / sum })
    }

    /// `f` and the density.
    #[inline]
    pub(in super::super) fn eval_pdf(
        &self,
        wo: LocalDir,
        wi: LocalDir,
        tint: Spectrum,
    ) -> (Spectrum, Pdf<SolidAngle>) {
        match self.seen(wo, tint) {
            Some(seen) => self.eval_pdf_seen(&seen, wo, wi, tint),
            None => (Spectrum::ZERO, Pdf::ZERO),
        }
    }

    /// The same, given what `wo` sees.
    #[inline]
    fn eval_pdf_seen(
        &self,
        &Seen { transmittance, p_top, .. }: &Seen,
        wo: LocalDir,
        wi: LocalDir,
        tint: Spectrum,
    ) -> (Spectrum, Pdf<SolidAngle>) {
        let mut f = self.scale * (transmittance * self.transmittance(wi));
        let mut pdf = (1.0 - p_top) * wi.0.z * FRAC_1_PI;
        if !self.top.is_smooth()
            && let Some(m) = mirroring_facet(wo, wi)
        {
            let facets = self.top.facets();
            let (so, si) = (facets.stretch(wo), facets.stretch(wi));
            let half_d = 0.5 * facets.d(m);
            let reflectance = fresnel::dielectric(wo.dot(m), self.top.eta());
            let visibility = facets.visibility([wo.0.z, so], [wi.0.z, si]);
            f += tint * (reflectance * half_d * visibility);
            pdf += p_top * half_d / (wo.0.z + so);
        }
        (f, Pdf::new(pdf))
    }

    /// A sample for `wo`.
    pub(in super::super) fn sample(
        &self,
        wo: LocalDir,
        u_lobe: f32,
        u: [f32; 2],
        tint: Spectrum,
    ) -> Option<BsdfSample> {
        let seen = self.seen(wo, tint)?;
        let p_top = seen.p_top;
        if self.top.is_smooth() {
            if u_lobe < p_top {
                let weight = tint * (seen.reflectance / p_top);
                let lobe = Lobe::reflection(Gloss::Specular);
                return Some(BsdfSample::delta(wo.reflect(), weight, p_top, lobe));
            }
            let wi = cosine_on_side_of(wo, u)?;
            let p = 1.0 - p_top;
            let t = seen.transmittance * self.transmittance(wi);
            let weight = self.scale * (PI * t / p);
            let lobe = Lobe::reflection(Gloss::Diffuse);
            return Some(BsdfSample::smooth(wi, weight, Pdf::new(p * wi.0.z * FRAC_1_PI), lobe));
        }

        // Two lobes overlap: weigh by the density of both.
        let (wi, gloss) = if u_lobe < p_top {
            (mirror(wo, self.top.facets().sample_visible(wo, u)), Gloss::Glossy)
        } else {
            (cosine_on_side_of(wo, u)?, Gloss::Diffuse)
        };
        if wi.0.z <= MIN_COS {
            return None;
        }
        let (f, pdf) = self.eval_pdf_seen(&seen, wo, wi, tint);
        pdf.is_positive()
            .then(|| BsdfSample::smooth(wi, f * (wi.0.z / pdf.value()), pdf, Lobe::reflection(gloss)))
    }
}
