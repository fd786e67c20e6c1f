//! glTF's metallic-roughness surface with its layers.
//!
//! | lobe            | value                                                               | sampled by      |
//! |-----------------|---------------------------------------------------------------------|-----------------|
//! | specular        | `F D G2 / (4 cos cos)`, GGX, Schlick's `F` between `f0` and `f90`    | visible normals |
//! | diffuse         | `ρ/π T(wo) T(wi) / (1 − F̄)` with `T = 1 − F(cos)` of the dielectric  | cosine          |
//! | through, sheet  | the specular lobe mirrored, `1 − F` strong                          | visible normals |
//! | through, solid  | that of rough glass                                                 | visible normals |
//! | diffuse through | Lambert's law                                                       | cosine          |
//! | sheen           | `cloth`; what it gives back, layers below do not get                | with the diffuse |
//! | coat            | GGX of index 1.5; what is below is seen through it twice            | visible normals |
//!
//! The parameters are those of glTF 2.0, app. B, and its extensions. Departs from it: where the specification multiplies
//! what is under a layer by `1 − F` of the half vector, or of `wo` alone, so that a white surface can give back more than
//! it gets, or is not reciprocal, the layer is passed on both ways and normalised by its mean [Shirley1997].

use std::f32::consts::FRAC_1_PI;

use math::LocalDir;
use sampling::distribution::{chances, choose};
use sampling::{Pdf, SolidAngle};
use spectrum::Spectrum;

use super::conductor::mirror;
use super::diffuse::cosine_on_side_of;
use super::mixture::{mirror_lobe, sample_of, schlick_weight};
use super::{BsdfKind, BsdfSample, Dielectric, Gloss, Lobe, LobeFlags, SampleLobes, TransportMode, cloth};
use crate::fresnel;
use crate::microfacet::{Facets, MIN_COS};

/// Its parameters at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetallicRoughnessParameters {
    /// Base colour.
    pub base: Spectrum,
    /// 1 is metal.
    pub metallic: f32,
    /// Of the specular lobe.
    pub facets: Facets,
    /// Inside over outside.
    pub eta: f32,
    /// Strength of the dielectric's specular reflection.
    pub specular: f32,
    /// Its colour at normal incidence.
    pub specular_color: Spectrum,
    /// Colour of the cloth.
    pub sheen: Spectrum,
    /// Roughness of the cloth.
    pub sheen_roughness: f32,
    /// Strength of the coat.
    pub clearcoat: f32,
    /// Roughness of the coat.
    pub clearcoat_roughness: f32,
    /// The part of the dielectric that is glass.
    pub transmission: f32,
    /// Diffuse light that goes through: its part, and its colour.
    pub diffuse_transmission: (f32, Spectrum),
    /// A sheet?
    pub thin: bool,
}

/// The surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetallicRoughness {
    diffuse: Spectrum,
    diffuse_through: Spectrum,
    through: Spectrum,
    f0: Spectrum,
    sheen: Spectrum,
    f90: f32,
    /// Reflectance of the dielectric alone, at normal and at grazing incidence.
    dielectric: [f32; 2],
    facets: Facets,
    coat: f32,
    coat_facets: Facets,
    sheen_alpha: f32,
    eta: f32,
    /// The part that is glass, if it is the border of a solid.
    solid: f32,
}

/// GGX facets of a roughness, never a mirror's.
fn rough(roughness: f32) -> Facets {
    let alpha = (roughness * roughness).max(1e-3);
    Facets::ggx(alpha, alpha)
}

impl MetallicRoughness {
    /// With these parameters.
    #[must_use]
    pub fn new(p: &MetallicRoughnessParameters) -> Self {
        let matter = 1.0 - p.metallic;
        let r = (p.eta - 1.0) / (p.eta + 1.0);
        let f0 = p.specular_color.map(|c| (r * r * c).min(1.0)) * p.specular;
        let (through, color) = p.diffuse_transmission;
        let body = matter * (1.0 - p.transmission);
        Self {
            diffuse: p.base * (body * (1.0 - through)),
            diffuse_through: color * (body * through),
            through: p.base * (matter * p.transmission),
            f0: f0 * matter + p.base * p.metallic,
            sheen: p.sheen,
            f90: p.specular * matter + p.metallic,
            dielectric: [f0.max_component(), p.specular],
            facets: p.facets,
            coat: p.clearcoat,
            coat_facets: rough(p.clearcoat_roughness),
            sheen_alpha: cloth::alpha(p.sheen_roughness),
            eta: p.eta,
            solid: if p.thin { 0.0 } else { matter * p.transmission },
        }
    }

