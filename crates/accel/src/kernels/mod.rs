//! The traversal kernels: all SIMD and all `unsafe` of the crate, one door for each.
//!
//! One source ([`traverse`]) over a trait of lanes ([`lanes::Lanes`]); [`scalar`] runs it on plain loops, the
//! others on registers. The same operations are fused and every minimum is the processor's, so that all give the same bits.
//!
//! [`partners`] serves the building of trees.

mod boxes;
mod lanes;
pub(crate) mod memory;
pub(crate) mod partners;
mod scalar;
mod stack;
mod traverse;
#[cfg(target_arch = "x86_64")]
mod x86;

use math::Ray;

use crate::accel::Accel;
use crate::hit::Hit;
use crate::isa::Isa;

pub(crate) use stack::MAX_DEPTH;

/// Can this processor run the kernel?
pub(crate) fn is_available(isa: Isa) -> bool {
    match isa {
        Isa::Scalar => true,
        #[cfg(target_arch = "x86_64")]
        Isa::Avx2 => x86::has_avx2(),
        #[cfg(target_arch = "x86_64")]
        Isa::Avx512 => x86::has_avx512(),
        #[cfg(not(target_arch = "x86_64"))]
        Isa::Avx2 | Isa::Avx512 => false,
    }
}

/// The nearest hit. The kernel must be available.
#[inline(always)]
pub(crate) fn nearest<F: FnMut(&Hit) -> bool>(accel: &Accel, ray: &Ray, filter: &mut F) -> Option<Hit> {
    match accel.isa() {
        #[cfg(target_arch = "x86_64")]
        Isa::Scalar if x86::has_fma() => x86::fma::nearest(accel, ray, filter),
        Isa::Scalar => scalar::nearest(accel, ray, filter),
        #[cfg(target_arch = "x86_64")]
        Isa::Avx2 => x86::avx2::nearest(accel, ray, filter),
        #[cfg(target_arch = "x86_64")]
        Isa::Avx512 => x86::avx512::nearest(accel, ray, filter),
        #[cfg(not(target_arch = "x86_64"))]
        Isa::Avx2 | Isa::Avx512 => scalar::nearest(accel, ray, filter),
    }
}

/// Is there any hit? The kernel must be available.
#[inline(always)]
pub(crate) fn any<F: FnMut(&Hit) -> bool>(accel: &Accel, ray: &Ray, filter: &mut F) -> bool {
    match accel.isa() {
        #[cfg(target_arch = "x86_64")]
        Isa::Scalar if x86::has_fma() => x86::fma::any(accel, ray, filter),
        Isa::Scalar => scalar::any(accel, ray, filter),
        #[cfg(target_arch = "x86_64")]
        Isa::Avx2 => x86::avx2::any(accel, ray, filter),
        #[cfg(target_arch = "x86_64")]
        Isa::Avx512 => x86::avx512::any(accel, ray, filter),
        #[cfg(not(target_arch = "x86_64"))]
        Isa::Avx2 | Isa::Avx512 => scalar::any(accel, ray, filter),
    }
}
