//! Disney's principled surface, the border of a solid.
//!
//! | lobe           | value                                                               | sampled by      |
//! |----------------|---------------------------------------------------------------------|-----------------|
//! | specular       | `F D G / (4 cos cos)`, GGX; `F` mixes Fresnel's with Schlick's for metal and tint | visible normals |
//! | refraction     | that of rough glass, times `√base` and `spec_trans`                 | visible normals |
//! | diffuse        | Burley's with retro-reflection, or flat subsurface, and sheen       | cosine          |
//! | clearcoat      | GTR1 facets of index 1.5, `G` of GGX of width 0.25, a quarter strong; over `4 cos cos` if asked for | GTR1 normals    |
//!
//! Formulas are those of [Burley2012; Burley2015] as Mitsuba 3 has them in `principled`; which lobe is sampled is our
//! own. From inside there are the boundary of glass and nothing else.
//! Left out: conservation of energy, which the model does not have at grazing angles of bright colours.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use math::{LocalDir, trig};
use sampling::distribution::{chances, choose};
use sampling::{Pdf, SolidAngle};
use spectrum::Spectrum;

use super::conductor::mirror;
use super::diffuse::cosine_on_side_of;
use super::mixture::{lerp, mirror_lobe, sample_of, schlick_weight};
use super::{BsdfKind, BsdfSample, Dielectric, Gloss, Lobe, LobeFlags, SampleLobes, TransportMode};
use crate::fresnel;
use crate::microfacet::{Facets, MIN_COS};

/// Its parameters at a point, all in [0, 1] but for the index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrincipledParameters {
    /// Colour of diffuse reflection, of metal, and the square of that of refraction.
    pub base: Spectrum,
    /// The base colour over its luminance; one if it has none.
    pub hue: Spectrum,
    /// 1 is metal.
    pub metallic: f32,
    /// Its square is the width of facets.
    pub roughness: f32,
    /// Of the facets.
    pub facets: Facets,
    /// Inside over outside.
    pub eta: f32,
    /// Of the dielectric's specular reflection.
    pub spec_tint: f32,
    /// The part of the dielectric that refracts.
    pub spec_trans: f32,
    /// Strength.
    pub sheen: f32,
    /// Of the sheen.
    pub sheen_tint: f32,
    /// Of the diffuse lobe.
    pub flatness: f32,
    /// Strength.
    pub clearcoat: f32,
    /// Of the clearcoat.
    pub clearcoat_gloss: f32,
    /// Is the clearcoat divided by `4 cos cos`, as facets are?
    pub clearcoat_of_facets: bool,
}

/// The surface of a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Principled {
    p: PrincipledParameters,
}

impl Principled {
    /// With these parameters.
    #[must_use]
    pub fn new(p: PrincipledParameters) -> Self {
        Self { p }
    }

    /// The facets of a roughness: widths of its square along and across, at least 10⁻³.
    #[must_use]
    pub fn facets(roughness: f32, anisotropic: f32) -> Facets {
        let aspect = (1.0 - 0.9 * anisotropic).sqrt();
        let r2 = roughness * roughness;
        Facets::ggx((r2 / aspect).max(1e-3), (r2 * aspect).max(1e-3))
    }

    fn glass(&self) -> Dielectric {
        Dielectric::new(self.p.eta, self.p.facets)
    }

    /// Weight of the diffuse lobe.
    fn brdf(&self) -> f32 {
        (1.0 - self.p.metallic) * (1.0 - self.p.spec_trans)
    }

    /// Weight of the refraction.
    fn bsdf(&self) -> f32 {
        (1.0 - self.p.metallic) * self.p.spec_trans
    }

    /// Reflectance of a facet; `cos` is negative from inside.
    fn reflectance(&self, cos: f32) -> Spectrum {
        let p = &self.p;
        let there = fresnel::interface(cos, p.eta);
        if cos < 0.0 {
            return Spectrum::splat(self.bsdf() * there.reflectance);
        }
        let weight = schlick_weight(if p.eta > 1.0 { cos } else { there.cos_transmitted });
        let schlick = |f0: Spectrum| lerp(f0, Spectrum::ONE, weight);
        let r = (p.eta - 1.0) / (p.eta + 1.0);
        let dielectric = lerp(Spectrum::splat(there.reflectance), schlick(p.hue * (r * r)), p.spec_tint);
        lerp(dielectric, schlick(p.base), p.metallic)
    }

