//! Laws, statistics and analytic scenes for tests.

pub mod chi2;
pub mod laws;
pub mod measured;

pub use statistics;
