//! Mitsuba's scene files [Mitsuba2022] [Mitsuba2010]: XML of versions 3.x, 2.x and 0.x.
//!
//! ```text
//! bytes ──reader──► Tree (objects with properties, places) ──build──► SceneDesc
//! ```
//!
//! An object is built when something asks for it; what nobody asked for is told, with the name that was probably meant.
//! Plug-ins that have no equivalent give a warning at their place that says what is done instead; plug-ins that Mitsuba
//! does not have either are errors. Names of versions before 2.0 are upgraded as Mitsuba does.
//!
//! | class       | supported                                                                                       |
//! |-------------|-------------------------------------------------------------------------------------------------|
//! | shapes      | cube, rectangle, sphere, disk, cylinder, obj, ply, serialized, bsplinecurve, linearcurve, hair, shapegroup, instance, merge |
//! | BSDFs       | diffuse, (rough)conductor, (thin-, rough)dielectric, (rough)plastic, principled(thin), hair, measured, blendbsdf, mask, bumpmap, normalmap, twosided, null |
//! | emitters    | area, constant, envmap, point, spot, projector, directional, sky, sun, sunsky                   |
//! | textures    | bitmap (with `<UDIM>`), checkerboard, mesh_attribute, volume; spectra: uniform, d65, srgb, blackbody, regular, irregular                |
//! | sensors     | perspective, thinlens, orthographic                                                             |
//! | integrators | path, volpath, direct, ptracer and their kin; moment, aov and others around them                |
#![allow(
    clippy::wildcard_enum_match_arm,
    reason = "a property holds what is asked for, or it is told as something else: the kinds do not matter"
)]

mod reader;
mod text;
mod transform;
mod tree;
mod value;

mod build;

mod bsdfs;
mod emitters;
mod integrator;
mod media;
mod meshes;
mod sensor;
mod shapes;
mod sky;
mod spectra;
mod strands;
mod surfaces;
mod textures;
mod volumes;

use std::path::Path;

use scene_desc::{SceneDesc, Sink};

use crate::report::Report;

/// Reads a Mitsuba scene and all files that it names, with values for its `$parameters`.
pub(crate) fn load(path: &Path, defines: &[(String, String)], sink: &mut Sink) -> Option<SceneDesc> {
    let mut report = Report::new(sink);
    let tree = reader::read(path, defines, &mut report);
    // What was not read to its end would only bring messages about what is missing.
    let is_readable = !report.has_errors() || !tree.nodes.is_empty();
    let scene = (is_readable && !report.is_over()).then(|| build::build(&tree, &mut report));
    let failed = report.has_errors();
    report.finish(None);
    scene.filter(|_| !failed)
}
