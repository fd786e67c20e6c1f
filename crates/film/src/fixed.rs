//! Fixed-point numbers: sums that are the same in any order.
//!
//! A floating-point number is rounded once, to nearest with ties to even, when it enters; additions are exact after
//! that, hence commutative and associative. The conversions are shifts of the mantissa and use no library function.

/// A multiple of 2^−`FRACTION` in 128 bits of two's complement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(transparent)]
pub struct FixedPoint<const FRACTION: u32>(i128);

/// What sums of radiance are counted in: units of 2⁻⁶⁴, up to 2⁶³ ≈ 9.2e18.
pub type Fixed = FixedPoint<64>;

/// What sums of products of two such values are counted in: units of 2⁻⁴⁸, up to 2⁷⁹ ≈ 6e23.
pub type Moment = FixedPoint<48>;

impl<const FRACTION: u32> FixedPoint<FRACTION> {
    /// Zero.
    pub const ZERO: Self = Self(0);
    /// The largest number; as the result of [`Self::saturating_add`] it means "too much".
    pub const MAX: Self = Self(i128::MAX);

    /// From the raw count of units.
    #[must_use]
    pub const fn from_bits(bits: i128) -> Self {
        Self(bits)
    }

    /// The raw count of units.
    #[must_use]
    pub const fn to_bits(self) -> i128 {
        self.0
    }

    /// The nearest multiple of the unit; `None` if `x` is not finite or does not fit.
    #[inline]
    #[must_use]
    pub const fn from_f64(x: f64) -> Option<Self> {
        let bits = x.to_bits();
        let exponent = (bits >> 52 & 0x7ff) as i32;
        // Subnormals are far below half a unit, so the hidden bit may be set for them too.
        let mantissa = (bits & ((1 << 52) - 1)) | 1 << 52;
        // x = mantissa 2^(exponent − 1075), and the unit is 2^−FRACTION.
        let shift = exponent - 1075 + FRACTION as i32;
        let magnitude = if shift >= 0 {
            // The mantissa has 53 bits, and 127 fit beside the sign. Infinity and NaN have the largest exponent.
            if shift > 74 {
                return None;
            }
            (mantissa as i128) << shift
        } else if shift < -53 {
            0
        } else {
            let s = -shift as u32;
            let (floor, rest, half) = (mantissa >> s, mantissa & ((1 << s) - 1), 1_u64 << (s - 1));
            let up = rest > half || (rest == half && floor & 1 == 1);
            (floor + up as u64) as i128
        };
        Some(Self(if bits >> 63 == 1 { -magnitude } else { magnitude }))
    }

    /// The nearest multiple of the unit; `None` if `x` is not finite or does not fit.
    #[inline]
    #[must_use]
    pub const fn from_f32(x: f32) -> Option<Self> {
        Self::from_f64(x as f64)
    }

    /// The nearest double.
    #[inline]
    #[must_use]
    pub fn to_f64(self) -> f64 {
        // The upper 63 bits, and whether there are more: a conversion to 53 bits rounds them as it would round all. The scales are powers of
        // two, so nothing else rounds.
        let magnitude = self.0.unsigned_abs();
        let s = 65_u32.saturating_sub(magnitude.leading_zeros());
        let rest = magnitude & ((1 << s) - 1);
        let upper = (magnitude >> s) as i64 | i64::from(rest != 0);
        let upper = if self.0 < 0 { -upper } else { upper };
        let power = |e: i32| f64::from_bits(((1023 + e) as u64) << 52);
        upper as f64 * power(s as i32 - FRACTION as i32)
    }

    /// Exact sum modulo 2¹²⁸ units: what overflows stays commutative and associative.
    #[inline]
    #[must_use]
    pub const fn wrapping_add(self, other: Self) -> Self {
        Self(self.0.wrapping_add(other.0))
    }

    /// Exact sum, or [`Self::MAX`]. Associative for numbers that are at least zero.
    #[inline]
    #[must_use]
    pub const fn saturating_add(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }

    /// Exact difference modulo 2¹²⁸ units.
    #[inline]
    #[must_use]
    pub const fn wrapping_sub(self, other: Self) -> Self {
        Self(self.0.wrapping_sub(other.0))
    }
}

