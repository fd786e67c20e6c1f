//! AVX-512: sixteen lanes in a register.
#![allow(unsafe_code, reason = "intrinsics; see each SAFETY note")]

use std::arch::x86_64::{
    __m512, __m512d, __m512i, __mmask16, _CMP_EQ_OQ, _CMP_LE_OQ, _CMP_LT_OQ, _mm512_abs_pd, _mm512_abs_ps,
    _mm512_add_epi32, _mm512_add_pd, _mm512_add_ps, _mm512_and_si512, _mm512_castpd_si512,
    _mm512_castps_si512, _mm512_castps256_ps512, _mm512_castps512_ps256, _mm512_castsi256_si512,
    _mm512_castsi512_pd, _mm512_castsi512_ps, _mm512_castsi512_si256, _mm512_cmp_pd_mask, _mm512_cmp_ps_mask,
    _mm512_cmpeq_epi32_mask, _mm512_cmplt_epi32_mask, _mm512_cvtepi32_ps, _mm512_cvtepi64_epi32,
    _mm512_cvtepu32_epi64, _mm512_cvtpd_ps, _mm512_cvtps_pd, _mm512_div_pd, _mm512_div_ps,
    _mm512_extractf32x8_ps, _mm512_extracti64x4_epi64, _mm512_insertf32x8, _mm512_inserti64x4,
    _mm512_loadu_ps, _mm512_loadu_si512, _mm512_mask_blend_epi32, _mm512_mask_blend_pd, _mm512_mask_blend_ps,
    _mm512_maskz_compress_ps, _mm512_max_pd, _mm512_max_ps, _mm512_min_pd, _mm512_min_ps, _mm512_mul_pd,
    _mm512_mul_ps, _mm512_mullo_epi32, _mm512_mullo_epi64, _mm512_or_si512, _mm512_set1_epi32,
    _mm512_set1_epi64, _mm512_set1_pd, _mm512_set1_ps, _mm512_slli_epi32, _mm512_slli_epi64, _mm512_sqrt_pd,
    _mm512_sqrt_ps, _mm512_srli_epi32, _mm512_srli_epi64, _mm512_storeu_ps, _mm512_storeu_si512,
    _mm512_sub_epi32, _mm512_sub_pd, _mm512_sub_ps, _mm512_xor_si512,
};
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use math::lanes::{Doubles, Floats, LANES, Longs, Mask, Words};

use super::wide::Wide;
use super::x86;

/// Runs `work` on registers of 512 bits; AVX-512 must be there.
#[inline]
pub(super) fn run_avx512<W: Wide>(work: W) -> W::Output {
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
    fn inner<W: Wide>(work: W) -> W::Output {
        work.run::<F512>()
    }
    assert!(x86::has_avx512());
    // SAFETY: it was asked for just now.
    unsafe { inner(work) }
}

// Only `run_avx512` names these types, where AVX-512 (F, VL, DQ, BW) was detected: that is the fact every method relies on.

/// Floats.
#[derive(Clone, Copy)]
struct F512(__m512);
/// Words.
#[derive(Clone, Copy)]
struct W512(__m512i);
/// Long words, eight each.
#[derive(Clone, Copy)]
struct L512(__m512i, __m512i);
/// Doubles, eight each.
#[derive(Clone, Copy)]
struct D512(__m512d, __m512d);
/// A bit a lane.
#[derive(Clone, Copy)]
struct M512(__mmask16);

/// Calls an intrinsic.
macro_rules! simd {
    ($e:expr) => {
        // SAFETY: AVX-512 was detected, see the types; pointers are of references to all that is read or written.
        unsafe { $e }
    };
}

macro_rules! operator {
    ($name:ident, $trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for $name {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                Self(simd!($intrinsic(self.0, o.0)))
            }
        }
    };
    ($name:ident, $trait:ident, $method:ident, $intrinsic:ident, twice) => {
        impl $trait for $name {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                Self(simd!($intrinsic(self.0, o.0)), simd!($intrinsic(self.1, o.1)))
            }
        }
    };
}

