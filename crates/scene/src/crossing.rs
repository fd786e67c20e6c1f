//! Rays through borders of media and bodies: what is where, and how much light gets through.
//!
//! A ray's medium is known where it starts and changes where it crosses a shape with media on both sides; a shape without
//! them leaves it as it is, as in pbrt-v4. The camera's medium is the file's. So is a light's; where the file gives none,
//! it is the medium on this side of the first border that a ray from the light meets, so that walks from lights and from
//! the eye agree on where the light is. Bodies with priorities (see [`Surroundings`]) that eye and light are in are had
//! the same way, by the borders that a ray meets.
//!
//! Left out: an eye that moves through the surface of a body, or whose lens is in two.

use accel::{Hit, accept_all};
use math::{Dir, Point, Ray, Vec3, error_bound};
use spectrum::{Spectrum, Wavelengths};

use crate::materials::Gaps;
use crate::surroundings::Enclosing;
use crate::{EmissionSample, LightId, MediumId, Scene, SurfaceInteraction, Surroundings};

/// Surfaces that a ray in search of a medium goes through; one that has met none by then is taken to be in none.
const MOST_BORDERS: usize = 1000;

/// Along no axis, lest the search for bodies run along faces.
const ASIDE: Dir = Dir(Vec3::new(0.267_261_24, 0.534_522_5, 0.801_783_7));

/// What is along a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    /// Something that is surely opaque.
    Blocked,
    /// Borders of media, or surfaces of bodies, which may be displaced.
    Borders,
    /// Nothing at all.
    Clear,
}

impl Scene {
    /// Is there any medium?
    #[inline]
    #[must_use]
    pub fn has_media(&self) -> bool {
        !self.media.is_empty()
    }

    /// Is space empty: no media, and no bodies that may overlap?
    #[inline]
    #[must_use]
    pub fn is_empty_space(&self) -> bool {
        self.media.is_empty() && self.bodies.is_empty()
    }

    /// What is around the eye.
    #[inline]
    #[must_use]
    pub fn camera_surroundings(&self) -> Surroundings {
        self.camera_surroundings
    }

    /// What a ray is in that leaves a surface along `w`; it came to the surface through `before`.
    #[inline]
    #[must_use]
    pub fn surroundings_after(&self, si: &SurfaceInteraction, w: Dir, before: &Surroundings) -> Surroundings {
        let shape = self.shape(si.shape);
        let is_outside = si.ng.dot(w) > 0.0;
        match (shape.body, shape.medium_interface) {
            (None, None) => *before,
            (None, Some([inside, outside])) => {
                let medium = if is_outside { outside } else { inside };
                self.bodies.surroundings(before.bodies(), medium)
            }
            // What is outside of a body is what would be there without it.
            (Some(body), _) => {
                let others = self.others(si, before);
                let bodies = if is_outside { others } else { others.with(body) };
                self.bodies.surroundings(bodies, before.ambient())
            }
        }
    }

    /// The bodies on both sides of a surface that a ray came to through `before`: all but its own.
    fn others(&self, si: &SurfaceInteraction, before: &Surroundings) -> Enclosing {
        let bodies = before.bodies();
        match self.shape(si.shape).body {
            Some(body) if si.ng.dot(si.wo) <= 0.0 => bodies.without(body).unwrap_or(bodies),
            Some(_) | None => bodies,
        }
    }

    /// Is the surface inside a stronger body, and so not there?
    pub(crate) fn is_displaced(&self, si: &SurfaceInteraction, before: &Surroundings) -> bool {
        let strongest = self.shape(si.shape).body.and_then(|own| {
            let other = self.others(si, before).strongest()?;
            Some(other >= own)
        });
        strongest.unwrap_or(false)
    }

    /// The index of refraction of what is outside of a body's surface, if that is a body.
    pub(crate) fn index_outside(
        &self,
        si: &SurfaceInteraction,
        before: &Surroundings,
        wl: &mut Wavelengths,
    ) -> Option<f32> {
        self.shape(si.shape).body?;
        let outside = self.others(si, before).strongest()?;
        Some(self.materials.index_of_refraction(self.bodies.get(outside).material, wl))
    }

