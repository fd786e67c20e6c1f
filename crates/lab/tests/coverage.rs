//! Do intervals of 95 % cover the truth in 93 to 97 of a hundred cases? Two thousand replicates, cheap ones.
//!
//! The standard error of a coverage of 95 % over 2000 replicates is 0.5 %: the bounds are four of them away.
#![allow(clippy::unwrap_used, reason = "set-up of tests: a failure is a failed test")]

use std::num::NonZero;
use std::path::Path;

use render::{Cancel, Job, Method, SceneOptions, Stop, Workers};
use scene::Scene;
use scene_desc::Sink;
use statistics::{Moments, student_two_sided_quantile};
use steradian_lab::comparison::{self, Budget, Entry, Plan, Truth};

const REPLICATES: u64 = 2000;

fn scene(workers: &Workers, side: u32) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/box.pbrt");
    let options = SceneOptions { resolution: Some([side, side]), ..SceneOptions::default() };
    let mut sink = Sink::default();
    render::open(&path, &options, workers, &mut sink).unwrap_or_else(|| panic!("{}", sink.render())).scene
}

fn one() -> Workers {
    Workers::new(NonZero::new(1)).unwrap()
}

fn occlusion() -> Entry {
    Entry::parse("ao:sampling=uniform:distance=0.8").unwrap()
}

fn assert_covered(covered: u64, of: u64, what: &str) {
    let share = covered as f64 / of as f64;
    println_if_asked(&format!("{what}: {:.2} % of {of}", 100.0 * share));
    assert!((0.93..=0.97).contains(&share), "{what}: {:.2} % of {of}", 100.0 * share);
}

/// With `--nocapture`, for who wants the figure.
#[expect(clippy::print_stdout, reason = "the figure is wanted in documents")]
fn println_if_asked(text: &str) {
    println!("{text}");
}

/// The mean of a pixel, plus and minus its standard error times Student's quantile.
#[test]
fn intervals_of_pixels_cover() {
    const SPP: u32 = 32;
    let workers = one();
    let scene = scene(&workers, 4);
    let shoot = |seed: u64| {
        let method = Method { seed: Some(seed), ..occlusion().method };
        let mut job = Job::new(&scene, &method).unwrap();
        job.render(&Stop::Passes(0..SPP), None, &workers, &Cancel::default(), &mut |_| {}).unwrap();
        job.into_film().develop()
    };
    let all: Vec<_> = (0..REPLICATES).map(shoot).collect();
    let quantile = student_two_sided_quantile(0.05, f64::from(SPP - 1));
    let (mut covered, mut of) = (0, 0);
    for pixel in 0..16 {
        // The mean of all replicates is the truth, to a fortieth of an interval.
        let truth = Moments::of(all.iter().map(|d| f64::from(d.mean[pixel][1]))).mean();
        for d in &all {
            let error = (f64::from(d.mean[pixel][1]) - truth).abs();
            covered += u64::from(error <= quantile * f64::from(d.variance[pixel][1]).sqrt());
            of += 1;
        }
    }
    assert_covered(covered, of, "pixels");
}

/// The error of a method with its interval, as comparisons tell it.
#[test]
fn intervals_of_errors_cover() {
    let workers = one();
    let scene = scene(&workers, 8);
    let reference = {
        let method = Method { seed: Some(u64::MAX), ..occlusion().method };
        let mut job = Job::new(&scene, &method).unwrap();
        job.render(&Stop::Passes(0..20_000), None, &workers, &Cancel::default(), &mut |_| {}).unwrap();
        job.into_film().develop()
    };
    let compare = |i: u64| {
        let plan = Plan {
            entries: vec![occlusion()],
            budget: Budget::Samples(4),
            seeds: (3 * i..3 * i + 3).collect(),
            truth: Truth::Picture {
                name: "truth".to_owned(),
                rgb: reference.mean.clone(),
                variance: Some(reference.variance.clone()),
            },
        };
        let compared = comparison::run(&plan, &scene, &workers, &Cancel::default(), &mut |_| {}).unwrap();
        let m = &compared.methods[0];
        (m.relmse, m.relmse_of_runs.clone())
    };
    let all: Vec<_> = (0..REPLICATES).map(compare).collect();
    let truth = Moments::of(all.iter().flat_map(|(_, runs)| runs.iter().map(|e| libm::log(*e)))).mean();
    let truth = libm::exp(truth);
    let covered = all.iter().filter(|(i, _)| i.low <= truth && truth <= i.high).count() as u64;
    assert_covered(covered, REPLICATES, "errors");
}
