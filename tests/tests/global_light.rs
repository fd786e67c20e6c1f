//! Global illumination against closed forms: furnaces, cavities, the radiosity box, glass and coats.
//!
//! Rough glass has no closed form here: it must lie between bounds, and two ways of walking must agree on it.
#![allow(clippy::print_stdout, reason = "what was measured is read with `--nocapture`")]

use std::f64::consts::PI;

use steradian_tests::{Eye, Family, SIGNIFICANCE, Way, compile};
use testkit::statistics::{Moments, sidak};

const NONE: (&str, &str) = ("max_depth", "none");

/// Every unbiased way to walk.
const WALKS: [Way<'_>; 10] = [
    Way { integrator: "path", settings: &[NONE] },
    Way { integrator: "path", settings: &[NONE, ("heuristic", "balance"), ("rr_depth", "1")] },
    Way { integrator: "path", settings: &[NONE, ("mis", "false")] },
    Way { integrator: "path", settings: &[NONE, ("shadow_rays", "false")] },
    Way { integrator: "path", settings: &[NONE, ("sampling", "uniform")] },
    Way { integrator: "path", settings: &[NONE, ("sampling", "cosine"), ("shadow_rays", "false")] },
    Way { integrator: "recursive", settings: &[NONE, ("branching", "1"), ("rr_depth", "2")] },
    Way {
        integrator: "recursive",
        settings: &[NONE, ("branching", "2,1"), ("shadow_rays", "false"), ("rr_depth", "2")],
    },
    Way { integrator: "bdpt", settings: &[NONE] },
    Way { integrator: "guided", settings: &[NONE] },
];

fn diffuse(rho: f64) -> String {
    format!("Material \"diffuse\" \"rgb reflectance\" [{rho} {rho} {rho}]\n")
}

fn emitting(l: f64) -> String {
    format!("AreaLightSource \"diffuse\" \"rgb L\" [{l} {l} {l}] \"bool twosided\" true\n")
}

/// Part of the unit sphere.
fn zone(z: [f64; 2]) -> String {
    format!("Shape \"sphere\" \"float zmin\" [{}] \"float zmax\" [{}]\n", z[0], z[1])
}

fn furnace_sphere(rho: f64) -> String {
    format!("{}{}Shape \"sphere\"\n", diffuse(rho), emitting(1.0))
}

/// The unit cube [0, 1]³ as triangles.
fn furnace_box(rho: f64) -> String {
    format!(
        "{}{}Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0 0 0 1 1 0 1 0 1 1 1 1 1]\n\
         \"integer indices\" [0 1 3 0 3 2 4 5 7 4 7 6 0 1 5 0 5 4 2 3 7 2 7 6 0 2 6 0 6 4 1 3 7 1 7 5]\n",
        diffuse(rho),
        emitting(1.0)
    )
}

fn in_sphere(side: u32) -> Eye {
    Eye::at([0.1, 0.2, 0.3], [0.7, 0.0, -0.714_142_842_854_285], side)
}

fn in_box(side: u32) -> Eye {
    Eye::at([0.3, 0.4, 0.5], [0.2, 0.3, 0.0], side)
}

/// Every surface emits 1 and reflects ρ; paths of n vertices see (1 − ρⁿ)/(1 − ρ), every single one of them.
#[test]
fn a_truncated_furnace_has_no_variance() {
    let mut family = Family::default();
    let settings = [("max_depth", "7"), ("shadow_rays", "false"), ("rr_depth", "1000")];
    let branching = [settings[0], settings[1], settings[2], ("branching", "2,1")];
    let ways = [
        Way { integrator: "path", settings: &settings },
        Way { integrator: "recursive", settings: &branching },
    ];
    for (rho, truth) in [(0.5, 1.992_187_5), (0.8, 4.161_139_2)] {
        let scenes = [
            ("sphere", in_sphere(64).scene(&furnace_sphere(rho))),
            ("box", in_box(64).scene(&furnace_box(rho))),
        ];
        for (name, scene) in &scenes {
            for way in ways {
                let name = format!("furnace {name} {rho}, {}", way.name());
                family.exact(name, &way.moments(scene, 5), truth);
            }
        }
    }
    family.finish();
}

