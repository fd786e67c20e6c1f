//! Plastic: a dielectric boundary, smooth or rough, over Lambert's law, with all bounces between them.
//!
//! | lobe     | value                                                                | source                       |
//! |----------|----------------------------------------------------------------------|------------------------------|
//! | boundary | delta, or `F D G2 / (4 cos cos)`, times a tint                        | `coated`                     |
//! | base     | `t(wo) t(wi) ρ / (π η² (1 − ρ K))`, with `ρ` one below the line if linear | `coated`; Mitsuba's `plastic` |
//!
//! `t` is what gets through the boundary, `K` what it sends back to the base ([`CoatProfile`]). Furnace: over a white
//! base one, if the boundary is smooth; if rough, less what its facets lose to each other.

use std::f32::consts::FRAC_1_PI;

use math::LocalDir;
use sampling::{Pdf, SolidAngle};
use spectrum::Spectrum;

use super::coated::{ClosedForm, CoatProfile};
use super::coated_diffuse::{sample_upward, upward};
use super::{BsdfKind, BsdfSample, Dielectric, LobeFlags, TransportMode};
use crate::microfacet::Facets;

/// A matt surface under a clear boundary. Both sides are alike.
#[derive(Clone, Copy, Debug)]
pub struct Plastic {
    form: ClosedForm,
    tint: Spectrum,
}

impl Plastic {
    /// A base of this reflectance under a boundary of index `eta`, whose `profile` (without thickness) is that of its
    /// facets. `nonlinear`: the colour deepens with each bounce.
    #[must_use]
    pub fn new(
        reflectance: Spectrum,
        eta: f32,
        facets: Facets,
        profile: CoatProfile,
        nonlinear: bool,
    ) -> Self {
        let k = profile.internal();
        let bounces = |r: f32| r / (1.0 - if nonlinear { r } else { 1.0 } * k).max(1e-4);
        let scale = reflectance.map(bounces) * (FRAC_1_PI / (eta * eta));
        Self { form: ClosedForm::new(Dielectric::new(eta, facets), scale, 0.0, profile), tint: Spectrum::ONE }
    }

    /// The same with a factor on specular reflection.
    #[must_use]
    pub fn tinted(self, tint: Spectrum) -> Self {
        Self { tint, ..self }
    }
}

impl BsdfKind for Plastic {
    fn eval(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Spectrum {
        self.eval_pdf(wo, wi, mode).0
    }

    fn pdf(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Pdf<SolidAngle> {
        self.eval_pdf(wo, wi, mode).1
    }

    #[inline]
    fn eval_pdf(&self, wo: LocalDir, wi: LocalDir, _: TransportMode) -> (Spectrum, Pdf<SolidAngle>) {
        let Some((wo, wi)) = upward(wo, wi) else { return (Spectrum::ZERO, Pdf::ZERO) };
        self.form.eval_pdf(wo, wi, self.tint)
    }

    fn sample(&self, wo: LocalDir, u_lobe: f32, u: [f32; 2], _: TransportMode) -> Option<BsdfSample> {
        sample_upward(wo, |wo| self.form.sample(wo, u_lobe, u, self.tint))
    }

    fn flags(&self) -> LobeFlags {
        self.form.flags()
    }

    fn specular_probability(&self, wo: LocalDir) -> f32 {
        let up = if wo.0.z < 0.0 { -wo } else { wo };
        let smooth = self.form.top().is_smooth();
        if smooth { self.form.top_probability(up, self.tint).unwrap_or(0.0) } else { 0.0 }
    }

    fn albedo_estimate(&self, wo: LocalDir) -> Spectrum {
        let up = if wo.0.z < 0.0 { -wo } else { wo };
        let [top, base] = self.form.albedos(up, self.tint);
        top + base
    }

    fn regularized(&self) -> Self {
        Self { form: self.form.widened(), ..*self }
    }
}
