//! From inputs of a description to handles: the parameters that kinds of material share.

use std::path::Path;

use scatter::microfacet::{Distribution, Masking};
use scene_desc::{
    ConductorSpectrum, FloatInput, IndexOfRefraction, MaterialDesc, MaterialKind, Roughness, Span,
    SpectrumDesc, SpectrumInput, Tint,
};
use spectrum::ColorMode;

use super::super::look::Look;
use super::super::measured::MeasuredLook;
use super::super::metal::rgb_metal;
use super::super::parameters::{Alpha, Eta, Layer, Metal, ProfileKey, Tints};
use super::{CoatParts, Compiler};
use crate::textures::{FloatHandle, SpectrumHandle, SpectrumRole, spectral_curve};

impl Compiler<'_, '_> {
    /// The priority of the body that a material bounds.
    pub(super) fn priority(&mut self, desc: &MaterialDesc) -> Option<i32> {
        let priority = desc.priority?;
        let bounds = matches!(
            desc.kind,
            MaterialKind::Dielectric { .. } | MaterialKind::Interface | MaterialKind::Subsurface { .. }
        );
        let problem = if !bounds {
            "this material bounds no body: its priority is ignored"
        } else if desc.opacity.is_some() {
            "a surface with holes bounds no body: its priority is ignored"
        } else if self.mixed.get(self.interiors.len() - 1).copied().unwrap_or(false) {
            "a priority counts where the material is a shape's own, not as a part of another"
        } else {
            return Some(priority);
        };
        self.textures
            .sink()
            .warning(desc.span, problem)
            .hint("dielectrics, subsurface materials and interfaces have priorities");
        bounds.then_some(priority).filter(|_| desc.opacity.is_none())
    }

    pub(super) fn albedo(&mut self, input: &SpectrumInput, span: Span) -> SpectrumHandle {
        self.textures.spectrum(input, SpectrumRole::Albedo, span)
    }

    pub(super) fn alpha(&mut self, roughness: &Roughness, span: Span) -> Alpha {
        for input in [&roughness.u, &roughness.v] {
            if let FloatInput::Constant(r) = input
                && !(0.0..=1.0).contains(r)
            {
                self.textures
                    .sink()
                    .warning(span, format!("roughness {r} is outside [0, 1]"))
                    .hint("it is used as it is; below zero as a mirror");
                break;
            }
        }
        let (u, v) = (self.textures.float(&roughness.u, span), self.textures.float(&roughness.v, span));
        let distribution = match roughness.distribution {
            scene_desc::Distribution::Ggx => Distribution::Ggx,
            scene_desc::Distribution::Beckmann => Distribution::Beckmann,
        };
        let masking = match roughness.masking {
            scene_desc::Masking::Correlated => Masking::Correlated,
            scene_desc::Masking::Separable => Masking::Separable,
        };
        Alpha { u, v, remap: roughness.remap, distribution, masking, compensate: roughness.compensate }
    }

    pub(super) fn eta(&mut self, eta: &IndexOfRefraction, span: Span) -> Eta {
        let desc = match eta {
            IndexOfRefraction::Constant(eta) => return Eta::Constant(*eta),
            IndexOfRefraction::Spectrum(desc) => desc,
        };
        let curve = spectral_curve(desc, SpectrumRole::Unbounded, span, self.textures.sink());
        if curve.is_constant() {
            return Eta::Constant(curve.eval(550.0));
        }
        let colors = self.textures.colors();
        match colors.mode {
            ColorMode::Spectral => Eta::Dispersive(colors.unbounded(&curve)),
            // The eye's mean: ∫ ȳ η / ∫ ȳ.
            ColorMode::Rgb => {
                self.dispersive.push(span);
                Eta::Constant((curve.inner_product_y() / spectrum::y_integral()) as f32)
            }
        }
    }

    pub(super) fn metal(&mut self, desc: &ConductorSpectrum, span: Span) -> Metal {
        let (eta, k) = match desc {
            ConductorSpectrum::Reflectance(r) => return Metal::Reflectance(self.albedo(r, span)),
            ConductorSpectrum::EtaK { eta, k } => (eta, k),
        };
        let colors = self.textures.colors();
        if let (SpectrumInput::Constant(eta), SpectrumInput::Constant(k)) = (eta, k)
            && colors.mode == ColorMode::Rgb
            && is_curve(eta)
            && is_curve(k)
        {
            let mut curve = |d| spectral_curve(d, SpectrumRole::Unbounded, span, self.textures.sink());
            let [eta, k] = rgb_metal(&curve(eta), &curve(k), colors).map(SpectrumHandle::Constant);
            return Metal::EtaK { eta, k };
        }
        let mut handle = |input| self.textures.spectrum(input, SpectrumRole::Unbounded, span);
        Metal::EtaK { eta: handle(eta), k: handle(k) }
    }

    pub(super) fn tint(&mut self, tint: &Tint, span: Span) -> Tints {
        let mut handle = |input: &Option<SpectrumInput>| {
            input.as_ref().map(|i| self.textures.spectrum(i, SpectrumRole::Unbounded, span))
        };
        Tints { reflectance: handle(&tint.reflectance), transmittance: handle(&tint.transmittance) }
    }

    pub(super) fn layer(&mut self, parts: &CoatParts<'_>, span: Span) -> Box<Layer> {
        // A coat without a medium does not absorb, however thick it is (docs/decisions/0011).
        let albedo = self.albedo(parts.albedo, span);
        let thickness = match &albedo {
            SpectrumHandle::Constant(a) if a.is_black() => FloatHandle::Constant(0.0),
            SpectrumHandle::Constant(_) | SpectrumHandle::Texture(_) => {
                self.textures.float(parts.thickness, span)
            }
        };
        let [max_depth, n_samples] = parts.limits.map(|n| u16::try_from(n).unwrap_or(u16::MAX));
        Box::new(Layer {
            eta: self.eta(parts.eta, span),
            alpha: self.alpha(parts.roughness, span),
            thickness,
            g: self.textures.float(parts.g, span),
            albedo,
            max_depth,
            n_samples: n_samples.max(1),
            profiles: None,
        })
    }

    /// A measured surface; a file is read once.
    pub(super) fn measured(&mut self, path: &Path, span: Span) -> Look {
        if let Some((_, known)) = self.measured.iter().find(|(p, _)| p == path) {
            return Look::Measured(known.clone());
        }
        match MeasuredLook::read(path, self.textures.colors()) {
            Ok(look) => {
                self.measured.push((path.to_owned(), look.clone()));
                Look::Measured(look)
            }
            Err(what) => {
                self.textures
                    .sink()
                    .error(span, format!("measured surface {}: {what}", path.display()))
                    .hint("it is a .bsdf file of the RGL data base, or one made alike");
                Look::Diffuse { reflectance: SpectrumHandle::Constant(spectrum::SpectrumValue::ZERO) }
            }
        }
    }

    /// The index of a coat's tables.
    pub(super) fn profile(&mut self, key: ProfileKey) -> usize {
        self.profiles.iter().position(|k| *k == key).unwrap_or_else(|| {
            self.profiles.push(key);
            self.profiles.len() - 1
        })
    }
}

/// A spectrum in the proper sense, rather than a colour?
fn is_curve(desc: &SpectrumDesc) -> bool {
    match desc {
        SpectrumDesc::Named(_) | SpectrumDesc::Curve(_) | SpectrumDesc::Blackbody(_) => true,
        SpectrumDesc::Constant(_) | SpectrumDesc::Rgb { .. } => false,
    }
}
