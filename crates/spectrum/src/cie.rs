//! The CIE 1931 standard observer (2 degrees): x̄, ȳ, z̄ from 360 to 830 nm [CIE018].
//!
//! Integrals over wavelength are sums over the table's 471 values in steps of 1 nm; what lies outside is not seen.

use std::sync::OnceLock;

use math::Vec4;

use crate::ColorSpace;

/// The shortest wavelength that anything here knows, in nm.
pub const LAMBDA_MIN: f32 = 360.0;
/// The longest wavelength that anything here knows, in nm.
pub const LAMBDA_MAX: f32 = 830.0;
/// Values in a table of 1 nm steps from [`LAMBDA_MIN`] to [`LAMBDA_MAX`].
pub(crate) const N_LAMBDA: usize = 471;

/// x̄, ȳ, z̄ at a wavelength in nm, interpolated linearly; zero outside 360 … 830 nm.
#[must_use]
pub fn xyz_bar(lambda: f32) -> [f32; 3] {
    let [x, y, z, _] = xyz_bar4(lambda).to_array();
    [x, y, z]
}

/// [`xyz_bar`] with a zero for padding.
pub(crate) fn xyz_bar4(lambda: f32) -> Vec4 {
    static TABLE: OnceLock<Vec<Vec4>> = OnceLock::new();
    if !(LAMBDA_MIN..=LAMBDA_MAX).contains(&lambda) {
        return Vec4::ZERO;
    }
    let table = TABLE.get_or_init(|| {
        observer().iter().map(|c| Vec4::new(c[0] as f32, c[1] as f32, c[2] as f32, 0.0)).collect()
    });
    let at = lambda - LAMBDA_MIN;
    let i = (at as usize).min(N_LAMBDA - 2);
    table[i].lerp(table[i + 1], at - i as f32)
}

/// ∫ ȳ dλ in nm: 106.857.
#[must_use]
pub fn y_integral() -> f64 {
    observer().iter().map(|c| c[1]).sum()
}

/// ∫ (x̄, ȳ, z̄) f dλ, where `f` takes nm.
pub(crate) fn integrate(f: impl Fn(f64) -> f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (i, bar) in observer().iter().enumerate() {
        let value = f(f64::from(LAMBDA_MIN) + i as f64);
        for (s, b) in sum.iter_mut().zip(bar) {
            *s += b * value;
        }
    }
    sum
}

/// The response of a colour space's R, G and B to an equal-energy spectrum of one: what a constant becomes.
pub(crate) fn equal_energy_rgb(space: ColorSpace) -> [f64; 3] {
    space.rgb_from_xyz64(integrate(|_| 1.0))
}

/// The table as it is in the file.
pub(crate) fn observer() -> &'static [[f64; 3]] {
    static TABLE: OnceLock<Vec<[f64; 3]>> = OnceLock::new();
    TABLE.get_or_init(|| {
        let numbers: Vec<f64> = include_str!("../data/cie1931.txt")
            .lines()
            .filter(|l| !l.starts_with('#'))
            .flat_map(str::split_whitespace)
            .filter_map(|word| word.parse().ok())
            .collect();
        numbers.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_whole_and_sums_to_the_published_integral() {
        assert_eq!(observer().len(), N_LAMBDA);
        assert!((y_integral() - 106.8569).abs() < 1e-4, "{}", y_integral());
        let peak = xyz_bar(555.0);
        assert!((peak[1] - 1.0).abs() < 1e-6, "photopic peak {peak:?}");
    }

    #[test]
    fn equal_energy_has_its_published_chromaticity() {
        let [x, y, z] = integrate(|_| 1.0);
        assert!((x / (x + y + z) - 0.333_314).abs() < 1e-6);
        assert!((y / (x + y + z) - 0.333_288).abs() < 1e-6);
    }

    #[test]
    fn between_table_values_it_is_linear_and_outside_it_is_zero() {
        let (a, b, mid) = (xyz_bar(500.0), xyz_bar(501.0), xyz_bar(500.5));
        for c in 0..3 {
            assert!((0.5 * (a[c] + b[c]) - mid[c]).abs() < 1e-6);
        }
        assert_eq!(xyz_bar(359.9), [0.0; 3]);
        assert_eq!(xyz_bar(f32::NAN), [0.0; 3]);
        assert!(xyz_bar(830.0)[0] > 0.0);
    }
}
