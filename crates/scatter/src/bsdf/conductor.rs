//! Metal: a mirror, or a Cook–Torrance lobe of facets, with the exact Fresnel reflectance of a complex index.
//!
//! | step            | source                                    |
//! |-----------------|-------------------------------------------|
//! | `f`             | [Walter2007], `F D G2 / (4 cos cos)`      |
//! | `D`, `G2`, warp | `microfacet::Facets`                      |
//! | `F`             | `fresnel::conductor`                      |
//!
//! Left out: light that bounces between facets. The furnace law tests `≤ 1`; what is missing is in the GGX energy
//! table (`microfacet::ggx`).

use math::LocalDir;
use sampling::{Pdf, SolidAngle};
use spectrum::Spectrum;

use super::{BsdfKind, BsdfSample, Gloss, Lobe, LobeFlags, TransportMode};
use crate::fresnel;
use crate::microfacet::{Facets, MIN_COS};

/// A metal. Both sides reflect alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conductor {
    eta: Spectrum,
    k: Spectrum,
    tint: Spectrum,
    facets: Facets,
}

impl Conductor {
    /// Complex index `eta + i k` relative to the medium outside, and the facets, or their widths along both tangents
    /// (a mirror if both are below [`Facets::SMOOTH_BELOW`]).
    #[must_use]
    pub fn new(eta: Spectrum, k: Spectrum, facets: impl Into<Facets>) -> Self {
        Self { eta, k, tint: Spectrum::ONE, facets: facets.into() }
    }

    /// A metal with a given reflectance at normal incidence; see [`fresnel::conductor_from_reflectance`].
    #[must_use]
    pub fn from_reflectance(reflectance: Spectrum, facets: impl Into<Facets>) -> Self {
        let (eta, k) = fresnel::conductor_from_reflectance(reflectance);
        Self::new(eta, k, facets)
    }

    /// The same with a factor on its reflectance.
    #[must_use]
    pub fn tinted(self, tint: Spectrum) -> Self {
        Self { tint, ..self }
    }

    pub(super) fn facets(&self) -> Facets {
        self.facets
    }

    /// The index as it is under a layer of index `eta`.
    pub(super) fn under(self, eta: f32) -> Self {
        Self { eta: self.eta / eta, k: self.k / eta, ..self }
    }

    /// Reflectance where the facet makes an angle of this cosine with `wo`.
    #[inline]
    pub(super) fn fresnel(&self, cos: f32) -> Spectrum {
        fresnel::conductor(cos.abs(), self.eta, self.k) * self.tint
    }
}

/// The facet that mirrors `wi` to `wo`, on the side z > 0; `None` unless both lie on one side, off the surface.
#[inline]
pub(super) fn mirroring_facet(wo: LocalDir, wi: LocalDir) -> Option<LocalDir> {
    let off = wo.abs_cos_theta() > MIN_COS && wi.abs_cos_theta() > MIN_COS;
    if !off || !wo.same_hemisphere(wi) {
        return None;
    }
    let m = LocalDir::normalize(wo.0 + wi.0);
    Some(if m.0.z < 0.0 { -m } else { m })
}

/// `wo` mirrored at the facet `m`.
#[inline]
pub(super) fn mirror(wo: LocalDir, m: LocalDir) -> LocalDir {
    LocalDir(2.0 * wo.dot(m) * m.0 - wo.0)
}

impl BsdfKind for Conductor {
    fn eval(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Spectrum {
        self.eval_pdf(wo, wi, mode).0
    }

    fn pdf(&self, wo: LocalDir, wi: LocalDir, _: TransportMode) -> Pdf<SolidAngle> {
        match mirroring_facet(wo, wi) {
            // dω_m = dω_i / (4 wo·m): wo·m cancels against that of the visible normals.
            Some(m) if !self.facets.is_smooth() => {
                Pdf::new(self.facets.d(m) / (2.0 * (wo.abs_cos_theta() + self.facets.stretch(wo))))
            }
            Some(_) | None => Pdf::ZERO,
        }
    }

    #[inline]
    fn eval_pdf(&self, wo: LocalDir, wi: LocalDir, _: TransportMode) -> (Spectrum, Pdf<SolidAngle>) {
        let Some(m) = mirroring_facet(wo, wi) else { return (Spectrum::ZERO, Pdf::ZERO) };
        if self.facets.is_smooth() {
            return (Spectrum::ZERO, Pdf::ZERO);
        }
        // D G2 / (4 cos cos), where G2 / (cos cos) = 2 / (s(wo) ci + s(wi) co); likewise G1 / co = 2 / (co + s(wo)).
        let (so, si) = (self.facets.stretch(wo), self.facets.stretch(wi));
        let (co, ci) = (wo.abs_cos_theta(), wi.abs_cos_theta());
        let half_d = 0.5 * self.facets.d(m);
        let visibility = self.facets.visibility([co, so], [ci, si]);
        (self.fresnel(wo.dot(m)) * (half_d * visibility), Pdf::new(half_d / (co + so)))
    }

    #[inline]
    fn sample(&self, wo: LocalDir, _: f32, u: [f32; 2], _: TransportMode) -> Option<BsdfSample> {
        let co = wo.abs_cos_theta();
        if co <= MIN_COS {
            return None;
        }
        if self.facets.is_smooth() {
            let lobe = Lobe::reflection(Gloss::Specular);
            return Some(BsdfSample::delta(wo.reflect(), self.fresnel(co), 1.0, lobe));
        }

        // The weight is F G2 / G1: the distribution cancels.
        let m = self.facets.sample_visible(wo, u);
        let wi = mirror(wo, m);
        if !wo.same_hemisphere(wi) || wi.abs_cos_theta() <= MIN_COS {
            return None;
        }
        let weight = self.fresnel(wo.dot(m)) * self.facets.shadowing(wo, wi);
        let pdf = Pdf::new(self.facets.d(m) / (2.0 * (co + self.facets.stretch(wo))));
        Some(BsdfSample::smooth(wi, weight, pdf, Lobe::reflection(Gloss::Glossy)))
    }

    #[inline]
    fn has_choice(&self) -> bool {
        false
    }

    fn is_isotropic(&self) -> bool {
        self.facets.is_isotropic()
    }

    fn flags(&self) -> LobeFlags {
        if self.facets.is_smooth() { LobeFlags::SPECULAR_REFLECTION } else { LobeFlags::GLOSSY_REFLECTION }
    }

    fn albedo_estimate(&self, wo: LocalDir) -> Spectrum {
        self.fresnel(wo.abs_cos_theta())
    }

    fn regularized(&self) -> Self {
        Self { facets: self.facets.regularized(), ..*self }
    }
}
