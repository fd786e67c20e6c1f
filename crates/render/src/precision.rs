//! Rendering until the picture is precise enough: a stop rule that stays valid though it looks many times.
//!
//! The error of a picture is √relMSE. Its square has the expected value V, the mean over pixels and channels of Var / (r² + 0.01),
//! which the film estimates. The picture that is there differs from that mean by chance, and so does the estimate; both
//! deviations shrink with the number of pixels. The rule stops when
//!
//! ```text
//! V + z_k · √(F (2 · mean(e²) + var(e)) / P)  ≤  target²,
//! ```
//!
//! where `e` is a pixel's share of V, P the number of pixels, F how many of them a sample reaches through the filter, and `z_k` the
//! normal quantile of `α_k = α · 6 / (π k)²` at the k-th look: all looks together err with at most α = 5 % (union bound).
//! Looks come whenever the passes have grown by a quarter, so the rule costs at most a quarter more than a prophet needs.
//!
//! r² is not known: the mean's square less its variance stands for it. Bounds noise alone: a biased method's bias is not in it.
//! Methods whose pixels err together over the whole picture (`mlt`) deviate more than P pixels would.

use film::{Developed, Filter};
use statistics::normal_two_sided_quantile;

use crate::checkpoint::Checkpoint;
use crate::events::{Cancel, Event, Progress};
use crate::job::{Job, Outcome};
use crate::stop::Stop;
use crate::{Error, Workers};

/// Chance that a picture that was called precise is not.
const RISK: f64 = 0.05;
/// Passes before the first look: a variance from fewer is worth little.
const FIRST_LOOK: u32 = 8;
/// Keeps relative errors finite where the picture is black.
const EPSILON: f64 = 0.01;

/// How precise a picture is to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Precision {
    /// √relMSE that is not to be exceeded.
    pub target: f64,
}

impl std::str::FromStr for Precision {
    type Err = String;

    /// `1%` or `0.01`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (number, unit) = text.trim().strip_suffix('%').map_or((text, 1.0), |n| (n, 0.01));
        let target = number.trim().parse::<f64>().ok().map(|x| x * unit);
        let target = target.filter(|t| t.is_finite() && *t > 0.0);
        target.map(|target| Self { target }).ok_or("expected an error above zero, such as 1% or 0.01".into())
    }
}

impl Job<'_> {
    /// Renders passes from the first on until the picture is precise, or `cancel` is asked for. Passes that the film has already
    /// count. The picture's bits depend on `precision`, scene, settings and seed alone.
    ///
    /// # Errors
    /// As [`Job::render`].
    pub fn render_until(
        &mut self,
        precision: Precision,
        checkpoint: Option<&Checkpoint>,
        workers: &Workers,
        cancel: &Cancel,
        on_event: &mut dyn FnMut(Event<'_>),
    ) -> Result<Outcome, Error> {
        let mut sum: Option<Outcome> = None;
        let mut passes = FIRST_LOOK;
        // Once begun, the checkpoint is this render's own.
        let again = checkpoint.map(|c| Checkpoint { resume: true, ..c.clone() });
        for look in 1.. {
            let mut tell = |event: Event<'_>| match (event, &sum) {
                (Event::Progress(p), before) => {
                    let earlier = before.as_ref().map(|o| &o.report);
                    on_event(Event::Progress(&Progress {
                        passes: p.passes + earlier.map_or(0, |r| r.passes),
                        of_passes: None,
                        elapsed: p.elapsed + earlier.map_or_else(Default::default, |r| r.elapsed),
                        remaining: None,
                        ..*p
                    }));
                }
                (other, _) => on_event(other),
            };
            let stop = Stop::Passes(0..passes);
            let checkpoint = if look == 1 { checkpoint } else { again.as_ref() };
            let outcome = self.render(&stop, checkpoint, workers, cancel, &mut tell)?;
            let cancelled = outcome.report.cancelled;
            sum = Some(match sum.take() {
                None => outcome,
                Some(before) => before.and(outcome),
            });
            let is_reached = || {
                let film = self.film();
                let developed = workers.install(|| film.develop());
                precision.is_reached(&developed, look, footprint(self))
            };
            let is_done = cancelled || is_reached();
            match sum {
                Some(outcome) if is_done => return Ok(outcome),
                Some(_) | None => {}
            }
            passes = passes.saturating_add((passes / 4).max(1));
        }
        unreachable!("looks do not end by themselves")
    }
}

impl Precision {
    /// Is the picture precise, at the `look`-th look? `footprint`: pixels that one sample reaches.
    fn is_reached(self, developed: &Developed, look: u32, footprint: f64) -> bool {
        let k = f64::from(look);
        let risk = RISK * 6.0 / (std::f64::consts::PI * k).powi(2);
        // The quantile of one side.
        let z = normal_two_sided_quantile(2.0 * risk);
        let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
        for (mean, variance) in developed.mean.iter().zip(&developed.variance) {
            let e = (0..3).map(|c| share(f64::from(mean[c]), f64::from(variance[c]))).sum::<f64>() / 3.0;
            n += 1.0;
            sum += e;
            squares += e * e;
        }
        let estimate = sum / n;
        let (mean_square, variance) = (squares / n, squares / n - estimate * estimate);
        let bound = estimate + z * (footprint * (2.0 * mean_square + variance) / n).sqrt();
        bound <= self.target * self.target
    }
}

/// A channel's share of relMSE; the square of what is true is estimated without bias.
fn share(mean: f64, variance: f64) -> f64 {
    variance / ((mean * mean - variance).max(0.0) + EPSILON)
}

/// Pixels that one sample reaches.
fn footprint(job: &Job<'_>) -> f64 {
    let [x, y] = match job.film().settings().filter {
        Filter::Box { radius }
        | Filter::Triangle { radius }
        | Filter::Gaussian { radius, .. }
        | Filter::Mitchell { radius, .. }
        | Filter::Sinc { radius, .. } => radius,
    };
    f64::from((2.0 * x).max(1.0) * (2.0 * y).max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(variance: f32, n: usize) -> Developed {
        Developed {
            bounds: math::Bounds2i::new([0, 0], [n as i32, 1]),
            n_passes: 8,
            weights: vec![1.0],
            mean: vec![[1.0; 3]; n],
            variance: vec![[variance; 3]; n],
            aovs: Vec::new(),
        }
    }

    #[test]
    fn small_pictures_and_late_looks_need_more() {
        let reached =
            |variance, n, look| Precision { target: 0.1 }.is_reached(&picture(variance, n), look, 1.0);
        assert!(reached(0.009, 10_000, 1) && !reached(0.0102, 10_000, 1));
        assert!(!reached(0.009, 100, 1), "a hundred pixels may err by a quarter");
        let latest = |look| (0..200).map(|i| 1e-4 * i as f32).rfind(|&v| reached(v, 400, look));
        assert!(latest(1) > latest(5) && latest(5) > latest(50));
    }

    #[test]
    fn nothing_is_reached_without_variance() {
        assert!(!Precision { target: 0.1 }.is_reached(&picture(f32::INFINITY, 9), 1, 1.0));
    }
}
