//! What surfaces that are sums of lobes share: a sample whose density is that of all.

use math::LocalDir;
use sampling::{Pdf, SolidAngle};
use spectrum::Spectrum;

use super::conductor::mirroring_facet;
use super::{BsdfKind, BsdfSample, Lobe, TransportMode};
use crate::microfacet::{Facets, MIN_COS};

/// The sample in a direction that some lobe has drawn: its weight and density are those of all.
#[inline]
pub(super) fn sample_of(
    bsdf: &impl BsdfKind,
    wo: LocalDir,
    wi: LocalDir,
    (lobe, eta): (Lobe, f32),
    mode: TransportMode,
) -> Option<BsdfSample> {
    if wi.abs_cos_theta() <= MIN_COS || wo.same_hemisphere(wi) == lobe.is_transmission() {
        return None;
    }
    let (f, pdf) = bsdf.eval_pdf(wo, wi, mode);
    let weight = f * (wi.abs_cos_theta() / pdf.value());
    (pdf.is_positive() && weight.is_finite())
        .then(|| BsdfSample { eta, ..BsdfSample::smooth(wi, weight, pdf, lobe) })
}

/// A lobe of facets that mirror: `D G2 / (4 cos cos)`, to be multiplied by a reflectance, the density of its visible
/// normals, and the facet. `None` for directions on two sides or in the surface.
#[inline]
pub(super) fn mirror_lobe(
    facets: &Facets,
    wo: LocalDir,
    wi: LocalDir,
) -> Option<(f32, Pdf<SolidAngle>, LocalDir)> {
    let m = mirroring_facet(wo, wi)?;
    let (so, si) = (facets.stretch(wo), facets.stretch(wi));
    let (co, ci) = (wo.abs_cos_theta(), wi.abs_cos_theta());
    let half_d = 0.5 * facets.d(m);
    Some((half_d * facets.visibility([co, so], [ci, si]), Pdf::new(half_d / (co + so)), m))
}

/// `(1 − c)⁵`.
#[inline]
pub(super) fn schlick_weight(c: f32) -> f32 {
    let m = (1.0 - c).clamp(0.0, 1.0);
    (m * m) * (m * m) * m
}

/// `a + (b − a) t`.
#[inline]
pub(super) fn lerp(a: Spectrum, b: Spectrum, t: f32) -> Spectrum {
    a + (b - a) * t
}
