//! What the eye's light falls on.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{ColorSpaceName, Span};

/// The film.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FilmDesc {
    /// Width and height in pixels.
    pub resolution: [u32; 2],
    /// Pixels that are rendered, x₀, x₁, y₀, y₁ half-open; `None`: all.
    pub pixel_bounds: Option<[u32; 4]>,
    /// Where the file wants its picture.
    pub filename: Option<String>,
    /// How light becomes numbers.
    pub sensor: SensorDesc,
    /// The picture's primaries.
    pub color_space: ColorSpaceName,
    /// Length of the diagonal in mm, for realistic cameras.
    pub diagonal_mm: f32,
    /// Where it was written.
    #[serde(skip)]
    pub span: Span,
}

/// From radiance to pixel values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SensorDesc {
    /// Name of the sensor; `cie1931` is the ideal one.
    pub name: String,
    /// Film speed.
    pub iso: f32,
    /// In seconds.
    pub exposure_time: f32,
    /// Colour temperature of the light that shall look white, in kelvin; `None`: as it is.
    pub white_balance: Option<f32>,
}

impl SensorDesc {
    /// pbrt-v4's imaging ratio: what radiance is multiplied with.
    #[must_use]
    pub fn imaging_ratio(&self) -> f32 {
        self.exposure_time * self.iso / 100.0
    }
}

impl Default for FilmDesc {
    fn default() -> Self {
        Self {
            resolution: [1280, 720],
            pixel_bounds: None,
            filename: None,
            sensor: SensorDesc {
                name: "cie1931".into(),
                iso: 100.0,
                exposure_time: 1.0,
                white_balance: None,
            },
            color_space: ColorSpaceName::Srgb,
            diagonal_mm: 35.0,
            span: Span::NONE,
        }
    }
}

/// Reconstruction filters, radii in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FilterDesc {
    /// Constant.
    Box {
        /// Half widths.
        radius: [f32; 2],
    },
    /// Tent.
    Triangle {
        /// Half widths.
        radius: [f32; 2],
    },
    /// Gaussian, shifted down so that it ends at zero.
    Gaussian {
        /// Half widths.
        radius: [f32; 2],
        /// Standard deviation in pixels.
        sigma: f32,
    },
    /// Mitchell and Netravali's cubic.
    Mitchell {
        /// Half widths.
        radius: [f32; 2],
        /// Their B.
        b: f32,
        /// Their C.
        c: f32,
    },
    /// Lanczos-windowed sinc.
    Sinc {
        /// Half widths.
        radius: [f32; 2],
        /// Cycles of the sinc.
        tau: f32,
    },
}

impl FilterDesc {
    /// How many pixels away from its own a sample may still count.
    #[must_use]
    pub fn reach(&self) -> u32 {
        let [x, y] = match *self {
            Self::Box { radius }
            | Self::Triangle { radius }
            | Self::Gaussian { radius, .. }
            | Self::Mitchell { radius, .. }
            | Self::Sinc { radius, .. } => radius,
        };
        (x.max(y) - 0.5).ceil().max(0.0) as u32
    }
}

impl Default for FilterDesc {
    /// pbrt-v4's default.
    fn default() -> Self {
        Self::Gaussian { radius: [1.5, 1.5], sigma: 0.5 }
    }
}
