//! Compiled textures and their values at a point.
//!
//! A texture that is the same everywhere is no texture: its handle holds the value. Formulas and the order of
//! factor, inversion and limits are pbrt-v4's ([PBR4e], ch. 10).
//! Departs from pbrt-v4: point and bilinear lookups of images ignore the footprint (see `pyramid`).

use std::ops::{Add, Mul};

use math::{Vec2, Vec3};
use scene_desc::{ImageFilter, ImageId, ImageTile, WrapMode};
use spectrum::{ColorPipeline, ColorSpace, Spectrum, SpectrumValue, Wavelengths};

use super::attributes::{AttributeId, Attributes};
use super::images::Images;
use super::mapping::{Coord2, Mapping, Mapping3};
use super::noise::{Octaves, fbm, turbulence};
use super::pattern::{Marble, checkerboard_2d, checkerboard_3d, inside_dot, marble};
use super::space::{Triplanar, Volume};
use super::spectra::SpectrumRole;
use super::texture_image::{Texel, TextureImage};
use crate::{TextureContext, TextureId};

/// A number, or where to look it up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FloatHandle {
    /// The same everywhere.
    Constant(f32),
    /// A texture of numbers.
    Texture(TextureId),
}

/// A spectrum, or where to look it up.
#[derive(Clone, Debug, PartialEq)]
pub enum SpectrumHandle {
    /// The same everywhere.
    Constant(SpectrumValue),
    /// A texture of spectra.
    Texture(TextureId),
}

/// All textures of a scene, and the images that they and lights look up.
#[derive(Clone, Debug)]
pub struct Textures {
    pub(super) floats: Vec<FloatNode>,
    pub(super) spectra: Vec<SpectrumNode>,
    pub(super) images: Images,
    pub(super) attributes: Attributes,
    pub(super) colors: ColorPipeline,
}

/// A texture of numbers.
#[derive(Clone, Debug)]
pub(super) enum FloatNode {
    /// Made of others.
    Combine(Combine<FloatHandle>),
    /// Noise.
    Noise(Noise),
    /// An image.
    Image(ImageLookup),
    /// One from an edge on, zero below.
    Step { tex: FloatHandle, edge: f32 },
    /// What the mesh carries.
    Attribute { id: AttributeId, scale: f32 },
    /// A grid, of which the mean of the channels counts.
    Volume(Volume),
    /// Seen along three axes.
    Triplanar(Triplanar<FloatHandle>),
}

/// A texture of spectra.
#[derive(Clone, Debug)]
pub(super) enum SpectrumNode {
    /// Made of others.
    Combine(Combine<SpectrumHandle>),
    /// A number, the same in all lanes.
    Grey(FloatHandle),
    /// Coloured veins.
    Marble(Marble, Mapping3),
    /// An image.
    Image(ImageLookup, SpectrumRole),
    /// What the mesh carries.
    Attribute { id: AttributeId, scale: f32, role: SpectrumRole },
    /// A grid.
    Volume(Volume, SpectrumRole),
    /// Seen along three axes.
    Triplanar(Triplanar<SpectrumHandle>),
}

/// A texture made of others, of numbers or of spectra alike.
#[derive(Clone, Debug)]
pub(super) enum Combine<H> {
    /// A product.
    Scale { tex: H, scale: FloatHandle },
    /// The same of two alike.
    Product { a: H, b: H },
    /// `(1 − amount) a + amount b`.
    Mix { a: H, b: H, amount: FloatHandle },
    /// `|n · dir| a + (1 − |n · dir|) b`.
    DirectionMix { a: H, b: H, dir: Vec3 },
    /// Squares.
    Checkerboard { a: H, b: H, mapping: Mapping },
    /// Cubes.
    Cubes { a: H, b: H, mapping: Mapping3 },
    /// Values at (s, t) = (0,0), (0,1), (1,0), (1,1).
    Bilerp { corners: Box<[H; 4]>, mapping: Mapping },
    /// Dots.
    Dots { inside: H, outside: H, mapping: Mapping },
}

/// Textures of noise alone.
#[derive(Clone, Debug)]
pub(super) struct Noise {
    pub(super) kind: NoiseKind,
    pub(super) octaves: u32,
    pub(super) omega: f32,
    pub(super) mapping: Mapping3,
}

/// Their kinds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NoiseKind {
    /// Fractional Brownian motion.
    Fbm,
    /// Turbulence.
    Wrinkled,
    /// Waves.
    Windy,
}

/// How an image is looked up.
#[derive(Clone, Debug)]
pub(super) struct ImageLookup {
    pub(super) image: ImageId,
    /// Images on squares of the plane, in order of their corners; `image` alone if there are none.
    pub(super) tiles: Vec<ImageTile>,
    pub(super) mapping: Mapping,
    pub(super) wrap: [WrapMode; 2],
    pub(super) filter: ImageFilter,
    pub(super) max_anisotropy: f32,
    pub(super) scale: f32,
    pub(super) invert: bool,
}

