//! The seam between stated colours and paths: what a curve is worth at a path's four lanes.
//!
//! In RGB mode a value is three numbers in the film's colour space; in spectral mode, a table or a sigmoid. The role of
//! a colour decides how: reflectances are limited to [0, 1] and seen under the film's white; lights keep their
//! illuminant; everything else (indices, cross-sections) is averaged.

use std::sync::Arc;

use crate::{
    ColorSpace, DenseSpectrum, RgbToSpectrumTable, SigmoidPolynomial, SpectralCurve, Spectrum, Wavelengths,
};

/// What the lanes of all paths are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColorMode {
    /// Linear R, G and B.
    #[default]
    Rgb,
    /// Four wavelengths.
    Spectral,
}

/// Turns stated colours into [`SpectrumValue`]s for one render.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ColorPipeline {
    /// What the lanes are.
    pub mode: ColorMode,
    /// The film's colour space: the meaning of the lanes in RGB mode.
    pub space: ColorSpace,
}

/// A colour at any wavelengths. Cheap to clone and to evaluate.
#[derive(Clone, Debug, PartialEq)]
pub struct SpectrumValue(Kind);

#[derive(Clone, Debug, PartialEq)]
enum Kind {
    /// RGB mode.
    Rgb(Spectrum),
    Constant(f32),
    Sigmoid {
        scale: f32,
        polynomial: SigmoidPolynomial,
    },
    Light {
        scale: f32,
        polynomial: SigmoidPolynomial,
        space: ColorSpace,
    },
    Dense {
        scale: f32,
        table: Arc<DenseSpectrum>,
    },
}

impl SpectrumValue {
    /// Zero everywhere.
    pub const ZERO: Self = Self(Kind::Constant(0.0));

    /// The same at all wavelengths and in R, G and B.
    #[must_use]
    pub const fn constant(value: f32) -> Self {
        Self(Kind::Constant(value))
    }

    /// The value at a path's lanes.
    #[must_use]
    pub fn eval(&self, wavelengths: &Wavelengths) -> Spectrum {
        match &self.0 {
            Kind::Rgb(lanes) => *lanes,
            Kind::Constant(c) => Spectrum::splat(*c),
            Kind::Sigmoid { scale, polynomial } => sigmoid(*scale, polynomial, wavelengths),
            Kind::Light { scale, polynomial, space } => {
                sigmoid(*scale, polynomial, wavelengths) * table(1.0, space.illuminant(), wavelengths)
            }
            Kind::Dense { scale, table: t } => table(*scale, t, wavelengths),
        }
    }

    /// The value times a number.
    #[must_use]
    pub fn scaled(mut self, factor: f32) -> Self {
        match &mut self.0 {
            Kind::Rgb(lanes) => *lanes *= factor,
            Kind::Constant(c) => *c *= factor,
            Kind::Sigmoid { scale, .. } | Kind::Light { scale, .. } | Kind::Dense { scale, .. } => {
                *scale *= factor
            }
        }
        self
    }

    /// Zero at every wavelength?
    #[must_use]
    pub fn is_black(&self) -> bool {
        match &self.0 {
            Kind::Rgb(lanes) => lanes.is_black(),
            Kind::Constant(c) => *c == 0.0,
            Kind::Sigmoid { scale, .. } | Kind::Light { scale, .. } => *scale == 0.0,
            Kind::Dense { scale, table } => *scale == 0.0 || table.values().iter().all(|v| *v == 0.0),
        }
    }

    /// The same in every lane? A refractive index that is so has no dispersion.
    #[must_use]
    pub fn is_constant(&self) -> bool {
        match &self.0 {
            Kind::Rgb(lanes) => lanes.rgb().iter().all(|c| *c == lanes.rgb()[0]),
            Kind::Constant(_) => true,
            Kind::Sigmoid { scale, polynomial } => {
                *scale == 0.0 || polynomial.coefficients()[..2] == [0.0, 0.0]
            }
            Kind::Light { scale, .. } => *scale == 0.0,
            Kind::Dense { table, .. } => table.values().iter().all(|v| *v == table.values()[0]),
        }
    }

