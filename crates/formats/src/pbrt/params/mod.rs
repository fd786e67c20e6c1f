//! Typed parameter lists: `"float fov" [ 35 ]`. Whoever builds a thing asks for its parameters by name and type;
//! what nobody asked for is an error, as in pbrt, with the name or type that was probably meant.

mod edit;
mod values;

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use math::{Vec2, Vec3};
use scene_desc::{ColorSpaceName, Span};

use crate::report::Report;
use crate::suggest;

pub(in crate::pbrt) use values::parse_list;

/// The types of parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::pbrt) enum Type {
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
    pub(in crate::pbrt) fn name(self) -> &'static str {
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
pub(in crate::pbrt) enum Values {
    Floats(Vec<f32>),
    Integers(Vec<i32>),
    Strings(Vec<String>),
    Bools(Vec<bool>),
}

/// One parameter as written.
#[derive(Clone, Debug)]
pub(in crate::pbrt) struct Param {
    pub(in crate::pbrt) ty: Type,
    pub(in crate::pbrt) name: Box<str>,
    pub(in crate::pbrt) values: Values,
    pub(in crate::pbrt) span: Span,
    /// The colour space at an `Attribute` directive, which stays with the parameter.
    pub(in crate::pbrt) space: Option<ColorSpaceName>,
    used: Cell<bool>,
}

impl Param {
    pub(in crate::pbrt) fn floats(&self) -> &[f32] {
        match &self.values {
            Values::Floats(v) => v,
            Values::Integers(_) | Values::Strings(_) | Values::Bools(_) => &[],
        }
    }

    pub(in crate::pbrt) fn strings(&self) -> &[String] {
        match &self.values {
            Values::Strings(v) => v,
            Values::Floats(_) | Values::Integers(_) | Values::Bools(_) => &[],
        }
    }
}

/// Parameters as read.
#[derive(Debug, Default)]
pub(in crate::pbrt) struct ParamList {
    pub(in crate::pbrt) list: Vec<Param>,
    /// Names of those that were wrong, which has been reported.
    dropped: Vec<Box<str>>,
}

/// The parameters of one directive, with the defaults that an `Attribute` directive gave.
#[derive(Debug)]
pub(in crate::pbrt) struct Params {
    list: Vec<Param>,
    dropped: Vec<Box<str>>,
    defaults: Rc<Vec<Param>>,
    pub(in crate::pbrt) space: ColorSpaceName,
    /// All that was asked for, for hints.
    asked: RefCell<Vec<(&'static str, Type)>>,
}

impl Params {
    pub(in crate::pbrt) fn new(params: ParamList, defaults: Rc<Vec<Param>>, space: ColorSpaceName) -> Self {
        let ParamList { list, dropped } = params;
        Self { list, dropped, defaults, space, asked: RefCell::default() }
    }

    /// Was a parameter of that name given, but wrong?
    pub(in crate::pbrt) fn was_dropped(&self, name: &str) -> bool {
        self.dropped.iter().any(|d| **d == *name)
    }

    /// The parameter of that name and one of these types: the last one given, else the last default.
    pub(in crate::pbrt) fn find(&self, name: &'static str, types: &[Type]) -> Option<&Param> {
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
    pub(in crate::pbrt) fn mention(&self, name: &'static str, types: &[Type]) {
        self.asked.borrow_mut().extend(types.iter().map(|t| (name, *t)));
    }

    /// Takes a long array out instead of copying it.
    pub(in crate::pbrt) fn take_integers(&mut self, name: &'static str) -> Option<(Vec<i32>, Span)> {
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

    pub(in crate::pbrt) fn float_opt(&self, name: &'static str, report: &mut Report<'_>) -> Option<f32> {
        let p = self.find(name, &[Type::Float])?;
        single(p, p.floats(), report).copied()
    }

    pub(in crate::pbrt) fn float(&self, name: &'static str, default: f32, report: &mut Report<'_>) -> f32 {
        self.float_opt(name, report).unwrap_or(default)
    }

    pub(in crate::pbrt) fn integer_opt(
        &self,
        name: &'static str,
        report: &mut Report<'_>,
    ) -> Option<(i32, Span)> {
        let p = self.find(name, &[Type::Integer])?;
        match &p.values {
            Values::Integers(v) => single(p, v, report).map(|x| (*x, p.span)),
            Values::Floats(_) | Values::Strings(_) | Values::Bools(_) => None,
        }
    }

    /// A count: whole, in `range`.
    pub(in crate::pbrt) fn count(
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

    pub(in crate::pbrt) fn boolean(
        &self,
        name: &'static str,
        default: bool,
        report: &mut Report<'_>,
    ) -> bool {
        let Some(p) = self.find(name, &[Type::Bool]) else { return default };
        match &p.values {
            Values::Bools(v) => single(p, v, report).copied().unwrap_or(default),
            Values::Floats(_) | Values::Integers(_) | Values::Strings(_) => default,
        }
    }

    pub(in crate::pbrt) fn string_opt(
        &self,
        name: &'static str,
        report: &mut Report<'_>,
    ) -> Option<(String, Span)> {
        let p = self.find(name, &[Type::String])?;
        single(p, p.strings(), report).map(|s| (s.clone(), p.span))
    }

    pub(in crate::pbrt) fn vec3(
        &self,
        name: &'static str,
        ty: Type,
        default: Vec3,
        report: &mut Report<'_>,
    ) -> Vec3 {
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
    pub(in crate::pbrt) fn vec3s(&self, name: &'static str, ty: Type) -> Vec<Vec3> {
        let floats = self.find(name, &[ty]).map(Param::floats).unwrap_or_default();
        floats.chunks_exact(3).map(Vec3::from_slice).collect()
    }

    pub(in crate::pbrt) fn vec2s(&self, name: &'static str) -> Vec<Vec2> {
        let floats = self.find(name, &[Type::Point2]).map(Param::floats).unwrap_or_default();
        floats.chunks_exact(2).map(Vec2::from_slice).collect()
    }

    /// Exactly four numbers of a type, such as a window.
    pub(in crate::pbrt) fn four_floats(
        &self,
        name: &'static str,
        report: &mut Report<'_>,
    ) -> Option<[f32; 4]> {
        let p = self.find(name, &[Type::Float])?;
        let four = <[f32; 4]>::try_from(p.floats()).ok();
        if four.is_none() {
            report.error(p.span, format!("\"{name}\" has {} values", p.floats().len())).hint("it takes four");
        }
        four
    }

    /// Where a parameter of that name stands, whatever its type.
    pub(in crate::pbrt) fn span_of(&self, name: &str) -> Option<Span> {
        self.list.iter().rev().find(|p| &*p.name == name).map(|p| p.span)
    }

    /// Asks for parameters that have no effect here, so that they are not called unknown.
    pub(in crate::pbrt) fn accept(&self, names: &[(&'static str, Type)]) {
        for (name, ty) in names {
            self.find(name, &[*ty]);
        }
    }

    /// Reports what nobody asked for.
    pub(in crate::pbrt) fn report_unused(&self, what: &str, report: &mut Report<'_>) {
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

/// A token for a message: readable and not too long.
pub(in crate::pbrt) fn show(word: &[u8]) -> String {
    const MOST: usize = 40;
    let text = String::from_utf8_lossy(word);
    let clean: String = text.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    match clean.char_indices().nth(MOST) {
        Some((i, _)) => format!("{}…", &clean[..i]),
        None => clean,
    }
}
