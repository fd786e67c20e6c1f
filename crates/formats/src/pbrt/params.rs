//! Typed parameter lists: `"float fov" [ 35 ]`. Whoever builds a thing asks for its parameters by name and type;
//! what nobody asked for is an error, as in pbrt, with the name or type that was probably meant.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use math::{Vec2, Vec3};
use scene_desc::{ColorSpaceName, Span};

use super::lexer::{Kind, Lexer};
use super::parser::Refused;
use crate::report::Report;
use crate::suggest;

/// The types of parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Type {
    Bool,
    Float,
    Integer,
    Point2,
    Vector2,
    Point3,
    Vector3,
    Normal,
    String,
    Texture,
    Rgb,
    Spectrum,
    Blackbody,
}

const TYPES: [(&str, Type); 13] = [
    ("bool", Type::Bool),
    ("float", Type::Float),
    ("integer", Type::Integer),
    ("point2", Type::Point2),
    ("vector2", Type::Vector2),
    ("point3", Type::Point3),
    ("vector3", Type::Vector3),
    ("normal", Type::Normal),
    ("string", Type::String),
    ("texture", Type::Texture),
    ("rgb", Type::Rgb),
    ("spectrum", Type::Spectrum),
    ("blackbody", Type::Blackbody),
];

impl Type {
    pub(super) fn name(self) -> &'static str {
        TYPES.iter().find(|t| t.1 == self).map_or("", |t| t.0)
    }

    /// Values that make one item.
    fn arity(self) -> usize {
        match self {
            Self::Bool | Self::Float | Self::Integer | Self::String => 1,
            Self::Texture | Self::Spectrum | Self::Blackbody => 1,
            Self::Point2 | Self::Vector2 => 2,
            Self::Point3 | Self::Vector3 | Self::Normal | Self::Rgb => 3,
        }
    }
}

/// What a parameter holds.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Values {
    Floats(Vec<f32>),
    Integers(Vec<i32>),
    Strings(Vec<String>),
    Bools(Vec<bool>),
}

/// One parameter as written.
#[derive(Clone, Debug)]
pub(super) struct Param {
    pub(super) ty: Type,
    pub(super) name: Box<str>,
    pub(super) values: Values,
    pub(super) span: Span,
    /// The colour space at an `Attribute` directive, which stays with the parameter.
    pub(super) space: Option<ColorSpaceName>,
    used: Cell<bool>,
}

impl Param {
    pub(super) fn floats(&self) -> &[f32] {
        match &self.values {
            Values::Floats(v) => v,
            Values::Integers(_) | Values::Strings(_) | Values::Bools(_) => &[],
        }
    }

    pub(super) fn strings(&self) -> &[String] {
        match &self.values {
            Values::Strings(v) => v,
            Values::Floats(_) | Values::Integers(_) | Values::Bools(_) => &[],
        }
    }
}

/// The parameters of one directive, with the defaults that an `Attribute` directive gave.
#[derive(Debug)]
pub(super) struct Params {
    list: Vec<Param>,
    defaults: Rc<Vec<Param>>,
    pub(super) space: ColorSpaceName,
    /// All that was asked for, for hints.
    asked: RefCell<Vec<(&'static str, Type)>>,
}

impl Params {
    pub(super) fn new(list: Vec<Param>, defaults: Rc<Vec<Param>>, space: ColorSpaceName) -> Self {
        Self { list, defaults, space, asked: RefCell::default() }
    }

    /// The parameter of that name and one of these types: the last one given, else the last default.
    pub(super) fn find(&self, name: &'static str, types: &[Type]) -> Option<&Param> {
        let mut asked = self.asked.borrow_mut();
        asked.extend(types.iter().map(|t| (name, *t)));
        let is_it = |p: &&Param| &*p.name == name && types.contains(&p.ty);
        let found = self.list.iter().rev().find(is_it).or_else(|| self.defaults.iter().rev().find(is_it));
        if let Some(p) = found {
            p.used.set(true);
        }
        found
    }

    /// Remembers that a parameter would be possible, without using it.
    pub(super) fn mention(&self, name: &'static str, types: &[Type]) {
        self.asked.borrow_mut().extend(types.iter().map(|t| (name, *t)));
    }

