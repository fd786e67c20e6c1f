//! Methods side by side on one scene: at equal time or equal samples, over several seeds, against a reference.
//!
//! ```text
//! Plan ──run──► trials (method × seed) ──figures──► Comparison ──report──► one page, one JSON
//! ```
//!
//! A trial renders batches of passes that double in size. After each of them its error is measured; the batches by themselves
//! are independent samples of every tile's mean, from which tests of agreement and of bias take their errors.

mod figures;
mod plan;
mod tiles;
mod trial;
mod truth;

use render::{Cancel, Event, Method, Workers};
use scene::Scene;
use thiserror::Error;

pub(crate) use figures::geometric;
pub use figures::{
    Agreement, Comparison, Convergence, Interval, Machine, MethodFigures, Pictures, Slope, Verdict,
};
pub use plan::{Budget, Entry, Plan, Truth};
pub(crate) use tiles::{Batch, Grid, estimate};
pub(crate) use trial::Bench;
pub use truth::{REFERENCE_SEED, Reference, ReferenceFacts};

use self::trial::Trial;

/// Why a comparison gave nothing.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// A render failed.
    #[error(transparent)]
    Render(#[from] render::Error),
    /// The reference does not fit.
    #[error("the reference {name} does not have the {width} x {height} pixels of the render")]
    ReferenceSize {
        /// Which.
        name: String,
        /// Of the render.
        width: usize,
        /// Of the render.
        height: usize,
    },
    /// Stopped before there was anything to compare.
    #[error("interrupted before there was anything to compare")]
    Interrupted,
    /// The plan itself is wrong.
    #[error("{0}")]
    Plan(String),
    /// Nothing to do.
    #[error("a comparison needs at least one method and one seed")]
    Empty,
}

/// What a comparison tells while it runs.
#[derive(Clone, Copy, Debug)]
pub enum Step<'a> {
    /// The reference is made.
    Reference,
    /// A run begins.
    Trial {
        /// Of which method.
        label: &'a str,
        /// The how manieth run of all.
        number: usize,
        /// Runs in all.
        of: usize,
    },
    /// Something within the step.
    Event(Event<'a>),
}

/// Runs a comparison. When `cancel` is asked for, what is complete is compared.
///
/// # Errors
/// A method or a parameter does not exist, the reference does not fit, or there is nothing to compare.
pub fn run(
    plan: &Plan,
    scene: &Scene,
    workers: &Workers,
    cancel: &Cancel,
    on_step: &mut dyn FnMut(Step<'_>),
) -> Result<Comparison, Error> {
    if plan.entries.is_empty() || plan.seeds.is_empty() {
        return Err(Error::Empty);
    }
    // Bad names are found before the reference is made.
    for entry in &plan.entries {
        render::Job::new(scene, &entry.method)?;
    }
    on_step(Step::Reference);
    let reference = Reference::obtain(&plan.truth, scene, workers, cancel, &mut |e| on_step(Step::Event(e)))?;

    let crop = scene.settings().crop;
    let grid = Grid::new(crop.width(), crop.height());
    let bench = Bench { scene, workers, cancel, grid, budget: plan.budget };
    let of = plan.entries.len() * plan.seeds.len();
    let mut trials: Vec<Vec<Trial>> = vec![Vec::new(); plan.entries.len()];
    // Seed by seed, so that methods share whatever else the machine does, and a cut leaves a fair comparison.
    'all: for (round, &seed) in plan.seeds.iter().enumerate() {
        for (i, entry) in plan.entries.iter().enumerate() {
            let number = round * plan.entries.len() + i + 1;
            on_step(Step::Trial { label: &entry.label, number, of });
            let method = Method { seed: Some(seed), ..entry.method.clone() };
            let trial = bench.run(&method, Some(&reference), &mut |e| on_step(Step::Event(e)))?;
            match trial {
                Some(trial) if !trial.cancelled || round == 0 => trials[i].push(trial),
                Some(_) | None => {}
            }
            if cancel.urgency() > render::Urgency::None {
                break 'all;
            }
        }
    }
    if trials.iter().all(Vec::is_empty) {
        return Err(Error::Interrupted);
    }
    Ok(figures::gather(plan, scene, workers, &grid, (trials, reference)))
}
