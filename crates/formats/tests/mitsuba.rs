//! Mitsuba's XML: what good, odd and broken files give, and that none of them crashes.
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::wildcard_enum_match_arm, reason = "tests")]

mod common;

use std::fmt::Write as _;
use std::path::Path;

use common::Folder;
use proptest::prelude::*;
use scene_desc::{CameraKind, Geometry, LightKind, Mapping2d, MaterialKind, SceneDesc, TextureNode};

fn corpus() -> Vec<(String, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    let name = |p: &Path| p.file_name().unwrap().to_str().unwrap().to_owned();
    files.iter().map(|p| (name(p), std::fs::read_to_string(p).unwrap())).collect()
}

fn summary(scene: &SceneDesc) -> String {
    let mut out = String::new();
    let s = scene;
    writeln!(out, "film {:?}, crop {:?}, {:?}", s.film.resolution, s.film.pixel_bounds, s.filter).unwrap();
    writeln!(out, "{:?}, window {:?}", s.camera.kind, s.camera.screen_window).unwrap();
    writeln!(out, "{} {} spp", s.sampler.name, s.sampler.spp).unwrap();
    let i = &s.integrator;
    writeln!(out, "{} depth {:?} rr {:?} {:?}", i.name, i.max_depth, i.rr_depth, i.parameters).unwrap();
    for m in &s.materials {
        writeln!(out, "material \"{}\" {:?}, opacity {:?}", m.name, m.kind, m.opacity).unwrap();
    }
    for t in &s.textures {
        writeln!(out, "texture \"{}\" {:?} {:?}", t.name, t.kind, t.node).unwrap();
    }
    for l in &s.lights {
        writeln!(out, "light {:?}", l.kind).unwrap();
    }
    let shape = |s: &scene_desc::ShapeDesc| {
        let form = match &s.geometry {
            Geometry::Mesh(m) => format!("mesh of {}", m.indices.len()),
            other => format!("{other:?}"),
        };
        let light = s.area_light.as_ref().map(|l| l.radiance.scale);
        format!("{form}, material {}, light {light:?}, flip {}", s.material.0, s.reverse_orientation)
    };
    s.shapes.iter().for_each(|x| writeln!(out, "shape {}", shape(x)).unwrap());
    for o in &s.objects {
        writeln!(out, "object \"{}\"", o.name).unwrap();
        o.shapes.iter().for_each(|x| writeln!(out, "  {}", shape(x)).unwrap());
    }
    writeln!(out, "{} instances", s.instances.len()).unwrap();
    out
}

fn folder() -> Folder {
    corpus().into_iter().fold(Folder::new(), |f, (name, text)| f.with(&name, text))
}

#[test]
fn every_file_of_the_corpus_gives_what_it_gave() {
    let folder = folder();
    for (name, _) in corpus() {
        let (scene, messages) = folder.load(&name);
        let good = scene.as_ref().map(summary).unwrap_or_else(|| "no scene\n".into());
        if name.starts_with("good") {
            assert_eq!(messages, "", "{name}");
        }
        assert_eq!(scene.is_some(), !name.starts_with("broken"), "{name}: {messages}");
        insta::assert_snapshot!(name.trim_end_matches(".xml").to_owned(), format!("{messages}{good}"));
    }
}

/// A scene of these elements, without a message.
fn scene(elements: &str) -> SceneDesc {
    let text = format!(
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"><film type=\"hdrfilm\">\
        <integer name=\"width\" value=\"300\"/><integer name=\"height\" value=\"100\"/></film>\
        <float name=\"fov\" value=\"90\"/></sensor>{elements}</scene>"
    );
    let (scene, messages) = Folder::new().with("a.xml", text).load("a.xml");
    assert_eq!(messages, "");
    scene.unwrap()
}

#[test]
fn the_field_of_view_spans_the_width() {
    let s = scene("");
    let CameraKind::Perspective { fov, .. } = s.camera.kind else { panic!("{:?}", s.camera.kind) };
    let [x0, x1, y0, y1] = s.camera.screen_window.unwrap();
    // 90° over 300 pixels: at distance one from −1 to 1, and a third of it in height.
    let unit = math::trig::tan(0.5 * fov.to_radians());
    for (found, expected) in [(x0, -1.0), (x1, 1.0), (y0, -1.0 / 3.0), (y1, 1.0 / 3.0)] {
        assert!((found * unit - expected).abs() < 1e-5, "{found} {unit} {expected}");
    }
    assert!(s.integrator.max_depth.is_none() && s.integrator.name == "path", "unlimited by default");
}

