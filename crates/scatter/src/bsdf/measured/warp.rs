//! Bilinear functions on the unit square in a family of slices, between which they are blended linearly; as densities
//! they are sampled by inverting marginal and conditional distribution functions, which are quadratic in each cell.

/// Weights of four slices: the corners of a cell in the family's two parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Blend {
    pub(super) slices: [usize; 4],
    pub(super) weights: [f32; 4],
}

impl Blend {
    /// Between the values of two axes, the first of which runs slowest; outside of them the nearest.
    pub(super) fn new(axes: [&[f32]; 2], at: [f32; 2]) -> Self {
        let [(i, f), (j, g)] = [0, 1].map(|k| place(axes[k], at[k]));
        let n = axes[1].len();
        let (ii, jj) = ((i + 1).min(axes[0].len() - 1), (j + 1).min(n - 1));
        let slices = [i * n + j, i * n + jj, ii * n + j, ii * n + jj];
        let weights = [(1.0 - f) * (1.0 - g), (1.0 - f) * g, f * (1.0 - g), f * g];
        Self { slices, weights }
    }

    /// The blend of what every slice of `stride` numbers has at `offset`.
    #[inline]
    fn of(&self, data: &[f32], stride: usize, offset: usize) -> f32 {
        let mut sum = 0.0;
        for (slice, weight) in self.slices.iter().zip(self.weights) {
            if weight > 0.0 {
                sum += weight * data[slice * stride + offset];
            }
        }
        sum
    }
}

/// The interval of an ascending axis that holds `x`, and how far into it.
fn place(axis: &[f32], x: f32) -> (usize, f32) {
    if axis.len() < 2 {
        return (0, 0.0);
    }
    let i = axis.partition_point(|a| *a <= x).saturating_sub(1).min(axis.len() - 2);
    (i, ((x - axis[i]) / (axis[i + 1] - axis[i])).clamp(0.0, 1.0))
}

/// Values at nodes of the square.
#[derive(Clone, Debug)]
pub(super) struct Nodes {
    pub(super) size: [usize; 2],
    pub(super) values: Vec<f32>,
}

/// A node and how far it is to the next ones.
#[derive(Clone, Copy)]
struct Cell {
    at: [usize; 2],
    f: [f32; 2],
}

impl Nodes {
    fn cell(&self, p: [f32; 2]) -> Cell {
        let axis = |k: usize| {
            let x = p[k].clamp(0.0, 1.0) * (self.size[k] - 1) as f32;
            let i = (x as usize).min(self.size[k] - 2);
            (i, x - i as f32)
        };
        let ((i, f), (j, g)) = (axis(0), axis(1));
        Cell { at: [i, j], f: [f, g] }
    }

    /// Numbers in a slice.
    pub(super) fn stride(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// The value of slice `slice` at a point.
    pub(super) fn at(&self, slice: usize, p: [f32; 2]) -> f32 {
        let cell = self.cell(p);
        let base = slice * self.stride() + cell.at[1] * self.size[0] + cell.at[0];
        let row = |i: usize| lerp(self.values[i], self.values[i + 1], cell.f[0]);
        lerp(row(base), row(base + self.size[0]), cell.f[1])
    }
}

/// A family of densities.
#[derive(Clone, Debug)]
pub(super) struct Warp {
    nodes: Nodes,
    /// Integral along each row, in cells, up to each of its nodes.
    along: Vec<f32>,
    /// Integral of whole rows up to each row.
    rows: Vec<f32>,
}

impl Warp {
    /// Of values that are finite and not negative; every slice is scaled to integrate to one, and one that is zero is even.
    pub(super) fn new(mut nodes: Nodes) -> Self {
        let [w, h] = nodes.size;
        let (mut along, mut rows) = (Vec::with_capacity(nodes.values.len()), Vec::new());
        for slice in nodes.values.chunks_exact_mut(w * h) {
            let cells: f64 = slice.chunks_exact(w).map(|row| trapezoids(row).sum::<f64>()).sum();
            if cells <= 0.0 {
                slice.fill(1.0);
            }
            let row_sums: Vec<f64> = slice.chunks_exact(w).map(|row| trapezoids(row).sum()).collect();
            let total: f64 = row_sums.windows(2).map(|r| 0.5 * (r[0] + r[1])).sum();
            for v in slice.iter_mut() {
                *v = (f64::from(*v) / total) as f32;
            }
            for row in slice.chunks_exact(w) {
                along.extend(running(trapezoids(row)));
            }
            rows.extend(running(row_sums.windows(2).map(|r| 0.5 * (r[0] + r[1]) / total)));
        }
        Self { nodes, along, rows }
    }

    /// The density at a point.
    pub(super) fn pdf(&self, blend: &Blend, p: [f32; 2]) -> f32 {
        let (cell, [w, h]) = (self.nodes.cell(p), self.nodes.size);
        let [near, far] = self.edge(blend, cell.at, cell.f[1]);
        lerp(near, far, cell.f[0]) * ((w - 1) * (h - 1)) as f32
    }

    /// The density at height `g` of a cell, at its left and right edge.
    fn edge(&self, blend: &Blend, [i, j]: [usize; 2], g: f32) -> [f32; 2] {
        let (w, stride) = (self.nodes.size[0], self.nodes.stride());
        [i, i + 1].map(|i| {
            let at = |j: usize| blend.of(&self.nodes.values, stride, j * w + i);
            lerp(at(j), at(j + 1), g)
        })
    }

