//! An image cut into blocks, each behind a lock of its own, so that many threads add to it at once.
//!
//! Locks are taken per tile or per list of splats, never per sample. What is added is exact, so the order in which threads
//! come does not matter.

use std::sync::{Mutex, MutexGuard, PoisonError};

use math::Bounds2i;

/// Side of a block, in pixels.
pub(crate) const SIDE: i32 = 32;

/// Something with values for each pixel of a rectangle.
pub(crate) trait Block: Sized {
    /// Where it lies.
    fn area(&self) -> Bounds2i;
}

/// All blocks of an image, in rows.
pub(crate) struct Blocks<B> {
    bounds: Bounds2i,
    blocks: Vec<Mutex<B>>,
}

/// Blocks across an image of this many columns (or rows).
fn across(n: usize) -> usize {
    n.div_ceil(SIDE as usize)
}

/// Which block of an image holds the pixel, or, for one outside, the nearest pixel inside.
pub(crate) fn block_of(bounds: &Bounds2i, pixel: [i32; 2]) -> usize {
    let at = |a: usize| {
        ((pixel[a].clamp(bounds.min[a], bounds.max[a] - 1) - bounds.min[a]) as u32 / SIDE as u32) as usize
    };
    at(1) * across(bounds.width()) + at(0)
}

impl<B: Block> Blocks<B> {
    /// `None` if there is no memory.
    pub(crate) fn new(bounds: Bounds2i, make: impl Fn(Bounds2i) -> B) -> Option<Self> {
        let (columns, rows) = (across(bounds.width()), across(bounds.height()));
        let mut blocks = Vec::new();
        blocks.try_reserve_exact(columns * rows).ok()?;
        for i in 0..columns * rows {
            let min =
                [bounds.min[0] + SIDE * (i % columns) as i32, bounds.min[1] + SIDE * (i / columns) as i32];
            let area = Bounds2i::new(min, [min[0] + SIDE, min[1] + SIDE]).intersect(&bounds);
            blocks.push(Mutex::new(make(area)));
        }
        Some(Self { bounds, blocks })
    }

    pub(crate) fn len(&self) -> usize {
        self.blocks.len()
    }

    /// Blocks in a row.
    pub(crate) fn columns(&self) -> usize {
        across(self.bounds.width())
    }

    /// The block, for this thread alone.
    pub(crate) fn lock(&self, i: usize) -> MutexGuard<'_, B> {
        self.blocks[i].lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Calls `f` with every block that touches `area`, locked, and the part that it shares.
    pub(crate) fn for_each_in(&self, area: Bounds2i, mut f: impl FnMut(&mut B, Bounds2i)) {
        let area = area.intersect(&self.bounds);
        if area.area() == 0 {
            return;
        }
        let columns = across(self.bounds.width());
        let first = block_of(&self.bounds, area.min);
        let last = block_of(&self.bounds, [area.max[0] - 1, area.max[1] - 1]);
        for row in first / columns..=last / columns {
            for column in first % columns..=last % columns {
                let mut block = self.lock(row * columns + column);
                let shared = block.area().intersect(&area);
                f(&mut block, shared);
            }
        }
    }
}

/// Where a pixel's values lie in a rectangle that holds it, row by row.
#[inline]
pub(crate) fn offset_in(area: &Bounds2i, x: i32, y: i32) -> usize {
    (y - area.min[1]) as usize * area.width() + (x - area.min[0]) as usize
}
