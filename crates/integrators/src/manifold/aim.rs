//! What a chain shall reach: a point of a light, or the direction of one that is infinitely far away. By how much a ray misses it,
//! and what light comes from there.

use math::{Dir, Frame, Point, Ray};
use scatter::Density;
use scene::{LightId, LightPlace, LightSample, Scene};
use spectrum::Spectrum;

use super::chain::{Chain, Start};

/// A point of a light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aim {
    light: LightId,
    pub(super) at: At,
    /// Probability of the light, times the density of the place per area if it has one.
    density: f32,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum At {
    Surface(LightPlace),
    Point(Point),
    Infinity(Dir),
}

/// By how much a ray misses.
#[derive(Clone, Copy, Debug)]
pub(super) struct Miss {
    /// The sine of the angle.
    pub(super) error: f32,
    /// The angles, along the axes of the start's direction, by which it would meet if all were linear.
    pub(super) step: [f32; 2],
    /// Solid angle at the start to area across the ray where it meets, or to solid angle for what is at infinity.
    spread: f32,
}

/// Light that arrives over the last edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arriving {
    pub(super) ray: Ray,
    /// With all factors but for [`Chain::spread`].
    pub(super) li: Spectrum,
}

impl Aim {
    /// A point of a light that is chosen by its power: over mirrors and lenses light may come from behind.
    pub(super) fn sample(start: &Start<'_>, u_light: f32, u: [f32; 2]) -> Option<Self> {
        let scene = start.scene;
        let (light, chosen) = scene.light_selector.select_emission(u_light)?;
        if let Some(place) = scene.lights.sample_place(light, u, start.vertex.time()) {
            return Some(Self { light, at: At::Surface(place), density: chosen * place.pdf.value() });
        }
        let at = match scene.lights.position(light) {
            Some(p) => At::Point(p),
            None => {
                let sample =
                    scene.lights.sample(light, &start.vertex.light_context(), u, &start.wl).filter(|s| {
                        // The sky is left to walks.
                        s.is_infinite && matches!(s.density, Density::Delta { .. })
                    })?;
                At::Infinity(sample.wi)
            }
        };
        Some(Self { light, at, density: chosen })
    }

    /// Where it is as seen from a point.
    pub(super) fn direction(&self, from: Point) -> Option<Dir> {
        match self.at {
            At::Surface(place) => (place.p - from).try_normalize().map(Dir),
            At::Point(p) => (p - from).try_normalize().map(Dir),
            At::Infinity(w) => Some(w),
        }
    }

    /// By how much the ray that leaves a chain misses; `None` if it flies away from it.
    pub(super) fn miss(&self, chain: &Chain) -> Option<Miss> {
        let d = chain.dir.0;
        let target = match self.at {
            At::Surface(place) => place.p - chain.last.p,
            At::Point(p) => p - chain.last.p,
            At::Infinity(w) => w.0,
        };
        // Across the ray, at the distance of the target.
        let along = target.dot(d);
        if along <= 0.0 {
            return None;
        }
        let off = target - d * along;
        let moves = match self.at {
            At::Surface(_) | At::Point(_) => [0, 1].map(|i| chain.by_place[i] + chain.by_dir[i] * along),
            At::Infinity(_) => chain.by_dir,
        };
        let Frame { s, t, .. } = Frame::from_normal(chain.dir);
        let [[a, c], [b, d]] = moves.map(|m| [m.dot(s), m.dot(t)]);
        let [x, y] = [off.dot(s), off.dot(t)];
        let determinant = a * d - b * c;
        let step = [(d * x - b * y) / determinant, (a * y - c * x) / determinant];
        let is_regular = step.iter().all(|s| s.is_finite()) && determinant != 0.0;
        is_regular.then(|| Miss { error: off.length() / target.length(), step, spread: determinant.abs() })
    }

    /// The light that arrives at the end of a chain.
    pub(super) fn light(&self, scene: &Scene, chain: &Chain) -> Option<Arriving> {
        let from = chain.last.light_context();
        let (sample, factor) = match self.at {
            At::Surface(place) => {
                let wi = self.direction(from.p)?;
                let li = scene.lights.emitted(self.light, place.n, place.uv, -wi, &chain.wl);
                let LightPlace { p, p_error, n, uv, .. } = place;
                let density = Density::Delta { probability: 1.0 };
                let sample =
                    LightSample { light: self.light, li, wi, p, p_error, n, uv, density, is_infinite: false };
                (sample, n.abs_dot(chain.dir))
            }
            // Intensity has the inverse square no more.
            At::Point(p) => {
                let sample = scene.lights.sample(self.light, &from, [0.5; 2], &chain.wl)?;
                (sample, p.distance_squared(from.p))
            }
            At::Infinity(_) => (scene.lights.sample(self.light, &from, [0.5; 2], &chain.wl)?, 1.0),
        };
        let li = sample.li * (factor / self.density);
        Some(Arriving { ray: scene.shadow_ray(&from, &sample), li })
    }
}

impl Chain {
    /// See [`Miss`].
    pub(super) fn spread(&self, aim: &Aim) -> f32 {
        aim.miss(self).map_or(f32::INFINITY, |m| m.spread)
    }
}
