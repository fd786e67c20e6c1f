//! Textures: images with their samplers and mappings.

use std::path::PathBuf;
use std::sync::Arc;

use math::{Vec2, trig};
use scene_desc::{
    ColorSpaceName, ImageDesc, ImageEncoding, ImageFilter, ImageId, Mapping2d, TextureDesc, TextureId,
    TextureKind, TextureNode, WrapMode,
};

use super::container::{beside, bytes_of};
use super::geometry::uv_name;
use super::json_material::{TextureInfo, TextureTransform};
use super::materials::Materials;
use crate::resources::readable;

/// Where an image is, and its bytes if the file holds them.
type FoundImage = (PathBuf, Option<Arc<[u8]>>);

impl Materials<'_, '_, '_> {
    pub(super) fn texture(&mut self, kind: TextureKind, node: TextureNode) -> TextureId {
        self.scene.textures.push(TextureDesc { name: String::new(), kind, node, span: self.file.span });
        TextureId(self.scene.textures.len() as u32 - 1)
    }

    pub(super) fn image_node(
        &mut self,
        info: &TextureInfo,
        srgb: bool,
        channel: Option<u8>,
        scale: f32,
    ) -> Option<TextureNode> {
        let image = self.image(info, srgb, channel)?;
        let sampler = self.file.root.textures.get(info.index).and_then(|t| t.sampler);
        let sampler = sampler.and_then(|s| self.file.root.samplers.get(s));
        let filter = match sampler.map(|s| (s.mag_filter, s.min_filter)) {
            Some((Some(9728), _)) => ImageFilter::Point,
            Some((_, Some(9728 | 9729))) => ImageFilter::Bilinear,
            _ => ImageFilter::Trilinear,
        };
        let (mapping, wrap) = (self.mapping(info), self.wraps(info));
        Some(TextureNode::ImageMap {
            image,
            tiles: Vec::new(),
            mapping,
            wrap,
            filter,
            max_anisotropy: 8.0,
            scale,
            invert: false,
        })
    }

    /// From the surface's coordinates to the texture's.
    pub(super) fn mapping(&self, info: &TextureInfo) -> Mapping2d {
        let transform = mapping(info.extensions.transform.as_ref());
        let set = set_of(info);
        if set == self.uv_set {
            return transform;
        }
        let name = uv_name(set).to_owned();
        match transform {
            Mapping2d::Affine { u, v, shift } => Mapping2d::Attribute { name, u, v, shift },
            // Without a transform.
            Mapping2d::Uv { .. }
            | Mapping2d::Attribute { .. }
            | Mapping2d::Spherical(_)
            | Mapping2d::Cylindrical(_)
            | Mapping2d::Planar { .. } => {
                Mapping2d::Attribute { name, u: Vec2::X, v: Vec2::Y, shift: Vec2::ZERO }
            }
        }
    }

    pub(super) fn wraps(&self, info: &TextureInfo) -> [WrapMode; 2] {
        let root = &self.file.root;
        let sampler = root.textures.get(info.index).and_then(|t| t.sampler);
        let sampler = sampler.and_then(|s| root.samplers.get(s));
        let wrap = |mode: Option<u32>| match mode {
            Some(33071) => WrapMode::Clamp,
            Some(33648) => WrapMode::Mirror,
            _ => WrapMode::Repeat,
        };
        [wrap(sampler.and_then(|s| s.wrap_s)), wrap(sampler.and_then(|s| s.wrap_t))]
    }

    /// An image where no more than an image can be used.
    pub(super) fn plain_image(&mut self, info: &TextureInfo, what: &str, srgb: bool) -> Option<ImageId> {
        if info.extensions.transform.is_some() || set_of(info) != self.uv_set || info.scale != 1.0 {
            self.warn(format!("its {what} is laid as the surface's coordinates are, at full strength"));
        }
        self.image(info, srgb, None)
    }

    pub(super) fn image(&mut self, info: &TextureInfo, srgb: bool, channel: Option<u8>) -> Option<ImageId> {
        // Alpha is never encoded.
        let srgb = srgb && channel != Some(3);
        let Some(source) = self.file.root.textures.get(info.index).and_then(|t| t.source) else {
            self.warn(format!("texture {} has no image that can be read", info.index));
            return None;
        };
        let key = (source, srgb, channel);
        if let Some(image) = self.images.get(&key) {
            return *image;
        }
        let made = self.new_image(source, srgb, channel);
        self.images.insert(key, made);
        made
    }

    fn new_image(&mut self, source: usize, srgb: bool, channel: Option<u8>) -> Option<ImageId> {
        let found = self.find_image(source);
        let (path, embedded) = match found {
            Ok(found) => found,
            Err(e) => {
                if self.report.first(&format!("image {source}")) {
                    self.report.error(self.file.span, format!("image {source} cannot be read: {e}"));
                }
                return None;
            }
        };
        let encoding = if srgb { ImageEncoding::Srgb } else { ImageEncoding::Linear };
        let (space, span) = (ColorSpaceName::Srgb, self.file.span);
        self.scene.images.push(ImageDesc { path, encoding, space, channel, embedded, span });
        Some(ImageId(self.scene.images.len() as u32 - 1))
    }

    fn find_image(&mut self, source: usize) -> Result<FoundImage, String> {
        let image = self.file.root.images.get(source).ok_or("there is none of this number")?;
        let inside = || PathBuf::from(format!("#image{source}"));
        match (&image.uri, image.buffer_view) {
            (Some(uri), _) if uri.starts_with("data:") => {
                Ok((inside(), Some(bytes_of(&self.file.path, uri, &mut self.hashes)?.into())))
            }
            (Some(uri), _) => {
                let path = beside(&self.file.path, uri);
                readable(&path).map_err(|e| format!("{uri}: {e}"))?;
                Ok((path, None))
            }
            (None, Some(view)) => Ok((inside(), Some(self.file.view(view)?.into()))),
            (None, None) => Err("neither a file nor a buffer view".to_owned()),
        }
    }
}

pub(super) fn set_of(info: &TextureInfo) -> usize {
    info.extensions.transform.as_ref().and_then(|t| t.tex_coord).unwrap_or(info.tex_coord)
}

/// `KHR_texture_transform` for coordinates whose second runs upwards, as ours do and glTF's do not.
fn mapping(transform: Option<&TextureTransform>) -> Mapping2d {
    let Some(t) = transform else { return Mapping2d::default() };
    let (sin, cos) = trig::sin_cos(t.rotation);
    let ([x, y], [sx, sy]) = (t.offset, t.scale);
    Mapping2d::Affine {
        u: Vec2::new(cos * sx, sin * sx),
        v: Vec2::new(-sin * sy, cos * sy),
        shift: Vec2::new(x + sin * sy, 1.0 - y - cos * sy),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_transform_of_textures_is_the_same_upside_down() {
        let t = TextureTransform { offset: [0.25, 0.5], rotation: 0.7, scale: [2.0, 3.0], tex_coord: None };
        let Mapping2d::Affine { u, v, shift } = mapping(Some(&t)) else { panic!("affine") };
        let (sin, cos) = trig::sin_cos(0.7);
        for (x, y) in [(0.0, 0.0), (0.3, 0.9), (1.0, 0.2)] {
            let theirs = [0.25 + cos * 2.0 * x + sin * 3.0 * y, 0.5 - sin * 2.0 * x + cos * 3.0 * y];
            let ours = u * x + v * (1.0 - y) + shift;
            assert!((ours.x - theirs[0]).abs() < 1e-5 && (1.0 - ours.y - theirs[1]).abs() < 1e-5);
        }
    }
}
