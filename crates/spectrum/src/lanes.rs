//! Four lanes of light.

use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Sub};

use math::Vec4;

/// Radiance, importance, reflectance or throughput at four samples (see the crate's head). The unused lane of RGB
/// mode stays zero in emission, so it is zero in every product with it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(transparent)]
pub struct Spectrum(pub Vec4);

impl Spectrum {
    /// No light.
    pub const ZERO: Self = Self(Vec4::ZERO);
    /// One in every lane.
    pub const ONE: Self = Self(Vec4::ONE);

    /// The same in every lane.
    #[must_use]
    pub const fn splat(x: f32) -> Self {
        Self(Vec4::splat(x))
    }

    /// Linear R, G, B; the fourth lane is zero.
    #[must_use]
    pub const fn from_rgb(rgb: [f32; 3]) -> Self {
        Self(Vec4::new(rgb[0], rgb[1], rgb[2], 0.0))
    }

    /// From four lanes.
    #[must_use]
    pub const fn from_lanes(lanes: [f32; 4]) -> Self {
        Self(Vec4::from_array(lanes))
    }

    /// All four lanes.
    #[must_use]
    pub fn lanes(self) -> [f32; 4] {
        self.0.to_array()
    }

    /// The first three lanes.
    #[must_use]
    pub fn rgb(self) -> [f32; 3] {
        [self.0.x, self.0.y, self.0.z]
    }

    /// Zero in every lane?
    #[must_use]
    pub fn is_black(self) -> bool {
        self.0 == Vec4::ZERO
    }

    /// The largest lane.
    #[must_use]
    pub fn max_component(self) -> f32 {
        self.0.max_element()
    }

    /// Mean of the four lanes (in RGB mode this is ¾ of the mean of R, G and B: use it for ratios only).
    #[must_use]
    pub fn average(self) -> f32 {
        self.0.element_sum() * 0.25
    }

    /// No NaN and no infinity?
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.0.is_finite()
    }

    /// Each lane through `f`.
    #[must_use]
    pub fn map(self, f: impl Fn(f32) -> f32) -> Self {
        let [a, b, c, d] = self.lanes();
        Self::from_lanes([f(a), f(b), f(c), f(d)])
    }

    /// Each pair of lanes through `f`.
    #[must_use]
    pub fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let (a, b) = (self.lanes(), other.lanes());
        Self::from_lanes([f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2]), f(a[3], b[3])])
    }

    /// `exp(x)` of each lane.
    #[must_use]
    pub fn exp(self) -> Self {
        self.map(math::trig::exp)
    }

    /// Square root of each lane, zero below zero.
    #[must_use]
    pub fn safe_sqrt(self) -> Self {
        self.map(math::trig::safe_sqrt)
    }

    /// Each lane limited to [lo, hi].
    #[must_use]
    pub fn clamp(self, lo: f32, hi: f32) -> Self {
        Self(self.0.clamp(Vec4::splat(lo), Vec4::splat(hi)))
    }

    /// `self (1 − t) + other t`.
    #[must_use]
    pub fn lerp(self, other: Self, t: f32) -> Self {
        Self(self.0 * (1.0 - t) + other.0 * t)
    }

    /// Division that gives zero where the divisor is zero.
    #[must_use]
    pub fn safe_div(self, other: Self) -> Self {
        self.zip(other, |a, b| if b == 0.0 { 0.0 } else { a / b })
    }
}

impl Add for Spectrum {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self(self.0 + o.0)
    }
}

impl AddAssign for Spectrum {
    fn add_assign(&mut self, o: Self) {
        self.0 += o.0;
    }
}

impl Sub for Spectrum {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self(self.0 - o.0)
    }
}

impl Mul for Spectrum {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self(self.0 * o.0)
    }
}

impl MulAssign for Spectrum {
    fn mul_assign(&mut self, o: Self) {
        self.0 *= o.0;
    }
}

impl Mul<f32> for Spectrum {
    type Output = Self;
    fn mul(self, s: f32) -> Self {
        Self(self.0 * s)
    }
}

impl MulAssign<f32> for Spectrum {
    fn mul_assign(&mut self, s: f32) {
        self.0 *= s;
    }
}

impl Mul<Spectrum> for f32 {
    type Output = Spectrum;
    fn mul(self, s: Spectrum) -> Spectrum {
        Spectrum(s.0 * self)
    }
}

impl Div<f32> for Spectrum {
    type Output = Self;
    fn div(self, s: f32) -> Self {
        Self(self.0 / s)
    }
}

impl std::iter::Sum for Spectrum {
    fn sum<I: Iterator<Item = Self>>(iter: I) -> Self {
        iter.fold(Self::ZERO, |a, b| a + b)
    }
}
