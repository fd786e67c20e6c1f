//! `ao` against closed forms: values, and the variance of a single ray under both samplings.
//!
//! Wall of height h at distance d: A = (1 + 1/√(1 + (h/d)²))/2. Sphere of radius R on the plane at lateral distance x:
//! A = 1 − (1 + (x/R)²)^(−3/2). Cosine sampling: Var = A(1 − A). Uniform sampling: E[X²] = (4/2π) ∫ V cos² dω.

use steradian_tests::{Eye, Family, Way};

const FLOOR: &str = "Material \"diffuse\"\n\
    Shape \"trianglemesh\" \"point3 P\" [-9 -9 0  9 -9 0  9 9 0  -9 9 0] \"integer indices\" [0 1 2  0 2 3]\n";

/// A wall at x = 1 that is endless sideways.
fn wall(height: f64) -> String {
    format!(
        "Shape \"trianglemesh\" \"integer indices\" [0 1 2  0 2 3]\n\
         \"point3 P\" [1 -1e4 0  1 1e4 0  1 1e4 {height}  1 -1e4 {height}]\n"
    )
}

fn sphere(x: f64) -> String {
    format!("Translate {x} 0 1\nShape \"sphere\"\n")
}

const COSINE: Way<'_> = Way { integrator: "ao", settings: &[("sampling", "cosine")] };
const UNIFORM: Way<'_> = Way { integrator: "ao", settings: &[("sampling", "uniform")] };

#[test]
fn ambient_occlusion_and_its_variance() {
    let hole = "Translate 0 0 1\nShape \"disk\" \"float radius\" [1e4] \"float innerradius\" [1]".to_owned();
    let lid = "Translate 0 0 1\nShape \"disk\" \"float radius\" [1]".to_owned();
    // Name, scene, A, variance under uniform sampling where the table has it.
    let cases = [
        ("wall h/d = 0.5", wall(0.5), 0.947_213_6, Some(0.409_106_9)),
        ("wall h/d = 1", wall(1.0), 0.853_553_4, Some(0.483_653_2)),
        ("wall h/d = 2", wall(2.0), 0.723_606_8, Some(0.509_603_3)),
        ("endless wall", wall(1e5), 0.5, Some(5.0 / 12.0)),
        ("sphere x/R = 0.5", sphere(0.5), 0.284_458_2, None),
        ("sphere x/R = 1", sphere(1.0), 0.646_446_6, Some(0.407_064_7)),
        ("sphere x/R = 2", sphere(2.0), 0.910_557_3, Some(0.411_157_8)),
        ("sphere x/R = 4", sphere(4.0), 0.985_733_2, None),
        ("cone of 45°", hole, 0.5, Some(0.611_928_8)),
        ("ring from 45°", lid, 0.5, Some(0.221_404_5)),
    ];
    let mut family = Family::default();
    for (seed, (name, world, a, uniform_variance)) in cases.into_iter().enumerate() {
        let scene = Eye::on_floor(256).scene(&(FLOOR.to_owned() + &world));
        let seed = 100 + seed as u64;
        let cosine = COSINE.moments(&scene, seed);
        family.mean(format!("{name}, cosine"), &cosine, a);
        family.variance(format!("{name}, cosine"), &cosine, a * (1.0 - a));
        let uniform = UNIFORM.moments(&scene, seed);
        family.mean(format!("{name}, uniform"), &uniform, a);
        if let Some(v) = uniform_variance {
            family.variance(format!("{name}, uniform"), &uniform, v);
        }
    }
    family.finish();
}

#[test]
fn the_open_sky_has_no_variance_under_cosine_sampling() {
    let scene = Eye::on_floor(256).scene(FLOOR);
    let mut family = Family::default();
    family.exact("open, cosine", &COSINE.moments(&scene, 1), 1.0);
    let uniform = UNIFORM.moments(&scene, 1);
    family.mean("open, uniform", &uniform, 1.0);
    family.variance("open, uniform", &uniform, 1.0 / 3.0);
    family.finish();
}

/// N rays divide the variance by N; the albedo is a factor; what is farther than the limit does not occlude: of a
/// lid at height 1, seen within 1.2, only cos θ > 1/1.2 occludes, A = 1/1.44.
#[test]
fn rays_albedo_and_distance() {
    let scene = Eye::on_floor(256).scene(&(FLOOR.to_owned() + &wall(1.0)));
    let way =
        Way { integrator: "ao", settings: &[("samples", "4"), ("albedo", "0.5"), ("sampling", "uniform")] };
    let mut family = Family::default();
    let four = way.moments(&scene, 3);
    family.mean("wall, 4 rays, albedo 0.5", &four, 0.5 * 0.853_553_4);
    family.variance("wall, 4 rays, albedo 0.5", &four, 0.25 * 0.25 * 0.483_653_2);

    let lid = "Translate 0 0 1\nShape \"disk\" \"float radius\" [1e3]";
    let scene = Eye::on_floor(256).scene(&(FLOOR.to_owned() + lid));
    for sampling in ["cosine", "uniform"] {
        let way = Way { integrator: "ao", settings: &[("distance", "1.2"), ("sampling", sampling)] };
        family.mean(format!("lid, distance 1.2, {sampling}"), &way.moments(&scene, 4), 1.0 / 1.44);
    }
    family.finish();
}

#[test]
fn spectral_mode_is_grey() {
    let scene = Eye::on_floor(128).spectral_scene(&(FLOOR.to_owned() + &wall(1.0)));
    let found = COSINE.rgb_moments(&scene, 5);
    let mut family = Family::default();
    found.iter().for_each(|m| family.mean("wall h/d = 1, spectral", m, 0.853_553_4));
    family.finish();
}
