//! Materials of pbrt-v3 [PBR3e, ch. 9].
//!
//! | pbrt-v3               | here                                                                                     |
//! |-----------------------|------------------------------------------------------------------------------------------|
//! | matte                 | Lambert, or Oren–Nayar where `sigma` is given                                             |
//! | plastic, substrate, uber | a dielectric coat over Lambert, as pbrt-v4's own upgrade has it; without `Ks`, Lambert  |
//! | metal, mirror         | a conductor                                                                               |
//! | glass                 | a dielectric with the factors `Kr` and `Kt`                                               |
//! | translucent           | Lambert to both sides, without its gloss                                                  |
//! | disney                | Disney's principled surface                                                               |
//! | kdsubsurface          | subsurface by reflectance and mean free path                                              |
//! | fourier               | grey, with a warning                                                                      |

use scene_desc::{
    ConductorSpectrum, FloatInput, IndexOfRefraction, MaterialKind, PrincipledDesc, Roughness, SpectrumDesc,
    SpectrumInput, SubsurfaceProfile, TextureDesc, TextureId, TextureInput, TextureKind, TextureNode,
    ThinSheet, Tint,
};

use super::build::Build;
use super::params::{Params, Type};
use super::spectra::Role;
use super::state::Entity;
use super::upgrade::alpha_of_roughness;

/// Names of its materials that pbrt-v4 does not have.
pub(super) const NAMES: [&str; 13] = [
    "matte",
    "plastic",
    "substrate",
    "uber",
    "metal",
    "mirror",
    "glass",
    "translucent",
    "disney",
    "kdsubsurface",
    "fourier",
    "mix",
    "none",
];

impl Build<'_, '_> {
    /// A material of pbrt-v3 that pbrt-v4 has not, or has otherwise.
    #[allow(clippy::too_many_lines, reason = "one arm a kind")]
    pub(super) fn old_material(&mut self, entity: &Entity) -> Option<MaterialKind> {
        let p = &entity.params;
        Some(match entity.kind.as_str() {
            "matte" => self.matte(p),
            "plastic" => self.coat(p, ["Kd", "Ks"], 0.25),
            "substrate" => self.coat(p, ["Kd", "Ks"], 0.5),
            "uber" => {
                self.drop_of_uber(entity);
                self.coat(p, ["Kd", "Ks"], 0.25)
            }
            "metal" => MaterialKind::Conductor {
                spectrum: self.conductor(p, "eta", "k"),
                roughness: self.old_roughness(p, 0.01),
                tint: Tint::default(),
            },
            "mirror" => MaterialKind::Conductor {
                spectrum: ConductorSpectrum::Reflectance(self.albedo(p, "Kr", 0.9)),
                roughness: Roughness::smooth(),
                tint: Tint::default(),
            },
            "glass" => {
                let eta = if p.span_of("eta").is_some() { "eta" } else { "index" };
                MaterialKind::Dielectric {
                    eta: self.ior(p, eta, 1.5),
                    roughness: self.old_roughness(p, 0.0),
                    tint: Tint { reflectance: self.tint(p, "Kr"), transmittance: self.tint(p, "Kt") },
                }
            }
            "translucent" => {
                p.accept(&[("Ks", Type::Rgb), ("Ks", Type::Texture), ("Ks", Type::Spectrum)]);
                p.accept(&[("roughness", Type::Float), ("remaproughness", Type::Bool)]);
                let color = self.albedo(p, "Kd", 0.25);
                let (r, t) = (self.albedo(p, "reflect", 0.5), self.albedo(p, "transmit", 0.5));
                MaterialKind::DiffuseTransmission {
                    reflectance: self.times(color.clone(), r, entity),
                    transmittance: self.times(color, t, entity),
                    scale: 1.0,
                }
            }
            "disney" => self.disney(entity),
            "kdsubsurface" => MaterialKind::Subsurface {
                profile: SubsurfaceProfile::Reflectance {
                    reflectance: self.albedo(p, "Kd", 0.5),
                    mfp: self
                        .spectrum_input(p, "mfp", Role::Unbounded)
                        .or_else(|| self.float_input(p, "mfp").and_then(constant))
                        .unwrap_or(SpectrumDesc::Constant(1.0).into()),
                },
                scale: p.float("scale", 1.0, self.report),
                g: p.float("g", 0.0, self.report),
                eta: p.float("eta", 1.3, self.report),
                roughness: self.old_roughness(p, 0.0),
            },
            "fourier" => {
                p.accept(&[("bsdffile", Type::String)]);
                self.report
                    .warning(entity.span, "material \"fourier\" is not supported")
                    .hint("a grey diffuse surface stands in for it");
                MaterialKind::default_diffuse()
            }
            "mix" => return self.old_mix(entity),
            _ => MaterialKind::Interface,
        })
    }

