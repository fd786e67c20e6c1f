//! From bytes to tokens: words, quoted strings, brackets; comments are skipped. Nothing is copied but strings with
//! escapes, and arrays of numbers are read without a token in between.

use std::borrow::Cow;

use scene_desc::{FileId, Span};

use super::number;

/// A token's meaning.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Kind<'a> {
    /// A directive, a number or a bare word.
    Word(&'a [u8]),
    /// In quotes, without them.
    Text(Cow<'a, str>),
    Open,
    Close,
}

/// A token and its place.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Token<'a> {
    pub(super) kind: Kind<'a>,
    pub(super) span: Span,
}

/// A token that cannot be one.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LexError {
    pub(super) span: Span,
    pub(super) message: &'static str,
    pub(super) hint: &'static str,
}

/// Reads tokens from a file's bytes.
pub(super) struct Lexer<'a> {
    bytes: &'a [u8],
    at: usize,
    file: FileId,
    line: u32,
    /// Where in the line columns have been counted up to, and that column.
    counted: (usize, u32),
    peeked: Option<Result<Token<'a>, LexError>>,
    /// Is it pbrt-v3's syntax?
    pub(super) is_old: bool,
}

impl<'a> Lexer<'a> {
    pub(super) fn new(bytes: &'a [u8], file: FileId) -> Self {
        // A byte order mark is no token.
        let at = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        Self { bytes, at, file, line: 1, counted: (at, 1), peeked: None, is_old: false }
    }

    /// The next token; `None` at the end of the file.
    pub(super) fn next(&mut self) -> Option<Result<Token<'a>, LexError>> {
        self.peeked.take().or_else(|| self.read())
    }

    /// Looks at the next token.
    pub(super) fn peek(&mut self) -> Option<&Result<Token<'a>, LexError>> {
        if self.peeked.is_none() {
            self.peeked = self.read();
        }
        self.peeked.as_ref()
    }

    /// Gives a token back, to be read again.
    pub(super) fn put_back(&mut self, token: Token<'a>) {
        self.peeked = Some(Ok(token));
    }

    /// The place of what comes next (at the end of the file: the end).
    pub(super) fn here(&mut self) -> Span {
        match &self.peeked {
            Some(Ok(token)) => token.span,
            Some(Err(e)) => e.span,
            None => {
                self.skip_space();
                self.span()
            }
        }
    }

    /// Appends numbers until something else comes, which is left. Call after `[` was taken.
    pub(super) fn floats(&mut self, out: &mut Vec<f32>) {
        self.numbers(|bytes| {
            let (x, length) = number::f32_at(bytes).filter(|(x, _)| x.is_finite())?;
            out.push(x);
            Some(length)
        });
    }

    /// The same for whole numbers.
    pub(super) fn integers(&mut self, out: &mut Vec<i32>) {
        self.numbers(|bytes| {
            let (x, length) = number::i32_at(bytes)?;
            out.push(x?);
            Some(length)
        });
    }

    fn numbers(&mut self, mut take: impl FnMut(&[u8]) -> Option<usize>) {
        if self.peeked.is_some() {
            return;
        }
        loop {
            self.skip_space();
            let Some(length) = take(&self.bytes[self.at..]) else { return };
            self.at += length;
        }
    }

    fn read(&mut self) -> Option<Result<Token<'a>, LexError>> {
        self.skip_space();
        let first = *self.bytes.get(self.at)?;
        let span = self.span();
        let start = self.at;
        let kind = match first {
            b'[' => {
                self.at += 1;
                Kind::Open
            }
            b']' => {
                self.at += 1;
                Kind::Close
            }
            b'"' => return Some(self.text(span)),
            _ => {
                let rest = &self.bytes[start..];
                let length = rest.iter().position(|b| number::is_delimiter(*b)).unwrap_or(rest.len());
                self.at += length;
                Kind::Word(&rest[..length])
            }
        };
        Some(Ok(Token { kind, span }))
    }

    /// A quoted string; `at` is on the quote.
    fn text(&mut self, span: Span) -> Result<Token<'a>, LexError> {
        let error = |message, hint| Err(LexError { span, message, hint });
        let start = self.at + 1;
        let mut i = start;
        let mut escaped = false;
        loop {
            match self.bytes.get(i) {
                None => {
                    self.at = self.bytes.len();
                    return error("unterminated string: the file ends in it", "add the closing quote");
                }
                Some(b'\n') => {
                    self.at = i;
                    return error("unterminated string: the line ends in it", "add the closing quote");
                }
                Some(b'"') => break,
                Some(b'\\') => {
                    escaped = true;
                    i += 2;
                }
                Some(_) => i += 1,
            }
        }
        self.at = i + 1;
        let raw = &self.bytes[start..i];
        let text = if escaped {
            match unescape(raw) {
                Some(bytes) => Cow::Owned(String::from_utf8_lossy(&bytes).into_owned()),
                None => {
                    return error(
                        "unknown escape in a string",
                        "\\b \\f \\n \\r \\t \\\\ \\' and \\\" are known; write paths with / or \\\\",
                    );
                }
            }
        } else {
            String::from_utf8_lossy(raw)
        };
        Ok(Token { kind: Kind::Text(text), span })
    }

    fn skip_space(&mut self) {
        while let Some(b) = self.bytes.get(self.at) {
            match b {
                b'\n' => {
                    self.line += 1;
                    self.at += 1;
                    self.counted = (self.at, 1);
                }
                b' ' | b'\t' | b'\r' => self.at += 1,
                b'#' => {
                    let rest = &self.bytes[self.at..];
                    let end = rest.iter().position(|b| matches!(b, b'\n' | b'\r'));
                    self.at += end.unwrap_or(rest.len());
                }
                _ => return,
            }
        }
    }

    /// Where `at` is. Columns are counted on from the last place asked for: a file of one long line stays linear.
    fn span(&mut self) -> Span {
        let (from, column) = self.counted;
        let new = self.bytes[from..self.at].iter().filter(|b| (**b & 0xc0) != 0x80).count();
        let column = column.saturating_add(u32::try_from(new).unwrap_or(u32::MAX));
        self.counted = (self.at, column);
        Span { file: Some(self.file), line: self.line, column }
    }
}

