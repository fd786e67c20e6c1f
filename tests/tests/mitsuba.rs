//! Mitsuba's own regression scenes against its means and variances of 32 000 samples a pixel, pixel by pixel in X, Y
//! and Z, and as a whole. They live outside the repository (`../shared/scenes/mitsuba-data`); without them these
//! tests say so and pass.
//!
//! The variance of a pixel is that of our samples or the reference's for as many, whichever is larger (few samples of a
//! heavy tail seem quiet), and the reference's own. Of `roughplastic_linear`,
//! whose base Mitsuba tabulates coarsely (0.3 % brighter here at 400 samples), only the pixels are held.
#![allow(clippy::print_stdout, reason = "what was measured is read with `--nocapture`")]

use std::path::{Path, PathBuf};

use image::Image;
use render::SceneOptions;
use steradian_tests::{Way, open};
use testkit::statistics::{normal_two_sided_quantile, sidak};

/// Samples of the reference.
const REFERENCE_SPP: f64 = 32_000.0;
/// Variance below which Mitsuba's own test does not go: rounding of the references.
const LEAST_VARIANCE: f64 = 1e-4;
/// For each scene.
const SIGNIFICANCE: f64 = 1e-3;

fn folder() -> Option<PathBuf> {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let found =
        root.ancestors().map(|a| a.join("shared/scenes/mitsuba-data/tests/scenes")).find(|p| p.is_dir());
    if found.is_none() {
        println!("SKIPPED: there is no shared/scenes/mitsuba-data beside the repository");
    }
    found
}

fn load(path: &Path) -> Image {
    image::load_image(path).and_then(|i| i.to_rgb()).unwrap_or_else(|e| panic!("{e}"))
}

/// XYZ of linear sRGB.
const XYZ: [[f64; 3]; 3] =
    [[0.412_453, 0.357_580, 0.180_423], [0.212_671, 0.715_160, 0.072_169], [0.019_334, 0.119_193, 0.950_227]];

fn xyz(rgb: [f64; 3]) -> [f64; 3] {
    XYZ.map(|row| (0..3).map(|c| row[c] * rgb[c]).sum())
}

/// Renders a scene by its own integrator and compares it with its reference.
fn agrees(scene: &str, reference: &str, integrator: &str, spp: u32) {
    let Some(folder) = folder() else { return };
    // Independent samples, as the references: their variance is known without bias.
    let settings = vec![("sampler".to_owned(), "independent".to_owned())];
    let options = SceneOptions { settings, ..SceneOptions::default() };
    let opened = open(&folder.join(format!("{scene}.xml")), &options);
    let way = Way { integrator, settings: &[] };
    let ours = way.render(&opened, 0..spp, 0, 2).0.film().develop();
    let mean = load(&folder.join(format!("{reference}.exr")));
    let variance = load(&folder.join(format!("{reference}_var.exr")));
    assert_eq!(ours.mean.len() * 3, mean.data().len(), "{scene}: sizes");

    let n = ours.mean.len();
    let (mut worst, mut sums) = ((0.0_f64, 0, 0), [[0.0_f64; 2]; 3]);
    for i in 0..n {
        let of = |data: &[f32]| [0, 1, 2].map(|c| f64::from(data[3 * i + c]));
        let (m, r, v) = (xyz(ours.mean[i].map(f64::from)), xyz(of(mean.data())), xyz(of(variance.data())));
        let own =
            XYZ.map(|row| (0..3).map(|c| row[c] * row[c] * f64::from(ours.variance[i][c])).sum::<f64>());
        for c in 0..3 {
            let expected = v[c].max(LEAST_VARIANCE) / f64::from(spp);
            let s2 = own[c].max(expected) + v[c].max(0.0) / REFERENCE_SPP;
            let z = (m[c] - r[c]) / s2.sqrt();
            sums[c] = [sums[c][0] + m[c] - r[c], sums[c][1] + s2];
            if z.abs() > worst.0.abs() {
                worst = (z, i, c);
            }
        }
    }
    let whole = sums.map(|[d, s2]| d / s2.sqrt());
    let limit = normal_two_sided_quantile(sidak(SIGNIFICANCE, 3 * n));
    let whole_limit = normal_two_sided_quantile(sidak(SIGNIFICANCE, 3));
    let (x, y) = (worst.1 % mean.width(), worst.1 / mean.width());
    let line = format!(
        "{scene}: largest |z| {:.2} of {limit:.2} at ({x}, {y}) in {}, whole picture {whole:.2?} of {whole_limit:.2}",
        worst.0.abs(),
        ["X", "Y", "Z"][worst.2]
    );
    println!("{line}");
    let is_held = !scene.contains("roughplastic_linear");
    assert!(worst.0.abs() < limit, "{line}");
    assert!(!is_held || whole.iter().all(|z| z.abs() < whole_limit), "{line}");
}

#[test]
fn spheres_under_every_kind_of_light() {
    for light in ["arealight", "constant", "envmap", "pointlight"] {
        agrees(
            &format!("bsdf_spheres/test_{light}_path"),
            &format!("bsdf_spheres/refs/test_{light}_ref_rgb"),
            "path",
            24,
        );
    }
}

#[test]
fn surfaces_near_at_hand() {
    for name in ["roughdielectric", "roughplastic_linear", "textured_diffuse", "texturedprincipled1"] {
        agrees(
            &format!("bsdf_spheres/test_{name}_path"),
            &format!("bsdf_spheres/refs/test_{name}_ref_rgb"),
            "path",
            24,
        );
    }
}

#[test]
fn mirrors_instances_and_emitters() {
    agrees("infinite_mirrors/scene_path", "infinite_mirrors/refs/scene_ref_rgb", "path", 24);
    agrees("instancing/test_instancing_path", "instancing/refs/test_instancing_ref_rgb", "path", 24);
    let (scene, reference) =
        ("test_mesh_attributes_3_vertex_direct", "test_mesh_attributes_3_vertex_ref_rgb");
    agrees(&format!("mesh_attributes/{scene}"), &format!("mesh_attributes/refs/{reference}"), "direct", 24);
    agrees("spot_light/test_spot_direct", "spot_light/refs/test_spot_ref_rgb", "direct", 24);
    let (scene, reference) = ("test_various_emitters", "refs/test_various_emitters_ref_rgb");
    agrees(
        &format!("various_emitters/{scene}_ptracer"),
        &format!("various_emitters/{reference}"),
        "light",
        24,
    );
}

#[test]
fn media_even_and_on_a_grid() {
    let lit = ["homo_area_light", "homo_emitter_inside_medium"];
    let names = ["hetero_sigmat", "homo_dielectric_envmap", "homo_null_envmap", "homo_spectral_sigmat"];
    for name in names.into_iter().chain(lit) {
        let method = if name.contains("spectral") { "volpathmis" } else { "volpath" };
        agrees(
            &format!("participating_media/test_{name}_{method}"),
            &format!("participating_media/refs/test_{name}_ref_rgb"),
            "path",
            24,
        );
    }
}
