//! Spheres, disks and cylinders: (u, v), derivatives and normals from the hit point [PBR4e, sec. 6.2–6.4].

use math::{Dir, Point, Transform, Vec2, Vec3, error_bound::gamma, trig};

use super::LocalSurface;

/// A quadric with its place.
#[derive(Clone, Debug)]
pub(crate) struct Quadric {
    pub(crate) kind: QuadricKind,
    pub(crate) world_from_object: Transform,
    /// Does the normal point the other way?
    pub(crate) flip: bool,
}

/// The forms, angles in radians.
#[derive(Clone, Copy, Debug)]
pub(crate) enum QuadricKind {
    Sphere { radius: f32, z_min: f32, z_max: f32, phi_max: f32 },
    Disk { height: f32, radius: f32, inner_radius: f32, phi_max: f32 },
    Cylinder { radius: f32, z_min: f32, z_max: f32, phi_max: f32 },
}

impl Quadric {
    /// The surface at parameters (u, v) in [0, 1]²; `p` is the hit point in the space of storage.
    pub(crate) fn at(&self, u: f32, v: f32, p: Point) -> LocalSurface {
        let object = self.world_from_object.inverse().point(p);
        let (p, dpdu, dpdv, normal) = self.kind.point(object, v);
        let normal = if self.flip { -normal } else { normal };
        let (dndu, dndv) = self.kind.normal_derivatives(dpdu, dpdv);
        let sign = if self.flip { -1.0 } else { 1.0 };
        LocalSurface {
            p: Point(p),
            p_error: p.abs() * gamma(5),
            ng: normal,
            ns: normal,
            tangent: dpdu,
            uv: Vec2::new(u, v),
            dpdu,
            dpdv,
            dndu: dndu * sign,
            dndv: dndv * sign,
        }
        .transformed(&self.world_from_object)
    }
}

impl QuadricKind {
    /// The point moved onto the surface, its derivatives, and the outward normal.
    fn point(&self, p: Point, v: f32) -> (Vec3, Vec3, Vec3, Dir) {
        match *self {
            Self::Sphere { radius, z_min, z_max, phi_max } => {
                let mut p = Dir::normalize(p.0).0 * radius;
                if p.x == 0.0 && p.y == 0.0 {
                    p.x = 1e-5 * radius;
                }
                let r_xy = p.truncate().length();
                let (cos, sin) = (p.x / r_xy, p.y / r_xy);
                let d_theta = trig::safe_acos(z_max / radius) - trig::safe_acos(z_min / radius);
                let dpdu = Vec3::new(-phi_max * p.y, phi_max * p.x, 0.0);
                let dpdv = Vec3::new(p.z * cos, p.z * sin, -r_xy) * d_theta;
                (p, dpdu, dpdv, Dir::normalize(p))
            }
            Self::Disk { height, radius, inner_radius, phi_max } => {
                let p = Vec3::new(p.0.x, p.0.y, height);
                let r = (radius - v * (radius - inner_radius)).max(1e-6 * radius);
                let dpdu = Vec3::new(-phi_max * p.y, phi_max * p.x, 0.0);
                let dpdv = Vec3::new(p.x, p.y, 0.0) * ((inner_radius - radius) / r);
                let dpdu = if dpdu == Vec3::ZERO { Vec3::Y * phi_max } else { dpdu };
                let dpdv = if dpdv == Vec3::ZERO { Vec3::X * (inner_radius - radius) } else { dpdv };
                (p, dpdu, dpdv, Dir::Z)
            }
            Self::Cylinder { radius, z_min, z_max, phi_max } => {
                let scale = radius / p.0.truncate().length().max(f32::MIN_POSITIVE);
                let p = Vec3::new(p.0.x * scale, p.0.y * scale, p.0.z);
                let dpdu = Vec3::new(-phi_max * p.y, phi_max * p.x, 0.0);
                (p, dpdu, Vec3::Z * (z_max - z_min), Dir::normalize(Vec3::new(p.x, p.y, 0.0)))
            }
        }
    }

    /// Change of the outward unit normal along `dpdu` and `dpdv`.
    fn normal_derivatives(&self, dpdu: Vec3, dpdv: Vec3) -> (Vec3, Vec3) {
        match *self {
            Self::Sphere { radius, .. } => (dpdu / radius, dpdv / radius),
            Self::Disk { .. } => (Vec3::ZERO, Vec3::ZERO),
            Self::Cylinder { radius, .. } => (dpdu / radius, Vec3::ZERO),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(kind: QuadricKind, p: Vec3, v: f32) -> LocalSurface {
        Quadric { kind, world_from_object: Transform::IDENTITY, flip: false }.at(0.1, v, Point(p))
    }

    #[test]
    fn derivatives_cross_to_the_outward_normal() {
        let tau = std::f32::consts::TAU;
        let sphere = QuadricKind::Sphere { radius: 2.0, z_min: -2.0, z_max: 2.0, phi_max: tau };
        let disk = QuadricKind::Disk { height: 1.0, radius: 2.0, inner_radius: 0.0, phi_max: tau };
        let cylinder = QuadricKind::Cylinder { radius: 2.0, z_min: -1.0, z_max: 1.0, phi_max: tau };
        for (kind, p) in [
            (sphere, Vec3::new(1.0, -1.0, 1.4)),
            (disk, Vec3::new(0.6, 0.8, 1.0)),
            (cylinder, Vec3::new(-1.2, 1.6, 0.3)),
        ] {
            let s = at(kind, p, 0.5);
            let n = s.dpdu.cross(s.dpdv).normalize();
            assert!((n - s.ng.0).length() < 1e-5, "{kind:?}: {n} against {:?}", s.ng);
        }
    }
}
