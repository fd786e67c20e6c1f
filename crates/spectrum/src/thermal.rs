//! Light of hot bodies and of the day: Planck's law and the CIE daylight series.
//!
//! | what                        | source                            |
//! |-----------------------------|-----------------------------------|
//! | constants                   | [CODATA2018], exact since 2019    |
//! | daylight chromaticity, M1 M2| [CIE15], the daylight illuminants |

use math::trig::f64::exp;

/// Planck's constant in J s.
const PLANCK: f64 = 6.626_070_15e-34;
/// The speed of light in m/s.
const LIGHT_SPEED: f64 = 299_792_458.0;
/// Boltzmann's constant in J/K.
const BOLTZMANN: f64 = 1.380_649e-23;
/// Wien's displacement constant in nm K.
const WIEN: f64 = 2.897_771_955e6;
/// The second radiation constant has changed since the daylight illuminants were named: D65 is at 6504 K today.
const DAYLIGHT_KELVIN_RATIO: f64 = 1.4388 / 1.4380;

/// Spectral radiance of a black body, in W m⁻² sr⁻¹ nm⁻¹, at a wavelength in nm; zero at 0 K and below.
#[must_use]
pub fn planck(lambda: f64, kelvin: f64) -> f64 {
    if kelvin <= 0.0 || lambda <= 0.0 {
        return 0.0;
    }
    let l = lambda * 1e-9;
    let exponent = PLANCK * LIGHT_SPEED / (l * BOLTZMANN * kelvin);
    let per_metre = 2.0 * PLANCK * LIGHT_SPEED * LIGHT_SPEED / (l * l * l * l * l * (exp(exponent) - 1.0));
    per_metre * 1e-9
}

/// [`planck`] over its maximum over all wavelengths.
pub(crate) fn planck_normalized(lambda: f64, kelvin: f64) -> f64 {
    let peak = planck(WIEN / kelvin, kelvin);
    if peak > 0.0 { planck(lambda, kelvin) / peak } else { 0.0 }
}

/// Chromaticity (x, y) of the daylight illuminant named by a temperature such as 6500 (whose colour temperature is
/// 6504 K); below 4000 K, where there is no daylight, that of the formula's end.
#[must_use]
pub fn daylight_chromaticity(kelvin: f64) -> [f64; 2] {
    let t = (kelvin * DAYLIGHT_KELVIN_RATIO).clamp(4000.0, 25_000.0);
    let x = if t <= 7000.0 {
        0.244_063 + (0.099_11e3 + (2.967_8e6 - 4.607e9 / t) / t) / t
    } else {
        0.237_040 + (0.247_48e3 + (1.901_8e6 - 2.006_4e9 / t) / t) / t
    };
    [x, -3.0 * x * x + 2.87 * x - 0.275]
}

/// The factors M1 and M2 of the components S1 and S2.
pub(crate) fn daylight_factors(kelvin: f64) -> [f64; 2] {
    let [x, y] = daylight_chromaticity(kelvin);
    let m = 0.0241 + 0.2562 * x - 0.7341 * y;
    [(-1.3515 - 1.7703 * x + 5.9114 * y) / m, (0.0300 - 31.4424 * x + 30.0717 * y) / m]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planck_meets_known_radiances() {
        assert!((planck(500.0, 5000.0) - 12_107.19).abs() < 0.01, "{}", planck(500.0, 5000.0));
        // σ T⁴ / π: the trapezium rule to 0.2 mm.
        let total: f64 = (1..200_000).map(|l| planck(f64::from(l), 5000.0)).sum();
        assert!((total / 1.128_085e7 - 1.0).abs() < 1e-5, "{total}");
        assert_eq!(planck(500.0, 0.0), 0.0);
        assert_eq!(planck(0.001, 1.0), 0.0);
    }

    #[test]
    fn the_normalised_black_body_peaks_at_one_where_wien_says() {
        let l = WIEN / 4000.0;
        assert!((planck_normalized(l, 4000.0) - 1.0).abs() < 1e-12);
        assert!(planck_normalized(l * 1.01, 4000.0) < 1.0 && planck_normalized(l * 0.99, 4000.0) < 1.0);
        assert_eq!(planck_normalized(500.0, -1.0), 0.0);
    }

    #[test]
    fn d65_has_the_standard_chromaticity() {
        let [x, y] = daylight_chromaticity(6500.0);
        assert!((x - 0.3127).abs() < 1e-4 && (y - 0.3290).abs() < 2e-4, "{x} {y}");
        let [x, y] = daylight_chromaticity(5000.0);
        assert!((x - 0.3457).abs() < 2e-4 && (y - 0.3585).abs() < 2e-4, "{x} {y}");
    }
}
