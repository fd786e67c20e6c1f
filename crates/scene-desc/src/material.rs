//! Surfaces' looks.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    FloatInput, ImageId, Mapping2d, MaterialId, MetallicRoughnessDesc, PrincipledDesc, Span, SpectrumDesc,
    SpectrumInput, WrapMode,
};

/// A material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MaterialDesc {
    /// As the file names it; empty for an unnamed one.
    pub name: String,
    /// What it is.
    pub kind: MaterialKind,
    /// A tangent-space normal map.
    pub normal_map: Option<ImageId>,
    /// How that map is laid.
    #[serde(default)]
    pub normal_layout: NormalLayout,
    /// A height, in scene units, that bends shading normals.
    pub displacement: Option<FloatInput>,
    /// The chance that the surface is there at all, times that of its shape's `alpha`: masks and cut-outs.
    pub opacity: Option<FloatInput>,
    /// Its closed surfaces bound bodies that may overlap: where they do, the one of the highest priority fills the place,
    /// whatever else is there, and what has none yields to all that have one. For dielectrics (whose index is then over
    /// that of the body outside), subsurface materials and interfaces.
    #[serde(default)]
    pub priority: Option<i32>,
    /// Where it was written.
    #[serde(skip)]
    pub span: Span,
}

impl MaterialDesc {
    /// Of this kind, even, opaque, unnamed.
    #[must_use]
    pub fn new(kind: MaterialKind, span: Span) -> Self {
        Self {
            name: String::new(),
            kind,
            normal_map: None,
            normal_layout: NormalLayout::default(),
            displacement: None,
            opacity: None,
            priority: None,
            span,
        }
    }
}

/// How a map of normals lies on a surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct NormalLayout {
    /// From the surface's coordinates to the map's.
    pub mapping: Mapping2d,
    /// Beyond the map's borders, along s and along t.
    pub wrap: [WrapMode; 2],
    /// Factor on what the map's normals lean by.
    pub strength: f32,
    /// Does the map's second axis run along v, also where (u, v) are mirrored (glTF)? Else it is a quarter turn from the
    /// tangent everywhere (pbrt, Mitsuba).
    pub follows_v: bool,
}

impl Default for NormalLayout {
    fn default() -> Self {
        Self { mapping: Mapping2d::default(), wrap: [WrapMode::Repeat; 2], strength: 1.0, follows_v: false }
    }
}

/// How the normals of microfacets are distributed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Distribution {
    /// GGX (Trowbridge–Reitz), with long tails.
    #[default]
    Ggx,
    /// Beckmann's: slopes of a Gaussian.
    Beckmann,
}

/// How masking and shadowing of one facet depend on each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
pub enum Masking {
    /// By the heights of facets [Heitz2014], as in pbrt-v4.
    #[default]
    Correlated,
    /// Not at all, as in Mitsuba: a little darker.
    Separable,
}

/// Width of a microfacet distribution along u and v.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Roughness {
    /// Along u.
    pub u: FloatInput,
    /// Along v.
    pub v: FloatInput,
    /// `alpha = √roughness` (pbrt's remapping) rather than `alpha = roughness`?
    pub remap: bool,
    /// Of the normals.
    pub distribution: Distribution,
    /// Of facets by each other.
    pub masking: Masking,
    /// Give back the light that bounces between facets, which single scattering loses? No format's renderer does by
    /// default.
    pub compensate: bool,
}

impl Roughness {
    /// Perfectly smooth.
    #[must_use]
    pub fn smooth() -> Self {
        Self::new(0.0, 0.0, true)
    }

    /// GGX with these numbers or textures along u and v.
    #[must_use]
    pub fn new(u: impl Into<FloatInput>, v: impl Into<FloatInput>, remap: bool) -> Self {
        let (distribution, masking) = (Distribution::default(), Masking::default());
        Self { u: u.into(), v: v.into(), remap, distribution, masking, compensate: false }
    }
}

/// What a conductor is made of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ConductorSpectrum {
    /// Complex index of refraction η + ik.
    EtaK {
        /// Real part.
        eta: SpectrumInput,
        /// Absorption.
        k: SpectrumInput,
    },
    /// The colour at normal incidence; η = 1 and k follow from it.
    Reflectance(SpectrumInput),
}

/// Index of refraction of a dielectric's inside over its outside.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum IndexOfRefraction {
    /// The same at every wavelength.
    Constant(f32),
    /// Dispersive: the scene must be rendered spectrally to show it.
    Spectrum(SpectrumDesc),
}

/// Factors on what a boundary reflects and transmits; `None` for one. They have no place in physics, but in files.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Tint {
    /// On specular reflection.
    pub reflectance: Option<SpectrumInput>,
    /// On specular transmission; nothing for what is opaque.
    pub transmittance: Option<SpectrumInput>,
}

/// What colours a hair.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HairColor {
    /// Absorption inside, per radius of the hair.
    Absorption(SpectrumInput),
    /// About the colour of many hairs together; absorption follows from it and `beta_n` [Chiang2016].
    Reflectance(SpectrumInput),
    /// Concentrations of pigment: brown and black; red.
    Melanin {
        /// 0.3 is blond, 1.3 brown, 8 black.
        eumelanin: FloatInput,
        /// Red.
        pheomelanin: FloatInput,
    },
}

/// How a subsurface material says what is under its surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SubsurfaceProfile {
    /// Named measured coefficients.
    Named(String),
    /// Absorption and reduced scattering in 1/mm.
    Coefficients {
        /// Absorption.
        sigma_a: SpectrumInput,
        /// Scattering.
        sigma_s: SpectrumInput,
    },
    /// Diffuse reflectance and mean free path.
    Reflectance {
        /// Effective albedo.
        reflectance: SpectrumInput,
        /// Mean free path in scene units.
        mfp: SpectrumInput,
    },
}

