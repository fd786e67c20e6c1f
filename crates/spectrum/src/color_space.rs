//! RGB colour spaces: primaries, white, and their matrices to and from CIE XYZ.
//!
//! | space       | primaries and white                      | source      |
//! |-------------|------------------------------------------|-------------|
//! | sRGB        | ITU-R BT.709, D65                        | [IEC61966]  |
//! | DCI-P3      | P3 with a white of D65 ("Display P3")    | [SMPTE431]  |
//! | Rec2020     | ITU-R BT.2020, D65                       | [BT2020]    |
//! | ACES2065-1  | AP0, the ACES white (near D60)           | [SMPTE2065] |
//!
//! The whites are the standards' four-digit ones; the illuminant *spectra* have whites of their own (D65: 0.31272,
//! 0.32903), so that RGB (1, 1, 1) times the illuminant comes back as (1, 1, 1) within 3 · 10⁻⁴.

use std::sync::OnceLock;

use glam::{DMat3, DVec3};

use crate::{DenseSpectrum, cie, named};

/// An RGB colour space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ColorSpace {
    /// sRGB and BT.709.
    #[default]
    Srgb,
    /// DCI-P3 primaries with D65.
    DciP3,
    /// BT.2020.
    Rec2020,
    /// ACES AP0.
    Aces2065,
}

/// What follows from primaries and white.
struct Derived {
    xyz_from_rgb: DMat3,
    rgb_from_xyz: DMat3,
    illuminant: DenseSpectrum,
    photometric: f64,
}

impl ColorSpace {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Srgb, Self::DciP3, Self::Rec2020, Self::Aces2065];

    /// The name in pbrt files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Srgb => "srgb",
            Self::DciP3 => "dci-p3",
            Self::Rec2020 => "rec2020",
            Self::Aces2065 => "aces2065-1",
        }
    }

    /// The space of that [`ColorSpace::name`].
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|s| s.name() == name)
    }

    /// Chromaticities (x, y) of R, G and B.
    #[must_use]
    pub const fn primaries(self) -> [[f64; 2]; 3] {
        match self {
            Self::Srgb => [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]],
            Self::DciP3 => [[0.680, 0.320], [0.265, 0.690], [0.150, 0.060]],
            Self::Rec2020 => [[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]],
            Self::Aces2065 => [[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.077]],
        }
    }

    /// Chromaticity (x, y) of white.
    #[must_use]
    pub const fn white(self) -> [f64; 2] {
        match self {
            Self::Srgb | Self::DciP3 | Self::Rec2020 => [0.3127, 0.3290],
            Self::Aces2065 => [0.32168, 0.33767],
        }
    }

    /// The spectrum of its white light, scaled to the luminance of an equal-energy spectrum of one.
    #[must_use]
    pub fn illuminant(self) -> &'static DenseSpectrum {
        &self.derived().illuminant
    }

    /// ∫ ȳ of [`ColorSpace::illuminant`] dλ.
    #[must_use]
    pub fn illuminant_photometric(self) -> f64 {
        self.derived().photometric
    }

    /// CIE XYZ of linear RGB; white has Y = 1.
    #[must_use]
    pub fn xyz_from_rgb(self, rgb: [f32; 3]) -> [f32; 3] {
        self.xyz_from_rgb64(rgb.map(f64::from)).map(|x| x as f32)
    }

    /// Linear RGB of CIE XYZ.
    #[must_use]
    pub fn rgb_from_xyz(self, xyz: [f32; 3]) -> [f32; 3] {
        self.rgb_from_xyz64(xyz.map(f64::from)).map(|x| x as f32)
    }

    /// Luminance Y of linear RGB.
    #[must_use]
    pub fn luminance(self, rgb: [f32; 3]) -> f32 {
        self.xyz_from_rgb(rgb)[1]
    }

    /// Linear RGB of this space in `other`, without adaptation to another white.
    #[must_use]
    pub fn convert(self, other: Self, rgb: [f32; 3]) -> [f32; 3] {
        if self == other {
            rgb
        } else {
            other.rgb_from_xyz64(self.xyz_from_rgb64(rgb.map(f64::from))).map(|x| x as f32)
        }
    }

    /// The matrix to RGB from XYZ, as three rows.
    #[must_use]
    pub fn rgb_from_xyz_rows(self) -> [[f64; 3]; 3] {
        self.derived().rgb_from_xyz.transpose().to_cols_array_2d()
    }

    /// The matrix to XYZ from RGB, as three rows.
    #[must_use]
    pub fn xyz_from_rgb_rows(self) -> [[f64; 3]; 3] {
        self.derived().xyz_from_rgb.transpose().to_cols_array_2d()
    }

    pub(crate) fn rgb_from_xyz64(self, xyz: [f64; 3]) -> [f64; 3] {
        (self.derived().rgb_from_xyz * DVec3::from_array(xyz)).to_array()
    }

    pub(crate) fn xyz_from_rgb64(self, rgb: [f64; 3]) -> [f64; 3] {
        (self.derived().xyz_from_rgb * DVec3::from_array(rgb)).to_array()
    }

    fn derived(self) -> &'static Derived {
        static SPACES: [OnceLock<Derived>; 4] = [const { OnceLock::new() }; 4];
        SPACES[self as usize].get_or_init(|| {
            // Columns: XYZ of each primary with Y such that the three add up to white.
            let unscaled = DMat3::from_cols_array_2d(&self.primaries().map(xyz_of_chromaticity));
            let scale = unscaled.inverse() * DVec3::from_array(xyz_of_chromaticity(self.white()));
            let xyz_from_rgb = unscaled * DMat3::from_diagonal(scale);
            let curve = named::piecewise(self.illuminant_name());
            let illuminant = DenseSpectrum::tabulate(|l| curve.as_ref().map_or(1.0, |c| c.eval64(l)));
            let photometric = cie::integrate(|l| f64::from(illuminant.eval(l as f32)))[1];
            Derived { xyz_from_rgb, rgb_from_xyz: xyz_from_rgb.inverse(), illuminant, photometric }
        })
    }

    const fn illuminant_name(self) -> &'static str {
        match self {
            Self::Srgb | Self::DciP3 | Self::Rec2020 => "stdillum-D65",
            Self::Aces2065 => "illum-acesD60",
        }
    }
}

