//! Temporary, until `light_select/` lands: uniform choice.
use crate::{LightContext, LightId, lights::Lights};
/// Chooses.
#[derive(Debug)]
pub struct LightSelector {
    n: u32,
}
impl LightSelector {
    /// New.
    pub fn new(_: scene_desc::LightSelection, lights: &Lights) -> Self {
        Self { n: lights.len() as u32 }
    }
    /// Choose.
    pub fn select(&self, _: &LightContext, u: f32) -> Option<(LightId, f32)> {
        (self.n > 0).then(|| (LightId(((u * self.n as f32) as u32).min(self.n - 1)), 1.0 / self.n as f32))
    }
    /// Pmf.
    pub fn probability(&self, _: &LightContext, _: LightId) -> f32 {
        1.0 / self.n as f32
    }
}
