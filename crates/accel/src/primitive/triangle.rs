//! The last step of the watertight ray–triangle test.
//!
//! | step | source |
//! |------|--------|
//! | shear, edge functions, their exact signs | [Woop2013] |
//! | `t` from the plane, in double precision | Cramer's rule |
//!
//! The kernels find candidates by edge functions in single precision, `U = fl(C_x B_y) − fl(C_y B_x)` without fusing.
//! Rounding is monotone, so such a sign is right or the difference is zero; products of two `f32` are exact in `f64`,
//! so here every sign is right, where the kernels met a zero. A triangle on the other side of an edge computes exactly
//! the negative.
//!
//! Departs from [Woop2013]: `t` is not interpolated from the sheared corners, which is off near the origin of the ray,
//! but solved from the plane, and clamped into the interval of the triangle's box.

use crate::ray_space::RaySpace;

/// The corners of a triangle, wherever they are.
pub(crate) trait Corners: Copy {
    /// One coordinate; both numbers are below 3.
    fn coordinate(self, vertex: usize, axis: usize) -> f32;
}

impl Corners for &[[f32; 3]; 3] {
    #[inline(always)]
    fn coordinate(self, vertex: usize, axis: usize) -> f32 {
        self[vertex][axis]
    }
}

/// `(t, u, v)` if the ray's line passes through the triangle. `entry` and `exit` are of the triangle's box.
#[inline(always)]
pub(crate) fn finish(ray: &RaySpace, p: impl Corners, entry: f32, exit: f32) -> Option<(f32, f32, f32)> {
    let e = Edges::new(ray, p);
    if !e.inside {
        return None;
    }
    let (height, along) = plane(ray, p);
    let t = if along == 0.0 {
        e.height() / (e.det * f64::from(ray.d[ray.k[2] as usize]))
    } else {
        height / along
    };
    let (u, v) = e.barycentrics();
    Some((clamp(t, entry, exit), u, v))
}

/// The `t` of [`finish`] where edge functions in single precision, none of them zero, have told that the line passes
/// through the triangle; `None` where this takes a closer look.
#[inline(always)]
pub(crate) fn distance(ray: &RaySpace, p: impl Corners, entry: f32, exit: f32) -> Option<f32> {
    let (height, along) = plane(ray, p);
    (along != 0.0).then(|| clamp(height / along, entry, exit))
}

/// The `(u, v)` of [`finish`] for a triangle that was hit.
#[inline(always)]
pub(crate) fn barycentrics(ray: &RaySpace, p: impl Corners) -> (f32, f32) {
    Edges::new(ray, p).barycentrics()
}

/// Signed areas over the edges, opposite of each corner. Each sign is exact.
struct Edges {
    areas: [f64; 3],
    det: f64,
    /// Of the corners, along the ray.
    z: [f64; 3],
    /// Does the line pass through?
    inside: bool,
}

impl Edges {
    #[inline(always)]
    fn new(ray: &RaySpace, p: impl Corners) -> Self {
        let (kx, ky, kz) = ((ray.k[0] & 3) as usize, (ray.k[1] & 3) as usize, (ray.k[2] & 3) as usize);
        let sheared = |i: usize| {
            let (x, y, z) = ray.sheared(p.coordinate(i, kx), p.coordinate(i, ky), p.coordinate(i, kz));
            (f64::from(x), f64::from(y), f64::from(z))
        };
        let (a, b, c) = (sheared(0), sheared(1), sheared(2));
        let u = c.0 * b.1 - c.1 * b.0;
        let v = a.0 * c.1 - a.1 * c.0;
        let w = b.0 * a.1 - b.1 * a.0;
        let det = u + v + w;
        // No short circuits: which way round the corners are is a coin toss.
        let around = ((u >= 0.0) & (v >= 0.0) & (w >= 0.0)) | ((u <= 0.0) & (v <= 0.0) & (w <= 0.0));
        Self { areas: [u, v, w], det, z: [a.2, b.2, c.2], inside: around & (det != 0.0) }
    }

