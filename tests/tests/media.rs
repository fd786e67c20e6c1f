//! Participating media against closed forms (ground truth, sec. 6): transmittance, emission, single scattering, albedos of
//! half-spaces and slabs, and furnaces that show one whatever is in them.
//!
//! Half-spaces and slabs lie between wide disks. Under an even sky the eye sees a directional albedo (by reciprocity).

use scene::Scene;
use steradian_tests::{Eye, Family, Way, replicates};

const NONE: (&str, &str) = ("max_depth", "none");
const PATH: Way<'_> = Way { integrator: "path", settings: &[NONE] };
const BLIND_PATH: Way<'_> = Way { integrator: "path", settings: &[NONE, ("shadow_rays", "false")] };
const BDPT: Way<'_> = Way { integrator: "bdpt", settings: &[NONE] };
const LIGHT: Way<'_> = Way { integrator: "light", settings: &[NONE] };
const MLT: Way<'_> = Way { integrator: "mlt", settings: &[NONE, ("pilot", "256"), ("chain", "128")] };

const SKY: &str = "LightSource \"infinite\" \"rgb L\" [1 1 1]\n";

/// A homogeneous medium "m" with absorption and scattering in R, G and B.
fn homogeneous(a: [f64; 3], s: [f64; 3], g: f64) -> String {
    let [[a0, a1, a2], [s0, s1, s2]] = [a, s];
    format!(
        "MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [{a0} {a1} {a2}]\n\
         \"rgb sigma_s\" [{s0} {s1} {s2}] \"float g\" [{g}]\n"
    )
}

/// Grey, with extinction one.
fn grey(albedo: f64, g: f64) -> String {
    homogeneous([1.0 - albedo; 3], [albedo; 3], g)
}

/// "m" between z = 0 and −`depth`; without end below for `None`.
fn slab(depth: Option<f64>) -> String {
    let wide = |z: f64| format!("Shape \"disk\" \"float radius\" [1e3] \"float height\" [{z}]\n");
    let below = depth.map_or(String::new(), |d| format!("MediumInterface \"\" \"m\"\n{}", wide(-d)));
    format!(
        "Material \"interface\"\nMediumInterface \"m\" \"\"\n{}{below}MediumInterface \"\" \"\"\n",
        wide(0.0)
    )
}

/// A black floor below everything.
const BLACK: &str = "Material \"diffuse\" \"rgb reflectance\" [0 0 0]\nShape \"disk\" \"float radius\" [1e3] \"float height\" [-100]\n";

/// An eye that sees the origin from the cosine `mu` to the z axis, below it for `mu` < 0.
fn eye(mu: f64, side: u32) -> Eye {
    Eye::at([(1.0 - mu * mu).sqrt(), 0.0, mu], [0.0; 3], side)
}

/// The eye and the world in a medium "m".
fn in_medium(eye: &Eye, medium: &str, world: &str) -> Scene {
    let head = eye.head();
    let (options, camera) = head.split_at(head.find("LookAt").unwrap_or(0));
    // The medium is made before the camera, as the world's.
    let text =
        format!("{options}MediumInterface \"\" \"m\"\n{camera}{medium}MediumInterface \"\" \"m\"\n{world}");
    steradian_tests::compile(&text, &render::SceneOptions::default())
}

