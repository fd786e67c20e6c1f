//! The triangle, by a map from the square that keeps areas and distorts little [Heitz2019].

use crate::{Area, Pdf};

/// Barycentric coordinates, uniform over the triangle.
#[must_use]
pub fn uniform_triangle(u: [f32; 2]) -> [f32; 3] {
    let (b0, b1) = if u[0] < u[1] {
        let b0 = 0.5 * u[0];
        (b0, u[1] - b0)
    } else {
        let b1 = 0.5 * u[1];
        (u[0] - b1, b1)
    };
    [b0, b1, (1.0 - b0 - b1).max(0.0)]
}

/// The `u` of barycentric coordinates.
#[must_use]
pub fn uniform_triangle_inverse(b: [f32; 3]) -> [f32; 2] {
    if b[0] < b[1] { [2.0 * b[0], b[0] + b[1]] } else { [b[0] + b[1], 2.0 * b[1]] }
}

/// Density of [`uniform_triangle`] on a triangle of this area; zero for a triangle without one.
#[must_use]
pub fn uniform_triangle_pdf(area: f32) -> Pdf<Area> {
    Pdf::new(if area > 0.0 && (1.0 / area).is_finite() { 1.0 / area } else { 0.0 })
}
