//! Virtual lights against path tracing, on every small scene: with compensation the bound on near ones is no bias,
//! and cuts are right within their error. All tests of this file are one family with a false-alarm rate of 1 %.
#![allow(clippy::print_stdout, reason = "figures of the tests")]

mod common;

use common::{Estimate, estimate, scene, worst};
use testkit::statistics::sidak;

/// Scenes × ways × tiles × colours.
const FAMILY: usize = 14 * 2 * 9 * 3;

const BATCHES: u32 = 24;

/// Few light paths a pass: noisy, but as right as many. Clamping far out, so that much is left to compensation.
const ALL: &[&str] = &["max_depth=4", "light_paths=24", "gather=all", "clamping=0.3"];
const CUTS: &[&str] = &["max_depth=4", "light_paths=96", "max_cut=24", "clamping=0.1"];

fn agrees(name: &str, spectral: bool) {
    let scene = scene(name, spectral);
    let path = estimate(&scene, "path", &["max_depth=4"], BATCHES, 4);
    let alpha = sidak(0.01, FAMILY);
    for set in [ALL, CUTS] {
        let found: Estimate = estimate(&scene, "many-light", set, BATCHES, 2);
        let (tile, t) = worst(&path, &found, &[]);
        let [a, b] = [&path, &found].map(|e| e.tiles[tile].mean());
        let line = format!(
            "{name}: {}: tile {} colour {}: {b:.5}, path {a:.5} ({:+.2} %), t = {:.2}, p = {:.1e}",
            found.label,
            tile / 3,
            tile % 3,
            100.0 * (b / a - 1.0),
            t.statistic,
            t.p_value
        );
        println!("{line}");
        assert!(t.is_consistent(alpha), "p < {alpha:.1e}: {line}");
    }
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
}

#[test]
fn in_wavelengths() {
    agrees("dispersion", true);
    agrees("rough-glass", true);
}