fn check(family: &mut Family, name: &str, scene: &Scene, (ways, truth, uncertainty): (&[Way<'_>], f64, f64)) {
    for (i, way) in ways.iter().enumerate() {
        let name = format!("{name}, {}", way.name());
        family.mean_within(name, &way.moments(scene, 20 + i as u64), truth, uncertainty);
    }
}

/// What is seen through absorbing and scattering media without an event (depth 0), and what they emit.
#[test]
fn light_that_comes_straight() {
    let ways = ["path", "light", "mlt"].map(|integrator| Way { integrator, settings: &[("max_depth", "0")] });
    let walk = Way { integrator: "bdpt", settings: &[("max_depth", "0")] };
    let mut family = Family::default();
    let world = homogeneous([0.3, 0.5, 0.0], [0.2, 0.5, 2.0], 0.0) + SKY + &slab(Some(1.0));
    let scene = eye(1.0, 64).scene(&world);
    for way in &ways {
        for (c, truth) in [0.606_530_7, 0.367_879_4, 0.135_335_3].into_iter().enumerate() {
            family.exact(format!("slab, {}, {c}", way.name()), &way.rgb_moments(&scene, 1)[c], truth);
        }
    }
    for (c, truth) in [0.606_530_7, 0.367_879_4, 0.135_335_3].into_iter().enumerate() {
        family.mean(format!("slab, bdpt, {c}"), &walk.rgb_moments(&scene, 1)[c], truth);
    }

    // Density 0.5 and 1.5 at the middles of two cells, fading to half of that at the faces: depth 0.875.
    let grid = "MakeNamedMedium \"m\" \"string type\" \"uniformgrid\" \"integer nx\" 3 \"integer ny\" 3 \"integer nz\" 2\n\
         \"float density\" [.5 .5 .5 .5 .5 .5 .5 .5 .5 1.5 1.5 1.5 1.5 1.5 1.5 1.5 1.5 1.5]\n\
         \"point3 p0\" [-1 -1 -1] \"point3 p1\" [1 1 0]";
    for (name, coefficients) in
        [("absorbs", "\"rgb sigma_s\" [0 0 0]"), ("scatters", "\"rgb sigma_a\" [0 0 0]")]
    {
        let scene = eye(1.0, 128).scene(&(format!("{grid} {coefficients}\n") + SKY + &slab(Some(1.0))));
        for way in ways.iter().chain([&walk]) {
            let found = way.moments(&scene, 3);
            family.mean(format!("grid that {name}, {}", way.name()), &found, 0.416_862_0);
        }
    }

    // Emission: 1 − e⁻¹ of a black body's.
    let glow =
        "MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"rgb sigma_s\" [0 0 0] \"rgb Le\" [1 1 1]\n";
    let scene = eye(1.0, 32).scene(&(glow.to_owned() + &slab(Some(1.0))));
    for way in [ways[0], ways[2], walk] {
        family.exact(format!("emission, {}", way.name()), &way.moments(&scene, 4), 0.632_120_6);
    }
    let glow = format!(
        "{grid} \"rgb sigma_s\" [0 0 0] \"rgb Le\" [1 1 1] \"float Lescale\" [{}]\n",
        "2 ".repeat(18)
    );
    let scene = eye(1.0, 128).scene(&(glow + &slab(Some(1.0))));
    for way in [ways[0], ways[2], walk] {
        let found = way.moments(&scene, 5);
        family.mean(format!("emission of a grid, {}", way.name()), &found, GRID_GLOW);
    }
    family.finish();
}

/// `∫ σ_a L e^{−τ}` of the grid above with an Le of two at every point, which fades at the faces as the density does.
const GRID_GLOW: f64 = 1.033_790_9;

#[test]
fn single_scattering_in_a_slab() {
    let mut family = Family::default();
    let ways = [
        Way { integrator: "path", settings: &[("max_depth", "1")] },
        Way { integrator: "bdpt", settings: &[("max_depth", "1")] },
    ];
    // Albedo, depth, cosines of eye and light; reflected and transmitted.
    for (w, tau, [mu, mu0], [reflected, transmitted]) in [
        (0.8, 1.0, [1.0, 1.0], [0.027_523_13, 0.023_419_93]),
        (0.8, 1.0, [0.5, 1.0], [0.040_328_29, 0.029_608_44]),
        (0.8, 1.0, [0.5, 0.5], [0.031_247_98, 0.017_231_44]),
        (1.0, 2.0, [0.8, 0.6], [0.034_004_76, 0.011_079_81]),
    ] {
        // The light comes from the side, so that an eye below is not in its beam.
        let y = f64::sqrt(1.0 - mu0 * mu0);
        let world = grey(w, 0.0)
            + &format!(
                "LightSource \"distant\" \"rgb L\" [1 1 1] \"point3 from\" [0 {y} {mu0}] \"point3 to\" [0 0 0]\n"
            )
            + &slab(Some(tau));
        for (side, truth) in [(1.0, reflected), (-1.0, transmitted)] {
            let mut eye = eye(side * mu, 96);
            if side < 0.0 {
                (eye.from[2], eye.to[2]) = (eye.from[2] - tau, -tau);
            }
            let name = format!("w = {w}, depth {tau}, {mu} and {mu0}, side {side}");
            check(&mut family, &name, &eye.scene(&world), (&ways, truth, 1e-6));
        }
    }

    // A point light at distance h of a ray through an endless medium, the eye in the medium too.
    let eye = Eye::at([0.0, 1.0, -2.0], [0.0, 1.0, 0.0], 128);
    let medium = homogeneous([0.0; 3], [1.0; 3], 0.0);
    let scene = in_medium(&eye, &medium, "LightSource \"point\"\n");
    check(&mut family, "point light in an endless medium", &scene, (&ways, 0.008_933_16, 1e-6));

    // In thin mist, by equal angles too, a light is seen far more surely.
    let coefficient = 0.02;
    let scene = in_medium(&eye, &homogeneous([0.0; 3], [coefficient; 3], 0.0), "LightSource \"point\"\n");
    let by = |name: &'static str| {
        let settings = [("max_depth", "1"), ("equiangular", name)];
        Way { integrator: "path", settings: &settings }.moments(&scene, 6)
    };
    let (both, flights) = (by("true"), by("false"));
    family.same("thin mist, with and without equal angles", &both, &flights);
    family.mean_within("thin mist", &both, thin_mist(coefficient), 1e-5);
    family.holds("far less noise", both.variance() < 0.02 * flights.variance());
    family.finish();
}

/// What a point light of intensity one at distance 1 of a ray adds to it by single scattering without absorption, from 2 before
/// it on, by Simpson's rule over the angle.
fn thin_mist(sigma: f64) -> f64 {
    let f = |angle: f64| {
        let s = angle.tan();
        // ds = (1 + s²) dθ, over d² = 1 + s².
        sigma / (4.0 * std::f64::consts::PI) * (-sigma * (s + 2.0 + (1.0 + s * s).sqrt())).exp()
    };
    let (from, to, n) = ((-2.0_f64).atan(), std::f64::consts::FRAC_PI_2 - 1e-9, 20_000);
    let h = (to - from) / f64::from(n);
    let weight = |i| if i == 0 || i == n { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
    (0..=n).map(|i| weight(i) * f(from + h * f64::from(i))).sum::<f64>() * h / 3.0
}

/// Who walks from lights says no to light from beyond a medium without end, and takes it where the medium ends.
#[test]
fn endless_media_under_a_sky_are_refused_by_name() {
    let refusal = |scene: &Scene, name: &str| (integrators::find(name).unwrap().refuses)(scene);
    let eye = Eye::at([0.0, 1.0, -2.0], [0.0, 1.0, 0.0], 8);
    let sphere =
        "Material \"interface\"\nMediumInterface \"m\" \"\"\nShape \"sphere\" \"float radius\" [9]\n";
    for light in [SKY, "LightSource \"distant\"\n"] {
        let endless = in_medium(&eye, &grey(0.5, 0.0), light);
        let ends = in_medium(&eye, &grey(0.5, 0.0), &format!("{sphere}MediumInterface \"\" \"\"\n{light}"));
        for name in ["light", "bdpt", "mlt", "vcm", "sppm", "photon", "many-light"] {
            let said = refusal(&endless, name).unwrap_or_default();
            assert!(said.contains("medium around the camera has no end"), "{name}: {said}");
            assert_eq!(refusal(&ends, name), None, "{name}");
        }
        for name in ["path", "guided", "irradiance-cache"] {
            assert_eq!(refusal(&endless, name), None, "{name}");
        }
    }
}

/// Chandrasekhar's H functions; with a boundary of glass; van de Hulst's slabs.
#[test]
fn albedos_of_half_spaces_and_slabs() {
    let mut family = Family::default();
    for (w, albedo, oblique, brdf) in
        [(0.5, 0.115_225_9, 0.160_144_4, 0.031_147_6), (0.9, 0.414_947_5, 0.507_938_9, 0.122_572_3)]
    {
        let world = grey(w, 0.0) + &slab(None);
        for (mu, truth) in [(1.0, albedo), (0.5, oblique)] {
            let scene = eye(mu, 96).scene(&(world.clone() + SKY));
            check(
                &mut family,
                &format!("half-space {w} at {mu}"),
                &scene,
                (&[PATH, BLIND_PATH, BDPT], truth, 1e-6),
            );
        }
        let sun = "LightSource \"distant\" \"rgb L\" [1 1 1] \"point3 from\" [0 0 1] \"point3 to\" [0 0 0]\n";
        let scene = eye(1.0, 96).scene(&(world + sun));
        check(&mut family, &format!("half-space {w} under a sun"), &scene, (&[PATH, BDPT], brdf, 1e-6));
    }

    for (w, n, truth) in [(0.9, 1.5, 0.259_918_6), (0.9, 1.33, 0.294_791_4), (0.5, 1.5, 0.084_245_9)] {
        let world = grey(w, 0.0)
            + SKY
            + &format!(
                "Material \"dielectric\" \"float eta\" [{n}]\nMediumInterface \"m\" \"\"\n\
                 Shape \"disk\" \"float radius\" [1e3]\n"
            );
        let scene = eye(1.0, 96).scene(&world);
        check(&mut family, &format!("half-space {w} under glass {n}"), &scene, (&[PATH, BDPT], truth, 1e-6));
    }

    for (w, g, tau, mu, [reflected, transmitted]) in [
        (0.9, 0.75, 2.0, 1.0, [0.097_394_7, 0.660_957_8]),
        (1.0, 0.0, 1.0, 1.0, [0.341_329_0, 0.658_671_4]),
        (0.8, 0.0, 1.0, 1.0, [0.210_846_7, 0.541_399_7]),
        (0.9, 0.0, 4.0, 1.0, [0.408_142_6, 0.128_523_9]),
    ] {
        let world = grey(w, g) + SKY + BLACK + &slab(Some(tau));
        let scene = eye(mu, 96).scene(&world);
        check(&mut family, &format!("slab {w} {g} {tau} reflects"), &scene, (&[PATH, BDPT], reflected, 2e-6));
        let below = Eye::at([0.0, 0.0, -tau - 1.0], [0.0, 0.0, -tau], 96).scene(&world);
        check(
            &mut family,
            &format!("slab {w} {g} {tau} transmits"),
            &below,
            (&[PATH, BDPT], transmitted, 2e-6),
        );
    }
    family.finish();
}

/// The same by a diffusion profile, exactly; and with coefficients, what half-spaces of them give back; on the albedo that a
/// walk under the same border has.
#[test]
fn separable_materials_have_their_reflectance() {
    let mut family = Family::default();
    let guided = Way { integrator: "guided", settings: &[NONE, ("training", "16")] };
    let plane = "Shape \"disk\" \"float radius\" [1e3]\n";
    for (eta, f, reflectance, rough) in
        [(1.33, 0.020_060, [0.8, 0.5, 0.1], 0.0), (1.5, 0.04, [0.6, 0.9, 0.3], 0.0)]
    {
        let [r, g, b] = reflectance;
        let world = format!(
            "{SKY}Material \"subsurface\" \"string method\" \"separable\" \"rgb reflectance\" [{r} {g} {b}]\n\
             \"rgb mfp\" [0.1 0.3 2] \"float eta\" [{eta}] \"float roughness\" [{rough}]\n{plane}"
        );
        let scene = eye(1.0, 96).scene(&world);
        for (i, way) in [PATH, BLIND_PATH, guided].iter().enumerate() {
            for (c, m) in way.rgb_moments(&scene, 50 + i as u64).iter().enumerate() {
                let name = format!("separable {eta}, {}, {c}", way.name());
                family.mean_within(name, m, f + (1.0 - f) * reflectance[c], 1e-4);
            }
        }
    }

    // Chandrasekhar's half-spaces have no border.
    let world = format!(
        "{SKY}Material \"subsurface\" \"string method\" \"separable\" \"rgb sigma_a\" [0.5 0.2 0.1]\n\
         \"rgb sigma_s\" [0.5 0.8 0.9] \"float eta\" [1]\n{plane}"
    );
    let scene = eye(1.0, 96).scene(&world);
    for (m, albedo) in PATH.rgb_moments(&scene, 60).iter().zip([0.146_544_4, 0.341_866_8, 0.478_025_4]) {
        // The table of albedos has an error of a quarter of a per cent.
        family.mean_within(format!("half-space {albedo}"), m, albedo, 4e-3);
    }
    family.finish();
}

/// Those who know no diffusion profiles say so, and who does.
#[test]
fn separable_materials_are_refused_by_name() {
    let world = format!("{SKY}Material \"subsurface\" \"string method\" \"separable\"\nShape \"sphere\"\n");
    let scene = eye(1.0, 8).scene(&world);
    for info in integrators::list() {
        let said = (info.refuses)(&scene);
        match info.name {
            "path" | "guided" => assert_eq!(said, None, "{}", info.name),
            name => assert!(said.is_some_and(|s| s.contains("path and guided do")), "{name}: {said:?}"),
        }
    }
}

/// A half-space of given reflectance shows F + (1 − F) R of an even sky.
#[test]
fn subsurface_materials_have_their_reflectance() {
    let mut family = Family::default();
    for (eta, f, reflectance, mfp) in
        [(1.33, 0.020_060, [0.8, 0.5, 0.1], 0.3), (1.5, 0.04, [0.6, 0.9, 0.3], 2.0)]
    {
        let [r, g, b] = reflectance;
        let world = format!(
            "{SKY}Material \"subsurface\" \"rgb reflectance\" [{r} {g} {b}] \"rgb mfp\" [{mfp} {mfp} {mfp}]\n\
             \"float eta\" [{eta}]\nShape \"disk\" \"float radius\" [1e3]\n"
        );
        let scene = eye(1.0, 96).scene(&world);
        for (i, way) in [PATH, BLIND_PATH, BDPT].iter().enumerate() {
            // Albedo inversion has an error of a quarter of a per cent.
            for (c, m) in way.rgb_moments(&scene, 40 + i as u64).iter().enumerate() {
                let name = format!("subsurface {eta}, {}, {c}", way.name());
                family.mean_within(name, m, f + (1.0 - f) * reflectance[c], 4e-3);
            }
        }
    }
    family.finish();
}

/// A ball of what scatters and does not absorb, or that glows as much as the sky, has the sky's radiance.
#[test]
fn balls_in_a_furnace_cannot_be_seen() {
    let grid =
        "\"integer nx\" 2 \"integer ny\" 2 \"integer nz\" 2 \"point3 p0\" [-1 -1 -1] \"point3 p1\" [1 1 1]";
    let density = "\"float density\" [1 2 3 4 5 6 7 8]";
    let media = [
        ("grey", homogeneous([0.0; 3], [2.0; 3], 0.6), "interface"),
        ("of colours", homogeneous([0.0; 3], [0.5, 2.0, 5.0], -0.3), "interface"),
        (
            "that varies",
            format!(
                "MakeNamedMedium \"m\" \"string type\" \"uniformgrid\" {grid} {density}\n\
                 \"rgb sigma_s\" [0.2 0.6 1] \"rgb sigma_a\" [0 0 0]\n"
            ),
            "interface",
        ),
        (
            "of grids of colours",
            format!(
                "MakeNamedMedium \"m\" \"string type\" \"rgbgrid\" {grid} \"rgb sigma_a\" [{}]\n\
                 \"rgb sigma_s\" [1 2 3  4 5 6  1 0 0  0 1 0  2 2 2  3 2 1  0 0 0  5 5 5]\n",
                "0 ".repeat(24)
            ),
            "interface",
        ),
        ("in glass", homogeneous([0.0; 3], [1.0, 2.0, 3.0], 0.0), "dielectric"),
        (
            "that glows",
            "MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [1 2 .5] \"rgb sigma_s\" [1 1 2]\n\
             \"rgb Le\" [1 1 1]\n"
                .to_owned(),
            "interface",
        ),
    ];
    let mut family = Family::default();
    for (name, medium, material) in media {
        let world =
            format!("{medium}{SKY}Material \"{material}\"\nMediumInterface \"m\" \"\"\nShape \"sphere\"\n");
        let scene = Eye { window: 1.0, ..Eye::at([0.0, 0.3, 3.0], [0.0, 0.3, 0.0], 32) }.scene(&world);
        for way in [PATH, BLIND_PATH, BDPT, LIGHT, MLT] {
            // Light paths do not see into glass, and none starts in what glows.
            if way.integrator == "light" && matches!(name, "in glass" | "that glows") {
                continue;
            }
            let found = replicates(&way, &scene, 2, 0..24);
            for (c, m) in found.iter().enumerate() {
                family.mean(format!("ball {name}, {}, {c}", way.name()), m, 1.0);
            }
        }
    }
    family.finish();
}
