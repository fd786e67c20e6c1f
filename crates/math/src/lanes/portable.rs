//! Lanes as arrays: what registers are compared with. (No way to render: single paths are faster.)

use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use super::{Doubles, Floats, LANES, Longs, Mask, Words};

/// Sixteen floats.
#[derive(Clone, Copy, Debug)]
pub struct PortableFloats([f32; LANES]);

/// Sixteen words.
#[derive(Clone, Copy, Debug)]
pub struct PortableWords([u32; LANES]);

/// Sixteen long words.
#[derive(Clone, Copy, Debug)]
pub struct PortableLongs([u64; LANES]);

/// Sixteen doubles.
#[derive(Clone, Copy, Debug)]
pub struct PortableDoubles([f64; LANES]);

/// A bit for each lane.
#[derive(Clone, Copy, Debug)]
pub struct PortableMask(u16);

impl Mask for PortableMask {
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        Self(bits as u16)
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self.0)
    }
}

impl BitAnd for PortableMask {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, o: Self) -> Self {
        Self(self.0 & o.0)
    }
}

impl BitOr for PortableMask {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, o: Self) -> Self {
        Self(self.0 | o.0)
    }
}

impl Not for PortableMask {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0)
    }
}

/// A loop over the lanes of one array. (Not `map`, of which calls are left.)
macro_rules! each {
    ($zero:expr, |$i:ident| $value:expr) => {{
        let mut out = [$zero; LANES];
        let mut $i = 0;
        while $i < LANES {
            out[$i] = $value;
            $i += 1;
        }
        out
    }};
}

/// The lanes in which a comparison holds.
macro_rules! mask {
    (|$i:ident| $holds:expr) => {{
        let mut bits = 0_u16;
        let mut $i = 0;
        while $i < LANES {
            bits |= u16::from($holds) << $i;
            $i += 1;
        }
        PortableMask(bits)
    }};
}

macro_rules! operator {
    ($name:ident, $zero:expr, $trait:ident, $method:ident, |$a:ident, $b:ident| $value:expr) => {
        impl $trait for $name {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                Self(each!($zero, |i| {
                    let ($a, $b) = (self.0[i], o.0[i]);
                    $value
                }))
            }
        }
    };
}

operator!(PortableFloats, 0.0, Add, add, |a, b| a + b);
operator!(PortableFloats, 0.0, Sub, sub, |a, b| a - b);
operator!(PortableFloats, 0.0, Mul, mul, |a, b| a * b);
operator!(PortableFloats, 0.0, Div, div, |a, b| a / b);
operator!(PortableDoubles, 0.0, Add, add, |a, b| a + b);
operator!(PortableDoubles, 0.0, Sub, sub, |a, b| a - b);
operator!(PortableDoubles, 0.0, Mul, mul, |a, b| a * b);
operator!(PortableDoubles, 0.0, Div, div, |a, b| a / b);
operator!(PortableWords, 0, Add, add, |a, b| a.wrapping_add(b));
operator!(PortableWords, 0, Sub, sub, |a, b| a.wrapping_sub(b));
operator!(PortableWords, 0, Mul, mul, |a, b| a.wrapping_mul(b));
operator!(PortableWords, 0, BitAnd, bitand, |a, b| a & b);
operator!(PortableWords, 0, BitOr, bitor, |a, b| a | b);
operator!(PortableWords, 0, BitXor, bitxor, |a, b| a ^ b);
operator!(PortableLongs, 0, Mul, mul, |a, b| a.wrapping_mul(b));
operator!(PortableLongs, 0, BitXor, bitxor, |a, b| a ^ b);

impl Neg for PortableFloats {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(each!(0.0, |i| -self.0[i]))
    }
}

impl Neg for PortableDoubles {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(each!(0.0, |i| -self.0[i]))
    }
}

impl Floats for PortableFloats {
    type Mask = PortableMask;
    type Words = PortableWords;
    type Doubles = PortableDoubles;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self([x; LANES])
    }
    #[inline(always)]
    fn load(a: &[f32; LANES]) -> Self {
        Self(*a)
    }
    #[inline(always)]
    fn store(self, a: &mut [f32; LANES]) {
        *a = self.0;
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(each!(0.0, |i| self.0[i].sqrt()))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(each!(0.0, |i| self.0[i].abs()))
    }
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        Self(each!(0.0, |i| if self.0[i] < o.0[i] { self.0[i] } else { o.0[i] }))
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        Self(each!(0.0, |i| if self.0[i] > o.0[i] { self.0[i] } else { o.0[i] }))
    }
    #[inline(always)]
    fn lt(self, o: Self) -> PortableMask {
        mask!(|i| self.0[i] < o.0[i])
    }
    #[inline(always)]
    fn le(self, o: Self) -> PortableMask {
        mask!(|i| self.0[i] <= o.0[i])
    }
    #[inline(always)]
    fn eq(self, o: Self) -> PortableMask {
        mask!(|i| self.0[i] == o.0[i])
    }
    #[inline(always)]
    fn or_else(self, mask: PortableMask, o: Self) -> Self {
        Self(each!(0.0, |i| if mask.0 >> i & 1 == 1 { self.0[i] } else { o.0[i] }))
    }
    #[inline(always)]
    fn front(self, mask: PortableMask) -> Self {
        let (mut out, mut n) = ([0.0; LANES], 0);
        let mut i = 0;
        while i < LANES {
            // Where it is not of the mask, the next one takes its place.
            out[n & (LANES - 1)] = if mask.0 >> i & 1 == 1 { self.0[i] } else { out[n & (LANES - 1)] };
            n += usize::from(mask.0 >> i & 1);
            i += 1;
        }
        Self(out)
    }
    #[inline(always)]
    fn bits(self) -> PortableWords {
        PortableWords(each!(0, |i| self.0[i].to_bits()))
    }
    #[inline(always)]
    fn doubles(self) -> PortableDoubles {
        PortableDoubles(each!(0.0, |i| f64::from(self.0[i])))
    }
}

