//! pbrt-v4 scene files [pbrt-v4]: <https://pbrt.org/fileformat-v4>.
//!
//! ```text
//! bytes ──lexer──► tokens ──parser──► entities (directives with their state) ──build──► SceneDesc
//! ```
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

use scene_desc::{SceneDesc, Severity, Sink, Span};

use crate::report::{Report, diagnostic};

/// Reads a pbrt-v4 scene and all files that it names.
pub(crate) fn load(path: &Path, sink: &mut Sink) -> Option<SceneDesc> {
    let mut report = Report::new(sink);
    let entities = parser::parse(path, &mut report);
    // What was not read to its end would only bring messages about what is missing.
    let scene = (!report.is_over()).then(|| build::build(entities, path, &mut report));
    let failed = report.has_errors();
    let summary = (!report.first(parser::OLD_SYNTAX)).then(|| {
        let span = Span::file(report.add_source(path));
        let mut d = diagnostic(Severity::Error, span, "this looks like a pbrt-v3 scene".into());
        d.hint("`pbrt --upgrade old.pbrt > new.pbrt` converts it to pbrt-v4");
        d
    });
    report.finish(summary);
    scene.filter(|_| !failed)
}
