//! pbrt-v4 scene files [pbrt-v4]: <https://pbrt.org/fileformat-v4>; those of pbrt-v3 are upgraded on the way.
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
mod color_means;
mod curves;
mod film;
mod integrator;
mod lights;
mod materials;
mod media;
mod nanovdb;
mod resources;
mod shapes;
mod spectra;
mod textures;

mod old_materials;
mod upgrade;

use std::path::Path;

use scene_desc::{SceneDesc, Severity, Sink, Span};

use crate::report::{Report, diagnostic};
use crate::source;

/// Reads a pbrt-v4 scene and all files that it names.
pub(crate) fn load(path: &Path, sink: &mut Sink) -> Option<SceneDesc> {
    let mut report = Report::new(sink);
    let is_old = ends_as_v3(path);
    let mut entities = parser::parse(path, is_old, &mut report);
    if is_old {
        upgrade::upgrade(&mut entities, &mut report);
    }
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

/// Is the last word of a file `WorldEnd`, which pbrt-v3 wants and pbrt-v4 does not know?
fn ends_as_v3(path: &Path) -> bool {
    // What cannot be read is reported by the parser.
    let Ok(source) = source::read(path) else { return false };
    let lines = source.bytes.rsplit(|b| matches!(b, b'\n' | b'\r')).map(<[u8]>::trim_ascii);
    let last = lines.map(|l| l.split(|b| *b == b'#').next().unwrap_or_default().trim_ascii());
    last.into_iter().find(|l| !l.is_empty()).is_some_and(|l| l.ends_with(b"WorldEnd"))
}
