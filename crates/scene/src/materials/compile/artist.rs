//! Looks with an artist's parameters, and hair, from their descriptions.

use scatter::Hair;
use scene_desc::{HairColor, MetallicRoughnessDesc, PrincipledDesc, Span, SpectrumDesc};

use super::super::artist::{HairLook, HairPigment, MetallicRoughnessLook, PrincipledLook};
use super::super::look::Look;
use super::Compiler;
use crate::textures::SpectrumRole;

impl Compiler<'_, '_> {
    pub(super) fn principled(&mut self, p: &PrincipledDesc, span: Span) -> Look {
        let (base_color, eta) = (self.albedo(&p.base_color, span), self.eta(&p.eta, span));
        let mut float = |input| self.textures.float(input, span);
        Look::Principled(Box::new(PrincipledLook {
            base_color,
            eta,
            metallic: float(&p.metallic),
            roughness: float(&p.roughness),
            anisotropic: float(&p.anisotropic),
            spec_tint: float(&p.spec_tint),
            spec_trans: float(&p.spec_trans),
            sheen: float(&p.sheen),
            sheen_tint: float(&p.sheen_tint),
            flatness: float(&p.flatness),
            clearcoat: float(&p.clearcoat),
            clearcoat_gloss: float(&p.clearcoat_gloss),
            clearcoat_of_facets: p.clearcoat_of_facets,
            diff_trans: p.thin.as_ref().map(|sheet| float(&sheet.diff_trans)),
        }))
    }

    pub(super) fn metallic_roughness(&mut self, p: &MetallicRoughnessDesc, span: Span) -> Look {
        let [base_color, sheen_color, diffuse_transmission_color] =
            [&p.base_color, &p.sheen_color, &p.diffuse_transmission_color].map(|c| self.albedo(c, span));
        let specular_color = self.textures.spectrum(&p.specular_color, SpectrumRole::Unbounded, span);
        let eta = self.eta(&p.eta, span);
        let mut float = |input| self.textures.float(input, span);
        Look::MetallicRoughness(Box::new(MetallicRoughnessLook {
            base_color,
            sheen_color,
            diffuse_transmission_color,
            specular_color,
            eta,
            metallic: float(&p.metallic),
            roughness: float(&p.roughness),
            specular: float(&p.specular),
            anisotropy: float(&p.anisotropy),
            rotation: float(&p.anisotropy_rotation),
            sheen_roughness: float(&p.sheen_roughness),
            clearcoat: float(&p.clearcoat),
            clearcoat_roughness: float(&p.clearcoat_roughness),
            transmission: float(&p.transmission),
            diffuse_transmission: float(&p.diffuse_transmission),
            thin: p.thin_walled,
        }))
    }

    pub(super) fn hair(
        &mut self,
        color: &HairColor,
        eta: f32,
        [beta_m, beta_n, alpha]: [&scene_desc::FloatInput; 3],
        span: Span,
    ) -> Look {
        let color = match color {
            HairColor::Absorption(sigma_a) => {
                HairPigment::Absorption(self.textures.spectrum(sigma_a, SpectrumRole::Unbounded, span))
            }
            HairColor::Reflectance(r) => HairPigment::Reflectance(self.albedo(r, span)),
            HairColor::Melanin { eumelanin, pheomelanin } => HairPigment::Melanin {
                concentration: [eumelanin, pheomelanin].map(|c| self.textures.float(c, span)),
                sigma_a: [[1.0, 0.0], [0.0, 1.0]].map(|[eu, pheo]| {
                    let unit = SpectrumDesc::srgb(Hair::sigma_a_from_melanin(eu, pheo)).into();
                    self.textures.spectrum(&unit, SpectrumRole::Unbounded, span)
                }),
            },
        };
        let mut float = |input| self.textures.float(input, span);
        let [beta_m, beta_n, alpha_degrees] = [float(beta_m), float(beta_n), float(alpha)];
        Look::Hair(Box::new(HairLook { color, eta, beta_m, beta_n, alpha_degrees }))
    }
}
