//! The side of a cylinder about the object's z axis, or a sector of it.

use std::f32::consts::TAU;

use math::{Bounds, Dir, Point, Vec2, Vec3, error_bound::gamma, trig};
use sampling::{Area, Pdf};

use super::{SurfaceSample, azimuth};
use crate::linear_map::AffineMap;

/// An emitting cylinder; it emits outwards, or inwards when reversed. `phi_max` in radians.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cylinder {
    world_from_object: AffineMap,
    radius: f32,
    z_min: f32,
    z_max: f32,
    phi_max: f32,
    side: f32,
    area: f32,
}

impl Cylinder {
    /// `None` if it has no area.
    pub(crate) fn new(
        world_from_object: AffineMap,
        radius: f32,
        z: [f32; 2],
        phi_max: f32,
        reverse: bool,
    ) -> Option<Self> {
        let mut cylinder = Self {
            world_from_object,
            radius,
            z_min: z[0].min(z[1]),
            z_max: z[0].max(z[1]),
            phi_max: phi_max.clamp(0.0, TAU),
            side: if reverse { -1.0 } else { 1.0 },
            area: 0.0,
        };
        cylinder.area = cylinder.object_area() * cylinder.mean_area_ratio();
        (cylinder.area > 0.0 && cylinder.area.is_finite()).then_some(cylinder)
    }

    fn object_area(&self) -> f32 {
        self.phi_max * self.radius * (self.z_max - self.z_min)
    }

    /// Mean over the angle of world area over object area, by a midpoint rule.
    fn mean_area_ratio(&self) -> f32 {
        const N: u16 = 1024;
        let sum: f64 = (0..N)
            .map(|i| {
                let (sin, cos) = trig::sin_cos((f32::from(i) + 0.5) / f32::from(N) * self.phi_max);
                f64::from(self.world_from_object.linear.area_ratio(Vec3::new(cos, sin, 0.0)))
            })
            .sum();
        (sum / f64::from(N)) as f32
    }

    pub(crate) fn area(&self) -> f32 {
        self.area
    }

    /// Uniform over the object's surface.
    pub(crate) fn sample_area(&self, u: [f32; 2]) -> SurfaceSample<Area> {
        let (sin, cos) = trig::sin_cos(u[1] * self.phi_max);
        let n = Vec3::new(cos, sin, 0.0);
        let z = self.z_min + (self.z_max - self.z_min) * u[0];
        let p = self.world_from_object.point(n * self.radius + Vec3::Z * z);
        let origin = self.world_from_object.origin;
        SurfaceSample {
            p,
            p_error: (origin.abs() + (p.0 - origin).abs()) * gamma(8),
            n: Dir(self.world_from_object.normal(n).0 * self.side),
            uv: Vec2::new(azimuth(cos, sin) / self.phi_max, u[0]),
            pdf: self.pdf_area_at(n),
        }
    }

    pub(crate) fn pdf_area(&self, p: Point) -> Pdf<Area> {
        let q = self.world_from_object.inverse_point(p);
        self.pdf_area_at(Vec3::new(q.x, q.y, 0.0).normalize_or(Vec3::X))
    }

    fn pdf_area_at(&self, n: Vec3) -> Pdf<Area> {
        Pdf::new(1.0 / (self.object_area() * self.world_from_object.linear.area_ratio(n)))
    }

    pub(crate) fn bounds(&self) -> Bounds {
        let r = self.radius;
        let object = Bounds { min: Vec3::new(-r, -r, self.z_min), max: Vec3::new(r, r, self.z_max) };
        object.corners().iter().fold(Bounds::EMPTY, |b, &c| b.grow(self.world_from_object.point(c).0))
    }
}