    /// What a light path starts in.
    #[must_use]
    pub fn emission_surroundings(&self, start: &EmissionSample) -> Surroundings {
        let [inside, outside] = self.light_media.get(start.light.index()).copied().unwrap_or_default();
        let medium = if start.is_outside { outside } else { inside };
        if self.bodies.is_empty() || start.is_infinite {
            return Surroundings::of(medium);
        }
        self.surroundings_at(start.ray, medium)
    }

    /// What a ray starts in, by the borders of bodies that it meets. `medium` is what is said to be there.
    pub(crate) fn surroundings_at(&self, mut ray: Ray, medium: Option<MediumId>) -> Surroundings {
        let (mut around, mut entered) = (Enclosing::default(), Enclosing::default());
        let mut beyond = None;
        for _ in 0..MOST_BORDERS {
            let Some(hit) = self.intersect(&ray) else { break };
            let si = self.interaction(&ray, &hit);
            let shape = self.shape(si.shape);
            match shape.body {
                Some(body) if si.ng.dot(ray.dir) < 0.0 => entered = entered.with(body),
                Some(body) => match entered.without(body) {
                    Some(rest) => entered = rest,
                    None => {
                        around = around.with(body);
                        beyond = shape.medium_interface.map(|[_, outside]| outside).or(beyond);
                    }
                },
                None => {}
            }
            ray = si.spawn_ray(ray.dir);
        }
        // What is said of a place in a body may be what the body is filled with.
        let is_of_body = around.strongest().is_some_and(|b| self.bodies.get(b).medium == medium);
        let ambient = beyond.unwrap_or(if is_of_body { None } else { medium });
        self.bodies.surroundings(around, ambient)
    }

    /// How much of the light along the ray arrives, through media and their borders: zero if something opaque is in
    /// between. The ray starts in `around`. Exact in homogeneous media, else an unbiased estimate from numbers of `u`.
    pub fn transmittance(
        &self,
        ray: &Ray,
        around: &Surroundings,
        wl: &Wavelengths,
        u: &mut impl FnMut() -> f32,
    ) -> Spectrum {
        if self.is_empty_space() {
            return if self.occluded(ray) { Spectrum::ZERO } else { Spectrum::ONE };
        }
        // Opaque things first: estimates cost more than rays.
        let mut through = Spectrum::ONE;
        match (self.way(ray), around.medium()) {
            (Way::Blocked, _) => return Spectrum::ZERO,
            (Way::Clear, None) => return through,
            (Way::Clear, Some(m)) => return through * self.media.pass(m, ray, wl, u).factor,
            (Way::Borders, _) => {}
        }
        let (mut ray, mut around) = (*ray, *around);
        loop {
            let hit = self.intersect(&ray);
            let end = hit.map_or(ray.t_max, |h| h.t);
            if let Some(m) = around.medium() {
                through *= self.media.pass(m, &Ray { t_max: end, ..ray }, wl, u).factor;
                if through.is_black() {
                    return through;
                }
            }
            let Some(hit) = hit else { return through };
            let si = self.interaction(&ray, &hit);
            // Where a shape is a border in some points only, this is one of them: nothing opaque was found. (Asked again, from
            // another origin, a choice by a hash of the point might be another.)
            match self.shape(si.shape).gaps {
                Gaps::Nowhere => return Spectrum::ZERO,
                Gaps::WhereDisplaced if !self.is_displaced(&si, &around) => return Spectrum::ZERO,
                Gaps::WhereDisplaced | Gaps::Somewhere | Gaps::Everywhere => {}
            }
            around = self.surroundings_after(&si, ray.dir, &around);
            let t_max = ray.t_max - hit.t;
            ray = Ray { t_max, ..si.spawn_ray(ray.dir) };
        }
    }

    /// What is along a ray: surfaces of bodies may be displaced, which a walk knows.
    fn way(&self, ray: &Ray) -> Way {
        let mut is_clear = true;
        let is_blocked = match self.shadow_filter {
            false => self.accel.occluded(ray, &mut accept_all),
            true => self.accel.occluded(ray, &mut |hit: &Hit| {
                let is_surface = self.is_surface::<false>(ray, hit);
                is_clear &= is_surface;
                is_surface && self.is_there(ray, hit)
            }),
        };
        match (is_blocked, is_clear) {
            (true, _) => Way::Blocked,
            (false, true) => Way::Clear,
            (false, false) => Way::Borders,
        }
    }

