//! Next-event estimation: light straight from an emitter to a point; and what its rival, the ray that finds an
//! emitter, must know of it.

use math::Dir;
use sampling::mis::Heuristic;
use sampling::{Pdf, Sampler, SolidAngle};
use scatter::{Density, TransportMode};
use scene::{LightContext, LightId, LightSample, Scene, Shading, SurfaceInteraction, Surroundings};
use spectrum::{Spectrum, Wavelengths};

use super::{DirectionSampling, MediumPoint};
use crate::Counters;
use crate::guide::LocalGuide;

/// Does next-event estimation share the work with rays that find emitters?
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LightStrategy {
    /// Alone: rays that find an emitter count only where no light sample could have.
    Alone,
    /// Weighted by a heuristic.
    Mis(Heuristic),
}

/// A surface that light may reach.
#[derive(Clone, Copy)]
pub(crate) struct DirectLight<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) si: &'a SurfaceInteraction,
    pub(crate) shading: &'a Shading,
    /// What the path came through to the surface.
    pub(crate) around: Surroundings,
    /// How the rival draws its directions.
    pub(crate) directions: DirectionSampling,
    /// What the rival mixes them with.
    pub(crate) guide: Option<LocalGuide<'a>>,
    /// How many light samples and direction samples share the estimate.
    pub(crate) counts: [u32; 2],
}

/// What light samples are made with.
pub(crate) struct Tools<'a> {
    pub(crate) sampler: &'a mut Sampler,
    pub(crate) wl: &'a Wavelengths,
    pub(crate) counters: &'a mut Counters,
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
        self.sample_stratum(strategy, [0, 1], &mut Tools { sampler, wl, counters })
    }

    /// All light samples that [`DirectLight::counts`] says, whose choices of a light are in strata: as the tree of lights
    /// goes, they are dealt to its branches, and far branches share one [Yuksel2019].
    pub(crate) fn sample_all(&self, strategy: LightStrategy, tools: &mut Tools<'_>) -> Spectrum {
        let n = self.counts[0];
        (0..n).map(|i| self.sample_stratum(strategy, [i, n], tools)).sum()
    }

    fn sample_stratum(&self, strategy: LightStrategy, stratum: [u32; 2], tools: &mut Tools<'_>) -> Spectrum {
        let ctx = self.shading.light_context(self.si);
        let Some((sample, chosen)) = tools.light_sample(self.scene, &ctx, stratum) else {
            return Spectrum::ZERO;
        };
        self.contribution(&ctx, &sample, chosen, strategy, tools)
    }

    /// What a given light sample, chosen with probability `chosen`, contributes.
    pub(crate) fn contribution(
        &self,
        ctx: &LightContext,
        sample: &LightSample,
        chosen: f32,
        strategy: LightStrategy,
        tools: &mut Tools<'_>,
    ) -> Spectrum {
        let frame = &self.shading.frame;
        let (wo, wi) = (frame.to_local(self.si.wo), frame.to_local(sample.wi));
        let bsdf = &self.shading.bsdf;
        let (f, rival) = self.directions.eval_pdf(bsdf, wo, wi, TransportMode::Radiance);
        let rival = self.guide.map_or(rival, |guide| guide.mixed(rival, sample.wi));
        let reflected = f * sample.li * wi.abs_cos_theta();
        if reflected.is_black() {
            return Spectrum::ZERO;
        }
        let [n_light, n_direction] = self.counts.map(|n| n as f32);
        let weight = weight_of_sample(sample.density, strategy, [chosen * n_light, 0.0], rival * n_direction);
        tools.counters.rays += 1;
        if self.scene.is_empty_space() {
            return match weight.is_finite() && self.scene.unoccluded(ctx, sample) {
                true => reflected * weight,
                false => Spectrum::ZERO,
            };
        }
        let around = self.scene.surroundings_after(self.si, sample.wi, &self.around);
        reflected * tools.arriving(self.scene, (ctx, sample), &around, weight)
    }
}

/// Light straight from emitters to a point of a medium, in its surroundings: phase function × Le / p of one light sample,
/// weighted. `rate` tells how many samples of a light others make there.
pub(crate) fn direct_in_medium(
    scene: &Scene,
    (point, around): (&MediumPoint, &Surroundings),
    (strategy, rate): (LightStrategy, impl FnOnce(LightId) -> f32),
    tools: &mut Tools<'_>,
) -> Spectrum {
    let ctx = point.light_context();
    let Some((sample, chosen)) = tools.light_sample(scene, &ctx, [0, 1]) else { return Spectrum::ZERO };
    scatter_sample(scene, (point, around), &sample, (strategy, [chosen, rate(sample.light)]), tools)
}

/// What a light sample contributes at a point of a medium. So many are made of its light in this way and in others.
pub(crate) fn scatter_sample(
    scene: &Scene,
    (point, around): (&MediumPoint, &Surroundings),
    sample: &LightSample,
    (strategy, counts): (LightStrategy, [f32; 2]),
    tools: &mut Tools<'_>,
) -> Spectrum {
    let rival = point.phase.pdf(point.wo, sample.wi);
    let scattered = sample.li * rival.value();
    if scattered.is_black() {
        return Spectrum::ZERO;
    }
    let weight = weight_of_sample(sample.density, strategy, counts, rival);
    tools.counters.rays += 1;
    scattered * tools.arriving(scene, (&point.light_context(), sample), around, weight)
}

impl Tools<'_> {
    /// A light sample and the probability of its light, which is chosen in stratum `i` of `n`.
    fn light_sample(
        &mut self,
        scene: &Scene,
        ctx: &LightContext,
        [i, n]: [u32; 2],
    ) -> Option<(LightSample, f32)> {
        let u = self.sampler.next_1d_if(scene.light_selector.has_choice());
        let u_place = self.sampler.next_2d();
        let u_light = ((i as f32 + u) / n as f32).min(1.0 - 0.5 * f32::EPSILON);
        let (light, chosen) = scene.light_selector.select(ctx, u_light)?;
        scene.lights.sample(light, ctx, u_place, self.wl).map(|s| (s, chosen))
    }

    /// `weight` times what gets through from a light sample to a point.
    fn arriving(
        &mut self,
        scene: &Scene,
        (ctx, sample): (&LightContext, &LightSample),
        around: &Surroundings,
        weight: f32,
    ) -> Spectrum {
        if !weight.is_finite() {
            return Spectrum::ZERO;
        }
        let ray = scene.shadow_ray(ctx, sample);
        scene.transmittance(&ray, around, self.wl, &mut || self.sampler.next_1d()) * weight
    }
}

/// Weight over density of a light sample, of which `expected` are made and `others` in other ways, against the `rival` that
/// finds emitters by rays.
fn weight_of_sample(
    density: Density,
    strategy: LightStrategy,
    [expected, others]: [f32; 2],
    rival: Pdf<SolidAngle>,
) -> f32 {
    let heuristic = match strategy {
        LightStrategy::Alone => Heuristic::Balance,
        LightStrategy::Mis(h) => h,
    };
    let (share, together) = heuristic.beside(others / expected);
    match (density, strategy) {
        (Density::Delta { probability }, _) => share / (probability * expected),
        (Density::Smooth(pdf), LightStrategy::Alone) => share / (pdf * expected).value(),
        (Density::Smooth(pdf), LightStrategy::Mis(h)) => {
            let (pdf, all) = (pdf * expected, pdf * (expected * together));
            share * h.weight(all, rival) / pdf.value()
        }
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
