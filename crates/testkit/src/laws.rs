//! Laws: what every kind of a family must obey, whatever it models.

pub mod bsdf;
pub mod phase;