operator!(F512, Add, add, _mm512_add_ps);
operator!(F512, Sub, sub, _mm512_sub_ps);
operator!(F512, Mul, mul, _mm512_mul_ps);
operator!(F512, Div, div, _mm512_div_ps);
operator!(W512, Add, add, _mm512_add_epi32);
operator!(W512, Sub, sub, _mm512_sub_epi32);
operator!(W512, Mul, mul, _mm512_mullo_epi32);
operator!(W512, BitAnd, bitand, _mm512_and_si512);
operator!(W512, BitOr, bitor, _mm512_or_si512);
operator!(W512, BitXor, bitxor, _mm512_xor_si512);
operator!(L512, Mul, mul, _mm512_mullo_epi64, twice);
operator!(L512, BitXor, bitxor, _mm512_xor_si512, twice);
operator!(D512, Add, add, _mm512_add_pd, twice);
operator!(D512, Sub, sub, _mm512_sub_pd, twice);
operator!(D512, Mul, mul, _mm512_mul_pd, twice);
operator!(D512, Div, div, _mm512_div_pd, twice);

impl Mask for M512 {
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        Self(bits as u16)
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self.0)
    }
}

impl BitAnd for M512 {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, o: Self) -> Self {
        Self(self.0 & o.0)
    }
}

impl BitOr for M512 {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, o: Self) -> Self {
        Self(self.0 | o.0)
    }
}

impl Not for M512 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0)
    }
}

impl Neg for F512 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        (self.bits() ^ W512::splat(1 << 31)).floats()
    }
}

impl Neg for D512 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(flipped(self.0), flipped(self.1))
    }
}

impl Floats for F512 {
    type Mask = M512;
    type Words = W512;
    type Doubles = D512;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self(simd!(_mm512_set1_ps(x)))
    }
    #[inline(always)]
    fn load(a: &[f32; LANES]) -> Self {
        Self(simd!(_mm512_loadu_ps(a.as_ptr())))
    }
    #[inline(always)]
    fn store(self, a: &mut [f32; LANES]) {
        simd!(_mm512_storeu_ps(a.as_mut_ptr(), self.0));
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(simd!(_mm512_sqrt_ps(self.0)))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(simd!(_mm512_abs_ps(self.0)))
    }
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        Self(simd!(_mm512_min_ps(self.0, o.0)))
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        Self(simd!(_mm512_max_ps(self.0, o.0)))
    }
    #[inline(always)]
    fn lt(self, o: Self) -> M512 {
        M512(simd!(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, o.0)))
    }
    #[inline(always)]
    fn le(self, o: Self) -> M512 {
        M512(simd!(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, o.0)))
    }
    #[inline(always)]
    fn eq(self, o: Self) -> M512 {
        M512(simd!(_mm512_cmp_ps_mask::<_CMP_EQ_OQ>(self.0, o.0)))
    }
    #[inline(always)]
    fn or_else(self, mask: M512, o: Self) -> Self {
        Self(simd!(_mm512_mask_blend_ps(mask.0, o.0, self.0)))
    }
    #[inline(always)]
    fn front(self, mask: M512) -> Self {
        Self(simd!(_mm512_maskz_compress_ps(mask.0, self.0)))
    }
    #[inline(always)]
    fn bits(self) -> W512 {
        W512(simd!(_mm512_castps_si512(self.0)))
    }
    #[inline(always)]
    fn doubles(self) -> D512 {
        let low = simd!(_mm512_cvtps_pd(_mm512_castps512_ps256(self.0)));
        D512(low, simd!(_mm512_cvtps_pd(_mm512_extractf32x8_ps::<1>(self.0))))
    }
}

impl Words for W512 {
    type Mask = M512;
    type Floats = F512;
    type Longs = L512;

