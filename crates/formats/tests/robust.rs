//! Whatever the bytes: no panic, and no scene without its errors said (the helper checks it).
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::wildcard_enum_match_arm,
    clippy::too_many_lines,
    reason = "tests"
)]

mod common;

use common::{Folder, load};
use proptest::prelude::*;

/// A scene that uses most of the format, to be mutated.
const SCENE: &str = "LookAt 3 4 1.5 .5 .5 0 0 0 1\n\
Camera \"perspective\" \"float fov\" 45 \"float screenwindow\" [ -1 1 -1 1 ]\n\
Sampler \"halton\" \"integer pixelsamples\" 128\nIntegrator \"volpath\" \"integer maxdepth\" [ 6 ]\n\
PixelFilter \"mitchell\" \"float B\" .3\n\
Film \"rgb\" \"string filename\" \"simple.png\" \"integer xresolution\" [400] \"integer yresolution\" [400]\n\
TransformTimes 0 1 Option \"seed\" 3 ColorSpace \"srgb\"\n\
WorldBegin # a comment\n\
LightSource \"infinite\" \"rgb L\" [ .4 .45 .5 ]\n\
LightSource \"distant\" \"point3 from\" [ -30 40 100 ] \"blackbody L\" 3000 \"float scale\" 1.5\n\
MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [ 1 2 3 ]\n\
MakeNamedMedium \"g\" \"string type\" \"uniformgrid\" \"integer nx\" 2 \"float density\" [ 1 2 ] \"float temperature\" [ 900 9e3 ]\n\
MakeNamedMedium \"h\" \"string type\" \"rgbgrid\" \"integer nz\" 2 \"rgb sigma_a\" [ 1 2 3 4 5 6 ] \"point3 p0\" [ 0 0 .5 ]\n\
AttributeBegin\nMaterial \"dielectric\" \"spectrum eta\" \"glass-BK7\"\nMediumInterface \"m\" \"\"\n\
Shape \"sphere\" \"float radius\" 1\nAttributeEnd\n\
Texture \"checks\" \"spectrum\" \"checkerboard\" \"float uscale\" [ 16 ] \"rgb tex1\" [ .1 .1 .1 ]\n\
Attribute \"shape\" \"float alpha\" 0.5\n\
MakeNamedMaterial \"x\" \"string type\" \"conductor\" \"spectrum k\" [ 400 1 700 2 ] \"bool remaproughness\" false\n\
ObjectBegin \"o\" Translate 0 0 -1 NamedMaterial \"x\"\n\
Shape \"bilinearmesh\" \"point3 P\" [ -20 -20 0 20 -20 0 -20 20 0 20 20 0 ] \"point2 uv\" [ 0 0 1 0 1 1 0 1 ]\n\
Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] \"normal N\" [ 0 0 1 0 0 1 0 0 1 ]\n\
ObjectEnd ActiveTransform EndTime Rotate 45 0 0 1 Scale 1 2 3 ActiveTransform All\n\
ConcatTransform [ 1 0 0 0 0 1 0 0 0 0 1 0 1 2 3 1 ] CoordinateSystem \"here\" CoordSysTransform \"camera\"\n\
ObjectInstance \"o\" ReverseOrientation\n\
Shape \"curve\" \"point3 P\" [ 0 0 0 1 0 0 2 0 0 3 0 0 ] \"string basis\" \"bspline\"\n\
AreaLightSource \"diffuse\" Shape \"plymesh\" \"string filename\" \"m.ply\"\n";

const PLY: &[u8] =
    b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\0\
\x03\0\0\0\0\x01\0\0\0\x02\0\0\0";

fn folder(scene: &[u8], ply: &[u8]) -> Folder {
    Folder::new().with("a.pbrt", scene).with("m.ply", ply)
}

#[test]
fn the_scene_to_be_mutated_is_good() {
    let (scene, messages) = folder(SCENE.as_bytes(), PLY).load("a.pbrt");
    assert!(scene.is_some(), "{messages}");
    assert_eq!(messages.lines().filter(|l| l.contains("warning")).count(), 0, "{messages}");
}

/// One change to a text.
#[derive(Clone, Debug)]
enum Change {
    Cut(usize, usize),
    Repeat(usize, usize),
    Byte(usize, u8),
    Word(usize, &'static str),
}

fn change() -> impl Strategy<Value = Change> {
    let words = prop::sample::select(vec![
        "AttributeEnd",
        "ObjectEnd",
        "\"",
        "[",
        "]",
        "nan",
        "-1",
        "1e40",
        "99999999999",
        "Include \"a.pbrt\"",
        "\"float radius\"",
        "WorldBegin",
        "Shape",
        "\\",
        "true",
        "\"\"",
        "0",
        "\"texture alpha\" \"checks\"",
    ]);
    prop_oneof![
        (any::<usize>(), 1..40usize).prop_map(|(at, n)| Change::Cut(at, n)),
        (any::<usize>(), 1..200usize).prop_map(|(at, n)| Change::Repeat(at, n)),
        (any::<usize>(), any::<u8>()).prop_map(|(at, b)| Change::Byte(at, b)),
        (any::<usize>(), words).prop_map(|(at, w)| Change::Word(at, w)),
    ]
}

fn apply(changes: &[Change], bytes: &mut Vec<u8>) {
    for c in changes {
        if bytes.is_empty() {
            return;
        }
        match *c {
            Change::Cut(at, n) => {
                let at = at % bytes.len();
                bytes.drain(at..(at + n).min(bytes.len()));
            }
            Change::Repeat(at, n) => {
                let at = at % bytes.len();
                let part = bytes[at..(at + n).min(bytes.len())].to_vec();
                bytes.splice(at..at, part);
            }
            Change::Byte(at, b) => {
                let at = at % bytes.len();
                bytes[at] = b;
            }
            Change::Word(at, w) => {
                let at = at % bytes.len();
                bytes.splice(at..at, format!(" {w} ").into_bytes());
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes_are_no_scene(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let (scene, messages) = load(&bytes);
        prop_assert!(scene.is_none() && messages.contains("error"));
    }

    #[test]
    fn random_tokens_do_no_harm(words in prop::collection::vec(prop::sample::select(
        SCENE.split_ascii_whitespace().collect::<Vec<_>>()), 0..200))
    {
        let text = format!("WorldBegin {}", words.join(" "));
        let (_, messages) = folder(text.as_bytes(), PLY).load("a.pbrt");
        prop_assert!(messages.lines().count() < 200);
    }

    #[test]
    fn mutated_scenes_do_no_harm(changes in prop::collection::vec(change(), 1..6)) {
        let mut bytes = SCENE.as_bytes().to_vec();
        apply(&changes, &mut bytes);
        let (_, messages) = folder(&bytes, PLY).load("a.pbrt");
        prop_assert!(messages.lines().count() < 200);
    }

    #[test]
    fn mutated_meshes_do_no_harm(changes in prop::collection::vec(change(), 1..6)) {
        let mut bytes = PLY.to_vec();
        apply(&changes, &mut bytes);
        let (_, messages) = folder(SCENE.as_bytes(), &bytes).load("a.pbrt");
        prop_assert!(messages.lines().count() < 200);
    }
}
