//! Bodies that overlap against closed forms: what is seen through stacked slabs of glass and water, of which the one of
//! the higher priority fills what both claim; what an eye in them sees; and what comes out is what no overlap gives.

use scene::Scene;
use steradian_tests::{Eye, Family, Way};

const NONE: (&str, &str) = ("max_depth", "none");
const PATH: Way<'_> = Way { integrator: "path", settings: &[NONE] };
const BDPT: Way<'_> = Way { integrator: "bdpt", settings: &[NONE] };
const RECURSIVE: Way<'_> = Way { integrator: "recursive", settings: &[NONE, ("branching", "1")] };

const WATER: f64 = 1.33;
const GLASS: f64 = 1.5;

/// A black lamp of radiance one far below.
const LAMP: &str = "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\nMaterial \"diffuse\" \"rgb reflectance\" [0 0 0]\n\
     Shape \"disk\" \"float radius\" [1e3] \"float height\" [-50]\nAttributeEnd\n";

/// A slab between two heights, of the current material and media.
fn slab(bottom: f64, top: f64) -> String {
    let disk = |z: f64| format!("Shape \"disk\" \"float radius\" [1e3] \"float height\" [{z}]\n");
    format!("{}AttributeBegin\nReverseOrientation\n{}AttributeEnd\n", disk(top), disk(bottom))
}

fn glass(eta: f64, priority: Option<i32>) -> String {
    let priority = priority.map_or(String::new(), |p| format!(" \"integer priority\" [{p}]"));
    format!("Material \"dielectric\" \"float eta\" [{eta}]{priority}\n")
}

/// Reflectance of a border at normal incidence.
fn fresnel(eta: f64) -> f64 {
    ((eta - 1.0) / (eta + 1.0)).powi(2)
}

/// What passes a stack of borders and absorbing layers one after the other, all bounces included.
fn stack(parts: &[[f64; 2]]) -> f64 {
    // Transmittance, and reflectance from before and from behind.
    let (mut t, mut r_front, mut r_back) = (1.0, 0.0, 0.0);
    for &[reflectance, transmittance] in parts {
        let pass = 1.0 / (1.0 - r_back * reflectance);
        r_front += t * t * reflectance * pass;
        r_back = reflectance + transmittance * transmittance * r_back * pass;
        t *= transmittance * pass;
    }
    assert!(r_front >= 0.0 && t <= 1.0);
    t
}

fn border(eta: f64) -> [f64; 2] {
    [fresnel(eta), 1.0 - fresnel(eta)]
}

/// Absorbs e^−depth.
fn layer(depth: f64) -> [f64; 2] {
    [0.0, (-depth).exp()]
}

fn from_above(world: &str) -> Scene {
    Eye::at([0.0, 0.0, 20.0], [0.0; 3], 96).scene(&(LAMP.to_owned() + world))
}

const DYE: &str = "MakeNamedMedium \"dye\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0.4 0.4 0.4] \"rgb sigma_s\" [0 0 0]\n";

/// Water from 0 to 1 on glass from −1 to 0, whichever way the file makes them overlap; and air between, and none at all.
#[test]
fn light_through_a_stack_does_not_see_what_is_displaced() {
    let mut family = Family::default();
    let (water, pane) = (glass(WATER, Some(1)), glass(GLASS, Some(2)));
    let clear = stack(&[border(WATER), border(GLASS / WATER), border(GLASS)]);
    for (seed, (name, world)) in (10..).zip([
        ("water into glass", format!("{water}{}{pane}{}", slab(-0.4, 1.0), slab(-1.0, 0.0))),
        ("glass first", format!("{pane}{}{water}{}", slab(-1.0, 0.0), slab(-0.4, 1.0))),
        ("glass into water", {
            let (water, pane) = (glass(WATER, Some(7)), glass(GLASS, Some(-3)));
            format!("{water}{}{pane}{}", slab(0.0, 1.0), slab(-1.0, 0.6))
        }),
        // No surface of the water is there below, though it ends where the glass does.
        (
            "water all through",
            format!("{water}{}{pane}{}", slab(-1.3, 1.0), {
                // Beyond the glass there is air again: a body of air.
                format!("{}{}{}", slab(-1.0, 0.0), glass(1.0, Some(9)), slab(-1.5, -0.9))
            }),
        ),
        // Water in two pieces that overlap each other.
        ("two pieces", format!("{water}{}{}{pane}{}", slab(0.3, 1.0), slab(-0.2, 0.5), slab(-1.0, 0.0))),
    ]) {
        let scene = from_above(&world);
        for way in [PATH, BDPT, RECURSIVE] {
            family.mean(format!("{name}, {}", way.name()), &way.moments(&scene, seed), clear);
        }
    }

    // What absorbs does so where it is, and no further.
    let filled = |inside: &str, world: String| {
        format!("MediumInterface \"{inside}\" \"\"\n{world}MediumInterface \"\" \"\"\n")
    };
    let (low, high) = (slab(-0.4, 1.0), slab(-1.0, 0.0));
    for (name, [in_water, in_glass], depths) in
        [("dyed water", ["dye", ""], [0.4, 0.0]), ("dyed glass", ["", "dye"], [0.0, 0.4])]
    {
        let water = filled(in_water, format!("{water}{low}"));
        let pane = filled(in_glass, format!("{pane}{high}"));
        let parts = [border(WATER), layer(depths[0]), border(GLASS / WATER), layer(depths[1]), border(GLASS)];
        let scene = from_above(&format!("{DYE}{water}{pane}"));
        for way in [PATH, BDPT] {
            family.mean(format!("{name}, {}", way.name()), &way.moments(&scene, 2), stack(&parts));
        }
    }
    family.finish();
}

