//! Scenes that others made, small and quick, against their reference's mean in R, G, B. They live outside the
//! repository (`../shared/scenes`); without them these tests say so and pass.
//!
//! A mean may be off by what the acceptance says of the scene, and by three standard errors of the estimate, found
//! from renders with different seeds.
#![allow(clippy::print_stdout, reason = "what was measured is read with `--nocapture`")]

use std::path::PathBuf;

use render::SceneOptions;
use steradian_tests::{Way, open, replicates};

/// The scene's folder, if it is there.
fn folder(name: &str) -> Option<PathBuf> {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let found = root.ancestors().map(|a| a.join("shared/scenes").join(name)).find(|p| p.is_dir());
    if found.is_none() {
        println!("SKIPPED: there is no shared/scenes/{name} beside the repository");
    }
    found
}

/// Renders at `1/divisor` of the resolution; `bounds` are relative, by channel.
fn means_agree(name: &str, divisor: u32, spp: u32, bounds: [f64; 3]) {
    let Some(folder) = folder(name) else { return };
    let reference = image::load_image(&folder.join("TungstenRender.exr")).and_then(|i| i.to_rgb());
    let reference = reference.unwrap_or_else(|e| panic!("{e}"));
    let size = [reference.width(), reference.height()].map(|n| n as u32 / divisor);
    let options = SceneOptions { resolution: Some(size), ..SceneOptions::default() };
    let scene = open(&folder.join("scene-v4.pbrt"), &options);

    let found = replicates(&Way { integrator: "path", settings: &[] }, &scene, spp, 0..6);
    let n = (reference.width() * reference.height()) as f64;
    let wrong: Vec<String> = (0..3)
        .filter_map(|c| {
            let truth = reference.data().chunks_exact(3).map(|p| f64::from(p[c])).sum::<f64>() / n;
            let (mean, error) = (found[c].mean(), found[c].std_error());
            let line = format!("{name} {}: {mean:.5} ± {error:.5}, reference {truth:.5}", ["R", "G", "B"][c]);
            println!("{line} ({:+.2} %)", 100.0 * (mean / truth - 1.0));
            assert!(error < bounds[c] * truth, "{line}: too noisy to tell");
            ((mean - truth).abs() > bounds[c] * truth + 3.0 * error).then_some(line)
        })
        .collect();
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn cornell_box_within_half_a_percent() {
    means_agree("cornell-box", 8, 4, [0.005; 3]);
}

#[test]
fn coffee_maker_within_five_percent() {
    means_agree("coffee-maker", 8, 4, [0.05; 3]);
}

#[test]
fn modern_hall_within_three_percent() {
    means_agree("modern-hall", 8, 4, [0.03; 3]);
}
