//! `bdpt show=strategies`: the layers are exact sums as the image is, the weighted ones add up to it, and every strategy
//! alone makes the same picture.

use std::path::Path;

use film::Merged;
use integrators::StrategyLayer;
use render::SceneOptions;
use scene::Scene;
use steradian_tests::{SIGNIFICANCE, Way, bytes, open};
use testkit::statistics::{Moments, sidak, welch_test};

const SHOWN: Way<'_> =
    Way { integrator: "bdpt", settings: &[("show", "strategies"), ("show_depth", "2"), ("max_depth", "2")] };

fn scene(name: &str, options: SceneOptions) -> Scene {
    open(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name), &options)
}

/// A wide filter, a crop, a lens; and lamps without a surface.
const SCENES: [&str; 3] = ["orthographic.pbrt", "wide-lens.pbrt", "points.pbrt"];

#[test]
fn weighted_layers_add_up_to_the_image_which_they_do_not_change() {
    for name in SCENES {
        let scene = scene(name, SceneOptions::default());
        let image = SHOWN.render(&scene, 0..4, 3, 2).0;
        let plain = Way { settings: &[("max_depth", "2")], ..SHOWN };
        let plain = plain.render(&scene, 0..4, 3, 2).0.film().develop();
        let settings = image.film().settings();
        let names: Vec<&String> = settings.aovs.iter().chain(&settings.splat_aovs).collect();
        let developed = image.film().develop();
        assert_eq!((&developed.mean, &developed.variance), (&plain.mean, &plain.variance), "{name}");
        for (rgb, layers) in developed.mean.iter().zip(developed.aovs.chunks_exact(names.len())) {
            for (c, channel) in [".weighted.R", ".weighted.G", ".weighted.B"].into_iter().enumerate() {
                let of_channel = names.iter().zip(layers).filter(|(n, _)| n.ends_with(channel));
                let sum: f64 = of_channel.map(|(_, x)| f64::from(*x)).sum();
                assert!(
                    (sum - f64::from(rgb[c])).abs() < 1e-5 * (1.0 + sum.abs()),
                    "{name}: {sum} {}",
                    rgb[c]
                );
            }
        }
    }
}

#[test]
fn layers_are_exact_for_any_threads_and_any_split_into_passes() {
    let scene =
        scene("wide-lens.pbrt", SceneOptions { resolution: Some([70, 40]), ..SceneOptions::default() });
    let whole = bytes(SHOWN.render(&scene, 0..4, 1, 1).0.film());
    assert!(whole == bytes(SHOWN.render(&scene, 0..4, 1, 3).0.film()), "threads");
    let (first, second) = (SHOWN.render(&scene, 0..1, 1, 2).0, SHOWN.render(&scene, 1..4, 1, 2).0);
    let mut film = film::Film::from_bytes(&bytes(second.film())).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(film.merge(first.film()).unwrap_or_else(|e| panic!("{e}")), Merged::Added);
    assert!(whole == bytes(&film), "passes");
}

/// Means of the unweighted layers over the film, per seed: those of one length are one, whatever the crop.
#[test]
fn every_strategy_alone_makes_the_same_picture_in_a_crop() {
    let mut failures = String::new();
    for name in ["orthographic.pbrt", "points.pbrt"] {
        let crop = math::Bounds2i::new([4, 6], [16, 24]);
        let scene = scene(name, SceneOptions { crop: Some(crop), ..SceneOptions::default() });
        let has_delta_light = scene.lights.ids().any(|l| scene.lights.is_delta(l));
        let mut layers: Vec<(StrategyLayer, Moments)> = Vec::new();
        for seed in 0..24 {
            let image = SHOWN.render(&scene, 0..24, seed, 2).0;
            let (settings, developed) = (image.film().settings(), image.film().develop());
            let names: Vec<&String> = settings.aovs.iter().chain(&settings.splat_aovs).collect();
            let shown = names.iter().enumerate().filter_map(|(i, n)| {
                let layer = StrategyLayer::parse(n.strip_suffix(".G")?)?;
                let mean =
                    developed.aovs.iter().skip(i).step_by(names.len()).map(|x| f64::from(*x)).sum::<f64>();
                (!layer.is_weighted).then_some((layer, mean / developed.mean.len() as f64))
            });
            for (k, (layer, mean)) in shown.enumerate() {
                if seed == 0 {
                    layers.push((layer, Moments::default()));
                }
                layers[k].1.push(mean);
            }
        }
        layers.retain(|(l, _)| l.depth() > 0 && (l.s > 0 || !has_delta_light));
        for (layer, moments) in &layers {
            let next_event = layers.iter().find(|(l, _)| l.s == 1 && l.depth() == layer.depth());
            let t = welch_test(moments, next_event.map_or(&Moments::default(), |(_, m)| m));
            if !t.is_consistent(sidak(SIGNIFICANCE, 14)) {
                failures += &format!("{name} {}: {} {t:?}\n", layer.name(), moments.mean());
            }
        }
    }
    assert!(failures.is_empty(), "{failures}");
}
