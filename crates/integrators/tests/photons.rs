//! Photon methods agree with path tracing where the radius is so small that noise hides the bias: on lenses, delta and
//! infinite lights, shading normals, cut-outs, glass and dispersion. Welch tests over the means of tiles; all tests of this
//! file are one family with a false-alarm rate of 1 % (Šidák).
//!
//! The radius is a third of a pixel's width: its bias is some 0.1 % (what the scenes show with larger radii, and that it
//! goes with r² away from edges), the noise of a tile 1 %.

mod common;

use common::{Findings, estimate, scene};
use testkit::statistics::sidak;

/// Scenes, methods, tiles and the whole picture, colours.
const FAMILY: usize = (8 + 2) * 5 * (9 + 1) * 3;

const SMALL: &[&str] = &["radius_pixels=0.33"];
const MANY: &str = "photons=3000";
const BATCHES: u32 = 24;

#[test]
fn photon_methods_agree_with_path_tracing() {
    all_agree(
        &[
            ("small-lamp", false),
            ("sky", false),
            ("points", false),
            ("shading-normals", false),
            ("lens-and-motion", false),
            ("instances", false),
            ("lens-stack", false),
            ("dispersion", true),
        ],
        MANY,
        SMALL,
    );
}

/// Mist, a cloud, what is in rough glass and under rough surfaces. In so small a ball there are so few photons that noise hides its
/// bias too: a tile may differ by some 15 % unseen, the whole picture by 7 %. (Longer runs: docs/proofs.md.)
#[test]
fn in_media_too() {
    all_agree(
        &[("smoke", false), ("wax", false)],
        "photons=12000",
        &["radius_pixels=0.33", "medium_radius=1"],
    );
}

fn all_agree(scenes: &[(&str, bool)], photons: &str, radius: &[&str]) {
    let mut findings = Findings::new(sidak(0.01, FAMILY));
    for &(name, spectral) in scenes {
        let scene = scene(name, spectral);
        let path = estimate(&scene, "path", &["max_depth=4"], BATCHES, 12);
        let ways: [(&str, &[&str]); 5] = [
            ("photon", &["nearest=0", "gather_rays=2"]),
            ("sppm", &["alpha=1"]),
            ("vcm", &["alpha=1"]),
            ("vcm", &["alpha=1", "mode=ppm"]),
            ("vcm", &["alpha=1", "mode=bpm"]),
        ];
        // Nothing is joined to a camera through a stack of lenses.
        for (method, own) in ways.into_iter().filter(|w| w.0 != "vcm" || name != "lens-stack") {
            let set = [&["max_depth=4", photons], radius, own].concat();
            let found = estimate(&scene, method, &set, BATCHES, 2);
            findings.compare_tiles(name, &found, &path, &[]);
            findings.compare_whole(name, &found, &path);
        }
    }
    findings.end();
}

/// A pass whose light paths do not fit into the budget says so.
#[test]
fn a_budget_that_is_reached_is_told() {
    let scene = scene("small-lamp", false);
    for (name, photons, is_told) in
        [("sppm", "photons=20000", true), ("vcm", "photons=20000", true), ("sppm", "photons=500", false)]
    {
        let mut it = common::integrator(&scene, name, &[photons, "photon_memory=1"], 1);
        let warning = it.prepare(steradian_integrators::PassContext { scene: &scene, pass: 0 }).warning;
        assert_eq!(warning.is_some(), is_told, "{name} {photons}");
        assert!(warning.is_none_or(|w| w.contains("of 20000 light paths within 1 MiB")));
    }
}
