//! Manifold sampling: caustics that are seen over mirrors and refracting surfaces, so that no connection makes them, against closed
//! forms and against path tracing, which hits a large lamp by chance.
//!
//! What an eye sees through a pane of index one is what it sees without it, but no path can be connected to the eye there: every
//! caustic is manifold sampling's.

use std::f64::consts::PI;
use std::fmt::Write;

use scene::Scene;
use steradian_tests::{Eye, Family, Way, bytes, channel_moments, replicates};

const fn bdpt(settings: &'static [(&'static str, &'static str)]) -> Way<'static> {
    Way { integrator: "bdpt", settings }
}

const GLASS: &str = "Material \"dielectric\" \"float eta\" [1.5] \"float roughness\" [0]\n";
const WATER: &str = "Material \"dielectric\" \"float eta\" [1.33] \"float roughness\" [0]\n";
const MIRROR: &str = "Material \"conductor\" \"rgb reflectance\" [0.9 0.8 0.7] \"float roughness\" [0]\n";

fn square(half: f64, z: f64) -> String {
    format!(
        "Shape \"trianglemesh\" \"integer indices\" [0 1 2  0 2 3]\n\
         \"point3 P\" [-{half} -{half} {z}  {half} -{half} {z}  {half} {half} {z}  -{half} {half} {z}]\n"
    )
}

fn floor() -> String {
    format!("Material \"diffuse\" \"rgb reflectance\" [0.6 0.5 0.4]\n{}", square(20.0, 0.0))
}

/// A pane of index one before the eye, so small that light does not come through it.
fn pane([x, y, z]: [f64; 3]) -> String {
    format!(
        "Material \"dielectric\" \"float eta\" [1] \"float roughness\" [0]\n\
         AttributeBegin\nTranslate {x} {y} {z}\n{}AttributeEnd\n",
        square(1e-3, 0.0)
    )
}

/// Fresnel's transmittance into water at an angle, and the cosine there.
fn into_water(eta: f64, cos: f64) -> (f64, f64) {
    let far = (1.0 - (1.0 - cos * cos) / (eta * eta)).sqrt();
    let parallel = (eta * cos - far) / (eta * cos + far);
    let perpendicular = (cos - eta * far) / (cos + eta * far);
    (1.0 - 0.5 * (parallel * parallel + perpendicular * perpendicular), far)
}

/// Irradiance under flat water of depth `d` at the distance `r` from a lamp of intensity one that stands `h` above the water: what
/// leaves the lamp between two angles falls onto a ring.
fn under_water(eta: f64, h: f64, d: f64, r: f64) -> f64 {
    let radius = |cos: f64| {
        let (_, far) = into_water(eta, cos);
        let tan = |cos: f64| (1.0 - cos * cos).sqrt() / cos;
        h * tan(cos) + d * tan(far)
    };
    let (mut low, mut high) = (1e-9, 1.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if radius(middle) > r { low = middle } else { high = middle }
    }
    let step = 1e-6;
    let width = (radius(low - step) - radius(low + step)) / (2.0 * step);
    // dΩ = dcos dφ, dA = r dr dφ.
    into_water(eta, low).0 / (r * width)
}

/// Light of a lamp at a point, of a spot and of the sun under flat water, and its picture above: radiance falls by η² there.
#[test]
fn flat_water_refracts_by_snells_law() {
    let (eta, depth) = (1.33, 0.5);
    let seen = 0.5 / PI * into_water(eta, 1.0).0 / (eta * eta);
    let slant: f64 = 0.8;
    let lamp = "\"rgb I\" [1 1 1] \"point3 from\" [1 0 2]";
    let lamps = [
        ("point", format!("LightSource \"point\" {lamp}\n"), under_water(eta, 1.5, depth, 1.0)),
        (
            "spot",
            format!("LightSource \"spot\" {lamp} \"point3 to\" [0.2 0 0] \"float coneangle\" [40]\n"),
            under_water(eta, 1.5, depth, 1.0),
        ),
        (
            "sun",
            "LightSource \"distant\" \"rgb L\" [1 1 1] \"point3 from\" [0.6 0 0.8] \"point3 to\" [0 0 0]\n"
                .to_owned(),
            slant * into_water(eta, slant).0,
        ),
    ];
    let mut family = Family::default();
    for (name, lamp, irradiance) in lamps {
        let world = format!("{lamp}{}{WATER}{}", floor(), square(20.0, depth));
        let scene = Eye::at([0.0, 0.0, 1.0], [0.0; 3], 48).scene(&world);
        for way in
            [bdpt(&[("max_depth", "3"), ("manifold", "1")]), bdpt(&[("max_depth", "3"), ("manifold", "3")])]
        {
            let found = way.moments(&scene, 1);
            family.mean_within(format!("{name}, {}", way.name()), &found, irradiance * seen, 1e-4);
        }
        let mlt = Way {
            integrator: "mlt",
            settings: &[
                ("max_depth", "3"),
                ("manifold", "1"),
                ("pilot", "64"),
                ("chain", "64"),
                ("mutations", "1"),
            ],
        };
        let found = replicates(&mlt, &scene, 1, 0..8);
        family.mean_within(format!("{name}, mlt"), &found[1], irradiance * seen, 1e-4);
        let without = bdpt(&[("max_depth", "3")]).moments(&scene, 1);
        family.holds(format!("{name}: nothing without it"), without.mean() == 0.0);
    }
    family.finish();
}

/// A sheet of waves about the height `z` with its normals.
fn waves(z: f64) -> String {
    const N: usize = 24;
    let (mut p, mut n, mut indices) = (String::new(), String::new(), String::new());
    for i in 0..=N {
        for j in 0..=N {
            let at = |k: usize| 6.0 * (k as f64 / N as f64 - 0.5);
            let (x, y) = (at(i), at(j));
            let (sx, cx) = (2.3 * x + 0.4).sin_cos();
            let (sy, cy) = (1.9 * y - 0.3).sin_cos();
            let _ = write!(p, "{x} {y} {} ", z + 0.06 * sx + 0.05 * sy);
            let _ = write!(n, "{} {} 1 ", -0.06 * 2.3 * cx, -0.05 * 1.9 * cy);
            if i < N && j < N {
                let k = i * (N + 1) + j;
                let _ = write!(indices, "{k} {} {} {k} {} {} ", k + N + 1, k + N + 2, k + N + 2, k + 1);
            }
        }
    }
    format!("Shape \"trianglemesh\" \"integer indices\" [{indices}] \"point3 P\" [{p}] \"normal N\" [{n}]\n")
}

const LAMP: &str = "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [3 4 5]\nTranslate -0.5 0.4 3\n\
                    Shape \"sphere\" \"float radius\" [0.6]\nAttributeEnd\n";

/// Worlds with a large lamp: a name, a scene, and how long chains are there.
#[allow(clippy::too_many_lines, reason = "one entry a world")]
fn worlds() -> Vec<(&'static str, Scene, Way<'static>)> {
    const ONE: &[(&str, &str)] = &[("max_depth", "4"), ("manifold", "1")];
    const TWO: &[(&str, &str)] = &[("max_depth", "5"), ("manifold", "2")];
    const FOUR: &[(&str, &str)] = &[("max_depth", "6"), ("manifold", "4")];
    let eye = |x: f64| Eye::at([x, 0.0, 0.05], [x, 0.0, 0.0], 32);
    let before = |x: f64| pane([x, 0.0, 0.03]);
    let under = Eye::at([0.3, -1.0, 2.4], [0.2, 0.1, 0.0], 32);
    let ball = |place: &str| format!("AttributeBegin\n{place}\nShape \"sphere\"\nAttributeEnd\n");
    let large = "Translate 0 0 1.6";
    let near = format!("{}{}{GLASS}{}", floor(), before(0.15), ball(large));
    vec![
        ("waves", under.scene(&format!("{LAMP}{}{WATER}{}", floor(), waves(1.0))), bdpt(ONE)),
        ("a ball of glass", eye(0.15).scene(&format!("{LAMP}{near}")), bdpt(TWO)),
        (
            "an egg under waves",
            under.scene(&format!(
                "{LAMP}{}{WATER}{}{GLASS}{}ObjectBegin \"egg\"\nShape \"sphere\"\nObjectEnd\n\
                 AttributeBegin\nTranslate 0.1 0.3 0.45\nRotate 30 1 1 0\nScale 0.2 0.3 0.25\n\
                 ObjectInstance \"egg\"\nAttributeEnd\n",
                floor(),
                waves(1.0),
                ""
            )),
            bdpt(FOUR),
        ),
        (
            "in a ring of metal",
            eye(0.3).scene(&format!(
                "{LAMP}{}{}{MIRROR}Shape \"cylinder\" \"float radius\" [0.8] \"float zmin\" [0] \"float zmax\" [0.9]\n",
                floor(),
                before(0.3)
            )),
            bdpt(TWO),
        ),
        (
            "over a bent mirror",
            eye(0.3).scene(&format!(
                "{LAMP}{}{}{MIRROR}Shape \"bilinearmesh\" \"point3 P\" [-1 0.5 0  1.2 0.7 0  -1 0.9 1.4  1 0.4 1.3]\n",
                floor(),
                before(0.3)
            )),
            bdpt(ONE),
        ),
        (
            "dispersion",
            eye(0.15).spectral_scene(&format!(
                "{LAMP}{}{}Material \"dielectric\" \"spectrum eta\" [400 1.7 700 1.5] \"float roughness\" [0]\n{}",
                floor(),
                before(0.15),
                ball(large)
            )),
            bdpt(TWO),
        ),
        (
            "in mist",
            eye(0.15).scene(&format!(
                "MakeNamedMedium \"mist\" \"string type\" [\"homogeneous\"] \"rgb sigma_s\" [0.1 0.1 0.1] \"rgb sigma_a\" [0.1 0.2 0.3]\n\
                 {LAMP}{}{}MediumInterface \"mist\" \"\"\n{GLASS}{}",
                floor(),
                before(0.15),
                ball(large)
            )),
            bdpt(TWO),
        ),
    ]
}

/// Over waves, a ball and a ring several directions lead to a lamp, and Newton's method finds each with a chance of its own.
#[test]
fn a_large_lamp_is_found_as_by_chance() {
    let mut family = Family::default();
    for (name, scene, way) in worlds() {
        let chance = [way.settings[0]];
        let moments = |way: &Way<'_>, passes, seed| {
            channel_moments(&way.render(&scene, 0..passes, seed, 2).0.film().develop())
        };
        let path = moments(&Way { integrator: "path", settings: &chance }, 16, 3);
        let walks = moments(&Way { integrator: "bdpt", settings: &chance }, 8, 4);
        let found = moments(&way, 2, 5);
        for c in 0..3 {
            family.same(format!("{name}, bdpt manifold and path, {c}"), &found[c], &path[c]);
            family.same(format!("{name}, bdpt and path, {c}"), &walks[c], &path[c]);
        }
        if name.contains("mirror") || name == "waves" {
            let settings = [way.settings, &[("pilot", "256"), ("chain", "128"), ("mutations", "1")]].concat();
            let mlt = replicates(&Way { integrator: "mlt", settings: &settings }, &scene, 1, 0..8);
            family.same(format!("{name}, mlt manifold and path"), &mlt[1], &path[1]);
        }
    }
    family.finish();
}

