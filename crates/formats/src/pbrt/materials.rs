//! `Material` and `MakeNamedMaterial`, with pbrt-v4's defaults.

use scene_desc::{
    ConductorSpectrum, FloatInput, HairColor, ImageEncoding, MaterialDesc, MaterialId, MaterialKind,
    Roughness, SpectrumDesc, SpectrumInput, SubsurfaceMethod, SubsurfaceProfile, Tint,
};

use super::build::Build;
use super::params::{Params, Type};
use super::spectra::Role;
use super::state::{Entity, NamedEntity};
use crate::{resources, suggest};

const NAMES: [&str; 12] = [
    "coatedconductor",
    "coateddiffuse",
    "conductor",
    "dielectric",
    "diffuse",
    "diffusetransmission",
    "hair",
    "interface",
    "measured",
    "mix",
    "subsurface",
    "thindielectric",
];

/// Materials of pbrt-v3, and what they are in pbrt-v4.
const OLD: [(&str, &str); 11] = [
    ("matte", "\"diffuse\""),
    ("plastic", "\"coateddiffuse\""),
    ("substrate", "\"coateddiffuse\""),
    ("metal", "\"conductor\""),
    ("glass", "\"dielectric\""),
    ("mirror", "\"conductor\""),
    ("translucent", "\"diffusetransmission\""),
    ("uber", "\"coateddiffuse\""),
    ("disney", "\"coateddiffuse\""),
    ("fourier", "\"measured\""),
    ("kdsubsurface", "\"subsurface\""),
];

/// The parameter names of a microfacet distribution.
struct RoughnessNames {
    both: &'static str,
    u: &'static str,
    v: &'static str,
}

const PLAIN: RoughnessNames = RoughnessNames { both: "roughness", u: "uroughness", v: "vroughness" };
const INTERFACE: RoughnessNames =
    RoughnessNames { both: "interface.roughness", u: "interface.uroughness", v: "interface.vroughness" };
const CONDUCTOR: RoughnessNames =
    RoughnessNames { both: "conductor.roughness", u: "conductor.uroughness", v: "conductor.vroughness" };

impl Build<'_, '_> {
    /// Builds all materials; gives the ids of the unnamed ones. Id 0 is pbrt's default.
    pub(super) fn materials(&mut self, named: Vec<NamedEntity>, unnamed: Vec<Entity>) -> Vec<MaterialId> {
        self.add_material(MaterialDesc::new(MaterialKind::default_diffuse(), scene_desc::Span::NONE));
        for NamedEntity { name, entity } in named {
            let desc = self.material(name.clone(), &entity);
            let id = self.add_material(desc);
            self.named_materials.insert(name, id);
        }
        unnamed
            .iter()
            .map(|entity| {
                let desc = self.material(String::new(), entity);
                self.add_material(desc)
            })
            .collect()
    }

    pub(super) fn add_material(&mut self, desc: MaterialDesc) -> MaterialId {
        self.scene.materials.push(desc);
        MaterialId(u32::try_from(self.scene.materials.len() - 1).unwrap_or(u32::MAX))
    }

    /// A material; one that could not be made stands as the default, so that its name is known.
    fn material(&mut self, name: String, entity: &Entity) -> MaterialDesc {
        let p = &entity.params;
        let kind = self.material_kind(entity);
        let has_surface = !matches!(kind, Some(MaterialKind::Interface | MaterialKind::Mix { .. }) | None);
        let (mut normal_map, mut displacement) = (None, None);
        if has_surface {
            normal_map = self.image_param(p, "normalmap", ImageEncoding::Linear);
            displacement = self.float_input(p, if self.is_old { "bumpmap" } else { "displacement" });
        }
        let bounds = matches!(
            kind,
            Some(MaterialKind::Dielectric { .. } | MaterialKind::Interface | MaterialKind::Subsurface { .. })
        );
        let priority = if bounds { p.integer_opt("priority", self.report).map(|(n, _)| n) } else { None };
        let opacity = if self.is_old { self.old_opacity(entity) } else { None };
        let is_stand_in = self.is_old && entity.kind == "fourier";
        if kind.is_some() && !is_stand_in {
            // The type of a named material is a parameter.
            p.accept(&[("type", Type::String)]);
            p.report_unused(&format!("material \"{}\"", entity.kind), self.report);
        }
        let kind = kind.unwrap_or_else(MaterialKind::default_diffuse);
        MaterialDesc {
            name,
            normal_map,
            displacement,
            opacity,
            priority,
            ..MaterialDesc::new(kind, entity.span)
        }
    }

