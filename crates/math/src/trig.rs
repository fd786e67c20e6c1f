//! Transcendental functions with the same bits on every platform (the `libm` crate; never the system's).

pub use libm::{
    acosf as acos, asinf as asin, atan2f as atan2, atanf as atan, cosf as cos, coshf as cosh, erff as erf,
    exp2f as exp2, expf as exp, log2f as log2, logf as ln, powf as pow, sincosf as sin_cos, sinf as sin,
    sinhf as sinh, tanf as tan, tanhf as tanh,
};

/// Double precision, for tables and builds.
pub mod f64 {
    pub use libm::{
        acos, asin, atan, atan2, cos, cosh, erf, exp, exp2, log as ln, log2, pow, sin, sincos as sin_cos,
        sinh, tan, tanh,
    };
}

/// Sine and cosine of an angle of at most π/4 in size, by Taylor's series: to one unit in the last place, and without the branches
/// of [`sin_cos`].
#[inline]
#[must_use]
pub fn sin_cos_within_an_eighth(x: f32) -> (f32, f32) {
    let t = x * x;
    let sin = x - x * t * (1.0 / 6.0 - t * (1.0 / 120.0 - t * (1.0 / 5040.0 - t * (1.0 / 362_880.0))));
    let cos = t * (1.0 / 24.0 - t * (1.0 / 720.0 - t * (1.0 / 40_320.0 - t * (1.0 / 3_628_800.0))));
    (sin, 1.0 - t * (0.5 - cos))
}

/// arcsine of a value that rounding may have pushed past ±1.
#[must_use]
pub fn safe_asin(x: f32) -> f32 {
    asin(x.clamp(-1.0, 1.0))
}

/// arccosine of a value that rounding may have pushed past ±1.
#[must_use]
pub fn safe_acos(x: f32) -> f32 {
    acos(x.clamp(-1.0, 1.0))
}

/// The inverse of `erf` on [−1, 1], to about three units in the last place near zero and 1e-6 near the ends; ±1 gives
/// a finite number beyond all others [Giles2010].
#[must_use]
#[allow(clippy::excessive_precision, reason = "as published")]
pub fn erf_inv(x: f32) -> f32 {
    const CENTER: [f32; 9] = [
        2.810_226_36e-08,
        3.432_739_39e-07,
        -3.523_387_7e-06,
        -4.391_506_54e-06,
        0.000_218_580_87,
        -0.001_253_725_03,
        -0.004_177_681_640,
        0.246_640_727,
        1.501_409_41,
    ];
    const TAIL: [f32; 9] = [
        -0.000_200_214_257,
        0.000_100_950_558,
        0.001_349_343_22,
        -0.003_673_428_44,
        0.005_739_507_73,
        -0.007_622_461_3,
        0.009_438_870_47,
        1.001_674_06,
        2.832_976_82,
    ];
    let x = x.clamp(-1.0 + 6e-8, 1.0 - 6e-8);
    let w = -ln((1.0 - x) * (1.0 + x));
    let (w, coefficients) = if w < 5.0 { (w - 2.5, CENTER) } else { (w.sqrt() - 3.0, TAIL) };
    coefficients.iter().fold(0.0, |p, c| p * w + c) * x
}

/// Square root of a value that rounding may have pushed below zero.
#[must_use]
pub fn safe_sqrt(x: f32) -> f32 {
    x.max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_angles_have_the_sines_of_all_angles() {
        for i in -1000..=1000 {
            let x = std::f32::consts::FRAC_PI_4 * i as f32 / 1000.0;
            let ((s, c), (sin, cos)) = (sin_cos_within_an_eighth(x), sin_cos(x));
            assert!((s - sin).abs() <= 1.2e-7 * sin.abs() && (c - cos).abs() <= 1.2e-7, "{x}: {s} {c}");
        }
    }

    #[test]
    fn erf_inv_undoes_erf() {
        for i in -99..=99 {
            let x = i as f32 / 100.0;
            assert!((erf(erf_inv(x)) - x).abs() < 1e-6, "{x}: {}", erf(erf_inv(x)));
        }
        assert!(erf_inv(1.0).is_finite() && erf_inv(-1.0) == -erf_inv(1.0) && erf_inv(0.0) == 0.0);
    }
}
