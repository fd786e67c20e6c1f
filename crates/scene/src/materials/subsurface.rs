//! Subsurface scattering: the medium under a surface; and what stands for it where it varies over the surface.
//!
//! Light that passes the (rough) dielectric border walks through a homogeneous medium. A diffuse reflectance and a mean free
//! path `1/σ_t` become coefficients by albedo inversion ([`HalfSpace`]). The surface must be closed: what walks out of a hole is
//! lost.
//!
//! Or light leaves by a diffusion profile, whose parameters may vary over the surface ([`Diffuser`]).
//!
//! Where a parameter of a walk is a texture, and in mixtures, a coat over the effective albedo stands in: a half space of particles with single-scattering albedo ω and asymmetry g gives back
//! `(1 − s)(1 − 0.139 s) / (1 + 1.17 s)` of uniform light, `s = √((1 − ω)/(1 − ω g))` [Hulst1980].
//! Named coefficients are measured ones, in 1/mm, scattering reduced.

use scatter::DiffusionProfile;
use scene_desc::{Sink, Span, SpectrumDesc, SpectrumInput, SubsurfaceProfile};
use spectrum::{
    ColorMode, ColorPipeline, LAMBDA_MAX, LAMBDA_MIN, SpectralCurve, Spectrum, SpectrumValue, Wavelengths,
    measured_media,
};

use super::half_space::{AlbedoTable, HalfSpace};
use super::parameters::Lookup;
use crate::textures::{SpectrumHandle, SpectrumRole, spectrum_value};

/// What is under a surface, in 1/scene unit.
#[derive(Clone, Debug)]
pub(crate) struct Interior {
    pub(crate) sigma_a: SpectrumValue,
    pub(crate) sigma_s: SpectrumValue,
    pub(crate) g: f32,
}

/// Where light leaves by a diffusion profile: its parameters.
#[derive(Clone, Debug)]
pub(super) struct Diffuser {
    /// Effective albedo and mean free path; or absorption and scattering.
    parameters: [SpectrumHandle; 2],
    are_coefficients: bool,
    /// On lengths or coefficients.
    scale: f32,
    g: f32,
    albedos: AlbedoTable,
}

impl Diffuser {
    /// Of parameters as [`SubsurfaceProfile`] has them; an unknown name is told of and grey.
    pub(super) fn new(
        profile: &SubsurfaceProfile,
        under: Under,
        mut handle: impl FnMut(&SpectrumInput, SpectrumRole) -> SpectrumHandle,
    ) -> Self {
        let Under { scale, g, eta, span: _ } = under;
        let mut g = g.clamp(-0.99, 0.99);
        let (parameters, are_coefficients) = match profile {
            SubsurfaceProfile::Named(name) => {
                // Scattering is measured reduced: isotropic.
                g = 0.0;
                let of = measured(name).unwrap_or([[1.0; 3]; 2]);
                (of.map(|rgb| handle(&SpectrumDesc::srgb(rgb).into(), SpectrumRole::Unbounded)), true)
            }
            SubsurfaceProfile::Coefficients { sigma_a, sigma_s } => {
                ([sigma_a, sigma_s].map(|input| handle(input, SpectrumRole::Unbounded)), true)
            }
            SubsurfaceProfile::Reflectance { reflectance, mfp } => {
                let reflectance = handle(reflectance, SpectrumRole::Albedo);
                ([reflectance, handle(mfp, SpectrumRole::Unbounded)], false)
            }
        };
        let albedos = HalfSpace::new(eta.max(0.1), g).table();
        Self { parameters, are_coefficients, scale: scale.max(0.0), g, albedos }
    }