/// Other walks in the same furnace, truncated: noise, and the same mean.
#[test]
fn a_truncated_furnace_by_every_walk() {
    let mut family = Family::default();
    let scenes =
        [("sphere", in_sphere(96).scene(&furnace_sphere(0.8))), ("box", in_box(96).scene(&furnace_box(0.8)))];
    for (name, scene) in &scenes {
        for (i, walk) in WALKS.iter().enumerate() {
            let settings: Vec<_> = walk
                .settings
                .iter()
                .copied()
                .filter(|s| s.0 != "max_depth")
                .chain([("max_depth", "3")])
                .collect();
            let way = Way { settings: &settings, ..*walk };
            let found = way.moments(scene, 60 + i as u64);
            family.mean_within(format!("furnace {name} 0.8, {}", way.name()), &found, 2.952, 1e-5);
        }
    }
    family.finish();
}

/// Roulette that survives with the throughput makes the number of vertices geometric: mean 1/(1 − ρ), variance ρ/(1 − ρ)².
/// With three times the throughput (`path`) nothing is left to chance until ρⁿ < ⅓; whoever survives that, with q = 3ρⁿ, carries ⅓
/// over a geometric number of vertices: variance q (1 + ρ − q) / (9 (1 − ρ)²).
#[test]
fn roulette_variance_in_the_furnace() {
    let mut family = Family::default();
    let settings = [NONE, ("shadow_rays", "false"), ("rr_depth", "1")];
    let single = [settings[0], settings[1], settings[2], ("branching", "1")];
    for (rho, n) in [(0.5, 2), (0.8, 5), (0.9, 11)] {
        let scene = in_sphere(192).scene(&furnace_sphere(rho));
        let (rest, q) = (1.0 - rho, 3.0 * f64::powi(rho, n));
        assert!(q < 1.0 && q / rho > 1.0);
        for (integrator, settings, variance) in [
            ("path", &settings[..], q * (1.0 + rho - q) / (9.0 * rest * rest)),
            ("recursive", &single, rho / (rest * rest)),
        ] {
            let way = Way { integrator, settings };
            let found = way.moments(&scene, 8);
            let name = format!("furnace {rho} with roulette, {}", way.name());
            family.mean(&name, &found, 1.0 / rest);
            family.variance(&name, &found, variance);
        }
    }
    family.finish();
}

/// L(x) = E(x) + ρ(x) avg(E) / (1 − avg(ρ)) in a sphere.
#[test]
fn integrating_sphere() {
    let mut family = Family::default();
    // Emitting above z = c; ρ; what the lamp and what the rest shows.
    for (c, rho, lamp, rest) in [(0.0, 0.5, 1.5, 0.5), (0.8, 0.8, 1.4, 0.4), (0.98, 0.9, 1.09, 0.09)] {
        let world = format!(
            "{}{}AttributeBegin\n{}{}AttributeEnd\n",
            diffuse(rho),
            zone([-1.0, c]),
            emitting(1.0),
            zone([c, 1.0])
        );
        for (name, z, truth) in [("lamp", 0.999, lamp), ("rest", -0.4, rest)] {
            let to = [f64::sqrt(1.0 - z * z), 0.0, z];
            let scene = Eye::at([0.1, 0.1, 0.0], to, 96).scene(&world);
            for (i, way) in WALKS.iter().enumerate() {
                let found = way.moments(&scene, 70 + i as u64);
                family.mean(format!("sphere lit above {c}, {name}, {}", way.name()), &found, truth);
            }
        }
    }
    family.finish();
}

