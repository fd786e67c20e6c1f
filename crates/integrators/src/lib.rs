//! The light transport algorithms.
