//! What is printed: results to standard output, all else to standard error. A closed pipe is no error.

use std::io::Write;

use scene_desc::{Severity, Sink};

/// Most diagnostics that are shown; the rest is counted.
const MOST: usize = 20;

/// A line to standard output.
pub(crate) fn say(line: &str) {
    // Who closed the pipe wants to hear no more.
    let _ = writeln!(std::io::stdout().lock(), "{line}");
}

/// A line to standard error.
pub(crate) fn note(line: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{line}");
}

/// An error that no file has a place for.
pub(crate) fn error(message: &str) {
    note(&format!("error: {message}"));
}

/// A warning that no file has a place for.
pub(crate) fn warning(message: &str) {
    note(&format!("warning: {message}"));
}

/// One JSON object, last on standard output.
pub(crate) fn json(value: &impl serde::Serialize) {
    match serde_json::to_string(value) {
        Ok(text) => say(&text),
        Err(e) => error(&format!("cannot write JSON: {e}")),
    }
}

/// Diagnostics with place and hint, errors first if not all can be shown.
pub(crate) fn diagnostics(sink: &Sink, strict: bool) {
    let all = sink.diagnostics();
    let (errors, warnings): (Vec<_>, Vec<_>) = all.iter().partition(|d| d.severity == Severity::Error);
    let n_errors = errors.len().min(MOST);
    let n_warnings = warnings.len().min(MOST - n_errors);
    let mut left = (n_errors, n_warnings);
    for d in all {
        let n = match d.severity {
            Severity::Error => &mut left.0,
            Severity::Warning => &mut left.1,
        };
        if *n == 0 {
            continue;
        }
        *n -= 1;
        let severity = if strict { Severity::Error } else { d.severity };
        note(&scene_desc::Diagnostic { severity, ..d.clone() }.render(sink.sources()));
    }
    let hidden = all.len() - n_errors - n_warnings;
    if hidden > 0 {
        note(&format!("… and {hidden} more"));
    }
}

/// A large number that can be read: 12 345 678.
pub(crate) fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::with_capacity(digits.len() * 4 / 3);
    for (i, d) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(d);
    }
    text
}

/// A number of bytes that can be read.
pub(crate) fn bytes(n: u64) -> String {
    let units = ["B", "KiB", "MiB", "GiB", "TiB"];
    let (mut value, mut unit) = (n as f64, 0);
    while value >= 1024.0 && unit + 1 < units.len() {
        value /= 1024.0;
        unit += 1;
    }
    if unit == 0 { format!("{n} B") } else { format!("{value:.1} {}", units[unit]) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_for_people() {
        assert_eq!(grouped(7), "7");
        assert_eq!(grouped(1_234_567), "1 234 567");
        assert_eq!(bytes(1000), "1000 B");
        assert_eq!(bytes(1536), "1.5 KiB");
        assert_eq!(bytes(3 << 30), "3.0 GiB");
    }
}
