//! From the materials of a description to their parameters' handles.

use rayon::prelude::*;
use scatter::{Bsdf, CoatProfiles};
use scene_desc::{
    ConductorSpectrum, FloatInput, IndexOfRefraction, MaterialDesc, MaterialKind, Roughness, SceneDesc, Span,
    SpectrumDesc, SpectrumInput, SubsurfaceProfile,
};
use spectrum::{ColorMode, Spectrum, Wavelengths};

use super::metal::rgb_metal;
use super::subsurface::{effective_albedo, measured, names};
use super::surface::{Alpha, Base, Eta, Layer, Lookup, Metal, Surface};
use super::{Material, Materials, Relief};
use crate::textures::{FloatHandle, SpectrumHandle, SpectrumRole, TextureCompiler, Textures, spectral_curve};
use crate::{Footprint, MaterialId, TextureContext};

impl Materials {
    /// Compiles all materials of a scene; their ids stay. Inputs that make no sense are reported to the compiler's
    /// sink.
    #[must_use]
    pub fn compile(scene: &SceneDesc, textures: &mut TextureCompiler<'_>) -> Self {
        let black = MaterialId(u32::try_from(scene.materials.len()).unwrap_or(u32::MAX));
        let mut compiler = Compiler { textures, black, profiles: Vec::new(), dispersive: Vec::new() };
        let mut list: Vec<Material> = scene.materials.iter().map(|m| compiler.material(m)).collect();
        list.push(Material::black());
        compiler.check_mixtures(scene, &mut list);
        compiler.report_dispersion();

        // Tabulating takes milliseconds each.
        let profiles: Vec<CoatProfiles> = compiler
            .profiles
            .par_iter()
            .map(|&[eta, thickness, lo, hi]| CoatProfiles::new(eta, thickness, [lo, hi]))
            .collect();

        // In RGB mode a surface that does not vary has one BSDF.
        let colors = textures.colors();
        if colors.mode == ColorMode::Rgb {
            let nowhere = Textures::none(colors);
            for material in &mut list {
                material.constant = uniform_bsdf(&material.surface, &nowhere, &profiles);
            }
        }
        Self { list, profiles }
    }
}

impl Material {
    fn black() -> Self {
        let reflectance = SpectrumHandle::Constant(spectrum::SpectrumValue::ZERO);
        Self { surface: Surface::Diffuse { reflectance }, relief: Relief::None, constant: None }
    }
}

/// The BSDF of a surface that is the same everywhere, in RGB mode.
fn uniform_bsdf(surface: &Surface, nowhere: &Textures, profiles: &[CoatProfiles]) -> Option<Bsdf> {
    if !surface.is_uniform() {
        return None;
    }
    let ctx = TextureContext {
        p: math::Point::default(),
        n: math::Dir::Z,
        uv: math::Vec2::ZERO,
        footprint: Footprint::default(),
    };
    surface.bsdf(&mut Lookup { textures: nowhere, ctx: &ctx, wl: &mut Wavelengths::RGB.clone() }, profiles)
}

struct Compiler<'a, 'b> {
    textures: &'a mut TextureCompiler<'b>,
    /// What is on the side that no material was given for: after those of the scene.
    black: MaterialId,
    /// Keys of the coats to tabulate, each once.
    profiles: Vec<[f32; 4]>,
    /// Where indices that depend on wavelength were averaged.
    dispersive: Vec<Span>,
}

impl Compiler<'_, '_> {
    fn material(&mut self, desc: &MaterialDesc) -> Material {
        let span = desc.span;
        let surface = self.surface(&desc.kind, span);
        let relief = match (&desc.displacement, desc.normal_map) {
            (Some(height), _) => match self.textures.float(height, span) {
                FloatHandle::Constant(_) => Relief::None,
                texture @ FloatHandle::Texture(_) => Relief::Bump(texture),
            },
            (None, Some(image)) => {
                self.textures.use_image(image);
                Relief::NormalMap(image)
            }
            (None, None) => Relief::None,
        };
        Material { surface, relief, constant: None }
    }

