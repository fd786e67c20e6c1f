//! Sixteen rays side by side, made ready for one structure.
//!
//! The operations of [`RaySpace::unchecked`], lane by lane, in plain loops over arrays: no branches, so that the
//! compiler makes registers of them.

use math::{Bounds, Ray, Vec3};

use crate::kernels::lanes::Lanes;
use crate::ray_space::{PAD, RaySpace, TINY, max, min};

/// Rays in a packet.
pub(in crate::kernels) const RAYS: usize = 16;

/// One number per ray.
pub(super) type Row = [f32; RAYS];

/// What a [`RaySpace`] holds, for sixteen rays.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Rays {
    pub(super) o: [Row; 3],
    /// The directions as they came.
    pub(super) given: [Row; 3],
    pub(super) d: [Row; 3],
    pub(super) inv: [Row; 3],
    pub(super) c_near: [Row; 3],
    pub(super) c_far: [Row; 3],
    pub(super) shear: [Row; 2],
    pub(super) time: Row,
    /// `PAD` times the span: by how much boxes grow.
    pad: Row,
    /// The signs, as [`RaySpace::negative`], and the fastest axis times 8.
    class: [u32; RAYS],
    /// A bit for each ray that can be traced.
    pub(super) valid: u32,
}

/// Axes along and across the fastest one, as [`RaySpace::k`] has them.
#[inline(always)]
pub(super) fn axes(class: u32) -> [usize; 3] {
    let fast = (class >> 3) as usize;
    let next = (0b00_10_01 >> (2 * fast)) & 3_usize;
    [next, 3 - next - fast, fast]
}

impl Rays {
    /// None that can be traced.
    pub(super) const NONE: Self = Self {
        o: [[0.0; RAYS]; 3],
        given: [[0.0; RAYS]; 3],
        d: [[0.0; RAYS]; 3],
        inv: [[0.0; RAYS]; 3],
        c_near: [[0.0; RAYS]; 3],
        c_far: [[0.0; RAYS]; 3],
        shear: [[0.0; RAYS]; 2],
        time: [0.0; RAYS],
        pad: [0.0; RAYS],
        class: [0; RAYS],
        valid: 0,
    };

    /// Up to sixteen rays in a structure of this `reach`.
    #[inline(always)]
    pub(super) fn fill(&mut self, rays: &[Ray], reach: f32) {
        for (i, ray) in rays.iter().enumerate().take(RAYS) {
            self.put(i, ray.origin.0, ray.dir.0, ray.time);
        }
        for i in rays.len()..RAYS {
            self.put(i, Vec3::ZERO, Vec3::ZERO, 0.0);
        }
        self.prepare(reach);
    }

    /// Origin and direction as they come.
    #[inline(always)]
    pub(super) fn put(&mut self, i: usize, o: Vec3, d: Vec3, time: f32) {
        let i = i & (RAYS - 1);
        self.o[0][i] = o.x;
        self.o[1][i] = o.y;
        self.o[2][i] = o.z;
        self.given[0][i] = d.x;
        self.given[1][i] = d.y;
        self.given[2][i] = d.z;
        self.time[i] = time;
    }

