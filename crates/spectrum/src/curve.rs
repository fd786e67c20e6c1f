//! A spectrum as a scene states it: a number, points, a temperature, or R, G and B.
//!
//! | kind                     | source                                          |
//! |--------------------------|-------------------------------------------------|
//! | black body, daylight     | see `thermal`                                   |
//! | R, G, B as a reflectance | sigmoid of a quadratic [Jakob2019]              |
//! | … beyond one, … as light | a factor times it, times the space's illuminant |
//!
//! Integrals are over 360 … 830 nm in steps of 1 nm.

use std::sync::Arc;

use crate::{ColorSpace, DenseSpectrum, RgbToSpectrumTable, Spectrum, Wavelengths, cie, named, thermal};

/// A spectrum over wavelength.
#[derive(Clone, Debug, PartialEq)]
pub enum SpectralCurve {
    /// The same everywhere.
    Constant(f32),
    /// Straight lines between points.
    Piecewise(Arc<PiecewiseLinear>),
    /// A black body, scaled to a maximum of one over all wavelengths.
    Blackbody {
        /// Temperature in K.
        kelvin: f32,
    },
    /// A black body in W m⁻² sr⁻¹ nm⁻¹.
    Planck {
        /// Temperature in K.
        kelvin: f32,
    },
    /// A CIE daylight; one at 560 nm.
    Daylight {
        /// The nominal temperature: 6500 is D65. Limited to 4000 … 25000.
        kelvin: f32,
    },
    /// A reflectance in [0, 1] that looks like this RGB under the space's white.
    RgbAlbedo {
        /// Of which space.
        space: ColorSpace,
        /// Linear; limited to [0, 1].
        rgb: [f32; 3],
    },
    /// The same for values above one.
    RgbUnbounded {
        /// Of which space.
        space: ColorSpace,
        /// Linear, not negative.
        rgb: [f32; 3],
    },
    /// Light of this RGB: [`SpectralCurve::RgbUnbounded`] times the space's illuminant.
    RgbIlluminant {
        /// Of which space.
        space: ColorSpace,
        /// Linear, not negative.
        rgb: [f32; 3],
    },
}

/// Why a curve cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CurveError {
    /// No points.
    #[error("a spectrum needs at least one pair of wavelength and value")]
    Empty,
    /// A wavelength without its value.
    #[error("{0} numbers are no pairs of wavelength and value")]
    OddCount(usize),
    /// Not a number, or infinite.
    #[error("wavelength {lambda} nm with value {value} is not finite")]
    NotFinite {
        /// In nm.
        lambda: f64,
        /// As given.
        value: f64,
    },
    /// Points out of order.
    #[error("wavelengths must rise, but {next} nm follows {previous} nm")]
    NotRising {
        /// In nm.
        previous: f64,
        /// In nm.
        next: f64,
    },
}

/// What a piecewise linear curve is outside its points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outside {
    Zero,
    Extend,
}

/// Points (λ in nm, value) joined by straight lines.
#[derive(Clone, Debug, PartialEq)]
pub struct PiecewiseLinear {
    points: Box<[(f64, f64)]>,
    outside: Outside,
}

impl PiecewiseLinear {
    /// λ₀ v₀ λ₁ v₁ …, as in files; zero outside.
    ///
    /// # Errors
    /// When there are no pairs, a number is not finite, or the wavelengths do not rise.
    pub fn from_interleaved(numbers: &[f32]) -> Result<Self, CurveError> {
        if numbers.len() % 2 == 1 {
            return Err(CurveError::OddCount(numbers.len()));
        }
        let pairs = numbers.chunks_exact(2).map(|p| (f64::from(p[0]), f64::from(p[1])));
        Self::new(pairs, Outside::Zero)
    }

    pub(crate) fn new(
        points: impl Iterator<Item = (f64, f64)>,
        outside: Outside,
    ) -> Result<Self, CurveError> {
        let points: Box<[(f64, f64)]> = points.collect();
        if points.is_empty() {
            return Err(CurveError::Empty);
        }
        if let Some(&(lambda, value)) = points.iter().find(|(l, v)| !l.is_finite() || !v.is_finite()) {
            return Err(CurveError::NotFinite { lambda, value });
        }
        if let Some(pair) = points.windows(2).find(|p| p[1].0 <= p[0].0) {
            return Err(CurveError::NotRising { previous: pair[0].0, next: pair[1].0 });
        }
        Ok(Self { points, outside })
    }

    /// The points, wavelengths rising.
    #[must_use]
    pub fn points(&self) -> &[(f64, f64)] {
        &self.points
    }

    pub(crate) fn scaled(mut self, factor: f64) -> Self {
        self.points.iter_mut().for_each(|p| p.1 *= factor);
        self
    }

