//! A ray as the kernels want it: reciprocals, shear and error bounds, found once per ray and space.
//!
//! # The box test, and why it loses nothing
//!
//! On each axis a plane at `b` is met at `fl(b · inv + c)`, fused, where `c` is `−o · inv` less (near planes) or more (far
//! planes) a slack. The entry is the largest near `t` and 0, the exit the smallest far `t`, and the box is met if
//! entry ≤ exit. All steps are monotone in the planes.
//!
//! The slack is that of a box grown by `pad` on all sides. Let `u = 2⁻²⁴`, `R` the largest distance along an axis from
//! the origin to a corner in the structure, and `m` the largest coordinate of the origin. The triangle test ([Woop2013])
//! is exact on vertices sheared to `x' = fl(fl(x − o_x) − S_x · fl(z − o_z))`, fused, with `|S_x| ≤ 1` as `z` is the
//! fastest axis. Of `x'`, one rounding is of the difference (`u R`), one of the sum (`2 u R`), one of `fl(z − o_z)` and
//! two of `S_x` (`3 u R`). So if the test lets a ray through, there is a point of the triangle, inside of its box, that
//! the line passes within `6 u R` along `x` and `y`. The box test itself errs by `u R` for the rounding of `inv`, `u R` for that
//! of the sum and `2 u m` for those of `c`. With `B` the largest coordinate in the structure, `R ≤ B + m`, all this is
//! less than `pad = 16 u (B + |o_x| + |o_y| + |o_z|)`. [Woop2013] widens boxes by the same reasoning.
//!
//! A component of `d` below 10⁻¹² of the largest counts as zero, since it moves the ray by less than `pad` within the
//! structure; it has the reciprocal of that bound, so that a ray in the plane of a face still meets the box.

use glam::Vec4;
use math::{Bounds, DVec3, Vec3};

/// Components of a direction below this share of the largest are zero.
pub(crate) const TINY: f32 = 1e-12;
/// 16 · 2⁻²⁴, see above.
pub(crate) const PAD: f32 = 8.0 * f32::EPSILON;

/// A ray in the space of one structure. The direction need not be unit.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub(crate) struct RaySpace {
    // The fourth numbers mean nothing; with them each is one register.
    pub(crate) o: [f32; 4],
    pub(crate) d: [f32; 4],
    pub(crate) inv: [f32; 4],
    /// A near plane `b` is met at `b · inv + c_near`.
    pub(crate) c_near: [f32; 4],
    /// The same for far planes.
    pub(crate) c_far: [f32; 4],
    /// Bit `i` is set where the near plane of axis `i` is the upper one.
    pub(crate) negative: u32,
    /// The axes, `k[2]` being the one along which the ray is fastest. Always a permutation of 0, 1, 2.
    pub(crate) k: [u32; 3],
    /// What is added for each unit along `k[2]`, so that the direction becomes that axis.
    pub(crate) shear: [f32; 2],
    pub(crate) time: f32,
    /// Can it be traced? Not if it is not finite, has no direction, or one so short or long that numbers overflow.
    pub(crate) valid: bool,
}

/// The largest coordinate of a structure, in absolute value; 0 if there is nothing in it.
pub(crate) fn reach(bounds: &Bounds) -> f32 {
    if bounds.is_empty() { 0.0 } else { bounds.min.abs().max(bounds.max.abs()).max_element() }
}

impl RaySpace {
    /// The ray in a structure of this `reach`. `None` if it cannot be traced.
    #[inline(always)]
    pub(crate) fn new(o: Vec3, d: Vec3, time: f32, reach: f32) -> Option<Self> {
        let ray = Self::unchecked(o, d, time, reach);
        ray.valid.then_some(ray)
    }