    /// Finds everything else.
    #[allow(clippy::needless_range_loop, reason = "the same lane of many rows")]
    #[inline(always)]
    pub(super) fn prepare(&mut self, reach: f32) {
        let r = self;
        let mut valid = [0_u32; RAYS];
        for i in 0..RAYS {
            let (ox, oy, oz) = (r.o[0][i], r.o[1][i], r.o[2][i]);
            let (dx, dy, dz) = (r.given[0][i], r.given[1][i], r.given[2][i]);
            let (x, y, z) = (dx.abs(), dy.abs(), dz.abs());
            let fastest = max(max(x, y), z);
            let span = reach + (ox.abs() + oy.abs() + oz.abs());
            let is_valid = (x + y + z <= 1e30) & (fastest >= 1e-30) & (fastest >= span * 1e-24);
            valid[i] = u32::from(is_valid) << i;
            let (tiny, pad) = (fastest * TINY, PAD * span);
            r.pad[i] = pad;
            let mut negative = 0;
            let mut inverse = [0.0_f32; 3];
            let mut direction = [0.0_f32; 3];
            for (axis, (o, d, size)) in [(ox, dx, x), (oy, dy, y), (oz, dz, z)].into_iter().enumerate() {
                let divisor = if size < tiny { tiny } else { d };
                let inv = 1.0 / divisor;
                let slack = inv.abs() * pad;
                let c = o * inv;
                direction[axis] = if size < tiny { 0.0 } else { d };
                inverse[axis] = inv;
                r.d[axis][i] = direction[axis];
                r.inv[axis][i] = inv;
                r.c_near[axis][i] = -slack - c;
                r.c_far[axis][i] = slack - c;
                negative |= (divisor.to_bits() >> 31) << axis;
            }
            // In turn, the next two after the fastest: (0 → 1, 2), (1 → 2, 0), (2 → 0, 1).
            let is_z = z > max(x, y);
            let is_y = !is_z & (y > x);
            let pick = |a: f32, b: f32, c: f32| {
                if is_z {
                    c
                } else if is_y {
                    b
                } else {
                    a
                }
            };
            let [dx, dy, dz] = direction;
            let per_unit = -pick(inverse[0], inverse[1], inverse[2]);
            r.shear[0][i] = pick(dy, dz, dx) * per_unit;
            r.shear[1][i] = pick(dz, dx, dy) * per_unit;
            r.class[i] = negative | (u32::from(is_y) << 3) | (u32::from(is_z) << 4);
        }
        r.valid = 0;
        for v in valid {
            r.valid |= v;
        }
    }

    /// One of them.
    #[inline(always)]
    pub(super) fn lane(&self, i: usize) -> RaySpace {
        let i = i & (RAYS - 1);
        let four = |rows: &[Row; 3]| [rows[0][i], rows[1][i], rows[2][i], 0.0];
        let [kx, ky, kz] = axes(self.class[i]);
        RaySpace {
            o: four(&self.o),
            d: four(&self.d),
            inv: four(&self.inv),
            c_near: four(&self.c_near),
            c_far: four(&self.c_far),
            negative: self.class[i] & 7,
            k: [kx as u32, ky as u32, kz as u32],
            shear: [self.shear[0][i], self.shear[1][i]],
            time: self.time[i],
            valid: self.valid >> i & 1 != 0,
        }
    }

    /// Signs and fastest axis of one of them.
    #[inline(always)]
    pub(super) fn class(&self, i: usize) -> u32 {
        self.class[i & (RAYS - 1)]
    }

    /// The class of the first of some rays, and those that have it.
    // No function that takes a closure: what is traced in one would lack the kernel's target features.
    #[inline(always)]
    pub(super) fn first_class(&self, among: u32) -> (u32, u32) {
        let class = self.class(among.trailing_zeros() as usize);
        (class, self.of_class(class, among))
    }

    /// Where each ray enters a box, and a bit for each that meets it before its `t_max`. The operations of
    /// [`RaySpace::slab`]: as rounding is monotone, the planes need not be sorted first.
    #[inline(always)]
    pub(super) fn slab(&self, b: &Bounds, t_max: &Row) -> (Row, u32) {
        let (lower, upper) = (b.min.to_array(), b.max.to_array());
        let (mut entries, mut met) = ([0.0; RAYS], [0_u32; RAYS]);
        for i in 0..RAYS {
            let (mut entry, mut exit) = (0.0, f32::INFINITY);
            for axis in 0..3 {
                let (inv, c_near, c_far) = (self.inv[axis][i], self.c_near[axis][i], self.c_far[axis][i]);
                let (low, high) = (lower[axis], upper[axis]);
                let near = min(low.mul_add(inv, c_near), high.mul_add(inv, c_near));
                let far = max(low.mul_add(inv, c_far), high.mul_add(inv, c_far));
                entry = max(near, entry);
                exit = min(far, exit);
            }
            entries[i] = entry;
            met[i] = u32::from((entry <= exit) & (entry <= t_max[i])) << i;
        }
        let mut all = 0;
        for bit in met {
            all |= bit;
        }
        (entries, all)
    }

