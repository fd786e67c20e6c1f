//! pbrt-v4 scene files [pbrt-v4]: <https://pbrt.org/fileformat-v4>.
//!
//!     bytes ──lexer──► tokens ──parser──► entities (directives with their state) ──build──► SceneDesc
//!
//! As in pbrt, names are resolved when all files have been read: a shape may name a material or an alpha texture
//! that is defined after it. What pbrt reports as an error, even one that it then ignores, is an error here.
//! What is read but not rendered yet is named in a warning at its place.
//!
//! Departs from pbrt: a parameter list ends with its file (pbrt lets it run on into the including file); files that
//! include themselves and absurd nesting are refused; values are checked for sense (radii, indices, not-a-number).

mod lexer;
mod number;
mod params;
mod parser;
mod state;

mod build;
mod camera;
mod curves;
mod film;
mod integrator;
mod lights;
mod materials;
mod media;
mod resources;
mod shapes;
mod spectra;
mod textures;

use std::path::Path;

use scene_desc::{SceneDesc, Sink};

use crate::report::Report;

/// Reads a pbrt-v4 scene and all files that it names.
pub(crate) fn load(path: &Path, sink: &mut Sink) -> Option<SceneDesc> {
    let mut report = Report::new(sink);
    let parsed = parser::parse(path, &mut report);
    let scene = build::build(parsed, path, &mut report);
    let failed = report.has_errors();
    report.finish();
    (!failed).then_some(scene)
}
