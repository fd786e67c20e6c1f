//! The equal-area octahedral map between the unit square and the sphere of directions [Clarberg2008], with
//! pbrt-v4's orientation [PBR4e, sec. 3.8.3]: the centre is +z, the corners are −z.
//!
//! Departs from the source: the radius comes from x² + y², not from 1 − |z|, which loses digits near the poles.

use std::f32::consts::{FRAC_2_PI, FRAC_PI_4};

use math::{Vec3, trig};

/// From the unit square to a unit vector.
pub(crate) fn direction(p: [f32; 2]) -> Vec3 {
    let (u, v) = (2.0 * p[0] - 1.0, 2.0 * p[1] - 1.0);
    let (up, vp) = (u.abs(), v.abs());

    // Distance to the diagonal: its sign is the hemisphere's.
    let signed = 1.0 - (up + vp);
    let r = 1.0 - signed.abs();
    let phi = if r == 0.0 { FRAC_PI_4 } else { ((vp - up) / r + 1.0) * FRAC_PI_4 };

    let (sin, cos) = trig::sin_cos(phi);
    let planar = r * trig::safe_sqrt(2.0 - r * r);
    let z = (1.0 - r * r).copysign(signed);
    Vec3::new(cos.copysign(u) * planar, sin.copysign(v) * planar, z)
}

/// The inverse of [`direction`].
pub(crate) fn square(d: Vec3) -> [f32; 2] {
    let (x, y, z) = (d.x.abs(), d.y.abs(), d.z.abs());
    let r = ((x * x + y * y) / (1.0 + z)).sqrt();
    let (a, b) = (x.max(y), x.min(y));
    let phi = trig::atan(if a == 0.0 { 0.0 } else { b / a }) * FRAC_2_PI;
    let phi = if x < y { 1.0 - phi } else { phi };

    let mut v = phi * r;
    let mut u = r - v;
    if d.z < 0.0 {
        (u, v) = (1.0 - v, 1.0 - u);
    }
    [u.copysign(d.x), v.copysign(d.y)].map(|x| (0.5 * (x + 1.0)).clamp(0.0, 1.0))
}

/// Where a point just outside the unit square lies inside it: the sphere continues over the square's edges.
pub(crate) fn wrap([mut x, mut y]: [f32; 2]) -> [f32; 2] {
    if x < 0.0 {
        (x, y) = (-x, 1.0 - y);
    } else if x > 1.0 {
        (x, y) = (2.0 - x, 1.0 - y);
    }
    if y < 0.0 {
        (x, y) = (1.0 - x, -y);
    } else if y > 1.0 {
        (x, y) = (1.0 - x, 2.0 - y);
    }
    [x, y]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ways_meet() {
        for i in 0..101 {
            for j in 0..101 {
                let p = [(i as f32 + 0.31) / 101.7, (j as f32 + 0.17) / 101.7];
                let d = direction(p);
                assert!((d.length() - 1.0).abs() < 1e-5);
                let q = square(d);
                assert!((p[0] - q[0]).abs() < 1e-5 && (p[1] - q[1]).abs() < 1e-5, "{p:?} {q:?}");
            }
        }
        assert_eq!(direction([0.5, 0.5]), Vec3::Z);
        assert!((direction([0.0, 0.0]) - -Vec3::Z).length() < 1e-6);
    }

    #[test]
    fn equal_areas_are_equal_solid_angles() {
        // z is uniform on [−1, 1] for a uniform point on the sphere: compare its distribution function.
        let n = 400;
        for z in [-0.8, -0.3, 0.1, 0.6] {
            let below = (0..n * n)
                .filter(|i| {
                    let p = [(i % n) as f32 + 0.5, (i / n) as f32 + 0.5].map(|x| x / n as f32);
                    direction(p).z < z
                })
                .count();
            let share = below as f32 / (n * n) as f32;
            assert!((share - 0.5 * (z + 1.0)).abs() < 5e-3, "{z}: {share}");
        }
    }

    #[test]
    fn the_square_continues_over_its_edges() {
        for t in [0.1, 0.3, 0.7, 0.9] {
            for (inside, outside) in [
                ([1e-4, t], [-1e-4, t]),
                ([1.0 - 1e-4, t], [1.0001, t]),
                ([t, 1e-4], [t, -1e-4]),
                ([t, 1.0 - 1e-4], [t, 1.0001]),
            ] {
                assert!((direction(inside) - direction(wrap(outside))).length() < 2e-3);
            }
        }
    }
}
