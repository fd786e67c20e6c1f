//! Affine (and, for cameras, projective) maps with their inverses, in double precision.
//!
//! Files are read and scenes compiled with these; what a ray meets is already `f32` in world space.

use glam::{DMat4, DVec3, Vec3};

use crate::{Bounds, Dir, Point};

/// A 4×4 map and its inverse. Reads right to left: `(a * b)` applies `b` first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    m: DMat4,
    inv: DMat4,
}

impl Default for Transform {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Transform {
    /// Changes nothing.
    pub const IDENTITY: Self = Self { m: DMat4::IDENTITY, inv: DMat4::IDENTITY };

    /// From a matrix; `None` if it is singular or not finite.
    #[must_use]
    pub fn from_matrix(m: DMat4) -> Option<Self> {
        let inv = m.inverse();
        (m.is_finite() && inv.is_finite() && m.determinant() != 0.0).then_some(Self { m, inv })
    }

    /// From a matrix and its inverse, which are taken as they are.
    #[cfg(feature = "serde")]
    pub(crate) fn from_pair(m: DMat4, inv: DMat4) -> Self {
        Self { m, inv }
    }

    /// Moves by `d`.
    #[must_use]
    pub fn translate(d: DVec3) -> Self {
        Self { m: DMat4::from_translation(d), inv: DMat4::from_translation(-d) }
    }

    /// Scales by `s`, which must have no zero.
    #[must_use]
    pub fn scale(s: DVec3) -> Option<Self> {
        Self::from_matrix(DMat4::from_scale(s))
    }

    /// Turns by `angle` (radians) about `axis`, counter-clockwise seen against the axis.
    #[must_use]
    pub fn rotate(axis: DVec3, angle: f64) -> Option<Self> {
        let m = DMat4::from_axis_angle(axis.try_normalize()?, angle);
        Some(Self { m, inv: m.transpose() })
    }

    /// camera-from-world of a camera at `eye` that looks at `look` (pbrt's left-handed camera space:
    /// x right, y up, z forward). `None` when `up` is parallel to the view or the points coincide.
    #[must_use]
    pub fn look_at(eye: DVec3, look: DVec3, up: DVec3) -> Option<Self> {
        let dir = (look - eye).try_normalize()?;
        let right = up.try_normalize()?.cross(dir).try_normalize()?;
        let new_up = dir.cross(right);
        let world_from_camera =
            DMat4::from_cols(right.extend(0.0), new_up.extend(0.0), dir.extend(0.0), eye.extend(1.0));
        Self::from_matrix(world_from_camera).map(Self::inverse)
    }

    /// The way back.
    #[must_use]
    pub fn inverse(self) -> Self {
        Self { m: self.inv, inv: self.m }
    }

    /// The matrix.
    #[must_use]
    pub fn matrix(&self) -> DMat4 {
        self.m
    }

    /// The inverse's matrix.
    #[must_use]
    pub fn inverse_matrix(&self) -> DMat4 {
        self.inv
    }

    /// Is the last row (0, 0, 0, 1)?
    #[must_use]
    pub fn is_affine(&self) -> bool {
        self.m.row(3) == DVec3::ZERO.extend(1.0)
    }

    /// Does the map turn right hands into left hands?
    #[must_use]
    pub fn swaps_handedness(&self) -> bool {
        glam::DMat3::from_mat4(self.m).determinant() < 0.0
    }

    /// Maps a point, with the perspective division if there is one.
    #[must_use]
    pub fn point(&self, p: Point) -> Point {
        Point(self.m.project_point3(p.0.as_dvec3()).as_vec3())
    }

    /// Maps a displacement.
    #[must_use]
    pub fn vector(&self, v: Vec3) -> Vec3 {
        self.m.transform_vector3(v.as_dvec3()).as_vec3()
    }

    /// Maps a direction and makes it unit again.
    #[must_use]
    pub fn dir(&self, d: Dir) -> Dir {
        Dir::normalize(self.m.transform_vector3(d.0.as_dvec3()).normalize_or_zero().as_vec3())
    }

    /// Maps a normal (by the inverse transpose) and makes it unit again.
    #[must_use]
    pub fn normal(&self, n: Dir) -> Dir {
        let v = n.0.as_dvec3();
        let i = &self.inv;
        let m =
            DVec3::new(i.x_axis.truncate().dot(v), i.y_axis.truncate().dot(v), i.z_axis.truncate().dot(v));
        Dir::normalize(m.normalize_or_zero().as_vec3())
    }

    /// The box around the mapped box.
    #[must_use]
    pub fn bounds(&self, b: Bounds) -> Bounds {
        if b.is_empty() {
            return b;
        }
        b.corners().iter().fold(Bounds::EMPTY, |acc, &c| acc.grow(self.point(Point(c)).0))
    }
}

impl std::ops::Mul for Transform {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self { m: self.m * other.m, inv: other.inv * self.inv }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn look_at_puts_the_target_on_the_z_axis() {
        let t = Transform::look_at(DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 2.0, 3.0), DVec3::Z).unwrap();
        assert!(t.point(Point::new(4.0, 2.0, 3.0)).distance(Point::new(0.0, 0.0, 3.0)) < 1e-5);
    }

    #[test]
    fn normals_stay_perpendicular_under_uneven_scales() {
        let t = Transform::scale(DVec3::new(1.0, 4.0, 0.5)).unwrap();
        let (tangent, n) = (Vec3::new(1.0, 1.0, 0.0), Dir::normalize(Vec3::new(1.0, -1.0, 0.0)));
        assert!(t.vector(tangent).dot(t.normal(n).0).abs() < 1e-6);
    }

    #[test]
    fn a_singular_matrix_is_refused() {
        assert!(Transform::scale(DVec3::new(1.0, 0.0, 1.0)).is_none());
    }
}
