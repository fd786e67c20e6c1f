//! Distributions of microfacets, with Smith masking.
//!
//! | what                  | source                                              |
//! |-----------------------|-----------------------------------------------------|
//! | `lambda`, `g1`, `g2`  | [Heitz2014], height-correlated or separable         |
//! | visible normals       | [Heitz2018] for the density                         |
//! | `regularize`, `alpha_from_roughness` | pbrt-v4's conventions                |
//!
//! All is written with `s(w) = |z| (1 + 2Λ(w))`, which no distribution has a pole in (for GGX it is the length of the
//! stretched direction): then `1 + Λ = (1 + s/|z|) / 2`, and `G1/|z|`, `G2/(z z')` and `G2/G1` have no tangent and no
//! pole at grazing angles.
//! Left out: slopes' correlation between sides of a transmission (both sides share the height-correlated form).

mod beckmann;
mod ggx;

use math::{LocalDir, trig};
use sampling::{Pdf, SolidAngle};

/// A direction closer to the surface than this counts as in it: the sines and cosines of microfacet formulas would
/// overflow, and its contribution is nil.
pub const MIN_COS: f32 = 1e-8;

/// Guards divisions whose divisor is zero only for a direction in the surface.
const MIN_Z: f32 = 1e-30;

/// The shape of a distribution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Distribution {
    /// GGX (Trowbridge–Reitz).
    #[default]
    Ggx,
    /// Beckmann.
    Beckmann,
}

/// A distribution of normals with its widths along both tangents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facets {
    alpha: [f32; 2],
    distribution: Distribution,
    masking: Masking,
}

/// How masking and shadowing of one facet depend on each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Masking {
    /// By the facets' heights: `1/(1 + Λ(wo) + Λ(wi))`.
    #[default]
    Correlated,
    /// Not at all: `G1(wo) G1(wi)`, as in Mitsuba; a little darker.
    Separable,
}

/// GGX of these widths.
impl From<[f32; 2]> for Facets {
    fn from(alpha: [f32; 2]) -> Self {
        Self::new(alpha, Distribution::Ggx)
    }
}

impl Facets {
    /// Widths along the tangents, at least zero. Unless the surface counts as smooth, each is at least 1e-4.
    #[must_use]
    #[inline]
    pub fn new(alpha: [f32; 2], distribution: Distribution) -> Self {
        let smooth = alpha[0].max(alpha[1]) < Self::SMOOTH_BELOW;
        let floor = if smooth { 0.0 } else { 1e-4 };
        Self { alpha: alpha.map(|a| a.max(floor)), distribution, masking: Masking::Correlated }
    }

    /// GGX.
    #[must_use]
    pub fn ggx(alpha_x: f32, alpha_y: f32) -> Self {
        Self::new([alpha_x, alpha_y], Distribution::Ggx)
    }

    /// Beckmann.
    #[must_use]
    pub fn beckmann(alpha_x: f32, alpha_y: f32) -> Self {
        Self::new([alpha_x, alpha_y], Distribution::Beckmann)
    }

    /// The same with another masking.
    #[must_use]
    pub fn masked(self, masking: Masking) -> Self {
        Self { masking, ..self }
    }

    /// The same distribution and masking with this width both ways.
    #[must_use]
    pub fn of_width(self, alpha: f32) -> Self {
        Self::new([alpha; 2], self.distribution).masked(self.masking)
    }

    /// A mirror.
    pub const SMOOTH: Self =
        Self { alpha: [0.0; 2], distribution: Distribution::Ggx, masking: Masking::Correlated };

    /// Surfaces with both widths below this are treated as mirrors (pbrt-v4).
    pub const SMOOTH_BELOW: f32 = 1e-3;

    /// pbrt-v4's roughness: `alpha = √roughness`.
    #[must_use]
    pub fn alpha_from_roughness(roughness: f32) -> f32 {
        trig::safe_sqrt(roughness)
    }

    /// Both widths.
    #[must_use]
    pub fn alpha(&self) -> [f32; 2] {
        self.alpha
    }

    /// The shape.
    #[must_use]
    pub fn distribution(&self) -> Distribution {
        self.distribution
    }

