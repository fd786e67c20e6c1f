//! What is written as pbrt-v4 reads back as it was.
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::wildcard_enum_match_arm, reason = "tests")]

mod common;

use std::path::Path;

use common::Folder;
use scene_desc::{
    FloatInput, Geometry, ImageId, LightKind, MaterialKind, PhaseDesc, SceneDesc, ShapeDesc, Sink,
    SubsurfaceMethod, TextureId, TextureInput, TextureNode, WrapMode,
};

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
        // What is an extension of ours is said.
        let extensions = [
            ("gaussian-lens.pbrt", "thin lens of such a shape"),
            ("moving-lamps.pbrt", "light that moves"),
            ("moving-vertices.pbrt", "vertices that move"),
            ("glowing-strands.pbrt", "curve that emits"),
            ("instanced-lamps.pbrt", "light in an object"),
            ("instanced-lamps.pbrt", "light that moves"),
        ];
        let expected: Vec<_> =
            extensions.iter().filter(|(name, _)| file.ends_with(name)).map(|e| e.1).collect();
        let mut told: Vec<_> =
            messages.lines().filter_map(|l| l.split_once("pbrt-v4 has no ")).map(|m| m.1).collect();
        told.sort_unstable();
        told.dedup();
        assert_eq!(told, expected, "{}", file.display());
        assert_eq!(messages.is_empty(), expected.is_empty(), "{}: {messages}", file.display());
        // Lights of an object are written outside of it.
        if !file.ends_with("instanced-lamps.pbrt") {
            same(&file.display().to_string(), &scene, &back);
        }
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

const HEAD: &str = "Camera \"perspective\"\nWorldBegin\n";

#[test]
fn sets_of_images_are_found_by_their_numbers() {
    let text = format!(
        "{HEAD}Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"skin.<UDIM>.png\"\n\
         Material \"diffuse\" \"texture reflectance\" \"t\"\nShape \"sphere\"\n"
    );
    let folder = Folder::new()
        .with("a.pbrt", &text)
        .with("skin.1001.png", "a")
        .with("skin.1003.png", "b")
        .with("skin.1012.png", "c")
        .with("skin.999.png", "too small")
        .with("skin.10011.png", "too long");
    let mut sink = Sink::default();
    let scene = steradian_formats::load(&folder.path("a.pbrt"), &mut sink).unwrap();
    assert!(
        sink.render().contains("tiles 1002 of") && sink.render().contains("they are black"),
        "{}",
        sink.render()
    );
    let tiles = |scene: &SceneDesc| match &scene.textures[0].node {
        TextureNode::ImageMap { tiles, .. } => {
            let bytes = |id: ImageId| std::fs::read_to_string(&scene.images[id.index()].path).unwrap();
            tiles.iter().map(|t| (t.at, bytes(t.image))).collect::<Vec<_>>()
        }
        other => panic!("{other:?}"),
    };
    let expected = [([0, 0], "a".to_owned()), ([2, 0], "b".to_owned()), ([1, 1], "c".to_owned())];
    assert_eq!(tiles(&scene), expected);

    // The same set in a Mitsuba file, and after a conversion.
    let out = Folder::new();
    let (back, messages) = round(&scene, &out);
    assert!(messages.contains("<UDIM>"), "{messages}");
    assert_eq!(tiles(&back), expected);
    let xml = "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><shape type=\"sphere\"><bsdf type=\"diffuse\"><texture type=\"bitmap\" \
        name=\"reflectance\"><string name=\"filename\" value=\"skin.<UDIM>.png\"/></texture></bsdf></shape></scene>";
    let folder = folder.with("b.xml", xml.replace("<UDIM>", "&lt;UDIM&gt;"));
    assert_eq!(tiles(&load(&folder.path("b.xml"))), expected);

    let mut sink = Sink::default();
    let without = Folder::new().with("a.pbrt", &text);
    assert!(steradian_formats::load(&without.path("a.pbrt"), &mut sink).is_none());
    assert!(sink.render().contains("there is no tile of"), "{}", sink.render());
}

