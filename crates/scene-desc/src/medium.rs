//! What fills space.

use std::sync::Arc;

use math::{Transform, Vec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{ColorSpaceName, MediumId, Span, SpectrumDesc};

/// A participating medium.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MediumDesc {
    /// As the file names it.
    pub name: String,
    /// What it is.
    pub kind: MediumKind,
    /// How it scatters.
    pub phase: PhaseDesc,
    /// From the space in which its grid is given; coefficients are per unit of **world** space, as in pbrt.
    pub world_from_medium: Transform,
    /// Where it was written.
    #[serde(skip)]
    pub span: Span,
}

/// The kinds of medium. Coefficients are in 1/scene unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MediumKind {
    /// The same everywhere.
    Homogeneous {
        /// Absorption.
        sigma_a: SpectrumDesc,
        /// Scattering.
        sigma_s: SpectrumDesc,
        /// Emitted radiance, times absorption per length.
        le: Option<SpectrumDesc>,
        /// Factor on both coefficients.
        scale: f32,
        /// Factor on emission.
        le_scale: f32,
    },
    /// One density that varies, times coefficients that do not.
    Grid {
        /// Where the grid is.
        layout: GridLayout,
        /// Factor on both coefficients, x fastest.
        density: Arc<[f32]>,
        /// Absorption where the density is one.
        sigma_a: SpectrumDesc,
        /// Scattering where the density is one.
        sigma_s: SpectrumDesc,
        /// Factor on both coefficients.
        scale: f32,
        /// What glows.
        emission: GridEmission,
    },
    /// Coefficients that vary in colour.
    RgbGrid {
        /// Where the grid is.
        layout: GridLayout,
        /// Absorption, x fastest; `None` is pbrt's default of one.
        sigma_a: Option<Arc<[[f32; 3]]>>,
        /// Scattering.
        sigma_s: Option<Arc<[[f32; 3]]>>,
        /// Emitted radiance, times absorption per length.
        le: Option<Arc<[[f32; 3]]>>,
        /// The primaries of all three.
        space: ColorSpaceName,
        /// Factor on both coefficients.
        scale: f32,
        /// Factor on emission.
        le_scale: f32,
    },
    /// pbrt's procedural cloud.
    Cloud {
        /// Corners of its box in medium space.
        #[schemars(with = "[[f32; 3]; 2]")]
        bounds: [Vec3; 2],
        /// Factor on density.
        density: f32,
        /// How torn it is.
        wispiness: f32,
        /// Of its noise, in 1/unit of medium space.
        frequency: f32,
        /// Absorption where the density is one.
        sigma_a: SpectrumDesc,
        /// Scattering where the density is one.
        sigma_s: SpectrumDesc,
    },
    /// Of a type that is not supported yet: it is treated as empty.
    Unsupported(String),
}

/// A box of points at the centres of its cells; values in between are trilinear.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GridLayout {
    /// Points along x, y and z; their product is the length of the data.
    pub resolution: [u32; 3],
    /// Corners of the box in medium space. There is nothing outside of it.
    #[schemars(with = "[[f32; 3]; 2]")]
    pub bounds: [Vec3; 2],
    /// What lies beyond the outermost points, within half a cell of the box's faces.
    pub border: GridBorder,
}

/// How a grid goes on beyond its outermost points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GridBorder {
    /// It fades to zero, as in pbrt.
    #[default]
    Zero,
    /// It keeps its value, as in Mitsuba.
    Clamp,
}

/// What glows in a grid: radiance, times absorption per length.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GridEmission {
    /// Nothing.
    #[default]
    None,
    /// One spectrum.
    Spectrum {
        /// Its colour, normalised as an [`crate::Illuminant`] is.
        le: SpectrumDesc,
        /// A factor that varies, on the same grid; `None` is one.
        scale: Option<Arc<[f32]>>,
        /// A factor that does not.
        factor: f32,
    },
    /// A black body, normalised to 1 at its maximum as pbrt has it.
    Temperature {
        /// In kelvin after `(t − offset) · scale`, on the same grid; below 100 it does not glow.
        kelvin: Arc<[f32]>,
        /// See `kelvin`.
        offset: f32,
        /// See `kelvin`.
        scale: f32,
        /// Factor on radiance.
        factor: f32,
    },
}

/// Phase functions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PhaseDesc {
    /// The same in all directions.
    Isotropic,
    /// Henyey–Greenstein with asymmetry g.
    HenyeyGreenstein(f32),
    /// Particles much smaller than the wavelength.
    Rayleigh,
    /// A sum of up to [`PhaseDesc::MOST_PARTS`] others that are no sums.
    Blend(Vec<PhasePart>),
}

impl PhaseDesc {
    /// Parts of a sum.
    pub const MOST_PARTS: usize = 4;
}

/// A part of a sum of phase functions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PhasePart {
    /// Its share of the light; shares are taken in proportion to their sum.
    pub weight: f32,
    /// Where that light goes.
    pub phase: PhaseDesc,
}

/// The media on both sides of a surface; `None` is vacuum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct MediumInterface {
    /// Where the normal does not point.
    pub inside: Option<MediumId>,
    /// Where it does.
    pub outside: Option<MediumId>,
}