#[test]
fn the_same_bits_on_any_number_of_threads_and_in_any_parts() {
    let scene = Eye { window: 1.0, ..Eye::at([0.3, -1.0, 2.4], [0.2, 0.1, 0.0], 36) }.scene(&format!(
        "{LAMP}{}{WATER}{}",
        floor(),
        waves(1.0)
    ));
    for integrator in ["bdpt", "mlt"] {
        let settings = [("manifold", "1"), ("max_depth", "3"), ("pilot", "64"), ("chain", "64")];
        let n = if integrator == "mlt" { 4 } else { 2 };
        let way = Way { integrator, settings: &settings[..n] };
        let whole = bytes(way.render(&scene, 0..2, 1, 1).0.film());
        assert!(bytes(way.render(&scene, 0..2, 1, 3).0.film()) == whole, "{integrator}: threads");
        let parts = [1..2, 0..1].map(|passes| bytes(way.render(&scene, passes, 1, 2).0.film()));
        let [mut film, other] = parts.map(|b| film::Film::from_bytes(&b).unwrap_or_else(|e| panic!("{e}")));
        film.merge(&other).unwrap_or_else(|e| panic!("{e}"));
        assert!(bytes(&film) == whole, "{integrator}: parts");
    }
}

#[test]
fn surfaces_by_chance_are_refused() {
    let refused = |world: &str| {
        let scene = Eye::on_floor(4).scene(world);
        let job = |manifold: &str| {
            let settings = [("manifold", manifold)].map(|(k, v)| (k.to_owned(), v.to_owned())).to_vec();
            let method = render::Method { integrator: Some("bdpt".to_owned()), settings, seed: None };
            render::Job::new(&scene, &method).is_err()
        };
        assert!(!job("0"));
        job("2")
    };
    assert!(!refused(&floor()));
    assert!(refused(
        "MakeNamedMaterial \"a\" \"string type\" \"diffuse\"\nMakeNamedMaterial \"b\" \"string type\" \"interface\"\n\
         Material \"mix\" \"string materials\" [\"a\" \"b\"]\nShape \"sphere\""
    ));
    assert!(refused("Shape \"sphere\" \"float alpha\" [0.5]"));
}
