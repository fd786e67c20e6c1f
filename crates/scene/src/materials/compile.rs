//! From the materials of a description to their parameters' handles.

mod artist;
mod inputs;
mod subsurface;

use std::path::PathBuf;

use rayon::prelude::*;
use scatter::{Bsdf, CoatProfiles, ThinDielectric};
use scene_desc::{
    FloatInput, IndexOfRefraction, MaterialDesc, MaterialKind, Roughness, SceneDesc, Span, SpectrumInput,
    SubsurfaceMethod, Tint,
};
use spectrum::{ColorMode, Wavelengths};

use super::bump::NormalMap;
use super::look::{Look, PlasticLook};
use super::measured::MeasuredLook;
use super::parameters::{Base, Lookup, ProfileKey};
use super::subsurface::Interior;
use super::{Material, Materials, Relief, Surface, matt_ones};
use crate::MaterialId;
use crate::textures::{FloatHandle, SpectrumHandle, TextureCompiler};

impl Materials {
    /// Compiles all materials of a scene; their ids stay. Inputs that make no sense are reported to the compiler's
    /// sink.
    #[must_use]
    pub fn compile(scene: &SceneDesc, textures: &mut TextureCompiler<'_>) -> Self {
        let black = MaterialId(u32::try_from(scene.materials.len()).unwrap_or(u32::MAX));
        let mixed = mixed(scene);
        let (profiles, dispersive, interiors) = (Vec::new(), Vec::new(), Vec::new());
        let measured = Vec::new();
        let mut compiler = Compiler { textures, black, profiles, dispersive, mixed, interiors, measured };
        let mut list: Vec<Material> = scene.materials.iter().map(|m| compiler.material(m)).collect();
        list.push(Material::black());
        compiler.check_mixtures(scene, &mut list);
        compiler.report_dispersion();

        let interiors = std::mem::take(&mut compiler.interiors);

        // Tabulating takes milliseconds each.
        let profiles: Vec<CoatProfiles> = compiler
            .profiles
            .par_iter()
            .map(|k| CoatProfiles::new(k.eta, k.thickness, k.alpha, k.facets))
            .collect();

        // In RGB mode a surface that does not vary has one BSDF.
        let colors = textures.colors();
        if colors.mode == ColorMode::Rgb {
            for material in &mut list {
                material.constant = uniform_bsdf(&material.surface, &profiles);
            }
        }
        let has_diffusion = list.iter().any(|m| m.diffuser().is_some());
        let matt = matt_ones(&list);
        Self { list, profiles, interiors, has_diffusion, matt }
    }
}

impl Material {
    fn black() -> Self {
        let reflectance = SpectrumHandle::Constant(spectrum::SpectrumValue::ZERO);
        Self {
            surface: Surface::Look(Look::Diffuse { reflectance }),
            relief: Relief::None,
            constant: None,
            priority: None,
        }
    }
}

/// The BSDF of a surface that is the same everywhere, in RGB mode.
fn uniform_bsdf(surface: &Surface, profiles: &[CoatProfiles]) -> Option<Bsdf> {
    let Surface::Look(look) = surface else { return None };
    let mut wl = Wavelengths::RGB;
    let mut nowhere = Lookup::nowhere(&mut wl);
    let bsdf = look.bsdf(&mut nowhere, profiles);
    (!nowhere.varies() && look.rotation().is_none()).then_some(bsdf)
}

/// A coat, as described.
struct CoatParts<'a> {
    eta: &'a IndexOfRefraction,
    roughness: &'a Roughness,
    thickness: &'a FloatInput,
    g: &'a FloatInput,
    albedo: &'a SpectrumInput,
    /// Events of a walk, walks of an evaluation.
    limits: [u32; 2],
}

struct Compiler<'a, 'b> {
    textures: &'a mut TextureCompiler<'b>,
    /// What is on the side that no material was given for: after those of the scene.
    black: MaterialId,
    /// Keys of the coats to tabulate, each once.
    profiles: Vec<ProfileKey>,
    /// Where indices that depend on wavelength were averaged.
    dispersive: Vec<Span>,
    /// Materials that others are made of.
    mixed: Vec<bool>,
    /// What is under the surfaces of the materials so far.
    interiors: Vec<Option<Interior>>,
    /// Tables of measured surfaces.
    measured: Vec<(PathBuf, MeasuredLook)>,
}

