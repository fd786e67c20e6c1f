//! Many fixed-point sums in as few bytes as they need: the lower halves of all, and the upper halves as wide as the largest.
//!
//! Sums of radiance nearly always fit into 96 bits and sums of squares into 64, and what one sample gives to its pixel is a float; a
//! number that does not fit widens its column, and every number reads as the 128 bits that were added.

use crate::fixed::FixedPoint;

/// Fixed-point numbers, zero at first: floats, or lower halves with upper halves that are none (then a number is its lower half with
/// its sign), of 32 bits, or of 64.
#[derive(Clone, Debug, Default)]
pub(crate) struct Column<const F: u32> {
    floats: Vec<f32>,
    low: Vec<u64>,
    high: Vec<i32>,
    wide: Vec<i64>,
}

impl<const F: u32> Column<F> {
    pub(crate) fn zeros(n: usize) -> Self {
        Self { low: vec![0; n], ..Self::default() }
    }

    /// Makes it `n` zeros, in the memory that it has.
    pub(crate) fn reset(&mut self, n: usize) {
        self.reset_floats(0);
        self.low.resize(n, 0);
    }

    /// The same, for numbers that will mostly be floats.
    pub(crate) fn reset_floats(&mut self, n: usize) {
        self.low.clear();
        self.high.clear();
        self.wide.clear();
        self.floats.clear();
        self.floats.resize(n, 0.0);
    }

    pub(crate) fn len(&self) -> usize {
        self.low.len().max(self.floats.len())
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.len() == 0
    }

    #[inline]
    pub(crate) fn get(&self, i: usize) -> FixedPoint<F> {
        if let Some(&x) = self.floats.get(i) {
            // What was kept as a float fits.
            return FixedPoint::from_f32(x).unwrap_or_default();
        }
        let low = self.low[i];
        let high = if !self.wide.is_empty() {
            self.wide[i]
        } else if !self.high.is_empty() {
            i64::from(self.high[i])
        } else {
            low as i64 >> 63
        };
        FixedPoint::from_bits(i128::from(high) << 64 | i128::from(low))
    }

    /// Three numbers that follow each other.
    #[inline]
    pub(crate) fn get3(&self, i: usize) -> [FixedPoint<F>; 3] {
        [self.get(i), self.get(i + 1), self.get(i + 2)]
    }

    #[inline]
    pub(crate) fn set(&mut self, i: usize, x: FixedPoint<F>) {
        if let Some(float) = self.floats.get_mut(i) {
            let rounded = x.to_f64() as f32;
            if FixedPoint::from_f32(rounded) == Some(x) {
                *float = rounded;
                return;
            }
            self.leave_floats();
        }
        let (low, high) = (x.to_bits() as u64, (x.to_bits() >> 64) as i64);
        if !self.wide.is_empty() {
            self.wide[i] = high;
        } else if !self.high.is_empty() && i64::from(high as i32) == high {
            self.high[i] = high as i32;
        } else if !self.high.is_empty() || high != low as i64 >> 63 {
            self.widen(i, high);
        }
        self.low[i] = low;
    }

    #[cold]
    fn leave_floats(&mut self) {
        let floats = std::mem::take(&mut self.floats);
        self.low.resize(floats.len(), 0);
        let numbers = floats.into_iter().enumerate();
        numbers.for_each(|(i, x)| self.set(i, FixedPoint::from_f32(x).unwrap_or_default()));
    }

    /// Upper halves of the next width that holds this one, which is number `i`'s.
    #[cold]
    fn widen(&mut self, i: usize, high: i64) {
        if self.high.is_empty() && i64::from(high as i32) == high {
            self.high.extend(self.low.iter().map(|&low| (low as i64 >> 63) as i32));
            self.high[i] = high as i32;
            return;
        }
        if self.high.is_empty() {
            self.wide.extend(self.low.iter().map(|&low| low as i64 >> 63));
        } else {
            self.wide.extend(self.high.iter().map(|&high| i64::from(high)));
            self.high = Vec::new();
        }
        self.wide[i] = high;
    }