    /// Chances of specular reflection, refraction, the diffuse lobe and the clearcoat: about what each is worth.
    fn chances(&self, wo: LocalDir) -> Option<[f32; 4]> {
        let p = &self.p;
        let passed = (1.0 - fresnel::dielectric(wo.0.z, p.eta)).max(0.1);
        let refracted = self.bsdf() * passed * p.base.max_component().sqrt();
        let front = wo.0.z > 0.0;
        if !front && self.bsdf() <= 0.0 {
            return None;
        }
        let mirrored = self.reflectance(wo.0.z).max_component().max(0.02);
        let diffuse = self.brdf() * p.base.max_component().max(0.3 * p.sheen);
        let coat = 0.25 * p.clearcoat * (0.04 + 0.96 * schlick_weight(wo.0.z));
        chances(if front { [mirrored, refracted, diffuse, coat] } else { [mirrored, refracted, 0.0, 0.0] })
    }

    /// `f` of the diffuse lobe and the sheen.
    fn diffuse(&self, wo: LocalDir, wi: LocalDir, m: LocalDir) -> Spectrum {
        let p = &self.p;
        let lobe = burley(p.roughness, p.flatness, wo, wi, m);
        let sheen = sheen(p.sheen * (1.0 - p.metallic), p.sheen_tint, p.hue, wi.dot(m));
        p.base * (self.brdf() * FRAC_1_PI * lobe) + sheen
    }

    fn clearcoat_alpha(&self) -> f32 {
        0.1 + (0.001 - 0.1) * self.p.clearcoat_gloss
    }

    /// `f` and the density of the clearcoat.
    fn clearcoat(&self, wo: LocalDir, wi: LocalDir, m: LocalDir) -> (f32, f32) {
        let (cos, d) = (wi.dot(m).abs(), gtr1(self.clearcoat_alpha(), m.0.z));
        let f = 0.04 + 0.96 * schlick_weight(cos);
        let shape = Facets::ggx(0.25, 0.25);
        let g = shape.g1(wo) * shape.g1(wi);
        let cosines = match self.p.clearcoat_of_facets {
            true => (4.0 * wo.abs_cos_theta() * wi.abs_cos_theta()).max(f32::MIN_POSITIVE),
            false => 1.0,
        };
        (0.25 * self.p.clearcoat * f * d * g / cosines, d * m.0.z / (4.0 * cos).max(f32::MIN_POSITIVE))
    }
}

/// Burley's diffuse lobe without its colour and `1/π`, blended with a flat subsurface.
pub(super) fn burley(roughness: f32, flatness: f32, wo: LocalDir, wi: LocalDir, m: LocalDir) -> f32 {
    let (co, ci) = (wo.abs_cos_theta(), wi.abs_cos_theta());
    let (fo, fi) = (schlick_weight(co), schlick_weight(ci));
    let cos = wi.dot(m);
    let rr = 2.0 * roughness * cos * cos;
    let diffuse = (1.0 - 0.5 * fo) * (1.0 - 0.5 * fi);
    let retro = rr * (fo + fi + fo * fi * (rr - 1.0));
    if flatness == 0.0 {
        return diffuse + retro;
    }
    // After Hanrahan and Krueger.
    let fss90 = 0.5 * rr;
    let fss = (1.0 + (fss90 - 1.0) * fo) * (1.0 + (fss90 - 1.0) * fi);
    let flat = 1.25 * (fss * (1.0 / (co + ci) - 0.5) + 0.5);
    (diffuse + retro) * (1.0 - flatness) + flat * flatness
}

/// `f` of the sheen.
pub(super) fn sheen(strength: f32, tint: f32, hue: Spectrum, cos: f32) -> Spectrum {
    if strength <= 0.0 {
        return Spectrum::ZERO;
    }
    lerp(Spectrum::ONE, hue, tint) * (strength * schlick_weight(cos.abs()))
}

/// Berry's distribution (GTR with an exponent of one) [Burley2012].
fn gtr1(alpha: f32, cos: f32) -> f32 {
    let a2 = alpha * alpha;
    (a2 - 1.0) / (PI * trig::ln(a2) * (1.0 + (a2 - 1.0) * cos * cos))
}

