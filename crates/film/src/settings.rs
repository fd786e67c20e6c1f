//! What a film is a film of: two films with equal settings are parts of one render.

use std::ops::Range;

use math::Bounds2i;
use serde::{Deserialize, Serialize};

use crate::bad::Sign;
use crate::error::Error;
use crate::filter::Filter;

/// Everything that decides which numbers a pass adds.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmSettings {
    /// Columns and rows of the whole image.
    pub resolution: [u32; 2],
    /// The pixels that are kept.
    pub crop: Bounds2i,
    /// How samples count in the pixels around them.
    pub filter: Filter,
    /// Which contributions are good.
    pub sign: Sign,
    /// Will there be splats? (Costs memory unless the filter is the box of one pixel.)
    pub splats: bool,
    /// Names of further channels that are averaged over camera samples beside R, G, B, such as `albedo.R` or `depth.Z`.
    pub aovs: Vec<String>,
    /// Names of further channels that splats are summed in, such as `s3t1.weighted.R`.
    pub splat_aovs: Vec<String>,
    /// First passes of all iterations but the first, ascending. Each iteration has sums of its own, and [`Film::develop`] weighs
    /// their pictures by the inverse of their variance, which is **biased**. Empty: one iteration, all passes alike.
    ///
    /// [`Film::develop`]: crate::Film::develop
    pub iterations: Vec<u32>,
    /// What was rendered, and how.
    pub key: RenderKey,
}

/// What was rendered and how, for the comparison of partial films.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RenderKey {
    /// Hash of the scene.
    pub scene: String,
    /// The integrator's name.
    pub integrator: String,
    /// Its parameters, the sampler and whatever else changes the numbers, in one canonical line.
    pub settings: String,
    /// The seed.
    pub seed: u64,
}

impl FilmSettings {
    /// A whole image with a filter, for contributions that are at least zero, without splats or further channels.
    #[must_use]
    pub fn new(resolution: [u32; 2], filter: Filter) -> Self {
        let max = resolution.map(|n| i32::try_from(n).unwrap_or(i32::MAX));
        Self {
            resolution,
            crop: Bounds2i::new([0, 0], max),
            filter,
            sign: Sign::NonNegative,
            splats: false,
            aovs: Vec::new(),
            splat_aovs: Vec::new(),
            iterations: Vec::new(),
            key: RenderKey::default(),
        }
    }

    /// The pixels that camera samples are needed in: the crop and a border, as wide as the filter reaches.
    #[must_use]
    pub fn sample_bounds(&self) -> Bounds2i {
        self.crop.expand(self.filter.reach())
    }

    /// The iteration that a pass belongs to.
    pub(crate) fn iteration_of(&self, pass: u32) -> usize {
        self.iterations.partition_point(|&first| first <= pass)
    }

    /// The passes of each iteration.
    pub(crate) fn iteration_ranges(&self) -> impl Iterator<Item = Range<u32>> {
        let starts = [0].into_iter().chain(self.iterations.iter().copied());
        let ends = self.iterations.iter().copied().chain([u32::MAX]);
        starts.zip(ends).map(|(start, end)| start..end)
    }

    /// Refuses what cannot be a film.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let bad = |sentence: String| Err(Error::Settings(sentence));
        let [w, h] = self.resolution;
        if w == 0 || h == 0 || w > MAX_SIDE || h > MAX_SIDE {
            return bad(format!("resolution {w} x {h} is outside 1..{MAX_SIDE} pixels a side"));
        }
        let Bounds2i { min, max } = self.crop;
        let inside = |a: usize, n: u32| 0 <= min[a] && min[a] < max[a] && max[a] as u32 <= n;
        if !inside(0, w) || !inside(1, h) {
            return bad(format!(
                "crop {},{} to {},{} is empty or outside the image of {w} x {h}",
                min[0], min[1], max[0], max[1]
            ));
        }
        if self.crop.area() > MAX_PIXELS {
            return Err(Error::TooLarge { width: self.crop.width(), height: self.crop.height() });
        }
        let n_aovs = self.aovs.len() + self.splat_aovs.len();
        if n_aovs > MAX_AOVS {
            return bad(format!("{n_aovs} further channels are more than {MAX_AOVS}"));
        }
        let starts = [0].into_iter().chain(self.iterations.iter().copied());
        if self.iterations.len() >= MAX_ITERATIONS || !starts.is_sorted_by(|a, b| a < b) {
            return bad(format!(
                "iterations from {:?} on are not at most {MAX_ITERATIONS}, one after the other",
                self.iterations
            ));
        }
        self.filter.check().map_err(Error::Settings)
    }

    /// What is different, in words; `None` if the films belong to one render.
    pub(crate) fn difference(&self, other: &Self) -> Option<String> {
        let differ = |what: &str, a: String, b: String| (a != b).then(|| format!("{what} {a} and {b}"));
        let size = |s: &Self| format!("{} x {}", s.resolution[0], s.resolution[1]);
        let crop = |s: &Self| {
            let Bounds2i { min, max } = s.crop;
            format!("{},{},{},{}", min[0], max[0], min[1], max[1])
        };
        let (a, b) = (&self.key, &other.key);
        differ("scenes", a.scene.clone(), b.scene.clone())
            .or_else(|| differ("integrators", a.integrator.clone(), b.integrator.clone()))
            .or_else(|| differ("settings", format!("`{}`", a.settings), format!("`{}`", b.settings)))
            .or_else(|| differ("seeds", a.seed.to_string(), b.seed.to_string()))
            .or_else(|| differ("resolutions", size(self), size(other)))
            .or_else(|| differ("crops (x0,x1,y0,y1)", crop(self), crop(other)))
            .or_else(|| differ("filters", format!("{:?}", self.filter), format!("{:?}", other.filter)))
            .or_else(|| differ("signs", format!("{:?}", self.sign), format!("{:?}", other.sign)))
            .or_else(|| differ("splats", self.splats.to_string(), other.splats.to_string()))
            .or_else(|| differ("further channels", self.aovs.join(" "), other.aovs.join(" ")))
            .or_else(|| {
                differ("further channels of splats", self.splat_aovs.join(" "), other.splat_aovs.join(" "))
            })
            .or_else(|| {
                differ("iterations", format!("{:?}", self.iterations), format!("{:?}", other.iterations))
            })
    }
}

/// The longest side of an image.
pub const MAX_SIDE: u32 = 1 << 20;

/// The largest crop, in pixels: its sums take some 26 GB.
pub const MAX_PIXELS: usize = 1 << 28;

/// The largest number of further channels.
pub const MAX_AOVS: usize = 256;

/// The largest number of iterations that a film keeps apart.
pub const MAX_ITERATIONS: usize = 32;
