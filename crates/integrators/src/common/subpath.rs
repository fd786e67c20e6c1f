//! Subpaths: random walks from the eye or from a light, with all that is needed to weigh them against each other
//! [Veach1997, ch. 10].
//!
//! Every vertex has two densities: `forward`, with which its own walk finds it, and `reverse`, with which a walk from
//! the other end would. Both are per area of its surface; for a light at infinity per solid angle. Where a walk
//! leaves a vertex by a delta lobe, the density is one per *projected* solid angle, in either sense: a reflection and
//! its reverse are equally likely, and the cosines are those that a smooth lobe would have.
//!
//! Walks from lights carry importance. Shading normals are not symmetric: the light that arrives at a surface is
//! multiplied by `|ωo·ns| |ωi·ng| / (|ωo·ng| |ωi·ns|)` [Veach1997, sec. 5.3.2].
//!
//! Borders of media are passed and are no vertices; if they emit, the walk keeps them in `passed`.
//! Left out: the η² in the densities of refracted walks (weights are right all the same, a little less than best).

use math::{Dir, Point, Ray};
use sampling::Sampler;
use scatter::TransportMode;
use scene::{LensHit, Scene, Shading, SurfaceInteraction};
use spectrum::{Spectrum, Wavelengths};

use super::{DirectionSampling, Roulette};
use crate::Counters;

/// A point that a density may be asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) p: Point,
    /// `None`: no surface, so that no ray finds it.
    pub(crate) n: Option<Dir>,
    /// Infinitely far away: its density is per solid angle.
    pub(crate) is_infinite: bool,
}

/// How a walk leaves a vertex: what the density of the next vertex follows from.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Leaving {
    /// From a point, with a density per solid angle.
    Point { from: Point, density: f32 },
    /// Along parallel rays, with a density per area across them.
    Parallel { density: f32, dir: Dir },
}

impl Leaving {
    /// The density of finding the place.
    pub(crate) fn density_at(self, to: &Place) -> f32 {
        match (self, to.n) {
            (Self::Point { density, .. }, _) if to.is_infinite => density,
            (Self::Point { from, density }, Some(n)) => {
                let d = to.p - from;
                let distance_squared = d.length_squared();
                let per_area = density * n.0.dot(d).abs() / (distance_squared * distance_squared.sqrt());
                if per_area.is_finite() { per_area } else { 0.0 }
            }
            (Self::Parallel { density, dir }, Some(n)) => density * n.abs_dot(dir),
            (_, None) => 0.0,
        }
    }
}

/// A surface at which a walk scattered, or ended.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertex {
    /// The surface; its `wo` leads back along the walk.
    pub(crate) si: SurfaceInteraction,
    /// How it scatters.
    pub(crate) shading: Shading,
    /// Of the walk up to here, before this vertex scatters.
    pub(crate) throughput: Spectrum,
    /// Density with which the walk found it.
    pub(crate) forward: f32,
    /// Density with which a walk from the other end would; known once the walk has gone on for two vertices.
    pub(crate) reverse: f32,
    /// Did the walk leave it by a delta lobe?
    pub(crate) is_delta: bool,
}

impl Vertex {
    pub(crate) fn place(&self) -> Place {
        Place { p: self.si.p, n: Some(self.si.ng), is_infinite: false }
    }

    /// Nothing can be connected to a surface of delta lobes alone.
    pub(crate) fn is_connectible(&self) -> bool {
        !self.shading.bsdf.is_delta_only()
    }

    /// `f |cos θ|` towards `w` for what the walk carries. Importance gets the correction for shading normals.
    pub(crate) fn scatter(&self, w: Dir, mode: TransportMode) -> Spectrum {
        let (wo, wi) = (self.shading.frame.to_local(self.si.wo), self.shading.frame.to_local(w));
        let f = self.shading.bsdf.eval(wo, wi, mode);
        match mode {
            TransportMode::Radiance => f * wi.abs_cos_theta(),
            TransportMode::Importance => {
                let cos_g = self.si.ng.abs_dot(self.si.wo);
                let factor = wo.abs_cos_theta() * self.si.ng.abs_dot(w) / cos_g;
                if cos_g > 0.0 { f * factor } else { Spectrum::ZERO }
            }
        }
    }