/// Reconstruction-filter weights and their squares: multiples of 2⁻³⁶ in 64 bits, up to 1.3e8.
pub(crate) mod weight {
    const SCALE: f64 = 68_719_476_736.0;

    /// The nearest multiple of the unit. Weights of a pass are a handful, far from the limits.
    #[inline]
    pub(crate) fn from_f64(x: f64) -> i64 {
        // Adding and subtracting 1.5·2⁵² rounds to nearest even without a library call.
        const MAGIC: f64 = 6_755_399_441_055_744.0;
        let scaled = x * SCALE;
        if scaled.abs() < 2_251_799_813_685_248.0 { (scaled + MAGIC - MAGIC) as i64 } else { scaled as i64 }
    }

    /// The nearest double.
    #[inline]
    pub(crate) fn to_f64(x: i64) -> f64 {
        x as f64 / SCALE
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn ties_go_to_the_even_neighbour_and_what_does_not_fit_is_refused() {
        let unit = 2.0_f64.powi(-64);
        for (x, n) in [(0.5, 0), (0.500_000_1, 1), (1.5, 2), (2.5, 2), (-0.5, 0), (-1.5, -2), (3.0, 3)] {
            assert_eq!(Fixed::from_f64(x * unit).unwrap().to_bits(), n, "{x}");
        }
        assert_eq!(Fixed::from_f64(f64::MIN_POSITIVE * 0.25), Some(Fixed::ZERO));
        assert_eq!(Fixed::from_f64(-0.0), Some(Fixed::ZERO));
        assert_eq!(Fixed::from_f64(1.0).unwrap().to_bits(), 1 << 64);
        let largest = 2.0_f64.powi(63).next_down();
        assert_eq!(Fixed::from_f64(largest).unwrap().to_f64(), largest);
        for x in [2.0_f64.powi(63), -2.0_f64.powi(63), f64::INFINITY, f64::NEG_INFINITY, f64::NAN, 1e300] {
            assert_eq!(Fixed::from_f64(x), None, "{x}");
        }
    }

    #[test]
    fn weights_round_to_nearest() {
        for (x, n) in
            [(1.0, 1_i64 << 36), (-1.0, -(1 << 36)), (0.3, 20_615_843_021), (1e5, 6_871_947_673_600_000)]
        {
            assert_eq!(weight::from_f64(x), n, "{x}");
        }
    }

    proptest! {
        #[test]
        fn conversion_is_exact_to_half_a_unit(x in -1e10_f64..1e10) {
            let f = Fixed::from_f64(x).unwrap();
            // Numbers above 2⁻¹¹ have no bits below the unit.
            if x.abs() > 2.0_f64.powi(-11) {
                prop_assert_eq!(f.to_f64(), x);
            }
            let m = Moment::from_f64(x).unwrap();
            prop_assert!((m.to_f64() - x).abs() <= 2.0_f64.powi(-49));
        }

        #[test]
        fn any_number_of_units_becomes_the_nearest_double(hi in any::<i64>(), lo in any::<u64>(), s in 0_u32..127) {
            let bits = (i128::from(hi) << 64 | i128::from(lo)) >> s;
            for bits in [bits, bits & (-1_i128 << (s / 2)), !bits] {
                prop_assert_eq!(Fixed::from_bits(bits).to_f64(), bits as f64 * 2.0_f64.powi(-64));
            }
        }

        #[test]
        fn small_numbers_round_like_the_quotient(m in -(1_i64 << 53)..1_i64 << 53, e in 40_i32..80) {
            // x = m 2^−(64+e−40)…: compare with exact integer division, rounded half to even.
            let s = e - 39;
            let x = m as f64 * 2.0_f64.powi(-64 - s);
            let (q, r) = (i128::from(m).div_euclid(1 << s), i128::from(m).rem_euclid(1 << s));
            let half = 1_i128 << (s - 1);
            let expected = q + i128::from(r > half || (r == half && q & 1 == 1));
            prop_assert_eq!(Fixed::from_f64(x).unwrap().to_bits(), expected);
        }
    }
}