    /// The integral along row `j` up to column `i`.
    fn along(&self, blend: &Blend, i: usize, j: usize) -> f32 {
        blend.of(&self.along, self.nodes.stride(), j * self.nodes.size[0] + i)
    }

    /// Draws a point.
    pub(super) fn sample(&self, blend: &Blend, u: [f32; 2]) -> [f32; 2] {
        let [w, h] = self.nodes.size;
        let row = |j: usize| blend.of(&self.rows, h, j);
        let target = u[1] * row(h - 1);
        let j = find(h, target, row);
        let [low, high] = [j, j + 1].map(|j| self.along(blend, w - 1, j));
        let g = solve([low, high], target - row(j));

        let along = |i: usize| lerp(self.along(blend, i, j), self.along(blend, i, j + 1), g);
        let target = u[0] * along(w - 1);
        let i = find(w, target, along);
        let f = solve(self.edge(blend, [i, j], g), target - along(i));
        [(i as f32 + f) / (w - 1) as f32, (j as f32 + g) / (h - 1) as f32]
    }

    /// The numbers that [`Warp::sample`] makes a point of, and the density there.
    pub(super) fn inverse(&self, blend: &Blend, p: [f32; 2]) -> ([f32; 2], f32) {
        let ([w, h], cell) = (self.nodes.size, self.nodes.cell(p));
        let ([i, j], [f, g]) = (cell.at, cell.f);
        let row = |j: usize| blend.of(&self.rows, h, j);
        let edge = self.edge(blend, [i, j], g);
        let pdf = lerp(edge[0], edge[1], f) * ((w - 1) * (h - 1)) as f32;
        let along = |i: usize| lerp(self.along(blend, i, j), self.along(blend, i, j + 1), g);
        let total = along(w - 1);
        let x = if total > 0.0 { (along(i) + integral(edge, f)) / total } else { p[0] };
        let y = row(j) + integral([j, j + 1].map(|j| self.along(blend, w - 1, j)), g);
        ([x.clamp(0.0, 1.0), (y / row(h - 1)).clamp(0.0, 1.0)], pdf)
    }
}

fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// Integrals between neighbours.
fn trapezoids(values: &[f32]) -> impl Iterator<Item = f64> + '_ {
    values.windows(2).map(|v| 0.5 * (f64::from(v[0]) + f64::from(v[1])))
}

/// Zero, and the sums so far.
fn running(terms: impl Iterator<Item = f64>) -> impl Iterator<Item = f32> {
    let sums = terms.scan(0.0, |sum, x| {
        *sum += x;
        Some(*sum as f32)
    });
    std::iter::once(0.0).chain(sums)
}

/// The last of the first `n − 1` nodes whose ascending value is at most `target`, and whose cell is not empty if possible.
fn find(n: usize, target: f32, value: impl Fn(usize) -> f32) -> usize {
    let (mut lo, mut hi) = (0, n - 1);
    while hi - lo > 1 {
        let mid = usize::midpoint(lo, hi);
        if value(mid) <= target { lo = mid } else { hi = mid }
    }
    lo
}

/// `∫₀ᵗ` of a line from `a` to `b`.
fn integral([a, b]: [f32; 2], t: f32) -> f32 {
    t * (a + 0.5 * t * (b - a))
}

/// The `t` in [0, 1] whose integral that is.
fn solve([a, b]: [f32; 2], target: f32) -> f32 {
    let root = (a * a + 2.0 * target * (b - a)).max(0.0).sqrt();
    let t = 2.0 * target / (a + root);
    if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.5 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use math::hash::unit_f32;

    fn random(n: usize) -> Vec<f32> {
        (0..n).map(|i| unit_f32((i as u32).wrapping_mul(0x9e37_79b9) ^ 0x55aa) + 0.01).collect()
    }

    #[test]
    fn the_inverse_undoes_the_warp_and_the_density_is_its_derivative() {
        let warp = Warp::new(Nodes { size: [5, 4], values: random(5 * 4 * 6) });
        let blend = Blend::new([&[0.0, 1.0], &[0.0, 0.5, 1.0]], [0.3, 0.7]);
        assert!((blend.weights.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        for k in 0..400_u32 {
            let u = [k, k + 1000].map(|k| 0.02 + 0.95 * unit_f32(k.wrapping_mul(0x85eb_ca6b)));
            let p = warp.sample(&blend, u);
            let (back, pdf) = warp.inverse(&blend, p);
            assert!((0..2).all(|a| (back[a] - u[a]).abs() < 1e-4), "{u:?} {p:?} {back:?}");
            assert!((pdf - warp.pdf(&blend, p)).abs() < 1e-4 * pdf);
            // du/dp is the density.
            let d = 1e-3;
            let [x, y] = [[p[0] + d, p[1]], [p[0], p[1] + d]].map(|q| warp.inverse(&blend, q).0);
            let area = (x[0] - back[0]) * (y[1] - back[1]) - (x[1] - back[1]) * (y[0] - back[0]);
            assert!((area / (d * d) / pdf - 1.0).abs() < 0.05, "{p:?}: {} is not {pdf}", area / (d * d));
        }
    }

    #[test]
    fn what_is_zero_is_even() {
        let warp = Warp::new(Nodes { size: [3, 3], values: vec![0.0; 9] });
        let blend = Blend::new([&[0.0], &[0.0]], [0.2, 0.2]);
        assert_eq!(warp.pdf(&blend, [0.3, 0.9]), 1.0);
        let p = warp.sample(&blend, [0.3, 0.9]);
        assert!((p[0] - 0.3).abs() < 1e-6 && (p[1] - 0.9).abs() < 1e-6);
    }
}
