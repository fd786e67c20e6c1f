//! A sky in patches: what each may send to a point, by the cosine at the point and by how much of it is seen from about there.
//!
//! A light sample is drawn first from the patches, in proportion to `E V cos`, then within one by the sky's image alone. `E` is the
//! patch's share of the sky's light and `V` the part of it that reaches the cell of space that the point lies in, learned by a few rays
//! when the scene is compiled: what windows leave of a sky in a room is soon found, where [Bitterli2015] must be told of the windows. `V` is never less than a twentieth and the cosine never zero where any of a
//! patch can be above the surface, so that estimates stay without bias whatever was learned; only their noise depends on it.
//!
//! Departs from a density in proportion to the sky alone: it is a function of the place.

use math::{Bounds, Dir, Point, Ray, Vec3, Vec4, hash};
use rayon::prelude::*;
use sampling::distribution::{PiecewiseConstant2D, chances, choose};
use sampling::{Pdf, PrimarySpace};

use crate::LightContext;

/// Patches along each side of the image.
const SIDE: usize = 8;
const N: usize = SIDE * SIDE;
const LANES: usize = 4;
/// `V` of a patch that no ray found.
const LEAST: f32 = 0.05;
/// Cells of space, at most about so many.
const CELLS: f32 = 2048.0;
/// Rays to a patch from each cell.
const RAYS: u64 = 2;

/// The patches of a sky.
#[derive(Clone, Debug)]
pub(super) struct Patches {
    /// Borders in pixels along both axes; the last is the image's size.
    borders: [[usize; SIDE + 1]; 2],
    /// How many there are along both axes.
    count: [usize; 2],
    /// Middles and sines of half angles.
    x: [Vec4; N / LANES],
    y: [Vec4; N / LANES],
    z: [Vec4; N / LANES],
    sin: [Vec4; N / LANES],
    /// Share of the sky's light.
    light: [Vec4; N / LANES],
    /// The density within each; `None` where all is black.
    inner: Vec<Option<PiecewiseConstant2D>>,
    seen: Option<Seen>,
}

/// A place of the image.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drawn {
    /// On the unit square.
    pub(super) p: [f32; 2],
    /// Its density there.
    pub(super) pdf: Pdf<PrimarySpace>,
}

/// What is seen of the patches from everywhere.
#[derive(Clone, Debug)]
struct Seen {
    bounds: Bounds,
    inverse_size: Vec3,
    cells: [usize; 3],
    /// `V` of all patches of every cell.
    parts: Vec<[Vec4; N / LANES]>,
}

impl Patches {
    /// Of an image of `width` pixels in each row, whose pixels emit in proportion to `weights`. `direction` is where in the world
    /// a place of the image is.
    pub(super) fn new(
        weights: &[f32],
        width: usize,
        direction: impl Fn([f32; 2]) -> Option<Dir>,
    ) -> Option<Self> {
        let size = [width, weights.len() / width.max(1)];
        let count = size.map(|n| n.min(SIDE));
        let border =
            |axis: usize| std::array::from_fn(|i| i.min(count[axis]) * size[axis] / count[axis].max(1));
        let mut patches = Self {
            borders: [border(0), border(1)],
            count,
            x: [Vec4::ZERO; N / LANES],
            y: [Vec4::ZERO; N / LANES],
            z: [Vec4::ZERO; N / LANES],
            sin: [Vec4::ONE; N / LANES],
            light: [Vec4::ZERO; N / LANES],
            inner: Vec::with_capacity(N),
            seen: None,
        };
        for i in 0..N {
            let at = [i % SIDE, i / SIDE];
            if at[0] >= count[0] || at[1] >= count[1] {
                patches.inner.push(None);
                continue;
            }
            let [from, to] = [0, 1].map(|end| [0, 1].map(|a| patches.borders[a][at[a] + end]));
            let pixels: Vec<f32> = (from[1]..to[1])
                .flat_map(|y| &weights[y * width + from[0]..y * width + to[0]])
                .copied()
                .collect();
            let sum: f64 = pixels.iter().map(|w| f64::from(w.max(0.0))).sum();
            let inner = PiecewiseConstant2D::new(&pixels, to[0] - from[0]).filter(|d| d.integral() > 0.0);
            let light = if inner.is_some() { sum as f32 } else { 0.0 };
            patches.inner.push(inner);

            // The cone around it, by places along its border and within.
            const STEPS: u16 = 8;
            let place = |k: u16, axis: usize| {
                let share = f32::from(k) / f32::from(STEPS);
                (from[axis] as f32 + (to[axis] - from[axis]) as f32 * share) / size[axis] as f32
            };
            let all = (0..=STEPS).flat_map(|y| (0..=STEPS).map(move |x| [x, y]));
            let directions: Vec<Vec3> =
                all.filter_map(|[x, y]| direction([place(x, 0), place(y, 1)])).map(|w| w.0).collect();
            let axis = directions.iter().sum::<Vec3>().try_normalize();
            let cos = axis.map(|a| directions.iter().map(|w| w.dot(a)).fold(1.0, f32::min));
            let (l, lane) = (i / LANES, i % LANES);
            patches.light[l][lane] = light;
            // A little more, for what is between the places; where it is half a sphere, it is above every surface.
            if let (Some(axis), Some(cos)) = (axis, cos.filter(|c| *c > 0.1)) {
                (patches.x[l][lane], patches.y[l][lane], patches.z[l][lane]) = (axis.x, axis.y, axis.z);
                patches.sin[l][lane] = ((1.0 - cos * cos).max(0.0).sqrt() * 1.05).clamp(0.02, 1.0);
            }
        }
        let sum: f32 = patches.light.iter().map(|l| l.element_sum()).sum();
        (sum > 0.0 && sum.is_finite()).then(|| {
            patches.light.iter_mut().for_each(|l| *l /= sum);
            patches
        })
    }

