//! The laboratory: how far a picture is from another one.

mod metrics;

pub use metrics::{Metric, MetricError, Metrics, compare};
