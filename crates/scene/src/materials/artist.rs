//! Looks with an artist's parameters, and hair.

use scatter::microfacet::Masking;
use scatter::{
    Bsdf, Hair, MetallicRoughness, MetallicRoughnessParameters, Principled, PrincipledParameters,
    PrincipledThin, ThinParameters,
};

use super::parameters::{Eta, Lookup};
use crate::textures::{FloatHandle, SpectrumHandle};

/// Disney's and Mitsuba's.
#[derive(Clone, Debug)]
pub(super) struct PrincipledLook {
    pub(super) base_color: SpectrumHandle,
    pub(super) metallic: FloatHandle,
    pub(super) roughness: FloatHandle,
    pub(super) anisotropic: FloatHandle,
    pub(super) eta: Eta,
    pub(super) spec_tint: FloatHandle,
    pub(super) spec_trans: FloatHandle,
    pub(super) sheen: FloatHandle,
    pub(super) sheen_tint: FloatHandle,
    pub(super) flatness: FloatHandle,
    pub(super) clearcoat: FloatHandle,
    pub(super) clearcoat_gloss: FloatHandle,
    pub(super) clearcoat_of_facets: bool,
    /// Of a sheet.
    pub(super) diff_trans: Option<FloatHandle>,
}

impl PrincipledLook {
    pub(super) fn bsdf(&self, at: &mut Lookup<'_>) -> Bsdf {
        let base = at.albedo(&self.base_color);
        let hue = at.hue(base);
        let (roughness, anisotropic) = (at.unit(&self.roughness), at.unit(&self.anisotropic));
        // Mitsuba's masking.
        let facets_of = |r| Principled::facets(r, anisotropic).masked(Masking::Separable);
        let (facets, eta) = (facets_of(roughness), self.eta.at(at.wl));
        let (spec_tint, spec_trans) = (at.unit(&self.spec_tint), at.unit(&self.spec_trans));
        let (sheen, sheen_tint) = (at.float(&self.sheen).max(0.0), at.unit(&self.sheen_tint));
        let flatness = at.unit(&self.flatness);
        if let Some(diff_trans) = &self.diff_trans {
            let facets_through = facets_of(PrincipledThin::roughness_through(roughness, eta));
            let diff_trans = (0.5 * at.float(diff_trans)).clamp(0.0, 1.0);
            return PrincipledThin::new(ThinParameters {
                base,
                hue,
                roughness,
                facets,
                facets_through,
                eta,
                spec_tint,
                spec_trans,
                sheen,
                sheen_tint,
                flatness,
                diff_trans,
            })
            .into();
        }
        Principled::new(PrincipledParameters {
            base,
            hue,
            metallic: at.unit(&self.metallic),
            roughness,
            facets,
            eta,
            spec_tint,
            spec_trans,
            sheen,
            sheen_tint,
            flatness,
            clearcoat: at.unit(&self.clearcoat),
            clearcoat_gloss: at.unit(&self.clearcoat_gloss),
            clearcoat_of_facets: self.clearcoat_of_facets,
        })
        .into()
    }
}

/// glTF's.
#[derive(Clone, Debug)]
pub(super) struct MetallicRoughnessLook {
    pub(super) base_color: SpectrumHandle,
    pub(super) metallic: FloatHandle,
    pub(super) roughness: FloatHandle,
    pub(super) eta: Eta,
    pub(super) specular: FloatHandle,
    pub(super) specular_color: SpectrumHandle,
    pub(super) anisotropy: FloatHandle,
    /// From the tangent, in radians.
    pub(super) rotation: FloatHandle,
    pub(super) sheen_color: SpectrumHandle,
    pub(super) sheen_roughness: FloatHandle,
    pub(super) clearcoat: FloatHandle,
    pub(super) clearcoat_roughness: FloatHandle,
    pub(super) transmission: FloatHandle,
    pub(super) diffuse_transmission: FloatHandle,
    pub(super) diffuse_transmission_color: SpectrumHandle,
    pub(super) thin: bool,
}

impl MetallicRoughnessLook {
    pub(super) fn bsdf(&self, at: &mut Lookup<'_>) -> Bsdf {
        let (roughness, anisotropy) = (at.unit(&self.roughness), at.unit(&self.anisotropy));
        let through = (at.unit(&self.diffuse_transmission), at.albedo(&self.diffuse_transmission_color));
        MetallicRoughness::new(&MetallicRoughnessParameters {
            base: at.albedo(&self.base_color),
            metallic: at.unit(&self.metallic),
            facets: MetallicRoughness::facets(roughness, anisotropy),
            eta: self.eta.at(at.wl),
            specular: at.unit(&self.specular),
            specular_color: at.positive(&self.specular_color),
            sheen: at.albedo(&self.sheen_color),
            sheen_roughness: at.unit(&self.sheen_roughness),
            clearcoat: at.unit(&self.clearcoat),
            clearcoat_roughness: at.unit(&self.clearcoat_roughness),
            transmission: at.unit(&self.transmission),
            diffuse_transmission: through,
            thin: self.thin,
        })
        .into()
    }
}

/// Hair.
#[derive(Clone, Debug)]
pub(super) struct HairLook {
    pub(super) color: HairPigment,
    pub(super) eta: f32,
    pub(super) beta_m: FloatHandle,
    pub(super) beta_n: FloatHandle,
    pub(super) alpha_degrees: FloatHandle,
}

/// What colours it.
#[derive(Clone, Debug)]
pub(super) enum HairPigment {
    Absorption(SpectrumHandle),
    Reflectance(SpectrumHandle),
    /// Concentrations, and absorption of a concentration of one.
    Melanin {
        concentration: [FloatHandle; 2],
        sigma_a: [SpectrumHandle; 2],
    },
}

impl HairLook {
    pub(super) fn bsdf(&self, at: &mut Lookup<'_>) -> Bsdf {
        let beta_n = at.unit(&self.beta_n);
        let sigma_a = match &self.color {
            HairPigment::Absorption(sigma_a) => at.positive(sigma_a),
            HairPigment::Reflectance(r) => Hair::sigma_a_from_reflectance(at.albedo(r), beta_n),
            HairPigment::Melanin { concentration, sigma_a } => {
                let mut part = |i: usize| at.positive(&sigma_a[i]) * at.float(&concentration[i]).max(0.0);
                part(0) + part(1)
            }
        };
        let h = 2.0 * at.across() - 1.0;
        let alpha = at.float(&self.alpha_degrees).to_radians();
        Hair::new(sigma_a, h, self.eta, [at.unit(&self.beta_m), beta_n], alpha).into()
    }
}
