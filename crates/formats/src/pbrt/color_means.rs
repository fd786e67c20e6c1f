//! Numbers where a file names a texture of colours: their means.

use scene_desc::{FloatInput, Span, SpectrumDesc, TextureId, TextureInput, TextureKind, TextureNode};

use super::build::Build;

impl Build<'_, '_> {
    /// The numbers of a texture, or the means of its colours.
    pub(super) fn numbers_of(&mut self, name: &str, at: Span) -> Option<FloatInput> {
        if let Some(id) = self.float_textures.get(name) {
            return Some(FloatInput::Texture(*id));
        }
        let found = self.spectrum_textures.get(name).copied();
        let numbers = found.and_then(|id| self.means(&TextureInput::Texture(id)));
        match numbers {
            Some(TextureInput::Float(x)) => Some(x.into()),
            Some(TextureInput::Texture(id)) => Some(FloatInput::Texture(id)),
            Some(TextureInput::Spectrum(_)) | None => {
                self.report
                    .warning(at, format!("texture \"{name}\" cannot be read as numbers"))
                    .hint("a constant stands in for it: 1 for an opacity, 0.5 for an amount");
                None
            }
        }
    }

    /// A texture of colours made anew as one of numbers, with all that it is made of.
    fn means(&mut self, input: &TextureInput) -> Option<TextureInput> {
        let id = match input {
            TextureInput::Float(_) => return Some(input.clone()),
            TextureInput::Spectrum(SpectrumDesc::Constant(c)) => return Some(TextureInput::Float(*c)),
            TextureInput::Spectrum(SpectrumDesc::Rgb { rgb, .. }) => {
                return Some(TextureInput::Float(rgb.iter().sum::<f32>() / 3.0));
            }
            TextureInput::Spectrum(_) => return None,
            TextureInput::Texture(id) => *id,
        };
        let mut desc = self.scene.textures.get(id.index())?.clone();
        let parts: Vec<&mut TextureInput> = match &mut desc.node {
            _ if desc.kind == TextureKind::Float => return Some(TextureInput::Texture(id)),
            TextureNode::Constant(a) | TextureNode::Scale { tex: a, .. } => vec![a],
            TextureNode::Product { a, b }
            | TextureNode::Mix { a, b, .. }
            | TextureNode::Checkerboard { a, b, .. }
            | TextureNode::Dots { inside: a, outside: b, .. } => vec![a, b],
            TextureNode::Bilerp { corners, .. } => corners.iter_mut().collect(),
            TextureNode::ImageMap { .. }
            | TextureNode::Fbm { .. }
            | TextureNode::Wrinkled { .. }
            | TextureNode::Windy { .. } => vec![],
            TextureNode::Step { .. }
            | TextureNode::Attribute { .. }
            | TextureNode::DirectionMix { .. }
            | TextureNode::Marble { .. }
            | TextureNode::Triplanar { .. }
            | TextureNode::Volume { .. } => return None,
        };
        for part in parts {
            *part = self.means(part)?;
        }
        desc.kind = TextureKind::Float;
        self.scene.textures.push(desc);
        Some(TextureInput::Texture(TextureId(self.scene.textures.len() as u32 - 1)))
    }
}
