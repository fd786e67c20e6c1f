//! What goes into a [`Blas`](crate::Blas).

use math::Vec3;

use crate::primitive::{Curve, Cylinder, Disk, Sphere};

/// A shape and how rays treat it.
#[derive(Clone, Copy, Debug)]
pub struct Geometry<'a> {
    /// The surface.
    pub shape: Shape<'a>,
    /// Are hits offered to the caller's filter (cut-outs)?
    pub needs_filter: bool,
}

impl<'a> Geometry<'a> {
    /// Every hit counts.
    #[must_use]
    pub fn opaque(shape: Shape<'a>) -> Self {
        Self { shape, needs_filter: false }
    }

    /// The caller's filter decides which hits count.
    #[must_use]
    pub fn filtered(shape: Shape<'a>) -> Self {
        Self { shape, needs_filter: true }
    }
}

/// A surface. Meshes and curves hold many primitives. The data are copied while building.
#[derive(Clone, Copy, Debug)]
pub enum Shape<'a> {
    /// Triangles.
    Mesh {
        /// Vertices.
        positions: &'a [Vec3],
        /// Three vertices per triangle.
        indices: &'a [[u32; 3]],
    },
    /// Triangles whose vertices move on straight lines from the first key to the second; still before and after.
    MovingMesh {
        /// Vertices at the two keys.
        positions: [&'a [Vec3]; 2],
        /// The moments of the keys.
        times: [f32; 2],
        /// Three vertices per triangle.
        indices: &'a [[u32; 3]],
    },
    /// Bilinear patches; `u` runs from vertex 0 to 1, `v` from vertex 0 to 2 (vertex 3 is at u = v = 1).
    PatchMesh {
        /// Vertices.
        positions: &'a [Vec3],
        /// Four vertices per patch.
        indices: &'a [[u32; 4]],
    },
    /// A sphere, or a part of one.
    Sphere(&'a Sphere),
    /// A disk, ring or sector.
    Disk(&'a Disk),
    /// The wall of a cylinder, without caps.
    Cylinder(&'a Cylinder),
    /// Cubic Bézier segments with width; the primitive is the index of the segment.
    Curves(&'a [Curve]),
}
