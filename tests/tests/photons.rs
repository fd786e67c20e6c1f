//! Photon methods where they are biased: by how much is known in closed form, and it vanishes with the radius and with
//! the passes; and what vcm is when parts of it are off.
#![allow(clippy::print_stdout, reason = "figures are read with `--nocapture`")]

use std::f64::consts::PI;
use std::path::Path;

use render::SceneOptions;
use steradian_tests::{Eye, Family, Way, bytes, open, replicates};
use testkit::statistics::Moments;

/// A lamp of intensity 1 at height 1 over the middle of a white floor: E = (1 + x²)^(−3/2).
const LAMP: &str = "Material \"diffuse\" \"rgb reflectance\" [1 1 1]\n\
    Shape \"bilinearmesh\" \"point3 P\" [-2 -2 0  2 -2 0  -2 2 0  2 2 0]\n\
    LightSource \"spot\" \"rgb I\" [1 1 1] \"point3 from\" [0 0 1] \"point3 to\" [0 0 0] \
    \"float coneangle\" [50] \"float conedeltaangle\" [1]\n";

/// The mean of E over the disk of radius r around the middle: what photons within r say of E there, which is 1.
fn blurred(r: f64) -> f64 {
    2.0 / (r * r) * (1.0 - 1.0 / (1.0 + r * r).sqrt())
}

const ONCE: (&str, &str) = ("max_depth", "1");
const CONSTANT: (&str, &str) = ("kernel", "constant");
const MANY: (&str, &str) = ("photons", "12000");

/// The three methods with a radius, without lamps by light samples.
fn ways<'a>(radius: &'a str, alpha: &'a str) -> [(&'static str, Vec<(&'a str, &'a str)>); 3] {
    let with = |own: &[(&'a str, &'a str)]| [&[ONCE, CONSTANT, MANY, ("radius", radius)], own].concat();
    [
        ("photon", with(&[("gather", "direct"), ("nearest", "0")])),
        ("sppm", with(&[("direct", "photons"), ("alpha", alpha)])),
        ("vcm", with(&[("mode", "ppm"), ("alpha", alpha)])),
    ]
}

/// The slope of ln y over ln x by weighted least squares, and its standard error.
fn slope(points: &[(f64, f64, f64)]) -> (f64, f64) {
    let rows: Vec<_> = points.iter().map(|&(x, y, se)| (x.ln(), y.ln(), (y / se) * (y / se))).collect();
    let w: f64 = rows.iter().map(|r| r.2).sum();
    let [mx, my] =
        [rows.iter().map(|r| r.0 * r.2).sum::<f64>() / w, rows.iter().map(|r| r.1 * r.2).sum::<f64>() / w];
    let xx: f64 = rows.iter().map(|r| r.2 * (r.0 - mx) * (r.0 - mx)).sum();
    let xy: f64 = rows.iter().map(|r| r.2 * (r.0 - mx) * (r.1 - my)).sum();
    (xy / xx, 1.0 / xx.sqrt())
}

/// The estimate is E blurred by the kernel, exactly; so the bias goes with r².
#[test]
fn bias_is_what_the_kernel_blurs_and_falls_with_the_square_of_the_radius() {
    let scene = Eye::on_floor(4).scene(LAMP);
    let mut family = Family::default();
    let radii = ["0.4", "0.3", "0.2"];
    for method in 0..3 {
        let mut biases = Vec::new();
        for text in radii {
            let (integrator, settings) = &ways(text, "1")[method];
            let way = Way { integrator, settings };
            let r: f64 = text.parse().unwrap_or_default();
            let found = replicates(&way, &scene, 4, 0..32);
            family.mean_within(format!("blur, r = {text}, {integrator}"), &found[1], blurred(r) / PI, 1e-5);
            biases.push((r, 1.0 / PI - found[1].mean(), found[1].std_error()));
        }
        // Of 1 − ¾ r² + ⅝ r⁴ …, over these radii.
        let (k, se) = slope(&biases);
        let exact: Vec<_> = biases.iter().map(|&(r, _, se)| (r, (1.0 - blurred(r)) / PI, se)).collect();
        let truth = slope(&exact).0;
        println!("slope {k:.3} ± {se:.3}, closed form {truth:.3}");
        family.holds(
            format!("slope of the bias of {}", ways("1", "1")[method].0),
            (k - truth).abs() < 4.0 * se,
        );
        family.holds("the slope is about two", (1.8..2.0).contains(&truth) && se < 0.1);
    }
    family.finish();
}

