//! Random walks from the eye or from a light, through surfaces and media, into a [`Subpath`].
//!
//! Walks from lights carry importance. Shading normals are not symmetric: the light that arrives at a surface is
//! multiplied by `|ωo·ns| |ωi·ng| / (|ωo·ng| |ωi·ns|)` [Veach1997, sec. 5.3.2].
//!
//! Borders of media are passed and are no vertices. A walk from a light may pass the lens on its way.

use math::{Dir, Point, Ray};
use sampling::Sampler;
use scatter::TransportMode;
use scene::{Scene, Shading, Surroundings};
use spectrum::{Spectrum, Wavelengths};

use super::subpath::{Arrival, Escape, Glow, Leaving, Passed, Place, Subpath, Vertex};
use super::{DirectionSampling, MediumPoint, Roulette, Site};
use crate::Counters;

/// Where a walk begins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Start {
    pub(crate) ray: Ray,
    /// What the ray starts in.
    pub(crate) around: Surroundings,
    pub(crate) place: Place,
    pub(crate) leaving: Leaving,
    pub(crate) throughput: Spectrum,
}

/// The rules of a walk.
#[derive(Clone, Copy)]
pub(crate) struct Walk<'a> {
    pub(crate) scene: &'a Scene,
    /// Radiance from the eye, importance from a light.
    pub(crate) mode: TransportMode,
    /// Most scattering events. What happens under a surface is none.
    pub(crate) limit: usize,
    pub(crate) roulette: Roulette,
}

/// A walk on its way.
struct Traveller {
    ray: Ray,
    around: Surroundings,
    leaving: Leaving,
    throughput: Spectrum,
    /// What roulette looks at: the throughput without the start's.
    carried: Spectrum,
    eta_scale: f32,
}

