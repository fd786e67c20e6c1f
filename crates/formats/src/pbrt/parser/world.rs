//! Shapes, materials, textures, lights and media.

use std::rc::Rc;
use std::sync::Arc;

use scene_desc::{Span, TextureKind};

use super::{Done, Parser, Refused, old_syntax};
use crate::pbrt::lexer::{Kind, Lexer, Token};
use crate::pbrt::params;
use crate::pbrt::state::{
    MaterialRef, Name, Named, NamedEntity, PlacedEntity, ShapeEntity, Target, TextureEntity,
};
use crate::suggest;

impl Parser<'_, '_> {
    pub(super) fn world(&mut self, word: &[u8], span: Span, lexer: &mut Lexer<'_>) -> Done {
        match word {
            b"Shape" => self.shape(span, lexer),
            b"Material" => {
                let entity = self.entity("Material", span, Some(Target::Material), lexer)?;
                self.after_world("Material", span)?;
                self.state.material = MaterialRef::Unnamed(self.entities.materials.len());
                self.entities.materials.push(entity);
                Ok(())
            }
            b"NamedMaterial" => {
                let name = self.text_argument("NamedMaterial", lexer)?;
                self.after_world("NamedMaterial", span)?;
                self.state.material = MaterialRef::Named(Arc::new(name));
                Ok(())
            }
            b"MakeNamedMaterial" => {
                let NamedEntity { name, entity } = self.named_entity("MakeNamedMaterial", span, lexer)?;
                self.after_world("MakeNamedMaterial", span)?;
                self.define("material", &name, span)?;
                self.entities.named_materials.push(NamedEntity { name, entity });
                Ok(())
            }
            b"MakeNamedMedium" => {
                let NamedEntity { name, entity } = self.named_entity("MakeNamedMedium", span, lexer)?;
                self.define("medium", &name, span)?;
                self.entities.media.push(NamedEntity { name, entity });
                Ok(())
            }
            b"MediumInterface" => self.medium_interface(lexer),
            b"Texture" => self.texture(span, lexer),
            b"LightSource" => {
                let entity = self.entity("LightSource", span, Some(Target::Light), lexer)?;
                self.after_world("LightSource", span)?;
                let medium = self.state.outside.clone();
                self.entities.lights.push(PlacedEntity { entity, medium });
                Ok(())
            }
            b"AreaLightSource" => {
                let entity = self.entity("AreaLightSource", span, Some(Target::Light), lexer)?;
                self.after_world("AreaLightSource", span)?;
                self.state.area_light = (!entity.kind.is_empty()).then_some(self.entities.area_lights.len());
                self.entities.area_lights.push(entity);
                Ok(())
            }
            b"ReverseOrientation" => {
                self.after_world("ReverseOrientation", span)?;
                self.state.reverse_orientation = !self.state.reverse_orientation;
                Ok(())
            }
            _ => self.attribute(lexer),
        }
    }

    pub(super) fn shape(&mut self, span: Span, lexer: &mut Lexer<'_>) -> Done {
        let entity = self.entity("Shape", span, Some(Target::Shape), lexer)?;
        self.after_world("Shape", span)?;
        self.entities.shapes.push(ShapeEntity {
            entity,
            reverse_orientation: self.state.reverse_orientation,
            material: self.state.material.clone(),
            area_light: self.state.area_light,
            inside: self.state.inside.clone(),
            outside: self.state.outside.clone(),
            object: self.object,
        });
        Ok(())
    }

    pub(super) fn texture(&mut self, span: Span, lexer: &mut Lexer<'_>) -> Done {
        let Named { name, span: name_span } = self.text_argument("Texture", lexer)?;
        let Named { name: kind, span: kind_span } = self.text_argument("Texture: the kind", lexer)?;
        let entity = self.entity("Texture", span, Some(Target::Texture), lexer)?;
        self.after_world("Texture", span)?;
        let (kind, word) = match kind.as_str() {
            "float" => (TextureKind::Float, "float texture"),
            "spectrum" => (TextureKind::Spectrum, "spectrum texture"),
            "color" if self.entities.is_old => (TextureKind::Spectrum, "spectrum texture"),
            "color" => {
                old_syntax(self.report, kind_span, "texture kind \"color\"", "\"spectrum\"");
                return Err(Refused);
            }
            _ => {
                let message = format!("unknown texture kind \"{kind}\"");
                return self.refuse(kind_span, message, "possible are \"float\" and \"spectrum\"");
            }
        };
        self.define(word, &name, name_span)?;
        self.entities.textures.push(TextureEntity { name, kind, entity });
        Ok(())
    }

    pub(super) fn medium_interface(&mut self, lexer: &mut Lexer<'_>) -> Done {
        let inside = self.text_argument("MediumInterface", lexer)?;
        let outside = match lexer.peek() {
            Some(Ok(Token { kind: Kind::Text(_), .. })) => self.text_argument("MediumInterface", lexer)?,
            Some(_) | None => Named { name: inside.name.clone(), span: inside.span },
        };
        let name = |n: Named| -> Name { (!n.name.is_empty()).then(|| Arc::new(n)) };
        self.state.inside = name(inside);
        self.state.outside = name(outside);
        Ok(())
    }

    /// Default parameters for what follows.
    pub(super) fn attribute(&mut self, lexer: &mut Lexer<'_>) -> Done {
        let Named { name, span } = self.text_argument("Attribute", lexer)?;
        let mut list = params::parse_list(lexer, self.report)?.list;
        let target = match name.as_str() {
            "shape" => Target::Shape,
            "light" => Target::Light,
            "material" => Target::Material,
            "medium" => Target::Medium,
            "texture" => Target::Texture,
            _ => {
                let names = ["shape", "light", "material", "medium", "texture"];
                let hint = suggest::hint(&name, &names);
                return self.refuse(span, format!("unknown Attribute target \"{name}\""), hint);
            }
        };
        for p in &mut list {
            p.space = Some(self.state.space);
        }
        Rc::make_mut(&mut self.state.defaults[target as usize]).extend(list);
        Ok(())
    }
}
