//! A point on a surface, as integrators, materials, textures and lights see it.

use math::{Dir, Frame, Point, Ray, Vec2, Vec3, error_bound};
use scatter::LobeFlags;

use crate::{LightId, MaterialId, Shading, ShapeId};

/// Where a ray met a surface, in world space.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceInteraction {
    /// The point.
    pub p: Point,
    /// Half-size of the box around `p` in which the true point lies.
    pub p_error: Vec3,
    /// Geometric normal, on the side of the shading normal (so that both agree on outside).
    pub ng: Dir,
    /// Shading frame: interpolated normal and tangent, before bump or normal mapping.
    pub frame: Frame,
    /// Surface coordinates.
    pub uv: Vec2,
    /// Derivative of the point by u.
    pub dpdu: Vec3,
    /// Derivative of the point by v.
    pub dpdv: Vec3,
    /// Derivatives of the shading normal by u and v (not normalised), for bump mapping.
    pub dndu: Vec3,
    /// See `dndu`.
    pub dndv: Vec3,
    /// Back along the ray.
    pub wo: Dir,
    /// The moment.
    pub time: f32,
    /// Distance along the ray.
    pub t: f32,
    /// What was hit.
    pub shape: ShapeId,
    /// Which triangle of it.
    pub primitive: u32,
    /// Where in it: weights of its second and third vertex, or the surface's own parameters.
    pub at: [f32; 2],
    /// Its look.
    pub material: MaterialId,
    /// The light that this surface is, if it emits.
    pub light: Option<LightId>,
}

impl SurfaceInteraction {
    /// A ray that leaves this surface along `w`, safely off it.
    #[must_use]
    pub fn spawn_ray(&self, w: Dir) -> Ray {
        Ray::new(error_bound::offset_ray_origin(self.p, self.p_error, self.ng, w), w, self.time)
    }

    /// What a light needs to know of this point, whatever stands there: see [`crate::Shading::light_context`].
    #[must_use]
    pub fn light_context(&self) -> LightContext {
        LightContext { p: self.p, p_error: self.p_error, ng: Some(self.ng), ns: None, time: self.time }
    }
}

impl Shading {
    /// What a light needs to know of the point, given how it scatters: of light for an opaque surface only what comes from the
    /// side that is looked at counts.
    #[inline]
    #[must_use]
    pub fn light_context(&self, si: &SurfaceInteraction) -> LightContext {
        let ns = self.frame.n.face_forward(si.wo);
        let is_opaque = !self.bsdf.flags().intersects(LobeFlags::TRANSMISSION);
        LightContext { ns: is_opaque.then_some(ns), ..si.light_context() }
    }
}

/// The point that light shall reach: on a surface, or in a medium (then without normals).
#[derive(Clone, Copy, Debug)]
pub struct LightContext {
    /// The point.
    pub p: Point,
    /// Half-size of the box in which the true point lies; zero in a medium.
    pub p_error: Vec3,
    /// Geometric normal.
    pub ng: Option<Dir>,
    /// Shading normal, on the side from which light is of use; `None` where that is both.
    pub ns: Option<Dir>,
    /// The moment.
    pub time: f32,
}

/// How large a pixel is on the surface: what textures are filtered over.
#[derive(Clone, Copy, Debug, Default)]
pub struct Footprint {
    /// Change of the point from one pixel to the next in x and y.
    pub dpdx: Vec3,
    /// See `dpdx`.
    pub dpdy: Vec3,
    /// Change of (u, v) from one pixel to the next in x and y.
    pub duvdx: Vec2,
    /// See `duvdx`.
    pub duvdy: Vec2,
}

impl Footprint {
    /// With (u, v) changing as the point does, by least squares [PBR4e, sec. 10.1.1].
    #[must_use]
    pub fn with_uv(self, dpdu: Vec3, dpdv: Vec3) -> Self {
        let (uu, uv, vv) = (dpdu.dot(dpdu), dpdu.dot(dpdv), dpdv.dot(dpdv));
        let inv = 1.0 / (uu * vv - uv * uv);
        let inv = if inv.is_finite() { inv } else { 0.0 };
        let solve = |d: Vec3| {
            let (bu, bv) = (dpdu.dot(d), dpdv.dot(d));
            let limit = |x: f32| if x.is_finite() { x.clamp(-1e8, 1e8) } else { 0.0 };
            Vec2::new(limit((vv * bu - uv * bv) * inv), limit((uu * bv - uv * bu) * inv))
        };
        Self { duvdx: solve(self.dpdx), duvdy: solve(self.dpdy), ..self }
    }
}

/// What a texture is evaluated at.
#[derive(Clone, Copy, Debug)]
pub struct TextureContext {
    /// The point, in world space.
    pub p: Point,
    /// The geometric normal.
    pub n: Dir,
    /// Surface coordinates.
    pub uv: Vec2,
    /// Area to filter over; all zero for none.
    pub footprint: Footprint,
    /// Where in which shape, for values that meshes carry.
    pub place: Place,
}

/// A point of a shape in its own terms.
#[derive(Clone, Copy, Debug, Default)]
pub struct Place {
    /// Which shape.
    pub shape: u32,
    /// Which triangle of it.
    pub primitive: u32,
    /// Weights of its second and third vertex.
    pub at: [f32; 2],
}
