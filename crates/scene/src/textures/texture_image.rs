//! An image as textures and lights look it up: compact samples, decoded through a table, wrapped and interpolated.
//!
//! Bytes stay bytes and halves halves; everything else is linear `f32`. Row 0 is the image's top; textures, whose t runs upwards,
//! flip it before they come here. Wrapping and what a single number of a colour image is are pbrt-v4's: alpha
//! where there is alpha that is not 1 everywhere, the mean of R, G and B otherwise. As in pbrt-v4 the curve of bytes
//! counts for all channels, alpha included.

use std::ops::{Add, Mul};
use std::sync::Arc;

use image::f16;
use math::{Vec2, Vec3};
use scene_desc::WrapMode;
use spectrum::ColorSpace;

use super::pyramid::Pyramid;

/// The samples of one or more levels of an image, channels interleaved.
#[derive(Clone, Debug)]
pub(crate) enum Texels {
    /// Codes, and what each of them means.
    Bytes {
        /// Shared by all images of one file.
        data: Arc<[u8]>,
        /// Code to linear value.
        curve: Arc<[f32; 256]>,
    },
    /// Linear values.
    Halves(Arc<[f16]>),
    /// Linear values.
    Floats(Arc<[f32]>),
}

impl Texels {
    /// The linear value of a sample.
    #[inline]
    pub(crate) fn get(&self, i: usize) -> f32 {
        match self {
            Self::Bytes { data, curve } => curve[usize::from(data[i])],
            Self::Halves(data) => data[i].to_f32(),
            Self::Floats(data) => data[i],
        }
    }

    /// Bytes that the samples take.
    pub(crate) fn bytes(&self) -> usize {
        match self {
            Self::Bytes { data, .. } => data.len(),
            Self::Halves(data) => data.len() * 2,
            Self::Floats(data) => data.len() * 4,
        }
    }
}

/// How a single number is read from a texel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scalar {
    /// There is only one.
    First,
    /// Mean of R, G and B.
    MeanRgb,
    /// The last channel.
    Alpha,
}

/// A decoded image.
#[derive(Clone, Debug)]
pub struct TextureImage {
    width: u32,
    height: u32,
    channels: usize,
    scalar: Scalar,
    space: ColorSpace,
    base: Texels,
    pyramid: Option<Pyramid>,
}

/// One level, ready to be looked up.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Level<'a> {
    pub(crate) texels: &'a Texels,
    /// Index of its first sample.
    pub(crate) offset: usize,
    pub(crate) width: i32,
    pub(crate) height: i32,
    pub(crate) channels: usize,
    pub(crate) scalar: Scalar,
}

/// What a lookup gives: a number or R, G and B.
pub(crate) trait Texel: Copy + Add<Output = Self> + Mul<f32, Output = Self> {
    /// Black.
    const ZERO: Self;
    /// The texel whose first sample is `i`.
    fn fetch(level: &Level<'_>, i: usize) -> Self;
}

impl Texel for f32 {
    const ZERO: Self = 0.0;

    #[inline]
    fn fetch(level: &Level<'_>, i: usize) -> Self {
        match level.scalar {
            Scalar::First => level.texels.get(i),
            Scalar::MeanRgb => {
                (level.texels.get(i) + level.texels.get(i + 1) + level.texels.get(i + 2)) * (1.0 / 3.0)
            }
            Scalar::Alpha => level.texels.get(i + level.channels - 1),
        }
    }
}

impl Texel for Vec3 {
    const ZERO: Self = Self::ZERO;

    #[inline]
    fn fetch(level: &Level<'_>, i: usize) -> Self {
        if level.channels < 3 {
            return Self::splat(level.texels.get(i));
        }
        // One branch and one bounds check for all three.
        match level.texels {
            Texels::Bytes { data, curve } => {
                let p = &data[i..i + 3];
                Self::new(curve[usize::from(p[0])], curve[usize::from(p[1])], curve[usize::from(p[2])])
            }
            Texels::Halves(data) => {
                let p = &data[i..i + 3];
                Self::new(p[0].to_f32(), p[1].to_f32(), p[2].to_f32())
            }
            Texels::Floats(data) => {
                let p = &data[i..i + 3];
                Self::new(p[0], p[1], p[2])
            }
        }
    }
}

impl TextureImage {
    /// Texels of 1 (grey), 3 (colour) or 4 (colour and alpha) channels, top row first.
    pub(crate) fn new(size: [u32; 2], channels: usize, base: Texels, space: ColorSpace) -> Self {
        let scalar = match channels {
            3 => Scalar::MeanRgb,
            4 => Scalar::Alpha,
            _ => Scalar::First,
        };
        Self { width: size[0], height: size[1], channels, scalar, space, base, pyramid: None }
    }