/// With a radius that shrinks as it should, N passes are the mean of N blurs; it goes to the truth.
#[test]
fn bias_vanishes_with_the_passes() {
    let scene = Eye::on_floor(4).scene(LAMP);
    let mut family = Family::default();
    let mut last = 1.0;
    for passes in [1_u32, 8, 64] {
        let (mut square, mut sum) = (0.16, 0.0);
        for p in 1..=passes {
            sum += blurred(f64::sqrt(square));
            square *= (f64::from(p) + 0.5) / (f64::from(p) + 1.0);
        }
        let truth = sum / f64::from(passes);
        family.holds("the closed form goes to one", 1.0 - truth < 0.65 * last);
        last = 1.0 - truth;
        for (integrator, settings) in &ways("0.4", "0.5")[1..] {
            let way = Way { integrator, settings };
            let found = replicates(&way, &scene, passes, 0..16);
            family.mean_within(format!("{passes} passes, {integrator}"), &found[1], truth / PI, 1e-5);
        }
    }
    family.finish();
}

/// Of k nearest photons k − 1 count: no bias where the density is even.
#[test]
fn nearest_photons_estimate_an_even_density_without_bias() {
    let sun = "Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\n\
        Shape \"bilinearmesh\" \"point3 P\" [-2 -2 0  2 -2 0  -2 2 0  2 2 0]\n\
        LightSource \"distant\" \"rgb L\" [1 1 1] \"point3 from\" [1 0 1] \"point3 to\" [0 0 0]\n";
    let scene = Eye::on_floor(4).scene(sun);
    let mut family = Family::default();
    for k in ["3", "20"] {
        let settings =
            [ONCE, CONSTANT, ("gather", "direct"), ("nearest", k), ("radius", "1"), ("photons", "1000")];
        let way = Way { integrator: "photon", settings: &settings };
        let found = replicates(&way, &scene, 8, 0..64);
        family.mean(format!("{k} nearest"), &found[1], 0.5 / PI * std::f64::consts::FRAC_1_SQRT_2);
    }
    family.finish();
}

/// The centre of the floor of the radiosity box, whose walls are ½ or 0.8 white, as photons, final gathering and all
/// together see it.
#[test]
fn the_floor_of_a_box() {
    let wall = |p: &str| format!("Shape \"bilinearmesh\" \"point3 P\" [{p}]\n");
    let world = |rho: f64| {
        let walls = [
            "0 0 0  1 0 0  0 1 0  1 1 0",
            "0 0 0  1 0 0  0 0 1  1 0 1",
            "0 1 0  1 1 0  0 1 1  1 1 1",
            "0 0 0  0 1 0  0 0 1  0 1 1",
            "1 0 0  1 1 0  1 0 1  1 1 1",
            "0 0 1  1 0 1  0 .25 1  1 .25 1",
            "0 .75 1  1 .75 1  0 1 1  1 1 1",
            "0 .25 1  .25 .25 1  0 .75 1  .25 .75 1",
            ".75 .25 1  1 .25 1  .75 .75 1  1 .75 1",
        ];
        format!("Material \"diffuse\" \"rgb reflectance\" [{rho} {rho} {rho}]\n")
            + &walls.map(wall).concat()
            + "Material \"diffuse\" \"rgb reflectance\" [0 0 0]\nAreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\n"
            + &wall(".25 .25 1  .25 .75 1  .75 .25 1  .75 .75 1")
    };
    let none = ("max_depth", "none");
    let mut family = Family::default();
    for (rho, truth) in [(0.5, 0.055_956), (0.8, 0.168_075)] {
        let scene =
            Eye { window: 0.02, ..Eye::at([0.5, 0.5, 0.999], [0.5, 0.5, 0.0], 16) }.scene(&world(rho));
        for (integrator, settings) in [
            (
                "photon",
                vec![none, ("nearest", "0"), ("radius", "0.03"), ("photons", "2000"), ("gather_rays", "4")],
            ),
            ("sppm", vec![none, ("radius", "0.03"), ("photons", "3000")]),
            ("vcm", vec![none, ("radius", "0.02"), ("photons", "3000")]),
        ] {
            let way = Way { integrator, settings: &settings };
            let found = replicates(&way, &scene, 2, 0..24);
            family.mean_within(format!("box {rho}, {integrator}"), &found[1], truth, 1.5e-3);
        }
    }
    family.finish();
}

fn scene(name: &str, spectral: bool) -> scene::Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    open(&path, &SceneOptions { resolution: Some([40, 24]), spectral, ..SceneOptions::default() })
}

#[test]
fn vcm_without_merging_is_bdpt_to_the_bit() {
    for (name, spectral) in
        [("points.pbrt", false), ("lens-and-motion.pbrt", false), ("dispersion.pbrt", true)]
    {
        let scene = scene(name, spectral);
        let image = |way: Way<'_>| way.render(&scene, 0..3, 1, 2).0.film().develop();
        let bdpt = image(Way { integrator: "bdpt", settings: &[] });
        let vcm = image(Way { integrator: "vcm", settings: &[("mode", "bpt")] });
        assert!(bdpt == vcm, "{name}");
    }
}

