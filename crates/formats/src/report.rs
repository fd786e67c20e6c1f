//! Diagnostics of one reading, bounded in number: a broken file shall not print a million lines.

use std::collections::HashSet;

use scene_desc::{Diagnostic, FileId, Severity, Sink, Span};

/// Most errors that are shown; the rest is counted.
const MOST_ERRORS: usize = 20;
/// Most warnings that are shown.
const MOST_WARNINGS: usize = 50;

/// Where a reader reports to.
pub(crate) struct Report<'s> {
    sink: &'s mut Sink,
    errors: usize,
    warnings: usize,
    said: HashSet<String>,
    /// Takes hints for what is not shown.
    unseen: Diagnostic,
}

impl<'s> Report<'s> {
    pub(crate) fn new(sink: &'s mut Sink) -> Self {
        let unseen =
            Diagnostic { severity: Severity::Warning, span: Span::NONE, message: String::new(), hint: None };
        Self { sink, errors: 0, warnings: 0, said: HashSet::new(), unseen }
    }

    pub(crate) fn error(&mut self, span: Span, message: impl Into<String>) -> &mut Diagnostic {
        self.errors += 1;
        if self.errors > MOST_ERRORS {
            return &mut self.unseen;
        }
        self.sink.error(span, message)
    }

    pub(crate) fn warning(&mut self, span: Span, message: impl Into<String>) -> &mut Diagnostic {
        self.warnings += 1;
        if self.warnings > MOST_WARNINGS {
            return &mut self.unseen;
        }
        self.sink.warning(span, message)
    }

    /// True the first time that `key` is asked for: things said once for a whole scene.
    pub(crate) fn first(&mut self, key: &str) -> bool {
        self.said.insert(key.to_owned())
    }

    pub(crate) fn add_source(&mut self, path: &std::path::Path) -> FileId {
        self.sink.add_source(path)
    }

    pub(crate) fn sources(&self) -> &scene_desc::SourceMap {
        self.sink.sources()
    }

    /// `file:line:column` of a span, for messages that name a second place.
    pub(crate) fn locate(&self, span: Span) -> String {
        self.sink.sources().locate(span)
    }

    pub(crate) fn has_errors(&self) -> bool {
        self.errors > 0
    }

    /// Enough has been shown: what else is found would not be.
    pub(crate) fn is_full(&self) -> bool {
        self.errors > MOST_ERRORS
    }

    /// Says how many were not shown.
    pub(crate) fn finish(self) {
        if self.errors > MOST_ERRORS {
            self.sink.error(Span::NONE, format!("… and {} more errors", self.errors - MOST_ERRORS));
        }
        if self.warnings > MOST_WARNINGS {
            self.sink.warning(Span::NONE, format!("… and {} more warnings", self.warnings - MOST_WARNINGS));
        }
    }
}
