//! From sums to pixels: the mean, the variance of the mean and the further channels.
//!
//! Where a film keeps iterations apart, their pictures are combined with one weight each, in proportion to the inverse of the
//! picture's relMSE as its own variance estimates it [Mueller2019]. One number for a picture, not one for a pixel: where a pixel's
//! samples missed the light, its variance is low just because they did. The bias that is left falls with the passes and with
//! the pixels that share a weight; the variance given is that of fixed weights.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::MutexGuard;

use math::Bounds2i;
use rayon::prelude::*;

use crate::blocks::{SIDE, offset_in};
use crate::film::Film;
use crate::fixed::{Moment, weight};
use crate::passes::PassSet;
use crate::sums::{FilmBlock, Sums};
use crate::tile::Common;

/// The pixels of a film's crop, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Developed {
    /// The crop.
    pub bounds: Bounds2i,
    /// Complete passes.
    pub n_passes: u64,
    /// How much each iteration that has passes of its own counts, adding up to one. One alone: all passes count alike.
    pub weights: Vec<f64>,
    /// Linear R, G, B of each pixel.
    pub mean: Vec<[f32; 3]>,
    /// Variance of that mean, by the delta method; infinite below two passes.
    pub variance: Vec<[f32; 3]>,
    /// The further channels, `n` per pixel in the order of the settings: those of camera samples, then those of splats.
    pub aovs: Vec<f32>,
}

impl Film {
    /// The image as it stands, on the threads of the current rayon pool.
    #[must_use]
    pub fn develop(&self) -> Developed {
        let bounds = self.settings().crop;
        let n_further = self.common.n_aovs + self.common.n_splat_aovs;
        let parts = self.parts();
        let weights = self.weights(&parts);
        let mut image = Developed {
            bounds,
            n_passes: self.passes().len(),
            weights: Vec::new(),
            mean: vec![[0.0; 3]; bounds.area()],
            variance: vec![[0.0; 3]; bounds.area()],
            aovs: vec![0.0; bounds.area() * n_further],
        };
        // Rows of blocks.
        let rows = SIDE as usize * bounds.width();
        let mut further: Vec<&mut [f32]> = match n_further {
            0 => (0..self.n_blocks()).map(|_| &mut [][..]).collect(),
            n => image.aovs.chunks_mut(rows * n).collect(),
        };
        let mean = image.mean.par_chunks_mut(rows);
        mean.zip(image.variance.par_chunks_mut(rows)).zip(&mut further).enumerate().for_each(
            |(row, ((mean, variance), further))| {
                let columns = self.iterations[0].columns();
                for b in row * columns..(row + 1) * columns {
                    let mut band = Band { mean, variance, further };
                    self.develop_block(b, (&parts, &weights), &mut band);
                }
            },
        );
        image.weights = weights;
        image
    }

