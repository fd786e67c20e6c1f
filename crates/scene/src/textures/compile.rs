//! From the textures of a description to flat arrays: only what is used, each spectrum texture once for each role,
//! and what does not vary as the constant that it is.

mod leaves;

use math::Vec3;
use scene_desc::{
    FloatInput, ImageId, Mapping2d, MeshDesc, SceneDesc, Sink, Span, SpectrumDesc, SpectrumInput,
    TextureDesc, TextureInput, TextureKind, TextureNode,
};
use spectrum::{ColorPipeline, SpectrumValue};

use super::attributes::Attributes;
use super::images::{ImageUse, Images, KeptImages};
use super::mapping::{Mapping, Mapping3};
use super::node::{Combine, FloatHandle, FloatNode, SpectrumHandle, SpectrumNode, Textures};
use super::pattern::Marble;
use super::space::Triplanar;
use super::spectra::{SpectrumRole, spectrum_value};
use crate::TextureId;

/// More texels than this along an ellipse's long axis help nobody.
const MAX_ANISOTROPY: f32 = 64.0;

/// Compiles textures as materials and shapes ask for them.
#[derive(Debug)]
pub struct TextureCompiler<'a> {
    scene: &'a SceneDesc,
    colors: ColorPipeline,
    sink: &'a mut Sink,
    floats: Vec<FloatNode>,
    spectra: Vec<SpectrumNode>,
    images: Vec<ImageUse>,
    attributes: Attributes,
    /// What each texture has become already: as numbers, and in each role.
    float_of: Vec<Option<FloatHandle>>,
    spectrum_of: Vec<[Option<SpectrumHandle>; 3]>,
}

impl<'a> TextureCompiler<'a> {
    /// Of a scene, for a render's colours. The images of lights are loaded as well.
    #[must_use]
    pub fn new(scene: &'a SceneDesc, colors: ColorPipeline, sink: &'a mut Sink) -> Self {
        let mut compiler = Self::of_surfaces(scene, colors, sink);
        compiler.use_light_images();
        compiler
    }

    /// The same without the images of lights.
    pub(crate) fn of_surfaces(scene: &'a SceneDesc, colors: ColorPipeline, sink: &'a mut Sink) -> Self {
        let n = scene.textures.len();
        Self {
            scene,
            colors,
            sink,
            floats: Vec::new(),
            spectra: Vec::new(),
            images: vec![ImageUse::None; scene.images.len()],
            attributes: Attributes::default(),
            float_of: vec![None; n],
            spectrum_of: vec![[const { None }; 3]; n],
        }
    }

    /// Where to report.
    pub fn sink(&mut self) -> &mut Sink {
        self.sink
    }

    /// How colours become lanes.
    #[must_use]
    pub fn colors(&self) -> ColorPipeline {
        self.colors
    }

    /// Compiles a number.
    pub fn float(&mut self, input: &FloatInput, span: Span) -> FloatHandle {
        match input {
            FloatInput::Constant(c) => FloatHandle::Constant(*c),
            FloatInput::Texture(id) => self.float_texture(*id, span),
        }
    }

    /// The product of two numbers.
    pub fn product(&mut self, a: FloatHandle, b: FloatHandle) -> FloatHandle {
        let node = Combine::Scale { tex: a, scale: b };
        if let Some(constant) = node.constant() {
            return FloatHandle::Constant(constant);
        }
        self.floats.push(FloatNode::Combine(node));
        FloatHandle::Texture(next_id(self.floats.len()))
    }

    /// Compiles a spectrum in a role.
    pub fn spectrum(&mut self, input: &SpectrumInput, role: SpectrumRole, span: Span) -> SpectrumHandle {
        match input {
            SpectrumInput::Constant(desc) => SpectrumHandle::Constant(self.value(desc, role, span)),
            SpectrumInput::Texture(id) => self.spectrum_texture(*id, role, span),
        }
    }

    /// Compiles a spectrum without textures.
    pub fn value(&mut self, desc: &SpectrumDesc, role: SpectrumRole, span: Span) -> SpectrumValue {
        spectrum_value(desc, role, self.colors, span, self.sink)
    }

    /// Says that an image will be looked up.
    pub fn use_image(&mut self, image: ImageId) {
        self.need(image, ImageUse::Base);
    }

