//! Path tracing [Kajiya1986]: one walk from the eye per sample, with next-event estimation at every vertex and
//! multiple importance sampling between the two ways of meeting an emitter [Veach1997, ch. 9].
//!
//! Cannot find: light that reaches the eye only over a delta surface from a delta light (caustics of point lights),
//! and in practice hardly any caustic of a small lamp. `bdpt`, `photon`, `sppm` and `vcm` do.
//!
//! Through media by free flights (see `scene::Media`), with next-event estimation by the phase function at every
//! collision. Weights compare densities of directions alone; transmittances are left out of both sides. With `equiangular`
//! every flight is lit by one light at a second distance too (see `common::lit_flight`).
//!
//! Without `shadow_rays` the walk alone finds emitters; delta lights are then invisible and contribute nothing.

mod inside;
mod wide;

use accel::Hit;
use sampling::{Pdf, Sampler, SolidAngle};
use scatter::TransportMode;
use scene::{LightContext, Scene, Shading, SurfaceInteraction};
use spectrum::Spectrum;

use self::inside::Event;
use self::wide::PathLoop;
use crate::Integrator;
use crate::common::{
    CameraEstimator, CameraPath, DirectLight, DirectionSample, DirectionSampling, LightStrategy, PathOutput,
    PixelLoop, Roulette, Shared, Tools, infinite_light_pdf, light_pdf, sampler_of,
};
use crate::guide::{Field, LocalGuide};
use crate::parameters::{ParameterInfo, ParameterKind, Parameters, shared};
use crate::registry::{IntegratorInfo, Making, refuses_nothing};
use crate::shortcut::Shortcut;
use crate::walker::{Previous, Walker, guided};

/// For the registry.
pub(crate) const INFO: IntegratorInfo = IntegratorInfo {
    name: "path",
    purpose: "global illumination by random walks from the eye; the robust default",
    misses: "caustics of point lights and of mirrors' delta reflections of them; small caustics converge slowly",
    unbiased: true,
    refuses: refuses_nothing,
    parameters,
    make,
};

/// Parameter: are flights lit by equal angles too?
pub(crate) const EQUIANGULAR: ParameterInfo = ParameterInfo {
    name: "equiangular",
    kind: ParameterKind::Bool(false),
    doc: "in even mist, a second point of every flight is lit, drawn by the angle under which a lamp sees it: for lamps in thin mist",
};

fn parameters() -> Vec<ParameterInfo> {
    vec![
        shared::MAX_DEPTH,
        shared::RR_DEPTH,
        ParameterInfo {
            name: "shadow_rays",
            kind: ParameterKind::Bool(true),
            doc: "next-event estimation at every vertex",
        },
        ParameterInfo {
            name: "mis",
            kind: ParameterKind::Bool(true),
            doc: "weigh shadow rays against rays that find emitters; false: shadow rays alone",
        },
        shared::HEURISTIC,
        ParameterInfo {
            name: "sampling",
            kind: ParameterKind::Choice(DirectionSampling::NAMES),
            doc: "density of the walk's directions (delta lobes always by the BSDF)",
        },
        EQUIANGULAR,
    ]
}

fn make(p: &Parameters, making: &Making<'_>) -> Box<dyn Integrator> {
    let heuristic = shared::heuristic(p);
    let lights = match (p.bool("shadow_rays"), p.bool("mis")) {
        (false, _) => None,
        (true, false) => Some(LightStrategy::Alone),
        (true, true) => Some(LightStrategy::Mis(heuristic)),
    };
    let estimator = Path {
        max_depth: p.limit("max_depth"),
        roulette: Roulette::patient(p.integer("rr_depth")),
        lights,
        directions: DirectionSampling::from_name(p.text("sampling")),
        equiangular: p.bool(EQUIANGULAR.name),
        shortcut: (),
        guide: None,
    };
    Box::new(PathLoop::new(PixelLoop { estimator, sampler: sampler_of(making.sampler, making.seed) }))
}

/// The estimator; a [`Shortcut`] may stand for a part of it.
pub(crate) struct Path<S = ()> {
    pub(crate) max_depth: u32,
    pub(crate) roulette: Roulette,
    /// `None`: no shadow rays.
    pub(crate) lights: Option<LightStrategy>,
    pub(crate) directions: DirectionSampling,
    /// Are flights lit by equal angles too?
    pub(crate) equiangular: bool,
    pub(crate) shortcut: S,
    /// What directions by the BSDF are mixed with.
    pub(crate) guide: Option<Field>,
}

impl<S: Shortcut> CameraEstimator for Path<S> {
    fn shared(&self) -> Option<Shared> {
        self.shortcut.shared()
    }