impl Walk<'_> {
    /// Walks from `start` into `path`, which is emptied first. Dispersion may end secondary wavelengths.
    pub(crate) fn run(
        &self,
        start: &Start,
        sampler: &mut Sampler,
        wl: &mut Wavelengths,
        counters: &mut Counters,
        path: &mut Subpath,
    ) {
        path.clear();
        let mut on = Traveller {
            ray: start.ray,
            around: start.around,
            leaving: start.leaving,
            throughput: start.throughput,
            carried: Spectrum::ONE,
            eta_scale: 1.0,
        };
        let events = |path: &Subpath| path.events(path.vertices.len());
        while events(path) < self.limit {
            let is_first = path.vertices.is_empty();
            let found = self.next_vertex(&mut on, (&mut *sampler, &mut *wl), counters, path);
            if is_first && !is_lit(start, path) {
                return;
            }
            if !found || events(path) == self.limit {
                return;
            }
            if !self.scatter(&mut on, start, sampler, path) {
                return;
            }
        }
    }

    /// To the next surface that is no border of media, or to where a medium scatters; false if there is nothing.
    fn next_vertex(
        &self,
        on: &mut Traveller,
        (sampler, wl): (&mut Sampler, &mut Wavelengths),
        counters: &mut Counters,
        path: &mut Subpath,
    ) -> bool {
        let after = path.vertices.len();
        loop {
            counters.rays += 1;
            let hit = self.scene.intersect(&on.ray);
            let end = hit.map_or(f32::INFINITY, |h| h.t);
            if on.around.medium().is_some() {
                if let Some(t) = self.fly(on, end, (&mut *sampler, &*wl), path) {
                    return self.scatter_in_medium(on, t, path);
                }
                if on.throughput.is_black() {
                    return false;
                }
            } else if self.mode == TransportMode::Importance {
                self.pass_lens(on, end, after, path);
            }
            let Some(hit) = hit else {
                // Nothing competes with parallel rays from the eye straight to the sky: any density will do.
                let forward = match on.leaving {
                    Leaving::Point { density, .. } => density,
                    Leaving::Parallel { .. } => 1.0,
                };
                path.escape = Some(Escape { dir: on.ray.dir, throughput: on.throughput, forward });
                return false;
            };
            let si = self.scene.interaction(&on.ray, &hit);
            let forward = on.leaving.density_at(&Place::on_surface(si.p, si.ng));
            let (throughput, around) = (on.throughput, on.around);
            if let Some(shading) = self.scene.shade(&si, &around, wl) {
                let site = Site::Surface { si, shading };
                let events = path.events(after) as u32 + 1;
                let (reverse, is_delta) = (0.0, false);
                path.vertices.push(Vertex { site, around, throughput, forward, reverse, is_delta, events });
                return true;
            }
            if si.light.is_some() && self.mode == TransportMode::Radiance {
                path.passed.push(Passed { after, si, throughput, forward });
            }
            on.around = self.scene.surroundings_after(&si, on.ray.dir, &around);
            on.ray = si.spawn_ray(on.ray.dir);
        }
    }

    /// Through the medium up to `end`; where it scatters. A walk from a light may pass the lens before.
    fn fly(
        &self,
        on: &mut Traveller,
        end: f32,
        (sampler, wl): (&mut Sampler, &Wavelengths),
        path: &mut Subpath,
    ) -> Option<f32> {
        let medium = on.around.medium()?;
        let mut through = |on: &mut Traveller, from: f32, to: f32, path: &mut Subpath| {
            let piece = Ray { origin: on.ray.at(from), t_max: to - from, ..on.ray };
            let flight = self.scene.media.fly(medium, &piece, on.throughput, wl, &mut || sampler.next_1d());
            if self.mode == TransportMode::Radiance && !flight.emitted.is_black() {
                let radiance = on.throughput * flight.emitted;
                path.glows.push(Glow { after: path.vertices.len(), radiance });
            }
            on.throughput *= flight.factor;
            on.carried *= flight.factor;
            flight.scatters_at.map(|t| from + t)
        };
        let lens = match self.mode {
            TransportMode::Importance => self.scene.camera.lens_hit(&on.ray, end),
            TransportMode::Radiance => None,
        };
        let Some(lens) = lens else { return through(on, 0.0, end, path) };
        if let Some(t) = through(on, 0.0, lens.t, path) {
            return Some(t);
        }
        self.pass_lens(on, end, path.vertices.len(), path);
        through(on, lens.t, end, path)
    }

    /// A vertex in the medium at distance `t`, if anything is left.
    fn scatter_in_medium(&self, on: &Traveller, t: f32, path: &mut Subpath) -> bool {
        let Some(medium) = on.around.medium().filter(|_| !on.throughput.is_black()) else { return false };
        let point = MediumPoint::new(self.scene, &on.ray, t, medium);
        path.vertices.push(Vertex {
            site: Site::Medium(point),
            around: on.around,
            throughput: on.throughput,
            forward: on.leaving.density_at(&Place::in_medium(point.p)),
            reverse: 0.0,
            is_delta: point.is_interior,
            events: path.events(path.vertices.len()) as u32 + u32::from(!point.is_interior),
        });
        true
    }

    fn pass_lens(&self, on: &Traveller, t_max: f32, after: usize, path: &mut Subpath) {
        if let Some(hit) = self.scene.camera.lens_hit(&on.ray, t_max) {
            let forward = on.leaving.density_at(&Place::on_surface(hit.p, hit.n));
            path.arrivals.push(Arrival { after, hit, throughput: on.throughput, forward });
        }
    }

    /// Scatters at the last vertex; false if the walk ends there.
    fn scatter(&self, on: &mut Traveller, start: &Start, sampler: &mut Sampler, path: &mut Subpath) -> bool {
        let Some((vertex, before)) = path.vertices.split_last_mut() else { return false };
        let Some(step) = self.step(&vertex.site, sampler) else { return false };
        vertex.is_delta = step.is_delta;
        let backwards = Leaving::Point { from: vertex.p(), density: step.reverse };
        match before.last_mut() {
            Some(v) => v.reverse = backwards.density_at(&v.place()),
            None => path.start_reverse = backwards.density_at(&start.place),
        }
        on.eta_scale *= step.eta_scale;
        on.throughput *= step.factor;
        on.carried *= step.factor;
        on.leaving = Leaving::Point { from: vertex.p(), density: step.forward };
        on.around = vertex.surroundings_towards(self.scene, step.dir);
        on.ray = vertex.spawn_ray(step.dir);
        if on.throughput.is_black() {
            return false;
        }
        let n = path.vertices.len();
        let depth = match path.vertices.last().is_some_and(|v| v.surface().is_none()) {
            true => Roulette::depth_in_medium(n as u32),
            false => path.events(n) as u32,
        };
        let Some(paid) = self.roulette.survive(depth, on.carried, on.eta_scale, sampler) else {
            return false;
        };
        on.throughput *= paid;
        on.carried *= paid;
        true
    }

    /// A direction in which a walk goes on.
    fn step(&self, site: &Site, sampler: &mut Sampler) -> Option<Step> {
        let (si, Shading { bsdf, frame }) = match site {
            Site::Surface { si, shading } => (si, shading),
            Site::Medium(m) => {
                let s = m.phase.sample(m.wo, sampler.next_2d());
                let density = s.pdf.value();
                return Some(Step {
                    dir: s.wi,
                    factor: Spectrum::ONE,
                    forward: density,
                    reverse: density,
                    is_delta: m.is_interior,
                    eta_scale: 1.0,
                });
            }
        };
        let (back, ng) = (si.wo, si.ng);
        let wo = frame.to_local(back);
        let s = DirectionSampling::Bsdf.sample(bsdf, wo, sampler, self.mode)?;
        let dir = frame.to_world(s.wi);

        // Densities in both senses; see the head for deltas.
        let (forward, reverse) = match s.pdf {
            Some(pdf) => (pdf.value(), bsdf.pdf(s.wi, wo, !self.mode).value()),
            None => (s.eta * s.eta * ng.abs_dot(dir), ng.abs_dot(back)),
        };
        let (mut factor, mut eta_scale) = (s.weight, 1.0);
        if self.mode == TransportMode::Importance {
            let correction = wo.abs_cos_theta() * ng.abs_dot(dir) / (ng.abs_dot(back) * s.wi.abs_cos_theta());
            factor *= if correction.is_finite() { correction } else { 0.0 };
        } else {
            eta_scale = s.eta * s.eta;
        }
        Some(Step { dir, factor, forward, reverse, is_delta: s.pdf.is_none(), eta_scale })
    }
}

/// Light from infinity may come through a portal: what its ray meets before is not lit. False, and the walk emptied, if
/// its first vertex is not.
fn is_lit(start: &Start, path: &mut Subpath) -> bool {
    if !start.place.is_infinite {
        return true;
    }
    let is_behind = |p: Point| (p - start.place.p).dot(start.ray.dir.0) > 0.0;
    path.arrivals.retain(|a| is_behind(a.hit.p));
    let is_lit = path.vertices.first().is_none_or(|v| is_behind(v.p()));
    if !is_lit {
        path.vertices.clear();
    }
    is_lit
}

/// How a walk goes on from a vertex.
struct Step {
    dir: Dir,
    /// On the throughput.
    factor: Spectrum,
    /// Density of the direction in the walk's sense and in the other.
    forward: f32,
    reverse: f32,
    is_delta: bool,
    eta_scale: f32,
}