impl Words for PortableWords {
    type Mask = PortableMask;
    type Floats = PortableFloats;
    type Longs = PortableLongs;

    #[inline(always)]
    fn splat(x: u32) -> Self {
        Self([x; LANES])
    }
    #[inline(always)]
    fn load(a: &[u32; LANES]) -> Self {
        Self(*a)
    }
    #[inline(always)]
    fn store(self, a: &mut [u32; LANES]) {
        *a = self.0;
    }
    #[inline(always)]
    fn shl<const N: u32>(self) -> Self {
        Self(each!(0, |i| self.0[i] << N))
    }
    #[inline(always)]
    fn shr<const N: u32>(self) -> Self {
        Self(each!(0, |i| self.0[i] >> N))
    }
    #[inline(always)]
    fn eq(self, o: Self) -> PortableMask {
        mask!(|i| self.0[i] == o.0[i])
    }
    #[inline(always)]
    fn lt_signed(self, o: Self) -> PortableMask {
        mask!(|i| (self.0[i] as i32) < (o.0[i] as i32))
    }
    #[inline(always)]
    fn or_else(self, mask: PortableMask, o: Self) -> Self {
        Self(each!(0, |i| if mask.0 >> i & 1 == 1 { self.0[i] } else { o.0[i] }))
    }
    #[inline(always)]
    fn floats(self) -> PortableFloats {
        PortableFloats(each!(0.0, |i| f32::from_bits(self.0[i])))
    }
    #[inline(always)]
    fn to_floats(self) -> PortableFloats {
        PortableFloats(each!(0.0, |i| self.0[i] as f32))
    }
    #[inline(always)]
    fn longs(self) -> PortableLongs {
        PortableLongs(each!(0, |i| u64::from(self.0[i])))
    }
}

impl Longs for PortableLongs {
    type Words = PortableWords;

    #[inline(always)]
    fn splat(x: u64) -> Self {
        Self([x; LANES])
    }
    #[inline(always)]
    fn load(a: &[u64; LANES]) -> Self {
        Self(*a)
    }
    #[inline(always)]
    fn shr<const N: u32>(self) -> Self {
        Self(each!(0, |i| self.0[i] >> N))
    }
    #[inline(always)]
    fn of_halves(high: PortableWords, low: PortableWords) -> Self {
        Self(each!(0, |i| u64::from(high.0[i]) << 32 | u64::from(low.0[i])))
    }
    #[inline(always)]
    fn store(self, a: &mut [u64; LANES]) {
        *a = self.0;
    }
    #[inline(always)]
    fn high(self) -> PortableWords {
        PortableWords(each!(0, |i| (self.0[i] >> 32) as u32))
    }
    #[inline(always)]
    fn low(self) -> PortableWords {
        PortableWords(each!(0, |i| self.0[i] as u32))
    }
}

impl Doubles for PortableDoubles {
    type Mask = PortableMask;
    type Floats = PortableFloats;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self([x; LANES])
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(each!(0.0, |i| self.0[i].sqrt()))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(each!(0.0, |i| self.0[i].abs()))
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        Self(each!(0.0, |i| self.0[i].copysign(sign.0[i])))
    }
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        Self(each!(0.0, |i| if self.0[i] < o.0[i] { self.0[i] } else { o.0[i] }))
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        Self(each!(0.0, |i| if self.0[i] > o.0[i] { self.0[i] } else { o.0[i] }))
    }
    #[inline(always)]
    fn lt(self, o: Self) -> PortableMask {
        mask!(|i| self.0[i] < o.0[i])
    }
    #[inline(always)]
    fn le(self, o: Self) -> PortableMask {
        mask!(|i| self.0[i] <= o.0[i])
    }
    #[inline(always)]
    fn or_else(self, mask: PortableMask, o: Self) -> Self {
        Self(each!(0.0, |i| if mask.0 >> i & 1 == 1 { self.0[i] } else { o.0[i] }))
    }
    #[inline(always)]
    fn floats(self) -> PortableFloats {
        PortableFloats(each!(0.0, |i| self.0[i] as f32))
    }
}