    /// Those of `among` that have the class.
    #[inline(always)]
    pub(super) fn of_class(&self, class: u32, among: u32) -> u32 {
        let mut mask = 0;
        for i in 0..RAYS {
            mask |= u32::from(self.class[i] == class) << i;
        }
        mask & among
    }
}

/// All that some rays of one class may meet: numbers of the [`Rays`], the least and the most of each [Boulos2006].
///
/// A plane at `b` is met nowhere before `(b − o) · inv` less four times the largest slack, with the `o` that is farthest
/// along and the `inv` of least size; nowhere after the same with the other ends, plus the slack. (If the plane lies ahead of a ray
/// this bounds the product. If it lies behind, entries do not matter as they become 0, and exits only of rays that have it no
/// farther behind than their pad.) The roundings of either side are less than half a slack.
#[derive(Clone, Copy)]
pub(in crate::kernels) struct Beam {
    // The fourth numbers mean nothing.
    pub(in crate::kernels) inv_near: [f32; 4],
    pub(in crate::kernels) inv_far: [f32; 4],
    pub(in crate::kernels) c_near: [f32; 4],
    pub(in crate::kernels) c_far: [f32; 4],
    /// Of all rays, if they have it in common.
    pub(in crate::kernels) origin: Option<[f32; 3]>,
    /// As [`RaySpace::negative`].
    pub(in crate::kernels) negative: u32,
    /// As [`RaySpace::k`].
    pub(super) k: [usize; 3],
}

/// The least and the most of those in the mask, of which there is at least one.
#[inline(always)]
fn range<L: Lanes<RAYS>>(row: &Row, among: u32) -> (f32, f32) {
    let (row, low) = (L::load(row), L::splat(f32::NEG_INFINITY));
    let negated = L::splat(0.0).sub(row);
    (-negated.keep(among, low).most(), row.keep(among, low).most())
}

/// As many rays as it takes for a packet to be worth it.
pub(super) const PACKET: u32 = 6;
/// Slopes across the fastest axis may differ by this much in all.
const SLOPES: f32 = 0.2;
/// Origins may differ by this share of the structure's reach.
const ORIGINS: f32 = 0.05;

impl Beam {
    /// Around the rays of `among`, which have one class and can be traced; `None` if they are too few, or go apart
    /// too far, for it to be of use.
    #[allow(clippy::needless_range_loop, reason = "the same lane of many rows")]
    #[inline(always)]
    pub(super) fn around<L: Lanes<RAYS>>(rays: &Rays, among: u32, class: u32, reach: f32) -> Option<Self> {
        if among.count_ones() < PACKET {
            return None;
        }
        let mut spread = 0.0;
        for row in &rays.shear {
            let (least, most) = range::<L>(row, among);
            spread += most - least;
        }
        if !(spread < SLOPES) {
            return None;
        }
        let pad = range::<L>(&rays.pad, among).1;
        let zero = [0.0; 4];
        let (negative, k) = (class & 7, axes(class));
        let mut beam =
            Self { inv_near: zero, inv_far: zero, c_near: zero, c_far: zero, origin: None, negative, k };
        let (mut apart, mut origin) = (0.0, [0.0; 3]);
        for axis in 0..3 {
            let (o_least, o_most) = range::<L>(&rays.o[axis], among);
            let (least, most) = range::<L>(&rays.inv[axis], among);
            apart += o_most - o_least;
            origin[axis] = o_most;
            let is_up = negative >> axis & 1 == 0;
            let (inv_near, inv_far) = if is_up { (least, most) } else { (most, least) };
            let (o_near, o_far) = if is_up { (o_most, o_least) } else { (o_least, o_most) };
            let slack = 4.0 * pad * inv_far.abs();
            beam.inv_near[axis] = inv_near;
            beam.inv_far[axis] = inv_far;
            beam.c_near[axis] = -slack - o_near * inv_near;
            beam.c_far[axis] = slack - o_far * inv_far;
        }
        beam.origin = (apart == 0.0).then_some(origin);
        (apart <= ORIGINS * reach).then_some(beam)
    }
}
