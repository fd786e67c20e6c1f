//! A ray as the kernels want it: reciprocals, shear and error bounds, found once per ray and space.
//!
//! # The box test, and why it loses nothing
//!
//! For each axis `t = (b − o) · fl(1/d)`, two roundings (none fused). The entry is the largest near `t` and 0, the exit
//! the smallest far `t`, and the box is met if `entry ≤ exit · (1 + 4ε′) + pad`. All steps are monotone in the planes.
//!
//! The triangle test ([Woop2013]) is exact on vertices sheared to `x' = fl(fl(x − o_x) − fl(S_x · fl(z − o_z)))`. The
//! first rounding is that of the box, as its planes are vertex coordinates. The others move a vertex by at most
//! `½ε|x'| + ³⁄₂ε|S_x z|` (ε = 2⁻²³ / 2 here), and a point of the moved triangle can then lie outside of the box by at
//! most `⁵⁄₂ ε |S_x| Z` where `Z` is the largest `|z − o_z|` in the structure; along the ray this is `⁵⁄₂ ε Z / |d_z|`
//! for both axes, because `S_x = d_x / d_z`. So `pad = 8 ε Z / |d_z|` covers both ends with a margin of 1.6.
//! [Woop2013] pads box planes by the same reasoning; here it is one addition to the exit.
//!
//! A component of `d` below 10⁻³⁷ counts as zero: then `1/d` stands for 10³⁷ and the far planes move away by one part
//! in 2²² (at least 10⁻¹⁸), so that a ray in the plane of a face still meets the box.

use math::{Bounds, Vec3};

/// Directions below this are zero.
const TINY_DIR: f32 = 1e-37;
/// Stands for the reciprocal of zero.
const HUGE_INV: f32 = 1e37;
/// Widening of the exit for the roundings of the slab arithmetic.
pub(crate) const EXIT_SCALE: f32 = 1.0 + 4.0 * f32::EPSILON;

/// A ray in the space of one structure. The direction need not be unit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RaySpace {
    pub(crate) o: [f32; 3],
    pub(crate) d: [f32; 3],
    /// `o` as far planes see it; differs where `d` is zero.
    pub(crate) o_far: [f32; 3],
    pub(crate) inv: [f32; 3],
    /// 1 where the near plane is the upper one. Always 0 or 1.
    pub(crate) near: [usize; 3],
    /// The axes, `k[2]` being the one along which the ray is fastest. Always a permutation of 0, 1, 2.
    pub(crate) k: [usize; 3],
    /// Shear that turns the direction into the axis `k[2]`.
    pub(crate) shear: [f32; 2],
    /// Absolute widening of the exit.
    pub(crate) pad: f32,
    pub(crate) time: f32,
}

impl RaySpace {
    /// `None` if the ray is not finite or has no direction.
    #[inline(always)]
    pub(crate) fn new(o: Vec3, d: Vec3, time: f32, bounds: &Bounds) -> Option<Self> {
        let (a, mut d) = (o.to_array(), d.to_array());
        let (x, y, z) = (d[0].abs(), d[1].abs(), d[2].abs());
        // Zero times what is not finite is not a number.
        if !((a[0] + a[1] + a[2] + x + y + z) * 0.0 == 0.0) {
            return None;
        }
        let mut inv = [1.0 / d[0], 1.0 / d[1], 1.0 / d[2]];
        let mut near = [usize::from(d[0] < 0.0), usize::from(d[1] < 0.0), usize::from(d[2] < 0.0)];
        let mut o_far = a;
        if min(min(x, y), z) < TINY_DIR {
            for (i, size) in [x, y, z].into_iter().enumerate() {
                if size < TINY_DIR {
                    (d[i], inv[i], near[i]) = (0.0, HUGE_INV, 0);
                    o_far[i] = a[i] - (a[i].abs() * (2.0 * f32::EPSILON)).max(1e-18);
                }
            }
        }
        // The fastest axis and, in turn, the next two: (0 → 1, 2), (1 → 2, 0), (2 → 0, 1).
        let fast = if y > x { 1 } else { 0 };
        let fast = if z > max(y, x) { 2 } else { fast };
        let next = (0b00_10_01 >> (2 * fast)) & 3;
        let k = [next, 3 - next - fast, fast];
        if d[fast] == 0.0 {
            return None;
        }
        let reach = (bounds.min[k[2]] - a[k[2]]).abs().max((bounds.max[k[2]] - a[k[2]]).abs());
        let pad = (4.0 * f32::EPSILON) * reach * inv[k[2]].abs();
        let shear = [d[k[0]] / d[k[2]], d[k[1]] / d[k[2]]];
        Some(Self { o: a, d, o_far, inv, near, k, shear, pad, time })
    }

    /// Entry and widened exit of a box; it is met if `entry <= exit`. The same operations in the same order as in the
    /// kernels' node test.
    #[inline]
    pub(crate) fn slab(&self, b: &Bounds) -> (f32, f32) {
        let planes = [b.min.to_array(), b.max.to_array()];
        let near = |i: usize| (planes[self.near[i]][i] - self.o[i]) * self.inv[i];
        let far = |i: usize| (planes[1 - self.near[i]][i] - self.o_far[i]) * self.inv[i];
        let entry = max(max(max(near(0), near(1)), near(2)), 0.0);
        let exit = min(min(far(0), far(1)), far(2));
        (entry, exit * EXIT_SCALE + self.pad)
    }
}

/// As the processor's `minps`: the second where they are unordered or equal.
#[inline(always)]
pub(crate) fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// As the processor's `maxps`: the second where they are unordered or equal.
#[inline(always)]
pub(crate) fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit_box() -> Bounds {
        Bounds { min: Vec3::ZERO, max: Vec3::ONE }
    }

    #[test]
    fn a_ray_along_a_face_meets_the_box_from_either_side() {
        for y in [0.0, 1.0] {
            let ray = RaySpace::new(Vec3::new(-1.0, y, 0.5), Vec3::X, 0.0, &unit_box()).unwrap();
            let (entry, exit) = ray.slab(&unit_box());
            assert!(entry == 1.0 && (2.0..2.001).contains(&exit), "y = {y}: {entry} {exit}");
        }
        let ray = RaySpace::new(Vec3::new(-1.0, 1.1, 0.5), Vec3::X, 0.0, &unit_box()).unwrap();
        let (entry, exit) = ray.slab(&unit_box());
        assert!(entry > exit);
    }

    #[test]
    fn rays_without_direction_or_with_nan_are_refused() {
        assert!(RaySpace::new(Vec3::ZERO, Vec3::ZERO, 0.0, &unit_box()).is_none());
        assert!(RaySpace::new(Vec3::NAN, Vec3::X, 0.0, &unit_box()).is_none());
        assert!(RaySpace::new(Vec3::ZERO, Vec3::new(f32::INFINITY, 0.0, 0.0), 0.0, &unit_box()).is_none());
    }

    #[test]
    fn a_box_inside_another_has_its_interval_inside() {
        let outer = Bounds { min: Vec3::splat(-0.1), max: Vec3::splat(1.3) };
        for i in 0..1000_u64 {
            let r = |j: u64| math::hash::unit_f32(math::hash::mix64(i * 16 + j) as u32) * 4.0 - 2.0;
            let ray = RaySpace::new(Vec3::new(r(0), r(1), r(2)), Vec3::new(r(3), r(4), r(5)), 0.0, &outer);
            let ray = ray.unwrap();
            let ((a, b), (c, d)) = (ray.slab(&outer), ray.slab(&unit_box()));
            assert!(a <= c && d <= b);
        }
    }
}
