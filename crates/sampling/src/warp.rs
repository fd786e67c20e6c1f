//! From the unit square to where samples are wanted: each warp with its density and its inverse.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4};

use math::{LocalDir, Vec2, Vec3, trig};

use crate::{Pdf, SolidAngle};

/// Uniform on the unit disk, by concentric squares [Shirley1997].
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

/// Cosine-weighted on the hemisphere about the normal.
#[must_use]
pub fn cosine_hemisphere(u: [f32; 2]) -> LocalDir {
    let d = concentric_disk(u);
    LocalDir(Vec3::new(d.x, d.y, trig::safe_sqrt(1.0 - d.length_squared())))
}

/// Density of [`cosine_hemisphere`]: `cos θ / π`, zero below.
#[must_use]
pub fn cosine_hemisphere_pdf(w: LocalDir) -> Pdf<SolidAngle> {
    Pdf::new(w.cos_theta().max(0.0) * FRAC_1_PI)
}
