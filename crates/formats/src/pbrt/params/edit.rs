//! Changing parameter lists: how the syntax of pbrt-v3 becomes that of pbrt-v4.

use std::cell::Cell;

use scene_desc::Span;

use super::{Param, Params, Type, Values};

impl Params {
    /// The last parameter of that name, without counting it as used.
    pub(in crate::pbrt) fn peek(&self, name: &str) -> Option<&Param> {
        self.list.iter().rev().find(|p| &*p.name == name)
    }

    /// Another name for a parameter.
    pub(in crate::pbrt) fn rename(&mut self, from: &str, to: &str) {
        for p in self.list.iter_mut().filter(|p| &*p.name == from) {
            p.name = to.into();
        }
    }

    /// Takes a parameter out.
    pub(in crate::pbrt) fn remove(&mut self, name: &str) -> Option<Param> {
        let at = self.list.iter().rposition(|p| &*p.name == name)?;
        let found = self.list.remove(at);
        self.list.retain(|p| &*p.name != name);
        Some(found)
    }

    /// Another type for a parameter of this type.
    pub(in crate::pbrt) fn retype(&mut self, name: &str, from: Type, to: Type) {
        for p in self.list.iter_mut().filter(|p| &*p.name == name && p.ty == from) {
            p.ty = to;
        }
    }

    /// Adds a parameter, or replaces it.
    pub(in crate::pbrt) fn set(&mut self, ty: Type, name: &str, values: Values, span: Span) {
        let span = self.remove(name).map_or(span, |p| p.span);
        self.list.push(Param { ty, name: name.into(), values, span, space: None, used: Cell::new(false) });
    }

    /// [`Self::set`] of one number.
    pub(in crate::pbrt) fn set_float(&mut self, name: &str, value: f32, span: Span) {
        self.set(Type::Float, name, Values::Floats(vec![value]), span);
    }

    /// [`Self::set`] of one word.
    pub(in crate::pbrt) fn set_word(&mut self, name: &str, value: &str, span: Span) {
        self.set(Type::String, name, Values::Strings(vec![value.to_owned()]), span);
    }
}
