//! The film: exact sums over passes, the same bits in any order of passes, tiles, threads and machines.
//!
//! With weights w of the reconstruction filter, values v and splats s of n passes, a pixel is
//!
//! ```text
//! Σ w v / Σ w  +  Σ s / n.
//! ```
//!
//! Moments are over *replicates*: T = Σ w v + Σ s and B = Σ w of one pass are summed before they are squared. With R = ΣA / ΣB,
//! where A is T without splats, the delta method gives the variance of the pixel [Cochran1977, sec. 6.4]:
//!
//! ```text
//! Var = [ΣT² − 2R ΣTB + R² ΣB² − n z̄²] / (n (n − 1) B̄²),   z̄ = (ΣT − R ΣB) / n.
//! ```
//!
//! With the box of one pixel B = 1, and this is the variance of the mean. Passes of a low-discrepancy sequence are not
//! independent: for them it is an upper estimate, more so the smoother the pixel.
//!
//! Departs from the delta method in one respect: where there are splats, they too are divided by B̄, whose expectation is one.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::bad::BadSamples;
use crate::blocks::{Blocks, offset_in};
use crate::error::Error;
use crate::filter::FilterTable;
use crate::fixed::Fixed;
use crate::pass::{PassBuffer, SplatList, fixed3};
use crate::passes::PassSet;
use crate::settings::FilmSettings;
use crate::sums::{FilmBlock, Held};
use crate::tile::{Common, FilmTile};

/// Sums over passes for every pixel of the crop.
pub struct Film {
    settings: FilmSettings,
    pub(crate) common: Arc<Common>,
    /// One for each iteration.
    pub(crate) iterations: Vec<Blocks<FilmBlock>>,
    pub(crate) progress: Mutex<Progress>,
}

/// What a film is of, and how far it is: all but its sums, which take memory.
#[derive(Clone, Debug)]
pub struct FilmLabel {
    /// What it is a film of.
    pub settings: FilmSettings,
    /// The passes that it holds completely.
    pub passes: PassSet,
    /// The bad samples of its passes.
    pub bad_samples: BadSamples,
}

/// What is not about a single pixel.
#[derive(Clone, Debug, Default)]
pub(crate) struct Progress {
    pub(crate) passes: PassSet,
    pub(crate) open: BTreeSet<u32>,
    pub(crate) bad: BadSamples,
}

/// What a merge did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Merged {
    /// The passes of the other film were added.
    Added,
    /// The film had all those passes already, and nothing was changed.
    AlreadyThere,
}

impl Film {
    /// A film without passes.
    ///
    /// # Errors
    /// If the settings make no sense, or there is no memory.
    pub fn new(settings: FilmSettings) -> Result<Self, Error> {
        settings.check()?;
        let crop = settings.crop;
        let common = Arc::new(Common {
            crop,
            table: FilterTable::new(&settings.filter),
            reach: settings.filter.reach(),
            is_pixel_box: settings.filter.is_pixel_box(),
            sign: settings.sign,
            has_splats: settings.splats,
            n_aovs: settings.aovs.len(),
            n_splat_aovs: settings.splat_aovs.len(),
            spare: Mutex::default(),
        });
        // Memory is taken when something is added.
        let make = |area| FilmBlock { area, held: Held::Nothing };
        let iterations: Option<_> = settings.iteration_ranges().map(|_| Blocks::new(crop, make)).collect();
        let iterations = iterations.ok_or(Error::TooLarge { width: crop.width(), height: crop.height() })?;
        Ok(Self { settings, common, iterations, progress: Mutex::default() })
    }

    /// What it is a film of.
    #[must_use]
    pub fn settings(&self) -> &FilmSettings {
        &self.settings
    }

    /// The passes that it holds completely.
    #[must_use]
    pub fn passes(&self) -> PassSet {
        self.progress().passes.clone()
    }

    /// The bad samples of its passes.
    #[must_use]
    pub fn bad_samples(&self) -> BadSamples {
        self.progress().bad.clone()
    }

    /// All but the sums.
    #[must_use]
    pub fn label(&self) -> FilmLabel {
        let progress = self.progress();
        FilmLabel {
            settings: self.settings.clone(),
            passes: progress.passes.clone(),
            bad_samples: progress.bad.clone(),
        }
    }

    /// A tile for a worker.
    #[must_use]
    pub fn tile(&self) -> FilmTile {
        FilmTile::new(self.common.clone())
    }

    /// A list of splats for a worker.
    #[must_use]
    pub fn splat_list(&self) -> SplatList {
        SplatList::new(self.common.clone())
    }

    /// A buffer for one pass at a time.
    ///
    /// # Errors
    /// If there is no memory.
    pub fn pass_buffer(&self) -> Result<PassBuffer, Error> {
        PassBuffer::new(self.common.clone())
    }

    /// Adds a whole pass and empties the buffer.
    ///
    /// # Errors
    /// If the film has the pass already.
    pub fn add_pass(&self, buffer: &mut PassBuffer) -> Result<(), Error> {
        self.begin_pass(buffer.pass)?;
        for i in 0..self.n_blocks() {
            self.add_pass_block(buffer, i);
        }
        let bad = std::mem::take(buffer.bad.get_mut().unwrap_or_else(PoisonError::into_inner));
        self.progress().bad.merge(&bad);
        self.end_pass(buffer.pass)
    }

    /// How many blocks [`Film::add_pass_block`] can work on at the same time.
    #[must_use]
    pub fn n_blocks(&self) -> usize {
        self.iterations[0].len()
    }

