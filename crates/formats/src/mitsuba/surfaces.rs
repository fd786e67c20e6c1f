//! BSDFs that are surfaces by themselves, with Mitsuba's defaults.

use scene_desc::{
    ConductorSpectrum, Distribution, FloatInput, HairColor, IndexOfRefraction, Masking, MaterialKind,
    PrincipledDesc, Roughness, SpectrumDesc, ThinSheet, Tint,
};

use super::bsdfs::Look;
use super::build::Build;
use super::text;
use super::tree::{Class, Node, Value};
use crate::{resources, suggest};

impl<'t> Build<'t, '_, '_> {
    /// The look of a surface; `None` if there is no such BSDF.
    pub(super) fn surface(&mut self, node: &'t Node) -> Option<Look> {
        let (kind, one_sided) = match node.kind.as_str() {
            "diffuse" => {
                (MaterialKind::Diffuse { reflectance: self.spectrum_input(node, "reflectance", 0.5) }, true)
            }
            "roughdiffuse" => {
                // Version 0.x: alpha is √2 times the standard deviation of the slopes.
                let alpha = self.float(node, "alpha", 0.2);
                node.accept(&["use_fast_approx"]);
                let sigma = (alpha * std::f32::consts::FRAC_1_SQRT_2).to_degrees().into();
                (
                    MaterialKind::OrenNayar {
                        reflectance: self.spectrum_input(node, "reflectance", 0.5),
                        sigma,
                    },
                    true,
                )
            }
            "difftrans" => {
                let transmittance = self.spectrum_input(node, "transmittance", 0.5);
                let reflectance = SpectrumDesc::Constant(0.0).into();
                (MaterialKind::DiffuseTransmission { reflectance, transmittance, scale: 1.0 }, false)
            }
            "conductor" | "roughconductor" => (self.conductor(node), true),
            "dielectric" | "roughdielectric" => {
                let eta = self.eta(node, "bk7");
                let roughness = self.roughness(node);
                (MaterialKind::Dielectric { eta, roughness, tint: self.tint(node) }, false)
            }
            "thindielectric" => {
                let eta = self.eta(node, "bk7");
                let tint = self.tint(node);
                // Its integrators of volumes take what goes straight on for no event.
                let is_volume = |n: &Node| n.class == Class::Integrator && n.kind.starts_with("volpath");
                let passes = tint == Tint::default() && self.tree.nodes.iter().any(is_volume);
                (MaterialKind::ThinDielectric { eta, tint, passes }, false)
            }
            "plastic" | "roughplastic" | "pplastic" => (self.plastic(node), true),
            "principled" => (self.principled(node), false),
            "principledthin" => (self.principled_thin(node), false),
            "hair" => (self.hair(node), false),
            "measured" => (self.measured(node)?, true),
            "phong" | "ward" | "hk" | "irawan" | "measured_polarized" => {
                let reflectance = self.spectrum_input(node, "diffuse_reflectance", 0.5);
                self.unsupported(node, "a diffuse surface of its \"diffuse_reflectance\" stands in");
                (MaterialKind::Diffuse { reflectance }, true)
            }
            _ => return None,
        };
        Some(Look::of(kind, node, one_sided))
    }

    /// `int_ior` over `ext_ior`, each a number or a name.
    fn eta(&mut self, node: &Node, inside: &str) -> IndexOfRefraction {
        let inside = self.ior(node, "int_ior", inside);
        let outside = self.ior(node, "ext_ior", "air");
        let eta = inside / outside;
        if eta > 0.0 && eta.is_finite() {
            return IndexOfRefraction::Constant(eta);
        }
        self.report
            .error(node.span_of("int_ior"), format!("an index of {inside} within {outside}"))
            .hint("both must be above 0");
        IndexOfRefraction::Constant(1.5)
    }

    fn ior(&mut self, node: &Node, name: &'static str, default: &str) -> f32 {
        let named = match node.find(name).map(|p| &p.value) {
            Some(Value::Text(s)) => s.clone(),
            Some(_) => return self.float(node, name, 1.5),
            None => default.to_owned(),
        };
        self.named_ior(&named, node.span_of(name)).unwrap_or(1.5)
    }

    fn tint(&mut self, node: &'t Node) -> Tint {
        Tint {
            reflectance: self.spectrum_opt(node, "specular_reflectance"),
            transmittance: self.spectrum_opt(node, "specular_transmittance"),
        }
    }

