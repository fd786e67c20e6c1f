//! Where a path scatters: on a surface, or at a point of a medium.

use math::{Dir, Point, Ray, Vec3};
use scatter::{PhaseFunction, TransportMode};
use scene::{LightContext, MediumId, Scene, Shading, SurfaceInteraction, Surroundings};
use spectrum::Spectrum;

/// A point of a medium at which a path scatters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MediumPoint {
    /// Where.
    pub(crate) p: Point,
    /// Back along the path.
    pub(crate) wo: Dir,
    /// The moment.
    pub(crate) time: f32,
    /// How it scatters.
    pub(crate) phase: PhaseFunction,
    /// Of what.
    pub(crate) medium: MediumId,
    /// Under the surface of a subsurface material: no event of its own, and hidden (see `scene::Media::is_interior`).
    pub(crate) is_interior: bool,
}

impl MediumPoint {
    /// At distance `t` along a ray.
    pub(crate) fn new(scene: &Scene, ray: &Ray, t: f32, medium: MediumId) -> Self {
        Self {
            p: ray.at(t),
            wo: -ray.dir,
            time: ray.time,
            phase: scene.media.phase(medium),
            medium,
            is_interior: scene.media.is_interior(medium),
        }
    }

    pub(crate) fn spawn_ray(&self, w: Dir) -> Ray {
        Ray::new(self.p, w, self.time)
    }

    pub(crate) fn light_context(&self) -> LightContext {
        LightContext { p: self.p, p_error: Vec3::ZERO, ng: None, ns: None, time: self.time }
    }
}

/// A surface or a point of a medium.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "a walk's vertices lie in one vector that is used again")]
pub(crate) enum Site {
    Surface {
        /// Its `wo` leads back along the path.
        si: SurfaceInteraction,
        /// How it scatters.
        shading: Shading,
    },
    Medium(MediumPoint),
}

impl Site {
    pub(crate) fn p(&self) -> Point {
        match self {
            Self::Surface { si, .. } => si.p,
            Self::Medium(m) => m.p,
        }
    }

    /// Back along the path.
    pub(crate) fn wo(&self) -> Dir {
        match self {
            Self::Surface { si, .. } => si.wo,
            Self::Medium(m) => m.wo,
        }
    }

    pub(crate) fn time(&self) -> f32 {
        match self {
            Self::Surface { si, .. } => si.time,
            Self::Medium(m) => m.time,
        }
    }

    /// The surface, if it is one.
    pub(crate) fn surface(&self) -> Option<&SurfaceInteraction> {
        match self {
            Self::Surface { si, .. } => Some(si),
            Self::Medium(_) => None,
        }
    }

    /// A ray that leaves along `w`, safely off a surface.
    pub(crate) fn spawn_ray(&self, w: Dir) -> Ray {
        match self {
            Self::Surface { si, .. } => si.spawn_ray(w),
            Self::Medium(m) => m.spawn_ray(w),
        }
    }

    /// What a light needs to know of the point.
    pub(crate) fn light_context(&self) -> LightContext {
        match self {
            Self::Surface { si, shading } => shading.light_context(si),
            Self::Medium(m) => m.light_context(),
        }
    }

    /// What rays are in that leave along `w`, where the path came through `before`.
    pub(crate) fn surroundings_towards(&self, scene: &Scene, w: Dir, before: &Surroundings) -> Surroundings {
        match self {
            Self::Surface { si, .. } => scene.surroundings_after(si, w, before),
            Self::Medium(_) => *before,
        }
    }

    /// Nothing can be connected to a surface of delta lobes alone, nor to what is hidden under a surface.
    pub(crate) fn is_connectible(&self) -> bool {
        match self {
            Self::Surface { shading, .. } => !shading.bsdf.is_delta_only(),
            Self::Medium(m) => !m.is_interior,
        }
    }

    /// Under the surface of a subsurface material?
    pub(crate) fn is_interior(&self) -> bool {
        match self {
            Self::Surface { .. } => false,
            Self::Medium(m) => m.is_interior,
        }
    }

    /// `f |cos θ|` (the phase function in a medium) from `wo` towards `w` for what the path carries. Importance gets the
    /// correction for shading normals.
    pub(crate) fn scatter(&self, w: Dir, mode: TransportMode) -> Spectrum {
        match self {
            Self::Surface { si, shading } => scatter_at(si, shading, w, mode),
            Self::Medium(m) => Spectrum::splat(m.phase.eval(m.wo, w)),
        }
    }

    /// Density per solid angle with which a walk that came from `back` goes on along `on`, deltas left out. The mode is
    /// that walk's.
    pub(crate) fn density(&self, back: Dir, on: Dir, mode: TransportMode) -> f32 {
        match self {
            Self::Surface { shading, .. } => {
                let (wo, wi) = (shading.frame.to_local(back), shading.frame.to_local(on));
                shading.bsdf.pdf(wo, wi, mode).value()
            }
            Self::Medium(m) => m.phase.pdf(back, on).value(),
        }
    }
}

/// See [`Site::scatter`].
pub(crate) fn scatter_at(
    si: &SurfaceInteraction,
    shading: &Shading,
    w: Dir,
    mode: TransportMode,
) -> Spectrum {
    let (wo, wi) = (shading.frame.to_local(si.wo), shading.frame.to_local(w));
    let f = shading.bsdf.eval(wo, wi, mode);
    match mode {
        TransportMode::Radiance => f * wi.abs_cos_theta(),
        TransportMode::Importance => {
            let cos_g = si.ng.abs_dot(si.wo);
            let factor = wo.abs_cos_theta() * si.ng.abs_dot(w) / cos_g;
            if cos_g > 0.0 { f * factor } else { Spectrum::ZERO }
        }
    }
}
