//! The film's bits depend on scene, method, seed and passes, and on nothing else: not on threads, not on the
//! instruction set that traces the rays, not on how passes are split over runs.
#![allow(clippy::print_stdout, reason = "which instruction sets were there is read with `--nocapture`")]

use std::path::Path;
use std::time::Duration;

use accel::Isa;
use film::Merged;
use render::{Cancel, Checkpoint, Event, SceneOptions, Stop};
use scene::Scene;
use steradian_tests::{Way, bytes, open, workers};

/// Wider than a tile, so that threads have tiles to take from each other.
const SIZE: [u32; 2] = [72, 40];

fn scene(name: &str, isa: Option<Isa>) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    open(&path, &SceneOptions { resolution: Some(SIZE), isa, ..SceneOptions::default() })
}

/// Every integrator there is, with its default parameters, or cheaper ones where a pass of these small pictures would
/// be all preparation.
fn ways() -> Vec<Way<'static>> {
    let way = |integrator: &'static str| match integrator {
        "irradiance-cache" => Way { integrator, settings: &[("rays", "64"), ("min_spacing", "8")] },
        "many-light" => Way { integrator, settings: &[("light_paths", "64"), ("max_cut", "40")] },
        _ => Way { integrator, settings: &[] },
    };
    integrators::list().iter().map(|i| way(i.name)).collect()
}

/// Those that render a scene.
fn ways_for(scene: &Scene) -> Vec<Way<'static>> {
    let renders =
        |way: &Way<'_>| integrators::find(way.integrator).is_ok_and(|info| (info.refuses)(scene).is_none());
    ways().into_iter().filter(renders).collect()
}

#[test]
fn the_same_bits_on_one_two_and_three_threads() {
    for name in ["large-lamp.pbrt", "rough-glass.pbrt", "smoke.pbrt", "instanced-lamps.pbrt"] {
        let scene = scene(name, None);
        for way in ways_for(&scene) {
            let one = bytes(way.render(&scene, 0..3, 1, 1).0.film());
            for threads in [2, 3] {
                let many = bytes(way.render(&scene, 0..3, 1, threads).0.film());
                assert!(one == many, "{name}, {}: {threads} threads", way.name());
            }
        }
    }
}

#[test]
fn the_same_bits_for_every_instruction_set() {
    for name in
        ["large-lamp.pbrt", "instances.pbrt", "lens-and-motion.pbrt", "moving-vertices.pbrt", "glass.pbrt"]
    {
        let scenes: Vec<(Isa, Scene)> = Isa::ALL
            .into_iter()
            .filter(|isa| isa.is_available())
            .map(|isa| (isa, scene(name, Some(isa))))
            .collect();
        println!("{name}: {:?}", scenes.iter().map(|s| s.0).collect::<Vec<_>>());
        for way in ways() {
            let first = bytes(way.render(&scenes[0].1, 0..2, 1, 2).0.film());
            for (isa, scene) in &scenes[1..] {
                let other = bytes(way.render(scene, 0..2, 1, 2).0.film());
                assert!(first == other, "{name}, {}: {isa:?} and {:?}", way.name(), scenes[0].0);
            }
        }
    }
}

#[test]
fn passes_merge_to_the_same_bits() {
    let scene = scene("many-lamps.pbrt", None);
    for way in ways() {
        let whole = way.render(&scene, 0..16, 1, 2).0;
        let (a, b) = (way.render(&scene, 0..8, 1, 2).0, way.render(&scene, 8..16, 1, 1).0);
        for [x, y] in [[&a, &b], [&b, &a]] {
            let mut film = film::Film::from_bytes(&bytes(x.film())).unwrap_or_else(|e| panic!("{e}"));
            let other = film::Film::from_bytes(&bytes(y.film())).unwrap_or_else(|e| panic!("{e}"));
            assert!(matches!(film.merge(&other), Ok(Merged::Added)), "{}", way.name());
            assert!(bytes(&film) == bytes(whole.film()), "{}: 0..8 and 8..16 are not 0..16", way.name());
        }
    }
}

/// A process that dies leaves its last checkpoint: for methods with memory too, what goes on from it is the whole.
#[test]
fn what_goes_on_from_a_checkpoint_is_the_uninterrupted_render() {
    let folder = tempfile::tempdir().unwrap_or_else(|e| panic!("{e}"));
    let [path, left] = ["running", "left"].map(|name| folder.path().join(name));
    for name in ["many-lamps.pbrt", "smoke.pbrt"] {
        let scene = scene(name, None);
        for way in ways_for(&scene) {
            let whole = bytes(way.render(&scene, 0..6, 1, 2).0.film());

            // The first checkpoint is all that is left of this one.
            let first = Checkpoint { path: path.clone(), every: Duration::ZERO, resume: false };
            let mut has_left = false;
            way.job(&scene, 1)
                .render(&Stop::Passes(0..6), Some(&first), &workers(2), &Cancel::default(), &mut |event| {
                    if matches!(event, Event::Checkpoint { .. }) && !std::mem::replace(&mut has_left, true) {
                        std::fs::copy(&path, &left).unwrap_or_else(|e| panic!("{e}"));
                    }
                })
                .unwrap_or_else(|e| panic!("{}: {e}", way.name()));
            assert!(has_left, "{}: no checkpoint", way.name());

            let second = Checkpoint { path: left.clone(), every: Duration::from_secs(3600), resume: true };
            let mut job = way.job(&scene, 1);
            let resumed =
                job.render(&Stop::Passes(0..6), Some(&second), &workers(3), &Cancel::default(), &mut |_| {});
            let resumed = resumed.unwrap_or_else(|e| panic!("{}: {e}", way.name())).passes_resumed;
            assert!((1..=5).contains(&resumed), "{name}, {}: {resumed} of 6 passes were there", way.name());
            assert!(bytes(job.film()) == whole, "{name}, {}", way.name());
        }
    }
}