    fn matte(&mut self, p: &Params) -> MaterialKind {
        let reflectance = self.albedo(p, "Kd", 0.5);
        match self.float_input(p, "sigma") {
            None | Some(FloatInput::Constant(0.0)) => MaterialKind::Diffuse { reflectance },
            Some(sigma) => MaterialKind::OrenNayar { reflectance, sigma },
        }
    }

    /// A coat, unless its reflection is black.
    fn coat(&mut self, p: &Params, [base, gloss]: [&'static str; 2], default: f32) -> MaterialKind {
        let reflectance = self.albedo(p, base, default);
        let is_matte = self.spectrum_input(p, gloss, Role::Albedo).is_some_and(|s| is_black(&s));
        let roughness = self.old_roughness(p, 0.1);
        let index = if p.span_of("index").is_some() { "index" } else { "eta" };
        let eta = self.ior(p, index, 1.5);
        if is_matte {
            return MaterialKind::Diffuse { reflectance };
        }
        MaterialKind::CoatedDiffuse {
            reflectance,
            roughness,
            thickness: 0.01.into(),
            eta,
            g: 0.0.into(),
            albedo: SpectrumDesc::Constant(0.0).into(),
            max_depth: 10,
            n_samples: 1,
        }
    }

    /// What `uber` has beside its coat.
    fn drop_of_uber(&mut self, entity: &Entity) {
        let p = &entity.params;
        for name in ["Kr", "Kt"] {
            if self.spectrum_input(p, name, Role::Albedo).is_some_and(|s| !is_black(&s)) {
                let at = p.span_of(name).unwrap_or(entity.span);
                self.report
                    .warning(at, format!("\"{name}\" of material \"uber\" is not supported"))
                    .hint("its base and its coat are shown without it");
            }
        }
    }

    /// The chance that a surface of `uber` is there.
    pub(super) fn old_opacity(&mut self, entity: &Entity) -> Option<FloatInput> {
        if entity.kind != "uber" {
            return None;
        }
        let p = &entity.params;
        let param = p.find("opacity", &[Type::Rgb, Type::Float, Type::Spectrum, Type::Texture])?;
        if param.ty == Type::Texture {
            // A texture of colours cannot say it.
            let name = param.strings().first()?;
            return self.float_textures.get(name).copied().map(FloatInput::Texture);
        }
        let values = param.floats();
        let mean = values.iter().sum::<f32>() / values.len().max(1) as f32;
        (!values.is_empty() && mean < 1.0).then_some(FloatInput::Constant(mean))
    }

    /// Widths by pbrt-v3's own curve where they are numbers, by pbrt-v4's where they are textures.
    fn old_roughness(&mut self, p: &Params, default: f32) -> Roughness {
        let both = self.float_input(p, "roughness").unwrap_or(default.into());
        let u = self.float_input(p, "uroughness").unwrap_or(both.clone());
        let v = self.float_input(p, "vroughness").unwrap_or(both);
        let remap = p.boolean("remaproughness", true, self.report);
        match (&u, &v) {
            (FloatInput::Constant(u), FloatInput::Constant(v)) if remap => {
                // Zero is a mirror.
                let alpha = |r: f32| if r > 0.0 { alpha_of_roughness(r) } else { 0.0 };
                Roughness::new(alpha(*u), alpha(*v), false)
            }
            _ => Roughness::new(u, v, remap),
        }
    }

    fn tint(&mut self, p: &Params, name: &'static str) -> Option<SpectrumInput> {
        let white = |s: &SpectrumInput| match s {
            SpectrumInput::Constant(SpectrumDesc::Rgb { rgb, .. }) => *rgb == [1.0; 3],
            SpectrumInput::Constant(SpectrumDesc::Constant(c)) => *c == 1.0,
            SpectrumInput::Constant(_) | SpectrumInput::Texture(_) => false,
        };
        self.spectrum_input(p, name, Role::Albedo).filter(|s| !white(s))
    }

    fn times(&mut self, a: SpectrumInput, b: SpectrumInput, entity: &Entity) -> SpectrumInput {
        let operand = |s: SpectrumInput| match s {
            SpectrumInput::Constant(desc) => TextureInput::Spectrum(desc),
            SpectrumInput::Texture(id) => TextureInput::Texture(id),
        };
        let node = TextureNode::Product { a: operand(a), b: operand(b) };
        let (name, kind, span) = (String::new(), TextureKind::Spectrum, entity.span);
        self.scene.textures.push(TextureDesc { name, kind, node, span });
        SpectrumInput::Texture(TextureId(self.scene.textures.len() as u32 - 1))
    }

    fn disney(&mut self, entity: &Entity) -> MaterialKind {
        let p = &entity.params;
        if let Some(at) = p.span_of("scatterdistance") {
            p.accept(&[("scatterdistance", Type::Rgb), ("scatterdistance", Type::Spectrum)]);
            self.report
                .warning(at, "\"scatterdistance\" of material \"disney\" is not supported")
                .hint("light does not wander below the surface");
        }
        let is_thin = p.boolean("thin", false, self.report);
        let eta = match self.float_input(p, "eta") {
            Some(FloatInput::Constant(eta)) => eta,
            Some(FloatInput::Texture(_)) | None => 1.5,
        };
        let flatness = self.number(p, "flatness", 0.0);
        let diff_trans = self.number(p, "difftrans", 1.0);
        MaterialKind::Principled(Box::new(PrincipledDesc {
            base_color: self.albedo(p, "color", 0.5),
            metallic: self.number(p, "metallic", 0.0),
            roughness: self.number(p, "roughness", 0.5),
            anisotropic: self.number(p, "anisotropic", 0.0),
            eta: IndexOfRefraction::Constant(eta),
            spec_tint: self.number(p, "speculartint", 0.0),
            spec_trans: self.number(p, "spectrans", 0.0),
            sheen: self.number(p, "sheen", 0.0),
            sheen_tint: self.number(p, "sheentint", 0.5),
            flatness,
            clearcoat: self.number(p, "clearcoat", 0.0),
            clearcoat_gloss: self.number(p, "clearcoatgloss", 1.0),
            thin: is_thin.then_some(ThinSheet { diff_trans }),
        }))
    }

    /// The share of the first is `amount`.
    fn old_mix(&mut self, entity: &Entity) -> Option<MaterialKind> {
        let p = &entity.params;
        let mut name = |key| p.string_opt(key, self.report);
        let (Some(a), Some(b)) = (name("namedmaterial1"), name("namedmaterial2")) else {
            let hint = "add \"string namedmaterial1\" and \"string namedmaterial2\"";
            return self.refuse(entity.span, "material \"mix\" has no two materials", hint);
        };
        let mut id = |(name, span): (String, scene_desc::Span)| {
            let found = self.named_materials.get(&name).copied();
            if found.is_none() {
                let known: Vec<_> = self.named_materials.keys().cloned().collect();
                self.unknown("named material (so far)", &name, span, known.iter());
            }
            found
        };
        let (first, second) = (id(a), id(b));
        let param = p.find("amount", &[Type::Rgb, Type::Float, Type::Spectrum, Type::Texture]);
        let amount = match param {
            Some(param) if param.ty == Type::Texture => {
                let id = param.strings().first().and_then(|n| self.float_textures.get(n).copied());
                id.map_or(0.5.into(), FloatInput::Texture)
            }
            Some(param) if !param.floats().is_empty() => {
                FloatInput::Constant(param.floats().iter().sum::<f32>() / param.floats().len() as f32)
            }
            Some(_) | None => 0.5.into(),
        };
        Some(MaterialKind::Mix { materials: [second?, first?], amount })
    }
}

fn is_black(s: &SpectrumInput) -> bool {
    match s {
        SpectrumInput::Constant(SpectrumDesc::Rgb { rgb, .. }) => *rgb == [0.0; 3],
        SpectrumInput::Constant(SpectrumDesc::Constant(c)) => *c == 0.0,
        SpectrumInput::Constant(_) | SpectrumInput::Texture(_) => false,
    }
}

fn constant(x: FloatInput) -> Option<SpectrumInput> {
    match x {
        FloatInput::Constant(c) => Some(SpectrumDesc::Constant(c).into()),
        FloatInput::Texture(_) => None,
    }
}