    pub(crate) fn eval64(&self, lambda: f64) -> f64 {
        let after = self.points.partition_point(|p| p.0 <= lambda);
        let last = self.points.len() - 1;
        match self.outside {
            Outside::Zero if lambda < self.points[0].0 || lambda > self.points[last].0 => 0.0,
            Outside::Zero | Outside::Extend => {
                let (a, b) = (self.points[after.saturating_sub(1)], self.points[after.min(last)]);
                if b.0 > a.0 { a.1 + (b.1 - a.1) * (lambda - a.0) / (b.0 - a.0) } else { a.1 }
            }
        }
    }
}

impl SpectralCurve {
    /// λ₀ v₀ λ₁ v₁ … in nm, joined by straight lines; zero outside.
    ///
    /// # Errors
    /// See [`PiecewiseLinear::from_interleaved`].
    pub fn from_interleaved(numbers: &[f32]) -> Result<Self, CurveError> {
        PiecewiseLinear::from_interleaved(numbers).map(|p| Self::Piecewise(Arc::new(p)))
    }

    /// The spectrum of a name such as `metal-Au-eta`, `glass-BK7` or `stdillum-D65`; see [`crate::spectrum_names`].
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        named::find(name)
    }

    /// The value at a wavelength in nm.
    #[must_use]
    pub fn eval(&self, lambda: f32) -> f32 {
        self.evaluator()(f64::from(lambda)) as f32
    }

    /// The values at a path's wavelengths. Spectral mode only: in RGB mode use a [`crate::SpectrumValue`].
    #[must_use]
    pub fn sample(&self, wavelengths: &Wavelengths) -> Spectrum {
        let eval = self.evaluator();
        Spectrum::from_lanes(wavelengths.lambda().map(|l| eval(f64::from(l)) as f32))
    }

    /// The curve from 360 to 830 nm in steps of 1 nm.
    #[must_use]
    pub fn tabulate(&self) -> DenseSpectrum {
        DenseSpectrum::tabulate(self.evaluator())
    }

    /// The same at every wavelength? Then no material has dispersion by it.
    #[must_use]
    pub fn is_constant(&self) -> bool {
        match self {
            Self::Constant(_) => true,
            Self::Piecewise(p) => {
                p.outside == Outside::Extend && p.points.iter().all(|q| q.1 == p.points[0].1)
            }
            Self::RgbAlbedo { rgb, .. } | Self::RgbUnbounded { rgb, .. } => {
                rgb[0] == rgb[1] && rgb[1] == rgb[2]
            }
            Self::Blackbody { .. }
            | Self::Planck { .. }
            | Self::Daylight { .. }
            | Self::RgbIlluminant { .. } => false,
        }
    }

    /// ∫ (x̄, ȳ, z̄) f dλ, in units of the curve times nm.
    #[must_use]
    pub fn to_xyz(&self) -> [f32; 3] {
        self.integrals().map(|c| c as f32)
    }

    /// ∫ ȳ f dλ.
    #[must_use]
    pub fn inner_product_y(&self) -> f64 {
        self.integrals()[1]
    }

    /// RGB of the curve as emitted light: of [`SpectralCurve::to_xyz`], so that divided by [`photometric`] white is one.
    #[must_use]
    pub fn emission_rgb(&self, space: ColorSpace) -> [f32; 3] {
        if let Self::RgbIlluminant { space: own, rgb } = self {
            let y = own.illuminant_photometric() as f32;
            return own.convert(space, *rgb).map(|c| c * y);
        }
        space.rgb_from_xyz64(self.integrals()).map(|c| c as f32)
    }

    /// RGB of the curve as a reflectance under the white of `space`; not limited.
    #[must_use]
    pub fn reflectance_rgb(&self, space: ColorSpace) -> [f32; 3] {
        if let Some(rgb) = self.stated_rgb(space) {
            return rgb;
        }
        let (eval, light) = (self.evaluator(), space.illuminant());
        let lit = |l: f64| eval(l) * f64::from(light.eval(l as f32));
        let white = space.rgb_from_xyz64(cie::integrate(|l| f64::from(light.eval(l as f32))));
        ratio(space.rgb_from_xyz64(cie::integrate(lit)), white)
    }

    /// Averages of the curve with the weights of R, G and B over wavelength: right for what is not a colour, such as
    /// refractive indices and cross-sections. A constant is the same constant in all three. Not limited: the weights
    /// have negative parts.
    #[must_use]
    pub fn average_rgb(&self, space: ColorSpace) -> [f32; 3] {
        if let Some(rgb) = self.stated_rgb(space) {
            return rgb;
        }
        ratio(space.rgb_from_xyz64(self.integrals()), cie::equal_energy_rgb(space))
    }

    /// What needs no integral.
    fn stated_rgb(&self, space: ColorSpace) -> Option<[f32; 3]> {
        match self {
            Self::Constant(c) => Some([*c; 3]),
            Self::RgbAlbedo { space: own, rgb } => Some(own.convert(space, rgb.map(|c| c.clamp(0.0, 1.0)))),
            Self::RgbUnbounded { space: own, rgb } => Some(own.convert(space, *rgb)),
            Self::Piecewise(_)
            | Self::Blackbody { .. }
            | Self::Planck { .. }
            | Self::Daylight { .. }
            | Self::RgbIlluminant { .. } => None,
        }
    }

    fn integrals(&self) -> [f64; 3] {
        cie::integrate(self.evaluator())
    }

    /// The curve as a function of nm, with all that does not depend on wavelength done.
    fn evaluator(&self) -> Box<dyn Fn(f64) -> f64 + '_> {
        match self {
            Self::Constant(c) => Box::new(|_| f64::from(*c)),
            Self::Piecewise(p) => Box::new(|l| p.eval64(l)),
            Self::Blackbody { kelvin } => Box::new(|l| thermal::planck_normalized(l, f64::from(*kelvin))),
            Self::Planck { kelvin } => Box::new(|l| thermal::planck(l, f64::from(*kelvin))),
            Self::Daylight { kelvin } => daylight(f64::from(*kelvin)),
            Self::RgbAlbedo { space, rgb } => {
                let polynomial = RgbToSpectrumTable::of(*space).coefficients(*rgb);
                Box::new(move |l| f64::from(polynomial.eval(l as f32)))
            }
            Self::RgbUnbounded { space, rgb } => {
                let (scale, polynomial) = RgbToSpectrumTable::of(*space).unbounded(*rgb);
                Box::new(move |l| f64::from(scale * polynomial.eval(l as f32)))
            }
            Self::RgbIlluminant { space, rgb } => {
                let (scale, polynomial) = RgbToSpectrumTable::of(*space).unbounded(*rgb);
                let light = space.illuminant();
                Box::new(move |l| f64::from(scale * polynomial.eval(l as f32) * light.eval(l as f32)))
            }
        }
    }
}