#[test]
fn x_points_left_and_operations_apply_in_order() {
    let s = scene(
        "<shape type=\"sphere\"><transform name=\"to_world\"><translate x=\"1\"/><scale value=\"2\"/>\
        <rotate z=\"1\" angle=\"90\"/></transform></shape>",
    );
    let p = s.shapes[0].world_from_object.start().point(math::Point::new(0.0, 0.0, 0.0));
    assert!(p.distance(math::Point::new(0.0, 2.0, 0.0)) < 1e-6, "{p:?}");
    let right = s.camera.world_from_camera.start().vector(math::Vec3::X);
    assert!((right + math::Vec3::X).length() < 1e-6, "the camera's right is −x: {right}");
}

#[test]
fn an_opaque_surface_is_black_from_behind_unless_told_otherwise() {
    let s = scene(
        "<shape type=\"sphere\"/><shape type=\"sphere\"><bsdf type=\"twosided\"><bsdf type=\"diffuse\"/></bsdf></shape>\
        <shape type=\"sphere\"><emitter type=\"area\"/></shape>",
    );
    let kind = |i: usize| &s.materials[s.shapes[i].material.index()].kind;
    assert!(matches!(kind(0), MaterialKind::TwoSided { back: None, .. }));
    assert!(matches!(kind(1), MaterialKind::Diffuse { .. }));
    assert!(matches!(kind(2), MaterialKind::Diffuse { .. }), "an emitter without a BSDF is black");
}

#[test]
fn a_parameter_comes_from_the_command_line_and_must_be_there() {
    let text = "<scene version=\"3.0.0\"><default name=\"r\" value=\"1\"/><default name=\"rr\" value=\"5\"/>\
        <sensor type=\"perspective\"/><shape type=\"sphere\"><float name=\"radius\" value=\"$rr\"/></shape></scene>";
    let folder = Folder::new().with("a.xml", text);
    let load = |defines: &[(&str, &str)]| {
        let defines: Vec<_> = defines.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())).collect();
        let mut sink = scene_desc::Sink::default();
        let scene = steradian_formats::load_with(&folder.path("a.xml"), &defines, &mut sink);
        (scene.map(|s| format!("{:?}", s.shapes[0].geometry)), sink.render())
    };
    assert!(load(&[]).0.unwrap().contains("radius: 5.0"));
    assert!(load(&[("rr", "7")]).0.unwrap().contains("radius: 7.0"));
    let (none, messages) = load(&[("R", "7")]);
    assert!(none.is_none() && messages.contains("the scene has no parameter `R`"), "{messages}");
}

#[test]
fn checkerboards_and_environments_are_turned_to_our_conventions() {
    let s = scene(
        "<shape type=\"sphere\"><bsdf type=\"diffuse\"><texture type=\"checkerboard\" name=\"reflectance\"/></bsdf></shape>\
        <emitter type=\"point\"><transform name=\"to_world\"><translate y=\"3\"/></transform></emitter>",
    );
    let TextureNode::Checkerboard { mapping: Some(Mapping2d::Uv { scale, shift }), .. } = &s.textures[0].node
    else {
        panic!("{:?}", s.textures[0].node)
    };
    // Squares of half a unit; our v is 1 − theirs.
    assert_eq!((*scale, *shift), ([2.0, -2.0], [0.0, 2.0]));
    assert!(matches!(s.lights[0].kind, LightKind::Point { .. }));
}

