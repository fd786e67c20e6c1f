//! A sphere or a part of one.
//!
//! Whole and seen from outside, it is sampled uniformly in the cone that it fills [PBR4e, sec. 6.2.4], with
//! `1 − cos θ_max = sin² θ_max / (1 + cos θ_max)`, which keeps its digits for small and far spheres. The cone's
//! directions meet the near side only; the far side has density zero.

use std::f32::consts::{PI, TAU};

use math::{Bounds, Dir, Frame, Point, Vec2, Vec3, error_bound::gamma, trig};
use sampling::{Area, Pdf, SolidAngle};

use super::{SurfaceSample, azimuth};
use crate::linear_map::AffineMap;

/// An emitting sphere around the object's origin, from `z_min` to `z_max` and up to the angle `phi_max` (radians).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sphere {
    world_from_object: AffineMap,
    radius: f32,
    z_min: f32,
    z_max: f32,
    phi_max: f32,
    /// −1: emits inwards.
    side: f32,
    area: f32,
    /// World radius of a whole sphere that is still one in the world.
    whole: Option<f32>,
}

impl Sphere {
    /// `None` if it has no area.
    pub(crate) fn new(
        world_from_object: AffineMap,
        radius: f32,
        z: [f32; 2],
        phi_max: f32,
        reverse: bool,
    ) -> Option<Self> {
        let (z_min, z_max) = (z[0].min(z[1]).clamp(-radius, radius), z[0].max(z[1]).clamp(-radius, radius));
        let phi_max = phi_max.clamp(0.0, TAU);
        let scale = world_from_object.linear.uniform_scale();
        let is_whole = z_min == -radius && z_max == radius && phi_max == TAU;
        let mut sphere = Self {
            world_from_object,
            radius,
            z_min,
            z_max,
            phi_max,
            side: if reverse { -1.0 } else { 1.0 },
            area: 0.0,
            whole: scale.filter(|_| is_whole).map(|s| s * radius),
        };
        sphere.area = match scale {
            Some(s) => sphere.object_area() * s * s,
            None => sphere.object_area() * sphere.mean_area_ratio(),
        };
        (radius > 0.0 && sphere.area > 0.0).then_some(sphere)
    }

    fn object_area(&self) -> f32 {
        self.phi_max * self.radius * (self.z_max - self.z_min)
    }

    /// Mean over the object's surface of world area over object area, by a midpoint rule.
    fn mean_area_ratio(&self) -> f32 {
        const N: u16 = 128;
        let mut sum = 0.0_f64;
        for i in 0..N {
            for j in 0..N {
                let u = [i, j].map(|k| (f32::from(k) + 0.5) / f32::from(N));
                let n = self.object_point(u) / self.radius;
                sum += f64::from(self.world_from_object.linear.area_ratio(n));
            }
        }
        (sum / (f64::from(N) * f64::from(N))) as f32
    }

    pub(crate) fn area(&self) -> f32 {
        self.area
    }

    /// Uniform over the object's surface: z is uniform (Archimedes).
    fn object_point(&self, u: [f32; 2]) -> Vec3 {
        let z = self.z_min + (self.z_max - self.z_min) * u[0];
        let (sin, cos) = trig::sin_cos(u[1] * self.phi_max);
        let r = trig::safe_sqrt((self.radius - z) * (self.radius + z));
        Vec3::new(r * cos, r * sin, z)
    }

    pub(crate) fn sample_area(&self, u: [f32; 2]) -> SurfaceSample<Area> {
        let q = self.object_point(u);
        self.at(q, self.pdf_area_at(q / self.radius))
    }

    pub(crate) fn pdf_area(&self, p: Point) -> Pdf<Area> {
        self.pdf_area_at(self.world_from_object.inverse_point(p).normalize_or(Vec3::Z))
    }

    fn pdf_area_at(&self, n: Vec3) -> Pdf<Area> {
        Pdf::new(1.0 / (self.object_area() * self.world_from_object.linear.area_ratio(n)))
    }

