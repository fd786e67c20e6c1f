//! Subsurface materials: a medium below, a diffusion profile, or a coat that stands in.

use scene_desc::{
    IndexOfRefraction, MaterialKind, Roughness, Span, SpectrumDesc, SubsurfaceMethod, SubsurfaceProfile,
};
use spectrum::Spectrum;

use super::super::Surface;
use super::super::look::Look;
use super::super::parameters::Base;
use super::super::subsurface::{
    Diffuser, Interior, Under, effective_albedo, measured as measured_medium, names,
};
use super::{CoatParts, Compiler};
use crate::textures::SpectrumRole;

impl Compiler<'_, '_> {
    /// What is under a subsurface material's surface.
    pub(super) fn interior(&mut self, kind: &MaterialKind, span: Span) -> Option<Interior> {
        let MaterialKind::Subsurface { profile, scale, g, eta, method, .. } = kind else { return None };
        if self.is_mixed() || *method == SubsurfaceMethod::Separable {
            return None;
        }
        let under = Under { scale: *scale, g: *g, eta: *eta, span };
        let colors = self.textures.colors();
        Interior::new(profile, under, colors, self.textures.sink())
    }

    /// Is the material that is next in the list a part of another?
    pub(super) fn is_mixed(&self) -> bool {
        self.mixed.get(self.interiors.len()).copied().unwrap_or(false)
    }

    /// A border over a diffusion profile.
    pub(super) fn separable(&mut self, kind: &MaterialKind, span: Span) -> Surface {
        let MaterialKind::Subsurface { profile, scale, g, eta, roughness, .. } = kind else {
            return Surface::Interface;
        };
        if let SubsurfaceProfile::Named(name) = profile {
            self.known_measured(name, span);
        }
        let under = Under { scale: *scale, g: *g, eta: *eta, span };
        let diffuser = Diffuser::new(profile, under, |input, role| self.textures.spectrum(input, role, span));
        let alpha = self.alpha(roughness, span);
        Surface::Look(Look::SoftBorder { eta: *eta, alpha, profile: Some(Box::new(diffuser)) })
    }

    /// Absorption and scattering of a named material; grey, with a warning, if there is none of this name.
    fn known_measured(&mut self, name: &str, span: Span) -> [[f32; 3]; 2] {
        measured_medium(name).unwrap_or_else(|| {
            let known: Vec<_> = names().collect();
            self.textures
                .sink()
                .warning(span, format!("no subsurface material is named \"{name}\""))
                .hint(format!("rendered grey; known names: {}", known.join(", ")));
            [[1.0; 3]; 2]
        })
    }

    pub(super) fn subsurface(
        &mut self,
        profile: &SubsurfaceProfile,
        g: f32,
        (eta, roughness): (f32, &Roughness),
        span: Span,
    ) -> Look {
        self.textures
            .sink()
            .warning(
                span,
                "subsurface scattering with textures, or as a part of another material, is not supported",
            )
            .hint("rendered as a coated diffuse surface of about the same albedo; of textures method \"separable\" knows");
        let base = match profile {
            SubsurfaceProfile::Reflectance { reflectance, .. } => {
                Base::Albedo(self.albedo(reflectance, span))
            }
            SubsurfaceProfile::Coefficients { sigma_a, sigma_s } => {
                let mut handle = |input| self.textures.spectrum(input, SpectrumRole::Unbounded, span);
                Base::Subsurface { sigma_a: handle(sigma_a), sigma_s: handle(sigma_s), g }
            }
            SubsurfaceProfile::Named(name) => {
                let albedo = self.known_measured(name, span);
                // Scattering is measured reduced: isotropic.
                let [a, s] = albedo.map(Spectrum::from_rgb);
                let rgb = effective_albedo(a, s, 0.0).rgb();
                Base::Albedo(self.albedo(&SpectrumDesc::srgb(rgb).into(), span))
            }
        };
        let coat = CoatParts {
            eta: &IndexOfRefraction::Constant(eta),
            roughness,
            thickness: &0.0.into(),
            g: &0.0.into(),
            albedo: &SpectrumDesc::Constant(0.0).into(),
            limits: [100, 1],
        };
        self.coated_diffuse(base, &coat, span)
    }
}
