//! The square and the sphere, with areas kept in proportion: an octahedron unfolded [Clarberg2008].
//!
//! The inner diamond of the square is the upper half (z ≥ 0), its middle +z; the corners meet at −z. The square's first axis
//! is x, its second y: the layout of pbrt-v4's image environments.

use std::f32::consts::{FRAC_1_PI, FRAC_2_PI, FRAC_PI_4};

use math::{Dir, Vec3, trig};

use crate::{Pdf, SolidAngle};

/// Uniform on the sphere; continuous, also across the edges of the square ([`wrap_equal_area`]).
#[must_use]
pub fn equal_area_sphere(u: [f32; 2]) -> Dir {
    let (x, y) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    let (ax, ay) = (x.abs(), y.abs());
    // Signed distance from the diagonal of the quadrant, positive inside the diamond.
    let d = 1.0 - (ax + ay);
    let r = 1.0 - d.abs();
    let phi = if r == 0.0 { FRAC_PI_4 } else { ((ay - ax) / r + 1.0) * FRAC_PI_4 };
    let (sin, cos) = trig::sin_cos(phi);
    let s = r * trig::safe_sqrt(2.0 - r * r);
    Dir(Vec3::new((s * cos).copysign(x), (s * sin).copysign(y), (1.0 - r * r).copysign(d)))
}

/// The point of the square for a direction.
#[must_use]
pub fn equal_area_sphere_inverse(w: Dir) -> [f32; 2] {
    let (ax, ay, az) = (w.0.x.abs(), w.0.y.abs(), w.0.z.abs());
    // r² = 1 − |z|, in the form that keeps its bits near the poles.
    let r = trig::safe_sqrt((ax * ax + ay * ay) / (1.0 + az)).min(1.0);
    let share = if ax == 0.0 && ay == 0.0 { 0.0 } else { trig::atan2(ay, ax) * FRAC_2_PI };
    let (v, u) = (share * r, r - share * r);
    // The lower half is folded out over the diagonal.
    let (u, v) = if w.0.z < 0.0 { (1.0 - v, 1.0 - u) } else { (u, v) };
    [0.5 + 0.5 * u.copysign(w.0.x), 0.5 + 0.5 * v.copysign(w.0.y)]
}

/// Density of [`equal_area_sphere`]: `1 / 4π`.
#[must_use]
pub fn equal_area_sphere_pdf() -> Pdf<SolidAngle> {
    Pdf::new(0.25 * FRAC_1_PI)
}

/// The texel that lies where (x, y) would, up to one size outside a square of `n × n`: the map goes on across an edge
/// mirrored about the edge's middle.
#[must_use]
pub fn wrap_equal_area([mut x, mut y]: [i32; 2], n: i32) -> [i32; 2] {
    if x < 0 || x >= n {
        x = if x < 0 { -1 - x } else { 2 * n - 1 - x };
        y = n - 1 - y;
    }
    if y < 0 || y >= n {
        y = if y < 0 { -1 - y } else { 2 * n - 1 - y };
        x = n - 1 - x;
    }
    [x.clamp(0, n - 1), y.clamp(0, n - 1)]
}
