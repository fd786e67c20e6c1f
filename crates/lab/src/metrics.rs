//! Distances between a picture `x` and a reference `r`, in linear R, G, B.
//!
//! | metric           | per channel             | then                                |
//! |------------------|-------------------------|-------------------------------------|
//! | MSE              | `(x − r)²`              | mean over channels and pixels       |
//! | relMSE           | `(x − r)² / (r² + ε)`   | the same                            |
//! | trimmed relMSE   | the same                | the same, without the worst pixels  |
//! | MAPE             | `|x − r| / (|r| + ε)`   | mean over channels and pixels       |
//! | SMAPE            | `2 |x − r| / (|x| + |r| + ε)` | the same                        |
//!
//! with `ε = 0.01`. Sums are in double precision and in the order of the pixels. FLIP needs to know which pixels are
//! neighbours: [`crate::flip`]; its mean may be put beside the others.

use std::fmt;
use std::str::FromStr;

use serde::Serialize;

/// Keeps relative errors finite where the reference is black.
const EPSILON: f64 = 0.01;
/// The share of pixels that trimmed relMSE leaves out.
const TRIMMED: f64 = 0.001;

/// All metrics of a pair of pictures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Metrics {
    /// Mean squared error.
    pub mse: f64,
    /// Mean relative squared error.
    pub relmse: f64,
    /// The same without the 0.1 % of pixels with the largest error (rounded down to whole pixels).
    pub trimmed_relmse: f64,
    /// Mean absolute relative error; a share, not per cent.
    pub mape: f64,
    /// Symmetric mean absolute relative error; a share, not per cent.
    pub smape: f64,
    /// Mean FLIP error, where somebody asked for it: [`crate::flip`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flip: Option<f64>,
    /// Mean R, G, B of the picture.
    pub mean: [f64; 3],
    /// Mean R, G, B of the reference.
    pub mean_reference: [f64; 3],
    /// Pixels that were compared.
    pub pixels: u64,
    /// Pixels with a value that is not finite, in either picture. They are left out of all the rest.
    pub non_finite: u64,
}

impl Metrics {
    /// Nothing is known.
    pub(crate) fn unknown() -> Self {
        let nan = f64::NAN;
        Self {
            mse: nan,
            relmse: nan,
            trimmed_relmse: nan,
            mape: nan,
            smape: nan,
            flip: None,
            mean: [nan; 3],
            mean_reference: [nan; 3],
            pixels: 0,
            non_finite: 0,
        }
    }
}

/// A metric by name, for thresholds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// [`Metrics::mse`].
    Mse,
    /// [`Metrics::relmse`].
    RelMse,
    /// [`Metrics::trimmed_relmse`].
    TrimmedRelMse,
    /// [`Metrics::mape`].
    Mape,
    /// [`Metrics::smape`].
    Smape,
    /// [`Metrics::flip`].
    Flip,
}

impl Metric {
    /// All of them, in the order of the table above.
    pub const ALL: [Self; 6] =
        [Self::Mse, Self::RelMse, Self::TrimmedRelMse, Self::Mape, Self::Smape, Self::Flip];

    /// Its name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Mse => "mse",
            Self::RelMse => "relmse",
            Self::TrimmedRelMse => "trimmed_relmse",
            Self::Mape => "mape",
            Self::Smape => "smape",
            Self::Flip => "flip",
        }
    }

    /// Its value; not a number where it was not computed.
    #[must_use]
    pub fn of(self, metrics: &Metrics) -> f64 {
        match self {
            Self::Mse => metrics.mse,
            Self::RelMse => metrics.relmse,
            Self::TrimmedRelMse => metrics.trimmed_relmse,
            Self::Mape => metrics.mape,
            Self::Smape => metrics.smape,
            Self::Flip => metrics.flip.unwrap_or(f64::NAN),
        }
    }
}

impl fmt::Display for Metric {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Metric {
    type Err = String;

    fn from_str(s: &str) -> Result<Self, String> {
        let wanted = s.to_lowercase().replace('-', "_");
        let names = Self::ALL.map(Self::name).join(", ");
        Self::ALL
            .into_iter()
            .find(|m| m.name() == wanted)
            .ok_or_else(|| format!("there is no metric `{s}`; there are {names}"))
    }
}

/// Why two pictures cannot be compared.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MetricError {
    /// Different numbers of pixels.
    #[error("the pictures have {0} and {1} pixels")]
    Size(usize, usize),
    /// No pixels.
    #[error("the pictures have no pixels")]
    Empty,
}

/// Compares a picture with a reference, pixel by pixel.
///
/// # Errors
/// Different numbers of pixels, or none. Width and height are the caller's to compare.
pub fn compare(picture: &[[f32; 3]], reference: &[[f32; 3]]) -> Result<Metrics, MetricError> {
    if picture.len() != reference.len() {
        return Err(MetricError::Size(picture.len(), reference.len()));
    }
    if picture.is_empty() {
        return Err(MetricError::Empty);
    }
    let mut sums = Sums::default();
    let mut relative = Vec::with_capacity(picture.len());
    for (x, r) in picture.iter().zip(reference) {
        if x.iter().chain(r).all(|v| v.is_finite()) {
            relative.push(sums.add(x.map(f64::from), r.map(f64::from)));
        }
    }

    let pixels = relative.len();
    let values = 3.0 * pixels as f64;
    let mean = |sum: [f64; 3]| sum.map(|s| s / pixels as f64);
    Ok(Metrics {
        mse: sums.squared / values,
        relmse: relative.iter().sum::<f64>() / pixels as f64,
        trimmed_relmse: trimmed_mean(&mut relative),
        mape: sums.absolute / values,
        smape: sums.symmetric / values,
        flip: None,
        mean: mean(sums.picture),
        mean_reference: mean(sums.reference),
        pixels: pixels as u64,
        non_finite: (picture.len() - pixels) as u64,
    })
}

