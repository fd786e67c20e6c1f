//! `Texture`: constant, scale, mix, directionmix, checkerboard, bilerp, dots, fbm, wrinkled, windy, marble, imagemap; and
//! `triplanar`, which is ours alone. A `filename` with `<UDIM>` in it is a set of tiles (ours alone as well).

use math::{Dir, Transform, Vec3};
use scene_desc::{
    FloatInput, ImageEncoding, ImageFilter, Mapping2d, Span, SpectrumDesc, TextureDesc, TextureId,
    TextureInput, TextureKind, TextureNode, WrapMode,
};

use super::build::Build;
use super::params::{Params, Type};
use super::state::{Entity, TextureEntity};
use crate::suggest;

const NAMES: [&str; 14] = [
    "bilerp",
    "checkerboard",
    "constant",
    "directionmix",
    "dots",
    "fbm",
    "imagemap",
    "marble",
    "mix",
    "ptex",
    "scale",
    "triplanar",
    "windy",
    "wrinkled",
];

/// Octaves of noise beyond which nothing can be seen.
const MOST_OCTAVES: u32 = 64;

impl Build<'_, '_> {
    /// Image maps first, then the others in order, as pbrt makes them: a texture may refer to an image map that is
    /// defined after it.
    pub(super) fn textures(&mut self, textures: Vec<TextureEntity>) {
        let (images, others): (Vec<_>, Vec<_>) =
            textures.into_iter().partition(|t| t.entity.kind == "imagemap");
        for TextureEntity { name, kind, entity } in images.into_iter().chain(others) {
            let node = self.texture_node(&entity, kind);
            // A texture that could not be made is still known by its name: one mistake, one message.
            let node = node.unwrap_or(TextureNode::Constant(TextureInput::Float(1.0)));
            let id = TextureId(u32::try_from(self.scene.textures.len()).unwrap_or(u32::MAX));
            match kind {
                TextureKind::Float => self.float_textures.insert(name.clone(), id),
                TextureKind::Spectrum => self.spectrum_textures.insert(name.clone(), id),
            };
            self.scene.textures.push(TextureDesc { name, kind, node, span: entity.span });
        }
    }

    fn texture_node(&mut self, entity: &Entity, kind: TextureKind) -> Option<TextureNode> {
        let p = &entity.params;
        let node = match entity.kind.as_str() {
            "constant" => TextureNode::Constant(self.constant(p, kind)),
            "scale" if self.is_old => TextureNode::Product {
                a: self.texture_input(p, "tex1", kind, 1.0),
                b: self.texture_input(p, "tex2", kind, 1.0),
            },
            "scale" => TextureNode::Scale {
                tex: self.texture_input(p, "tex", kind, 1.0),
                scale: self.float_input(p, "scale").unwrap_or(FloatInput::Constant(1.0)),
            },
            "mix" => TextureNode::Mix {
                a: self.texture_input(p, "tex1", kind, 0.0),
                b: self.texture_input(p, "tex2", kind, 1.0),
                amount: self.float_input(p, "amount").unwrap_or(FloatInput::Constant(0.5)),
            },
            "directionmix" => self.direction_mix(entity, kind),
            "checkerboard" => self.checkerboard(entity, kind)?,
            "bilerp" => {
                let mut corner = |name, default| self.texture_constant(p, name, kind, default);
                let corners =
                    [corner("v00", 0.0), corner("v01", 1.0), corner("v10", 0.0), corner("v11", 1.0)];
                TextureNode::Bilerp { corners, mapping: self.mapping(entity) }
            }
            "dots" => TextureNode::Dots {
                inside: self.texture_input(p, "inside", kind, 1.0),
                outside: self.texture_input(p, "outside", kind, 0.0),
                mapping: self.mapping(entity),
            },
            "imagemap" => self.image_map(entity)?,
            "ptex" => {
                self.report
                    .warning(entity.span, "ptex textures are not supported")
                    .hint("a constant 0.5 stands in for it");
                return Some(TextureNode::Constant(TextureInput::Float(0.5)));
            }
            "triplanar" => self.triplanar(entity, kind),
            "fbm" | "wrinkled" | "windy" | "marble" => self.noise(entity, kind)?,
            name => {
                let hint = suggest::hint(name, &NAMES);
                return self.refuse(entity.span, format!("unknown texture type \"{name}\""), hint);
            }
        };
        p.report_unused(&format!("texture \"{}\"", entity.kind), self.report);
        Some(node)
    }

