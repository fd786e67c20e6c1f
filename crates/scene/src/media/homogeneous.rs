//! The same everywhere: everything in closed form.

use math::{Ray, trig};
use sampling::Pdf;
use spectrum::{Spectrum, SpectrumValue, Wavelengths};

use super::{Collision, Flight, lane_weights};

/// A medium that is the same everywhere.
#[derive(Clone, Debug)]
pub(super) struct Homogeneous {
    /// In 1/length.
    pub(super) sigma_a: SpectrumValue,
    /// In 1/length.
    pub(super) sigma_s: SpectrumValue,
    /// Radiance, times absorption per length.
    pub(super) le: SpectrumValue,
}

impl Homogeneous {
    pub(super) fn emits(&self) -> bool {
        !self.le.is_black() && !self.sigma_a.is_black()
    }

    pub(super) fn coefficients(&self, wl: &Wavelengths) -> [Spectrum; 2] {
        [self.sigma_a.eval(wl), self.sigma_s.eval(wl)]
    }

    pub(super) fn pass(&self, ray: &Ray, wl: &Wavelengths) -> Flight {
        let [sigma_a, sigma_s] = self.coefficients(wl);
        let sigma_t = sigma_a + sigma_s;
        Flight {
            scatters_at: None,
            factor: transmittance(sigma_t, ray.t_max),
            emitted: self.emitted(sigma_a, sigma_t, ray.t_max, wl),
        }
    }

    pub(super) fn fly(
        &self,
        ray: &Ray,
        carried: Spectrum,
        wl: &Wavelengths,
        u: &mut impl FnMut() -> f32,
    ) -> Flight {
        let [sigma_a, sigma_s] = self.coefficients(wl);
        let sigma_t = sigma_a + sigma_s;
        let weights = lane_weights(carried, wl);
        let sum: f32 = weights.iter().sum();
        let scatters = |(w, s): (&f32, f32)| *w > 0.0 && s > 0.0;
        if sum <= 0.0 || !weights.iter().zip(sigma_s.lanes()).any(scatters) {
            return self.pass(ray, wl);
        }
        let emitted = self.emitted(sigma_a, sigma_t, ray.t_max, wl);

        // One coefficient for all lanes that count: exponentials cancel.
        let sigma = sigma_t.lanes();
        let own = (0..4).find(|&i| weights[i] > 0.0).unwrap_or(0);
        if (0..4).all(|i| weights[i] <= 0.0 || sigma[i] == sigma[own]) {
            let t = exponential(u(), sigma[own]);
            return match t < ray.t_max {
                true => Flight { scatters_at: Some(t), factor: sigma_s.safe_div(sigma_t), emitted },
                false => Flight { emitted, ..Flight::EMPTY },
            };
        }

        // A lane draws the distance for all.
        let mut rest = u() * sum;
        let mut lane = own;
        for (i, w) in weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
            lane = i;
            if rest < *w {
                break;
            }
            rest -= w;
        }
        let t = exponential(u(), sigma[lane]);
        let passed = transmittance(sigma_t, t.min(ray.t_max));
        let mean = |of: [f32; 4]| weights.iter().zip(of).map(|(w, x)| w * x).sum::<f32>() / sum;
        if t < ray.t_max {
            let density = mean((passed * sigma_t).lanes());
            return Flight { scatters_at: Some(t), factor: passed * sigma_s / density, emitted };
        }
        Flight { scatters_at: None, factor: passed / mean(passed.lanes()), emitted }
    }

    /// See [`super::Media::collision`].
    pub(super) fn collision(&self, t: f32, carried: Spectrum, wl: &Wavelengths) -> Option<Collision> {
        let [sigma_a, sigma_s] = self.coefficients(wl);
        let sigma_t = sigma_a + sigma_s;
        let weights = lane_weights(carried, wl);
        let sum: f32 = weights.iter().sum();
        if sum <= 0.0 || !weights.iter().zip(sigma_s.lanes()).any(|(w, s)| *w > 0.0 && s > 0.0) {
            return None;
        }
        let sigma = sigma_t.lanes();
        let own = (0..4).find(|&i| weights[i] > 0.0).unwrap_or(0);
        if (0..4).all(|i| weights[i] <= 0.0 || sigma[i] == sigma[own]) {
            let density = sigma[own] * trig::exp(-sigma[own] * t);
            let factor = sigma_s.safe_div(sigma_t);
            return (density > 0.0).then(|| Collision { factor, pdf: Pdf::new(density) });
        }
        let passed = transmittance(sigma_t, t);
        let density = weights.iter().zip((passed * sigma_t).lanes()).map(|(w, x)| w * x).sum::<f32>() / sum;
        let is_possible = density > 0.0 && density.is_finite();
        is_possible.then(|| Collision { factor: passed * sigma_s / density, pdf: Pdf::new(density) })
    }

    /// `∫ σ_a L_e e^{−σ_t x} dx` over the distance.
    fn emitted(&self, sigma_a: Spectrum, sigma_t: Spectrum, distance: f32, wl: &Wavelengths) -> Spectrum {
        if self.le.is_black() {
            return Spectrum::ZERO;
        }
        let integral = sigma_t.map(|s| {
            let tau = s * distance;
            if s <= 0.0 {
                0.0
            } else if tau < 1e-3 {
                distance * (1.0 - tau * (0.5 - tau / 6.0))
            } else {
                (1.0 - trig::exp(-tau)) / s
            }
        });
        self.le.eval(wl) * sigma_a * integral
    }
}

/// Distance with density σ e^{−σ t}; infinite where there is nothing.
fn exponential(u: f32, sigma: f32) -> f32 {
    if sigma > 0.0 { -trig::ln(1.0 - u) / sigma } else { f32::INFINITY }
}

/// e^{−σ d}; one where there is nothing, however far.
fn transmittance(sigma_t: Spectrum, distance: f32) -> Spectrum {
    sigma_t.map(|s| if s > 0.0 { trig::exp(-s * distance) } else { 1.0 })
}
