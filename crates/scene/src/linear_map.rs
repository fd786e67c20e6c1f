//! A linear map in single precision with its inverse: what cameras, lights and analytic emitters need of a
//! transform on a path.

use math::{DMat4, DVec3, Dir, Point, Transform, Vec3, error_bound::gamma};

/// The linear part of an affine transform. Columns are the images of the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LinearMap {
    columns: [Vec3; 3],
    inverse: [Vec3; 3],
    inverse_det: f32,
}

/// An affine map: a linear one, then a shift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AffineMap {
    pub(crate) linear: LinearMap,
    pub(crate) origin: Vec3,
}

impl LinearMap {
    /// The linear part of a transform that is affine, perhaps but for rounding; `None` unless it is finite both ways.
    fn of_affine(t: &Transform) -> Option<Self> {
        let ok = t.matrix().is_finite() && t.inverse_matrix().is_finite();
        let (columns, inverse) = (columns(&t.matrix()), columns(&t.inverse_matrix()));
        ok.then(|| Self {
            columns: columns.map(|c| c.as_vec3()),
            inverse: inverse.map(|c| c.as_vec3()),
            inverse_det: inverse[0].dot(inverse[1].cross(inverse[2])).abs() as f32,
        })
    }

    #[inline]
    pub(crate) fn apply(&self, v: Vec3) -> Vec3 {
        self.columns[0] * v.x + self.columns[1] * v.y + self.columns[2] * v.z
    }

    #[inline]
    pub(crate) fn apply_inverse(&self, v: Vec3) -> Vec3 {
        self.inverse[0] * v.x + self.inverse[1] * v.y + self.inverse[2] * v.z
    }

    /// A normal, by the transpose of the inverse; not unit.
    #[inline]
    pub(crate) fn apply_normal(&self, n: Vec3) -> Vec3 {
        Vec3::new(self.inverse[0].dot(n), self.inverse[1].dot(n), self.inverse[2].dot(n))
    }

    /// A normal the other way; not unit.
    #[inline]
    pub(crate) fn apply_inverse_normal(&self, n: Vec3) -> Vec3 {
        Vec3::new(self.columns[0].dot(n), self.columns[1].dot(n), self.columns[2].dot(n))
    }

    /// Image area over area, on a plane with the unit normal `n` before the map: |det M| |M⁻ᵀ n|.
    pub(crate) fn area_ratio(&self, n: Vec3) -> f32 {
        self.apply_normal(n).length() / self.inverse_det
    }

    /// Solid angle before the map over solid angle after it, about a direction whose inverse image has the length
    /// `inverse_length`: |det M⁻¹| / |M⁻¹ w|³.
    pub(crate) fn inverse_solid_angle_ratio(&self, inverse_length: f32) -> f32 {
        self.inverse_det / (inverse_length * inverse_length * inverse_length)
    }

    /// The factor on all lengths, if it is the same in all directions (to a relative 10⁻⁵).
    pub(crate) fn uniform_scale(&self) -> Option<f32> {
        let s = self.columns[0].length();
        let even = (1..3).all(|i| (self.columns[i].length() / s - 1.0).abs() < 1e-5);
        let square = (0..3).all(|i| self.columns[i].dot(self.columns[(i + 1) % 3]).abs() < 1e-5 * s * s);
        (even && square).then_some(s)
    }
}

impl AffineMap {
    /// Changes nothing.
    pub(crate) const IDENTITY: Self = Self {
        linear: LinearMap {
            columns: [Vec3::X, Vec3::Y, Vec3::Z],
            inverse: [Vec3::X, Vec3::Y, Vec3::Z],
            inverse_det: 1.0,
        },
        origin: Vec3::ZERO,
    };

    /// `None` unless `t` is affine and finite both ways.
    pub(crate) fn of(t: &Transform) -> Option<Self> {
        if t.is_affine() { Self::of_affine(t) } else { None }
    }

    /// Of a transform that is affine, but perhaps for rounding: a product with an inverse.
    pub(crate) fn of_affine(t: &Transform) -> Option<Self> {
        let origin = t.matrix().w_axis.truncate().as_vec3();
        LinearMap::of_affine(t).map(|linear| Self { linear, origin })
    }

    /// Maps a point that lies in a box of half-size `error`; gives the box around its image too.
    pub(crate) fn point_with_error(&self, p: Vec3, error: Vec3) -> (Point, Vec3) {
        let by_size = |v: Vec3| {
            let c = self.linear.columns;
            c[0].abs() * v.x + c[1].abs() * v.y + c[2].abs() * v.z
        };
        let rounding = (self.origin.abs() + by_size(p.abs())) * gamma(5);
        (self.point(p), by_size(error) * 1.000_001 + rounding)
    }

    #[inline]
    pub(crate) fn point(&self, p: Vec3) -> Point {
        Point(self.origin + self.linear.apply(p))
    }

    #[inline]
    pub(crate) fn inverse_point(&self, p: Point) -> Vec3 {
        self.linear.apply_inverse(p.0 - self.origin)
    }

    /// A unit normal.
    #[inline]
    pub(crate) fn normal(&self, n: Vec3) -> Dir {
        Dir::normalize(self.linear.apply_normal(n))
    }
}

fn columns(m: &DMat4) -> [DVec3; 3] {
    [m.x_axis.truncate(), m.y_axis.truncate(), m.z_axis.truncate()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_and_solid_angles_follow_the_map() {
        let t = Transform::scale(DVec3::new(2.0, 3.0, 0.5)).unwrap();
        let m = LinearMap::of_affine(&t).unwrap();
        assert!((m.area_ratio(Vec3::Z) - 6.0).abs() < 1e-5 && (m.area_ratio(Vec3::X) - 1.5).abs() < 1e-5);
        assert!(m.uniform_scale().is_none());
        // A small square about +x: its solid angle before and after.
        let h = 1e-2;
        let corner = |y, z| Vec3::new(1.0, y, z);
        let solid_angle = |a: Vec3, b: Vec3, c: Vec3| (b - a).cross(c - a).dot(a) / a.length().powi(3);
        let before = solid_angle(corner(0.0, 0.0), corner(h, 0.0), corner(0.0, h));
        let [a, b, c] = [corner(0.0, 0.0), corner(h, 0.0), corner(0.0, h)].map(|v| m.apply(v));
        let w = a.normalize();
        let ratio = m.inverse_solid_angle_ratio(m.apply_inverse(w).length());
        assert!((before / solid_angle(a, b, c) / ratio - 1.0).abs() < 1e-3);
    }
}
