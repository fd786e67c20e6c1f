//! Vectors and frames in lanes: the operations of the single ones, in their order.

use std::ops::{Add, Mul, Neg, Sub};

use super::{Floats, LANES, Words};

/// Sixteen vectors in memory: a column for each component.
pub type Columns = [[f32; LANES]; 3];

/// One of them.
#[inline(always)]
#[must_use]
pub fn in_lane(columns: &Columns, lane: usize) -> glam::Vec3 {
    glam::Vec3::new(columns[0][lane], columns[1][lane], columns[2][lane])
}

/// Sixteen vectors.
#[derive(Clone, Copy, Debug)]
pub struct Vec3Lanes<F> {
    /// First components.
    pub x: F,
    /// Second components.
    pub y: F,
    /// Third components.
    pub z: F,
}

/// Sixteen points with the half-sizes of the boxes in which the true ones lie.
#[derive(Clone, Copy, Debug)]
pub struct PointLanes<F> {
    /// The points.
    pub p: Vec3Lanes<F>,
    /// See [`crate::error_bound`].
    pub error: Vec3Lanes<F>,
}

impl<F: Floats> Vec3Lanes<F> {
    /// From components.
    #[inline(always)]
    pub fn new(x: F, y: F, z: F) -> Self {
        Self { x, y, z }
    }

    /// The same in every lane.
    #[inline(always)]
    pub fn splat(v: glam::Vec3) -> Self {
        Self::new(F::splat(v.x), F::splat(v.y), F::splat(v.z))
    }

    /// From memory, component by component.
    #[inline(always)]
    pub fn load(columns: &Columns) -> Self {
        Self::new(F::load(&columns[0]), F::load(&columns[1]), F::load(&columns[2]))
    }

    /// To memory, component by component.
    #[inline(always)]
    pub fn stored(self) -> Columns {
        let mut out = [[0.0; LANES]; 3];
        self.x.store(&mut out[0]);
        self.y.store(&mut out[1]);
        self.z.store(&mut out[2]);
        out
    }

    /// Dot product.
    #[inline(always)]
    pub fn dot(self, o: Self) -> F {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    /// Cross product.
    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        Self {
            x: self.y * o.z - o.y * self.z,
            y: self.z * o.x - o.z * self.x,
            z: self.x * o.y - o.x * self.y,
        }
    }

    /// Size of each component.
    #[inline(always)]
    pub fn abs(self) -> Self {
        Self::new(self.x.abs(), self.y.abs(), self.z.abs())
    }

    /// Its own lanes where the mask says yes, else the other's.
    #[inline(always)]
    pub fn or_else(self, mask: F::Mask, o: Self) -> Self {
        Self { x: self.x.or_else(mask, o.x), y: self.y.or_else(mask, o.y), z: self.z.or_else(mask, o.z) }
    }

    /// Made unit, and where that is possible.
    #[inline(always)]
    pub fn try_normalize(self) -> (Self, F::Mask) {
        let inverse = F::splat(1.0) / self.dot(self).sqrt();
        (self * inverse, inverse.is_finite() & inverse.gt(F::splat(0.0)))
    }

    /// [`crate::Dir::normalize`].
    #[inline(always)]
    pub fn normalize(self) -> Self {
        let (unit, is_one) = self.try_normalize();
        unit.or_else(is_one, Self::splat(glam::Vec3::Z))
    }

    /// [`crate::Dir::face_forward`].
    #[inline(always)]
    pub fn face_forward(self, reference: Self) -> Self {
        self.negated_where(self.dot(reference).lt(F::splat(0.0)))
    }

    /// Negated where the mask says so.
    #[inline(always)]
    pub fn negated_where(self, mask: F::Mask) -> Self {
        (-self).or_else(mask, self)
    }
}

impl<F: Floats> Add for Vec3Lanes<F> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self::new(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}

impl<F: Floats> Sub for Vec3Lanes<F> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self::new(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}

impl<F: Floats> Mul<F> for Vec3Lanes<F> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: F) -> Self {
        Self::new(self.x * s, self.y * s, self.z * s)
    }
}

impl<F: Floats> Neg for Vec3Lanes<F> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}

/// Sixteen frames: see [`crate::Frame`].
#[derive(Clone, Copy, Debug)]
pub struct FrameLanes<F> {
    /// First tangents.
    pub s: Vec3Lanes<F>,
    /// Second tangents.
    pub t: Vec3Lanes<F>,
    /// Normals.
    pub n: Vec3Lanes<F>,
}

impl<F: Floats> FrameLanes<F> {
    /// [`crate::Frame::from_normal`].
    #[inline(always)]
    pub fn from_normal(n: Vec3Lanes<F>) -> Self {
        let one = F::splat(1.0);
        let sign = one.copysign(n.z);
        let a = F::splat(-1.0) / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            s: Vec3Lanes::new(one + sign * n.x * n.x * a, sign * b, -sign * n.x),
            t: Vec3Lanes::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }

    /// [`crate::Frame::from_normal_tangent`].
    #[inline(always)]
    pub fn from_normal_tangent(n: Vec3Lanes<F>, tangent: Vec3Lanes<F>) -> Self {
        let (s, leans) = (tangent - n * n.dot(tangent)).try_normalize();
        Self { s, t: n.cross(s), n }.or_else(leans, Self::from_normal(n))
    }

