//! AVX2 and AVX-512: eight lanes in a 256-bit register.
//!
//! The AVX-512 kernel is the same source with 32 registers and mask registers at the compiler's hand (AVX-512VL).
#![allow(unsafe_code, reason = "intrinsics; see each SAFETY note")]

use std::arch::x86_64::{
    __m256, __m512, _CMP_LE_OQ, _mm_cvtss_f32, _mm_max_ps, _mm_max_ss, _mm_movehdup_ps, _mm_movehl_ps,
    _mm256_and_si256, _mm256_blendv_ps, _mm256_castps256_ps128, _mm256_castsi256_ps, _mm256_cmp_ps,
    _mm256_cmpeq_epi32, _mm256_extractf128_ps, _mm256_fmadd_ps, _mm256_loadu_ps, _mm256_max_ps,
    _mm256_min_ps, _mm256_movemask_ps, _mm256_mul_ps, _mm256_set1_epi32, _mm256_set1_ps, _mm256_setr_epi32,
    _mm256_storeu_ps, _mm256_sub_ps, _mm512_cmp_ps_mask, _mm512_fmadd_ps, _mm512_loadu_ps,
    _mm512_mask_blend_ps, _mm512_max_ps, _mm512_min_ps, _mm512_mul_ps, _mm512_reduce_max_ps, _mm512_set1_ps,
    _mm512_storeu_ps, _mm512_sub_ps,
};

use super::lanes::{Kernel, Lanes, Pair};
use super::stream::RAYS;
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
    #[inline(always)]
    fn keep(self, mask: u32, other: Self) -> Self {
        // SAFETY: AVX2 was detected, see the type.
        Self(unsafe {
            let bit = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let is_in = _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(mask as i32), bit), bit);
            _mm256_blendv_ps(other.0, self.0, _mm256_castsi256_ps(is_in))
        })
    }
    #[inline(always)]
    fn most(self) -> f32 {
        // SAFETY: AVX2 was detected, see the type.
        unsafe {
            let four = _mm_max_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
            let two = _mm_max_ps(four, _mm_movehl_ps(four, four));
            _mm_cvtss_f32(_mm_max_ss(two, _mm_movehdup_ps(two)))
        }
    }
}

/// Only functions below, which run where AVX-512 was detected, name this type: that is the fact every method relies on.
#[derive(Clone, Copy)]
struct Zmm(__m512);

impl Lanes<RAYS> for Zmm {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        // SAFETY: AVX-512 was detected, see the type.
        Self(unsafe { _mm512_set1_ps(x) })
    }
    #[inline(always)]
    fn load(a: &[f32; RAYS]) -> Self {
        // SAFETY: AVX-512 was detected, see the type; the reference is to sixteen floats.
        Self(unsafe { _mm512_loadu_ps(a.as_ptr()) })
    }
    #[inline(always)]
    fn store(self, a: &mut [f32; RAYS]) {
        // SAFETY: AVX-512 was detected, see the type; the reference is to sixteen floats.
        unsafe { _mm512_storeu_ps(a.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        // SAFETY: AVX-512 was detected, see the type.
        Self(unsafe { _mm512_sub_ps(self.0, b.0) })
    }
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        // SAFETY: AVX-512 was detected, see the type.
        Self(unsafe { _mm512_mul_ps(self.0, b.0) })
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        // SAFETY: AVX-512 was detected, see the type.
        Self(unsafe { _mm512_fmadd_ps(self.0, b.0, c.0) })
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        // SAFETY: AVX-512 was detected, see the type.
        Self(unsafe { _mm512_min_ps(self.0, b.0) })
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        // SAFETY: AVX-512 was detected, see the type.
        Self(unsafe { _mm512_max_ps(self.0, b.0) })
    }
    #[inline(always)]
    fn le(self, b: Self) -> u32 {
        // SAFETY: AVX-512 was detected, see the type.
        u32::from(unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, b.0) })
    }
    #[inline(always)]
    fn keep(self, mask: u32, other: Self) -> Self {
        // SAFETY: AVX-512 was detected, see the type.
        Self(unsafe { _mm512_mask_blend_ps(mask as u16, other.0, self.0) })
    }
    #[inline(always)]
    fn most(self) -> f32 {
        // SAFETY: AVX-512 was detected, see the type.
        unsafe { _mm512_reduce_max_ps(self.0) }
    }
}