/// A normal with the density `D cos`.
fn sample_gtr1(alpha: f32, u: [f32; 2]) -> LocalDir {
    let a2 = alpha * alpha;
    let cos2 = (1.0 - trig::pow(a2, 1.0 - u[1])) / (1.0 - a2);
    let (sin_phi, cos_phi) = trig::sin_cos(TAU * u[0]);
    let sin = trig::safe_sqrt(1.0 - cos2);
    LocalDir::new(sin * cos_phi, sin * sin_phi, trig::safe_sqrt(cos2))
}

impl BsdfKind for Principled {
    fn eval(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Spectrum {
        self.eval_pdf(wo, wi, mode).0
    }

    fn pdf(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Pdf<SolidAngle> {
        self.eval_pdf(wo, wi, mode).1
    }

    fn eval_pdf(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> (Spectrum, Pdf<SolidAngle>) {
        let black = (Spectrum::ZERO, Pdf::ZERO);
        let Some([mirrored, refracted, diffuse, coat]) = self.chances(wo) else { return black };
        let Some((shape, pdf, m)) = mirror_lobe(&self.p.facets, wo, wi) else {
            if refracted <= 0.0 {
                return black;
            }
            let glass = self.glass();
            let f = if wo.same_hemisphere(wi) { 0.0 } else { glass.eval_scalar(wo, wi, mode) };
            let color = self.p.base.map(|b| b.max(0.0).sqrt()) * self.bsdf();
            return (color * f, glass.pdf_lobes(wo, wi, SampleLobes::Transmission) * refracted);
        };
        let front = wo.0.z > 0.0;
        let cos = if front { wo.dot(m).abs() } else { -wo.dot(m).abs() };
        let mut f = self.reflectance(cos) * shape;
        let mut pdf = pdf * mirrored;
        if diffuse > 0.0 {
            f += self.diffuse(wo, wi, m);
            pdf = pdf + Pdf::new(diffuse * wi.abs_cos_theta() * FRAC_1_PI);
        }
        if coat > 0.0 {
            let (value, density) = self.clearcoat(wo, wi, m);
            f += Spectrum::splat(value);
            pdf = pdf + Pdf::new(coat * density);
        }
        (f, pdf)
    }

    fn sample(&self, wo: LocalDir, u_lobe: f32, u: [f32; 2], mode: TransportMode) -> Option<BsdfSample> {
        if wo.abs_cos_theta() <= MIN_COS {
            return None;
        }
        let (lobe, u_lobe) = choose(self.chances(wo)?, u_lobe);
        let reflected = Lobe::reflection(Gloss::Glossy);
        let (wi, lobe, eta) = match lobe {
            0 => (mirror(wo, self.p.facets.sample_visible(wo, u)), reflected, 1.0),
            1 => {
                let s = self.glass().sample_lobes(wo, u_lobe, u, mode, SampleLobes::Transmission)?;
                (s.wi, s.lobe, s.eta)
            }
            2 => (cosine_on_side_of(wo, u)?, Lobe::reflection(Gloss::Diffuse), 1.0),
            _ => (mirror(wo, sample_gtr1(self.clearcoat_alpha(), u)), reflected, 1.0),
        };
        sample_of(self, wo, wi, (lobe, eta), mode)
    }

    fn flags(&self) -> LobeFlags {
        let diffuse = if self.brdf() > 0.0 { LobeFlags::DIFFUSE_REFLECTION } else { LobeFlags::NONE };
        let refraction = if self.bsdf() > 0.0 { LobeFlags::GLOSSY_TRANSMISSION } else { LobeFlags::NONE };
        LobeFlags::GLOSSY_REFLECTION | diffuse | refraction
    }

    fn albedo_estimate(&self, wo: LocalDir) -> Spectrum {
        let mirrored = self.reflectance(wo.abs_cos_theta());
        mirrored + (Spectrum::ONE - mirrored).map(|x| x.max(0.0)) * self.p.base * (1.0 - self.p.metallic)
    }

    fn regularized(&self) -> Self {
        Self { p: PrincipledParameters { facets: self.p.facets.regularized(), ..self.p } }
    }
}
