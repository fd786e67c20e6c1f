//! From trials to figures: errors with intervals, slopes, efficiency, bias and agreement.

use serde::Serialize;
use statistics::{Moments, log_log_fit, sidak};

use render::Workers;
use scene::Scene;

use super::plan::{Budget, Plan};
use super::tiles::{Batch, Grid, estimate};
use super::trial::Trial;
use super::truth::{Reference, ReferenceFacts};
use crate::flip;

/// Probability of all intervals.
const CONFIDENCE: f64 = 0.95;
/// Chance that a family of tests raises a false alarm.
const FALSE_ALARM: f64 = 0.01;

/// A value and the interval that holds it with 95 % (open where there is one run only).
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Interval {
    /// The value.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// The interval of a positive value that strays from the truth beside: the logarithm has this standard deviation more.
    pub(crate) fn widened(self, stray: f64) -> Self {
        let more = stray * statistics::normal_two_sided_quantile(1.0 - CONFIDENCE);
        let wider = |end: f64| libm::exp(libm::hypot(libm::log(end / self.value), more));
        Self { low: self.value / wider(self.low), high: self.value * wider(self.high), ..self }
    }
}

/// The exponent of an error's fall, with its interval.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Slope {
    /// Of relMSE over samples: −1 for independent samples.
    pub samples: Interval,
    /// Of relMSE over time.
    pub time: Interval,
}

/// A point of a method's curve: means over its runs.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Convergence {
    /// Passes.
    pub spp: u32,
    /// Seconds of rendering.
    pub seconds: f64,
    /// relMSE without the reference's noise.
    pub relmse: Interval,
}

/// The worst of a family of tests.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Verdict {
    /// Do the means agree? The family's false-alarm rate is 1 %.
    pub agrees: bool,
    /// Largest |t|.
    pub statistic: f64,
    /// Its probability, before the number of tests is taken into account.
    pub p_value: f64,
    /// Tests in the family.
    pub tests: usize,
    /// Column and row of the worst tile.
    pub tile: [usize; 2],
    /// Difference of the means there, relative to the second.
    pub difference: f64,
}

/// Two methods.
#[derive(Clone, Debug, Serialize)]
pub struct Agreement {
    /// The first.
    pub a: String,
    /// The second; `reference` for the reference.
    pub b: String,
    /// What the tests say.
    pub verdict: Verdict,
}

/// All figures of one method.
#[derive(Clone, Debug, Serialize)]
pub struct MethodFigures {
    /// As it was called.
    pub label: String,
    /// Every setting.
    pub settings: String,
    /// Is its expected value the right image?
    pub unbiased: bool,
    /// What it cannot find, in a sentence.
    pub misses: String,
    /// Runs.
    pub runs: usize,
    /// Mean passes of a run.
    pub spp: f64,
    /// Mean seconds of a run.
    pub seconds: f64,
    /// Million rays a second.
    pub mrays_per_second: f64,
    /// Million rays of a run.
    pub mrays_per_run: f64,
    /// relMSE of each run, without the reference's noise.
    pub relmse_of_runs: Vec<f64>,
    /// The same without the worst thousandth of the pixels of each run; the reference's noise is in it.
    pub trimmed_of_runs: Vec<f64>,
    /// relMSE, its geometric mean over runs, without the reference's noise.
    pub relmse: Interval,
    /// Without the worst thousandth of the pixels. (The reference's noise is in it.)
    pub trimmed_relmse: Interval,
    /// Mean FLIP error of the first run.
    pub flip: f64,
    /// 1 / (relMSE × seconds).
    pub efficiency: Interval,
    /// How fast the error falls.
    pub slope: Option<Slope>,
    /// The share of relMSE that the film's own variance explains; what is missing from one is bias, or noise that it did not see.
    pub explained_by_noise: f64,
    /// Mean R, G, B over the reference's.
    pub mean_ratio: [f64; 3],
    /// Its curve.
    pub convergence: Vec<Convergence>,
}

/// A method's picture: of its first run.
#[derive(Clone, Debug)]
pub struct Pictures {
    /// Of which method.
    pub label: String,
    /// Linear R, G, B.
    pub rgb: Vec<[f32; 3]>,
    /// Variance of each value.
    pub variance: Vec<[f32; 3]>,
}

/// Where it ran.
#[derive(Clone, Debug, Serialize)]
pub struct Machine {
    /// Threads.
    pub threads: usize,
    /// The instruction set of the ray kernel.
    pub isa: String,
    /// Processor family and system.
    pub platform: String,
    /// The program's version.
    pub version: String,
}