    /// Is it to be treated as a mirror?
    #[must_use]
    #[inline]
    pub fn is_smooth(&self) -> bool {
        self.alpha[0].max(self.alpha[1]) < Self::SMOOTH_BELOW
    }

    /// The same width both ways?
    #[must_use]
    pub fn is_isotropic(&self) -> bool {
        self.alpha[0] == self.alpha[1]
    }

    /// Widened, for paths whose caustics would be found too seldom: below 0.3 to twice itself within [0.1, 0.3].
    #[must_use]
    pub fn regularized(&self) -> Self {
        let widen = |a: f32| if a < 0.3 { (2.0 * a).clamp(0.1, 0.3) } else { a };
        Self { alpha: self.alpha.map(widen), ..*self }
    }

    /// `D(m)`: area of facets with normal `m` per steradian and per area of surface; `∫ D (m·n) dm = 1`.
    #[must_use]
    #[inline]
    pub fn d(&self, m: LocalDir) -> f32 {
        match self.distribution {
            Distribution::Ggx => ggx::d(self.alpha, m),
            Distribution::Beckmann => beckmann::d(self.alpha, m),
        }
    }

    /// `s(w)` of the head.
    #[must_use]
    #[inline]
    pub(crate) fn stretch(&self, w: LocalDir) -> f32 {
        match self.distribution {
            Distribution::Ggx => ggx::stretch(self.alpha, w),
            Distribution::Beckmann => beckmann::stretch(self.alpha, w),
        }
    }

    /// Smith's `Λ(w) = (s/|z| − 1) / 2`.
    #[must_use]
    pub fn lambda(&self, w: LocalDir) -> f32 {
        0.5 * (self.stretch(w) / w.abs_cos_theta().max(MIN_Z) - 1.0).max(0.0)
    }

    /// Masking `G1 = 1/(1 + Λ)`: the part of the facets facing `w` that it sees.
    #[must_use]
    pub fn g1(&self, w: LocalDir) -> f32 {
        let c = w.abs_cos_theta();
        2.0 * c / (c + self.stretch(w)).max(MIN_Z)
    }

    /// Masking and shadowing `G2`.
    #[must_use]
    pub fn g2(&self, wo: LocalDir, wi: LocalDir) -> f32 {
        let (co, ci) = (wo.abs_cos_theta(), wi.abs_cos_theta());
        2.0 * co * ci * self.visibility([co, self.stretch(wo)], [ci, self.stretch(wi)])
    }

    /// `G2 / (2 |zo zi|)`, of cosines and stretches: `1 / (so ci + si co)` if correlated, `2 / ((co + so)(ci + si))` if
    /// not.
    #[inline]
    pub(crate) fn visibility(&self, [co, so]: [f32; 2], [ci, si]: [f32; 2]) -> f32 {
        match self.masking {
            Masking::Correlated => 1.0 / (so * ci + si * co).max(MIN_Z),
            Masking::Separable => 2.0 / ((co + so) * (ci + si)).max(MIN_Z),
        }
    }

    /// `G2/G1(wo)`, the weight of a sample of visible normals; in [0, 1].
    #[must_use]
    #[inline]
    pub fn shadowing(&self, wo: LocalDir, wi: LocalDir) -> f32 {
        let (so, si) = (self.stretch(wo), self.stretch(wi));
        let (co, ci) = (wo.abs_cos_theta(), wi.abs_cos_theta());
        ci * (co + so) * self.visibility([co, so], [ci, si])
    }

    /// Density of the normals that `wo` sees, `G1(wo) |wo·m| D(m) / |z|`, per steradian of `m`.
    #[must_use]
    #[inline]
    pub fn visible_pdf(&self, wo: LocalDir, m: LocalDir) -> Pdf<SolidAngle> {
        Pdf::new(2.0 * self.d(m) * wo.dot(m).abs() / (wo.abs_cos_theta() + self.stretch(wo)).max(MIN_Z))
    }

    /// A normal seen from `wo` (either side), on the side z > 0.
    #[must_use]
    #[inline]
    pub fn sample_visible(&self, wo: LocalDir, u: [f32; 2]) -> LocalDir {
        match self.distribution {
            Distribution::Ggx => ggx::sample_visible(self.alpha, wo, u),
            Distribution::Beckmann => beckmann::sample_visible(self.alpha, wo, u),
        }
    }
}
