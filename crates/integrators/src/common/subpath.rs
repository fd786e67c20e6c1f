//! Subpaths: what random walks from the eye or from a light leave, with all that is needed to weigh them against each other
//! [Veach1997, ch. 10].
//!
//! A vertex is a surface or a point of a medium ([`Site`]); who uses it need not care which.
//!
//! Every vertex has two densities: `forward`, with which its own walk finds it, and `reverse`, with which a walk from
//! the other end would. Both are per area of its surface, per volume in a medium; for a light at infinity per solid angle.
//! Where a walk leaves a vertex by a delta lobe, the density is one per *projected* solid angle of the side that it comes
//! from, in either sense: an event and its reverse are equally likely, and the cosines are those that a smooth lobe would
//! have. A refraction's beam is narrower by η² on the denser side, so much denser is the density there.
//!
//! Borders of media are passed and are no vertices; if they emit, the walk keeps them in `passed`. What media emit towards
//! the eye is in `glows`.
//!
//! Left out of densities: the transmittances and extinctions of free flights. A density is a
//! function of the path alone, the same for every way of making it, so weights still add up to one and means are right, for
//! media that vary too; they are a little less than best. The extinction at a vertex would cancel in any case.

use math::{Dir, Point, Ray};
use scatter::TransportMode;
use scene::{LensHit, LightContext, Scene, SurfaceInteraction, Surroundings};
use spectrum::Spectrum;

use super::Site;

/// A point that a density may be asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) p: Point,
    /// `None`: no surface.
    pub(crate) n: Option<Dir>,
    /// Infinitely far away: its density is per solid angle.
    pub(crate) is_infinite: bool,
    /// In a medium: its density is per volume. Other points without a surface are found by no ray.
    pub(crate) is_medium: bool,
}

impl Place {
    pub(crate) fn on_surface(p: Point, n: Dir) -> Self {
        Self { p, n: Some(n), is_infinite: false, is_medium: false }
    }

    pub(crate) fn in_medium(p: Point) -> Self {
        Self { p, n: None, is_infinite: false, is_medium: true }
    }

    /// A point that only its own end of a path finds.
    pub(crate) fn point(p: Point) -> Self {
        Self { p, n: None, is_infinite: false, is_medium: false }
    }

    /// Infinitely far away, on a straight line through `p`.
    pub(crate) fn infinity(p: Point) -> Self {
        Self { p, n: None, is_infinite: true, is_medium: false }
    }
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
            (Self::Point { from, density }, None) if to.is_medium => {
                let per_volume = density / (to.p - from).length_squared();
                if per_volume.is_finite() { per_volume } else { 0.0 }
            }
            (Self::Parallel { density, dir }, Some(n)) => density * n.abs_dot(dir),
            (Self::Parallel { density, .. }, None) if to.is_medium => density,
            (_, None) => 0.0,
        }
    }
}

/// Where a walk scattered, or ended.
#[derive(Clone, Debug)]
pub(crate) struct Vertex {
    /// A surface or a point of a medium; its `wo` leads back along the walk.
    pub(crate) site: Site,
    /// What the walk came through.
    pub(crate) around: Surroundings,
    /// Of the walk up to here, before this vertex scatters.
    pub(crate) throughput: Spectrum,
    /// Density with which the walk found it.
    pub(crate) forward: f32,
    /// Density with which a walk from the other end would; known once the walk has gone on for two vertices.
    pub(crate) reverse: f32,
    /// Did the walk leave it by a delta lobe, or is it hidden, so that it cannot be connected?
    pub(crate) is_delta: bool,
    /// Scattering events of the walk up to and with this one: what is under a surface is none.
    pub(crate) events: u32,
}

impl Vertex {
    pub(crate) fn p(&self) -> Point {
        self.site.p()
    }

    /// Back along the walk.
    pub(crate) fn wo(&self) -> Dir {
        self.site.wo()
    }

    pub(crate) fn time(&self) -> f32 {
        self.site.time()
    }

    /// The surface; `None` in a medium.
    pub(crate) fn surface(&self) -> Option<&SurfaceInteraction> {
        self.site.surface()
    }

