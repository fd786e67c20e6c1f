//! Items along the Morton curve.

use glam::Vec4;
use rayon::prelude::*;

use super::binary::{Box4, Item};
use crate::kernels::memory;

/// Items of one task.
const CHUNK: usize = 1 << 14;

/// A place on the curve, 21 bits an axis, and the item there.
type Key = (u64, u32);

/// The items in order of the curve; where they share a place their order stays.
pub(crate) fn sorted(items: &[Item]) -> Vec<Item> {
    let grow = |b: Box4, i: &Item| b.grow(i.center2());
    let centers =
        items.par_chunks(CHUNK).map(|c| c.iter().fold(Box4::EMPTY, grow)).reduce(|| Box4::EMPTY, Box4::union);
    let d = centers.max - centers.min;
    // One scale for all axes: cells are cubes.
    let scale = 2_097_151.0 / d.x.max(d.y).max(d.z).max(1e-30);
    let key = |(item, at): (&Item, u32)| {
        let c: Vec4 = (item.center2() - centers.min) * scale;
        (spread(c.x as u32) | spread(c.y as u32) << 1 | spread(c.z as u32) << 2, at)
    };
    let mut keys: Vec<Key> = memory::with_capacity(items.len());
    keys.par_extend(items.par_iter().zip(0..items.len() as u32).map(key));
    keys.par_sort_unstable();
    let mut sorted = memory::with_capacity(items.len());
    sorted.par_extend(keys.par_iter().map(|&(_, at)| items[at as usize]));
    sorted
}

/// Two zero bits after each of the lower 21.
fn spread(x: u32) -> u64 {
    let mut x = u64::from(x.min(0x1f_ffff));
    x = (x | x << 32) & 0x001f_0000_0000_ffff;
    x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_spread_by_three() {
        assert_eq!(spread(0b1011), 0b001_000_001_001);
        assert_eq!(spread(0x1f_ffff).count_ones(), 21);
    }
}