    #[inline(always)]
    fn barycentrics(&self) -> (f32, f32) {
        ((self.areas[1] / self.det) as f32, (self.areas[2] / self.det) as f32)
    }

    fn height(&self) -> f64 {
        self.areas[0] * self.z[0] + self.areas[1] * self.z[1] + self.areas[2] * self.z[2]
    }
}

/// The first corner, and the normal (twice as long as the area).
#[inline(always)]
pub(crate) fn normal(p: impl Corners) -> ([f64; 3], [f64; 3]) {
    let wide = |i: usize, axis: usize| f64::from(p.coordinate(i, axis));
    let (ax, ay, az) = (wide(0, 0), wide(0, 1), wide(0, 2));
    let (bx, by, bz) = (wide(1, 0) - ax, wide(1, 1) - ay, wide(1, 2) - az);
    let (cx, cy, cz) = (wide(2, 0) - ax, wide(2, 1) - ay, wide(2, 2) - az);
    ([ax, ay, az], [by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx])
}

/// Numerator and denominator of `t = N · (p₀ − o) / N · d`.
#[inline(always)]
fn plane(ray: &RaySpace, p: impl Corners) -> (f64, f64) {
    let ([ax, ay, az], [nx, ny, nz]) = normal(p);
    let along = nx * f64::from(ray.d[0]) + ny * f64::from(ray.d[1]) + nz * f64::from(ray.d[2]);
    let (px, py, pz) = (ax - f64::from(ray.o[0]), ay - f64::from(ray.o[1]), az - f64::from(ray.o[2]));
    (nx * px + ny * py + nz * pz, along)
}

/// Into the interval of the box; the entry where `t` is not a number.
#[inline(always)]
pub(crate) fn clamp(t: f64, entry: f32, exit: f32) -> f32 {
    let t = t as f32;
    let t = if t < exit { t } else { exit };
    if t > entry { t } else { entry }
}

/// Is a corner not of numbers, or so far away that products overflow?
pub(crate) fn is_far(corner: &[f32; 3]) -> bool {
    const FAR: f32 = 1e18;
    !corner.iter().all(|x| x.abs() < FAR)
}

/// Has the triangle no area, or corners that are not numbers or so far away that products overflow?
pub(crate) fn is_degenerate(p: &[[f32; 3]; 3]) -> bool {
    if p.iter().any(is_far) {
        return true;
    }
    let e = |i: usize, axis: usize| f64::from(p[i][axis]) - f64::from(p[0][axis]);
    (0..3).all(|i| {
        let j = (i + 1) % 3;
        e(1, i) * e(2, j) == e(1, j) * e(2, i)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::primitive::test_ray;

    const P: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    #[test]
    fn barycentrics_are_the_weights_of_vertices_one_and_two() {
        let hit = finish(&test_ray([0.25, 0.5, 3.0], [0.0, 0.0, -1.0]), &P, 0.0, 10.0);
        assert_eq!(hit, Some((3.0, 0.25, 0.5)));
    }

    #[test]
    fn corners_and_edges_belong_to_the_triangle() {
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (0.3, 0.0), (0.0, 0.7)] {
            assert!(finish(&test_ray([x, y, 3.0], [0.0, 0.0, -1.0]), &P, 0.0, 10.0).is_some());
        }
        assert!(finish(&test_ray([-1e-30, 0.5, 3.0], [0.0, 0.0, -1.0]), &P, 0.0, 10.0).is_none());
    }

    #[test]
    fn collinear_corners_and_nan_are_degenerate() {
        assert!(is_degenerate(&[[0.0; 3], [1.0; 3], [2.0; 3]]));
        assert!(is_degenerate(&[[0.0; 3], [f32::NAN, 0.0, 0.0], [0.0, 1.0, 0.0]]));
        assert!(is_degenerate(&[[0.0; 3], [f32::INFINITY, 0.0, 0.0], [0.0, 1.0, 0.0]]));
        assert!(!is_degenerate(&P));
    }
}