#[test]
fn textures_seen_along_three_axes_come_back() {
    let text = format!(
        "{HEAD}Translate 1 2 3\nTexture \"a\" \"float\" \"fbm\"\nTexture \"t\" \"float\" \"triplanar\" \
         \"texture x\" \"a\" \"float y\" 0.25 \"float sharpness\" 3\n\
         Material \"diffuse\" \"texture displacement\" \"t\"\nShape \"sphere\"\n"
    );
    let folder = Folder::new().with("a.pbrt", &text);
    let scene = load(&folder.path("a.pbrt"));
    let (back, _) = round(&scene, &folder);
    for scene in [&scene, &back] {
        let TextureNode::Triplanar { planes, sharpness, texture_from_world } = &scene.textures[1].node else {
            panic!("{:?}", scene.textures)
        };
        assert!(matches!(planes, [TextureInput::Texture(_), TextureInput::Float(y), TextureInput::Float(z)]
            if *y == 0.25 && *z == 1.0));
        assert_eq!(*sharpness, 3.0);
        assert_eq!(texture_from_world.point(math::Point::new(1.0, 2.0, 3.0)), math::Point::default());
    }
}

#[test]
fn what_bodies_and_profiles_are_comes_back() {
    let text = format!(
        "{HEAD}Material \"dielectric\" \"integer priority\" -3\nShape \"sphere\"\n\
         Material \"subsurface\" \"string method\" \"separable\" \"integer priority\" 2\nShape \"sphere\"\n\
         Material \"subsurface\" \"string method\" \"walk\"\nShape \"sphere\"\n"
    );
    let folder = Folder::new().with("a.pbrt", &text);
    let scene = load(&folder.path("a.pbrt"));
    let (back, messages) = round(&scene, &folder);
    assert_eq!(messages, "");
    for scene in [&scene, &back] {
        let of = |s: &ShapeDesc| {
            let m = &scene.materials[s.material.index()];
            let method =
                if let MaterialKind::Subsurface { method, .. } = &m.kind { Some(*method) } else { None };
            (m.priority, method)
        };
        let found: Vec<_> = scene.shapes.iter().map(of).collect();
        let (separable, walk) = (Some(SubsurfaceMethod::Separable), Some(SubsurfaceMethod::Walk));
        assert_eq!(found, [(Some(-3), None), (Some(2), separable), (None, walk)]);
    }

    let mut sink = Sink::default();
    let wrong = folder.with("b.pbrt", format!("{HEAD}Material \"subsurface\" \"string method\" \"run\"\n"));
    assert!(steradian_formats::load(&wrong.path("b.pbrt"), &mut sink).is_none());
    assert!(sink.render().contains("\"walk\" or \"separable\""), "{}", sink.render());
}

#[test]
fn a_relief_comes_back_with_its_mesh() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
               element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
    let text = format!(
        "{HEAD}Texture \"h\" \"float\" \"fbm\"\n\
         Shape \"plymesh\" \"string filename\" \"a.ply\" \"texture displacement\" \"h\" \"float edgelength\" 0.125\n"
    );
    let folder = Folder::new().with("a.pbrt", &text).with("a.ply", ply);
    let scene = load(&folder.path("a.pbrt"));
    let (back, messages) = round(&scene, &folder);
    assert_eq!(messages, "");
    for scene in [&scene, &back] {
        let [shape] = scene.shapes.as_slice() else { panic!("{}", scene.shapes.len()) };
        let relief = shape.displacement.as_ref().unwrap();
        assert_eq!((relief.edge_length, &relief.height), (0.125, &FloatInput::Texture(TextureId(0))));
        let Geometry::Mesh(mesh) = &shape.geometry else { panic!("{:?}", shape.geometry) };
        assert_eq!(mesh.indices.len(), 2, "a quadrilateral is two triangles");
    }
}

