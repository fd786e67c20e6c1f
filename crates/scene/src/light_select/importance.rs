//! What a cluster of lights may send to a point: an upper estimate of irradiance [Conty2018], [PBR4e, sec. 12.6.3].
//!
//! `φ cos θ' |cos θ'_i| / d²`, where θ' is the least angle between the point and the cluster's normals, and θ'_i that
//! between the point's normal and the cluster, both over the sphere around the cluster's box.
//!
//! Departs from the book: the distance is at least the sphere's radius (the book compares a squared length with a
//! length). A cluster that emits past the horizon of its normals has its cosine rescaled to stay positive.

use math::{Vec3, trig};

use crate::LightContext;
use crate::lights::LightBounds;

/// Light bounds, ready to be weighed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cluster {
    center: Vec3,
    radius_squared: f32,
    axis: Vec3,
    power: f32,
    cos_theta_o: f32,
    sin_theta_o: f32,
    cos_theta_e: f32,
    two_sided: bool,
}

impl Cluster {
    pub(super) fn new(b: &LightBounds) -> Self {
        let (center, radius) = b.bounds.bounding_sphere();
        Self {
            center: center.0,
            radius_squared: radius * radius,
            axis: b.axis.0,
            power: b.power,
            cos_theta_o: b.cos_theta_o,
            sin_theta_o: sin_of(b.cos_theta_o),
            cos_theta_e: b.cos_theta_e,
            two_sided: b.two_sided,
        }
    }

    /// Zero only if nothing of the cluster reaches the point.
    pub(super) fn importance(&self, context: &LightContext) -> f32 {
        let d = context.p.0 - self.center;
        let distance_squared = d.length_squared();
        let away = if distance_squared > 0.0 { d / distance_squared.sqrt() } else { self.axis };

        // θ_b: half angle of the sphere around the box, all directions from within.
        let cos_b = if distance_squared > self.radius_squared {
            trig::safe_sqrt(1.0 - self.radius_squared / distance_squared)
        } else {
            -1.0
        };
        let sin_b = sin_of(cos_b);

        // θ' = max(0, θ_w − θ_o − θ_b) must stay below θ_e.
        let cos_w = self.axis.dot(away);
        let cos_w = if self.two_sided { cos_w.abs() } else { cos_w };
        let sin_w = sin_of(cos_w);
        let cos_x = cos_difference(sin_w, cos_w, self.sin_theta_o, self.cos_theta_o);
        let sin_x = sin_difference(sin_w, cos_w, self.sin_theta_o, self.cos_theta_o);
        let cos = cos_difference(sin_x, cos_x, sin_b, cos_b);
        if cos <= self.cos_theta_e {
            return 0.0;
        }
        let cos =
            if self.cos_theta_e < 0.0 { (cos - self.cos_theta_e) / (1.0 - self.cos_theta_e) } else { cos };

        let mut importance =
            self.power * cos / distance_squared.max(self.radius_squared).max(f32::MIN_POSITIVE);
        if let Some(n) = context.ns {
            let cos_i = n.0.dot(away).abs();
            importance *= cos_difference(sin_of(cos_i), cos_i, sin_b, cos_b);
        }
        importance.clamp(0.0, 1e30)
    }
}

fn sin_of(cos: f32) -> f32 {
    trig::safe_sqrt((1.0 - cos) * (1.0 + cos))
}

/// cos(max(0, a − b)).
fn cos_difference(sin_a: f32, cos_a: f32, sin_b: f32, cos_b: f32) -> f32 {
    if cos_a > cos_b { 1.0 } else { cos_a * cos_b + sin_a * sin_b }
}

/// sin(max(0, a − b)).
fn sin_difference(sin_a: f32, cos_a: f32, sin_b: f32, cos_b: f32) -> f32 {
    if cos_a > cos_b { 0.0 } else { sin_a * cos_b - cos_a * sin_b }
}
