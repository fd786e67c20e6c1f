//! How fast errors fall, and that choices of sampling are ordered as the theory says.
#![allow(clippy::print_stdout, reason = "what was measured is read with `--nocapture`")]

use std::f64::consts::PI;

use render::SceneOptions;
use scene::Scene;
use steradian_tests::{Eye, Way, compile};
use testkit::statistics::log_log_slope;

const FLOOR: &str = "Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\n\
    Shape \"trianglemesh\" \"point3 P\" [-9 -9 0  9 -9 0  9 9 0  -9 9 0] \"integer indices\" [0 1 2  0 2 3]\n\
    Material \"diffuse\" \"rgb reflectance\" [0 0 0]\n";

/// A square lamp of 2 x 2 at height 1.
const LARGE: &str = "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool twosided\" true\n\
    Shape \"bilinearmesh\" \"point3 P\" [-1 -1 1  1 -1 1  -1 1 1  1 1 1]\n";

/// Its E ρ / π.
const LARGE_TRUTH: f64 = 0.5 * 1.740_839_5 / PI;

/// A lamp of 0.1 x 0.1.
const SMALL: &str = "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool twosided\" true\n\
    Shape \"bilinearmesh\" \"point3 P\" [-.05 -.05 1  .05 -.05 1  -.05 .05 1  .05 .05 1]\n";

const DIRECT_LIGHT: Way<'_> = Way { integrator: "direct", settings: &[("sampling", "light")] };

/// Root of the mean square error over pixels that all see one point, after `spp` passes.
fn rmse(way: &Way<'_>, scene: &Scene, spp: u32, seed: u64, truth: f64) -> f64 {
    let image = way.render(scene, 0..spp, seed, 2).0.film().develop();
    let square = |p: &[f32; 3]| (f64::from(p[1]) - truth).powi(2);
    (image.mean.iter().map(square).sum::<f64>() / image.mean.len() as f64).sqrt()
}

/// Standard error of a fitted slope whose ordinates each have the standard error `each`.
fn slope_error(points: &[(f64, f64)], each: f64) -> f64 {
    let logs: Vec<f64> = points.iter().map(|p| libm::log(p.0)).collect();
    let mean = logs.iter().sum::<f64>() / logs.len() as f64;
    each / logs.iter().map(|l| (l - mean).powi(2)).sum::<f64>().sqrt()
}

/// Error falls as N^-1/2: the log of an RMSE over n pixels has the standard error √((κ − 1)/4n), with a kurtosis κ
/// of the pixels' errors that is 3 where means are normal and below 3 + 1 here from the first sample on.
#[test]
fn independent_samples_converge_with_the_root() {
    let side = 40;
    let each = (3.0 / (4.0 * f64::from(side * side))).sqrt();
    let cases = [
        ("direct light", DIRECT_LIGHT, LARGE),
        ("direct cosine", Way { integrator: "direct", settings: &[("sampling", "cosine")] }, LARGE),
        ("direct mis", Way { integrator: "direct", settings: &[] }, LARGE),
        ("path", Way { integrator: "path", settings: &[] }, LARGE),
    ];
    for (name, way, lamp) in cases {
        let scene = Eye::on_floor(side).scene(&(FLOOR.to_owned() + lamp));
        let points: Vec<(f64, f64)> = [1, 4, 16, 64, 256]
            .into_iter()
            .map(|n| (f64::from(n), rmse(&way, &scene, n, u64::from(n), LARGE_TRUTH)))
            .collect();
        let (slope, error) = (log_log_slope(&points), slope_error(&points, each));
        println!("{name}: slope {slope:.4} ± {error:.4}");
        assert!((slope + 0.5).abs() < 4.0 * error, "{name}: slope {slope} ± {error}, {points:?}");
    }
}

/// The same scene with another sampler.
fn sampled(sampler: &str, side: u32) -> Scene {
    let text = Eye::on_floor(side).head() + FLOOR + LARGE;
    let settings = vec![("sampler".to_owned(), sampler.to_owned())];
    compile(&text, &SceneOptions { settings, ..SceneOptions::default() })
}

/// On a smooth integrand a scrambled Sobol sequence is far better than independent numbers, and gets better faster.
/// Its pixels may share a randomisation, so that the error is taken over seeds too.
#[test]
fn sobol_is_better_than_independent() {
    let error = |sampler: &str, spp: u32| {
        let scene = sampled(sampler, 4);
        let squares = (0..24).map(|seed| rmse(&DIRECT_LIGHT, &scene, spp, seed, LARGE_TRUTH).powi(2));
        (squares.sum::<f64>() / 24.0).sqrt()
    };
    let spps = [4, 16, 64, 256];
    let sobol: Vec<(f64, f64)> = spps.iter().map(|&n| (f64::from(n), error("sobol", n))).collect();
    let independent = error("independent", 64);
    let slope = log_log_slope(&sobol);
    println!("Sobol {sobol:?}, slope {slope:.3}; independent at 64: {independent:e}");
    assert!(sobol[2].1 < 0.25 * independent, "{sobol:?} {independent}");
    assert!(slope < -1.0, "slope {slope}: {sobol:?}");
}

