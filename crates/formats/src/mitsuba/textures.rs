//! Textures, as numbers and as spectra.
//!
//! Mitsuba's v runs down an image's rows. Here meshes get `1 − v`, so that v runs up everywhere, and every `to_uv` is
//! turned to match; patterns, which have no up, get Mitsuba's own v back.

use math::Vec2;
use scene_desc::{
    FloatInput, ImageEncoding, ImageFilter, Mapping2d, SpectrumDesc, SpectrumInput, TextureDesc, TextureId,
    TextureInput, TextureKind, TextureNode, WrapMode,
};

use super::build::Build;
use super::spectra::{PLUGINS, Spectral};
use super::tree::{Class, Node, NodeId, Value};
use super::volumes::Volume;

/// Textures that are known, supported or not.
const NAMES: [&str; 8] = [
    "bitmap",
    "checkerboard",
    "mesh_attribute",
    "volume",
    "scale",
    "vertexcolors",
    "gridtexture",
    "curvature",
];

/// The u and v of a texture's own plane from the surface's.
#[derive(Clone, Copy)]
struct Affine {
    /// Columns of the matrix, and the shift.
    u: Vec2,
    v: Vec2,
    shift: Vec2,
}

impl Affine {
    /// Both v's run up instead of down: `1 − (M (u, 1 − v) + d).y`.
    fn upwards(self) -> Self {
        Self {
            u: Vec2::new(self.u.x, -self.u.y),
            v: Vec2::new(-self.v.x, self.v.y),
            shift: Vec2::new(self.shift.x + self.v.x, 1.0 - self.shift.y - self.v.y),
        }
    }

    /// Only the surface's v runs up.
    fn of_upwards(self) -> Self {
        Self { u: self.u, v: -self.v, shift: self.shift + self.v }
    }

    fn scaled(self, factor: f32) -> Self {
        Self { u: self.u * factor, v: self.v * factor, shift: self.shift * factor }
    }

    fn mapping(self) -> Mapping2d {
        if self.u.y == 0.0 && self.v.x == 0.0 {
            return Mapping2d::Uv { scale: [self.u.x, self.v.y], shift: self.shift.to_array() };
        }
        Mapping2d::Affine { u: self.u, v: self.v, shift: self.shift }
    }
}

impl<'t> Build<'t, '_, '_> {
    // ── Inputs of materials ──────────────────────────────────────────────────────────────────────────────────────

    /// A number or a texture of numbers.
    pub(super) fn float_input(&mut self, node: &'t Node, name: &'static str, default: f32) -> FloatInput {
        let Some(p) = node.find(name) else { return default.into() };
        if matches!(p.value, Value::Object(_) | Value::Ref(_)) {
            let Some(id) = self.object_of(p) else { return default.into() };
            let texture = self.tree.node(id);
            if texture.class != Class::Texture {
                self.misplaced(texture, node);
                return default.into();
            }
            return match self.value_of(texture) {
                Some(Spectral::Constant(c)) => c.into(),
                Some(_) => {
                    let message = format!("\"{name}\" takes a number, not a spectrum");
                    self.report.error(p.span, message).hint("expected <float>, or a texture");
                    default.into()
                }
                None => self.texture(id, TextureKind::Float).map_or(default.into(), FloatInput::Texture),
            };
        }
        self.float(node, name, default).into()
    }

    /// A spectrum or a texture of spectra; `None` if there is no such property.
    pub(super) fn spectrum_opt(&mut self, node: &'t Node, name: &'static str) -> Option<SpectrumInput> {
        let p = node.find(name)?;
        Some(match &p.value {
            Value::Float(x) => SpectrumDesc::Constant(*x as f32).into(),
            Value::Integer(n) => SpectrumDesc::Constant(*n as f32).into(),
            Value::Rgb(rgb) if rgb[0] == rgb[1] && rgb[1] == rgb[2] => SpectrumDesc::Constant(rgb[0]).into(),
            Value::Rgb(rgb) => SpectrumDesc::srgb(*rgb).into(),
            Value::Spectrum(s) => s.plain().into(),
            Value::Object(_) | Value::Ref(_) => {
                let id = self.object_of(p)?;
                let texture = self.tree.node(id);
                if texture.class != Class::Texture {
                    self.misplaced(texture, node);
                    return None;
                }
                match self.value_of(texture) {
                    Some(s) => s.plain().into(),
                    None => SpectrumInput::Texture(self.texture(id, TextureKind::Spectrum)?),
                }
            }
            Value::Bool(_) | Value::Text(_) | Value::Vector(_) | Value::Transform(_) => {
                let message = format!("\"{name}\" of {} is a <{}>", node.title(), p.value.element());
                return self.refuse(p.span, message, "expected <rgb>, <spectrum>, <float> or a texture");
            }
        })
    }

