//! Directives: from tokens to changes of state and to entities.
//!
//! After a mistake the reader goes on at the next directive, so that one run finds many mistakes.

mod arguments;
mod blocks;
mod options;
mod transforms;
mod world;

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use scene_desc::Span;

use super::lexer::{Kind, LexError, Lexer, Token};
use super::params::show;
use super::state::{Entities, GraphicsState, TransformSet};
use crate::report::Report;
use crate::{source, suggest};

/// A directive could not be carried out; that has been reported.
#[derive(Debug)]
pub(in crate::pbrt) struct Refused;

type Done = Result<(), Refused>;

/// Files within files.
const MOST_FILES_DEEP: usize = 64;
/// Blocks within blocks.
const MOST_BLOCKS_DEEP: usize = 4096;
/// Files in all.
const MOST_FILES: usize = 1 << 20;
/// Bytes of files that are read again, in all.
const MOST_REPEATED_BYTES: usize = 1 << 30;
/// Directives of files that are read again, in all: each may become a shape.
const MOST_REPEATED_DIRECTIVES: usize = 1 << 21;

/// All directives.
const DIRECTIVES: [&str; 43] = [
    "Accelerator",
    "ActiveTransform",
    "AreaLightSource",
    "Attribute",
    "AttributeBegin",
    "AttributeEnd",
    "Camera",
    "ColorSpace",
    "ConcatTransform",
    "CoordSysTransform",
    "CoordinateSystem",
    "Film",
    "Identity",
    "Import",
    "Include",
    "Integrator",
    "LightSource",
    "LookAt",
    "MakeNamedMaterial",
    "MakeNamedMedium",
    "Material",
    "MediumInterface",
    "NamedMaterial",
    "ObjectBegin",
    "ObjectEnd",
    "ObjectInstance",
    "Option",
    "PixelFilter",
    "ReverseOrientation",
    "Rotate",
    "Sampler",
    "Scale",
    "Shape",
    "Texture",
    "Transform",
    "TransformBegin",
    "TransformEnd",
    "TransformTimes",
    "Translate",
    "WorldBegin",
    "WorldEnd",
    "Renderer",
    "SurfaceIntegrator",
];

/// Is this word a directive (of any version)?
pub(in crate::pbrt) fn is_directive(word: &[u8]) -> bool {
    word.first().is_some_and(u8::is_ascii_uppercase) && DIRECTIVES.iter().any(|d| d.as_bytes() == word)
}

/// Reports a token that is none.
pub(in crate::pbrt) fn lex_error(e: LexError, report: &mut Report<'_>) -> Refused {
    report.error(e.span, e.message).hint(e.hint);
    Refused
}

/// The key under which [`Report`] knows that pbrt-v3's syntax was met.
pub(in crate::pbrt) const OLD_SYNTAX: &str = "pbrt-v3";

/// Reports a spelling of pbrt-v3, and what there is in its place.
pub(in crate::pbrt) fn old_syntax(report: &mut Report<'_>, span: Span, what: &str, now: &str) {
    report.first(OLD_SYNTAX);
    report.error(span, format!("{what} is pbrt-v3's")).hint(format!("pbrt-v4 has {now}"));
}

/// Reads a scene's main file and what it includes.
pub(in crate::pbrt) fn parse(path: &Path, is_old: bool, report: &mut Report<'_>) -> Entities {
    let file = report.add_source(path);
    let mut parser = Parser::new(path.parent().unwrap_or(Path::new("")).to_owned(), report);
    parser.entities.is_old = is_old;
    let done = parser.file(path, Span::file(file));
    if done.is_ok() && !parser.in_world && !parser.report.is_over() {
        parser
            .report
            .error(Span::file(file), "no WorldBegin: there is no scene in it")
            .hint("shapes and lights come after WorldBegin");
    }
    parser.close_blocks(0);
    parser.entities
}

/// What opened a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Block {
    Attribute,
    Object,
}

struct Parser<'r, 's> {
    report: &'r mut Report<'s>,
    /// Paths are relative to the main file's folder.
    base: PathBuf,
    state: GraphicsState,
    blocks: Vec<(Block, Span, GraphicsState)>,
    coordinate_systems: HashMap<String, TransformSet>,
    in_world: bool,
    object: Option<usize>,
    /// Files being read, outermost first.
    open_files: Vec<PathBuf>,
    files_read: HashSet<PathBuf>,
    n_files: usize,
    repeated_bytes: usize,
    /// This file, or one that includes it, has been read before.
    is_repeated: bool,
    repeated_directives: usize,
    /// Where named things were defined, by kind and name.
    defined: HashMap<(&'static str, String), Span>,
    entities: Entities,
}

impl<'r, 's> Parser<'r, 's> {
    fn new(base: PathBuf, report: &'r mut Report<'s>) -> Self {
        Self {
            report,
            base,
            state: GraphicsState::default(),
            blocks: Vec::new(),
            coordinate_systems: HashMap::new(),
            in_world: false,
            object: None,
            open_files: Vec::new(),
            files_read: HashSet::new(),
            n_files: 0,
            repeated_bytes: 0,
            is_repeated: false,
            repeated_directives: 0,
            defined: HashMap::new(),
            entities: Entities::default(),
        }
    }

