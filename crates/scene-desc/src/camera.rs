//! The eye.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use math::{AnimatedTransform, Transform, Vec2};

use crate::Span;

/// A camera.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct CameraDesc {
    /// What it is.
    pub kind: CameraKind,
    /// Where it is. Camera space is left-handed: x right, y up, z forward.
    pub world_from_camera: AnimatedTransform,
    /// When the shutter opens.
    pub shutter_open: f32,
    /// When it closes.
    pub shutter_close: f32,
    /// Extent of the film plane as x₀, x₁, y₀, y₁ before projection; `None`: the shorter side spans −1 to 1.
    pub screen_window: Option<[f32; 4]>,
    /// Width over height; `None`: the film's.
    pub frame_aspect_ratio: Option<f32>,
    /// The medium around it.
    pub medium: Option<crate::MediumId>,
    /// Where it was written.
    #[serde(skip)]
    pub span: Span,
}

/// The kinds of camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CameraKind {
    /// Perspective, with a thin lens if its radius is not zero.
    Perspective {
        /// Field of view of the shorter side, in degrees.
        fov: f32,
        /// Radius of the lens; 0 is a pinhole.
        lens_radius: f32,
        /// Distance of the plane in focus.
        focal_distance: f32,
        /// Shape of the opening.
        aperture: ApertureDesc,
    },
    /// Parallel projection, with a lens if its radius is not zero.
    Orthographic {
        /// Radius of the lens.
        lens_radius: f32,
        /// Distance of the plane in focus.
        focal_distance: f32,
    },
    /// All directions at once.
    Spherical {
        /// From the unit square to directions.
        mapping: SphericalMapping,
    },
}

/// Shape of a lens opening, on the unit disk.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ApertureDesc {
    /// Round.
    #[default]
    Disk,
    /// A polygon's corners in order.
    Polygon(#[schemars(with = "Vec<[f32; 2]>")] Vec<Vec2>),
}

/// Mappings of the sphere of directions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SphericalMapping {
    /// Equal-area octahedral [Clarberg2008], pbrt-v4's default.
    #[default]
    EqualArea,
    /// Longitude and latitude.
    EquiRectangular,
    /// Longitude and latitude of an image whose first and last rows lie on the poles (Mitsuba's); for cameras, which have no
    /// rows, the same as [`SphericalMapping::EquiRectangular`].
    EquiRectangularPoles,
}

impl Default for CameraDesc {
    fn default() -> Self {
        Self {
            kind: CameraKind::Perspective {
                fov: 90.0,
                lens_radius: 0.0,
                focal_distance: 1e6,
                aperture: ApertureDesc::Disk,
            },
            world_from_camera: AnimatedTransform::fixed(Transform::IDENTITY),
            shutter_open: 0.0,
            shutter_close: 1.0,
            screen_window: None,
            frame_aspect_ratio: None,
            medium: None,
            span: Span::NONE,
        }
    }
}
