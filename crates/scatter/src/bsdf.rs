//! Surfaces: what part of the light from `wi` leaves along `wo`, and how to choose `wi`.
//!
//! | kind                  | what it is                                             | delta      |
//! |-----------------------|--------------------------------------------------------|------------|
//! | `Diffuse`             | Lambert's law                                          | never      |
//! | `DiffuseTransmission` | Lambert's law on both sides                            | never      |
//! | `Conductor`           | metal, smooth or rough                                 | if smooth  |
//! | `Dielectric`          | glass, smooth or rough                                 | if smooth  |
//! | `ThinDielectric`      | a pane: two parallel smooth interfaces                 | always     |
//! | `SoftBorder`          | the border of what light wanders in                    | gloss, if smooth |
//! | `CoatedDiffuse`       | a dielectric layer over Lambert's law                  | if smooth  |
//! | `CoatedConductor`     | a dielectric layer over metal                          | if both smooth |
//! | `OrenNayar`           | rough and matt                                         | never      |
//! | `Plastic`             | a dielectric boundary over Lambert's law               | if smooth  |
//! | `TintedDielectric`    | glass or a pane with factors                           | if smooth  |
//! | `Principled`          | Disney's principled surface                            | never      |
//! | `PrincipledThin`      | the same as a sheet                                    | never      |
//! | `MetallicRoughness`   | glTF's surface with its layers                         | never      |
//! | `Hair`                | a fibre; not reciprocal                                | never      |
//! | `CompensatedConductor` | metal without loss between facets                     | if smooth  |
//! | `Measured`            | a table of measurements; not reciprocal                | never      |
//!
//! A mixture of materials is resolved at the hit (`scene`), by a hash of the point. To add a kind: its file here,
//! a line in the closed set below and in the table above, a line in `tests/laws.rs`.

mod cloth;
mod coated;
mod coated_conductor;
mod coated_diffuse;
mod compensated_conductor;
mod conductor;
mod dielectric;
mod diffuse;
mod diffuse_transmission;
mod hair;
mod lobe;
mod measured;
mod metallic_roughness;
mod mixture;
mod oren_nayar;
mod plastic;
mod principled;
mod principled_thin;
mod soft_border;
mod thin_dielectric;
mod tinted;

use std::ops::Not;

use math::LocalDir;
use sampling::{Pdf, SolidAngle};
use spectrum::Spectrum;

pub use coated::{Coat, CoatProfile, CoatProfiles};
pub use coated_conductor::CoatedConductor;
pub use coated_diffuse::CoatedDiffuse;
pub use compensated_conductor::CompensatedConductor;
pub use conductor::Conductor;
pub use dielectric::Dielectric;
pub use diffuse::Diffuse;
pub use diffuse_transmission::DiffuseTransmission;
pub use hair::Hair;
pub use lobe::{Gloss, Lobe, LobeFlags, SampleLobes, Side};
pub use measured::{Measured, MeasuredError, MeasuredParts, MeasuredTable, Raster};
pub use metallic_roughness::{MetallicRoughness, MetallicRoughnessParameters};
pub use oren_nayar::OrenNayar;
pub use plastic::Plastic;
pub use principled::{Principled, PrincipledParameters};
pub use principled_thin::{PrincipledThin, ThinParameters};
pub use soft_border::SoftBorder;
pub use thin_dielectric::ThinDielectric;
pub use tinted::TintedDielectric;

use crate::closed_set::closed_set;

/// What a path carries from `wi` to `wo`. Radiance is divided by η² where it enters a denser medium; importance is
/// not [Veach1997, ch. 5].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TransportMode {
    /// Paths from the eye: light flows from `wi` to `wo`.
    #[default]
    Radiance,
    /// Paths from a light: importance flows from `wi` to `wo`.
    Importance,
}

