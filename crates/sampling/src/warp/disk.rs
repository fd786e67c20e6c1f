//! The unit disk, by concentric squares [Shirley1997]: equal areas stay equal and neighbours stay near.

use std::f32::consts::{FRAC_1_PI, FRAC_2_PI, FRAC_PI_4};

use math::{Vec2, trig};

use crate::{Area, Pdf};

/// Uniform on the unit disk.
#[inline]
#[must_use]
pub fn concentric_disk(u: [f32; 2]) -> Vec2 {
    let (x, y) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    // In the wedges about the x axis x is the radius, and the angle is counted from that axis; in those about the y axis, y.
    let exchange = Exchange::unless_larger(x, y);
    let (along, across) = exchange.pair(x, y);
    if along == 0.0 {
        return Vec2::ZERO;
    }
    let (sin, cos) = trig::sin_cos_within_an_eighth(FRAC_PI_4 * (across / along));
    let (x, y) = exchange.pair(along * cos, along * sin);
    Vec2::new(x, y)
}

/// Exchanges pairs, or not, without a branch: half of them would be guessed wrong.
#[derive(Clone, Copy)]
struct Exchange(u32);

impl Exchange {
    /// Unless `|x| > |y|`.
    #[inline]
    fn unless_larger(x: f32, y: f32) -> Self {
        // Bits of positive numbers are in the order of the numbers.
        let [x, y] = [x, y].map(|v| (v.to_bits() & 0x7fff_ffff) as i32);
        Self(!((y - x) >> 31) as u32)
    }

    #[inline]
    fn pair(self, x: f32, y: f32) -> (f32, f32) {
        let (x, y) = (x.to_bits(), y.to_bits());
        let change = (x ^ y) & self.0;
        (f32::from_bits(x ^ change), f32::from_bits(y ^ change))
    }
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
