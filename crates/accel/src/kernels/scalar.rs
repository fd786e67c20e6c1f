//! The oracle: plain loops over eight lanes, for every processor.

use math::Ray;

use super::lanes::{Kernel, Lanes, Pair};
use super::{Filter, stream, traverse};
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
    #[inline(always)]
    fn keep(self, mask: u32, other: Self) -> Self {
        Self(std::array::from_fn(|i| if mask >> i & 1 != 0 { self.0[i] } else { other.0[i] }))
    }
    #[inline(always)]
    fn most(self) -> f32 {
        self.0.into_iter().fold(f32::NEG_INFINITY, ray_space::max)
    }
}

/// Plain loops.
pub(super) struct Scalar;

impl Kernel for Scalar {
    type Node = Pair<Plain>;
    type Block = Plain;
    type Rays = Pair<Plain>;
    const PACKETS: bool = false;
}

/// One entry: its name, what it calls, the filter if that is generic, and the signature.
macro_rules! entry {
    ($name:ident, $module:ident::$call:ident, $filter:path, ($($arg:ident: $t:ty,)*) -> $result:ty) => {
        pub(super) fn $name<F: $filter>(accel: &Accel, $($arg: $t,)* filter: &mut F) -> $result {
            if accel.placed.is_empty() {
                return $module::$call::<Scalar, false, F>(accel, $($arg,)* filter);
            }
            $module::$call::<Scalar, true, F>(accel, $($arg,)* filter)
        }
    };
    ($name:ident, $module:ident::$call:ident, ($($arg:ident: $t:ty),*)) => {
        pub(super) fn $name(accel: &Accel, $($arg: $t),*) {
            if accel.placed.is_empty() {
                return $module::$call::<Scalar, false>(accel, $($arg),*);
            }
            $module::$call::<Scalar, true>(accel, $($arg),*)
        }
    };
}

entry!(nearest, traverse::nearest, FnMut(&Hit) -> bool, (ray: &Ray,) -> Option<Hit>);
entry!(any, traverse::any, FnMut(&Hit) -> bool, (ray: &Ray,) -> bool);
entry!(nearest_many, stream::nearest, (rays: &[Ray], hits: &mut [Option<Hit>], filter: Filter<'_>));
entry!(any_many, stream::any, (rays: &[Ray], blocked: &mut [bool], filter: Filter<'_>));
