//! A disk, a ring, or a sector of one, across the object's z axis.

use std::f32::consts::TAU;

use math::{Bounds, Dir, Vec2, Vec3, error_bound::gamma, trig};
use sampling::{Area, Pdf, warp};

use super::{NormalCone, SurfaceSample, azimuth};
use crate::linear_map::AffineMap;

/// An emitting disk; it emits to the object's +z, or −z when reversed. `phi_max` in radians.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Disk {
    world_from_object: AffineMap,
    height: f32,
    radius: f32,
    inner_radius: f32,
    phi_max: f32,
    n: Dir,
    area: f32,
}

impl Disk {
    /// `None` if it has no area. `radii`: outer, inner.
    pub(crate) fn new(
        world_from_object: AffineMap,
        height: f32,
        radii: [f32; 2],
        phi_max: f32,
        reverse: bool,
    ) -> Option<Self> {
        let [radius, inner_radius] = radii;
        let phi_max = phi_max.clamp(0.0, TAU);
        let n = world_from_object.normal(Vec3::Z);
        let object_area = 0.5 * phi_max * (radius * radius - inner_radius * inner_radius);
        let area = object_area * world_from_object.linear.area_ratio(Vec3::Z);
        let n = if reverse { -n } else { n };
        let disk = Self { world_from_object, height, radius, inner_radius, phi_max, n, area };
        (area > 0.0 && area.is_finite()).then_some(disk)
    }

    pub(crate) fn area(&self) -> f32 {
        self.area
    }

    pub(crate) fn pdf_area(&self) -> Pdf<Area> {
        Pdf::new(1.0 / self.area)
    }

    pub(crate) fn sample_area(&self, u: [f32; 2]) -> SurfaceSample<Area> {
        let (r0, r1) = (self.inner_radius, self.radius);
        let (q, r) = if r0 == 0.0 && self.phi_max == TAU {
            let d = warp::concentric_disk(u) * r1;
            (d, d.length())
        } else {
            // r² is uniform between the squares of both radii.
            let r = (r0 * r0 + (r1 * r1 - r0 * r0) * u[0]).sqrt();
            let (sin, cos) = trig::sin_cos(u[1] * self.phi_max);
            (Vec2::new(r * cos, r * sin), r)
        };
        let p = self.world_from_object.point(q.extend(self.height));
        let origin = self.world_from_object.origin;
        SurfaceSample {
            p,
            p_error: (origin.abs() + (p.0 - origin).abs()) * gamma(6),
            n: self.n,
            uv: Vec2::new(azimuth(q.x, q.y) / self.phi_max, (r1 - r) / (r1 - r0)),
            pdf: self.pdf_area(),
        }
    }

    pub(crate) fn bounds(&self) -> Bounds {
        let r = self.radius;
        let object = Bounds { min: Vec3::new(-r, -r, self.height), max: Vec3::new(r, r, self.height) };
        object.corners().iter().fold(Bounds::EMPTY, |b, &c| b.grow(self.world_from_object.point(c).0))
    }

    pub(crate) fn normals(&self) -> NormalCone {
        NormalCone { axis: self.n, cos_theta: 1.0 }
    }
}
