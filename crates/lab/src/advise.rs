//! Which integrator for this scene? Short pilots, then the time that each would need for a wanted error.
//!
//! The error of an unbiased method obeys relMSE × seconds = constant. A pilot of a second measures the constant, from the film's own
//! variance; pilots with several seeds give its interval, which is widened by how far longer renders were found to stray from such
//! predictions ([`STRAY`]). Variance that a pilot did not see (a caustic that no path found) makes a method look better than it is: so
//! every pilot's picture is compared with the others, and a method that has significantly less light anywhere is not recommended.
//! Where none has found that light, the prediction is too short, and no interval says so.
//!
//! Left out: the bias of biased methods. Their times are for noise alone, and they are recommended only where it is asked for.

use std::time::Duration;

use render::{Cancel, Method, Workers};
use scene::Scene;
use serde::Serialize;
use statistics::sidak;

use crate::comparison::{Batch, Bench, Budget, Entry, Error, Grid, Interval, estimate, geometric};

/// Chance that a method is called blind although it is not.
const FALSE_ALARM: f64 = 0.01;

/// Pilots of each method, if nothing else is said.
pub const PILOTS: u32 = 3;

/// Standard deviation of the logarithm of the seconds that a render needed over those that its pilots predicted: 0.24 over ten scenes of
/// `benches/advise.py` (ratios from 0.73 to 1.63, pilots of 1 s, renders of 4 s). Its three scenes with rare light (caustics of tiny
/// lamps) are not counted: there renders took 4.5, 16 and 20 times as long.
const STRAY: f64 = 0.24;

/// What to find out.
#[derive(Clone, Debug)]
pub struct Question {
    /// The methods that may be recommended.
    pub entries: Vec<Entry>,
    /// √relMSE that is wanted.
    pub target: f64,
    /// Time for each pilot of each method.
    pub pilot: Duration,
    /// Pilots of each method.
    pub pilots: u32,
    /// May a biased method be recommended?
    pub allow_biased: bool,
}

/// What a pilot says of a method.
#[derive(Clone, Debug, Serialize)]
pub struct Advice {
    /// Which.
    pub label: String,
    /// Seconds to the wanted error, with 95 % interval; for biased methods of its noise alone.
    pub seconds: Interval,
    /// Samples per pixel that this means.
    pub spp: f64,
    /// Is its expected value the right image?
    pub unbiased: bool,
    /// What speaks against it: another method found more light.
    pub objection: Option<String>,
    /// The one to take.
    pub recommended: bool,
}

struct Pilot {
    label: String,
    unbiased: bool,
    misses: &'static str,
    /// relMSE × seconds of each pilot.
    costs: Vec<f64>,
    seconds_per_pass: f64,
    batches: Vec<Batch>,
}

/// The methods that show all light of a scene and can render it, with their own settings.
#[must_use]
pub fn candidates(scene: &Scene) -> Vec<Entry> {
    let shows_all = |name: &str| !matches!(name, "ao" | "direct" | "recursive");
    let can = |entry: &Entry| render::Job::new(scene, &entry.method).is_ok();
    let names = integrators::list().iter().map(|i| i.name).filter(|n| shows_all(n));
    names.filter_map(|n| Entry::parse(n).ok()).filter(can).collect()
}