    /// Width and kind of microfacets; smooth for plug-ins that are so.
    fn roughness(&mut self, node: &'t Node) -> Roughness {
        let is_rough = node.kind.starts_with("rough") || (node.kind == "pplastic" && node.has("alpha"));
        if !is_rough {
            return Roughness { remap: false, ..Roughness::smooth() };
        }
        let word = self.word(node, "distribution", &["beckmann", "ggx", "phong", "as"]);
        let distribution = match word {
            "ggx" => Distribution::Ggx,
            "beckmann" => Distribution::Beckmann,
            other => {
                self.report
                    .warning(
                        node.span_of("distribution"),
                        format!("distribution \"{other}\" is not supported"),
                    )
                    .hint("\"beckmann\" is used");
                Distribution::Beckmann
            }
        };
        node.accept(&["sample_visible"]);
        let both = node.has("alpha_u") || node.has("alpha_v");
        let (u, v) = if both {
            (self.float_input(node, "alpha_u", 0.1), self.float_input(node, "alpha_v", 0.1))
        } else {
            let alpha = self.float_input(node, "alpha", 0.1);
            (alpha.clone(), alpha)
        };
        for alpha in [&u, &v] {
            if let FloatInput::Constant(a) = alpha
                && *a < 0.0
            {
                let at = node.span_of("alpha");
                self.report.error(at, format!("\"alpha\" is {a}")).hint("it must not be negative");
            }
        }
        Roughness { distribution, masking: Masking::Separable, ..Roughness::new(u, v, false) }
    }

    fn conductor(&mut self, node: &'t Node) -> MaterialKind {
        let roughness = self.roughness(node);
        let tint = self.tint(node);
        let material = self.string(node, "material");
        let constant = |x: f32| SpectrumDesc::Constant(x).into();
        let (eta, k) = if node.has("eta") || node.has("k") {
            if material.as_deref().is_some_and(|m| m != "none") {
                let at = node.span_of("material");
                self.report.error(at, "\"material\" and \"eta\" both say what it is").hint("take one out");
            }
            let eta = self.spectrum_opt(node, "eta").unwrap_or_else(|| constant(0.0));
            (eta, self.spectrum_opt(node, "k").unwrap_or_else(|| constant(1.0)))
        } else {
            match material.as_deref().unwrap_or("Cu") {
                "none" => (constant(0.0), constant(1.0)),
                name => {
                    let name = self.metal(name, node);
                    let of = |part: &str| SpectrumDesc::Named(format!("metal-{name}-{part}")).into();
                    (of("eta"), of("k"))
                }
            }
        };
        self.external(node);
        MaterialKind::Conductor { spectrum: ConductorSpectrum::EtaK { eta, k }, roughness, tint }
    }

    /// Version 0.x has metals in other media than vacuum.
    fn external(&mut self, node: &Node) {
        if node.has("ext_eta") {
            let at = node.span_of("ext_eta");
            node.accept(&["ext_eta"]);
            self.report.warning(at, "\"ext_eta\" of a metal is not supported").hint("vacuum is around it");
        }
    }

    /// Our name of a metal.
    fn metal(&mut self, name: &str, node: &Node) -> String {
        let names = spectrum::spectrum_names();
        let is_known = |name: &str| names.iter().any(|n| *n == format!("metal-{name}-eta"));
        let plain = name.strip_suffix("_palik").unwrap_or(name);
        if is_known(plain) {
            return plain.to_owned();
        }
        let at = node.span_of("material");
        if MITSUBA_METALS.contains(&plain) {
            self.report
                .warning(at, format!("the metal \"{}\" is not among ours", text::show(name)))
                .hint("copper stands in: give its \"eta\" and \"k\" as spectra");
        } else {
            let known: Vec<_> =
                names.iter().filter_map(|n| n.strip_prefix("metal-")?.strip_suffix("-eta")).collect();
            self.report
                .error(at, format!("no metal \"{}\" is known", text::show(name)))
                .hint(suggest::hint(plain, &known));
        }
        "Cu".to_owned()
    }

    fn plastic(&mut self, node: &'t Node) -> MaterialKind {
        let roughness = self.roughness(node);
        let eta = self.eta(node, "polypropylene");
        let tint = Tint { reflectance: self.spectrum_opt(node, "specular_reflectance"), transmittance: None };
        let nonlinear = self.boolean(node, "nonlinear", false);
        let reflectance = self.spectrum_input(node, "diffuse_reflectance", 0.5);
        MaterialKind::Plastic { reflectance, eta, roughness, tint, nonlinear }
    }

