//! What lights give when they are sampled: light at a point, and the start of a light path.

use math::{Dir, Point, Ray, Vec2, Vec3};
use sampling::{Area, Pdf, SolidAngle};
use scatter::Density;
use spectrum::Spectrum;

use crate::LightId;

/// Light that may reach a point.
///
/// The estimator of the reflected radiance is `f · li · |cos θ| · visibility`, divided by the density, or by the
/// probability of a delta.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Whose.
    pub light: LightId,
    /// Incident radiance, before visibility. For a light without extent the inverse square is in it.
    pub li: Spectrum,
    /// Towards the light.
    pub wi: Dir,
    /// Where on the light; for light from infinity, a point outside of the scene.
    pub p: Point,
    /// Half-size of the box in which the true point lies.
    pub p_error: Vec3,
    /// Normal of the emitting side there; `-wi` where there is no surface.
    pub n: Dir,
    /// Surface coordinates of an emitting surface.
    pub uv: Vec2,
    /// Density of `wi`, without the choice of the light.
    pub density: Density,
    /// From infinitely far away?
    pub is_infinite: bool,
}

/// A ray that a light emits: the start of a light path.
#[derive(Clone, Copy, Debug)]
pub struct EmissionSample {
    /// Whose.
    pub light: LightId,
    /// Off the light's surface; for light from infinity, from a disk outside of the scene.
    pub ray: Ray,
    /// The point itself. Of light from infinity a point of the ray: what the ray meets before it is not lit.
    pub p: Point,
    /// Half-size of the box in which the true point lies.
    pub p_error: Vec3,
    /// Normal of the light's surface on the side of the ray; `None` for lights without a surface.
    pub n: Option<Dir>,
    /// Emitted radiance; intensity of a light at a point, irradiance of a distant one.
    pub le: Spectrum,
    /// Density of the ray's origin; `None` for a light at a point. For light from infinity, per area of the disk.
    pub pdf_position: Option<Pdf<Area>>,
    /// Density of the ray's direction; `None` for a distant light.
    pub pdf_direction: Option<Pdf<SolidAngle>>,
    /// From infinitely far away?
    pub is_infinite: bool,
    /// On the side of a surface that its outside is on? True where there is no surface.
    pub is_outside: bool,
}

impl EmissionSample {
    /// |cos θ| at the light's surface; 1 where there is none.
    #[must_use]
    pub fn abs_cos(&self) -> f32 {
        self.n.map_or(1.0, |n| n.abs_dot(self.ray.dir))
    }

    /// `le |cos θ| / (p_A p_ω)`: what a light path starts with, still without the probability of the light.
    #[must_use]
    pub fn throughput(&self) -> Spectrum {
        let density = self.pdf_position.map_or(1.0, Pdf::value) * self.pdf_direction.map_or(1.0, Pdf::value);
        self.le * (self.abs_cos() / density)
    }

    /// Can it be drawn, and does it carry anything?
    pub(super) fn is_possible(&self) -> bool {
        self.pdf_position.is_none_or(Pdf::is_positive)
            && self.pdf_direction.is_none_or(Pdf::is_positive)
            && !self.le.is_black()
    }

    /// Is the light a single point?
    #[must_use]
    pub fn is_delta_position(&self) -> bool {
        self.pdf_position.is_none()
    }

    /// Does it shine in a single direction?
    #[must_use]
    pub fn is_delta_direction(&self) -> bool {
        self.pdf_direction.is_none()
    }
}
