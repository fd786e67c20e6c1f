//! From a path's lanes to the film's R, G and B: an ideal CIE sensor.
//!
//! XYZ is the mean over the lanes of L (x̄, ȳ, z̄) / p(λ), in the units in which lights are measured: a light whose
//! ∫ ȳ L dλ is one has Y = 1, as in pbrt-v4 with its "cie1931" sensor. White balance is von Kries adaptation in
//! Bradford's cone space [Lam1985]. Left out: the response curves of real cameras.

use glam::{DMat3, DVec3, Mat3};
use math::Vec4;

use crate::color_space::xyz_of_chromaticity;
use crate::{ColorSpace, Spectrum, Wavelengths, cie, thermal};

/// Bradford's cone responses of XYZ, as rows.
const LMS_FROM_XYZ: [[f64; 3]; 3] =
    [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]];

/// What the film's colours are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor {
    space: ColorSpace,
    /// From XYZ: white balance and exposure included.
    rgb_from_xyz: Mat3,
    /// From unbalanced RGB of the film's space: white balance and exposure.
    rgb_from_rgb: Mat3,
}

impl Sensor {
    /// Records linear RGB of `space`.
    #[must_use]
    pub fn new(space: ColorSpace) -> Self {
        Self::with(space, DMat3::IDENTITY)
    }

    /// Records so that what is white under daylight of this temperature (or of this chromaticity) is white in the film.
    #[must_use]
    pub fn with_white_balance(space: ColorSpace, kelvin: f64) -> Self {
        Self::with(space, adaptation(thermal::daylight_chromaticity(kelvin), space.white()))
    }

    /// All colours times a factor: pbrt-v4's exposure time times ISO / 100.
    #[must_use]
    pub fn with_exposure(self, factor: f32) -> Self {
        Self { rgb_from_xyz: self.rgb_from_xyz * factor, rgb_from_rgb: self.rgb_from_rgb * factor, ..self }
    }

    /// The film's colour space.
    #[must_use]
    pub const fn space(&self) -> ColorSpace {
        self.space
    }

    /// Linear RGB of one path's radiance at its lanes.
    #[must_use]
    pub fn rgb(&self, radiance: Spectrum, wavelengths: &Wavelengths) -> [f32; 3] {
        if wavelengths.is_rgb() {
            return (self.rgb_from_rgb * radiance.0.truncate()).to_array();
        }
        let mut xyz = Vec4::ZERO;
        for ((l, lambda), pdf) in
            radiance.lanes().into_iter().zip(wavelengths.lambda()).zip(wavelengths.pdf())
        {
            if pdf > 0.0 {
                xyz += cie::xyz_bar4(lambda) * (l / pdf);
            }
        }
        (self.rgb_from_xyz * (xyz.truncate() * 0.25)).to_array()
    }

    fn with(space: ColorSpace, balance: DMat3) -> Self {
        let rgb_from_xyz = DMat3::from_cols_array_2d(&space.rgb_from_xyz_rows()).transpose();
        let xyz_from_rgb = DMat3::from_cols_array_2d(&space.xyz_from_rgb_rows()).transpose();
        let rgb_from_rgb =
            if balance == DMat3::IDENTITY { DMat3::IDENTITY } else { rgb_from_xyz * balance * xyz_from_rgb };
        Self { space, rgb_from_xyz: (rgb_from_xyz * balance).as_mat3(), rgb_from_rgb: rgb_from_rgb.as_mat3() }
    }
}

