//! Proofs: a harness that renders small scenes through the whole pipeline (file, compiler, integrator, film) and
//! compares what comes out with closed forms, by tests whose false-alarm rate is known.
//!
//! The trick of most proofs: a parallel camera whose window is 10⁻⁴ wide, so that all pixels of a film see one
//! point. With the independent sampler and one pass, every pixel is then one independent sample of the estimator:
//! its mean *and its variance* can be tested, and no replicates are needed.
//!
//! A test collects its checks in a [`Family`], whose significance is shared by the rule of [Sidak1967].
#![allow(clippy::print_stdout, reason = "what was measured is read with `--nocapture`")]

pub mod worlds;

use std::fmt::Write;
use std::num::NonZero;
use std::ops::Range;
use std::path::Path;

use film::{Developed, Film};
use integrators::Counters;
use render::{Cancel, Job, Method, SceneOptions, Stop, Workers};
use scene::Scene;
use scene_desc::Sink;
use testkit::statistics::{
    Moments, TestResult, normal_two_sided_quantile, sidak, t_test, variance_test, welch_test,
};

/// Chance that a family fails although all its hypotheses hold. Seeds are fixed: it fails always or never.
pub const SIGNIFICANCE: f64 = 1e-3;

/// Radiance is computed in single precision, over a few dozen operations.
pub const ROUNDING: f64 = 2e-6;

/// A camera that sees one point.
#[derive(Clone, Copy, Debug)]
pub struct Eye {
    /// Where rays start.
    pub from: [f64; 3],
    /// What they see.
    pub to: [f64; 3],
    /// Width of the window, around the line from `from` to `to`.
    pub window: f64,
    /// Pixels along a side.
    pub side: u32,
}

impl Eye {
    /// Sees the point `to` from `from`, in `side` × `side` pixels.
    #[must_use]
    pub fn at(from: [f64; 3], to: [f64; 3], side: u32) -> Self {
        Self { from, to, window: 1e-4, side }
    }

    /// Sees the origin of the floor z = 0 from just above it.
    #[must_use]
    pub fn on_floor(side: u32) -> Self {
        Self::at([0.0, 0.0, 0.05], [0.0, 0.0, 0.0], side)
    }

    /// The head of a pbrt file, up to `WorldBegin`.
    #[must_use]
    pub fn head(&self) -> String {
        let Self { from: [x, y, z], to: [tx, ty, tz], window, side } = *self;
        let up = if (x - tx).hypot(y - ty) < 1e-6 { "0 1 0" } else { "0 0 1" };
        let w = 0.5 * window;
        format!(
            "Film \"rgb\" \"integer xresolution\" [{side}] \"integer yresolution\" [{side}]\n\
             PixelFilter \"box\" \"float xradius\" [0.5] \"float yradius\" [0.5]\n\
             Sampler \"independent\" \"integer pixelsamples\" [1]\n\
             LookAt {x} {y} {z}  {tx} {ty} {tz}  {up}\n\
             Camera \"orthographic\" \"float screenwindow\" [{} {w} {} {w}]\nWorldBegin\n",
            -w, -w
        )
    }

    /// The compiled scene of this eye and a world.
    ///
    /// # Panics
    /// The text is no scene.
    #[must_use]
    pub fn scene(&self, world: &str) -> Scene {
        compile(&(self.head() + world), &SceneOptions::default())
    }

    /// The same with four wavelengths in place of R, G, B.
    ///
    /// # Panics
    /// The text is no scene.
    #[must_use]
    pub fn spectral_scene(&self, world: &str) -> Scene {
        compile(&(self.head() + world), &SceneOptions { spectral: true, ..SceneOptions::default() })
    }
}

/// Threads for a test.
///
/// # Panics
/// The system gives none.
#[must_use]
pub fn workers(n: usize) -> Workers {
    Workers::new(NonZero::new(n)).unwrap_or_else(|e| panic!("{n} threads: {e}"))
}

/// Compiles the text of a pbrt file.
///
/// # Panics
/// The text is no scene.
#[must_use]
pub fn compile(text: &str, options: &SceneOptions) -> Scene {
    let file = tempfile::Builder::new().suffix(".pbrt").tempfile().and_then(|f| {
        std::fs::write(f.path(), text)?;
        Ok(f)
    });
    let file = file.unwrap_or_else(|e| panic!("a temporary file: {e}"));
    open(file.path(), options)
}

