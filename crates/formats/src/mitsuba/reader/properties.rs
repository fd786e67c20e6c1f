//! Elements that hold a value: properties and transforms.

use math::AnimatedTransform;

use super::{Attributes, ELEMENTS, File, Reader, Xml};
use crate::mitsuba::text;
use crate::mitsuba::transform::{self, OPERATIONS, Wrong};
use crate::mitsuba::tree::{Class, NodeId};
use crate::mitsuba::value;
use crate::suggest;

impl Reader<'_, '_> {
    pub(super) fn property(
        &mut self,
        xml: Xml<'_>,
        attributes: &Attributes<'_>,
        parent: NodeId,
        file: &File<'_>,
    ) {
        let element = xml.tag_name().name();
        let span = attributes.span;
        let get = |name: &str| attributes.get(name);
        let read = match value::read(element, &get, &file.dirs) {
            Some(read) => read,
            None => {
                let (message, hint) = if OPERATIONS.contains(&element) {
                    (format!("<{element}> outside of a <transform>"), "put it into one".to_owned())
                } else {
                    let all: Vec<_> = Class::elements().chain(ELEMENTS).collect();
                    let hint = match suggest::nearest(element, all) {
                        Some(e) => format!("did you mean <{e}>?"),
                        None => "no such element is known".to_owned(),
                    };
                    (format!("unknown element <{}>", text::show(element)), hint)
                };
                self.report.error(span, message).hint(hint);
                return;
            }
        };
        match read {
            Ok((value, hash)) => {
                self.tree.hashes.extend(hash);
                if get("name").is_none_or(str::is_empty) {
                    let message = format!("<{element}> has no name");
                    self.report.error(span, message).hint("say which property it is: name=\"…\"");
                    return;
                }
                self.add(parent, attributes, file, value);
            }
            Err(Wrong { message, hint }) => {
                let name = get("name").map(|n| format!(" of \"{}\"", text::show(n))).unwrap_or_default();
                self.report.error(span, format!("<{element}>{name}: {message}")).hint(hint);
            }
        }
        if let Some(child) = xml.children().find(Xml::is_element) {
            let span = file.lines.span(child.range().start);
            let message = format!("<{}> within <{element}>", text::show(child.tag_name().name()));
            self.report.error(span, message).hint("properties hold nothing: close the outer one first");
        }
    }

    /// `<transform>`, or an `<animation>` of them.
    pub(super) fn transform(
        &mut self,
        xml: Xml<'_>,
        file: &File<'_>,
        is_animated: bool,
    ) -> Option<AnimatedTransform> {
        if !is_animated {
            return self.still(xml, file).map(AnimatedTransform::fixed);
        }
        let mut keys = Vec::new();
        for key in xml.children().filter(Xml::is_element) {
            let span = file.lines.span(key.range().start);
            let attributes = self.attributes(key, span)?;
            let time = attributes.get("time").and_then(text::number);
            let (Some(time), "transform") = (time, key.tag_name().name()) else {
                let hint = "expected <transform time=\"…\">";
                self.report.error(span, "an animation holds transforms with their times").hint(hint);
                return None;
            };
            keys.push((time as f32, self.still(key, file)?));
        }
        let span = file.lines.span(xml.range().start);
        keys.sort_by(|a, b| a.0.total_cmp(&b.0));
        if keys.len() > 2 {
            self.report
                .warning(span, format!("an animation of {} keys", keys.len()))
                .hint("the first and the last are used");
        }
        let (Some(first), Some(last)) = (keys.first(), keys.last()) else {
            self.report.error(span, "an animation without keys").hint("expected <transform time=\"…\">");
            return None;
        };
        Some(AnimatedTransform::new(first.1, last.1, [first.0, last.0]))
    }

    pub(super) fn still(&mut self, xml: Xml<'_>, file: &File<'_>) -> Option<math::Transform> {
        let mut matrix = math::DMat4::IDENTITY;
        for child in xml.children().filter(Xml::is_element) {
            let span = file.lines.span(child.range().start);
            let name = child.tag_name().name();
            if !OPERATIONS.contains(&name) {
                let message = format!("<{}> within a transform", text::show(name));
                self.report.error(span, message).hint(suggest::hint(name, &OPERATIONS[..5]));
                return None;
            }
            let attributes = self.attributes(child, span)?;
            match transform::operation(name, |a| attributes.get(a)) {
                Ok(m) => matrix = m * matrix,
                Err(Wrong { message, hint }) => {
                    self.report.error(span, format!("<{name}>: {message}")).hint(hint);
                    return None;
                }
            }
        }
        match transform::invertible(matrix) {
            Ok(t) => Some(t),
            Err(Wrong { message, hint }) => {
                self.report.error(file.lines.span(xml.range().start), message).hint(hint);
                None
            }
        }
    }
}
