//! Everything random: densities that know their measure, the ways to combine them, samplers, warps and
//! distributions.
//!
//! Only a [`Sampler`] makes numbers; every other routine takes them as arguments `u`, so that it is a pure
//! function: testable on grids, usable by quasi-Monte Carlo and by Metropolis alike.

pub mod distribution;
pub mod mis;
pub mod rng;
pub mod sobol;
pub mod warp;

mod pdf;
mod sampler;
mod sobol_lanes;

pub use pdf::{
    Area, Geometry, Length, Measure, Pdf, PrimarySpace, ProjectedSolidAngle, SolidAngle, Volume, Wavelength,
};
pub use sampler::{PathState, Sampler, SamplerKind};
pub use sobol_lanes::{LongsOf, SobolLanes};