/// The picture of slabs that overlap is that of three borders made by hand, each with its relative index.
#[test]
fn overlapping_slabs_look_like_borders_made_by_hand() {
    let mut family = Family::default();
    let (water, pane) = (glass(WATER, Some(1)), glass(GLASS, Some(2)));
    let overlapping = format!("{water}{}{pane}{}", slab(-0.4, 1.0), slab(-1.0, 0.0));
    let disk = |eta: f64, z: f64| {
        format!("{}Shape \"disk\" \"float radius\" [1e3] \"float height\" [{z}]\n", glass(eta, None))
    };
    let by_hand = disk(WATER, 1.0) + &disk(GLASS / WATER, 0.0) + &disk(1.0 / GLASS, -1.0);
    // From the side, on a lamp that ends: a ray that is bent wrongly misses it or finds it.
    let lamp = "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\nMaterial \"diffuse\" \"rgb reflectance\" [0 0 0]\n\
         Shape \"disk\" \"float radius\" [3.2] \"float height\" [-3]\nAttributeEnd\n";
    let eye = Eye { from: [-3.0, 0.0, 3.0], to: [-1.0, 0.0, 1.0], window: 3.0, side: 96 };
    let scenes = [&overlapping, &by_hand].map(|world| eye.scene(&(lamp.to_owned() + world)));
    for way in [PATH, BDPT, RECURSIVE] {
        let [a, b] = [0, 1].map(|i| way.moments(&scenes[i], 5 + i as u64));
        assert!(a.mean() > 0.1 && a.mean() < 0.9, "{}", a.mean());
        family.same(way.name(), &a, &b);
    }
    family.finish();
}

/// Radiance over the square of the index is the same everywhere along a ray: under an even sky an eye in a body sees that
/// square, whatever bodies are around.
#[test]
fn an_eye_in_bodies_sees_the_square_of_its_index() {
    let mut family = Family::default();
    let sphere = |z: f64, radius: f64| {
        format!(
            "AttributeBegin\nTranslate 0 0 {z}\nShape \"sphere\" \"float radius\" [{radius}]\nAttributeEnd\n"
        )
    };
    let world = format!(
        "LightSource \"infinite\" \"rgb L\" [1 1 1]\n{}{}{}{}",
        glass(WATER, Some(1)),
        sphere(0.0, 1.0),
        glass(GLASS, Some(2)),
        sphere(0.6, 0.7),
    );
    // In water, in both, in glass that leaves the water, outside.
    for (z, eta) in [(-0.5, WATER), (0.3, GLASS), (1.2, GLASS), (-3.0, 1.0)] {
        for to in [z - 1.0, z + 1.0] {
            let scene = Eye::at([0.0, 0.0, z], [0.0, 0.0, to], 16).scene(&world);
            for way in [PATH, BDPT, RECURSIVE] {
                let found = way.moments(&scene, 3);
                family.exact(format!("from {z} to {to}, {}", way.name()), &found, eta * eta);
            }
        }
    }
    family.finish();
}

/// A priority that nothing overlaps changes no bit.
#[test]
fn priorities_that_do_nothing() {
    let world = |p: &str| {
        format!(
            "{LAMP}LightSource \"point\" \"point3 from\" [1 1 5]\nMaterial \"dielectric\" \"float roughness\" [0.3] {p}\n\
             Shape \"sphere\"\nMaterial \"diffuse\"\nShape \"disk\" \"float radius\" [9] \"float height\" [-2]\n"
        )
    };
    let eye = Eye { window: 3.0, ..Eye::at([1.0, 0.0, 5.0], [0.0; 3], 16) };
    let (plain, bounded) = (eye.scene(&world("")), eye.scene(&world("\"integer priority\" [4]")));
    for way in
        [PATH, BDPT, Way { integrator: "light", settings: &[] }, Way { integrator: "ao", settings: &[] }]
    {
        let image = |scene| way.render(scene, 0..2, 1, 2).0.film().develop().mean;
        assert!(image(&plain) == image(&bounded), "{}", way.name());
    }
}
