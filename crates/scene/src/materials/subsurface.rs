//! What stands for subsurface scattering until there is subsurface scattering: its albedo.
//!
//! A half space of particles with single-scattering albedo ω and asymmetry g gives back
//! `(1 − s)(1 − 0.139 s) / (1 + 1.17 s)` of uniform light, `s = √((1 − ω)/(1 − ω g))` [Hulst1980].
//! Named coefficients are measured ones, in 1/mm, scattering reduced.

use spectrum::{Spectrum, measured_media};

/// Absorption and reduced scattering of a named material.
pub(super) fn measured(name: &str) -> Option<[[f32; 3]; 2]> {
    measured_media().iter().find(|m| m.name == name).map(|m| [m.sigma_a, m.sigma_s])
}

/// Their names.
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    measured_media().iter().map(|m| m.name)
}

/// Albedo of a half space with these coefficients.
pub(super) fn effective_albedo(sigma_a: Spectrum, sigma_s: Spectrum, g: f32) -> Spectrum {
    sigma_a.zip(sigma_s, |a, s| {
        let total = a + s;
        if total <= 0.0 {
            return 0.0;
        }
        let omega = s / total;
        let s = math::trig::safe_sqrt((1.0 - omega) / (1.0 - omega * g).max(1e-6)).min(1.0);
        (1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_spaces_have_the_albedo_of_chandrasekhar() {
        // Ground truth, sec. 6: A* of isotropic half spaces.
        for (omega, albedo) in
            [(0.5, 0.146_544_4), (0.8, 0.341_866_8), (0.9, 0.478_025_4), (0.99, 0.794_563_7)]
        {
            let found =
                effective_albedo(Spectrum::splat(1.0 - omega), Spectrum::splat(omega), 0.0).lanes()[0];
            assert!((found - albedo).abs() < 0.003, "ω {omega}: {found} is not {albedo}");
        }
        assert_eq!(effective_albedo(Spectrum::ZERO, Spectrum::ONE, 0.0), Spectrum::ONE);
        assert_eq!(effective_albedo(Spectrum::ONE, Spectrum::ZERO, 0.5), Spectrum::ZERO);
        assert_eq!(effective_albedo(Spectrum::ZERO, Spectrum::ZERO, 0.5), Spectrum::ZERO);
    }

    #[test]
    fn skin_is_redder_than_blue() {
        let [a, s] = measured("Skin1").unwrap();
        let [r, g, b] = effective_albedo(Spectrum::from_rgb(a), Spectrum::from_rgb(s), 0.0).rgb();
        assert!(r > g && g > b && r < 1.0 && names().count() == 47);
    }
}
