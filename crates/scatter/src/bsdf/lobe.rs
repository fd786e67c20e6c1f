//! Lobes: what a surface has, what a sample was drawn from, what may be drawn.

use std::ops::BitOr;

/// Which side light comes out of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The side that it came from.
    Reflection,
    /// The other.
    Transmission,
}

/// How wide a lobe is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gloss {
    /// Over the whole hemisphere.
    Diffuse,
    /// About one direction.
    Glossy,
    /// In one direction alone: a delta.
    Specular,
}

/// What a sample was drawn from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lobe {
    /// Reflection or transmission.
    pub side: Side,
    /// Diffuse, glossy or specular.
    pub gloss: Gloss,
}

impl Lobe {
    pub(crate) const fn reflection(gloss: Gloss) -> Self {
        Self { side: Side::Reflection, gloss }
    }

    pub(crate) const fn transmission(gloss: Gloss) -> Self {
        Self { side: Side::Transmission, gloss }
    }

    /// A delta?
    #[must_use]
    pub fn is_specular(self) -> bool {
        self.gloss == Gloss::Specular
    }

    /// Through the surface?
    #[must_use]
    pub fn is_transmission(self) -> bool {
        self.side == Side::Transmission
    }
}

/// The lobes that a BSDF has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LobeFlags(u8);

impl LobeFlags {
    /// None: the surface is black.
    pub const NONE: Self = Self(0);
    /// Lambertian reflection.
    pub const DIFFUSE_REFLECTION: Self = Self(1);
    /// Lambertian transmission.
    pub const DIFFUSE_TRANSMISSION: Self = Self(2);
    /// Rough reflection.
    pub const GLOSSY_REFLECTION: Self = Self(4);
    /// Rough transmission.
    pub const GLOSSY_TRANSMISSION: Self = Self(8);
    /// Mirror reflection.
    pub const SPECULAR_REFLECTION: Self = Self(16);
    /// Refraction, or straight passage.
    pub const SPECULAR_TRANSMISSION: Self = Self(32);

    /// Every lobe that follows Lambert's law.
    pub const DIFFUSE: Self = Self(1 | 2);
    /// Every lobe that is a delta.
    pub const SPECULAR: Self = Self(16 | 32);
    /// Every lobe through the surface.
    pub const TRANSMISSION: Self = Self(2 | 8 | 32);

    /// Any lobe in common?
    #[must_use]
    pub const fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// No lobe but those of `other`?
    #[must_use]
    pub const fn is_within(self, other: Self) -> bool {
        self.0 & !other.0 == 0
    }

    /// No lobe at all?
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }
}

impl BitOr for LobeFlags {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

/// Which sides a sample may come out of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SampleLobes {
    /// Both.
    #[default]
    All,
    /// Only the side of `wo`.
    Reflection,
    /// Only the other.
    Transmission,
}

impl SampleLobes {
    /// The probability of reflection, where it would be `reflectance` if both sides were allowed.
    #[must_use]
    #[inline]
    pub(crate) fn reflection_probability(self, reflectance: f32) -> f32 {
        match self {
            Self::All => reflectance,
            Self::Reflection => 1.0,
            Self::Transmission => 0.0,
        }
    }
}
