//! How a path chooses its next direction: by the BSDF, or by the cruder densities that the theory begins with.

use math::{LocalDir, Vec3};
use sampling::{Pdf, Sampler, SolidAngle, warp};
use scatter::{Bsdf, LobeFlags, TransportMode};
use spectrum::Spectrum;

/// A density to draw directions from. Delta lobes are always sampled by the BSDF.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum DirectionSampling {
    /// In proportion to (about) the BSDF times cosine.
    #[default]
    Bsdf,
    /// In proportion to the cosine.
    Cosine,
    /// All directions alike.
    Uniform,
}

/// A direction, with what the throughput is multiplied by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DirectionSample {
    pub(crate) wi: LocalDir,
    /// `f |cos θ| / p`.
    pub(crate) weight: Spectrum,
    /// `None` for a delta: nothing competes with it.
    pub(crate) pdf: Option<Pdf<SolidAngle>>,
    /// See [`scatter::BsdfSample::eta`].
    pub(crate) eta: f32,
}

impl DirectionSampling {
    /// The words of parameters.
    pub(crate) const NAMES: &'static [&'static str] = &["bsdf", "cosine", "uniform"];

    /// From a word of [`Self::NAMES`].
    pub(crate) fn from_name(name: &str) -> Self {
        match name {
            "cosine" => Self::Cosine,
            "uniform" => Self::Uniform,
            _ => Self::Bsdf,
        }
    }

    /// Draws a direction.
    #[inline]
    pub(crate) fn sample(
        self,
        bsdf: &Bsdf,
        wo: LocalDir,
        sampler: &mut Sampler,
        mode: TransportMode,
    ) -> Option<DirectionSample> {
        if self == Self::Bsdf {
            let u_lobe = sampler.next_1d_if(bsdf.has_choice());
            return by_bsdf(bsdf, wo, u_lobe, sampler.next_2d(), mode);
        }
        let (u_lobe, u) = (sampler.next_1d(), sampler.next_2d());

        // A delta lobe takes its share; the rest goes to the cruder density, with numbers of its own.
        let flags = bsdf.flags();
        let (mut u, mut u_side) = (u, u_lobe);
        if flags.intersects(LobeFlags::SPECULAR) {
            let sample = by_bsdf(bsdf, wo, u_lobe, u, mode)?;
            if sample.pdf.is_none() {
                return Some(sample);
            }
            (u_side, u) = (sampler.next_1d(), sampler.next_2d());
        }
        let both_sides = flags.intersects(LobeFlags::TRANSMISSION);
        let wi = self.warp(wo, u, u_side, both_sides);
        let (f, pdf) = self.eval_pdf(bsdf, wo, wi, mode);
        if !pdf.is_positive() || f.is_black() {
            return None;
        }
        let weight = f * (wi.abs_cos_theta() / pdf.value());
        Some(DirectionSample { wi, weight, pdf: Some(pdf), eta: 1.0 })
    }

    /// `f` and the density with which [`Self::sample`] makes `wi`, deltas left out.
    pub(crate) fn eval_pdf(
        self,
        bsdf: &Bsdf,
        wo: LocalDir,
        wi: LocalDir,
        mode: TransportMode,
    ) -> (Spectrum, Pdf<SolidAngle>) {
        if self == Self::Bsdf {
            return bsdf.eval_pdf(wo, wi, mode);
        }
        let flags = bsdf.flags();
        let smooth_share = match flags.intersects(LobeFlags::SPECULAR) {
            true => 1.0 - bsdf.specular_probability(wo),
            false => 1.0,
        };
        let pdf = self.crude_pdf(wo, wi, flags.intersects(LobeFlags::TRANSMISSION)) * smooth_share;
        (bsdf.eval(wo, wi, mode), pdf)
    }

    /// On the side of `wo`, or (by `u_side`) on either.
    fn warp(self, wo: LocalDir, u: [f32; 2], u_side: f32, both_sides: bool) -> LocalDir {
        let up = match self {
            Self::Uniform => warp::uniform_hemisphere(u),
            Self::Cosine | Self::Bsdf => warp::cosine_hemisphere(u),
        };
        let below = (wo.cos_theta() < 0.0) != (both_sides && u_side < 0.5);
        if below { LocalDir(Vec3::new(up.0.x, up.0.y, -up.0.z)) } else { up }
    }

    fn crude_pdf(self, wo: LocalDir, wi: LocalDir, both_sides: bool) -> Pdf<SolidAngle> {
        if !both_sides && !wo.same_hemisphere(wi) {
            return Pdf::ZERO;
        }
        let up = LocalDir(Vec3::new(wi.0.x, wi.0.y, wi.abs_cos_theta()));
        let pdf = match self {
            Self::Uniform => warp::uniform_hemisphere_pdf(up),
            Self::Cosine | Self::Bsdf => warp::cosine_hemisphere_pdf(up),
        };
        if both_sides { pdf * 0.5 } else { pdf }
    }
}

#[inline]
fn by_bsdf(
    bsdf: &Bsdf,
    wo: LocalDir,
    u_lobe: f32,
    u: [f32; 2],
    mode: TransportMode,
) -> Option<DirectionSample> {
    let s = bsdf.sample(wo, u_lobe, u, mode)?;
    let pdf = match s.pdf_is_proportional {
        true => s.pdf().map(|_| bsdf.pdf(wo, s.wi, mode)),
        false => s.pdf(),
    };
    Some(DirectionSample { wi: s.wi, weight: s.weight, pdf, eta: s.eta })
}
