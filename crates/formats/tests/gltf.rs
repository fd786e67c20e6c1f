//! glTF: what is read, what is said about broken files, and that nothing breaks the reader.
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::wildcard_enum_match_arm, reason = "tests")]

mod common;

use common::Folder;
use insta::assert_snapshot;
use math::Vec3;
use scene_desc::{CameraKind, FloatInput, Geometry, LightKind, MaterialKind, MeshDesc, SceneDesc, Sink};

/// A triangle (0,0,0), (1,0,0), (0,1,0) as floats, then the indices 0, 1, 2 as bytes: 39 bytes.
fn triangle() -> Vec<u8> {
    let positions = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    positions.iter().flat_map(|x| x.to_le_bytes()).chain([0, 1, 2]).collect()
}

/// A scene of that triangle in `a.bin`; `more` adds members to the file, `node` to its node.
fn scene(node: &str, more: &str) -> String {
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "scenes": [{{"nodes": [0]}}],
        "nodes": [{{"mesh": 0 {node}}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1}}]}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}},
                      {{"bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 36}}, {{"buffer": 0, "byteOffset": 36, "byteLength": 3}}],
        "buffers": [{{"uri": "a.bin", "byteLength": 39}}] {more}}}"#
    )
}

fn load(text: &str) -> (Option<SceneDesc>, String) {
    Folder::new().with("a.gltf", text).with("a.bin", triangle()).load("a.gltf")
}

fn good(text: &str) -> SceneDesc {
    let (scene, messages) = load(text);
    assert_eq!(messages, "");
    scene.unwrap()
}

fn mesh(scene: &SceneDesc) -> &MeshDesc {
    match &scene.shapes[0].geometry {
        Geometry::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

/// A `.glb` of these chunks.
fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().div_ceil(4) * 4, b' ');
    let mut bytes = b"glTF".to_vec();
    let words = |w: &[u32], bytes: &mut Vec<u8>| bytes.extend(w.iter().flat_map(|w| w.to_le_bytes()));
    words(&[2, (28 + json.len() + binary.len()) as u32, json.len() as u32, 0x4e4f_534a], &mut bytes);
    bytes.extend(&json);
    words(&[binary.len() as u32, 0x004e_4942], &mut bytes);
    bytes.extend(binary);
    bytes
}

