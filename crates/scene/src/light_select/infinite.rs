//! Light from infinity beside the tree: how often it is chosen at all, and which of it. Light through a portal counts only where
//! the portal does not turn its back to the point.

use std::f32::consts::PI;

use math::Point;

use crate::LightId;
use crate::lights::{Lights, Side};

/// Importances of clusters are 4π times the irradiance of a point light and π times that of a surface; between both.
const IRRADIANCE_FROM_IMPORTANCE: f32 = 0.16;

/// All distant and infinite lights that emit.
#[derive(Clone, Debug)]
pub(super) struct InfiniteLights {
    lights: Vec<InfiniteLight>,
    /// Of those that are everywhere.
    everywhere: Present,
    has_portals: bool,
}

#[derive(Clone, Copy, Debug)]
struct InfiniteLight {
    light: LightId,
    /// Half by number and half by irradiance; all together sum to one.
    probability: f32,
    irradiance: f32,
    portal: Option<Side>,
}

/// The lights that a point can get.
#[derive(Clone, Copy, Debug, Default)]
struct Present {
    n: f32,
    probability: f32,
    irradiance: f32,
}

impl Present {
    fn with(self, l: &InfiniteLight) -> Self {
        Self {
            n: self.n + 1.0,
            probability: self.probability + l.probability,
            irradiance: self.irradiance + l.irradiance,
        }
    }
}

impl InfiniteLight {
    fn is_at(&self, p: Point) -> bool {
        self.portal.is_none_or(|side| side.holds(p))
    }
}

impl InfiniteLights {
    pub(super) fn new(lights: &Lights) -> Self {
        let all: Vec<LightId> = lights.ids().filter(|l| lights.is_from_infinity(*l)).collect();
        let disk = PI * lights.world_sphere().1 * lights.world_sphere().1;
        let irradiance: Vec<f32> = all
            .iter()
            // From all around, a plane gets a quarter of the sphere's power per area of its disk.
            .map(|&l| lights.power(l) / disk * if lights.is_delta(l) { 1.0 } else { 0.25 })
            .collect();
        let sum: f32 = irradiance.iter().sum();
        let even = 1.0 / all.len().max(1) as f32;
        let lights: Vec<InfiniteLight> = all
            .iter()
            .zip(irradiance)
            .map(|(&light, irradiance)| InfiniteLight {
                light,
                probability: 0.5 * even + 0.5 * irradiance / sum,
                irradiance,
                portal: lights.portal_side(light),
            })
            .collect();
        let everywhere = lights.iter().filter(|l| l.portal.is_none()).fold(Present::default(), Present::with);
        Self { has_portals: lights.iter().any(|l| l.portal.is_some()), everywhere, lights }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    fn present(&self, p: Point) -> Present {
        match self.has_portals {
            false => self.everywhere,
            true => self.lights.iter().filter(|l| l.is_at(p)).fold(Present::default(), Present::with),
        }
    }

    /// The probability of light from infinity at a point where finite lights have the importance `finite`.
    pub(super) fn share(&self, p: Point, finite: f32) -> f32 {
        if self.lights.is_empty() {
            return 0.0;
        }
        let Present { n, irradiance, .. } = self.present(p);
        if finite <= 0.0 {
            return 1.0;
        }
        if n == 0.0 {
            return 0.0;
        }
        let estimate = finite * IRRADIANCE_FROM_IMPORTANCE;
        0.5 * n / (n + 1.0) + 0.5 * irradiance / (irradiance + estimate)
    }

    pub(super) fn select(&self, p: Point, u: f32) -> Option<(LightId, f32)> {
        let all = self.present(p).probability;
        let mut rest = u * all;
        let mut last = None;
        for l in self.lights.iter().filter(|l| l.is_at(p)) {
            last = Some((l.light, l.probability / all));
            if rest < l.probability {
                break;
            }
            rest -= l.probability;
        }
        last
    }

    /// Among the lights from infinity that come to the point.
    pub(super) fn probability(&self, p: Point, light: LightId) -> f32 {
        let found = self.lights.iter().find(|l| l.light == light && l.is_at(p));
        found.map_or(0.0, |l| l.probability / self.present(p).probability)
    }
}