    fn surface(&mut self, kind: &MaterialKind, span: Span) -> Surface {
        match kind {
            MaterialKind::Diffuse { reflectance } => {
                Surface::Diffuse { reflectance: self.albedo(reflectance, span) }
            }
            MaterialKind::DiffuseTransmission { reflectance, transmittance, scale } => {
                Surface::DiffuseTransmission {
                    reflectance: self.albedo(reflectance, span),
                    transmittance: self.albedo(transmittance, span),
                    scale: *scale,
                }
            }
            MaterialKind::Conductor { spectrum, roughness, .. } => {
                Surface::Conductor { metal: self.metal(spectrum, span), alpha: self.alpha(roughness, span) }
            }
            MaterialKind::Dielectric { eta, roughness, .. } => {
                Surface::Dielectric { eta: self.eta(eta, span), alpha: self.alpha(roughness, span) }
            }
            MaterialKind::ThinDielectric { eta, .. } => Surface::ThinDielectric { eta: self.eta(eta, span) },
            MaterialKind::CoatedDiffuse { reflectance, .. } => {
                let base = Base::Albedo(self.albedo(reflectance, span));
                self.coated(kind, span, |coat| Surface::CoatedDiffuse { base, coat })
            }
            MaterialKind::CoatedConductor { conductor, conductor_roughness, .. } => {
                let (metal, alpha) = (self.metal(conductor, span), self.alpha(conductor_roughness, span));
                self.coated(kind, span, |coat| Surface::CoatedConductor { metal, alpha, coat })
            }
            MaterialKind::Mix { materials, amount } => Surface::Mix {
                materials: materials.map(|id| MaterialId(id.0)),
                amount: self.textures.float(amount, span),
            },
            MaterialKind::TwoSided { front, back } => Surface::TwoSided {
                front: MaterialId(front.0),
                back: back.map_or(self.black, |id| MaterialId(id.0)),
            },
            MaterialKind::Interface => Surface::Interface,
            MaterialKind::OrenNayar { reflectance, .. } | MaterialKind::Plastic { reflectance, .. } => {
                self.stand_in(reflectance, span)
            }
            MaterialKind::Principled(p) => self.stand_in(&p.base_color, span),
            MaterialKind::MetallicRoughness(p) => self.stand_in(&p.base_color, span),
            MaterialKind::Hair { .. } | MaterialKind::Measured { .. } => {
                self.stand_in(&SpectrumDesc::Constant(0.5).into(), span)
            }
            MaterialKind::Subsurface { profile, scale: _, g, eta, roughness } => {
                self.subsurface(profile, *g, (*eta, roughness), span)
            }
        }
    }

    fn stand_in(&mut self, reflectance: &SpectrumInput, span: Span) -> Surface {
        self.textures
            .sink()
            .warning(span, "this material is not supported yet")
            .hint("a diffuse surface stands in for it");
        Surface::Diffuse { reflectance: self.albedo(reflectance, span) }
    }

    fn albedo(&mut self, input: &SpectrumInput, span: Span) -> SpectrumHandle {
        self.textures.spectrum(input, SpectrumRole::Albedo, span)
    }

    fn alpha(&mut self, roughness: &Roughness, span: Span) -> Alpha {
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
        Alpha { u, v, remap: roughness.remap }
    }