    pub(super) fn spectrum_input(
        &mut self,
        node: &'t Node,
        name: &'static str,
        default: f32,
    ) -> SpectrumInput {
        self.spectrum_opt(node, name).unwrap_or_else(|| SpectrumDesc::Constant(default).into())
    }

    /// A spectrum that does not vary.
    pub(super) fn spectrum_desc(&mut self, node: &'t Node, name: &'static str) -> Option<SpectrumDesc> {
        match self.spectrum_opt(node, name)? {
            SpectrumInput::Constant(desc) => Some(desc),
            SpectrumInput::Texture(_) => {
                let message = format!("\"{name}\" of {} cannot vary", node.title());
                self.refuse(node.span_of(name), message, "expected <rgb>, <spectrum> or <float>")
            }
        }
    }

    /// The spectrum that a plug-in is, if it is none that varies.
    pub(super) fn value_of(&mut self, texture: &Node) -> Option<Spectral> {
        PLUGINS.contains(&texture.kind.as_str()).then(|| self.spectrum_plugin(texture)).flatten()
    }

    // ── Textures themselves ──────────────────────────────────────────────────────────────────────────────────────

    /// The texture of a node, made once for each kind of value.
    pub(super) fn texture(&mut self, id: NodeId, kind: TextureKind) -> Option<TextureId> {
        if let Some(found) = self.textures.get(&(id, kind)) {
            return *found;
        }
        let node = self.tree.node(id);
        if self.building.contains(&id) {
            return self.refuse(
                node.span,
                format!("{} refers to itself", node.title()),
                "take a reference out",
            );
        }
        self.building.push(id);
        let made = self.texture_node(node, kind);
        self.building.pop();
        if made.is_some() {
            self.unused(node);
        }
        let texture = made.map(|made| {
            let name = node.id.clone().unwrap_or_default();
            self.scene.textures.push(TextureDesc { name, kind, node: made, span: node.span });
            TextureId(u32::try_from(self.scene.textures.len() - 1).unwrap_or(u32::MAX))
        });
        self.textures.insert((id, kind), texture);
        texture
    }

    fn texture_node(&mut self, node: &'t Node, kind: TextureKind) -> Option<TextureNode> {
        match node.kind.as_str() {
            "bitmap" => self.bitmap(node),
            "checkerboard" => {
                let a = self.operand(node, "color0", kind, 0.4);
                let b = self.operand(node, "color1", kind, 0.2);
                // Mitsuba's squares of numbers lie where its squares of colours have their gaps.
                let (a, b) = if kind == TextureKind::Float { (b, a) } else { (a, b) };
                // Their squares are half a unit wide.
                let mapping = Some(self.uv_transform(node).of_upwards().scaled(2.0).mapping());
                let texture_from_world = math::Transform::IDENTITY;
                Some(TextureNode::Checkerboard { a, b, mapping, texture_from_world })
            }
            "scale" => {
                let children = self.children(node);
                let inner = children.iter().find(|c| c.1.class == Class::Texture).map(|c| c.2);
                let scale = self.float(node, "scale", 1.0);
                let inner = inner.and_then(|id| self.texture(id, kind));
                let tex = inner.map_or(TextureInput::Float(1.0), TextureInput::Texture);
                Some(TextureNode::Scale { tex, scale: scale.into() })
            }
            "mesh_attribute" => {
                let name = self.string(node, "name").unwrap_or_default();
                let scale = self.float(node, "scale", 1.0);
                Some(TextureNode::Attribute { name, scale })
            }
            "volume" => self.volume_texture(node),
            "vertexcolors" | "gridtexture" | "curvature" => {
                self.unsupported(node, "grey of one half stands in");
                Some(TextureNode::Constant(TextureInput::Float(0.5)))
            }
            _ => {
                let all: Vec<_> = NAMES.into_iter().chain(PLUGINS).collect();
                self.unknown(node, &all);
                None
            }
        }
    }

