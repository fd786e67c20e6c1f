//! Values that vary over surfaces.

use std::path::PathBuf;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use math::{Transform, Vec2, Vec3};

use crate::{ColorSpaceName, ImageId, Span, SpectrumDesc, TextureId};

/// A number, or a texture of numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FloatInput {
    /// The same everywhere.
    Constant(f32),
    /// Looked up.
    Texture(TextureId),
}

/// A spectrum, or a texture of spectra.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SpectrumInput {
    /// The same everywhere.
    Constant(SpectrumDesc),
    /// Looked up.
    Texture(TextureId),
}

impl From<f32> for FloatInput {
    fn from(x: f32) -> Self {
        Self::Constant(x)
    }
}

impl From<SpectrumDesc> for SpectrumInput {
    fn from(x: SpectrumDesc) -> Self {
        Self::Constant(x)
    }
}

/// What a texture gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TextureKind {
    /// Numbers.
    Float,
    /// Spectra; where it is used says whether as albedo, unbounded or illuminant.
    Spectrum,
}

/// An operand of a texture: of the texture's own kind, unless said otherwise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TextureInput {
    /// A number (in a spectrum texture: that number at every wavelength).
    Float(f32),
    /// A spectrum.
    Spectrum(SpectrumDesc),
    /// Another texture, made earlier.
    Texture(TextureId),
}

/// A texture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TextureDesc {
    /// As the file names it; empty for one made on the way.
    pub name: String,
    /// What it gives.
    pub kind: TextureKind,
    /// How.
    pub node: TextureNode,
    /// Where it was written.
    #[serde(skip)]
    pub span: Span,
}

/// How a texture makes its value.
#[allow(
    clippy::large_enum_variant,
    reason = "textures are few, and plain data is easier to make without boxes"
)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TextureNode {
    /// The same everywhere.
    Constant(TextureInput),
    /// `tex × scale`; `scale` is a number or a float texture.
    Scale {
        /// The factor of the texture's kind.
        tex: TextureInput,
        /// The other factor, a number.
        scale: FloatInput,
    },
    /// `a × b`, both of the texture's kind.
    Product {
        /// A factor.
        a: TextureInput,
        /// The other.
        b: TextureInput,
    },
    /// One where a number is at least `edge`, zero where it is not. Of numbers alone.
    Step {
        /// The number.
        tex: TextureInput,
        /// From here on it is one.
        edge: f32,
    },
    /// Values that the mesh carries ([`crate::MeshAttribute`]); zero on a surface without them.
    Attribute {
        /// Their name.
        name: String,
        /// Factor on them.
        scale: f32,
    },
    /// `(1 − amount) a + amount b`.
    Mix {
        /// At amount 0.
        a: TextureInput,
        /// At amount 1.
        b: TextureInput,
        /// The weight of `b`.
        amount: FloatInput,
    },
    /// `|n · dir| a + (1 − |n · dir|) b`, with `dir` in world space [pbrt-v4].
    DirectionMix {
        /// Facing `dir`.
        a: TextureInput,
        /// Across `dir`.
        b: TextureInput,
        /// Unit direction in world space.
        #[schemars(with = "[f32; 3]")]
        dir: Vec3,
    },
    /// Squares or cubes.
    Checkerboard {
        /// Even squares.
        a: TextureInput,
        /// Odd squares.
        b: TextureInput,
        /// Two-dimensional, or `None` for cubes in texture space.
        mapping: Option<Mapping2d>,
        /// For cubes.
        texture_from_world: Transform,
    },
    /// Bilinear between four corners.
    Bilerp {
        /// At (0,0), (0,1), (1,0), (1,1).
        corners: [TextureInput; 4],
        /// Of the surface.
        mapping: Mapping2d,
    },
    /// Dots at random places.
    Dots {
        /// In a dot.
        inside: TextureInput,
        /// Around it.
        outside: TextureInput,
        /// Of the surface.
        mapping: Mapping2d,
    },
    /// Fractional Brownian motion.
    Fbm {
        /// Number of octaves.
        octaves: u32,
        /// Falloff of the octaves ("omega").
        roughness: f32,
        /// To noise space.
        texture_from_world: Transform,
    },
    /// Turbulence: sum of absolute values of noise.
    Wrinkled {
        /// Number of octaves.
        octaves: u32,
        /// Falloff of the octaves.
        roughness: f32,
        /// To noise space.
        texture_from_world: Transform,
    },
    /// Waves under a varying wind.
    Windy {
        /// To noise space.
        texture_from_world: Transform,
    },
    /// Coloured veins.
    Marble {
        /// Number of octaves.
        octaves: u32,
        /// Falloff of the octaves.
        roughness: f32,
        /// Frequency of the noise.
        scale: f32,
        /// How much the noise moves the veins.
        variation: f32,
        /// To noise space.
        texture_from_world: Transform,
    },
    /// Three textures, each seen along an axis of texture space, blended by where the surface faces.
    Triplanar {
        /// Along x, y and z; their (u, v) are (y, z), (z, x) and (x, y).
        planes: [TextureInput; 3],
        /// Each counts by the cosine between the normal and its axis, to this power.
        sharpness: f32,
        /// To texture space.
        texture_from_world: Transform,
    },
    /// Points of a grid, trilinear in between: of the unit cube of texture space, each at the centre of its cell.
    Volume {
        /// Points along x, y and z; their product is the number of values.
        resolution: [u32; 3],
        /// Linear R, G, B, x fastest.
        values: Arc<[[f32; 3]]>,
        /// Beyond the cube: [`WrapMode::Black`] is zero.
        wrap: WrapMode,
        /// To texture space.
        texture_from_world: Transform,
    },
    /// An image file.
    ImageMap {
        /// Which; the first of them, if there are tiles.
        image: ImageId,
        /// Images side by side (UDIM): (s, t) falls into one of them; `wrap` does not count, and there is black in between.
        /// Empty for one image.
        #[serde(default)]
        tiles: Vec<ImageTile>,
        /// Of the surface; v runs upwards, as in pbrt.
        mapping: Mapping2d,
        /// Beyond the borders, along s and along t.
        wrap: [WrapMode; 2],
        /// Between and below pixels.
        filter: ImageFilter,
        /// Largest anisotropy of EWA.
        max_anisotropy: f32,
        /// Factor on the value.
        scale: f32,
        /// `1 − value` (after the factor, as in pbrt-v4)?
        invert: bool,
    },
}

