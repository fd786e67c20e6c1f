//! A pane: two parallel smooth interfaces, so thin that light leaves where it came in.
//!
//! All bounces inside add up: `R' = R + T² R / (1 − R²)` and `T' = 1 − R'`; light passes straight on.
//! Left out: absorption in the pane, interference, and polarisation.

use math::LocalDir;
use sampling::{Pdf, SolidAngle};
use spectrum::Spectrum;

use super::{BsdfKind, BsdfSample, Gloss, Lobe, LobeFlags, TransportMode};
use crate::fresnel;
use crate::microfacet::MIN_COS;

/// Window glass as one surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinDielectric {
    eta: f32,
}

impl ThinDielectric {
    /// With the index of the pane over that of what is around it.
    #[must_use]
    pub fn new(eta: f32) -> Self {
        Self { eta }
    }

    /// Reflectance of the whole pane.
    #[must_use]
    pub fn reflectance(&self, wo: LocalDir) -> f32 {
        let r = fresnel::dielectric(wo.abs_cos_theta(), self.eta);
        // R + T² R / (1 − R²) with T = 1 − R is 2R / (1 + R), also where R = 1.
        2.0 * r / (1.0 + r)
    }
}

impl BsdfKind for ThinDielectric {
    fn eval(&self, _: LocalDir, _: LocalDir, _: TransportMode) -> Spectrum {
        Spectrum::ZERO
    }

    fn pdf(&self, _: LocalDir, _: LocalDir, _: TransportMode) -> Pdf<SolidAngle> {
        Pdf::ZERO
    }

    fn sample(&self, wo: LocalDir, u_lobe: f32, _: [f32; 2], _: TransportMode) -> Option<BsdfSample> {
        if wo.abs_cos_theta() <= MIN_COS {
            return None;
        }
        // The weight is one: each side is chosen with what it carries.
        let r = self.reflectance(wo);
        Some(if u_lobe < r {
            BsdfSample::delta(wo.reflect(), Spectrum::ONE, r, Lobe::reflection(Gloss::Specular))
        } else {
            BsdfSample::delta(-wo, Spectrum::ONE, 1.0 - r, Lobe::transmission(Gloss::Specular))
        })
    }

    fn is_isotropic(&self) -> bool {
        true
    }

    fn flags(&self) -> LobeFlags {
        LobeFlags::SPECULAR_REFLECTION | LobeFlags::SPECULAR_TRANSMISSION
    }

    fn albedo_estimate(&self, _: LocalDir) -> Spectrum {
        Spectrum::ONE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pane_transmits_what_the_table_says() {
        // Ground truth, sec. 7: T = (1 − F)/(1 + F) at 0, 45, 60 and 75 degrees.
        let pane = ThinDielectric::new(1.5);
        for (degrees, t) in
            [(0.0, 0.923_076_9), (45.0, 0.904_326_8), (60.0, 0.836_232_5), (75.0, 0.596_092_0)]
        {
            let (sin, cos) = math::trig::sin_cos(f32::to_radians(degrees));
            let found = 1.0 - pane.reflectance(LocalDir::new(sin, 0.0, cos));
            assert!((found - t).abs() < 2e-6, "{degrees}: {found} is not {t}");
        }
        // Seen edge-on it reflects everything, without NaN.
        assert_eq!(pane.reflectance(LocalDir::new(1.0, 0.0, 0.0)), 1.0);
    }
}
