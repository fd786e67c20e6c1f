//! The oracle: plain loops over eight lanes, for every processor.

use math::Ray;

use super::lanes::{Kernel, Lanes, Pair};
use super::traverse;
use crate::accel::Accel;
use crate::hit::Hit;
use crate::layout::WIDTH;
use crate::ray_space;

#[derive(Clone, Copy)]
pub(super) struct Plain([f32; 8]);

impl Plain {
    #[inline(always)]
    fn zip(self, b: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], b.0[i])))
    }
}

impl Lanes<WIDTH> for Plain {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self([x; 8])
    }
    #[inline(always)]
    fn load(a: &[f32; 8]) -> Self {
        Self(*a)
    }
    #[inline(always)]
    fn store(self, a: &mut [f32; 8]) {
        *a = self.0;
    }
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        self.zip(b, |x, y| x - y)
    }
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        self.zip(b, |x, y| x * y)
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i].mul_add(b.0[i], c.0[i])))
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        self.zip(b, ray_space::min)
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        self.zip(b, ray_space::max)
    }
    #[inline(always)]
    fn le(self, b: Self) -> u32 {
        (0..8).fold(0, |m, i| m | (u32::from(self.0[i] <= b.0[i]) << i))
    }
}

/// Plain loops.
pub(super) struct Scalar;

impl Kernel for Scalar {
    type Node = Pair<Plain>;
    type Block = Plain;
}

pub(super) fn nearest<F: FnMut(&Hit) -> bool>(accel: &Accel, ray: &Ray, filter: &mut F) -> Option<Hit> {
    if accel.placed.is_empty() {
        return traverse::nearest::<Scalar, false, F>(accel, ray, filter);
    }
    traverse::nearest::<Scalar, true, F>(accel, ray, filter)
}

pub(super) fn any<F: FnMut(&Hit) -> bool>(accel: &Accel, ray: &Ray, filter: &mut F) -> bool {
    if accel.placed.is_empty() {
        return traverse::any::<Scalar, false, F>(accel, ray, filter);
    }
    traverse::any::<Scalar, true, F>(accel, ray, filter)
}