/// A square of a set of images.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct ImageTile {
    /// Its lower left corner in (s, t).
    pub at: [u32; 2],
    /// What is on it.
    pub image: ImageId,
}

/// An image file, held once however many textures use it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ImageDesc {
    /// Where it is.
    pub path: PathBuf,
    /// How its numbers are to be read.
    pub encoding: ImageEncoding,
    /// In which primaries, where the file does not say.
    pub space: ColorSpaceName,
    /// The only channel that is used, from 0; one that the image does not have is one everywhere. `None`: all of them.
    pub channel: Option<u8>,
    /// The bytes of the file, if it is part of another; `path` is then only its name.
    pub embedded: Option<Arc<[u8]>>,
    /// Who first asked for it.
    #[serde(skip)]
    pub span: Span,
}

/// How an image's numbers become linear ones.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ImageEncoding {
    /// sRGB for integers, linear for floating point.
    #[default]
    Auto,
    /// sRGB curve.
    Srgb,
    /// As they are.
    Linear,
    /// `x^γ`.
    Gamma(f32),
}

/// What lies beyond an image's border.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum WrapMode {
    /// The image again.
    #[default]
    Repeat,
    /// The image mirrored.
    Mirror,
    /// The border's value.
    Clamp,
    /// Black.
    Black,
}

/// How an image is looked up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ImageFilter {
    /// Nearest pixel.
    Point,
    /// Bilinear at full resolution.
    #[default]
    Bilinear,
    /// Bilinear at two levels of the pyramid.
    Trilinear,
    /// Elliptically weighted average.
    Ewa,
}

/// From a surface point to (s, t).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Mapping2d {
    /// The surface's own u, v: `s = su u + du`.
    Uv {
        /// Scale of u and v.
        scale: [f32; 2],
        /// Shift of u and v.
        shift: [f32; 2],
    },
    /// The surface's own u, v, turned and sheared as well: `(s, t) = u · u + v · v + shift`.
    Affine {
        /// What u adds.
        #[schemars(with = "[f32; 2]")]
        u: Vec2,
        /// What v adds.
        #[schemars(with = "[f32; 2]")]
        v: Vec2,
        /// Shift of s and t.
        #[schemars(with = "[f32; 2]")]
        shift: Vec2,
    },
    /// Coordinates that the mesh carries under a name ([`crate::MeshAttribute`] of two channels), turned and shifted as in
    /// [`Mapping2d::Affine`]. Images are not filtered over a pixel there.
    Attribute {
        /// Their name.
        name: String,
        /// What the first coordinate adds.
        #[schemars(with = "[f32; 2]")]
        u: Vec2,
        /// What the second adds.
        #[schemars(with = "[f32; 2]")]
        v: Vec2,
        /// Shift of s and t.
        #[schemars(with = "[f32; 2]")]
        shift: Vec2,
    },
    /// Angles of a sphere around the texture's origin.
    Spherical(Transform),
    /// Angle and height around the texture's z axis.
    Cylindrical(Transform),
    /// Projection on two axes.
    Planar {
        /// To texture space.
        texture_from_world: Transform,
        /// Axis of s.
        #[schemars(with = "[f32; 3]")]
        vs: Vec3,
        /// Axis of t.
        #[schemars(with = "[f32; 3]")]
        vt: Vec3,
        /// Shift of s and t.
        shift: [f32; 2],
    },
}

impl Default for Mapping2d {
    fn default() -> Self {
        Self::Uv { scale: [1.0; 2], shift: [0.0; 2] }
    }
}