impl Compiler<'_, '_> {
    fn material(&mut self, desc: &MaterialDesc) -> Material {
        let span = desc.span;
        let interior = self.interior(&desc.kind, span);
        let surface = match (&desc.kind, &interior) {
            (MaterialKind::Subsurface { eta, roughness, .. }, Some(_)) => {
                let alpha = self.alpha(roughness, span);
                Surface::Look(Look::SoftBorder { eta: *eta, alpha, profile: None })
            }
            (MaterialKind::Subsurface { method: SubsurfaceMethod::Separable, .. }, None)
                if !self.is_mixed() =>
            {
                self.separable(&desc.kind, span)
            }
            (kind, _) => self.surface(kind, span),
        };
        self.interiors.push(interior);
        let relief = match (&desc.displacement, desc.normal_map) {
            (Some(height), _) => match self.textures.float(height, span) {
                FloatHandle::Constant(_) => Relief::None,
                texture @ FloatHandle::Texture(_) => Relief::Bump(texture),
            },
            (None, Some(image)) => {
                self.textures.use_image(image);
                let layout = &desc.normal_layout;
                Relief::NormalMap(NormalMap {
                    image,
                    mapping: self.textures.mapping(&layout.mapping),
                    wrap: layout.wrap,
                    strength: layout.strength,
                    follows_v: layout.follows_v,
                })
            }
            (None, None) => Relief::None,
        };
        let priority = self.priority(desc);
        Material { surface, relief, constant: None, priority }
    }

    #[allow(clippy::too_many_lines, reason = "one arm for each kind, none of which decides anything")]
    fn surface(&mut self, kind: &MaterialKind, span: Span) -> Surface {
        let id = |id: &scene_desc::MaterialId| MaterialId(id.0);
        Surface::Look(match kind {
            MaterialKind::Mix { materials, amount } => {
                let amount = self.textures.float(amount, span);
                return Surface::Mix { materials: materials.each_ref().map(id), amount };
            }
            MaterialKind::TwoSided { front, back } => {
                return Surface::TwoSided { front: id(front), back: back.as_ref().map_or(self.black, id) };
            }
            MaterialKind::Interface => return Surface::Interface,
            MaterialKind::Diffuse { reflectance } => {
                Look::Diffuse { reflectance: self.albedo(reflectance, span) }
            }
            MaterialKind::DiffuseTransmission { reflectance, transmittance, scale } => {
                Look::DiffuseTransmission {
                    reflectance: self.albedo(reflectance, span),
                    transmittance: self.albedo(transmittance, span),
                    scale: *scale,
                }
            }
            MaterialKind::OrenNayar { reflectance, sigma } => Look::OrenNayar {
                reflectance: self.albedo(reflectance, span),
                sigma_degrees: self.textures.float(sigma, span),
            },
            MaterialKind::Conductor { spectrum, roughness, tint } => Look::Conductor {
                metal: self.metal(spectrum, span),
                alpha: self.alpha(roughness, span),
                tint: self.tint(tint, span),
            },
            MaterialKind::Dielectric { roughness, .. } | MaterialKind::Plastic { roughness, .. }
                if roughness.compensate =>
            {
                self.textures
                    .sink()
                    .warning(span, "light between facets is compensated for in metals alone")
                    .hint(
                        "this surface is rendered with single scattering: a little darker where it is rough",
                    );
                return self.surface(&without_compensation(kind), span);
            }
            MaterialKind::Dielectric { eta, roughness, tint } => Look::Dielectric {
                eta: self.eta(eta, span),
                alpha: self.alpha(roughness, span),
                tint: self.tint(tint, span),
            },
            MaterialKind::ThinDielectric { eta: IndexOfRefraction::Constant(eta), tint, passes: true }
                if *tint == Tint::default() =>
            {
                return Surface::Pane(ThinDielectric::new(*eta));
            }
            MaterialKind::ThinDielectric { eta, tint, passes: _ } => {
                Look::ThinDielectric { eta: self.eta(eta, span), tint: self.tint(tint, span) }
            }
            MaterialKind::Plastic { reflectance, eta, roughness, tint, nonlinear } => {
                self.plastic((reflectance, eta, roughness, tint), *nonlinear, span)
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
                let limits = [*max_depth, *n_samples];
                let base = Base::Albedo(self.albedo(reflectance, span));
                self.coated_diffuse(base, &CoatParts { eta, roughness, thickness, g, albedo, limits }, span)
            }
            MaterialKind::CoatedConductor {
                interface_roughness: roughness,
                thickness,
                interface_eta: eta,
                conductor,
                conductor_roughness,
                g,
                albedo,
                max_depth,
                n_samples,
            } => {
                let limits = [*max_depth, *n_samples];
                Look::CoatedConductor {
                    metal: self.metal(conductor, span),
                    alpha: self.alpha(conductor_roughness, span),
                    coat: self.layer(&CoatParts { eta, roughness, thickness, g, albedo, limits }, span),
                }
            }
            MaterialKind::Principled(p) => self.principled(p, span),
            MaterialKind::MetallicRoughness(p) => self.metallic_roughness(p, span),
            MaterialKind::Hair { color, eta, beta_m, beta_n, alpha } => {
                self.hair(color, *eta, [beta_m, beta_n, alpha], span)
            }
            MaterialKind::Measured { path } => self.measured(path, span),
            MaterialKind::Subsurface { profile, scale: _, g, eta, roughness, method: _ } => {
                self.subsurface(profile, *g, (*eta, roughness), span)
            }
        })
    }