    fn radiance(
        &self,
        scene: &Scene,
        path: &mut CameraPath,
        sampler: &mut Sampler,
        out: &mut PathOutput<'_>,
    ) -> Spectrum {
        let mut walk = Walker::new(scene, (path.ray, &mut path.wl), sampler, out.counters);
        walk.recorded = out.recorded.as_deref_mut();
        self.walk(&mut walk);
        walk.radiance()
    }
}

impl<S: Shortcut> Path<S> {
    /// The same with another shortcut.
    pub(crate) fn with<T>(&self, shortcut: T) -> Path<T> {
        let Self { max_depth, roulette, lights, directions, equiangular, .. } = *self;
        Path { max_depth, roulette, lights, directions, equiangular, shortcut, guide: None }
    }

    /// Walks from where the walk is, to its end.
    pub(crate) fn walk(&self, walk: &mut Walker<'_>) {
        loop {
            walk.counters.rays += 1;
            let hit = walk.scene.intersect(&walk.ray);
            if !self.arrive(walk, hit) {
                return;
            }
        }
    }

    /// Goes to the nearest surface, which is at `hit`, unless a medium scatters before; a path that leaves the scene may find the
    /// sky. False if the walk ends there.
    #[inline]
    fn arrive(&self, walk: &mut Walker<'_>, hit: Option<Hit>) -> bool {
        if let Some(medium) = walk.around.medium() {
            match self.fly(walk, medium, hit.map_or(f32::INFINITY, |h| h.t)) {
                Event::None => {}
                Event::Scattered => return true,
                Event::End => return false,
            }
        }
        let Some(hit) = hit else {
            walk.add(self.sky(walk));
            return false;
        };
        let si = walk.scene.interaction(&walk.ray, &hit);

        // The walk itself found an emitter.
        walk.add(self.emission(walk, &si));
        let Some(shading) = walk.scene.shade(&si, &walk.around, walk.wl) else {
            // A border of media is no scattering event.
            walk.around = walk.scene.surroundings_after(&si, walk.ray.dir, &walk.around);
            walk.ray = si.spawn_ray(walk.ray.dir);
            return true;
        };
        self.scatter(walk, &si, &shading)
    }

    /// Russian roulette.
    fn survives(&self, walk: &mut Walker<'_>) -> bool {
        let paid = self.roulette.survive(walk.depth, walk.carried, walk.eta_scale, walk.sampler);
        walk.pay(paid)
    }

    /// The same for a guided walk that has come to a surface, by what the guide expects there.
    fn survives_guided(&self, walk: &mut Walker<'_>, guide: &LocalGuide<'_>) -> bool {
        let bring = guide.brightness.map(|b| b * walk.throughput.average());
        let share = match (bring, walk.expected) {
            (Some(here), Some(whole)) => here / whole,
            (_, None) => {
                walk.expected = bring.filter(|&b| b > 0.0);
                1.0
            }
            (None, Some(_)) => 1.0,
        };
        let paid = self.roulette.survive_guided(walk.depth, share, walk.sampler);
        walk.pay(paid)
    }

    /// Light that the surface scatters towards where the walk came from, and the way on; false if there is none.
    pub(crate) fn scatter(&self, walk: &mut Walker<'_>, si: &SurfaceInteraction, shading: &Shading) -> bool {
        if walk.depth >= self.max_depth {
            return false;
        }
        // Of what the surface scatters by its smooth lobes, the shortcut at the last one may have left only a share.
        let share = self.share_left(walk, si, shading);
        if share == 0.0 && !shading.bsdf.has_delta() {
            return false;
        }
        let shortcut = self.take_shortcut(walk, (si, shading), share);
        let goes_on = !shortcut || shading.bsdf.has_delta() || self.shortcut.leaves_something();

        let guide = match &self.guide {
            Some(field) if !shading.bsdf.is_delta_only() => Some(field.at(si.p)),
            _ => None,
        };

        if let Some(guide) = &guide
            && !self.survives_guided(walk, guide)
        {
            return false;
        }

        // Next-event estimation.
        let n_light = if shortcut { self.shortcut.light_samples() } else { 1 };
        if let Some(strategy) = self.lights
            && !shading.bsdf.is_delta_only()
            && share > 0.0
        {
            let here = DirectLight {
                scene: walk.scene,
                si,
                shading,
                around: walk.around,
                directions: self.directions,
                guide,
                counts: [n_light, 1],
            };
            let strategy = if goes_on { strategy } else { LightStrategy::Alone };
            let mut tools = Tools { sampler: walk.sampler, wl: walk.wl, counters: walk.counters };
            let direct = here.sample_all(strategy, &mut tools);
            walk.add(direct * share);
        }
        if !goes_on {
            return false;
        }

        // Continue the walk.
        let s = match &guide {
            Some(guide) => guided(walk, si, shading, guide),
            None => self.unguided(walk, shading, si, share),
        };
        let Some(s) = s.filter(|_| !walk.throughput.is_black()) else { return false };
        walk.eta_scale *= s.eta * s.eta;
        walk.depth += 1;
        walk.steps += 1;
        // One direction for so many light samples.
        walk.previous.rival = s.pdf.map(|pdf| (shading.light_context(si), pdf * (1.0 / n_light as f32)));
        walk.previous.flight = None;
        walk.shortcut_from = if shortcut && s.pdf.is_some() { Some((*si, shading.clone())) } else { None };
        if s.pdf.is_none() && s.wi.0.z < 0.0 && shading.bsdf.as_soft_border().is_some() {
            return self.emerge(walk, si);
        }
        let dir = shading.frame.to_world(s.wi);
        walk.around = walk.scene.surroundings_after(si, dir, &walk.around);
        walk.ray = si.spawn_ray(dir);
        walk.from = walk.ray.origin;
        // A guided walk is asked where it arrives.
        guide.is_some() || self.survives(walk)
    }