/// Runs the pilots; the best first.
///
/// # Errors
/// A method does not exist, no method can render the scene, or it was interrupted.
pub fn advise(
    question: &Question,
    scene: &Scene,
    workers: &Workers,
    cancel: &Cancel,
    on_pilot: &mut dyn FnMut(&str),
) -> Result<Vec<Advice>, Error> {
    let crop = scene.settings().crop;
    let grid = Grid::new(crop.width(), crop.height());
    let bench = Bench { scene, workers, cancel, grid, budget: Budget::Time(question.pilot) };
    let mut pilots = Vec::new();
    for entry in &question.entries {
        on_pilot(&entry.label);
        pilots.push(pilot(question, entry, &bench)?);
        if cancel.urgency() > render::Urgency::None {
            return Err(Error::Interrupted);
        }
    }
    if pilots.is_empty() {
        return Err(Error::Empty);
    }
    let objections: Vec<_> = (0..pilots.len()).map(|i| objection(&pilots, i, &grid)).collect();
    let mut advice: Vec<Advice> = pilots
        .iter()
        .zip(objections)
        .map(|(p, objection)| {
            let seconds = geometric(p.costs.iter().map(|c| c / (question.target * question.target)));
            let seconds = seconds.widened(STRAY);
            Advice {
                label: p.label.clone(),
                spp: seconds.value / p.seconds_per_pass,
                seconds,
                unbiased: p.unbiased,
                objection,
                recommended: false,
            }
        })
        .collect();
    let is_eligible = |a: &Advice| {
        a.objection.is_none() && (a.unbiased || question.allow_biased) && a.seconds.value.is_finite()
    };
    advice.sort_by(|a, b| {
        is_eligible(b).cmp(&is_eligible(a)).then(a.seconds.value.total_cmp(&b.seconds.value))
    });
    if let Some(first) = advice.first_mut() {
        first.recommended = is_eligible(first);
    }
    Ok(advice)
}

fn pilot(question: &Question, entry: &Entry, bench: &Bench<'_>) -> Result<Pilot, Error> {
    let mut pilot = Pilot {
        label: entry.label.clone(),
        unbiased: false,
        misses: "",
        costs: Vec::new(),
        seconds_per_pass: 0.0,
        batches: Vec::new(),
    };
    let (mut seconds, mut passes) = (0.0, 0.0);
    for seed in 0..question.pilots.max(2) {
        let method = Method { seed: Some(u64::from(seed)), ..entry.method.clone() };
        let Some(trial) = bench.run(&method, None, &mut |_| {})? else { return Err(Error::Interrupted) };
        let spent = trial.moments.last().map_or(0.0, |m| m.seconds);
        pilot.costs.push(trial.developed.relmse_estimate() * spent);
        seconds += spent;
        passes += trial.developed.n_passes as f64;
        (pilot.unbiased, pilot.misses) = (trial.unbiased, trial.misses);
        pilot.batches.extend(trial.batches);
    }
    pilot.seconds_per_pass = seconds / f64::max(passes, 1.0);
    Ok(pilot)
}

/// Has another unbiased method found significantly more light in some tile?
fn objection(pilots: &[Pilot], own: usize, grid: &Grid) -> Option<String> {
    let others = pilots.iter().enumerate().filter(|(i, p)| *i != own && p.unbiased);
    let tests = grid.len() * 3 * pilots.len();
    let alpha = sidak(FALSE_ALARM, tests);
    for (_, other) in others {
        for tile in 0..grid.len() {
            for c in 0..3 {
                let (a, b) = (estimate(&pilots[own].batches, tile, c), estimate(&other.batches, tile, c));
                // Ten per cent of the light is a hole; less is a matter of noise or bias.
                if a.mean < 0.9 * b.mean && a.compare(&b).p_value < alpha {
                    let share = 100.0 * (1.0 - a.mean / b.mean);
                    return Some(format!(
                        "{} found more light ({share:.0} % of a tile is missing); it misses {}",
                        other.label, pilots[own].misses
                    ));
                }
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_pilots_agree_on_is_still_not_sure() {
        let agreed = geometric([4.0, 4.0, 4.0].into_iter()).widened(STRAY);
        assert_eq!(agreed.value, 4.0);
        let by = (1.959_964 * STRAY).exp();
        assert!((agreed.high / 4.0 - by).abs() < 1e-5 && (4.0 / agreed.low - by).abs() < 1e-5, "{agreed:?}");
        let unsure = geometric([2.0, 4.0, 8.0].into_iter());
        let wider = unsure.widened(STRAY);
        assert!(wider.low < unsure.low && wider.high > unsure.high && wider.high < unsure.high * by);
    }
}
