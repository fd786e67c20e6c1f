//! Parameters of looks, and what they are at a point.

use math::trig;
use scatter::microfacet::{Distribution, Facets, Masking};
use scatter::{Coat, Conductor};
use spectrum::{Spectrum, SpectrumValue, Wavelengths};

use super::subsurface::effective_albedo;
use crate::TextureContext;
use crate::textures::{FloatHandle, SpectrumHandle, Textures};

/// Widths up to this count as a mirror's.
const SMOOTH: f32 = 1e-3;

/// Where parameters are looked up.
pub(super) struct Lookup<'a> {
    /// `None` to find out whether anything varies: textures then give zero.
    place: Option<(&'a Textures, &'a TextureContext)>,
    pub(super) wl: &'a mut Wavelengths,
    /// Was a texture asked for in no place?
    varies: bool,
    /// Index of refraction of what is outside of the surface.
    pub(super) outside: f32,
}

impl<'a> Lookup<'a> {
    /// At a point.
    pub(super) fn at(textures: &'a Textures, ctx: &'a TextureContext, wl: &'a mut Wavelengths) -> Self {
        Self { place: Some((textures, ctx)), wl, varies: false, outside: 1.0 }
    }

    /// In no place.
    pub(super) fn nowhere(wl: &'a mut Wavelengths) -> Self {
        Self { place: None, wl, varies: false, outside: 1.0 }
    }

    /// With something of this index of refraction outside of the surface.
    pub(super) fn over(self, outside: f32) -> Self {
        Self { outside, ..self }
    }

    /// Was a texture asked for in no place?
    pub(super) fn varies(&self) -> bool {
        self.varies
    }

    pub(super) fn float(&mut self, h: &FloatHandle) -> f32 {
        match (h, self.place) {
            (FloatHandle::Constant(c), _) => *c,
            (FloatHandle::Texture(_), Some((textures, ctx))) => textures.float(h, ctx),
            (FloatHandle::Texture(_), None) => {
                self.varies = true;
                0.0
            }
        }
    }

    /// A number in [0, 1].
    pub(super) fn unit(&mut self, h: &FloatHandle) -> f32 {
        self.float(h).clamp(0.0, 1.0)
    }

    /// Coordinate across a curve.
    pub(super) fn across(&mut self) -> f32 {
        let Some((_, ctx)) = self.place else {
            self.varies = true;
            return 0.5;
        };
        ctx.uv.y
    }

    /// A colour over its luminance (in spectral mode its mean); one if it is black.
    pub(super) fn hue(&self, color: Spectrum) -> Spectrum {
        let luminance = if self.wl.is_rgb() {
            let [r, g, b] = color.rgb();
            0.212_671 * r + 0.715_160 * g + 0.072_169 * b
        } else {
            color.average()
        };
        if luminance > 0.0 { color / luminance } else { Spectrum::ONE }
    }

    pub(super) fn spectrum(&mut self, h: &SpectrumHandle) -> Spectrum {
        match (h, self.place) {
            (SpectrumHandle::Constant(value), _) => value.eval(self.wl),
            (SpectrumHandle::Texture(_), Some((textures, ctx))) => textures.spectrum(h, ctx, self.wl),
            (SpectrumHandle::Texture(_), None) => {
                self.varies = true;
                Spectrum::ZERO
            }
        }
    }

    /// A spectrum in [0, 1].
    pub(super) fn albedo(&mut self, h: &SpectrumHandle) -> Spectrum {
        self.spectrum(h).clamp(0.0, 1.0)
    }

    /// A factor, which may exceed one.
    pub(super) fn positive(&mut self, h: &SpectrumHandle) -> Spectrum {
        self.spectrum(h).map(|x| x.max(0.0))
    }
}

/// What is under a coat.
#[derive(Clone, Debug)]
pub(super) enum Base {
    /// Lambert's law.
    Albedo(SpectrumHandle),
    /// A half space of particles.
    Subsurface { sigma_a: SpectrumHandle, sigma_s: SpectrumHandle, g: f32 },
}

/// What a metal is made of.
#[derive(Clone, Debug)]
pub(super) enum Metal {
    EtaK { eta: SpectrumHandle, k: SpectrumHandle },
    Reflectance(SpectrumHandle),
}

/// Widths of microfacets along both tangents.
#[derive(Clone, Copy, Debug)]
pub(super) struct Alpha {
    pub(super) u: FloatHandle,
    pub(super) v: FloatHandle,
    /// Are they roughnesses, whose roots are the widths?
    pub(super) remap: bool,
    pub(super) distribution: Distribution,
    pub(super) masking: Masking,
    /// Is the light between facets given back?
    pub(super) compensate: bool,
}

/// Factors on both sides of a boundary.
#[derive(Clone, Debug)]
pub(super) struct Tints {
    pub(super) reflectance: Option<SpectrumHandle>,
    pub(super) transmittance: Option<SpectrumHandle>,
}

/// Index of the inside over the outside.
#[derive(Clone, Debug)]
pub(super) enum Eta {
    Constant(f32),
    /// Another at each wavelength.
    Dispersive(SpectrumValue),
}

/// A coat.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    pub(super) eta: Eta,
    pub(super) alpha: Alpha,
    pub(super) thickness: FloatHandle,
    pub(super) g: FloatHandle,
    pub(super) albedo: SpectrumHandle,
    pub(super) max_depth: u16,
    pub(super) n_samples: u16,
    /// Index of its tabulated transmittance.
    pub(super) profiles: Option<usize>,
}

