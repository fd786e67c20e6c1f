//! From sums to pixels: the mean, the variance of the mean and the further channels.

use math::Bounds2i;

use crate::blocks::offset_in;
use crate::film::{Film, FilmBlock};
use crate::fixed::{Fixed, Moment, weight};

/// The pixels of a film's crop, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Developed {
    /// The crop.
    pub bounds: Bounds2i,
    /// Complete passes.
    pub n_passes: u64,
    /// Linear R, G, B of each pixel.
    pub mean: Vec<[f32; 3]>,
    /// Variance of that mean, by the delta method; infinite below two passes.
    pub variance: Vec<[f32; 3]>,
    /// The further channels, `n` per pixel in the order of the settings: those of camera samples, then those of splats.
    pub aovs: Vec<f32>,
}

impl Film {
    /// The image as it stands.
    #[must_use]
    pub fn develop(&self) -> Developed {
        let bounds = self.settings().crop;
        let (n_passes, n_aovs, n_splat_aovs) =
            (self.passes().len(), self.common.n_aovs, self.common.n_splat_aovs);
        let n_further = n_aovs + n_splat_aovs;
        let mut image = Developed {
            bounds,
            n_passes,
            mean: vec![[0.0; 3]; bounds.area()],
            variance: vec![[0.0; 3]; bounds.area()],
            aovs: vec![0.0; bounds.area() * n_further],
        };
        for b in 0..self.blocks.len() {
            let block = self.blocks.lock(b);
            for i in 0..block.area.area() {
                let (x, y) = (i % block.area.width(), i / block.area.width());
                let to = offset_in(&bounds, block.area.min[0] + x as i32, block.area.min[1] + y as i32);
                let pixel = Pixel::new(&block, i, n_passes as f64);
                for c in 0..3 {
                    image.mean[to][c] = pixel.mean(c) as f32;
                    image.variance[to][c] = pixel.variance(c) as f32;
                }
                for k in 0..n_aovs {
                    let sum = block.aovs[i * n_aovs + k].to_f64();
                    image.aovs[to * n_further + k] = ratio(sum, pixel.weight) as f32;
                }
                for k in 0..n_splat_aovs {
                    let sum = block.splat_aovs[i * n_splat_aovs + k].to_f64();
                    image.aovs[to * n_further + n_aovs + k] = ratio(sum, n_passes as f64) as f32;
                }
            }
        }
        image
    }
}

impl Developed {
    /// Estimated relMSE of the image: the mean over pixels and channels of Var / (mean² + 0.01). Infinite below two passes.
    #[must_use]
    pub fn relmse_estimate(&self) -> f64 {
        let relative = |m: f32, v: f32| f64::from(v) / (f64::from(m) * f64::from(m) + 0.01);
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
    fn new(block: &FilmBlock, i: usize, n: f64) -> Self {
        let total = block.total[i].map(Fixed::to_f64);
        let total_squared =
            block.total_squared[i].map(|m| if m == Moment::MAX { f64::INFINITY } else { m.to_f64() });
        let splat = block.splat.get(i).map_or([0.0; 3], |s| s.map(Fixed::to_f64));
        if block.weight.is_empty() {
            // The box of one pixel: every pass weighs one.
            return Self {
                n,
                total,
                total_squared,
                weight: n,
                weight_squared: n,
                total_weight: total,
                splat,
            };
        }
        Self {
            n,
            total,
            total_squared,
            weight: weight::to_f64(block.weight[i]),
            weight_squared: weight::to_f64(block.weight_squared[i]),
            total_weight: block.total_weight[i].map(Moment::to_f64),
            splat,
        }
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
