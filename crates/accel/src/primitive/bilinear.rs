//! A bilinear patch: the surface swept by a line whose ends run along two opposite edges.
//!
//! The line from `A(u) = p₀ + u g` to `A(u) + e + u f` meets the ray's line where
//! `(A(u) − o) · (d × (e + u f)) = 0`, a quadratic in `u` [Reshetov2019]; `v` and `t` follow from cross products.
//! All in double precision. Left out: watertight edges between patches (they agree to double rounding only).

use math::{Bounds, DVec3, Vec3};

use super::{Root, Roots};
use crate::ray_space::RaySpace;

/// The patch with corners at (0, 0), (1, 0), (0, 1) and (1, 1).
pub(crate) fn roots(corners: &[Vec3; 4], ray: &RaySpace) -> Roots {
    let [p00, p10, p01, p11] = corners.map(|p| p.as_dvec3());
    let (o, d) = (ray.origin(), ray.direction());
    let (a0, g, e) = (p00 - o, p10 - p00, p01 - p00);
    let f = (p11 - p01) - g;

    let (c0, c1) = (a0.dot(d.cross(e)), a0.dot(d.cross(f)) + g.dot(d.cross(e)));
    let [x, y] = quadratic(g.dot(d.cross(f)), c1, c0);
    let root = |u: f64| {
        // w + v D = t d: crossing with d gives v, crossing with D gives t.
        let (w, across): (DVec3, DVec3) = (a0 + g * u, e + f * u);
        let n = d.cross(across);
        let n2 = n.length_squared();
        let (v, t) = (w.cross(d).dot(n) / n2, w.cross(across).dot(n) / n2);
        let inside = (0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v);
        (inside && t.is_finite()).then_some(Root { t, u: u as f32, v: v as f32 })
    };
    match (x.and_then(root), y.and_then(root)) {
        (Some(a), Some(b)) if b.t < a.t => [Some(b), Some(a)],
        (None, b) => [b, None],
        both => [both.0, both.1],
    }
}

/// Real zeros of `a x² + b x + c`.
fn quadratic(a: f64, b: f64, c: f64) -> [Option<f64>; 2] {
    let disc = b * b - 4.0 * a * c;
    if !(disc >= 0.0) || (a == 0.0 && b == 0.0) {
        return [None; 2];
    }
    let q = -0.5 * (b + disc.sqrt().copysign(b));
    let finite = |x: f64| x.is_finite().then_some(x);
    if q == 0.0 { [Some(0.0), None] } else { [finite(c / q), finite(q / a)] }
}

/// Not four finite corners that span an area?
pub(crate) fn is_degenerate(corners: &[Vec3; 4]) -> bool {
    let [p00, p10, p01, p11] = *corners;
    let half = |a: Vec3, b: Vec3, c: Vec3| {
        super::triangle::is_degenerate(&[a.to_array(), b.to_array(), c.to_array()])
    };
    !corners.iter().all(|p| p.abs().max_element() < 1e18) || (half(p00, p10, p11) && half(p00, p11, p01))
}

/// The box of the corners holds the patch; rounded outwards for the arithmetic.
pub(crate) fn bounds(corners: &[Vec3; 4]) -> Bounds {
    super::round_outwards(&corners.iter().fold(Bounds::EMPTY, |b, &p| b.grow(p)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::primitive::test_ray;

    #[test]
    fn a_flat_square_gives_its_coordinates() {
        let square = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(1.0, 1.0, 0.0)];
        let [a, b] = roots(&square, &test_ray([0.25, 0.75, 2.0], [0.0, 0.0, -1.0]));
        assert_eq!((a, b), (Some(Root { t: 2.0, u: 0.25, v: 0.75 }), None));
        assert_eq!(roots(&square, &test_ray([1.25, 0.75, 2.0], [0.0, 0.0, -1.0])), [None; 2]);
    }

    #[test]
    fn points_of_a_twisted_patch_are_where_the_ray_says() {
        let c = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(1.0, 1.0, 1.0)];
        let ray = test_ray([0.3, 0.6, 5.0], [0.0, 0.0, -1.0]);
        let hit = roots(&c, &ray)[0].unwrap();
        assert!((hit.u - 0.3).abs() < 1e-6 && (hit.v - 0.6).abs() < 1e-6);
        assert!((hit.t - (5.0 - 0.18)).abs() < 1e-6, "z = u v");
    }
}
