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
    /// Through a stack of lenses, as photographers have them. Its pixels are irradiances on the film.
    Realistic(LensStackDesc),
    /// All directions at once.
    Spherical {
        /// From the unit square to directions.
        mapping: SphericalMapping,
    },
}

/// Spherical lenses before a film.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LensStackDesc {
    /// From front to rear.
    pub elements: Vec<LensElement>,
    /// Width of the stop's opening, in mm; at most the stop's own counts, and zero is the stop's own.
    pub aperture_diameter: f32,
    /// Distance from the film of the plane in focus, in scene units, which count as metres.
    pub focus_distance: f32,
    /// The film's diagonal, in mm.
    pub diagonal_mm: f32,
    /// Shape of the stop. It changes the blur and not the brightness, as in pbrt.
    #[serde(default)]
    pub aperture: ApertureDesc,
}

/// One interface of a stack of lenses, or its stop.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LensElement {
    /// Radius in mm, positive where the centre lies towards the film; zero for the stop.
    pub curvature: f32,
    /// Distance to the next element, of the last one to the film, in mm.
    pub thickness: f32,
    /// Index of refraction behind it; zero is air.
    pub eta: f32,
    /// Diameter in mm.
    pub aperture: f32,
}

/// Shape of a lens opening, on the unit disk: x right and y up as in camera space.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ApertureDesc {
    /// Round.
    #[default]
    Disk,
    /// A polygon's corners in order.
    Polygon(#[schemars(with = "Vec<[f32; 2]>")] Vec<Vec2>),
    /// Denser in the middle: `exp(−r²) − exp(−1)`, as in pbrt.
    Gaussian,
    /// By the mean of R, G and B of an image over the square around the disk, its top at y = 1.
    Image(std::path::PathBuf),
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

impl ApertureDesc {
    /// An opening of `blades` straight blades; one corner stands `rotation` degrees from straight up, against the clock as
    /// the camera sees it. `None` for fewer than three.
    #[must_use]
    pub fn blades(blades: u32, rotation: f32) -> Option<Self> {
        let corner = |i: u32| {
            let turn = std::f32::consts::TAU * i as f32 / blades as f32;
            let (sin, cos) = math::trig::sin_cos(turn + (90.0 + rotation).to_radians());
            Vec2::new(cos, sin)
        };
        (3..=1024).contains(&blades).then(|| Self::Polygon((0..blades).map(corner).collect()))
    }
}
