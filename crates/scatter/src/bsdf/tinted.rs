//! Glass with factors on what it reflects and transmits: no physics, but files have them.
//!
//! All is that of the glass or pane inside, times a factor for each side, which takes part in no choice.

use math::LocalDir;
use sampling::{Pdf, SolidAngle};
use spectrum::Spectrum;

use super::{BsdfKind, BsdfSample, Dielectric, LobeFlags, ThinDielectric, TransportMode};

/// Glass or a pane with factors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TintedDielectric {
    clear: Clear,
    reflectance: Spectrum,
    transmittance: Spectrum,
}

/// What it is without its factors.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Clear {
    Glass(Dielectric),
    Pane(ThinDielectric),
}

impl From<Dielectric> for Clear {
    fn from(glass: Dielectric) -> Self {
        Self::Glass(glass)
    }
}

impl From<ThinDielectric> for Clear {
    fn from(pane: ThinDielectric) -> Self {
        Self::Pane(pane)
    }
}

impl TintedDielectric {
    /// Glass with factors on reflection and transmission.
    #[must_use]
    pub fn glass(clear: Dielectric, reflectance: Spectrum, transmittance: Spectrum) -> Self {
        Self { clear: clear.into(), reflectance, transmittance }
    }

    /// A pane with factors on reflection and transmission.
    #[must_use]
    pub fn pane(clear: ThinDielectric, reflectance: Spectrum, transmittance: Spectrum) -> Self {
        Self { clear: clear.into(), reflectance, transmittance }
    }

    fn factor(&self, is_transmission: bool) -> Spectrum {
        if is_transmission { self.transmittance } else { self.reflectance }
    }

    #[inline]
    fn either<T>(&self, glass: impl FnOnce(&Dielectric) -> T, pane: impl FnOnce(&ThinDielectric) -> T) -> T {
        match &self.clear {
            Clear::Glass(g) => glass(g),
            Clear::Pane(p) => pane(p),
        }
    }
}

impl BsdfKind for TintedDielectric {
    fn eval(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Spectrum {
        let f = self.either(|g| g.eval(wo, wi, mode), |p| p.eval(wo, wi, mode));
        f * self.factor(!wo.same_hemisphere(wi))
    }

    fn pdf(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Pdf<SolidAngle> {
        self.either(|g| g.pdf(wo, wi, mode), |p| p.pdf(wo, wi, mode))
    }

    fn sample(&self, wo: LocalDir, u_lobe: f32, u: [f32; 2], mode: TransportMode) -> Option<BsdfSample> {
        let s = self.either(|g| g.sample(wo, u_lobe, u, mode), |p| p.sample(wo, u_lobe, u, mode))?;
        Some(BsdfSample { weight: s.weight * self.factor(s.lobe.is_transmission()), ..s })
    }

    fn flags(&self) -> LobeFlags {
        self.either(BsdfKind::flags, BsdfKind::flags)
    }

    fn albedo_estimate(&self, _: LocalDir) -> Spectrum {
        (self.reflectance + self.transmittance) * 0.5
    }

    fn regularized(&self) -> Self {
        Self { clear: self.either(|g| g.regularized().into(), |p| (*p).into()), ..*self }
    }
}
