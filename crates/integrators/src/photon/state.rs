//! Where a gathering walk is, and how an emitter counts that it meets.

use math::{Point, Ray};
use sampling::mis::Heuristic;
use sampling::{Pdf, SolidAngle};
use scene::{LightContext, Scene, Surroundings};
use spectrum::Spectrum;

use crate::common::{DirectionSample, Site, Vertex};

/// How an emitter that the walk meets next counts.
#[derive(Clone, Copy)]
pub(super) enum Before {
    /// In full: nothing but deltas so far.
    Deltas,
    /// Against a light sample from there; so many light samples and directions share the work.
    Rival(LightContext, Pdf<SolidAngle>, [u32; 2]),
    /// Not at all: photons stand for it.
    Photons,
}

/// A walk on its way.
#[derive(Clone, Copy)]
pub(super) struct State {
    pub(super) ray: Ray,
    /// Where the walk last scattered, or its eye.
    pub(super) from: Point,
    /// What the ray starts in.
    pub(super) around: Surroundings,
    pub(super) throughput: Spectrum,
    pub(super) eta_scale: f32,
    /// Scattering events so far.
    pub(super) depth: u32,
    /// The same with those under surfaces.
    pub(super) steps: u32,
    pub(super) before: Before,
    /// It is one of the rays of final gathering.
    pub(super) is_gathering: bool,
}

impl State {
    /// Where the walk is.
    pub(super) fn vertex(&self, site: Site) -> Vertex {
        Vertex {
            site,
            around: self.around,
            throughput: self.throughput,
            forward: 0.0,
            reverse: 0.0,
            is_delta: false,
            events: self.depth + 1,
        }
    }

    /// Leaves a surface.
    pub(super) fn follow(&mut self, scene: &Scene, vertex: &Vertex, s: &DirectionSample, counts: [u32; 2]) {
        let Site::Surface { si, shading } = &vertex.site else { return };
        self.throughput *= s.weight;
        self.eta_scale *= s.eta * s.eta;
        self.depth += 1;
        self.steps += 1;
        self.before = match s.pdf {
            Some(pdf) => Before::Rival(shading.light_context(si), pdf, counts),
            None => self.before.after_delta(),
        };
        let dir = shading.frame.to_world(s.wi);
        self.around = scene.surroundings_after(si, dir, &self.around);
        self.ray = si.spawn_ray(dir);
        self.from = self.ray.origin;
    }
}

impl Before {
    /// The walk scatters by a delta, or under a surface.
    pub(super) fn after_delta(self) -> Self {
        match self {
            Self::Deltas => Self::Deltas,
            Self::Rival(..) | Self::Photons => Self::Photons,
        }
    }

    pub(super) fn weight(&self, light_pdf: impl Fn(&LightContext) -> Pdf<SolidAngle>) -> f32 {
        match self {
            Self::Deltas => 1.0,
            Self::Photons => 0.0,
            Self::Rival(from, pdf, [n_light, n_direction]) => {
                Heuristic::Power.weight(*pdf * *n_direction as f32, light_pdf(from) * *n_light as f32)
            }
        }
    }
}