/// Loads and compiles a file.
///
/// # Panics
/// The file is no scene.
#[must_use]
pub fn open(path: &Path, options: &SceneOptions) -> Scene {
    let mut sink = Sink::default();
    match render::open(path, options, &workers(2), &mut sink) {
        Some(opened) => opened.scene,
        None => panic!("{}:\n{}", path.display(), sink.render()),
    }
}

/// An integrator and its parameters.
#[derive(Clone, Copy, Debug)]
pub struct Way<'a> {
    /// Its name.
    pub integrator: &'a str,
    /// Names and values of parameters.
    pub settings: &'a [(&'a str, &'a str)],
}

impl Way<'_> {
    /// For messages.
    #[must_use]
    pub fn name(&self) -> String {
        let settings: Vec<_> = self.settings.iter().map(|(k, v)| format!("{k}={v}")).collect();
        format!("{} {}", self.integrator, settings.join(" ")).trim_end().to_owned()
    }

    /// A job that has rendered nothing yet.
    ///
    /// # Panics
    /// The parameters are wrong.
    #[must_use]
    pub fn job<'s>(&self, scene: &'s Scene, seed: u64) -> Job<'s> {
        let settings = self.settings.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
        let method = Method { integrator: Some(self.integrator.to_owned()), settings, seed: Some(seed) };
        Job::new(scene, &method).unwrap_or_else(|e| panic!("{}: {e}", self.name()))
    }

    /// Renders passes of a scene: the job with its film, and what was done.
    ///
    /// # Panics
    /// The parameters are wrong, or a sample was bad.
    #[must_use]
    pub fn render<'s>(
        &self,
        scene: &'s Scene,
        passes: Range<u32>,
        seed: u64,
        threads: usize,
    ) -> (Job<'s>, Counters) {
        let mut job = self.job(scene, seed);
        let outcome =
            job.render(&Stop::Passes(passes), None, &workers(threads), &Cancel::default(), &mut |_| {});
        let outcome = outcome.unwrap_or_else(|e| panic!("{}: {e}", self.name()));
        assert_eq!(job.film().bad_samples().count(), 0, "{}: bad samples", self.name());
        (job, outcome.report.counters)
    }

    /// Moments of single samples in R, G, B: one pass, each pixel a sample.
    #[must_use]
    pub fn rgb_moments(&self, scene: &Scene, seed: u64) -> [Moments; 3] {
        let image = self.render(scene, 0..1, seed, 2).0.film().develop();
        channel_moments(&image)
    }

    /// The same in G alone.
    #[must_use]
    pub fn moments(&self, scene: &Scene, seed: u64) -> Moments {
        self.rgb_moments(scene, seed)[1]
    }
}

/// Moments over pixels.
#[must_use]
pub fn channel_moments(image: &Developed) -> [Moments; 3] {
    [0, 1, 2].map(|c| Moments::of(image.mean.iter().map(|p| f64::from(p[c]))))
}

/// Moments of the image's mean over replicates with different seeds: for samplers whose pixels depend on each other.
#[must_use]
pub fn replicates(way: &Way<'_>, scene: &Scene, spp: u32, seeds: Range<u64>) -> [Moments; 3] {
    let mut of = [Moments::default(); 3];
    for seed in seeds {
        let film = way.render(scene, 0..spp, seed, 2).0.film().develop().mean_rgb();
        (0..3).for_each(|c| of[c].push(film[c]));
    }
    of
}

/// The bytes of a film's partial file.
///
/// # Panics
/// The film has open passes.
#[must_use]
pub fn bytes(film: &Film) -> Vec<u8> {
    film.to_bytes().unwrap_or_else(|e| panic!("{e}"))
}

/// Checks that share one false-alarm rate.
#[derive(Debug, Default)]
pub struct Family {
    checks: Vec<(String, f64, f64, TestResult)>,
    wrong: Vec<String>,
}

