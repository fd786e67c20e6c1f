//! A dielectric layer over Lambert's law: varnish, plastic, glazed ceramics. Both sides are alike.
//!
//! Two ways to the same mean (see `coated`): the closed form where the layer does not scatter and its boundary is
//! smooth or has a profile, the random walk otherwise.
//!
//! | lobe of the closed form | value                                     | sampled by                 |
//! |-------------------------|-------------------------------------------|----------------------------|
//! | boundary                | delta, or `F D G2 / (4 cos cos)`          | mirror, or visible normals |
//! | base                    | `t(wo) t(wi) ρ Σ (ρ K)^k / (π η²)`        | cosine                     |
//!
//! The lobe is chosen by what each is worth from `wo`. Furnace: a lossless coat over a white base returns what the
//! cut-off at `max_depth` leaves of one (and, if rough, what facets lose to each other).

use std::f32::consts::{FRAC_1_PI, PI};

use math::LocalDir;
use sampling::{Pdf, SolidAngle};
use spectrum::Spectrum;

use super::coated::{self, Coat, CoatProfile, Layer, Walk};
use super::conductor::{mirror, mirroring_facet};
use super::diffuse::cosine_on_side_of;
use super::{BsdfKind, BsdfSample, Dielectric, Diffuse, Gloss, Lobe, LobeFlags, TransportMode};
use crate::fresnel;
use crate::microfacet::MIN_COS;

/// A coated matt surface.
#[derive(Clone, Copy, Debug)]
pub struct CoatedDiffuse {
    top: Dielectric,
    reflectance: Spectrum,
    inside: Inside,
}

/// How the light below the boundary is had.
#[derive(Clone, Copy, Debug)]
enum Inside {
    Closed {
        /// `ρ Σ (ρ K)^k / (π η²)`.
        scale: Spectrum,
        profile: CoatProfile,
        thickness: f32,
        max_depth: u16,
        n_samples: u16,
    },
    Walk(Layer),
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
        let inside = closed.map_or(Inside::Walk(coat.layer()), |profile| {
            let k = profile.internal();
            let series = reflectance.map(|r| r * coated::bounces(r * k, coat.max_depth));
            let scale = series * (FRAC_1_PI / (coat.eta * coat.eta));
            let (thickness, max_depth, n_samples) = (coat.thickness, coat.max_depth, coat.n_samples);
            Inside::Closed { scale, profile, thickness, max_depth, n_samples }
        });
        Self { top, reflectance, inside }
    }

    /// Reflectance of the coat and of all below it at `wo`, of the closed form: exact where the coat is smooth.
    fn albedos(&self, wo: LocalDir, closed: &Closed<'_>) -> (f32, Spectrum) {
        let top = fresnel::dielectric(wo.0.z, self.top.eta());
        (top, *closed.scale * (PI * closed.profile.average() * self.transmittance(wo, closed)))
    }

    /// What gets from `w` (z > 0) to the base.
    #[inline]
    fn transmittance(&self, w: LocalDir, closed: &Closed<'_>) -> f32 {
        if self.top.is_smooth() {
            coated::smooth_at(self.top.eta(), closed.thickness, w.0.z)
        } else {
            closed.profile.rough_at(w.0.z)
        }
    }

    /// Chance of sampling the boundary rather than the base; `None` where neither reflects.
    #[inline]
    fn top_probability(&self, wo: LocalDir, closed: &Closed<'_>) -> Option<f32> {
        let (top, base) = self.albedos(wo, closed);
        let sum = top + base.max_component();
        (sum > 0.0).then(|| top / sum)
    }

    /// `f` and the density, for directions on the upper side.
    #[inline]
    fn closed_eval_pdf(
        &self,
        wo: LocalDir,
        wi: LocalDir,
        closed: &Closed<'_>,
    ) -> (Spectrum, Pdf<SolidAngle>) {
        let Some(p_top) = self.top_probability(wo, closed) else { return (Spectrum::ZERO, Pdf::ZERO) };
        let t = self.transmittance(wo, closed) * self.transmittance(wi, closed);
        let mut f = *closed.scale * t;
        let mut pdf = (1.0 - p_top) * wi.0.z * FRAC_1_PI;
        if !self.top.is_smooth()
            && let Some(m) = mirroring_facet(wo, wi)
        {
            let facets = self.top.facets();
            let (so, si) = (facets.stretch(wo), facets.stretch(wi));
            let half_d = 0.5 * facets.d(m);
            let reflectance = fresnel::dielectric(wo.dot(m), self.top.eta());
            f += Spectrum::splat(reflectance * half_d / (so * wi.0.z + si * wo.0.z));
            pdf += p_top * half_d / (wo.0.z + so);
        }
        (f, Pdf::new(pdf))
    }

    /// A sample for `wo` on the upper side.
    fn closed_sample(
        &self,
        wo: LocalDir,
        u_lobe: f32,
        u: [f32; 2],
        closed: &Closed<'_>,
    ) -> Option<BsdfSample> {
        let p_top = self.top_probability(wo, closed)?;
        if self.top.is_smooth() {
            if u_lobe < p_top {
                let weight = Spectrum::splat(fresnel::dielectric(wo.0.z, self.top.eta()) / p_top);
                let lobe = Lobe::reflection(Gloss::Specular);
                return Some(BsdfSample::delta(wo.reflect(), weight, p_top, lobe));
            }
            let wi = cosine_on_side_of(wo, u)?;
            let p = 1.0 - p_top;
            let t = self.transmittance(wo, closed) * self.transmittance(wi, closed);
            let weight = *closed.scale * (PI * t / p);
            let lobe = Lobe::reflection(Gloss::Diffuse);
            return Some(BsdfSample::smooth(wi, weight, Pdf::new(p * wi.0.z * FRAC_1_PI), lobe));
        }

        // Two lobes overlap: weigh by the density of both.
        let (wi, gloss) = if u_lobe < p_top {
            (mirror(wo, self.top.facets().sample_visible(wo, u)), Gloss::Glossy)
        } else {
            (cosine_on_side_of(wo, u)?, Gloss::Diffuse)
        };
        if wi.0.z <= MIN_COS {
            return None;
        }
        let (f, pdf) = self.closed_eval_pdf(wo, wi, closed);
        pdf.is_positive()
            .then(|| BsdfSample::smooth(wi, f * (wi.0.z / pdf.value()), pdf, Lobe::reflection(gloss)))
    }

    /// About the density of the walk: the boundary's lobe and a cosine for the rest.
    fn walk_pdf(&self, wo: LocalDir, wi: LocalDir) -> Pdf<SolidAngle> {
        let passed = 1.0 - fresnel::dielectric(wo.0.z, self.top.eta());
        self.top.pdf_lobes(wo, wi, super::SampleLobes::All) + Pdf::new(passed * wi.0.z * FRAC_1_PI)
    }
}

