//! Coarser and coarser copies of an image, and the filters that read them.
//!
//! | step                              | source                       |
//! |-----------------------------------|------------------------------|
//! | pyramid, trilinear                | [Williams1983]               |
//! | elliptically weighted average     | [Heckbert1989], [PBR4e], sec. 10.4.4 |
//!
//! Departs from pbrt-v4: an odd level is halved by exact areas (its mean stays its mean), footprints are measured in
//! texels (pbrt measures them in (s, t), which differs for oblong images), and point and bilinear lookups use the
//! image itself, so that images which no texture filters need no pyramid.

use std::sync::Arc;

use image::f16;
use math::{Vec2, trig};
use scene_desc::WrapMode;

use super::texture_image::{Level, Texel, Texels, TextureImage};

/// Entries of the table of weights.
const WEIGHTS: usize = 128;

/// The levels above the image itself.
#[derive(Clone, Debug)]
pub(crate) struct Pyramid {
    texels: Texels,
    /// Width, height and first sample of each level.
    levels: Vec<(u32, u32, usize)>,
    /// `exp(−2 r²) − exp(−2)` by r² in [0, 1).
    weights: Box<[f32; WEIGHTS]>,
}

impl Pyramid {
    /// Halves `base` until a single texel is left. The samples keep the kind of the image's.
    pub(crate) fn new(base: &Level<'_>) -> Self {
        let n = base.width as usize * base.height as usize * base.channels;
        let mut fine: Vec<f32> = (0..n).map(|i| base.texels.get(base.offset + i)).collect();
        let (mut w, mut h) = (base.width as usize, base.height as usize);
        let mut levels = Vec::new();
        let mut all = Vec::new();
        while w > 1 || h > 1 {
            let (w2, h2) = ((w / 2).max(1), (h / 2).max(1));
            let narrow = halve(&fine, [w, base.channels], h);
            fine = halve(&narrow, [h, w2 * base.channels], 1);
            (w, h) = (w2, h2);
            levels.push((w as u32, h as u32, all.len()));
            all.extend_from_slice(&fine);
        }
        let texels = match base.texels {
            Texels::Bytes { curve, .. } => {
                let data = all.iter().map(|&x| encode(curve, x)).collect();
                Texels::Bytes { data, curve: Arc::clone(curve) }
            }
            Texels::Halves(_) => Texels::Halves(all.iter().map(|&x| f16::from_f32(x)).collect()),
            Texels::Floats(_) => Texels::Floats(Arc::from(all)),
        };
        let weight = |i: usize| {
            let r2 = i as f32 / (WEIGHTS - 1) as f32;
            trig::exp(-2.0 * r2) - trig::exp(-2.0)
        };
        Self { texels, levels, weights: Box::new(std::array::from_fn(weight)) }
    }

    /// How many levels.
    pub(crate) fn len(&self) -> usize {
        self.levels.len()
    }

    /// Bytes that it takes.
    pub(crate) fn bytes(&self) -> usize {
        self.texels.bytes()
    }

    /// Level `i`, the finest first, of the image whose own level is `base`.
    pub(crate) fn level<'a>(&'a self, i: usize, base: &Level<'a>) -> Level<'a> {
        let (width, height, offset) = self.levels[i];
        Level { texels: &self.texels, offset, width: width as i32, height: height as i32, ..*base }
    }
}

impl TextureImage {
    /// Bilinear at the two levels whose texels are as wide as the footprint. t = 0 is the top.
    pub(crate) fn trilinear<T: Texel>(&self, st: Vec2, d: [Vec2; 2], mode: [WrapMode; 2]) -> T {
        let size = self.level_0().size();
        let width = 2.0 * (d[0] * size).abs().max((d[1] * size).abs()).max_element();
        let top = self.n_levels() - 1;
        let lod = if width > 1.0 { trig::log2(width) } else { 0.0 };
        if lod >= top as f32 {
            return self.level(top).bilinear(st, mode);
        }
        let fine = lod as usize;
        blend(lod - fine as f32, self.level(fine).bilinear(st, mode), || {
            self.level(fine + 1).bilinear(st, mode)
        })
    }

