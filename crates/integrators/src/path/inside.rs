//! What a walk of path tracing does where it is not on a surface: flights through media, and places where light emerges that
//! has entered elsewhere.

use math::Ray;
use scene::{LightContext, LightId, MediumId, SurfaceInteraction};

use super::Path;
use crate::common::{
    Entrance, LightStrategy, LitFlight, MediumPoint, Roulette, Tools, direct_in_medium, scatter_sample,
};
use crate::shortcut::Shortcut;
use crate::walker::Walker;

/// How a flight through a medium ends.
pub(super) enum Event {
    /// At a surface, or nowhere.
    None,
    /// In the medium; the walk goes on.
    Scattered,
    /// The walk does not go on.
    End,
}

impl<S: Shortcut> Path<S> {
    /// Through a medium up to the distance `end`. Where no event may follow, what gets through is had without chance.
    pub(super) fn fly(&self, walk: &mut Walker<'_>, medium: MediumId, end: f32) -> Event {
        let ray = Ray { t_max: end, ..walk.ray };
        let is_interior = walk.scene.media.is_interior(medium);
        let lit = if is_interior { None } else { self.light_flight(walk, &ray, medium) };
        let (media, sampler) = (&walk.scene.media, &mut *walk.sampler);
        let flight = match walk.depth >= self.max_depth && !is_interior {
            true => media.pass(medium, &ray, walk.wl, &mut || sampler.next_1d()),
            false => media.fly(medium, &ray, walk.throughput, walk.wl, &mut || sampler.next_1d()),
        };
        walk.add(flight.emitted);
        walk.throughput *= flight.factor;
        walk.carried *= flight.factor;
        if walk.throughput.is_black() {
            return Event::End;
        }
        let Some(t) = flight.scatters_at else { return Event::None };
        let point = MediumPoint::new(walk.scene, &ray, t, medium);

        // Next-event estimation. Under a surface no lamp is seen.
        if let Some(strategy) = self.lights.filter(|_| !is_interior) {
            let (scene, wl) = (walk.scene, *walk.wl);
            let rate = |light| lit.map_or(0.0, |lit| lit.rate(scene, light, t, &wl));
            let mut tools = Tools { sampler: walk.sampler, wl: &wl, counters: walk.counters };
            let direct = direct_in_medium(scene, (&point, &walk.around), (strategy, rate), &mut tools);
            walk.add(direct);
        }

        // Continue the walk.
        let s = point.phase.sample(point.wo, walk.sampler.next_2d());
        walk.depth += u32::from(!is_interior);
        walk.steps += 1;
        walk.previous.rival = Some((point.light_context(), s.pdf));
        walk.previous.flight = lit.map(|lit| (lit, t));
        walk.shortcut_from = None;
        walk.ray = point.spawn_ray(s.wi);
        walk.from = walk.ray.origin;
        let depth = Roulette::depth_in_medium(walk.steps);
        let paid = self.roulette.survive(depth, walk.carried, walk.eta_scale, walk.sampler);
        if walk.pay(paid) { Event::Scattered } else { Event::End }
    }

    /// Lights a point of a flight, drawn by equal angles; the flight, if there may be such points.
    fn light_flight(&self, walk: &mut Walker<'_>, ray: &Ray, medium: MediumId) -> Option<LitFlight> {
        let strategy = self.lights.filter(|_| self.equiangular && walk.depth < self.max_depth)?;
        let lit = LitFlight::new(walk.scene, ray, (medium, walk.throughput), walk.wl)?;
        if let Some(at) = lit.sample(walk.scene, walk.sampler, walk.wl) {
            let mut tools = Tools { sampler: walk.sampler, wl: walk.wl, counters: walk.counters };
            let place = (&at.point, &walk.around);
            let direct = scatter_sample(walk.scene, place, &at.sample, (strategy, at.counts), &mut tools);
            walk.add(at.factor * direct);
        }
        Some(lit)
    }

    /// How many times as many samples of a light were expected where the walk came from, with those by equal angles.
    pub(super) fn with_flight(&self, walk: &Walker<'_>, from: &LightContext, light: LightId) -> f32 {
        let (Some((lit, t)), Some(LightStrategy::Mis(h))) = (&walk.previous.flight, self.lights) else {
            return 1.0;
        };
        let chosen = walk.scene.light_selector.probability(from, light);
        let ratio = lit.rate(walk.scene, light, *t, walk.wl) / chosen;
        if ratio.is_finite() { h.beside(ratio).1 } else { 1.0 }
    }

    /// Light that has entered a surface over a diffusion profile, from where it leaves again on.
    pub(super) fn emerge(&self, walk: &mut Walker<'_>, si: &SurfaceInteraction) -> bool {
        let entrance = Entrance { scene: walk.scene, si, around: &walk.around, carried: walk.throughput };
        let Some(at) = entrance.emerge(walk.sampler, walk.wl, walk.counters) else { return false };
        walk.throughput *= at.factor;
        walk.carried *= at.factor;
        !walk.throughput.is_black() && self.scatter(walk, &at.si, &at.shading)
    }
}
