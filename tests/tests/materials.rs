//! Materials that no pbrt file has: path, light and bidirectional tracing see the same picture of all of them.
//!
//! A lamp over a floor with a row of spheres and a strand of hair; each material is put in by its name. What a light path
//! leaves is shared by pixels, so that the independent samples are renders with different seeds.

use std::fs;
use std::path::Path;

use render::SceneOptions;
use scene::Scene;
use scene_desc::{
    Distribution, HairColor, IndexOfRefraction, MaterialKind, MetallicRoughnessDesc, PrincipledDesc,
    Roughness, Sink, SpectrumDesc, SpectrumInput, ThinSheet, Tint,
};
use steradian_tests::{Family, Way, workers};
use testkit::statistics::Moments;

fn rgb(r: f32, g: f32, b: f32) -> SpectrumInput {
    SpectrumDesc::srgb([r, g, b]).into()
}

fn beckmann(alpha: f32) -> Roughness {
    Roughness { distribution: Distribution::Beckmann, ..Roughness::new(alpha, alpha, false) }
}

/// A file of a glossy surface, as if measured.
#[expect(clippy::unwrap_used, reason = "a test's own file")]
fn measured(folder: &Path) -> MaterialKind {
    let parts = testkit::measured::tabulate([0.5; 2], true, |wo, wi| {
        let m = (wo.0 + wi.0).normalize();
        let gloss = 1.5 * libm::powf(m.z, 20.0);
        [0.2, 0.1, 0.05].map(|matt| (matt + gloss) * wi.cos_theta() * std::f32::consts::FRAC_1_PI)
    });
    let path = folder.join("measured.bsdf");
    fs::write(&path, testkit::measured::file(&parts.unwrap(), &[])).unwrap();
    MaterialKind::Measured { path }
}

fn kinds(folder: &Path) -> Vec<MaterialKind> {
    let eta = || IndexOfRefraction::Constant(1.5);
    let plastic = |roughness, nonlinear| MaterialKind::Plastic {
        reflectance: rgb(0.2, 0.3, 0.7),
        eta: eta(),
        roughness,
        tint: Tint::default(),
        nonlinear,
    };
    let principled = PrincipledDesc {
        base_color: rgb(0.7, 0.4, 0.2),
        metallic: 0.3.into(),
        roughness: 0.4.into(),
        anisotropic: 0.5.into(),
        clearcoat: 0.7.into(),
        clearcoat_gloss: 0.3.into(),
        sheen: 0.3.into(),
        ..PrincipledDesc::default()
    };
    let glass = PrincipledDesc { spec_trans: 0.9.into(), metallic: 0.0.into(), ..principled.clone() };
    let thin = PrincipledDesc {
        thin: Some(ThinSheet { diff_trans: 0.8.into() }),
        spec_trans: 0.4.into(),
        ..principled.clone()
    };
    let gltf = MetallicRoughnessDesc {
        base_color: rgb(0.6, 0.7, 0.3),
        metallic: 0.2.into(),
        roughness: 0.5.into(),
        clearcoat: 0.6.into(),
        clearcoat_roughness: 0.3.into(),
        sheen_color: rgb(0.3, 0.2, 0.4),
        sheen_roughness: 0.5.into(),
        transmission: 0.3.into(),
        anisotropy: 0.4.into(),
        anisotropy_rotation: 0.7.into(),
        ..MetallicRoughnessDesc::default()
    };
    vec![
        plastic(Roughness::new(0.3, 0.1, false), true),
        plastic(beckmann(0.2), false),
        MaterialKind::OrenNayar { reflectance: rgb(0.6, 0.5, 0.4), sigma: 30.0.into() },
        MaterialKind::Principled(Box::new(principled)),
        MaterialKind::Principled(Box::new(glass)),
        MaterialKind::Principled(Box::new(thin)),
        MaterialKind::MetallicRoughness(Box::new(gltf.clone())),
        MaterialKind::MetallicRoughness(Box::new(MetallicRoughnessDesc { thin_walled: false, ..gltf })),
        MaterialKind::Hair {
            color: HairColor::Melanin { eumelanin: 0.3.into(), pheomelanin: 0.1.into() },
            eta: 1.55,
            beta_m: 0.4.into(),
            beta_n: 0.4.into(),
            alpha: 2.0.into(),
        },
        measured(folder),
    ]
}