    /// `None`: sample by area.
    pub(crate) fn sample(&self, from: Point, u: [f32; 2]) -> Option<SurfaceSample<SolidAngle>> {
        let cone = self.cone(from)?;

        // θ at the viewer, uniform in the cone; α at the centre.
        let h = u[0] * cone.one_minus_cos;
        let (cos_theta, sin2_theta) = (1.0 - h, h * (2.0 - h));
        let cos_alpha =
            sin2_theta / cone.sin2_max.sqrt() + cos_theta * trig::safe_sqrt(1.0 - sin2_theta / cone.sin2_max);
        let sin_alpha = trig::safe_sqrt(1.0 - cos_alpha * cos_alpha);
        let (sin_phi, cos_phi) = trig::sin_cos(u[1] * TAU);
        let frame = Frame::from_normal(cone.to_viewer);
        let n = frame.s * (sin_alpha * cos_phi) + frame.t * (sin_alpha * sin_phi) + frame.n.0 * cos_alpha;

        let center = self.world_from_object.origin;
        let sample =
            self.at(self.world_from_object.inverse_point(Point(center + n * cone.radius)), cone.pdf());
        Some(SurfaceSample { p: Point(center + n * cone.radius), n: Dir(n * self.side), ..sample })
    }

    /// `None`: by area.
    pub(crate) fn pdf(&self, from: Point, p: Point) -> Option<Pdf<SolidAngle>> {
        let cone = self.cone(from)?;
        let (outward, d) = (p.0 - self.world_from_object.origin, from - p);
        let near = outward.dot(d) > -1e-3 * cone.radius * d.length();
        Some(if near { cone.pdf() } else { Pdf::ZERO })
    }

    fn cone(&self, from: Point) -> Option<Cone> {
        let radius = self.whole?;
        let d = from.0 - self.world_from_object.origin;
        let distance_squared = d.length_squared();
        if distance_squared <= radius * radius * (1.0 + 1e-5) {
            return None;
        }
        let sin2_max = radius * radius / distance_squared;
        let one_minus_cos = sin2_max / (1.0 + trig::safe_sqrt(1.0 - sin2_max));
        Some(Cone { radius, to_viewer: Dir(d / distance_squared.sqrt()), sin2_max, one_minus_cos })
    }

    /// The sample at the object's point `q`.
    fn at<M: sampling::Measure>(&self, q: Vec3, pdf: Pdf<M>) -> SurfaceSample<M> {
        let p = self.world_from_object.point(q);
        let theta = trig::safe_acos(q.z / self.radius);
        let theta_of = |z: f32| trig::safe_acos(z / self.radius);
        let (at_min, at_max) = (theta_of(self.z_min), theta_of(self.z_max));
        SurfaceSample {
            p,
            p_error: (self.world_from_object.origin.abs() + (p.0 - self.world_from_object.origin).abs())
                * gamma(8),
            n: Dir(self.world_from_object.normal(q).0 * self.side),
            uv: Vec2::new(azimuth(q.x, q.y) / self.phi_max, (theta - at_min) / (at_max - at_min)),
            pdf,
        }
    }

    pub(crate) fn bounds(&self) -> Bounds {
        let r = Vec3::splat(self.radius);
        let object = Bounds { min: Vec3::new(-r.x, -r.y, self.z_min), max: Vec3::new(r.x, r.y, self.z_max) };
        object.corners().iter().fold(Bounds::EMPTY, |b, &c| b.grow(self.world_from_object.point(c).0))
    }
}

/// The cone that a sphere fills, seen from outside.
struct Cone {
    radius: f32,
    to_viewer: Dir,
    sin2_max: f32,
    one_minus_cos: f32,
}

impl Cone {
    fn pdf(&self) -> Pdf<SolidAngle> {
        Pdf::new(1.0 / (2.0 * PI * self.one_minus_cos))
    }
}
