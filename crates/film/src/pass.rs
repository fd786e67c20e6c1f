//! One pass of the image: everything that it gives to a pixel is summed here before it is squared.

use std::sync::{Arc, Mutex, PoisonError};

use math::Bounds2i;

use crate::bad::{BadSample, BadSamples, kind_of};
use crate::blocks::{Block, Blocks, block_of, offset_in};
use crate::column::Column;
use crate::error::Error;
use crate::fixed::{Fixed, weight};
use crate::tile::{Common, FilmTile, spread};

/// Exact sums of one pass over the whole crop. Threads add tiles and splats in any order; the bits are the same.
pub struct PassBuffer {
    pub(crate) common: Arc<Common>,
    pub(crate) blocks: Blocks<PassBlock>,
    pub(crate) pass: u32,
    pub(crate) bad: Mutex<BadSamples>,
}

/// One block.
pub(crate) struct PassBlock {
    pub(crate) area: Bounds2i,
    /// None as long as they are all zero.
    sums: Option<PassSums>,
}

/// The sums of one block, those of a pixel next to each other. What the settings do not need is empty.
#[derive(Clone, Debug, Default)]
pub(crate) struct PassSums {
    /// Σ w v + splats.
    pub(crate) total: Column<64>,
    /// Σ w.
    pub(crate) weight: Vec<i64>,
    /// Splats alone.
    pub(crate) splat: Column<64>,
    /// Σ w x of the further channels.
    pub(crate) aovs: Column<64>,
    /// Σ x of the splats' further channels.
    pub(crate) splat_aovs: Column<64>,
}

impl Block for PassBlock {
    fn area(&self) -> Bounds2i {
        self.area
    }
}

impl PassBuffer {
    pub(crate) fn new(common: Arc<Common>) -> Result<Self, Error> {
        // Memory is taken when something is added, and shared by the buffers of a film.
        let crop = common.crop;
        let blocks = Blocks::new(crop, |area| PassBlock { area, sums: None })
            .ok_or(Error::TooLarge { width: crop.width(), height: crop.height() })?;
        Ok(Self { common, blocks, pass: 0, bad: Mutex::default() })
    }

    /// Empties it for `pass`.
    pub fn begin(&mut self, pass: u32) {
        self.pass = pass;
        for i in 0..self.blocks.len() {
            if let Some(sums) = self.blocks.lock(i).take() {
                self.common.give_back(sums);
            }
        }
        self.bad.get_mut().unwrap_or_else(PoisonError::into_inner).clear();
    }

    /// The pass that it is for.
    #[must_use]
    pub fn pass(&self) -> u32 {
        self.pass
    }

    /// Adds the samples of a tile, once.
    pub fn add_tile(&self, tile: &FilmTile) {
        debug_assert_eq!(tile.pass, self.pass);
        let n_aovs = self.common.n_aovs;
        self.blocks.for_each_in(tile.area, |block, shared| {
            let area = block.area;
            let sums = block.sums(&self.common);
            for y in shared.min[1]..shared.max[1] {
                let from = offset_in(&tile.area, shared.min[0], y);
                let to = offset_in(&area, shared.min[0], y);
                for k in 0..shared.width() {
                    let sum = &tile.sums[from + k];
                    for (c, x) in fixed3(sum).into_iter().enumerate() {
                        sums.total.add(3 * (to + k) + c, x);
                    }
                    if let Some(w) = sums.weight.get_mut(to + k) {
                        *w = w.wrapping_add(weight::from_f64(sum[3]));
                    }
                }
                let aovs = &tile.aovs[from * n_aovs..(from + shared.width()) * n_aovs];
                for (k, &x) in aovs.iter().enumerate() {
                    sums.aovs.add(to * n_aovs + k, Fixed::from_f64(x).unwrap_or_default());
                }
            }
        });
        self.record(&tile.bad);
    }

    /// Adds all splats of the list, and empties it.
    pub fn add_splats(&self, list: &mut SplatList) {
        // Splats of one block together, so that its lock is taken once.
        list.splats.sort_unstable_by_key(|s| s.block);
        for splats in list.splats.chunk_by(|a, b| a.block == b.block) {
            self.add_splats_of_one_block(splats[0].block as usize, splats);
        }
        list.splats.clear();
        self.record(&list.bad);
        list.bad.clear();
    }

    /// Most splats stay in their block; those that reach into others take those locks afterwards.
    fn add_splats_of_one_block(&self, i: usize, splats: &[Splat]) {
        let reach = self.common.reach;
        let mut block = self.blocks.lock(i);
        let area = block.area;
        for s in splats {
            block.add_splat(&self.common, s, area);
        }
        drop(block);
        for s in splats {
            let [x, y] = s.pixel;
            let footprint = Bounds2i::new([x, y], [x.saturating_add(1), y.saturating_add(1)]).expand(reach);
            if footprint.intersect(&area) != footprint {
                self.blocks.for_each_in(footprint, |other, shared| {
                    if other.area != area {
                        other.add_splat(&self.common, s, shared);
                    }
                });
            }
        }
    }

    fn record(&self, bad: &BadSamples) {
        if bad.count() > 0 {
            self.bad.lock().unwrap_or_else(PoisonError::into_inner).merge(bad);
        }
    }
}

