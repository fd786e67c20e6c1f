//! What an experiment expects, and the test that decides.

use serde::Serialize;
use statistics::{Moments, sidak, student_two_sided_quantile};

use crate::comparison::{Comparison, MethodFigures};

/// Chance that an experiment fails although all its claims hold.
const FALSE_ALARM: f64 = 0.01;

/// What errors are compared at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Per {
    /// Equal samples.
    Sample,
    /// Equal numbers of rays: error times rays.
    Ray,
}

/// A claim; methods by their labels.
#[derive(Clone, Copy, Debug)]
pub enum Claim {
    /// The error of `worse` is more than `factor` times that of `better`, surely. The error is trimmed relMSE, without the worst
    /// thousandth of the pixels: where a sample in a hundred thousand sees the edge of a lamp, relMSE of a handful of runs hangs on
    /// that sample, which is the same for all methods, and no test could say anything.
    Lower {
        /// Which has the lower error.
        better: &'static str,
        /// Than which.
        worse: &'static str,
        /// By how much at least.
        factor: f64,
        /// At equal what.
        per: Per,
    },
    /// relMSE falls as samples^exponent, within `within` and the fit's interval.
    Falls {
        /// Whose.
        of: &'static str,
        /// −1 for independent samples.
        exponent: f64,
        /// What is allowed besides the interval.
        within: f64,
    },
    /// No test on any tile tells the two apart; `reference` is the reference.
    Agree {
        /// One.
        a: &'static str,
        /// The other.
        b: &'static str,
    },
    /// The tests tell them apart.
    Differ {
        /// One.
        a: &'static str,
        /// The other.
        b: &'static str,
    },
    /// The picture of `a` holds at least `factor` times the light of `b`.
    Brighter {
        /// Which has more light.
        a: &'static str,
        /// Than which.
        b: &'static str,
        /// At least by this.
        factor: f64,
    },
}

/// What a test said.
#[derive(Clone, Debug, Serialize)]
pub struct Finding {
    /// The claim in words.
    pub claim: String,
    /// What was measured.
    pub measured: String,
    /// Does it hold?
    pub holds: bool,
}

impl Claim {
    /// The methods that it speaks of.
    #[must_use]
    pub fn labels(&self) -> Vec<&'static str> {
        match *self {
            Self::Lower { better, worse, .. } => vec![better, worse],
            Self::Falls { of, .. } => vec![of],
            Self::Agree { a, b } | Self::Differ { a, b } | Self::Brighter { a, b, .. } => vec![a, b],
        }
    }

    /// Tests it, as one of `n` claims.
    #[must_use]
    pub fn check(&self, comparison: &Comparison, n: usize) -> Finding {
        let alpha = sidak(FALSE_ALARM, n);
        let (claim, found) = match *self {
            Self::Lower { better, worse, factor, per } => {
                let unit = match per {
                    Per::Sample => "samples",
                    Per::Ray => "rays",
                };
                let claim = match factor {
                    1.0 => format!("at equal {unit} the error of {better} is below that of {worse}"),
                    f => format!(
                        "at equal {unit} the error of {worse} is more than {f} times that of {better}"
                    ),
                };
                (claim, lower(comparison, [better, worse], factor, per, alpha))
            }
            Self::Falls { of, exponent, within } => {
                let claim = format!("the error (relMSE) of {of} falls as samples to the power {exponent}");
                (claim, falls(comparison, of, exponent, within))
            }
            Self::Agree { a, b } => {
                (format!("{a} and {b} are one picture"), agreement(comparison, a, b, true))
            }
            Self::Differ { a, b } => {
                (format!("{a} and {b} are different pictures"), agreement(comparison, a, b, false))
            }
            Self::Brighter { a, b, factor } => {
                let claim = format!("{a} holds at least {factor} times the light of {b}");
                (claim, brighter(comparison, a, b, factor))
            }
        };
        let (measured, holds) = found.unwrap_or_else(|| ("a method has no run".to_owned(), false));
        Finding { claim, measured, holds }
    }
}

type Found = Option<(String, bool)>;

fn method<'a>(comparison: &'a Comparison, label: &str) -> Option<&'a MethodFigures> {
    comparison.methods.iter().find(|m| m.label == label)
}

/// The ratio of errors, by the logarithms of all runs: above `factor` with confidence 1 − α.
fn lower(c: &Comparison, [better, worse]: [&str; 2], factor: f64, per: Per, alpha: f64) -> Found {
    let errors = |label| {
        let m = method(c, label)?;
        let cost = match per {
            Per::Sample => 1.0,
            Per::Ray => m.mrays_per_run,
        };
        Some(Moments::of(m.trimmed_of_runs.iter().map(|e| libm::log(e * cost))))
    };
    let (low, high) = (errors(better)?, errors(worse)?);
    let difference = high.mean() - low.mean();
    let error = low.std_error().hypot(high.std_error());
    let df = (low.n().min(high.n()) as f64 - 1.0).max(1.0);
    // One side: the quantile of twice the risk.
    let sure = difference - student_two_sided_quantile(2.0 * alpha, df) * error;
    let measured = format!("{:.3} times, surely more than {:.3}", libm::exp(difference), libm::exp(sure));
    Some((measured, sure > libm::log(factor)))
}

fn falls(c: &Comparison, of: &str, exponent: f64, within: f64) -> Found {
    let slope = method(c, of)?.slope?.samples;
    let holds = slope.low - within <= exponent && exponent <= slope.high + within;
    Some((format!("exponent {:.3}, between {:.3} and {:.3}", slope.value, slope.low, slope.high), holds))
}

fn agreement(c: &Comparison, a: &str, b: &str, expected: bool) -> Found {
    let found = c.agreements.iter().find(|x| (x.a == a && x.b == b) || (x.a == b && x.b == a))?;
    let v = &found.verdict;
    let measured = format!(
        "worst of {} tests: |t| = {:.2}, p = {:.1e}, {:+.1} %",
        v.tests,
        v.statistic,
        v.p_value,
        100.0 * v.difference
    );
    Some((measured, v.agrees == expected))
}

fn brighter(c: &Comparison, a: &str, b: &str, factor: f64) -> Found {
    let light = |label| method(c, label).map(|m| m.mean_ratio.iter().sum::<f64>());
    let ratio = light(a)? / light(b)?;
    Some((format!("{ratio:.3} times"), ratio >= factor))
}
