//! A dielectric layer over Lambert's law: varnish, plastic, glazed ceramics. Both sides are alike.
//!
//! Two ways to the same mean (see `coated`): the closed form where the layer does not scatter and its boundary is
//! smooth or has a profile (its base has `scale = ρ Σ (ρ K)^k / (π η²)`), the random walk otherwise.
//! Furnace: a lossless coat over a white base returns what the cut-off at `max_depth` leaves of one (and, if rough,
//! what facets lose to each other).

use std::f32::consts::FRAC_1_PI;

use math::LocalDir;
use sampling::{Pdf, SolidAngle};
use spectrum::Spectrum;

use super::coated::{self, ClosedForm, Coat, CoatProfile, Layer, Walk};
use super::{BsdfKind, BsdfSample, Dielectric, Diffuse, LobeFlags, TransportMode};
use crate::fresnel;
use crate::microfacet::MIN_COS;

/// A coated matt surface.
#[derive(Clone, Copy, Debug)]
pub struct CoatedDiffuse {
    reflectance: Spectrum,
    inside: Inside,
}

/// How the light below the boundary is had.
#[derive(Clone, Copy, Debug)]
enum Inside {
    Closed { form: ClosedForm, max_depth: u16, n_samples: u16 },
    Walk { top: Dielectric, layer: Layer },
}

impl CoatedDiffuse {
    /// A base of this reflectance under the coat. `profile`, made for the coat's `eta`, `alpha` and `thickness`,
    /// saves the walk (rough coats) or the quadrature (smooth ones); anisotropic and scattering coats ignore it.
    #[must_use]
    pub fn new(reflectance: Spectrum, coat: &Coat, profile: Option<CoatProfile>) -> Self {
        let top = Dielectric::new(coat.eta, coat.alpha);
        let closed = if !coat.is_clear() || !(top.is_smooth() || top.facets().is_isotropic()) {
            None
        } else if top.is_smooth() {
            Some(profile.unwrap_or_else(|| CoatProfile::smooth(coat.eta, coat.thickness)))
        } else {
            profile.filter(CoatProfile::is_rough)
        };
        let inside = match closed {
            None => Inside::Walk { top, layer: coat.layer() },
            Some(profile) => {
                let k = profile.internal();
                let series = reflectance.map(|r| r * coated::bounces(r * k, coat.max_depth));
                let scale = series * (FRAC_1_PI / (coat.eta * coat.eta));
                let form = ClosedForm::new(top, scale, coat.thickness, profile);
                Inside::Closed { form, max_depth: coat.max_depth, n_samples: coat.n_samples }
            }
        };
        Self { reflectance, inside }
    }

