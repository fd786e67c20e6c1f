//! A smooth reflectance: the sigmoid of a quadratic in wavelength [Jakob2019].
//!
//! Departs from the paper: the polynomial is in t = (λ − 360) / 470 rather than in nm, which keeps its digits in `f32`.

use math::Vec4;

use crate::cie::{LAMBDA_MAX, LAMBDA_MIN};

/// s(c₀ t² + c₁ t + c₂) with s(x) = ½ + x / (2 √(1 + x²)): always in [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SigmoidPolynomial {
    c: [f32; 3],
}

/// s(±this) is 0 or 1 exactly, its square is finite.
const SATURATED: f32 = 1e9;

impl SigmoidPolynomial {
    /// From c₀, c₁, c₂.
    #[must_use]
    pub const fn new(c: [f32; 3]) -> Self {
        Self { c }
    }

    /// The same reflectance, in [0, 1], at all wavelengths.
    #[must_use]
    pub fn constant(reflectance: f32) -> Self {
        let r = reflectance.clamp(0.0, 1.0);
        let x = (r - 0.5) / (r * (1.0 - r)).sqrt();
        Self { c: [0.0, 0.0, x.clamp(-SATURATED, SATURATED)] }
    }

    /// c₀, c₁, c₂.
    #[must_use]
    pub const fn coefficients(&self) -> [f32; 3] {
        self.c
    }

    /// The reflectance at a wavelength in nm.
    #[must_use]
    pub fn eval(&self, lambda: f32) -> f32 {
        let t = (lambda - LAMBDA_MIN) * (1.0 / (LAMBDA_MAX - LAMBDA_MIN));
        let x = (self.c[0] * t + self.c[1]) * t + self.c[2];
        0.5 + 0.5 * x / (1.0 + x * x).sqrt()
    }

    /// [`SigmoidPolynomial::eval`] of four wavelengths.
    #[must_use]
    pub fn eval4(&self, lambda: Vec4) -> Vec4 {
        let t = (lambda - LAMBDA_MIN) * (1.0 / (LAMBDA_MAX - LAMBDA_MIN));
        let x = (t * self.c[0] + self.c[1]) * t + self.c[2];
        let root = (x * x + 1.0).to_array().map(f32::sqrt);
        0.5 + 0.5 * x / Vec4::from_array(root)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_are_themselves_up_to_the_ends() {
        for r in [0.0, 1e-6, 0.1, 0.5, 0.9, 0.999, 1.0] {
            let p = SigmoidPolynomial::constant(r);
            assert!(
                (p.eval(360.0) - r).abs() < 1e-6 && (p.eval(700.0) - r).abs() < 1e-6,
                "{r} {}",
                p.eval(500.0)
            );
        }
        assert_eq!(SigmoidPolynomial::constant(0.0).eval(500.0), 0.0);
        assert_eq!(SigmoidPolynomial::constant(1.0).eval(500.0), 1.0);
    }

    #[test]
    fn four_at_once_are_the_same_as_one_by_one() {
        let p = SigmoidPolynomial::new([3.0, -7.0, 1.5]);
        let lambda = [380.0, 472.5, 550.0, 811.0];
        assert_eq!(p.eval4(Vec4::from_array(lambda)).to_array(), lambda.map(|l| p.eval(l)));
    }
}