#[test]
fn blends_of_phase_functions_are_written_out() {
    let medium = |phase: &str| {
        format!(
            "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><shape type=\"sphere\"><bsdf type=\"null\"/>\
             <medium type=\"homogeneous\" name=\"interior\">{phase}</medium></shape></scene>"
        )
    };
    let hg = |g: f32| format!("<phase type=\"hg\"><float name=\"g\" value=\"{g}\"/></phase>");
    let blend = |w: f32, a: &str, b: &str| {
        format!("<phase type=\"blendphase\"><float name=\"weight\" value=\"{w}\"/>{a}{b}</phase>")
    };
    let inner = blend(0.25, "<phase type=\"rayleigh\"/>", &hg(0.5));
    let folder = Folder::new().with("a.xml", medium(&blend(0.2, &hg(-0.5), &inner)));
    let scene = load(&folder.path("a.xml"));
    let PhaseDesc::Blend(parts) = &scene.media[0].phase else { panic!("{:?}", scene.media[0].phase) };
    let parts: Vec<_> = parts.iter().map(|p| (p.weight, &p.phase)).collect();
    let expected = [
        (0.8, PhaseDesc::HenyeyGreenstein(-0.5)),
        (0.2 * 0.75, PhaseDesc::Rayleigh),
        (0.2 * 0.25, PhaseDesc::HenyeyGreenstein(0.5)),
    ];
    assert_eq!(parts.len(), 3);
    for ((w, phase), (v, other)) in parts.iter().zip(&expected) {
        assert!((w - v).abs() < 1e-6 && *phase == other, "{w} {phase:?}");
    }
    // pbrt has one phase function: of the same mean cosine.
    let (back, messages) = round(&scene, &folder);
    assert!(messages.contains("blend of phase functions"), "{messages}");
    let PhaseDesc::HenyeyGreenstein(g) = back.media[0].phase else { panic!("{:?}", back.media[0].phase) };
    assert!((g + 0.375).abs() < 1e-6, "{g}");

    let mut sink = Sink::default();
    let one = Folder::new().with("a.xml", medium(&blend(0.2, &hg(0.1), "")));
    assert!(steradian_formats::load(&one.path("a.xml"), &mut sink).is_none());
    assert!(sink.render().contains("a blend of 1 phase functions"), "{}", sink.render());
}

#[test]
fn volumes_are_textures_of_surfaces_too() {
    let vol: Vec<u8> = [
        b"VOL\x03".to_vec(),
        [1_i32, 2, 1, 1, 3].map(i32::to_le_bytes).concat(),
        [0.0_f32, 0.0, 0.0, 1.0, 1.0, 1.0].map(f32::to_le_bytes).concat(),
        [1.0_f32, 0.0, 0.0, 0.0, 1.0, 0.5].map(f32::to_le_bytes).concat(),
    ]
    .concat();
    let xml = "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><shape type=\"sphere\"><bsdf type=\"diffuse\"><texture type=\"volume\" \
        name=\"reflectance\"><volume type=\"gridvolume\" name=\"volume\"><string name=\"filename\" value=\"a.vol\"/>\
        <transform name=\"to_world\"><scale value=\"2\"/></transform></volume></texture></bsdf></shape></scene>";
    let folder = Folder::new().with("a.xml", xml);
    std::fs::write(folder.path("a.vol"), vol).unwrap();
    let scene = load(&folder.path("a.xml"));
    let TextureNode::Volume { resolution, values, wrap, texture_from_world } = &scene.textures[0].node else {
        panic!("{:?}", scene.textures)
    };
    assert_eq!((*resolution, *wrap), ([2, 1, 1], WrapMode::Clamp));
    assert_eq!(values.as_ref(), [[1.0, 0.0, 0.0], [0.0, 1.0, 0.5]]);
    assert_eq!(texture_from_world.point(math::Point::new(2.0, 1.0, 0.0)), math::Point::new(1.0, 0.5, 0.0));
    let (_, messages) = round(&scene, &folder);
    assert!(messages.contains("its mean is written"), "{messages}");
}

/// pbrt-v4 leaves a light in an object dark: it is written once for each instance, outside of the object.
#[test]
fn lights_of_objects_are_written_for_each_instance() {
    let text = "WorldBegin\nObjectBegin \"a\"\nShape \"sphere\"\nTranslate 0 2 0\n\
                AreaLightSource \"diffuse\"\nShape \"disk\"\nObjectEnd\n\
                ObjectInstance \"a\"\nTranslate 5 0 0\nObjectInstance \"a\"\n";
    let folder = Folder::new().with("a.pbrt", text);
    let (scene, said) = folder.load("a.pbrt");
    let scene = scene.unwrap();
    assert!(said.contains("warning: a shape in an object emits"), "{said}");
    assert_eq!((scene.objects[0].shapes.len(), scene.instances.len(), scene.shapes.len()), (2, 2, 0));
    let (back, said) = round(&scene, &folder);
    assert!(said.contains("pbrt-v4 has no light in an object"), "{said}");
    assert_eq!((back.objects[0].shapes.len(), back.instances.len(), back.shapes.len()), (1, 2, 2));
    let places: Vec<_> =
        back.shapes.iter().map(|s| s.world_from_object.start().matrix().w_axis.truncate()).collect();
    assert_eq!(places, [math::DVec3::new(0.0, 2.0, 0.0), math::DVec3::new(5.0, 2.0, 0.0)]);
    assert!(back.shapes.iter().all(|s| s.area_light.is_some()));
}
