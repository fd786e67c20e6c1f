//! The laws of phase functions: see [`phase_laws!`](crate::phase_laws).

use math::{Dir, Vec3};
use scatter::PhaseFunction;

use crate::chi2::{Chi2Settings, chi2_sphere};
use statistics::sidak;

/// Writes the tests of all laws for each line `name: phase function;`, in a module of that name.
#[macro_export]
macro_rules! phase_laws {
    ($($name:ident: $phase:expr;)*) => {$(
        mod $name {
            #[allow(unused_imports, reason = "a line may need no name from around it")]
            use super::*;

            #[test]
            fn sampling_follows_a_density_of_mass_one() {
                $crate::laws::phase::sampling_follows_a_density_of_mass_one(&$phase.into());
            }

            #[test]
            fn samples_state_their_density() {
                $crate::laws::phase::samples_state_their_density(&$phase.into());
            }
        }
    )*};
}

fn directions() -> [Dir; 3] {
    [Dir::Z, -Dir::Z, Dir::normalize(Vec3::new(0.5, -0.7, 0.1))]
}

/// A χ² test, and the mass of the density.
pub fn sampling_follows_a_density_of_mass_one(phase: &PhaseFunction) {
    for (i, wo) in directions().into_iter().enumerate() {
        let settings =
            Chi2Settings { seed: i as u64, significance: sidak(1e-6, 3), ..Chi2Settings::default() };
        let pdf = |w: [f64; 3]| {
            let wi = Dir::normalize(Vec3::new(w[0] as f32, w[1] as f32, w[2] as f32));
            f64::from(phase.pdf(wo, wi).value())
        };
        match chi2_sphere(&settings, |u| Some(phase.sample(wo, u).wi.0.to_array().map(f64::from)), pdf) {
            Ok(found) => assert!((found.mass - 1.0).abs() < 1e-3, "{wo:?}: mass {}", found.mass),
            Err(why) => panic!("{wo:?}: {why}"),
        }
    }
}

/// The density in a sample is `pdf` at its direction, which is the value; reversing both directions changes nothing.
pub fn samples_state_their_density(phase: &PhaseFunction) {
    for wo in directions() {
        for i in 0..1000 {
            let s = phase.sample(wo, crate::chi2::uniform_pair(9, i));
            let (pdf, value) = (phase.pdf(wo, s.wi).value(), phase.eval(s.wi, wo));
            assert!((s.pdf.value() / pdf - 1.0).abs() < 2e-3, "{wo:?} {s:?}: {pdf}");
            assert!((value / pdf - 1.0).abs() < 1e-3, "{wo:?} {s:?}: {value} back");
        }
    }
}