    /// An operand of a texture, of its own kind.
    fn operand(
        &mut self,
        node: &'t Node,
        name: &'static str,
        kind: TextureKind,
        default: f32,
    ) -> TextureInput {
        match kind {
            TextureKind::Float => match self.float_input(node, name, default) {
                FloatInput::Constant(c) => TextureInput::Float(c),
                FloatInput::Texture(id) => TextureInput::Texture(id),
            },
            TextureKind::Spectrum => match self.spectrum_input(node, name, default) {
                SpectrumInput::Constant(desc) => TextureInput::Spectrum(desc),
                SpectrumInput::Texture(id) => TextureInput::Texture(id),
            },
        }
    }

    /// What `to_uv` asks for, in Mitsuba's own direction of v.
    fn uv_transform(&mut self, node: &Node) -> Affine {
        let m = self.transform(node, "to_uv").matrix();
        let column = |c: math::DVec4| Vec2::new(c.x as f32, c.y as f32);
        // Nine numbers are a matrix of the plane, whose shift stands in the third column.
        let is_planar = m.w_axis.x == 0.0 && m.w_axis.y == 0.0;
        let shift = if is_planar { m.z_axis } else { m.w_axis };
        Affine { u: column(m.x_axis), v: column(m.y_axis), shift: column(shift) }
    }

    fn bitmap(&mut self, node: &'t Node) -> Option<TextureNode> {
        let raw = self.boolean(node, "raw", false);
        // Version 0.x says it by the exponent.
        let gamma = self.float_opt(node, "gamma").filter(|g| *g > 0.0);
        let encoding = match gamma {
            _ if raw => ImageEncoding::Linear,
            Some(1.0) => ImageEncoding::Linear,
            Some(gamma) => ImageEncoding::Gamma(gamma),
            None => ImageEncoding::Auto,
        };
        let filter = match self.word(node, "filter_type", &["bilinear", "nearest", "ewa", "trilinear"]) {
            "nearest" => ImageFilter::Point,
            "ewa" => ImageFilter::Ewa,
            "trilinear" => ImageFilter::Trilinear,
            _ => ImageFilter::Bilinear,
        };
        let wrap = match self.word(node, "wrap_mode", &["repeat", "mirror", "clamp", "zero", "one"]) {
            "mirror" => WrapMode::Mirror,
            "clamp" => WrapMode::Clamp,
            "zero" => WrapMode::Black,
            "one" => {
                self.report
                    .warning(node.span_of("wrap_mode"), "\"wrap_mode\" \"one\" is not supported")
                    .hint("the border's value is used beyond it");
                WrapMode::Clamp
            }
            _ => WrapMode::Repeat,
        };
        let max_anisotropy = self.float(node, "max_anisotropy", 20.0);
        node.accept(&["format", "accel", "cache", "wrap_mode_u", "wrap_mode_v"]);
        let wrap = [wrap; 2];
        let (image, tiles) = self.images_of(node, encoding)?;
        let mapping = self.uv_transform(node).upwards().mapping();
        Some(TextureNode::ImageMap {
            image,
            tiles,
            mapping,
            wrap,
            filter,
            max_anisotropy,
            scale: 1.0,
            invert: false,
        })
    }

    /// A volume as a surface shows it.
    fn volume_texture(&mut self, node: &'t Node) -> Option<TextureNode> {
        Some(match self.volume(node, "volume", 0.5) {
            Volume::Constant(rgb) => TextureNode::Constant(TextureInput::Spectrum(SpectrumDesc::srgb(rgb))),
            Volume::Grid { grid, world_from_grid, wrap } => TextureNode::Volume {
                resolution: grid.resolution,
                values: grid.values.into(),
                wrap,
                texture_from_world: world_from_grid.inverse(),
            },
        })
    }

    /// The image of a texture that must be one: what lights take.
    pub(super) fn image_of(&mut self, id: NodeId, purpose: &str) -> Option<scene_desc::ImageId> {
        let node = self.tree.node(id);
        if node.kind != "bitmap" {
            self.unsupported(node, &format!("{purpose} takes a bitmap alone: it is dark"));
            return None;
        }
        let Some(TextureNode::ImageMap { image, mapping, .. }) = self.bitmap(node) else { return None };
        if mapping != Mapping2d::default() {
            self.report
                .warning(node.span_of("to_uv"), format!("\"to_uv\" of {purpose} is not supported"))
                .hint("the image is used as it is");
        }
        self.unused(node);
        Some(image)
    }
}