    fn material_kind(&mut self, entity: &Entity) -> Option<MaterialKind> {
        let p = &entity.params;
        if self.is_old && super::old_materials::NAMES.contains(&entity.kind.as_str()) {
            return self.old_material(entity);
        }
        Some(match entity.kind.as_str() {
            "diffuse" => MaterialKind::Diffuse { reflectance: self.albedo(p, "reflectance", 0.5) },
            "diffusetransmission" => MaterialKind::DiffuseTransmission {
                reflectance: self.albedo(p, "reflectance", 0.25),
                transmittance: self.albedo(p, "transmittance", 0.25),
                scale: p.float("scale", 1.0, self.report),
            },
            "conductor" => MaterialKind::Conductor {
                spectrum: self.conductor(p, "eta", "k"),
                roughness: self.roughness(p, &PLAIN),
                tint: Tint::default(),
            },
            "dielectric" => MaterialKind::Dielectric {
                eta: self.ior(p, "eta", 1.5),
                roughness: self.roughness(p, &PLAIN),
                tint: Tint::default(),
            },
            "thindielectric" => {
                let (eta, tint) = (self.ior(p, "eta", 1.5), Tint::default());
                MaterialKind::ThinDielectric { eta, tint, passes: false }
            }
            "coateddiffuse" => self.coated_diffuse(p),
            "coatedconductor" => self.coated_conductor(p),
            "subsurface" => return self.subsurface(entity),
            "mix" => return self.mix(entity),
            "interface" | "none" | "" => MaterialKind::Interface,
            "hair" => self.hair(p),
            "measured" => return self.measured(entity),
            name => {
                let what = format!("material \"{name}\"");
                if let Some((_, now)) = OLD.iter().find(|o| o.0 == name) {
                    super::parser::old_syntax(self.report, entity.span, &what, now);
                    return None;
                }
                return self.refuse(entity.span, format!("unknown {what}"), suggest::hint(name, &NAMES));
            }
        })
    }

    fn measured(&mut self, entity: &Entity) -> Option<MaterialKind> {
        let Some((name, span)) = entity.params.string_opt("filename", self.report) else {
            let hint = "it is a .bsdf file of the RGL data base";
            return self.refuse(entity.span, "material \"measured\" has no \"filename\"".to_owned(), hint);
        };
        let path = self.resolve(&name);
        self.hashes.extend(resources::hash_measured(&path, span, self.report));
        Some(MaterialKind::Measured { path })
    }

    pub(super) fn albedo(&mut self, p: &Params, name: &'static str, default: f32) -> SpectrumInput {
        self.spectrum_input(p, name, Role::Albedo).unwrap_or(SpectrumDesc::Constant(default).into())
    }

    pub(super) fn number(&mut self, p: &Params, name: &'static str, default: f32) -> FloatInput {
        self.float_input(p, name).unwrap_or(FloatInput::Constant(default))
    }

