//! A walk of path tracing on its way: where it is and what it has found.

use math::{Point, Ray};
use sampling::{Pdf, Sampler, SolidAngle};
use scene::{LightContext, Scene, Shading, SurfaceInteraction, Surroundings};
use spectrum::{Spectrum, Wavelengths};

use crate::Counters;
use crate::common::{DirectionSample, Gathered, LitFlight, sample_guided};
use crate::guide::{LocalGuide, RecordedPath, Step};

/// A walk on its way.
pub(crate) struct Walker<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) wl: &'a mut Wavelengths,
    pub(crate) sampler: &'a mut Sampler,
    pub(crate) counters: &'a mut Counters,
    /// Where it goes next.
    pub(crate) ray: Ray,
    /// Where it last scattered, or its eye: borders of media do not count.
    pub(crate) from: Point,
    /// What the ray starts in.
    pub(crate) around: Surroundings,
    /// Scattering events so far.
    pub(crate) depth: u32,
    /// The same with what happened under surfaces.
    pub(crate) steps: u32,
    pub(crate) throughput: Spectrum,
    /// What it has found.
    pub(crate) radiance: Gathered,
    /// Where it writes down what a guide learns from.
    pub(crate) recorded: Option<&'a mut RecordedPath>,
    /// What roulette looks at without a guide: the throughput, but for what the camera began with.
    pub(crate) carried: Spectrum,
    /// What a guide expected of the whole path at the first surface where it knew.
    pub(crate) expected: Option<f32>,
    pub(crate) eta_scale: f32,
    pub(crate) previous: Previous,
    /// The last surface, if light that it gets from others of its class was had by the shortcut.
    pub(crate) shortcut_from: Option<(SurfaceInteraction, Shading)>,
}

/// Where the walk came from: what a light sample there would have competed with.
pub(crate) struct Previous {
    /// `None` after the camera or a delta: nothing competes.
    pub(crate) rival: Option<(LightContext, Pdf<SolidAngle>)>,
    /// The flight that came there and how far it went, if points on it were lit by equal angles.
    pub(crate) flight: Option<(LitFlight, f32)>,
}

impl<'a> Walker<'a> {
    /// At the eye.
    pub(crate) fn new(
        scene: &'a Scene,
        (ray, wl): (Ray, &'a mut Wavelengths),
        sampler: &'a mut Sampler,
        counters: &'a mut Counters,
    ) -> Self {
        Self {
            scene,
            wl,
            sampler,
            counters,
            ray,
            from: ray.origin,
            around: scene.camera_surroundings(),
            depth: 0,
            steps: 0,
            throughput: Spectrum::ONE,
            radiance: Gathered::default(),
            recorded: None,
            carried: Spectrum::ONE,
            expected: None,
            eta_scale: 1.0,
            previous: Previous { rival: None, flight: None },
            shortcut_from: None,
        }
    }

    /// What it has found, when it is done.
    pub(crate) fn radiance(&self) -> Spectrum {
        self.radiance.radiance(self.wl)
    }

    /// What roulette pays the walk; false if it ends.
    pub(crate) fn pay(&mut self, paid: Option<f32>) -> bool {
        self.throughput *= paid.unwrap_or(0.0);
        self.carried *= paid.unwrap_or(0.0);
        paid.is_some()
    }

    pub(crate) fn add(&mut self, light: Spectrum) {
        self.radiance.add(self.throughput * light, false);
    }
}

/// A direction of the mixture with a guide, which the walk takes and writes down.
pub(crate) fn guided(
    walk: &mut Walker<'_>,
    si: &SurfaceInteraction,
    shading: &Shading,
    guide: &LocalGuide<'_>,
) -> Option<DirectionSample> {
    let wo = shading.frame.to_local(si.wo);
    let sampled = sample_guided(guide, shading, wo, walk.sampler);
    if sampled.is_none()
        && let Some(recorded) = &mut walk.recorded
    {
        recorded.push(Step::end(si.p));
    }
    let (s, bsdf_pdf) = sampled?;
    walk.throughput *= s.weight;
    let radiance = walk.radiance();
    if let (Some(recorded), Some(pdf)) = (&mut walk.recorded, s.pdf) {
        recorded.push(Step {
            p: si.p,
            w: shading.frame.to_world(s.wi),
            weight: s.weight,
            pdf: pdf.value(),
            bsdf_pdf,
            radiance,
            throughput: walk.throughput,
        });
    }
    Some(s)
}
