//! A dielectric layer over metal: lacquered brass, car paint's base. Both sides are alike.
//!
//! A smooth layer without scattering over a mirror is a mirror, whose bounces add up to
//! `F + T² R A Σ_{k<n} (F R A)^k`, with the metal's reflectance `R` inside the layer and `A` the absorption of one way
//! down and up. Everything else is the random walk (`coated`); there the density for multiple importance sampling
//! is an approximation: the boundary's lobe, the metal's lobe as seen through a smooth boundary, and a cosine.
//!
//! Furnace: at most one; what is missing was absorbed, lost between facets, or cut off at `max_depth`.

use std::f32::consts::FRAC_1_PI;

use math::{LocalDir, trig};
use sampling::{Pdf, SolidAngle};
use spectrum::Spectrum;

use super::coated::{self, Coat, Layer, Walk};
use super::coated_diffuse::{sample_upward, upward};
use super::conductor::mirroring_facet;
use super::{
    BsdfKind, BsdfSample, Conductor, Dielectric, Gloss, Lobe, LobeFlags, SampleLobes, TransportMode,
};
use crate::fresnel;
use crate::microfacet::Facets;

/// A coated metal.
#[derive(Clone, Copy, Debug)]
pub struct CoatedConductor {
    top: Dielectric,
    /// With its index relative to the layer's.
    base: Conductor,
    layer: Layer,
}

impl CoatedConductor {
    /// `metal`'s index is relative to the *outside*, as if there were no coat.
    #[must_use]
    pub fn new(metal: Conductor, coat: &Coat) -> Self {
        let top = Dielectric::new(coat.eta, coat.alpha);
        Self { top, base: metal.under(coat.eta), layer: coat.layer() }
    }

    fn walk(&self) -> Walk<'_, Conductor> {
        Walk { top: &self.top, layer: &self.layer, base: &self.base }
    }

    /// A mirror all in all?
    fn is_mirror(&self) -> bool {
        self.top.is_smooth() && self.base.facets().is_smooth() && self.layer.albedo.is_black()
    }

    /// Reflectance of the whole, if it is a mirror.
    fn mirror_reflectance(&self, cos: f32) -> Spectrum {
        let there = fresnel::interface(cos, self.top.eta());
        let f = there.reflectance;
        if f >= 1.0 {
            return Spectrum::ONE;
        }
        let absorbed = trig::exp(-2.0 * self.layer.thickness / there.cos_transmitted);
        self.base.fresnel(there.cos_transmitted).map(|r| {
            let ra = r * absorbed;
            f + (1.0 - f) * (1.0 - f) * ra * coated::bounces(f * ra, self.layer.max_depth)
        })
    }

    /// The facets that the metal seems to have below a rough boundary: a refraction turns light by about
    /// `(1 − 1/η)` of a slope, a reflection by twice a slope.
    fn apparent_facets(&self) -> Facets {
        let bend = 1.0 - 1.0 / self.top.eta();
        let (a, b) = (self.base.facets().alpha(), self.top.facets().alpha());
        let widen = |a: f32, b: f32| (a * a + 0.5 * (bend * b) * (bend * b)).sqrt();
        Facets::new([widen(a[0], b[0]), widen(a[1], b[1])], self.base.facets().distribution())
    }

    /// About the density of the walk, for directions on the upper side.
    fn walk_pdf(&self, wo: LocalDir, wi: LocalDir) -> Pdf<SolidAngle> {
        if self.is_mirror() {
            return Pdf::ZERO;
        }
        let even = Pdf::new(0.1 * wi.0.z * FRAC_1_PI);
        let top = self.top.pdf_lobes(wo, wi, SampleLobes::All) * 0.9;
        let facets = self.apparent_facets();
        let refracted = (self.refract(wo), self.refract(wi));
        let ((Some((o, f_o)), Some((i, f_i))), false) = (refracted, facets.is_smooth()) else {
            return top + even;
        };

        // Inside: D / (2 (co + so)); outside: dω' / dω = cos θ / (η² cos θ').
        let Some(m) = mirroring_facet(o, i) else { return top + even };
        let eta = self.top.eta();
        let inside = facets.d(m) / (2.0 * (o.0.z + facets.stretch(o)));
        let base = inside * wi.0.z / (eta * eta * i.0.z) * (1.0 - f_o) * (1.0 - f_i);
        top + even + Pdf::new(0.9 * base)
    }

    /// `w` as it goes on inside, turned up again, and the reflectance on the way.
    fn refract(&self, w: LocalDir) -> Option<(LocalDir, f32)> {
        let eta = self.top.eta();
        let there = fresnel::interface(w.0.z, eta);
        let inside = LocalDir::new(w.0.x / eta, w.0.y / eta, there.cos_transmitted);
        (there.cos_transmitted > 0.0).then_some((inside, there.reflectance))
    }
}

impl BsdfKind for CoatedConductor {
    fn eval(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Spectrum {
        if self.is_mirror() {
            return Spectrum::ZERO;
        }
        upward(wo, wi).map_or(Spectrum::ZERO, |(wo, wi)| self.walk().eval(wo, wi, mode))
    }

    fn pdf(&self, wo: LocalDir, wi: LocalDir, _: TransportMode) -> Pdf<SolidAngle> {
        upward(wo, wi).map_or(Pdf::ZERO, |(wo, wi)| self.walk_pdf(wo, wi))
    }

    fn sample(&self, wo: LocalDir, u_lobe: f32, u: [f32; 2], mode: TransportMode) -> Option<BsdfSample> {
        sample_upward(wo, |wo| {
            if self.is_mirror() {
                let (weight, lobe) = (self.mirror_reflectance(wo.0.z), Lobe::reflection(Gloss::Specular));
                return Some(BsdfSample::delta(wo.reflect(), weight, 1.0, lobe));
            }
            self.walk().sample(wo, u_lobe, u, mode, |wi| self.walk_pdf(wo, wi))
        })
    }

    fn flags(&self) -> LobeFlags {
        self.walk().flags()
    }

    fn specular_probability(&self, wo: LocalDir) -> f32 {
        match (self.is_mirror(), self.top.is_smooth()) {
            (true, _) => 1.0,
            (false, true) => crate::fresnel::dielectric(wo.abs_cos_theta(), self.top.eta()),
            (false, false) => 0.0,
        }
    }

    fn albedo_estimate(&self, wo: LocalDir) -> Spectrum {
        self.mirror_reflectance(wo.abs_cos_theta())
    }

    fn regularized(&self) -> Self {
        Self { top: self.top.regularized(), base: self.base.regularized(), layer: self.layer }
    }
}
