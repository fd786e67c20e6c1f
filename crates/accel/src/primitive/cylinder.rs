//! The wall of a cylinder about the z axis of its own space, without caps.
//!
//! The discriminant is taken at the point of the line nearest to the axis, as for the sphere.

use math::{Bounds, DVec3, Transform};

use super::{Line, Root, Roots, mapped_bounds, phi};
use crate::ray_space::RaySpace;

/// `x² + y² = radius²`, `z_min ≤ z ≤ z_max`, `φ ≤ phi_max`.
///
/// `u = φ / phi_max`; `v` runs from `z_min` to `z_max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// Radius.
    pub radius: f32,
    /// Lower end.
    pub z_min: f32,
    /// Upper end.
    pub z_max: f32,
    /// Largest angle about z, radians.
    pub phi_max: f32,
    /// Places it.
    pub object_from_local: Transform,
}

impl Cylinder {
    pub(crate) fn is_degenerate(&self) -> bool {
        let finite = [self.radius, self.z_min, self.z_max, self.phi_max].iter().all(|x| x.is_finite());
        !(finite && self.radius > 0.0 && self.z_min < self.z_max && self.phi_max > 0.0)
    }

    pub(crate) fn bounds(&self) -> Bounds {
        let r = f64::from(self.radius);
        let (lo, hi) = (f64::from(self.z_min), f64::from(self.z_max));
        mapped_bounds(&self.object_from_local, DVec3::new(-r, -r, lo), DVec3::new(r, r, hi))
    }

    pub(crate) fn roots(&self, ray: &RaySpace) -> Roots {
        let line = Line::local(ray, &self.object_from_local);
        let (o, d) = (line.o.truncate(), line.d.truncate());
        let (r, a) = (f64::from(self.radius), d.length_squared());
        let middle = -o.dot(d) / a;
        let disc = r * r - (o + d * middle).length_squared();
        if a == 0.0 || !(disc >= 0.0) {
            return [None; 2];
        }
        let half = (disc / a).sqrt();
        [self.root(&line, middle - half), self.root(&line, middle + half)]
    }

    /// The point at `t`, if the wall reaches there.
    fn root(&self, line: &Line, t: f64) -> Option<Root> {
        let p = line.at(t);
        let (lo, hi) = (f64::from(self.z_min), f64::from(self.z_max));
        if !(p.z >= lo && p.z <= hi) {
            return None;
        }
        let (phi, phi_max) = (phi(p), f64::from(self.phi_max));
        if phi > phi_max && self.phi_max < std::f32::consts::TAU {
            return None;
        }
        Some(Root { t, u: (phi / phi_max).min(1.0) as f32, v: ((p.z - lo) / (hi - lo)) as f32 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::primitive::test_ray;

    #[test]
    fn the_wall_is_hit_twice_and_the_ends_are_open() {
        let tau = std::f32::consts::TAU;
        let c = Cylinder {
            radius: 1.0,
            z_min: 0.0,
            z_max: 2.0,
            phi_max: tau,
            object_from_local: Transform::IDENTITY,
        };
        let [Some(a), Some(b)] = c.roots(&test_ray([3.0, 0.0, 0.5], [-1.0, 0.0, 0.0])) else {
            panic!("two roots")
        };
        assert_eq!((a.t, a.u, a.v), (2.0, 0.0, 0.25));
        assert_eq!((b.t, b.v), (4.0, 0.25));
        assert_eq!(c.roots(&test_ray([0.5, 0.0, 5.0], [0.0, 0.0, -1.0])), [None; 2]);
        assert_eq!(c.roots(&test_ray([3.0, 0.0, 2.5], [-1.0, 0.0, 0.0])), [None; 2]);
    }
}
