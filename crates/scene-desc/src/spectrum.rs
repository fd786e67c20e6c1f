//! Spectra as people write them.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A spectrum, before anyone asks which role it plays.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SpectrumDesc {
    /// The same at every wavelength.
    Constant(f32),
    /// A linear colour.
    Rgb {
        /// Red, green, blue.
        rgb: [f32; 3],
        /// In which primaries.
        space: ColorSpaceName,
    },
    /// A black body, normalised to 1 at its maximum; in kelvin.
    Blackbody(f32),
    /// A named spectrum, such as `metal-Au-eta` or `stdillum-D65`.
    Named(String),
    /// Pairs of wavelength (nm, ascending) and value, linear in between, zero outside.
    Curve(Arc<[(f32, f32)]>),
}

impl SpectrumDesc {
    /// A linear sRGB colour.
    #[must_use]
    pub fn srgb(rgb: [f32; 3]) -> Self {
        Self::Rgb { rgb, space: ColorSpaceName::Srgb }
    }
}

/// The RGB colour spaces that files name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ColorSpaceName {
    /// sRGB / Rec. 709 primaries, D65.
    #[default]
    Srgb,
    /// DCI-P3 primaries, D65.
    DciP3,
    /// Rec. 2020 primaries, D65.
    Rec2020,
    /// ACES2065-1 primaries.
    Aces2065_1,
}