/// The three colours of a tile's sum. Each is far below what fits: contributions have a limit.
#[inline]
pub(crate) fn fixed3(sum: &[f64; 4]) -> [Fixed; 3] {
    [0, 1, 2].map(|c| Fixed::from_f64(sum[c]).unwrap_or_default())
}

impl Drop for PassBuffer {
    /// The render is over: what its passes needed goes too.
    fn drop(&mut self) {
        self.common.let_go();
    }
}

impl PassBlock {
    /// The sums, to be added to.
    fn sums(&mut self, common: &Common) -> &mut PassSums {
        self.sums.get_or_insert_with(|| common.take_sums(self.area.area()))
    }

    /// The sums, if there is anything; it is empty then.
    pub(crate) fn take(&mut self) -> Option<PassSums> {
        self.sums.take()
    }

    /// The part of a splat that falls into `part` of this block.
    fn add_splat(&mut self, common: &Common, s: &Splat, part: Bounds2i) {
        let area = self.area;
        let sums = self.sums(common);
        spread(common, part, s.pixel, s.offset, |i, w| {
            let to = offset_in(&area, part.min[0], part.min[1])
                + i / part.width() * area.width()
                + i % part.width();
            let value = s.rgb.map(|v| Fixed::from_f32(w * v).unwrap_or_default());
            if let Some(channel) = s.channel {
                let at = to * common.n_splat_aovs + usize::from(channel);
                return value.into_iter().enumerate().for_each(|(c, x)| sums.splat_aovs.add(at + c, x));
            }
            for (c, x) in value.into_iter().enumerate() {
                sums.total.add(3 * to + c, x);
                if !sums.splat.is_empty() {
                    sums.splat.add(3 * to + c, x);
                }
            }
        });
    }
}

impl PassSums {
    /// Makes them zeros for `n` pixels.
    pub(crate) fn reset(&mut self, common: &Common, n: usize) {
        let n_weighted = if common.is_pixel_box { 0 } else { n };
        // One sample in its own pixel is a float.
        if common.is_pixel_box {
            self.total.reset_floats(3 * n)
        } else {
            self.total.reset(3 * n)
        }
        self.weight.clear();
        self.weight.resize(n_weighted, 0);
        self.splat.reset(if common.has_splats { 3 * n_weighted } else { 0 });
        self.aovs.reset(n * common.n_aovs);
        self.splat_aovs.reset(n * common.n_splat_aovs);
    }
}

/// Splats of one worker on their way to the pass: appended without a lock, added in bulk.
#[derive(Clone, Debug)]
pub struct SplatList {
    common: Arc<Common>,
    pass: u32,
    splats: Vec<Splat>,
    bad: BadSamples,
}

#[derive(Clone, Copy, Debug)]
struct Splat {
    /// The block of the film that is nearest.
    block: u32,
    pixel: [i32; 2],
    offset: [f32; 2],
    rgb: [f32; 3],
    /// The first of three further channels; `None` for the image.
    channel: Option<u16>,
}

/// A list this long should be handed in.
const FULL: usize = 8192;

impl SplatList {
    pub(crate) fn new(common: Arc<Common>) -> Self {
        Self { common, pass: 0, splats: Vec::new(), bad: BadSamples::default() }
    }

    /// Empties it for the splats of `pass`.
    pub fn begin(&mut self, pass: u32) {
        self.pass = pass;
        self.splats.clear();
        self.bad.clear();
    }

    /// Adds `rgb` at a raster position, on or off the film. It counts, weighted by the filter, in the pixels of the footprint, and
    /// its sum over a pass is an estimate of the pixel: the caller has divided by the number of paths.
    #[inline]
    pub fn add(&mut self, position: [f32; 2], rgb: [f32; 3]) {
        self.push(position, rgb, None);
    }

    /// Adds to three further channels, from `channel` of [`FilmSettings::splat_aovs`] on, as [`SplatList::add`] does to R, G, B.
    pub fn add_aov(&mut self, channel: usize, position: [f32; 2], rgb: [f32; 3]) {
        debug_assert!(channel + 3 <= self.common.n_splat_aovs);
        self.push(position, rgb, u16::try_from(channel).ok());
    }

    #[inline]
    fn push(&mut self, position: [f32; 2], rgb: [f32; 3], channel: Option<u16>) {
        if rgb == [0.0; 3] || !position.iter().all(|x| x.abs() < 1e9) {
            return;
        }
        let pixel = position.map(|x| x.floor() as i32);
        if !self.common.sign.accepts(rgb) {
            self.bad.record(BadSample { pass: self.pass, y: pixel[1], x: pixel[0], kind: kind_of(rgb) });
            return;
        }
        if !self.common.crop.expand(self.common.reach).contains(pixel) {
            return;
        }
        let offset = [0, 1].map(|a| position[a] - pixel[a] as f32);
        let block = block_of(&self.common.crop, pixel) as u32;
        self.splats.push(Splat { block, pixel, offset, rgb, channel });
    }

    /// Is it long enough to be handed to [`PassBuffer::add_splats`]? (It may grow further.)
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.splats.len() >= FULL
    }
}