    /// The facets of a roughness, widened along the tangent by `anisotropy`, never a mirror's.
    #[must_use]
    pub fn facets(roughness: f32, anisotropy: f32) -> Facets {
        let alpha = (roughness * roughness).max(1e-3);
        Facets::ggx(alpha + (1.0 - alpha) * anisotropy * anisotropy, alpha)
    }

    fn is_inside(&self, wo: LocalDir) -> bool {
        self.solid > 0.0 && wo.0.z < 0.0
    }

    fn glass(&self) -> Dielectric {
        Dielectric::new(self.eta, self.facets)
    }

    /// Of a facet, seen from this side.
    fn reflectance(&self, cos: f32, inside: bool) -> Spectrum {
        if inside {
            return Spectrum::splat(self.solid * fresnel::dielectric(-cos, self.eta));
        }
        let w = schlick_weight(cos);
        self.f0 + (Spectrum::splat(self.f90) - self.f0) * w
    }

    /// What the dielectric lets through at an angle.
    fn passed(&self, cos: f32) -> f32 {
        let [f0, f90] = self.dielectric;
        1.0 - (f0 + (f90 - f0) * schlick_weight(cos))
    }

    /// What is left for diffuse reflection after both ways.
    fn passed_both(&self, co: f32, ci: f32) -> f32 {
        let [f0, f90] = self.dielectric;
        let mean = 1.0 - (f0 + (f90 - f0) / 21.0);
        if mean > 0.0 { self.passed(co) * self.passed(ci) / mean } else { 0.0 }
    }

    /// What the coat leaves of light that goes in and out through it.
    fn below_coat(&self, wo: LocalDir, wi: LocalDir) -> f32 {
        if self.coat <= 0.0 {
            return 1.0;
        }
        let passed = |w: LocalDir| 1.0 - self.coat * (0.04 + 0.96 * schlick_weight(w.abs_cos_theta()));
        passed(wo) * passed(wi) / (1.0 - self.coat * (0.04 + 0.96 / 21.0))
    }

    /// What the cloth leaves of light that goes in and out through it.
    fn below_cloths(&self, wo: LocalDir, wi: LocalDir) -> f32 {
        self.below_cloth(wo.abs_cos_theta()).min(self.below_cloth(wi.abs_cos_theta()))
    }

    fn below_cloth(&self, cos: f32) -> f32 {
        let strength = self.sheen.max_component();
        if strength <= 0.0 {
            return 1.0;
        }
        (1.0 - strength * cloth::albedo(self.sheen_alpha, cos)).max(0.0)
    }

    /// Chances of specular reflection, specular passage, diffuse reflection (and cloth), diffuse passage, and the coat.
    fn chances(&self, wo: LocalDir) -> Option<[f32; 5]> {
        let (co, inside) = (wo.abs_cos_theta(), self.is_inside(wo));
        let mirrored = self.reflectance(co, inside).max_component().clamp(0.02, 1.0);
        let through = self.through.max_component() * self.passed(co).max(0.05);
        if inside {
            return chances([
                mirrored,
                self.through.max_component() * (1.0 - mirrored).max(0.05),
                0.0,
                0.0,
                0.0,
            ]);
        }
        let coat = self.coat * (0.04 + 0.96 * schlick_weight(co));
        let diffuse = self.diffuse.max_component() * self.passed(co) + 0.5 * self.sheen.max_component();
        chances([mirrored, through, diffuse, self.diffuse_through.max_component(), coat])
    }

    /// Through the surface.
    fn passage(
        &self,
        wo: LocalDir,
        wi: LocalDir,
        mode: TransportMode,
        chances: [f32; 5],
    ) -> (Spectrum, Pdf<SolidAngle>) {
        // Both sides of a sheet have coat and cloth; of a solid, the outside alone.
        let layers = if self.solid > 0.0 {
            let outside = if wo.0.z > 0.0 { wo } else { wi }.abs_cos_theta();
            (1.0 - self.coat * (0.04 + 0.96 * schlick_weight(outside))) * self.below_cloth(outside)
        } else {
            self.below_cloths(wo, wi) * self.below_coat(wo, wi)
        };
        let (mut f, mut pdf) = if self.solid > 0.0 {
            let glass = self.glass();
            let f = self.through * glass.eval_scalar(wo, wi, mode);
            (f, glass.pdf_lobes(wo, wi, SampleLobes::Transmission) * chances[1])
        } else {
            match mirror_lobe(&self.facets, wo, turned(wi)) {
                Some((shape, pdf, m)) => {
                    (self.through * (shape * self.passed(wo.dot(m).abs())), pdf * chances[1])
                }
                None => return (Spectrum::ZERO, Pdf::ZERO),
            }
        };
        if chances[3] > 0.0 || self.is_inside(wo) {
            f += self.diffuse_through * FRAC_1_PI;
            pdf = pdf + Pdf::new(chances[3] * wi.abs_cos_theta() * FRAC_1_PI);
        }
        (f * layers, pdf)
    }
}