    /// Of linear values, for tests.
    #[cfg(test)]
    pub(crate) fn of_floats(size: [u32; 2], channels: usize, data: &[f32]) -> Self {
        Self::new(size, channels, Texels::Floats(Arc::from(data)), ColorSpace::Srgb)
    }

    /// Adds the coarser levels, if they are not there yet.
    pub(crate) fn build_pyramid(&mut self) {
        if self.pyramid.is_none() {
            self.pyramid = Some(Pyramid::new(&self.level_0()));
        }
    }

    /// In texels.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// In texels.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The primaries of its R, G and B.
    #[must_use]
    pub fn color_space(&self) -> ColorSpace {
        self.space
    }

    /// Has it a colour, or is it grey?
    #[must_use]
    pub fn is_colored(&self) -> bool {
        self.channels >= 3
    }

    /// Linear R, G and B of a texel in the image's own primaries; row 0 is the top. Panics outside the image.
    #[must_use]
    pub fn texel_rgb(&self, x: u32, y: u32) -> [f32; 3] {
        self.texel::<Vec3>(x, y).to_array()
    }

    /// The single number of a texel: alpha, grey, or the mean of R, G and B. Panics outside the image.
    #[must_use]
    pub fn texel_scalar(&self, x: u32, y: u32) -> f32 {
        self.texel(x, y)
    }

    /// R, G and B between the texels around (s, t); t = 0 is the top.
    #[must_use]
    pub fn bilinear_rgb(&self, st: Vec2, wrap: [WrapMode; 2]) -> [f32; 3] {
        self.level_0().bilinear::<Vec3>(st, wrap).to_array()
    }

    /// Bytes that it takes, the coarser levels included.
    #[must_use]
    pub fn memory(&self) -> usize {
        self.base.bytes() + self.pyramid.as_ref().map_or(0, Pyramid::bytes)
    }

    /// Are the texels held in common?
    #[cfg(test)]
    pub(crate) fn shares_texels_with(&self, other: &Self) -> bool {
        match (&self.base, &other.base) {
            (Texels::Bytes { data: a, .. }, Texels::Bytes { data: b, .. }) => Arc::ptr_eq(a, b),
            (Texels::Bytes { .. } | Texels::Halves(_) | Texels::Floats(_), _) => false,
        }
    }

    /// The image itself.
    pub(crate) fn level_0(&self) -> Level<'_> {
        Level {
            texels: &self.base,
            offset: 0,
            width: self.width as i32,
            height: self.height as i32,
            channels: self.channels,
            scalar: self.scalar,
        }
    }

    /// Level `i`, of which there are [`Self::n_levels`].
    pub(crate) fn level(&self, i: usize) -> Level<'_> {
        match &self.pyramid {
            Some(pyramid) if i > 0 => pyramid.level(i - 1, &self.level_0()),
            Some(_) | None => self.level_0(),
        }
    }

    /// 1, or with a pyramid as many as it takes to get to a single texel.
    pub(crate) fn n_levels(&self) -> usize {
        1 + self.pyramid.as_ref().map_or(0, Pyramid::len)
    }

    /// The coarser levels.
    pub(crate) fn pyramid(&self) -> Option<&Pyramid> {
        self.pyramid.as_ref()
    }

    fn texel<T: Texel>(&self, x: u32, y: u32) -> T {
        assert!(x < self.width && y < self.height, "texel ({x}, {y}) of {}×{}", self.width, self.height);
        self.level_0().texel(x as i32, y as i32, [WrapMode::Clamp; 2])
    }
}

impl Level<'_> {
    /// The texel at (x, y), which may lie outside.
    #[inline]
    pub(crate) fn texel<T: Texel>(&self, x: i32, y: i32, mode: [WrapMode; 2]) -> T {
        self.at(wrap(x, self.width, mode[0]), wrap(y, self.height, mode[1]))
    }

    /// The texel at a place inside; black where there is none.
    #[inline]
    fn at<T: Texel>(&self, x: Option<i32>, y: Option<i32>) -> T {
        match (x, y) {
            (Some(x), Some(y)) => {
                let index = y as usize * self.width as usize + x as usize;
                T::fetch(self, self.offset + index * self.channels)
            }
            (Some(_) | None, _) => T::ZERO,
        }
    }

    /// The texel that (s, t) falls in; t = 0 is the top.
    pub(crate) fn nearest<T: Texel>(&self, st: Vec2, mode: [WrapMode; 2]) -> T {
        let p = (st * self.size()).floor();
        self.texel(p.x as i32, p.y as i32, mode)
    }

    /// Between the four texels around (s, t); t = 0 is the top.
    #[inline]
    pub(crate) fn bilinear<T: Texel>(&self, st: Vec2, mode: [WrapMode; 2]) -> T {
        let p = st * self.size() - 0.5;
        let corner = p.floor();
        let d = p - corner;
        let (x, y) = (corner.x as i32, corner.y as i32);
        let columns = [x, x.wrapping_add(1)].map(|x| wrap(x, self.width, mode[0]));
        let rows = [y, y.wrapping_add(1)].map(|y| wrap(y, self.height, mode[1]));
        let row = |y: Option<i32>| {
            let [a, b] = columns.map(|x| self.at::<T>(x, y));
            a * (1.0 - d.x) + b * d.x
        };
        row(rows[0]) * (1.0 - d.y) + row(rows[1]) * d.y
    }

    /// In texels.
    #[inline]
    pub(crate) fn size(&self) -> Vec2 {
        Vec2::new(self.width as f32, self.height as f32)
    }
}

