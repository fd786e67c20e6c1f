//! The vocabulary of space: points, directions, frames, transforms, bounds and float error bounds.
//!
//! World and local directions are different types ([`Dir`], [`LocalDir`]), so that a BSDF cannot be handed
//! a world vector by accident. A displacement, a colour or anything else without a meaning of its own is a
//! plain [`Vec3`]. Transcendental functions come from [`trig`] alone, so that every machine gives the same bits.

mod bounds;
mod frame;
mod motion;
mod ray;
#[cfg(feature = "serde")]
mod serial;
mod space;
mod transform;

pub mod error_bound;
pub mod hash;
pub mod lanes;
pub mod trig;

pub use bounds::{Bounds, Bounds2i};
pub use frame::Frame;
pub use glam::{DMat4, DVec3, DVec4, Mat2, Mat4, UVec2, Vec2, Vec3, Vec4};
pub use motion::AnimatedTransform;
pub use ray::Ray;
pub use space::{Dir, LocalDir, Point};
pub use transform::Transform;
