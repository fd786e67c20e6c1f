//! Next-event estimation: light straight from an emitter to a point; and what its rival, the ray that finds an
//! emitter, must know of it.

use math::Dir;
use sampling::mis::Heuristic;
use sampling::{Pdf, Sampler, SolidAngle};
use scatter::{Density, TransportMode};
use scene::{LightContext, LightId, LightSample, Scene, Shading, SurfaceInteraction};
use spectrum::{Spectrum, Wavelengths};

use super::DirectionSampling;
use crate::Counters;

/// Does next-event estimation share the work with rays that find emitters?
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LightStrategy {
    /// Alone: rays that find an emitter count only where no light sample could have.
    Alone,
    /// Weighted by a heuristic.
    Mis(Heuristic),
}

/// A point that light may reach.
#[derive(Clone, Copy)]
pub(crate) struct DirectLight<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) si: &'a SurfaceInteraction,
    pub(crate) shading: &'a Shading,
    /// How the rival draws its directions.
    pub(crate) directions: DirectionSampling,
    /// How many light samples and direction samples share the estimate.
    pub(crate) counts: [u32; 2],
}

impl DirectLight<'_> {
    /// `f cos Le / (n p)` of one light sample, weighted; zero where nothing arrives.
    pub(crate) fn sample(
        &self,
        strategy: LightStrategy,
        sampler: &mut Sampler,
        wl: &Wavelengths,
        counters: &mut Counters,
    ) -> Spectrum {
        let (u_light, u) = (sampler.next_1d(), sampler.next_2d());
        let ctx = self.si.light_context();
        let Some((light, chosen)) = self.scene.light_selector.select(&ctx, u_light) else {
            return Spectrum::ZERO;
        };
        let Some(sample) = self.scene.lights.sample(light, &ctx, u, wl) else {
            return Spectrum::ZERO;
        };
        self.contribution(&ctx, &sample, chosen, strategy, counters)
    }

    /// What a given light sample, chosen with probability `chosen`, contributes.
    pub(crate) fn contribution(
        &self,
        ctx: &LightContext,
        sample: &LightSample,
        chosen: f32,
        strategy: LightStrategy,
        counters: &mut Counters,
    ) -> Spectrum {
        let frame = &self.shading.frame;
        let (wo, wi) = (frame.to_local(self.si.wo), frame.to_local(sample.wi));
        let bsdf = &self.shading.bsdf;
        let (f, rival) = self.directions.eval_pdf(bsdf, wo, wi, TransportMode::Radiance);
        let reflected = f * sample.li * wi.abs_cos_theta();
        if reflected.is_black() {
            return Spectrum::ZERO;
        }
        let [n_light, n_direction] = self.counts.map(|n| n as f32);
        let expected = chosen * n_light;
        let weight = match (sample.density, strategy) {
            (Density::Delta { probability }, _) => 1.0 / (probability * expected),
            (Density::Smooth(pdf), LightStrategy::Alone) => 1.0 / (pdf * expected).value(),
            (Density::Smooth(pdf), LightStrategy::Mis(h)) => {
                let pdf = pdf * expected;
                h.weight(pdf, rival * n_direction) / pdf.value()
            }
        };
        counters.rays += 1;
        if !weight.is_finite() || !self.scene.unoccluded(ctx, sample) {
            return Spectrum::ZERO;
        }
        reflected * weight
    }
}

/// Density with which next-event estimation at `from` would have sampled the surface that a ray found.
pub(crate) fn light_pdf(
    scene: &Scene,
    from: &LightContext,
    light: LightId,
    found: &SurfaceInteraction,
) -> Pdf<SolidAngle> {
    let chosen = scene.light_selector.probability(from, light);
    scene.lights.pdf(light, from, found.p, found.ng, -found.wo) * chosen
}

/// The same for an infinite light in direction `w`.
pub(crate) fn infinite_light_pdf(
    scene: &Scene,
    from: &LightContext,
    light: LightId,
    w: Dir,
) -> Pdf<SolidAngle> {
    let chosen = scene.light_selector.probability(from, light);
    scene.lights.pdf(light, from, from.p, w, w) * chosen
}
