//! Flights through a medium as lights see them: equiangular sampling [Kulla2012].
//!
//! A free flight through thin mist seldom ends near a lamp, where most of the light is scattered. So a second distance is
//! drawn along the same ray by equal angles as a light at a finite place sees them, and lit by that light. The two are weighed
//! against each other (and rays that find the lamp against both) as techniques for the same light at the same distance:
//! in units of the density of the flight the first makes `P(l | x)` samples of light l at distance t, the second
//! `rate = P(l | ray) p(t | l) / p_flight(t)`.
//!
//! The light is chosen as for a point in the middle of the ray; its place is taken to be its middle. Only where the medium is
//! the same everywhere, as else the flight's density is not known; and only where the ray is thin or the light is near, as
//! else flights are as good.

use math::{Point, Ray, Vec3};
use sampling::{Length, Pdf, Sampler, warp};
use scene::{LightContext, LightId, LightSample, MediumId, Scene};
use spectrum::{Spectrum, Wavelengths};

use super::MediumPoint;

/// A flight.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LitFlight {
    /// To the end of what may be flown through.
    ray: Ray,
    medium: MediumId,
    /// What the path carried at its start.
    carried: Spectrum,
    /// What lights are chosen for.
    middle: LightContext,
    /// A mean free path.
    reach: f32,
}

/// Where on a flight a light sample is made by equal angles.
pub(crate) struct LitPoint {
    pub(crate) point: MediumPoint,
    pub(crate) sample: LightSample,
    /// What the path carries is multiplied by it, as if a flight had ended here.
    pub(crate) factor: Spectrum,
    /// Samples of this light that are made here in this way, and by flights.
    pub(crate) counts: [f32; 2],
}

/// The distances of a flight from a light.
#[derive(Clone, Copy, Debug)]
struct Distances {
    /// Of the point that is nearest to the light.
    foot: f32,
    end: f32,
    line: warp::Equiangular,
}

/// A light on the ray counts as one so far beside it, as a share of its distance.
const LEAST_HEIGHT: f32 = 1e-3;

impl LitFlight {
    /// `None` where it does not apply.
    pub(crate) fn new(
        scene: &Scene,
        ray: &Ray,
        (medium, carried): (MediumId, Spectrum),
        wl: &Wavelengths,
    ) -> Option<Self> {
        let extinction = scene.media.collision(medium, 0.0, carried, wl)?.pdf.value();
        let reach = 1.0 / extinction;
        if !reach.is_finite() || ray.t_max <= 0.0 {
            return None;
        }
        let p = ray.at(0.5 * ray.t_max.min(reach));
        let middle = LightContext { p, p_error: Vec3::ZERO, ng: None, ns: None, time: ray.time };
        let lit = Self { ray: *ray, medium, carried, middle, reach };

        // No light is near a thick ray that is far from the sphere around all.
        let (center, radius) = scene.lights.finite_sphere()?;
        (ray.t_max < reach || lit.seen_from(center).1 < reach + radius).then_some(lit)
    }

    /// A light and a distance; `None` if there is nothing to be lit by.
    pub(crate) fn sample(&self, scene: &Scene, sampler: &mut Sampler, wl: &Wavelengths) -> Option<LitPoint> {
        let u_light = sampler.next_1d_if(scene.light_selector.has_choice());
        let (u_distance, u_place) = (sampler.next_1d(), sampler.next_2d());
        let (light, chosen) = scene.light_selector.select(&self.middle, u_light)?;
        let distances = self.distances(scene, light)?;
        let t = distances.sample(u_distance);
        let collision = scene.media.collision(self.medium, t, self.carried, wl)?;
        let point = MediumPoint::new(scene, &self.ray, t, self.medium);
        let from = point.light_context();
        let sample = scene.lights.sample(light, &from, u_place, wl)?;
        let rate = chosen * distances.pdf(t).value() / collision.pdf.value();
        let counts = [rate, scene.light_selector.probability(&from, light)];
        (rate > 0.0 && rate.is_finite()).then_some(LitPoint {
            point,
            sample,
            factor: collision.factor,
            counts,
        })
    }

    /// How many samples of a light are made at distance `t` in this way, for each flight that ends there.
    pub(crate) fn rate(&self, scene: &Scene, light: LightId, t: f32, wl: &Wavelengths) -> f32 {
        let Some(distances) = self.distances(scene, light) else { return 0.0 };
        let Some(collision) = scene.media.collision(self.medium, t, self.carried, wl) else { return 0.0 };
        let chosen = scene.light_selector.probability(&self.middle, light);
        let rate = chosen * distances.pdf(t).value() / collision.pdf.value();
        if rate.is_finite() { rate } else { 0.0 }
    }

    fn distances(&self, scene: &Scene, light: LightId) -> Option<Distances> {
        let (foot, height) = self.seen_from(scene.lights.middle(light)?);
        let is_near = self.ray.t_max.min(height) < self.reach;
        let end = self.ray.t_max;
        (is_near && height > 0.0).then(|| Distances {
            foot,
            end,
            line: warp::Equiangular::new([-foot, end - foot], height),
        })
    }

    /// Distance along the ray of the point nearest to another, and how far that is beside the ray.
    fn seen_from(&self, p: Point) -> (f32, f32) {
        let to_light = p - self.ray.origin;
        let foot = to_light.dot(self.ray.dir.0);
        let height = (to_light - self.ray.dir.0 * foot).length();
        (foot, height.max(LEAST_HEIGHT * to_light.length()))
    }
}

impl Distances {
    fn sample(&self, u: f32) -> f32 {
        (self.foot + self.line.sample(u)).clamp(0.0, self.end)
    }

    fn pdf(&self, t: f32) -> Pdf<Length> {
        self.line.pdf((t - self.foot).clamp(-self.foot, self.end - self.foot))
    }
}
