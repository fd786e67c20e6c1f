//! What is told to a person about their input: what, where, what was expected, what to do.

use std::fmt;
use std::path::{Path, PathBuf};

/// Index into [`SourceMap`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct FileId(pub u32);

/// A place in a source file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Span {
    /// Which file; `None` for things that no file says (defaults, the command line, Python).
    pub file: Option<FileId>,
    /// Line, from 1; 0 for a file as a whole.
    pub line: u32,
    /// Column in characters, from 1; 0 for a line as a whole.
    pub column: u32,
}

impl Span {
    /// No file says it.
    pub const NONE: Self = Self { file: None, line: 0, column: 0 };

    /// A file as a whole.
    #[must_use]
    pub fn file(file: FileId) -> Self {
        Self { file: Some(file), line: 0, column: 0 }
    }
}

impl Default for Span {
    fn default() -> Self {
        Self::NONE
    }
}

/// The files that spans refer to.
#[derive(Clone, Debug, Default)]
pub struct SourceMap {
    files: Vec<PathBuf>,
}

impl SourceMap {
    /// Registers a file; the same path gives the same id.
    pub fn add(&mut self, path: &Path) -> FileId {
        let found = self.files.iter().position(|p| p == path);
        let index = found.unwrap_or_else(|| {
            self.files.push(path.to_owned());
            self.files.len() - 1
        });
        FileId(u32::try_from(index).unwrap_or(u32::MAX))
    }

    /// The path of a file.
    #[must_use]
    pub fn path(&self, id: FileId) -> Option<&Path> {
        self.files.get(id.0 as usize).map(PathBuf::as_path)
    }

    /// All files, in the order in which they were met.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        self.files.iter().map(PathBuf::as_path)
    }

    /// `file:line:column`, as far as it is known.
    #[must_use]
    pub fn locate(&self, span: Span) -> String {
        let Some(path) = span.file.and_then(|f| self.path(f)) else { return String::new() };
        match (span.line, span.column) {
            (0, _) => path.display().to_string(),
            (line, 0) => format!("{}:{line}", path.display()),
            (line, column) => format!("{}:{line}:{column}", path.display()),
        }
    }
}

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The scene renders, but something is not as the file asks.
    Warning,
    /// The scene is not rendered.
    Error,
}

/// One message to a person.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnostic {
    /// How bad it is.
    pub severity: Severity,
    /// Where it is.
    pub span: Span,
    /// What is wrong, with the value; lower case, no full stop.
    pub message: String,
    /// What to do about it, or what is done instead.
    pub hint: Option<String>,
}

impl Diagnostic {
    /// Adds what to do about it.
    pub fn hint(&mut self, hint: impl Into<String>) {
        self.hint = Some(hint.into());
    }

    /// `file:line:column: error: message` and the hint on a line of its own.
    #[must_use]
    pub fn render(&self, sources: &SourceMap) -> String {
        let place = sources.locate(self.span);
        let place = if place.is_empty() { place } else { format!("{place}: ") };
        let hint = self.hint.as_ref().map(|h| format!("\n  hint: {h}")).unwrap_or_default();
        format!("{place}{}: {}{hint}", self.severity, self.message)
    }
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Warning => "warning",
            Self::Error => "error",
        })
    }
}

/// Collects diagnostics, so that all are reported, not just the first.
#[derive(Clone, Debug, Default)]
pub struct Sink {
    list: Vec<Diagnostic>,
    sources: SourceMap,
}

impl Sink {
    /// Reports an error; the returned reference takes a hint.
    pub fn error(&mut self, span: Span, message: impl Into<String>) -> &mut Diagnostic {
        self.push(Severity::Error, span, message.into())
    }

    /// Reports a warning; the returned reference takes a hint.
    pub fn warning(&mut self, span: Span, message: impl Into<String>) -> &mut Diagnostic {
        self.push(Severity::Warning, span, message.into())
    }

    /// Takes over what another sink collected.
    pub fn append(&mut self, other: Self) {
        self.list.extend(other.list);
    }

    /// The files that the diagnostics' spans refer to, also when no scene came of them.
    #[must_use]
    pub fn sources(&self) -> &SourceMap {
        &self.sources
    }

    /// Registers a file that spans will refer to.
    pub fn add_source(&mut self, path: &Path) -> FileId {
        self.sources.add(path)
    }

    /// Everything so far as text, one message a line (and its hint on the next).
    #[must_use]
    pub fn render(&self) -> String {
        self.list.iter().map(|d| d.render(&self.sources) + "\n").collect()
    }

    /// Everything so far, in the order of reporting.
    #[must_use]
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.list
    }

    /// Was there an error?
    #[must_use]
    pub fn has_errors(&self) -> bool {
        self.list.iter().any(|d| d.severity == Severity::Error)
    }

    fn push(&mut self, severity: Severity, span: Span, message: String) -> &mut Diagnostic {
        self.list.push(Diagnostic { severity, span, message, hint: None });
        let last = self.list.len() - 1;
        &mut self.list[last]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_names_its_place_and_what_to_do() {
        let mut sources = SourceMap::default();
        let file = sources.add(Path::new("a.pbrt"));
        let mut sink = Sink::default();
        sink.error(Span { file: Some(file), line: 3, column: 7 }, "roughness 1.7 is outside [0, 1]")
            .hint("did you mean 0.17?");
        assert_eq!(
            sink.diagnostics()[0].render(&sources),
            "a.pbrt:3:7: error: roughness 1.7 is outside [0, 1]\n  hint: did you mean 0.17?"
        );
    }
}
