//! The film: exact accumulation, filters, merging and partial files.
//!
//! A worker adds camera samples to a [`FilmTile`] and splats to a [`SplatList`]; those go into the [`PassBuffer`] of their
//! pass, and complete passes into the [`Film`]. Every step but the first is exact integer arithmetic, so the film's bits
//! do not depend on threads, machines or order. A film knows nothing of scenes.

mod bad;
mod blocks;
mod column;
mod develop;
mod error;
mod film;
mod filter;
mod fixed;
mod partial;
mod pass;
mod passes;
mod settings;
mod sums;
mod tile;

pub use bad::{BadKind, BadSample, BadSamples, CONTRIBUTION_LIMIT, Sign};
pub use develop::Developed;
pub use error::Error;
pub use film::{Film, FilmLabel, Merged};
pub use filter::{Filter, MAX_RADIUS};
pub use fixed::{Fixed, FixedPoint, Moment};
pub use pass::{PassBuffer, SplatList};
pub use passes::PassSet;
pub use settings::{FilmSettings, MAX_AOVS, MAX_ITERATIONS, MAX_PIXELS, MAX_SIDE, RenderKey};
pub use tile::FilmTile;