    /// Reads the images (in parallel) and gives everything that was asked for.
    #[must_use]
    pub fn finish(self) -> Textures {
        self.finish_with(None)
    }

    /// The same; images of an earlier compile are not read again.
    pub(crate) fn finish_with(self, kept: Option<&KeptImages>) -> Textures {
        let images = Images::load(&self.scene.images, &self.images, kept, self.sink);
        Textures {
            floats: self.floats,
            spectra: self.spectra,
            images,
            attributes: self.attributes,
            colors: self.colors,
        }
    }

    /// Keeps what textures ask for of the values that a mesh carries, which is shape `shape`.
    pub(crate) fn attach(&mut self, shape: u32, mesh: &MeshDesc) {
        self.attributes.attach(shape, mesh);
    }

    /// Compiles a mapping.
    pub(crate) fn mapping(&mut self, mapping: &Mapping2d) -> Mapping {
        Mapping::compile(mapping, &mut self.attributes)
    }

    fn need(&mut self, image: ImageId, what: ImageUse) {
        if let Some(current) = self.images.get_mut(image.index()) {
            *current = (*current).max(what);
        }
    }

    /// A texture, if it is there and earlier than `before`.
    fn texture(&mut self, id: scene_desc::TextureId, before: usize, span: Span) -> Option<&'a TextureDesc> {
        let scene = self.scene;
        let found = scene.textures.get(id.index()).filter(|_| id.index() < before);
        if found.is_none() {
            self.sink
                .error(span, format!("texture {} is not among the {before} made before it", id.0))
                .hint("a texture can only use textures that come earlier in the file");
        }
        found
    }

    fn float_texture(&mut self, id: scene_desc::TextureId, span: Span) -> FloatHandle {
        let Some(desc) = self.texture(id, self.scene.textures.len(), span) else {
            return FloatHandle::Constant(0.0);
        };
        if let Some(handle) = self.float_of[id.index()] {
            return handle;
        }
        let handle = if desc.kind == TextureKind::Float {
            self.float_node(desc, id.index())
        } else {
            self.sink
                .error(span, format!("texture \"{}\" gives spectra where numbers are needed", desc.name))
                .hint("declare it as a float texture");
            FloatHandle::Constant(0.0)
        };
        self.float_of[id.index()] = Some(handle);
        handle
    }

    fn float_node(&mut self, desc: &TextureDesc, index: usize) -> FloatHandle {
        let span = desc.span;
        let mut operand = |this: &mut Self, input: &TextureInput| match input {
            TextureInput::Float(x) => FloatHandle::Constant(*x),
            TextureInput::Spectrum(_) => {
                this.sink.error(span, "a spectrum where a number is needed");
                FloatHandle::Constant(0.0)
            }
            TextureInput::Texture(id) => match this.texture(*id, index, span) {
                Some(_) => this.float_texture(*id, span),
                None => FloatHandle::Constant(0.0),
            },
        };
        let node = match &desc.node {
            TextureNode::Constant(value) => return operand(self, value),
            TextureNode::ImageMap { .. }
            | TextureNode::Volume { .. }
            | TextureNode::Fbm { .. }
            | TextureNode::Wrinkled { .. }
            | TextureNode::Windy { .. } => match self.float_leaf(desc) {
                Some(leaf) => leaf,
                None => return FloatHandle::Constant(0.0),
            },
            TextureNode::Step { tex, edge } => match operand(self, tex) {
                FloatHandle::Constant(c) => {
                    return FloatHandle::Constant(if c >= *edge { 1.0 } else { 0.0 });
                }
                tex @ FloatHandle::Texture(_) => FloatNode::Step { tex, edge: *edge },
            },
            TextureNode::Attribute { name, scale } => {
                FloatNode::Attribute { id: self.attributes.id(name), scale: *scale }
            }
            TextureNode::Triplanar { planes, sharpness, texture_from_world } => {
                let planes = planes.each_ref().map(|p| operand(self, p));
                FloatNode::Triplanar(Triplanar::new(planes, *sharpness, texture_from_world))
            }
            TextureNode::Marble { .. } => {
                self.sink.error(span, "marble gives spectra, not numbers");
                return FloatHandle::Constant(0.0);
            }
            TextureNode::Scale { .. }
            | TextureNode::Product { .. }
            | TextureNode::Mix { .. }
            | TextureNode::DirectionMix { .. }
            | TextureNode::Checkerboard { .. }
            | TextureNode::Bilerp { .. }
            | TextureNode::Dots { .. } => match self.combine(desc, index, &mut operand) {
                Some(node) => match node.constant() {
                    Some(constant) => return FloatHandle::Constant(constant),
                    None => FloatNode::Combine(node),
                },
                None => return FloatHandle::Constant(0.0),
            },
        };
        self.floats.push(node);
        FloatHandle::Texture(next_id(self.floats.len()))
    }

    fn spectrum_texture(
        &mut self,
        id: scene_desc::TextureId,
        role: SpectrumRole,
        span: Span,
    ) -> SpectrumHandle {
        let black = SpectrumHandle::Constant(SpectrumValue::ZERO);
        let Some(desc) = self.texture(id, self.scene.textures.len(), span) else { return black };
        if let Some(handle) = &self.spectrum_of[id.index()][role as usize] {
            return handle.clone();
        }
        let handle = match desc.kind {
            TextureKind::Spectrum => self.spectrum_node(desc, id.index(), role),
            TextureKind::Float => {
                let number = self.float_texture(id, span);
                self.grey(number)
            }
        };
        self.spectrum_of[id.index()][role as usize] = Some(handle.clone());
        handle
    }

    fn spectrum_node(&mut self, desc: &TextureDesc, index: usize, role: SpectrumRole) -> SpectrumHandle {
        let black = || SpectrumHandle::Constant(SpectrumValue::ZERO);
        let span = desc.span;
        let mut operand = |this: &mut Self, input: &TextureInput| match input {
            TextureInput::Float(x) => {
                SpectrumHandle::Constant(this.value(&SpectrumDesc::Constant(*x), role, span))
            }
            TextureInput::Spectrum(value) => SpectrumHandle::Constant(this.value(value, role, span)),
            TextureInput::Texture(id) => match this.texture(*id, index, span) {
                Some(_) => this.spectrum_texture(*id, role, span),
                None => SpectrumHandle::Constant(SpectrumValue::ZERO),
            },
        };
        let node = match &desc.node {
            TextureNode::Constant(value) => return operand(self, value),
            TextureNode::ImageMap { .. } => match self.image_lookup(desc) {
                Some(lookup) => SpectrumNode::Image(lookup, role),
                None => return black(),
            },
            TextureNode::Attribute { name, scale } => {
                SpectrumNode::Attribute { id: self.attributes.id(name), scale: *scale, role }
            }
            TextureNode::Volume { .. } => match self.volume(desc) {
                Some(volume) => SpectrumNode::Volume(volume, role),
                None => return black(),
            },
            TextureNode::Triplanar { planes, sharpness, texture_from_world } => {
                let planes = planes.each_ref().map(|p| operand(self, p));
                SpectrumNode::Triplanar(Triplanar::new(planes, *sharpness, texture_from_world))
            }
            TextureNode::Step { .. } => {
                let number = self.float_node(desc, index);
                return self.grey(number);
            }
            TextureNode::Marble { octaves, roughness, scale, variation, texture_from_world } => {
                let marble =
                    Marble { octaves: *octaves, omega: *roughness, scale: *scale, variation: *variation };
                SpectrumNode::Marble(marble, Mapping3::compile(texture_from_world))
            }
            TextureNode::Fbm { .. } | TextureNode::Wrinkled { .. } | TextureNode::Windy { .. } => {
                let number = self.float_node(desc, index);
                return self.grey(number);
            }
            TextureNode::Scale { .. }
            | TextureNode::Product { .. }
            | TextureNode::Mix { .. }
            | TextureNode::DirectionMix { .. }
            | TextureNode::Checkerboard { .. }
            | TextureNode::Bilerp { .. }
            | TextureNode::Dots { .. } => match self.combine(desc, index, &mut operand) {
                Some(Combine::Scale {
                    tex: SpectrumHandle::Constant(value),
                    scale: FloatHandle::Constant(factor),
                }) => return SpectrumHandle::Constant(value.scaled(factor)),
                Some(node) => SpectrumNode::Combine(node),
                None => return black(),
            },
        };
        self.push_spectrum(node)
    }

    fn grey(&mut self, number: FloatHandle) -> SpectrumHandle {
        match number {
            FloatHandle::Constant(c) => SpectrumHandle::Constant(SpectrumValue::constant(c)),
            FloatHandle::Texture(_) => self.push_spectrum(SpectrumNode::Grey(number)),
        }
    }

    fn push_spectrum(&mut self, node: SpectrumNode) -> SpectrumHandle {
        self.spectra.push(node);
        SpectrumHandle::Texture(next_id(self.spectra.len()))
    }

    /// The textures made of others; `None` for those that are not.
    fn combine<H>(
        &mut self,
        desc: &TextureDesc,
        index: usize,
        operand: &mut impl FnMut(&mut Self, &TextureInput) -> H,
    ) -> Option<Combine<H>> {
        let span = desc.span;
        let number = |this: &mut Self, input: &FloatInput| match input {
            FloatInput::Texture(id) if this.texture(*id, index, span).is_none() => FloatHandle::Constant(0.0),
            FloatInput::Texture(_) | FloatInput::Constant(_) => this.float(input, span),
        };
        Some(match &desc.node {
            TextureNode::Scale { tex, scale } => {
                Combine::Scale { tex: operand(self, tex), scale: number(self, scale) }
            }
            TextureNode::Product { a, b } => Combine::Product { a: operand(self, a), b: operand(self, b) },
            TextureNode::Mix { a, b, amount } => {
                Combine::Mix { a: operand(self, a), b: operand(self, b), amount: number(self, amount) }
            }
            TextureNode::DirectionMix { a, b, dir } => Combine::DirectionMix {
                a: operand(self, a),
                b: operand(self, b),
                dir: dir.try_normalize().unwrap_or(Vec3::Y),
            },
            TextureNode::Checkerboard { a, b, mapping: Some(mapping), .. } => Combine::Checkerboard {
                a: operand(self, a),
                b: operand(self, b),
                mapping: self.mapping(mapping),
            },
            TextureNode::Checkerboard { a, b, mapping: None, texture_from_world } => Combine::Cubes {
                a: operand(self, a),
                b: operand(self, b),
                mapping: Mapping3::compile(texture_from_world),
            },
            TextureNode::Bilerp { corners, mapping } => Combine::Bilerp {
                corners: Box::new(corners.each_ref().map(|c| operand(self, c))),
                mapping: self.mapping(mapping),
            },
            TextureNode::Dots { inside, outside, mapping } => Combine::Dots {
                inside: operand(self, inside),
                outside: operand(self, outside),
                mapping: self.mapping(mapping),
            },
            TextureNode::Constant(_)
            | TextureNode::Step { .. }
            | TextureNode::Attribute { .. }
            | TextureNode::Fbm { .. }
            | TextureNode::Wrinkled { .. }
            | TextureNode::Windy { .. }
            | TextureNode::Marble { .. }
            | TextureNode::Triplanar { .. }
            | TextureNode::Volume { .. }
            | TextureNode::ImageMap { .. } => return None,
        })
    }
}

