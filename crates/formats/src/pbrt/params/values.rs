//! Parameter lists: from tokens to typed values.

use std::cell::Cell;

use scene_desc::Span;

use super::{Param, ParamList, TYPES, Type, Values, show};
use crate::pbrt::lexer::{Kind, Lexer};
use crate::pbrt::parser::Refused;
use crate::pbrt::{number, parser};
use crate::report::Report;
use crate::suggest;

/// Reads parameters until something comes that is none.
pub(in crate::pbrt) fn parse_list(
    lexer: &mut Lexer<'_>,
    report: &mut Report<'_>,
) -> Result<ParamList, Refused> {
    let ParamList { mut list, mut dropped } = ParamList::default();
    while let Some(Ok(token)) = lexer.peek() {
        let Kind::Text(declaration) = &token.kind else { break };
        let (declaration, span) = (declaration.clone().into_owned(), token.span);
        lexer.next();
        if let Some(p) = parse_one(&declaration, span, lexer, report)? {
            if list.iter().any(|q| q.name == p.name && q.ty == p.ty) {
                report
                    .warning(p.span, format!("\"{}\" is given twice", p.name))
                    .hint("the last one counts, as in pbrt");
            }
            list.push(p);
        } else {
            dropped.extend(declaration.split_ascii_whitespace().last().map(Box::from));
        }
    }
    Ok(ParamList { list, dropped })
}

/// One parameter after its declaration; `None` if it was wrong, but ended properly.
fn parse_one(
    declaration: &str,
    span: Span,
    lexer: &mut Lexer<'_>,
    report: &mut Report<'_>,
) -> Result<Option<Param>, Refused> {
    let mut words = declaration.split([' ', '\t']).filter(|w| !w.is_empty());
    let (type_name, name) = (words.next(), words.next());
    let ty = match (type_name, name) {
        (Some(t), Some(_)) => find_type(t, span, lexer.is_old, report),
        (_, _) => {
            report
                .error(span, format!("\"{declaration}\" is no parameter declaration"))
                .hint("expected a type and a name, as in \"float fov\"");
            None
        }
    };
    let values = parse_values(ty, name.unwrap_or_default(), lexer, report)?;
    let (Some(ty), Some(name), Some(values)) = (ty, name, values) else { return Ok(None) };
    let fits = match &values {
        Values::Floats(v) => v.len() % ty.arity() == 0,
        Values::Integers(_) | Values::Strings(_) | Values::Bools(_) => true,
    };
    let count = match &values {
        Values::Floats(v) => v.len(),
        Values::Integers(v) => v.len(),
        Values::Strings(v) => v.len(),
        Values::Bools(v) => v.len(),
    };
    if count == 0 || !fits {
        let expected = match ty.arity() {
            1 => "at least one".to_owned(),
            n => format!("a multiple of {n}"),
        };
        report
            .error(span, format!("\"{}\" has {count} values", declaration.trim()))
            .hint(format!("expected {expected}"));
        return Ok(None);
    }
    Ok(Some(Param { ty, name: name.into(), values, span, space: None, used: Cell::new(false) }))
}

fn find_type(name: &str, span: Span, is_old: bool, report: &mut Report<'_>) -> Option<Type> {
    if let Some((_, ty)) = TYPES.iter().find(|t| t.0 == name) {
        return Some(*ty);
    }
    let old = match name {
        "point" => Some("point3"),
        "vector" => Some("vector3"),
        "color" => Some("rgb"),
        "xyz" => Some("rgb"),
        _ => None,
    };
    if let (Some(new), true) = (old, is_old) {
        return find_type(new, span, false, report);
    }
    if let Some(new) = old {
        parser::old_syntax(report, span, &format!("parameter type \"{name}\""), new);
        return None;
    }
    let names: Vec<_> = TYPES.iter().map(|t| t.0).collect();
    report.error(span, format!("unknown parameter type \"{name}\"")).hint(suggest::hint(name, &names));
    None
}