    /// Takes a long array out instead of copying it.
    pub(super) fn take_integers(&mut self, name: &'static str) -> Option<(Vec<i32>, Span)> {
        let found = self.find(name, &[Type::Integer])?;
        let span = found.span;
        let copy = match &found.values {
            Values::Integers(v) => (!self.list.iter().any(|p| std::ptr::eq(p, found))).then(|| v.clone()),
            Values::Floats(_) | Values::Strings(_) | Values::Bools(_) => return None,
        };
        if let Some(copy) = copy {
            return Some((copy, span));
        }
        let is_it = |p: &&mut Param| &*p.name == name && p.ty == Type::Integer;
        match self.list.iter_mut().rev().find(is_it) {
            Some(Param { values: Values::Integers(v), .. }) => Some((std::mem::take(v), span)),
            Some(_) | None => None,
        }
    }

    pub(super) fn float_opt(&self, name: &'static str, report: &mut Report<'_>) -> Option<f32> {
        let p = self.find(name, &[Type::Float])?;
        single(p, p.floats(), report).copied()
    }

    pub(super) fn float(&self, name: &'static str, default: f32, report: &mut Report<'_>) -> f32 {
        self.float_opt(name, report).unwrap_or(default)
    }

    pub(super) fn integer_opt(&self, name: &'static str, report: &mut Report<'_>) -> Option<(i32, Span)> {
        let p = self.find(name, &[Type::Integer])?;
        match &p.values {
            Values::Integers(v) => single(p, v, report).map(|x| (*x, p.span)),
            Values::Floats(_) | Values::Strings(_) | Values::Bools(_) => None,
        }
    }

    /// A count: whole, in `range`.
    pub(super) fn count(
        &self,
        name: &'static str,
        default: u32,
        range: std::ops::RangeInclusive<u32>,
        report: &mut Report<'_>,
    ) -> u32 {
        let Some((value, span)) = self.integer_opt(name, report) else { return default };
        match u32::try_from(value).ok().filter(|v| range.contains(v)) {
            Some(v) => v,
            None => {
                let (low, high) = range.into_inner();
                let message = format!("\"{name}\" is {value}");
                report.error(span, message).hint(format!("expected {low} to {high}"));
                default
            }
        }
    }

    pub(super) fn boolean(&self, name: &'static str, default: bool, report: &mut Report<'_>) -> bool {
        let Some(p) = self.find(name, &[Type::Bool]) else { return default };
        match &p.values {
            Values::Bools(v) => single(p, v, report).copied().unwrap_or(default),
            Values::Floats(_) | Values::Integers(_) | Values::Strings(_) => default,
        }
    }

    pub(super) fn string_opt(&self, name: &'static str, report: &mut Report<'_>) -> Option<(String, Span)> {
        let p = self.find(name, &[Type::String])?;
        single(p, p.strings(), report).map(|s| (s.clone(), p.span))
    }

    pub(super) fn vec3(&self, name: &'static str, ty: Type, default: Vec3, report: &mut Report<'_>) -> Vec3 {
        let Some(p) = self.find(name, &[ty]) else { return default };
        match p.floats() {
            [x, y, z] => Vec3::new(*x, *y, *z),
            more => {
                report.error(p.span, format!("\"{name}\" has {} values", more.len())).hint("it takes three");
                default
            }
        }
    }

    /// All items of a three-dimensional parameter; empty if it is not there.
    pub(super) fn vec3s(&self, name: &'static str, ty: Type) -> Vec<Vec3> {
        let floats = self.find(name, &[ty]).map(Param::floats).unwrap_or_default();
        floats.chunks_exact(3).map(Vec3::from_slice).collect()
    }

    pub(super) fn vec2s(&self, name: &'static str) -> Vec<Vec2> {
        let floats = self.find(name, &[Type::Point2]).map(Param::floats).unwrap_or_default();
        floats.chunks_exact(2).map(Vec2::from_slice).collect()
    }

    /// Exactly four numbers of a type, such as a window.
    pub(super) fn four_floats(&self, name: &'static str, report: &mut Report<'_>) -> Option<[f32; 4]> {
        let p = self.find(name, &[Type::Float])?;
        let four = <[f32; 4]>::try_from(p.floats()).ok();
        if four.is_none() {
            report.error(p.span, format!("\"{name}\" has {} values", p.floats().len())).hint("it takes four");
        }
        four
    }