    /// A direction by the walk's own density, which it takes.
    fn unguided(
        &self,
        walk: &mut Walker<'_>,
        shading: &Shading,
        si: &SurfaceInteraction,
        share: f32,
    ) -> Option<DirectionSample> {
        let wo = shading.frame.to_local(si.wo);
        let s = self.directions.sample(&shading.bsdf, wo, walk.sampler, TransportMode::Radiance)?;
        let weight = if s.pdf.is_some() { s.weight * share } else { s.weight };
        walk.throughput *= weight;
        walk.carried *= weight;
        Some(s)
    }

    /// What the shortcut at the last surface left of the light that smooth lobes send there from this one.
    fn share_left(&self, walk: &mut Walker<'_>, si: &SurfaceInteraction, shading: &Shading) -> f32 {
        match walk.shortcut_from.take() {
            Some((from, at)) if self.shortcut.takes(&shading.bsdf) => {
                self.shortcut.remainder((&from, &at), si)
            }
            Some(_) | None => 1.0,
        }
    }

    /// Light from surfaces of the shortcut's class, if this is one of them; true if it is in.
    fn take_shortcut(
        &self,
        walk: &mut Walker<'_>,
        (si, shading): (&SurfaceInteraction, &Shading),
        share: f32,
    ) -> bool {
        if !self.shortcut.takes(&shading.bsdf) {
            return false;
        }
        // In the last event, or if nothing is asked for, nothing is left out.
        if walk.depth + 1 == self.max_depth || share == 0.0 {
            return true;
        }
        let Some(light) = self.shortcut.light(walk, si, shading) else { return false };
        walk.radiance.add_scaled(&light, walk.throughput * share);
        true
    }

    /// Emission of a surface that the walk found, weighted against the light sample that could have found it.
    fn emission(&self, walk: &Walker<'_>, si: &SurfaceInteraction) -> Spectrum {
        let Some((light, le)) = si.light.zip(walk.scene.emitted(si, si.wo, walk.wl)) else {
            return Spectrum::ZERO;
        };
        if le.is_black() {
            return Spectrum::ZERO;
        }
        le * self.weight(&walk.previous, |from| {
            light_pdf(walk.scene, from, light, si) * self.with_flight(walk, from, light)
        })
    }

    /// Radiance of all infinite lights along a ray that left the scene.
    fn sky(&self, walk: &Walker<'_>) -> Spectrum {
        let (scene, dir) = (walk.scene, walk.ray.dir);
        let lights = scene.lights.infinite().iter();
        lights
            .map(|&light| {
                let le = scene.lights.infinite_emitted(light, walk.from, dir, walk.wl);
                le * self.weight(&walk.previous, |from| infinite_light_pdf(scene, from, light, dir))
            })
            .sum()
    }

    fn weight(&self, previous: &Previous, light_pdf: impl Fn(&LightContext) -> Pdf<SolidAngle>) -> f32 {
        match (self.lights, &previous.rival) {
            (None, _) | (_, None) => 1.0,
            (Some(LightStrategy::Alone), Some(_)) => 0.0,
            (Some(LightStrategy::Mis(h)), Some((from, pdf))) => h.weight(*pdf, light_pdf(from)),
        }
    }
}