/// A comparison that was run.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// Hash of the scene.
    pub scene: String,
    /// Width and height.
    pub size: [usize; 2],
    /// Four wavelengths rather than R, G, B?
    pub spectral: bool,
    /// What each run could spend, in words.
    pub budget: String,
    /// Seeds of the runs.
    pub seeds: Vec<u64>,
    /// What they were measured against.
    pub reference: ReferenceFacts,
    /// Where.
    pub machine: Machine,
    /// The methods, in the order of the plan; those without a run are left out.
    pub methods: Vec<MethodFigures>,
    /// Every pair of unbiased methods, and every method against the reference if its noise is known.
    pub agreements: Vec<Agreement>,
    /// Their pictures, in the same order.
    #[serde(skip)]
    pub pictures: Vec<Pictures>,
    /// The reference's picture.
    #[serde(skip)]
    pub truth: Pictures,
}

pub(super) fn gather(
    plan: &Plan,
    scene: &Scene,
    workers: &Workers,
    grid: &Grid,
    (trials, reference): (Vec<Vec<Trial>>, Reference),
) -> Comparison {
    let settings = scene.settings();
    let size = [settings.crop.width(), settings.crop.height()];
    let run: Vec<(&str, &[Trial])> = plan
        .entries
        .iter()
        .zip(&trials)
        .filter(|(_, t)| !t.is_empty())
        .map(|(e, t)| (e.label.as_str(), t.as_slice()))
        .collect();
    let budget = match plan.budget {
        Budget::Time(t) => format!("{} s each", t.as_secs_f64()),
        Budget::Samples(n) => format!("{n} samples per pixel each"),
    };
    let isa = format!("{:?}", scene.accel().isa()).to_lowercase();
    Comparison {
        scene: format!("{:016x}", settings.content_hash),
        size,
        spectral: settings.spectral,
        budget,
        seeds: plan.seeds.clone(),
        machine: Machine {
            threads: workers.len(),
            isa,
            platform: format!("{} {}", std::env::consts::ARCH, std::env::consts::OS),
            version: render::VERSION.to_owned(),
        },
        methods: run.iter().map(|(label, trials)| of_method(label, trials, &reference, size[0])).collect(),
        agreements: agreements(&run, &reference, grid),
        pictures: run
            .iter()
            .map(|(label, trials)| Pictures {
                label: (*label).to_owned(),
                rgb: trials[0].developed.mean.clone(),
                variance: trials[0].developed.variance.clone(),
            })
            .collect(),
        truth: Pictures { label: "reference".to_owned(), rgb: reference.rgb, variance: reference.variance },
        reference: reference.facts,
    }
}

fn of_method(label: &str, trials: &[Trial], reference: &Reference, width: usize) -> MethodFigures {
    let noise = reference.facts.relmse.unwrap_or(0.0);
    let own = |relmse: f64| (relmse - noise).max(1e-3 * relmse);
    let last = || trials.iter().filter_map(|t| t.moments.last());
    let mean = |f: &dyn Fn(&super::trial::Moment) -> f64| last().map(f).sum::<f64>() / trials.len() as f64;
    let seconds = mean(&|m| m.seconds);
    let ratio = |c: usize| mean(&|m| m.metrics.mean[c] / m.metrics.mean_reference[c]);
    let relmse = geometric(last().map(|m| own(m.metrics.relmse)));
    let first = &trials[0];
    let explained = trials.iter().map(|t| t.developed.relmse_estimate()).sum::<f64>() / trials.len() as f64;
    let rays: u64 = trials.iter().map(|t| t.rays).sum();
    MethodFigures {
        label: label.to_owned(),
        settings: first.settings.clone(),
        unbiased: first.unbiased,
        misses: first.misses.to_owned(),
        runs: trials.len(),
        spp: mean(&|m| f64::from(m.passes)),
        seconds,
        mrays_per_second: rays as f64 * 1e-6 / (seconds * trials.len() as f64).max(1e-9),
        mrays_per_run: rays as f64 * 1e-6 / trials.len() as f64,
        relmse_of_runs: last().map(|m| own(m.metrics.relmse)).collect(),
        trimmed_of_runs: last().map(|m| m.metrics.trimmed_relmse).collect(),
        relmse,
        trimmed_relmse: geometric(last().map(|m| m.metrics.trimmed_relmse)),
        flip: flip::mean(&flip::flip_hdr(&first.developed.mean, &reference.rgb, width)),
        efficiency: geometric(last().map(|m| 1.0 / (own(m.metrics.relmse) * m.seconds.max(1e-9)))),
        slope: slope(trials, &own),
        explained_by_noise: explained / relmse.value,
        mean_ratio: [0, 1, 2].map(ratio),
        convergence: convergence(trials, &own),
    }
}

/// The geometric mean of positive values with its interval, by their logarithms.
pub(crate) fn geometric(values: impl Iterator<Item = f64>) -> Interval {
    let logs = Moments::of(values.map(|x| libm::log(x.max(f64::MIN_POSITIVE))));
    let [low, high] = logs.mean_interval(CONFIDENCE);
    Interval { value: libm::exp(logs.mean()), low: libm::exp(low), high: libm::exp(high) }
}

