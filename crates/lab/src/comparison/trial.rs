//! One run of one method: batches of passes that double in size, and the error after each of them.

use std::time::{Duration, Instant};

use film::{Developed, Film};
use render::{Cancel, Event, Job, Method, Stop, Workers};
use scene::Scene;

use super::plan::Budget;
use super::tiles::{Batch, Grid};
use super::truth::Reference;
use crate::Metrics;

/// A point on the way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment {
    pub(crate) passes: u32,
    pub(crate) seconds: f64,
    pub(crate) metrics: Metrics,
}

/// A run that is done.
#[derive(Clone, Debug)]
pub(crate) struct Trial {
    pub(crate) moments: Vec<Moment>,
    pub(crate) batches: Vec<Batch>,
    pub(crate) developed: Developed,
    pub(crate) rays: u64,
    pub(crate) settings: String,
    pub(crate) unbiased: bool,
    /// What its method cannot find.
    pub(crate) misses: &'static str,
    /// Why it ended early.
    pub(crate) cancelled: bool,
}

/// What all runs share.
pub(crate) struct Bench<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) workers: &'a Workers,
    pub(crate) cancel: &'a Cancel,
    pub(crate) grid: Grid,
    pub(crate) budget: Budget,
}

impl Bench<'_> {
    /// Runs `method` until its budget is spent; without a reference its errors are not known. `None`: stopped before anything was
    /// complete.
    pub(crate) fn run(
        &self,
        method: &Method,
        reference: Option<&Reference>,
        on_event: &mut dyn FnMut(Event<'_>),
    ) -> Result<Option<Trial>, render::Error> {
        let mut job = Job::new(self.scene, method)?;
        let mut whole: Option<Film> = None;
        let mut trial: Option<Trial> = None;
        let (mut done, mut spent, mut rays) = (0_u32, Duration::ZERO, 0);
        let mut batches = Vec::new();
        let mut moments = Vec::new();
        while let Some(size) = next_batch(self.budget, done, spent) {
            // What the integrator builds before a pass counts too.
            let start = Instant::now();
            let stop = Stop::Passes(done..done + size);
            let outcome = job.render(&stop, None, self.workers, self.cancel, on_event)?;
            spent += start.elapsed();
            rays += outcome.report.counters.rays;
            done += outcome.report.passes;
            if outcome.report.passes > 0 {
                let film = job.take_film()?;
                batches.push(Batch::new(&self.grid, &film.develop()));
                let whole = match &mut whole {
                    None => whole.insert(film),
                    Some(whole) => {
                        whole.merge(&film)?;
                        whole
                    }
                };
                let developed = whole.develop();
                let metrics = reference.map_or_else(Metrics::unknown, |r| r.metrics(&developed));
                moments.push(Moment { passes: done, seconds: spent.as_secs_f64(), metrics });
                let key = &whole.settings().key;
                let info = integrators::find(&key.integrator);
                let (unbiased, misses) = info.map_or((false, ""), |i| (i.unbiased, i.misses));
                // Iterations are combined by weights that their own samples give.
                let unbiased = unbiased && whole.settings().iterations.is_empty();
                let settings = key.settings.clone();
                trial = Some(Trial {
                    moments: moments.clone(),
                    batches: batches.clone(),
                    developed,
                    rays,
                    settings,
                    unbiased,
                    misses,
                    cancelled: outcome.report.cancelled,
                });
            }
            if outcome.report.cancelled {
                break;
            }
        }
        Ok(trial)
    }
}

/// Passes that come next: as many as there were, so that points lie evenly on logarithmic paper; fewer at the end.
fn next_batch(budget: Budget, done: u32, spent: Duration) -> Option<u32> {
    let double = done.max(1);
    match budget {
        Budget::Samples(n) => Some(double.min(n.saturating_sub(done))).filter(|&k| k > 0),
        Budget::Time(_) if done == 0 => Some(1),
        Budget::Time(limit) => {
            let each = spent.as_secs_f64() / f64::from(done);
            let left = limit.saturating_sub(spent).as_secs_f64();
            let fit = (left / each.max(1e-9)) as u32;
            // A rest that is smaller than a batch joins it.
            let size = if fit < 2 * double { fit } else { double };
            Some(size).filter(|&k| k > 0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batches_double_and_end_with_the_budget() {
        let mut sizes = Vec::new();
        let mut done = 0;
        while let Some(n) = next_batch(Budget::Samples(11), done, Duration::ZERO) {
            sizes.push(n);
            done += n;
        }
        assert_eq!(sizes, [1, 1, 2, 4, 3]);

        let (mut done, limit) = (0, Duration::from_millis(1000));
        let spent = |done: u32| Duration::from_millis(u64::from(done) * 90);
        let mut sizes = Vec::new();
        while let Some(n) = next_batch(Budget::Time(limit), done, spent(done)) {
            sizes.push(n);
            done += n;
        }
        assert_eq!(sizes, [1, 1, 2, 7]);
    }
}