fn next_id(len: usize) -> TextureId {
    TextureId(u32::try_from(len - 1).unwrap_or(u32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Footprint, Place, TextureContext};
    use math::{Dir, Point, Transform, Vec2};
    use scene_desc::{ImageDesc, ImageEncoding, ImageFilter, TextureId as Id, WrapMode};
    use spectrum::{ColorMode, ColorSpace, Wavelengths};
    use std::path::Path;

    const RGB: ColorPipeline = ColorPipeline::new(ColorMode::Rgb, ColorSpace::Srgb);

    fn at(u: f32, v: f32) -> TextureContext {
        let p = Point::new(u, v, 0.25);
        TextureContext {
            p,
            n: Dir::Z,
            uv: Vec2::new(u, v),
            footprint: Footprint::default(),
            place: Place::default(),
        }
    }

    fn float(node: TextureNode) -> TextureDesc {
        TextureDesc { name: "f".into(), kind: TextureKind::Float, node, span: Span::NONE }
    }

    fn spectrum(node: TextureNode) -> TextureDesc {
        TextureDesc { kind: TextureKind::Spectrum, ..float(node) }
    }

    /// Compiles the last texture as a number and evaluates it.
    fn number(textures: Vec<TextureDesc>, ctx: &TextureContext) -> f32 {
        let scene = SceneDesc { textures, ..SceneDesc::default() };
        let mut sink = Sink::default();
        let mut compiler = TextureCompiler::new(&scene, RGB, &mut sink);
        let last = Id(scene.textures.len() as u32 - 1);
        let handle = compiler.float(&FloatInput::Texture(last), Span::NONE);
        let textures = compiler.finish();
        assert!(sink.diagnostics().is_empty(), "{sink:?}");
        textures.float(&handle, ctx)
    }

    /// Compiles the last texture as a spectrum and evaluates it in RGB mode.
    fn color(textures: Vec<TextureDesc>, role: SpectrumRole, ctx: &TextureContext) -> [f32; 3] {
        let scene = SceneDesc { textures, ..SceneDesc::default() };
        let mut sink = Sink::default();
        let mut compiler = TextureCompiler::new(&scene, RGB, &mut sink);
        let last = Id(scene.textures.len() as u32 - 1);
        let handle = compiler.spectrum(&SpectrumInput::Texture(last), role, Span::NONE);
        let textures = compiler.finish();
        assert!(sink.diagnostics().is_empty(), "{sink:?}");
        textures.spectrum(&handle, ctx, &Wavelengths::RGB).rgb()
    }

    fn uv_ramp() -> TextureDesc {
        let corners = [0.0, 1.0, 2.0, 3.0].map(TextureInput::Float);
        float(TextureNode::Bilerp { corners, mapping: Mapping2d::default() })
    }

    fn map(filter: ImageFilter, scale: f32, invert: bool) -> TextureNode {
        TextureNode::ImageMap {
            tiles: Vec::new(),
            image: ImageId(0),
            mapping: Mapping2d::default(),
            wrap: [WrapMode::Clamp; 2],
            filter,
            max_anisotropy: 8.0,
            scale,
            invert,
        }
    }

    #[test]
    fn tiles_lie_side_by_side_with_black_where_there_is_none() {
        let image = |value: u8| {
            let pgm = image::Image::from_data(1, 1, vec!["Y".to_owned()], vec![f32::from(value)]).unwrap();
            let bytes = image::encode(&pgm, image::Format::Exr, &image::SaveOptions::default()).unwrap();
            ImageDesc {
                path: format!("{value}.exr").into(),
                encoding: ImageEncoding::Linear,
                space: scene_desc::ColorSpaceName::Srgb,
                channel: None,
                embedded: Some(bytes.into()),
                span: Span::NONE,
            }
        };
        let tile = |at, image| scene_desc::ImageTile { at, image: ImageId(image) };
        let tiles = vec![tile([0, 0], 0), tile([2, 0], 1), tile([1, 1], 2)];
        let mut node = map(ImageFilter::Trilinear, 1.0, false);
        if let TextureNode::ImageMap { tiles: all, .. } = &mut node {
            *all = tiles;
        }
        let textures = vec![float(node)];
        let scene = SceneDesc { textures, images: [3, 5, 7].map(image).to_vec(), ..SceneDesc::default() };
        let mut sink = Sink::default();
        let mut compiler = TextureCompiler::new(&scene, RGB, &mut sink);
        let handle = compiler.float(&FloatInput::Texture(Id(0)), Span::NONE);
        let textures = compiler.finish();
        assert!(sink.diagnostics().is_empty(), "{sink:?}");
        let value = |u, v| textures.float(&handle, &at(u, v));
        assert_eq!([value(0.5, 0.1), value(2.01, 0.99), value(1.5, 1.5)], [3.0, 5.0, 7.0]);
        assert_eq!([value(1.5, 0.5), value(-0.5, 0.5), value(0.5, 1.0)], [0.0; 3]);
    }

    #[test]
    fn bilerps_corners_are_where_files_put_them() {
        // v00, v01, v10, v11: the first digit is s.
        let f = |u, v| number(vec![uv_ramp()], &at(u, v));
        assert_eq!([f(0.0, 0.0), f(0.0, 1.0), f(1.0, 0.0), f(1.0, 1.0)], [0.0, 1.0, 2.0, 3.0]);
        assert!((f(0.25, 0.5) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn textures_combine_as_their_formulas_say() {
        let tex = || TextureInput::Texture(Id(0));
        let ctx = at(0.25, 0.5);
        let scale = TextureNode::Scale { tex: tex(), scale: 3.0.into() };
        assert!((number(vec![uv_ramp(), float(scale)], &ctx) - 3.0).abs() < 1e-6);
        let mix = TextureNode::Mix { a: tex(), b: TextureInput::Float(5.0), amount: 0.75.into() };
        assert!((number(vec![uv_ramp(), float(mix)], &ctx) - 4.0).abs() < 1e-6);
        let dir = Vec3::new(0.6, 0.0, 0.8) * 2.0;
        let facing =
            TextureNode::DirectionMix { a: TextureInput::Float(1.0), b: TextureInput::Float(0.0), dir };
        assert!((number(vec![float(facing)], &ctx) - 0.8).abs() < 1e-6);
        let checker = |u: f32| {
            let (a, b) = (TextureInput::Float(0.1), TextureInput::Float(0.9));
            let mapping = Some(Mapping2d::Uv { scale: [4.0, 4.0], shift: [0.0; 2] });
            let node = TextureNode::Checkerboard { a, b, mapping, texture_from_world: Transform::IDENTITY };
            number(vec![float(node)], &at(u, 0.1))
        };
        assert_eq!([checker(0.1), checker(0.3), checker(0.6)], [0.1, 0.9, 0.1]);
    }

    #[test]
    fn what_does_not_vary_is_a_constant() {
        let two = || float(TextureNode::Constant(TextureInput::Float(2.0)));
        let scaled =
            TextureNode::Scale { tex: TextureInput::Texture(Id(0)), scale: FloatInput::Texture(Id(0)) };
        let red =
            spectrum(TextureNode::Constant(TextureInput::Spectrum(SpectrumDesc::srgb([1.0, 0.0, 0.0]))));
        let half_red = TextureNode::Scale { tex: TextureInput::Texture(Id(2)), scale: 0.5.into() };
        let scene = SceneDesc {
            textures: vec![two(), float(scaled), red, spectrum(half_red)],
            ..SceneDesc::default()
        };
        let mut sink = Sink::default();
        let mut compiler = TextureCompiler::new(&scene, RGB, &mut sink);
        assert_eq!(compiler.float(&FloatInput::Texture(Id(1)), Span::NONE), FloatHandle::Constant(4.0));
        let handle = compiler.spectrum(&SpectrumInput::Texture(Id(3)), SpectrumRole::Albedo, Span::NONE);
        let SpectrumHandle::Constant(value) = handle else { panic!("{handle:?}") };
        assert_eq!(value.eval(&Wavelengths::RGB).rgb(), [0.5, 0.0, 0.0]);
        let textures = compiler.finish();
        assert!(textures.floats.is_empty() && textures.spectra.is_empty());
    }

    #[test]
    fn noise_and_marble_are_there_in_every_kind() {
        let id = Transform::IDENTITY;
        let ctx = at(0.3, 0.6);
        let fbm = || TextureNode::Fbm { octaves: 8, roughness: 0.5, texture_from_world: id };
        let f = number(vec![float(fbm())], &ctx);
        assert!(f != 0.0 && f.abs() < 1.0);
        assert_eq!(color(vec![spectrum(fbm())], SpectrumRole::Unbounded, &ctx), [f; 3]);
        let wrinkled = TextureNode::Wrinkled { octaves: 8, roughness: 0.5, texture_from_world: id };
        assert!(number(vec![float(wrinkled)], &ctx) > 0.0);
        assert!(number(vec![float(TextureNode::Windy { texture_from_world: id })], &ctx).abs() < 1.0);
        let marble = TextureNode::Marble {
            octaves: 8,
            roughness: 0.5,
            scale: 1.0,
            variation: 0.2,
            texture_from_world: id,
        };
        let rgb = color(vec![spectrum(marble)], SpectrumRole::Albedo, &ctx);
        assert!(rgb.iter().all(|c| (0.3..=0.9).contains(c)), "{rgb:?}");
    }

    #[test]
    fn a_texture_that_uses_a_later_one_is_an_error() {
        let forward = TextureNode::Scale { tex: TextureInput::Texture(Id(1)), scale: 1.0.into() };
        let scene = SceneDesc { textures: vec![float(forward), uv_ramp()], ..SceneDesc::default() };
        let mut sink = Sink::default();
        let mut compiler = TextureCompiler::new(&scene, RGB, &mut sink);
        let _ = compiler.float(&FloatInput::Texture(Id(0)), Span::NONE);
        let _ = compiler.float(&FloatInput::Texture(Id(9)), Span::NONE);
        let _ = compiler.finish();
        assert_eq!(sink.diagnostics().len(), 2);
        assert_eq!(sink.diagnostics()[0].message, "texture 1 is not among the 0 made before it");
    }

    /// A scene whose last texture maps this image: black, red / green, white.
    fn with_image(dir: &Path, node: TextureDesc) -> SceneDesc {
        let path = dir.join("four.pfm");
        let names = ["R", "G", "B"].map(str::to_owned).to_vec();
        let data = vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 1.0];
        let image = image::Image::from_data(2, 2, names, data).unwrap();
        image::save(&path, &image, &image::SaveOptions::default()).unwrap();
        let desc = ImageDesc {
            path,
            encoding: ImageEncoding::Auto,
            space: scene_desc::ColorSpaceName::Srgb,
            channel: None,
            embedded: None,
            span: Span::NONE,
        };
        SceneDesc { textures: vec![node], images: vec![desc], ..SceneDesc::default() }
    }

    #[test]
    fn an_image_stands_upright() {
        let dir = tempfile::tempdir().unwrap();
        let scene = with_image(dir.path(), spectrum(map(ImageFilter::Point, 1.0, false)));
        let mut sink = Sink::default();
        let mut compiler = TextureCompiler::new(&scene, RGB, &mut sink);
        let handle = compiler.spectrum(&SpectrumInput::Texture(Id(0)), SpectrumRole::Albedo, Span::NONE);
        let textures = compiler.finish();
        assert!(sink.diagnostics().is_empty(), "{sink:?}");
        let rgb = |u, v| textures.spectrum(&handle, &at(u, v), &Wavelengths::RGB).rgb();
        // The upper row of the file is at v above one half.
        assert_eq!(rgb(0.25, 0.75), [0.0, 0.0, 0.0]);
        assert_eq!(rgb(0.75, 0.75), [1.0, 0.0, 0.0]);
        assert_eq!(rgb(0.25, 0.25), [0.0, 1.0, 0.0]);
        assert_eq!(rgb(0.75, 0.25), [1.0, 1.0, 1.0]);
    }

    #[test]
    fn an_image_is_scaled_then_inverted_and_numbers_are_means() {
        let dir = tempfile::tempdir().unwrap();
        for (filter, levels) in
            [(ImageFilter::Bilinear, 1), (ImageFilter::Ewa, 2), (ImageFilter::Trilinear, 2)]
        {
            let mut scene = with_image(dir.path(), float(map(filter, 0.5, true)));
            scene.textures.push(spectrum(map(filter, 2.0, true)));
            let mut sink = Sink::default();
            let mut compiler = TextureCompiler::new(&scene, RGB, &mut sink);
            let number = compiler.float(&FloatInput::Texture(Id(0)), Span::NONE);
            let color =
                compiler.spectrum(&SpectrumInput::Texture(Id(1)), SpectrumRole::Unbounded, Span::NONE);
            let textures = compiler.finish();
            assert_eq!(textures.images().get(ImageId(0)).n_levels(), levels);
            // Red at the upper right: mean 1/3, 1 − 0.5/3; and (1 − 2, 1, 1) without what is below zero.
            assert!((textures.float(&number, &at(0.75, 0.75)) - (1.0 - 0.5 / 3.0)).abs() < 1e-6);
            let rgb = textures.spectrum(&color, &at(0.75, 0.75), &Wavelengths::RGB).rgb();
            assert_eq!(rgb, [0.0, 1.0, 1.0]);
        }
    }

    #[test]
    fn only_images_that_something_uses_are_read() {
        let dir = tempfile::tempdir().unwrap();
        let mut scene = with_image(dir.path(), float(map(ImageFilter::Bilinear, 1.0, false)));
        scene.images[0].path = "/nowhere/none.png".into();
        let mut sink = Sink::default();
        let _ = TextureCompiler::new(&scene, RGB, &mut sink).finish();
        assert!(sink.diagnostics().is_empty());
        let mut compiler = TextureCompiler::new(&scene, RGB, &mut sink);
        compiler.use_image(ImageId(0));
        let _ = compiler.finish();
        assert!(sink.has_errors());
    }
}