    fn eta(&mut self, eta: &IndexOfRefraction, span: Span) -> Eta {
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

    fn metal(&mut self, desc: &ConductorSpectrum, span: Span) -> Metal {
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

    /// The coat of a coated material, around what `make` puts under it.
    fn coated(
        &mut self,
        kind: &MaterialKind,
        span: Span,
        make: impl FnOnce(Box<Layer>) -> Surface,
    ) -> Surface {
        let (MaterialKind::CoatedDiffuse {
            roughness, eta, thickness, g, albedo, max_depth, n_samples, ..
        }
        | MaterialKind::CoatedConductor {
            interface_roughness: roughness,
            interface_eta: eta,
            thickness,
            g,
            albedo,
            max_depth,
            n_samples,
            ..
        }) = kind
        else {
            return Surface::Interface;
        };
        // A coat without a medium does not absorb, however thick it is (docs/decisions/0011).
        let albedo = self.albedo(albedo, span);
        let thickness = match &albedo {
            SpectrumHandle::Constant(a) if a.is_black() => FloatHandle::Constant(0.0),
            SpectrumHandle::Constant(_) | SpectrumHandle::Texture(_) => self.textures.float(thickness, span),
        };
        let coat = Layer {
            eta: self.eta(eta, span),
            alpha: self.alpha(roughness, span),
            thickness,
            g: self.textures.float(g, span),
            albedo,
            max_depth: u16::try_from(*max_depth).unwrap_or(u16::MAX),
            n_samples: u16::try_from(*n_samples).unwrap_or(u16::MAX).max(1),
            profiles: None,
        };
        let mut surface = make(Box::new(coat));
        if let Surface::CoatedDiffuse { coat, .. } = &mut surface {
            coat.profiles = coat.profile_key().map(|key| self.profile(key));
        }
        surface
    }

    /// The index of a coat's tables.
    fn profile(&mut self, key: [f32; 4]) -> usize {
        self.profiles.iter().position(|k| *k == key).unwrap_or_else(|| {
            self.profiles.push(key);
            self.profiles.len() - 1
        })
    }

    fn subsurface(
        &mut self,
        profile: &SubsurfaceProfile,
        g: f32,
        (eta, roughness): (f32, &Roughness),
        span: Span,
    ) -> Surface {
        self.textures
            .sink()
            .warning(span, "subsurface scattering is not supported yet")
            .hint("rendered as a coated diffuse surface of about the same albedo");
        let base = match profile {
            SubsurfaceProfile::Reflectance { reflectance, .. } => {
                Base::Albedo(self.albedo(reflectance, span))
            }
            SubsurfaceProfile::Coefficients { sigma_a, sigma_s } => {
                let mut handle = |input| self.textures.spectrum(input, SpectrumRole::Unbounded, span);
                Base::Subsurface { sigma_a: handle(sigma_a), sigma_s: handle(sigma_s), g }
            }
            SubsurfaceProfile::Named(name) => {
                let albedo = measured(name).unwrap_or_else(|| {
                    let known: Vec<_> = names().collect();
                    self.textures
                        .sink()
                        .warning(span, format!("no subsurface material is named \"{name}\""))
                        .hint(format!("rendered grey; known names: {}", known.join(", ")));
                    [[1.0; 3]; 2]
                });
                // Scattering is measured reduced: isotropic.
                let [a, s] = albedo.map(Spectrum::from_rgb);
                let rgb = effective_albedo(a, s, 0.0).rgb();
                Base::Albedo(self.albedo(&SpectrumDesc::srgb(rgb).into(), span))
            }
        };
        let coated = MaterialKind::CoatedDiffuse {
            reflectance: SpectrumDesc::Constant(0.0).into(),
            roughness: roughness.clone(),
            thickness: 0.0.into(),
            eta: IndexOfRefraction::Constant(eta),
            g: 0.0.into(),
            albedo: SpectrumDesc::Constant(0.0).into(),
            max_depth: 100,
            n_samples: 1,
        };
        self.coated(&coated, span, |coat| Surface::CoatedDiffuse { base, coat })
    }

    /// Mixtures of what is not there or of themselves become a medium's border, and an error.
    fn check_mixtures(&mut self, scene: &SceneDesc, list: &mut [Material]) {
        for i in 0..scene.materials.len() {
            if let Err(problem) = mixture_depth(list, i, 0) {
                self.textures.sink().error(scene.materials[i].span, problem);
                list[i].surface = Surface::Interface;
            }
        }
    }

    fn report_dispersion(&mut self) {
        let n = self.dispersive.len();
        if let Some(&first) = self.dispersive.first() {
            self.textures
                .sink()
                .warning(
                    first,
                    format!("dispersion needs spectral mode: {n} refractive indices are averaged"),
                )
                .hint("render with --spectral to see it");
        }
    }
}

/// Follows the mixtures below material `i`.
fn mixture_depth(list: &[Material], i: usize, depth: usize) -> Result<(), String> {
    let Some(material) = list.get(i) else { return Err(format!("there is no material {i} to mix")) };
    let parts = match &material.surface {
        Surface::Mix { materials: parts, .. } => *parts,
        Surface::TwoSided { front, back } => [*front, *back],
        Surface::Diffuse { .. }
        | Surface::DiffuseTransmission { .. }
        | Surface::Conductor { .. }
        | Surface::Dielectric { .. }
        | Surface::ThinDielectric { .. }
        | Surface::CoatedDiffuse { .. }
        | Surface::CoatedConductor { .. }
        | Surface::Interface => return Ok(()),
    };
    if depth > list.len() {
        return Err("a material that is a mixture of itself".into());
    }
    parts.iter().try_for_each(|m| mixture_depth(list, m.index(), depth + 1))
}

/// A spectrum in the proper sense, rather than a colour?
fn is_curve(desc: &SpectrumDesc) -> bool {
    match desc {
        SpectrumDesc::Named(_) | SpectrumDesc::Curve(_) | SpectrumDesc::Blackbody(_) => true,
        SpectrumDesc::Constant(_) | SpectrumDesc::Rgb { .. } => false,
    }
}