/// The matrix on XYZ that makes one white the other.
fn adaptation(from: [f64; 2], to: [f64; 2]) -> DMat3 {
    let lms_from_xyz = DMat3::from_cols_array_2d(&LMS_FROM_XYZ).transpose();
    let lms = |white| lms_from_xyz * DVec3::from_array(xyz_of_chromaticity(white));
    lms_from_xyz.inverse() * DMat3::from_diagonal(lms(to) / lms(from)) * lms_from_xyz
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ColorMode, ColorPipeline, SpectralCurve, photometric};

    const SRGB: ColorSpace = ColorSpace::Srgb;

    /// Mean over stratified wavelengths, as a film would see a constant image.
    fn film(curve: &SpectralCurve, sensor: &Sensor) -> [f32; 3] {
        let value =
            ColorPipeline::new(ColorMode::Spectral, SRGB).illuminant(curve).scaled(1.0 / photometric(curve));
        let n = 4000;
        let mut sum = [0.0_f64; 3];
        for i in 0..n {
            let w = Wavelengths::sample_visible((i as f32 + 0.5) / n as f32);
            for (s, c) in sum.iter_mut().zip(sensor.rgb(value.eval(&w), &w)) {
                *s += f64::from(c);
            }
        }
        sum.map(|s| (s / f64::from(n)) as f32)
    }

    #[test]
    fn rgb_light_one_makes_film_rgb_one() {
        for space in [SRGB, ColorSpace::Rec2020] {
            let rgb = film(&SpectralCurve::RgbIlluminant { space, rgb: [1.0; 3] }, &Sensor::new(space));
            assert!(rgb.iter().all(|c| (c - 1.0).abs() < 1e-3), "{space:?} {rgb:?}");
        }
    }

    #[test]
    fn coloured_light_keeps_its_rgb() {
        let rgb =
            film(&SpectralCurve::RgbIlluminant { space: SRGB, rgb: [5.0, 2.0, 1.0] }, &Sensor::new(SRGB));
        for (a, b) in rgb.into_iter().zip([5.0, 2.0, 1.0]) {
            assert!((a - b).abs() < 0.02, "{rgb:?}");
        }
    }

    #[test]
    fn a_single_wavelength_path_gives_the_same_mean() {
        let sensor = Sensor::new(SRGB);
        let value = ColorPipeline::new(ColorMode::Spectral, SRGB)
            .illuminant(&SpectralCurve::Constant(1.0))
            .scaled(1.0 / cie::y_integral() as f32);
        let n = 4000;
        let mut sum = [[0.0_f64; 3]; 2];
        for i in 0..n {
            let mut w = Wavelengths::sample_visible((i as f32 + 0.5) / n as f32);
            for total in &mut sum {
                for (s, c) in total.iter_mut().zip(sensor.rgb(value.eval(&w), &w)) {
                    *s += f64::from(c) / f64::from(n);
                }
                w.terminate_secondary();
            }
        }
        for c in 0..3 {
            assert!((sum[0][c] - sum[1][c]).abs() < 2e-3, "{sum:?}");
            assert!((sum[0][c] - [1.205_07, 0.948_22, 0.908_98][c]).abs() < 2e-3, "{sum:?}");
        }
    }

    #[test]
    fn white_balance_makes_its_illuminant_white() {
        let light = SpectralCurve::Daylight { kelvin: 5000.0 };
        let sensor = Sensor::with_white_balance(SRGB, 5000.0);
        let rgb = film(&light, &sensor);
        assert!(rgb.iter().all(|c| (c - 1.0).abs() < 3e-3), "{rgb:?}");
        let rgb_mode = light.emission_rgb(SRGB).map(|c| c / photometric(&light));
        let balanced = sensor.rgb(Spectrum::from_rgb(rgb_mode), &Wavelengths::RGB);
        assert!(balanced.iter().all(|c| (c - 1.0).abs() < 3e-3), "{balanced:?}");
        assert!(rgb_mode[0] > 1.1 && rgb_mode[2] < 0.9, "without it, it is yellow: {rgb_mode:?}");
    }

    #[test]
    fn rgb_mode_passes_numbers_through_and_exposure_multiplies() {
        let s = Spectrum::from_rgb([0.1, 0.2, 0.3]);
        assert_eq!(Sensor::new(SRGB).rgb(s, &Wavelengths::RGB), [0.1, 0.2, 0.3]);
        let twice = Sensor::new(SRGB).with_exposure(2.0).rgb(s, &Wavelengths::RGB);
        assert_eq!(twice, [0.2, 0.4, 0.6]);
    }
}