impl Textures {
    /// No textures: enough for handles of constants.
    #[must_use]
    pub fn none(colors: ColorPipeline) -> Self {
        Self {
            floats: Vec::new(),
            spectra: Vec::new(),
            images: Images::default(),
            attributes: Attributes::default(),
            colors,
        }
    }

    /// The value of a number at a point.
    #[inline]
    #[must_use]
    pub fn float(&self, handle: &FloatHandle, ctx: &TextureContext) -> f32 {
        match handle {
            FloatHandle::Constant(c) => *c,
            FloatHandle::Texture(id) => self.eval_float(*id, ctx),
        }
    }

    /// The value of a spectrum at a point, at a path's lanes. Albedos are not limited here: `Scale` may exceed one.
    #[inline]
    #[must_use]
    pub fn spectrum(&self, handle: &SpectrumHandle, ctx: &TextureContext, wl: &Wavelengths) -> Spectrum {
        match handle {
            SpectrumHandle::Constant(value) => value.eval(wl),
            SpectrumHandle::Texture(id) => self.eval_spectrum(*id, ctx, wl),
        }
    }

    /// The chance that a surface is there at all (cut-outs), at its (u, v).
    #[inline]
    #[must_use]
    pub fn alpha(&self, handle: &FloatHandle, ctx: &TextureContext) -> f32 {
        self.float(handle, ctx).clamp(0.0, 1.0)
    }

    /// Where a mapping takes a point.
    pub(crate) fn coordinates(&self, mapping: &Mapping, ctx: &TextureContext) -> Vec2 {
        mapping.map(ctx, &self.attributes).st
    }

    /// The decoded images, by the description's ids.
    #[must_use]
    pub fn images(&self) -> &Images {
        &self.images
    }

    /// The decoded images alone.
    pub(crate) fn into_images(self) -> Images {
        self.images
    }

    /// How colours become lanes.
    #[must_use]
    pub fn colors(&self) -> ColorPipeline {
        self.colors
    }

    /// Bytes that textures and images take.
    #[must_use]
    pub fn memory(&self) -> usize {
        self.images.memory()
            + self.attributes.memory()
            + self.floats.len() * size_of::<FloatNode>()
            + self.spectra.len() * size_of::<SpectrumNode>()
    }

    fn eval_float(&self, id: TextureId, ctx: &TextureContext) -> f32 {
        match &self.floats[id.index()] {
            FloatNode::Combine(c) => {
                c.eval((ctx, &self.attributes), |h| self.float(h, ctx), |h| self.float(h, ctx))
            }
            FloatNode::Noise(n) => n.eval(ctx),
            FloatNode::Image(lookup) => {
                let st = lookup.mapping.map(ctx, &self.attributes);
                let Some((image, st)) = lookup.tile(st) else { return 0.0 };
                let value = lookup.scale * lookup.filtered::<f32>(self.images.get(image), st);
                if lookup.invert { (1.0 - value).max(0.0) } else { value }
            }
            FloatNode::Step { tex, edge } => {
                if self.float(tex, ctx) >= *edge {
                    1.0
                } else {
                    0.0
                }
            }
            FloatNode::Attribute { id, scale } => scale * self.attributes.number(*id, &ctx.place),
            FloatNode::Volume(volume) => volume.at(ctx).element_sum() * (1.0 / 3.0),
            FloatNode::Triplanar(t) => t.eval(ctx, |h, ctx| self.float(h, ctx)).unwrap_or(0.0),
        }
    }

    fn eval_spectrum(&self, id: TextureId, ctx: &TextureContext, wl: &Wavelengths) -> Spectrum {
        match &self.spectra[id.index()] {
            SpectrumNode::Combine(c) => {
                c.eval((ctx, &self.attributes), |h| self.float(h, ctx), |h| self.spectrum(h, ctx, wl))
            }
            SpectrumNode::Grey(h) => Spectrum::splat(self.float(h, ctx)),
            SpectrumNode::Marble(m, mapping) => {
                self.colors.texel_albedo(ColorSpace::Srgb, marble(m, &mapping.map(ctx)), wl)
            }
            SpectrumNode::Image(lookup, role) => {
                let st = lookup.mapping.map(ctx, &self.attributes);
                let Some((image, st)) = lookup.tile(st) else { return Spectrum::ZERO };
                let image = self.images.get(image);
                let rgb = lookup.scale * lookup.filtered::<Vec3>(image, st);
                let rgb = if lookup.invert { 1.0 - rgb } else { rgb }.max(Vec3::ZERO).to_array();
                self.texel(*role, image.color_space(), rgb, wl)
            }
            SpectrumNode::Attribute { id, scale, role } => {
                let rgb = self.attributes.at(*id, &ctx.place).map(|c| (c * scale).max(0.0));
                self.texel(*role, ColorSpace::Srgb, rgb, wl)
            }
            SpectrumNode::Volume(volume, role) => {
                self.texel(*role, ColorSpace::Srgb, volume.at(ctx).max(Vec3::ZERO).to_array(), wl)
            }
            SpectrumNode::Triplanar(t) => {
                t.eval(ctx, |h, ctx| self.spectrum(h, ctx, wl)).unwrap_or(Spectrum::ZERO)
            }
        }
    }