/// Pairs of registers for nodes. One register of 512 bits instead is slower where such operations take two steps.
struct Avx2;

impl Kernel for Avx2 {
    type Node = Pair<Avx>;
    type Block = Avx;
    type Rays = Pair<Avx>;
    const PACKETS: bool = true;
}

/// The same with one register for the rays of a packet: half as many instructions, twice as many numbers at hand.
struct Avx512;

impl Kernel for Avx512 {
    type Node = Pair<Avx>;
    type Block = Avx;
    type Rays = Zmm;
    const PACKETS: bool = true;
}

/// The entries to one kernel: its module, registers and instruction sets, and the function that detects these.
macro_rules! kernel {
    ($name:ident, $registers:ty, $features:literal, $detected:ident) => {
        pub(super) mod $name {
            use math::Ray;

            use crate::accel::Accel;
            use crate::hit::Hit;
            use crate::kernels::{Filter, stream, traverse};

            entry!($registers, $features, $detected, traverse::nearest, nearest, nearest_of,
                FnMut(&Hit) -> bool, (ray: &Ray,) -> Option<Hit>);
            entry!($registers, $features, $detected, traverse::any, any, any_of,
                FnMut(&Hit) -> bool, (ray: &Ray,) -> bool);
            entry!($registers, $features, $detected, stream::nearest, nearest_many, nearest_many_of,
                (rays: &[Ray], hits: &mut [Option<Hit>], filter: Filter<'_>));
            entry!($registers, $features, $detected, stream::any, any_many, any_many_of,
                (rays: &[Ray], blocked: &mut [bool], filter: Filter<'_>));
        }
    };
}

/// One entry: what it calls, its name and that of the function with the features, the filter if that is generic, and the
/// signature.
macro_rules! entry {
    ($registers:ty, $features:literal, $detected:ident, $module:ident::$call:ident, $name:ident, $inner:ident,
        $filter:path, ($($arg:ident: $t:ty,)*) -> $result:ty) => {
        #[target_feature(enable = $features)]
        fn $inner<const I: bool, F: $filter>(accel: &Accel, $($arg: $t,)* filter: &mut F) -> $result {
            $module::$call::<$registers, I, F>(accel, $($arg,)* filter)
        }

        #[inline]
        pub(in crate::kernels) fn $name<F: $filter>(accel: &Accel, $($arg: $t,)* filter: &mut F) -> $result {
            debug_assert!(super::$detected());
            if accel.placed.is_empty() {
                // SAFETY: an `Accel` names this kernel only after it was detected.
                return unsafe { $inner::<false, F>(accel, $($arg,)* filter) };
            }
            // SAFETY: an `Accel` names this kernel only after it was detected.
            unsafe { $inner::<true, F>(accel, $($arg,)* filter) }
        }
    };
    ($registers:ty, $features:literal, $detected:ident, $module:ident::$call:ident, $name:ident, $inner:ident,
        ($($arg:ident: $t:ty),*)) => {
        #[target_feature(enable = $features)]
        fn $inner<const I: bool>(accel: &Accel, $($arg: $t),*) {
            $module::$call::<$registers, I>(accel, $($arg),*);
        }

        pub(in crate::kernels) fn $name(accel: &Accel, $($arg: $t),*) {
            debug_assert!(super::$detected());
            if accel.placed.is_empty() {
                // SAFETY: an `Accel` names this kernel only after it was detected.
                return unsafe { $inner::<false>(accel, $($arg),*) };
            }
            // SAFETY: an `Accel` names this kernel only after it was detected.
            unsafe { $inner::<true>(accel, $($arg),*) }
        }
    };
}

kernel!(fma, crate::kernels::scalar::Scalar, "fma", has_fma);
kernel!(avx2, super::Avx2, "avx2,fma,bmi1,bmi2,lzcnt,popcnt", has_avx2);
kernel!(
    avx512,
    super::Avx512,
    "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt",
    has_avx512
);
