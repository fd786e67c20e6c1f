//! What follows a directive: names, types, parameters.

use std::sync::Arc;

use scene_desc::Span;

use super::{Done, Parser, Refused, is_directive, lex_error};
use crate::pbrt::lexer::{Kind, Lexer, Token};
use crate::pbrt::params::{self, Params, show};
use crate::pbrt::state::{Entity, Named, NamedEntity, Target};

impl Parser<'_, '_> {
    /// A type in quotes and parameters.
    pub(super) fn entity(
        &mut self,
        what: &str,
        span: Span,
        target: Option<Target>,
        lexer: &mut Lexer<'_>,
    ) -> Result<Entity, Refused> {
        let kind = self.text_argument(what, lexer)?.name;
        let list = params::parse_list(lexer, self.report)?;
        let defaults = target.map(|t| self.state.defaults(t)).unwrap_or_default();
        let params = Params::new(list, defaults, self.state.space);
        Ok(Entity { kind, params, ctm: Arc::clone(&self.state.ctm), span })
    }

    /// A name in quotes and parameters, one of which is the type.
    pub(super) fn named_entity(
        &mut self,
        what: &'static str,
        span: Span,
        lexer: &mut Lexer<'_>,
    ) -> Result<NamedEntity, Refused> {
        let target = if what == "MakeNamedMedium" { Target::Medium } else { Target::Material };
        let mut entity = self.entity(what, span, Some(target), lexer)?;
        let Some((kind, _)) = entity.params.string_opt("type", self.report) else {
            let message = format!("{what} \"{}\" has no type", entity.kind);
            self.report.error(span, message).hint("add one, as in \"string type\" \"diffuse\"");
            return Err(Refused);
        };
        let name = std::mem::replace(&mut entity.kind, kind);
        Ok(NamedEntity { name, entity })
    }

    /// Remembers where a name was defined; twice is an error.
    pub(super) fn define(&mut self, what: &'static str, name: &str, span: Span) -> Done {
        let before = self.defined.insert((what, name.to_owned()), span);
        // In pbrt-v3 the last one counts.
        if let Some(first) = before.filter(|_| !self.entities.is_old) {
            let hint = format!("the first is at {}", self.report.locate(first));
            return self.refuse(span, format!("{what} \"{name}\" is defined twice"), hint);
        }
        Ok(())
    }

    pub(super) fn text_argument(&mut self, what: &str, lexer: &mut Lexer<'_>) -> Result<Named, Refused> {
        let token = self.token(lexer)?;
        match token.kind {
            Kind::Text(text) => Ok(Named { name: text.into_owned(), span: token.span }),
            Kind::Word(word) => {
                let message = format!("{what}: expected a name in quotes, found {}", show(word));
                self.report.error(token.span, message).hint("write it as \"name\"");
                if is_directive(word) {
                    lexer.put_back(token);
                }
                Err(Refused)
            }
            Kind::Open | Kind::Close => {
                self.report
                    .error(token.span, format!("{what}: expected a name in quotes, found a bracket"))
                    .hint("write it as \"name\"");
                Err(Refused)
            }
        }
    }

    /// The next token, which must be there.
    pub(super) fn token<'a>(&mut self, lexer: &mut Lexer<'a>) -> Result<Token<'a>, Refused> {
        match lexer.next() {
            Some(Ok(token)) => Ok(token),
            Some(Err(e)) => Err(lex_error(e, self.report)),
            None => {
                let here = lexer.here();
                self.report.error(here, "the file ends within a directive").hint("is it complete?");
                Err(Refused)
            }
        }
    }
}
