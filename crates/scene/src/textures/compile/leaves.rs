//! Textures that are made of no others: images and noise.

use scene_desc::{ImageFilter, TextureDesc, TextureNode};

use super::super::images::ImageUse;
use super::super::mapping::Mapping3;
use super::super::node::{ImageLookup, Noise, NoiseKind};
use super::{MAX_ANISOTROPY, TextureCompiler};

impl TextureCompiler<'_> {
    /// How an image map is looked up; `None` (and an error) if its image is not in the description.
    pub(super) fn image_lookup(&mut self, desc: &TextureDesc) -> Option<ImageLookup> {
        let TextureNode::ImageMap { image, mapping, wrap, filter, max_anisotropy, scale, invert } =
            &desc.node
        else {
            return None;
        };
        if image.index() >= self.scene.images.len() {
            self.sink.error(desc.span, format!("there is no image {}", image.0));
            return None;
        }
        self.need(
            *image,
            match filter {
                ImageFilter::Point | ImageFilter::Bilinear => ImageUse::Base,
                ImageFilter::Trilinear | ImageFilter::Ewa => ImageUse::Pyramid,
            },
        );
        Some(ImageLookup {
            image: *image,
            mapping: self.mapping(mapping),
            wrap: *wrap,
            filter: *filter,
            max_anisotropy: max_anisotropy.clamp(1.0, MAX_ANISOTROPY),
            scale: *scale,
            invert: *invert,
        })
    }
}

pub(super) fn noise_of(node: &TextureNode) -> Option<Noise> {
    let (kind, octaves, omega, texture_from_world) = match node {
        TextureNode::Fbm { octaves, roughness, texture_from_world } => {
            (NoiseKind::Fbm, *octaves, *roughness, texture_from_world)
        }
        TextureNode::Wrinkled { octaves, roughness, texture_from_world } => {
            (NoiseKind::Wrinkled, *octaves, *roughness, texture_from_world)
        }
        TextureNode::Windy { texture_from_world } => (NoiseKind::Windy, 0, 0.0, texture_from_world),
        TextureNode::Constant(_)
        | TextureNode::Scale { .. }
        | TextureNode::Product { .. }
        | TextureNode::Step { .. }
        | TextureNode::Attribute { .. }
        | TextureNode::Mix { .. }
        | TextureNode::DirectionMix { .. }
        | TextureNode::Checkerboard { .. }
        | TextureNode::Bilerp { .. }
        | TextureNode::Dots { .. }
        | TextureNode::Marble { .. }
        | TextureNode::ImageMap { .. } => return None,
    };
    Some(Noise { kind, octaves, omega, mapping: Mapping3::compile(texture_from_world) })
}
