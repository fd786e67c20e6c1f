//! Errors as Python's exceptions, with the text of the command line. The classes are in `steradian.errors`.

use pyo3::prelude::*;
use scene_desc::{Severity, Sink};

/// Most diagnostics that an exception lists; the rest is counted.
const MOST: usize = 20;

/// An exception of `steradian.errors` by its name.
pub(crate) fn error(py: Python<'_>, class: &str, text: &str) -> PyErr {
    let made =
        py.import("steradian.errors").and_then(|m| m.getattr(class)).and_then(|class| class.call1((text,)));
    match made {
        Ok(value) => PyErr::from_value(value),
        Err(e) => e,
    }
}

/// An error of the library.
pub(crate) fn of_render(py: Python<'_>, e: &render::Error) -> PyErr {
    let text = render::sentence(e);
    let class = match e {
        render::Error::Film(e) => class_of_film(e),
        render::Error::Parameter(_) => "ParameterError",
        render::Error::Output { .. } => "OutputError",
        render::Error::Memory { .. } => "FilmTooLargeError",
        render::Error::Resume { .. } => "ResumeError",
        render::Error::Threads { .. } | render::Error::Pixel { .. } => "SteradianError",
        _ => "SteradianError",
    };
    error(py, class, &text)
}

/// An error of a film.
pub(crate) fn of_film(py: Python<'_>, e: &film::Error) -> PyErr {
    error(py, class_of_film(e), &render::sentence(e))
}

fn class_of_film(e: &film::Error) -> &'static str {
    if matches!(e, film::Error::Io { .. }) { "OutputError" } else { "FilmError" }
}

/// Why a scene was refused: all of it.
pub(crate) fn of_scene(py: Python<'_>, sink: &Sink, strict: bool) -> PyErr {
    let refusing = |d: &&scene_desc::Diagnostic| strict || d.severity == Severity::Error;
    let all: Vec<_> = sink.diagnostics().iter().filter(refusing).collect();
    let severity = Severity::Error;
    let shown = all.iter().take(MOST);
    let mut lines: Vec<String> =
        shown.map(|d| scene_desc::Diagnostic { severity, ..(*d).clone() }.render(sink.sources())).collect();
    if all.len() > MOST {
        lines.push(format!("… and {} more", all.len() - MOST));
    }
    error(py, "SceneError", &lines.join("\n"))
}

/// Tells warnings about a scene the way Python tells warnings.
pub(crate) fn warn(py: Python<'_>, sink: &Sink) -> PyResult<()> {
    let warnings = sink.diagnostics().iter().filter(|d| d.severity == Severity::Warning);
    let texts: Vec<String> = warnings.map(|d| d.render(sink.sources())).collect();
    if texts.is_empty() {
        return Ok(());
    }
    py.import("steradian.errors")?.getattr("_warn")?.call1((texts,))?;
    Ok(())
}
