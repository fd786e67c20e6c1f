//! Disney's principled surface as a sheet: what is transmitted leaves on the other side at once.
//!
//! | lobe                 | value                                                            | sampled by      |
//! |----------------------|------------------------------------------------------------------|-----------------|
//! | specular             | `F D G / (4 cos cos)`, GGX, times `spec_trans`                   | visible normals |
//! | specular, through    | the same mirrored to the other side with `base (1 − F)`, facets narrower by the index | visible normals |
//! | diffuse and sheen    | that of `principled`                                             | cosine          |
//! | diffuse, through     | Lambert's law                                                    | cosine          |
//!
//! Formulas are those of [Burley2015] as Mitsuba 3 has them in `principledthin`. Both sides are alike.

use std::f32::consts::FRAC_1_PI;

use math::LocalDir;
use sampling::distribution::{chances, choose};
use sampling::{Pdf, SolidAngle};
use spectrum::Spectrum;

use super::conductor::mirror;
use super::diffuse::cosine_on_side_of;
use super::mixture::{lerp, mirror_lobe, sample_of, schlick_weight};
use super::principled::{burley, sheen};
use super::{BsdfKind, BsdfSample, Gloss, Lobe, LobeFlags, TransportMode};
use crate::fresnel;
use crate::microfacet::{Facets, MIN_COS};

/// Its parameters at a point, all in [0, 1] but for the index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinParameters {
    /// Colour of diffuse reflection and of what passes.
    pub base: Spectrum,
    /// The base colour over its luminance; one if it has none.
    pub hue: Spectrum,
    /// Of the diffuse lobe.
    pub roughness: f32,
    /// Of specular reflection.
    pub facets: Facets,
    /// Of what passes.
    pub facets_through: Facets,
    /// Of the sheet.
    pub eta: f32,
    /// Of specular reflection.
    pub spec_tint: f32,
    /// The part that is glass rather than diffuse.
    pub spec_trans: f32,
    /// Strength.
    pub sheen: f32,
    /// Of the sheen.
    pub sheen_tint: f32,
    /// Of the diffuse lobe.
    pub flatness: f32,
    /// The part of diffuse light that goes through.
    pub diff_trans: f32,
}

/// A sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrincipledThin {
    p: ThinParameters,
}

impl PrincipledThin {
    /// With these parameters.
    #[must_use]
    pub fn new(p: ThinParameters) -> Self {
        Self { p }
    }

    /// The roughness of what passes [Burley2015].
    #[must_use]
    pub fn roughness_through(roughness: f32, eta: f32) -> f32 {
        ((0.65 * eta - 0.35) * roughness).clamp(0.0, 1.0)
    }

    fn reflectance(&self, cos: f32) -> Spectrum {
        let p = &self.p;
        let there = fresnel::interface(cos, p.eta);
        let weight = schlick_weight(if p.eta > 1.0 { cos } else { there.cos_transmitted });
        let r = (p.eta - 1.0) / (p.eta + 1.0);
        let tinted = lerp(p.hue * (r * r), Spectrum::ONE, weight);
        lerp(Spectrum::splat(there.reflectance), tinted, p.spec_tint)
    }

    /// Chances of both specular and both diffuse lobes.
    fn chances(&self, wo: LocalDir) -> Option<[f32; 4]> {
        let p = &self.p;
        let base = p.base.max_component();
        let f = self.reflectance(wo.abs_cos_theta()).max_component().clamp(0.02, 1.0);
        let diffuse = (1.0 - p.spec_trans) * base.max(0.3 * p.sheen);
        chances([
            p.spec_trans * f,
            p.spec_trans * (1.0 - f).max(0.05) * base,
            diffuse * (1.0 - p.diff_trans),
            (1.0 - p.spec_trans) * base * p.diff_trans,
        ])
    }
}

/// `w` mirrored at the surface.
fn turned(w: LocalDir) -> LocalDir {
    LocalDir::new(w.0.x, w.0.y, -w.0.z)
}

impl BsdfKind for PrincipledThin {
    fn eval(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Spectrum {
        self.eval_pdf(wo, wi, mode).0
    }

    fn pdf(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Pdf<SolidAngle> {
        self.eval_pdf(wo, wi, mode).1
    }

    fn eval_pdf(&self, wo: LocalDir, wi: LocalDir, _: TransportMode) -> (Spectrum, Pdf<SolidAngle>) {
        let black = (Spectrum::ZERO, Pdf::ZERO);
        let Some([mirrored, through, diffuse, diffuse_through]) = self.chances(wo) else { return black };
        let p = &self.p;
        let cosine = wi.abs_cos_theta() * FRAC_1_PI;
        if let Some((shape, pdf, m)) = mirror_lobe(&p.facets, wo, wi) {
            let matt = p.base * (FRAC_1_PI * burley(p.roughness, p.flatness, wo, wi, m))
                + sheen(p.sheen, p.sheen_tint, p.hue, wi.dot(m));
            let specular = self.reflectance(wo.dot(m).abs()) * (p.spec_trans * shape);
            let f = specular + matt * ((1.0 - p.spec_trans) * (1.0 - p.diff_trans));
            return (f, pdf * mirrored + Pdf::new(diffuse * cosine));
        }
        if let Some((shape, pdf, m)) = mirror_lobe(&p.facets_through, wo, turned(wi)) {
            let passed = 1.0 - fresnel::dielectric(wo.dot(m).abs(), p.eta);
            let factor = p.spec_trans * passed * shape + (1.0 - p.spec_trans) * p.diff_trans * FRAC_1_PI;
            return (p.base * factor, pdf * through + Pdf::new(diffuse_through * cosine));
        }
        black
    }

    fn sample(&self, wo: LocalDir, u_lobe: f32, u: [f32; 2], mode: TransportMode) -> Option<BsdfSample> {
        if wo.abs_cos_theta() <= MIN_COS {
            return None;
        }
        let (lobe, _) = choose(self.chances(wo)?, u_lobe);
        let (wi, lobe) = match lobe {
            0 => (mirror(wo, self.p.facets.sample_visible(wo, u)), Lobe::reflection(Gloss::Glossy)),
            1 => {
                let m = self.p.facets_through.sample_visible(wo, u);
                (turned(mirror(wo, m)), Lobe::transmission(Gloss::Glossy))
            }
            2 => (cosine_on_side_of(wo, u)?, Lobe::reflection(Gloss::Diffuse)),
            _ => (-cosine_on_side_of(wo, u)?, Lobe::transmission(Gloss::Diffuse)),
        };
        sample_of(self, wo, wi, (lobe, 1.0), mode)
    }

    fn flags(&self) -> LobeFlags {
        let p = &self.p;
        let flag = |there: bool, f: LobeFlags| if there { f } else { LobeFlags::NONE };
        flag(p.spec_trans > 0.0, LobeFlags::GLOSSY_REFLECTION | LobeFlags::GLOSSY_TRANSMISSION)
            | flag(p.spec_trans < 1.0, LobeFlags::DIFFUSE_REFLECTION)
            | flag(p.spec_trans < 1.0 && p.diff_trans > 0.0, LobeFlags::DIFFUSE_TRANSMISSION)
    }

    fn albedo_estimate(&self, _: LocalDir) -> Spectrum {
        self.p.base
    }

    fn regularized(&self) -> Self {
        let (facets, facets_through) = (self.p.facets.regularized(), self.p.facets_through.regularized());
        Self { p: ThinParameters { facets, facets_through, ..self.p } }
    }
}
