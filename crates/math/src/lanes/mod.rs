//! Sixteen of everything, side by side: what formulas need that are worked out for sixteen paths at once.
//!
//! A formula is written once over [`Floats`] and runs on the registers of `accel`'s kernels, or for comparison on plain arrays
//! ([`PortableFloats`]). Every operation is rounded as on a single `f32` and nothing is fused or reordered, so that a lane has
//! the bits that scalar code with the same operations has.
//!
//! Generic code over lanes must be `#[inline(always)]` down to the operations: only then is it compiled for the
//! instructions of the kernel that it is called from.

mod geometry;
mod portable;
mod trig;

use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

pub use geometry::{Columns, FrameLanes, PointLanes, Vec3Lanes, in_lane, offset_ray_origin};
pub use portable::{PortableDoubles, PortableFloats, PortableLongs, PortableWords};
pub use trig::{atan2, sin_cos_within_an_eighth};

/// How many.
pub const LANES: usize = 16;

/// A yes or no in each lane.
pub trait Mask: Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    /// From the lowest sixteen bits.
    fn from_bits(bits: u32) -> Self;

    /// Bit `i` is lane `i`; the others are zero.
    fn bits(self) -> u32;

    /// Yes in any lane?
    #[inline(always)]
    fn any(self) -> bool {
        self.bits() != 0
    }
}

/// Sixteen `f32`.
pub trait Floats:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// What comparisons give.
    type Mask: Mask;
    /// Their bits.
    type Words: Words<Floats = Self, Mask = Self::Mask>;
    /// The same in double precision.
    type Doubles: Doubles<Floats = Self, Mask = Self::Mask>;

    /// The same in every lane.
    fn splat(x: f32) -> Self;
    /// From memory.
    fn load(a: &[f32; LANES]) -> Self;
    /// To memory.
    fn store(self, a: &mut [f32; LANES]);
    /// Square root.
    fn sqrt(self) -> Self;
    /// Size.
    fn abs(self) -> Self;
    /// The smaller; the second where the two are equal or unordered.
    fn min(self, other: Self) -> Self;
    /// The larger; the second where the two are equal or unordered.
    fn max(self, other: Self) -> Self;
    /// `<`, false for NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// `<=`, false for NaN.
    fn le(self, other: Self) -> Self::Mask;
    /// `==`, false for NaN.
    fn eq(self, other: Self) -> Self::Mask;
    /// Its own lanes where the mask says yes, else the other's.
    fn or_else(self, mask: Self::Mask, other: Self) -> Self;
    /// The lanes of the mask moved together to the front; after them come zeros.
    fn front(self, mask: Self::Mask) -> Self;
    /// The bits.
    fn bits(self) -> Self::Words;
    /// In double precision.
    fn doubles(self) -> Self::Doubles;

    /// `>`, false for NaN.
    #[inline(always)]
    fn gt(self, other: Self) -> Self::Mask {
        other.lt(self)
    }

    /// Its size with the sign of `sign`.
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        let bit = Self::Words::splat(1 << 31);
        (self.abs().bits() | (sign.bits() & bit)).floats()
    }

    /// Neither infinite nor NaN?
    #[inline(always)]
    fn is_finite(self) -> Self::Mask {
        self.abs().lt(Self::splat(f32::INFINITY))
    }

    /// Square root of a value that rounding may have pushed below zero.
    #[inline(always)]
    fn safe_sqrt(self) -> Self {
        self.max(Self::splat(0.0)).sqrt()
    }
}

/// Sixteen `u32`; sums, differences and products wrap around.
pub trait Words:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + BitXor<Output = Self>
{
    /// What comparisons give.
    type Mask: Mask;
    /// Of the same bits.
    type Floats: Floats<Words = Self, Mask = Self::Mask>;
    /// The same in 64 bits.
    type Longs: Longs<Words = Self>;

    /// The same in every lane.
    fn splat(x: u32) -> Self;
    /// From memory.
    fn load(a: &[u32; LANES]) -> Self;
    /// To memory.
    fn store(self, a: &mut [u32; LANES]);
    /// `<<`.
    fn shl<const N: u32>(self) -> Self;
    /// `>>`.
    fn shr<const N: u32>(self) -> Self;
    /// `==`.
    fn eq(self, other: Self) -> Self::Mask;
    /// `<` of signed numbers.
    fn lt_signed(self, other: Self) -> Self::Mask;
    /// Its own lanes where the mask says yes, else the other's.
    fn or_else(self, mask: Self::Mask, other: Self) -> Self;
    /// The floats that have these bits.
    fn floats(self) -> Self::Floats;
    /// The numbers as floats; each below 2³¹.
    fn to_floats(self) -> Self::Floats;
    /// Filled up with zeros.
    fn longs(self) -> Self::Longs;

