//! The ray kernel: BVH construction and traversal, usable alone.
//!
//! ```
//! use steradian_accel::{Accel, Blas, BuildOptions, Geometry, Shape, accept_all};
//! use math::{Dir, Point, Ray, Vec3};
//!
//! let positions = [Vec3::ZERO, Vec3::X, Vec3::Y];
//! let mesh = Shape::Mesh { positions: &positions, indices: &[[0, 1, 2]] };
//! let world = Blas::build(&[Geometry::opaque(mesh)], &BuildOptions::default())?;
//! let accel = Accel::from_static(world);
//! let ray = Ray::new(Point::new(0.25, 0.5, 2.0), Dir(-Vec3::Z), 0.0);
//! let hit = accel.intersect(&ray, &mut accept_all).expect("the ray points at the triangle");
//! assert_eq!((hit.t, hit.u, hit.v), (2.0, 0.25, 0.5));
//! # Ok::<(), steradian_accel::BuildError>(())
//! ```
//!
//! # What a hit is
//!
//! The nearest hit is the smallest `(t, instance, geometry, primitive)`. It is a function of ray and scene alone: the
//! bits do not depend on instruction set, tree, traversal order or threads, because
//!
//! 1. the same operations are fused in every kernel, so that a lane of any width computes what scalar code computes;
//! 2. which triangle a line meets is decided by signs that are exact [Woop2013];
//! 3. the `t` of a hit is clamped into the slab interval of the primitive's *own* box, found by the very arithmetic of
//!    the node test. Rounding is monotone, so a box's interval holds the interval of every box inside it, and culling
//!    by distance can never drop a hit that would have won.
//!
//! Left out: spatial splits, compressed nodes, reinsertion, a kernel for NEON (the portable one serves).

#![allow(clippy::neg_cmp_op_on_partial_ord, reason = "`!(a <= b)` also means: or one of them is NaN")]

mod accel;
mod blas;
mod error;
mod geometry;
mod hit;
mod instance;
mod isa;
mod ray_space;

mod build;
mod kernels;
mod layout;
mod numbering;
mod oracle;
mod primitive;

pub use accel::{Accel, AccelStats};
pub use blas::{Blas, BlasStats};
pub use build::{BuildOptions, TreeKind};
pub use error::BuildError;
pub use geometry::{Geometry, Shape};
pub use hit::{Hit, NO_INSTANCE, accept_all, accept_all_of};
pub use instance::Instance;
pub use isa::Isa;
pub use kernels::{Wide, has_lanes, run_wide};
pub use primitive::{Curve, CurveKind, Cylinder, Disk, Sphere, share_of_motion, vertex_between};
