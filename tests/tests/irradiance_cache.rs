//! The irradiance cache against closed forms: at points, where a record is an estimate without bias; over a floor,
//! where its interpolation error falls with the allowed error; and against its own traps.
//!
//! Pixels share records, so that the independent samples are renders with different seeds.
#![allow(clippy::print_stdout, reason = "what was measured is read with `--nocapture`")]

use scene::Scene;
use std::f64::consts::PI;
use steradian_tests::worlds::{corner_irradiance, radiosity_box};
use steradian_tests::{Eye, Family, Way, replicates};
use testkit::statistics::{Moments, log_log_slope};

const NONE: (&str, &str) = ("max_depth", "none");
const CACHE: Way<'_> = Way { integrator: "irradiance-cache", settings: &[NONE, ("rays", "256")] };

const GREY: &str = "0.5 0.5 0.5";

#[test]
fn radiosity_of_a_closed_box() {
    let colours = ["0.725 0.71 0.68", "0.63 0.065 0.05", "0.14 0.45 0.091"];
    let world = radiosity_box(colours[0], colours[1], colours[2]);
    let points = [
        ("floor centre", [0.5, 0.5, 0.0], [0.091_628, 0.081_320, 0.068_321]),
        ("floor (.1,.1)", [0.1, 0.1, 0.0], [0.071_773, 0.053_631, 0.045_636]),
        ("left centre", [0.0, 0.5, 0.5], [0.080_233, 0.008_213_6, 0.005_471_9]),
        ("back (.1,.1)", [0.1, 1.0, 0.1], [0.060_372, 0.042_346, 0.034_648]),
        ("ceiling (.1,.1)", [0.1, 0.1, 1.0], [0.046_752, 0.027_708, 0.020_397]),
    ];
    let mut family = Family::default();
    for (name, p, truth) in points {
        let scene = Eye::at([0.45, 0.55, 0.4], p, 8).scene(&world);
        let found = replicates(&CACHE, &scene, 4, 0..48);
        for (channel, m) in ["R", "G", "B"].iter().zip(0..) {
            let name = format!("box C, {name} {channel}, irradiance-cache");
            family.mean_within(name, &found[m], truth[m], 1.5e-4);
        }
    }
    family.finish();
}

/// Furnace, integrating sphere, planes lit from one side only: emission is no part of a record.
#[test]
fn furnaces_and_the_integrating_sphere() {
    let grey = "Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\n";
    let emitting = "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool twosided\" true\n";
    let furnace = format!("{grey}{emitting}Shape \"sphere\"\n");
    let half =
        format!("{grey}Shape \"sphere\" \"float zmax\" [0]\n{emitting}Shape \"sphere\" \"float zmin\" [0]\n");
    let mut family = Family::default();
    for (name, world, to, truth) in [
        ("furnace", &furnace, [0.6, 0.0, 0.8], 2.0),
        ("integrating sphere, lamp", &half, [0.6, 0.0, 0.8], 1.5),
        ("integrating sphere, rest", &half, [0.6, 0.0, -0.8], 0.5),
    ] {
        // E is the same everywhere on a sphere: interpolation has no error, on a window of any size.
        let scene = Eye { window: 0.5, ..Eye::at([0.0; 3], to, 12) }.scene(world);
        let found = replicates(&CACHE, &scene, 2, 0..32);
        family.mean(format!("{name}, irradiance-cache"), &found[1], truth);
    }
    // In wavelengths, from bins.
    let scene = Eye { window: 0.5, ..Eye::at([0.0; 3], [0.6, 0.0, -0.8], 12) }.spectral_scene(&half);
    let found = replicates(&CACHE, &scene, 2, 0..32);
    for (channel, m) in ["R", "G", "B"].iter().zip(&found) {
        family.mean_within(format!("spectral sphere, rest {channel}, irradiance-cache"), m, 0.5, 1e-3);
    }
    family.finish();
}