    /// The weighted mean over the footprint's ellipse, whose axes are at most `max_anisotropy` : 1.
    /// t = 0 is the top.
    pub(crate) fn ewa<T: Texel>(
        &self,
        st: Vec2,
        d: [Vec2; 2],
        max_anisotropy: f32,
        mode: [WrapMode; 2],
    ) -> T {
        // The ellipse's axes in texels, the longer first.
        let size = self.level_0().size();
        let [mut major, mut minor] = d.map(|v| v * size);
        if major.length_squared() < minor.length_squared() {
            std::mem::swap(&mut major, &mut minor);
        }
        let (longer, mut shorter) = (major.length(), minor.length());
        if shorter == 0.0 {
            return self.level_0().bilinear(st, mode);
        }

        // A thin ellipse is made thicker, so that its texels can be counted.
        if shorter * max_anisotropy < longer {
            let scale = longer / (shorter * max_anisotropy);
            minor *= scale;
            shorter *= scale;
        }

        // At the level where the shorter axis is between one and two texels.
        let top = self.n_levels() - 1;
        let lod = trig::log2(shorter).max(0.0);
        let Some(pyramid) = self.pyramid().filter(|_| lod < top as f32) else {
            return self.level(top).bilinear(st, mode);
        };
        let fine = lod as usize;
        let axes = [major / size, minor / size];
        let at = |i: usize| self.level(i).ellipse(st, axes, &pyramid.weights, mode);
        blend(lod - fine as f32, at(fine), || at(fine + 1))
    }
}

impl Level<'_> {
    /// The Gaussian mean over the ellipse with the axes `axes` (in (s, t)), widened by a texel.
    fn ellipse<T: Texel>(
        &self,
        st: Vec2,
        axes: [Vec2; 2],
        weights: &[f32; WEIGHTS],
        mode: [WrapMode; 2],
    ) -> T {
        let center = st * self.size() - 0.5;
        let [p, q] = axes.map(|v| v * self.size());

        // A x² + B x y + C y² < 1 inside.
        let (a, b, c) =
            (p.y * p.y + q.y * q.y + 1.0, -2.0 * (p.x * p.y + q.x * q.y), p.x * p.x + q.x * q.x + 1.0);
        let f = 1.0 / (a * c - 0.25 * b * b);
        let (a, b, c) = (a * f, b * f, c * f);

        // Its bounding box: where the derivative along the other axis vanishes.
        let det = 4.0 * a * c - b * b;
        let half = Vec2::new((det * c).max(0.0).sqrt(), (det * a).max(0.0).sqrt()) * (2.0 / det);
        let (lo, hi) = ((center - half).ceil(), (center + half).floor());

        let (mut sum, mut total) = (T::ZERO, 0.0);
        for y in lo.y as i32..=hi.y as i32 {
            let v = y as f32 - center.y;
            for x in lo.x as i32..=hi.x as i32 {
                let u = x as f32 - center.x;
                let r2 = a * u * u + b * u * v + c * v * v;
                if r2 < 1.0 {
                    let weight = weights[((r2 * WEIGHTS as f32) as usize).min(WEIGHTS - 1)];
                    sum = sum + self.texel::<T>(x, y, mode) * weight;
                    total += weight;
                }
            }
        }
        if total > 0.0 { sum * (1.0 / total) } else { self.bilinear(st, mode) }
    }
}

/// `a (1 − t) + b t`, without `b` where it does not count.
fn blend<T: Texel>(t: f32, a: T, b: impl FnOnce() -> T) -> T {
    if t > 0.0 { a * (1.0 - t) + b() * t } else { a }
}

/// Halves each of `rows` rows of `n` items of `stride` samples by exact areas: with `n` odd, the cells of the result
/// are a little wider than two.
fn halve(data: &[f32], [n, stride]: [usize; 2], rows: usize) -> Vec<f32> {
    let m = (n / 2).max(1);
    let mut out = Vec::with_capacity(rows * m * stride);
    for row in data.chunks_exact(n * stride) {
        for i in 0..m {
            // The cell covers [i n/m, (i+1) n/m) of the row; in units of 1/m: [i n, (i+1) n).
            let (from, to) = (i * n, (i + 1) * n);
            for s in 0..stride {
                let sum: f32 = (from / m..to.div_ceil(m))
                    .map(|j| {
                        let overlap = to.min((j + 1) * m) - from.max(j * m);
                        overlap as f32 * row[j * stride + s]
                    })
                    .sum();
                out.push(sum / n as f32);
            }
        }
    }
    out
}

