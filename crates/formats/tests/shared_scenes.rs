//! The scenes beside the workspace, made by others: they load, and every warning is one that is expected.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::wildcard_enum_match_arm,
    clippy::too_many_lines,
    reason = "tests"
)]

mod common;

use std::time::Instant;

use scene_desc::{Geometry, SceneDesc, Severity, Sink};

/// Loads a shared scene; gives its warnings.
fn load(name: &str) -> Option<(SceneDesc, Vec<String>)> {
    let path = common::shared_scenes()?.join(name);
    let start = Instant::now();
    let mut sink = Sink::default();
    let scene = steradian_formats::load(&path, &mut sink);
    println!("{name}: {:.1} ms", start.elapsed().as_secs_f64() * 1e3);
    assert!(scene.is_some(), "{}", sink.render());
    let warnings = sink.diagnostics().iter().inspect(|d| assert_eq!(d.severity, Severity::Warning));
    Some((scene?, warnings.map(|d| d.message.clone()).collect()))
}

fn n_triangles(scene: &SceneDesc) -> usize {
    let count = |g: &Geometry| match g {
        Geometry::Mesh(m) => m.indices.len(),
        Geometry::BilinearMesh(m) => 2 * m.indices.len(),
        Geometry::Sphere { .. } | Geometry::Disk { .. } | Geometry::Cylinder { .. } => 0,
        Geometry::LoopSubdiv(_) | Geometry::Curve(_) => 0,
    };
    scene.shapes.iter().map(|s| count(&s.geometry)).sum()
}

#[test]
fn scenes_load_without_a_warning_and_have_the_triangles_that_their_notes_say() {
    for (name, triangles) in [
        ("cornell-box/scene-v4.pbrt", 36),
        ("veach-mis/scene-v4.pbrt", 52),
        ("veach-ajar/scene-v4.pbrt", 382_690),
        ("water-caustic/scene-v4.pbrt", 103_487),
        ("coffee-maker/scene-v4.pbrt", 235_271),
        ("breakfast-room/scene-v4.pbrt", 269_538),
        ("bunny/scene-bssrdf.pbrt", 69_455),
        ("bunny/scene-diffuse.pbrt", 69_455),
    ] {
        let Some((scene, warnings)) = load(name) else { return };
        assert_eq!(warnings, [""; 0], "{name}");
        assert_eq!(n_triangles(&scene), triangles, "{name}");
    }
}

#[test]
fn media_are_read() {
    for name in ["modern-hall/scene-v4.pbrt", "volumetric-caustic/scene-v4.pbrt", "bunny/scene-medium.pbrt"] {
        let Some((scene, warnings)) = load(name) else { return };
        assert_eq!((warnings, scene.media.len()), (vec![], 1), "{name}");
    }
}

#[test]
fn a_pbrt_v3_scene_is_the_pbrt_v4_scene_of_the_same_name() {
    let Some((old, warnings)) = load("veach-ajar/scene-v3.pbrt") else { return };
    let Some((new, _)) = load("veach-ajar/scene-v4.pbrt") else { return };
    assert_eq!(warnings, Vec::<String>::new());
    assert_eq!(old.shapes.len(), new.shapes.len());
    let kinds = |s: &scene_desc::SceneDesc| -> Vec<_> {
        s.materials.iter().map(|m| std::mem::discriminant(&m.kind)).collect()
    };
    assert_eq!(kinds(&old), kinds(&new));
    assert_eq!(old.film.resolution, new.film.resolution);
}
