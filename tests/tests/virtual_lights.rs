//! Virtual lights against closed forms; what clamping costs and compensation gives back; how cuts grow with the number
//! of lights.
//!
//! The lights of a pass are shared by its pixels, so that the independent samples are renders with different seeds.
#![allow(clippy::print_stdout, reason = "what was measured is read with `--nocapture`")]

use steradian_tests::worlds::radiosity_box;
use steradian_tests::{Eye, Family, Way, replicates};
use testkit::statistics::{Moments, log_log_slope};

const NONE: (&str, &str) = ("max_depth", "none");

const ALL: Way<'_> =
    Way { integrator: "many-light", settings: &[NONE, ("gather", "all"), ("light_paths", "16")] };
const UNBOUNDED: Way<'_> = Way {
    integrator: "many-light",
    settings: &[NONE, ("gather", "all"), ("light_paths", "16"), ("clamping", "0")],
};
const CUTS: Way<'_> =
    Way { integrator: "many-light", settings: &[NONE, ("light_paths", "64"), ("max_cut", "50")] };

const GREY: &str = "0.5 0.5 0.5";

/// At points of the radiosity box; without a bound away from corners.
#[test]
fn radiosity_of_a_closed_box() {
    let colours = ["0.725 0.71 0.68", "0.63 0.065 0.05", "0.14 0.45 0.091"];
    let [a, c] = [radiosity_box(GREY, GREY, GREY), radiosity_box(colours[0], colours[1], colours[2])];
    let points = [
        ("floor centre", [0.5, 0.5, 0.0], 0.055_956, [0.091_628, 0.081_320, 0.068_321]),
        ("floor (.1,.1)", [0.1, 0.1, 0.0], 0.038_863, [0.071_773, 0.053_631, 0.045_636]),
        ("left centre", [0.0, 0.5, 0.5], 0.056_374, [0.080_233, 0.008_213_6, 0.005_471_9]),
        ("ceiling (.1,.1)", [0.1, 0.1, 1.0], 0.020_260, [0.046_752, 0.027_708, 0.020_397]),
    ];
    let mut family = Family::default();
    for (name, p, case_a, case_c) in points {
        let eye = Eye::at([0.45, 0.55, 0.4], p, 12);
        let (scene_a, scene_c) = (eye.scene(&a), eye.scene(&c));
        for (label, way) in [("all", ALL), ("all, no bound", UNBOUNDED), ("cuts", CUTS)] {
            let found = replicates(&way, &scene_a, 2, 0..48);
            family.mean_within(format!("box A, {name}, many-light {label}"), &found[1], case_a, 1e-4);
        }
        let found = replicates(&ALL, &scene_c, 2, 0..48);
        for (channel, m) in ["R", "G", "B"].iter().zip(0..) {
            let name = format!("box C, {name} {channel}, many-light all");
            family.mean_within(name, &found[m], case_c[m], 1.5e-4);
        }
    }
    family.finish();
}

/// Furnace and integrating sphere: all surfaces reflect, some or all of them emit.
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
        let scene = Eye { window: 0.5, ..Eye::at([0.0; 3], to, 16) }.scene(world);
        for (label, way) in [("all", ALL), ("cuts", CUTS)] {
            let found = replicates(&way, &scene, 2, 0..32);
            family.mean(format!("{name}, many-light {label}"), &found[1], truth);
        }
    }
    family.finish();
}

/// Without compensation, what clamping takes away near a corner falls to nothing with the clamping distance. Both ways
/// have the same lights for the same seed, so that their difference shows it.
#[test]
fn the_bias_of_clamping_vanishes_and_compensation_takes_it_away() {
    const TRUTH: f64 = 0.038_863;
    let scene = Eye::at([0.45, 0.55, 0.4], [0.1, 0.1, 0.0], 4).scene(&radiosity_box(GREY, GREY, GREY));
    let means = |clamping: &str, compensation: &str| -> Vec<f64> {
        let settings = [
            NONE,
            ("gather", "all"),
            ("light_paths", "128"),
            ("clamping", clamping),
            ("compensation", compensation),
        ];
        let way = Way { integrator: "many-light", settings: &settings };
        (0..64).map(|seed| way.render(&scene, 0..2, seed, 2).0.film().develop().mean_rgb()[1]).collect()
    };
    let mut family = Family::default();
    let found: Vec<(f64, Moments)> = ["1.6", "0.8", "0.4"]
        .iter()
        .map(|c| {
            let (with, without) = (means(c, "true"), means(c, "false"));
            let compensated = Moments::of(with.iter().copied());
            family.mean_within(format!("compensated, {c}"), &compensated, TRUTH, 1e-4);
            (c.parse().unwrap(), Moments::of(with.iter().zip(&without).map(|(a, b)| a - b)))
        })
        .collect();
    let points: Vec<(f64, f64)> = found.iter().map(|(c, m)| (*c, m.mean())).collect();
    // Standard error of the fitted slope from those of the points' logarithms.
    let relative = found.iter().map(|(_, m)| m.std_error() / m.mean()).fold(0.0, f64::max);
    let (slope, error) = (log_log_slope(&points), relative / (2.0_f64.sqrt() * libm::log(2.0)));
    println!("lost by clamping: {points:?}, slope {slope:.2} ± {error:.2}");
    assert!(slope - 3.0 * error > 0.5, "slope {slope} ± {error}: {points:?}");
    assert!(points[0].1 > 0.1 * TRUTH, "clamping takes much away: {points:?}");
    family.finish();
}