/// XYZ of luminance one.
pub(crate) fn xyz_of_chromaticity([x, y]: [f64; 2]) -> [f64; 3] {
    [x / y, 1.0, (1.0 - x - y) / y]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_has_the_published_luminance_row() {
        let row = ColorSpace::Srgb.xyz_from_rgb_rows()[1];
        for (a, b) in row.into_iter().zip([0.212_639_0, 0.715_168_7, 0.072_192_3]) {
            assert!((a - b).abs() < 5e-8, "{row:?}");
        }
    }

    #[test]
    fn a_constant_spectrum_is_the_published_pink() {
        let n = cie::y_integral();
        let rgb = ColorSpace::Srgb.rgb_from_xyz64(cie::integrate(|_| 1.0 / n));
        for (a, b) in rgb.into_iter().zip([1.205_07, 0.948_22, 0.908_98]) {
            assert!((a - b).abs() < 1e-5, "{rgb:?}");
        }
    }

    #[test]
    fn white_is_one_one_one_and_matrices_undo_each_other() {
        for space in ColorSpace::ALL {
            let w = space.rgb_from_xyz64(xyz_of_chromaticity(space.white()));
            assert!(w.iter().all(|c| (c - 1.0).abs() < 1e-12), "{space:?} {w:?}");
            let back = space.rgb_from_xyz(space.xyz_from_rgb([0.2, 0.5, 0.9]));
            for (a, b) in back.into_iter().zip([0.2, 0.5, 0.9]) {
                assert!((a - b).abs() < 1e-6);
            }
            assert_eq!(ColorSpace::from_name(space.name()), Some(space));
        }
        assert_eq!(ColorSpace::from_name("lab"), None);
    }

    #[test]
    fn the_illuminants_spectra_are_white() {
        for space in ColorSpace::ALL {
            let xyz = cie::integrate(|l| f64::from(space.illuminant().eval(l as f32)));
            let rgb = space.rgb_from_xyz64(xyz.map(|c| c / space.illuminant_photometric()));
            assert!(rgb.iter().all(|c| (c - 1.0).abs() < 6e-4), "{space:?} {rgb:?}");
            assert!((space.illuminant_photometric() / cie::y_integral() - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn a_wider_space_holds_srgb_without_negatives() {
        for space in [ColorSpace::DciP3, ColorSpace::Rec2020, ColorSpace::Aces2065] {
            for rgb in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
                assert!(ColorSpace::Srgb.convert(space, rgb).iter().all(|c| *c > -1e-3), "{space:?}");
            }
        }
    }
}