/// Slopes of all runs together, from the third point on: before, a pixel's error is not yet what it will be.
fn slope(trials: &[Trial], own: &dyn Fn(f64) -> f64) -> Option<Slope> {
    let fit = |x: &dyn Fn(&super::trial::Moment) -> f64| {
        let points: Vec<_> = trials
            .iter()
            .flat_map(|t| t.moments.iter().skip(2))
            .map(|m| (x(m), own(m.metrics.relmse)))
            .collect();
        (points.len() >= 3).then(|| log_log_fit(&points))
    };
    let interval = |fit: statistics::LogLogFit| {
        let [low, high] = fit.slope_interval(CONFIDENCE);
        Interval { value: fit.slope, low, high }
    };
    let samples = fit(&|m| f64::from(m.passes)).map(interval)?;
    let time = fit(&|m| m.seconds).map(interval)?;
    Some(Slope { samples, time })
}

/// Points that all runs share, and the last of each run as one point.
fn convergence(trials: &[Trial], own: &dyn Fn(f64) -> f64) -> Vec<Convergence> {
    let shortest = trials.iter().map(|t| t.moments.len()).min().unwrap_or(0);
    let point = |i: usize| {
        let moments = || trials.iter().map(move |t| &t.moments[i]);
        let n = trials.len() as f64;
        Convergence {
            spp: (moments().map(|m| f64::from(m.passes)).sum::<f64>() / n) as u32,
            seconds: moments().map(|m| m.seconds).sum::<f64>() / n,
            relmse: geometric(moments().map(|m| own(m.metrics.relmse))),
        }
    };
    (0..shortest).map(point).collect()
}

/// Every pair of unbiased methods, then every method against the reference.
fn agreements(run: &[(&str, &[Trial])], reference: &Reference, grid: &Grid) -> Vec<Agreement> {
    let batches: Vec<Vec<Batch>> =
        run.iter().map(|(_, trials)| trials.iter().flat_map(|t| t.batches.clone()).collect()).collect();
    let is_unbiased = |i: usize| run[i].1[0].unbiased;
    let mut found = Vec::new();
    for i in (0..run.len()).filter(|&i| is_unbiased(i)) {
        for j in (i + 1..run.len()).filter(|&j| is_unbiased(j)) {
            let b = |tile, c| estimate(&batches[j], tile, c);
            let verdict = worst(grid, &|tile, c| estimate(&batches[i], tile, c), &b);
            found.push(Agreement { a: run[i].0.to_owned(), b: run[j].0.to_owned(), verdict });
        }
    }
    if reference.facts.relmse.is_some() {
        let means = grid.means(&reference.rgb);
        let variances = grid.means(&reference.variance);
        let pixels = reference.rgb.len() as f64 / grid.len() as f64;
        // Pixels of a reference are nearly independent; what a filter's border shares makes the truth a little less sure.
        let truth = |tile: usize, c: usize| statistics::MeanEstimate {
            mean: means[tile][c],
            std_error: (variances[tile][c] / pixels).sqrt(),
            degrees_of_freedom: f64::INFINITY,
        };
        for (i, (label, _)) in run.iter().enumerate() {
            let verdict = worst(grid, &|tile, c| estimate(&batches[i], tile, c), &truth);
            found.push(Agreement { a: (*label).to_owned(), b: "reference".to_owned(), verdict });
        }
    }
    // All tests are one family.
    let tests: usize = found.iter().map(|a| a.verdict.tests).sum();
    let alpha = sidak(FALSE_ALARM, tests);
    found.iter_mut().for_each(|a| a.verdict.agrees = a.verdict.p_value >= alpha);
    found
}

type Estimates<'a> = &'a dyn Fn(usize, usize) -> statistics::MeanEstimate;

/// The least likely difference over all tiles and channels.
fn worst(grid: &Grid, a: Estimates<'_>, b: Estimates<'_>) -> Verdict {
    let mut verdict = Verdict {
        agrees: true,
        statistic: 0.0,
        p_value: 1.0,
        tests: grid.len() * 3,
        tile: [0; 2],
        difference: 0.0,
    };
    for tile in 0..grid.len() {
        for c in 0..3 {
            let (x, y) = (a(tile, c), b(tile, c));
            let test = x.compare(&y);
            if test.p_value < verdict.p_value {
                verdict.statistic = test.statistic.abs();
                verdict.p_value = test.p_value;
                verdict.tile = [tile % grid.tiles[0], tile / grid.tiles[0]];
                verdict.difference = x.mean / y.mean - 1.0;
            }
        }
    }
    verdict
}
