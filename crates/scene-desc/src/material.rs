//! Surfaces' looks.

use crate::{FloatInput, ImageId, MaterialId, Span, SpectrumDesc, SpectrumInput};

/// A material.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialDesc {
    /// As the file names it; empty for an unnamed one.
    pub name: String,
    /// What it is.
    pub kind: MaterialKind,
    /// A tangent-space normal map.
    pub normal_map: Option<ImageId>,
    /// A height, in scene units, that bends shading normals.
    pub displacement: Option<FloatInput>,
    /// Where it was written.
    pub span: Span,
}

/// Width of a microfacet distribution along u and v.
#[derive(Clone, Debug, PartialEq)]
pub struct Roughness {
    /// Along u.
    pub u: FloatInput,
    /// Along v.
    pub v: FloatInput,
    /// `alpha = √roughness` (pbrt's remapping) rather than `alpha = roughness`?
    pub remap: bool,
}

impl Roughness {
    /// Perfectly smooth.
    #[must_use]
    pub fn smooth() -> Self {
        Self { u: 0.0.into(), v: 0.0.into(), remap: true }
    }
}

/// What a conductor is made of.
#[derive(Clone, Debug, PartialEq)]
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
#[derive(Clone, Debug, PartialEq)]
pub enum IndexOfRefraction {
    /// The same at every wavelength.
    Constant(f32),
    /// Dispersive: the scene must be rendered spectrally to show it.
    Spectrum(SpectrumDesc),
}

/// How a subsurface material says what is under its surface.
#[derive(Clone, Debug, PartialEq)]
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

/// The kinds of material.
#[derive(Clone, Debug, PartialEq)]
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
    /// Metal.
    Conductor {
        /// Its stuff.
        spectrum: ConductorSpectrum,
        /// Its microfacets.
        roughness: Roughness,
    },
    /// Glass.
    Dielectric {
        /// Inside over outside.
        eta: IndexOfRefraction,
        /// Its microfacets.
        roughness: Roughness,
    },
    /// A pane: both faces in one surface.
    ThinDielectric {
        /// Of the pane.
        eta: IndexOfRefraction,
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
    },
}

impl MaterialKind {
    /// pbrt's default material: grey Lambert.
    #[must_use]
    pub fn default_diffuse() -> Self {
        Self::Diffuse { reflectance: SpectrumDesc::Constant(0.5).into() }
    }
}
