//! The unit disk, by concentric squares [Shirley1997]: equal areas stay equal and neighbours stay near.

use std::f32::consts::{FRAC_1_PI, FRAC_2_PI, FRAC_PI_2, FRAC_PI_4};

use math::{Vec2, trig};

use crate::{Area, Pdf};

/// Uniform on the unit disk.
#[must_use]
pub fn concentric_disk(u: [f32; 2]) -> Vec2 {
    let (x, y) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    if x == 0.0 && y == 0.0 {
        return Vec2::ZERO;
    }
    let (r, phi) =
        if x.abs() > y.abs() { (x, FRAC_PI_4 * (y / x)) } else { (y, FRAC_PI_2 - FRAC_PI_4 * (x / y)) };
    let (sin, cos) = trig::sin_cos(phi);
    Vec2::new(r * cos, r * sin)
}

/// The `u` of a point of the disk.
#[must_use]
pub fn concentric_disk_inverse(p: Vec2) -> [f32; 2] {
    let r = p.length();
    if r == 0.0 {
        return [0.5; 2];
    }
    // In the wedges about the x axis |x| is the radius, in those about the y axis |y|.
    let (x, y) = if p.x.abs() > p.y.abs() {
        let side = r.copysign(p.x);
        (side, 2.0 * FRAC_2_PI * trig::atan(p.y / p.x) * side)
    } else {
        let side = r.copysign(p.y);
        (2.0 * FRAC_2_PI * trig::atan(p.x / p.y) * side, side)
    };
    [0.5 + 0.5 * x, 0.5 + 0.5 * y]
}

/// Density of [`concentric_disk`]: `1/π` inside.
#[must_use]
pub fn concentric_disk_pdf(p: Vec2) -> Pdf<Area> {
    Pdf::new(if p.length_squared() <= 1.0 { FRAC_1_PI } else { 0.0 })
}