    /// Is what was hit no border of media there?
    pub(crate) fn is_surface<const BODIES_COUNT: bool>(&self, ray: &Ray, hit: &Hit) -> bool {
        match self.shapes[self.shape_of(hit).index()].gaps {
            Gaps::Nowhere => true,
            Gaps::WhereDisplaced => BODIES_COUNT,
            Gaps::Somewhere => !self.materials.is_interface(&self.textures, &self.interaction(ray, hit)),
            Gaps::Everywhere => false,
        }
    }

    /// Is anything opaque along a ray that starts in `around`? Borders of media do not count, media themselves neither.
    #[must_use]
    pub fn is_blocked(&self, ray: &Ray, around: &Surroundings) -> bool {
        if self.bodies.is_empty() {
            return self.occluded(ray);
        }
        match self.way(ray) {
            Way::Blocked => return true,
            Way::Clear => return false,
            Way::Borders => {}
        }
        let (mut ray, mut around) = (*ray, *around);
        while let Some(hit) = self.intersect(&ray) {
            let si = self.interaction(&ray, &hit);
            if self.shape(si.shape).gaps == Gaps::WhereDisplaced && !self.is_displaced(&si, &around) {
                return true;
            }
            around = self.surroundings_after(&si, ray.dir, &around);
            let t_max = ray.t_max - hit.t;
            ray = Ray { t_max, ..si.spawn_ray(ray.dir) };
        }
        false
    }

    /// Is the eye in a medium that no border ends, with a light at infinity? None of that light comes to the eye's walks,
    /// but walks from the light would start inside the scene's bounds, past nearly all of the medium.
    #[must_use]
    pub fn has_light_from_beyond_a_medium(&self) -> bool {
        let eye_in = self.camera_surroundings;
        let has_medium = eye_in.medium().or(eye_in.ambient()).is_some();
        if !has_medium || !self.lights.ids().any(|l| self.lights.is_from_infinity(l)) {
            return false;
        }
        let eye = self.camera.position(0.0);
        let axes = [Vec3::X, Vec3::Y, Vec3::Z].map(Dir);
        axes.into_iter().flat_map(|w| [w, -w]).any(|w| {
            let (mut ray, mut around) = (Ray::new(eye, w, 0.0), eye_in);
            for _ in 0..MOST_BORDERS {
                let Some(hit) = self.intersect(&ray) else { return around.medium().is_some() };
                let si = self.interaction(&ray, &hit);
                around = self.surroundings_after(&si, w, &around);
                ray = si.spawn_ray(w);
            }
            false
        })
    }

    /// Finds the bodies that the eye is in; `medium` is what the file says of its place.
    pub(crate) fn place_camera(&mut self, medium: Option<MediumId>) {
        self.camera_surroundings = match self.bodies.is_empty() {
            true => Surroundings::of(medium),
            false => self.surroundings_at(Ray::new(self.camera.position(0.0), ASIDE, 0.0), medium),
        };
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
        for (shape, first) in self.emitting_shapes() {
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

    /// Lets skies learn from where they are seen. Borders of media do not count, nor media.
    pub(crate) fn look_at_skies(&mut self) {
        let mut lights = std::mem::take(&mut self.lights);
        lights.look_at_skies(&self.bounds(), |ray| self.occluded(ray));
        self.lights = lights;
    }

    /// The medium at a point, by the first border in a direction; the camera's where there is none.
    fn medium_at(&self, p: Point, w: Dir) -> Option<MediumId> {
        let mut ray = Ray::new(p, w, 0.0);
        for _ in 0..MOST_BORDERS {
            let Some(hit) = self.intersect(&ray) else { break };
            let si = self.interaction(&ray, &hit);
            if let Some([inside, outside]) = self.shape(si.shape).medium_interface {
                return if si.ng.dot(-w) > 0.0 { outside } else { inside };
            }
            ray = si.spawn_ray(w);
        }
        self.camera_surroundings.ambient()
    }
}