/// ∫ ȳ L dλ, by which a reader divides a light's scale so that it is measured in luminance, as pbrt-v4 does; of an RGB
/// illuminant only the illuminant counts, so that its RGB keeps its size.
#[must_use]
pub fn photometric(curve: &SpectralCurve) -> f32 {
    match curve {
        SpectralCurve::RgbIlluminant { space, .. } => space.illuminant_photometric() as f32,
        SpectralCurve::Constant(_)
        | SpectralCurve::Piecewise(_)
        | SpectralCurve::Blackbody { .. }
        | SpectralCurve::Planck { .. }
        | SpectralCurve::Daylight { .. }
        | SpectralCurve::RgbAlbedo { .. }
        | SpectralCurve::RgbUnbounded { .. } => curve.inner_product_y() as f32,
    }
}

/// (S0 + M1 S1 + M2 S2) / 100.
fn daylight(kelvin: f64) -> Box<dyn Fn(f64) -> f64> {
    let [m1, m2] = thermal::daylight_factors(kelvin);
    let parts = ["daylight-S0", "daylight-S1", "daylight-S2"].map(named::illuminant);
    Box::new(move |l| {
        let [s0, s1, s2] = parts.each_ref().map(|p| p.as_ref().map_or(0.0, |p| p.eval64(l)));
        (s0 + m1 * s1 + m2 * s2) * 0.01
    })
}

fn ratio(a: [f64; 3], b: [f64; 3]) -> [f32; 3] {
    [(a[0] / b[0]) as f32, (a[1] / b[1]) as f32, (a[2] / b[2]) as f32]
}

#[cfg(test)]
mod tests {
    use super::*;

    const SRGB: ColorSpace = ColorSpace::Srgb;

    #[test]
    fn points_are_joined_by_lines_and_zero_outside() {
        let c = SpectralCurve::from_interleaved(&[400.0, 1.0, 500.0, 3.0, 600.0, 0.0]).unwrap();
        for (l, v) in [
            (399.0, 0.0),
            (400.0, 1.0),
            (450.0, 2.0),
            (500.0, 3.0),
            (575.0, 0.75),
            (600.0, 0.0),
            (601.0, 0.0),
        ] {
            assert!((c.eval(l) - v).abs() < 1e-6, "{l}: {}", c.eval(l));
        }
        let single = SpectralCurve::from_interleaved(&[500.0, 2.0]).unwrap();
        assert_eq!(single.eval(500.0), 2.0);
        assert_eq!(single.eval(501.0), 0.0);
    }