    /// Its own lanes where the mask says yes, else the other's.
    #[inline(always)]
    pub fn or_else(self, mask: F::Mask, o: Self) -> Self {
        Self { s: self.s.or_else(mask, o.s), t: self.t.or_else(mask, o.t), n: self.n.or_else(mask, o.n) }
    }

    /// [`crate::Frame::to_local`].
    #[inline(always)]
    pub fn to_local(&self, v: Vec3Lanes<F>) -> Vec3Lanes<F> {
        Vec3Lanes::new(v.dot(self.s), v.dot(self.t), v.dot(self.n))
    }

    /// [`crate::Frame::to_world`].
    #[inline(always)]
    pub fn to_world(&self, v: Vec3Lanes<F>) -> Vec3Lanes<F> {
        self.s * v.x + self.t * v.y + self.n * v.z
    }
}

/// [`crate::error_bound::offset_ray_origin`].
#[inline(always)]
pub fn offset_ray_origin<F: Floats>(at: &PointLanes<F>, n: Vec3Lanes<F>, w: Vec3Lanes<F>) -> Vec3Lanes<F> {
    let d = n.abs().dot(at.error);
    let d = (-d).or_else(n.dot(w).lt(F::splat(0.0)), d);
    let o = n * d;
    Vec3Lanes::new(moved(at.p.x, o.x), moved(at.p.y, o.y), moved(at.p.z, o.z))
}

/// See `error_bound`.
#[inline(always)]
fn moved<F: Floats>(x: F, o: F) -> F {
    let (one, zero) = (F::Words::splat(1), F::splat(0.0));
    let y = x + o;
    let (bits, towards) = (y.bits(), o.bits() & F::Words::splat(1 << 31));
    let step = one - (bits ^ towards).shr::<31>().shl::<1>();
    let beyond = (towards | one).or_else(y.eq(zero), bits + step);
    bits.or_else(o.eq(zero), beyond).floats()
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::lanes::{LANES, PortableFloats};
    use crate::{Dir, Frame, Point, error_bound, hash};

    fn numbers(key: u64) -> [f32; LANES] {
        let mut out = [0.0; LANES];
        for (i, x) in out.iter_mut().enumerate() {
            let h = hash::combine(key, i as u64);
            // Some zeros, some of other orders of size.
            *x = match h % 7 {
                0 => 0.0,
                1 => (hash::unit_f32((h >> 32) as u32) - 0.5) * 1e-12,
                _ => hash::unit_f32((h >> 32) as u32) * 4.0 - 2.0,
            };
        }
        out
    }

    fn vectors(key: u64) -> (Vec3Lanes<PortableFloats>, [Vec3; LANES]) {
        let [x, y, z] = [0, 1, 2].map(|i| numbers(hash::combine(key, 100 + i)));
        let load = |a| PortableFloats::load(a);
        let mut single = [Vec3::ZERO; LANES];
        for (i, v) in single.iter_mut().enumerate() {
            *v = Vec3::new(x[i], y[i], z[i]);
        }
        (Vec3Lanes::new(load(&x), load(&y), load(&z)), single)
    }

    fn assert_same(lanes: Vec3Lanes<PortableFloats>, single: impl Fn(usize) -> Vec3) {
        let mut out = [[0.0; LANES]; 3];
        lanes.x.store(&mut out[0]);
        lanes.y.store(&mut out[1]);
        lanes.z.store(&mut out[2]);
        for (i, _) in out[0].iter().enumerate() {
            let bits = |v: [f32; 3]| v.map(f32::to_bits);
            assert_eq!(bits([out[0][i], out[1][i], out[2][i]]), bits(single(i).to_array()), "lane {i}");
        }
    }

    #[test]
    fn lanes_have_the_bits_of_single_vectors() {
        for key in 0..200 {
            let ((a, sa), (b, sb), (c, sc)) = (vectors(key), vectors(key + 1000), vectors(key + 2000));
            assert_same(a.cross(b), |i| sa[i].cross(sb[i]));
            let (n, sn) = (a.normalize(), sa.map(Dir::normalize));
            assert_same(n, |i| sn[i].0);
            let (w, sw) = (b.normalize(), sb.map(Dir::normalize));
            assert_same(n.face_forward(w), |i| sn[i].face_forward(sw[i]).0);
            let frame = FrameLanes::from_normal_tangent(n, c);
            let single = |i: usize| Frame::from_normal_tangent(sn[i], sc[i]);
            assert_same(frame.s, |i| single(i).s);
            assert_same(frame.t, |i| single(i).t);
            assert_same(frame.to_local(w), |i| single(i).to_local(sw[i]).0);
            assert_same(frame.to_world(w), |i| single(i).to_world(crate::LocalDir(sw[i].0)).0);
            let at = PointLanes { p: b, error: c.abs() * PortableFloats::splat(1e-6) };
            let moved =
                |i: usize| error_bound::offset_ray_origin(Point(sb[i]), sc[i].abs() * 1e-6, sn[i], sw[i]);
            assert_same(offset_ray_origin(&at, n, w), |i| moved(i).0);
        }
    }
}
