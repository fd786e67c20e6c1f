//! Distributions of microfacets.

mod ggx;

pub use ggx::Ggx;

/// A direction closer to the surface than this counts as in it: the sines and cosines of microfacet formulas would
/// overflow, and its contribution is nil.
pub const MIN_COS: f32 = 1e-8;