/// The values of a parameter, bracketed or single. With no type (it was unknown) they are skipped.
fn parse_values(
    ty: Option<Type>,
    name: &str,
    lexer: &mut Lexer<'_>,
    report: &mut Report<'_>,
) -> Result<Option<Values>, Refused> {
    let mut reader = Reader { ty, name, values: None, wrong: ty.is_none(), is_old: lexer.is_old };
    let start = lexer.here();
    match lexer.next() {
        Some(Ok(token)) if token.kind == Kind::Open => loop {
            if let Some(values) = reader.array(lexer) {
                reader.values = Some(values);
            }
            let end = lexer.here();
            match lexer.next() {
                Some(Ok(token)) => match token.kind {
                    Kind::Close => break,
                    Kind::Open => {
                        report.error(token.span, "a list within a list").hint("close the first with ]");
                        return Err(Refused);
                    }
                    Kind::Word(word) if parser::is_directive(word) => {
                        let hint = format!("add ] before {}", report.locate(token.span));
                        report.error(start, format!("unterminated list of \"{name}\"")).hint(hint);
                        lexer.put_back(token);
                        return Err(Refused);
                    }
                    Kind::Word(_) | Kind::Text(_) => reader.value(token.kind, token.span, report),
                },
                Some(Err(e)) => return Err(parser::lex_error(e, report)),
                None => {
                    let hint = format!("add ] before {}", report.locate(end));
                    report
                        .error(start, format!("unterminated list of \"{name}\": the file ends in it"))
                        .hint(hint);
                    return Err(Refused);
                }
            }
        },
        Some(Ok(token)) if token.kind != Kind::Close => match token.kind {
            Kind::Word(word) if parser::is_directive(word) => {
                report.error(start, format!("\"{name}\" has no value")).hint("add one, as in [ 1 ]");
                lexer.put_back(token);
                return Err(Refused);
            }
            Kind::Word(_) | Kind::Text(_) | Kind::Open | Kind::Close => {
                reader.value(token.kind, token.span, report);
            }
        },
        Some(Err(e)) => return Err(parser::lex_error(e, report)),
        Some(Ok(_)) | None => {
            report.error(start, format!("\"{name}\" has no value")).hint("add one, as in [ 1 ]");
            return Err(Refused);
        }
    }
    if reader.wrong {
        return Ok(None);
    }
    Ok(Some(reader.values.unwrap_or(Values::Floats(Vec::new()))))
}

/// Collects the values of one parameter.
struct Reader<'n> {
    ty: Option<Type>,
    name: &'n str,
    values: Option<Values>,
    /// Something was wrong and has been reported.
    wrong: bool,
    /// Is it pbrt-v3's syntax?
    is_old: bool,
}

/// What a type's values look like.
#[derive(Clone, Copy, PartialEq)]
enum Form {
    Numbers,
    Integers,
    Strings,
    Bools,
    /// A spectrum: names, or wavelengths and values.
    NumbersOrStrings,
}

impl Form {
    fn of(ty: Type) -> Self {
        match ty {
            Type::Bool => Self::Bools,
            Type::Integer => Self::Integers,
            Type::String | Type::Texture => Self::Strings,
            Type::Spectrum => Self::NumbersOrStrings,
            Type::Float | Type::Point2 | Type::Vector2 | Type::Point3 | Type::Vector3 => Self::Numbers,
            Type::Normal | Type::Rgb | Type::Blackbody => Self::Numbers,
        }
    }
}

