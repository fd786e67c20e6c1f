//! Methods that start at the lights, against closed forms that they can see: means over whole surfaces, furnaces,
//! irradiance, and caustics of distant light that no path from the eye finds.
//!
//! What a light path leaves on the film is shared by pixels, so that the independent samples are renders with
//! different seeds.

use std::f64::consts::PI;

use scene::Scene;
use steradian_tests::worlds::{corner_irradiance as corner, radiosity_box};
use steradian_tests::{Eye, Family, Way, replicates};
use testkit::statistics::Moments;

const NONE: (&str, &str) = ("max_depth", "none");
const LIGHT: Way<'_> = Way { integrator: "light", settings: &[NONE] };
const BDPT: Way<'_> = Way { integrator: "bdpt", settings: &[NONE] };
const BALANCE: Way<'_> = Way { integrator: "bdpt", settings: &[NONE, ("heuristic", "balance")] };
const MLT: Way<'_> = Way { integrator: "mlt", settings: &[NONE, ("pilot", "256"), ("chain", "128")] };
const PATH: Way<'_> = Way { integrator: "path", settings: &[NONE] };
/// Photons within a radius so small that its bias is far below the noise.
const SMALL: (&str, &str) = ("radius", "0.02");
const PHOTON: Way<'_> = Way {
    integrator: "photon",
    settings: &[NONE, SMALL, ("nearest", "0"), ("gather_rays", "2"), ("photons", "2000")],
};
const SPPM: Way<'_> = Way { integrator: "sppm", settings: &[NONE, SMALL, ("photons", "6000")] };
const SPPM_RAW: Way<'_> =
    Way { integrator: "sppm", settings: &[NONE, SMALL, ("direct", "photons"), ("photons", "6000")] };
const VCM: Way<'_> = Way { integrator: "vcm", settings: &[NONE, SMALL, ("photons", "6000")] };
const VCM_LIGHT: Way<'_> = Way { integrator: "vcm", settings: &[NONE, ("mode", "light")] };
const BPM: Way<'_> =
    Way { integrator: "vcm", settings: &[NONE, SMALL, ("mode", "bpm"), ("photons", "6000")] };
const RECURSIVE: Way<'_> = Way { integrator: "recursive", settings: &[NONE, ("branching", "1")] };

fn diffuse(rho: f64) -> String {
    format!("Material \"diffuse\" \"rgb reflectance\" [{rho} {rho} {rho}]\n")
}

/// The mean radiance of floor, ceiling (without the lamp), and side walls, seen whole.
#[test]
fn mean_radiosities_of_a_closed_box() {
    let white = "0.725 0.71 0.68";
    let boxes = [
        ("A", radiosity_box("0.5 0.5 0.5", "0.5 0.5 0.5", "0.5 0.5 0.5"), [0.046_524; 3], [0.043_599; 3]),
        ("B", radiosity_box("0.8 0.8 0.8", "0.8 0.8 0.8", "0.8 0.8 0.8"), [0.152_953; 3], [0.149_678; 3]),
        (
            "C",
            radiosity_box(white, "0.63 0.065 0.05", "0.14 0.45 0.091"),
            [0.077_980, 0.068_135, 0.056_009],
            [0.066_102, 0.006_484_4, 0.004_234_3],
        ),
    ];
    let mut family = Family::default();
    for (name, world, floor, left) in boxes {
        let views = [
            ("floor", [0.5, 0.5, 0.999], [0.5, 0.5, 0.0], floor),
            ("left wall", [0.999, 0.5, 0.5], [0.0, 0.5, 0.5], left),
        ];
        for (view, from, to, truth) in views {
            let scene = Eye { window: 1.0, ..Eye::at(from, to, 24) }.scene(&world);
            for way in [LIGHT, BDPT, BALANCE, MLT, PATH, RECURSIVE] {
                // Long paths weigh much in a chain that starts anew with every film: left to the box that is dark.
                if way.integrator == "mlt" && name != "A" {
                    continue;
                }
                let found = replicates(&way, &scene, 2, 0..32);
                let channels = if name == "C" { 0..3 } else { 1..2 };
                for c in channels {
                    let name = format!("box {name}, mean {view} {}, {}", ["R", "G", "B"][c], way.name());
                    family.mean_within(name, &found[c], truth[c], 1.5e-4);
                }
            }
        }
    }
    family.finish();
}