/// What a coat's transmittance is tabulated by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ProfileKey {
    pub(super) eta: f32,
    pub(super) thickness: f32,
    /// Range of widths.
    pub(super) alpha: [f32; 2],
    /// Their distribution and masking, of whatever width.
    pub(super) facets: Facets,
}

impl Base {
    pub(super) fn albedo(&self, at: &mut Lookup<'_>) -> Spectrum {
        match self {
            Self::Albedo(h) => at.albedo(h),
            Self::Subsurface { sigma_a, sigma_s, g } => {
                effective_albedo(at.spectrum(sigma_a), at.spectrum(sigma_s), *g)
            }
        }
    }
}

impl Metal {
    pub(super) fn conductor(&self, at: &mut Lookup<'_>, facets: Facets) -> Conductor {
        match self {
            Self::EtaK { eta, k } => Conductor::new(at.spectrum(eta), at.spectrum(k), facets),
            Self::Reflectance(r) => Conductor::from_reflectance(at.spectrum(r), facets),
        }
    }
}

impl Tints {
    /// Of reflection and transmission; `None` where there are none.
    pub(super) fn at(&self, at: &mut Lookup<'_>) -> Option<[Spectrum; 2]> {
        if self.reflectance.is_none() && self.transmittance.is_none() {
            return None;
        }
        let mut factor = |h: &Option<SpectrumHandle>| h.as_ref().map_or(Spectrum::ONE, |h| at.positive(h));
        Some([factor(&self.reflectance), factor(&self.transmittance)])
    }
}

impl Alpha {
    /// The facets at a point; those of a mirror if the widths are small.
    pub(super) fn at(&self, at: &mut Lookup<'_>) -> Facets {
        let alpha = self.widths([at.float(&self.u), at.float(&self.v)]);
        Facets::new(alpha, self.distribution).masked(self.masking)
    }

    /// The widths, if they are the same everywhere.
    pub(super) fn constant(&self) -> Option<[f32; 2]> {
        match (self.u, self.v) {
            (FloatHandle::Constant(u), FloatHandle::Constant(v)) => Some(self.widths([u, v])),
            (FloatHandle::Constant(_) | FloatHandle::Texture(_), _) => None,
        }
    }

    /// The kind of facets, without a width.
    pub(super) fn kind(&self) -> Facets {
        Facets::new([0.0; 2], self.distribution).masked(self.masking)
    }

    /// The same both ways, everywhere?
    pub(super) fn is_isotropic(&self) -> bool {
        self.u == self.v
    }

    fn widths(&self, values: [f32; 2]) -> [f32; 2] {
        let alpha = values.map(|r| if self.remap { trig::safe_sqrt(r) } else { r.max(0.0) });
        if alpha[0].max(alpha[1]) <= SMOOTH { [0.0; 2] } else { alpha }
    }
}

impl Eta {
    /// The index for a path, which is left with its hero wavelength if the index depends on wavelength.
    pub(super) fn at(&self, wl: &mut Wavelengths) -> f32 {
        let eta = match self {
            Self::Constant(eta) => *eta,
            Self::Dispersive(value) => {
                let hero = value.eval(wl).lanes()[0];
                wl.terminate_secondary();
                hero
            }
        };
        // Zero is what tabulated spectra give outside their range.
        if eta > 0.0 { eta } else { 1.0 }
    }

    /// The index, if it is the same at all wavelengths.
    pub(super) fn constant(&self) -> Option<f32> {
        match self {
            Self::Constant(eta) => Some(if *eta > 0.0 { *eta } else { 1.0 }),
            Self::Dispersive(_) => None,
        }
    }
}

impl Layer {
    pub(super) fn at(&self, at: &mut Lookup<'_>) -> Coat {
        let coat = Coat {
            eta: self.eta.at(at.wl),
            alpha: self.alpha.at(at).alpha(),
            thickness: at.float(&self.thickness).max(f32::MIN_POSITIVE),
            g: at.float(&self.g).clamp(-1.0, 1.0),
            albedo: at.albedo(&self.albedo),
            max_depth: self.max_depth,
            n_samples: self.n_samples,
        };
        // A clear coat keeps the whole series of bounces (docs/decisions/0011).
        if coat.is_clear() { Coat { max_depth: u16::MAX, ..coat } } else { coat }
    }

    /// What its transmittance is tabulated by; `None` where a table is of no use: it scatters, varies in more than its
    /// roughness, or has another roughness along u than along v.
    pub(super) fn profile_key(&self) -> Option<ProfileKey> {
        let clear = matches!(&self.albedo, SpectrumHandle::Constant(a) if a.is_black());
        let (Some(eta), FloatHandle::Constant(thickness)) = (self.eta.constant(), self.thickness) else {
            return None;
        };
        if !clear || !self.alpha.is_isotropic() {
            return None;
        }
        let alpha = self.alpha.constant().map_or([0.0, 1.0], |[a, _]| [a, a]);
        // Coats are of GGX facets.
        let facets = Facets::SMOOTH;
        Some(ProfileKey { eta, thickness: thickness.max(f32::MIN_POSITIVE), alpha, facets })
    }
}