/// The code whose value is nearest to `x`; `curve` must not fall.
fn encode(curve: &[f32; 256], x: f32) -> u8 {
    let above = curve.partition_point(|&c| c < x).min(255);
    let below = above.saturating_sub(1);
    let code = if x - curve[below] < curve[above] - x { below } else { above };
    code as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use math::hash;
    use spectrum::ColorSpace;

    /// White noise, reproducible.
    fn noise(w: u32, h: u32) -> TextureImage {
        let data: Vec<f32> = (0..w * h).map(|i| hash::unit_f32(hash::mix32(i))).collect();
        let mut image = TextureImage::new([w, h], 1, Texels::Floats(Arc::from(data)), ColorSpace::Srgb);
        image.build_pyramid();
        image
    }

    fn mean(level: &Level<'_>) -> f32 {
        let texels = (0..level.height).flat_map(|y| (0..level.width).map(move |x| (x, y)));
        let sum: f32 = texels.map(|(x, y)| level.texel::<f32>(x, y, [WrapMode::Clamp; 2])).sum();
        sum / (level.width * level.height) as f32
    }

    #[test]
    fn every_level_has_the_mean_of_the_image_also_at_odd_sizes() {
        for (w, h) in [(16, 16), (13, 7), (1, 9), (31, 2)] {
            let image = noise(w, h);
            let whole = mean(&image.level_0());
            for i in 0..image.n_levels() {
                assert!((mean(&image.level(i)) - whole).abs() < 1e-5, "{w}×{h} level {i}");
            }
            let top = image.level(image.n_levels() - 1);
            assert_eq!((top.width, top.height), (1, 1));
        }
    }

    #[test]
    fn bytes_stay_bytes_and_lose_at_most_half_a_code() {
        let curve: Arc<[f32; 256]> = Arc::new(std::array::from_fn(|i| (i as f32 / 255.0).powi(2)));
        assert!((0..=255_u8).all(|i| encode(&curve, curve[usize::from(i)]) == i));
        let data: Arc<[u8]> = vec![10, 200, 30, 40].into();
        let mut image =
            TextureImage::new([2, 2], 1, Texels::Bytes { data, curve: Arc::clone(&curve) }, ColorSpace::Srgb);
        image.build_pyramid();
        let exact = [10, 200, 30, 40].iter().map(|&i: &usize| curve[i]).sum::<f32>() / 4.0;
        let stored = image.level(1).texel::<f32>(0, 0, [WrapMode::Clamp; 2]);
        assert!((stored - exact).abs() <= 0.5 * (curve[105] - curve[104]) + 1e-6, "{stored} {exact}");
    }

    /// The Gaussian mean over the ellipse, by many bilinear lookups of the image itself.
    fn brute_force(image: &TextureImage, st: Vec2, [p, q]: [Vec2; 2]) -> f32 {
        let n = 200;
        let (mut sum, mut total) = (0.0, 0.0);
        for i in 0..n * n {
            let a = (Vec2::new((i % n) as f32, (i / n) as f32) + 0.5) / n as f32 * 2.0 - 1.0;
            let r2 = a.length_squared();
            if r2 < 1.0 {
                let weight = trig::exp(-2.0 * r2) - trig::exp(-2.0);
                sum +=
                    weight * image.level_0().bilinear::<f32>(st + p * a.x + q * a.y, [WrapMode::Repeat; 2]);
                total += weight;
            }
        }
        sum / total
    }

    #[test]
    fn the_ellipse_gives_the_gaussian_mean_in_its_own_direction() {
        // Waves along (1, 1): a long axis along them keeps them, one across them wipes them out.
        let wave = |i: u32| {
            let phase = ((i % 256) as f32 + (i / 256) as f32) / 256.0 * 4.0;
            trig::sin(2.0 * std::f32::consts::PI * phase)
        };
        let data: Vec<f32> = (0..256 * 256).map(wave).collect();
        let mut image = TextureImage::new([256, 256], 1, Texels::Floats(Arc::from(data)), ColorSpace::Srgb);
        image.build_pyramid();
        let st = Vec2::splat(0.5 + 1.0 / 32.0);
        let (long, short) = (0.15, 0.012);
        let along = [Vec2::new(long, -long), Vec2::new(short, short)];
        let across = [Vec2::new(long, long), Vec2::new(-short, short)];
        for (axes, around) in [(along, 0.9), (across, 0.0)] {
            let brute = brute_force(&image, st, axes);
            let ewa: f32 = image.ewa(st, axes, 16.0, [WrapMode::Repeat; 2]);
            assert!((brute - around).abs() < 0.12, "{brute}");
            assert!((ewa - brute).abs() < 0.06, "{ewa} against {brute}");
        }
    }

    #[test]
    fn on_the_image_itself_the_ellipse_is_the_weighted_sum_over_its_texels() {
        let image = noise(64, 64);
        let st = Vec2::new(0.371, 0.614);
        let axes = [Vec2::new(4.0, 3.0) / 64.0, Vec2::new(-0.3, 0.4) / 64.0];
        // r² of the quadratic form (M Mᵀ + 1)⁻¹ with the axes as the columns of M.
        let (p, q) = (axes[0] * 64.0, axes[1] * 64.0);
        let (xx, xy, yy) = (p.x * p.x + q.x * q.x + 1.0, p.x * p.y + q.x * q.y, p.y * p.y + q.y * q.y + 1.0);
        let det = xx * yy - xy * xy;
        let (mut sum, mut total) = (0.0, 0.0);
        for i in 0..64 * 64 {
            let d = Vec2::new((i % 64) as f32 + 0.5, (i / 64) as f32 + 0.5) - st * 64.0;
            let r2 = (yy * d.x * d.x - 2.0 * xy * d.x * d.y + xx * d.y * d.y) / det;
            if r2 < 1.0 {
                let weight = trig::exp(-2.0 * r2) - trig::exp(-2.0);
                sum += weight * image.texel_scalar(i % 64, i / 64);
                total += weight;
            }
        }
        let ewa: f32 = image.ewa(st, axes, 16.0, [WrapMode::Repeat; 2]);
        assert!((ewa - sum / total).abs() < 2e-3, "{ewa} against {}", sum / total);
    }

    #[test]
    fn a_smooth_image_is_the_same_through_every_filter() {
        let data: Vec<f32> = (0..64 * 64).map(|i| (i % 64) as f32 / 64.0).collect();
        let mut image = TextureImage::new([64, 64], 1, Texels::Floats(Arc::from(data)), ColorSpace::Srgb);
        image.build_pyramid();
        let (st, d) = (Vec2::new(0.5, 0.5), [Vec2::new(0.05, 0.0), Vec2::new(0.01, 0.03)]);
        let exact: f32 = image.level_0().bilinear(st, [WrapMode::Clamp; 2]);
        assert!((image.trilinear::<f32>(st, d, [WrapMode::Clamp; 2]) - exact).abs() < 0.01);
        assert!((image.ewa::<f32>(st, d, 8.0, [WrapMode::Clamp; 2]) - exact).abs() < 0.01);
    }

    #[test]
    fn without_a_footprint_filters_are_bilinear_and_with_a_huge_one_the_mean() {
        let image = noise(32, 16);
        let st = Vec2::new(0.3, 0.8);
        let sharp: f32 = image.level_0().bilinear(st, [WrapMode::Repeat; 2]);
        assert_eq!(image.trilinear::<f32>(st, [Vec2::ZERO; 2], [WrapMode::Repeat; 2]), sharp);
        assert_eq!(image.ewa::<f32>(st, [Vec2::ZERO; 2], 8.0, [WrapMode::Repeat; 2]), sharp);
        let whole = mean(&image.level_0());
        for d in
            [[Vec2::X * 50.0, Vec2::Y * 70.0], [Vec2::splat(f32::INFINITY); 2], [Vec2::splat(f32::NAN); 2]]
        {
            assert!(
                (image.trilinear::<f32>(st, d, [WrapMode::Repeat; 2]) - whole).abs() < 1e-5 || d[0].is_nan()
            );
            assert!(image.ewa::<f32>(st, d, 8.0, [WrapMode::Repeat; 2]).is_finite());
        }
        assert!(
            (image.ewa::<f32>(st, [Vec2::X * 50.0, Vec2::Y * 70.0], 8.0, [WrapMode::Repeat; 2]) - whole)
                .abs()
                < 1e-5
        );
    }
}
