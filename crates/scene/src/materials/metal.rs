//! Metals in RGB: three indices whose reflectances are right, in place of three averages of indices.
//!
//! Reflectance is far from linear in η and k, so that the averages of gold's η and k are not gold: the reflectance
//! at normal incidence is averaged in their place, and k is what gives it together with the averaged η.

use spectrum::{ColorPipeline, SpectralCurve, SpectrumValue};

/// η and k for RGB mode of a metal with these curves, relative to the vacuum.
pub(super) fn rgb_metal(eta: &SpectralCurve, k: &SpectralCurve, colors: ColorPipeline) -> [SpectrumValue; 2] {
    let points: Vec<f32> =
        (360..=830).flat_map(|l| [l as f32, reflectance(eta.eval(l as f32), k.eval(l as f32))]).collect();
    let Ok(reflectances) = SpectralCurve::from_interleaved(&points) else {
        return [colors.unbounded(eta), colors.unbounded(k)];
    };
    let mean_eta = eta.average_rgb(colors.space);
    let f0 = reflectances.reflectance_rgb(colors.space);
    let lanes = [0, 1, 2].map(|i| indices(mean_eta[i].max(0.0), f0[i].clamp(0.0, 0.9999)));
    let value = |rgb: [f32; 3]| colors.unbounded(&SpectralCurve::RgbUnbounded { space: colors.space, rgb });
    [value(lanes.map(|l| l.0)), value(lanes.map(|l| l.1))]
}

/// `((η − 1)² + k²) / ((η + 1)² + k²)`.
fn reflectance(eta: f32, k: f32) -> f32 {
    let (near, far) = ((eta - 1.0) * (eta - 1.0), (eta + 1.0) * (eta + 1.0));
    (near + k * k) / (far + k * k)
}

/// η and k with this reflectance: the η asked for, unless it alone reflects more; then η without k.
fn indices(eta: f32, f0: f32) -> (f32, f32) {
    let k2 = (f0 * (eta + 1.0) * (eta + 1.0) - (eta - 1.0) * (eta - 1.0)) / (1.0 - f0);
    if k2 >= 0.0 {
        return (eta, k2.sqrt());
    }
    let root = f0.sqrt();
    ((1.0 + root) / (1.0 - root), 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use spectrum::{ColorMode, ColorSpace, Wavelengths};

    const RGB: ColorPipeline = ColorPipeline::new(ColorMode::Rgb, ColorSpace::Srgb);

    #[test]
    fn indices_give_their_reflectance() {
        for (eta, f0) in [(0.2, 0.95), (1.5, 0.04), (1.5, 0.5), (3.0, 0.1)] {
            let (n, k) = indices(eta, f0);
            assert!((reflectance(n, k) - f0).abs() < 1e-6, "{eta} {f0}: {n} {k}");
        }
        assert!(indices(1.0, 1.0 - 1e-4).1.is_finite());
    }

    #[test]
    fn gold_has_the_colour_of_its_spectrum() {
        let [eta, k] = ["metal-Au-eta", "metal-Au-k"].map(|n| SpectralCurve::named(n).unwrap());
        let [n, k2] = rgb_metal(&eta, &k, RGB).map(|v| v.eval(&Wavelengths::RGB).rgb());
        let points: Vec<f32> =
            (360..=830).flat_map(|l| [l as f32, reflectance(eta.eval(l as f32), k.eval(l as f32))]).collect();
        let exact = SpectralCurve::from_interleaved(&points).unwrap().reflectance_rgb(ColorSpace::Srgb);
        for i in 0..3 {
            assert!((reflectance(n[i], k2[i]) - exact[i].min(0.9999)).abs() < 1e-3, "{exact:?} {n:?} {k2:?}");
        }
        // Gold: much red, some green, little blue.
        assert!(exact[0] > 0.95 && (0.6..0.85).contains(&exact[1]) && exact[2] < 0.45, "{exact:?}");
    }
}
