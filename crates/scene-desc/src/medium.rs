//! What fills space.

use crate::{MediumId, Span, SpectrumDesc};

/// A participating medium.
#[derive(Clone, Debug, PartialEq)]
pub struct MediumDesc {
    /// As the file names it.
    pub name: String,
    /// What it is.
    pub kind: MediumKind,
    /// Where it was written.
    pub span: Span,
}

/// The kinds of medium.
#[derive(Clone, Debug, PartialEq)]
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
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PhaseDesc {
    /// Henyey–Greenstein with asymmetry g.
    HenyeyGreenstein(f32),
}

/// The media on both sides of a surface; `None` is vacuum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MediumInterface {
    /// Where the normal does not point.
    pub inside: Option<MediumId>,
    /// Where it does.
    pub outside: Option<MediumId>,
}