    /// The ray in a structure of this `reach`, of which only `valid` means something if it cannot be traced.
    // Not an option, so that it is written where it stays.
    #[inline(always)]
    pub(crate) fn unchecked(o: Vec3, d: Vec3, time: f32, reach: f32) -> Self {
        let (o, d) = (o.extend(0.0), d.extend(1.0));
        let (size, far) = (d.abs(), o.abs());
        let [x, y, z, _] = size.to_array();
        let fastest = max(max(x, y), z);
        // Sums, as they are not numbers if one term is none.
        let span = reach + (far.x + far.y + far.z);
        let valid = (x + y + z <= 1e30) & (fastest >= 1e-30) & (fastest >= span * 1e-24);

        let tiny = Vec4::splat(fastest * TINY);
        let zero = size.cmplt(tiny);
        let divisor = Vec4::select(zero, tiny, d);
        let inv = 1.0 / divisor;
        let slack = inv.abs() * (PAD * span);
        let c = o * inv;
        let d = Vec4::select(zero, Vec4::ZERO, d).to_array();
        let inv_of = inv.to_array();

        // The fastest axis and, in turn, the next two: (0 → 1, 2), (1 → 2, 0), (2 → 0, 1).
        let fast = if y > x { 1 } else { 0 };
        let fast = if z > max(x, y) { 2 } else { fast };
        let next = (0b00_10_01 >> (2 * fast)) & 3_u32;
        let k = [next, 3 - next - fast, fast];
        let at = |a: &[f32; 4], i: u32| a[(i & 3) as usize];
        let per_unit = -at(&inv_of, k[2]);
        Self {
            o: o.to_array(),
            d,
            inv: inv_of,
            c_near: (-slack - c).to_array(),
            c_far: (slack - c).to_array(),
            negative: divisor.is_negative_bitmask() & 7,
            k,
            shear: [at(&d, k[0]) * per_unit, at(&d, k[1]) * per_unit],
            time,
            valid,
        }
    }

    /// Entry and exit of a box, grown by the slack; it is met if `entry <= exit`. The same operations in the same order
    /// as in the kernels' node test.
    #[inline(always)]
    pub(crate) fn slab(&self, b: &Bounds) -> (f32, f32) {
        let planes = [b.min.to_array(), b.max.to_array()];
        let up = |i: usize| (self.negative >> i & 1) as usize;
        let near = |i: usize| planes[up(i)][i].mul_add(self.inv[i], self.c_near[i]);
        let far = |i: usize| planes[1 - up(i)][i].mul_add(self.inv[i], self.c_far[i]);
        let entry = max(max(near(0), near(1)), max(near(2), 0.0));
        (entry, min(min(far(0), far(1)), far(2)))
    }

    /// In double precision.
    pub(crate) fn origin(&self) -> DVec3 {
        Vec4::from_array(self.o).truncate().as_dvec3()
    }

    /// In double precision.
    pub(crate) fn direction(&self) -> DVec3 {
        Vec4::from_array(self.d).truncate().as_dvec3()
    }

    /// A point, given along each axis of `k`, sheared so that the ray becomes the axis `k[2]` from 0. The same operations
    /// as in the kernels.
    #[inline(always)]
    pub(crate) fn sheared(&self, x: f32, y: f32, z: f32) -> (f32, f32, f32) {
        let o = |i: usize| self.o[(self.k[i] & 3) as usize];
        let z = z - o(2);
        (z.mul_add(self.shear[0], x - o(0)), z.mul_add(self.shear[1], y - o(1)), z)
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
            let ray = RaySpace::new(Vec3::new(-1.0, y, 0.5), Vec3::X, 0.0, 1.0).unwrap();
            let (entry, exit) = ray.slab(&unit_box());
            assert!(
                (0.9999..=1.0).contains(&entry) && (2.0..2.0001).contains(&exit),
                "y = {y}: {entry} {exit}"
            );
        }
        let ray = RaySpace::new(Vec3::new(-1.0, 1.1, 0.5), Vec3::X, 0.0, 1.0).unwrap();
        let (entry, exit) = ray.slab(&unit_box());
        assert!(entry > exit);
    }

    #[test]
    fn rays_without_direction_or_with_nan_are_refused() {
        assert!(RaySpace::new(Vec3::ZERO, Vec3::ZERO, 0.0, 1.0).is_none());
        assert!(RaySpace::new(Vec3::NAN, Vec3::X, 0.0, 1.0).is_none());
        assert!(RaySpace::new(Vec3::ZERO, Vec3::new(f32::INFINITY, 0.0, 0.0), 0.0, 1.0).is_none());
    }

    #[test]
    fn a_box_inside_another_has_its_interval_inside() {
        let outer = Bounds { min: Vec3::splat(-0.1), max: Vec3::splat(1.3) };
        for i in 0..1000_u64 {
            let r = |j: u64| math::hash::unit_f32(math::hash::mix64(i * 16 + j) as u32) * 4.0 - 2.0;
            let ray =
                RaySpace::new(Vec3::new(r(0), r(1), r(2)), Vec3::new(r(3), r(4), r(5)), 0.0, reach(&outer));
            let ray = ray.unwrap();
            let ((a, b), (c, d)) = (ray.slab(&outer), ray.slab(&unit_box()));
            assert!(a <= c && d <= b);
        }
    }
}
