//! Bad samples: contributions that cannot be added, dropped but never in silence.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

/// What was wrong with a contribution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BadKind {
    /// Not a number.
    Nan,
    /// Infinite, or above the film's limit of 2³⁶.
    TooLarge,
    /// Below zero.
    Negative,
}

/// Where a bad contribution was made: enough to walk that path again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct BadSample {
    /// Of which pass.
    pub pass: u32,
    /// Row and column (of the path for camera samples, of the splat for splats).
    pub y: i32,
    /// Column.
    pub x: i32,
    /// What was wrong.
    pub kind: BadKind,
}

/// How many there were, and the first few in order of (pass, y, x), whichever order they came in.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BadSamples {
    count: u64,
    first: BTreeSet<BadSample>,
}

impl BadSamples {
    /// How many are remembered with their place.
    pub const REMEMBERED: usize = 16;

    /// How many were dropped.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The first of them.
    pub fn first(&self) -> impl Iterator<Item = &BadSample> {
        self.first.iter()
    }

    /// Counts one.
    #[cold]
    pub fn record(&mut self, sample: BadSample) {
        self.count += 1;
        self.remember(sample);
    }

    /// Adds those of another film, tile or list.
    pub fn merge(&mut self, other: &Self) {
        self.count += other.count;
        other.first.iter().for_each(|&s| self.remember(s));
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.count = 0;
        self.first.clear();
    }

    fn remember(&mut self, sample: BadSample) {
        self.first.insert(sample);
        if self.first.len() > Self::REMEMBERED {
            self.first.pop_last();
        }
    }
}

/// Contributions above this are bad samples, so that squares of pixels and long sums fit: 2³⁶ ≈ 6.9e10.
pub const CONTRIBUTION_LIMIT: f32 = 68_719_476_736.0;

/// Which contributions a film takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sign {
    /// Zero and above: radiance in R, G, B.
    #[default]
    NonNegative,
    /// Any: the R, G, B of a few wavelengths may lie outside the gamut, and only the mean is a colour. Whoever
    /// converts checks the radiance itself.
    Any,
}

impl Sign {
    /// Is the contribution good?
    #[inline]
    pub(crate) fn accepts(self, rgb: [f32; 3]) -> bool {
        let good = |x: f32| match self {
            Self::NonNegative => (0.0..=CONTRIBUTION_LIMIT).contains(&x),
            Self::Any => x.abs() <= CONTRIBUTION_LIMIT,
        };
        good(rgb[0]) && good(rgb[1]) && good(rgb[2])
    }
}

/// What is wrong with a contribution that [`Sign::accepts`] refused.
#[cold]
pub(crate) fn kind_of(rgb: [f32; 3]) -> BadKind {
    if rgb.iter().any(|x| x.is_nan()) {
        BadKind::Nan
    } else if rgb.iter().any(|x| x.abs() > CONTRIBUTION_LIMIT) {
        BadKind::TooLarge
    } else {
        BadKind::Negative
    }
}