    /// An upper bound over all wavelengths.
    #[must_use]
    pub fn max_value(&self) -> f32 {
        match &self.0 {
            Kind::Rgb(lanes) => lanes.max_component(),
            Kind::Constant(c) => *c,
            Kind::Sigmoid { scale, polynomial } => scale * max_of(polynomial),
            Kind::Light { scale, polynomial, space } => {
                scale * max_of(polynomial) * space.illuminant().max_value()
            }
            Kind::Dense { scale, table } => scale * table.max_value(),
        }
    }
}

impl ColorPipeline {
    /// A render's pipeline.
    #[must_use]
    pub const fn new(mode: ColorMode, space: ColorSpace) -> Self {
        Self { mode, space }
    }

    /// A reflectance or transmittance: limited to [0, 1].
    #[must_use]
    pub fn albedo(&self, curve: &SpectralCurve) -> SpectrumValue {
        match self.mode {
            ColorMode::Rgb => rgb_value(curve.reflectance_rgb(self.space).map(|c| c.clamp(0.0, 1.0)), 0.0),
            ColorMode::Spectral => spectral_value(curve, |v| v.clamp(0.0, 1.0)),
        }
    }

    /// A refractive index, a cross-section, a factor: not negative. In RGB mode the fourth lane is that of G, so that
    /// no lane divides by zero.
    #[must_use]
    pub fn unbounded(&self, curve: &SpectralCurve) -> SpectrumValue {
        match self.mode {
            ColorMode::Rgb => {
                let rgb = curve.average_rgb(self.space).map(|c| c.max(0.0));
                rgb_value(rgb, rgb[1])
            }
            ColorMode::Spectral => spectral_value(curve, |v| v.max(0.0)),
        }
    }

    /// Emitted light: not negative. Its scale is a light's business (see [`crate::photometric`]); in RGB mode what a
    /// space cannot hold is limited to zero.
    #[must_use]
    pub fn illuminant(&self, curve: &SpectralCurve) -> SpectrumValue {
        match self.mode {
            ColorMode::Rgb => rgb_value(curve.emission_rgb(self.space).map(|c| c.max(0.0)), 0.0),
            ColorMode::Spectral => spectral_value(curve, |v| v.max(0.0)),
        }
    }

    /// [`ColorPipeline::albedo`] of an image's linear RGB, at a path's lanes.
    #[must_use]
    pub fn texel_albedo(&self, space: ColorSpace, rgb: [f32; 3], wavelengths: &Wavelengths) -> Spectrum {
        match self.mode {
            ColorMode::Rgb => Spectrum::from_rgb(space.convert(self.space, rgb).map(|c| c.clamp(0.0, 1.0))),
            ColorMode::Spectral => {
                sigmoid(1.0, &RgbToSpectrumTable::of(space).coefficients(rgb), wavelengths)
            }
        }
    }

    /// [`ColorPipeline::unbounded`] of an image's linear RGB, at a path's lanes.
    #[must_use]
    pub fn texel_unbounded(&self, space: ColorSpace, rgb: [f32; 3], wavelengths: &Wavelengths) -> Spectrum {
        match self.mode {
            ColorMode::Rgb => {
                let [r, g, b] = space.convert(self.space, rgb).map(|c| c.max(0.0));
                Spectrum::from_lanes([r, g, b, g])
            }
            ColorMode::Spectral => {
                let (scale, polynomial) = RgbToSpectrumTable::of(space).unbounded(rgb);
                sigmoid(scale, &polynomial, wavelengths)
            }
        }
    }

