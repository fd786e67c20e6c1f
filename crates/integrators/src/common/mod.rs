//! What the algorithms share.

mod direct;
mod directions;
mod pixel_loop;
mod roulette;

pub(crate) use direct::{DirectLight, LightStrategy, infinite_light_pdf, light_pdf};
pub(crate) use directions::{DirectionSample, DirectionSampling};
pub(crate) use pixel_loop::{CameraEstimator, CameraPath, PathOutput, PixelLoop, sampler_of};
pub(crate) use roulette::Roulette;
