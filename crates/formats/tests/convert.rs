//! What is written as pbrt-v4 reads back as it was.
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::wildcard_enum_match_arm, reason = "tests")]

mod common;

use std::path::Path;

use common::Folder;
use scene_desc::{Geometry, LightKind, MaterialKind, SceneDesc, ShapeDesc, Sink};

fn load(path: &Path) -> SceneDesc {
    let mut sink = Sink::default();
    steradian_formats::load(path, &mut sink).unwrap_or_else(|| panic!("{}", sink.render()))
}

/// Writes a scene and reads it back; gives the warnings as well.
fn round(scene: &SceneDesc, folder: &Folder) -> (SceneDesc, String) {
    let mut sink = Sink::default();
    let path = folder.path("b.pbrt");
    steradian_formats::write_pbrt(scene, &path, false, &mut sink).unwrap();
    (load(&path), sink.render())
}

/// A shape without places and numbers of materials, which may differ.
fn shape(s: &ShapeDesc) -> String {
    let place = (s.world_from_object.start().matrix(), s.world_from_object.end().matrix());
    let light = s.area_light.as_ref().map(|l| (&l.radiance, l.image, l.two_sided, l.power));
    let geometry = match &s.geometry {
        Geometry::Mesh(m) => format!("{m:?}"),
        other => format!("{other:?}"),
    };
    format!("{geometry} {place:?} {} {:?} {light:?} {:?}", s.reverse_orientation, s.alpha, s.medium_interface)
}

/// A grey colour is the same at every wavelength, and written so.
fn grey(text: &str) -> String {
    let (mut out, mut rest) = (String::new(), text);
    while let Some(at) = rest.find("Rgb { rgb: [") {
        let (before, found) = rest.split_at(at);
        let (numbers, after) = found["Rgb { rgb: [".len()..].split_once(']').unwrap();
        let numbers: Vec<_> = numbers.split(", ").collect();
        out.push_str(before);
        match after.strip_prefix(", space: Srgb }") {
            Some(after) if numbers.iter().all(|n| *n == numbers[0]) => {
                out.push_str(&format!("Constant({})", numbers[0]));
                rest = after;
            }
            _ => {
                out.push_str("Rgb { rgb: [");
                out.push_str(&numbers.join(", "));
                rest = &found["Rgb { rgb: [".len() + numbers.join(", ").len()..];
            }
        }
    }
    out + rest
}

fn same(name: &str, a: &SceneDesc, b: &SceneDesc) {
    let camera = |s: &SceneDesc| {
        let c = &s.camera;
        format!("{:?} {:?} {:?}", c.kind, [c.shutter_open, c.shutter_close], c.frame_aspect_ratio)
    };
    assert_eq!(camera(a), camera(b), "{name}");
    // The file has its inverse, which is inverted again: the last digits of a double differ.
    let (x, y) = (&a.camera.world_from_camera, &b.camera.world_from_camera);
    for (x, y) in [(x.start(), y.start()), (x.end(), y.end())] {
        let far = (x.matrix() - y.matrix()).to_cols_array().into_iter().fold(0.0_f64, |m, d| m.max(d.abs()));
        assert!(far < 1e-12, "{name}: {far}");
    }
    let film =
        |s: &SceneDesc| format!("{:?} {:?} {:?}", s.film.resolution, s.film.pixel_bounds, s.film.sensor);
    assert_eq!(film(a), film(b), "{name}");
    assert_eq!(
        (a.filter, a.sampler.spp, &a.integrator.name),
        (b.filter, b.sampler.spp, &b.integrator.name),
        "{name}"
    );
    assert_eq!(a.integrator.max_depth, b.integrator.max_depth, "{name}");
    // The reader puts a default material first, and numbers textures by kind.
    let material = |s: &SceneDesc, m: &ShapeDesc| format!("{:?}", s.materials[m.material.index()].kind);
    assert_eq!(a.shapes.len(), b.shapes.len(), "{name}");
    for (x, y) in a.shapes.iter().zip(&b.shapes) {
        assert_eq!(shape(x), shape(y), "{name}");
        let (x, y) = (material(a, x), material(b, y));
        let has_ids = ["TextureId", "MaterialId"].iter().any(|id| x.contains(id));
        assert!(has_ids || grey(&x) == grey(&y), "{name}: {x} {y}");
    }
    let light = |s: &SceneDesc| -> Vec<String> {
        s.lights
            .iter()
            .map(|l| grey(&format!("{:?} {:?}", l.kind, l.world_from_light.start().matrix())))
            .collect()
    };
    assert_eq!(light(a), light(b), "{name}");
    let media =
        |s: &SceneDesc| -> Vec<String> { s.media.iter().map(|m| grey(&format!("{:?}", m.kind))).collect() };
    assert_eq!(media(a), media(b), "{name}");
    let objects =
        |s: &SceneDesc| -> Vec<String> { s.objects.iter().flat_map(|o| &o.shapes).map(shape).collect() };
    assert_eq!(objects(a), objects(b), "{name}");
    assert_eq!(a.textures.len(), b.textures.len(), "{name}");
    assert_eq!(a.instances.len(), b.instances.len(), "{name}");
}

