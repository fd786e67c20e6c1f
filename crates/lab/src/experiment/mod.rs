//! The theory, executable: experiments that state what they expect, check it statistically, and say pass or fail.
//!
//! An experiment is a small scene, methods at equal samples, and claims. It is run as a comparison; claims are tests on its
//! figures, all of one experiment sharing a false-alarm rate of 1 %. `docs/lecture.md` tells them in order.

mod catalogue;
mod claim;
mod strip;

use std::path::Path;
use std::time::Duration;

use render::{Cancel, SceneOptions, Workers};
use scene_desc::Sink;
use serde::Serialize;

pub use catalogue::CATALOGUE;
pub use claim::{Claim, Finding, Per};
pub use strip::strip;

use crate::comparison::{self, Budget, Comparison, Entry, Plan, Step, Truth};

/// An experiment.
#[derive(Clone, Copy, Debug)]
pub struct Experiment {
    /// What it is called on the command line.
    pub name: &'static str,
    /// A title.
    pub title: &'static str,
    /// What the theory says, in a paragraph.
    pub theory: &'static str,
    /// The scene, as a pbrt file.
    pub scene: &'static str,
    /// Methods, as [`Entry::parse`] reads them, each with a label.
    pub methods: &'static [(&'static str, &'static str)],
    /// Passes of each run.
    pub spp: u32,
    /// Runs of each method that its claims need, where the effort does not say.
    pub seeds: u32,
    /// What makes the reference.
    pub reference: &'static str,
    /// What is expected.
    pub claims: &'static [Claim],
}

/// What came out of an experiment.
#[derive(Debug, Serialize)]
pub struct Outcome {
    /// Which.
    pub name: &'static str,
    /// Does every claim hold?
    pub passed: bool,
    /// Claim by claim.
    pub findings: Vec<Finding>,
    /// All figures.
    pub comparison: Comparison,
}

/// How much an experiment may cost.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Runs of each method; `None`: as many as the experiment's claims need.
    pub seeds: Option<u32>,
    /// Passes are multiplied with this.
    pub scale: f64,
    /// The longest time for a reference.
    pub reference_time: Duration,
}

impl Default for Effort {
    fn default() -> Self {
        Self { seeds: None, scale: 1.0, reference_time: Duration::from_secs(20) }
    }
}

impl Experiment {
    /// An experiment by name.
    #[must_use]
    pub fn find(name: &str) -> Option<&'static Self> {
        CATALOGUE.iter().find(|e| e.name == name)
    }

    /// Runs it. `cache` keeps references.
    ///
    /// # Errors
    /// A render fails, or it was interrupted before there was anything.
    pub fn run(
        &self,
        effort: Effort,
        cache: Option<&Path>,
        workers: &Workers,
        cancel: &Cancel,
        on_step: &mut dyn FnMut(Step<'_>),
    ) -> Result<Outcome, comparison::Error> {
        let scene = self.compile(workers)?;
        let entry = |label: &str, text: &str| {
            Entry::parse(text)
                .map(|e| Entry { label: label.to_owned(), ..e })
                .map_err(comparison::Error::Plan)
        };
        let entries =
            self.methods.iter().map(|(label, text)| entry(label, text)).collect::<Result<_, _>>()?;
        let plan = Plan {
            entries,
            budget: Budget::Samples((f64::from(self.spp) * effort.scale).round().max(4.0) as u32),
            seeds: (0..u64::from(effort.seeds.unwrap_or(self.seeds))).collect(),
            truth: Truth::Render {
                method: entry("reference", self.reference)?.method,
                relmse: 2e-5,
                time: effort.reference_time,
                cache: cache.map(Path::to_path_buf),
            },
        };
        let comparison = comparison::run(&plan, &scene, workers, cancel, on_step)?;
        let findings: Vec<Finding> =
            self.claims.iter().map(|c| c.check(&comparison, self.claims.len())).collect();
        Ok(Outcome { name: self.name, passed: findings.iter().all(|f| f.holds), findings, comparison })
    }

    fn compile(&self, workers: &Workers) -> Result<scene::Scene, comparison::Error> {
        let broken = |what: String| comparison::Error::Plan(format!("the scene of {}: {what}", self.name));
        let folder = tempfile::tempdir().map_err(|e| broken(e.to_string()))?;
        let path = folder.path().join(format!("{}.pbrt", self.name));
        std::fs::write(&path, self.scene).map_err(|e| broken(e.to_string()))?;
        let mut sink = Sink::default();
        let opened = render::open(&path, &SceneOptions::default(), workers, &mut sink);
        opened.map(|o| o.scene).ok_or_else(|| broken(sink.render()))
    }
}

#[cfg(test)]
mod tests {
    use std::num::NonZero;

    use super::*;

    #[test]
    fn every_experiment_can_be_set_up() {
        let workers = Workers::new(NonZero::new(1)).unwrap();
        for e in CATALOGUE {
            let scene = e.compile(&workers).unwrap_or_else(|err| panic!("{err}"));
            let labels: Vec<_> = e.methods.iter().map(|m| m.0).collect();
            for text in e.methods.iter().map(|m| m.1).chain([e.reference]) {
                let method = Entry::parse(text).unwrap().method;
                if let Err(err) = render::Job::new(&scene, &method) {
                    panic!("{}: {text}: {err}", e.name);
                }
            }
            for label in e.claims.iter().flat_map(Claim::labels) {
                assert!(label == "reference" || labels.contains(&label), "{}: {label}", e.name);
            }
            assert!(!e.claims.is_empty(), "{} claims nothing", e.name);
            assert_eq!(CATALOGUE.iter().filter(|o| o.name == e.name).count(), 1);
        }
    }

    #[test]
    fn a_cheap_experiment_passes_and_a_false_claim_fails() {
        let workers = Workers::new(NonZero::new(2)).unwrap();
        let effort = Effort { seeds: Some(6), scale: 0.25, reference_time: Duration::from_secs(3) };
        let run = |e: &Experiment| e.run(effort, None, &workers, &Cancel::default(), &mut |_| {}).unwrap();
        let real = Experiment::find("ambient-occlusion").unwrap();
        let outcome = run(real);
        assert!(outcome.passed, "{:#?}", outcome.findings);
        let [(a, _), (b, _), ..] = real.methods else { panic!("two methods") };
        // The wrong way round.
        let claims: &'static [Claim] = Box::leak(Box::new([
            Claim::Lower { better: a, worse: b, factor: 1.0, per: Per::Sample },
            Claim::Lower { better: b, worse: a, factor: 1.0, per: Per::Sample },
        ]));
        let outcome = run(&Experiment { claims, ..*real });
        assert!(!outcome.passed && outcome.findings.iter().filter(|f| f.holds).count() <= 1);
    }
}