/// Furnaces and the integrating sphere, seen through a window in their middle.
#[test]
fn furnaces_and_the_integrating_sphere() {
    let emitting = "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool twosided\" true\n";
    let furnace = format!("{}{emitting}Shape \"sphere\"\n", diffuse(0.5));
    let half = format!(
        "{}Shape \"sphere\" \"float zmax\" [0]\n{emitting}Shape \"sphere\" \"float zmin\" [0]\n",
        diffuse(0.5)
    );
    let mut family = Family::default();
    for (name, world, to, truth) in [
        ("furnace", &furnace, [0.6, 0.0, 0.8], 2.0),
        ("integrating sphere, lamp", &half, [0.6, 0.0, 0.8], 1.5),
        ("integrating sphere, rest", &half, [0.6, 0.0, -0.8], 0.5),
    ] {
        let scene = Eye { window: 0.5, ..Eye::at([0.0; 3], to, 32) }.scene(world);
        for way in [LIGHT, BDPT, MLT, VCM_LIGHT, PHOTON, SPPM, VCM, BPM] {
            let found = replicates(&way, &scene, 2, 0..32);
            family.mean(format!("{name}, {}", way.name()), &found[1], truth);
        }
    }
    family.finish();
}

/// The mean of a function over the window [−½ w, ½ w]².
fn window_mean(w: f64, e: impl Fn(f64, f64) -> f64) -> f64 {
    const N: u32 = 64;
    let at = |i: u32| w * ((f64::from(i) + 0.5) / f64::from(N) - 0.5);
    (0..N * N).map(|i| e(at(i % N), at(i / N))).sum::<f64>() / f64::from(N * N)
}

/// A name, a world, and E at a place of its floor.
type Lamp = (&'static str, &'static str, fn(f64, f64) -> f64);

/// Lamps above a floor.
fn lamps() -> Vec<Lamp> {
    let disk = |x: f64, y: f64| {
        let s = 1.0 + x * x + y * y;
        0.5 * PI * (1.0 - (s - 1.0) / ((s + 1.0) * (s + 1.0) - 4.0 * (s - 1.0)).sqrt())
    };
    vec![
        (
            "square 2 x 2",
            "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\nReverseOrientation\n\
             Shape \"trianglemesh\" \"integer indices\" [0 1 2  0 2 3] \"point3 P\" [-1 -1 1  1 -1 1  1 1 1  -1 1 1]",
            |x, y| {
                corner(1.0 - x, 1.0 - y)
                    + corner(1.0 + x, 1.0 - y)
                    + corner(1.0 - x, 1.0 + y)
                    + corner(1.0 + x, 1.0 + y)
            },
        ),
        (
            "sphere",
            "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\nTranslate 0 0 2\nShape \"sphere\"",
            |x, y| PI * 2.0 * libm::pow(x * x + y * y + 4.0, -1.5),
        ),
        (
            "disk r = h",
            "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\nReverseOrientation\nTranslate 0 0 1\nShape \"disk\"",
            disk,
        ),
        ("point", "LightSource \"point\" \"rgb I\" [1 1 1] \"point3 from\" [1 0 2]", |x, y| {
            2.0 * libm::pow((1.0 - x) * (1.0 - x) + y * y + 4.0, -1.5)
        }),
        (
            "spot",
            "LightSource \"spot\" \"rgb I\" [1 1 1] \"point3 from\" [1 0 2] \"point3 to\" [0 0 0] \
             \"float coneangle\" [40] \"float conedeltaangle\" [5]",
            |x, y| 2.0 * libm::pow((1.0 - x) * (1.0 - x) + y * y + 4.0, -1.5),
        ),
        (
            "sun",
            "LightSource \"distant\" \"rgb L\" [1 1 1] \"point3 from\" [1 0 1] \"point3 to\" [0 0 0]",
            |_, _| std::f64::consts::FRAC_1_SQRT_2,
        ),
        ("sky", "LightSource \"infinite\" \"rgb L\" [1 1 1]", |_, _| PI),
    ]
}

/// Irradiance of a floor, averaged over a window of 1 x 1.
#[test]
fn irradiance_by_light_paths() {
    let floor = format!(
        "{}Shape \"trianglemesh\" \"integer indices\" [0 1 2  0 2 3]\n\
         \"point3 P\" [-1 -1 0  1 -1 0  1 1 0  -1 1 0]\n{}",
        diffuse(0.5),
        diffuse(0.0)
    );
    let mut family = Family::default();
    for (name, lamp, e) in lamps() {
        let scene = Eye { window: 1.0, ..Eye::on_floor(48) }.scene(&format!("{floor}{lamp}\n"));
        let e = window_mean(1.0, e);
        for way in [LIGHT, BDPT, MLT, SPPM_RAW, VCM] {
            let found = replicates(&way, &scene, 2, 0..32);
            family.mean_within(format!("{name}, {}", way.name()), &found[1], 0.5 * e / PI, 1e-4);
        }
    }
    family.finish();
}