    /// The profile at a point.
    pub(super) fn at(&self, at: &mut Lookup<'_>) -> DiffusionProfile {
        let [a, b] = self.parameters.each_ref().map(|h| at.positive(h));
        let table = &self.albedos;
        let (albedo, path) = match self.are_coefficients {
            true => (
                a.zip(b, |a, s| if a + s > 0.0 { table.albedo(s / (a + s)) } else { 0.0 }),
                a.zip(b, |a, s| 1.0 / (self.scale * (a + (1.0 - self.g) * s)).max(SHORTEST)),
            ),
            false => {
                let albedo = a.clamp(0.0, 1.0);
                (albedo, albedo.zip(b, |a, mfp| self.scale * mfp / (1.0 - self.g * table.invert(a))))
            }
        };
        DiffusionProfile::new(albedo, path)
    }
}

/// The border of a subsurface material.
#[derive(Clone, Copy, Debug)]
pub(super) struct Under {
    pub(super) scale: f32,
    pub(super) g: f32,
    pub(super) eta: f32,
    pub(super) span: Span,
}

impl Interior {
    /// `None` if something varies over the surface, or the name is unknown.
    pub(super) fn new(
        profile: &SubsurfaceProfile,
        under: Under,
        colors: ColorPipeline,
        sink: &mut Sink,
    ) -> Option<Self> {
        let Under { scale, g, eta, span } = under;
        let mut value = |desc: &SpectrumDesc, role| spectrum_value(desc, role, colors, span, sink);
        let g = g.clamp(-0.99, 0.99);
        match profile {
            SubsurfaceProfile::Named(name) => {
                // Scattering is measured reduced: isotropic.
                let [a, s] =
                    measured(name)?.map(|rgb| value(&SpectrumDesc::srgb(rgb), SpectrumRole::Unbounded));
                Some(Self { sigma_a: a.scaled(scale), sigma_s: s.scaled(scale), g: 0.0 })
            }
            SubsurfaceProfile::Coefficients {
                sigma_a: SpectrumInput::Constant(a),
                sigma_s: SpectrumInput::Constant(s),
            } => {
                let [a, s] = [a, s].map(|d| value(d, SpectrumRole::Unbounded).scaled(scale));
                Some(Self { sigma_a: a, sigma_s: s, g })
            }
            SubsurfaceProfile::Reflectance {
                reflectance: SpectrumInput::Constant(reflectance),
                mfp: SpectrumInput::Constant(mfp),
            } => {
                let reflectance = value(reflectance, SpectrumRole::Albedo);
                let mfp = value(mfp, SpectrumRole::Unbounded).scaled(scale);
                let half_space = HalfSpace::new(eta.max(0.1), g);
                let [sigma_a, sigma_s] = [false, true].map(|scatters| {
                    mapped([&reflectance, &mfp], colors, |r, mfp| {
                        let omega = half_space.invert(r);
                        (if scatters { omega } else { 1.0 - omega }) / mfp.max(SHORTEST)
                    })
                });
                Some(Self { sigma_a, sigma_s, g })
            }
            SubsurfaceProfile::Coefficients { .. } | SubsurfaceProfile::Reflectance { .. } => None,
        }
    }
}

/// Mean free paths are at least this long, in scene units.
const SHORTEST: f32 = 1e-7;
/// Steps of wavelengths in nm.
const STEP: usize = 5;

/// A function of two spectra, lane by lane or wavelength by wavelength.
fn mapped(of: [&SpectrumValue; 2], colors: ColorPipeline, f: impl Fn(f32, f32) -> f32) -> SpectrumValue {
    let at = |wl: &Wavelengths| of[0].eval(wl).zip(of[1].eval(wl), &f);
    match colors.mode {
        ColorMode::Rgb => {
            let rgb = at(&Wavelengths::RGB).rgb();
            colors.unbounded(&SpectralCurve::RgbUnbounded { space: colors.space, rgb })
        }
        ColorMode::Spectral => {
            let points: Vec<f32> = (LAMBDA_MIN as usize..=LAMBDA_MAX as usize)
                .step_by(STEP)
                .flat_map(|l| {
                    let l = l as f32;
                    [l, at(&Wavelengths::new([l; 4], [1.0; 4])).lanes()[0]]
                })
                .collect();
            SpectralCurve::from_interleaved(&points)
                .map_or(SpectrumValue::ZERO, |curve| colors.unbounded(&curve))
        }
    }
}

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
