//! A spectrum tabulated from 360 to 830 nm in steps of 1 nm: fast to evaluate, the same for every source.

use crate::cie::{LAMBDA_MAX, LAMBDA_MIN, N_LAMBDA};

/// 471 values, interpolated linearly; zero outside 360 … 830 nm.
#[derive(Clone, Debug, PartialEq)]
pub struct DenseSpectrum(Box<[f32]>);

impl DenseSpectrum {
    /// Tabulates `f`, which takes nm.
    #[must_use]
    pub fn tabulate(f: impl Fn(f64) -> f64) -> Self {
        Self((0..N_LAMBDA).map(|i| f(f64::from(LAMBDA_MIN) + i as f64) as f32).collect())
    }

    /// The value at a wavelength in nm.
    #[must_use]
    pub fn eval(&self, lambda: f32) -> f32 {
        if !(LAMBDA_MIN..=LAMBDA_MAX).contains(&lambda) {
            return 0.0;
        }
        let at = lambda - LAMBDA_MIN;
        let i = (at as usize).min(N_LAMBDA - 2);
        let t = at - i as f32;
        self.0[i] * (1.0 - t) + self.0[i + 1] * t
    }

    /// The values at 360, 361, …, 830 nm.
    #[must_use]
    pub fn values(&self) -> &[f32] {
        &self.0
    }

    /// The largest value.
    #[must_use]
    pub fn max_value(&self) -> f32 {
        self.0.iter().copied().fold(f32::NEG_INFINITY, f32::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_comes_back_as_a_line() {
        let d = DenseSpectrum::tabulate(|l| 2.0 * l - 5.0);
        for l in [360.0, 400.25, 555.5, 829.75, 830.0] {
            assert!((d.eval(l) - (2.0 * l - 5.0)).abs() < 2e-3, "{l}");
        }
        assert_eq!(d.eval(100.0), 0.0);
        assert_eq!(d.eval(831.0), 0.0);
        assert_eq!(d.max_value(), 1655.0);
    }
}