#[test]
fn deep_and_wide_files_end() {
    let deep = format!(
        "<scene version=\"3.0.0\">{}{}</scene>",
        "<bsdf type=\"twosided\">".repeat(50_000),
        "</bsdf>".repeat(50_000)
    );
    let (scene, messages) = Folder::new().with("a.xml", deep).load("a.xml");
    assert!(scene.is_none() && messages.len() < 10_000, "{messages}");
    // Ten files that include the next one ten times: 10¹⁰ in all.
    let mut folder = Folder::new().with("10.xml", "<scene version=\"3.0.0\"/>");
    for i in 0..10 {
        let include = format!("<include filename=\"{}.xml\"/>", i + 1);
        folder = folder
            .with(&format!("{i}.xml"), format!("<scene version=\"3.0.0\">{}</scene>", include.repeat(10)));
    }
    let (scene, messages) = folder.load("0.xml");
    assert!(scene.is_none() && messages.contains("too often"), "{messages}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]
    #[test]
    fn no_change_of_a_scene_crashes(which in 0..64_usize, cut in 0..4000_usize, length in 0..60_usize, byte in 32..127_u8) {
        let files = corpus();
        let (name, text) = &files[which % files.len()];
        let mut bytes = text.clone().into_bytes();
        let at = cut % bytes.len();
        bytes.splice(at..(at + length).min(text.len()), [byte]);
        let (_, _) = folder().with(name, bytes).load(name);
    }

    #[test]
    fn no_bytes_crash_the_mesh_readers(tail in prop::collection::vec(any::<u8>(), 0..200), obj in "[vftn 0-9/.-]{0,80}") {
        let mut serialized = vec![0x1c, 0x04, 0x04, 0x00];
        serialized.extend(tail);
        let text = "<scene version=\"3.0.0\"><sensor type=\"perspective\"/>\
            <shape type=\"serialized\"><string name=\"filename\" value=\"m.serialized\"/></shape>\
            <shape type=\"obj\"><string name=\"filename\" value=\"m.obj\"/></shape></scene>";
        let obj = obj.replace("  ", "\n");
        let (_, _) = Folder::new().with("a.xml", text).with("m.serialized", serialized).with("m.obj", obj).load("a.xml");
    }
}

#[test]
fn ply_files_carry_values_by_name() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
         property float heat_0\nproperty uchar r\nproperty uchar g\nproperty uchar b\nelement face 2\n\
         property list uchar int vertex_indices\nproperty float kind\nend_header\n\
         0 0 0 1 255 0 0\n1 0 0 2 0 255 0\n0 1 0 3 0 0 255\n1 1 0 4 0 0 0\n3 0 1 2 7\n3 2 1 3 8\n";
    let scene = "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><shape type=\"ply\"><string name=\"filename\" value=\"m.ply\"/>\
         <bsdf type=\"diffuse\"><texture type=\"mesh_attribute\" name=\"reflectance\">\
         <string name=\"name\" value=\"vertex_color\"/><float name=\"scale\" value=\"0.5\"/></texture></bsdf></shape></scene>";
    let (scene, messages) = Folder::new().with("a.xml", scene).with("m.ply", ply).load("a.xml");
    let scene = scene.unwrap_or_else(|| panic!("{messages}"));
    let Geometry::Mesh(mesh) = &scene.shapes[0].geometry else { panic!() };
    let found: Vec<_> = mesh.attributes.iter().map(|a| (a.name.as_str(), a.channels, a.per_face)).collect();
    assert_eq!(found, [("vertex_heat", 1, false), ("vertex_color", 3, false), ("face_kind", 1, true)]);
    assert_eq!(mesh.attributes[1].values[..6], [1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    assert_eq!(mesh.attributes[2].values, [7.0, 8.0]);
    assert!(
        matches!(&scene.textures[0].node, TextureNode::Attribute { name, scale: 0.5 } if name == "vertex_color")
    );
}

#[test]
fn the_sun_and_the_sky_are_an_environment_map_made_here() {
    let text = |kind: &str, inner: &str| {
        format!(
            "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><emitter type=\"{kind}\">{inner}</emitter></scene>"
        )
    };
    let load = |text: String| Folder::new().with("a.xml", text).load("a.xml");
    let (scene, messages) = load(text("sky", "<vector name=\"sun_direction\" value=\"0,1,1\"/>"));
    let scene = scene.unwrap_or_else(|| panic!("{messages}"));
    assert!(matches!(scene.lights[0].kind, LightKind::InfiniteImage { .. }), "{messages}");
    assert_eq!(
        scene.images[0].embedded.as_ref().unwrap().len(),
        "PF\n512 256\n-1.0\n".len() + 512 * 256 * 12
    );
    let (scene, messages) = load(text("sunsky", "<vector name=\"sun_direction\" value=\"0,1,-1\"/>"));
    assert!(scene.unwrap().lights.is_empty() && messages.contains("below the horizon"), "{messages}");
}