impl TransportMode {
    /// What radiance is multiplied by on its way from the far side (index `eta` times that of the near side).
    #[must_use]
    #[inline]
    pub(crate) fn transmission_scale(self, eta: f32) -> f32 {
        match self {
            Self::Radiance => 1.0 / (eta * eta),
            Self::Importance => 1.0,
        }
    }
}

impl Not for TransportMode {
    type Output = Self;
    fn not(self) -> Self {
        match self {
            Self::Radiance => Self::Importance,
            Self::Importance => Self::Radiance,
        }
    }
}

/// How likely a sample was. A delta has no density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Density {
    /// Per steradian, over all lobes that could have made this direction.
    Smooth(Pdf<SolidAngle>),
    /// One of finitely many directions.
    Delta {
        /// Chance of this one.
        probability: f32,
    },
}

/// A direction drawn from a BSDF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// The direction, away from the surface.
    pub wi: LocalDir,
    /// What a throughput is multiplied by: `f |cos θi| / pdf`, and for a delta its reflectance or transmittance
    /// (with 1/η² for radiance) over its probability. Computed without the poles of `f` and `pdf`.
    pub weight: Spectrum,
    /// How likely the direction was.
    pub density: Density,
    /// What it was drawn from.
    pub lobe: Lobe,
    /// One for reflection; index of the far side over the near side for transmission. Russian roulette undoes its
    /// square.
    pub eta: f32,
    /// The direction comes from a random walk between layers: `weight` is right in the mean, and `density`, which is
    /// [`Bsdf::pdf`], is what multiple importance sampling needs, but it is not quite what the direction was drawn
    /// from. Integrators that only use both need not look.
    pub pdf_is_proportional: bool,
}

impl BsdfSample {
    pub(crate) fn smooth(wi: LocalDir, weight: Spectrum, pdf: Pdf<SolidAngle>, lobe: Lobe) -> Self {
        let density = Density::Smooth(pdf);
        Self { wi, weight, density, lobe, eta: 1.0, pdf_is_proportional: false }
    }

    pub(crate) fn delta(wi: LocalDir, weight: Spectrum, probability: f32, lobe: Lobe) -> Self {
        let density = Density::Delta { probability };
        Self { wi, weight, density, lobe, eta: 1.0, pdf_is_proportional: false }
    }

    /// A delta?
    #[must_use]
    pub fn is_specular(&self) -> bool {
        matches!(self.density, Density::Delta { .. })
    }

    /// The density per steradian; `None` for a delta.
    #[must_use]
    pub fn pdf(&self) -> Option<Pdf<SolidAngle>> {
        match self.density {
            Density::Smooth(pdf) => Some(pdf),
            Density::Delta { .. } => None,
        }
    }

    /// `f(wo, wi)` in 1/sr, without the cosine; `None` for a delta and for a walk between layers.
    #[must_use]
    pub fn f(&self) -> Option<Spectrum> {
        let pdf = self.pdf().filter(|_| !self.pdf_is_proportional)?;
        Some(self.weight * (pdf.value() / self.wi.abs_cos_theta().max(f32::MIN_POSITIVE)))
    }
}

