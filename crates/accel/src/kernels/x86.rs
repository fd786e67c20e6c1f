//! AVX2 and AVX-512: eight lanes in a 256-bit register.
//!
//! The AVX-512 kernel is the same source with 32 registers and mask registers at the compiler's hand (AVX-512VL).
#![allow(unsafe_code, reason = "intrinsics; see each SAFETY note")]

use std::arch::x86_64::{
    __m256, _CMP_LE_OQ, _mm256_cmp_ps, _mm256_fmadd_ps, _mm256_loadu_ps, _mm256_max_ps, _mm256_min_ps,
    _mm256_movemask_ps, _mm256_mul_ps, _mm256_set1_ps, _mm256_storeu_ps, _mm256_sub_ps,
};

use super::lanes::{Kernel, Lanes, Pair};
use crate::layout::WIDTH;

/// Without it, the portable kernel rounds products and sums once by calling a library.
pub(super) fn has_fma() -> bool {
    is_x86_feature_detected!("fma")
}

pub(super) fn has_avx2() -> bool {
    is_x86_feature_detected!("avx2")
        && has_fma()
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("lzcnt")
        && is_x86_feature_detected!("popcnt")
}

pub(super) fn has_avx512() -> bool {
    has_avx2()
        && is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512vl")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512bw")
}

/// Only functions below, which run where AVX2 and FMA were detected, name this type: that is the fact every method relies on.
#[derive(Clone, Copy)]
struct Avx(__m256);

impl Lanes<WIDTH> for Avx {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        // SAFETY: AVX2 was detected, see the type.
        Self(unsafe { _mm256_set1_ps(x) })
    }
    #[inline(always)]
    fn load(a: &[f32; 8]) -> Self {
        // SAFETY: AVX2 was detected, see the type; the reference is to eight floats.
        Self(unsafe { _mm256_loadu_ps(a.as_ptr()) })
    }
    #[inline(always)]
    fn store(self, a: &mut [f32; 8]) {
        // SAFETY: AVX2 was detected, see the type; the reference is to eight floats.
        unsafe { _mm256_storeu_ps(a.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        // SAFETY: AVX2 was detected, see the type.
        Self(unsafe { _mm256_sub_ps(self.0, b.0) })
    }
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        // SAFETY: AVX2 was detected, see the type.
        Self(unsafe { _mm256_mul_ps(self.0, b.0) })
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        // SAFETY: FMA was detected, see the type.
        Self(unsafe { _mm256_fmadd_ps(self.0, b.0, c.0) })
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        // SAFETY: AVX2 was detected, see the type.
        Self(unsafe { _mm256_min_ps(self.0, b.0) })
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        // SAFETY: AVX2 was detected, see the type.
        Self(unsafe { _mm256_max_ps(self.0, b.0) })
    }
    #[inline(always)]
    fn le(self, b: Self) -> u32 {
        // SAFETY: AVX2 was detected, see the type.
        (unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, b.0)) }) as u32
    }
}

/// Pairs of registers for nodes. One register of 512 bits instead is slower where such operations take two steps.
struct Avx2;

impl Kernel for Avx2 {
    type Node = Pair<Avx>;
    type Block = Avx;
}

/// The entries to one kernel: its module, registers and instruction sets, and the function that detects these.
macro_rules! kernel {
    ($name:ident, $registers:ty, $features:literal, $detected:ident) => {
        pub(super) mod $name {
            use math::Ray;

            use crate::accel::Accel;
            use crate::hit::Hit;
            use crate::kernels::traverse;

            #[target_feature(enable = $features)]
            fn nearest_of<const I: bool, F>(accel: &Accel, ray: &Ray, filter: &mut F) -> Option<Hit>
            where
                F: FnMut(&Hit) -> bool,
            {
                traverse::nearest::<$registers, I, F>(accel, ray, filter)
            }

            #[target_feature(enable = $features)]
            fn any_of<const I: bool, F>(accel: &Accel, ray: &Ray, filter: &mut F) -> bool
            where
                F: FnMut(&Hit) -> bool,
            {
                traverse::any::<$registers, I, F>(accel, ray, filter)
            }

            #[inline]
            pub(in crate::kernels) fn nearest<F>(accel: &Accel, ray: &Ray, filter: &mut F) -> Option<Hit>
            where
                F: FnMut(&Hit) -> bool,
            {
                debug_assert!(super::$detected());
                if accel.placed.is_empty() {
                    // SAFETY: an `Accel` names this kernel only after it was detected.
                    return unsafe { nearest_of::<false, F>(accel, ray, filter) };
                }
                // SAFETY: an `Accel` names this kernel only after it was detected.
                unsafe { nearest_of::<true, F>(accel, ray, filter) }
            }

            #[inline]
            pub(in crate::kernels) fn any<F>(accel: &Accel, ray: &Ray, filter: &mut F) -> bool
            where
                F: FnMut(&Hit) -> bool,
            {
                debug_assert!(super::$detected());
                if accel.placed.is_empty() {
                    // SAFETY: an `Accel` names this kernel only after it was detected.
                    return unsafe { any_of::<false, F>(accel, ray, filter) };
                }
                // SAFETY: an `Accel` names this kernel only after it was detected.
                unsafe { any_of::<true, F>(accel, ray, filter) }
            }
        }
    };
}

kernel!(fma, crate::kernels::scalar::Scalar, "fma", has_fma);
kernel!(avx2, super::Avx2, "avx2,fma,bmi1,bmi2,lzcnt,popcnt", has_avx2);
kernel!(
    avx512,
    super::Avx2,
    "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt",
    has_avx512
);