/// A square ceiling of 2 x 2 at height 1, lit by a slanted distant light from below, sends an even light to a floor.
fn lit_ceiling(side: u32) -> Scene {
    let sun = "LightSource \"distant\" \"rgb L\" [1 1 1] \"point3 from\" [-10 0 -3] \"point3 to\" [0 0 0]\n";
    let grey = "Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\n";
    let square = |half: f64, z: f64| {
        format!(
            "Shape \"trianglemesh\" \"integer indices\" [0 1 2  0 2 3] \"point3 P\"\n\
             [-{half} -{half} {z}  {half} -{half} {z}  {half} {half} {z}  -{half} {half} {z}]\n"
        )
    };
    let world = format!("{sun}{grey}{}{}", square(0.8, 0.0), square(1.0, 1.0));
    Eye { window: 1.0, ..Eye::at([0.0, 0.0, 0.9], [0.0; 3], side) }.scene(&world)
}

/// Radiance of that floor at (x, y).
fn truth(x: f64, y: f64) -> f64 {
    let ceiling = 0.5 / PI * 3.0 / 109.0_f64.sqrt();
    let e: f64 = [-1.0, 1.0]
        .iter()
        .flat_map(|a| [-1.0, 1.0].map(|b| corner_irradiance(1.0 + a * x, 1.0 + b * y)))
        .sum();
    0.5 / PI * ceiling * e
}

/// Relative root mean square error over the floor.
fn floor_error(scene: &Scene, side: u32, settings: &[(&str, &str)], seed: u64) -> f64 {
    let image =
        Way { integrator: "irradiance-cache", settings }.render(scene, 0..4, seed, 2).0.film().develop();
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(side) - 0.5;
    let errors = image.mean.iter().zip(0..).map(|(p, i)| {
        // The floor is symmetrical: it does not matter how the film lies.
        let t = truth(at(i % side), at(i / side));
        (f64::from(p[1]) / t - 1.0).powi(2)
    });
    (errors.sum::<f64>() / f64::from(side * side)).sqrt()
}

/// The interpolation error falls with the allowed error; gradients make it smaller.
#[test]
fn the_interpolation_error_vanishes_with_the_allowed_error() {
    const SIDE: u32 = 24;
    let scene = lit_ceiling(SIDE);
    let error = |gradients: &str, error: &str| {
        let settings = [
            ("max_depth", "2"),
            ("error", error),
            ("gradients", gradients),
            ("rays", "4096"),
            ("min_spacing", "0"),
            ("max_spacing", "1000"),
        ];
        Moments::of((0..6).map(|seed| libm::log(floor_error(&scene, SIDE, &settings, seed))))
    };
    for (gradients, least) in [("false", 0.6), ("true", 0.6)] {
        let allowed = ["0.4", "0.2", "0.1"];
        let found = allowed.map(|a| error(gradients, a));
        let points: Vec<(f64, f64)> =
            allowed.iter().zip(&found).map(|(a, m)| (a.parse().unwrap(), libm::exp(m.mean()))).collect();
        let worst = found.iter().map(Moments::std_error).fold(0.0, f64::max);
        let (slope, se) = (log_log_slope(&points), worst / (2.0_f64.sqrt() * libm::log(2.0)));
        println!("gradients {gradients}: error by allowed error {points:?}, slope {slope:.2} ± {se:.2}");
        assert!(slope - 3.0 * se > least, "gradients {gradients}: slope {slope} ± {se}, {points:?}");
    }
    let (without, with) = (error("false", "0.1"), error("true", "0.1"));
    println!("gradients take log error from {:.2} to {:.2}", without.mean(), with.mean());
    assert!(with.mean() < without.mean() - libm::log(1.5));
}

/// A full cache is no error: the rest is traced, and a warning says so.
#[test]
fn a_full_cache_leaves_the_rest_to_walks() {
    let scene = Eye { window: 0.9, ..Eye::at([0.5, 0.5, 0.5], [0.5, 0.5, 0.0], 12) }
        .scene(&radiosity_box(GREY, GREY, GREY));
    let tiny =
        Way { integrator: "irradiance-cache", settings: &[NONE, ("cache_memory", "0"), ("rays", "64")] };
    let path = Way { integrator: "path", settings: &[NONE] };
    let mut family = Family::default();
    let truth = replicates(&path, &scene, 32, 0..16)[1];
    let found = replicates(&tiny, &scene, 4, 0..32)[1];
    family.mean_within("no room for records", &found, truth.mean(), truth.std_error() / truth.mean());
    family.finish();
}