    /// `f |cos θ|` towards `w`, from where photons come, over the cosine by which they are counted.
    pub(crate) fn gather(&self, w: Dir) -> Spectrum {
        let cos_g = self.si.ng.abs_dot(w);
        let scattered = self.scatter(w, TransportMode::Radiance);
        if cos_g > 0.0 { scattered * (1.0 / cos_g) } else { Spectrum::ZERO }
    }

    /// How a walk that came from `back` leaves along `on`, deltas left out. The mode is that walk's.
    pub(crate) fn leaving(&self, back: Dir, on: Dir, mode: TransportMode) -> Leaving {
        let (wo, wi) = (self.shading.frame.to_local(back), self.shading.frame.to_local(on));
        Leaving::Point { from: self.si.p, density: self.shading.bsdf.pdf(wo, wi, mode).value() }
    }
}

/// An emitting border of media that a walk passed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Passed {
    /// Vertices before it.
    pub(crate) after: usize,
    pub(crate) si: SurfaceInteraction,
    pub(crate) throughput: Spectrum,
    pub(crate) forward: f32,
}

/// Where a walk left the scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Escape {
    pub(crate) dir: Dir,
    pub(crate) throughput: Spectrum,
    /// Per solid angle.
    pub(crate) forward: f32,
}

/// A walk from a light that passed the camera's lens.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arrival {
    /// Vertices before it.
    pub(crate) after: usize,
    pub(crate) hit: LensHit,
    pub(crate) throughput: Spectrum,
    pub(crate) forward: f32,
}

/// A walk without its start. Kept and used again, so that a path allocates nothing.
#[derive(Debug, Default)]
pub(crate) struct Subpath {
    pub(crate) vertices: Vec<Vertex>,
    pub(crate) passed: Vec<Passed>,
    pub(crate) arrivals: Vec<Arrival>,
    pub(crate) escape: Option<Escape>,
    /// Density with which a walk from the other end finds the start.
    pub(crate) start_reverse: f32,
}

impl Subpath {
    pub(crate) fn clear(&mut self) {
        self.vertices.clear();
        self.passed.clear();
        self.arrivals.clear();
        self.escape = None;
        self.start_reverse = 0.0;
    }
}

/// Where a walk begins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Start {
    pub(crate) ray: Ray,
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
    /// Most vertices.
    pub(crate) limit: usize,
    pub(crate) roulette: Roulette,
}

