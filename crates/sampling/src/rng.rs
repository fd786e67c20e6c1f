//! A counter-based generator: the n-th number is a hash of (key, n), so that any of them can be had at once and
//! nothing is shared between threads [Salmon2011].
//!
//! The hash is [`math::hash::mix64`] of a Weyl sequence, which makes this `SplitMix64` [Steele2014].
//! Left out: cryptographic strength, and streams of more than 2⁶⁴ numbers.

use math::hash::{combine, mix64, unit_f32};

/// The stream of random numbers that belongs to a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rng {
    state: u64,
}

/// 2⁶⁴ / φ, odd: the step of the Weyl sequence.
const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

impl Rng {
    /// The stream of `key`.
    #[must_use]
    pub const fn new(key: u64) -> Self {
        Self { state: mix64(key ^ STEP) }
    }

    /// The stream of a key in several parts, such as (seed, path, pass).
    #[must_use]
    pub fn from_parts(parts: &[u64]) -> Self {
        Self::new(parts.iter().fold(0, |h, &p| combine(h, p)))
    }

    /// 64 random bits.
    #[must_use]
    pub const fn next_u64(&mut self) -> u64 {
        self.state = self.state.wrapping_add(STEP);
        mix64(self.state)
    }

    /// 32 random bits.
    #[must_use]
    pub const fn next_u32(&mut self) -> u32 {
        (self.next_u64() >> 32) as u32
    }

    /// Uniform in [0, 1), of 24 bits.
    #[must_use]
    pub fn next_f32(&mut self) -> f32 {
        unit_f32(self.next_u32())
    }

    /// Uniform in [0, 1), of 53 bits.
    #[must_use]
    pub const fn next_f64(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
    }

    /// Skips `n` numbers at no cost.
    pub const fn advance(&mut self, n: u64) {
        self.state = self.state.wrapping_add(STEP.wrapping_mul(n));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn skipping_is_drawing() {
        let (mut a, mut b) = (Rng::new(7), Rng::new(7));
        for _ in 0..10 {
            let _ = a.next_u64();
        }
        b.advance(10);
        assert_eq!(a, b);
    }
}