    /// `"value"`: never a texture.
    fn constant(&mut self, p: &Params, kind: TextureKind) -> TextureInput {
        self.texture_constant(p, "value", kind, 1.0)
    }

    fn texture_constant(
        &mut self,
        p: &Params,
        name: &'static str,
        kind: TextureKind,
        default: f32,
    ) -> TextureInput {
        match kind {
            TextureKind::Float => TextureInput::Float(p.float(name, default, self.report)),
            TextureKind::Spectrum => {
                let spectrum = self.spectrum(p, name, super::spectra::Role::Unbounded);
                TextureInput::Spectrum(spectrum.unwrap_or(SpectrumDesc::Constant(default)))
            }
        }
    }

    fn direction_mix(&mut self, entity: &Entity, kind: TextureKind) -> TextureNode {
        let p = &entity.params;
        let dir = p.vec3("dir", Type::Vector3, Vec3::Y, self.report);
        let at = p.span_of("dir").unwrap_or(entity.span);
        if dir == Vec3::ZERO {
            self.report.error(at, "\"dir\" is zero").hint("it must have a direction");
        }
        let world_from_texture = self.fixed(&entity.ctm, "a texture", entity.span).start();
        TextureNode::DirectionMix {
            a: self.texture_input(p, "tex1", kind, 0.0),
            b: self.texture_input(p, "tex2", kind, 1.0),
            dir: Dir::normalize(world_from_texture.vector(dir)).0,
        }
    }

    /// Ours, not pbrt's: three textures, each seen along an axis of the texture's space.
    fn triplanar(&mut self, entity: &Entity, kind: TextureKind) -> TextureNode {
        let p = &entity.params;
        let planes = ["x", "y", "z"].map(|axis| self.texture_input(p, axis, kind, 1.0));
        let sharpness = p.float("sharpness", 4.0, self.report);
        TextureNode::Triplanar { planes, sharpness, texture_from_world: self.texture_from_world(entity) }
    }

    fn checkerboard(&mut self, entity: &Entity, kind: TextureKind) -> Option<TextureNode> {
        let p = &entity.params;
        let dimension = p.integer_opt("dimension", self.report).unwrap_or((2, entity.span));
        let a = self.texture_input(p, "tex1", kind, 1.0);
        let b = self.texture_input(p, "tex2", kind, 0.0);
        let (mapping, texture_from_world) = match dimension {
            (2, _) => (Some(self.mapping(entity)), Transform::IDENTITY),
            (3, _) => (None, self.texture_from_world(entity)),
            (n, span) => {
                return self.refuse(
                    span,
                    format!("a checkerboard of {n} dimensions"),
                    "possible are 2 and 3",
                );
            }
        };
        Some(TextureNode::Checkerboard { a, b, mapping, texture_from_world })
    }

    fn noise(&mut self, entity: &Entity, kind: TextureKind) -> Option<TextureNode> {
        let p = &entity.params;
        let texture_from_world = self.texture_from_world(entity);
        if entity.kind == "windy" {
            return Some(TextureNode::Windy { texture_from_world });
        }
        if entity.kind == "marble" && kind == TextureKind::Float {
            let hint = "declare it as a \"spectrum\" texture";
            return self.refuse(entity.span, "\"marble\" gives spectra, not numbers", hint);
        }
        let octaves = p.count("octaves", 8, 0..=i32::MAX as u32, self.report).min(MOST_OCTAVES);
        let roughness = p.float("roughness", 0.5, self.report);
        Some(match entity.kind.as_str() {
            "fbm" => TextureNode::Fbm { octaves, roughness, texture_from_world },
            "wrinkled" => TextureNode::Wrinkled { octaves, roughness, texture_from_world },
            _ => TextureNode::Marble {
                octaves,
                roughness,
                scale: p.float("scale", 1.0, self.report),
                variation: p.float("variation", 0.2, self.report),
                texture_from_world,
            },
        })
    }