#[derive(Default)]
struct Sums {
    squared: f64,
    absolute: f64,
    symmetric: f64,
    picture: [f64; 3],
    reference: [f64; 3],
}

impl Sums {
    /// Adds a pixel; its relative squared error is returned.
    fn add(&mut self, x: [f64; 3], r: [f64; 3]) -> f64 {
        let mut relative = 0.0;
        for c in 0..3 {
            let d = x[c] - r[c];
            self.squared += d * d;
            self.absolute += d.abs() / (r[c].abs() + EPSILON);
            self.symmetric += 2.0 * d.abs() / (x[c].abs() + r[c].abs() + EPSILON);
            self.picture[c] += x[c];
            self.reference[c] += r[c];
            relative += d * d / (r[c] * r[c] + EPSILON);
        }
        relative / 3.0
    }
}

fn trimmed_mean(errors: &mut [f64]) -> f64 {
    let kept = errors.len() - (errors.len() as f64 * TRIMMED) as usize;
    errors.sort_unstable_by(f64::total_cmp);
    errors[..kept].iter().sum::<f64>() / kept as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-12 * b.abs().max(1.0)
    }

    #[test]
    fn equal_pictures_have_no_distance() {
        let p = [[0.25, 0.0, 3.0], [1.0, 2.0, 1e6]];
        let m = compare(&p, &p).unwrap();
        assert!(Metric::ALL.iter().all(|k| k.of(&m) == 0.0 || *k == Metric::Flip));
        assert_eq!((m.pixels, m.non_finite), (2, 0));
    }

    #[test]
    fn one_channel_by_hand() {
        // x = 2, r = 1 in one of three channels; the others agree.
        let m = compare(&[[2.0, 0.5, 0.0]], &[[1.0, 0.5, 0.0]]).unwrap();
        assert!(near(m.mse, 1.0 / 3.0));
        assert!(near(m.relmse, 1.0 / 1.01 / 3.0));
        assert!(near(m.mape, 1.0 / 1.01 / 3.0));
        assert!(near(m.smape, 2.0 / 3.01 / 3.0));
        assert!(near(m.mean[0], 2.0) && near(m.mean_reference[0], 1.0));
    }

    #[test]
    fn a_black_reference_gives_finite_errors() {
        let m = compare(&[[0.1; 3]], &[[0.0; 3]]).unwrap();
        assert!((m.relmse - 1.0).abs() < 1e-6, "0.1² / 0.01, with 0.1 of single precision");
        assert!((m.mape - 10.0).abs() < 1e-5 && (m.smape - 0.2 / 0.11).abs() < 1e-6);
    }

    #[test]
    fn trimming_leaves_out_the_worst_thousandth() {
        // 2000 pixels: two are left out, the third outlier stays.
        let reference = vec![[1.0; 3]; 2000];
        let mut picture = reference.clone();
        picture[5] = [101.0; 3];
        picture[700] = [51.0; 3];
        picture[1999] = [3.0; 3];
        let m = compare(&picture, &reference).unwrap();
        assert!(near(m.relmse, (10_000.0 + 2500.0 + 4.0) / 1.01 / 2000.0));
        assert!(near(m.trimmed_relmse, 4.0 / 1.01 / 1998.0));
    }

    #[test]
    fn the_reference_is_the_second() {
        let (a, b) = ([[3.0; 3]], [[1.0; 3]]);
        let (ab, ba) = (compare(&a, &b).unwrap(), compare(&b, &a).unwrap());
        assert!(near(ab.relmse, 4.0 / 1.01) && near(ba.relmse, 4.0 / 9.01));
        assert_eq!(ab.smape, ba.smape);
    }

    #[test]
    fn what_is_not_finite_is_counted_and_left_out() {
        let m = compare(&[[f32::NAN, 0.0, 0.0], [1.0; 3]], &[[1.0; 3], [1.0; 3]]).unwrap();
        assert_eq!((m.pixels, m.non_finite, m.mse), (1, 1, 0.0));
        let none = compare(&[[f32::INFINITY; 3]], &[[1.0; 3]]).unwrap();
        assert!(none.mse.is_nan() && none.pixels == 0);
    }

    #[test]
    fn pictures_of_other_sizes_are_refused() {
        assert_eq!(compare(&[[0.0; 3]; 2], &[[0.0; 3]; 3]), Err(MetricError::Size(2, 3)));
        assert_eq!(compare(&[], &[]), Err(MetricError::Empty));
    }

    #[test]
    fn names_are_read_back() {
        assert!(Metric::ALL.iter().all(|m| m.name().parse() == Ok(*m)));
        assert_eq!("relMSE".parse(), Ok(Metric::RelMse));
        assert!("psnr".parse::<Metric>().unwrap_err().contains("smape"));
    }
}