#[test]
fn other_seeds_are_other_images() {
    let scene = scene("large-lamp.pbrt", None);
    for way in ways() {
        // Half of all rays are open: cosine sampling would have three values for two samples.
        let uniform: &[_] = if way.integrator == "ao" { &[("sampling", "uniform")] } else { &[] };
        let way = Way { settings: uniform, ..way };
        let of = |seed| way.render(&scene, 0..2, seed, 2).0.film().develop().mean;
        let (a, again, b) = (of(1), of(1), of(2));
        assert!(a == again, "{}", way.name());
        // Where one of them is lit at all: few light paths leave most pixels black.
        let lit: Vec<_> = a.iter().zip(&b).filter(|(x, y)| **x != [0.0; 3] || **y != [0.0; 3]).collect();
        let same = lit.iter().filter(|(x, y)| x == y).count();
        assert!(lit.len() > 100, "{}: nothing is lit", way.name());
        assert!(same < lit.len() / 4, "{}: {same} of {} pixels are the same", way.name(), lit.len());
    }
}

/// Four wavelengths as well.
#[test]
fn spectral_renders_are_the_same_on_every_thread_count() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/glass.pbrt");
    let scene =
        open(&path, &SceneOptions { resolution: Some(SIZE), spectral: true, ..SceneOptions::default() });
    for way in ways() {
        let one = bytes(way.render(&scene, 0..2, 1, 1).0.film());
        let three = bytes(way.render(&scene, 0..2, 1, 3).0.film());
        assert!(one == three, "{}", way.name());
    }
}

/// Sobol pixels depend on each other's numbers by design, but not on the tile that they are rendered in.
#[test]
fn a_crop_is_a_part_of_the_whole() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/large-lamp.pbrt");
    let crop = math::Bounds2i::new([20, 10], [50, 30]);
    for sampler in ["sobol", "independent", "stratified"] {
        let options = SceneOptions {
            resolution: Some(SIZE),
            settings: vec![("sampler".to_owned(), sampler.to_owned())],
            ..SceneOptions::default()
        };
        let (all, part) = (open(&path, &options), open(&path, &SceneOptions { crop: Some(crop), ..options }));
        let way = Way { integrator: "path", settings: &[] };
        let of = |scene| way.render(scene, 0..4, 1, 2).0.film().develop();
        let (all, part) = (of(&all), of(&part));
        for (i, pixel) in part.mean.iter().enumerate() {
            let (x, y) = (20 + i % 30, 10 + i / 30);
            assert!(*pixel == all.mean[y * SIZE[0] as usize + x], "{sampler}: pixel {x}, {y}");
        }
    }
}

#[test]
fn a_sketch_shows_samples_of_the_first_pass() {
    const STEP: usize = 16;
    let scene = scene("large-lamp.pbrt", None);
    let path = Way { integrator: "path", settings: &[] };
    let (job, _) = path.render(&scene, 0..1, 1, 2);
    let first = job.film().develop();
    let sketch = path.job(&scene, 1).sketch(STEP as u32, &workers(2));
    let sketch = sketch.unwrap_or_else(|e| panic!("{e}")).unwrap_or_else(|| panic!("path can be sketched"));
    assert_eq!([sketch.width(), sketch.height()], [72_usize.div_ceil(STEP), 40_usize.div_ceil(STEP)]);
    for y in 0..sketch.height() {
        for x in 0..sketch.width() {
            // In the middle of the square, or of what the picture has of it.
            let middle = |k: usize, n: usize| (k * STEP + (k * STEP + STEP).min(n)) / 2;
            let pixel = first.mean[middle(y, 40) * 72 + middle(x, 72)];
            assert_eq!(sketch.pixel(x, y), pixel, "{x}, {y}");
        }
    }
    for integrator in ["light", "sppm", "mlt"] {
        let way = Way { integrator, settings: &[] };
        let nothing = way.job(&scene, 1).sketch(STEP as u32, &workers(2));
        assert!(nothing.unwrap_or_else(|e| panic!("{e}")).is_none(), "{integrator}");
    }
}