const SUN: &str = "LightSource \"distant\" \"rgb L\" [1 1 1] \"point3 from\" [0 0 1] \"point3 to\" [0 0 0]\n";

/// Methods that find caustics of distant light, without roulette, since what is dark is looked at.
const CAUSTICS: [Way<'_>; 5] = [
    Way { integrator: "light", settings: &[NONE, KEEP] },
    Way { integrator: "bdpt", settings: &[NONE, KEEP] },
    Way {
        integrator: "photon",
        settings: &[
            NONE,
            KEEP,
            ("radius", "0.01"),
            ("nearest", "0"),
            ("gather_rays", "1"),
            ("photons", "1000"),
            ("caustic_photons", "12000"),
        ],
    },
    Way { integrator: "sppm", settings: &[NONE, KEEP, ("radius", "0.01"), ("photons", "12000")] },
    Way { integrator: "vcm", settings: &[NONE, KEEP, ("radius", "0.01"), ("photons", "12000")] },
];
const KEEP: (&str, &str) = ("rr_depth", "100");

/// So dark that what returns from the glass to the floor is below 10⁻³ of what came.
const DARK: f64 = 0.002;

fn floor(half: f64) -> String {
    format!(
        "{}Shape \"trianglemesh\" \"integer indices\" [0 1 2  0 2 3]\n\
         \"point3 P\" [-{half} -{half} 0  {half} -{half} 0  {half} {half} 0  -{half} {half} 0]\n",
        diffuse(DARK)
    )
}

/// Distant light through a slab on a floor: E = E₀ (1 − F)/(1 + F).
#[test]
fn a_slab_of_glass_in_the_sun() {
    let slab = "Material \"dielectric\" \"float eta\" [1.5] \"float roughness\" [0]\n\
        Shape \"trianglemesh\" \"integer indices\" [0 2 1 0 3 2 4 5 6 4 6 7]\n\
        \"point3 P\" [-1 -1 0.5 1 -1 0.5 1 1 0.5 -1 1 0.5 -1 -1 0.6 1 -1 0.6 1 1 0.6 -1 1 0.6]\n";
    let scene = Eye { window: 0.4, ..Eye::at([0.0, 0.0, 0.4], [0.0; 3], 64) }
        .scene(&format!("{SUN}{}{slab}", floor(1.0)));
    let mut family = Family::default();
    for way in CAUSTICS {
        let found = replicates(&way, &scene, 2, 0..32);
        family.mean_within(format!("slab, {}", way.name()), &found[1], DARK / PI * 0.923_076_9, 1e-3);
    }
    family.finish();
}

/// The mean of E / E₀ over the disk of a radius around the film's middle, over renders with different seeds.
fn disk_mean(way: &Way<'_>, scene: &Scene, side: u32, radius: f64) -> Moments {
    ring_mean(way, scene, side, [0.0, radius])
}

/// The same between two radii.
fn ring_mean(way: &Way<'_>, scene: &Scene, side: u32, radii: [f64; 2]) -> Moments {
    // The share of each pixel that lies in the ring.
    let share = |i: usize| {
        let (x, y) = ((i as u32 % side) as f64, (i as u32 / side) as f64);
        let inside = |k: u32| {
            let (dx, dy) = ((f64::from(k % 16) + 0.5) / 16.0, (f64::from(k / 16) + 0.5) / 16.0);
            let half = 0.5 * f64::from(side);
            let r = (x + dx - half).hypot(y + dy - half);
            radii[0] <= r && r < radii[1]
        };
        (0..256).filter(|&k| inside(k)).count() as f64 / 256.0
    };
    let shares: Vec<f64> = (0..(side * side) as usize).map(share).collect();
    let total: f64 = shares.iter().sum();
    Moments::of((0..32).map(|seed| {
        let image = way.render(scene, 0..2, seed, 2).0.film().develop();
        let sum: f64 = image.mean.iter().zip(&shares).map(|(p, s)| f64::from(p[1]) * s).sum();
        sum / total * PI / DARK
    }))
}

