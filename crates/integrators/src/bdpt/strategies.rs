//! The strategies (s, t): a path of s vertices from the light and t from the eye, joined, with its weight.
//!
//! | strategy     | how the ends meet                                                            |
//! |--------------|------------------------------------------------------------------------------|
//! | s = 0        | the walk from the eye finds an emitter                                       |
//! | s = 1, t ≥ 2 | next-event estimation: a place on a light, drawn anew for the eye's vertex   |
//! | s, t ≥ 2     | two surfaces are connected                                                   |
//! | s ≥ 2, t = 1 | a surface of the light's walk is connected to the lens                       |
//! | t = 0        | the walk from the light passes a lens of finite size                         |
//! | merging      | a photon near a surface of the eye's walk                                    |

use math::{Dir, Ray};
use sampling::Sampler;
use scatter::{Density, TransportMode};
use scene::{LightId, Scene, SurfaceInteraction, segment};
use spectrum::{Spectrum, Wavelengths};

use super::Merging;
use super::links::join;
use super::weight::{LightEnd, Link, Strategy, Weighting};
use crate::Counters;
use crate::common::{
    CameraStart, Leaving, LightStart, Place, Subpath, Vertex, camera_densities, connect_to_eye,
    direct_density, emission_densities, place_of,
};

/// What one strategy adds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contribution {
    /// Before weighting.
    pub(crate) unweighted: Spectrum,
    /// With its share.
    pub(crate) weighted: Spectrum,
    /// Where on the film, if not where the camera path started. Such a value is an integral over the film; the
    /// others are radiance.
    pub(crate) splat: Option<[f32; 2]>,
}

/// Two walks that may be joined. Kept and used again.
#[derive(Debug, Default)]
pub(crate) struct Subpaths {
    pub(crate) eye_start: Option<CameraStart>,
    pub(crate) eye: Subpath,
    pub(crate) light_start: Option<LightStart>,
    pub(crate) light: Subpath,
    /// Density of next-event estimation from the light walk's first surface to its start.
    direct: f32,
    /// How many photons are found at the vertices of both walks; see [`Link`].
    pub(super) eye_merges: Vec<f32>,
    pub(super) light_merges: Vec<f32>,
}

impl Subpaths {
    /// To be called when both walks are done.
    pub(crate) fn finish_merges(&mut self, scene: &Scene, merging: Option<&Merging>) {
        let Self { eye, light, eye_merges, light_merges, .. } = self;
        for (walk, merges) in [(eye, eye_merges), (light, light_merges)] {
            merges.clear();
            if let Some(merging) = merging {
                merges.extend(walk.vertices.iter().map(|v| match v.is_connectible() {
                    true => merging.expected(scene, v),
                    false => 0.0,
                }));
            }
        }
    }

    /// To be called when the light's walk is done.
    pub(crate) fn finish_light(&mut self, scene: &Scene) {
        self.direct = match (&self.light_start, self.light.vertices.first()) {
            (Some(start), Some(v)) => {
                direct_density(scene, &v.light_context(), start.light, &start.start.place, v.wo())
            }
            _ => 0.0,
        };
    }
}

/// Joins two walks.
pub(crate) struct Joint<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) weighting: Weighting,
    pub(crate) wl: Wavelengths,
    pub(crate) paths: &'a Subpaths,
    /// Kept and used again.
    pub(crate) links: &'a mut Vec<Link>,
    pub(crate) sampler: &'a mut Sampler,
    pub(crate) counters: &'a mut Counters,
}

/// An emitter that the eye's walk found.
struct Found {
    light: LightId,
    place: Place,
    le: Spectrum,
    /// Of the walk.
    throughput: Spectrum,
    /// Density with which the walk found it.
    forward: f32,
    /// Back along the walk.
    back: Dir,
    /// The moment, for a surface.
    time: f32,
}

