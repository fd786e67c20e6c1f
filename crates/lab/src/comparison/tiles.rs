//! Means over the tiles of a picture: nearly normal where single pixels are not, and few enough to be tested one by one.

use film::Developed;
use statistics::MeanEstimate;

/// Most tiles across and down.
const MOST: [usize; 2] = [8, 6];
/// Fewest pixels across and down a tile: means over fewer are far from normal, and tests of them cry wolf.
const SIDE: usize = 8;

/// A grid of tiles over a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Grid {
    size: [usize; 2],
    /// Tiles across and down.
    pub(crate) tiles: [usize; 2],
}

impl Grid {
    pub(crate) fn new(width: usize, height: usize) -> Self {
        let tiles = |n: usize, most: usize| (n / SIDE).clamp(1, most);
        Self { size: [width, height], tiles: [tiles(width, MOST[0]), tiles(height, MOST[1])] }
    }

    /// How many tiles.
    pub(crate) fn len(&self) -> usize {
        self.tiles[0] * self.tiles[1]
    }

    fn tile_of(&self, pixel: usize) -> usize {
        let [w, h] = self.size;
        let (x, y) = (pixel % w, pixel / w);
        (y * self.tiles[1] / h) * self.tiles[0] + x * self.tiles[0] / w
    }

    /// The mean of each tile.
    pub(crate) fn means(&self, rgb: &[[f32; 3]]) -> Vec<[f64; 3]> {
        let mut sums = vec![[0.0; 3]; self.len()];
        let mut counts = vec![0_u32; self.len()];
        for (i, value) in rgb.iter().enumerate() {
            let tile = self.tile_of(i);
            counts[tile] += 1;
            for c in 0..3 {
                sums[tile][c] += if value[c].is_finite() { f64::from(value[c]) } else { 0.0 };
            }
        }
        sums.iter().zip(counts).map(|(s, n)| s.map(|x| x / f64::from(n.max(1)))).collect()
    }
}

/// The tiles of a batch of passes that were rendered independently of all other batches.
#[derive(Clone, Debug)]
pub(crate) struct Batch {
    pub(crate) passes: u32,
    pub(crate) tiles: Vec<[f64; 3]>,
}

impl Batch {
    pub(crate) fn new(grid: &Grid, developed: &Developed) -> Self {
        Self { passes: developed.n_passes as u32, tiles: grid.means(&developed.mean) }
    }
}

/// What batches say of a tile's channel.
pub(crate) fn estimate(batches: &[Batch], tile: usize, channel: usize) -> MeanEstimate {
    MeanEstimate::of_batches(batches.iter().map(|b| (b.tiles[tile][channel], f64::from(b.passes))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_counts_in_one_tile() {
        let (width, height) = (67, 51);
        let grid = Grid::new(width, height);
        let rgb = vec![[1.0, 2.0, 3.0]; width * height];
        assert_eq!(grid.means(&rgb), vec![[1.0, 2.0, 3.0]; 48]);
        let mut one = vec![[0.0; 3]; width * height];
        one[width * height - 1] = [120.0; 3];
        let means = grid.means(&one);
        assert!(means[47][0] > 0.0 && means[..47].iter().all(|m| m[0] == 0.0));
    }

    #[test]
    fn small_pictures_have_few_tiles() {
        let tiles = [(3, 2), (24, 16), (1, 900)].map(|(w, h)| Grid::new(w, h).tiles);
        assert_eq!(tiles, [[1, 1], [3, 2], [1, 6]]);
    }
}