    /// Adds one block of a pass and empties it in the buffer: [`Film::add_pass`] cut up for several threads. Between
    /// [`Film::begin_pass`] and [`Film::end_pass`], each block once; then [`Film::take_bad_samples`].
    pub fn add_pass_block(&self, buffer: &PassBuffer, block: usize) {
        let blocks = self.blocks_of(buffer.pass);
        let (mut film, mut pass) = (blocks.lock(block), buffer.blocks.lock(block));
        let Some(sums) = pass.take() else { return };
        if matches!(film.held, Held::Nothing) {
            film.held = Held::One(Box::new(sums));
            return;
        }
        film.sums_mut(&self.common).add_replicate(&sums);
        self.common.give_back(sums);
    }

    /// Takes over the bad samples of a buffer whose blocks were added one by one.
    pub fn take_bad_samples(&self, buffer: &PassBuffer) {
        let bad = std::mem::take(&mut *buffer.bad.lock().unwrap_or_else(PoisonError::into_inner));
        self.progress().bad.merge(&bad);
    }

    /// May tiles be added to the film directly, without a [`PassBuffer`]? Only if a tile is all that a pass gives to its
    /// pixels: with the box of one pixel, and without splats.
    #[must_use]
    pub fn takes_tiles(&self) -> bool {
        self.common.is_pixel_box && !self.settings.splats
    }

    /// Opens a pass for [`Film::add_tile`] or [`Film::add_pass_block`]. A film with an open pass cannot be saved or merged.
    ///
    /// # Errors
    /// If the film has the pass already, or it is open.
    pub fn begin_pass(&self, pass: u32) -> Result<(), Error> {
        let mut progress = self.progress();
        if progress.passes.contains(pass) || !progress.open.insert(pass) {
            return Err(Error::DuplicatePass(pass));
        }
        Ok(())
    }

    /// Closes a pass of which everything was added.
    ///
    /// # Errors
    /// If the pass was not open.
    pub fn end_pass(&self, pass: u32) -> Result<(), Error> {
        let mut progress = self.progress();
        if !progress.open.remove(&pass) {
            return Err(Error::OpenPass(pass));
        }
        progress.passes.insert(pass);
        Ok(())
    }

    /// Adds a tile of an open pass where [`Film::takes_tiles`]: the same bits as by way of a [`PassBuffer`], for less
    /// memory and time. An open pass cannot be taken back.
    pub fn add_tile(&self, tile: &FilmTile) {
        debug_assert!(self.takes_tiles(), "this film needs a pass buffer");
        let n_aovs = self.common.n_aovs;
        self.blocks_of(tile.pass).for_each_in(tile.area, |block, shared| {
            let area = block.area;
            let sums = block.sums_mut(&self.common);
            for y in shared.min[1]..shared.max[1] {
                let from = offset_in(&tile.area, shared.min[0], y);
                let to = offset_in(&area, shared.min[0], y);
                for k in 0..shared.width() {
                    sums.add_total(to + k, &fixed3(&tile.sums[from + k]));
                }
                let aovs = &tile.aovs[from * n_aovs..(from + shared.width()) * n_aovs];
                for (k, &x) in aovs.iter().enumerate() {
                    sums.aovs.add(to * n_aovs + k, Fixed::from_f64(x).unwrap_or_default());
                }
            }
        });
        if tile.bad.count() > 0 {
            self.progress().bad.merge(&tile.bad);
        }
    }

    /// Adds the passes of another film of the same render, exactly. Passes that are all there already are recognised
    /// and not added again.
    ///
    /// # Errors
    /// If the films are not of one render, share some of their passes but not all, or have open passes.
    pub fn merge(&mut self, other: &Self) -> Result<Merged, Error> {
        let theirs = other.progress().clone();
        let merged = self.admit(&other.settings, &theirs)?;
        if merged == Merged::Added {
            for (ours, theirs) in self.iterations.iter().zip(&other.iterations) {
                for i in 0..ours.len() {
                    let (mut ours, theirs) = (ours.lock(i), theirs.lock(i));
                    if matches!(ours.held, Held::Nothing) {
                        ours.held.clone_from(&theirs.held);
                    } else if let Some(sums) = theirs.sums(&self.common) {
                        ours.sums_mut(&self.common).merge(&sums);
                    }
                }
            }
        }
        Ok(merged)
    }

    /// Counts another film's passes as ours, whose sums are to be added next; unless they are ours already.
    pub(crate) fn admit(&mut self, settings: &FilmSettings, theirs: &Progress) -> Result<Merged, Error> {
        if let Some(difference) = self.settings.difference(settings) {
            return Err(Error::Mismatch(difference));
        }
        let ours = self.progress.get_mut().unwrap_or_else(PoisonError::into_inner);
        if let Some(&pass) = ours.open.iter().chain(&theirs.open).next() {
            return Err(Error::OpenPass(pass));
        }
        let overlap = ours.passes.intersection(&theirs.passes);
        if overlap == theirs.passes {
            return Ok(Merged::AlreadyThere);
        }
        if !overlap.is_empty() {
            return Err(Error::Overlap { overlap: overlap.to_string(), present: ours.passes.to_string() });
        }
        ours.passes = ours.passes.union(&theirs.passes);
        ours.bad.merge(&theirs.bad);
        Ok(Merged::Added)
    }

    /// Where a pass is added.
    fn blocks_of(&self, pass: u32) -> &Blocks<FilmBlock> {
        &self.iterations[self.settings.iteration_of(pass)]
    }

    pub(crate) fn progress(&self) -> MutexGuard<'_, Progress> {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