#[test]
fn a_triangle_has_a_camera_and_lights_that_the_file_does_not_say() {
    let scene = good(&scene("", ""));
    assert_eq!(mesh(&scene).positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!((mesh(&scene).indices.as_slice(), scene.lights.len()), (&[[0, 1, 2]][..], 2));
    // All of it is in view.
    let camera_from_world = scene.camera.world_from_camera.start().inverse();
    for p in &mesh(&scene).positions {
        let p = camera_from_world.point(math::Point(*p)).0;
        assert!(p.z > 0.0 && p.x.abs() < p.z * 0.27 && p.y.abs() < p.z * 0.27, "{p}");
    }
}

#[test]
fn the_same_in_one_file_and_in_two() {
    let json = scene("", "").replace(r#""uri": "a.bin", "#, "");
    let folder = Folder::new().with("a.glb", glb(&json, &triangle()));
    let (scene, messages) = folder.load("a.glb");
    assert_eq!(messages, "");
    assert_eq!(mesh(&scene.unwrap()).positions, mesh(&good(&self::scene("", ""))).positions);
}

#[test]
fn cameras_lights_and_materials_mean_what_they_say() {
    let more = r#", "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "aspectRatio": 0.5}}],
        "extensions": {"KHR_lights_punctual": {"lights": [
            {"type": "spot", "intensity": 3, "color": [1, 0, 0], "spot": {"outerConeAngle": 0.5}}]}},
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.5], "metallicFactor": 0},
            "alphaMode": "BLEND", "extensions": {"KHR_materials_ior": {"ior": 1.3},
            "KHR_materials_clearcoat": {"clearcoatFactor": 0.7}}}]"#;
    let node =
        r#", "camera": 0, "translation": [0, 0, 5], "extensions": {"KHR_lights_punctual": {"light": 0}}"#;
    let text = scene(node, more).replace(r#""indices": 1"#, r#""indices": 1, "material": 0"#);
    let scene = good(&text);
    assert_eq!(scene.film.resolution, [360, 720]);
    let CameraKind::Perspective { fov, .. } = scene.camera.kind else { panic!("{:?}", scene.camera.kind) };
    let half_width = f64::from(fov).to_radians() / 2.0;
    assert!(
        (math::trig::f64::tan(half_width) - 0.5 * math::trig::f64::tan(0.4)).abs() < 1e-6,
        "the shorter side"
    );
    let eye = scene.camera.world_from_camera.start();
    assert_eq!(eye.point(math::Point::new(0.0, 0.0, 1.0)).0, Vec3::new(0.0, 0.0, 4.0), "along -z");
    assert_eq!(eye.point(math::Point::new(1.0, 0.0, 0.0)).0, Vec3::new(1.0, 0.0, 5.0), "not mirrored");
    match &scene.lights[..] {
        [light] => match &light.kind {
            LightKind::Spot { from, to, intensity, .. } => {
                assert_eq!((*from, *to, intensity.scale), (Vec3::Z * 5.0, Vec3::Z * 4.0, 3.0));
            }
            other => panic!("{other:?}"),
        },
        lights => panic!("{lights:?}"),
    }
    let material = &scene.materials[0];
    assert_eq!(material.opacity, Some(FloatInput::Constant(0.5)));
    match &material.kind {
        MaterialKind::MetallicRoughness(m) => {
            assert_eq!((&m.metallic, &m.clearcoat), (&0.0.into(), &0.7.into()));
            assert!(m.thin_walled);
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn sparse_values_and_morph_targets_move_vertices() {
    // Accessor 2 is zero but for its third element, which is the second vertex: (1, 0, 0).
    let more = "";
    let text = scene(r#", "weights": [0.5]"#, more)
        .replace(r#""indices": 1"#, r#""indices": 1, "targets": [{"POSITION": 2}]"#)
        .replace(
            r#""type": "SCALAR"}"#,
            r#""type": "SCALAR"}, {"componentType": 5126, "count": 3, "type": "VEC3", "sparse": {"count": 1,
               "indices": {"bufferView": 1, "byteOffset": 2, "componentType": 5121},
               "values": {"bufferView": 0, "byteOffset": 12}}}"#,
        );
    assert_eq!(mesh(&good(&text)).positions, [Vec3::ZERO, Vec3::X, Vec3::new(0.5, 1.0, 0.0)]);
}

#[test]
fn skins_stand_where_their_joints_are() {
    let json = scene(r#", "skin": 0}, {"translation": [0, 0, 2]"#, r#", "skins": [{"joints": [1]}]"#)
        .replace(r#""nodes": [0]"#, r#""nodes": [0, 1]"#)
        .replace(r#""POSITION": 0"#, r#""POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3"#)
        .replace(
            r#""type": "SCALAR"}"#,
            r#""type": "SCALAR"}, {"componentType": 5121, "count": 3, "type": "VEC4"},
               {"bufferView": 2, "componentType": 5121, "normalized": true, "count": 3, "type": "VEC4"}"#,
        )
        .replace(
            r#""byteOffset": 36, "byteLength": 3}"#,
            r#""byteOffset": 36, "byteLength": 3}, {"buffer": 1, "byteLength": 12}"#,
        )
        .replace(
            r#""byteLength": 39}"#,
            r#""byteLength": 39}, {"uri": "data:;base64,/wAAAP8AAAD/AAAA", "byteLength": 12}"#,
        );
    let scene = good(&json);
    assert_eq!(mesh(&scene).positions[1], Vec3::new(1.0, 0.0, 2.0));
}

#[test]
fn broken_files_say_what_is_wrong() {
    let cases = [
        ("no JSON", "{\"asset\": ".to_owned()),
        ("version", scene("", "").replace("2.0", "1.0")),
        ("no buffer", scene("", "").replace("a.bin", "absent.bin")),
        ("short buffer", scene("", "").replace(r#""byteLength": 39"#, r#""byteLength": 390"#)),
        ("view", scene("", "").replace(r#""byteLength": 36"#, r#""byteLength": 3600"#)),
        (
            "accessor",
            scene("", "").replace(r#""count": 3, "type": "VEC3""#, r#""count": 4000000000, "type": "VEC3""#),
        ),
        ("no accessor", scene("", "").replace(r#""indices": 1"#, r#""indices": 7"#)),
        ("type", scene("", "").replace(r#""type": "VEC3""#, r#""type": "VEC5""#)),
        ("index", scene("", "").replace(r#""byteOffset": 36"#, r#""byteOffset": 3"#)),
        ("loop", scene(r#", "children": [0]"#, "")),
        ("no node", scene(r#", "children": [5]"#, "")),
        ("no mesh", scene("", "").replace(r#""mesh": 0"#, r#""mesh": 3"#)),
        ("no material", scene("", "").replace(r#""indices": 1"#, r#""indices": 1, "material": 2"#)),
        ("required", scene("", r#", "extensionsRequired": ["KHR_draco_mesh_compression"]"#)),
        (
            "no image",
            scene(
                "",
                r#", "textures": [{"source": 0}], "images": [{"uri": "no.png"}],
                "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]"#,
            ),
        ),
        ("points", scene("", "").replace(r#""indices": 1"#, r#""mode": 0"#)),
        ("empty", r#"{"asset": {"version": "2.0"}}"#.to_owned()),
    ];
    let mut all: String = cases.iter().map(|(name, text)| format!("{name}\n{}", load(text).1)).collect();
    let whole = glb(&scene("", "").replace(r#""uri": "a.bin", "#, ""), &triangle());
    let cut = [8, 20, 100, whole.len() - 5];
    for n in cut {
        let folder = Folder::new().with("a.glb", &whole[..n]);
        all += &format!("cut at {n}\n{}", folder.load("a.glb").1);
    }
    assert_snapshot!(all);
}

#[test]
fn no_damage_breaks_the_reader() {
    let whole = glb(&scene("", "").replace(r#""uri": "a.bin", "#, ""), &triangle());
    let folder = Folder::new();
    let path = folder.path("a.glb");
    let mut state = 1_u64;
    for _ in 0..2000 {
        let mut bytes = whole.clone();
        for _ in 0..3 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let at = (state >> 33) as usize % bytes.len();
            bytes[at] = (state >> 20) as u8;
        }
        std::fs::write(&path, &bytes).unwrap();
        let mut sink = Sink::default();
        let scene = steradian_formats::load(&path, &mut sink);
        assert_eq!(scene.is_none(), sink.has_errors());
    }
}

#[test]
fn scenes_of_others_load_with_the_warnings_that_are_known() {
    let Some(folder) = common::shared_scenes() else { return };
    let mut all = String::new();
    for name in [
        "cornell-box/cornell-box.gltf",
        "flight-helmet/FlightHelmet.gltf",
        "suzanne/Suzanne.gltf",
        "shaderball/shaderball.glb",
        "gltf-tests/TextureSettingsTest/TextureSettingsTest.gltf",
        "gltf-tests/NormalTangentTest/NormalTangentTest.glb",
        "gltf-tests/SheenChairRoom/MixedLightingExample.gltf",
        "gltf-tests/GolfBall/GolfBall.glb",
    ] {
        let mut sink = Sink::default();
        let scene = steradian_formats::load(&folder.join(name), &mut sink);
        assert!(scene.is_some(), "{}", sink.render());
        let (shapes, instances) = scene.map_or((0, 0), |s| (s.shapes.len(), s.instances.len()));
        all += &format!("{name}: {shapes} shapes, {instances} instances\n");
        for d in sink.diagnostics() {
            all += &format!("  {}\n", d.message);
        }
    }
    assert_snapshot!(all);
}

#[test]
fn colours_of_vertices_and_cut_outs_become_textures() {
    let more = r#", "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.5, 1, 1, 0.8]}, "alphaMode": "MASK",
            "alphaCutoff": 0.7}, {"alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.4]}}]"#;
    let colored = scene("", more)
        .replace(r#""indices": 1"#, r#""indices": 1, "material": 0"#)
        .replace(r#""POSITION": 0"#, r#""POSITION": 0, "COLOR_0": 0"#);
    let scene = good(&colored);
    let names: Vec<_> = mesh(&scene).attributes.iter().map(|a| (a.name.as_str(), a.channels)).collect();
    assert_eq!(names, [("COLOR_0", 3), ("COLOR_0.a", 1)]);
    assert_eq!(mesh(&scene).attributes[1].values, [1.0; 3], "colours without alpha are opaque");
    let shown = &scene.materials[scene.shapes[0].material.index()];
    let MaterialKind::MetallicRoughness(kind) = &shown.kind else { panic!("{:?}", shown.kind) };
    let scene_desc::SpectrumInput::Texture(id) = &kind.base_color else { panic!("{:?}", kind.base_color) };
    assert!(matches!(scene.textures[id.index()].node, scene_desc::TextureNode::Product { .. }));
    let Some(FloatInput::Texture(id)) = shown.opacity else { panic!("{:?}", shown.opacity) };
    assert!(matches!(scene.textures[id.index()].node, scene_desc::TextureNode::Step { edge: 0.7, .. }));
    // Below the cut nothing is left, without a texture.
    assert_eq!(scene.materials[1].opacity, Some(FloatInput::Constant(0.0)));
}

#[test]
fn lights_of_blender_are_watts_again() {
    let more = |generator: &str, intensity: f32| {
        let lights = format!(r#"{{"lights": [{{"type": "directional", "intensity": {intensity}}}]}}"#);
        let more = format!(r#", "extensions": {{"KHR_lights_punctual": {lights}}}"#);
        let node = r#", "extensions": {"KHR_lights_punctual": {"light": 0}}"#;
        let from = r#""version": "2.0""#;
        let scene =
            good(&scene(node, &more).replace(from, &format!(r#"{from}, "generator": "{generator}""#)));
        let LightKind::Distant { radiance, .. } = &scene.lights[0].kind else { panic!() };
        radiance.scale
    };
    assert!((more("Khronos glTF Blender I/O v4.3.47", 2049.0) - 3.0).abs() < 1e-5);
    assert_eq!(more("Khronos glTF Blender I/O v4.3.47", 3.0), 3.0);
    assert_eq!(more("by hand", 2049.0), 2049.0);
}
