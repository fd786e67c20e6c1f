//! What a record's light is stored in, so that paths of any wavelengths can use it.
//!
//! In RGB mode that is R, G and B. In spectral mode it is the mean over each of sixteen bins of 360 … 830 nm, four
//! bins to a group: a path of the build carries one wavelength in each bin of its group. A wavelength finds its bin's
//! mean, so that what is lost is how light varies within a bin *together with* the surface that it meets.

use math::Vec4;
use spectrum::{LAMBDA_MAX, LAMBDA_MIN, Spectrum, Wavelengths};

/// Bins are group + GROUPS · lane.
const GROUPS: usize = 4;

/// Width of a bin in nm.
const WIDTH: f32 = (LAMBDA_MAX - LAMBDA_MIN) / (4 * GROUPS) as f32;

/// The basis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Basis {
    Rgb,
    Bins,
}

impl Basis {
    /// Groups of four numbers.
    pub(super) fn n_groups(self) -> usize {
        match self {
            Self::Rgb => 1,
            Self::Bins => GROUPS,
        }
    }

    /// Wavelengths of the `i`-th path of a group; `u` says where in their bins.
    pub(super) fn wavelengths(self, group: usize, i: usize, u: f32) -> Wavelengths {
        match self {
            Self::Rgb => Wavelengths::RGB,
            Self::Bins => {
                // The hero takes turns, for with dispersion it may be all that is left.
                let lambda = |lane: usize| {
                    let bin = group + GROUPS * ((lane + i) % 4);
                    LAMBDA_MIN + WIDTH * (bin as f32 + u)
                };
                let pdf = 1.0 / (LAMBDA_MAX - LAMBDA_MIN);
                Wavelengths::new([lambda(0), lambda(1), lambda(2), lambda(3)], [pdf; 4])
            }
        }
    }

    /// A path's radiance as its group keeps it.
    pub(super) fn store(self, radiance: Spectrum, i: usize, wl: &Wavelengths) -> Spectrum {
        if self == Self::Rgb {
            return radiance;
        }
        let lanes = match wl.is_terminated() {
            true => [4.0 * radiance.lanes()[0], 0.0, 0.0, 0.0],
            false => radiance.lanes(),
        };
        Spectrum::from_lanes([0, 1, 2, 3].map(|bin: usize| lanes[(bin + 4 - i % 4) % 4]))
    }

    /// What a path of some wavelengths finds in all groups.
    pub(super) fn load(self, groups: &[Spectrum], wl: &Wavelengths) -> Spectrum {
        match self {
            Self::Rgb => groups[0],
            Self::Bins => {
                let value = |lambda: f32| {
                    let bin = (((lambda - LAMBDA_MIN) / WIDTH) as usize).min(4 * GROUPS - 1);
                    groups[bin % GROUPS].lanes()[bin / GROUPS]
                };
                Spectrum(Vec4::from_array(wl.lambda().map(value)))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Radiance equal to the wavelength comes back as the middle of its bin, on average.
    #[test]
    fn what_is_stored_is_found_again() {
        let basis = Basis::Bins;
        let groups: Vec<Spectrum> = (0..basis.n_groups())
            .map(|g| {
                let path = |i: usize| {
                    let wl = basis.wavelengths(g, i, (i as f32 + 0.5) / 64.0);
                    basis.store(Spectrum::from_lanes(wl.lambda()), i, &wl)
                };
                (0..64).map(path).sum::<Spectrum>() / 64.0
            })
            .collect();
        let wl = Wavelengths::sample_visible(0.3);
        for (found, lambda) in basis.load(&groups, &wl).lanes().into_iter().zip(wl.lambda()) {
            assert!((found - lambda).abs() <= 0.51 * WIDTH, "{lambda}: {found}");
        }
    }

    #[test]
    fn a_path_that_lost_its_secondary_wavelengths_counts_its_hero_four_times() {
        let basis = Basis::Bins;
        let mean = (0..64).map(|i| {
            let mut wl = basis.wavelengths(1, i, 0.5);
            if i % 8 < 4 {
                wl.terminate_secondary();
            }
            basis.store(Spectrum::ONE, i, &wl)
        });
        assert_eq!(mean.sum::<Spectrum>() / 64.0, Spectrum::ONE);
        assert_eq!(Basis::Rgb.wavelengths(0, 3, 0.5), Wavelengths::RGB);
    }
}
