//! A walk's next direction by the BSDF or by what was learned of light: one sample from a mixture, weighted by the
//! balance heuristic [Veach1997, sec. 9.2.4].

use math::LocalDir;
use sampling::Sampler;
use scatter::TransportMode;
use scene::Shading;

use super::{DirectionSample, DirectionSampling};
use crate::guide::LocalGuide;

/// Draws from the mixture; delta lobes come from the BSDF alone. Beside the sample stands the BSDF's own
/// density there, zero for a delta.
pub(crate) fn sample_guided(
    guide: &LocalGuide<'_>,
    shading: &Shading,
    wo: LocalDir,
    sampler: &mut Sampler,
) -> Option<(DirectionSample, f32)> {
    let Shading { bsdf, frame } = shading;
    if sampler.next_1d() < guide.by_bsdf {
        let s = DirectionSampling::Bsdf.sample(bsdf, wo, sampler, TransportMode::Radiance)?;
        let Some(bsdf_pdf) = s.pdf else {
            let sample = DirectionSample { weight: s.weight / guide.by_bsdf, ..s };
            return Some((sample, 0.0));
        };
        // (f cos / p_b) p_b / p: the weight may be right in the mean alone.
        let pdf = guide.mixed(bsdf_pdf, frame.to_world(s.wi));
        let weight = s.weight * (bsdf_pdf.value() / pdf.value());
        let sample = DirectionSample { weight, pdf: Some(pdf), ..s };
        return weight.is_finite().then_some((sample, bsdf_pdf.value()));
    }
    // Past the number that chooses a lobe: both ways use the same dimensions.
    sampler.set_dimension(sampler.dimension() + 1);
    let w = guide.tree.sample(sampler.next_2d());
    let wi = frame.to_local(w);
    let (f, bsdf_pdf) = bsdf.eval_pdf(wo, wi, TransportMode::Radiance);
    let pdf = guide.mixed(bsdf_pdf, w);
    if f.is_black() || !pdf.is_positive() {
        return None;
    }
    let weight = f * (wi.abs_cos_theta() / pdf.value());
    let sample = DirectionSample { wi, weight, pdf: Some(pdf), eta: 1.0 };
    Some((sample, bsdf_pdf.value()))
}
