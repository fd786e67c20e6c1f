//! Registers of `f32`.

use super::stream::RAYS;
use crate::layout::{NODE, WIDTH};

/// What the traversal needs of a register of `N` lanes. Minimum and maximum give the second operand where the two are
/// equal or unordered, as x86 does; a comparison with NaN is false.
pub(super) trait Lanes<const N: usize>: Copy {
    fn splat(x: f32) -> Self;
    fn load(a: &[f32; N]) -> Self;
    fn store(self, a: &mut [f32; N]);
    fn sub(self, b: Self) -> Self;
    fn mul(self, b: Self) -> Self;
    /// `self · b + c`, rounded once.
    fn mul_add(self, b: Self, c: Self) -> Self;
    fn min(self, b: Self) -> Self;
    fn max(self, b: Self) -> Self;
    /// Bit `i` is set where lane `i` of `self` is at most that of `b`.
    fn le(self, b: Self) -> u32;
    /// `self` in the lanes of the mask, `other` in the rest.
    fn keep(self, mask: u32, other: Self) -> Self;
    /// The largest lane, if all are numbers.
    fn most(self) -> f32;
}

/// The registers of a kernel.
pub(super) trait Kernel {
    /// For the children of a node.
    type Node: Lanes<NODE>;
    /// For the triangles of a block.
    type Block: Lanes<WIDTH>;
    /// For the rays of a packet.
    type Rays: Lanes<RAYS>;
    /// Are packets worth it?
    const PACKETS: bool;
}

/// Two registers as one.
#[derive(Clone, Copy)]
pub(super) struct Pair<L>(L, L);

/// Both halves.
#[inline(always)]
fn halves(a: &[f32; NODE]) -> (&[f32; WIDTH], &[f32; WIDTH]) {
    let [first, second] = a.as_chunks::<WIDTH>().0 else { return (&[0.0; WIDTH], &[0.0; WIDTH]) };
    (first, second)
}

impl<L: Lanes<WIDTH>> Lanes<NODE> for Pair<L> {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self(L::splat(x), L::splat(x))
    }
    #[inline(always)]
    fn load(a: &[f32; NODE]) -> Self {
        let (a, b) = halves(a);
        Self(L::load(a), L::load(b))
    }
    #[inline(always)]
    fn store(self, a: &mut [f32; NODE]) {
        if let [first, second] = a.as_chunks_mut::<WIDTH>().0 {
            self.0.store(first);
            self.1.store(second);
        }
    }
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Self(self.0.sub(b.0), self.1.sub(b.1))
    }
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Self(self.0.mul(b.0), self.1.mul(b.1))
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Self(self.0.mul_add(b.0, c.0), self.1.mul_add(b.1, c.1))
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        Self(self.0.min(b.0), self.1.min(b.1))
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        Self(self.0.max(b.0), self.1.max(b.1))
    }
    #[inline(always)]
    fn le(self, b: Self) -> u32 {
        self.0.le(b.0) | self.1.le(b.1) << WIDTH
    }
    #[inline(always)]
    fn keep(self, mask: u32, other: Self) -> Self {
        Self(self.0.keep(mask, other.0), self.1.keep(mask >> WIDTH, other.1))
    }
    #[inline(always)]
    fn most(self) -> f32 {
        self.0.max(self.1).most()
    }
}
