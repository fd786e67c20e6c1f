//! Values on a grid of points, trilinear in between, and their upper bounds in a coarser grid of cells.

use std::sync::Arc;

use math::Vec3;
use scene_desc::GridBorder;

/// What a grid holds.
pub(super) trait Value: Copy + Default + std::fmt::Debug {
    fn lerp(a: Self, b: Self, t: f32) -> Self;
}

impl Value for f32 {
    fn lerp(a: Self, b: Self, t: f32) -> Self {
        a * (1.0 - t) + b * t
    }
}

impl Value for [f32; 3] {
    fn lerp(a: Self, b: Self, t: f32) -> Self {
        [0, 1, 2].map(|i| a[i] * (1.0 - t) + b[i] * t)
    }
}

/// Points at the centres of the cells of the unit cube.
#[derive(Clone, Debug)]
pub(super) struct Grid<T> {
    resolution: [u32; 3],
    data: Arc<[T]>,
    border: GridBorder,
}

impl<T: Value> Grid<T> {
    /// `None` if the number of values is not that of the points, or zero.
    pub(super) fn new(resolution: [u32; 3], data: Arc<[T]>, border: GridBorder) -> Option<Self> {
        let n = resolution.iter().try_fold(1_usize, |n, r| n.checked_mul(*r as usize))?;
        (n > 0 && n == data.len()).then_some(Self { resolution, data, border })
    }

    /// The value at a point of the unit cube.
    pub(super) fn at(&self, p: Vec3) -> T {
        let n = self.resolution.map(|r| r as f32);
        let q = [p.x * n[0] - 0.5, p.y * n[1] - 0.5, p.z * n[2] - 0.5];
        let i = q.map(|x| x.floor() as i64);
        let d = [0, 1, 2].map(|a| q[a] - q[a].floor());
        let row = |y: i64, z: i64| T::lerp(self.point([i[0], y, z]), self.point([i[0] + 1, y, z]), d[0]);
        let plane = |z: i64| T::lerp(row(i[1], z), row(i[1] + 1, z), d[1]);
        T::lerp(plane(i[2]), plane(i[2] + 1), d[2])
    }

    /// Is it so for all points?
    pub(super) fn all(&self, is_so: impl Fn(T) -> bool) -> bool {
        self.data.iter().all(|v| is_so(*v))
    }

    fn point(&self, at: [i64; 3]) -> T {
        let n = self.resolution.map(i64::from);
        let inside = (0..3).all(|a| (0..n[a]).contains(&at[a]));
        let at = match self.border {
            GridBorder::Zero if !inside => return T::default(),
            GridBorder::Zero => at,
            GridBorder::Clamp => [0, 1, 2].map(|a| at[a].clamp(0, n[a] - 1)),
        };
        self.data[((at[2] * n[1] + at[1]) * n[0] + at[0]) as usize]
    }

    /// The largest of `size` over all points that values between `lo` and `hi` of the unit cube come from.
    fn most(&self, lo: [f32; 3], hi: [f32; 3], size: &impl Fn(T) -> f32) -> f32 {
        let range = |a: usize| {
            let n = self.resolution[a] as f32;
            let (from, to) = ((lo[a] * n - 0.5).floor() as i64, (hi[a] * n - 0.5).floor() as i64 + 1);
            from.max(-1)..=to.min(i64::from(self.resolution[a]))
        };
        let mut most = 0.0_f32;
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    most = most.max(size(self.point([x, y, z])));
                }
            }
        }
        most
    }
}

/// Upper bounds in the cells of the unit cube.
#[derive(Clone, Debug)]
pub(super) struct Majorants {
    pub(super) resolution: [u32; 3],
    values: Vec<f32>,
}

/// Most cells along an axis.
const MOST_CELLS: u32 = 32;
/// Points of the grid along a cell's edge, if there are enough.
const POINTS_PER_CELL: u32 = 4;
/// Rounding may carry a point of a ray so far over the border of its cell.
const SLACK: f32 = 1e-3;

impl Majorants {
    /// The same everywhere.
    pub(super) fn constant(value: f32) -> Self {
        Self { resolution: [1; 3], values: vec![value] }
    }