/// What every kind of surface does. Both directions point away from the surface.
///
/// Laws, checked for every kind by `testkit::bsdf_laws!`: `pdf` integrates to the chance of a valid sample, at most
/// one; `sample` draws from `pdf`, and its weight is `f |cos| / pdf`; `eval` is reciprocal (with η² between sides)
/// and, under uniform light, gives back no more than it receives; nothing is NaN or infinite for any input.
pub trait BsdfKind: Clone + Into<Bsdf> {
    /// `f(wo, wi)` in 1/sr, **without** the cosine; zero where only a delta would do.
    fn eval(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Spectrum;

    /// Density per steradian with which [`BsdfKind::sample`] makes `wi`, deltas left out. (Walks between layers: an
    /// approximation that is positive wherever `eval` is.)
    fn pdf(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Pdf<SolidAngle>;

    /// Both at once: the inner loop of next-event estimation with multiple importance sampling.
    #[inline]
    fn eval_pdf(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> (Spectrum, Pdf<SolidAngle>) {
        (self.eval(wo, wi, mode), self.pdf(wo, wi, mode))
    }

    /// A direction for `wo`: `u_lobe` chooses what to sample, `u` where. `None` if the sample carries nothing.
    fn sample(&self, wo: LocalDir, u_lobe: f32, u: [f32; 2], mode: TransportMode) -> Option<BsdfSample>;

    /// The lobes that it has.
    fn flags(&self) -> LobeFlags;

    /// Does [`BsdfKind::sample`] look at `u_lobe`?
    #[inline]
    fn has_choice(&self) -> bool {
        true
    }

    /// Is it surely the same however its frame turns about the normal?
    fn is_isotropic(&self) -> bool {
        false
    }

    /// Chance that [`BsdfKind::sample`] draws a delta at `wo`, given that it draws anything.
    fn specular_probability(&self, _wo: LocalDir) -> f32 {
        if self.flags().is_within(LobeFlags::SPECULAR) { 1.0 } else { 0.0 }
    }

    /// About `∫ f |cos θi| dωi`: for guides and auxiliary images, not for light transport.
    fn albedo_estimate(&self, wo: LocalDir) -> Spectrum;

    /// Is `f` the same with its directions exchanged (up to η²)? Fitted models may not be: importance then flows by `f`
    /// with its directions exchanged, so that light paths and eye paths still agree.
    fn is_reciprocal(&self) -> bool {
        true
    }

    /// The same surface with its narrow lobes widened.
    #[must_use]
    fn regularized(&self) -> Self {
        self.clone()
    }
}

closed_set! {
    ($)
    /// A surface at a hit: one of the kinds of the module's head, by value (a table is shared).
    #[derive(Clone, Debug)]
    pub enum Bsdf dispatch dispatch {
        /// Lambert's law.
        Diffuse,
        /// Lambert's law on both sides.
        DiffuseTransmission,
        /// Metal.
        Conductor,
        /// Glass.
        Dielectric,
        /// A pane.
        ThinDielectric,
        /// The border of what light wanders in.
        SoftBorder,
        /// A dielectric layer over Lambert's law.
        CoatedDiffuse,
        /// A dielectric layer over metal.
        CoatedConductor,
        /// Rough and matt.
        OrenNayar,
        /// Plastic.
        Plastic,
        /// Glass or a pane with factors.
        TintedDielectric,
        /// Disney's.
        Principled,
        /// Disney's, of a sheet.
        PrincipledThin,
        /// glTF's.
        MetallicRoughness,
        /// Hair.
        Hair,
        /// Metal without loss between facets.
        CompensatedConductor,
        /// A table of measurements.
        Measured,
    }
}

impl Bsdf {
    /// The border of what light wanders in, if it is one.
    #[must_use]
    pub fn as_soft_border(&self) -> Option<&SoftBorder> {
        if let Self::SoftBorder(border) = self { Some(border) } else { None }
    }

    /// See [`BsdfKind::eval`].
    #[must_use]
    #[inline]
    pub fn eval(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Spectrum {
        dispatch!(self, b => b.eval(wo, wi, mode))
    }

    /// See [`BsdfKind::pdf`].
    #[must_use]
    #[inline]
    pub fn pdf(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Pdf<SolidAngle> {
        dispatch!(self, b => b.pdf(wo, wi, mode))
    }

    /// See [`BsdfKind::eval_pdf`].
    #[must_use]
    #[inline]
    pub fn eval_pdf(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> (Spectrum, Pdf<SolidAngle>) {
        dispatch!(self, b => b.eval_pdf(wo, wi, mode))
    }

    /// See [`BsdfKind::sample`].
    #[must_use]
    #[inline]
    pub fn sample(&self, wo: LocalDir, u_lobe: f32, u: [f32; 2], mode: TransportMode) -> Option<BsdfSample> {
        dispatch!(self, b => b.sample(wo, u_lobe, u, mode))
    }

    /// See [`BsdfKind::has_choice`].
    #[must_use]
    #[inline]
    pub fn has_choice(&self) -> bool {
        dispatch!(self, b => b.has_choice())
    }

    /// See [`BsdfKind::is_isotropic`].
    #[must_use]
    pub fn is_isotropic(&self) -> bool {
        dispatch!(self, b => b.is_isotropic())
    }

    /// The delta of one side, of a surface of deltas alone; `None` if it has none there. Weight times probability is its
    /// reflectance or transmittance (with 1/η² for radiance).
    #[must_use]
    pub fn specular(&self, wo: LocalDir, side: Side, mode: TransportMode) -> Option<BsdfSample> {
        // Every kind chooses reflection by the first numbers and transmission by the last.
        let u_lobe = match side {
            Side::Reflection => 0.0,
            Side::Transmission => 1.0_f32.next_down(),
        };
        self.sample(wo, u_lobe, [0.5; 2], mode).filter(|s| s.is_specular() && s.lobe.side == side)
    }

    /// See [`BsdfKind::flags`].
    #[must_use]
    #[inline]
    pub fn flags(&self) -> LobeFlags {
        dispatch!(self, b => b.flags())
    }

    /// See [`BsdfKind::specular_probability`].
    #[must_use]
    pub fn specular_probability(&self, wo: LocalDir) -> f32 {
        dispatch!(self, b => b.specular_probability(wo))
    }

    /// See [`BsdfKind::albedo_estimate`].
    #[must_use]
    pub fn albedo_estimate(&self, wo: LocalDir) -> Spectrum {
        dispatch!(self, b => b.albedo_estimate(wo))
    }

    /// See [`BsdfKind::is_reciprocal`].
    #[must_use]
    pub fn is_reciprocal(&self) -> bool {
        dispatch!(self, b => b.is_reciprocal())
    }

    /// See [`BsdfKind::regularized`].
    #[must_use]
    pub fn regularized(&self) -> Self {
        dispatch!(self, b => b.regularized().into())
    }

    /// Nothing but deltas (or nothing at all): next-event estimation finds no light here.
    #[must_use]
    #[inline]
    pub fn is_delta_only(&self) -> bool {
        self.flags().is_within(LobeFlags::SPECULAR)
    }

    /// Any delta?
    #[must_use]
    #[inline]
    pub fn has_delta(&self) -> bool {
        self.flags().intersects(LobeFlags::SPECULAR)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bsdf_fits_in_160_bytes() {
        assert!(size_of::<Bsdf>() <= 160, "{}", size_of::<Bsdf>());
        assert!(size_of::<BsdfSample>() <= 64, "{}", size_of::<BsdfSample>());
    }

    #[test]
    fn the_deltas_of_both_sides_are_those_that_are_drawn() {
        let (white, half) = (Spectrum::ONE, Spectrum::splat(0.5));
        let metal = Conductor::new(white, white * 2.0, crate::microfacet::Facets::SMOOTH);
        let glass = Dielectric::new(1.5, [0.0; 2]);
        let kinds: [Bsdf; 7] = [
            metal.into(),
            glass.into(),
            Dielectric::new(1.0, [0.0; 2]).into(),
            ThinDielectric::new(1.5).into(),
            CompensatedConductor::new(metal).into(),
            TintedDielectric::glass(glass, half, white).into(),
            TintedDielectric::pane(ThinDielectric::new(1.5), white, half).into(),
        ];
        let mode = TransportMode::Radiance;
        for bsdf in kinds {
            assert!(bsdf.is_delta_only());
            for z in [0.8, -0.8] {
                let wo = LocalDir::new(0.36, -0.48, z);
                for (side, flag) in [
                    (Side::Reflection, LobeFlags::SPECULAR_REFLECTION),
                    (Side::Transmission, LobeFlags::SPECULAR_TRANSMISSION),
                ] {
                    let found = bsdf.specular(wo, side, mode);
                    assert_eq!(found.is_some(), bsdf.flags().intersects(flag), "{} {side:?}", bsdf.name());
                    // Whatever is drawn of this side is the same.
                    for i in 0..64 {
                        let drawn = bsdf.sample(wo, i as f32 / 64.0, [0.3, 0.7], mode);
                        if let Some(s) = drawn.filter(|s| s.lobe.side == side) {
                            assert_eq!(Some(s), found, "{}", bsdf.name());
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn what_is_isotropic_does_not_change_when_its_frame_turns() {
        let white = Spectrum::ONE;
        let metal = |alpha| Conductor::new(white, white * 2.0, crate::microfacet::Facets::ggx(alpha, 0.3));
        let kinds: [(Bsdf, bool); 7] = [
            (Diffuse::new(white).into(), true),
            (DiffuseTransmission::new(white * 0.5, white * 0.5).into(), true),
            (OrenNayar::new(white, 0.5).into(), true),
            (ThinDielectric::new(1.5).into(), true),
            (Dielectric::new(1.5, [0.3; 2]).into(), true),
            (metal(0.3).into(), true),
            (metal(0.1).into(), false),
        ];
        let turned = |w: LocalDir| LocalDir::new(0.6 * w.0.x - 0.8 * w.0.y, 0.8 * w.0.x + 0.6 * w.0.y, w.0.z);
        let wo = LocalDir::normalize(math::Vec3::new(0.3, -0.5, 0.6));
        for (bsdf, is_isotropic) in kinds {
            assert_eq!(bsdf.is_isotropic(), is_isotropic, "{}", bsdf.name());
            for z in [0.7, -0.4] {
                let wi = LocalDir::normalize(math::Vec3::new(-0.2, 0.4, z));
                let mode = TransportMode::Radiance;
                let [a, b] = [bsdf.eval(wo, wi, mode), bsdf.eval(turned(wo), turned(wi), mode)];
                let differ = (a.lanes()[0] - b.lanes()[0]).abs() > 1e-4 * a.lanes()[0];
                assert!(!(is_isotropic && differ), "{} {a:?} {b:?}", bsdf.name());
            }
        }
    }

    #[test]
    fn what_has_no_choice_does_not_look_at_its_number() {
        let white = Spectrum::ONE;
        let metal = Conductor::new(white, white * 2.0, crate::microfacet::Facets::ggx(0.2, 0.3));
        let kinds: [Bsdf; 3] = [Diffuse::new(white).into(), OrenNayar::new(white, 0.5).into(), metal.into()];
        let wo = LocalDir::normalize(math::Vec3::new(0.3, -0.5, 0.6));
        for bsdf in kinds {
            assert!(!bsdf.has_choice());
            let [a, b] = [0.1, 0.9].map(|u| bsdf.sample(wo, u, [0.3, 0.6], TransportMode::Radiance));
            assert!(a.is_some() && a == b, "{}", bsdf.name());
        }
        assert!(Bsdf::from(Dielectric::new(1.5, [0.0; 2])).has_choice());
    }

    #[test]
    fn flags_say_what_is_there() {
        let glass = Bsdf::from(Dielectric::new(1.5, [0.0; 2]));
        assert!(
            glass.is_delta_only() && glass.has_delta() && glass.flags().intersects(LobeFlags::TRANSMISSION)
        );
        let frosted = Bsdf::from(Dielectric::new(1.5, [0.3; 2]));
        assert!(!frosted.is_delta_only() && !frosted.has_delta());
        assert!(!Bsdf::from(Diffuse::new(Spectrum::ONE)).has_delta());
        assert!(!glass.regularized().has_delta());
        assert_eq!(glass.name(), "Dielectric");
        assert_eq!(Bsdf::NAMES.len(), 17);
    }
}
