//! Every pair of unbiased integrators agrees on every small scene: Welch tests over the means of tiles, both sides
//! noisy. All tests of this file are one family with a false-alarm rate of 1 % (Šidák).
//!
//! What a method cannot see is said in the table, tile by tile (3 × 3 of them, row by row from the top left).

mod common;

use common::{Estimate, Findings, estimate, scene};
use testkit::statistics::sidak;

/// Tests in the family: 27 renders of scenes, 28 pairs at most, 9 tiles, 3 colours.
const FAMILY: usize = 27 * 28 * 9 * 3;

/// An integrator with its work.
struct Method {
    name: &'static str,
    set: &'static [&'static str],
    /// Passes per batch.
    passes: u32,
    /// Tiles that it cannot see.
    blind: &'static [usize],
}

const fn method(name: &'static str, passes: u32) -> Method {
    Method { name, set: &["max_depth=4"], passes, blind: &[] }
}

/// Batches of passes, whose means are nearly normal.
const BATCHES: u32 = 24;

fn all_agree(name: &str, spectral: bool, methods: &[Method]) {
    let scene = scene(name, spectral);
    let estimates: Vec<Estimate> =
        methods.iter().map(|m| estimate(&scene, m.name, m.set, BATCHES, m.passes)).collect();
    let mut findings = Findings::new(sidak(0.01, FAMILY));
    for (i, a) in estimates.iter().enumerate() {
        for (j, b) in estimates.iter().enumerate().skip(i + 1) {
            findings.compare_tiles(name, a, b, &[methods[i].blind, methods[j].blind].concat());
        }
    }
    findings.end();
}

fn methods() -> Vec<Method> {
    vec![
        method("path", 6),
        method("recursive", 3),
        method("light", 8),
        method("bdpt", 4),
        method("guided", 6),
        Method { set: &["max_depth=4", "pilot=512", "chain=128"], ..method("mlt", 4) },
    ]
}

#[test]
fn on_a_large_lamp_with_metal_and_a_coat() {
    all_agree("large-lamp", false, &methods());
}

#[test]
fn on_a_small_lamp_and_a_translucent_ball() {
    all_agree("small-lamp", false, &methods());
}

#[test]
fn on_a_sky_and_a_sun() {
    all_agree("sky", false, &methods());
}

#[test]
fn on_an_image_of_a_sky() {
    all_agree("sky-image", false, &methods());
}

#[test]
fn on_a_sky_through_a_portal() {
    all_agree("portal", false, &methods());
}

#[test]
fn on_points_and_spots() {
    all_agree("points", false, &methods());
}

#[test]
fn on_rough_glass() {
    all_agree("rough-glass", false, &methods());
}

#[test]
fn on_shading_normals() {
    all_agree("shading-normals", false, &methods());
}

#[test]
fn on_a_lens_and_motion() {
    all_agree("lens-and-motion", false, &methods());
}

#[test]
fn on_meshes_whose_vertices_move() {
    all_agree("moving-vertices", false, &methods());
}

#[test]
fn on_instances_cut_outs_and_borders() {
    all_agree("instances", false, &methods());
}

/// With two more methods: walks that meet lamps by chance alone, and paths whose light ends meet merged ones.
fn methods_for_lamps() -> Vec<Method> {
    let by_chance = Method { set: &["max_depth=4", "shadow_rays=false"], ..method("path", 24) };
    let merging =
        Method { set: &["max_depth=4", "photons=3000", "radius_pixels=0.33", "alpha=1"], ..method("vcm", 2) };
    methods().into_iter().chain([by_chance, merging]).collect()
}

#[test]
fn on_lamps_that_move() {
    all_agree("moving-lamps", false, &methods_for_lamps());
}

#[test]
fn on_lamps_of_a_group_that_is_repeated() {
    all_agree("instanced-lamps", false, &methods_for_lamps());
}

#[test]
fn on_strands_that_emit() {
    all_agree("glowing-strands", false, &methods_for_lamps());
}

#[test]
fn on_smooth_glass_and_mirrors() {
    let mut methods = methods();
    // Light paths do not see what is behind the balls and the pane: the two lower rows.
    methods[2].blind = &[3, 4, 5, 6, 7, 8];
    all_agree("glass", false, &methods);
}

#[test]
fn on_parallel_projection_with_a_wide_filter() {
    all_agree("orthographic", false, &methods());
}

#[test]
fn on_a_wide_lens() {
    all_agree("wide-lens", false, &methods());
}

#[test]
fn on_a_lamp_without_a_surface() {
    all_agree("lamp-without-surface.xml", false, &methods());
}

#[test]
fn on_a_lens_that_is_denser_in_its_middle() {
    let of = ["path", "light", "bdpt"];
    let methods: Vec<_> = methods().into_iter().filter(|m| of.contains(&m.name)).collect();
    all_agree("gaussian-lens", false, &methods);
}

#[test]
fn in_wavelengths() {
    all_agree("dispersion", true, &methods());
    all_agree("rough-glass", true, &methods());
}

#[test]
fn on_many_lamps() {
    all_agree("many-lamps", false, &methods());
}

/// Those that know media.
fn methods_for_media() -> Vec<Method> {
    methods().into_iter().filter(|m| !matches!(m.name, "recursive" | "vcm")).collect()
}

#[test]
fn on_mist_in_glass_and_a_cloud() {
    all_agree("smoke", false, &methods_for_media());
}

/// Light walks do not know profiles.
#[test]
fn on_what_leaves_elsewhere_than_it_enters() {
    let mut methods = methods_for_media();
    methods.retain(|m| matches!(m.name, "path" | "guided"));
    methods.push(Method { set: &["max_depth=4", "shadow_rays=false"], ..method("path", 12) });
    methods.push(Method { set: &["max_depth=4", "heuristic=balance"], ..method("path", 6) });
    all_agree("candle", false, &methods);
}

#[test]
fn in_thin_mist_with_near_lamps() {
    let mut methods = methods_for_media();
    methods.retain(|m| matches!(m.name, "path" | "light" | "bdpt"));
    methods.push(Method { set: &["max_depth=4", "equiangular=true"], ..method("path", 6) });
    methods
        .push(Method { set: &["max_depth=4", "equiangular=true", "heuristic=balance"], ..method("path", 6) });
    methods.push(Method { set: &["max_depth=4", "equiangular=true", "mis=false"], ..method("path", 6) });
    all_agree("mist", false, &methods);
}

#[test]
fn on_bodies_that_overlap() {
    all_agree("nested", false, &methods_for_media());
}

#[test]
fn on_what_light_wanders_in() {
    all_agree("wax", false, &methods_for_media());
}