/// An isothermal cavity (emits 1 − ρ) with an opening of the share s: L = (1 − ρ)/(1 − ρ(1 − s)).
#[test]
fn open_cavity_and_concentric_spheres() {
    let mut family = Family::default();
    for (s, rho, truth) in [(0.1, 0.5, 0.909_090_9), (0.25, 0.8, 0.5)] {
        let world = format!("{}{}{}", diffuse(rho), emitting(1.0 - rho), zone([-1.0, 1.0 - 2.0 * s]));
        let scene = Eye::at([0.1, 0.0, 0.0], [0.6, 0.0, -0.8], 96).scene(&world);
        for (i, way) in WALKS.iter().enumerate() {
            family.mean(format!("cavity {s}, {}", way.name()), &way.moments(&scene, 90 + i as u64), truth);
        }
    }
    for (inner, outer, l1, l2) in [(1.0, 0.0, 10.0 / 9.0, 2.0 / 9.0), (0.0, 1.0, 8.0 / 9.0, 16.0 / 9.0)] {
        let light = |l: f64| if l > 0.0 { emitting(l) } else { String::new() };
        let world = format!(
            "{}AttributeBegin\n{}Shape \"sphere\" \"float radius\" [0.5]\nAttributeEnd\n{}Shape \"sphere\"\n",
            diffuse(0.5),
            light(inner),
            light(outer)
        );
        for (name, to, truth) in [("inner", [0.4, 0.3, 0.0], l1), ("outer", [0.8, 0.6, 0.0], l2)] {
            let from = if name == "inner" { [0.6, 0.45, 0.1] } else { [0.45, 0.4, 0.1] };
            let scene = Eye::at(from, to, 96).scene(&world);
            for (i, way) in WALKS.iter().enumerate() {
                let found = way.moments(&scene, 110 + i as u64);
                let which = if inner > 0.0 { "inner" } else { "outer" };
                family.mean(format!("concentric, {which} shines, {name}, {}", way.name()), &found, truth);
            }
        }
    }
    family.finish();
}

/// Endless planes, by mirrors at the sides: L₁ = 1/(1 − ρ₁ρ₂), L₂ = ρ₂/(1 − ρ₁ρ₂).
#[test]
fn parallel_planes_between_mirrors() {
    let square = |z: u32| {
        format!(
            "Shape \"trianglemesh\" \"integer indices\" [0 1 2  0 2 3]\n\
             \"point3 P\" [0 0 {z} 1 0 {z} 1 1 {z} 0 1 {z}]\n"
        )
    };
    let sides = "Material \"conductor\" \"rgb reflectance\" [1 1 1] \"float roughness\" [0]\n\
        Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0 0 0 1 1 0 1 0 1 1 1 1 1]\n\
        \"integer indices\" [0 1 5 0 5 4 2 3 7 2 7 6 0 2 6 0 6 4 1 3 7 1 7 5]\n";
    let mut family = Family::default();
    for (r1, r2, l1, l2) in [(0.5, 0.5, 4.0 / 3.0, 2.0 / 3.0), (0.8, 0.3, 1.315_789_5, 0.394_736_8)] {
        let world = format!(
            "{sides}{}{}AttributeBegin\n{}{}{}AttributeEnd\n",
            diffuse(r2),
            square(1),
            diffuse(r1),
            emitting(1.0),
            square(0)
        );
        for (name, z, truth) in [("first", 0.0, l1), ("second", 1.0, l2)] {
            let scene = Eye::at([0.4, 0.3, 0.5], [0.35, 0.3, z], 128).scene(&world);
            for (i, way) in WALKS.iter().enumerate() {
                let found = way.moments(&scene, 130 + i as u64);
                // A mirror's reflectance is η, k of 0.9999 as in pbrt-v4; some two bounces of it per hop.
                family.mean_within(format!("planes {r1} {r2}, {name}, {}", way.name()), &found, truth, 3e-4);
            }
        }
    }
    family.finish();
}

