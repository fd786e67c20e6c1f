//! A disk, ring or sector in a plane of constant z of its own space.

use math::{Bounds, DVec3, Transform};

use super::{Line, Root, Roots, mapped_bounds, phi};
use crate::ray_space::RaySpace;

/// `z = height`, `inner_radius² ≤ x² + y² ≤ radius²`, `φ ≤ phi_max`.
///
/// `u = φ / phi_max`; `v` is 0 at the rim and 1 at the inner radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disk {
    /// Height above the xy plane.
    pub height: f32,
    /// Outer radius.
    pub radius: f32,
    /// Radius of the hole.
    pub inner_radius: f32,
    /// Largest angle about z, radians.
    pub phi_max: f32,
    /// Places it.
    pub object_from_local: Transform,
}

impl Disk {
    pub(crate) fn is_degenerate(&self) -> bool {
        let all = [self.height, self.radius, self.inner_radius, self.phi_max];
        let finite = all.iter().all(|x| x.is_finite());
        !(finite && self.radius > 0.0 && self.inner_radius < self.radius && self.phi_max > 0.0)
    }

    pub(crate) fn bounds(&self) -> Bounds {
        let (r, z) = (f64::from(self.radius), f64::from(self.height));
        mapped_bounds(&self.object_from_local, DVec3::new(-r, -r, z), DVec3::new(r, r, z))
    }

    pub(crate) fn roots(&self, ray: &RaySpace) -> Roots {
        let line = Line::local(ray, &self.object_from_local);
        [self.root(&line), None]
    }

    fn root(&self, line: &Line) -> Option<Root> {
        if line.d.z == 0.0 {
            return None;
        }
        let t = (f64::from(self.height) - line.o.z) / line.d.z;
        let p = line.at(t);
        let r2 = p.x * p.x + p.y * p.y;
        let (outer, inner) = (f64::from(self.radius), f64::from(self.inner_radius));
        if !(r2 <= outer * outer && r2 >= inner * inner) {
            return None;
        }
        let (phi, phi_max) = (phi(p), f64::from(self.phi_max));
        if phi > phi_max && self.phi_max < std::f32::consts::TAU {
            return None;
        }
        let v = (outer - r2.sqrt()) / (outer - inner);
        Some(Root { t, u: (phi / phi_max).min(1.0) as f32, v: v as f32 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::primitive::test_ray;

    #[test]
    fn the_ring_is_hit_and_its_hole_is_not() {
        let tau = std::f32::consts::TAU;
        let ring = Disk {
            height: 1.0,
            radius: 2.0,
            inner_radius: 1.0,
            phi_max: tau,
            object_from_local: Transform::IDENTITY,
        };
        let at = |x: f32| ring.roots(&test_ray([x, 0.0, 4.0], [0.0, 0.0, -1.0]))[0];
        assert_eq!(at(1.5), Some(Root { t: 3.0, u: 0.0, v: 0.5 }));
        assert!(at(0.5).is_none() && at(2.5).is_none());
        assert!(ring.roots(&test_ray([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]))[0].is_none());
    }
}