    fn roughness(&mut self, p: &Params, names: &RoughnessNames) -> Roughness {
        let u = self.float_input(p, names.u);
        let v = self.float_input(p, names.v);
        let both = if u.is_some() && v.is_some() {
            p.mention(names.both, &[Type::Float, Type::Texture]);
            None
        } else {
            self.float_input(p, names.both)
        };
        for name in [names.u, names.v, names.both] {
            if let Some(bad) = p.find(name, &[Type::Float]).filter(|q| q.floats().iter().any(|x| *x < 0.0)) {
                let message = format!("\"{name}\" is {}", bad.floats()[0]);
                self.report.error(bad.span, message).hint("it must not be negative");
            }
        }
        let both = both.unwrap_or(FloatInput::Constant(0.0));
        let remap = p.boolean("remaproughness", true, self.report);
        Roughness::new(u.unwrap_or_else(|| both.clone()), v.unwrap_or(both), remap)
    }

    /// η and k, or a reflectance; copper if nothing is said.
    pub(super) fn conductor(&mut self, p: &Params, eta: &'static str, k: &'static str) -> ConductorSpectrum {
        let eta = self.spectrum_input(p, eta, Role::Unbounded);
        let k = self.spectrum_input(p, k, Role::Unbounded);
        if let Some(reflectance) = self.spectrum_input(p, "reflectance", Role::Albedo) {
            if eta.is_some() || k.is_some() {
                let at = p.span_of("reflectance").unwrap_or_default();
                self.report
                    .error(at, "a conductor has both \"reflectance\" and \"eta\" or \"k\"")
                    .hint("give either the one or the others");
            }
            return ConductorSpectrum::Reflectance(reflectance);
        }
        let copper = |part: &str| SpectrumDesc::Named(format!("metal-Cu-{part}")).into();
        ConductorSpectrum::EtaK { eta: eta.unwrap_or(copper("eta")), k: k.unwrap_or(copper("k")) }
    }

    fn coated_diffuse(&mut self, p: &Params) -> MaterialKind {
        MaterialKind::CoatedDiffuse {
            reflectance: self.albedo(p, "reflectance", 0.5),
            roughness: self.roughness(p, &PLAIN),
            thickness: self.number(p, "thickness", 0.01),
            eta: self.ior(p, "eta", 1.5),
            g: self.number(p, "g", 0.0),
            albedo: self.albedo(p, "albedo", 0.0),
            max_depth: p.count("maxdepth", 10, 1..=1 << 16, self.report),
            n_samples: p.count("nsamples", 1, 1..=1 << 16, self.report),
        }
    }

    fn coated_conductor(&mut self, p: &Params) -> MaterialKind {
        MaterialKind::CoatedConductor {
            interface_roughness: self.roughness(p, &INTERFACE),
            thickness: self.number(p, "thickness", 0.01),
            interface_eta: self.ior(p, "interface.eta", 1.5),
            conductor: self.conductor(p, "conductor.eta", "conductor.k"),
            conductor_roughness: self.roughness(p, &CONDUCTOR),
            g: self.number(p, "g", 0.0),
            albedo: self.albedo(p, "albedo", 0.0),
            max_depth: p.count("maxdepth", 10, 1..=1 << 16, self.report),
            n_samples: p.count("nsamples", 1, 1..=1 << 16, self.report),
        }
    }

    /// What colours it: the first that is given of absorption, reflectance and pigment; brown if nothing is said.
    fn hair(&mut self, p: &Params) -> MaterialKind {
        let sigma_a = self.spectrum_input(p, "sigma_a", Role::Unbounded);
        let reflectance = match self.spectrum_input(p, "reflectance", Role::Albedo) {
            Some(r) => Some(r),
            None => self.spectrum_input(p, "color", Role::Albedo),
        };
        let eumelanin = self.float_input(p, "eumelanin");
        let pheomelanin = self.float_input(p, "pheomelanin");
        let color = match (sigma_a, reflectance) {
            (Some(sigma_a), _) => HairColor::Absorption(sigma_a),
            (None, Some(reflectance)) => HairColor::Reflectance(reflectance),
            (None, None) => {
                let brown = if pheomelanin.is_none() { 1.3 } else { 0.0 };
                HairColor::Melanin {
                    eumelanin: eumelanin.unwrap_or(brown.into()),
                    pheomelanin: pheomelanin.unwrap_or(0.0.into()),
                }
            }
        };
        MaterialKind::Hair {
            color,
            eta: p.float("eta", 1.55, self.report),
            beta_m: self.number(p, "beta_m", 0.3),
            beta_n: self.number(p, "beta_n", 0.3),
            alpha: self.number(p, "alpha", 2.0),
        }
    }

