//! The parameters of each kind of surface, and the BSDF that they make at a point.

use math::trig;
use scatter::{
    Bsdf, Coat, CoatProfiles, CoatedConductor, CoatedDiffuse, Conductor, Dielectric, Diffuse,
    DiffuseTransmission, ThinDielectric,
};
use spectrum::{Spectrum, SpectrumValue, Wavelengths};

use super::subsurface::effective_albedo;
use crate::textures::{FloatHandle, SpectrumHandle, Textures};
use crate::{MaterialId, TextureContext};

/// Widths up to this count as a mirror's.
const SMOOTH: f32 = 1e-3;

/// The kinds.
#[derive(Clone, Debug)]
pub(super) enum Surface {
    Diffuse {
        reflectance: SpectrumHandle,
    },
    DiffuseTransmission {
        reflectance: SpectrumHandle,
        transmittance: SpectrumHandle,
        scale: f32,
    },
    Conductor {
        metal: Metal,
        alpha: Alpha,
    },
    Dielectric {
        eta: Eta,
        alpha: Alpha,
    },
    ThinDielectric {
        eta: Eta,
    },
    CoatedDiffuse {
        base: Base,
        coat: Box<Layer>,
    },
    CoatedConductor {
        metal: Metal,
        alpha: Alpha,
        coat: Box<Layer>,
    },
    Mix {
        materials: [MaterialId; 2],
        amount: FloatHandle,
    },
    /// One on each side.
    TwoSided {
        front: MaterialId,
        back: MaterialId,
    },
    Interface,
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

/// Where parameters are looked up.
pub(super) struct Lookup<'a> {
    pub(super) textures: &'a Textures,
    pub(super) ctx: &'a TextureContext,
    pub(super) wl: &'a mut Wavelengths,
}

impl Lookup<'_> {
    fn float(&self, h: &FloatHandle) -> f32 {
        self.textures.float(h, self.ctx)
    }

    fn spectrum(&self, h: &SpectrumHandle) -> Spectrum {
        self.textures.spectrum(h, self.ctx, self.wl)
    }

    fn albedo(&self, h: &SpectrumHandle) -> Spectrum {
        self.spectrum(h).clamp(0.0, 1.0)
    }
}

impl Surface {
    /// The BSDF at a point; `None` for what is no surface.
    pub(super) fn bsdf(&self, at: &mut Lookup<'_>, profiles: &[CoatProfiles]) -> Option<Bsdf> {
        Some(match self {
            Self::Diffuse { reflectance } => Diffuse::new(at.albedo(reflectance)).into(),
            Self::DiffuseTransmission { reflectance, transmittance, scale } => {
                let scaled = |h| (at.spectrum(h) * *scale).clamp(0.0, 1.0);
                DiffuseTransmission::new(scaled(reflectance), scaled(transmittance)).into()
            }
            Self::Conductor { metal, alpha } => metal.conductor(at, alpha.at(at)).into(),
            Self::Dielectric { eta, alpha } => Dielectric::new(eta.at(at.wl), alpha.at(at)).into(),
            Self::ThinDielectric { eta } => ThinDielectric::new(eta.at(at.wl)).into(),
            Self::CoatedDiffuse { base, coat } => {
                let layer = coat.at(at);
                let profile = coat.profiles.and_then(|i| profiles[i].at(layer.alpha));
                CoatedDiffuse::new(base.albedo(at), &layer, profile).into()
            }
            Self::CoatedConductor { metal, alpha, coat } => {
                let metal = metal.conductor(at, alpha.at(at));
                CoatedConductor::new(metal, &coat.at(at)).into()
            }
            Self::Mix { .. } | Self::TwoSided { .. } | Self::Interface => return None,
        })
    }

    /// Does no parameter vary over the surface?
    pub(super) fn is_uniform(&self) -> bool {
        match self {
            Self::Diffuse { reflectance } => is_constant(reflectance),
            Self::DiffuseTransmission { reflectance, transmittance, .. } => {
                is_constant(reflectance) && is_constant(transmittance)
            }
            Self::Conductor { metal, alpha } => metal.is_uniform() && alpha.constant().is_some(),
            Self::Dielectric { alpha, .. } => alpha.constant().is_some(),
            Self::ThinDielectric { .. } => true,
            Self::CoatedDiffuse { base, coat } => base.is_uniform() && coat.is_uniform(),
            Self::CoatedConductor { metal, alpha, coat } => {
                metal.is_uniform() && alpha.constant().is_some() && coat.is_uniform()
            }
            Self::Mix { .. } | Self::TwoSided { .. } | Self::Interface => false,
        }
    }
}

