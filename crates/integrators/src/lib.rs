//! The light transport algorithms: one room each, what they share in `common`.
//!
//! A pass is one sample in every pixel (and, for the methods that need them, a batch of light paths). It is cut
//! into cells; a cell is a **pure function** of scene, seed, pass and cell, so that it may run anywhere, twice, or
//! be thrown away and run again. See [`Integrator`].

pub mod parameters;

mod ao;
mod bdpt;
mod cell;
mod common;
mod direct;
mod guide;
mod guided;
mod irradiance_cache;
mod light;
mod manifold;
mod many_light;
mod mlt;
mod path;
mod photon;
mod recursive;
mod registry;
mod shortcut;
mod sppm;
mod strategy_layer;
#[cfg(test)]
mod test_scene;
mod vcm;
mod walker;

pub use cell::{Cell, CellOutput, Channels, Counters, Integrator, PassContext, Prepared};
pub use registry::{IntegratorInfo, Making, create, find, learns, list};
pub use strategy_layer::StrategyLayer;