    fn coated_diffuse(&mut self, base: Base, coat: &CoatParts<'_>, span: Span) -> Look {
        let mut coat = self.layer(coat, span);
        coat.profiles = coat.profile_key().map(|key| self.profile(key));
        Look::CoatedDiffuse { base, coat }
    }

    fn plastic(
        &mut self,
        (reflectance, eta, roughness, tint): (&SpectrumInput, &IndexOfRefraction, &Roughness, &Tint),
        nonlinear: bool,
        span: Span,
    ) -> Look {
        let (eta, alpha) = (self.eta(eta, span), self.alpha(roughness, span));
        let profiles = eta.constant().map(|eta| {
            let range = alpha.constant().map_or([0.0, 1.0], |[u, v]| [(u * v).sqrt(); 2]);
            self.profile(ProfileKey { eta, thickness: 0.0, alpha: range, facets: alpha.kind() })
        });
        Look::Plastic(Box::new(PlasticLook {
            reflectance: self.albedo(reflectance, span),
            eta,
            alpha,
            tint: self.tint(tint, span),
            nonlinear,
            profiles,
        }))
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

/// Which materials are parts of others.
fn mixed(scene: &SceneDesc) -> Vec<bool> {
    let mut mixed = vec![false; scene.materials.len()];
    for material in &scene.materials {
        let parts = if let MaterialKind::Mix { materials: [a, b], .. } = &material.kind {
            [Some(*a), Some(*b)]
        } else if let MaterialKind::TwoSided { front, back } = &material.kind {
            [Some(*front), *back]
        } else {
            continue; // made of itself alone
        };
        for part in parts.into_iter().flatten() {
            if let Some(is_part) = mixed.get_mut(part.index()) {
                *is_part = true;
            }
        }
    }
    mixed
}

/// The same material, with single scattering at its facets.
fn without_compensation(kind: &MaterialKind) -> MaterialKind {
    let mut kind = kind.clone();
    if let MaterialKind::Dielectric { roughness, .. } | MaterialKind::Plastic { roughness, .. } = &mut kind {
        roughness.compensate = false;
    }
    kind
}

/// Follows the mixtures below material `i`.
fn mixture_depth(list: &[Material], i: usize, depth: usize) -> Result<(), String> {
    let Some(material) = list.get(i) else { return Err(format!("there is no material {i} to mix")) };
    let parts = match &material.surface {
        Surface::Mix { materials: parts, .. } => *parts,
        Surface::TwoSided { front, back } => [*front, *back],
        Surface::Look(_) | Surface::Pane(_) | Surface::Interface => return Ok(()),
    };
    if depth > list.len() {
        return Err("a material that is a mixture of itself".into());
    }
    parts.iter().try_for_each(|m| mixture_depth(list, m.index(), depth + 1))
}
