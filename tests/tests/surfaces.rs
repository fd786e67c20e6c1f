//! Materials, cut-outs, instances and motion under an even sky or lamp, against closed forms: what surfaces show
//! when everything around them has the radiance 1.
//!
//! Energy of GGX with height-correlated masking and F = 1: tables of directional albedo, ± 2e-5. Fresnel reflectance of
//! a conductor n = 0.2, k = 3.9 at 0°, 60°, 80°.

use steradian_tests::{Eye, Family, Way, compile};

const NONE: (&str, &str) = ("max_depth", "none");

const WALKS: [Way<'_>; 6] = [
    Way { integrator: "path", settings: &[NONE] },
    Way { integrator: "path", settings: &[NONE, ("shadow_rays", "false")] },
    Way { integrator: "path", settings: &[NONE, ("mis", "false")] },
    Way { integrator: "path", settings: &[NONE, ("sampling", "cosine")] },
    Way { integrator: "recursive", settings: &[NONE, ("branching", "2,1")] },
    Way { integrator: "bdpt", settings: &[NONE] },
];

const SKY: &str = "LightSource \"infinite\" \"rgb L\" [1 1 1]\n";
const SHEET: &str = "Shape \"disk\" \"float radius\" [9]\n";

/// An eye that sees the origin from the cosine `mu` to the z axis.
fn from_cosine(mu: f64, side: u32) -> Eye {
    Eye::at([(1.0 - mu * mu).sqrt(), 0.0, mu], [0.0; 3], side)
}

#[test]
fn energy_of_rough_metal() {
    let mut family = Family::default();
    for (alpha, energies) in [
        (0.1, [0.9883, 0.969_21, 0.883_45]),
        (0.25, [0.915_81, 0.857_26, 0.891_62]),
        (0.5, [0.687_85, 0.698_25, 0.860_11]),
        (1.0, [0.306_85, 0.450_69, 0.760_21]),
    ] {
        for (mu, energy) in [1.0, 0.5, 0.1].into_iter().zip(energies) {
            let metal = format!(
                "{SKY}Material \"conductor\" \"rgb reflectance\" [1 1 1] \"float roughness\" [{alpha}]\n\
                 \"bool remaproughness\" false\n{SHEET}"
            );
            let scene = from_cosine(mu, 128).scene(&metal);
            let rough = alpha > 0.2;
            // Walks that leave sharp lobes to other densities have tails that 16384 samples do not tell.
            let ways = WALKS.iter().enumerate().filter(|(i, _)| rough || [0, 1, 5].contains(i));
            for (i, way) in ways {
                let found = way.moments(&scene, 10 + i as u64);
                // Reflectances end at 0.9999, as in pbrt-v4.
                family.mean_within(format!("GGX {alpha} at {mu}, {}", way.name()), &found, energy, 1.2e-4);
            }
            let direct = Way { integrator: "direct", settings: &[] };
            family.mean_within(
                format!("GGX {alpha} at {mu}, direct"),
                &direct.moments(&scene, 9),
                energy,
                1.2e-4,
            );
        }
    }
    family.finish();
}

#[test]
fn fresnel_reflectance_of_a_smooth_metal() {
    let mut family = Family::default();
    for (degrees, truth) in [(0.0_f64, 0.951_952), (60.0, 0.945_882_4), (80.0, 0.948_407_4)] {
        let metal = format!(
            "{SKY}Material \"conductor\" \"spectrum eta\" [300 0.2 900 0.2] \"spectrum k\" [300 3.9 900 3.9]\n\
             \"float roughness\" [0]\n{SHEET}"
        );
        let scene = from_cosine(libm::cos(degrees.to_radians()), 16).scene(&metal);
        for way in &WALKS {
            // The window of 10⁻⁴ does not change the angle: rays are parallel.
            family.exact(format!("metal at {degrees}°, {}", way.name()), &way.moments(&scene, 1), truth);
        }
    }
    family.finish();
}

/// A sheet that scatters to both sides shows ρ + τ; a mixture shows the mean; a convex instance shows ρ, however it is
/// stretched.
#[test]
fn sheets_mixtures_and_instances() {
    let diffuse = |rho: f64| format!("\"string type\" \"diffuse\" \"rgb reflectance\" [{rho} {rho} {rho}]");
    let cases = [
        (
            "sheet of 0.3 and 0.4",
            format!(
                "Material \"diffusetransmission\" \"rgb reflectance\" [0.3 0.3 0.3] \"rgb transmittance\" [0.4 0.4 0.4]\n{SHEET}"
            ),
            0.7,
        ),
        (
            "mixture of 0.2 and 0.8",
            format!(
                "MakeNamedMaterial \"a\" {}\nMakeNamedMaterial \"b\" {}\n\
                 Material \"mix\" \"string materials\" [\"a\" \"b\"] \"float amount\" [0.25]\n{SHEET}",
                diffuse(0.2),
                diffuse(0.8)
            ),
            0.35,
        ),
        (
            "stretched instance",
            "Material \"diffuse\" \"rgb reflectance\" [0.6 0.6 0.6]\nObjectBegin \"o\"\nShape \"sphere\"\nObjectEnd\n\
             Translate 0 0 -0.2\nScale 2 1 0.2\nRotate 30 0 1 0\nObjectInstance \"o\"\n"
                .to_owned(),
            0.6,
        ),
        (
            "cut-out of 0.3 before the sky",
            "Material \"diffuse\" \"rgb reflectance\" [0 0 0]\n\
                 Shape \"disk\" \"float radius\" [9] \"float alpha\" [0.3]\n".to_owned(),
            0.7,
        ),
    ];
    let mut family = Family::default();
    for (name, world, truth) in cases {
        let scene =
            Eye { window: 1e-3, ..Eye::at([0.1, 0.2, 2.0], [0.0; 3], 128) }.scene(&format!("{SKY}{world}"));
        for (i, way) in WALKS.iter().enumerate() {
            family.mean(format!("{name}, {}", way.name()), &way.moments(&scene, 20 + i as u64), truth);
        }
    }
    family.finish();
}

