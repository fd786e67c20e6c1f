//! Glass: smooth, or an interface of facets that reflect and refract.
//!
//! | step                     | source                                              |
//! |--------------------------|-----------------------------------------------------|
//! | `f` of both sides        | [Walter2007], with `G2` height-correlated for both  |
//! | half vector, Jacobian    | [Walter2007]: `m ∝ η' wi + wo`, `dω_m / dω_i = \|wi·m\| / (wi·m + wo·m/η')²` |
//! | radiance and importance  | [Veach1997, ch. 5]: radiance is divided by η'²      |
//!
//! `η'` is the index of the far side over that of the near side, as `wo` sees it. Reflection is chosen with the
//! probability `F` of the sampled facet, so that the weight is `G2/G1` on both sides.
//! Left out: light that bounces between facets, and dispersion (the material chooses `eta`).

use math::LocalDir;
use sampling::{Pdf, SolidAngle};
use spectrum::Spectrum;

use super::conductor::{mirror, mirroring_facet};
use super::{BsdfKind, BsdfSample, Gloss, Lobe, LobeFlags, SampleLobes, TransportMode};
use crate::fresnel;
use crate::microfacet::{Facets, MIN_COS};

/// The boundary between two transparent media.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    eta: f32,
    facets: Facets,
}

/// A pair of directions joined by a facet.
struct Facet {
    m: LocalDir,
    /// Index of the far side over the near side for a transmission; one for a reflection.
    eta: f32,
    is_reflection: bool,
}

impl Dielectric {
    /// `eta`: index inside (z < 0) over outside; the facets, or their widths along both tangents (smooth if both are below
    /// [`Facets::SMOOTH_BELOW`]). An interface with `eta = 1` lets everything pass.
    #[must_use]
    pub fn new(eta: f32, facets: impl Into<Facets>) -> Self {
        let facets = if eta == 1.0 { Facets::SMOOTH } else { facets.into() };
        Self { eta, facets }
    }

    pub(super) fn eta(&self) -> f32 {
        self.eta
    }

    pub(super) fn facets(&self) -> Facets {
        self.facets
    }

    pub(super) fn is_smooth(&self) -> bool {
        self.facets.is_smooth()
    }

    /// With its facets widened, unless it is not there at all.
    pub(super) fn widened(&self) -> Self {
        Self { facets: if self.eta == 1.0 { self.facets } else { self.facets.regularized() }, ..*self }
    }

    /// The facet that takes `wi` to `wo`; `None` if there is none, or none with its face to both.
    #[inline]
    fn facet(&self, wo: LocalDir, wi: LocalDir) -> Option<Facet> {
        if let Some(m) = mirroring_facet(wo, wi) {
            return Some(Facet { m, eta: 1.0, is_reflection: true });
        }
        let off = wo.abs_cos_theta() > MIN_COS && wi.abs_cos_theta() > MIN_COS;
        if !off || !wo.same_hemisphere(-wi) {
            return None;
        }
        let eta = if wo.0.z > 0.0 { self.eta } else { 1.0 / self.eta };
        let m = LocalDir((eta * wi.0 + wo.0).try_normalize()?);
        let m = if m.0.z < 0.0 { -m } else { m };
        let faces_both = wi.dot(m) * wi.0.z > 0.0 && wo.dot(m) * wo.0.z > 0.0;
        faces_both.then_some(Facet { m, eta, is_reflection: false })
    }

    /// Chance of reflection (with the lobes allowed) and `f`, at this facet.
    fn eval_pdf_lobes(
        &self,
        wo: LocalDir,
        wi: LocalDir,
        mode: TransportMode,
        lobes: SampleLobes,
    ) -> (f32, Pdf<SolidAngle>) {
        if self.is_smooth() {
            return (0.0, Pdf::ZERO);
        }
        let Some(Facet { m, eta, is_reflection }) = self.facet(wo, wi) else { return (0.0, Pdf::ZERO) };
        let (so, si) = (self.facets.stretch(wo), self.facets.stretch(wi));
        let (co, ci) = (wo.abs_cos_theta(), wi.abs_cos_theta());
        let reflectance = if is_reflection {
            fresnel::dielectric(wo.dot(m), self.eta)
        } else {
            fresnel::between(wo.dot(m).abs(), wi.dot(m).abs(), eta)
        };
        let p_reflect = lobes.reflection_probability(reflectance);
        let half_d = 0.5 * self.facets.d(m);
        let visibility = self.facets.visibility([co, so], [ci, si]);

        if is_reflection {
            return (reflectance * half_d * visibility, Pdf::new(p_reflect * half_d / (co + so)));
        }
        // 4 |wo·m| dω_m / dω_i, which is one for reflection.
        let sum = wi.dot(m) + wo.dot(m) / eta;
        let jacobian = 4.0 * (wi.dot(m) * wo.dot(m)).abs() / (sum * sum).max(f32::MIN_POSITIVE);
        let transmittance = (1.0 - reflectance) * mode.transmission_scale(eta);
        let f = transmittance * half_d * jacobian * visibility;
        (f, Pdf::new((1.0 - p_reflect) * half_d * jacobian / (co + so)))
    }