impl Base {
    fn albedo(&self, at: &Lookup<'_>) -> Spectrum {
        match self {
            Self::Albedo(h) => at.albedo(h),
            Self::Subsurface { sigma_a, sigma_s, g } => {
                effective_albedo(at.spectrum(sigma_a), at.spectrum(sigma_s), *g)
            }
        }
    }

    fn is_uniform(&self) -> bool {
        match self {
            Self::Albedo(h) => is_constant(h),
            Self::Subsurface { sigma_a, sigma_s, .. } => is_constant(sigma_a) && is_constant(sigma_s),
        }
    }
}

impl Metal {
    fn conductor(&self, at: &Lookup<'_>, alpha: [f32; 2]) -> Conductor {
        match self {
            Self::EtaK { eta, k } => Conductor::new(at.spectrum(eta), at.spectrum(k), alpha),
            Self::Reflectance(r) => Conductor::from_reflectance(at.spectrum(r), alpha),
        }
    }

    fn is_uniform(&self) -> bool {
        match self {
            Self::EtaK { eta, k } => is_constant(eta) && is_constant(k),
            Self::Reflectance(r) => is_constant(r),
        }
    }
}

impl Alpha {
    /// The widths at a point; zeros for a mirror.
    fn at(&self, at: &Lookup<'_>) -> [f32; 2] {
        self.widths([at.float(&self.u), at.float(&self.v)])
    }

    /// The widths, if they are the same everywhere.
    pub(super) fn constant(&self) -> Option<[f32; 2]> {
        match (self.u, self.v) {
            (FloatHandle::Constant(u), FloatHandle::Constant(v)) => Some(self.widths([u, v])),
            (FloatHandle::Constant(_) | FloatHandle::Texture(_), _) => None,
        }
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
    fn at(&self, wl: &mut Wavelengths) -> f32 {
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

    fn is_constant(&self) -> bool {
        matches!(self, Self::Constant(_))
    }
}

impl Layer {
    fn at(&self, at: &mut Lookup<'_>) -> Coat {
        let coat = Coat {
            eta: self.eta.at(at.wl),
            alpha: self.alpha.at(at),
            thickness: at.float(&self.thickness).max(f32::MIN_POSITIVE),
            g: at.float(&self.g).clamp(-1.0, 1.0),
            albedo: at.albedo(&self.albedo),
            max_depth: self.max_depth,
            n_samples: self.n_samples,
        };
        // A clear coat keeps the whole series of bounces (docs/decisions/0011).
        if coat.is_clear() { Coat { max_depth: u16::MAX, ..coat } } else { coat }
    }

    fn is_uniform(&self) -> bool {
        let floats = [self.thickness, self.g];
        self.eta.is_constant()
            && self.alpha.constant().is_some()
            && floats.iter().all(|h| matches!(h, FloatHandle::Constant(_)))
            && is_constant(&self.albedo)
    }

    /// What its transmittance is tabulated by (index, thickness, range of widths); `None` where a table is of no
    /// use: it scatters, varies in more than its roughness, or has another roughness along u than along v.
    pub(super) fn profile_key(&self) -> Option<[f32; 4]> {
        let clear = matches!(&self.albedo, SpectrumHandle::Constant(a) if a.is_black());
        let (Eta::Constant(eta), FloatHandle::Constant(thickness)) = (&self.eta, self.thickness) else {
            return None;
        };
        if !clear || !self.alpha.is_isotropic() {
            return None;
        }
        let [lo, hi] = self.alpha.constant().map_or([0.0, 1.0], |[a, _]| [a, a]);
        let eta = if *eta > 0.0 { *eta } else { 1.0 };
        Some([eta, thickness.max(f32::MIN_POSITIVE), lo, hi])
    }
}

fn is_constant(h: &SpectrumHandle) -> bool {
    matches!(h, SpectrumHandle::Constant(_))
}
