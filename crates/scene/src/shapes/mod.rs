//! Compiled surfaces: from what the ray kernel found to a [`SurfaceInteraction`].
//!
//! A shape is a mesh, a patch mesh, a set of strands or one quadric. Geometry of the world is stored in world
//! space; geometry of an object in the object's space, and an instance's transform is applied to what comes out.

mod bilinear;
mod curvature;
mod curve;
mod local;
mod loop_subdiv;
mod mesh;
mod moving_mesh;
mod quadric;
mod tube;

pub(crate) use bilinear::PatchMesh;
pub use curvature::Curvature;
pub(crate) use curve::Strand;
pub(crate) use local::LocalSurface;
pub(crate) use loop_subdiv::subdivide;
pub(crate) use mesh::Mesh;
pub(crate) use moving_mesh::MovingMesh;
pub(crate) use quadric::{Quadric, QuadricKind};
pub(crate) use tube::tube;

use math::{Point, Ray, Transform};

use crate::materials::{Detail, Gaps};
use crate::textures::FloatHandle;
use crate::{BodyId, LightId, MaterialId, MediumId};

/// A surface with all that belongs to it.
#[derive(Clone, Debug)]
pub struct Shape {
    /// Its form.
    pub(crate) geometry: ShapeGeometry,
    /// Its look.
    pub material: MaterialId,
    /// The chance that a hit counts, if less than one somewhere.
    pub(crate) alpha: Option<FloatHandle>,
    /// The light of its first primitive, if it emits; primitive `i` is light `first + i / primitives_per_light`. In an
    /// object, counted from the first light of the instance.
    pub(crate) first_light: Option<LightId>,
    pub(crate) primitives_per_light: u32,
    /// The media inside and outside, if it is a border of media.
    pub medium_interface: Option<[Option<MediumId>; 2]>,
    /// The body that it bounds, if its material has a priority.
    pub(crate) body: Option<BodyId>,
    /// Where it is nothing but a border of media.
    pub(crate) gaps: Gaps,
    /// What its material needs to know of its points.
    pub(crate) detail: Detail,
}

/// Forms.
#[derive(Clone, Debug)]
pub(crate) enum ShapeGeometry {
    Mesh(Mesh),
    MovingMesh(Box<MovingMesh>),
    Patches(PatchMesh),
    Quadric(Quadric),
    Strand(Strand),
}

impl Shape {
    /// Does it emit?
    #[inline]
    #[must_use]
    pub fn is_lamp(&self) -> bool {
        self.first_light.is_some()
    }
}

impl ShapeGeometry {
    /// The surface at a hit, in the space in which the geometry is stored. `p` is the hit point there. Meshes, which are
    /// most of what is hit, leave out what is not asked for.
    #[inline]
    pub(crate) fn at(&self, hit: &accel::Hit, ray_in_space: &Ray, p: Point, detail: Detail) -> LocalSurface {
        match self {
            Self::Mesh(m) => m.at(hit.primitive, [hit.u, hit.v], detail),
            Self::MovingMesh(m) => m.at(hit.primitive, [hit.u, hit.v], ray_in_space.time, detail),
            Self::Patches(m) => m.at(hit.primitive, hit.u, hit.v),
            Self::Quadric(q) => q.at(hit.u, hit.v, p),
            Self::Strand(s) => s.at(hit.primitive, hit.u, hit.v, ray_in_space, p),
        }
    }

    /// (u, v) of a hit: what an alpha texture needs, and no more.
    pub(crate) fn uv(&self, hit: &accel::Hit) -> math::Vec2 {
        match self {
            Self::Mesh(m) => m.uv(hit.primitive, hit.u, hit.v),
            Self::MovingMesh(m) => m.start.uv(hit.primitive, hit.u, hit.v),
            Self::Patches(m) => m.uv(hit.primitive, hit.u, hit.v),
            Self::Quadric(_) | Self::Strand(_) => math::Vec2::new(hit.u, hit.v),
        }
    }

    /// The same form where `t` leads.
    pub(crate) fn placed(&self, t: &Transform) -> Self {
        match self {
            Self::Mesh(m) => Self::Mesh(m.placed(t)),
            Self::MovingMesh(m) => Self::MovingMesh(Box::new(m.placed(t))),
            Self::Patches(m) => Self::Patches(m.placed(t)),
            Self::Quadric(q) => {
                Self::Quadric(Quadric { world_from_object: *t * q.world_from_object, ..q.clone() })
            }
            Self::Strand(s) => Self::Strand(s.clone()),
        }
    }

    /// Number of primitives.
    pub(crate) fn primitives(&self) -> usize {
        match self {
            Self::Mesh(m) => m.indices.len(),
            Self::MovingMesh(m) => m.start.indices.len(),
            Self::Patches(m) => m.indices.len(),
            Self::Quadric(_) => 1,
            Self::Strand(s) => s.segments.len(),
        }
    }

    /// Bytes of heap memory.
    pub(crate) fn memory(&self) -> usize {
        match self {
            Self::Mesh(m) => m.memory(),
            Self::MovingMesh(m) => m.memory(),
            Self::Patches(m) => m.memory(),
            Self::Quadric(_) => 0,
            Self::Strand(s) => s.memory(),
        }
    }
}

/// Does the normal of a shape under this transform point the other way?
pub(crate) fn flips(reverse_orientation: bool, world_from_object: &Transform) -> bool {
    reverse_orientation != world_from_object.swaps_handedness()
}