fn unescape(raw: &[u8]) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(raw.len());
    let mut bytes = raw.iter();
    while let Some(b) = bytes.next() {
        out.push(match b {
            b'\\' => match bytes.next()? {
                b'b' => 8,
                b'f' => 12,
                b'n' => b'\n',
                b'r' => b'\r',
                b't' => b'\t',
                c @ (b'\\' | b'\'' | b'"') => *c,
                _ => return None,
            },
            b => *b,
        });
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds(text: &str) -> Vec<(String, u32, u32)> {
        let mut lexer = Lexer::new(text.as_bytes(), FileId(0));
        let mut out = Vec::new();
        while let Some(token) = lexer.next() {
            out.push(match token {
                Ok(Token { kind, span }) => (format!("{kind:?}"), span.line, span.column),
                Err(e) => (e.message.to_owned(), e.span.line, e.span.column),
            });
        }
        out
    }

    #[test]
    fn tokens_know_their_line_and_column_in_characters() {
        let tokens = kinds("# a comment \"\nA \"b c\"[1]\n  \"\u{e4}\u{f6}\" x#y");
        let places: Vec<_> = tokens.iter().map(|t| (t.1, t.2)).collect();
        assert_eq!(places, [(2, 1), (2, 3), (2, 8), (2, 9), (2, 10), (3, 3), (3, 8)]);
        assert_eq!(tokens[1].0, "Text(\"b c\")");
    }

    #[test]
    fn strings_end_or_are_errors() {
        assert_eq!(kinds(r#""a\"b\\c""#)[0].0, r#"Text("a\"b\\c")"#);
        assert!(kinds("\"ab\n\"c\"")[0].0.starts_with("unterminated"));
        assert_eq!(kinds("\"ab\n\"c\"")[1].0, "Text(\"c\")");
        assert!(kinds("\"ab\\")[0].0.starts_with("unterminated"));
        assert!(kinds(r#""a\q""#)[0].0.starts_with("unknown escape"));
    }

    #[test]
    fn arrays_of_numbers_are_read_up_to_what_is_none() {
        let mut lexer = Lexer::new(b" 1 2.5 # c\n -3e1] 4", FileId(0));
        let mut out = Vec::new();
        lexer.floats(&mut out);
        assert_eq!(out, [1.0, 2.5, -30.0]);
        assert_eq!(lexer.next().unwrap().unwrap().kind, Kind::Close);
    }
}
