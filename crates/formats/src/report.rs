//! Diagnostics of one reading, in the order of the files, and bounded in number: a broken file shall not print a
//! million lines.

use std::collections::HashSet;

use scene_desc::{Diagnostic, FileId, Severity, Sink, SourceMap, Span};

/// Most errors that are shown; the rest is counted.
const MOST_ERRORS: usize = 20;
/// Most warnings that are shown.
const MOST_WARNINGS: usize = 50;

/// Where a reader reports to.
pub(crate) struct Report<'s> {
    sink: &'s mut Sink,
    list: Vec<Diagnostic>,
    errors: usize,
    warnings: usize,
    said: HashSet<String>,
    gave_up: bool,
    /// Takes hints for what is not shown.
    unseen: Diagnostic,
}

impl<'s> Report<'s> {
    pub(crate) fn new(sink: &'s mut Sink) -> Self {
        Self {
            sink,
            list: Vec::new(),
            errors: 0,
            warnings: 0,
            said: HashSet::new(),
            gave_up: false,
            unseen: diagnostic(Severity::Warning, Span::NONE, String::new()),
        }
    }

    pub(crate) fn error(&mut self, span: Span, message: impl Into<String>) -> &mut Diagnostic {
        self.errors += 1;
        if self.errors > MOST_ERRORS {
            return &mut self.unseen;
        }
        self.push(Severity::Error, span, message.into())
    }

    pub(crate) fn warning(&mut self, span: Span, message: impl Into<String>) -> &mut Diagnostic {
        self.warnings += 1;
        if self.warnings > MOST_WARNINGS {
            return &mut self.unseen;
        }
        self.push(Severity::Warning, span, message.into())
    }

    fn push(&mut self, severity: Severity, span: Span, message: String) -> &mut Diagnostic {
        self.list.push(diagnostic(severity, span, message));
        let last = self.list.len() - 1;
        &mut self.list[last]
    }

    /// True the first time that `key` is asked for: things said once for a whole scene.
    pub(crate) fn first(&mut self, key: &str) -> bool {
        self.said.insert(key.to_owned())
    }

    pub(crate) fn add_source(&mut self, path: &std::path::Path) -> FileId {
        self.sink.add_source(path)
    }

    pub(crate) fn sources(&self) -> &SourceMap {
        self.sink.sources()
    }

    /// `file:line:column` of a span, for messages that name a second place.
    pub(crate) fn locate(&self, span: Span) -> String {
        self.sink.sources().locate(span)
    }

    pub(crate) fn has_errors(&self) -> bool {
        self.errors > 0
    }

    pub(crate) fn has_warnings(&self) -> bool {
        self.warnings > 0
    }

    /// Nothing more shall be read.
    pub(crate) fn give_up(&mut self) {
        self.gave_up = true;
    }

    /// Enough has been read, or enough has been said: what else is found would not be shown.
    pub(crate) fn is_over(&self) -> bool {
        self.gave_up || self.errors > MOST_ERRORS
    }

    /// Hands over what was collected; `summary` of an error goes first.
    pub(crate) fn finish(mut self, summary: Option<Diagnostic>) {
        // Stable: messages about one place stay in their order. Those of no file come last.
        self.list.sort_by_key(|d| (d.span.file.map_or(u32::MAX, |f| f.0), d.span.line, d.span.column));
        for d in summary.into_iter().chain(self.list) {
            let Diagnostic { severity, span, message, hint } = d;
            let shown = match severity {
                Severity::Error => self.sink.error(span, message),
                Severity::Warning => self.sink.warning(span, message),
            };
            shown.hint = hint;
        }
        if self.errors > MOST_ERRORS {
            // Reading stops there: nobody has counted the others.
            self.sink.error(Span::NONE, "… and more errors").hint("mend the first ones and try again");
        }
        if self.warnings > MOST_WARNINGS {
            let more = format!("… and {} more warnings", self.warnings - MOST_WARNINGS);
            self.sink.warning(Span::NONE, more).hint("the first are shown");
        }
    }
}

pub(crate) fn diagnostic(severity: Severity, span: Span, message: String) -> Diagnostic {
    Diagnostic { severity, span, message, hint: None }
}
