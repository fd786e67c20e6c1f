//! One tile of one pass: where a worker adds samples without a lock.

use std::sync::{Arc, Mutex, PoisonError};

use math::Bounds2i;

use crate::bad::{BadSample, BadSamples, Sign, kind_of};
use crate::blocks::offset_in;
use crate::filter::FilterTable;
use crate::pass::PassSums;

/// What the tiles and the film have in common.
#[derive(Debug)]
pub(crate) struct Common {
    pub(crate) crop: Bounds2i,
    pub(crate) table: FilterTable,
    pub(crate) reach: i32,
    pub(crate) is_pixel_box: bool,
    pub(crate) sign: Sign,
    pub(crate) n_aovs: usize,
    pub(crate) n_splat_aovs: usize,
    pub(crate) has_splats: bool,
    /// Memory for blocks of passes that nobody uses just now.
    pub(crate) spare: Mutex<Vec<PassSums>>,
}

impl Common {
    /// Zeros for a block of `n` pixels.
    pub(crate) fn take_sums(&self, n: usize) -> PassSums {
        let spare = self.spare.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut sums = spare.unwrap_or_default();
        sums.reset(self, n);
        sums
    }

    /// Sums that nobody needs any more.
    pub(crate) fn give_back(&self, sums: PassSums) {
        self.spare.lock().unwrap_or_else(PoisonError::into_inner).push(sums);
    }

    /// Frees the memory of passes that nobody uses.
    pub(crate) fn let_go(&self) {
        self.spare.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }
}

/// The samples of one tile of one pass, spread over the filter's footprint, with a border that belongs to the neighbours.
///
/// Sums are doubles in a fixed order: a pure function of the tile and the pass. They are rounded to fixed point when the tile is
/// added to a [`PassBuffer`](crate::PassBuffer) or a [`Film`](crate::Film). One tile serves a worker for all its tiles.
#[derive(Clone, Debug)]
pub struct FilmTile {
    pub(crate) common: Arc<Common>,
    pub(crate) area: Bounds2i,
    pub(crate) pass: u32,
    /// Σ w (r, g, b, 1) per pixel of the area.
    pub(crate) sums: Vec<[f64; 4]>,
    /// Σ w x per pixel and further channel.
    pub(crate) aovs: Vec<f64>,
    pub(crate) bad: BadSamples,
}

impl FilmTile {
    pub(crate) fn new(common: Arc<Common>) -> Self {
        let area = Bounds2i::new(common.crop.min, common.crop.min);
        Self { common, area, pass: 0, sums: Vec::new(), aovs: Vec::new(), bad: BadSamples::default() }
    }

    /// Empties it for the samples of the pixels in `bounds` (which may reach past the crop) in `pass`.
    pub fn begin(&mut self, bounds: Bounds2i, pass: u32) {
        self.area = bounds.expand(self.common.reach).intersect(&self.common.crop);
        self.pass = pass;
        self.bad.clear();
        self.sums.clear();
        self.sums.resize(self.area.area(), [0.0; 4]);
        self.aovs.clear();
        self.aovs.resize(self.area.area() * self.common.n_aovs, 0.0);
    }

    /// Adds a camera sample at `offset` ∈ [0, 1)² of `pixel`, which is one of the tile's. A bad sample counts as black.
    ///
    /// Pixel and offset are apart because a single `f32` has too few bits for both: in column 4000 a sample at 0.9999 would fall
    /// into the next pixel.
    #[inline]
    pub fn add_sample(&mut self, pixel: [i32; 2], offset: [f32; 2], rgb: [f32; 3]) {
        let rgb = self.checked(pixel, rgb);
        if self.common.is_pixel_box {
            if self.area.contains(pixel) {
                let i = offset_in(&self.area, pixel[0], pixel[1]);
                add_weighted(&mut self.sums[i], rgb, 1.0);
            }
            return;
        }
        let sums = &mut self.sums;
        spread(&self.common, self.area, pixel, offset, |i, w| add_weighted(&mut sums[i], rgb, w));
    }

    /// Adds the further channels of a camera sample; one that is not finite is bad and counts as zero.
    pub fn add_aovs(&mut self, pixel: [i32; 2], offset: [f32; 2], values: &[f32]) {
        let n = self.common.n_aovs;
        debug_assert_eq!(values.len(), n);
        for &x in values.iter().filter(|x| !Sign::Any.accepts([**x; 3])) {
            self.bad.record(BadSample { pass: self.pass, y: pixel[1], x: pixel[0], kind: kind_of([x; 3]) });
        }
        let aovs = &mut self.aovs;
        spread(&self.common, self.area, pixel, offset, |i, w| {
            for (sum, &x) in aovs[i * n..(i + 1) * n].iter_mut().zip(values) {
                *sum += if Sign::Any.accepts([x; 3]) { f64::from(w * x) } else { 0.0 };
            }
        });
    }

    /// What a pixel of the tile's has so far; black without samples.
    #[must_use]
    pub fn mean(&self, pixel: [i32; 2]) -> [f32; 3] {
        if !self.area.contains(pixel) {
            return [0.0; 3];
        }
        let [r, g, b, w] = self.sums[offset_in(&self.area, pixel[0], pixel[1])];
        [r, g, b].map(|c| if w > 0.0 { (c / w) as f32 } else { 0.0 })
    }

    /// Bad samples so far.
    #[must_use]
    pub fn bad_samples(&self) -> &BadSamples {
        &self.bad
    }

    #[inline]
    fn checked(&mut self, pixel: [i32; 2], rgb: [f32; 3]) -> [f32; 3] {
        if self.common.sign.accepts(rgb) {
            return rgb;
        }
        self.bad.record(BadSample { pass: self.pass, y: pixel[1], x: pixel[0], kind: kind_of(rgb) });
        [0.0; 3]
    }
}

#[inline]
fn add_weighted(sum: &mut [f64; 4], rgb: [f32; 3], w: f32) {
    // Products are rounded to f32, so that a handful of them nearly always adds up exactly in f64.
    sum[0] += f64::from(w * rgb[0]);
    sum[1] += f64::from(w * rgb[1]);
    sum[2] += f64::from(w * rgb[2]);
    sum[3] += f64::from(w);
}

/// Calls `add` with the place in `area` and the weight of every pixel of the footprint.
#[inline]
pub(crate) fn spread(
    common: &Common,
    area: Bounds2i,
    pixel: [i32; 2],
    offset: [f32; 2],
    mut add: impl FnMut(usize, f32),
) {
    let (fx, fy) = (common.table.footprint(0, offset[0]), common.table.footprint(1, offset[1]));
    let (x0, y0) = (pixel[0].saturating_add(fx.first), pixel[1].saturating_add(fy.first));
    let columns = clipped(x0, fx.n, area.min[0], area.max[0]);
    for k in clipped(y0, fy.n, area.min[1], area.max[1]) {
        let row = offset_in(&area, area.min[0], y0 + k as i32);
        for j in columns.clone() {
            let column = (x0 + j as i32 - area.min[0]) as usize;
            add(row + column, fx.weights[j] * fy.weights[k]);
        }
    }
}

/// Which of `n` pixels from `first` on lie in `min..max`.
#[inline]
fn clipped(first: i32, n: usize, min: i32, max: i32) -> std::ops::Range<usize> {
    let end = i64::from(max) - i64::from(first);
    let start = (i64::from(min) - i64::from(first)).clamp(0, n as i64) as usize;
    start..(end.clamp(0, n as i64) as usize).max(start)
}
