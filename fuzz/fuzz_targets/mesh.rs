//! Mesh files, each kind through a scene that holds it: the first byte says which.
#![cfg_attr(feature = "libfuzzer", no_main)]

mod common;

const PLY: &str = "WorldBegin\nShape \"plymesh\" \"string filename\" \"m.ply\"\n";

fn run(bytes: &[u8]) {
    let Some((kind, rest)) = bytes.split_first() else { return };
    let kind = ["ply", "obj", "serialized", "pbrt"][usize::from(kind % 4)];
    if kind == "pbrt" {
        return common::read("a.pbrt", &[("a.pbrt", PLY.as_bytes()), ("m.ply", rest)]);
    }
    let scene = format!(
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><shape type=\"{kind}\"><string name=\"filename\" value=\"m\"/></shape></scene>"
    );
    common::read("a.xml", &[("a.xml", scene.as_bytes()), ("m", rest)]);
}

target!(run);