/// Error of a pass falls as that of independent paths, or faster: their starts are stratified.
#[test]
fn the_error_of_a_pass_vanishes_with_the_number_of_lights() {
    let scene = Eye::at([0.45, 0.55, 0.4], [0.5, 0.5, 0.0], 4).scene(&radiosity_box(GREY, GREY, GREY));
    let error = |n: &str| {
        let settings = [NONE, ("gather", "all"), ("light_paths", n), ("clamping", "0")];
        replicates(&Way { integrator: "many-light", settings: &settings }, &scene, 1, 0..64)[1]
            .variance()
            .sqrt()
    };
    let points: Vec<(f64, f64)> =
        ["16", "64", "256", "1024"].iter().map(|n| (n.parse().unwrap(), error(n))).collect();
    // The log of a deviation over 64 renders has the standard error 1/√126.
    let (slope, se) = (log_log_slope(&points), 1.0 / 126.0_f64.sqrt() / (20.0_f64.sqrt() * libm::log(2.0)));
    println!("deviation of a pass by light paths {points:?}: slope {slope:.3} ± {se:.3}");
    assert!(slope < -0.5 + 4.0 * se, "{points:?}");
}

/// Rays for a camera path grow much more slowly than lights do.
#[test]
fn cuts_grow_sublinearly() {
    let eye = Eye { window: 0.9, ..Eye::at([0.5, 0.5, 0.5], [0.5, 0.5, 0.0], 16) };
    let scene = eye.scene(&radiosity_box(GREY, GREY, GREY));
    let rays = |n: &str, gather: &str| {
        let settings = [NONE, ("light_paths", n), ("gather", gather), ("compensation", "false")];
        let counters = Way { integrator: "many-light", settings: &settings }.render(&scene, 0..1, 1, 2).1;
        counters.rays as f64 / counters.camera_paths as f64
    };
    let points: Vec<(f64, f64)> =
        ["256", "1024", "4096", "16384"].iter().map(|n| (n.parse().unwrap(), rays(n, "lightcuts"))).collect();
    // Among the rays are those of the light paths themselves: some four a path, over 256 pixels.
    let own = |n: f64| 4.0 * n / 256.0;
    let cuts: Vec<(f64, f64)> = points.iter().map(|(n, r)| (*n, r - own(*n))).collect();
    let slope = log_log_slope(&cuts);
    println!(
        "rays of a cut by light paths {cuts:?}: slope {slope:.2}; all of 256: {:.0}",
        rays("256", "all")
    );
    assert!(slope < 0.5, "slope {slope}: {cuts:?}");
    assert!(rays("256", "all") > rays("256", "lightcuts"));
}

/// A floor under a field of n small lamps of one total power: rays for a camera path do not grow with the number of lamps, and the error
/// of a field of 4096 is less than twice that of 256, so that the cost of real lights is that of walking down their tree, k log n.
#[test]
fn real_lights_cost_the_same_rays_however_many_they_are() {
    let lamps = |n: u32| {
        let (side, half) = (n.isqrt(), 0.01);
        let mut world = "Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\nShape \"trianglemesh\" \"integer indices\" \
                         [0 1 2 0 2 3] \"point3 P\" [-3 -3 0 3 -3 0 3 3 0 -3 3 0]\n"
            .to_owned();
        world += &format!("AreaLightSource \"diffuse\" \"rgb L\" [{0} {0} {0}]\n", 20_000.0 / f64::from(n));
        for i in 0..n {
            let [x, y] = [i % side, i / side].map(|k| (f64::from(k) + 0.5) / f64::from(side) * 4.0 - 2.0);
            let (x0, x1, y0, y1) = (x - half, x + half, y - half, y + half);
            world += &format!(
                "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" \
                 [{x0} {y0} 1 {x0} {y1} 1 {x1} {y1} 1 {x1} {y0} 1]\n"
            );
        }
        world
    };
    let eye = Eye { window: 1.0, ..Eye::at([0.0, 0.0, 0.5], [0.0, 0.0, 0.0], 24) };
    let settings = [("max_depth", "1"), ("light_paths", "1"), ("light_samples", "8")];
    let way = Way { integrator: "many-light", settings: &settings };
    let found: Vec<(f64, f64, f64)> = [16, 256, 4096]
        .iter()
        .map(|&n| {
            let scene = eye.scene(&lamps(n));
            let (job, counters) = way.render(&scene, 0..8, 1, 2);
            let rays = counters.rays as f64 / counters.camera_paths as f64;
            (f64::from(n), rays, job.film().develop().relmse_estimate())
        })
        .collect();
    println!("lamps, rays for a camera path, relMSE: {found:?}");
    let rays: Vec<(f64, f64)> = found.iter().map(|f| (f.0, f.1)).collect();
    assert!(log_log_slope(&rays).abs() < 0.02, "{rays:?}");
    // The more there are, the more the picture is that of an even ceiling.
    assert!(found[2].2 < 2.0 * found[1].2, "{found:?}");
}
