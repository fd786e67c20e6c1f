//! The last step of the watertight ray–triangle test.
//!
//! | step | source |
//! |------|--------|
//! | shear, edge functions, their exact signs | [Woop2013] |
//! | `t` from the plane, in double precision | Cramer's rule |
//!
//! The kernels find candidates by edge functions in single precision, `U = fl(C_x B_y) − fl(C_y B_x)` without fusing.
//! Rounding is monotone, so such a sign is right or the difference is zero; products of two `f32` are exact in `f64`,
//! so here every sign is right. A triangle on the other side of an edge computes exactly the negative.
//!
//! Departs from [Woop2013]: `t` is not interpolated from the sheared corners, which is off near the origin of the ray,
//! but solved from the plane, and clamped into the interval of the triangle's box.

use crate::ray_space::RaySpace;

/// `(t, u, v)` if the ray's line passes through the triangle. `entry` and `exit` are of the triangle's box.
#[inline(always)]
pub(crate) fn finish(ray: &RaySpace, p: &[[f32; 3]; 3], entry: f32, exit: f32) -> Option<(f32, f32, f32)> {
    let [kx, ky, kz] = ray.k;
    let sheared = |v: &[f32; 3]| {
        let z = v[kz] - ray.o[kz];
        let x = (v[kx] - ray.o[kx]) - ray.shear[0] * z;
        let y = (v[ky] - ray.o[ky]) - ray.shear[1] * z;
        [f64::from(x), f64::from(y), f64::from(z)]
    };
    let [a, b, c] = [sheared(&p[0]), sheared(&p[1]), sheared(&p[2])];

    // Signed areas over the edges; each sign is exact.
    let u = c[0] * b[1] - c[1] * b[0];
    let v = a[0] * c[1] - a[1] * c[0];
    let w = b[0] * a[1] - b[1] * a[0];
    let det = u + v + w;
    // No short circuits: which way round the corners are is a coin toss.
    let inside = ((u >= 0.0) & (v >= 0.0) & (w >= 0.0)) | ((u <= 0.0) & (v <= 0.0) & (w <= 0.0));
    if !inside | (det == 0.0) {
        return None;
    }

    let (height, along) = plane(ray, p);
    let t = if along == 0.0 {
        (u * a[2] + v * b[2] + w * c[2]) / (det * f64::from(ray.d[kz]))
    } else {
        height / along
    };
    let t = clamp(t, entry, exit);
    Some((t, (v / det) as f32, (w / det) as f32))
}

/// Numerator and denominator of `t = N · (p₀ − o) / N · d`.
#[inline(always)]
fn plane(ray: &RaySpace, p: &[[f32; 3]; 3]) -> (f64, f64) {
    let sub = |a: &[f32; 3], b: &[f32; 3]| -> [f64; 3] {
        std::array::from_fn(|i| f64::from(a[i]) - f64::from(b[i]))
    };
    let (e1, e2, to_p) = (sub(&p[1], &p[0]), sub(&p[2], &p[0]), sub(&p[0], &ray.o));
    let n = [e1[1] * e2[2] - e1[2] * e2[1], e1[2] * e2[0] - e1[0] * e2[2], e1[0] * e2[1] - e1[1] * e2[0]];
    let along = n[0] * f64::from(ray.d[0]) + n[1] * f64::from(ray.d[1]) + n[2] * f64::from(ray.d[2]);
    let height = n[0] * to_p[0] + n[1] * to_p[1] + n[2] * to_p[2];
    (height, along)
}

/// Into the interval of the box; the entry where `t` is not a number.
#[inline(always)]
pub(crate) fn clamp(t: f64, entry: f32, exit: f32) -> f32 {
    let t = t as f32;
    let t = if t < exit { t } else { exit };
    if t > entry { t } else { entry }
}

/// Has the triangle no area, or corners that are not numbers or so far away that products overflow?
pub(crate) fn is_degenerate(p: &[[f32; 3]; 3]) -> bool {
    const FAR: f32 = 1e18;
    if !p.iter().flatten().all(|x| x.abs() < FAR) {
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
