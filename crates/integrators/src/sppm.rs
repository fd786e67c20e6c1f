//! Stochastic progressive photon mapping [Hachisuka2009] in its memoryless form [Knaus2011]: every pass has photons of
//! its own, and a radius that depends on its number alone. The mean over passes converges to the right image, and no
//! statistics are kept between them, so that passes may be rendered anywhere and added.
//!
//! Walks from the eye go on over deltas and rough surfaces and gather at the first diffuse one, or where a medium scatters. With α = 2/3 bias and noise
//! fade alike; the mean squared error falls as N^(−2/3) in the end.
//!
//! Left out: a radius that adapts to each pixel; it follows from the width of a pixel.

use crate::Integrator;
use crate::common::{KERNEL, MEDIUM_RADIUS, MEMORY, RADIUS, RADIUS_PIXELS};
use crate::parameters::{ParameterInfo, ParameterKind, Parameters, shared};
use crate::photon::{AtDiffuse, PHOTONS, PhotonMapping};
use crate::registry::{IntegratorInfo, Making, refuses_for_light_walks, refuses_glow};

/// For the registry.
pub(crate) const INFO: IntegratorInfo = IntegratorInfo {
    name: "sppm",
    purpose: "progressive photon mapping: caustics, also those seen in mirrors and through glass",
    misses: "nothing in the end; every pass blurs indirect light over its radius, which shrinks slowly",
    unbiased: false,
    refuses: |scene| refuses_glow(scene).or_else(|| refuses_for_light_walks(scene)),
    parameters,
    make,
};

fn parameters() -> Vec<ParameterInfo> {
    vec![
        shared::MAX_DEPTH,
        shared::RR_DEPTH,
        PHOTONS,
        ParameterInfo {
            name: "alpha",
            kind: ParameterKind::Float(2.0 / 3.0),
            doc: "how the radius shrinks, r² ~ passes^(alpha − 1): 1 not at all, smaller is less biased and noisier",
        },
        ParameterInfo {
            name: "direct",
            kind: ParameterKind::Choice(&["samples", "photons"]),
            doc: "light straight from lamps on diffuse surfaces: by light samples, or by photons as well",
        },
        RADIUS,
        RADIUS_PIXELS,
        MEDIUM_RADIUS,
        KERNEL,
        MEMORY,
    ]
}

fn make(p: &Parameters, making: &Making<'_>) -> Box<dyn Integrator> {
    let at_diffuse = if p.text("direct") == "photons" { AtDiffuse::Raw } else { AtDiffuse::Photons };
    Box::new(PhotonMapping::new(p, making, (at_diffuse, 0, p.float("alpha"))))
}
