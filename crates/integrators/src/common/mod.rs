//! What the algorithms share.

mod direct;
mod directions;
mod ends;
mod pixel_loop;
mod roulette;
mod subpath;

pub(crate) use direct::{DirectLight, LightStrategy, infinite_light_pdf, light_pdf};
pub(crate) use directions::DirectionSampling;
pub(crate) use ends::{
    CameraStart, LightStart, camera_densities, connect_to_eye, direct_density, emission_densities, place_of,
};
pub(crate) use pixel_loop::{CameraEstimator, CameraPath, PathOutput, PixelLoop, sampler_of};
pub(crate) use roulette::Roulette;
pub(crate) use subpath::{Leaving, Place, Start, Subpath, Vertex, Walk};
