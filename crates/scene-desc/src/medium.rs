//! What fills space.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{MediumId, Span, SpectrumDesc};

/// A participating medium.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MediumDesc {
    /// As the file names it.
    pub name: String,
    /// What it is.
    pub kind: MediumKind,
    /// Where it was written.
    #[serde(skip)]
    pub span: Span,
}

/// The kinds of medium.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MediumKind {
    /// The same everywhere; coefficients in 1/scene unit.
    Homogeneous {
        /// Absorption.
        sigma_a: SpectrumDesc,
        /// Scattering.
        sigma_s: SpectrumDesc,
        /// Emitted radiance per length, times absorption.
        le: Option<SpectrumDesc>,
        /// Factor on both coefficients.
        scale: f32,
        /// Factor on emission.
        le_scale: f32,
        /// How it scatters.
        phase: PhaseDesc,
    },
    /// Of a type that is not supported yet: it is treated as empty.
    Unsupported(String),
}

/// Phase functions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PhaseDesc {
    /// Henyey–Greenstein with asymmetry g.
    HenyeyGreenstein(f32),
}

/// The media on both sides of a surface; `None` is vacuum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct MediumInterface {
    /// Where the normal does not point.
    pub inside: Option<MediumId>,
    /// Where it does.
    pub outside: Option<MediumId>,
}
