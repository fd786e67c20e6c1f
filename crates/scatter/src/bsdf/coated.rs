//! A dielectric layer, perhaps with scattering particles in it, over an opaque base.
//!
//! The answer is that of a random walk between the two boundaries whose positions along the surface do not matter
//! [Guo2018], with the parameters, the order of events and the cut-off depth of pbrt-v4's layered materials. It is
//! had in two ways:
//!
//! - **Walk** (`walk.rs`): an unbiased estimate. Any coat, any base.
//! - **Closed form**: over a Lambertian base, under a coat without scattering, light that left the base is
//!   isotropic again, so the sum over bounces is geometric and *equal in the mean to the walk*:
//!   `f = f_top + t(wo) t(wi) / (π η²) · ρ Σ_{k<n} (ρ K)^k`, where `t` is what gets from outside to the base,
//!   `K = ∫∫ f_inside cos cos' / π` what the coat sends back to it, both with absorption on the way, and `n` the
//!   number of times that the walk would reach the base. Noise-free, with an exact density, and far faster. For a
//!   smooth coat `t = (1 − F) e^{−d/μ'}`; for a rough one it is tabulated ([`CoatProfile`]).
//!
//! Even without scattering the layer absorbs, with a mean free path of one unit of `thickness` (as in pbrt-v4).
//! Departs from pbrt-v4: the weights of multiple importance sampling use the density of the competing technique in
//! its own direction, so that they add up to one; and a sampled walk may get out after its last event, so that
//! samples and evaluations are cut off alike (pbrt-v4's are for even depths without a medium).
//! Left out: closed forms for anisotropic roughness (the walk serves), and several coats.

mod closed;
mod profile;
mod walk;

use spectrum::Spectrum;

pub(super) use closed::ClosedForm;
pub use profile::{CoatProfile, CoatProfiles};
use profile::{smooth_at, smooth_both};
pub(super) use walk::Walk;

/// A dielectric layer: its upper boundary and what is in it. The defaults are pbrt-v4's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coat {
    /// Index of the layer over that of the outside.
    pub eta: f32,
    /// Widths of the facets of the upper boundary along both tangents.
    pub alpha: [f32; 2],
    /// Thickness in mean free paths of the medium.
    pub thickness: f32,
    /// Asymmetry of the medium's (Henyey–Greenstein) phase function.
    pub g: f32,
    /// Albedo of the medium; where it is zero the medium only absorbs.
    pub albedo: Spectrum,
    /// Events (at either boundary or in the medium) after which a walk is given up.
    pub max_depth: u16,
    /// Walks per evaluation.
    pub n_samples: u16,
}

impl Default for Coat {
    fn default() -> Self {
        Self {
            eta: 1.5,
            alpha: [0.0; 2],
            thickness: 0.01,
            g: 0.0,
            albedo: Spectrum::ZERO,
            max_depth: 10,
            n_samples: 1,
        }
    }
}

impl Coat {
    /// Without scattering in the layer?
    #[must_use]
    pub fn is_clear(&self) -> bool {
        self.albedo.is_black()
    }

    /// The numbers of the layer without its boundary.
    pub(super) fn layer(&self) -> Layer {
        Layer {
            thickness: self.thickness,
            g: self.g,
            albedo: self.albedo,
            max_depth: self.max_depth,
            n_samples: self.n_samples,
        }
    }
}

/// What is between the boundaries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Layer {
    pub(super) thickness: f32,
    pub(super) g: f32,
    pub(super) albedo: Spectrum,
    pub(super) max_depth: u16,
    pub(super) n_samples: u16,
}

/// `Σ_{k<n} x^k`: what repeated reflection between the boundaries adds up to in `max_depth` events, of which every
/// second is at the base.
pub(super) fn bounces(x: f32, max_depth: u16) -> f32 {
    let n = max_depth.div_ceil(2);
    if x >= 0.999_999 {
        return f32::from(n);
    }
    // x^n < e^(−n (1 − x)) would be no number of f32.
    if f32::from(n) * (1.0 - x) > 110.0 {
        return 1.0 / (1.0 - x);
    }
    (1.0 - integer_power(x, n)) / (1.0 - x)
}

/// `x^n` by squaring.
fn integer_power(mut x: f32, mut n: u16) -> f32 {
    let mut product = 1.0;
    while n > 0 {
        if n & 1 == 1 {
            product *= x;
        }
        x *= x;
        n >>= 1;
    }
    product
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounces_add_up_to_a_geometric_series() {
        assert_eq!(bounces(0.5, 0), 0.0);
        assert_eq!(bounces(0.5, 1), 1.0);
        assert_eq!(bounces(0.5, 10), 1.9375);
        assert!((bounces(0.9, 2000) - 10.0).abs() < 1e-4);
        assert_eq!(bounces(1.0, 10), 5.0);
        assert_eq!(bounces(0.0, 10), 1.0);
        for x in [0.0, 0.3, 0.99, 0.996_6, 0.999, 0.999_9] {
            let n = u16::MAX.div_ceil(2);
            assert_eq!(bounces(x, u16::MAX), (1.0 - integer_power(x, n)) / (1.0 - x), "{x}");
        }
    }
}
