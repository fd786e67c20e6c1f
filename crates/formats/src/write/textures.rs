//! `Texture`.

use math::{AnimatedTransform, Transform};
use scene_desc::{
    FloatInput, ImageFilter, Mapping2d, Span, TextureDesc, TextureInput, TextureKind, TextureNode, WrapMode,
};

use super::params::Params;
use super::{WriteError, Writer};

impl Writer<'_, '_, '_> {
    pub(super) fn textures(&mut self) -> Result<(), WriteError> {
        for (i, texture) in self.scene.textures.iter().enumerate() {
            let mut p = Params::default();
            let mut place = Transform::IDENTITY;
            let class = self.texture(&mut p, texture, &mut place)?;
            let kind = match texture.kind {
                TextureKind::Float => "float",
                TextureKind::Spectrum => "spectrum",
            };
            let is_placed = place != Transform::IDENTITY;
            if is_placed {
                self.line(0, "AttributeBegin");
                self.transform(1, &AnimatedTransform::fixed(place), texture.span);
            }
            self.line(
                usize::from(is_placed),
                &format!("Texture \"texture-{i}\" \"{kind}\" \"{class}\"{}", p.0),
            );
            if is_placed {
                self.line(0, "AttributeEnd");
            }
        }
        Ok(())
    }

    #[allow(clippy::too_many_lines, reason = "one arm a kind")]
    fn texture(
        &mut self,
        p: &mut Params,
        texture: &TextureDesc,
        place: &mut Transform,
    ) -> Result<&'static str, WriteError> {
        let how = (texture.kind == TextureKind::Spectrum, texture.span);
        let span = texture.span;
        Ok(match &texture.node {
            TextureNode::Constant(value) => {
                self.texture_input(p, "value", value, how);
                "constant"
            }
            TextureNode::Scale { tex, scale } => {
                self.texture_input(p, "tex", tex, how);
                Self::float_input(p, "scale", scale);
                "scale"
            }
            TextureNode::Product { a, b } => {
                let factor = match b {
                    TextureInput::Float(x) => Some(FloatInput::Constant(*x)),
                    TextureInput::Texture(id) if texture.kind == TextureKind::Float => {
                        Some(FloatInput::Texture(*id))
                    }
                    TextureInput::Texture(_) | TextureInput::Spectrum(_) => None,
                };
                if factor.is_none() {
                    self.otherwise(span, "product of two colours", "it is the first of them alone");
                }
                self.texture_input(p, "tex", a, how);
                Self::float_input(p, "scale", &factor.unwrap_or(FloatInput::Constant(1.0)));
                "scale"
            }
            TextureNode::Step { tex, .. } => {
                self.otherwise(span, "step between zero and one", "it is the number itself");
                self.texture_input(p, "tex", tex, how);
                "scale"
            }
            TextureNode::Attribute { .. } => {
                self.otherwise(span, "value that a mesh carries", "it is one half");
                self.texture_input(p, "value", &TextureInput::Float(0.5), how);
                "constant"
            }
            TextureNode::Triplanar { planes, sharpness, texture_from_world } => {
                self.otherwise(
                    span,
                    "texture seen along three axes",
                    "a \"triplanar\" is written, which we alone can read",
                );
                for (name, plane) in ["x", "y", "z"].into_iter().zip(planes) {
                    self.texture_input(p, name, plane, how);
                }
                p.float("sharpness", *sharpness);
                *place = texture_from_world.inverse();
                "triplanar"
            }
            TextureNode::Volume { values, .. } => {
                self.otherwise(span, "texture of a volume", "its mean is written");
                let sum = values.iter().fold([0.0_f64; 3], |s, v| [0, 1, 2].map(|c| s[c] + f64::from(v[c])));
                let mean = sum.map(|s| (s / values.len().max(1) as f64) as f32);
                let grey = TextureInput::Float((mean[0] + mean[1] + mean[2]) / 3.0);
                let color = TextureInput::Spectrum(scene_desc::SpectrumDesc::srgb(mean));
                self.texture_input(p, "value", if how.0 { &color } else { &grey }, how);
                "constant"
            }
            TextureNode::Mix { a, b, amount } => {
                self.texture_input(p, "tex1", a, how);
                self.texture_input(p, "tex2", b, how);
                Self::float_input(p, "amount", amount);
                "mix"
            }
            TextureNode::DirectionMix { a, b, dir } => {
                self.texture_input(p, "tex1", a, how);
                self.texture_input(p, "tex2", b, how);
                p.vec3s("vector3", "dir", &[*dir]);
                "directionmix"
            }
            TextureNode::Checkerboard { a, b, mapping, texture_from_world } => {
                self.texture_input(p, "tex1", a, how);
                self.texture_input(p, "tex2", b, how);
                match mapping {
                    Some(mapping) => self.mapping(p, mapping, place, span),
                    None => {
                        p.integer("dimension", 3);
                        *place = texture_from_world.inverse();
                    }
                }
                "checkerboard"
            }
            TextureNode::Bilerp { corners, mapping } => {
                for (name, corner) in ["v00", "v01", "v10", "v11"].into_iter().zip(corners) {
                    self.texture_input(p, name, corner, how);
                }
                self.mapping(p, mapping, place, span);
                "bilerp"
            }
            TextureNode::Dots { inside, outside, mapping } => {
                self.texture_input(p, "inside", inside, how);
                self.texture_input(p, "outside", outside, how);
                self.mapping(p, mapping, place, span);
                "dots"
            }
            TextureNode::Fbm { octaves, roughness, texture_from_world }
            | TextureNode::Wrinkled { octaves, roughness, texture_from_world } => {
                p.integer("octaves", *octaves);
                p.float("roughness", *roughness);
                *place = texture_from_world.inverse();
                if matches!(texture.node, TextureNode::Fbm { .. }) { "fbm" } else { "wrinkled" }
            }
            TextureNode::Windy { texture_from_world } => {
                *place = texture_from_world.inverse();
                "windy"
            }
            TextureNode::Marble { octaves, roughness, scale, variation, texture_from_world } => {
                p.integer("octaves", *octaves);
                p.float("roughness", *roughness);
                p.float("scale", *scale);
                p.float("variation", *variation);
                *place = texture_from_world.inverse();
                "marble"
            }
            TextureNode::ImageMap { image, tiles, mapping, wrap, filter, max_anisotropy, scale, invert } => {
                let name = if tiles.is_empty() { self.image(*image)? } else { self.tiles(tiles, span)? };
                p.string("filename", &name);
                self.encoding(p, *image);
                self.mapping(p, mapping, place, span);
                if wrap[0] != wrap[1] {
                    self.otherwise(
                        span,
                        "image with two modes beyond its borders",
                        "the first counts for both",
                    );
                }
                p.string(
                    "wrap",
                    match wrap[0] {
                        WrapMode::Repeat => "repeat",
                        WrapMode::Clamp => "clamp",
                        WrapMode::Black => "black",
                        WrapMode::Mirror => {
                            self.otherwise(span, "image that mirrors beyond its borders", "it repeats");
                            "repeat"
                        }
                    },
                );
                p.string(
                    "filter",
                    match filter {
                        ImageFilter::Point => "point",
                        ImageFilter::Bilinear => "bilinear",
                        ImageFilter::Trilinear => "trilinear",
                        ImageFilter::Ewa => "ewa",
                    },
                );
                p.float_unless("maxanisotropy", *max_anisotropy, 8.0);
                p.float_unless("scale", *scale, 1.0);
                if *invert {
                    p.boolean("invert", true);
                }
                "imagemap"
            }
        })
    }

    fn mapping(&mut self, p: &mut Params, mapping: &Mapping2d, place: &mut Transform, span: Span) {
        match mapping {
            Mapping2d::Uv { scale, shift } => {
                for (name, x, default) in [
                    ("uscale", scale[0], 1.0),
                    ("vscale", scale[1], 1.0),
                    ("udelta", shift[0], 0.0),
                    ("vdelta", shift[1], 0.0),
                ] {
                    p.float_unless(name, x, default);
                }
            }
            Mapping2d::Affine { u, v, shift } => {
                self.otherwise(span, "turned texture coordinates", "they are scaled and shifted alone");
                p.float("uscale", u.x);
                p.float("vscale", v.y);
                p.float("udelta", shift.x);
                p.float("vdelta", shift.y);
            }
            Mapping2d::Attribute { .. } => {
                self.otherwise(span, "second set of texture coordinates", "the first is used");
            }
            Mapping2d::Spherical(texture_from_world) => {
                p.string("mapping", "spherical");
                *place = texture_from_world.inverse();
            }
            Mapping2d::Cylindrical(texture_from_world) => {
                p.string("mapping", "cylindrical");
                *place = texture_from_world.inverse();
            }
            Mapping2d::Planar { texture_from_world, vs, vt, shift } => {
                p.string("mapping", "planar");
                p.vec3s("vector3", "v1", &[*vs]);
                p.vec3s("vector3", "v2", &[*vt]);
                p.float_unless("udelta", shift[0], 0.0);
                p.float_unless("vdelta", shift[1], 0.0);
                *place = texture_from_world.inverse();
            }
        }
    }
}