    #[test]
    fn wrong_points_are_refused_with_a_reason() {
        assert_eq!(SpectralCurve::from_interleaved(&[]), Err(CurveError::Empty));
        assert_eq!(SpectralCurve::from_interleaved(&[1.0]), Err(CurveError::OddCount(1)));
        let falling = SpectralCurve::from_interleaved(&[500.0, 1.0, 400.0, 1.0]).unwrap_err();
        assert_eq!(falling.to_string(), "wavelengths must rise, but 400 nm follows 500 nm");
        assert!(SpectralCurve::from_interleaved(&[500.0, f32::NAN]).is_err());
    }

    #[test]
    fn black_bodies_have_their_published_colour_and_efficacy() {
        let known = [
            (2856.0, [0.447_535, 0.407_428], 1.974_973e7),
            (4000.0, [0.380_440, 0.376_747], 2.528_068e8),
            (6500.0, [0.313_526, 0.323_628], 3.072_519e9),
            (10_000.0, [0.280_634, 0.288_288], 1.326_045e10),
        ];
        for (kelvin, [x, y], luminance) in known {
            let [a, b, c] = SpectralCurve::Planck { kelvin }.integrals();
            assert!((a / (a + b + c) - x).abs() < 2e-6 && (b / (a + b + c) - y).abs() < 2e-6, "{kelvin}");
            assert!((683.002 * b / luminance - 1.0).abs() < 1e-5, "{kelvin}: {}", 683.002 * b);
            let [d, e, f] = SpectralCurve::Blackbody { kelvin }.integrals();
            assert!((a / b - d / e).abs() < 1e-9 && (c / b - f / e).abs() < 1e-9);
        }
    }

    #[test]
    fn daylight_of_6500_is_d65() {
        let (day, table) =
            (SpectralCurve::Daylight { kelvin: 6500.0 }, SpectralCurve::named("stdillum-D65").unwrap());
        let (a, b) = (day.eval(560.0), table.eval(560.0));
        assert!((a - 1.0).abs() < 1e-6);
        for l in [400.0, 450.0, 500.0, 600.0, 700.0] {
            assert!((day.eval(l) / a / (table.eval(l) / b) - 1.0).abs() < 2e-3, "{l}");
        }
    }

    #[test]
    fn a_constant_is_the_same_constant_in_each_channel_but_not_as_light() {
        let c = SpectralCurve::from_interleaved(&[300.0, 1.7, 900.0, 1.7]).unwrap();
        for v in c.average_rgb(SRGB).into_iter().chain(c.reflectance_rgb(SRGB)) {
            assert!((v - 1.7).abs() < 1e-5);
        }
        let light = SpectralCurve::Constant(1.0);
        let rgb = light.emission_rgb(SRGB).map(|v| v / photometric(&light));
        for (a, b) in rgb.into_iter().zip([1.205_07, 0.948_22, 0.908_98]) {
            assert!((a - b).abs() < 1e-4, "{rgb:?}");
        }
    }

    #[test]
    fn rgb_light_over_its_photometric_scale_is_its_rgb() {
        let light = SpectralCurve::RgbIlluminant { space: SRGB, rgb: [3.0, 0.5, 7.0] };
        let rgb = light.emission_rgb(SRGB).map(|v| v / photometric(&light));
        for (a, b) in rgb.into_iter().zip([3.0, 0.5, 7.0]) {
            assert!((a / b - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn averaged_indices_give_metals_their_colour() {
        // Fresnel at normal incidence of averaged n and k, against the average of Fresnel.
        let f0 = |n: f64, k: f64| ((n - 1.0) * (n - 1.0) + k * k) / ((n + 1.0) * (n + 1.0) + k * k);
        for metal in ["Au", "Cu", "Ag", "Al", "CuZn", "Cr"] {
            let curves = ["eta", "k"].map(|s| SpectralCurve::named(&format!("metal-{metal}-{s}")).unwrap());
            let points: Vec<f32> = (360..=830)
                .flat_map(|l| {
                    let [n, k] = curves.each_ref().map(|c| f64::from(c.eval(l as f32)));
                    [l as f32, f0(n, k) as f32]
                })
                .collect();
            let exact = SpectralCurve::from_interleaved(&points).unwrap().reflectance_rgb(SRGB);
            let [n, k] = curves.each_ref().map(|c| c.average_rgb(SRGB));
            for c in 0..3 {
                let averaged = f0(f64::from(n[c]), f64::from(k[c])) as f32;
                // Gold is redder than sRGB can say.
                let exact = exact[c].min(1.0);
                assert!((averaged - exact).abs() < 0.04, "{metal} {c}: {averaged} {exact}");
            }
        }
    }

    #[test]
    fn only_flat_curves_are_constant() {
        assert!(SpectralCurve::Constant(1.5).is_constant());
        assert!(SpectralCurve::named("stdillum-E").unwrap().is_constant());
        assert!(!SpectralCurve::named("glass-BK7").unwrap().is_constant());
        assert!(!SpectralCurve::Blackbody { kelvin: 5000.0 }.is_constant());
    }
}
