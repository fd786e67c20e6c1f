//! Numbers of text, correctly rounded, fast where they are short [Clinger1990].
//!
//! A decimal with at most 19 digits is a 64-bit integer times a power of ten. If the integer fits a double's 53 bits
//! and the power is at most 10²², one multiplication or division rounds correctly to `f64`; what goes on to `f32` is
//! rounded twice, which only hurts next to a midpoint of two floats, where the standard library takes over.

/// What a token holds if it is a number.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Decimal {
    negative: bool,
    mantissa: u64,
    exponent: i32,
    /// All digits are in the mantissa.
    exact: bool,
}

/// Powers of ten that doubles hold exactly.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];

/// Does a token end before this byte?
pub(super) fn is_delimiter(byte: u8) -> bool {
    matches!(byte, b' ' | b'\n' | b'\t' | b'\r' | b'"' | b'[' | b']')
}

/// The number at the start of `bytes` and its length; `None` if the token there is no number.
/// What is too large for an `f32` is infinite.
pub(super) fn f32_at(bytes: &[u8]) -> Option<(f32, usize)> {
    let (decimal, length) = decimal_at(bytes)?;
    if let Some(x) = decimal.to_f64() {
        let near_midpoint = (0x0fff_ffff..=0x1000_0001).contains(&(x.to_bits() & 0x1fff_ffff));
        if !near_midpoint && (x == 0.0 || x.abs() > 1e-36) {
            return Some((x as f32, length));
        }
    }
    std::str::from_utf8(&bytes[..length]).ok()?.parse().ok().map(|x| (x, length))
}

/// The same in double precision.
pub(super) fn f64_at(bytes: &[u8]) -> Option<(f64, usize)> {
    let (decimal, length) = decimal_at(bytes)?;
    if let Some(x) = decimal.to_f64() {
        return Some((x, length));
    }
    std::str::from_utf8(&bytes[..length]).ok()?.parse().ok().map(|x| (x, length))
}

/// A whole number at the start of `bytes` and its length; the inner `None` if it does not fit.
pub(super) fn i32_at(bytes: &[u8]) -> Option<(Option<i32>, usize)> {
    let (negative, mut i) = sign_at(bytes);
    let start = i;
    let mut value: i64 = 0;
    while let Some(digit) = bytes.get(i).map(|b| b.wrapping_sub(b'0')).filter(|d| *d <= 9) {
        value = value.saturating_mul(10).saturating_add(i64::from(digit));
        i += 1;
    }
    if i == start || bytes.get(i).is_some_and(|b| !is_delimiter(*b)) {
        return None;
    }
    Some((i32::try_from(if negative { -value } else { value }).ok(), i))
}

impl Decimal {
    /// The value where one operation rounds it correctly.
    fn to_f64(self) -> Option<f64> {
        if !self.exact || self.mantissa > 1 << 53 {
            return None;
        }
        let power = *POWERS.get(self.exponent.unsigned_abs() as usize)?;
        let m = self.mantissa as f64;
        let x = if self.exponent < 0 { m / power } else { m * power };
        Some(if self.negative { -x } else { x })
    }
}

fn sign_at(bytes: &[u8]) -> (bool, usize) {
    match bytes.first() {
        Some(b'-') => (true, 1),
        Some(b'+') => (false, 1),
        _ => (false, 0),
    }
}

fn decimal_at(bytes: &[u8]) -> Option<(Decimal, usize)> {
    let (negative, mut i) = sign_at(bytes);
    let mut d = Decimal { negative, mantissa: 0, exponent: 0, exact: true };
    let (mut digits, mut seen) = (0, false);
    let mut point = false;
    loop {
        match bytes.get(i) {
            Some(b @ b'0'..=b'9') => {
                seen = true;
                if d.mantissa > 0 || *b != b'0' {
                    digits += 1;
                }
                if digits <= 19 {
                    d.mantissa = d.mantissa * 10 + u64::from(b - b'0');
                    d.exponent -= i32::from(point);
                } else {
                    d.exact = false;
                }
            }
            Some(b'.') if !point => point = true,
            _ => break,
        }
        i += 1;
    }
    if !seen {
        return None;
    }
    if matches!(bytes.get(i), Some(b'e' | b'E')) {
        let (negative, length) = sign_at(&bytes[i + 1..]);
        i += 1 + length;
        let start = i;
        let mut e: i32 = 0;
        while let Some(digit) = bytes.get(i).map(|b| b.wrapping_sub(b'0')).filter(|x| *x <= 9) {
            e = e.saturating_mul(10).saturating_add(i32::from(digit));
            i += 1;
        }
        if i == start {
            return None;
        }
        d.exponent = d.exponent.saturating_add(if negative { -e } else { e });
    }
    bytes.get(i).is_none_or(|b| is_delimiter(*b)).then_some((d, i))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn odd_spellings_are_numbers_and_junk_is_not() {
        assert_eq!(f32_at(b"1.5 2").unwrap(), (1.5, 3));
        assert_eq!(f32_at(b"-.5]").unwrap(), (-0.5, 3));
        assert_eq!(f32_at(b"+5.e-1\n").unwrap(), (0.5, 6));
        assert_eq!(f32_at(b"-0").unwrap().0.to_bits(), (-0.0_f32).to_bits());
        assert_eq!(f32_at(b"1e999").unwrap().0, f32::INFINITY);
        assert_eq!(f32_at(b"0.1").unwrap().0, 0.1);
        for junk in ["", "-", ".", "1e", "nan", "inf", "1.2.3", "1x", "e5", "0x10"] {
            assert_eq!(f32_at(junk.as_bytes()), None, "{junk}");
        }
        assert_eq!(i32_at(b"-2147483648"), Some((Some(i32::MIN), 11)));
        assert_eq!(i32_at(b"2147483648 "), Some((None, 10)));
        assert_eq!(i32_at(b"99999999999999999999999"), Some((None, 23)));
        assert_eq!(i32_at(b"1.0"), None);
    }

    proptest! {
        #[test]
        fn every_float_comes_back_from_its_text(bits: u32) {
            let x = f32::from_bits(bits);
            prop_assume!(x.is_finite());
            for text in [format!("{x}"), format!("{x:e}"), format!("{x:.9}")] {
                let expected: f32 = text.parse().unwrap();
                prop_assert_eq!(f32_at(text.as_bytes()).unwrap().0.to_bits(), expected.to_bits());
                let expected: f64 = text.parse().unwrap();
                prop_assert_eq!(f64_at(text.as_bytes()).unwrap().0.to_bits(), expected.to_bits());
            }
        }

        #[test]
        fn decimals_round_as_the_standard_library_does(m: u64, e in -60..60i32) {
            let text = format!("{m}e{e}");
            let expected: f32 = text.parse().unwrap();
            prop_assert_eq!(f32_at(text.as_bytes()).unwrap().0.to_bits(), expected.to_bits());
        }
    }
}
