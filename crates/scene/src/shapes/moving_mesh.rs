//! Triangle meshes whose vertices move on straight lines between two moments, each at its own pace.
//!
//! What is interpolated in time are the corners, by the numbers that the ray kernel uses, so that a surface lies where rays meet
//! it; everything else follows from the triangle of the moment. Shading normals are interpolated as corners are, and tangents are
//! those of the first key. A form of its own, so that a hit on a mesh at rest asks nothing about time.

use math::{Dir, Point, Transform, Vec3};
use scene_desc::MeshDesc;

use super::{LocalSurface, Mesh};
use crate::materials::Detail;

/// A mesh at two moments, in the space in which it is traced.
#[derive(Clone, Debug)]
pub(crate) struct MovingMesh {
    /// At the first key and before.
    pub(crate) start: Mesh,
    /// Of the vertices at the second key and after.
    pub(crate) end_positions: Vec<Vec3>,
    /// As `start.normals`; empty where they do not turn.
    end_normals: Vec<Vec3>,
    /// The moments of the keys.
    pub(crate) times: [f32; 2],
}

impl MovingMesh {
    /// Maps both keys, the first as [`Mesh::new`] does.
    pub(crate) fn new(desc: &MeshDesc, t: &Transform, reverse_orientation: bool) -> Self {
        let sign = if reverse_orientation { -1.0 } else { 1.0 };
        let identity = *t == Transform::IDENTITY;
        let position = |p: &Vec3| if identity { *p } else { t.point(Point(*p)).0 };
        Self {
            start: Mesh::new(desc, t, reverse_orientation),
            end_positions: desc.end_positions.iter().map(position).collect(),
            end_normals: desc.end_normals.iter().map(|n| t.normal(Dir(*n)).0 * sign).collect(),
            times: desc.key_times,
        }
    }

    /// The same mesh where `t` leads.
    pub(crate) fn placed(&self, t: &Transform) -> Self {
        Self {
            start: self.start.placed(t),
            end_positions: self.end_positions.iter().map(|p| t.point(Point(*p)).0).collect(),
            end_normals: self.end_normals.iter().map(|n| t.normal(Dir(*n)).0).collect(),
            times: self.times,
        }
    }

    /// The corners of a triangle at a moment, and its normals there if it has any.
    pub(crate) fn triangle(&self, triangle: u32, time: f32) -> ([Vec3; 3], Option<[Vec3; 3]>) {
        let corners = self.corners(triangle);
        let share = accel::share_of_motion(self.times, time);
        let between = |a: &[Vec3], b: &[Vec3], i: usize| accel::vertex_between(a[i], b[i], share);
        let start = &self.start;
        let positions = corners.map(|i| between(&start.positions, &self.end_positions, i));
        let normals = match (start.normals.is_empty(), self.end_normals.is_empty()) {
            (true, _) => None,
            (false, true) => Some(corners.map(|i| start.normals[i])),
            (false, false) => Some(corners.map(|i| between(&start.normals, &self.end_normals, i))),
        };
        (positions, normals)
    }

    /// The surface at barycentric coordinates and a moment: see [`Mesh::at`].
    pub(crate) fn at(&self, triangle: u32, b: [f32; 2], time: f32, detail: Detail) -> LocalSurface {
        self.start.surface(self.corners(triangle), self.triangle(triangle, time), b, detail)
    }

    fn corners(&self, triangle: u32) -> [usize; 3] {
        self.start.indices[triangle as usize].map(|i| i as usize)
    }

    /// Bytes of heap memory.
    pub(crate) fn memory(&self) -> usize {
        self.start.memory() + 12 * (self.end_positions.len() + self.end_normals.len())
    }
}
