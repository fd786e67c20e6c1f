//! The door to lanes of `math::lanes`: one formula, compiled for each instruction set.

use math::lanes::Floats;

use crate::isa::Isa;

/// Work in lanes.
pub trait Wide {
    /// What comes out.
    type Output;

    /// Does it. Must be `#[inline(always)]`, as all that it calls over lanes: see `math::lanes`.
    fn run<F: Floats>(self) -> Self::Output;
}

/// Has this instruction set lanes, and has this processor it? Portable lanes are for comparisons alone: there single paths are faster.
#[must_use]
pub fn has_lanes(isa: Isa) -> bool {
    match isa {
        Isa::Avx512 => isa.is_available(),
        Isa::Scalar | Isa::Avx2 => false,
    }
}

/// Does the work with the lanes of an instruction set; `None` if there are none: see [`has_lanes`]. All give the same bits.
#[inline]
pub fn run_wide<W: Wide>(isa: Isa, work: W) -> Option<W::Output> {
    match isa {
        #[cfg(target_arch = "x86_64")]
        Isa::Avx512 if super::x86::has_avx512() => Some(super::x86_wide::run_avx512(work)),
        Isa::Scalar | Isa::Avx2 | Isa::Avx512 => None,
    }
}
