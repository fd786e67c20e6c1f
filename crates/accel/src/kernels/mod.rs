//! The traversal kernels: all SIMD and all `unsafe` of the crate, one door for each.
//!
//! One source ([`traverse`]) over a trait of eight lanes ([`lanes::Lanes`]); [`scalar`] runs it on plain loops, the
//! others on registers. Nothing is fused and every minimum is the processor's, so that all give the same bits.

mod lanes;
pub(crate) mod memory;
mod scalar;
mod stack;
mod traverse;
#[cfg(target_arch = "x86_64")]
mod x86;

use math::Ray;

use crate::accel::Accel;
use crate::hit::{Best, Hit};
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

/// The nearest hit, or any if `ANY`. The kernel must be available.
#[inline]
pub(crate) fn trace<const ANY: bool, F>(accel: &Accel, ray: &Ray, filter: &mut F) -> Best
where
    F: FnMut(&Hit) -> bool,
{
    match accel.isa() {
        Isa::Scalar => scalar::trace::<ANY, F>(accel, ray, filter),
        #[cfg(target_arch = "x86_64")]
        Isa::Avx2 => x86::trace_avx2::<ANY, F>(accel, ray, filter),
        #[cfg(target_arch = "x86_64")]
        Isa::Avx512 => x86::trace_avx512::<ANY, F>(accel, ray, filter),
        #[cfg(not(target_arch = "x86_64"))]
        Isa::Avx2 | Isa::Avx512 => scalar::trace::<ANY, F>(accel, ray, filter),
    }
}