/// `w` mirrored at the surface.
fn turned(w: LocalDir) -> LocalDir {
    LocalDir::new(w.0.x, w.0.y, -w.0.z)
}

impl BsdfKind for MetallicRoughness {
    fn eval(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Spectrum {
        self.eval_pdf(wo, wi, mode).0
    }

    fn pdf(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Pdf<SolidAngle> {
        self.eval_pdf(wo, wi, mode).1
    }

    fn eval_pdf(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> (Spectrum, Pdf<SolidAngle>) {
        let black = (Spectrum::ZERO, Pdf::ZERO);
        let Some(chances) = self.chances(wo) else { return black };
        let Some((shape, pdf, m)) = mirror_lobe(&self.facets, wo, wi) else {
            let off = wo.abs_cos_theta() > MIN_COS && wi.abs_cos_theta() > MIN_COS;
            return if off && wo.same_hemisphere(-wi) { self.passage(wo, wi, mode, chances) } else { black };
        };
        let (co, ci, cos) = (wo.abs_cos_theta(), wi.abs_cos_theta(), wo.dot(m).abs());
        let [mirrored, _, diffuse, _, coat] = chances;
        let inside = self.is_inside(wo);
        let mut f = self.reflectance(cos, inside) * shape;
        let mut pdf = pdf * mirrored;
        if inside {
            return (f, pdf);
        }
        f += self.diffuse * (FRAC_1_PI * self.passed_both(co, ci));
        f *= self.below_cloths(wo, wi);
        pdf = pdf + Pdf::new(diffuse * ci * FRAC_1_PI);
        if !self.sheen.is_black() {
            f += self.sheen * cloth::eval(self.sheen_alpha, wo, wi, m);
        }
        f *= self.below_coat(wo, wi);
        if let (true, Some((shape, density, _))) = (coat > 0.0, mirror_lobe(&self.coat_facets, wo, wi)) {
            f += Spectrum::splat(self.coat * (0.04 + 0.96 * schlick_weight(cos)) * shape);
            pdf = pdf + density * coat;
        }
        (f, pdf)
    }

    fn sample(&self, wo: LocalDir, u_lobe: f32, u: [f32; 2], mode: TransportMode) -> Option<BsdfSample> {
        if wo.abs_cos_theta() <= MIN_COS {
            return None;
        }
        let (lobe, u_lobe) = choose(self.chances(wo)?, u_lobe);
        let glossy = Lobe::reflection(Gloss::Glossy);
        let (wi, lobe, eta) = match lobe {
            0 => (mirror(wo, self.facets.sample_visible(wo, u)), glossy, 1.0),
            1 if self.solid > 0.0 => {
                let s = self.glass().sample_lobes(wo, u_lobe, u, mode, SampleLobes::Transmission)?;
                (s.wi, s.lobe, s.eta)
            }
            1 => {
                let wi = turned(mirror(wo, self.facets.sample_visible(wo, u)));
                (wi, Lobe::transmission(Gloss::Glossy), 1.0)
            }
            2 => (cosine_on_side_of(wo, u)?, Lobe::reflection(Gloss::Diffuse), 1.0),
            3 => (-cosine_on_side_of(wo, u)?, Lobe::transmission(Gloss::Diffuse), 1.0),
            _ => (mirror(wo, self.coat_facets.sample_visible(wo, u)), glossy, 1.0),
        };
        sample_of(self, wo, wi, (lobe, eta), mode)
    }

    fn flags(&self) -> LobeFlags {
        let flag = |s: Spectrum, f: LobeFlags| if s.is_black() { LobeFlags::NONE } else { f };
        LobeFlags::GLOSSY_REFLECTION
            | flag(self.diffuse + self.sheen, LobeFlags::DIFFUSE_REFLECTION)
            | flag(self.diffuse_through, LobeFlags::DIFFUSE_TRANSMISSION)
            | flag(self.through, LobeFlags::GLOSSY_TRANSMISSION)
    }

    fn albedo_estimate(&self, wo: LocalDir) -> Spectrum {
        let co = wo.abs_cos_theta();
        let body = (self.diffuse + self.diffuse_through + self.through) * self.passed(co);
        (self.reflectance(co, false) + body).clamp(0.0, 1.0)
    }

    fn regularized(&self) -> Self {
        Self { facets: self.facets.regularized(), coat_facets: self.coat_facets.regularized(), ..*self }
    }
}