/// The unit box with a square lamp in the ceiling: case A (ρ = 0.5) or C (Cornell's colours).
fn radiosity_box(cornell: bool) -> String {
    let [white, red, green] = match cornell {
        false => ["0.5 0.5 0.5"; 3],
        true => ["0.725 0.71 0.68", "0.63 0.065 0.05", "0.14 0.45 0.091"],
    };
    let wall = |rho: &str, p: &str| {
        format!(
            "Material \"diffuse\" \"rgb reflectance\" [{rho}]\n\
             Shape \"trianglemesh\" \"integer indices\" [0 1 2  0 2 3] \"point3 P\" [{p}]\n"
        )
    };
    let ceiling =
        [[0.0, 1.0, 0.0, 0.25], [0.0, 1.0, 0.75, 1.0], [0.0, 0.25, 0.25, 0.75], [0.75, 1.0, 0.25, 0.75]];
    let mut text: String = ceiling
        .iter()
        .map(|[x0, x1, y0, y1]| wall(white, &format!("{x0} {y0} 1 {x1} {y0} 1 {x1} {y1} 1 {x0} {y1} 1")))
        .collect();
    text += &wall(white, "0 0 0 1 0 0 1 1 0 0 1 0");
    text += &wall(white, "0 0 0 1 0 0 1 0 1 0 0 1");
    text += &wall(white, "0 1 0 1 1 0 1 1 1 0 1 1");
    text += &wall(red, "0 0 0 0 1 0 0 1 1 0 0 1");
    text += &wall(green, "1 0 0 1 1 0 1 1 1 1 0 1");
    // Two-sided: what it sends up leaves the box.
    text += &emitting(1.0);
    text + &wall("0 0 0", "0.25 0.25 1 0.75 0.25 1 0.75 0.75 1 0.25 0.75 1")
}

#[test]
fn radiosity_of_a_closed_box() {
    // Point, radiance in case A, radiance in case C.
    let points = [
        ("floor centre", [0.5, 0.5, 0.0], 0.055_956, [0.091_628, 0.081_320, 0.068_321]),
        ("floor (.1,.1)", [0.1, 0.1, 0.0], 0.038_863, [0.071_773, 0.053_631, 0.045_636]),
        ("left centre", [0.0, 0.5, 0.5], 0.056_374, [0.080_233, 0.008_213_6, 0.005_471_9]),
        ("right centre", [1.0, 0.5, 0.5], 0.056_374, [0.019_445, 0.053_117, 0.009_886_9]),
        ("back (.1,.1)", [0.1, 1.0, 0.1], 0.029_966, [0.060_372, 0.042_346, 0.034_648]),
        ("ceiling (.1,.1)", [0.1, 0.1, 1.0], 0.020_260, [0.046_752, 0.027_708, 0.020_397]),
    ];
    let [a, c] = [radiosity_box(false), radiosity_box(true)];
    let mut family = Family::default();
    for (k, (name, p, case_a, case_c)) in points.into_iter().enumerate() {
        let eye = Eye::at([0.45, 0.55, 0.4], p, 96);
        let [scene_a, scene_c] = [eye.scene(&a), eye.scene(&c)];
        for (i, way) in WALKS.iter().enumerate() {
            let seed = (1000 + 10 * k + i) as u64;
            let found = way.moments(&scene_a, seed);
            family.mean_within(format!("box A, {name}, {}", way.name()), &found, case_a, 1e-4);
            if i % 4 == 0 {
                let found = way.rgb_moments(&scene_c, seed);
                for (channel, m) in ["R", "G", "B"].iter().zip(0..) {
                    let name = format!("box C, {name} {channel}, {}", way.name());
                    family.mean_within(name, &found[m], case_c[m], 1.5e-4);
                }
            }
        }
    }
    family.finish();
}

/// Lambert's sphere under a distant light at phase angle a: (2/3π)(sin a + (π − a) cos a) ρ, averaged over its disk.
#[test]
fn lambert_sphere_under_a_distant_light() {
    let mut family = Family::default();
    for phase in [0.0_f64, 60.0, 90.0, 120.0] {
        let a = phase.to_radians();
        let truth = 2.0 / (3.0 * PI) * (libm::sin(a) + (PI - a) * libm::cos(a)) * 0.5;
        let world = format!(
            "LightSource \"distant\" \"rgb L\" [1 1 1] \"point3 from\" [{} 0 {}] \"point3 to\" [0 0 0]\n{}Shape \"sphere\"\n",
            libm::sin(a),
            libm::cos(a),
            diffuse(0.5)
        );
        let eye = Eye { window: 2.0, ..Eye::at([0.0, 0.0, 3.0], [0.0; 3], 256) };
        let scene = eye.scene(&world);
        for way in [
            Way { integrator: "path", settings: &[] },
            Way { integrator: "direct", settings: &[("sampling", "cosine")] },
            Way { integrator: "recursive", settings: &[("branching", "1")] },
            Way { integrator: "bdpt", settings: &[] },
        ] {
            // The square film holds the disk: π/4 of it. L = ρ E₀ cos / π. Pixels are strata: the test is careful.
            let found = way.moments(&scene, 3);
            family.mean(format!("phase {phase}°, {}", way.name()), &found, truth / 4.0);
        }
    }
    family.finish();
}

