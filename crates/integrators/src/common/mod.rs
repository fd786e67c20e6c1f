//! What the algorithms share.

mod density;
mod direct;
mod directions;
mod emergence;
mod ends;
mod guidance;
mod lit_flight;
mod neighbours;
mod photons;
mod pixel_loop;
mod roulette;
mod shared;
mod site;
mod subpath;
mod walk;

pub(crate) use density::{
    Estimate, Gathered, KERNEL, Kernel, MEDIUM_RADIUS, RADIUS, RADIUS_PIXELS, Radius, Search, ball, disk,
};
pub(crate) use direct::{
    DirectLight, LightStrategy, Tools, direct_in_medium, infinite_light_pdf, light_pdf, scatter_sample,
};
pub(crate) use directions::{DirectionSample, DirectionSampling};
pub(crate) use emergence::Entrance;
pub(crate) use ends::{
    CameraStart, LightStart, camera_densities, connect_to_eye, direct_density, emission_densities, place_of,
};
pub(crate) use guidance::sample_guided;
pub(crate) use lit_flight::LitFlight;
pub(crate) use neighbours::{Near, Neighbours};
pub(crate) use photons::{Emission, Emitted, Keeper, LightPath, MEMORY, Photon, PhotonMap, Photons};
pub(crate) use pixel_loop::{CameraEstimator, CameraPath, PathOutput, PixelLoop, place_in, sampler_of};
pub(crate) use roulette::Roulette;
pub(crate) use shared::Shared;
pub(crate) use site::{MediumPoint, Site, scatter_at};
pub(crate) use subpath::{Leaving, Place, Subpath, Vertex};
pub(crate) use walk::{Start, Walk};