    /// Exact sum modulo 2¹²⁸ units.
    #[inline]
    pub(crate) fn add(&mut self, i: usize, x: FixedPoint<F>) {
        self.set(i, self.get(i).wrapping_add(x));
    }

    /// Exact sum, or the largest number.
    #[inline]
    pub(crate) fn add_saturating(&mut self, i: usize, x: FixedPoint<F>) {
        self.set(i, self.get(i).saturating_add(x));
    }

    /// [`Column::add`] of each number of another column as long as this.
    pub(crate) fn add_all(&mut self, other: &Self) {
        (0..self.len()).for_each(|i| self.add(i, other.get(i)));
    }

    /// [`Column::add_saturating`] of each number of another column as long as this.
    pub(crate) fn add_all_saturating(&mut self, other: &Self) {
        (0..self.len()).for_each(|i| self.add_saturating(i, other.get(i)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Fixed;
    use proptest::prelude::*;

    fn any_number() -> impl Strategy<Value = i128> {
        // As often small as large, of both signs.
        (any::<i128>(), 0_u32..128).prop_map(|(x, s)| x >> s)
    }

    proptest! {
        #[test]
        fn a_column_holds_what_a_vector_of_128_bits_holds(
            added in prop::collection::vec((0_usize..5, any_number(), any::<bool>()), 0..60),
            floats in any::<bool>(),
        ) {
            let mut column = Column::<64>::default();
            if floats { column.reset_floats(5) } else { column.reset(5) }
            let mut plain = [Fixed::ZERO; 5];
            for (i, x, saturating) in added {
                let x = Fixed::from_bits(x);
                if saturating {
                    column.add_saturating(i, x);
                    plain[i] = plain[i].saturating_add(x);
                } else {
                    column.add(i, x);
                    plain[i] = plain[i].wrapping_add(x);
                }
                for (k, p) in plain.iter().enumerate() {
                    prop_assert_eq!(column.get(k), *p);
                }
            }
            let mut twice = Column::zeros(5);
            twice.add_all(&column);
            twice.add_all(&column);
            prop_assert!((0..5).all(|k| twice.get(k) == plain[k].wrapping_add(plain[k])));
            column.reset(3);
            prop_assert!(column.len() == 3 && (0..3).all(|k| column.get(k) == Fixed::ZERO));
        }
    }

    #[test]
    fn floats_stay_floats_until_they_are_sums() {
        let mut column = Column::<64>::default();
        column.reset_floats(3);
        column.add(1, Fixed::from_f32(0.1).unwrap_or_default());
        column.add(2, Fixed::from_f32(-3e7).unwrap_or_default());
        assert_eq!((column.len(), column.floats.len(), column.low.len()), (3, 3, 0));
        column.add(1, Fixed::from_f32(1e-9).unwrap_or_default());
        assert_eq!((column.len(), column.floats.len(), column.low.len()), (3, 0, 3));
        let sum = f64::from(0.1_f32) + f64::from(1e-9_f32);
        assert_eq!([0, 1, 2].map(|i| column.get(i).to_f64()), [0.0, sum, f64::from(-3e7_f32)]);
    }

    #[test]
    fn a_column_is_as_wide_as_its_largest_number() {
        let mut column = Column::<64>::zeros(4);
        let bytes = |c: &Column<64>| 8 * c.low.len() + 4 * c.high.len() + 8 * c.wide.len();
        column.add(0, Fixed::from_f64(0.3).unwrap_or_default());
        column.add(1, Fixed::from_f64(-0.3).unwrap_or_default());
        assert_eq!(bytes(&column), 32);
        column.add(0, Fixed::from_f64(1e9).unwrap_or_default());
        assert_eq!(bytes(&column), 48);
        column.add(3, Fixed::from_f64(-1e10).unwrap_or_default());
        assert_eq!(bytes(&column), 64);
        assert_eq!(column.get(1).to_f64(), -0.3);
        assert_eq!(column.get(3).to_f64(), -1e10);
    }
}