/// Several blocks of light paths, and a tree that several threads build.
#[test]
fn maps_are_the_same_on_every_number_of_threads() {
    let scene = scene("small-lamp.pbrt", false);
    for way in [
        Way { integrator: "sppm", settings: &[("photons", "30000")] },
        Way {
            integrator: "photon",
            settings: &[("photons", "30000"), ("gather_rays", "1"), ("nearest", "5")],
        },
        Way { integrator: "vcm", settings: &[("photons", "30000"), ("mode", "bpm")] },
    ] {
        let one = bytes(way.render(&scene, 0..2, 1, 1).0.film());
        for threads in [2, 3] {
            assert!(one == bytes(way.render(&scene, 0..2, 1, threads).0.film()), "{}, {threads}", way.name());
        }
    }
}

/// What does not fit into the budget is left out and told; the picture is as bright as with all.
#[test]
fn a_budget_keeps_the_mean() {
    let scene = Eye::on_floor(4).scene(LAMP);
    let mut family = Family::default();
    for integrator in ["sppm", "photon"] {
        let raw = if integrator == "sppm" { ("direct", "photons") } else { ("gather", "direct") };
        let settings = [ONCE, CONSTANT, raw, ("radius", "0.2"), ("photons", "20000"), ("photon_memory", "1")];
        let way = Way { integrator, settings: &settings };
        let counters = way.render(&scene, 0..1, 1, 2).1;
        family.holds("all blocks were walked until one did not fit", counters.light_paths > 4096);
        let found: Moments = replicates(&way, &scene, 2, 0..16)[1];
        family.mean_within(format!("a MiB of photons, {integrator}"), &found, blurred(0.2) / PI, 1e-5);
    }
    family.finish();
}

/// A ball of a medium that absorbs nothing cannot be seen in a furnace. Near its border the balls of a search lack photons:
/// what is missing falls with the radius, so that twice a radius of a half less one of a whole is right.
#[test]
fn a_medium_in_a_furnace_cannot_be_seen_in_the_limit() {
    let grid = "\"integer nx\" 2 \"integer ny\" 2 \"integer nz\" 2 \"point3 p0\" [-1 -1 -1] \"point3 p1\" [1 1 1]\n\
        \"float density\" [1 2 3 4 4 3 2 1]";
    let media = [
        (
            "of colours",
            "\"string type\" \"homogeneous\" \"rgb sigma_s\" [0.5 1 2] \"float g\" -0.3".to_owned(),
        ),
        ("that varies", format!("\"string type\" \"uniformgrid\" {grid} \"rgb sigma_s\" [0.2 0.4 0.6]")),
    ];
    let ways = [
        ("sppm", vec![("direct", "photons"), ("alpha", "1")]),
        ("sppm", vec![("alpha", "1")]),
        ("vcm", vec![("mode", "ppm"), ("alpha", "1")]),
        ("vcm", vec![("alpha", "1")]),
    ];
    let mut family = Family::default();
    for (name, medium) in media {
        let world = format!(
            "MakeNamedMedium \"m\" {medium} \"rgb sigma_a\" [0 0 0]\nLightSource \"infinite\" \"rgb L\" [1 1 1]\n\
             Material \"interface\"\nMediumInterface \"m\" \"\"\nShape \"sphere\"\n"
        );
        let scene = Eye { window: 1.0, ..Eye::at([0.0, 0.3, 3.0], [0.0, 0.3, 0.0], 16) }.scene(&world);
        for (integrator, own) in &ways {
            let of = |radius: &str, seed: u64| {
                let all =
                    [("max_depth", "none"), ("medium_radius", "1"), ("photons", "4000"), ("radius", radius)];
                let settings = [&all, own.as_slice()].concat();
                let (job, _) = Way { integrator, settings: &settings }.render(&scene, 0..2, seed, 2);
                job.film().develop().mean_rgb()
            };
            let both: Vec<_> = (0..16).map(|seed| [of("0.12", seed), of("0.06", 100 + seed)]).collect();
            for c in 0..3 {
                let limit = Moments::of(both.iter().map(|[whole, half]| 2.0 * half[c] - whole[c]));
                let name = format!("a medium {name}, {integrator} {own:?}, {c}");
                family.mean_within(&name, &limit, 1.0, 2e-3);
                let missing = Moments::of(both.iter().map(|[whole, _]| 1.0 - whole[c]));
                let least = -0.01 - 4.0 * missing.std_error();
                family.holds(name, (least..0.1).contains(&missing.mean()));
            }
        }
    }
    family.finish();
}
