//! What cameras give: rays, and the ways back to them.

use math::{Dir, Point, Ray};
use sampling::{Pdf, SolidAngle};

/// A ray from the camera.
#[derive(Clone, Copy, Debug)]
pub struct CameraRay {
    /// In world space, from the lens.
    pub ray: Ray,
    /// What the radiance that comes along it counts; 1 but for stacks of lenses.
    pub weight: f32,
}

/// A ray that arrives at the lens from the scene.
#[derive(Clone, Copy, Debug)]
pub struct LensHit {
    /// Where on the lens.
    pub p: Point,
    /// Distance along the ray.
    pub t: f32,
    /// The camera's forward direction.
    pub n: Dir,
    /// Where on the film it falls.
    pub raster: [f32; 2],
    /// Importance `We`.
    pub we: f32,
}

/// A connection from a point in the scene to the camera.
///
/// What a light path with throughput `beta` that arrives at the point adds to the film is
/// `beta · f(wo, wi) · |cos θ| · weight · visibility` (in a medium without the cosine), at `raster`,
/// and counts [`super::Camera::n_pixels`] times in the pixel's value.
#[derive(Clone, Copy, Debug)]
pub struct CameraConnection {
    /// Towards the camera, from the point.
    pub wi: Dir,
    /// Where the connection ends: on the lens, or on the film plane of an orthographic camera.
    pub p_lens: Point,
    /// The camera's forward direction; `None` for a spherical camera, which has no film plane.
    pub n_lens: Option<Dir>,
    /// Where on the film it falls.
    pub raster: [f32; 2],
    /// Importance `We` of the ray from `p_lens` to the point.
    pub we: f32,
    /// The estimator's factor: `We |cos θ_lens| / (r² p_A)`; 1 / (film area) for parallel projection.
    pub weight: f32,
    /// Density of `wi` as seen from the point; `None` where lens position or direction is a delta.
    pub pdf: Option<Pdf<SolidAngle>>,
    /// Is the lens a single point?
    pub is_delta_position: bool,
    /// Do all rays leave in one direction?
    pub is_delta_direction: bool,
}
