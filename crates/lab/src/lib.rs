//! The laboratory: how far a picture is from another one, and which method gets there soonest.

pub mod advise;
pub mod comparison;
pub mod experiment;
pub mod flip;
mod metrics;
mod picture;
mod report;

pub use metrics::{Metric, MetricError, Metrics, compare};
pub use picture::{Picture, PictureError};
pub use report::{page, save};
