//! Lights.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use math::{AnimatedTransform, Vec3};

use crate::{ImageId, MediumId, Span, SpectrumDesc, SphericalMapping};

/// An emission spectrum with its size.
///
/// As in pbrt-v4 the spectrum is normalised to a luminance integral of one (an RGB value keeps its own size; the
/// illuminant of its colour space is what is normalised), then scaled.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Illuminant {
    /// Its shape.
    pub spectrum: SpectrumDesc,
    /// Factor after normalisation.
    pub scale: f32,
    /// Is the spectrum normalised first? pbrt does; formats whose numbers are absolute do not.
    pub normalize: bool,
}

/// A light that is not a surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LightDesc {
    /// What it is.
    pub kind: LightKind,
    /// Where it is and how it is turned.
    pub world_from_light: AnimatedTransform,
    /// The medium around it.
    pub medium: Option<MediumId>,
    /// Where it was written.
    #[serde(skip)]
    pub span: Span,
}

/// The kinds of light. Positions and directions are in light space; `power` is the total emitted power that
/// replaces the scale, as pbrt defines it for each kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LightKind {
    /// From one point, evenly.
    Point {
        /// Radiant intensity.
        intensity: Illuminant,
        /// Where.
        #[schemars(with = "[f32; 3]")]
        from: Vec3,
        /// Total power instead of intensity.
        power: Option<f32>,
    },
    /// From one point, in a cone.
    Spot {
        /// Radiant intensity on the axis.
        intensity: Illuminant,
        /// Where.
        #[schemars(with = "[f32; 3]")]
        from: Vec3,
        /// What its axis passes through.
        #[schemars(with = "[f32; 3]")]
        to: Vec3,
        /// Half angle of the cone, in degrees.
        cone_angle: f32,
        /// Width of the falloff inside the cone, in degrees.
        cone_delta: f32,
        /// How it falls.
        falloff: SpotFalloff,
        /// Total power instead of intensity.
        power: Option<f32>,
    },
    /// Parallel light from infinity.
    Distant {
        /// Irradiance on a surface facing it.
        radiance: Illuminant,
        /// Where it comes from.
        #[schemars(with = "[f32; 3]")]
        from: Vec3,
        /// What it shines on.
        #[schemars(with = "[f32; 3]")]
        to: Vec3,
        /// Irradiance instead of the scale (pbrt's `illuminance`).
        illuminance: Option<f32>,
    },
    /// From everywhere, evenly.
    InfiniteConstant {
        /// Radiance.
        radiance: Illuminant,
        /// Illuminance of a horizontal surface instead of the scale.
        illuminance: Option<f32>,
        /// Corners in order, in world space, of a rectangular window through which all of it comes; see
        /// [`LightKind::InfiniteImage`].
        #[schemars(with = "Option<[[f32; 3]; 4]>")]
        portal: Option<[Vec3; 4]>,
    },
    /// From everywhere, by an image.
    InfiniteImage {
        /// Which.
        image: ImageId,
        /// From the image to directions of light space: pbrt's equal-area octahedral map, or longitude and latitude
        /// with z up, φ from +x towards +y along the rows and θ from +z down the columns.
        mapping: SphericalMapping,
        /// Factor on radiance.
        scale: f32,
        /// Illuminance of a horizontal surface instead of the scale.
        illuminance: Option<f32>,
        /// Corners in order, in world space, of a rectangular window through which all of it comes (as in pbrt): from the
        /// side to which `(p₃ − p₀) × (p₁ − p₀)` points. Elsewhere the sky is black.
        #[schemars(with = "Option<[[f32; 3]; 4]>")]
        portal: Option<[Vec3; 4]>,
    },
    /// A point light with an image of its directions (equal-area).
    Goniometric {
        /// Radiant intensity.
        intensity: Illuminant,
        /// Directions' factor.
        image: Option<ImageId>,
        /// Total power instead of intensity.
        power: Option<f32>,
    },
    /// A lamp as it was measured: a point light with the intensities of a photometric file (IES LM-63, photometry of
    /// type C). Straight down is −y; horizontal angles run from +x towards +z.
    Ies {
        /// The file.
        path: std::path::PathBuf,
        /// Factor on the file's candela.
        intensity: Illuminant,
        /// Total power instead of what the file says.
        power: Option<f32>,
    },
    /// A slide projector.
    Projection {
        /// The slide.
        image: ImageId,
        /// Full field of view in degrees, along what `throw` says.
        fov: f32,
        /// How the slide is thrown.
        throw: Throw,
        /// Factor on intensity.
        scale: f32,
        /// Total power instead of intensity.
        power: Option<f32>,
    },
}

/// How a spot falls from full to no intensity across the border of its cone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum SpotFalloff {
    /// A smoothstep of the cosine, as in pbrt.
    #[default]
    Smooth,
    /// Linear in the angle, as in Mitsuba.
    Linear,
}

/// How a slide is thrown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum Throw {
    /// The shorter side spans the field of view; intensity is the slide's value (pbrt). Pixels have sharp borders.
    #[default]
    Intensity,
    /// The slide's value is the irradiance on the plane at distance one, over π: intensity grows by `1 / cos³ θ`
    /// (Mitsuba's projector). Interpolated.
    Irradiance {
        /// What the field of view spans.
        axis: FovAxis,
    },
    /// The slide, whatever its sides, fills the square around a cone; intensity falls linearly in the angle at the cone's
    /// border (Mitsuba's textured spot). Interpolated; the field of view is not used.
    Cone {
        /// Half angle of the cone, in degrees.
        cone_angle: f32,
        /// Width of the falloff inside the cone, in degrees.
        cone_delta: f32,
    },
}

/// Along what a field of view is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum FovAxis {
    /// The width.
    #[default]
    X,
    /// The height.
    Y,
    /// From corner to corner.
    Diagonal,
    /// The shorter side.
    Smaller,
    /// The longer side.
    Larger,
}

/// A surface that emits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AreaLightDesc {
    /// Emitted radiance.
    pub radiance: Illuminant,
    /// Radiance over the surface's (u, v), instead of the spectrum; an image with RGB.
    pub image: Option<ImageId>,
    /// From both sides?
    pub two_sided: bool,
    /// Total power instead of radiance.
    pub power: Option<f32>,
    /// Where it was written.
    #[serde(skip)]
    pub span: Span,
}
