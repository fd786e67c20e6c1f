//! Caps of the sphere: cone, hemisphere and whole sphere with uniform density, and the cosine-weighted hemisphere.
//!
//! A cap of height h = 1 − cos θₘ (θₘ at its edge) is the image of the unit disk under a map that keeps areas [Shirley1997]: radius r goes to
//! height t = h r², at distance √(t (2 − t)) = r √(h (2 − t)) from the axis. h = 1 gives the hemisphere, h = 2 the sphere.
//! The height is the parameter, because 1 − cos of a small angle has no bits left in an `f32` cosine.

use std::f32::consts::FRAC_1_PI;

use math::{Dir, LocalDir, Vec2, Vec3, trig};

use crate::{Pdf, SolidAngle, warp};

/// Uniform in the cone about the normal whose edge is at `1 − cos θ_max = one_minus_cos`, in (0, 2].
#[must_use]
pub fn uniform_cone(u: [f32; 2], one_minus_cos: f32) -> LocalDir {
    let d = warp::concentric_disk(u);
    let t = one_minus_cos * d.length_squared().min(1.0);
    let s = trig::safe_sqrt(one_minus_cos * (2.0 - t));
    LocalDir(Vec3::new(d.x * s, d.y * s, 1.0 - t))
}

/// The `u` of a direction of the cone.
#[must_use]
pub fn uniform_cone_inverse(w: LocalDir, one_minus_cos: f32) -> [f32; 2] {
    let xy = Vec2::new(w.0.x, w.0.y);
    // t = 1 − z, from the longer of the two expressions for it.
    let t = if w.0.z > 0.0 { xy.length_squared() / (1.0 + w.0.z) } else { 1.0 - w.0.z };
    let r = trig::safe_sqrt(t / one_minus_cos).min(1.0);
    warp::concentric_disk_inverse(xy.try_normalize().unwrap_or(Vec2::X) * r)
}

/// Density of [`uniform_cone`]: `1 / (2π (1 − cos θ_max))` inside.
#[must_use]
pub fn uniform_cone_pdf(w: LocalDir, one_minus_cos: f32) -> Pdf<SolidAngle> {
    let t = if w.0.z > 0.0 { w.0.truncate().length_squared() / (1.0 + w.0.z) } else { 1.0 - w.0.z };
    // A sample on the very edge may be rounded out of the cone.
    let inside = t <= one_minus_cos * (1.0 + 4.0 * f32::EPSILON);
    Pdf::new(if inside { 0.5 * FRAC_1_PI / one_minus_cos } else { 0.0 })
}

/// Uniform on the hemisphere about the normal.
#[must_use]
pub fn uniform_hemisphere(u: [f32; 2]) -> LocalDir {
    uniform_cone(u, 1.0)
}

/// The `u` of a direction of the hemisphere.
#[must_use]
pub fn uniform_hemisphere_inverse(w: LocalDir) -> [f32; 2] {
    uniform_cone_inverse(w, 1.0)
}

/// Density of [`uniform_hemisphere`]: `1 / 2π` above.
#[must_use]
pub fn uniform_hemisphere_pdf(w: LocalDir) -> Pdf<SolidAngle> {
    Pdf::new(if w.cos_theta() >= 0.0 { 0.5 * FRAC_1_PI } else { 0.0 })
}

/// Uniform on the sphere.
#[must_use]
pub fn uniform_sphere(u: [f32; 2]) -> Dir {
    Dir(uniform_cone(u, 2.0).0)
}

/// The `u` of a direction.
#[must_use]
pub fn uniform_sphere_inverse(w: Dir) -> [f32; 2] {
    uniform_cone_inverse(LocalDir(w.0), 2.0)
}

/// Density of [`uniform_sphere`]: `1 / 4π`.
#[must_use]
pub fn uniform_sphere_pdf() -> Pdf<SolidAngle> {
    Pdf::new(0.25 * FRAC_1_PI)
}

/// Cosine-weighted on the hemisphere about the normal: the disk, lifted [Malley1988].
#[inline]
#[must_use]
pub fn cosine_hemisphere(u: [f32; 2]) -> LocalDir {
    let d = warp::concentric_disk(u);
    LocalDir(Vec3::new(d.x, d.y, trig::safe_sqrt(1.0 - d.length_squared())))
}

/// The `u` of a direction of the hemisphere.
#[must_use]
pub fn cosine_hemisphere_inverse(w: LocalDir) -> [f32; 2] {
    warp::concentric_disk_inverse(w.0.truncate())
}

/// Density of [`cosine_hemisphere`]: `cos θ / π`, zero below.
#[must_use]
pub fn cosine_hemisphere_pdf(w: LocalDir) -> Pdf<SolidAngle> {
    Pdf::new(w.cos_theta().max(0.0) * FRAC_1_PI)
}
