//! Verdicts: methods that are right agree, and whatever is wrong with one of them flips it.
//!
//! The planted mistake `verdict-no-cosine` of `cargo xtask mutants` is found by the first test alone.
#![allow(clippy::unwrap_used, reason = "set-up of tests: a failure is a failed test")]

use std::num::NonZero;
use std::path::Path;

use render::{Cancel, SceneOptions, Workers};
use scene::Scene;
use scene_desc::Sink;
use steradian_lab::comparison::{self, Budget, Comparison, Entry, Plan, Truth};

fn scene(workers: &Workers) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/box.pbrt");
    let options = SceneOptions { resolution: Some([32, 32]), ..SceneOptions::default() };
    let mut sink = Sink::default();
    render::open(&path, &options, workers, &mut sink).unwrap_or_else(|| panic!("{}", sink.render())).scene
}

/// Means and variances of pixels.
type Known = (Vec<[f32; 3]>, Vec<[f32; 3]>);

fn compare(methods: &[&str], truth: Option<Known>) -> Comparison {
    let workers = Workers::new(NonZero::new(2)).unwrap();
    let scene = scene(&workers);
    let render = Truth::Render {
        method: Entry::parse("path:max_depth=3").unwrap().method,
        relmse: 1e-4,
        time: std::time::Duration::from_secs(20),
        cache: None,
    };
    let truth = match truth {
        Some((rgb, variance)) => Truth::Picture { name: "truth".to_owned(), rgb, variance: Some(variance) },
        None => render,
    };
    let plan = Plan {
        entries: methods.iter().map(|m| Entry::parse(m).unwrap()).collect(),
        budget: Budget::Samples(16),
        seeds: (0..4).collect(),
        truth,
    };
    comparison::run(&plan, &scene, &workers, &Cancel::default(), &mut |_| {}).unwrap()
}

fn agree(c: &Comparison, a: &str, b: &str) -> bool {
    let found = c.agreements.iter().find(|x| x.a == a && x.b == b);
    found.unwrap_or_else(|| panic!("{a} and {b} were not compared")).verdict.agrees
}

#[test]
fn methods_that_are_right_agree() {
    let c = compare(&["path:max_depth=3", "bdpt:max_depth=3"], None);
    for a in &c.agreements {
        assert!(a.verdict.agrees, "{} and {}: {:?}", a.a, a.b, a.verdict);
    }
}

#[test]
fn a_bounce_that_is_missing_flips_the_verdict() {
    let c = compare(&["path:max_depth=3", "path:max_depth=2"], None);
    assert!(!agree(&c, "path:max_depth=3", "path:max_depth=2"));
    assert!(!agree(&c, "path:max_depth=2", "reference") && agree(&c, "path:max_depth=3", "reference"));
}

#[test]
fn light_that_is_wrong_in_one_corner_flips_the_verdict() {
    let right = compare(&["path:max_depth=3"], None);
    assert!(agree(&right, "path:max_depth=3", "reference"));
    let (mut rgb, variance) = (right.truth.rgb.clone(), right.truth.variance.clone());
    // A fifth more light in a sixteenth of the picture: one tile of sixteen.
    for (i, c) in rgb.iter_mut().enumerate() {
        if i % 32 >= 24 && i / 32 >= 24 {
            *c = c.map(|x| 1.2 * x);
        }
    }
    let wrong = compare(&["path:max_depth=3"], Some((rgb, variance)));
    let v = &wrong.agreements[0].verdict;
    assert!(!v.agrees && v.tile == [3, 3], "{v:?}");
}