/// The caustic of a ball of glass (η = 1.5, R = 1) on a plane 2 R behind its centre, with all inner reflections.
#[test]
fn the_caustic_of_a_ball_lens() {
    let ball = "Translate 0 0 2\nMaterial \"dielectric\" \"float eta\" [1.5] \"float roughness\" [0]\nShape \"sphere\"\n";
    let mut family = Family::default();
    let side = 80;
    for (window, radii) in
        [(0.2, [(0.1, 6.808_61), (0.05, 7.840_03)]), (1.0, [(0.5, 1.873_48), (0.2, 4.746_10)])]
    {
        let scene = Eye { window, ..Eye::at([0.0, 0.0, 0.8], [0.0; 3], side) }
            .scene(&format!("{SUN}{}{ball}", floor(0.6)));
        for way in CAUSTICS {
            for (radius, truth) in radii {
                let pixels = radius / window * f64::from(side);
                let found = disk_mean(&way, &scene, side, pixels);
                family.mean_within(format!("ball lens, r = {radius}, {}", way.name()), &found, truth, 1e-3);
            }
        }
    }
    family.finish();
}

/// A mirror z = r²/4 for |x|, |y| < 0.6, whose focus is at (0, 0, 1), with the normals of the paraboloid.
fn parabolic_mirror() -> String {
    const N: u32 = 96;
    let at = |i: u32| 1.2 * (f64::from(i) / f64::from(N) - 0.5);
    let (mut places, mut normals, mut indices) = (String::new(), String::new(), String::new());
    for (x, y) in (0..=N).flat_map(|j| (0..=N).map(move |i| (at(i), at(j)))) {
        places += &format!("{x} {y} {} ", 0.25 * (x * x + y * y));
        normals += &format!("{} {} 1 ", -0.5 * x, -0.5 * y);
    }
    for a in (0..N).flat_map(|j| (0..N).map(move |i| j * (N + 1) + i)) {
        let (b, c, d) = (a + 1, a + N + 2, a + N + 1);
        indices += &format!("{a} {b} {c} {a} {c} {d} ");
    }
    format!(
        "Material \"conductor\" \"rgb reflectance\" [1 1 1] \"float roughness\" [0]\nShape \"trianglemesh\" \
         \"integer indices\" [{indices}] \"point3 P\" [{places}] \"normal N\" [{normals}]\n"
    )
}

/// A disk that looks down.
fn screen(z: f64, radius: f64) -> String {
    format!(
        "AttributeBegin\n{}Translate 0 0 {z}\nShape \"disk\" \"float radius\" [{radius}]\nAttributeEnd\n",
        diffuse(DARK)
    )
}

/// A lamp in the focus of a parabolic mirror makes a parallel beam, E = I / (1 + r²/4)², whose mean over a disk is
/// I / (1 + R²/4).
#[test]
fn a_parabolic_mirror_with_a_lamp_in_its_focus() {
    let lamp = "LightSource \"spot\" \"rgb I\" [1 1 1] \"point3 from\" [0 0 1] \"point3 to\" [0 0 0] \
        \"float coneangle\" [40] \"float conedeltaangle\" [4]\n";
    let world = format!("{lamp}{}{}", screen(2.0, 0.7), parabolic_mirror());
    let mut family = Family::default();
    let radius = 0.55;
    let scene = Eye { window: 1.2, ..Eye::at([0.0, 0.0, 1.5], [0.0, 0.0, 2.0], 40) }.scene(&world);
    for way in CAUSTICS {
        let found = disk_mean(&way, &scene, 40, radius / 1.2 * 40.0);
        let truth = 1.0 / (1.0 + 0.25 * radius * radius);
        family.mean_within(format!("beam, {}", way.name()), &found, truth, 1e-3);
    }
    family.finish();
}

/// Distant light along the axis goes to the focus: what meets the mirror at r is at `r_d = ½ r / (1 − r²/4)` half way there.
/// The screen shades the middle of the mirror, and so its own.
#[test]
fn a_parabolic_mirror_in_the_sun() {
    let world = format!("{SUN}{}{}", screen(0.5, 0.24), parabolic_mirror());
    let mut family = Family::default();
    let scene = Eye { window: 0.48, ..Eye::at([0.0, 0.0, 0.4], [0.0, 0.0, 0.5], 40) }.scene(&world);
    let met = |d: f64| (libm::sqrt(0.25 + d * d) - 0.5) * 2.0 / d;
    let [inner, outer] = [0.14, 0.22];
    let truth = (met(outer).powi(2) - met(inner).powi(2)) / (outer * outer - inner * inner);
    assert!(
        (0.5 * met(outer) / (1.0 - 0.25 * met(outer).powi(2)) - outer).abs() < 1e-12 && met(inner) > 0.24
    );
    for way in CAUSTICS {
        let found = ring_mean(&way, &scene, 40, [inner, outer].map(|r| r / 0.48 * 40.0));
        family.mean_within(format!("towards the focus, {}", way.name()), &found, truth, 1e-3);
    }
    family.finish();
}