    fn principled(&mut self, node: &'t Node) -> MaterialKind {
        let eta = match self.float_opt(node, "eta") {
            Some(eta) => eta,
            None => {
                let specular = self.float(node, "specular", 0.5).max(1e-3);
                2.0 / (1.0 - (0.08 * specular).sqrt()) - 1.0
            }
        };
        node.accept(&[
            "main_specular_sampling_rate",
            "clearcoat_sampling_rate",
            "diffuse_reflectance_sampling_rate",
        ]);
        let desc = PrincipledDesc {
            metallic: self.float_input(node, "metallic", 0.0),
            flatness: self.float_input(node, "flatness", 0.0),
            clearcoat: self.float_input(node, "clearcoat", 0.0),
            clearcoat_gloss: self.float_input(node, "clearcoat_gloss", 0.0),
            clearcoat_of_facets: false,
            ..self.principled_common(node, eta)
        };
        MaterialKind::Principled(Box::new(desc))
    }

    fn principled_thin(&mut self, node: &'t Node) -> MaterialKind {
        let eta = self.float(node, "eta", 1.5);
        node.accept(&[
            "spec_reflectance_sampling_rate",
            "spec_transmittance_sampling_rate",
            "diffuse_transmittance_sampling_rate",
            "diffuse_reflectance_sampling_rate",
        ]);
        let desc = PrincipledDesc {
            flatness: self.float_input(node, "flatness", 0.0),
            thin: Some(ThinSheet { diff_trans: self.float_input(node, "diff_trans", 0.0) }),
            ..self.principled_common(node, eta)
        };
        MaterialKind::Principled(Box::new(desc))
    }

    fn principled_common(&mut self, node: &'t Node, eta: f32) -> PrincipledDesc {
        // An index of one bends nothing, and Mitsuba avoids it.
        let eta = if eta == 1.0 { 1.001 } else { eta };
        PrincipledDesc {
            base_color: self.spectrum_input(node, "base_color", 0.5),
            roughness: self.float_input(node, "roughness", 0.5),
            anisotropic: self.float_input(node, "anisotropic", 0.0),
            eta: IndexOfRefraction::Constant(eta),
            spec_tint: self.float_input(node, "spec_tint", 0.0),
            spec_trans: self.float_input(node, "spec_trans", 0.0),
            sheen: self.float_input(node, "sheen", 0.0),
            sheen_tint: self.float_input(node, "sheen_tint", 0.0),
            ..PrincipledDesc::default()
        }
    }

    fn hair(&mut self, node: &'t Node) -> MaterialKind {
        let color = match self.spectrum_opt(node, "sigma_a") {
            Some(sigma_a) => HairColor::Absorption(sigma_a),
            None => HairColor::Melanin {
                eumelanin: self.float_input(node, "eumelanin", 1.3),
                pheomelanin: self.float_input(node, "pheomelanin", 0.2),
            },
        };
        let inside = self.ior(node, "int_ior", "amber");
        let outside = self.ior(node, "ext_ior", "air");
        MaterialKind::Hair {
            color,
            eta: inside / outside,
            beta_m: self.float_input(node, "longitudinal_roughness", 0.3),
            beta_n: self.float_input(node, "azimuthal_roughness", 0.3),
            alpha: self.float_input(node, "scale_tilt", 2.0),
        }
    }

    fn measured(&mut self, node: &'t Node) -> Option<MaterialKind> {
        node.accept(&["wavelength"]);
        let Some(name) = self.string(node, "filename") else {
            self.report.error(node.span, "bsdf \"measured\" has no \"filename\"").hint("it is a .bsdf file");
            return Some(MaterialKind::default_diffuse());
        };
        let path = node.resolve(&name);
        self.hashes.extend(resources::hash_measured(&path, node.span_of("filename"), self.report));
        Some(MaterialKind::Measured { path })
    }
}

/// Conductors that Mitsuba has and we may not.
const MITSUBA_METALS: [&str; 16] = [
    "AlAs", "Cu2O", "CuO", "HgTe", "Na", "Se", "Se-e", "SnTe", "ThF4", "Be", "Hg", "Ni", "W", "MgO", "Mo",
    "Rh",
];