    /// [`ColorPipeline::illuminant`] of an image's linear RGB, at a path's lanes.
    #[must_use]
    pub fn texel_illuminant(&self, space: ColorSpace, rgb: [f32; 3], wavelengths: &Wavelengths) -> Spectrum {
        match self.mode {
            ColorMode::Rgb => {
                let y = space.illuminant_photometric() as f32;
                Spectrum::from_rgb(space.convert(self.space, rgb).map(|c| c.max(0.0) * y))
            }
            ColorMode::Spectral => {
                let (scale, polynomial) = RgbToSpectrumTable::of(space).unbounded(rgb);
                sigmoid(scale, &polynomial, wavelengths) * table(1.0, space.illuminant(), wavelengths)
            }
        }
    }
}

fn rgb_value([r, g, b]: [f32; 3], fourth: f32) -> SpectrumValue {
    SpectrumValue(Kind::Rgb(Spectrum::from_lanes([r, g, b, fourth])))
}

fn spectral_value(curve: &SpectralCurve, limit: impl Fn(f32) -> f32) -> SpectrumValue {
    SpectrumValue(match curve {
        SpectralCurve::Constant(c) => Kind::Constant(limit(*c)),
        SpectralCurve::RgbAlbedo { space, rgb } => {
            Kind::Sigmoid { scale: 1.0, polynomial: RgbToSpectrumTable::of(*space).coefficients(*rgb) }
        }
        SpectralCurve::RgbUnbounded { space, rgb } if limit(2.0) == 2.0 => {
            let (scale, polynomial) = RgbToSpectrumTable::of(*space).unbounded(*rgb);
            Kind::Sigmoid { scale, polynomial }
        }
        SpectralCurve::RgbIlluminant { space, rgb } if limit(2.0) == 2.0 => {
            let (scale, polynomial) = RgbToSpectrumTable::of(*space).unbounded(*rgb);
            Kind::Light { scale, polynomial, space: *space }
        }
        SpectralCurve::RgbUnbounded { .. }
        | SpectralCurve::RgbIlluminant { .. }
        | SpectralCurve::Piecewise(_)
        | SpectralCurve::Blackbody { .. }
        | SpectralCurve::Planck { .. }
        | SpectralCurve::Daylight { .. } => {
            let dense = curve.tabulate();
            let limited = DenseSpectrum::tabulate(|l| f64::from(limit(dense.eval(l as f32))));
            Kind::Dense { scale: 1.0, table: Arc::new(limited) }
        }
    })
}

fn sigmoid(scale: f32, polynomial: &SigmoidPolynomial, wavelengths: &Wavelengths) -> Spectrum {
    Spectrum(polynomial.eval4(math::Vec4::from_array(wavelengths.lambda())) * scale)
}

fn table(scale: f32, t: &DenseSpectrum, wavelengths: &Wavelengths) -> Spectrum {
    Spectrum::from_lanes(wavelengths.lambda().map(|l| scale * t.eval(l)))
}