impl Family {
    /// Is the mean the `truth`? `uncertainty` is relative: digits of a table, or single precision.
    pub fn mean_within(&mut self, name: impl Into<String>, found: &Moments, truth: f64, uncertainty: f64) {
        let se = found.std_error().hypot(uncertainty * truth);
        let t = (found.mean() - truth) / se;
        let exact = t_test(found, truth);
        let p_value = testkit::statistics::student_two_sided(t, (found.n() - 1) as f64);
        let result =
            if exact.statistic.abs() < t.abs() { exact } else { TestResult { statistic: t, p_value } };
        self.checks.push((name.into(), found.mean(), truth, result));
    }

    /// Are both means the same?
    pub fn same(&mut self, name: impl Into<String>, a: &Moments, b: &Moments) {
        self.checks.push((name.into(), a.mean(), b.mean(), welch_test(a, b)));
    }

    /// Is the mean the `truth`, up to single precision?
    pub fn mean(&mut self, name: impl Into<String>, found: &Moments, truth: f64) {
        self.mean_within(name, found, truth, ROUNDING);
    }

    /// Is the variance of one sample the `truth`?
    pub fn variance(&mut self, name: impl Into<String>, found: &Moments, truth: f64) {
        let name = format!("{}, variance", name.into());
        self.checks.push((name, found.variance(), truth, variance_test(found, truth)));
    }

    /// An estimator without variance: every sample is the `truth` to within single precision (10⁻⁵ after many
    /// bounces).
    pub fn exact(&mut self, name: impl Into<String>, found: &Moments, truth: f64) {
        let (name, spread) = (name.into(), found.variance().sqrt());
        if (found.mean() - truth).abs() > 1e-5 * truth || spread > 1e-5 * truth {
            self.wrong.push(format!("{name}: {} ± {spread:e}, not exactly {truth}", found.mean()));
        }
        println!("| {name} | {truth:.7} | {:.7} | exact |", found.mean());
    }

    /// Something that must hold.
    pub fn holds(&mut self, name: impl Into<String>, holds: bool) {
        if !holds {
            self.wrong.push(name.into());
        }
    }

    /// Prints all checks and fails if one is too unlikely.
    ///
    /// # Panics
    /// One is.
    pub fn finish(mut self) {
        let alpha = sidak(SIGNIFICANCE, self.checks.len());
        let bound = normal_two_sided_quantile(alpha);
        let mut table = String::new();
        for (name, found, truth, r) in &self.checks {
            let line = format!("| {name} | {truth:.7} | {found:.7} | {:+.2} |", r.statistic);
            let _ = writeln!(table, "{line}");
            if !r.is_consistent(alpha) {
                self.wrong.push(line);
            }
        }
        println!("{table}{} checks, bound |z| = {bound:.2}", self.checks.len());
        assert!(self.wrong.is_empty(), "disagreements:\n{}", self.wrong.join("\n"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(mean: f64) -> Moments {
        Moments::of((0..1000).map(|i| mean + f64::from(i % 10) - 4.5))
    }

    #[test]
    fn a_family_keeps_the_truth_and_refuses_what_is_not() {
        let mut family = Family::default();
        family.mean("m", &noise(2.0), 2.0);
        family.variance("v", &noise(2.0), 8.25);
        family.finish();
        let refused = std::panic::catch_unwind(|| {
            let mut family = Family::default();
            family.mean("m", &noise(3.0), 2.0);
            family.finish();
        });
        assert!(refused.is_err());
    }

    #[test]
    fn single_precision_is_no_excuse_for_noise() {
        let mut family = Family::default();
        family.exact("noisy", &noise(1.0), 1.0);
        assert_eq!(family.wrong.len(), 1);
    }

    #[test]
    fn an_eye_sees_its_point() {
        let scene = Eye::on_floor(4).scene(
            "AreaLightSource \"diffuse\" \"rgb L\" [3 2 1] \"bool twosided\" true\n\
             Shape \"disk\" \"float radius\" [1e-3]",
        );
        let way = Way { integrator: "path", settings: &[] };
        let means = way.rgb_moments(&scene, 1).map(|m| m.mean());
        assert!((0..3).all(|c| (means[c] - [3.0, 2.0, 1.0][c]).abs() < 1e-6), "{means:?}");
    }
}
