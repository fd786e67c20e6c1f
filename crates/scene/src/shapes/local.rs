//! What a form knows of one of its points, before anyone asks for materials or lights.

use crate::materials::Detail;
use math::{Dir, Frame, Point, Transform, Vec2, Vec3};

/// A point of a surface, in the space in which its geometry is stored.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalSurface {
    pub(crate) p: Point,
    /// Half-size of the box in which the true point lies.
    pub(crate) p_error: Vec3,
    /// Geometric normal, on the side of `ns`.
    pub(crate) ng: Dir,
    /// Shading normal.
    pub(crate) ns: Dir,
    /// The shading tangent leans this way.
    pub(crate) tangent: Vec3,
    pub(crate) uv: Vec2,
    pub(crate) dpdu: Vec3,
    pub(crate) dpdv: Vec3,
    pub(crate) dndu: Vec3,
    pub(crate) dndv: Vec3,
}

impl LocalSurface {
    /// The shading frame.
    #[inline]
    pub(crate) fn frame(&self, detail: Detail) -> Frame {
        match detail {
            Detail::Frame => Frame::from_normal(self.ns),
            Detail::Tangents | Detail::Curvature => Frame::from_normal_tangent(self.ns, self.tangent),
        }
    }

    /// The same point in the space that `t` maps to; the error grows by the map's own rounding.
    pub(crate) fn transformed(&self, t: &Transform) -> Self {
        let m = t.matrix();
        let abs = |v: math::DVec3| v.abs().as_vec3();
        let p = t.point(self.p);
        let spread = abs(m.x_axis.truncate()) * self.p_error.x
            + abs(m.y_axis.truncate()) * self.p_error.y
            + abs(m.z_axis.truncate()) * self.p_error.z;
        let ns = t.normal(self.ns);
        Self {
            p,
            p_error: spread * 1.000_001 + p.0.abs() * math::error_bound::gamma(3),
            ng: t.normal(self.ng).face_forward(ns),
            ns,
            tangent: t.vector(self.tangent),
            uv: self.uv,
            dpdu: t.vector(self.dpdu),
            dpdv: t.vector(self.dpdv),
            dndu: normal_vector(t, self.dndu),
            dndv: normal_vector(t, self.dndv),
        }
    }
}

/// Maps a change of the normal: by the inverse transpose, without making it unit.
pub(super) fn normal_vector(t: &Transform, v: Vec3) -> Vec3 {
    let (i, v) = (t.inverse_matrix(), v.as_dvec3());
    math::DVec3::new(i.x_axis.truncate().dot(v), i.y_axis.truncate().dot(v), i.z_axis.truncate().dot(v))
        .as_vec3()
}