    fn image_map(&mut self, entity: &Entity) -> Option<TextureNode> {
        let p = &entity.params;
        if let Some(span) = p.span_of("trilinear") {
            let now = "\"string filter\" \"trilinear\"";
            super::parser::old_syntax(self.report, span, "\"bool trilinear\"", now);
            return None;
        }
        let mapping = self.mapping(entity);
        let filter = self.word(
            p,
            "filter",
            ImageFilter::Bilinear,
            &[
                ("point", ImageFilter::Point),
                ("bilinear", ImageFilter::Bilinear),
                ("trilinear", ImageFilter::Trilinear),
                ("ewa", ImageFilter::Ewa),
                ("EWA", ImageFilter::Ewa),
            ],
        );
        let wrap = self.word(
            p,
            "wrap",
            WrapMode::Repeat,
            &[
                ("repeat", WrapMode::Repeat),
                ("black", WrapMode::Black),
                ("clamp", WrapMode::Clamp),
                ("octahedralsphere", WrapMode::Mirror),
            ],
        );
        if wrap == WrapMode::Mirror {
            let at = p.span_of("wrap").unwrap_or(entity.span);
            self.report
                .warning(at, "wrap \"octahedralsphere\" is not supported")
                .hint("the image is mirrored beyond its borders");
        }
        let max_anisotropy = p.float("maxanisotropy", 8.0, self.report);
        let scale = p.float("scale", 1.0, self.report);
        let invert = p.boolean("invert", false, self.report);
        let encoding = self.encoding(p);
        let Some((file, span)) = p.string_opt("filename", self.report) else {
            let hint = "add \"string filename\" \"…\"";
            return self.refuse(entity.span, "texture \"imagemap\" has no \"filename\"", hint);
        };
        let (image, tiles) = self.images_of(&file, span, encoding)?;
        Some(TextureNode::ImageMap {
            image,
            tiles,
            mapping,
            wrap: [wrap; 2],
            filter,
            max_anisotropy,
            scale,
            invert,
        })
    }

    /// One of several words.
    fn word<T: Copy>(&mut self, p: &Params, name: &'static str, default: T, words: &[(&str, T)]) -> T {
        let Some((given, span)) = p.string_opt(name, self.report) else { return default };
        if let Some((_, value)) = words.iter().find(|w| w.0 == given) {
            return *value;
        }
        let names: Vec<_> = words.iter().map(|w| w.0).collect();
        let hint = suggest::hint(&given, &names);
        self.report.error(span, format!("unknown {name} \"{given}\"")).hint(hint);
        default
    }

    fn encoding(&mut self, p: &Params) -> ImageEncoding {
        let Some((given, span)) = p.string_opt("encoding", self.report) else { return ImageEncoding::Auto };
        match given.split_ascii_whitespace().collect::<Vec<_>>().as_slice() {
            ["linear"] => ImageEncoding::Linear,
            ["sRGB"] => ImageEncoding::Srgb,
            ["gamma", g] if g.parse::<f32>().is_ok_and(|g| g > 0.0 && g.is_finite()) => {
                ImageEncoding::Gamma(g.parse().unwrap_or(2.2))
            }
            _ => {
                self.report
                    .error(span, format!("unknown encoding \"{given}\""))
                    .hint("possible are \"sRGB\", \"linear\" and \"gamma 2.2\"");
                ImageEncoding::Auto
            }
        }
    }

    fn texture_from_world(&mut self, entity: &Entity) -> Transform {
        self.fixed(&entity.ctm, "a texture", entity.span).start().inverse()
    }

    fn mapping(&mut self, entity: &Entity) -> Mapping2d {
        let p = &entity.params;
        let (name, span) = p.string_opt("mapping", self.report).unwrap_or(("uv".into(), entity.span));
        let mut number = |name, default| p.float(name, default, self.report);
        match name.as_str() {
            "uv" => Mapping2d::Uv {
                scale: [number("uscale", 1.0), number("vscale", 1.0)],
                shift: [number("udelta", 0.0), number("vdelta", 0.0)],
            },
            "spherical" => Mapping2d::Spherical(self.texture_from_world(entity)),
            "cylindrical" => Mapping2d::Cylindrical(self.texture_from_world(entity)),
            "planar" => Mapping2d::Planar {
                shift: [number("udelta", 0.0), number("vdelta", 0.0)],
                vs: p.vec3("v1", Type::Vector3, Vec3::X, self.report),
                vt: p.vec3("v2", Type::Vector3, Vec3::Y, self.report),
                texture_from_world: self.texture_from_world(entity),
            },
            _ => self.unknown_mapping(&name, span),
        }
    }

    fn unknown_mapping(&mut self, name: &str, span: Span) -> Mapping2d {
        let hint = suggest::hint(name, &["uv", "spherical", "cylindrical", "planar"]);
        self.report.error(span, format!("unknown mapping \"{name}\"")).hint(hint);
        Mapping2d::default()
    }
}
