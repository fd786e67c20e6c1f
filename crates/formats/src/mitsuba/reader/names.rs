//! Names: `$parameters`, ids and aliases, folders.

use std::borrow::Cow;
use std::rc::Rc;

use scene_desc::Span;

use super::{Attributes, File, LONGEST_TEXT, Parameter, Reader, Xml};
use crate::mitsuba::text;
use crate::mitsuba::tree::{NodeId, resolve};
use crate::suggest;

impl Reader<'_, '_> {
    /// All attributes with their parameters put in; `None` if one is not defined.
    pub(super) fn attributes<'a>(&mut self, xml: Xml<'a>, span: Span) -> Option<Attributes<'a>> {
        let mut list = Vec::new();
        for a in xml.attributes() {
            let value = a.value();
            let value = if value.contains('$') {
                Cow::Owned(self.substitute(value, span)?)
            } else {
                Cow::Borrowed(value)
            };
            list.push((a.name(), value));
        }
        Some(Attributes { list, span })
    }

    /// Puts parameters in, the longest name first.
    pub(super) fn substitute(&mut self, text: &str, span: Span) -> Option<String> {
        let mut out = String::new();
        let mut rest = text;
        while let Some(at) = rest.find('$') {
            out.push_str(&rest[..at]);
            rest = &rest[at + 1..];
            let fits = self.parameters.iter_mut().filter(|p| rest.starts_with(p.name.as_str()));
            let Some(p) = fits.max_by_key(|p| p.name.len()) else {
                let word: String = rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                let names: Vec<_> = self.parameters.iter().map(|p| p.name.as_str()).collect();
                let hint = match suggest::nearest(&word, names) {
                    Some(near) => format!("did you mean ${near}?"),
                    None => format!("give it a value with -D {word}=…, or by <default name=\"{word}\" …/>"),
                };
                self.report
                    .error(span, format!("the parameter ${} has no value", text::show(&word)))
                    .hint(hint);
                return None;
            };
            p.unused = false;
            out.push_str(&p.value);
            rest = &rest[p.name.len()..];
            if out.len() > LONGEST_TEXT {
                self.report.error(span, "parameters make this text too long").hint("is it meant so?");
                return None;
            }
        }
        out.push_str(rest);
        Some(out)
    }

    pub(super) fn default(&mut self, attributes: &Attributes<'_>) {
        let Some(name) = self.required(attributes, "name", "default") else { return };
        let value = attributes.get("value").unwrap_or_default().to_owned();
        match self.parameters.iter_mut().find(|p| p.name == name) {
            Some(p) => p.unused = false,
            None => self.parameters.push(Parameter { name, value, unused: false }),
        }
    }

    pub(super) fn path(&mut self, attributes: &Attributes<'_>, file: &mut File<'_>) {
        let Some(name) = self.required(attributes, "value", "path") else { return };
        let path = resolve(&file.dirs, &name);
        if !path.is_dir() {
            self.report
                .error(attributes.span, format!("there is no folder {}", path.display()))
                .hint("paths are relative to the scene file's folder");
            return;
        }
        let dirs = std::iter::once(path).chain(file.dirs.iter().cloned());
        file.dirs = Rc::new(dirs.collect());
    }

    pub(super) fn alias(&mut self, attributes: &Attributes<'_>) {
        let Some(id) = self.required(attributes, "id", "alias") else { return };
        let Some(new) = self.required(attributes, "as", "alias") else { return };
        match self.tree.ids.get(&id).copied() {
            Some(node) => self.define(new, node, attributes.span),
            None => {
                let message = format!("nothing before this has the id \"{}\"", text::show(&id));
                self.report.error(attributes.span, message).hint("an alias comes after what it names");
            }
        }
    }

    pub(super) fn define(&mut self, id: String, node: NodeId, span: Span) {
        if let Some(first) = self.tree.ids.get(&id) {
            let place = self.report.locate(self.tree.node(*first).span);
            self.report
                .error(span, format!("the id \"{}\" is given twice", text::show(&id)))
                .hint(format!("the first is at {place}"));
            return;
        }
        self.tree.ids.insert(id, node);
    }
}
