//! Paths side by side have the bits of paths one by one: `path` walks alone with the portable kernel, and in lanes with the
//! best that the processor has.

use std::path::{Path, PathBuf};

use accel::Isa;
use render::SceneOptions;
use steradian_tests::{Way, bytes, open};

/// Tiles of several sizes, some with fewer paths than go together.
const SIZE: [u32; 2] = [41, 37];

fn scenes(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut files: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "pbrt" || e == "xml"));
    files.sort();
    files
}

fn assert_same(file: &Path, ways: &[Way<'_>]) {
    let scene =
        |isa| open(file, &SceneOptions { resolution: Some(SIZE), isa: Some(isa), ..SceneOptions::default() });
    let alone = scene(Isa::Scalar);
    for isa in [Isa::Avx2, Isa::Avx512].into_iter().filter(|isa| isa.is_available()) {
        let together = scene(isa);
        for way in ways {
            let (a, counted) = way.render(&alone, 0..3, 1, 2);
            let (b, counted_there) = way.render(&together, 0..3, 1, 1);
            assert!(bytes(a.film()) == bytes(b.film()), "{}, {}, {isa:?}", file.display(), way.name());
            assert_eq!(counted, counted_there, "{}, {}, {isa:?}", file.display(), way.name());
        }
    }
}

#[test]
fn paths_side_by_side_have_the_bits_of_paths_one_by_one() {
    let files: Vec<PathBuf> = ["scenes", "../scenes"].into_iter().flat_map(scenes).collect();
    assert!(files.len() > 30, "{}", files.len());
    for file in files {
        assert_same(&file, &[Way { integrator: "path", settings: &[] }]);
    }
}

#[test]
fn whatever_the_parameters_are() {
    let way = |settings| Way { integrator: "path", settings };
    let ways = [
        way(&[("max_depth", "0")]),
        way(&[("max_depth", "1")]),
        way(&[("max_depth", "100"), ("rr_depth", "0")]),
        way(&[("heuristic", "balance")]),
        way(&[("mis", "false")]),
        way(&[("shadow_rays", "false")]),
        way(&[("sampling", "cosine")]),
    ];
    for name in ["large-lamp.pbrt", "many-lamps.pbrt", "shading-normals.pbrt", "glass.pbrt"] {
        assert_same(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name), &ways);
    }
}
