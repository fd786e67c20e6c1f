//! Blocks, objects and further files.

use std::sync::Arc;

use scene_desc::Span;

use super::{Block, Done, MOST_BLOCKS_DEEP, Parser};
use crate::pbrt::lexer::Lexer;
use crate::pbrt::state::{InstanceEntity, Named, ObjectEntity};

impl Parser<'_, '_> {
    pub(super) fn structure(&mut self, word: &[u8], span: Span, lexer: &mut Lexer<'_>) -> Done {
        match word {
            b"AttributeBegin" => self.begin(Block::Attribute, "AttributeBegin", span),
            b"AttributeEnd" => self.end(Block::Attribute, "AttributeEnd", span),
            // Deprecated: pbrt-v4 takes them for AttributeBegin and AttributeEnd.
            b"TransformBegin" => self.begin(Block::Attribute, "TransformBegin", span),
            b"TransformEnd" => self.end(Block::Attribute, "TransformEnd", span),
            b"ObjectBegin" => self.object_begin(span, lexer),
            b"ObjectEnd" => {
                self.after_world("ObjectEnd", span)?;
                self.end(Block::Object, "ObjectEnd", span)?;
                self.object = None;
                Ok(())
            }
            b"ObjectInstance" => {
                let object = self.text_argument("ObjectInstance", lexer)?;
                self.after_world("ObjectInstance", span)?;
                if self.object.is_some() {
                    let hint = "pbrt has no instances within objects: repeat the shapes";
                    return self.refuse(span, "ObjectInstance within ObjectBegin", hint);
                }
                let ctm = Arc::clone(&self.state.ctm);
                self.entities.instances.push(InstanceEntity { object, ctm });
                Ok(())
            }
            b"Include" => {
                let Named { name, span } = self.text_argument("Include", lexer)?;
                self.file(&self.base.join(name), span)
            }
            _ => self.import(span, lexer),
        }
    }

    /// Like `Include`, but what it does to the state ends with it.
    pub(super) fn import(&mut self, span: Span, lexer: &mut Lexer<'_>) -> Done {
        let Named { name, span: name_span } = self.text_argument("Import", lexer)?;
        self.after_world("Import", span)?;
        let state = self.state.clone();
        let systems = self.coordinate_systems.clone();
        let depth = self.blocks.len();
        let done = self.file(&self.base.join(name), name_span);
        self.close_blocks(depth);
        self.state = state;
        self.coordinate_systems = systems;
        done
    }

    pub(super) fn begin(&mut self, block: Block, what: &str, span: Span) -> Done {
        self.after_world(what, span)?;
        if self.blocks.len() >= MOST_BLOCKS_DEEP {
            let message = format!("blocks are nested more than {MOST_BLOCKS_DEEP} deep");
            self.blocks.clear();
            return self.refuse(span, message, "is there an AttributeEnd for each AttributeBegin?");
        }
        self.blocks.push((block, span, self.state.clone()));
        Ok(())
    }

    pub(super) fn end(&mut self, block: Block, what: &str, span: Span) -> Done {
        self.after_world(what, span)?;
        match self.blocks.pop() {
            Some((open, _, state)) if open == block => {
                self.state = state;
                Ok(())
            }
            Some((open, begin, state)) => {
                // The other block ends here too, so that one slip is one message.
                self.state = state;
                self.object = None;
                let open = if open == Block::Object { "ObjectBegin" } else { "AttributeBegin" };
                let hint = format!("{open} at {} is still open", self.report.locate(begin));
                self.refuse(span, format!("unmatched {what}"), hint)
            }
            None => self.refuse(span, format!("unmatched {what}"), "no block is open here: remove it"),
        }
    }

    pub(super) fn object_begin(&mut self, span: Span, lexer: &mut Lexer<'_>) -> Done {
        let Named { name, span: name_span } = self.text_argument("ObjectBegin", lexer)?;
        self.begin(Block::Object, "ObjectBegin", span)?;
        if self.object.is_some() {
            return self.refuse(span, "ObjectBegin within ObjectBegin", "objects do not nest: end the first");
        }
        self.object = Some(self.entities.objects.len());
        self.entities.objects.push(ObjectEntity { name: name.clone() });
        self.define("object", &name, name_span)
    }

    /// Reports blocks that are still open beyond a depth.
    pub(super) fn close_blocks(&mut self, depth: usize) {
        while self.blocks.len() > depth {
            if let Some((block, span, state)) = self.blocks.pop() {
                let (begin, end) = match block {
                    Block::Attribute => ("AttributeBegin", "AttributeEnd"),
                    Block::Object => ("ObjectBegin", "ObjectEnd"),
                };
                self.report.error(span, format!("{begin} without {end}")).hint(format!("add {end}"));
                self.state = state;
            }
        }
    }
}
