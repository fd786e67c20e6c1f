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
mod stream;
mod traverse;
mod wide;
#[cfg(target_arch = "x86_64")]
mod x86;
#[cfg(target_arch = "x86_64")]
mod x86_wide;

use math::Ray;

use crate::accel::Accel;
use crate::hit::Hit;
use crate::isa::Isa;

pub(crate) use stack::MAX_DEPTH;
pub use wide::{Wide, has_lanes, run_wide};

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

/// Lets hits of many rays through or not, given the index of the ray. Not generic, so that what traces many is compiled once.
pub(crate) type Filter<'a> = &'a mut dyn FnMut(usize, &Hit) -> bool;

/// Calls the entry of that name of the kernel in use, which must be available.
macro_rules! dispatch {
    ($name:ident($accel:expr, $($arg:expr),*)) => {
        match $accel.isa() {
            #[cfg(target_arch = "x86_64")]
            Isa::Scalar if x86::has_fma() => x86::fma::$name($accel, $($arg),*),
            Isa::Scalar => scalar::$name($accel, $($arg),*),
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2 => x86::avx2::$name($accel, $($arg),*),
            #[cfg(target_arch = "x86_64")]
            Isa::Avx512 => x86::avx512::$name($accel, $($arg),*),
            #[cfg(not(target_arch = "x86_64"))]
            Isa::Avx2 | Isa::Avx512 => scalar::$name($accel, $($arg),*),
        }
    };
}

/// The nearest hit.
#[inline(always)]
pub(crate) fn nearest<F: FnMut(&Hit) -> bool>(accel: &Accel, ray: &Ray, filter: &mut F) -> Option<Hit> {
    dispatch!(nearest(accel, ray, filter))
}

/// Is there any hit?
#[inline(always)]
pub(crate) fn any<F: FnMut(&Hit) -> bool>(accel: &Accel, ray: &Ray, filter: &mut F) -> bool {
    dispatch!(any(accel, ray, filter))
}

/// The nearest hit of each ray, of which there are as many as places for hits.
pub(crate) fn nearest_many(accel: &Accel, rays: &[Ray], hits: &mut [Option<Hit>], filter: Filter<'_>) {
    dispatch!(nearest_many(accel, rays, hits, filter));
}

/// Is there any hit, for each ray? There are as many of these as places for answers.
pub(crate) fn any_many(accel: &Accel, rays: &[Ray], blocked: &mut [bool], filter: Filter<'_>) {
    dispatch!(any_many(accel, rays, blocked, filter));
}