/// Variance of one sample.
fn variance(way: &Way<'_>, world: &str, side: u32) -> f64 {
    way.moments(&Eye::on_floor(side).scene(&(FLOOR.to_owned() + world)), 5).variance()
}

fn direct<'a>(settings: &'a [(&'a str, &'a str)]) -> Way<'a> {
    Way { integrator: "direct", settings }
}

#[test]
fn uniform_is_worse_than_cosine_in_the_open() {
    let sky = "LightSource \"infinite\" \"rgb L\" [1 1 1]";
    for world in [sky, LARGE] {
        let uniform = variance(&direct(&[("sampling", "uniform")]), world, 96);
        let cosine = variance(&direct(&[("sampling", "cosine")]), world, 96);
        println!("uniform {uniform:e}, cosine {cosine:e}");
        assert!(uniform > 1.05 * cosine, "uniform {uniform}, cosine {cosine}");
    }
}

#[test]
fn light_sampling_is_better_than_directions_for_a_small_lamp() {
    let light = variance(&DIRECT_LIGHT, SMALL, 96);
    for sampling in ["uniform", "cosine", "bsdf"] {
        let other = variance(&direct(&[("sampling", sampling)]), SMALL, 96);
        println!("light {light:e}, {sampling} {other:e}");
        assert!(100.0 * light < other, "light {light}, {sampling} {other}");
    }
}

/// Where a lamp is large and the floor a rough mirror, the BSDF is the better choice; the combination is near the
/// better one in both corners [Veach1997, sec. 9.2].
#[test]
fn mis_is_never_much_worse_than_the_best() {
    let metal = "Material \"conductor\" \"rgb reflectance\" [0.8 0.8 0.8] \"float roughness\" [0.02]\n\
        \"bool remaproughness\" false\n\
        Shape \"trianglemesh\" \"point3 P\" [-9 -9 0  9 -9 0  9 9 0  -9 9 0] \"integer indices\" [0 1 2  0 2 3]\n";
    // From the side, as seen in the mirror the lamp is overhead.
    let eye = Eye::at([0.0, 1.0, 0.8], [0.0; 3], 128);
    let lamp = "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool twosided\" true\n\
        Shape \"bilinearmesh\" \"point3 P\" [-2 -3 0.1  2 -3 0.1  -2 -1 3  2 -1 3]\n";
    let spread =
        |settings: &[(&str, &str)], world: &str, eye: Eye| direct(settings).moments(&eye.scene(world), 3);
    for (name, world, eye) in [
        ("rough mirror, large lamp", format!("{metal}{lamp}"), eye),
        ("floor, small lamp", format!("{FLOOR}{SMALL}"), Eye::on_floor(128)),
        ("floor, large lamp", format!("{FLOOR}{LARGE}"), Eye::on_floor(128)),
    ] {
        let light = spread(&[("sampling", "light")], &world, eye);
        let bsdf = spread(&[("sampling", "bsdf")], &world, eye);
        let best = light.variance().min(bsdf.variance());
        for heuristic in ["balance", "power"] {
            let mis = spread(&[("sampling", "mis"), ("heuristic", heuristic)], &world, eye);
            println!(
                "{name}: light {:e} bsdf {:e} {heuristic} {:e}",
                light.variance(),
                bsdf.variance(),
                mis.variance()
            );
            // Veach's bound for one sample of each, which holds for the balance heuristic; and half again for both.
            let bound = best + 0.5 * mis.mean() * mis.mean();
            assert!(mis.variance() <= 1.5 * bound, "{name} {heuristic}: {} > {bound}", mis.variance());
            assert!(mis.variance() < 0.5 * light.variance().max(bsdf.variance()), "{name} {heuristic}");
        }
    }
}

/// Branching spends more rays on a camera sample than a path does, and buys less variance per ray.
#[test]
fn recursion_spends_more_rays_than_a_path() {
    let scene = Eye::on_floor(48)
        .scene(&format!("{FLOOR}{LARGE}Material \"diffuse\"\nShape \"sphere\" \"float radius\" [5]\n"));
    let path = Way { integrator: "path", settings: &[("max_depth", "4")] };
    let recursive = Way { integrator: "recursive", settings: &[("max_depth", "4"), ("branching", "4,2,1")] };
    let rays = |way: &Way<'_>| way.render(&scene, 0..1, 1, 2).1.rays;
    let (one, many) = (rays(&path), rays(&recursive));
    let (v_one, v_many) = (path.moments(&scene, 1).variance(), recursive.moments(&scene, 1).variance());
    println!("rays {one} and {many}; variance {v_one:e} and {v_many:e}");
    assert!(many > 2 * one, "{many} rays against {one}");
}
