//! The kinds of surface, and the BSDF that they make at a point.

use scatter::microfacet::Facets;
use scatter::{
    Bsdf, CoatProfile, CoatProfiles, CoatedConductor, CoatedDiffuse, CompensatedConductor, Dielectric,
    Diffuse, DiffuseTransmission, OrenNayar, Plastic, SoftBorder, ThinDielectric, TintedDielectric,
};
use spectrum::{Spectrum, Wavelengths};

use super::artist::{HairLook, MetallicRoughnessLook, PrincipledLook};
use super::measured::MeasuredLook;
use super::parameters::{Alpha, Base, Eta, Layer, Lookup, Metal, Tints};
use super::subsurface::Diffuser;
use crate::textures::{FloatHandle, SpectrumHandle};

/// The kinds of surface that scatter.
#[derive(Clone, Debug)]
pub(super) enum Look {
    Diffuse {
        reflectance: SpectrumHandle,
    },
    DiffuseTransmission {
        reflectance: SpectrumHandle,
        transmittance: SpectrumHandle,
        scale: f32,
    },
    OrenNayar {
        reflectance: SpectrumHandle,
        sigma_degrees: FloatHandle,
    },
    Conductor {
        metal: Metal,
        alpha: Alpha,
        tint: Tints,
    },
    Dielectric {
        eta: Eta,
        alpha: Alpha,
        tint: Tints,
    },
    ThinDielectric {
        eta: Eta,
        tint: Tints,
    },
    /// With a medium inside, or over a diffusion profile.
    SoftBorder {
        eta: f32,
        alpha: Alpha,
        profile: Option<Box<Diffuser>>,
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
    Plastic(Box<PlasticLook>),
    Principled(Box<PrincipledLook>),
    MetallicRoughness(Box<MetallicRoughnessLook>),
    Hair(Box<HairLook>),
    Measured(MeasuredLook),
}

/// A boundary over Lambert's law.
#[derive(Clone, Debug)]
pub(super) struct PlasticLook {
    pub(super) reflectance: SpectrumHandle,
    pub(super) eta: Eta,
    pub(super) alpha: Alpha,
    pub(super) tint: Tints,
    pub(super) nonlinear: bool,
    /// Index of its tabulated transmittance.
    pub(super) profiles: Option<usize>,
}

impl Look {
    /// The BSDF at a point.
    pub(super) fn bsdf(&self, at: &mut Lookup<'_>, profiles: &[CoatProfiles]) -> Bsdf {
        match self {
            Self::Diffuse { reflectance } => Diffuse::new(at.albedo(reflectance)).into(),
            Self::DiffuseTransmission { reflectance, transmittance, scale } => {
                let mut scaled = |h| (at.spectrum(h) * *scale).clamp(0.0, 1.0);
                DiffuseTransmission::new(scaled(reflectance), scaled(transmittance)).into()
            }
            Self::OrenNayar { reflectance, sigma_degrees } => {
                let sigma = at.float(sigma_degrees).clamp(0.0, 90.0).to_radians();
                OrenNayar::new(at.albedo(reflectance), sigma).into()
            }
            Self::Conductor { metal, alpha, tint } => {
                let facets = alpha.at(at);
                let conductor = metal.conductor(at, facets);
                let conductor = match &tint.reflectance {
                    Some(r) => conductor.tinted(at.positive(r)),
                    None => conductor,
                };
                if alpha.compensate { CompensatedConductor::new(conductor).into() } else { conductor.into() }
            }
            Self::Dielectric { eta, alpha, tint } => {
                let facets = alpha.at(at);
                let glass = Dielectric::new(eta.at(at.wl) / at.outside, facets);
                match tint.at(at) {
                    Some([r, t]) => TintedDielectric::glass(glass, r, t).into(),
                    None => glass.into(),
                }
            }
            Self::SoftBorder { eta, alpha, profile } => {
                let border = SoftBorder::new(*eta / at.outside, alpha.at(at));
                if profile.is_some() { border.over_profile().into() } else { border.into() }
            }
            Self::ThinDielectric { eta, tint } => {
                let pane = ThinDielectric::new(eta.at(at.wl));
                match tint.at(at) {
                    Some([r, t]) => TintedDielectric::pane(pane, r, t).into(),
                    None => pane.into(),
                }
            }
            Self::CoatedDiffuse { base, coat } => {
                let layer = coat.at(at);
                let profile = coat.profiles.and_then(|i| profiles[i].at(layer.alpha));
                CoatedDiffuse::new(base.albedo(at), &layer, profile).into()
            }
            Self::CoatedConductor { metal, alpha, coat } => {
                let facets = alpha.at(at);
                let metal = metal.conductor(at, facets);
                CoatedConductor::new(metal, &coat.at(at)).into()
            }
            Self::Plastic(plastic) => plastic.bsdf(at, profiles).into(),
            Self::Principled(principled) => principled.bsdf(at),
            Self::MetallicRoughness(gltf) => gltf.bsdf(at),
            Self::Hair(hair) => hair.bsdf(at),
            Self::Measured(measured) => measured.bsdf(at.wl),
        }
    }