    pub(crate) fn place(&self) -> Place {
        match &self.site {
            Site::Surface { si, .. } => Place::on_surface(si.p, si.ng),
            Site::Medium(m) => Place::in_medium(m.p),
        }
    }

    /// Nothing can be connected to a surface of delta lobes alone.
    pub(crate) fn is_connectible(&self) -> bool {
        self.site.is_connectible()
    }

    /// See [`Site::scatter`].
    pub(crate) fn scatter(&self, w: Dir, mode: TransportMode) -> Spectrum {
        self.site.scatter(w, mode)
    }

    /// `f |cos θ|` towards `w`, from where photons come, over the cosine by which they are counted.
    pub(crate) fn gather(&self, w: Dir) -> Spectrum {
        let cos_g = self.surface().map_or(1.0, |si| si.ng.abs_dot(w));
        let scattered = self.scatter(w, TransportMode::Radiance);
        if cos_g > 0.0 { scattered * (1.0 / cos_g) } else { Spectrum::ZERO }
    }

    /// How a walk that came from `back` leaves along `on`, deltas left out. The mode is that walk's.
    pub(crate) fn leaving(&self, back: Dir, on: Dir, mode: TransportMode) -> Leaving {
        Leaving::Point { from: self.p(), density: self.site.density(back, on, mode) }
    }

    pub(crate) fn spawn_ray(&self, w: Dir) -> Ray {
        self.site.spawn_ray(w)
    }

    pub(crate) fn light_context(&self) -> LightContext {
        self.site.light_context()
    }

    /// What rays are in that leave along `w`.
    pub(crate) fn surroundings_towards(&self, scene: &Scene, w: Dir) -> Surroundings {
        self.site.surroundings_towards(scene, w, &self.around)
    }
}

/// What media emit towards the eye on the way from one vertex to the next.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Glow {
    /// Vertices before it.
    pub(crate) after: usize,
    /// What arrives at the walk's start.
    pub(crate) radiance: Spectrum,
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
    pub(crate) glows: Vec<Glow>,
    pub(crate) arrivals: Vec<Arrival>,
    pub(crate) escape: Option<Escape>,
    /// Density with which a walk from the other end finds the start.
    pub(crate) start_reverse: f32,
}

impl Subpath {
    pub(crate) fn clear(&mut self) {
        self.vertices.clear();
        self.passed.clear();
        self.glows.clear();
        self.arrivals.clear();
        self.escape = None;
        self.start_reverse = 0.0;
    }

    /// Scattering events among the first `n` vertices.
    pub(crate) fn events(&self, n: usize) -> usize {
        let last = n.min(self.vertices.len()).checked_sub(1);
        last.map_or(0, |i| self.vertices[i].events as usize)
    }

    /// How many vertices there are up to event number `n`: one more than all if it is the next after the walk's end; `None`
    /// if the walk ended before.
    pub(crate) fn vertices_to(&self, n: usize) -> Option<usize> {
        match self.vertices.iter().position(|v| v.events as usize >= n) {
            Some(i) => Some(i + 1),
            None => (self.events(self.vertices.len()) + 1 == n).then_some(self.vertices.len() + 1),
        }
    }

    /// Is vertex `i` hidden under a surface?
    pub(crate) fn is_hidden(&self, i: usize) -> bool {
        self.vertices.get(i).is_some_and(|v| v.site.is_interior())
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
                let place = Place::on_surface(Point::new(r, 0.0, 0.0), Dir::Z);
                let ring = std::f64::consts::TAU * f64::from(r * radius) / f64::from(n);
                f64::from(leaving.density_at(&place)) * ring
            })
            .sum();
        assert!((sum - (1.0 - 1.0 / 10.0_f64.sqrt())).abs() < 1e-5, "{sum}");

        let slanted = Dir(Vec3::new(0.6, 0.0, 0.8));
        let place = Place::on_surface(from, Dir::Z);
        let across = Leaving::Parallel { density: 0.5, dir: slanted };
        assert!((across.density_at(&place) - 0.4).abs() < 1e-6, "|cos θ| times as dense as across the rays");
    }
}