    /// Reads one file; `asked_at` is where it was asked for.
    fn file(&mut self, path: &Path, asked_at: Span) -> Done {
        let identity = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        if self.open_files.contains(&identity) {
            let chain: Vec<_> = self.open_files.iter().map(|p| p.display().to_string()).collect();
            return self.refuse(
                asked_at,
                format!("{} includes itself", path.display()),
                format!("the chain is {} → {}", chain.join(" → "), identity.display()),
            );
        }
        if self.open_files.len() >= MOST_FILES_DEEP {
            return self.refuse(
                asked_at,
                format!("files are included more than {MOST_FILES_DEEP} deep"),
                "include them from one place",
            );
        }
        let source = match source::read(path) {
            Ok(source) => source,
            Err(e) => {
                let message = format!("{} cannot be read: {e}", path.display());
                let is_main = self.open_files.is_empty();
                let hint = if is_main && e.is_absent() { "is it the right path?" } else { e.hint() };
                return self.refuse(asked_at, message, hint);
            }
        };
        self.n_files += 1;
        let is_new = self.files_read.insert(identity.clone());
        let was_repeated = self.is_repeated;
        self.is_repeated |= !is_new;
        if self.is_repeated {
            self.repeated_bytes += source.bytes.len();
        }
        if self.n_files > MOST_FILES || self.repeated_bytes > MOST_REPEATED_BYTES {
            return self.repeats(asked_at);
        }
        self.entities.hashes.push(source.hash);
        let file = self.report.add_source(path);
        self.open_files.push(identity);
        let done = self.text(&source.bytes, Span::file(file));
        self.open_files.pop();
        self.is_repeated = was_repeated;
        done
    }

    /// Refuses to read the same files without end.
    fn repeats(&mut self, span: Span) -> Done {
        self.report.give_up();
        let hint = "use ObjectBegin and ObjectInstance for repetition";
        self.refuse(span, "the same files are included again and again", hint)
    }

    /// Reads directives to the end of a file.
    fn text(&mut self, bytes: &[u8], whole: Span) -> Done {
        if let Some(what) = not_text(bytes) {
            return self.refuse(whole, what, "expected pbrt-v4's text");
        }
        let Some(file) = whole.file else { return Err(Refused) };
        let mut lexer = Lexer::new(bytes, file);
        lexer.is_old = self.entities.is_old;
        while let Some(token) = lexer.next() {
            let done = match token {
                Ok(token) => self.directive(token, &mut lexer),
                Err(e) => Err(lex_error(e, self.report)),
            };
            if done.is_err() {
                if self.report.is_over() {
                    return Err(Refused);
                }
                skip_to_directive(&mut lexer);
            }
        }
        Ok(())
    }

    fn refuse(&mut self, span: Span, message: impl Into<String>, hint: impl Into<String>) -> Done {
        self.report.error(span, message).hint(hint);
        Err(Refused)
    }

    fn directive(&mut self, token: Token<'_>, lexer: &mut Lexer<'_>) -> Done {
        let span = token.span;
        self.repeated_directives += usize::from(self.is_repeated);
        if self.repeated_directives > MOST_REPEATED_DIRECTIVES {
            return self.repeats(span);
        }
        let word = match token.kind {
            Kind::Word(word) => word,
            Kind::Text(text) => {
                let message = format!("expected a directive, found the string \"{}\"", show(text.as_bytes()));
                return self.refuse(span, message, "is something missing before it?");
            }
            Kind::Open | Kind::Close => {
                return self.refuse(span, "expected a directive, found a bracket", "is one too many?");
            }
        };
        match std::str::from_utf8(word).unwrap_or_default() {
            "Identity" | "Translate" | "Scale" | "Rotate" | "LookAt" | "Transform" | "ConcatTransform"
            | "CoordinateSystem" | "CoordSysTransform" | "TransformTimes" | "ActiveTransform" => {
                self.transform(word, span, lexer)
            }
            "Camera" | "Film" | "Sampler" | "Integrator" | "PixelFilter" | "Accelerator" | "Option"
            | "ColorSpace" | "WorldBegin" => self.option(word, span, lexer),
            "AttributeBegin" | "AttributeEnd" | "TransformBegin" | "TransformEnd" | "ObjectBegin"
            | "ObjectEnd" | "ObjectInstance" | "Include" | "Import" => self.structure(word, span, lexer),
            "Shape" | "Material" | "MakeNamedMaterial" | "NamedMaterial" | "Texture" | "LightSource"
            | "AreaLightSource" | "MediumInterface" | "MakeNamedMedium" | "ReverseOrientation"
            | "Attribute" => self.world(word, span, lexer),
            "WorldEnd" if self.entities.is_old => Ok(()),
            "WorldEnd" => {
                old_syntax(self.report, span, "WorldEnd", "no such directive: the scene ends with the file");
                Err(Refused)
            }
            "Renderer" | "SurfaceIntegrator" => {
                old_syntax(self.report, span, &show(word), "Integrator");
                Err(Refused)
            }
            _ => {
                let word = show(word);
                let hint = match suggest::nearest(&word, DIRECTIVES) {
                    Some(d) => format!("did you mean {d}?"),
                    None => "directives are words such as Shape or Material".to_owned(),
                };
                self.refuse(span, format!("unknown directive {word}"), hint)
            }
        }
    }
}

/// Goes on to what looks like a directive.
fn skip_to_directive(lexer: &mut Lexer<'_>) {
    while let Some(token) = lexer.peek() {
        if matches!(token, Ok(Token { kind: Kind::Word(word), .. }) if is_directive(word)) {
            return;
        }
        lexer.next();
    }
}

/// Why bytes are no scene's text, judged by their beginning.
fn not_text(bytes: &[u8]) -> Option<&'static str> {
    let head = &bytes[..bytes.len().min(4096)];
    if head.starts_with(&[0xfe, 0xff]) || head.starts_with(&[0xff, 0xfe]) {
        return Some("UTF-16 text: only UTF-8 can be read");
    }
    let odd = head.iter().filter(|b| **b < 9 || (14..32).contains(*b) || **b == 127).count();
    (odd * 50 > head.len()).then_some("binary data, not a scene's text")
}