    fn subsurface(&mut self, entity: &Entity) -> Option<MaterialKind> {
        let p = &entity.params;
        let name = p.string_opt("name", self.report).map(|n| n.0).filter(|n| !n.is_empty());
        let profile = if let Some(name) = name {
            SubsurfaceProfile::Named(name)
        } else {
            let sigma_a = self.spectrum_input(p, "sigma_a", Role::Unbounded);
            let sigma_s = self.spectrum_input(p, "sigma_s", Role::Unbounded);
            match (sigma_a, sigma_s) {
                (Some(sigma_a), Some(sigma_s)) => SubsurfaceProfile::Coefficients { sigma_a, sigma_s },
                (None, None) => match self.spectrum_input(p, "reflectance", Role::Albedo) {
                    Some(reflectance) => {
                        let mfp = self.spectrum_input(p, "mfp", Role::Unbounded);
                        let mfp = mfp.unwrap_or(SpectrumDesc::Constant(1.0).into());
                        SubsurfaceProfile::Reflectance { reflectance, mfp }
                    }
                    // Whole milk [Jensen2001].
                    None => SubsurfaceProfile::Coefficients {
                        sigma_a: SpectrumDesc::srgb([0.0011, 0.0024, 0.014]).into(),
                        sigma_s: SpectrumDesc::srgb([2.55, 3.21, 3.77]).into(),
                    },
                },
                (Some(_), None) | (None, Some(_)) => {
                    let message = "\"sigma_a\" and \"sigma_s\" come together";
                    return self.refuse(entity.span, message, "give both or none");
                }
            }
        };
        // What stands in for it is said by the compiler, which makes it.
        Some(MaterialKind::Subsurface {
            profile,
            scale: p.float("scale", 1.0, self.report),
            g: p.float("g", 0.0, self.report),
            eta: p.float("eta", 1.33, self.report),
            roughness: self.roughness(p, &PLAIN),
            method: self.subsurface_method(p),
        })
    }

    /// How light gets about below a surface, which pbrt does not ask.
    pub(super) fn subsurface_method(&mut self, p: &Params) -> SubsurfaceMethod {
        match p.string_opt("method", self.report) {
            Some((name, _)) if name == "separable" => SubsurfaceMethod::Separable,
            Some((name, span)) if name != "walk" => {
                let message = format!("\"method\" is \"{name}\"");
                self.report.error(span, message).hint("expected \"walk\" or \"separable\"");
                SubsurfaceMethod::Walk
            }
            Some(_) | None => SubsurfaceMethod::Walk,
        }
    }

    fn mix(&mut self, entity: &Entity) -> Option<MaterialKind> {
        let p = &entity.params;
        let Some(param) = p.find("materials", &[Type::String]) else {
            let hint = "add \"string materials\" [ \"a\" \"b\" ]";
            return self.refuse(entity.span, "material \"mix\" has no \"materials\"", hint);
        };
        let [a, b] = param.strings() else {
            let message = format!("\"materials\" has {} names", param.strings().len());
            return self.refuse(param.span, message, "it takes two");
        };
        let mut id = |name: &String| {
            let found = self.named_materials.get(name).copied();
            if found.is_none() {
                let known: Vec<_> = self.named_materials.keys().cloned().collect();
                self.unknown("named material (so far)", name, param.span, known.iter());
            }
            found
        };
        let (a, b) = (id(a), id(b));
        let amount = self.number(p, "amount", 0.5);
        Some(MaterialKind::Mix { materials: [a?, b?], amount })
    }
}