/// How light gets from one place of a subsurface material's surface to another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SubsurfaceMethod {
    /// It walks through a medium inside: right for every shape, and rendered by all methods. Parameters do not vary.
    #[default]
    Walk,
    /// By a diffusion profile over distance [Christensen2015]: right on what is flat and deep, less noise, and textures.
    Separable,
}

/// The kinds of material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MaterialKind {
    /// Lambert.
    Diffuse {
        /// Albedo.
        reflectance: SpectrumInput,
    },
    /// Lambert to both sides.
    DiffuseTransmission {
        /// Back to the side the light came from.
        reflectance: SpectrumInput,
        /// Through.
        transmittance: SpectrumInput,
        /// Factor on both.
        scale: f32,
    },
    /// Matt and rough: retro-reflecting V-grooves [Oren1994].
    OrenNayar {
        /// Albedo of the grooves' walls.
        reflectance: SpectrumInput,
        /// Standard deviation of the walls' slope angles, in degrees.
        sigma: FloatInput,
    },
    /// Metal.
    Conductor {
        /// Its stuff.
        spectrum: ConductorSpectrum,
        /// Its microfacets.
        roughness: Roughness,
        /// Factor on its reflectance.
        tint: Tint,
    },
    /// Glass.
    Dielectric {
        /// Inside over outside.
        eta: IndexOfRefraction,
        /// Its microfacets.
        roughness: Roughness,
        /// Factors on both sides.
        tint: Tint,
    },
    /// A pane: both faces in one surface.
    ThinDielectric {
        /// Of the pane.
        eta: IndexOfRefraction,
        /// Factors on both sides.
        tint: Tint,
        /// Is what goes through no event (Mitsuba's `volpath`)? Then it counts no depth, and lamps are seen through the
        /// pane. Not together with factors.
        #[serde(default)]
        passes: bool,
    },
    /// A dielectric boundary over Lambert, smooth or rough, with all bounces below it in closed form (Mitsuba's
    /// `plastic` and `roughplastic`).
    Plastic {
        /// Of the base.
        reflectance: SpectrumInput,
        /// Of the boundary.
        eta: IndexOfRefraction,
        /// Of the boundary.
        roughness: Roughness,
        /// Factor on specular reflection.
        tint: Tint,
        /// Does the colour deepen with every bounce below the boundary? If not, only the first is coloured.
        nonlinear: bool,
    },
    /// Disney's and Mitsuba's principled surface.
    Principled(Box<PrincipledDesc>),
    /// glTF's metallic-roughness surface with its extensions.
    MetallicRoughness(Box<MetallicRoughnessDesc>),
    /// A hair or a fibre: for curves, whose v runs across them [Chiang2016].
    Hair {
        /// What colours it.
        color: HairColor,
        /// Index of the hair over that of the outside.
        eta: f32,
        /// Roughness along the hair, in [0, 1].
        beta_m: FloatInput,
        /// Roughness around the hair, in [0, 1].
        beta_n: FloatInput,
        /// Tilt of the scales, in degrees.
        alpha: FloatInput,
    },
    /// A measured surface: a file of the RGL data base [Dupuy2018].
    Measured {
        /// A `.bsdf` file.
        path: PathBuf,
    },
    /// One material on each side.
    TwoSided {
        /// On the side of the surface's normal.
        front: MaterialId,
        /// On the other side; `None` is black.
        back: Option<MaterialId>,
    },
    /// A dielectric layer over Lambert.
    CoatedDiffuse {
        /// Of the base.
        reflectance: SpectrumInput,
        /// Of the interface.
        roughness: Roughness,
        /// Thickness of the layer, in mean-free-path units of its medium.
        thickness: FloatInput,
        /// Of the interface.
        eta: IndexOfRefraction,
        /// Henyey–Greenstein asymmetry of the layer's medium.
        g: FloatInput,
        /// Single-scattering albedo of the layer's medium; black for none.
        albedo: SpectrumInput,
        /// Most events of the random walk.
        max_depth: u32,
        /// Random walks per evaluation.
        n_samples: u32,
    },
    /// A dielectric layer over metal.
    CoatedConductor {
        /// Of the interface.
        interface_roughness: Roughness,
        /// Thickness of the layer.
        thickness: FloatInput,
        /// Of the interface.
        interface_eta: IndexOfRefraction,
        /// The metal, or its colour.
        conductor: ConductorSpectrum,
        /// Of the metal.
        conductor_roughness: Roughness,
        /// Asymmetry of the layer's medium.
        g: FloatInput,
        /// Albedo of the layer's medium.
        albedo: SpectrumInput,
        /// Most events of the random walk.
        max_depth: u32,
        /// Random walks per evaluation.
        n_samples: u32,
    },
    /// One of two materials, by a weight.
    Mix {
        /// At amount 0 and 1.
        materials: [MaterialId; 2],
        /// The share of the second.
        amount: FloatInput,
    },
    /// Not a surface at all: the border of a medium.
    Interface,
    /// Light that enters, wanders and leaves elsewhere.
    Subsurface {
        /// What is under the surface.
        profile: SubsurfaceProfile,
        /// Factor on the coefficients.
        scale: f32,
        /// Asymmetry.
        g: f32,
        /// Of the interface.
        eta: f32,
        /// Of the interface.
        roughness: Roughness,
        /// How light gets about inside.
        #[serde(default)]
        method: SubsurfaceMethod,
    },
}

impl MaterialKind {
    /// pbrt's default material: grey Lambert.
    #[must_use]
    pub fn default_diffuse() -> Self {
        Self::Diffuse { reflectance: SpectrumDesc::Constant(0.5).into() }
    }
}
