//! What the four lanes of a path mean: R, G, B, or four wavelengths.
//!
//! Wavelengths are the hero's and three more at equal distances in its number u [Wilkie2014], drawn with a density
//! like the eye's sensitivity to all of X, Y and Z [Radziszewski2009] in the form and with the constants of pbrt-v4.

use math::{Vec4, trig};

use crate::cie::{LAMBDA_MAX, LAMBDA_MIN};

/// The wavelengths that a path carries, with their densities; or the statement that it carries R, G and B.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wavelengths {
    /// In nm; zero in RGB mode.
    lambda: Vec4,
    /// Density of each wavelength in 1/nm; after [`Wavelengths::terminate_secondary`] only the first is positive.
    pdf: Vec4,
}

impl Wavelengths {
    /// RGB mode: the lanes are R, G and B.
    pub const RGB: Self = Self { lambda: Vec4::ZERO, pdf: Vec4::ONE };

    /// Four wavelengths (nm) with their densities (1/nm).
    #[must_use]
    pub fn new(lambda: [f32; 4], pdf: [f32; 4]) -> Self {
        Self { lambda: Vec4::from_array(lambda), pdf: Vec4::from_array(pdf) }
    }

    /// Four wavelengths of 360 … 830 nm from one number in [0, 1), with a density near to what the sensor weighs them.
    #[must_use]
    pub fn sample_visible(u: f32) -> Self {
        let lambda = rotations(u).map(sample_visible);
        Self::new(lambda, lambda.map(Self::visible_pdf))
    }

    /// Four wavelengths from one number in [0, 1), uniform over 360 … 830 nm.
    #[must_use]
    pub fn sample_uniform(u: f32) -> Self {
        let lambda = rotations(u).map(|v| LAMBDA_MIN + (LAMBDA_MAX - LAMBDA_MIN) * v);
        Self::new(lambda, [1.0 / (LAMBDA_MAX - LAMBDA_MIN); 4])
    }

    /// Density of [`Wavelengths::sample_visible`] at a wavelength in nm, in 1/nm:
    /// p(λ) = 0.00394 / cosh²(0.0072 (λ − 538)).
    #[must_use]
    pub fn visible_pdf(lambda: f32) -> f32 {
        if !(LAMBDA_MIN..=LAMBDA_MAX).contains(&lambda) {
            return 0.0;
        }
        let c = trig::cosh(VISIBLE_SLOPE * (lambda - VISIBLE_PEAK));
        VISIBLE_DENSITY / (c * c)
    }

    /// RGB mode?
    #[must_use]
    pub fn is_rgb(&self) -> bool {
        self.lambda.x == 0.0
    }

    /// The wavelengths in nm (zeros in RGB mode).
    #[must_use]
    pub fn lambda(&self) -> [f32; 4] {
        self.lambda.to_array()
    }

    /// Their densities in 1/nm.
    #[must_use]
    pub fn pdf(&self) -> [f32; 4] {
        self.pdf.to_array()
    }

    /// Keeps the hero wavelength alone: what follows (dispersion) differs between the lanes. No effect in RGB mode
    /// or when done already [Wilkie2014].
    pub fn terminate_secondary(&mut self) {
        if !self.is_rgb() && self.pdf.y != 0.0 {
            self.pdf = Vec4::new(self.pdf.x * 0.25, 0.0, 0.0, 0.0);
        }
    }

    /// Only the hero wavelength left?
    #[must_use]
    pub fn is_terminated(&self) -> bool {
        self.pdf.y == 0.0
    }
}

const VISIBLE_PEAK: f32 = 538.0;
const VISIBLE_SLOPE: f32 = 0.0072;
const VISIBLE_DENSITY: f32 = 0.003_939_804_2;

/// u and the three numbers a quarter of the way further on, round and round.
fn rotations(u: f32) -> [f32; 4] {
    [0.0, 0.25, 0.5, 0.75].map(|shift| if u + shift >= 1.0 { u + shift - 1.0 } else { u + shift })
}

/// λ = 538 − artanh(0.85691062 − 1.82750197 u) / 0.0072.
fn sample_visible(u: f32) -> f32 {
    let x = 0.856_910_62 - 1.827_501_97 * u;
    let artanh = 0.5 * trig::ln((1.0 + x) / (1.0 - x));
    (VISIBLE_PEAK - artanh / VISIBLE_SLOPE).clamp(LAMBDA_MIN, LAMBDA_MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_visible_density_integrates_to_one_and_is_that_of_its_samples() {
        let total: f64 =
            (0..47_000).map(|i| f64::from(Wavelengths::visible_pdf(360.005 + 0.01 * i as f32)) * 0.01).sum();
        assert!((total - 1.0).abs() < 1e-4, "{total}");
        // dλ/du = 1 / p(λ).
        for i in 1..100 {
            let u = i as f32 / 100.0;
            let slope = (f64::from(sample_visible(u + 2e-3)) - f64::from(sample_visible(u - 2e-3))) / 4e-3;
            let inverse = 1.0 / f64::from(Wavelengths::visible_pdf(sample_visible(u)));
            assert!((slope / inverse - 1.0).abs() < 6e-3, "{u}: {slope} {inverse}");
        }
    }

    #[test]
    fn chi_squared_of_the_visible_density() {
        // 94 bins of 5 nm against the density's integral; 400 000 lanes of a hashed sequence.
        let (mut count, n) = ([0_u32; 94], 100_000_u32);
        for i in 0..n {
            for l in Wavelengths::sample_visible(math::hash::unit_f32(math::hash::mix32(i))).lambda() {
                count[(((l - 360.0) / 5.0) as usize).min(93)] += 1;
            }
        }
        let mut chi2 = 0.0;
        for (bin, c) in count.into_iter().enumerate() {
            let inside =
                |k: i32| f64::from(Wavelengths::visible_pdf(360.25 + 5.0 * bin as f32 + 0.5 * k as f32));
            let expected = f64::from(4 * n) * (0..10).map(inside).sum::<f64>() * 0.5;
            chi2 += (f64::from(c) - expected) * (f64::from(c) - expected) / expected;
        }
        // 93 degrees of freedom: 99.9 % are below 140 (the four lanes are stratified, so it is less).
        assert!(chi2 < 140.0, "{chi2}");
    }

    #[test]
    fn lanes_are_in_range_and_apart() {
        for u in [0.0, 0.1, 0.249_999_99, 0.5, 0.999_999_94] {
            for w in [Wavelengths::sample_visible(u), Wavelengths::sample_uniform(u)] {
                assert!(w.lambda().iter().all(|l| (360.0..=830.0).contains(l)), "{u} {w:?}");
                assert!(w.pdf().iter().all(|p| *p > 0.0 && p.is_finite()));
                assert!(!w.is_rgb() && !w.is_terminated());
            }
        }
        let [a, b, c, d] = Wavelengths::sample_uniform(0.1).lambda();
        assert!((b - a - 117.5).abs() < 1e-3 && (c - b - 117.5).abs() < 1e-3 && (d - c - 117.5).abs() < 1e-3);
    }

    #[test]
    fn a_terminated_path_carries_its_hero_with_a_quarter_of_the_density() {
        let mut w = Wavelengths::sample_visible(0.3);
        let p = w.pdf();
        w.terminate_secondary();
        w.terminate_secondary();
        assert_eq!(w.pdf(), [p[0] * 0.25, 0.0, 0.0, 0.0]);
        assert!(w.is_terminated() && !Wavelengths::RGB.is_terminated());
    }
}
