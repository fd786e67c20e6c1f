//! Text of attributes: numbers, lists, places in a file.

use scene_desc::{FileId, Span};

/// A finite number, all of the text.
pub(super) fn number(text: &str) -> Option<f64> {
    text.trim().parse::<f64>().ok().filter(|x| x.is_finite())
}

/// A whole number, all of the text.
pub(super) fn integer(text: &str) -> Option<i64> {
    text.trim().parse().ok()
}

/// Items between commas and blanks.
pub(super) fn items(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| c == ',' || c.is_whitespace()).filter(|s| !s.is_empty())
}

/// Finite numbers between commas and blanks; `Err` with the item that is none.
pub(super) fn numbers(text: &str) -> Result<Vec<f64>, &str> {
    items(text).map(|item| number(item).ok_or(item)).collect()
}

/// `sampleCount` to `sample_count`, `intIOR` to `int_ior`: names of versions before 2.0.
pub(super) fn underscored(name: &str) -> String {
    let mut out = String::with_capacity(name.len() + 4);
    let mut previous: Option<char> = None;
    let mut in_capitals = false;
    for c in name.chars() {
        let begins = c.is_ascii_uppercase() && previous.is_some_and(|p| p.is_ascii_lowercase());
        in_capitals = begins || (in_capitals && c.is_ascii_uppercase());
        if begins {
            out.push('_');
        }
        out.push(if in_capitals { c.to_ascii_lowercase() } else { c });
        previous = Some(c);
    }
    out
}

/// At most forty characters of a text, for messages.
pub(super) fn show(text: &str) -> String {
    const MOST: usize = 40;
    let clean: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).take(MOST).collect();
    if text.chars().count() > MOST { format!("{clean}…") } else { clean }
}

/// Where lines begin, so that a place is found without reading the file again.
pub(super) struct Lines<'t> {
    text: &'t str,
    starts: Vec<usize>,
    file: FileId,
}

impl<'t> Lines<'t> {
    pub(super) fn new(text: &'t str, file: FileId) -> Self {
        let ends = text.bytes().enumerate().filter(|(_, b)| *b == b'\n').map(|(i, _)| i + 1);
        Self { text, starts: std::iter::once(0).chain(ends).collect(), file }
    }

    /// The place of a byte.
    pub(super) fn span(&self, at: usize) -> Span {
        let line = self.starts.partition_point(|s| *s <= at).max(1);
        let start = self.starts[line - 1];
        // One long line shall not be counted again for each of its elements.
        const LONGEST: usize = 4096;
        let column = if at - start > LONGEST {
            0
        } else {
            self.text.get(start..at).map_or(0, |s| s.chars().count() + 1)
        };
        let small = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        Span { file: Some(self.file), line: small(line), column: small(column) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_names_become_new_ones() {
        for (old, new) in [
            ("toWorld", "to_world"),
            ("intIOR", "int_ior"),
            ("sampleCount", "sample_count"),
            ("sigmaT", "sigma_t"),
            ("alpha", "alpha"),
            ("specularReflectance", "specular_reflectance"),
            ("IOR", "IOR"),
            ("", ""),
        ] {
            assert_eq!(underscored(old), new);
        }
    }

    #[test]
    fn lists_have_commas_or_blanks() {
        assert_eq!(numbers("1, 2.5 ,-3e1"), Ok(vec![1.0, 2.5, -30.0]));
        assert_eq!(numbers(" "), Ok(vec![]));
        assert_eq!(numbers("1 x 2"), Err("x"));
        assert_eq!(numbers("1 nan"), Err("nan"));
    }

    #[test]
    fn a_byte_has_a_line_and_a_column() {
        let lines = Lines::new("ab\ncä\u{1f600}d\n", FileId(0));
        let at = |i| (lines.span(i).line, lines.span(i).column);
        assert_eq!(at(0), (1, 1));
        assert_eq!(at(3), (2, 1));
        assert_eq!(at(10), (2, 4), "columns are characters");
    }
}
