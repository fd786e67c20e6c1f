//! Directives that change the current transformation.

use std::sync::Arc;

use math::{DVec3, DVec4, Transform};
use scene_desc::Span;

use super::{Done, Parser, Refused, is_directive};
use crate::pbrt::lexer::{Kind, Lexer};
use crate::pbrt::number;
use crate::pbrt::params::show;
use crate::pbrt::state::Named;
use crate::suggest;

impl Parser<'_, '_> {
    pub(super) fn transform(&mut self, word: &[u8], span: Span, lexer: &mut Lexer<'_>) -> Done {
        match word {
            b"Identity" => self.state.change(|_| Transform::IDENTITY),
            b"Translate" => {
                let d = self.numbers::<3>("Translate", lexer)?;
                let t = Transform::translate(DVec3::from_array(d));
                self.state.change(|ctm| ctm * t);
            }
            b"Scale" => {
                let s = self.numbers::<3>("Scale", lexer)?;
                let t = self.regular(Transform::scale(DVec3::from_array(s)), span, "no factor may be 0")?;
                self.state.change(|ctm| ctm * t);
            }
            b"Rotate" => {
                let [angle, x, y, z] = self.numbers::<4>("Rotate", lexer)?;
                let t = Transform::rotate(DVec3::new(x, y, z), angle.to_radians());
                let t = self.regular(t, span, "the axis must not be zero")?;
                self.state.change(|ctm| ctm * t);
            }
            b"LookAt" => {
                let v = self.numbers::<9>("LookAt", lexer)?;
                let at = |i: usize| DVec3::new(v[i], v[i + 1], v[i + 2]);
                let t = Transform::look_at(at(0), at(3), at(6));
                let hint = "eye and target must differ, and up must not point along the view";
                let t = self.regular(t, span, hint)?;
                self.state.change(|ctm| ctm * t);
            }
            b"Transform" => {
                let t = self.matrix("Transform", span, lexer)?;
                self.state.change(|_| t);
            }
            b"ConcatTransform" => {
                let t = self.matrix("ConcatTransform", span, lexer)?;
                self.state.change(|ctm| ctm * t);
            }
            b"CoordinateSystem" => {
                let name = self.text_argument("CoordinateSystem", lexer)?.name;
                self.coordinate_systems.insert(name, (*self.state.ctm).clone());
            }
            b"CoordSysTransform" => return self.named_transform(lexer),
            b"TransformTimes" => {
                let [start, end] = self.numbers::<2>("TransformTimes", lexer)?;
                self.before_world("TransformTimes", span)?;
                Arc::make_mut(&mut self.state.ctm).times = [start as f32, end as f32];
            }
            _ => return self.active_transform(lexer),
        }
        Ok(())
    }

    pub(super) fn named_transform(&mut self, lexer: &mut Lexer<'_>) -> Done {
        let Named { name, span } = self.text_argument("CoordSysTransform", lexer)?;
        if let Some(set) = self.coordinate_systems.get(&name) {
            Arc::make_mut(&mut self.state.ctm).at = set.at;
        } else {
            let mut known: Vec<_> = self.coordinate_systems.keys().map(String::as_str).collect();
            known.sort_unstable();
            let hint = format!("the directive is ignored, as in pbrt; {}", suggest::hint(&name, &known));
            self.report.warning(span, format!("unknown coordinate system \"{name}\"")).hint(hint);
        }
        Ok(())
    }

    pub(super) fn active_transform(&mut self, lexer: &mut Lexer<'_>) -> Done {
        let here = lexer.here();
        self.state.active = match self.token(lexer)?.kind {
            Kind::Word(b"All") => [true, true],
            Kind::Word(b"StartTime") => [true, false],
            Kind::Word(b"EndTime") => [false, true],
            Kind::Word(_) | Kind::Text(_) | Kind::Open | Kind::Close => {
                return self.refuse(
                    here,
                    "unknown ActiveTransform",
                    "expected StartTime, EndTime or All, without quotes",
                );
            }
        };
        Ok(())
    }

    /// A transform, unless it is singular.
    pub(super) fn regular(
        &mut self,
        t: Option<Transform>,
        span: Span,
        hint: &str,
    ) -> Result<Transform, Refused> {
        t.ok_or_else(|| {
            self.report.error(span, "a singular transform: it has no inverse").hint(hint);
            Refused
        })
    }

    pub(super) fn numbers<const N: usize>(
        &mut self,
        what: &str,
        lexer: &mut Lexer<'_>,
    ) -> Result<[f64; N], Refused> {
        let mut out = [0.0; N];
        for (i, x) in out.iter_mut().enumerate() {
            *x = self.number(&format!("{what}: number {} of {N}", i + 1), lexer)?;
        }
        Ok(out)
    }

    pub(super) fn number(&mut self, what: &str, lexer: &mut Lexer<'_>) -> Result<f64, Refused> {
        let token = self.token(lexer)?;
        let Kind::Word(word) = token.kind else {
            self.report.error(token.span, format!("{what} is missing")).hint("expected a number");
            return Err(Refused);
        };
        match number::f64_at(word) {
            Some((x, _)) if x.abs() <= f64::from(f32::MAX) => Ok(x),
            Some(_) => {
                let message = format!("{what}: {} does not fit a 32-bit float", show(word));
                self.report.error(token.span, message).hint("floats go up to 3.4e38");
                Err(Refused)
            }
            None => {
                let message = format!("{what}: {} is no number", show(word));
                self.report.error(token.span, message).hint("expected a number");
                if is_directive(word) {
                    lexer.put_back(token);
                }
                Err(Refused)
            }
        }
    }

    /// Sixteen numbers in brackets, column by column.
    pub(super) fn matrix(
        &mut self,
        what: &str,
        span: Span,
        lexer: &mut Lexer<'_>,
    ) -> Result<Transform, Refused> {
        self.bracket(Kind::Open, what, lexer)?;
        let v = self.numbers::<16>(what, lexer)?;
        self.bracket(Kind::Close, what, lexer)?;
        let column = |i: usize| DVec4::new(v[i], v[i + 1], v[i + 2], v[i + 3]);
        let m = math::DMat4::from_cols(column(0), column(4), column(8), column(12));
        self.regular(Transform::from_matrix(m), span, "no two axes may coincide and none may be zero")
    }

    pub(super) fn bracket(&mut self, kind: Kind<'static>, what: &str, lexer: &mut Lexer<'_>) -> Done {
        let token = self.token(lexer)?;
        if token.kind == kind {
            return Ok(());
        }
        let bracket = if kind == Kind::Open { "[" } else { "]" };
        self.refuse(token.span, format!("{what}: expected {bracket}"), "it takes 16 numbers in brackets")
    }
}