    #[inline(always)]
    fn splat(x: u32) -> Self {
        Self(simd!(_mm512_set1_epi32(x as i32)))
    }
    #[inline(always)]
    fn load(a: &[u32; LANES]) -> Self {
        Self(simd!(_mm512_loadu_si512(a.as_ptr().cast())))
    }
    #[inline(always)]
    fn store(self, a: &mut [u32; LANES]) {
        simd!(_mm512_storeu_si512(a.as_mut_ptr().cast(), self.0));
    }
    #[inline(always)]
    fn shl<const N: u32>(self) -> Self {
        Self(simd!(_mm512_slli_epi32::<N>(self.0)))
    }
    #[inline(always)]
    fn shr<const N: u32>(self) -> Self {
        Self(simd!(_mm512_srli_epi32::<N>(self.0)))
    }
    #[inline(always)]
    fn eq(self, o: Self) -> M512 {
        M512(simd!(_mm512_cmpeq_epi32_mask(self.0, o.0)))
    }
    #[inline(always)]
    fn lt_signed(self, o: Self) -> M512 {
        M512(simd!(_mm512_cmplt_epi32_mask(self.0, o.0)))
    }
    #[inline(always)]
    fn or_else(self, mask: M512, o: Self) -> Self {
        Self(simd!(_mm512_mask_blend_epi32(mask.0, o.0, self.0)))
    }
    #[inline(always)]
    fn floats(self) -> F512 {
        F512(simd!(_mm512_castsi512_ps(self.0)))
    }
    #[inline(always)]
    fn to_floats(self) -> F512 {
        F512(simd!(_mm512_cvtepi32_ps(self.0)))
    }
    #[inline(always)]
    fn longs(self) -> L512 {
        let low = simd!(_mm512_cvtepu32_epi64(_mm512_castsi512_si256(self.0)));
        L512(low, simd!(_mm512_cvtepu32_epi64(_mm512_extracti64x4_epi64::<1>(self.0))))
    }
}

impl Longs for L512 {
    type Words = W512;

    #[inline(always)]
    fn splat(x: u64) -> Self {
        let x = simd!(_mm512_set1_epi64(x as i64));
        Self(x, x)
    }
    #[inline(always)]
    fn load(a: &[u64; LANES]) -> Self {
        let at = a.as_ptr();
        Self(simd!(_mm512_loadu_si512(at.cast())), simd!(_mm512_loadu_si512(at.add(8).cast())))
    }
    #[inline(always)]
    fn store(self, a: &mut [u64; LANES]) {
        let at = a.as_mut_ptr();
        simd!(_mm512_storeu_si512(at.cast(), self.0));
        simd!(_mm512_storeu_si512(at.add(8).cast(), self.1));
    }
    #[inline(always)]
    fn shr<const N: u32>(self) -> Self {
        Self(simd!(_mm512_srli_epi64::<N>(self.0)), simd!(_mm512_srli_epi64::<N>(self.1)))
    }
    #[inline(always)]
    fn of_halves(high: W512, low: W512) -> Self {
        let (high, low) = (high.longs(), low.longs());
        Self(
            simd!(_mm512_or_si512(_mm512_slli_epi64::<32>(high.0), low.0)),
            simd!(_mm512_or_si512(_mm512_slli_epi64::<32>(high.1), low.1)),
        )
    }
    #[inline(always)]
    fn high(self) -> W512 {
        self.shr::<32>().low()
    }
    #[inline(always)]
    fn low(self) -> W512 {
        let low = simd!(_mm512_castsi256_si512(_mm512_cvtepi64_epi32(self.0)));
        W512(simd!(_mm512_inserti64x4::<1>(low, _mm512_cvtepi64_epi32(self.1))))
    }
}

#[inline(always)]
fn flipped(d: __m512d) -> __m512d {
    let sign = simd!(_mm512_set1_epi64(i64::MIN));
    simd!(_mm512_castsi512_pd(_mm512_xor_si512(_mm512_castpd_si512(d), sign)))
}

/// `size`, which is not negative, with the sign of the other.
#[inline(always)]
fn with_sign(size: __m512d, sign: __m512d) -> __m512d {
    let bit = simd!(_mm512_set1_epi64(i64::MIN));
    let sign = simd!(_mm512_and_si512(_mm512_castpd_si512(sign), bit));
    simd!(_mm512_castsi512_pd(_mm512_or_si512(_mm512_castpd_si512(size), sign)))
}

impl D512 {
    #[inline(always)]
    fn masks(low: u8, high: u8) -> M512 {
        M512(u16::from(low) | u16::from(high) << 8)
    }
}

