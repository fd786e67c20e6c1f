//! What all paths of a pass share where paths of different pixels are joined: wavelengths and the moment. Both follow a
//! sequence over the passes that covers their range evenly.

use math::hash::combine;
use scene::Scene;
use spectrum::Wavelengths;

/// Wavelengths and moment of a pass.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shared {
    pub(crate) wl: Wavelengths,
    /// Of the shutter's interval, in [0, 1).
    pub(crate) u_time: f32,
}

/// Irrational steps whose multiples are far apart, alone and together: roots of x³ = x + 1.
const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];

/// Keeps these numbers apart from those of samplers.
const PASS: u64 = 0x9a55;

impl Shared {
    /// Those of a pass.
    pub(crate) fn of_pass(scene: &Scene, seed: u64, pass: u32) -> Self {
        let u = [0, 1].map(|i| {
            let start = (combine(combine(PASS, seed), i) >> 11) as f64 / (1_u64 << 53) as f64;
            let u = start + f64::from(pass) * STEPS[i as usize];
            ((u - u.floor()) as f32).min(1.0 - f32::EPSILON)
        });
        let wl = if scene.settings().spectral { Wavelengths::sample_visible(u[0]) } else { Wavelengths::RGB };
        Self { wl, u_time: u[1] }
    }
}