    /// A place of the image for a point.
    pub(super) fn sample(&self, context: &LightContext, u: [f32; 2]) -> Option<Drawn> {
        let (weights, sum) = self.weights(context);
        let rows: [f32; SIDE] = std::array::from_fn(|y| (weights[2 * y] + weights[2 * y + 1]).element_sum());
        let (row, uy) = choose(chances(rows)?, u[1]);
        let columns: [f32; SIDE] = std::array::from_fn(|x| weights[2 * row + x / LANES][x % LANES]);
        let (column, ux) = choose(chances(columns)?, u[0]);
        let within = self.inner[row * SIDE + column].as_ref()?.sample([ux, uy]);
        let (p, scale) = self.place([column, row], within.p);
        let chance = columns[column] / sum;
        Some(Drawn { p, pdf: within.pdf * (chance * scale) })
    }

    /// Density of [`Patches::sample`] over the unit square.
    pub(super) fn pdf(&self, context: &LightContext, p: [f32; 2]) -> Pdf<PrimarySpace> {
        let at: [usize; 2] = std::array::from_fn(|a| {
            let n = self.borders[a][self.count[a]];
            let pixel = ((p[a] * n as f32) as usize).min(n - 1);
            ((pixel + 1) * self.count[a] - 1) / n
        });
        let i = at[1] * SIDE + at[0];
        let Some(inner) = &self.inner[i] else { return Pdf::ZERO };
        let (weights, sum) = self.weights(context);
        let within: [f32; 2] = std::array::from_fn(|a| {
            let [from, to] = [0, 1].map(|end| self.borders[a][at[a] + end] as f32);
            let n = self.borders[a][self.count[a]] as f32;
            ((p[a] * n - from) / (to - from)).clamp(0.0, 1.0_f32.next_down())
        });
        let (_, scale) = self.place(at, within);
        if sum <= 0.0 {
            return Pdf::ZERO;
        }
        inner.pdf(within) * (weights[i / LANES][i % LANES] / sum * scale)
    }

    /// The place in the unit square of a place within a patch, and the square's area over the patch's.
    fn place(&self, at: [usize; 2], within: [f32; 2]) -> ([f32; 2], f32) {
        let mut scale = 1.0;
        let p = std::array::from_fn(|a| {
            let [from, to] = [0, 1].map(|end| self.borders[a][at[a] + end] as f32);
            let n = self.borders[a][self.count[a]] as f32;
            scale *= n / (to - from);
            ((from + (to - from) * within[a]) / n).min(1.0_f32.next_down())
        });
        (p, scale)
    }

    /// What each patch may send to the point, and all of them.
    fn weights(&self, context: &LightContext) -> ([Vec4; N / LANES], f32) {
        let mut weights = self.light;
        if let Some(seen) = &self.seen {
            let parts = seen.at(context.p);
            for (w, v) in weights.iter_mut().zip(parts) {
                *w *= *v;
            }
        }
        if let Some(n) = context.ns {
            for (i, w) in weights.iter_mut().enumerate() {
                let cos = self.x[i] * n.0.x + self.y[i] * n.0.y + self.z[i] * n.0.z;
                // About the mean over the patch of max(0, cos): where the horizon cuts it, a parabola.
                let above = (cos + self.sin[i]).max(Vec4::ZERO);
                let cut = above * above / (4.0 * self.sin[i]);
                *w *= Vec4::select(cos.cmpgt(self.sin[i]), cos, cut);
            }
        }
        let sum = weights.iter().copied().sum::<Vec4>().element_sum();
        (weights, sum)
    }