/// The largest value over 360 … 830 nm: at an end or at the vertex of the quadratic.
fn max_of(polynomial: &SigmoidPolynomial) -> f32 {
    let [a, b, _] = polynomial.coefficients();
    let vertex = if a < 0.0 { (-b / (2.0 * a)).clamp(0.0, 1.0) } else { 0.0 };
    let at = |t: f32| polynomial.eval(360.0 + 470.0 * t);
    at(0.0).max(at(1.0)).max(at(vertex))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photometric;

    const SRGB: ColorSpace = ColorSpace::Srgb;
    const RGB: ColorPipeline = ColorPipeline::new(ColorMode::Rgb, SRGB);
    const SPECTRAL: ColorPipeline = ColorPipeline::new(ColorMode::Spectral, SRGB);

    fn at(lambda: f32) -> Wavelengths {
        Wavelengths::new([lambda, 400.0, 555.0, 700.0], [1.0; 4])
    }

    #[test]
    fn rgb_mode_keeps_the_films_numbers() {
        let rgb = [0.2, 0.5, 0.9];
        let albedo = RGB.albedo(&SpectralCurve::RgbAlbedo { space: SRGB, rgb }).eval(&Wavelengths::RGB);
        assert_eq!(albedo.lanes(), [0.2, 0.5, 0.9, 0.0]);
        let sigma = RGB.unbounded(&SpectralCurve::RgbUnbounded { space: SRGB, rgb: [3.0, 2.0, 1.0] });
        assert_eq!(sigma.eval(&Wavelengths::RGB).lanes(), [3.0, 2.0, 1.0, 2.0]);
        let curve = SpectralCurve::RgbIlluminant { space: SRGB, rgb: [4.0, 2.0, 1.0] };
        let light = RGB.illuminant(&curve).scaled(1.0 / photometric(&curve)).eval(&Wavelengths::RGB);
        for (a, b) in light.lanes().into_iter().zip([4.0, 2.0, 1.0, 0.0]) {
            assert!((a - b).abs() < 1e-5);
        }
        let wide = ColorPipeline::new(ColorMode::Rgb, ColorSpace::Rec2020);
        let green = wide.albedo(&SpectralCurve::RgbAlbedo { space: SRGB, rgb: [0.0, 1.0, 0.0] });
        assert!(green.eval(&Wavelengths::RGB).rgb()[0] > 0.3);
    }

    #[test]
    fn spectral_values_follow_their_curves() {
        let curves = [
            SpectralCurve::Constant(0.7),
            SpectralCurve::RgbAlbedo { space: SRGB, rgb: [0.9, 0.1, 0.4] },
            SpectralCurve::RgbUnbounded { space: SRGB, rgb: [9.0, 1.0, 4.0] },
            SpectralCurve::RgbIlluminant { space: SRGB, rgb: [9.0, 1.0, 4.0] },
            SpectralCurve::named("metal-Cu-k").unwrap(),
            SpectralCurve::Blackbody { kelvin: 3000.0 },
        ];
        for curve in curves {
            let value = SPECTRAL.unbounded(&curve);
            for l in [370.0, 500.0, 631.0, 829.0] {
                let (a, b) = (value.eval(&at(l)).lanes()[0], curve.eval(l));
                assert!((a - b).abs() <= 2e-5 * b.max(1.0), "{curve:?} {l}: {a} {b}");
                assert!(a <= value.max_value() * 1.000_01);
            }
        }
    }

    #[test]
    fn texels_are_worth_what_curves_are() {
        let rgb = [0.3, 0.8, 0.1];
        let w = at(600.0);
        for p in [RGB, SPECTRAL] {
            let w = if p.mode == ColorMode::Rgb { Wavelengths::RGB } else { w };
            assert_eq!(
                p.texel_albedo(SRGB, rgb, &w),
                p.albedo(&SpectralCurve::RgbAlbedo { space: SRGB, rgb }).eval(&w)
            );
            assert_eq!(
                p.texel_unbounded(SRGB, rgb, &w),
                p.unbounded(&SpectralCurve::RgbUnbounded { space: SRGB, rgb }).eval(&w)
            );
            assert_eq!(
                p.texel_illuminant(SRGB, rgb, &w),
                p.illuminant(&SpectralCurve::RgbIlluminant { space: SRGB, rgb }).eval(&w)
            );
        }
    }

    #[test]
    fn reflectances_are_limited_to_one() {
        let curve = SpectralCurve::from_interleaved(&[360.0, 2.0, 830.0, -1.0]).unwrap();
        for l in [360.0, 500.0, 700.0, 830.0] {
            assert!((0.0..=1.0).contains(&SPECTRAL.albedo(&curve).eval(&at(l)).lanes()[0]));
        }
        assert!(RGB.albedo(&curve).eval(&Wavelengths::RGB).rgb().iter().all(|c| (0.0..=1.0).contains(c)));
    }

    #[test]
    fn dispersion_is_told_from_its_absence() {
        assert!(SPECTRAL.unbounded(&SpectralCurve::Constant(1.5)).is_constant());
        assert!(!SPECTRAL.unbounded(&SpectralCurve::named("glass-SF11").unwrap()).is_constant());
        assert!(RGB.unbounded(&SpectralCurve::Constant(1.5)).is_constant());
        assert!(SpectrumValue::ZERO.is_black() && !SpectrumValue::constant(0.1).is_black());
    }
}
