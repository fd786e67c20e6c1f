//! `MakeNamedMaterial`.

use scene_desc::{
    ConductorSpectrum, Distribution, HairColor, IndexOfRefraction, MaterialDesc, MaterialKind, NormalLayout,
    Roughness, Span, SpectrumInput, SubsurfaceMethod, SubsurfaceProfile, Tint,
};

use super::params::Params;
use super::{WriteError, Writer};

/// What goes before the names of a boundary's parameters.
const NO_PREFIX: &str = "";

impl Writer<'_, '_, '_> {
    pub(super) fn materials(&mut self) -> Result<(), WriteError> {
        for (i, material) in self.scene.materials.iter().enumerate() {
            let mut p = Params::default();
            let kind = self.material(&mut p, material)?;
            let has_surface = !matches!(kind, "mix" | "interface");
            if let (Some(id), true) = (material.normal_map, has_surface) {
                let name = self.image(id)?;
                p.string("normalmap", &name);
                let told =
                    NormalLayout { follows_v: material.normal_layout.follows_v, ..NormalLayout::default() };
                if material.normal_layout != told {
                    self.otherwise(
                        material.span,
                        "normal map with a strength or a mapping of its own",
                        "it is laid as the surface's coordinates are",
                    );
                }
            }
            if let (Some(height), true) = (&material.displacement, has_surface) {
                Self::float_input(&mut p, "displacement", height);
            }
            if let Some(priority) = material.priority {
                p.put("integer", "priority", &priority.to_string());
            }
            let name = format!("material-{i}");
            self.line(0, &format!("MakeNamedMaterial \"{name}\" \"string type\" \"{kind}\"{}", p.0));
        }
        Ok(())
    }

    #[allow(clippy::wildcard_enum_match_arm, reason = "the rest are surfaces, all named there")]
    fn material(&mut self, p: &mut Params, m: &MaterialDesc) -> Result<&'static str, WriteError> {
        let span = m.span;
        Ok(match &m.kind {
            // What is black from behind shows the same from both sides.
            MaterialKind::TwoSided { front, back } => {
                if back.is_some_and(|b| b != *front) {
                    self.otherwise(span, "surface that differs on its sides", "its front is written");
                }
                let front = &self.scene.materials[front.index()];
                if matches!(front.kind, MaterialKind::TwoSided { .. }) {
                    "interface"
                } else {
                    self.material(p, front)?
                }
            }
            MaterialKind::Measured { path } => {
                let bytes =
                    std::fs::read(path).map_err(|source| WriteError::Io { path: path.clone(), source })?;
                let own = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
                let name = self.file(&own, &bytes)?;
                p.string("filename", &name);
                "measured"
            }
            kind => self.surface(p, kind, span),
        })
    }

    #[allow(clippy::too_many_lines, reason = "one arm a kind")]
    fn surface(&mut self, p: &mut Params, kind: &MaterialKind, span: Span) -> &'static str {
        match kind {
            MaterialKind::Diffuse { reflectance } => {
                self.spectrum_input(p, "reflectance", reflectance, span);
                "diffuse"
            }
            MaterialKind::OrenNayar { reflectance, .. } => {
                self.otherwise(span, "Oren–Nayar surface", "a Lambertian one is written");
                self.spectrum_input(p, "reflectance", reflectance, span);
                "diffuse"
            }
            MaterialKind::DiffuseTransmission { reflectance, transmittance, scale } => {
                self.spectrum_input(p, "reflectance", reflectance, span);
                self.spectrum_input(p, "transmittance", transmittance, span);
                p.float_unless("scale", *scale, 1.0);
                "diffusetransmission"
            }
            MaterialKind::Conductor { spectrum, roughness, tint } => {
                self.tint(tint, span);
                self.conductor(p, NO_PREFIX, spectrum, span);
                self.roughness(p, NO_PREFIX, roughness, span);
                "conductor"
            }
            MaterialKind::Dielectric { eta, roughness, tint } => {
                self.tint(tint, span);
                self.eta(p, "eta", eta, span);
                self.roughness(p, NO_PREFIX, roughness, span);
                "dielectric"
            }
            MaterialKind::ThinDielectric { eta, tint, passes: _ } => {
                self.tint(tint, span);
                self.eta(p, "eta", eta, span);
                "thindielectric"
            }
            MaterialKind::Plastic { reflectance, eta, roughness, tint, .. } => {
                self.otherwise(
                    span,
                    "closed form of plastic",
                    "\"coateddiffuse\" is written, whose walk gives about the same",
                );
                self.tint(tint, span);
                self.spectrum_input(p, "reflectance", reflectance, span);
                self.eta(p, "eta", eta, span);
                self.roughness(p, NO_PREFIX, roughness, span);
                p.float("thickness", 0.0);
                "coateddiffuse"
            }
            MaterialKind::Principled(desc) => {
                self.otherwise(span, "principled surface", "\"coateddiffuse\" of its base colour is written");
                self.stand_in(p, &desc.base_color, &desc.roughness, span);
                "coateddiffuse"
            }
            MaterialKind::MetallicRoughness(desc) => {
                self.otherwise(
                    span,
                    "metallic-roughness surface",
                    "\"coateddiffuse\" of its base colour is written",
                );
                self.stand_in(p, &desc.base_color, &desc.roughness, span);
                "coateddiffuse"
            }
            MaterialKind::Hair { color, eta, beta_m, beta_n, alpha } => {
                match color {
                    HairColor::Absorption(s) => self.spectrum_input(p, "sigma_a", s, span),
                    HairColor::Reflectance(s) => self.spectrum_input(p, "reflectance", s, span),
                    HairColor::Melanin { eumelanin, pheomelanin } => {
                        Self::float_input(p, "eumelanin", eumelanin);
                        Self::float_input(p, "pheomelanin", pheomelanin);
                    }
                }
                p.float("eta", *eta);
                for (name, x) in [("beta_m", beta_m), ("beta_n", beta_n), ("alpha", alpha)] {
                    Self::float_input(p, name, x);
                }
                "hair"
            }
            MaterialKind::CoatedDiffuse {
                reflectance,
                roughness,
                thickness,
                eta,
                g,
                albedo,
                max_depth,
                n_samples,
            } => {
                self.spectrum_input(p, "reflectance", reflectance, span);
                self.roughness(p, NO_PREFIX, roughness, span);
                self.eta(p, "eta", eta, span);
                self.layer(p, (thickness, g, albedo), (*max_depth, *n_samples), span);
                "coateddiffuse"
            }
            MaterialKind::CoatedConductor {
                interface_roughness,
                thickness,
                interface_eta,
                conductor,
                conductor_roughness,
                g,
                albedo,
                max_depth,
                n_samples,
            } => {
                self.roughness(p, "interface.", interface_roughness, span);
                self.eta(p, "interface.eta", interface_eta, span);
                self.conductor(p, "conductor.", conductor, span);
                // One word says for both whether roughness is remapped.
                let both = Roughness { remap: interface_roughness.remap, ..conductor_roughness.clone() };
                let names = Self::roughness_names("conductor.");
                Self::float_input(p, &names[0], &both.u);
                Self::float_input(p, &names[1], &both.v);
                self.layer(p, (thickness, g, albedo), (*max_depth, *n_samples), span);
                "coatedconductor"
            }
            MaterialKind::Mix { materials: [a, b], amount } => {
                p.put("string", "materials", &format!("[ \"material-{}\" \"material-{}\" ]", a.0, b.0));
                Self::float_input(p, "amount", amount);
                "mix"
            }
            MaterialKind::Subsurface { profile, scale, g, eta, roughness, method } => {
                match profile {
                    SubsurfaceProfile::Named(name) => p.string("name", name),
                    SubsurfaceProfile::Coefficients { sigma_a, sigma_s } => {
                        self.spectrum_input(p, "sigma_a", sigma_a, span);
                        self.spectrum_input(p, "sigma_s", sigma_s, span);
                    }
                    SubsurfaceProfile::Reflectance { reflectance, mfp } => {
                        self.spectrum_input(p, "reflectance", reflectance, span);
                        self.spectrum_input(p, "mfp", mfp, span);
                    }
                }
                p.float("scale", *scale);
                p.float("g", *g);
                p.float("eta", *eta);
                self.roughness(p, NO_PREFIX, roughness, span);
                if *method == SubsurfaceMethod::Separable {
                    p.string("method", "separable");
                }
                "subsurface"
            }
            MaterialKind::Interface | MaterialKind::TwoSided { .. } | MaterialKind::Measured { .. } => {
                "interface"
            }
        }
    }

    fn stand_in(
        &mut self,
        p: &mut Params,
        color: &SpectrumInput,
        roughness: &scene_desc::FloatInput,
        span: Span,
    ) {
        self.spectrum_input(p, "reflectance", color, span);
        Self::float_input(p, "roughness", roughness);
    }

    fn layer(
        &mut self,
        p: &mut Params,
        (thickness, g, albedo): (&scene_desc::FloatInput, &scene_desc::FloatInput, &SpectrumInput),
        (max_depth, n_samples): (u32, u32),
        span: Span,
    ) {
        Self::float_input(p, "thickness", thickness);
        Self::float_input(p, "g", g);
        self.spectrum_input(p, "albedo", albedo, span);
        p.integer("maxdepth", max_depth);
        p.integer("nsamples", n_samples);
    }

    fn tint(&mut self, tint: &Tint, span: Span) {
        if tint.reflectance.is_some() || tint.transmittance.is_some() {
            self.otherwise(span, "factor on specular reflection", "it is left out");
        }
    }

    fn eta(&mut self, p: &mut Params, name: &str, eta: &IndexOfRefraction, span: Span) {
        match eta {
            IndexOfRefraction::Constant(x) => p.float(name, *x),
            IndexOfRefraction::Spectrum(desc) => self.spectrum(p, name, desc, span),
        }
    }

    fn conductor(&mut self, p: &mut Params, prefix: &str, spectrum: &ConductorSpectrum, span: Span) {
        match spectrum {
            ConductorSpectrum::EtaK { eta, k } => {
                self.spectrum_input(p, &format!("{prefix}eta"), eta, span);
                self.spectrum_input(p, &format!("{prefix}k"), k, span);
            }
            // Its name has no prefix.
            ConductorSpectrum::Reflectance(r) => self.spectrum_input(p, "reflectance", r, span),
        }
    }

    fn roughness_names(prefix: &str) -> [String; 2] {
        ["u", "v"].map(|axis| format!("{prefix}{axis}roughness"))
    }

    fn roughness(&mut self, p: &mut Params, prefix: &str, roughness: &Roughness, span: Span) {
        if roughness.distribution == Distribution::Beckmann && *roughness != smooth(roughness) {
            self.otherwise(span, "Beckmann distribution", "GGX is written, with longer tails");
        }
        let [u, v] = Self::roughness_names(prefix);
        Self::float_input(p, &u, &roughness.u);
        Self::float_input(p, &v, &roughness.v);
        if !roughness.remap {
            p.boolean("remaproughness", false);
        }
    }
}

fn smooth(like: &Roughness) -> Roughness {
    Roughness { u: 0.0.into(), v: 0.0.into(), ..like.clone() }
}
