//! BSDFs, microfacet distributions, Fresnel and phase functions: pure, in the local frame.
//!
//! Conventions: `wo` and `wi` both point away from the surface; the third axis is the shading normal; `f` is in
//! 1/sr and **without** the cosine. For transmissive kinds z > 0 is the outside, and `eta` is the index inside
//! over the index outside. Random numbers are arguments.
//!
//! A [`Bsdf`] is built by value at a hit, is `Copy` and allocates nothing. Each kind is a file under `bsdf/`.

mod bsdf;
mod closed_set;
mod diffusion;
mod phase;

pub mod fresnel;
pub mod microfacet;

pub use bsdf::{
    Bsdf, BsdfKind, BsdfSample, Coat, CoatProfile, CoatProfiles, CoatedConductor, CoatedDiffuse,
    CompensatedConductor, Conductor, Density, Dielectric, Diffuse, DiffuseTransmission, Gloss, Hair, Lobe,
    LobeFlags, Measured, MeasuredError, MeasuredParts, MeasuredTable, MetallicRoughness,
    MetallicRoughnessParameters, OrenNayar, Plastic, Principled, PrincipledParameters, PrincipledThin,
    Raster, SampleLobes, Side, SoftBorder, ThinDielectric, ThinParameters, TintedDielectric, TransportMode,
};
pub use diffusion::DiffusionProfile;
pub use phase::{
    BlendedPhase, HenyeyGreenstein, Isotropic, PhaseFunction, PhaseKind, PhaseSample, PurePhase, Rayleigh,
};
