//! What stands for subsurface scattering until there is subsurface scattering: its albedo.
//!
//! A half space of particles with single-scattering albedo ω and asymmetry g gives back
//! `(1 − s)(1 − 0.139 s) / (1 + 1.17 s)` of uniform light, `s = √((1 − ω)/(1 − ω g))` [Hulst1980].
//! Named coefficients are those of [Jensen2001], in 1/mm, scattering reduced.

use spectrum::Spectrum;

/// Reduced scattering and absorption of R, G and B in 1/mm, by pbrt's names.
const MEASURED: [(&str, [f32; 3], [f32; 3]); 12] = [
    ("Apple", [2.29, 2.39, 1.97], [0.0030, 0.0034, 0.046]),
    ("Chicken1", [0.15, 0.21, 0.38], [0.015, 0.077, 0.19]),
    ("Chicken2", [0.19, 0.25, 0.32], [0.018, 0.088, 0.20]),
    ("Cream", [7.38, 5.47, 3.15], [0.0002, 0.0028, 0.0163]),
    ("Ketchup", [0.18, 0.07, 0.03], [0.061, 0.97, 1.45]),
    ("Marble", [2.19, 2.62, 3.00], [0.0021, 0.0041, 0.0071]),
    ("Potato", [0.68, 0.70, 0.55], [0.0024, 0.0090, 0.12]),
    ("Skimmilk", [0.70, 1.22, 1.90], [0.0014, 0.0025, 0.0142]),
    ("Skin1", [0.74, 0.88, 1.01], [0.032, 0.17, 0.48]),
    ("Skin2", [1.09, 1.59, 1.79], [0.013, 0.070, 0.145]),
    ("Spectralon", [11.6, 20.4, 14.9], [0.0, 0.0, 0.0]),
    ("Wholemilk", [2.55, 3.21, 3.77], [0.0011, 0.0024, 0.014]),
];

/// Absorption and reduced scattering of a named material.
pub(super) fn measured(name: &str) -> Option<[[f32; 3]; 2]> {
    MEASURED.iter().find(|m| m.0 == name).map(|m| [m.2, m.1])
}

/// Their names.
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    MEASURED.iter().map(|m| m.0)
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
        assert!(r > g && g > b && r < 1.0 && names().count() == 12);
    }
}
