//! Light from infinity beside the tree: how often it is chosen at all, and which of it.

use std::f32::consts::PI;

use crate::LightId;
use crate::lights::Lights;

/// Importances of clusters are 4π times the irradiance of a point light and π times that of a surface; between both.
const IRRADIANCE_FROM_IMPORTANCE: f32 = 0.16;

/// All distant and infinite lights that emit.
#[derive(Clone, Debug)]
pub(super) struct InfiniteLights {
    lights: Vec<LightId>,
    /// Probabilities, half by number and half by irradiance.
    probabilities: Vec<f32>,
    /// Sum of irradiances.
    irradiance: f32,
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
        let probabilities = irradiance.iter().map(|e| 0.5 * even + 0.5 * e / sum).collect();
        Self { lights: all, probabilities, irradiance: sum }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    /// The probability of light from infinity, where finite lights have the importance `finite`.
    pub(super) fn share(&self, finite: f32) -> f32 {
        if self.lights.is_empty() {
            return 0.0;
        }
        if finite <= 0.0 {
            return 1.0;
        }
        let n = self.lights.len() as f32;
        let estimate = finite * IRRADIANCE_FROM_IMPORTANCE;
        0.5 * n / (n + 1.0) + 0.5 * self.irradiance / (self.irradiance + estimate)
    }

    pub(super) fn select(&self, u: f32) -> Option<(LightId, f32)> {
        let mut rest = u;
        for (&light, &p) in self.lights.iter().zip(&self.probabilities) {
            if rest < p {
                return Some((light, p));
            }
            rest -= p;
        }
        Some((*self.lights.last()?, *self.probabilities.last()?))
    }

    /// Among the lights from infinity.
    pub(super) fn probability(&self, light: LightId) -> f32 {
        let i = self.lights.iter().position(|&l| l == light);
        i.map_or(0.0, |i| self.probabilities[i])
    }
}