impl Reader<'_> {
    /// The fast path: all numbers from here on.
    fn array(&mut self, lexer: &mut Lexer<'_>) -> Option<Values> {
        let form = Form::of(self.ty?);
        let mut values = self.values.take();
        match (form, &mut values) {
            (Form::Integers, Some(Values::Integers(v))) => lexer.integers(v),
            (Form::Numbers | Form::NumbersOrStrings, Some(Values::Floats(v))) => lexer.floats(v),
            (Form::Integers, None) => {
                let mut v = Vec::new();
                lexer.integers(&mut v);
                values = Some(Values::Integers(v));
            }
            (Form::Numbers, None) => {
                let mut v = Vec::new();
                lexer.floats(&mut v);
                values = Some(Values::Floats(v));
            }
            (Form::NumbersOrStrings, None) => {
                let mut v = Vec::new();
                lexer.floats(&mut v);
                values = (!v.is_empty()).then_some(Values::Floats(v));
            }
            (_, _) => {}
        }
        values
    }

    /// One value, with a message if it does not fit.
    fn value(&mut self, kind: Kind<'_>, span: Span, report: &mut Report<'_>) {
        if self.wrong {
            return;
        }
        let Some(ty) = self.ty else { return };
        let form = Form::of(ty);
        let fits = match (&kind, form) {
            (Kind::Text(t), Form::Bools) if **t == *"true" || **t == *"false" => {
                if !self.is_old {
                    report
                        .warning(span, format!("\"{}\": a bool in quotes", self.name))
                        .hint("pbrt-v3's way; pbrt-v4 writes true and false without");
                }
                self.push_bool(**t == *"true")
            }
            (Kind::Text(t), Form::Strings | Form::NumbersOrStrings) => {
                self.push_string(t.clone().into_owned())
            }
            (Kind::Word(b"true"), Form::Bools) => self.push_bool(true),
            (Kind::Word(b"false"), Form::Bools) => self.push_bool(false),
            (Kind::Word(w), Form::Integers) => return self.integer(w, span, report),
            (Kind::Word(w), Form::Numbers | Form::NumbersOrStrings) => return self.float(w, span, report),
            (_, _) => false,
        };
        if !fits {
            self.refuse(&kind, span, report);
        }
    }

    fn integer(&mut self, word: &[u8], span: Span, report: &mut Report<'_>) {
        match number::i32_at(word) {
            Some((Some(x), _)) => match self.values.get_or_insert(Values::Integers(Vec::new())) {
                Values::Integers(v) => v.push(x),
                Values::Floats(_) | Values::Strings(_) | Values::Bools(_) => self.wrong = true,
            },
            Some((None, _)) => {
                self.wrong = true;
                let message = format!("\"{}\": {} does not fit an integer", self.name, show(word));
                report.error(span, message).hint("integers go from -2147483648 to 2147483647");
            }
            None => self.refuse(&Kind::Word(word), span, report),
        }
    }

    fn float(&mut self, word: &[u8], span: Span, report: &mut Report<'_>) {
        match number::f32_at(word) {
            Some((x, _)) if x.is_finite() => match self.values.get_or_insert(Values::Floats(Vec::new())) {
                Values::Floats(v) => v.push(x),
                Values::Integers(_) | Values::Strings(_) | Values::Bools(_) => {
                    self.refuse(&Kind::Word(word), span, report);
                }
            },
            Some(_) => {
                self.wrong = true;
                let message = format!("\"{}\": {} does not fit a 32-bit float", self.name, show(word));
                report.error(span, message).hint("floats go up to 3.4e38");
            }
            None => self.refuse(&Kind::Word(word), span, report),
        }
    }

    fn push_bool(&mut self, x: bool) -> bool {
        match self.values.get_or_insert(Values::Bools(Vec::new())) {
            Values::Bools(v) => v.push(x),
            Values::Floats(_) | Values::Integers(_) | Values::Strings(_) => return false,
        }
        true
    }

    fn push_string(&mut self, s: String) -> bool {
        match self.values.get_or_insert(Values::Strings(Vec::new())) {
            Values::Strings(v) => v.push(s),
            Values::Floats(_) | Values::Integers(_) | Values::Bools(_) => return false,
        }
        true
    }

    fn refuse(&mut self, kind: &Kind<'_>, span: Span, report: &mut Report<'_>) {
        self.wrong = true;
        let found = match kind {
            Kind::Word(w) => show(w),
            Kind::Text(t) => show(format!("\"{t}\"").as_bytes()),
            Kind::Open => "[".to_owned(),
            Kind::Close => "]".to_owned(),
        };
        let expected = match self.ty.map(Form::of) {
            Some(Form::Numbers) => "a number",
            Some(Form::Integers) => "a whole number",
            Some(Form::Strings) => "a string in quotes",
            Some(Form::Bools) => "true or false",
            Some(Form::NumbersOrStrings) | None => {
                "a spectrum's name in quotes, or pairs of wavelength and value"
            }
        };
        report
            .error(span, format!("\"{}\": {found} is no {}", self.name, self.ty.map_or("", Type::name)))
            .hint(format!("expected {expected}"));
    }
}