    /// The index of refraction of what is inside; one for what has no inside.
    pub(super) fn index_of_refraction(&self, wl: &mut Wavelengths) -> f32 {
        match self {
            Self::Dielectric { eta, .. } => eta.at(wl),
            Self::SoftBorder { eta, .. } => *eta,
            Self::Diffuse { .. }
            | Self::DiffuseTransmission { .. }
            | Self::OrenNayar { .. }
            | Self::Conductor { .. }
            | Self::ThinDielectric { .. }
            | Self::CoatedDiffuse { .. }
            | Self::CoatedConductor { .. }
            | Self::Plastic(_)
            | Self::Principled(_)
            | Self::MetallicRoughness(_)
            | Self::Hair(_)
            | Self::Measured(_) => 1.0,
        }
    }

    /// May it scatter by deltas alone?
    pub(super) fn may_be_specular(&self) -> bool {
        match self {
            Self::Conductor { .. }
            | Self::Dielectric { .. }
            | Self::ThinDielectric { .. }
            | Self::CoatedConductor { .. } => true,
            Self::Diffuse { .. }
            | Self::DiffuseTransmission { .. }
            | Self::OrenNayar { .. }
            | Self::SoftBorder { .. }
            | Self::CoatedDiffuse { .. }
            | Self::Plastic(_)
            | Self::Principled(_)
            | Self::MetallicRoughness(_)
            | Self::Hair(_)
            | Self::Measured(_) => false,
        }
    }

    /// How far its tangent is turned about the normal, if it has such a number.
    pub(super) fn rotation(&self) -> Option<&FloatHandle> {
        match self {
            Self::MetallicRoughness(gltf) if gltf.rotation != FloatHandle::Constant(0.0) => {
                Some(&gltf.rotation)
            }
            Self::Diffuse { .. }
            | Self::DiffuseTransmission { .. }
            | Self::OrenNayar { .. }
            | Self::Conductor { .. }
            | Self::Dielectric { .. }
            | Self::ThinDielectric { .. }
            | Self::SoftBorder { .. }
            | Self::CoatedDiffuse { .. }
            | Self::CoatedConductor { .. }
            | Self::Plastic(_)
            | Self::Principled(_)
            | Self::MetallicRoughness(_)
            | Self::Hair(_)
            | Self::Measured(_) => None,
        }
    }
}

impl PlasticLook {
    fn bsdf(&self, at: &mut Lookup<'_>, profiles: &[CoatProfiles]) -> Plastic {
        let (eta, facets) = (self.eta.at(at.wl), self.alpha.at(at));
        let [u, v] = facets.alpha();
        let alpha = (u * v).sqrt();
        let profile = self.profiles.and_then(|i| profiles[i].at([alpha; 2]));
        let profile = profile.unwrap_or_else(|| CoatProfile::smooth(eta, 0.0));
        let facets = if facets.is_smooth() { Facets::SMOOTH } else { facets };
        let plastic = Plastic::new(at.albedo(&self.reflectance), eta, facets, profile, self.nonlinear);
        plastic.tinted(self.tint.reflectance.as_ref().map_or(Spectrum::ONE, |r| at.positive(r)))
    }
}
