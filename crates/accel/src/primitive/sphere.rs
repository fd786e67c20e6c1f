//! A sphere about the origin of its own space, or the part of one between two heights and within an angle.
//!
//! In double precision, with the discriminant taken at the point of the line nearest to the centre, which does not
//! cancel [PBR4e, sec. 6.8].

use math::{Bounds, DVec3, Transform};

use super::{Line, Root, Roots, mapped_bounds, phi};
use crate::ray_space::RaySpace;

/// `x² + y² + z² = radius²`, `z_min ≤ z ≤ z_max`, `φ ≤ phi_max`.
///
/// `u = φ / phi_max`; `v` runs linearly in the polar angle from `z_min` to `z_max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
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

impl Sphere {
    /// All of a sphere.
    #[must_use]
    pub fn full(radius: f32, object_from_local: Transform) -> Self {
        Self { radius, z_min: -radius, z_max: radius, phi_max: std::f32::consts::TAU, object_from_local }
    }

    pub(crate) fn is_degenerate(&self) -> bool {
        let finite = [self.radius, self.z_min, self.z_max, self.phi_max].iter().all(|x| x.is_finite());
        !(finite && self.radius > 0.0 && self.z_min < self.z_max && self.phi_max > 0.0)
    }

    pub(crate) fn bounds(&self) -> Bounds {
        let r = f64::from(self.radius);
        let z = |z: f32| f64::from(z).clamp(-r, r);
        mapped_bounds(
            &self.object_from_local,
            DVec3::new(-r, -r, z(self.z_min)),
            DVec3::new(r, r, z(self.z_max)),
        )
    }

    pub(crate) fn roots(&self, ray: &RaySpace) -> Roots {
        let line = Line::local(ray, &self.object_from_local);
        let (r, a) = (f64::from(self.radius), line.d.length_squared());
        let middle = -line.o.dot(line.d) / a;
        let disc = r * r - line.at(middle).length_squared();
        if !(disc >= 0.0) {
            return [None; 2];
        }
        let half = (disc / a).sqrt();
        [self.root(&line, middle - half), self.root(&line, middle + half)]
    }

    /// The point at `t`, if the part reaches there.
    fn root(&self, line: &Line, t: f64) -> Option<Root> {
        let r = f64::from(self.radius);
        let p = line.at(t);
        let p = p * (r / p.length());
        let (lo, hi) = (f64::from(self.z_min).max(-r), f64::from(self.z_max).min(r));
        if (lo > -r && p.z < lo) || (hi < r && p.z > hi) {
            return None;
        }
        let (phi, phi_max) = (phi(p), f64::from(self.phi_max));
        if phi > phi_max && self.phi_max < std::f32::consts::TAU {
            return None;
        }
        let acos = |z: f64| math::trig::f64::acos((z / r).clamp(-1.0, 1.0));
        let v = (acos(p.z) - acos(lo)) / (acos(hi) - acos(lo));
        Some(Root { t, u: (phi / phi_max).min(1.0) as f32, v: v as f32 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::primitive::test_ray;

    #[test]
    fn both_sides_are_found_with_their_parameters() {
        let s = Sphere::full(2.0, Transform::translate(DVec3::new(1.0, 0.0, 0.0)));
        let [Some(a), Some(b)] = s.roots(&test_ray([5.0, 0.0, 0.0], [-1.0, 0.0, 0.0])) else {
            panic!("two roots")
        };
        assert_eq!((a.t, b.t), (2.0, 6.0));
        assert_eq!((a.u, a.v), (0.0, 0.5));
        assert!((b.u - 0.5).abs() < 1e-6 && (b.v - 0.5).abs() < 1e-6);
    }

    #[test]
    fn a_clipped_part_lets_rays_through() {
        let upper = Sphere { z_min: 0.5, ..Sphere::full(1.0, Transform::IDENTITY) };
        let [a, b] = upper.roots(&test_ray([0.0, 0.0, -5.0], [0.0, 0.0, 1.0]));
        assert!(a.is_none() && b.is_some_and(|r| r.t == 6.0 && r.v == 1.0));
        let wedge = Sphere { phi_max: 1.0, ..Sphere::full(1.0, Transform::IDENTITY) };
        let [a, b] = wedge.roots(&test_ray([-5.0, 0.1, 0.0], [1.0, 0.0, 0.0]));
        assert!(a.is_none() && b.is_some());
    }
}
