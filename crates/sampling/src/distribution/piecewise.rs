//! Piecewise constant densities on [0, 1) and [0, 1)², sampled by inverting the distribution function.
//!
//! The two-dimensional one draws the row from the marginal and the column from the row [PBR4e, sec. A.5.3], which keeps
//! stratification. A cell holds its left and lower edge.

use crate::{Pdf, PrimarySpace};

/// A density on [0, 1) that is constant on `n` intervals of equal length.
#[derive(Clone, Debug, PartialEq)]
pub struct PiecewiseConstant1D {
    /// `cdf[i]` is the probability of everything before interval i: `n + 1` numbers from 0 to 1.
    cdf: Vec<f64>,
    integral: f64,
}

/// A point of the interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample1D {
    /// In [0, 1).
    pub x: f32,
    /// Density at x.
    pub pdf: Pdf<PrimarySpace>,
    /// The interval that x lies in.
    pub index: usize,
}

impl PiecewiseConstant1D {
    /// From values in proportion to the density; those that are not positive and finite count as zero. `None` if there
    /// are none.
    #[must_use]
    pub fn new(values: &[f32]) -> Option<Self> {
        Self::from_iter(values.iter().map(|&v| f64::from(v)), values.len())
    }

    fn from_iter(values: impl Iterator<Item = f64>, n: usize) -> Option<Self> {
        if n == 0 {
            return None;
        }
        let mut cdf = Vec::with_capacity(n + 1);
        let mut sum = 0.0;
        cdf.push(0.0);
        for v in values {
            sum += if v > 0.0 && v.is_finite() { v } else { 0.0 };
            cdf.push(sum);
        }
        for (i, c) in cdf.iter_mut().enumerate() {
            *c = if sum > 0.0 { *c / sum } else { i as f64 / n as f64 };
        }
        Some(Self { cdf, integral: sum / n as f64 })
    }

    /// Number of intervals.
    #[must_use]
    pub fn len(&self) -> usize {
        self.cdf.len() - 1
    }

    /// Never: there is at least one interval.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Mean of the values: their integral over [0, 1).
    #[must_use]
    pub fn integral(&self) -> f64 {
        self.integral
    }

    /// Draws a point.
    #[must_use]
    pub fn sample(&self, u: f32) -> Sample1D {
        let u = f64::from(u);
        let index = self.find(u);
        let (lo, hi) = (self.cdf[index], self.cdf[index + 1]);
        let x = (index as f64 + (u - lo) / (hi - lo)) / self.len() as f64;
        Sample1D { x: within(x, index, self.len()), pdf: self.pdf_of(index), index }
    }

    /// Draws an interval: its index, its probability and a number that is uniform again.
    #[must_use]
    pub fn choose(&self, u: f32) -> super::Choice {
        let u = f64::from(u);
        let index = self.find(u);
        let (lo, hi) = (self.cdf[index], self.cdf[index + 1]);
        let rest = ((u - lo) / (hi - lo)) as f32;
        super::Choice { index, probability: (hi - lo) as f32, u: rest.clamp(0.0, BELOW_ONE) }
    }

    /// The density at a point; zero outside.
    #[must_use]
    pub fn pdf(&self, x: f32) -> Pdf<PrimarySpace> {
        if (0.0..1.0).contains(&x) { self.pdf_of(cell(x, self.len())) } else { Pdf::ZERO }
    }

    /// The probability of an interval.
    #[must_use]
    pub fn probability(&self, index: usize) -> f32 {
        if index < self.len() { (self.cdf[index + 1] - self.cdf[index]) as f32 } else { 0.0 }
    }

    /// The `u` of a point: the distribution function.
    #[must_use]
    pub fn inverse(&self, x: f32) -> f32 {
        let n = self.len();
        let i = cell(x, n);
        let rest = (f64::from(x) * n as f64 - i as f64).clamp(0.0, 1.0);
        (self.cdf[i] + rest * (self.cdf[i + 1] - self.cdf[i])) as f32
    }

    fn pdf_of(&self, index: usize) -> Pdf<PrimarySpace> {
        Pdf::new(((self.cdf[index + 1] - self.cdf[index]) * self.len() as f64) as f32)
    }

    /// The interval of positive probability that u ∈ [0, 1) falls into.
    fn find(&self, u: f64) -> usize {
        let i = self.cdf.partition_point(|&c| c <= u);
        // Behind the last step of the distribution function come empty intervals only.
        if i > self.len() { self.cdf.partition_point(|&c| c < 1.0) - 1 } else { i - 1 }
    }
}

/// A density on [0, 1)² that is constant on `width × height` cells.
#[derive(Clone, Debug, PartialEq)]
pub struct PiecewiseConstant2D {
    rows: Vec<PiecewiseConstant1D>,
    marginal: PiecewiseConstant1D,
}

/// A point of the square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample2D {
    /// In [0, 1)².
    pub p: [f32; 2],
    /// Density at p.
    pub pdf: Pdf<PrimarySpace>,
    /// Column and row of the cell that p lies in.
    pub cell: [usize; 2],
}