/// A lamp seen through a lossless slab, all inner bounces: (1 − F)/(1 + F).
#[test]
fn a_lamp_through_a_slab_of_glass() {
    let slab = "Material \"dielectric\" \"float eta\" [1.5] \"float roughness\" [0]\n\
        Shape \"trianglemesh\" \"integer indices\" [0 2 1 0 3 2 4 5 6 4 6 7]\n\
        \"point3 P\" [-99 -99 0 99 -99 0 99 99 0 -99 99 0 -99 -99 0.1 99 -99 0.1 99 99 0.1 -99 99 0.1]\n";
    let lamp =
        format!("{}{}Translate 0 0 -1\nShape \"disk\" \"float radius\" [50]\n", diffuse(0.0), emitting(1.0));
    let thin = "Material \"thindielectric\" \"float eta\" [1.5]\nShape \"disk\" \"float radius\" [99]\n";
    let mut family = Family::default();
    for (glass, name) in [(slab, "slab"), (thin, "thin")] {
        for (angle, truth) in [(0.0_f64, 0.923_076_9), (45.0, 0.904_326_8), (60.0, 0.836_232_5)] {
            let a = angle.to_radians();
            let from = [3.0 * libm::sin(a), 0.0, 3.0 * libm::cos(a)];
            let scene = Eye::at(from, [0.0; 3], 160).scene(&format!("{glass}{lamp}"));
            for (i, way) in [WALKS[0], WALKS[3], WALKS[6], WALKS[8]].iter().enumerate() {
                let found = way.moments(&scene, 20 + i as u64);
                family.mean(format!("{name} at {angle}°, {}", way.name()), &found, truth);
            }
        }
    }
    family.finish();
}

const SKY: &str = "LightSource \"infinite\" \"rgb L\" [1 1 1]\n";

/// Under an even sky lossless glass is invisible, sample by sample; a convex Lambertian shows its ρ.
#[test]
fn under_an_even_sky() {
    let mut family = Family::default();
    let eye = Eye { window: 2.2, ..Eye::at([0.0, 0.0, 3.0], [0.0; 3], 96) };
    for (name, material) in [
        ("glass", "Material \"dielectric\" \"float eta\" [1.5] \"float roughness\" [0]\n"),
        ("diamond", "Material \"dielectric\" \"float eta\" [2.42] \"float roughness\" [0]\n"),
        ("thin glass", "Material \"thindielectric\" \"float eta\" [1.5]\n"),
    ] {
        let scene = eye.scene(&format!("{SKY}{material}Shape \"sphere\"\n"));
        for way in [WALKS[0], WALKS[3], WALKS[6], WALKS[8]] {
            family.exact(format!("{name}, {}", way.name()), &way.moments(&scene, 1), 1.0);
        }
    }
    let scene =
        Eye::at([3.0, 1.0, 2.0], [0.0; 3], 96).scene(&format!("{SKY}{}Shape \"sphere\"\n", diffuse(0.7)));
    for (i, way) in WALKS.iter().enumerate() {
        family.mean(format!("Lambertian sphere, {}", way.name()), &way.moments(&scene, i as u64), 0.7);
    }
    family.finish();
}