impl Doubles for D512 {
    type Mask = M512;
    type Floats = F512;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        let x = simd!(_mm512_set1_pd(x));
        Self(x, x)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(simd!(_mm512_sqrt_pd(self.0)), simd!(_mm512_sqrt_pd(self.1)))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(simd!(_mm512_abs_pd(self.0)), simd!(_mm512_abs_pd(self.1)))
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        let size = self.abs();
        Self(with_sign(size.0, sign.0), with_sign(size.1, sign.1))
    }
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        Self(simd!(_mm512_min_pd(self.0, o.0)), simd!(_mm512_min_pd(self.1, o.1)))
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        Self(simd!(_mm512_max_pd(self.0, o.0)), simd!(_mm512_max_pd(self.1, o.1)))
    }
    #[inline(always)]
    fn lt(self, o: Self) -> M512 {
        let low = simd!(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, o.0));
        Self::masks(low, simd!(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.1, o.1)))
    }
    #[inline(always)]
    fn le(self, o: Self) -> M512 {
        let low = simd!(_mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.0, o.0));
        Self::masks(low, simd!(_mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.1, o.1)))
    }
    #[inline(always)]
    fn or_else(self, mask: M512, o: Self) -> Self {
        let low = simd!(_mm512_mask_blend_pd(mask.0 as u8, o.0, self.0));
        Self(low, simd!(_mm512_mask_blend_pd((mask.0 >> 8) as u8, o.1, self.1)))
    }
    #[inline(always)]
    fn floats(self) -> F512 {
        let low = simd!(_mm512_castps256_ps512(_mm512_cvtpd_ps(self.0)));
        F512(simd!(_mm512_insertf32x8::<1>(low, _mm512_cvtpd_ps(self.1))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use math::hash;
    use math::lanes::PortableFloats;

    /// One of each operation, folded into bits.
    struct Each([u64; LANES]);

    impl Wide for Each {
        type Output = [[u32; LANES]; 32];

        #[inline(always)]
        fn run<F: Floats>(self) -> Self::Output {
            let longs = <F::Words as Words>::Longs::load(&self.0);
            let (a, b) = (longs.high(), longs.low());
            let (x, y) = (a.unit() - F::splat(0.5), b.unit() - F::splat(0.5));
            let (dx, dy) = (x.doubles(), y.doubles());
            let mask = x.lt(y);
            let m = |mask: F::Mask| F::Words::splat(mask.bits());
            let same = <F::Words as Words>::Longs::of_halves(a, b);
            let mut back = [0; LANES];
            same.store(&mut back);
            assert_eq!(back, self.0);
            let words = [
                a + b,
                a - b,
                a * b,
                a & b,
                a | b,
                a ^ b,
                a.shl::<5>(),
                a.shr::<7>(),
                m(a.eq(b) | a.lt_signed(b)),
                a.or_else(mask, b),
                a.reverse_bits(),
                (x + y).bits(),
                (x - y).bits(),
                (x * y).bits(),
                (x / y).bits(),
                x.abs().sqrt().bits(),
                x.min(y).bits(),
                x.max(y).bits(),
                m(x.le(y) & !x.eq(y)),
                x.or_else(mask, y).bits(),
                x.front(mask).bits(),
                (-x).copysign(y).bits(),
                longs.mix64().low(),
                longs.mix64().high(),
                a.longs().mix64().high(),
                (dx + dy * dx - dy / dx).floats().bits(),
                dx.abs().sqrt().copysign(-dy).floats().bits(),
                dx.min(dy).floats().bits(),
                dx.max(-dy).floats().bits(),
                m(dx.lt(dy) | dy.le(dx)),
                dx.or_else(dx.lt(dy), dy).floats().bits(),
                m(F::Mask::from_bits(0x1234) & x.is_finite()),
            ];
            let mut out = [[0; LANES]; 32];
            for (out, w) in out.iter_mut().zip(words) {
                w.store(out);
            }
            out
        }
    }

    #[test]
    fn registers_have_the_bits_of_arrays() {
        for key in 0..500_u64 {
            let mut longs = [0; LANES];
            for (i, l) in longs.iter_mut().enumerate() {
                *l = hash::combine(key, i as u64);
            }
            // Some lanes alike.
            longs[3] = (longs[3] >> 32) | (longs[3] & !0xffff_ffff);
            let portable = Each(longs).run::<PortableFloats>();
            for isa in crate::Isa::ALL {
                let Some(other) = crate::run_wide(isa, Each(longs)) else { continue };
                for (i, (a, b)) in portable.iter().zip(&other).enumerate() {
                    assert_eq!(a, b, "{isa:?}: operation {i}");
                }
            }
        }
    }
}
