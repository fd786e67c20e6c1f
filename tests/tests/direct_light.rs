//! Direct illumination against closed forms of irradiance: every lamp by every way of drawing directions, and the
//! exact variances of Veach's combination for a sphere lamp.
//!
//! The floor is Lambertian with ρ = 0.5, lamps have L = 1: the camera sees ρ E / π.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, FRAC_PI_4, FRAC_PI_6, FRAC_PI_8, PI};

use steradian_tests::{Eye, Family, Way};

const FLOOR: &str = "Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\n\
    Shape \"trianglemesh\" \"point3 P\" [-9 -9 0  9 -9 0  9 9 0  -9 9 0] \"integer indices\" [0 1 2  0 2 3]\n\
    Material \"diffuse\" \"rgb reflectance\" [0 0 0]\n";

const LAMP: &str = "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool twosided\" true\n";

const WAYS: [Way<'_>; 11] = [
    Way { integrator: "direct", settings: &[("sampling", "mis")] },
    Way { integrator: "direct", settings: &[("sampling", "mis"), ("heuristic", "balance")] },
    Way {
        integrator: "direct",
        settings: &[("sampling", "mis"), ("light_samples", "3"), ("bsdf_samples", "2")],
    },
    Way { integrator: "direct", settings: &[("sampling", "light")] },
    Way { integrator: "direct", settings: &[("sampling", "bsdf")] },
    Way { integrator: "direct", settings: &[("sampling", "cosine")] },
    Way { integrator: "direct", settings: &[("sampling", "uniform")] },
    Way { integrator: "path", settings: &[("max_depth", "1")] },
    Way {
        integrator: "path",
        settings: &[("max_depth", "1"), ("sampling", "uniform"), ("heuristic", "balance")],
    },
    Way { integrator: "recursive", settings: &[("max_depth", "1"), ("branching", "1")] },
    Way { integrator: "bdpt", settings: &[("max_depth", "1")] },
];

fn sphere(radius: f64, theta_degrees: f64) -> String {
    let (sin, cos) = (libm::sin(theta_degrees.to_radians()), libm::cos(theta_degrees.to_radians()));
    format!("{LAMP}Translate {} 0 {}\nShape \"sphere\" \"float radius\" [{radius}]", 2.0 * sin, 2.0 * cos)
}

fn disk(radius: f64, height: f64, x: f64) -> String {
    format!("{LAMP}Translate {x} 0 {height}\nShape \"disk\" \"float radius\" [{radius}]")
}

fn polygon(points: &[[f64; 3]]) -> String {
    let p: Vec<String> = points.iter().flatten().map(ToString::to_string).collect();
    let fan: Vec<String> = (1..points.len() - 1).map(|i| format!("0 {i} {}", i + 1)).collect();
    let (p, fan) = (p.join(" "), fan.join(" "));
    format!("{LAMP}Shape \"trianglemesh\" \"point3 P\" [{p}] \"integer indices\" [{fan}]")
}

fn rectangle(x: [f64; 2], y: [f64; 2]) -> String {
    polygon(&[[x[0], y[0], 1.0], [x[1], y[0], 1.0], [x[1], y[1], 1.0], [x[0], y[1], 1.0]])
}

fn patch(a: f64) -> String {
    format!("{LAMP}Shape \"bilinearmesh\" \"point3 P\" [-{a} -{a} 1  {a} -{a} 1  -{a} {a} 1  {a} {a} 1]")
}