    /// The lowest bit first.
    #[inline(always)]
    fn reverse_bits(self) -> Self {
        let x = (self & Self::splat(0x5555_5555)).shl::<1>() | (self.shr::<1>() & Self::splat(0x5555_5555));
        let x = (x & Self::splat(0x3333_3333)).shl::<2>() | (x.shr::<2>() & Self::splat(0x3333_3333));
        let x = (x & Self::splat(0x0f0f_0f0f)).shl::<4>() | (x.shr::<4>() & Self::splat(0x0f0f_0f0f));
        let x = (x & Self::splat(0x00ff_00ff)).shl::<8>() | (x.shr::<8>() & Self::splat(0x00ff_00ff));
        x.shl::<16>() | x.shr::<16>()
    }

    /// [`crate::hash::unit_f32`].
    #[inline(always)]
    fn unit(self) -> Self::Floats {
        self.shr::<8>().to_floats() * Self::Floats::splat(1.0 / 16_777_216.0)
    }
}

/// Sixteen `u64`; products wrap around.
pub trait Longs: Copy + Mul<Output = Self> + BitXor<Output = Self> {
    /// Halves.
    type Words: Words<Longs = Self>;

    /// The same in every lane.
    fn splat(x: u64) -> Self;
    /// From memory.
    fn load(a: &[u64; LANES]) -> Self;
    /// `>>`.
    fn shr<const N: u32>(self) -> Self;
    /// Both halves, the upper ones first, put together.
    fn of_halves(high: Self::Words, low: Self::Words) -> Self;
    /// To memory.
    fn store(self, a: &mut [u64; LANES]);
    /// The upper 32 bits.
    fn high(self) -> Self::Words;
    /// The lower 32 bits.
    fn low(self) -> Self::Words;

    /// [`crate::hash::mix64`].
    #[inline(always)]
    fn mix64(self) -> Self {
        let x = (self ^ self.shr::<30>()) * Self::splat(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ x.shr::<27>()) * Self::splat(0x94d0_49bb_1331_11eb);
        x ^ x.shr::<31>()
    }
}

/// Sixteen `f64`.
pub trait Doubles:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// What comparisons give.
    type Mask: Mask;
    /// In single precision.
    type Floats: Floats<Doubles = Self, Mask = Self::Mask>;

    /// The same in every lane.
    fn splat(x: f64) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Size.
    fn abs(self) -> Self;
    /// Its size with the sign of `sign`.
    fn copysign(self, sign: Self) -> Self;
    /// The smaller; the second where the two are equal or unordered.
    fn min(self, other: Self) -> Self;
    /// The larger; the second where the two are equal or unordered.
    fn max(self, other: Self) -> Self;
    /// `<`, false for NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// `<=`, false for NaN.
    fn le(self, other: Self) -> Self::Mask;
    /// Its own lanes where the mask says yes, else the other's.
    fn or_else(self, mask: Self::Mask, other: Self) -> Self;
    /// Rounded to single precision.
    fn floats(self) -> Self::Floats;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash;

    #[test]
    fn bits_are_reversed_and_hashed_as_in_single_words() {
        let mut words = [0; LANES];
        let mut longs = [0; LANES];
        for i in 0..LANES {
            longs[i] = hash::mix64(i as u64);
            words[i] = longs[i] as u32;
        }
        let (mut reversed, mut high, mut low) = ([0; LANES], [0; LANES], [0; LANES]);
        PortableWords::load(&words).reverse_bits().store(&mut reversed);
        let hashed = PortableLongs::load(&longs).mix64();
        hashed.high().store(&mut high);
        hashed.low().store(&mut low);
        let mut unit = [0.0; LANES];
        PortableWords::load(&words).unit().store(&mut unit);
        for i in 0..LANES {
            assert_eq!(reversed[i], words[i].reverse_bits());
            assert_eq!(u64::from(high[i]) << 32 | u64::from(low[i]), hash::mix64(longs[i]));
            assert_eq!(unit[i], hash::unit_f32(words[i]));
        }
    }
}
