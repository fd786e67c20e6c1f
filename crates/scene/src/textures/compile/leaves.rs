//! Textures that are made of no others: images and noise.

use scene_desc::{ImageFilter, ImageTile, LightKind, ShapeDesc, TextureDesc, TextureNode, WrapMode};

use super::super::images::ImageUse;
use super::super::mapping::Mapping3;
use super::super::node::{FloatNode, ImageLookup, Noise, NoiseKind};
use super::super::space::Volume;
use super::{MAX_ANISOTROPY, TextureCompiler};

impl TextureCompiler<'_> {
    /// Images that lights take.
    pub(super) fn use_light_images(&mut self) {
        let scene = self.scene;
        for light in &scene.lights {
            match light.kind {
                LightKind::InfiniteImage { image, .. } | LightKind::Projection { image, .. } => {
                    self.use_image(image);
                }
                LightKind::Goniometric { image, .. } => image.into_iter().for_each(|i| self.use_image(i)),
                LightKind::Point { .. }
                | LightKind::Spot { .. }
                | LightKind::Distant { .. }
                | LightKind::Ies { .. }
                | LightKind::InfiniteConstant { .. } => {}
            }
        }
        let in_objects = scene.objects.iter().flat_map(|o| &o.shapes);
        let image_of = |s: &ShapeDesc| s.area_light.as_ref().and_then(|l| l.image);
        for image in scene.shapes.iter().chain(in_objects).filter_map(image_of) {
            self.use_image(image);
        }
    }

    /// A grid; `None` (and an error) if it does not have as many values as points.
    pub(super) fn volume(&mut self, desc: &TextureDesc) -> Option<Volume> {
        let TextureNode::Volume { resolution, values, wrap, texture_from_world } = &desc.node else {
            return None;
        };
        let volume = Volume::new(*resolution, values, *wrap, texture_from_world);
        if volume.is_none() {
            let [x, y, z] = resolution;
            let message = format!("a volume of {x} x {y} x {z} points has {} values", values.len());
            self.sink.error(desc.span, message).hint("there must be one for each, and at least one");
        }
        volume
    }

    /// A texture of numbers that is made of no others.
    pub(super) fn float_leaf(&mut self, desc: &TextureDesc) -> Option<FloatNode> {
        let noise = noise_of(&desc.node).map(FloatNode::Noise);
        let noise_or_grid = noise.or_else(|| self.volume(desc).map(FloatNode::Volume));
        noise_or_grid.or_else(|| self.image_lookup(desc).map(FloatNode::Image))
    }

    /// How an image map is looked up; `None` (and an error) if its image is not in the description.
    pub(super) fn image_lookup(&mut self, desc: &TextureDesc) -> Option<ImageLookup> {
        let TextureNode::ImageMap { image, tiles, mapping, wrap, filter, max_anisotropy, scale, invert } =
            &desc.node
        else {
            return None;
        };
        let usage = match filter {
            ImageFilter::Point | ImageFilter::Bilinear => ImageUse::Base,
            ImageFilter::Trilinear | ImageFilter::Ewa => ImageUse::Pyramid,
        };
        let single = [ImageTile { at: [0; 2], image: *image }];
        let used = if tiles.is_empty() { &single[..] } else { tiles };
        for image in used.iter().map(|t| t.image) {
            if image.index() >= self.scene.images.len() {
                self.sink.error(desc.span, format!("there is no image {}", image.0));
                return None;
            }
            self.need(image, usage);
        }
        Some(ImageLookup {
            image: *image,
            tiles: tiles.clone(),
            mapping: self.mapping(mapping),
            // What is beyond a tile's border is another tile.
            wrap: if tiles.is_empty() { *wrap } else { [WrapMode::Clamp; 2] },
            filter: *filter,
            max_anisotropy: max_anisotropy.clamp(1.0, MAX_ANISOTROPY),
            scale: *scale,
            invert: *invert,
        })
    }
}

fn noise_of(node: &TextureNode) -> Option<Noise> {
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
        | TextureNode::Triplanar { .. }
        | TextureNode::Volume { .. }
        | TextureNode::ImageMap { .. } => return None,
    };
    Some(Noise { kind, octaves, omega, mapping: Mapping3::compile(texture_from_world) })
}