    /// Runs one expression for either way.
    #[inline]
    fn either<T>(
        &self,
        closed: impl FnOnce(&ClosedForm) -> T,
        walk: impl FnOnce(&Walk<'_, Diffuse>) -> T,
    ) -> T {
        match &self.inside {
            Inside::Closed { form, .. } => closed(form),
            Inside::Walk { top, layer } => walk(&Walk { top, layer, base: &Diffuse::new(self.reflectance) }),
        }
    }
}

/// About the density of the walk: the boundary's lobe and a cosine for the rest.
fn walk_pdf(top: &Dielectric, wo: LocalDir, wi: LocalDir) -> Pdf<SolidAngle> {
    let passed = 1.0 - fresnel::dielectric(wo.0.z, top.eta());
    top.pdf_lobes(wo, wi, super::SampleLobes::All) + Pdf::new(passed * wi.0.z * FRAC_1_PI)
}

/// Both directions turned to the upper side; `None` unless they lie on one side, off the surface.
#[inline]
pub(super) fn upward(wo: LocalDir, wi: LocalDir) -> Option<(LocalDir, LocalDir)> {
    let off = wo.abs_cos_theta() > MIN_COS && wi.abs_cos_theta() > MIN_COS;
    if !off || !wo.same_hemisphere(wi) {
        return None;
    }
    Some(if wo.0.z < 0.0 { (-wo, -wi) } else { (wo, wi) })
}

/// Samples for `wo` on the upper side, and turns the answer back.
#[inline]
pub(super) fn sample_upward(
    wo: LocalDir,
    sample: impl FnOnce(LocalDir) -> Option<BsdfSample>,
) -> Option<BsdfSample> {
    if wo.abs_cos_theta() <= MIN_COS {
        return None;
    }
    let below = wo.0.z < 0.0;
    let mut s = sample(if below { -wo } else { wo })?;
    if below {
        s.wi = -s.wi;
    }
    Some(s)
}

impl BsdfKind for CoatedDiffuse {
    fn eval(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Spectrum {
        let Some((wo, wi)) = upward(wo, wi) else { return Spectrum::ZERO };
        self.either(|c| c.eval_pdf(wo, wi, Spectrum::ONE).0, |w| w.eval(wo, wi, mode))
    }

    fn pdf(&self, wo: LocalDir, wi: LocalDir, _: TransportMode) -> Pdf<SolidAngle> {
        let Some((wo, wi)) = upward(wo, wi) else { return Pdf::ZERO };
        self.either(|c| c.eval_pdf(wo, wi, Spectrum::ONE).1, |w| walk_pdf(w.top, wo, wi))
    }

    #[inline]
    fn eval_pdf(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> (Spectrum, Pdf<SolidAngle>) {
        let Some((wo, wi)) = upward(wo, wi) else { return (Spectrum::ZERO, Pdf::ZERO) };
        self.either(
            |c| c.eval_pdf(wo, wi, Spectrum::ONE),
            |w| (w.eval(wo, wi, mode), walk_pdf(w.top, wo, wi)),
        )
    }

    fn sample(&self, wo: LocalDir, u_lobe: f32, u: [f32; 2], mode: TransportMode) -> Option<BsdfSample> {
        sample_upward(wo, |wo| {
            self.either(
                |c| c.sample(wo, u_lobe, u, Spectrum::ONE),
                |w| w.sample(wo, u_lobe, u, mode, |wi| walk_pdf(w.top, wo, wi)),
            )
        })
    }

    fn flags(&self) -> LobeFlags {
        self.either(ClosedForm::flags, |w| w.flags())
    }

    fn specular_probability(&self, wo: LocalDir) -> f32 {
        let up = if wo.0.z < 0.0 { -wo } else { wo };
        let delta = |top: &Dielectric, p: f32| if top.is_smooth() { p } else { 0.0 };
        self.either(
            |c| delta(c.top(), c.top_probability(up, Spectrum::ONE).unwrap_or(0.0)),
            |w| delta(w.top, fresnel::dielectric(up.0.z, w.top.eta())),
        )
    }

    fn albedo_estimate(&self, wo: LocalDir) -> Spectrum {
        let up = if wo.0.z < 0.0 { -wo } else { wo };
        self.either(
            |c| {
                let [top, base] = c.albedos(up, Spectrum::ONE);
                top + base
            },
            |w| {
                let top = fresnel::dielectric(up.0.z, w.top.eta());
                Spectrum::splat(top) + self.reflectance * (1.0 - top)
            },
        )
    }

    /// The widened boundary has no profile, so the walk takes over.
    fn regularized(&self) -> Self {
        let (top, layer) = match &self.inside {
            Inside::Walk { top, layer } => (*top, *layer),
            Inside::Closed { form, max_depth, n_samples } => {
                let (max_depth, n_samples) = (*max_depth, *n_samples);
                let thickness = form.thickness();
                (*form.top(), Layer { thickness, g: 0.0, albedo: Spectrum::ZERO, max_depth, n_samples })
            }
        };
        Self { inside: Inside::Walk { top: top.widened(), layer }, ..*self }
    }
}
