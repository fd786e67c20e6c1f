//! glTF 2.0 [Khronos2021]: `.gltf` with its files, or data URIs, and `.glb`.
//!
//! ```text
//! bytes ──container──► Root, buffers ──accessor, geometry, materials, build──► SceneDesc
//! ```
//!
//! | of glTF          | what is read                                                                                |
//! |------------------|---------------------------------------------------------------------------------------------|
//! | geometry         | triangles, strips, fans; sparse accessors; morph targets and skins at rest; two sets of (u, v), colours of vertices |
//! | materials        | metallic-roughness with textures, normal maps, emission, alpha (BLEND as coverage) |
//! | `KHR_materials_` | `emissive_strength`, `ior`, `specular`, `transmission`, `volume` (absorption), `clearcoat`, `sheen`, `anisotropy`, `diffuse_transmission`, `unlit` (as emission), `variants` (the default) |
//! | other extensions | `KHR_lights_punctual`, `KHR_texture_transform`, `KHR_mesh_quantization`                        |
//!
//! Numbers of lights are radiometric as they stand, as viewers take them: candela are watts per steradian, lux are watts
//! per square metre. Files of Blender are the exception: its exporter multiplies watts by 683, which is divided out again
//! (docs/decisions/0130). A light's `range`, which is for drawing, does not end it. Without a camera, the scene is seen from the front, a little
//! from above; without lights and glowing surfaces, there is an even sky and a key light.
//!
//! Left out, with a warning: points and lines, iridescence, dispersion; mappings of emission's textures.
//! Without one: animations, occlusion (a path tracer finds its own), one-sided drawing.

mod accessor;
mod build;
mod camera;
mod container;
mod geometry;
mod json;
mod json_material;
mod materials;
mod textures;

use std::path::Path;

use scene_desc::{SceneDesc, Sink};

use crate::report::Report;
use crate::{resources, source};

/// Extensions that are read, or that change nothing in a picture at rest.
const KNOWN: [&str; 16] = [
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_materials_iridescence",
    "KHR_materials_dispersion",
];

/// Reads a glTF file and all files that it names.
pub(crate) fn load(path: &Path, sink: &mut Sink) -> Option<SceneDesc> {
    let mut report = Report::new(sink);
    let scene = read(path, &mut report);
    let failed = report.has_errors();
    report.finish(None);
    let mut scene = scene.filter(|_| !failed)?;
    scene.sources = sink.sources().clone();
    Some(scene)
}

fn read(path: &Path, report: &mut Report<'_>) -> Option<SceneDesc> {
    let file = container::Container::read(path, report)?;
    for name in file.root.extensions_required.iter().filter(|n| !KNOWN.contains(&n.as_str())) {
        report
            .error(file.span, format!("the file requires the extension {name}, which is not read"))
            .hint("export the scene without it");
    }
    let (mut scene, mut hashes) = build::scene(&file, report);
    hashes.extend(&file.hashes);
    hashes.extend(resources::hash_images(&scene.images, report));
    scene.content_hash = source::combine(&hashes);
    Some(scene)
}
