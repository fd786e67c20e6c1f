//! What clusters of lights may send to a point: an upper estimate of irradiance [Conty2018], [PBR4e, sec. 12.6.3].
//!
//! `φ cos θ' |cos θ'_i| / d²`, where θ' is the least angle between the point and the cluster's normals, and `θ'_i` that
//! between the point's normal and the cluster, both over the sphere around the cluster's box.
//!
//! Four clusters are weighed at once, each in a lane of its own, without branches.
//!
//! Departs from the book: the distance is at least the sphere's radius (the book compares a squared length with a
//! length). A cluster that emits past the horizon of its normals has its cosine rescaled to stay positive.

use math::{Vec3, Vec4};

use crate::LightContext;
use crate::lights::LightBounds;

/// Clusters in one [`Clusters`].
pub(super) const LANES: usize = 4;

/// Four light bounds, ready to be weighed. Lanes without a cluster have no power.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Clusters {
    center: Lanes3,
    radius: Vec4,
    axis: Lanes3,
    power: Vec4,
    cos_theta_o: Vec4,
    sin_theta_o: Vec4,
    cos_theta_e: Vec4,
    /// Where the cosine to the normals counts as zero.
    horizon: Vec4,
    /// −1: the axis counts both ways; 0: one way.
    sides: Vec4,
}

/// Four vectors.
#[derive(Clone, Copy, Debug, Default)]
struct Lanes3 {
    x: Vec4,
    y: Vec4,
    z: Vec4,
}

impl Clusters {
    /// Of at most four.
    pub(super) fn new<'a>(bounds: impl IntoIterator<Item = &'a LightBounds>) -> Self {
        let mut c = Self::default();
        for (i, b) in bounds.into_iter().enumerate() {
            let (center, radius) = b.bounds.bounding_sphere();
            c.center.set(i, center.0);
            c.axis.set(i, b.axis.0);
            c.radius[i] = radius;
            c.power[i] = b.power;
            c.cos_theta_o[i] = b.cos_theta_o;
            c.sin_theta_o[i] = ((1.0 - b.cos_theta_o) * (1.0 + b.cos_theta_o)).max(0.0).sqrt();
            c.cos_theta_e[i] = b.cos_theta_e;
            c.horizon[i] = b.cos_theta_e.min(0.0);
            c.sides[i] = if b.two_sided { -1.0 } else { 0.0 };
        }
        c
    }

    /// Zero only where nothing of a cluster reaches the point.
    pub(super) fn importances(&self, context: &LightContext) -> [f32; LANES] {
        let d = self.center.towards(context.p.0);
        let at_least = d.dot(&d).max(Vec4::splat(f32::MIN_POSITIVE));
        let inverse = sqrt(at_least).recip();

        // θ_b: half angle of the sphere around the box; all directions from within.
        let sin_b = self.radius * inverse;
        let is_inside = sin_b.cmpge(Vec4::ONE);
        let cos_b = Vec4::select(is_inside, Vec4::NEG_ONE, cos_of(sin_b));
        let sin_b = Vec4::select(is_inside, Vec4::ZERO, sin_b);

        // θ' = max(0, θ_w − θ_o − θ_b) must stay below θ_e.
        let cos_w = self.axis.dot(&d) * inverse;
        let cos_w = Vec4::select(self.sides.cmplt(Vec4::ZERO), cos_w.abs(), cos_w);
        let sin_w = cos_of(cos_w);
        let is_in_cone = cos_w.cmpgt(self.cos_theta_o);
        let cos_x = cos_w * self.cos_theta_o + sin_w * self.sin_theta_o;
        let sin_x = sin_w * self.cos_theta_o - cos_w * self.sin_theta_o;
        let cos_x = Vec4::select(is_in_cone, Vec4::ONE, cos_x);
        let sin_x = Vec4::select(is_in_cone, Vec4::ZERO, sin_x);
        let cos = cos_difference(sin_x, cos_x, sin_b, cos_b);

        // The receiver's cosine, as large as the cluster's width allows.
        let receiver = context.ns.map_or(Vec4::ONE, |n| {
            let cos_i = (d.dot_all(n.0) * inverse).abs();
            cos_difference(cos_of(cos_i), cos_i, sin_b, cos_b)
        });

        let emitter = (cos - self.horizon) / (Vec4::ONE - self.horizon);
        let nearest = at_least.max(self.radius * self.radius);
        let value = (self.power * emitter * receiver / nearest).clamp(Vec4::ZERO, Vec4::splat(1e30));
        Vec4::select(cos.cmpgt(self.cos_theta_e), value, Vec4::ZERO).to_array()
    }
}

impl Lanes3 {
    fn set(&mut self, lane: usize, v: Vec3) {
        (self.x[lane], self.y[lane], self.z[lane]) = (v.x, v.y, v.z);
    }

    /// From each to `p`.
    fn towards(&self, p: Vec3) -> Self {
        Self { x: Vec4::splat(p.x) - self.x, y: Vec4::splat(p.y) - self.y, z: Vec4::splat(p.z) - self.z }
    }

    fn dot(&self, other: &Self) -> Vec4 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    fn dot_all(&self, v: Vec3) -> Vec4 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}

fn sqrt(v: Vec4) -> Vec4 {
    v.map(f32::sqrt)
}

/// √(1 − s²): the cosine to a sine and the other way round.
fn cos_of(sin: Vec4) -> Vec4 {
    sqrt(((Vec4::ONE - sin) * (Vec4::ONE + sin)).max(Vec4::ZERO))
}

/// cos(max(0, a − b)).
fn cos_difference(sin_a: Vec4, cos_a: Vec4, sin_b: Vec4, cos_b: Vec4) -> Vec4 {
    Vec4::select(cos_a.cmpgt(cos_b), Vec4::ONE, cos_a * cos_b + sin_a * sin_b)
}