/// The closed form's numbers, borrowed.
struct Closed<'a> {
    scale: &'a Spectrum,
    profile: &'a CoatProfile,
    thickness: f32,
}

impl CoatedDiffuse {
    /// Runs one expression for either way.
    #[inline]
    fn either<T>(
        &self,
        closed: impl FnOnce(&Closed<'_>) -> T,
        walk: impl FnOnce(&Walk<'_, Diffuse>) -> T,
    ) -> T {
        match &self.inside {
            Inside::Closed { scale, profile, thickness, .. } => {
                closed(&Closed { scale, profile, thickness: *thickness })
            }
            Inside::Walk(layer) => {
                walk(&Walk { top: &self.top, layer, base: &Diffuse::new(self.reflectance) })
            }
        }
    }
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
        self.either(|c| self.closed_eval_pdf(wo, wi, c).0, |w| w.eval(wo, wi, mode))
    }

    fn pdf(&self, wo: LocalDir, wi: LocalDir, _: TransportMode) -> Pdf<SolidAngle> {
        let Some((wo, wi)) = upward(wo, wi) else { return Pdf::ZERO };
        self.either(|c| self.closed_eval_pdf(wo, wi, c).1, |_| self.walk_pdf(wo, wi))
    }

    #[inline]
    fn eval_pdf(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> (Spectrum, Pdf<SolidAngle>) {
        let Some((wo, wi)) = upward(wo, wi) else { return (Spectrum::ZERO, Pdf::ZERO) };
        self.either(|c| self.closed_eval_pdf(wo, wi, c), |w| (w.eval(wo, wi, mode), self.walk_pdf(wo, wi)))
    }

    fn sample(&self, wo: LocalDir, u_lobe: f32, u: [f32; 2], mode: TransportMode) -> Option<BsdfSample> {
        sample_upward(wo, |wo| {
            self.either(
                |c| self.closed_sample(wo, u_lobe, u, c),
                |w| w.sample(wo, u_lobe, u, mode, |wi| self.walk_pdf(wo, wi)),
            )
        })
    }

    fn flags(&self) -> LobeFlags {
        self.either(
            |_| {
                let base = Diffuse::new(self.reflectance).flags();
                let smooth = self.top.is_smooth();
                base | if smooth { LobeFlags::SPECULAR_REFLECTION } else { LobeFlags::GLOSSY_REFLECTION }
            },
            |w| w.flags(),
        )
    }

    fn specular_probability(&self, wo: LocalDir) -> f32 {
        if !self.top.is_smooth() {
            return 0.0;
        }
        let up = if wo.0.z < 0.0 { -wo } else { wo };
        self.either(
            |c| self.top_probability(up, c).unwrap_or(0.0),
            |_| fresnel::dielectric(up.0.z, self.top.eta()),
        )
    }

    fn albedo_estimate(&self, wo: LocalDir) -> Spectrum {
        let up = if wo.0.z < 0.0 { -wo } else { wo };
        let top = fresnel::dielectric(up.0.z, self.top.eta());
        self.either(
            |c| {
                let (top, base) = self.albedos(up, c);
                Spectrum::splat(top) + base
            },
            |_| Spectrum::splat(top) + self.reflectance * (1.0 - top),
        )
    }

    /// The widened boundary has no profile, so the walk takes over.
    fn regularized(&self) -> Self {
        let layer = match self.inside {
            Inside::Walk(layer) => layer,
            Inside::Closed { thickness, max_depth, n_samples, .. } => {
                Layer { thickness, g: 0.0, albedo: Spectrum::ZERO, max_depth, n_samples }
            }
        };
        Self { top: self.top.regularized(), inside: Inside::Walk(layer), ..*self }
    }
}