    /// One block, into the rows of pixels that it lies in.
    fn develop_block(&self, b: usize, (parts, weights): (&[Part], &[f64]), to: &mut Band<'_>) {
        let (n_aovs, n_splat_aovs) = (self.common.n_aovs, self.common.n_splat_aovs);
        let (n_further, n_passes) = (n_aovs + n_splat_aovs, self.passes().len() as f64);
        let blocks = self.block_of_each_iteration(b);
        let area = blocks[0].area;
        let blocks = self.sums_of(&blocks);
        let crop = self.settings().crop;
        let band = Bounds2i::new([crop.min[0], area.min[1]], [crop.max[0], area.max[1]]);
        let mut pixels = Vec::with_capacity(parts.len());
        for i in 0..area.area() {
            let (x, y) = (i % area.width(), i / area.width());
            let at = offset_in(&band, area.min[0] + x as i32, area.min[1] + y as i32);
            pixels.clear();
            pixels.extend(parts.iter().map(|part| part.pixel(&self.common, &blocks, i)));
            for c in 0..3 {
                let sum = |f: &dyn Fn(&Pixel, f64) -> f64| {
                    pixels.iter().zip(weights).map(|(p, &w)| f(p, w)).sum::<f64>()
                };
                to.mean[at][c] = sum(&|p, w| w * p.mean(c)) as f32;
                to.variance[at][c] = sum(&|p, w| w * w * p.variance(c)) as f32;
            }
            let weight: f64 = pixels.iter().map(|p| p.weight).sum();
            let further = &mut to.further[at * n_further..(at + 1) * n_further];
            for (k, x) in further.iter_mut().enumerate() {
                let sum_of = |s: &Sums| match k.checked_sub(n_aovs) {
                    None => s.aovs.get(i * n_aovs + k).to_f64(),
                    Some(k) => s.splat_aovs.get(i * n_splat_aovs + k).to_f64(),
                };
                let sums = blocks.iter().flatten().map(|s| &**s);
                // (A sum of none would be negative.)
                let sum = sums.map(sum_of).fold(0.0, |a, x| a + x);
                *x = ratio(sum, if k < n_aovs { weight } else { n_passes }) as f32;
            }
        }
    }

    /// Iterations with passes, those of too few joined with their neighbour before (the first with the one behind); never none.
    fn parts(&self) -> Vec<Part> {
        let passes = self.passes();
        let mut parts: Vec<Part> = Vec::new();
        for (k, range) in self.settings().iteration_ranges().enumerate() {
            let n = passes.intersection(&PassSet::from_range(range)).len();
            match parts.last_mut() {
                Some(last) if n < AT_LEAST || last.n < AT_LEAST => {
                    last.n += n;
                    last.iterations.end = k + 1;
                }
                Some(_) | None => parts.push(Part { iterations: k..k + 1, n }),
            }
        }
        parts
    }

    /// How much each part counts: see the head. By the number of passes where a variance is zero or unknown.
    fn weights(&self, parts: &[Part]) -> Vec<f64> {
        if parts.len() == 1 {
            return vec![1.0];
        }
        let mut errors = vec![0.0; parts.len()];
        for b in 0..self.n_blocks() {
            let blocks = self.block_of_each_iteration(b);
            let n = blocks[0].area.area();
            let blocks = self.sums_of(&blocks);
            for i in 0..n {
                let all = Part { iterations: 0..blocks.len(), n: parts.iter().map(|p| p.n).sum() };
                let (whole, pixels) = (
                    all.pixel(&self.common, &blocks, i),
                    parts.iter().map(|p| p.pixel(&self.common, &blocks, i)),
                );
                for (error, pixel) in errors.iter_mut().zip(pixels) {
                    for c in 0..3 {
                        let mean = whole.mean(c);
                        *error += pixel.variance(c) / (mean * mean + EPSILON);
                    }
                }
            }
        }
        let is_known = errors.iter().all(|&e| e > 0.0 && f64::is_finite(e));
        let shares: Vec<f64> =
            parts.iter().zip(&errors).map(|(p, e)| if is_known { e.recip() } else { p.n as f64 }).collect();
        let sum: f64 = shares.iter().sum();
        shares.iter().map(|s| s / sum).collect()
    }

    /// Block `b` of every iteration, for this thread alone.
    fn block_of_each_iteration(&self, b: usize) -> Vec<MutexGuard<'_, FilmBlock>> {
        self.iterations.iter().map(|blocks| blocks.lock(b)).collect()
    }

    fn sums_of<'b>(&self, blocks: &'b [MutexGuard<'_, FilmBlock>]) -> Vec<Option<Cow<'b, Sums>>> {
        blocks.iter().map(|block| block.sums(&self.common)).collect()
    }
}

/// Rows of pixels as high as a block, to be developed.
struct Band<'a> {
    mean: &'a mut [[f32; 3]],
    variance: &'a mut [[f32; 3]],
    further: &'a mut [f32],
}