    /// Where a parameter of that name stands, whatever its type.
    pub(super) fn span_of(&self, name: &str) -> Option<Span> {
        self.list.iter().rev().find(|p| &*p.name == name).map(|p| p.span)
    }

    /// Asks for parameters that have no effect here, so that they are not called unknown.
    pub(super) fn accept(&self, names: &[(&'static str, Type)]) {
        for (name, ty) in names {
            self.find(name, &[*ty]);
        }
    }

    /// Reports what nobody asked for.
    pub(super) fn report_unused(&self, what: &str, report: &mut Report<'_>) {
        let asked = self.asked.borrow();
        for (i, p) in self.list.iter().enumerate() {
            let overridden = || self.list[i + 1..].iter().any(|q| q.name == p.name && q.used.get());
            if p.used.get() || overridden() {
                continue;
            }
            let mut types: Vec<_> = asked.iter().filter(|a| a.0 == &*p.name).map(|a| a.1.name()).collect();
            types.dedup();
            let declared = format!("\"{} {}\"", p.ty.name(), p.name);
            if types.is_empty() {
                let error = report.error(p.span, format!("{declared}: {what} has no such parameter"));
                match suggest::nearest(&p.name, asked.iter().map(|a| a.0)) {
                    Some(name) => error.hint(format!("did you mean \"{name}\"?")),
                    None => error.hint("remove it"),
                }
            } else if types.contains(&p.ty.name()) {
                report
                    .error(p.span, format!("{declared}: {what} does not use it together with the others"))
                    .hint("remove it");
            } else {
                let message = format!("{declared}: of the wrong type for {what}");
                report.error(p.span, message).hint(format!("it takes {}", suggest::listing(&types)));
            }
        }
    }
}

/// The one value of a parameter that takes one.
fn single<'v, T>(p: &Param, values: &'v [T], report: &mut Report<'_>) -> Option<&'v T> {
    if values.len() != 1 {
        report.error(p.span, format!("\"{}\" has {} values", p.name, values.len())).hint("it takes one");
    }
    values.first()
}

/// Reads parameters until something comes that is none.
pub(super) fn parse_list(lexer: &mut Lexer<'_>, report: &mut Report<'_>) -> Result<Vec<Param>, Refused> {
    let mut list: Vec<Param> = Vec::new();
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
        }
    }
    Ok(list)
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
        (Some(t), Some(_)) => find_type(t, span, report),
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

fn find_type(name: &str, span: Span, report: &mut Report<'_>) -> Option<Type> {
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
    if let Some(new) = old {
        super::parser::old_syntax(report, span, &format!("parameter type \"{name}\""), new);
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
    let mut reader = Reader { ty, name, values: None, wrong: ty.is_none() };
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
                    Kind::Word(word) if super::parser::is_directive(word) => {
                        let hint = format!("add ] before {}", report.locate(token.span));
                        report.error(start, format!("unterminated list of \"{name}\"")).hint(hint);
                        lexer.put_back(token);
                        return Err(Refused);
                    }
                    Kind::Word(_) | Kind::Text(_) => reader.value(token.kind, token.span, report),
                },
                Some(Err(e)) => return Err(super::parser::lex_error(e, report)),
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
            Kind::Word(word) if super::parser::is_directive(word) => {
                report.error(start, format!("\"{name}\" has no value")).hint("add one, as in [ 1 ]");
                lexer.put_back(token);
                return Err(Refused);
            }
            kind => reader.value(kind, token.span, report),
        },
        Some(Err(e)) => return Err(super::parser::lex_error(e, report)),
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
                report
                    .warning(span, format!("\"{}\": a bool in quotes", self.name))
                    .hint("pbrt-v3's way; pbrt-v4 writes true and false without");
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
        match super::number::i32_at(word) {
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
        match super::number::f32_at(word) {
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

/// A token for a message: readable and not too long.
pub(super) fn show(word: &[u8]) -> String {
    const MOST: usize = 40;
    let text = String::from_utf8_lossy(word);
    let clean: String = text.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    match clean.char_indices().nth(MOST) {
        Some((i, _)) => format!("{}…", &clean[..i]),
        None => clean,
    }
}