#[test]
fn our_own_scenes_come_back_bit_by_bit() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/scenes");
    let mut files: Vec<_> = std::fs::read_dir(scenes).unwrap().map(|e| e.unwrap().path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "pbrt"));
    files.sort();
    assert!(files.len() > 10);
    for file in files {
        let folder = Folder::new();
        let scene = load(&file);
        let (back, messages) = round(&scene, &folder);
        assert_eq!(messages, "", "{}", file.display());
        same(&file.display().to_string(), &scene, &back);
    }
}

#[test]
fn what_pbrt_cannot_say_is_told_and_refused_if_asked() {
    let text = "<scene version=\"3.0.0\"><sensor type=\"perspective\"/>\
        <emitter type=\"spot\"/><shape type=\"sphere\"><bsdf type=\"plastic\"/></shape></scene>";
    let folder = Folder::new().with("a.xml", text);
    let scene = load(&folder.path("a.xml"));
    let (back, messages) = round(&scene, &folder);
    assert_eq!(back.shapes.len(), 1);
    for what in ["a.xml:1:66: warning: pbrt-v4 has no spot that falls linearly", "closed form of plastic"] {
        let told = messages.lines().filter(|l| l.ends_with(what) || l.contains(what)).count();
        assert!(told > 0 || messages.contains(what.rsplit(": ").next().unwrap()), "{messages}");
    }
    let path = folder.path("strict.pbrt");
    let refused = steradian_formats::write_pbrt(&scene, &path, true, &mut Sink::default());
    assert!(refused.is_err() && !path.exists());
}

#[test]
fn a_measured_surface_goes_with_its_scene() {
    let text = "Camera \"perspective\"\nWorldBegin\nMaterial \"measured\" \"string filename\" \"gold.bsdf\"\nShape \"sphere\"\n";
    let folder = Folder::new().with("a.pbrt", text).with("gold.bsdf", "numbers");
    let scene = load(&folder.path("a.pbrt"));
    let out = Folder::new();
    let (back, messages) = round(&scene, &out);
    assert_eq!(messages, "");
    let MaterialKind::Measured { path } = &back.materials[back.shapes[0].material.index()].kind else {
        panic!("{:?}", back.materials)
    };
    assert!(path.starts_with(out.path("")));
    assert_eq!(std::fs::read_to_string(path).unwrap(), "numbers");
    // A file that is not there is told of when the scene is read; another file is another scene.
    let other = Folder::new().with("a.pbrt", text).with("gold.bsdf", "other numbers");
    assert_ne!(load(&other.path("a.pbrt")).content_hash, scene.content_hash);
    let mut sink = Sink::default();
    let without = Folder::new().with("a.pbrt", text);
    assert!(steradian_formats::load(&without.path("a.pbrt"), &mut sink).is_none());
    assert!(sink.render().contains("gold.bsdf cannot be read"), "{}", sink.render());
}

#[test]
fn a_lamps_file_goes_with_it() {
    let scene = load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/lamps.pbrt"));
    let folder = Folder::new();
    let (back, messages) = round(&scene, &folder);
    assert!(messages.contains("pbrt-v4 has no lamp with a photometric file"), "{messages}");
    let lamp = |s: &SceneDesc| {
        let LightKind::Ies { path, intensity, power } = &s.lights[0].kind else { panic!("{:?}", s.lights) };
        (std::fs::read(path).unwrap(), grey(&format!("{intensity:?} {power:?}")))
    };
    assert_eq!(lamp(&scene), lamp(&back));
}