/// Passes that tell something of their variance.
const AT_LEAST: u64 = 4;
/// Keeps relative errors finite where the picture is black.
const EPSILON: f64 = 0.01;

/// Neighbouring iterations whose passes count alike.
struct Part {
    iterations: Range<usize>,
    /// Their passes.
    n: u64,
}

impl Part {
    fn pixel(&self, common: &Common, blocks: &[Option<Cow<'_, Sums>>], i: usize) -> Pixel {
        let mut pixel = Pixel { n: self.n as f64, ..Pixel::default() };
        blocks[self.iterations.clone()].iter().flatten().for_each(|sums| pixel.add(sums, i));
        if common.is_pixel_box {
            // The box of one pixel: every pass weighs one.
            (pixel.weight, pixel.weight_squared, pixel.total_weight) = (pixel.n, pixel.n, pixel.total);
        }
        pixel
    }
}

impl Developed {
    /// Estimated relMSE of the image: the mean over pixels and channels of Var / (mean² + 0.01). Infinite below two passes.
    #[must_use]
    pub fn relmse_estimate(&self) -> f64 {
        let relative = |m: f32, v: f32| f64::from(v) / (f64::from(m) * f64::from(m) + EPSILON);
        let pixels = self.mean.iter().zip(&self.variance);
        let sum: f64 = pixels.map(|(m, v)| (0..3).map(|c| relative(m[c], v[c])).sum::<f64>()).sum();
        sum / (3 * self.mean.len().max(1)) as f64
    }

    /// Mean of each channel over the crop.
    #[must_use]
    pub fn mean_rgb(&self) -> [f64; 3] {
        let n = self.mean.len().max(1) as f64;
        [0, 1, 2].map(|c| self.mean.iter().map(|p| f64::from(p[c])).sum::<f64>() / n)
    }
}

/// The sums of one pixel as doubles.
#[derive(Default)]
struct Pixel {
    n: f64,
    total: [f64; 3],
    total_squared: [f64; 3],
    weight: f64,
    weight_squared: f64,
    total_weight: [f64; 3],
    splat: [f64; 3],
}

impl Pixel {
    /// Adds the sums of another iteration.
    fn add(&mut self, sums: &Sums, i: usize) {
        for c in 0..3 {
            let at = 3 * i + c;
            let squared = sums.total_squared.get(at);
            self.total[c] += sums.total.get(at).to_f64();
            self.total_squared[c] += if squared == Moment::MAX { f64::INFINITY } else { squared.to_f64() };
            if !sums.total_weight.is_empty() {
                self.total_weight[c] += sums.total_weight.get(at).to_f64();
            }
            if !sums.splat.is_empty() {
                self.splat[c] += sums.splat.get(at).to_f64();
            }
        }
        self.weight += sums.weight.get(i).map_or(0.0, |&w| weight::to_f64(w));
        self.weight_squared += sums.weight_squared.get(i).map_or(0.0, |&w| weight::to_f64(w));
    }

    fn mean(&self, c: usize) -> f64 {
        ratio(self.total[c] - self.splat[c], self.weight) + ratio(self.splat[c], self.n)
    }

    fn variance(&self, c: usize) -> f64 {
        if self.n < 2.0 {
            return f64::INFINITY;
        }
        let r = ratio(self.total[c] - self.splat[c], self.weight);
        let z = (self.total[c] - r * self.weight) / self.n;
        let squares = self.total_squared[c] - 2.0 * r * self.total_weight[c] + r * r * self.weight_squared;
        let b = self.weight / self.n;
        let divisor = self.n * (self.n - 1.0) * if b > 0.0 { b * b } else { 1.0 };
        ((squares - self.n * z * z) / divisor).max(0.0)
    }
}

/// A quotient that is zero where nothing was counted.
fn ratio(a: f64, b: f64) -> f64 {
    if b > 0.0 { a / b } else { 0.0 }
}
