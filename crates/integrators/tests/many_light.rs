//! Virtual lights against path tracing, on every small scene: with compensation the bound on near ones is no bias,
//! and cuts are right within their error. All tests of this file are one family with a false-alarm rate of 1 %.
#![allow(clippy::print_stdout, reason = "figures of the tests")]

mod common;

use common::{Findings, estimate, scene};
use testkit::statistics::sidak;

/// Scenes × ways × tiles × colours.
const FAMILY: usize = 16 * 2 * 9 * 3;

const BATCHES: u32 = 24;

/// Few light paths a pass: noisy, but as right as many. Clamping far out, so that much is left to compensation.
const ALL: &[&str] = &["max_depth=4", "light_paths=24", "gather=all", "clamping=0.3"];
const CUTS: &[&str] = &["max_depth=4", "light_paths=96", "max_cut=24", "clamping=0.1"];

fn agrees(name: &str, spectral: bool) {
    let scene = scene(name, spectral);
    let path = estimate(&scene, "path", &["max_depth=4"], BATCHES, 4);
    let mut findings = Findings::new(sidak(0.01, FAMILY));
    for set in [ALL, CUTS] {
        findings.compare_tiles(name, &estimate(&scene, "many-light", set, BATCHES, 2), &path, &[]);
    }
    findings.end();
}

#[test]
fn on_lamps_a_coat_and_a_translucent_ball() {
    agrees("large-lamp", false);
    agrees("small-lamp", false);
    agrees("many-lamps", false);
}

#[test]
fn on_a_sky_points_and_spots() {
    agrees("sky", false);
    agrees("points", false);
}

#[test]
fn on_glass_and_mirrors() {
    agrees("glass", false);
    agrees("rough-glass", false);
}

#[test]
fn on_shading_normals_motion_cut_outs_and_cameras() {
    agrees("shading-normals", false);
    agrees("lens-and-motion", false);
    agrees("instances", false);
    agrees("orthographic", false);
    agrees("wide-lens", false);
    agrees("lens-stack", false);
}

#[test]
fn in_media() {
    agrees("smoke", false);
}

/// The cache is biased by its interpolation: with fine records by no more than one per cent of a tile, here, beside
/// noise. (Its walks have the numbers of path's, so that they differ by far less.)
#[test]
fn the_cache_is_right_in_media_within_its_error() {
    let scene = scene("smoke", false);
    let path = estimate(&scene, "path", &["max_depth=4"], BATCHES, 8);
    let set = ["max_depth=4", "error=0.1", "min_spacing=0.5", "rays=2048"];
    let found = estimate(&scene, "irradiance-cache", &set, BATCHES, 8);
    for (i, (a, b)) in path.tiles.iter().zip(&found.tiles).enumerate() {
        let noise = 4.0 * a.std_error().hypot(b.std_error());
        let (a, b) = (a.mean(), b.mean());
        println!("tile {i}: path {a:.5}, cache {b:.5} ({:+.2} %), noise {noise:.5}", 100.0 * (b / a - 1.0));
        assert!((a - b).abs() < noise + 0.01 * a, "tile {i}: path {a}, cache {b}, noise {noise}");
    }
}

#[test]
fn in_wavelengths() {
    agrees("dispersion", true);
    agrees("rough-glass", true);
}