/// A walk on its way.
struct Traveller {
    ray: Ray,
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
            leaving: start.leaving,
            throughput: start.throughput,
            carried: Spectrum::ONE,
            eta_scale: 1.0,
        };
        while path.vertices.len() < self.limit {
            if !self.next_vertex(&mut on, wl, counters, path) || path.vertices.len() == self.limit {
                return;
            }
            if !self.scatter(&mut on, start, sampler, path) {
                return;
            }
        }
    }

    /// To the next surface that is no border of media; false if there is none.
    fn next_vertex(
        &self,
        on: &mut Traveller,
        wl: &mut Wavelengths,
        counters: &mut Counters,
        path: &mut Subpath,
    ) -> bool {
        let after = path.vertices.len();
        loop {
            counters.rays += 1;
            let hit = self.scene.intersect(&on.ray);
            if self.mode == TransportMode::Importance {
                self.pass_lens(on, hit.map_or(f32::INFINITY, |h| h.t), after, path);
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
            let place = Place { p: si.p, n: Some(si.ng), is_infinite: false };
            let forward = on.leaving.density_at(&place);
            let throughput = on.throughput;
            if let Some(shading) = self.scene.shade(&si, wl) {
                let vertex = Vertex { si, shading, throughput, forward, reverse: 0.0, is_delta: false };
                path.vertices.push(vertex);
                return true;
            }
            if si.light.is_some() && self.mode == TransportMode::Radiance {
                path.passed.push(Passed { after, si, throughput, forward });
            }
            on.ray = si.spawn_ray(on.ray.dir);
        }
    }

    fn pass_lens(&self, on: &Traveller, t_max: f32, after: usize, path: &mut Subpath) {
        if let Some(hit) = self.scene.camera.lens_hit(&on.ray, t_max) {
            let lens = Place { p: hit.p, n: Some(hit.n), is_infinite: false };
            let forward = on.leaving.density_at(&lens);
            path.arrivals.push(Arrival { after, hit, throughput: on.throughput, forward });
        }
    }

    /// Scatters at the last vertex; false if the walk ends there.
    fn scatter(&self, on: &mut Traveller, start: &Start, sampler: &mut Sampler, path: &mut Subpath) -> bool {
        let Some((vertex, before)) = path.vertices.split_last_mut() else { return false };
        let Shading { bsdf, frame } = &vertex.shading;
        let (back, ng) = (vertex.si.wo, vertex.si.ng);
        let wo = frame.to_local(back);
        let Some(s) = DirectionSampling::Bsdf.sample(bsdf, wo, sampler, self.mode) else { return false };
        let dir = frame.to_world(s.wi);

        // Densities in both senses; see the head for deltas.
        let (forward, reverse) = match s.pdf {
            Some(pdf) => (pdf.value(), bsdf.pdf(s.wi, wo, !self.mode).value()),
            None => (ng.abs_dot(dir), ng.abs_dot(back)),
        };
        vertex.is_delta = s.pdf.is_none();
        let backwards = Leaving::Point { from: vertex.si.p, density: reverse };
        match before.last_mut() {
            Some(v) => v.reverse = backwards.density_at(&v.place()),
            None => path.start_reverse = backwards.density_at(&start.place),
        }

        let mut factor = s.weight;
        if self.mode == TransportMode::Importance {
            let correction = wo.abs_cos_theta() * ng.abs_dot(dir) / (ng.abs_dot(back) * s.wi.abs_cos_theta());
            factor *= if correction.is_finite() { correction } else { 0.0 };
        } else {
            on.eta_scale *= s.eta * s.eta;
        }
        on.throughput *= factor;
        on.carried *= factor;
        on.leaving = Leaving::Point { from: vertex.si.p, density: forward };
        on.ray = vertex.si.spawn_ray(dir);
        if on.throughput.is_black() {
            return false;
        }
        let depth = path.vertices.len() as u32;
        let Some(paid) = self.roulette.survive(depth, on.carried, on.eta_scale, sampler.next_1d()) else {
            return false;
        };
        on.throughput *= paid;
        on.carried *= paid;
        true
    }
}

#[cfg(test)]
mod tests {
    use math::Vec3;

    use super::*;

    /// Over a disk of radius R at distance 1 a density of 1/2π per steradian adds up to 1 − cos θ, tan θ = R.
    #[test]
    fn a_density_per_area_adds_up_to_what_the_solid_angle_holds() {
        let from = Point::new(0.0, 0.0, 1.0);
        let leaving = Leaving::Point { from, density: std::f32::consts::FRAC_1_PI * 0.5 };
        let (radius, n) = (3.0_f32, 3000);
        let sum: f64 = (0..n)
            .map(|i| {
                let r = radius * (i as f32 + 0.5) / n as f32;
                let place = Place { p: Point::new(r, 0.0, 0.0), n: Some(Dir::Z), is_infinite: false };
                let ring = std::f64::consts::TAU * f64::from(r * radius) / f64::from(n);
                f64::from(leaving.density_at(&place)) * ring
            })
            .sum();
        assert!((sum - (1.0 - 1.0 / 10.0_f64.sqrt())).abs() < 1e-5, "{sum}");

        let slanted = Dir(Vec3::new(0.6, 0.0, 0.8));
        let place = Place { p: from, n: Some(Dir::Z), is_infinite: false };
        let across = Leaving::Parallel { density: 0.5, dir: slanted };
        assert!((across.density_at(&place) - 0.4).abs() < 1e-6, "|cos θ| times as dense as across the rays");
    }
}
