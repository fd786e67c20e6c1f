//! AVX2 and AVX-512: eight lanes in a 256-bit register, sixteen in two or in one of 512 bits.
#![allow(unsafe_code, reason = "intrinsics; see each SAFETY note")]

use std::arch::x86_64::{
    __m256, __m512, _CMP_LE_OQ, _mm256_cmp_ps, _mm256_fmadd_ps, _mm256_loadu_ps, _mm256_max_ps, _mm256_min_ps,
    _mm256_movemask_ps, _mm256_mul_ps, _mm256_set1_ps, _mm256_storeu_ps, _mm256_sub_ps, _mm512_cmp_ps_mask, _mm512_fmadd_ps, _mm512_loadu_ps, _mm512_max_ps, _mm512_min_ps, _mm512_mul_ps, _mm512_set1_ps, _mm512_storeu_ps, _mm512_sub_ps,
};

use math::Ray;

use super::lanes::{Kernel, Lanes, Pair};
use super::traverse;
use crate::accel::Accel;
use crate::hit::{Best, Hit};
use crate::layout::{NODE, WIDTH};

pub(super) fn has_avx2() -> bool {
    is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("fma")
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

/// Only functions below, which run where AVX-512 was detected, name this type.
#[derive(Clone, Copy)]
struct Wide(__m512);

impl Lanes<NODE> for Wide {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        // SAFETY: AVX-512 was detected, see the type.
        Self(unsafe { _mm512_set1_ps(x) })
    }
    #[inline(always)]
    fn load(a: &[f32; NODE]) -> Self {
        // SAFETY: AVX-512 was detected, see the type; the reference is to sixteen floats.
        Self(unsafe { _mm512_loadu_ps(a.as_ptr()) })
    }
    #[inline(always)]
    fn store(self, a: &mut [f32; NODE]) {
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
}

/// Pairs of registers for nodes.
struct Avx2;

impl Kernel for Avx2 {
    type Node = Pair<Avx>;
    type Block = Avx;
}

/// Nodes in one register.
struct Avx512;

impl Kernel for Avx512 {
    type Node = Wide;
    type Block = Avx;
}

pub(super) fn trace_avx2<const ANY: bool, F>(accel: &Accel, ray: &Ray, filter: &mut F) -> Best
where
    F: FnMut(&Hit) -> bool,
{
    #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
    fn kernel<const ANY: bool, F: FnMut(&Hit) -> bool>(accel: &Accel, ray: &Ray, filter: &mut F) -> Best {
        traverse::trace::<Avx2, ANY, true, F>(accel, ray, filter)
    }
    #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
    fn world<const ANY: bool, F: FnMut(&Hit) -> bool>(accel: &Accel, ray: &Ray, filter: &mut F) -> Best {
        traverse::trace::<Avx2, ANY, false, F>(accel, ray, filter)
    }
    if accel.placed.is_empty() {
        // SAFETY: an `Accel` names this kernel only after `has_avx2`.
        return unsafe { world::<ANY, F>(accel, ray, filter) };
    }
    // SAFETY: an `Accel` names this kernel only after `has_avx2`.
    unsafe { kernel::<ANY, F>(accel, ray, filter) }
}

pub(super) fn trace_avx512<const ANY: bool, F>(accel: &Accel, ray: &Ray, filter: &mut F) -> Best
where
    F: FnMut(&Hit) -> bool,
{
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
    fn kernel<const ANY: bool, F: FnMut(&Hit) -> bool>(accel: &Accel, ray: &Ray, filter: &mut F) -> Best {
        traverse::trace::<Avx512, ANY, true, F>(accel, ray, filter)
    }
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
    fn world<const ANY: bool, F: FnMut(&Hit) -> bool>(accel: &Accel, ray: &Ray, filter: &mut F) -> Best {
        traverse::trace::<Avx512, ANY, false, F>(accel, ray, filter)
    }
    if accel.placed.is_empty() {
        // SAFETY: an `Accel` names this kernel only after `has_avx512`.
        return unsafe { world::<ANY, F>(accel, ray, filter) };
    }
    // SAFETY: an `Accel` names this kernel only after `has_avx512`.
    unsafe { kernel::<ANY, F>(accel, ray, filter) }
}
