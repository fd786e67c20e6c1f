//! Directives that stand before `WorldBegin`.

use math::Transform;
use scene_desc::{ColorSpaceName, Span};

use super::{Done, Parser};
use crate::pbrt::lexer::{Kind, Lexer};
use crate::pbrt::params::show;
use crate::pbrt::state::{Named, PlacedEntity};
use crate::suggest;

impl Parser<'_, '_> {
    pub(super) fn option(&mut self, word: &[u8], span: Span, lexer: &mut Lexer<'_>) -> Done {
        match word {
            b"Option" => return self.set_option(lexer),
            b"ColorSpace" => return self.color_space(lexer),
            b"WorldBegin" => {
                self.before_world("WorldBegin", span)?;
                self.in_world = true;
                self.state.active = [true; 2];
                self.state.change(|_| Transform::IDENTITY);
                self.coordinate_systems.insert("world".into(), (*self.state.ctm).clone());
                return Ok(());
            }
            _ => {}
        }
        let entity = self.entity(&show(word), span, None, lexer)?;
        self.before_world(&show(word), span)?;
        match word {
            b"Camera" => {
                let world_from_camera = self.state.ctm.inverse();
                self.coordinate_systems.insert("camera".into(), world_from_camera);
                let medium = self.state.outside.clone();
                self.entities.camera = Some(PlacedEntity { entity, medium });
            }
            b"Film" => self.entities.film = Some(entity),
            b"Sampler" => self.entities.sampler = Some(entity),
            b"Integrator" => self.entities.integrator = Some(entity),
            b"PixelFilter" => self.entities.filter = Some(entity),
            // Our ray kernel builds its own tree: pbrt's choice changes no picture.
            _ => {}
        }
        Ok(())
    }

    pub(super) fn color_space(&mut self, lexer: &mut Lexer<'_>) -> Done {
        const NAMES: [&str; 4] = ["srgb", "dci-p3", "rec2020", "aces2065-1"];
        let Named { name, span } = self.text_argument("ColorSpace", lexer)?;
        self.state.space = match name.to_lowercase().as_str() {
            "srgb" => ColorSpaceName::Srgb,
            "dci-p3" => ColorSpaceName::DciP3,
            "rec2020" => ColorSpaceName::Rec2020,
            "aces2065-1" => ColorSpaceName::Aces2065_1,
            _ => {
                let hint = suggest::hint(&name, &NAMES);
                return self.refuse(span, format!("unknown colour space \"{name}\""), hint);
            }
        };
        Ok(())
    }

    /// `Option "seed" 3`: the value is a bare or quoted word.
    pub(super) fn set_option(&mut self, lexer: &mut Lexer<'_>) -> Done {
        const NAMES: [&str; 11] = [
            "disablepixeljitter",
            "disabletexturefiltering",
            "disablewavelengthjitter",
            "displacementedgescale",
            "forcediffuse",
            "msereferenceimage",
            "msereferenceout",
            "pixelstats",
            "rendercoordsys",
            "seed",
            "wavefront",
        ];
        let Named { name, span } = self.text_argument("Option", lexer)?;
        let token = self.token(lexer)?;
        let value = match &token.kind {
            Kind::Word(word) => String::from_utf8_lossy(word).into_owned(),
            Kind::Text(text) => text.clone().into_owned(),
            Kind::Open | Kind::Close => {
                return self.refuse(token.span, format!("option \"{name}\" has no value"), "add it");
            }
        };
        // pbrt reads names without regard to case, - and _.
        let plain: String = name.to_lowercase().chars().filter(|c| !matches!(c, '-' | '_')).collect();
        match (plain.as_str(), value.as_str()) {
            ("seed", _) => match value.parse() {
                Ok(seed) => self.entities.seed = Some(seed),
                Err(_) => {
                    let message = format!("option \"seed\": {} is no number", show(value.as_bytes()));
                    return self.refuse(token.span, message, "expected a whole number");
                }
            },
            // These change only how pbrt runs, or say what we do anyway.
            ("msereferenceimage" | "msereferenceout" | "pixelstats" | "rendercoordsys" | "wavefront", _)
            | ("displacementedgescale", _)
            | (_, "false")
                if NAMES.contains(&plain.as_str()) => {}
            (known, _) if NAMES.contains(&known) => {
                self.report
                    .warning(span, format!("option \"{name}\" is not supported"))
                    .hint("it is ignored");
            }
            (_, _) => {
                let hint = suggest::hint(&name, &NAMES);
                return self.refuse(span, format!("unknown option \"{name}\""), hint);
            }
        }
        Ok(())
    }

    pub(super) fn before_world(&mut self, what: &str, span: Span) -> Done {
        if self.in_world {
            let hint = "options, such as camera and film, stand before WorldBegin";
            return self.refuse(span, format!("{what} after WorldBegin"), hint);
        }
        Ok(())
    }

    pub(super) fn after_world(&mut self, what: &str, span: Span) -> Done {
        if !self.in_world {
            let hint = "shapes, lights and materials stand after WorldBegin";
            return self.refuse(span, format!("{what} before WorldBegin"), hint);
        }
        Ok(())
    }
}
