//! Densities whose measure is part of their type.
//!
//! `mis::power(p_area, p_solid_angle)` does not compile. Delta distributions have no density: where they can
//! occur, the type that holds a `Pdf` says so beside it.

use std::marker::PhantomData;
use std::ops::{Add, Mul};

/// What a density is with respect to.
pub trait Measure: Copy + std::fmt::Debug + 'static {}

macro_rules! measures {
    ($($(#[$doc:meta])* $name:ident),* $(,)?) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $name;
        impl Measure for $name {}
    )*};
}

measures! {
    /// Per steradian.
    SolidAngle,
    /// Per unit of cosine-weighted solid angle.
    ProjectedSolidAngle,
    /// Per unit of area, in scene units squared.
    Area,
    /// Per unit of length: free paths.
    Length,
    /// Per unit of volume.
    Volume,
    /// Per nanometre.
    Wavelength,
    /// Per unit of the unit cube.
    PrimarySpace,
}

/// A probability density with respect to `M`. The same size and cost as an `f32`.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
#[repr(transparent)]
pub struct Pdf<M: Measure>(f32, PhantomData<M>);

impl<M: Measure> Pdf<M> {
    /// Impossible.
    pub const ZERO: Self = Self(0.0, PhantomData);

    /// A density, which is finite and at least zero.
    #[must_use]
    pub fn new(value: f32) -> Self {
        debug_assert!(value >= 0.0 && value.is_finite(), "density {value}");
        Self(value, PhantomData)
    }

    /// The bare number. It stands only where an estimator divides by it.
    #[must_use]
    pub fn value(self) -> f32 {
        self.0
    }

    /// Can it happen at all?
    #[must_use]
    pub fn is_positive(self) -> bool {
        self.0 > 0.0
    }
}

/// A discrete probability times a density.
impl<M: Measure> Mul<f32> for Pdf<M> {
    type Output = Self;
    fn mul(self, probability: f32) -> Self {
        Self::new(self.0 * probability)
    }
}

/// Densities of the parts of a mixture add (each already times its probability).
impl<M: Measure> Add for Pdf<M> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.0 + other.0)
    }
}

/// How a point is seen from another: what turns area into solid angle.
#[derive(Clone, Copy, Debug)]
pub struct Geometry {
    /// Squared distance between the two points.
    pub distance_squared: f32,
    /// |cos| at the point whose area is meant.
    pub abs_cos: f32,
}

impl Pdf<Area> {
    /// `p_ω = p_A r² / |cos θ|`, the inverse of [`Pdf::to_area`]; zero where the surface is seen edge-on.
    #[must_use]
    pub fn to_solid_angle(self, g: Geometry) -> Pdf<SolidAngle> {
        let p = self.0 * g.distance_squared / g.abs_cos;
        Pdf::new(if p.is_finite() { p } else { 0.0 })
    }
}

impl Pdf<SolidAngle> {
    /// `p_A = p_ω |cos θ| / r²`; zero where the points coincide.
    #[must_use]
    pub fn to_area(self, g: Geometry) -> Pdf<Area> {
        let p = self.0 * g.abs_cos / g.distance_squared;
        Pdf::new(if p.is_finite() { p } else { 0.0 })
    }
}