/// Name, world, E.
fn lamps() -> Vec<(&'static str, String, f64)> {
    vec![
        ("sphere at 0°", sphere(1.0, 0.0), FRAC_PI_4),
        ("sphere at 30°", sphere(1.0, 30.0), 0.680_174_8),
        ("sphere at 60°", sphere(1.0, 60.0), FRAC_PI_8),
        ("sphere cut by the horizon, 75°", sphere(1.0, 75.0), 0.221_200_9),
        ("sphere cut by the horizon, 90°", sphere(1.0, 90.0), 0.090_586_1),
        ("sphere cut by the horizon, 110°", sphere(1.0, 110.0), 0.006_753_1),
        ("disk r = h", disk(1.0, 1.0, 0.0), FRAC_PI_2),
        ("disk r = h, x = 0.5", disk(1.0, 1.0, 0.5), 1.375_963),
        ("disk r = h, x = 2", disk(1.0, 1.0, 2.0), 0.165_833_4),
        ("disk r = h/2", disk(1.0, 2.0, 0.0), 0.628_318_5),
        ("square by its corner", rectangle([0.0, 1.0], [0.0, 1.0]), PI * 0.138_531_6),
        ("square 2 x 2", rectangle([-1.0, 1.0], [-1.0, 1.0]), 1.740_839_5),
        ("patch 1 x 1", patch(0.5), 0.752_274_7),
        ("patch 0.5 x 0.5", patch(0.25), 0.230_836_8),
        (
            "wall beside",
            polygon(&[[1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 2.0], [1.0, -1.0, 2.0]]),
            0.597_329_5,
        ),
        ("triangle", polygon(&[[1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [-1.0, -1.0, 2.0]]), 0.687_617_4),
        ("sky", "LightSource \"infinite\" \"rgb L\" [1 1 1]".to_owned(), PI),
    ]
}

#[test]
fn every_lamp_by_every_way() {
    let mut family = Family::default();
    for (i, (name, world, e)) in lamps().into_iter().enumerate() {
        let scene = Eye::on_floor(128).scene(&(FLOOR.to_owned() + &world));
        for (j, way) in WAYS.iter().enumerate() {
            let found = way.moments(&scene, (100 * i + j) as u64);
            family.mean(format!("{name}, {}", way.name()), &found, 0.5 * e / PI);
        }
    }
    family.finish();
}

/// Lamps that move, are repeated, or are strands. E of the moving disk is the mean over its way; of a thin strand, w long by
/// its width, `w (a / (h² + a²) + atan(a / h) / h)`.
#[test]
fn lamps_in_motion_in_groups_and_on_strands() {
    let n = 2000;
    let way = (0..n).map(|i| disk_irradiance(-0.5 + 2.0 * (f64::from(i) + 0.5) / f64::from(n)));
    // Places go straight from key to key, whatever turns.
    let chord = (0..n).map(|i| {
        let x = (f64::from(i) + 0.5) / f64::from(n);
        disk_irradiance((0.3 - 0.7 * x).hypot(0.4 - 0.1 * x))
    });
    let moving = format!(
        "ActiveTransform StartTime Translate -0.5 0 1\nActiveTransform EndTime Translate 1.5 0 1\nActiveTransform All\n\
         {LAMP}Shape \"disk\" \"float radius\" [1]"
    );
    let turning = format!(
        "ActiveTransform EndTime Rotate 90 0 0 1\nActiveTransform All Translate 0.3 0.4 1\n{LAMP}Shape \"disk\""
    );
    let group = format!(
        "ObjectBegin \"a\"\n{LAMP}Translate 0.5 0 1 Shape \"disk\" \"float radius\" [1]\nObjectEnd\n\
         ObjectInstance \"a\"\nRotate 180 0 0 1 Translate 1.5 0 0 ObjectInstance \"a\""
    );
    let strand = |kind: &str| {
        format!(
            "{LAMP}Shape \"curve\" \"string type\" \"{kind}\" \"float width\" [0.04] \"normal N\" [0 0 1 0 0 1] \
             \"point3 P\" [-1 0 1  -0.333 0 1  0.333 0 1  1 0 1]"
        )
    };
    let line = 0.04 * (0.5 + FRAC_PI_4);
    // A tube of nine sides is not equally wide from everywhere.
    let lamps = [
        ("a disk that passes by", moving, way.sum::<f64>() / f64::from(n), 0.0),
        ("a disk that turns about the point", turning, chord.sum::<f64>() / f64::from(n), 0.0),
        ("a disk twice", group, disk_irradiance(0.5) + disk_irradiance(2.0), 0.0),
        ("a ribbon", strand("ribbon"), line, 1e-3),
        ("a flat strand", strand("flat"), line, 0.011),
        ("a round strand", strand("cylinder"), line, 0.011),
    ];
    let mut family = Family::default();
    for (i, (name, world, e, uncertainty)) in lamps.into_iter().enumerate() {
        let scene = Eye::on_floor(128).scene(&(FLOOR.to_owned() + &world));
        for (j, way) in WAYS.iter().enumerate() {
            let found = way.moments(&scene, (3000 + 100 * i + j) as u64);
            let truth = 0.5 * e / PI;
            family.mean_within(format!("{name}, {}", way.name()), &found, truth, uncertainty * truth + 1e-6);
        }
    }
    family.finish();
}

/// Delta lights: I cos / d², L cos; also where directions are drawn by other densities.
#[test]
fn delta_lights_by_every_way() {
    let lights = [
        (
            "point",
            "LightSource \"point\" \"rgb I\" [1 1 1] \"point3 from\" [1 0 2]",
            2.0 / libm::pow(5.0, 1.5),
        ),
        (
            "spot",
            "LightSource \"spot\" \"rgb I\" [1 1 1] \"point3 from\" [0 1 2] \"point3 to\" [0 0 0] \
             \"float coneangle\" [30] \"float conedeltaangle\" [5]",
            2.0 / libm::pow(5.0, 1.5),
        ),
        (
            "sun",
            "LightSource \"distant\" \"rgb L\" [1 1 1] \"point3 from\" [1 0 1] \"point3 to\" [0 0 0]",
            FRAC_1_SQRT_2,
        ),
    ];
    let mut family = Family::default();
    for (name, light, e) in lights {
        let scene = Eye::on_floor(32).scene(&(FLOOR.to_owned() + light));
        for way in &WAYS {
            let found = way.moments(&scene, 7);
            // The window of 10⁻⁴ lets the distance vary.
            family.mean_within(format!("{name}, {}", way.name()), &found, 0.5 * e / PI, 1e-5);
            family.holds(format!("{name}, {}: noise", way.name()), found.variance().sqrt() < 1e-3);
        }
    }
    family.finish();
}

/// A lamp, a sun and a sky together: the sum, whatever light is chosen with which probability.
#[test]
fn many_lights_by_every_way() {
    let world = format!(
        "{FLOOR}LightSource \"infinite\" \"rgb L\" [0.1 0.1 0.1]\n\
         LightSource \"distant\" \"rgb L\" [0.3 0.3 0.3] \"point3 from\" [-1 0 1] \"point3 to\" [0 0 0]\n\
         LightSource \"point\" \"rgb I\" [0.5 0.5 0.5] \"point3 from\" [-2 0 1]\n\
         AttributeBegin\n{}\nAttributeEnd\nAttributeBegin\n{}\nAttributeEnd\n",
        disk(1.0, 1.0, 1.5),
        sphere(1.0, -60.0),
    );
    // The point light and the sun shine from below the sphere or are hidden by it: only what passes counts. The
    // sphere (centre (−1.73, 0, 1), radius 1) hides both, and its part of the sky; so does the disk.
    let (sphere_e, disk_e) = (FRAC_PI_8, disk_irradiance(1.5));
    let e = sphere_e + disk_e + 0.1 * (PI - sphere_e - disk_e);
    let mut family = Family::default();
    let scene = Eye::on_floor(192).scene(&world);
    for (i, way) in WAYS.iter().enumerate() {
        let found = way.moments(&scene, 40 + i as u64);
        family.mean(format!("many, {}", way.name()), &found, 0.5 * e / PI);
    }
    family.finish();
}

/// E of a disk r = h = 1 at lateral offset x.
fn disk_irradiance(x: f64) -> f64 {
    let s = 1.0 + x * x;
    0.5 * PI * (1.0 - (s - 1.0) / ((s + 1.0) * (s + 1.0) - 4.0 * x * x).sqrt())
}

/// Sphere of half-angle s on the normal: variances of E / L of one sample, or one of each technique.
#[test]
fn variances_of_multiple_importance_sampling() {
    // Half-angle; variance of cosine, cone, balance 1 + 1, power 1 + 1.
    let table: [(f64, [f64; 4]); 4] = [
        (5.0, [0.074_401_3, 6.8982e-10, 4.2292e-6, 9.3727e-10]),
        (15.0, [0.616_850_3, 4.434_86e-6, 2.435_421e-3, 1.663_976e-5]),
        (30.0, [1.850_551, 1.059_908e-3, 0.074_727_54, 7.243_413e-3]),
        (60.0, [1.850_551, 0.205_616_8, 0.386_757_3, 0.320_188_9]),
    ];
    let ways = [
        ("cosine", Way { integrator: "direct", settings: &[("sampling", "cosine")] }),
        ("cone", Way { integrator: "direct", settings: &[("sampling", "light")] }),
        (
            "balance 1+1",
            Way { integrator: "direct", settings: &[("sampling", "mis"), ("heuristic", "balance")] },
        ),
        ("power 1+1", Way { integrator: "direct", settings: &[("sampling", "mis"), ("heuristic", "power")] }),
    ];
    let mut family = Family::default();
    for (angle, variances) in table {
        let sin = libm::sin(angle.to_radians());
        let mu = PI * sin * sin;
        let scene = Eye::on_floor(256).scene(&(FLOOR.to_owned() + &sphere(2.0 * sin, 0.0)));
        let mut found = [0.0; 4];
        for (i, (name, way)) in ways.iter().enumerate() {
            let m = way.moments(&scene, 900 + i as u64);
            let name = format!("sphere of {angle}°, {name}");
            family.mean(&name, &m, 0.5 * mu / PI);
            found[i] = m.variance() * (2.0 * PI) * (2.0 * PI);
            // Below a relative spread of 1e-3 single precision and the window's width are part of the variance.
            if variances[i].sqrt() > 1e-3 * mu {
                family.variance(&name, &m, variances[i] / (4.0 * PI * PI));
            }
        }
        // Veach's bound for one sample of each.
        let best = found[0].min(found[1]);
        family.holds(format!("{angle}°: Veach's bound"), found[2] <= best + 0.5 * mu * mu);
    }
    family.finish();
}

/// An image all around, L = cosⁿ θ above the floor: E = 2π/(n + 2).
#[test]
fn a_sky_of_a_power_of_the_cosine() {
    const SIDE: usize = 512;
    let mut family = Family::default();
    for (n, e) in [(1.0, 2.094_395_1), (10.0, FRAC_PI_6), (100.0, 0.061_599_9)] {
        let texel = |i: usize| {
            let u = [i % SIDE, i / SIDE].map(|x| (x as f32 + 0.5) / SIDE as f32);
            libm::powf(sampling::warp::equal_area_sphere(u).0.z.max(0.0), n)
        };
        let mut pfm = format!("PF\n{SIDE} {SIDE}\n-1.0\n").into_bytes();
        (0..SIDE * SIDE).for_each(|i| (0..3).for_each(|_| pfm.extend(texel(i).to_le_bytes())));
        let file = tempfile::Builder::new().suffix(".pfm").tempfile().unwrap_or_else(|e| panic!("{e}"));
        std::fs::write(file.path(), pfm).unwrap_or_else(|e| panic!("{e}"));
        let sky = format!("LightSource \"infinite\" \"string filename\" \"{}\"\n", file.path().display());
        let scene = Eye::on_floor(128).scene(&format!("{sky}{FLOOR}"));
        for (i, way) in WAYS.iter().enumerate() {
            let found = way.moments(&scene, 50 + i as u64);
            // Texels are points of the function, not its means.
            family.mean_within(format!("sky cos^{n}, {}", way.name()), &found, 0.5 * e / PI, 5e-4);
        }
    }
    family.finish();
}

/// Samples shared by all pixels of a pass: passes are independent, pixels of one point are equal.
#[test]
fn shared_light_samples_have_the_same_mean() {
    let way = Way { integrator: "direct", settings: &[("sampling", "light"), ("shared", "true")] };
    let scene = Eye::on_floor(2).scene(&(FLOOR.to_owned() + &rectangle([-1.0, 1.0], [-1.0, 1.0])));
    let mut found = testkit::statistics::Moments::default();
    for seed in 0..400 {
        let image = way.render(&scene, 0..4, seed, 1).0.film().develop();
        let pixels: Vec<f32> = image.mean.iter().map(|p| p[1]).collect();
        assert!(pixels.iter().all(|p| (p - pixels[0]).abs() < 1e-3 * pixels[0]), "{pixels:?}");
        found.push(f64::from(pixels[0]));
    }
    let mut family = Family::default();
    family.mean_within("square, shared", &found, 0.5 * 1.740_839_5 / PI, 1e-5);
    family.finish();
}

#[test]
fn spectral_mode_agrees() {
    let mut family = Family::default();
    for (name, world, e) in lamps().into_iter().step_by(4) {
        let scene = Eye::on_floor(128).spectral_scene(&(FLOOR.to_owned() + &world));
        for way in &WAYS[..1] {
            // An upsampled grey and the lamp's white are exact to about 1e-3 in R, G, B.
            for m in way.rgb_moments(&scene, 77) {
                family.mean_within(format!("{name}, spectral, {}", way.name()), &m, 0.5 * e / PI, 1e-3);
            }
        }
    }
    family.finish();
}