    /// The same everywhere, on the cells for a grid of these points.
    pub(super) fn everywhere(points: [u32; 3], value: f32) -> Self {
        let resolution = cells(points);
        let n = resolution.iter().map(|r| *r as usize).product();
        Self { resolution, values: vec![value; n] }
    }

    /// Bounds on `size` of the grid's values.
    pub(super) fn of<T: Value>(grid: &Grid<T>, size: impl Fn(T) -> f32) -> Self {
        let resolution = cells(grid.resolution);
        let [nx, ny, nz] = resolution;
        let mut values = Vec::with_capacity((nx * ny * nz) as usize);
        for z in 0..nz {
            for y in 0..ny {
                for x in 0..nx {
                    let at =
                        |i: [u32; 3], by: f32| [0, 1, 2].map(|a| (i[a] as f32 + by) / resolution[a] as f32);
                    let (lo, hi) = (at([x, y, z], -SLACK), at([x, y, z], 1.0 + SLACK));
                    values.push(grid.most(lo, hi, &size));
                }
            }
        }
        Self { resolution, values }
    }

    /// The sum of two bounds on the same cells.
    pub(super) fn plus(mut self, other: &Self) -> Self {
        for (a, b) in self.values.iter_mut().zip(&other.values) {
            *a += b;
        }
        self
    }

    pub(super) fn at(&self, cell: [u32; 3]) -> f32 {
        let [nx, ny, _] = self.resolution;
        self.values[((cell[2] * ny + cell[1]) * nx + cell[0]) as usize]
    }
}

fn cells(points: [u32; 3]) -> [u32; 3] {
    points.map(|r| r.div_ceil(POINTS_PER_CELL).clamp(1, MOST_CELLS))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(border: GridBorder) -> Grid<f32> {
        // f(x, y, z) = x + 10 y + 100 z at the points of a grid of 4 × 3 × 2.
        let points = (0..24).map(|i| (i % 4) as f32 + 10.0 * ((i / 4) % 3) as f32 + 100.0 * (i / 12) as f32);
        Grid::new([4, 3, 2], points.collect(), border).unwrap()
    }

    #[test]
    fn values_are_trilinear_between_points_and_fade_or_stay_at_the_border() {
        let g = ramp(GridBorder::Zero);
        // x = 1.25, y = 0.5, z = 0.5 in units of points.
        let p = Vec3::new((1.25 + 0.5) / 4.0, (0.5 + 0.5) / 3.0, (0.5 + 0.5) / 2.0);
        assert!((g.at(p) - (1.25 + 5.0 + 50.0)).abs() < 1e-4);
        assert!((g.at(Vec3::new(0.0, 1.5 / 3.0, 0.75)) - 0.5 * 110.0).abs() < 1e-3, "half a cell outside");
        let g = ramp(GridBorder::Clamp);
        assert!((g.at(Vec3::new(0.0, 1.5 / 3.0, 0.75)) - 110.0).abs() < 1e-3);
        assert!(Grid::new([4, 3, 1], Arc::from([0.0_f32; 24]), GridBorder::Zero).is_none());
        assert!(Grid::new([0, 3, 1], Arc::from([0.0_f32; 0]), GridBorder::Zero).is_none());
    }

    #[test]
    fn no_value_is_above_its_cells_majorant() {
        let mut rng = sampling::rng::Rng::from_parts(&[3]);
        let data: Vec<f32> = (0..9 * 10 * 11).map(|_| rng.next_f32()).collect();
        for border in [GridBorder::Zero, GridBorder::Clamp] {
            let grid = Grid::new([9, 10, 11], data.clone().into(), border).unwrap();
            let majorants = Majorants::of(&grid, |v| v);
            for _ in 0..100_000 {
                let p = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
                let n = majorants.resolution;
                let cell = [0, 1, 2].map(|a| ((p[a] * n[a] as f32) as u32).min(n[a] - 1));
                assert!(grid.at(p) <= majorants.at(cell) * (1.0 + 1e-6), "{p} {cell:?}");
            }
        }
    }
}
