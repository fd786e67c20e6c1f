//! A piecewise constant density on the unit square, drawn from within any rectangle: by a summed-area table, whose
//! interpolation is the exact integral [Bitterli2015, sec. 3].

use crate::{Pdf, PrimarySpace};

/// A density of which windows can be drawn from.
#[derive(Clone, Debug, PartialEq)]
pub struct Windowed2D {
    size: [usize; 2],
    /// The mass of all before each corner of a cell: (width + 1) × (height + 1), for a mass of one in all.
    sums: Vec<f64>,
}

/// A rectangle: from and to, along x and y.
pub type Window = [[f64; 2]; 2];

/// The whole square.
pub const WHOLE: Window = [[0.0, 1.0]; 2];

impl Windowed2D {
    /// From values in rows, the first at y = 0; those that are not positive and finite count as zero, and if all do, as
    /// one. `None` unless there is at least one and all rows are full.
    #[must_use]
    pub fn new(values: &[f32], width: usize) -> Option<Self> {
        if values.is_empty() || width == 0 || !values.len().is_multiple_of(width) {
            return None;
        }
        let size = [width, values.len() / width];
        let clean = |v: f32| if v > 0.0 && v.is_finite() { f64::from(v) } else { 0.0 };
        let is_black = values.iter().all(|&v| clean(v) == 0.0);
        let value = |v: f32| if is_black { 1.0 } else { clean(v) };
        let total: f64 = values.iter().map(|&v| value(v)).sum();
        let mut sums = vec![0.0; (size[0] + 1) * (size[1] + 1)];
        for y in 0..size[1] {
            let mut row = 0.0;
            for x in 0..width {
                row += value(values[y * width + x]) / total;
                sums[(y + 1) * (width + 1) + x + 1] = sums[y * (width + 1) + x + 1] + row;
            }
        }
        Some(Self { size, sums })
    }

    /// A point of the window; `None` if the density is zero there, or the window is empty.
    #[must_use]
    pub fn sample(&self, u: [f32; 2], window: &Window) -> Option<[f32; 2]> {
        let [[x0, x1], [y0, y1]] = *window;
        // The column by the window's rows, then the row within that column.
        let x = invert(u[0], [x0, x1], self.size[0], |x| self.mass(&[[x0, x], [y0, y1]]))?;
        let column = (cell(x, self.size[0]) as f64, self.size[0] as f64);
        let strip = [column.0 / column.1, (column.0 + 1.0) / column.1];
        let y = invert(u[1], [y0, y1], self.size[1], |y| self.mass(&[strip, [y0, y]]))?;
        let f32_within =
            |x: f64, [lo, hi]: [f64; 2]| (x.clamp(lo, hi) as f32).clamp(0.0, 1.0_f32.next_down());
        Some([f32_within(x, [x0, x1]), f32_within(y, [y0, y1])])
    }

    /// Density of [`Windowed2D::sample`] at a point; zero outside of the window.
    #[must_use]
    pub fn pdf(&self, p: [f32; 2], window: &Window) -> Pdf<PrimarySpace> {
        let p = p.map(f64::from);
        // A sample at the border may have been rounded out of it.
        let is_inside = (0..2).all(|i| p[i] >= window[i][0] - 1e-7 && p[i] <= window[i][1] + 1e-7);
        let mass = self.mass(window);
        if !is_inside || mass <= 0.0 {
            return Pdf::ZERO;
        }
        let [i, j] = [cell(p[0], self.size[0]), cell(p[1], self.size[1])];
        let at = |x: usize, y: usize| self.sums[y * (self.size[0] + 1) + x];
        let of_cell = (at(i + 1, j + 1) - at(i, j + 1) - at(i + 1, j) + at(i, j)).max(0.0);
        let density = of_cell * (self.size[0] * self.size[1]) as f64 / mass;
        Pdf::new(if density.is_finite() { density as f32 } else { 0.0 })
    }

    /// Share of the whole mass in a window.
    #[must_use]
    pub fn mass(&self, window: &Window) -> f64 {
        let [[x0, x1], [y0, y1]] = *window;
        (self.before(x1, y1) - self.before(x0, y1) - self.before(x1, y0) + self.before(x0, y0)).max(0.0)
    }