/// The index within `0..n` that `i` stands for; `None` is black.
#[inline]
fn wrap(i: i32, n: i32, mode: WrapMode) -> Option<i32> {
    if (0..n).contains(&i) {
        return Some(i);
    }
    match mode {
        WrapMode::Repeat => Some(i.rem_euclid(n)),
        WrapMode::Mirror => {
            let i = i64::from(i).rem_euclid(2 * i64::from(n)) as i32;
            Some(if i < n { i } else { 2 * n - 1 - i })
        }
        WrapMode::Clamp => Some(i.clamp(0, n - 1)),
        WrapMode::Black => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Black, red / green, white as bytes; the curve is linear.
    fn four() -> TextureImage {
        let curve = Arc::new(std::array::from_fn(|i| i as f32 / 255.0));
        let data = Arc::from(vec![0, 0, 0, 255, 0, 0, 0, 255, 0, 255, 255, 255]);
        TextureImage::new([2, 2], 3, Texels::Bytes { data, curve }, ColorSpace::Srgb)
    }

    fn floats(size: [u32; 2], channels: usize, data: Vec<f32>) -> TextureImage {
        TextureImage::of_floats(size, channels, &data)
    }

    #[test]
    fn row_zero_is_the_top() {
        let image = four();
        assert_eq!(image.texel_rgb(1, 0), [1.0, 0.0, 0.0]);
        assert_eq!(image.texel_rgb(0, 1), [0.0, 1.0, 0.0]);
        assert_eq!(image.level_0().nearest::<Vec3>(Vec2::new(0.9, 0.1), [WrapMode::Repeat; 2]), Vec3::X);
    }

    #[test]
    fn texel_centres_are_exact_and_the_middle_is_the_mean() {
        let image = four();
        assert_eq!(image.bilinear_rgb(Vec2::new(0.25, 0.75), [WrapMode::Clamp; 2]), [0.0, 1.0, 0.0]);
        assert_eq!(image.bilinear_rgb(Vec2::splat(0.5), [WrapMode::Clamp; 2]), [0.5, 0.5, 0.25]);
    }

    #[test]
    fn borders_wrap_as_asked() {
        let row = floats([4, 1], 1, vec![1.0, 2.0, 3.0, 4.0]);
        let at = |mode| [-5, -2, -1, 4, 5, 9].map(|x| row.level_0().texel::<f32>(x, 0, mode));
        assert_eq!(at([WrapMode::Repeat; 2]), [4.0, 3.0, 4.0, 1.0, 2.0, 2.0]);
        assert_eq!(at([WrapMode::Mirror; 2]), [4.0, 2.0, 1.0, 4.0, 3.0, 2.0]);
        assert_eq!(at([WrapMode::Clamp; 2]), [1.0, 1.0, 1.0, 4.0, 4.0, 4.0]);
        assert_eq!(at([WrapMode::Black; 2]), [0.0; 6]);
    }

    #[test]
    fn senseless_coordinates_do_no_harm() {
        for mode in [[WrapMode::Repeat; 2], [WrapMode::Mirror; 2], [WrapMode::Clamp; 2], [WrapMode::Black; 2]]
        {
            for s in [f32::INFINITY, f32::NEG_INFINITY, 1e30, -1e30] {
                let _ = four().level_0().nearest::<Vec3>(Vec2::splat(s), mode);
                let _ = four().bilinear_rgb(Vec2::splat(s), mode);
            }
        }
    }

    #[test]
    fn one_number_of_a_colour_is_its_alpha_or_its_mean() {
        let opaque = floats([1, 2], 3, vec![0.1, 0.2, 0.6, 0.0, 0.0, 0.0]);
        assert!((opaque.texel_scalar(0, 0) - 0.3).abs() < 1e-6);
        let cut_out = floats([1, 2], 4, vec![0.1, 0.2, 0.6, 0.25, 0.0, 0.0, 0.0, 1.0]);
        assert_eq!(cut_out.texel_scalar(0, 0), 0.25);
        let grey = floats([1, 1], 1, vec![0.5]);
        assert_eq!((grey.texel_scalar(0, 0), grey.texel_rgb(0, 0)), (0.5, [0.5; 3]));
    }
}