/// Rough glass and coats neither gain energy nor lose more than single scattering does; a smooth coat over a
/// Lambertian is exact: Fe + (1 − F)(1 − Fi) ρ / (1 − Fi ρ).
#[test]
fn coats_and_rough_glass_under_an_even_sky() {
    let mut family = Family::default();
    let floor = "Shape \"disk\" \"float radius\" [9]\n";
    for (rho, truth) in [(0.1, 0.081_208_2), (0.5, 0.316_070_9), (0.9, 0.792_785_8)] {
        let coat = format!(
            "{SKY}Material \"coateddiffuse\" \"rgb reflectance\" [{rho} {rho} {rho}] \"float eta\" [1.5]\n\
             \"float roughness\" [0] \"integer maxdepth\" [100] \"integer nsamples\" [1] \"float thickness\" [1e-4]\n{floor}"
        );
        let scene = Eye::on_floor(256).scene(&coat);
        for (i, way) in [WALKS[0], WALKS[2], WALKS[3], WALKS[4], WALKS[6], WALKS[8]].iter().enumerate() {
            let found = way.moments(&scene, (30.0 + 1e3 * rho) as u64 + i as u64);
            family.mean(format!("smooth coat over {rho}, {}", way.name()), &found, truth);
        }
    }
    // A ray crosses two surfaces. Each keeps at least what it would keep if it only reflected, where microfacets hide
    // more of each other: E(1) of the GGX table.
    for (alpha, keeps) in [(0.1, 0.9883), (0.5, 0.687_85)] {
        let world = format!(
            "{SKY}Material \"dielectric\" \"float eta\" [1.5] \"float roughness\" [{alpha}] \"bool remaproughness\" false\n\
             Shape \"sphere\"\n"
        );
        let scene = Eye::at([0.0, 0.0, 3.0], [0.0; 3], 160).scene(&world);
        let found: [Moments; 3] = [0, 3, 8].map(|i| WALKS[i].moments(&scene, 2 + i as u64));
        for m in found {
            let noise = 4.0 * m.std_error();
            let (least, most) = (keeps * keeps - noise, 1.0 + noise);
            println!("rough glass {alpha}: {} ± {}", m.mean(), m.std_error());
            family.holds(format!("rough glass {alpha}: {}", m.mean()), (least..most).contains(&m.mean()));
        }
        for other in &found[1..] {
            let same = testkit::statistics::welch_test(&found[0], other);
            family
                .holds(format!("rough glass {alpha}: {same:?}"), same.is_consistent(sidak(SIGNIFICANCE, 4)));
        }
    }
    family.finish();
}

/// A lens camera in a furnace sees the furnace, whatever is in focus.
#[test]
fn a_lens_in_the_furnace() {
    let head = "Film \"rgb\" \"integer xresolution\" [48] \"integer yresolution\" [48]\nPixelFilter \"box\"\n\
        Sampler \"independent\"\nLookAt 0.1 0.2 0.3  0 0.5 -0.5  0 0 1\n\
        Camera \"perspective\" \"float fov\" [60] \"float lensradius\" [0.1] \"float focaldistance\" [0.4]\nWorldBegin\n";
    let settings = [("max_depth", "7"), ("shadow_rays", "false"), ("rr_depth", "1000")];
    let scene = compile(&(head.to_owned() + &furnace_sphere(0.5)), &render::SceneOptions::default());
    let mut family = Family::default();
    let way = Way { integrator: "path", settings: &settings };
    family.exact("lens in a furnace", &way.moments(&scene, 5), 1.992_187_5);
    family.finish();
}

#[test]
fn spectral_mode_in_the_furnace() {
    let mut family = Family::default();
    let scene = in_sphere(128).spectral_scene(&furnace_sphere(0.5));
    let settings = [("max_depth", "7"), ("shadow_rays", "false"), ("rr_depth", "1000")];
    let ways = [Way { integrator: "path", settings: &settings }, WALKS[0], WALKS[6]];
    for (way, truth) in ways.iter().zip([1.992_187_5, 2.0, 2.0]) {
        for (m, channel) in way.rgb_moments(&scene, 6).iter().zip(["R", "G", "B"]) {
            family.mean_within(format!("spectral furnace {channel}, {}", way.name()), m, truth, 1e-3);
        }
    }
    family.finish();
}
