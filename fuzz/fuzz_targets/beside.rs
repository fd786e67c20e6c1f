//! Files that stand beside a scene, each through a scene that holds it: the first byte says which. The scene is compiled too, for
//! some are only read then.
#![cfg_attr(feature = "libfuzzer", no_main)]

mod common;

/// Scenes and the names of their files.
const SCENES: [(&str, &str, &str); 6] = [
    ("a.pbrt", "WorldBegin\nMakeNamedMedium \"m\" \"string type\" \"nanovdb\" \"string filename\" \"f.nvdb\"\nMediumInterface \"m\" \"\"\nMaterial \"interface\"\nShape \"sphere\"\n", "f.nvdb"),
    ("a.pbrt", "WorldBegin\nLightSource \"goniometric\" \"string filename\" \"f.ies\"\nShape \"sphere\"\n", "f.ies"),
    ("a.pbrt", "WorldBegin\nLightSource \"point\"\nMaterial \"measured\" \"string filename\" \"f.bsdf\"\nShape \"sphere\"\n", "f.bsdf"),
    ("a.pbrt", "Camera \"realistic\" \"string lensfile\" \"f.dat\"\nWorldBegin\nShape \"sphere\"\n", "f.dat"),
    ("a.pbrt", "WorldBegin\nLightSource \"point\" \"spectrum I\" \"f.spd\"\nShape \"sphere\"\n", "f.spd"),
    ("a.xml", "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><shape type=\"sphere\"><bsdf type=\"null\"/><medium name=\"interior\" type=\"heterogeneous\"><volume name=\"sigma_t\" type=\"gridvolume\"><string name=\"filename\" value=\"f.vol\"/></volume></medium></shape></scene>", "f.vol"),
];

fn run(bytes: &[u8]) {
    let Some((kind, rest)) = bytes.split_first() else { return };
    let (name, scene, file) = SCENES[usize::from(*kind) % SCENES.len()];
    common::compile(name, &[(name, scene.as_bytes()), (file, rest)]);
}

target!(run);
