//! A ray as the kernels want it: reciprocals, shear and error bounds, found once per ray and space.
//!
//! # The box test, and why it loses nothing
//!
//! On each axis the near plane is met at `fl(fl(b − o) · inv)` and the far one at `fl(fl(b − o_far) · inv_far)`, nothing
//! fused. The entry is the largest near `t` and 0, the exit the smallest far `t`, and the box is met if entry ≤ exit.
//! All steps are monotone in the planes.
//!
//! The triangle test ([Woop2013]) is exact on vertices sheared to `x' = fl(fl(x − o_x) − fl(S_x · fl(z − o_z)))`. The
//! first rounding is that of the box, as its planes are vertex coordinates. The others move a vertex by at most
//! `u|x'| + 3u|S_x z|` (u = 2⁻²⁴), and a point of the moved triangle can then lie outside of the box by at most
//! `5u |S_x| Z`, where `Z` is the largest `|z − o_z|` in the structure. So `o_far` is `o` moved back by
//! `δ = 16u |S_x| Z`, and by one part in 2²² of `|o|` at least, so that the move survives its rounding; and `inv_far` is
//! `inv` enlarged by 16u for the roundings of the slab itself. [Woop2013] widens boxes by the same reasoning. It costs
//! six registers and no operation.
//!
//! A component of `d` below 10⁻³⁷ counts as zero: then `1/d` stands for 10³⁷ and `o_far` moves by at least 10⁻¹⁸, so
//! that a ray in the plane of a face still meets the box.

use math::{Bounds, Vec3};

/// Directions below this are zero.
const TINY_DIR: f32 = 1e-37;
/// Stands for the reciprocal of zero.
const HUGE_INV: f32 = 1e37;
/// Widening of the exit for the roundings of the slab arithmetic.
const EXIT_SCALE: f32 = 1.0 + 8.0 * f32::EPSILON;

/// A ray in the space of one structure. The direction need not be unit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RaySpace {
    pub(crate) o: [f32; 3],
    pub(crate) d: [f32; 3],
    pub(crate) inv: [f32; 3],
    /// `o` and `inv` as far planes see them.
    pub(crate) o_far: [f32; 3],
    pub(crate) inv_far: [f32; 3],
    /// 1 where the near plane is the upper one. Always 0 or 1.
    pub(crate) near: [usize; 3],
    /// The axes, `k[2]` being the one along which the ray is fastest. Always a permutation of 0, 1, 2.
    pub(crate) k: [usize; 3],
    /// Shear that turns the direction into the axis `k[2]`.
    pub(crate) shear: [f32; 2],
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
        if min(min(x, y), z) < TINY_DIR {
            for (i, size) in [x, y, z].into_iter().enumerate() {
                if size < TINY_DIR {
                    (d[i], inv[i], near[i]) = (0.0, HUGE_INV, 0);
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
        let shear = [d[k[0]] / d[fast], d[k[1]] / d[fast]];
        // (An array's index is an address; that of a `Vec3` is a branch, and a bad one to predict.)
        let (low, high) = (bounds.min.to_array(), bounds.max.to_array());
        let reach = max((low[fast] - a[fast]).abs(), (high[fast] - a[fast]).abs());
        let drift = (8.0 * f32::EPSILON) * reach * inv[fast].abs();
        let o_far = [0, 1, 2].map(|i| {
            let back = max(max(drift * d[i].abs(), a[i].abs() * (2.0 * f32::EPSILON)), 1e-18);
            a[i] - back.copysign(inv[i])
        });
        let inv_far = inv.map(|x| x * EXIT_SCALE);
        Some(Self { o: a, d, inv, o_far, inv_far, near, k, shear, time })
    }

    /// Entry and widened exit of a box; it is met if `entry <= exit`. The same operations in the same order as in the
    /// kernels' node test.
    #[inline]
    pub(crate) fn slab(&self, b: &Bounds) -> (f32, f32) {
        let planes = [b.min.to_array(), b.max.to_array()];
        let near = |i: usize| (planes[self.near[i]][i] - self.o[i]) * self.inv[i];
        let far = |i: usize| (planes[1 - self.near[i]][i] - self.o_far[i]) * self.inv_far[i];
        let entry = max(max(near(0), near(1)), max(near(2), 0.0));
        (entry, min(min(far(0), far(1)), far(2)))
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
            assert!(entry == 1.0 && (2.0..2.0001).contains(&exit), "y = {y}: {entry} {exit}");
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
