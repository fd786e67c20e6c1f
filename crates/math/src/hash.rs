//! Integer hashes: the source of all randomness, and of keys that must not depend on the platform.

/// A 64-bit finaliser: every input bit reaches every output bit (Stafford's mix 13, as in `SplitMix64` [Steele2014]).
#[must_use]
pub const fn mix64(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Folds `value` into the running hash `state`.
#[must_use]
pub const fn combine(state: u64, value: u64) -> u64 {
    mix64(state.wrapping_add(0x9e37_79b9_7f4a_7c15) ^ value.wrapping_mul(0xd6e8_feb8_6659_fd93))
}

/// A 32-bit finaliser with low bias (constants from a search by C. Wellons).
#[must_use]
pub const fn mix32(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x21f0_aaad);
    x ^= x >> 15;
    x = x.wrapping_mul(0xd35a_2d97);
    x ^ (x >> 15)
}

/// Hash of floats by their bits; −0 and 0 differ.
#[must_use]
pub fn of_floats(values: &[f32]) -> u64 {
    values.iter().fold(0, |h, v| combine(h, u64::from(v.to_bits())))
}

/// The upper 24 bits as a number in [0, 1).
#[must_use]
pub fn unit_f32(x: u32) -> f32 {
    (x >> 8) as f32 * (1.0 / 16_777_216.0)
}