    fn texel(&self, role: SpectrumRole, space: ColorSpace, rgb: [f32; 3], wl: &Wavelengths) -> Spectrum {
        match role {
            SpectrumRole::Albedo => self.colors.texel_albedo(space, rgb, wl),
            SpectrumRole::Unbounded => self.colors.texel_unbounded(space, rgb, wl),
            SpectrumRole::Illuminant => self.colors.texel_illuminant(space, rgb, wl),
        }
    }
}

impl<H> Combine<H> {
    /// The value at a point; operands that do not count are not looked up.
    fn eval<V>(
        &self,
        (ctx, attributes): (&TextureContext, &Attributes),
        float: impl Fn(&FloatHandle) -> f32,
        value: impl Fn(&H) -> V,
    ) -> V
    where
        V: Copy + Add<Output = V> + Mul<f32, Output = V> + Mul<Output = V>,
    {
        let mix = |a: &H, b: &H, t: f32| match t {
            0.0 => value(a),
            1.0 => value(b),
            t => value(a) * (1.0 - t) + value(b) * t,
        };
        match self {
            Self::Scale { tex, scale } => value(tex) * float(scale),
            Self::Product { a, b } => value(a) * value(b),
            Self::Mix { a, b, amount } => mix(a, b, float(amount)),
            Self::DirectionMix { a, b, dir } => mix(b, a, ctx.n.0.dot(*dir).abs()),
            Self::Checkerboard { a, b, mapping } => mix(a, b, checkerboard_2d(&mapping.map(ctx, attributes))),
            Self::Cubes { a, b, mapping } => mix(a, b, checkerboard_3d(&mapping.map(ctx))),
            Self::Bilerp { corners, mapping } => {
                let Vec2 { x: s, y: t } = mapping.map(ctx, attributes).st;
                let [v00, v01, v10, v11] = &**corners;
                (value(v00) * (1.0 - t) + value(v01) * t) * (1.0 - s)
                    + (value(v10) * (1.0 - t) + value(v11) * t) * s
            }
            Self::Dots { inside, outside, mapping } => {
                if inside_dot(mapping.map(ctx, attributes).st) {
                    value(inside)
                } else {
                    value(outside)
                }
            }
        }
    }
}

impl Combine<FloatHandle> {
    /// The value of a texture of constants, where that is a constant.
    pub(super) fn constant(&self) -> Option<f32> {
        use FloatHandle::Constant;
        match self {
            Self::Scale { tex: Constant(a), scale: Constant(b) } => Some(a * b),
            Self::Mix { a: Constant(a), b: Constant(b), amount: Constant(t) } => Some(a * (1.0 - t) + b * t),
            Self::Product { a: Constant(a), b: Constant(b) } => Some(a * b),
            Self::Scale { .. }
            | Self::Product { .. }
            | Self::Mix { .. }
            | Self::DirectionMix { .. }
            | Self::Checkerboard { .. }
            | Self::Cubes { .. }
            | Self::Bilerp { .. }
            | Self::Dots { .. } => None,
        }
    }
}

impl Noise {
    fn eval(&self, ctx: &TextureContext) -> f32 {
        let c = self.mapping.map(ctx);
        let octaves = |scale: f32, omega: f32, max: u32| Octaves {
            p: c.p * scale,
            footprint: [c.dx * scale, c.dy * scale],
            omega,
            max,
        };
        match self.kind {
            NoiseKind::Fbm => fbm(&octaves(1.0, self.omega, self.octaves)),
            NoiseKind::Wrinkled => turbulence(&octaves(1.0, self.omega, self.octaves)),
            // Gusts of wind over waves ten times finer [PBR3e], sec. 10.6.3.
            NoiseKind::Windy => fbm(&octaves(0.1, 0.5, 3)).abs() * fbm(&octaves(1.0, 0.5, 6)),
        }
    }
}

impl ImageLookup {
    /// The image that a point falls on, and where on it; `None` between tiles.
    fn tile(&self, at: Coord2) -> Option<(ImageId, Coord2)> {
        if self.tiles.is_empty() {
            return Some((self.image, at));
        }
        let corner = at.st.floor();
        let key = [corner.x, corner.y].map(|c| c as i64);
        let found = self.tiles.iter().find(|t| t.at.map(i64::from) == key)?;
        Some((found.image, Coord2 { st: at.st - corner, ..at }))
    }

    /// The image around a point, before factor and inversion.
    fn filtered<T: Texel>(&self, image: &TextureImage, at: Coord2) -> T {
        // t runs upwards, rows run downwards.
        let Coord2 { st, dx, dy } = at;
        let st = Vec2::new(st.x, 1.0 - st.y);
        let d = [Vec2::new(dx.x, -dx.y), Vec2::new(dy.x, -dy.y)];
        match self.filter {
            ImageFilter::Point => image.level_0().nearest(st, self.wrap),
            ImageFilter::Bilinear => image.level_0().bilinear(st, self.wrap),
            ImageFilter::Trilinear => image.trilinear(st, d, self.wrap),
            ImageFilter::Ewa => image.ewa(st, d, self.max_anisotropy, self.wrap),
        }
    }
}