    /// Learns what is seen of it within `bounds`; `is_blocked` tells of rays to infinity.
    pub(super) fn look(
        &mut self,
        bounds: &Bounds,
        to_world: impl Fn([f32; 2]) -> Option<Dir> + Sync,
        is_blocked: impl Fn(&Ray) -> bool + Sync,
    ) {
        let size = bounds.size();
        let longest = size.max_element();
        if bounds.is_empty() || longest <= 0.0 || !longest.is_finite() {
            return;
        }
        // Cubes, about as many as are wanted.
        let size = size.max(Vec3::splat(longest * 1e-3));
        let edge = math::trig::pow(size.x * size.y * size.z / CELLS, 1.0 / 3.0).max(longest / 32.0);
        let cells = (size / edge).to_array().map(|n| (n.ceil() as usize).max(1));
        let cell_size = size / Vec3::new(cells[0] as f32, cells[1] as f32, cells[2] as f32);
        let raw: Vec<[f32; N]> = (0..cells.iter().product::<usize>())
            .into_par_iter()
            .map(|cell| {
                let at = Vec3::new(
                    (cell % cells[0]) as f32,
                    (cell / cells[0] % cells[1]) as f32,
                    (cell / cells[0] / cells[1]) as f32,
                );
                let mut parts = [0.0; N];
                for (i, part) in parts.iter_mut().enumerate() {
                    let Some(inner) = &self.inner[i] else { continue };
                    for k in 0..RAYS {
                        let mut key = hash::combine(cell as u64, i as u64 * RAYS + k);
                        let mut u = || {
                            key = hash::mix64(key.wrapping_add(0x9e37_79b9_7f4a_7c15));
                            hash::unit_f32((key >> 32) as u32)
                        };
                        let origin = bounds.min + (at + Vec3::new(u(), u(), u())) * cell_size;
                        let (p, _) = self.place([i % SIDE, i / SIDE], inner.sample([u(), u()]).p);
                        let Some(w) = to_world(p) else { continue };
                        let ray = Ray::new(Point(origin), w, u());
                        *part += if is_blocked(&ray) { 0.0 } else { 1.0 / RAYS as f32 };
                    }
                }
                parts
            })
            .collect();
        let parts = (0..raw.len()).map(|cell| smoothed(&raw, cells, cell)).collect();
        self.seen = Some(Seen { bounds: *bounds, inverse_size: cell_size.recip(), cells, parts });
    }
}

impl Seen {
    fn at(&self, p: Point) -> &[Vec4; N / LANES] {
        let at = ((p.0 - self.bounds.min) * self.inverse_size).to_array();
        let at: [usize; 3] = std::array::from_fn(|a| (at[a].max(0.0) as usize).min(self.cells[a] - 1));
        &self.parts[(at[2] * self.cells[1] + at[1]) * self.cells[0] + at[0]]
    }
}

/// What was found in a cell, in parts with what was found beside it: in the next patches and in the next cells.
fn smoothed(raw: &[[f32; N]], cells: [usize; 3], cell: usize) -> [Vec4; N / LANES] {
    let at = [cell % cells[0], cell / cells[0] % cells[1], cell / cells[0] / cells[1]];
    let strides = [1, cells[0], cells[0] * cells[1]];
    let beside = (0..3).flat_map(|a| {
        let below = (at[a] > 0).then(|| cell - strides[a]);
        let above = (at[a] + 1 < cells[a]).then(|| cell + strides[a]);
        [below, above]
    });
    let beside: Vec<usize> = beside.flatten().collect();
    let mut parts = [Vec4::ZERO; N / LANES];
    for i in 0..N {
        let own = raw[cell][i];
        let of_cells = match beside.len() {
            0 => own,
            n => beside.iter().map(|c| raw[*c][i]).sum::<f32>() / n as f32,
        };
        let (x, y) = (i % SIDE, i / SIDE);
        let next = [
            (x > 0).then(|| i - 1),
            (x + 1 < SIDE).then(|| i + 1),
            (y > 0).then(|| i - SIDE),
            (y + 1 < SIDE).then(|| i + SIDE),
        ];
        let n = next.iter().flatten().count();
        let of_patches = next.iter().flatten().map(|p| raw[cell][*p]).sum::<f32>() / n.max(1) as f32;
        let mean = 0.5 * own + 0.25 * of_cells + 0.25 * of_patches;
        parts[i / LANES][i % LANES] = LEAST + (1.0 - LEAST) * mean;
    }
    parts
}