fn world() -> String {
    let mut text = String::from(
        "LookAt 0 -8 3  0 0 0.6  0 0 1\nCamera \"perspective\" \"float fov\" 36\n\
         Film \"rgb\" \"integer xresolution\" 48 \"integer yresolution\" 24\n\
         PixelFilter \"box\" \"float xradius\" 0.5 \"float yradius\" 0.5\nSampler \"independent\"\nWorldBegin\n\
         AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [6 5 4]\n\
         Shape \"bilinearmesh\" \"point3 P\" [-2 -1 4  -2 1 4  2 -1 4  2 1 4] AttributeEnd\n\
         Material \"diffuse\" \"rgb reflectance\" [.5 .5 .5]\n\
         Shape \"bilinearmesh\" \"point3 P\" [-5 -3 0  5 -3 0  -5 5 0  5 5 0]\n",
    );
    for i in 0..8 {
        let (x, y) = (f64::from(i % 4) * 1.5 - 2.25, f64::from(i / 4) * 1.8 - 1.0);
        text += &format!(
            "MakeNamedMaterial \"m{i}\" \"string type\" \"diffuse\" NamedMaterial \"m{i}\"\n\
             AttributeBegin Translate {x} {y} 0.7 Shape \"sphere\" \"float radius\" 0.65 AttributeEnd\n"
        );
    }
    text + "MakeNamedMaterial \"m8\" \"string type\" \"diffuse\" NamedMaterial \"m8\"\n\
            Shape \"curve\" \"string type\" \"ribbon\" \"float width\" 0.15 \"normal N\" [0 -1 0.6 0 -1 0.6] \"point3 P\" [-3 -1.5 1.8  -1 -2 2.3  1 -2 1.8  3 -1.5 2.3]\n\
            MakeNamedMaterial \"m9\" \"string type\" \"diffuse\" NamedMaterial \"m9\"\n\
            AttributeBegin Translate 3.6 -1 0.7 Shape \"sphere\" \"float radius\" 0.65 AttributeEnd\n"
}

#[expect(clippy::unwrap_used, reason = "a test's own scene")]
fn scene() -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("world.pbrt");
    fs::write(&file, world()).unwrap();
    let (mut sink, options) = (Sink::default(), SceneOptions::default());
    let mut desc = render::load(&file, &options, &workers(2), &mut sink).unwrap();
    for (i, kind) in kinds(folder.path()).into_iter().enumerate() {
        let name = format!("m{i}");
        let material = desc.materials.iter_mut().find(|m| m.name == name).unwrap();
        material.kind = kind;
    }
    let opened = render::compile(desc, &options, &workers(2), &mut sink);
    assert!(sink.diagnostics().is_empty(), "{}", sink.render());
    opened.unwrap().scene
}

#[test]
fn methods_from_both_ends_see_the_same_light_on_every_material() {
    let scene = scene();
    let depth = ("max_depth", "4");
    let of = |integrator, spp| {
        let way = Way { integrator, settings: &[depth] };
        (0..24).map(|seed| way.render(&scene, 0..spp, seed, 2).0.film().develop()).collect::<Vec<_>>()
    };
    // Blocks of 8 × 8 pixels: 6 × 3 of them.
    let block = |image: &film::Developed, b: usize, c: usize| -> f64 {
        let (x0, y0) = (b % 6 * 8, b / 6 * 8);
        let pixels = (0..64).map(|i| image.mean[(y0 + i / 8) * 48 + x0 + i % 8][c]);
        pixels.map(f64::from).sum::<f64>() / 64.0
    };
    let (path, light, bdpt) = (of("path", 16), of("light", 32), of("bdpt", 8));
    let mut family = Family::default();
    for (name, other) in [("light", &light), ("bdpt", &bdpt)] {
        for (b, c) in (0..18).flat_map(|b| (0..3).map(move |c| (b, c))) {
            let moments = |of: &[film::Developed]| Moments::of(of.iter().map(|image| block(image, b, c)));
            family.same(format!("{name}, block {b}, channel {c}"), &moments(&path), &moments(other));
        }
    }
    family.finish();
}