impl PiecewiseConstant2D {
    /// From values in rows, the first at y = 0. `None` unless there is at least one and all rows are full.
    #[must_use]
    pub fn new(values: &[f32], width: usize) -> Option<Self> {
        if values.is_empty() || width == 0 || !values.len().is_multiple_of(width) {
            return None;
        }
        let rows: Vec<_> = values.chunks(width).map(PiecewiseConstant1D::new).collect::<Option<_>>()?;
        let marginal =
            PiecewiseConstant1D::from_iter(rows.iter().map(PiecewiseConstant1D::integral), rows.len())?;
        Some(Self { rows, marginal })
    }

    /// Columns and rows.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        [self.rows[0].len(), self.rows.len()]
    }

    /// Mean of the values: their integral over the square.
    #[must_use]
    pub fn integral(&self) -> f64 {
        self.marginal.integral()
    }

    /// Draws a point.
    #[must_use]
    pub fn sample(&self, u: [f32; 2]) -> Sample2D {
        let y = self.marginal.sample(u[1]);
        let x = self.rows[y.index].sample(u[0]);
        let pdf = self.pdf_of(x.index, y.index);
        Sample2D { p: [x.x, y.x], pdf, cell: [x.index, y.index] }
    }

    /// The density at a point; zero outside.
    #[must_use]
    pub fn pdf(&self, p: [f32; 2]) -> Pdf<PrimarySpace> {
        if !p.iter().all(|x| (0.0..1.0).contains(x)) {
            return Pdf::ZERO;
        }
        let [w, h] = self.size();
        self.pdf_of(cell(p[0], w), cell(p[1], h))
    }

    /// The `u` of a point.
    #[must_use]
    pub fn inverse(&self, p: [f32; 2]) -> [f32; 2] {
        let row = cell(p[1], self.rows.len());
        [self.rows[row].inverse(p[0]), self.marginal.inverse(p[1])]
    }

    fn pdf_of(&self, column: usize, row: usize) -> Pdf<PrimarySpace> {
        self.rows[row].pdf_of(column) * self.marginal.pdf_of(row).value()
    }
}

const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// Which of `n` cells holds x ∈ [0, 1).
fn cell(x: f32, n: usize) -> usize {
    ((f64::from(x) * n as f64) as usize).min(n - 1)
}

/// x as `f32`, nudged back if rounding has pushed it out of its cell.
fn within(x: f64, index: usize, n: usize) -> f32 {
    let x = (x as f32).clamp(0.0, BELOW_ONE);
    let i = cell(x, n);
    if i == index {
        x
    } else if i < index {
        x.next_up()
    } else {
        x.next_down()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_lies_in_the_cell_whose_density_it_reports_and_the_inverse_leads_back() {
        let values: Vec<f32> =
            (0..1001).map(|i| if i % 7 == 3 { 0.0 } else { 1.0 + (i % 13) as f32 }).collect();
        let d = PiecewiseConstant1D::new(&values).unwrap();
        for i in 0..100_000 {
            let u = (i as f32 + 0.5) / 100_000.0;
            let s = d.sample(u);
            assert!(s.pdf.is_positive() && d.pdf(s.x) == s.pdf, "{s:?}");
            assert!((d.inverse(s.x) - u).abs() < 2e-6, "{s:?} {u} {}", d.inverse(s.x));
        }
    }

    #[test]
    fn the_ends_of_the_interval_never_meet_an_empty_cell() {
        let d = PiecewiseConstant1D::new(&[0.0, 0.0, 2.0, 0.0, 1.0, 0.0, 0.0]).unwrap();
        for (u, index) in [(0.0, 2), (BELOW_ONE, 4), (2.0_f32 / 3.0 + 1e-6, 4), (0.3, 2)] {
            assert_eq!(d.sample(u).index, index, "{u}");
            assert_eq!(d.choose(u).index, index, "{u}");
        }
        assert!((d.pdf(0.3).value() - 7.0 * 2.0 / 3.0).abs() < 1e-6);
        assert!((d.integral() - 3.0 / 7.0).abs() < 1e-12);
    }

    #[test]
    fn zeros_count_as_constant_and_dark_rows_are_skipped() {
        let d = PiecewiseConstant2D::new(&[0.0; 12], 4).unwrap();
        assert_eq!(d.pdf([0.3, 0.9]).value(), 1.0);
        let d = PiecewiseConstant2D::new(&[0.0, 0.0, 1.0, 3.0, 0.0, 0.0], 2).unwrap();
        for i in 0..1000 {
            let s = d.sample([(i as f32 + 0.5) / 1000.0, ((i * 37 % 1000) as f32 + 0.5) / 1000.0]);
            assert_eq!(s.cell[1], 1);
            assert_eq!(d.pdf(s.p), s.pdf);
        }
        // Six cells; the brightest has three quarters of it all.
        assert!((d.pdf([0.75, 0.5]).value() - 4.5).abs() < 1e-6);
        assert!(
            PiecewiseConstant2D::new(&[1.0; 5], 2).is_none() && PiecewiseConstant2D::new(&[], 0).is_none()
        );
    }
}
