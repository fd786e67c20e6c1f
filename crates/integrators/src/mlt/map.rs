//! A coarse map of how bright the image is: chains that visit paths in proportion to what they add *over the brightness
//! of their place* leave the same relative error in dark places as in bright ones, as in Veach's two-stage scheme
//! [Veach1997, sec. 11.5]. Any map gives the right mean.

use math::Bounds2i;

/// Cells on the longer side.
const ACROSS: usize = 16;

/// Least brightness, as a share of the mean.
const DARKEST: f64 = 0.05;

/// Brightness over a grid of cells; the mean is one.
#[derive(Clone, Debug)]
pub(super) struct Map {
    region: Bounds2i,
    cells: [usize; 2],
    values: Vec<f32>,
}

impl Map {
    /// One everywhere.
    pub(super) fn even(region: Bounds2i) -> Self {
        let longer = region.width().max(region.height()).max(1);
        let cells = [region.width(), region.height()].map(|n| (n * ACROSS).div_ceil(longer).min(n).max(1));
        Self { region, cells, values: vec![1.0; cells[0] * cells[1]] }
    }

    /// From the sum of what fell into each cell; stays as it is if nothing did.
    pub(super) fn set(&mut self, sums: &[f64]) {
        let mean = sums.iter().sum::<f64>() / sums.len() as f64;
        if mean > 0.0 && mean.is_finite() {
            let smooth = self.smoothed(sums);
            for (v, x) in self.values.iter_mut().zip(smooth) {
                *v = (DARKEST + (1.0 - DARKEST) * x / mean) as f32;
            }
        }
    }

    /// Means over each cell and its neighbours.
    fn smoothed(&self, sums: &[f64]) -> Vec<f64> {
        let [w, h] = self.cells;
        (0..w * h)
            .map(|i| {
                let near = |at: usize, n: usize| at.saturating_sub(1)..(at + 2).min(n);
                let (x, y) = (i % w, i / w);
                let cells = near(y, h).flat_map(|y| near(x, w).map(move |x| y * w + x));
                let (sum, n) = cells.fold((0.0, 0.0), |(s, n), i| (s + sums[i], n + 1.0));
                sum / n
            })
            .collect()
    }

    pub(super) fn n_cells(&self) -> usize {
        self.values.len()
    }

    pub(super) fn brightness_at(&self, raster: [f32; 2]) -> f32 {
        self.values[self.cell_at(raster)]
    }

    /// The brightness of a cell.
    pub(super) fn brightness(&self, cell: usize) -> f32 {
        self.values[cell]
    }

    /// Which cell a place lies in.
    pub(super) fn cell_at(&self, raster: [f32; 2]) -> usize {
        let size = [self.region.width(), self.region.height()];
        let [x, y] = [0, 1].map(|a| {
            let at = (raster[a] - self.region.min[a] as f32) / size[a] as f32;
            ((at * self.cells[a] as f32) as usize).min(self.cells[a] - 1)
        });
        y * self.cells[0] + x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_of_a_map_is_one_and_no_place_is_black() {
        let mut map = Map::even(Bounds2i::new([-2, 3], [62, 35]));
        assert_eq!(map.cells, [16, 8]);
        let sums: Vec<f64> = (0..map.n_cells()).map(|i| if i < 64 { 2.0 } else { 0.0 }).collect();
        map.set(&sums);
        let mean = map.values.iter().sum::<f32>() / 128.0;
        assert!((mean - 1.0).abs() < 1e-5, "{mean}");
        assert!((map.brightness_at([0.0, 4.0]) - 1.95).abs() < 1e-5);
        assert!((map.brightness_at([61.9, 34.9]) - 0.05).abs() < 1e-5);
        assert_eq!((map.cell_at([-2.0, 3.0]), map.cell_at([62.0, 35.0])), (0, 127));
        let before = map.values.clone();
        map.set(&vec![0.0; 128]);
        assert_eq!(map.values, before, "a pilot that found nothing says nothing");
    }
}