/// A cut-out between lamp and floor takes its share of the light, by whatever ray finds out.
#[test]
fn shadows_of_cut_outs() {
    let world = "Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\n\
        Shape \"disk\" \"float radius\" [9]\nMaterial \"diffuse\" \"rgb reflectance\" [0 0 0]\n\
        AttributeBegin\nTranslate 0 0 0.3\nShape \"disk\" \"float radius\" [9] \"float alpha\" [0.25]\nAttributeEnd\n\
        AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\nTranslate 0 0 2\nShape \"sphere\"\n";
    let scene = Eye::on_floor(160).scene(world);
    let truth = 0.75 * 0.25 * 0.5;
    let mut family = Family::default();
    for (i, way) in WALKS.iter().enumerate() {
        family.mean(format!("cut-out's shadow, {}", way.name()), &way.moments(&scene, 30 + i as u64), truth);
    }
    for sampling in ["light", "bsdf", "mis", "uniform"] {
        let settings = [("sampling", sampling)];
        let way = Way { integrator: "direct", settings: &settings };
        family.mean(format!("cut-out's shadow, {}", way.name()), &way.moments(&scene, 40), truth);
    }
    let open = Way { integrator: "ao", settings: &[("distance", "0.6")] };
    // Within 0.6 the cut-out at 0.3 takes a quarter of what is above cos θ = 1/2, which is 3/4 of the sky.
    family.mean("cut-out, ao", &open.moments(&scene, 41), 1.0 - 0.25 * 0.75);
    family.finish();
}

/// A black disk leaves the middle after 0.8 of the shutter; and a lens blurs its edge to the share of the lens that
/// sees past it.
#[test]
fn motion_and_focus() {
    let moving = "ActiveTransform EndTime\nTranslate 2 0 0\nActiveTransform All\nTranslate -0.6 0 0\n\
        Material \"diffuse\" \"rgb reflectance\" [0 0 0]\n";
    // It covers x = 0 while |2t − 0.6| < 1: until t = 0.8.
    let scene = Eye::at([0.0, 0.0, 2.0], [0.0; 3], 128).scene(&format!("{SKY}{moving}Shape \"disk\"\n"));
    let mut family = Family::default();
    for (i, way) in WALKS.iter().enumerate() {
        family.mean(format!("moving disk, {}", way.name()), &way.moments(&scene, 50 + i as u64), 0.2);
    }

    // In focus at 2, a half plane at 1 cuts the lens' cone in the middle: half of the sky is seen.
    let head = "Film \"rgb\" \"integer xresolution\" [128] \"integer yresolution\" [128]\nPixelFilter \"box\"\n\
        Sampler \"independent\"\nLookAt 0 0 2  0 0 0  0 1 0\n\
        Camera \"perspective\" \"float fov\" [0.001] \"float lensradius\" [0.2] \"float focaldistance\" [2]\nWorldBegin\n";
    let half = "Material \"diffuse\" \"rgb reflectance\" [0 0 0]\nShape \"trianglemesh\" \"integer indices\" [0 1 2]\n\
        \"point3 P\" [0 -900 1  900 0 1  0 900 1]\n";
    let scene = compile(&format!("{head}{SKY}{half}"), &render::SceneOptions::default());
    // A disk of radius 0.05 there hides the part (0.05 / 0.1)² of the lens.
    let disk = "Material \"diffuse\" \"rgb reflectance\" [0 0 0]\nTranslate 0 0 1\nShape \"disk\" \"float radius\" [0.05]\n";
    let small = compile(&format!("{head}{SKY}{disk}"), &render::SceneOptions::default());
    for (i, way) in WALKS.iter().enumerate() {
        family.mean(
            format!("half plane before the lens, {}", way.name()),
            &way.moments(&scene, 60 + i as u64),
            0.5,
        );
        family.mean(
            format!("disk before the lens, {}", way.name()),
            &way.moments(&small, 70 + i as u64),
            0.75,
        );
    }
    family.finish();
}

/// Spectral mode: an even sky over a coloured sheet shows its R, G, B; a lamp's irradiance keeps its colour.
#[test]
fn colours_in_spectral_mode() {
    let sheet = format!("{SKY}Material \"diffuse\" \"rgb reflectance\" [0.7 0.4 0.2]\n{SHEET}");
    let lamp = format!(
        "Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\n{SHEET}\
         Material \"diffuse\" \"rgb reflectance\" [0 0 0]\n\
         AreaLightSource \"diffuse\" \"rgb L\" [3 2 1]\nTranslate 0 0 2\nShape \"sphere\"\n"
    );
    let mut family = Family::default();
    let scenes = [
        ("sheet", Eye::on_floor(128).spectral_scene(&sheet), [0.7, 0.4, 0.2]),
        ("lamp", Eye::on_floor(128).spectral_scene(&lamp), [0.375, 0.25, 0.125]),
    ];
    for (name, scene, truth) in &scenes {
        for way in [WALKS[0], WALKS[1], WALKS[4], WALKS[5]] {
            for (c, m) in way.rgb_moments(scene, 5).iter().enumerate() {
                // Upsampled colours come back to about 2e-3.
                let name = format!("spectral {name} {}, {}", ["R", "G", "B"][c], way.name());
                family.mean_within(name, m, truth[c], 2e-3);
            }
        }
    }
    family.finish();
}