impl Joint<'_> {
    /// The strategy with `s` vertices from the light and `t` from the eye; `None` if it adds nothing.
    pub(crate) fn strategy(&mut self, s: usize, t: usize) -> Option<Contribution> {
        let c = match (s, t) {
            (0, 0 | 1) | (1, 0 | 1) => None,
            _ if !self.weighting.joins(s, t) => None,
            (0, _) => self.find_emitters(t),
            (1, _) => self.next_event(t),
            (_, 0) => self.pass_lens(s),
            (_, 1) => self.reach_eye(s),
            _ => self.connect(s, t),
        };
        c.filter(|c| !c.unweighted.is_black())
    }

    // ---- s = 0 ----

    fn find_emitters(&mut self, t: usize) -> Option<Contribution> {
        let before = t - 2;
        let mut sum = Contribution { unweighted: Spectrum::ZERO, weighted: Spectrum::ZERO, splat: None };
        let eye = &self.paths.eye;
        for p in eye.passed.iter().filter(|p| p.after == before) {
            self.add_surface(&mut sum, t, (&p.si, p.throughput, p.forward));
        }
        // What media emit has no rival: no light path starts in a medium.
        for glow in eye.glows.iter().filter(|g| g.after == before) {
            sum.unweighted += glow.radiance;
            sum.weighted += glow.radiance;
        }
        if let Some(v) = eye.vertices.get(before) {
            if let Some(si) = v.surface() {
                self.add_surface(&mut sum, t, (si, v.throughput, v.forward));
            }
        } else if let Some(e) = eye.escape.filter(|_| eye.vertices.len() == before) {
            // Every infinite light is a path of its own.
            let scene = self.scene;
            let start = self.paths.eye_start.map(|c| c.start.ray.origin);
            let Some(from) = eye.vertices.last().map(Vertex::p).or(start) else { return Some(sum) };
            for &light in scene.lights.infinite() {
                let le = scene.lights.infinite_emitted(light, from, e.dir, &self.wl);
                let place = Place::infinity(from);
                let (throughput, forward, back) = (e.throughput, e.forward, -e.dir);
                let found = Found { light, place, le, throughput, forward, back, time: 0.0 };
                self.add_found(&mut sum, t, &found);
            }
        }
        Some(sum)
    }

    fn add_surface(
        &mut self,
        sum: &mut Contribution,
        t: usize,
        (si, throughput, forward): (&SurfaceInteraction, Spectrum, f32),
    ) {
        if let (Some(light), Some(le)) = (si.light, self.scene.emitted(si, si.wo, &self.wl)) {
            let place = Place::on_surface(si.p, si.ng);
            let (back, time) = (si.wo, si.time);
            self.add_found(sum, t, &Found { light, place, le, throughput, forward, back, time });
        }
    }

    fn add_found(&mut self, sum: &mut Contribution, t: usize, found: &Found) {
        let value = found.throughput * found.le;
        if !value.is_black() {
            sum.unweighted += value;
            sum.weighted += value * self.weight_of_found(found, t);
        }
    }

    fn weight_of_found(&mut self, f: &Found, t: usize) -> f32 {
        let (emit, leaving) = emission_densities(self.scene, f.light, &f.place, (f.back, f.time));
        let direct = match t.checked_sub(3).and_then(|i| self.paths.eye.vertices.get(i)) {
            Some(v) => direct_density(self.scene, &v.light_context(), f.light, &f.place, -f.back),
            None => 0.0,
        };
        let first = Link { from_light: emit, from_eye: f.forward, ..Link::default() };
        let next = self.eye_place(t - 2);
        let links = self.gather(0, Some(first), t - 1);
        links[1].from_light = next.map_or(0.0, |p| leaving.density_at(&p));
        if self.is_left_to_manifold(f.light) {
            return 0.0;
        }
        let end = LightEnd { emit, direct, is_hittable: true };
        self.weighting.weight(self.links, &end, Strategy::Join(0))
    }

    // ---- s = 1 ----

    fn next_event(&mut self, t: usize) -> Option<Contribution> {
        let (u_light, u) = (self.sampler.next_1d(), self.sampler.next_2d());
        let paths = self.paths;
        let z = paths.eye.vertices.get(t - 2).filter(|v| v.is_connectible())?;
        let from = z.light_context();
        let (light, chosen) = self.scene.light_selector.select(&from, u_light)?;
        let sample = self.scene.lights.sample(light, &from, u, &self.wl)?;
        let probability = match sample.density {
            Density::Smooth(pdf) => pdf.value() * chosen,
            Density::Delta { probability } => probability * chosen,
        };
        let scattered = z.scatter(sample.wi, TransportMode::Radiance);
        let value = z.throughput * scattered * sample.li * (1.0 / probability);
        if value.is_black() || !value.is_finite() {
            return None;
        }
        let ray = self.scene.shadow_ray(&from, &sample);
        let value = value * self.through(z, &ray)?;

        let place = place_of(&sample);
        let (emit, leaving) = emission_densities(self.scene, light, &place, (-sample.wi, from.time));
        let is_delta = self.scene.lights.is_delta(light);
        let direct = match is_delta {
            true => chosen,
            false => Leaving::Point { from: from.p, density: probability }.density_at(&place),
        };
        let end = LightEnd { emit, direct, is_hittable: !is_delta };
        let by_eye = z.leaving(z.wo(), sample.wi, TransportMode::Radiance).density_at(&place);
        let before = self.eye_place(t - 2);
        let links = self.gather(0, Some(Link { from_eye: by_eye, ..Link::default() }), t);
        links[1].from_light = leaving.density_at(&z.place());
        links[1].is_delta = false;
        let on = z.leaving(sample.wi, z.wo(), TransportMode::Importance);
        links[2].from_light = before.map_or(0.0, |p| on.density_at(&p));
        Some(self.weighted(value, &end, 1, None))
    }

    // ---- s, t ≥ 2 ----

    fn connect(&mut self, s: usize, t: usize) -> Option<Contribution> {
        let paths = self.paths;
        let y = paths.light.vertices.get(s - 2).filter(|v| v.is_connectible())?;
        let z = paths.eye.vertices.get(t - 2).filter(|v| v.is_connectible())?;
        let d = z.p() - y.p();
        let distance_squared = d.length_squared();
        let w = Dir(d / distance_squared.sqrt());
        let scattered = y.scatter(w, TransportMode::Importance) * z.scatter(-w, TransportMode::Radiance);
        let value = y.throughput * scattered * z.throughput * (1.0 / distance_squared);
        if value.is_black() || !value.is_finite() {
            return None;
        }
        let (a, b) = (y.spawn_ray(w).origin, z.spawn_ray(-w).origin);
        let value = value * self.through(y, &segment(a, b, y.time()))?;

        let end = self.light_end()?;
        let (before_y, before_z) = (self.light_place(s - 2), self.eye_place(t - 2));
        let links = self.gather(s, None, t);
        join(links, s, y, z, (w, before_y, before_z));
        Some(self.weighted(value, &end, s, None))
    }

    // ---- t = 1 ----

    fn reach_eye(&mut self, s: usize) -> Option<Contribution> {
        let paths = self.paths;
        let y = paths.light.vertices.get(s - 2)?;
        let (eye, through) = connect_to_eye(self.scene, y, (&mut *self.sampler, &self.wl), self.counters)?;
        let scattered = y.scatter(eye.wi, TransportMode::Importance);
        let value = y.throughput * scattered * through * eye.weight;
        if value.is_black() || !value.is_finite() {
            return None;
        }

        let end = self.light_end()?;
        let (position, leaving) = camera_densities(self.scene, &Ray::new(eye.p_lens, -eye.wi, y.time()));
        let n_lens = eye.n_lens.filter(|_| self.scene.camera.has_lens());
        let lens = n_lens.map_or(Place::point(eye.p_lens), |n| Place::on_surface(eye.p_lens, n));
        let before = self.light_place(s - 2);
        let links = self.gather(s, None, 0);
        let on = y.leaving(y.wo(), eye.wi, TransportMode::Importance);
        links.push(Link { from_light: on.density_at(&lens), from_eye: position, ..Link::default() });
        links[s - 1].from_eye = leaving.density_at(&y.place());
        links[s - 1].is_delta = false;
        let back = y.leaving(eye.wi, y.wo(), TransportMode::Radiance);
        links[s - 2].from_eye = before.map_or(0.0, |p| back.density_at(&p));
        Some(self.weighted(value, &end, s, Some(eye.raster)))
    }

    // ---- t = 0 ----

    fn pass_lens(&mut self, s: usize) -> Option<Contribution> {
        let arrival = *self.paths.light.arrivals.iter().find(|a| a.after == s - 2)?;
        let value = arrival.throughput * arrival.hit.we;
        let start = self.paths.light_start?;
        let before = self.light_place(s - 2)?;
        let (time, dir) = match s.checked_sub(3).and_then(|i| self.paths.light.vertices.get(i)) {
            Some(v) => (v.time(), Dir::normalize(v.p() - arrival.hit.p)),
            None => (start.start.ray.time, -start.start.ray.dir),
        };
        let (position, leaving) = camera_densities(self.scene, &Ray::new(arrival.hit.p, dir, time));
        let mut end = self.light_end()?;
        if s == 2 {
            end.direct = 0.0;
        }
        let links = self.gather(s - 1, None, 0);
        links.push(Link { from_light: arrival.forward, from_eye: position, ..Link::default() });
        links[s - 2].from_eye = leaving.density_at(&before);
        if self.is_left_to_manifold(start.light) {
            return Some(Contribution {
                unweighted: value,
                weighted: Spectrum::ZERO,
                splat: Some(arrival.hit.raster),
            });
        }
        Some(self.weighted(value, &end, s, Some(arrival.hit.raster)))
    }

    // ---- what they share ----

    /// What gets through from a vertex along a ray; `None` for nothing.
    fn through(&mut self, from: &Vertex, ray: &Ray) -> Option<Spectrum> {
        self.counters.rays += 1;
        let around = from.surroundings_towards(self.scene, ray.dir);
        let sampler = &mut *self.sampler;
        let through = self.scene.transmittance(ray, &around, &self.wl, &mut || sampler.next_1d());
        (!through.is_black()).then_some(through)
    }

    fn weighted(&self, value: Spectrum, end: &LightEnd, s: usize, splat: Option<[f32; 2]>) -> Contribution {
        let weight = self.weighting.weight(self.links, end, Strategy::Join(s));
        Contribution { unweighted: value, weighted: value * weight, splat }
    }

    /// How the start of the light's walk may be found.
    fn light_end(&self) -> Option<LightEnd> {
        let start = self.paths.light_start.as_ref()?;
        let is_hittable = !self.scene.lights.is_delta(start.light);
        Some(LightEnd { emit: start.emit, direct: self.paths.direct, is_hittable })
    }

    /// Vertex `i` of the light's walk, whose vertex 0 is the light.
    fn light_place(&self, i: usize) -> Option<Place> {
        match i.checked_sub(1) {
            None => self.paths.light_start.map(|l| l.start.place),
            Some(i) => self.paths.light.vertices.get(i).map(Vertex::place),
        }
    }

    /// Vertex `i` of the eye's walk, whose vertex 0 is on the lens.
    pub(super) fn eye_place(&self, i: usize) -> Option<Place> {
        match i.checked_sub(1) {
            None => self.paths.eye_start.map(|c| c.start.place),
            Some(i) => self.paths.eye.vertices.get(i).map(Vertex::place),
        }
    }
}
