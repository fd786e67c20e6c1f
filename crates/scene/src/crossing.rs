//! Rays through borders of media: which medium is where, and how much light gets through.
//!
//! A ray's medium is known where it starts and changes where it crosses a shape with media on both sides; a shape without
//! them leaves it as it is, as in pbrt-v4. The camera's medium is the file's. So is a light's; where the file gives none,
//! it is the medium on this side of the first border that a ray from the light meets, so that walks from lights and from
//! the eye agree on where the light is.

use math::{Dir, Point, Ray, Vec3, error_bound};
use spectrum::{Spectrum, Wavelengths};

use crate::materials::Gaps;
use crate::{EmissionSample, LightId, MediumId, Scene, SurfaceInteraction};

/// Surfaces that a ray in search of a medium goes through; one that has met none by then is taken to be in none.
const MOST_BORDERS: usize = 1000;

impl Scene {
    /// Is there any medium?
    #[inline]
    #[must_use]
    pub fn has_media(&self) -> bool {
        !self.media.is_empty()
    }

    /// The medium around the eye.
    #[inline]
    #[must_use]
    pub fn camera_medium(&self) -> Option<MediumId> {
        self.camera_medium
    }

    /// The medium that a ray is in which leaves a surface along `w`; it came to the surface through `before`.
    #[inline]
    #[must_use]
    pub fn medium_after(
        &self,
        si: &SurfaceInteraction,
        w: Dir,
        before: Option<MediumId>,
    ) -> Option<MediumId> {
        match self.shape(si.shape).medium_interface {
            None => before,
            Some([inside, outside]) => {
                if si.ng.dot(w) > 0.0 {
                    outside
                } else {
                    inside
                }
            }
        }
    }

    /// The medium that a light path starts in.
    #[must_use]
    pub fn emission_medium(&self, start: &EmissionSample) -> Option<MediumId> {
        let [inside, outside] = self.light_media.get(start.light.index()).copied()?;
        if start.is_outside { outside } else { inside }
    }

    /// How much of the light along the ray arrives, through media and their borders: zero if something opaque is in
    /// between. The ray starts in `medium`. Exact in homogeneous media, else an unbiased estimate from numbers of `u`.
    pub fn transmittance(
        &self,
        ray: &Ray,
        medium: Option<MediumId>,
        wl: &Wavelengths,
        u: &mut impl FnMut() -> f32,
    ) -> Spectrum {
        if !self.has_media() {
            return if self.occluded(ray) { Spectrum::ZERO } else { Spectrum::ONE };
        }
        // Opaque things first: estimates cost more than rays.
        if self.occluded(ray) {
            return Spectrum::ZERO;
        }
        let (mut ray, mut medium) = (*ray, medium);
        let mut through = Spectrum::ONE;
        loop {
            let hit = self.intersect(&ray);
            let end = hit.map_or(ray.t_max, |h| h.t);
            if let Some(m) = medium {
                through *= self.media.pass(m, &Ray { t_max: end, ..ray }, wl, u).factor;
                if through.is_black() {
                    return through;
                }
            }
            let Some(hit) = hit else { return through };
            let si = self.interaction(&ray, &hit);
            // Where a shape is a border in some points only, this is one of them: nothing opaque was found. (Asked again, from
            // another origin, a choice by a hash of the point might be another.)
            if self.shape(si.shape).gaps == Gaps::Nowhere {
                return Spectrum::ZERO;
            }
            medium = self.medium_after(&si, ray.dir, medium);
            let t_max = ray.t_max - hit.t;
            ray = Ray { t_max, ..si.spawn_ray(ray.dir) };
        }
    }

    /// Is the eye in a medium that no border ends, with a light at infinity? None of that light comes to the eye's walks,
    /// but walks from the light would start inside the scene's bounds, past nearly all of the medium.
    #[must_use]
    pub fn has_light_from_beyond_a_medium(&self) -> bool {
        if self.camera_medium.is_none() || !self.lights.ids().any(|l| self.lights.is_from_infinity(l)) {
            return false;
        }
        let eye = self.camera.position(0.0);
        let axes = [Vec3::X, Vec3::Y, Vec3::Z].map(Dir);
        axes.into_iter().flat_map(|w| [w, -w]).any(|w| {
            let (mut ray, mut medium) = (Ray::new(eye, w, 0.0), self.camera_medium);
            for _ in 0..MOST_BORDERS {
                let Some(hit) = self.intersect(&ray) else { return medium.is_some() };
                let si = self.interaction(&ray, &hit);
                medium = self.medium_after(&si, w, medium);
                ray = si.spawn_ray(w);
            }
            false
        })
    }

    /// Sets the media that lights are in: what the file says of `declared`, else what is found.
    pub(crate) fn place_lights(&mut self, declared: &[(LightId, Option<MediumId>)]) {
        if !self.has_media() {
            return;
        }
        let mut media = vec![[None; 2]; self.lights.len()];
        for &(light, medium) in declared {
            let found = || self.lights.position(light).and_then(|p| self.medium_at(p, Dir::Z));
            media[light.index()] = [medium.or_else(found); 2];
        }
        for shape in &self.shapes {
            let Some(first) = shape.first_light else { continue };
            let n = shape.geometry.primitives() as u32 / shape.primitives_per_light.max(1);
            for light in (first.0..first.0 + n).map(LightId) {
                let found = |side: f32| {
                    let (p, n) = self.lights.surface_point(light)?;
                    let w = Dir(n.0 * side);
                    self.medium_at(error_bound::offset_ray_origin(p, Vec3::splat(1e-5), w, w), w)
                };
                media[light.index()] = shape.medium_interface.unwrap_or_else(|| [found(-1.0), found(1.0)]);
            }
        }
        self.light_media = media;
    }

    /// The medium at a point, by the first border in a direction; the camera's where there is none.
    fn medium_at(&self, p: Point, w: Dir) -> Option<MediumId> {
        let mut ray = Ray::new(p, w, 0.0);
        for _ in 0..MOST_BORDERS {
            let Some(hit) = self.intersect(&ray) else { break };
            let si = self.interaction(&ray, &hit);
            if self.shape(si.shape).medium_interface.is_some() {
                return self.medium_after(&si, -w, None);
            }
            ray = si.spawn_ray(w);
        }
        self.camera_medium
    }
}