    /// The mass of all that lies below and to the left of a point.
    fn before(&self, x: f64, y: f64) -> f64 {
        let split = |x: f64, n: usize| {
            let at = x.clamp(0.0, 1.0) * n as f64;
            let i = (at as usize).min(n - 1);
            (i, at - i as f64)
        };
        let ((i, fx), (j, fy)) = (split(x, self.size[0]), split(y, self.size[1]));
        let at = |x: usize, y: usize| self.sums[y * (self.size[0] + 1) + x];
        let lower = at(i, j) * (1.0 - fx) + at(i + 1, j) * fx;
        let upper = at(i, j + 1) * (1.0 - fx) + at(i + 1, j + 1) * fx;
        lower * (1.0 - fy) + upper * fy
    }
}

/// Where the mass, a straight line within each of `n` cells, reaches its share `u` of what it is at the end.
fn invert(u: f32, [from, to]: [f64; 2], n: usize, mass: impl Fn(f64) -> f64) -> Option<f64> {
    let total = mass(to);
    if to <= from || total <= 0.0 {
        return None;
    }
    let wanted = f64::from(u) * total;
    // The last border that does not reach it, by halves.
    let border = |i: usize| (i as f64 / n as f64).clamp(from, to);
    let (mut lo, mut hi) = (cell(from, n), cell(to, n) + 1);
    while hi - lo > 1 {
        let middle = (lo + hi) / 2;
        if mass(border(middle)) <= wanted {
            lo = middle;
        } else {
            hi = middle;
        }
    }
    let (a, b) = (mass(border(lo)), mass(border(hi)));
    let share = if b > a { ((wanted - a) / (b - a)).clamp(0.0, 1.0) } else { 0.5 };
    Some(border(lo) + (border(hi) - border(lo)) * share)
}

/// Which of `n` cells holds x ∈ [0, 1].
fn cell(x: f64, n: usize) -> usize {
    ((x.max(0.0) * n as f64) as usize).min(n - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Windowed2D {
        let values: Vec<f32> =
            (0..7 * 5).map(|i| if i % 4 == 1 { 0.0 } else { 1.0 + (i % 9) as f32 }).collect();
        Windowed2D::new(&values, 7).unwrap()
    }

    #[test]
    fn the_density_adds_up_to_one_in_every_window() {
        let d = table();
        for window in
            [WHOLE, [[0.13, 0.77], [0.31, 0.95]], [[0.40, 0.42], [0.1, 0.9]], [[0.2, 0.9], [0.55, 0.56]]]
        {
            let n = 400;
            let center = |i: usize, [a, b]: [f64; 2]| (a + (b - a) * (i as f64 + 0.5) / n as f64) as f32;
            let sum: f64 = (0..n * n)
                .map(|i| {
                    let p = [center(i % n, window[0]), center(i / n, window[1])];
                    f64::from(d.pdf(p, &window).value())
                })
                .sum();
            let area = (window[0][1] - window[0][0]) * (window[1][1] - window[1][0]);
            assert!((sum / (n * n) as f64 * area - 1.0).abs() < 0.02, "{window:?}: {sum}");
        }
    }

    #[test]
    fn samples_fill_a_window_as_its_density_says() {
        let d = table();
        let window = [[0.13, 0.77], [0.31, 0.95]];
        // The mass of a part of the window, drawn and by the table.
        let part = [[0.30, 0.61], [0.50, 0.80]];
        let n = 1000;
        let mut inside = 0;
        for i in 0..n * n {
            let u = [(i % n) as f32 + 0.5, (i / n) as f32 + 0.5].map(|x| x / n as f32);
            let p = d.sample(u, &window).unwrap();
            assert!(d.pdf(p, &window).is_positive(), "{p:?}");
            let p = p.map(f64::from);
            inside += u32::from((0..2).all(|k| p[k] >= part[k][0] && p[k] < part[k][1]));
        }
        let expected = d.mass(&part) / d.mass(&window);
        assert!((f64::from(inside) / (n * n) as f64 - expected).abs() < 2e-3, "{inside} {expected}");
    }

    #[test]
    fn dark_and_empty_windows_give_nothing() {
        let d = Windowed2D::new(&[0.0, 0.0, 1.0, 0.0], 2).unwrap();
        assert!(d.sample([0.5; 2], &[[0.6, 0.9], [0.1, 0.9]]).is_none());
        assert!(d.sample([0.5; 2], &[[0.3, 0.3], [0.1, 0.9]]).is_none());
        assert!(d.sample([0.5; 2], &[[0.1, 0.3], [0.6, 0.9]]).is_some());
    }
}
