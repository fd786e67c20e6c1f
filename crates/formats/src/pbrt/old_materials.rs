//! Materials of pbrt-v3 [PBR3e, ch. 9].
//!
//! | pbrt-v3               | here                                                                                     |
//! |-----------------------|------------------------------------------------------------------------------------------|
//! | matte                 | Lambert, or Oren–Nayar where `sigma` is given                                             |
//! | plastic, substrate    | a dielectric coat over Lambert, as pbrt-v4's own upgrade has it; without `Ks`, Lambert    |
//! | uber                  | the same, mixed with smooth glass of the colours `Kr` and `Kt` where they are given       |
//! | metal, mirror         | a conductor                                                                               |
//! | glass                 | a dielectric with the factors `Kr` and `Kt`                                               |
//! | translucent           | Lambert to both sides, mixed with rough glass for `Ks`                                    |
//! | disney                | Disney's principled surface; without gloss where it is thin, and metal in part as Mitsuba has it |
//! | kdsubsurface          | subsurface by reflectance and mean free path                                              |
//! | fourier               | grey, with a warning                                                                      |

use scene_desc::{
    ConductorSpectrum, FloatInput, IndexOfRefraction, MaterialDesc, MaterialKind, PrincipledDesc, Roughness,
    SpectrumDesc, SpectrumInput, SubsurfaceProfile, TextureDesc, TextureId, TextureInput, TextureKind,
    TextureNode, ThinSheet, Tint,
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
            "plastic" | "substrate" => {
                let reflectance = self.albedo(p, "Kd", if entity.kind == "plastic" { 0.25 } else { 0.5 });
                self.coat(p, reflectance)
            }
            "uber" => self.uber(entity),
            "metal" => MaterialKind::Conductor {
                spectrum: self.conductor(p, "eta", "k"),
                roughness: self.old_roughness(p, 0.01),
                tint: Tint::default(),
            },
            // Of the same reflectance from everywhere.
            "mirror" => MaterialKind::Conductor {
                spectrum: ConductorSpectrum::Reflectance(SpectrumDesc::Constant(1.0).into()),
                roughness: Roughness::smooth(),
                tint: Tint { reflectance: Some(self.albedo(p, "Kr", 0.9)), transmittance: None },
            },
            "glass" => {
                let eta = if p.span_of("eta").is_some() { "eta" } else { "index" };
                MaterialKind::Dielectric {
                    eta: self.ior(p, eta, 1.5),
                    roughness: self.old_roughness(p, 0.0),
                    tint: Tint { reflectance: self.tint(p, "Kr"), transmittance: self.tint(p, "Kt") },
                }
            }
            "translucent" => self.translucent(entity),
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
                eta: p.float("eta", 1.33, self.report),
                roughness: self.old_roughness(p, 0.0),
                method: self.subsurface_method(p),
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
    fn coat(&mut self, p: &Params, reflectance: SpectrumInput) -> MaterialKind {
        let is_matte = self.spectrum_input(p, "Ks", Role::Albedo).is_some_and(|s| is_black(&s));
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

    /// pbrt-v3 adds lobes: `Kd` and a gloss, and smooth glass times `Kr` and `Kt`. Of a mixture each part has its share of the
    /// chance and is as much brighter, so that the sum is the same.
    fn uber(&mut self, entity: &Entity) -> MaterialKind {
        let p = &entity.params;
        let base = self.albedo(p, "Kd", 0.25);
        let glass = ["Kr", "Kt"].map(|name| self.spectrum_input(p, name, Role::Albedo));
        let size = glass.iter().flatten().map(largest).fold(0.0, f32::max);
        if size <= 0.0 {
            return self.coat(p, base);
        }
        // Colours that give back more than they get are taken in proportion.
        let share = size / (size + largest(&base)).max(1.0);
        let [kr, kt] = glass.map(|color| match color {
            Some(color) => self.scaled(color, 1.0 / share, entity),
            None => SpectrumDesc::Constant(0.0).into(),
        });
        let index = if p.span_of("index").is_some() { "index" } else { "eta" };
        let eta = self.ior(p, index, 1.5);
        let tint = Tint { reflectance: Some(kr), transmittance: Some(kt) };
        let glass = MaterialKind::Dielectric { eta, roughness: Roughness::smooth(), tint };
        let base = if share < 1.0 { self.scaled(base, 1.0 / (1.0 - share), entity) } else { base };
        let coat = self.coat(p, base);
        if share >= 1.0 {
            return glass;
        }
        self.mixture(entity, [coat, glass], share)
    }

    /// Lambert to both sides, and rough glass of index 1.5 for the gloss: see [`Build::uber`].
    fn translucent(&mut self, entity: &Entity) -> MaterialKind {
        let p = &entity.params;
        let (color, gloss) = (self.albedo(p, "Kd", 0.25), self.albedo(p, "Ks", 0.25));
        let [r, t] = [self.albedo(p, "reflect", 0.5), self.albedo(p, "transmit", 0.5)];
        let roughness = self.old_roughness(p, 0.1);
        let size = largest(&gloss);
        let share = size / (size + largest(&color)).max(1.0);
        let both = [r, t].map(|side| {
            let [color, gloss] = [&color, &gloss].map(|c| self.times(c.clone(), side.clone(), entity));
            (color, gloss)
        });
        let [(reflectance, kr), (transmittance, kt)] = both;
        let [kr, kt] = [kr, kt].map(|c| self.scaled(c, 1.0 / share.max(f32::MIN_POSITIVE), entity));
        let tint = Tint { reflectance: Some(kr), transmittance: Some(kt) };
        let glass = MaterialKind::Dielectric { eta: IndexOfRefraction::Constant(1.5), roughness, tint };
        if share >= 1.0 {
            return glass;
        }
        let scale = 1.0 / (1.0 - share);
        let sheet = MaterialKind::DiffuseTransmission { reflectance, transmittance, scale };
        if share <= 0.0 { sheet } else { self.mixture(entity, [sheet, glass], share) }
    }

    /// Two parts with the entity's bumps; `share` is the second's.
    fn mixture(&mut self, entity: &Entity, parts: [MaterialKind; 2], share: f32) -> MaterialKind {
        let bumps = self.float_input(&entity.params, "bumpmap");
        let materials = parts.map(|kind| {
            let desc = MaterialDesc { displacement: bumps.clone(), ..MaterialDesc::new(kind, entity.span) };
            self.add_material(desc)
        });
        MaterialKind::Mix { materials, amount: share.into() }
    }

    fn scaled(&mut self, s: SpectrumInput, factor: f32, entity: &Entity) -> SpectrumInput {
        self.times(s, SpectrumDesc::Constant(factor).into(), entity)
    }

    /// The chance that a surface of `uber` is there.
    pub(super) fn old_opacity(&mut self, entity: &Entity) -> Option<FloatInput> {
        if entity.kind != "uber" {
            return None;
        }
        let p = &entity.params;
        let param = p.find("opacity", &[Type::Rgb, Type::Float, Type::Spectrum, Type::Texture])?;
        if param.ty == Type::Texture {
            return self.numbers_of(param.strings().first()?, param.span);
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
        if let (SpectrumInput::Constant(SpectrumDesc::Constant(a)), other)
        | (other, SpectrumInput::Constant(SpectrumDesc::Constant(a))) = (&a, &b)
            && let Some(product) = by_number(other, *a)
        {
            return product;
        }
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
        if is_thin {
            self.report
                .warning(p.span_of("thin").unwrap_or(entity.span), "a thin material \"disney\" is not pbrt-v3's")
                .hint("it is Mitsuba's \"principledthin\": without gloss, and less bright seen from where light comes");
        }
        let eta = match self.float_input(p, "eta") {
            Some(FloatInput::Constant(eta)) => eta,
            Some(FloatInput::Texture(_)) | None => 1.5,
        };
        // pbrt-v3 flattens sheets alone, and tints the gloss only as far as it is a metal's.
        let metallic = self.number(p, "metallic", 0.0);
        let flatness = self.number(p, "flatness", 0.0);
        let flatness = if is_thin { flatness } else { 0.0.into() };
        let tint = self.number(p, "speculartint", 0.0);
        let spec_tint = if metallic == FloatInput::Constant(0.0) { 0.0.into() } else { tint };
        let diff_trans = self.number(p, "difftrans", 1.0);
        MaterialKind::Principled(Box::new(PrincipledDesc {
            base_color: self.albedo(p, "color", 0.5),
            metallic,
            roughness: self.number(p, "roughness", 0.5),
            anisotropic: self.number(p, "anisotropic", 0.0),
            eta: IndexOfRefraction::Constant(eta),
            spec_tint,
            spec_trans: self.number(p, "spectrans", 0.0),
            sheen: self.number(p, "sheen", 0.0),
            sheen_tint: self.number(p, "sheentint", 0.5),
            flatness,
            clearcoat: self.number(p, "clearcoat", 0.0),
            clearcoat_gloss: self.number(p, "clearcoatgloss", 1.0),
            clearcoat_of_facets: true,
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
                let numbers = param.strings().first().and_then(|n| self.numbers_of(n, param.span));
                numbers.unwrap_or(0.5.into())
            }
            Some(param) if !param.floats().is_empty() => {
                FloatInput::Constant(param.floats().iter().sum::<f32>() / param.floats().len() as f32)
            }
            Some(_) | None => 0.5.into(),
        };
        Some(MaterialKind::Mix { materials: [second?, first?], amount })
    }
}

/// A colour that is no texture, times a number; at most one.
fn by_number(s: &SpectrumInput, factor: f32) -> Option<SpectrumInput> {
    let times = |c: f32| (c * factor).min(1.0);
    match s {
        SpectrumInput::Constant(SpectrumDesc::Constant(c)) => Some(SpectrumDesc::Constant(times(*c)).into()),
        SpectrumInput::Constant(SpectrumDesc::Rgb { rgb, space }) => {
            Some(SpectrumDesc::Rgb { rgb: rgb.map(times), space: *space }.into())
        }
        SpectrumInput::Constant(_) | SpectrumInput::Texture(_) => None,
    }
}

/// The largest share of light that a colour gives back; of a texture, a half.
fn largest(s: &SpectrumInput) -> f32 {
    match s {
        SpectrumInput::Constant(SpectrumDesc::Rgb { rgb, .. }) => rgb.iter().fold(0.0, |a: f32, c| a.max(*c)),
        SpectrumInput::Constant(SpectrumDesc::Constant(c)) => *c,
        SpectrumInput::Constant(_) | SpectrumInput::Texture(_) => 0.5,
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