    /// [`BsdfKind::eval`] as one number: glass has no colour.
    #[inline]
    pub(super) fn eval_scalar(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> f32 {
        self.eval_pdf_lobes(wo, wi, mode, SampleLobes::All).0
    }

    /// Density of [`Dielectric::sample_lobes`].
    #[must_use]
    pub fn pdf_lobes(&self, wo: LocalDir, wi: LocalDir, lobes: SampleLobes) -> Pdf<SolidAngle> {
        self.eval_pdf_lobes(wo, wi, TransportMode::Radiance, lobes).1
    }

    /// [`BsdfKind::sample`] of some lobes alone; the weight then holds the reflectance or transmittance.
    #[must_use]
    #[inline]
    pub fn sample_lobes(
        &self,
        wo: LocalDir,
        u_lobe: f32,
        u: [f32; 2],
        mode: TransportMode,
        lobes: SampleLobes,
    ) -> Option<BsdfSample> {
        let co = wo.abs_cos_theta();
        if co <= MIN_COS {
            return None;
        }
        let smooth = self.is_smooth();
        let m = if smooth { LocalDir::NORMAL } else { self.facets.sample_visible(wo, u) };
        let cos = wo.dot(m);
        let there = fresnel::interface(cos, self.eta);
        let p_reflect = lobes.reflection_probability(there.reflectance);
        let gloss = if smooth { Gloss::Specular } else { Gloss::Glossy };

        // Mirror at the facet.
        if u_lobe < p_reflect {
            let weight = there.reflectance / p_reflect;
            if smooth {
                let lobe = Lobe::reflection(gloss);
                return Some(BsdfSample::delta(wo.reflect(), Spectrum::splat(weight), p_reflect, lobe));
            }
            let wi = mirror(wo, m);
            if !wo.same_hemisphere(wi) || wi.abs_cos_theta() <= MIN_COS {
                return None;
            }
            let weight = Spectrum::splat(weight * self.facets.shadowing(wo, wi));
            let pdf = Pdf::new(p_reflect * self.facets.d(m) / (2.0 * (co + self.facets.stretch(wo))));
            return Some(BsdfSample::smooth(wi, weight, pdf, Lobe::reflection(gloss)));
        }

        // Refract: wi = −wo/η' + (|wo·m|/η' − cos θt) m, with m turned to the side of wo.
        let p = 1.0 - p_reflect;
        if there.reflectance >= 1.0 || p <= 0.0 {
            return None;
        }
        let eta = there.eta;
        let wi = LocalDir(m.0 * (cos / eta - there.cos_transmitted.copysign(cos)) - wo.0 / eta);
        let weight = (1.0 - there.reflectance) / p * mode.transmission_scale(eta);
        if smooth {
            let wi = LocalDir::normalize(wi.0);
            let sample = BsdfSample::delta(wi, Spectrum::splat(weight), p, Lobe::transmission(gloss));
            return Some(BsdfSample { eta, ..sample });
        }
        if !wo.same_hemisphere(-wi) || wi.abs_cos_theta() <= MIN_COS {
            return None;
        }
        let wi = LocalDir::normalize(wi.0);
        let weight = Spectrum::splat(weight * self.facets.shadowing(wo, wi));
        let sum = wi.dot(m) + cos / eta;
        let jacobian = wi.dot(m).abs() / (sum * sum).max(f32::MIN_POSITIVE);
        let pdf = self.facets.visible_pdf(wo, m) * (jacobian * p);
        Some(BsdfSample { eta, ..BsdfSample::smooth(wi, weight, pdf, Lobe::transmission(gloss)) })
    }
}

impl BsdfKind for Dielectric {
    fn eval(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Spectrum {
        Spectrum::splat(self.eval_scalar(wo, wi, mode))
    }

    fn pdf(&self, wo: LocalDir, wi: LocalDir, _: TransportMode) -> Pdf<SolidAngle> {
        self.pdf_lobes(wo, wi, SampleLobes::All)
    }

    fn eval_pdf(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> (Spectrum, Pdf<SolidAngle>) {
        let (f, pdf) = self.eval_pdf_lobes(wo, wi, mode, SampleLobes::All);
        (Spectrum::splat(f), pdf)
    }

    fn sample(&self, wo: LocalDir, u_lobe: f32, u: [f32; 2], mode: TransportMode) -> Option<BsdfSample> {
        self.sample_lobes(wo, u_lobe, u, mode, SampleLobes::All)
    }

    fn is_isotropic(&self) -> bool {
        self.facets.is_isotropic()
    }

    fn flags(&self) -> LobeFlags {
        match (self.is_smooth(), self.eta == 1.0) {
            (true, true) => LobeFlags::SPECULAR_TRANSMISSION,
            (true, false) => LobeFlags::SPECULAR_REFLECTION | LobeFlags::SPECULAR_TRANSMISSION,
            (false, _) => LobeFlags::GLOSSY_REFLECTION | LobeFlags::GLOSSY_TRANSMISSION,
        }
    }

    fn albedo_estimate(&self, _: LocalDir) -> Spectrum {
        Spectrum::ONE
    }

    fn regularized(&self) -> Self {
        self.widened()
    }
}
