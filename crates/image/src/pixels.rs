//! Pixels as their file stored them, for textures: small, and turned into light on access.

use spectrum::TransferFunction;

use crate::{Image, ImageError, f16};

/// Which channels, in which order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChannelLayout {
    /// Grey.
    L,
    /// Grey and alpha.
    La,
    /// Colour.
    Rgb,
    /// Colour and alpha.
    Rgba,
}

impl ChannelLayout {
    /// How many.
    #[must_use]
    pub const fn count(self) -> usize {
        match self {
            Self::L => 1,
            Self::La => 2,
            Self::Rgb => 3,
            Self::Rgba => 4,
        }
    }

    /// Position of alpha.
    #[must_use]
    pub const fn alpha(self) -> Option<usize> {
        match self {
            Self::L | Self::Rgb => None,
            Self::La => Some(1),
            Self::Rgba => Some(3),
        }
    }

    const fn names(self) -> &'static [&'static str] {
        match self {
            Self::L => &["Y"],
            Self::La => &["Y", "A"],
            Self::Rgb => &["R", "G", "B"],
            Self::Rgba => &["R", "G", "B", "A"],
        }
    }
}

/// Stored values.
#[derive(Clone, Debug, PartialEq)]
pub enum PixelData {
    /// In 255ths.
    U8(Vec<u8>),
    /// In 65535ths.
    U16(Vec<u16>),
    /// Half floats.
    F16(Vec<f16>),
    /// Floats.
    F32(Vec<f32>),
}

impl PixelData {
    fn len(&self) -> usize {
        match self {
            Self::U8(v) => v.len(),
            Self::U16(v) => v.len(),
            Self::F16(v) => v.len(),
            Self::F32(v) => v.len(),
        }
    }
}

/// A picture from a file, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelBuffer {
    width: usize,
    height: usize,
    layout: ChannelLayout,
    data: PixelData,
    transfer: TransferFunction,
}

impl PixelBuffer {
    /// From stored values. Integers are sRGB and floats linear; see [`PixelBuffer::with_transfer`].
    ///
    /// # Errors
    /// [`ImageError::Shape`] when their number is not width × height × channels, or there are none.
    pub fn new(
        width: usize,
        height: usize,
        layout: ChannelLayout,
        data: PixelData,
    ) -> Result<Self, ImageError> {
        let expected = width.checked_mul(height).and_then(|n| n.checked_mul(layout.count()));
        if expected != Some(data.len()) || data.len() == 0 {
            return Err(ImageError::Shape { width, height, channels: layout.count(), values: data.len() });
        }
        let transfer = match data {
            PixelData::U8(_) | PixelData::U16(_) => TransferFunction::Srgb,
            PixelData::F16(_) | PixelData::F32(_) => TransferFunction::Linear,
        };
        Ok(Self { width, height, layout, data, transfer })
    }

    /// The same values in another meaning. Floats stay linear whatever is asked for.
    #[must_use]
    pub fn with_transfer(mut self, transfer: TransferFunction) -> Self {
        if !self.is_float() {
            self.transfer = transfer;
        }
        self
    }

    /// In pixels.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// In pixels.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }

    /// Which channels.
    #[must_use]
    pub fn layout(&self) -> ChannelLayout {
        self.layout
    }

    /// How stored values become light.
    #[must_use]
    pub fn transfer(&self) -> TransferFunction {
        self.transfer
    }

    /// The stored values.
    #[must_use]
    pub fn data(&self) -> &PixelData {
        &self.data
    }

    /// Stored as floats, thus able to exceed one?
    #[must_use]
    pub fn is_float(&self) -> bool {
        matches!(self.data, PixelData::F16(_) | PixelData::F32(_))
    }

    /// Memory of the stored values in bytes.
    #[must_use]
    pub fn byte_len(&self) -> usize {
        match &self.data {
            PixelData::U8(v) => v.len(),
            PixelData::U16(v) => 2 * v.len(),
            PixelData::F16(v) => 2 * v.len(),
            PixelData::F32(v) => 4 * v.len(),
        }
    }

    /// A channel of a pixel, which must be inside: linear light, or alpha as stored.
    #[must_use]
    pub fn channel(&self, x: usize, y: usize, channel: usize) -> f32 {
        debug_assert!(x < self.width && y < self.height && channel < self.layout.count());
        let at = (y * self.width + x) * self.layout.count() + channel;
        let transfer =
            if self.layout.alpha() == Some(channel) { TransferFunction::Linear } else { self.transfer };
        match &self.data {
            PixelData::U8(v) => transfer.decode_u8(v[at]),
            PixelData::U16(v) => transfer.decode(f32::from(v[at]) / 65_535.0),
            PixelData::F16(v) => v[at].to_f32(),
            PixelData::F32(v) => v[at],
        }
    }

    /// Linear colour of a pixel, which must be inside.
    #[must_use]
    pub fn rgb(&self, x: usize, y: usize) -> [f32; 3] {
        match self.layout {
            ChannelLayout::L | ChannelLayout::La => [self.channel(x, y, 0); 3],
            ChannelLayout::Rgb | ChannelLayout::Rgba => [0, 1, 2].map(|c| self.channel(x, y, c)),
        }
    }

    /// Alpha of a pixel, which must be inside; one where there is none.
    #[must_use]
    pub fn alpha(&self, x: usize, y: usize) -> f32 {
        self.layout.alpha().map_or(1.0, |c| self.channel(x, y, c))
    }

    /// Linear floats, channels Y or R, G, B, and A.
    #[must_use]
    pub fn to_image(&self) -> Image {
        let mut image = Image::new(self.width, self.height, self.layout.names());
        for y in 0..self.height {
            for x in 0..self.width {
                for (c, value) in image.pixel_mut(x, y).iter_mut().enumerate() {
                    *value = self.channel(x, y, c);
                }
            }
        }
        image
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_are_srgb_unless_told_and_alpha_never_is() {
        let b = PixelBuffer::new(1, 1, ChannelLayout::La, PixelData::U8(vec![128, 128])).unwrap();
        assert!((b.rgb(0, 0)[1] - 0.215_860_5).abs() < 1e-6);
        assert!((b.alpha(0, 0) - 128.0 / 255.0).abs() < 1e-7);
        let b = b.with_transfer(TransferFunction::Linear);
        assert!((b.rgb(0, 0)[0] - 128.0 / 255.0).abs() < 1e-7);
        let b = PixelBuffer::new(1, 1, ChannelLayout::L, PixelData::U16(vec![65_535])).unwrap();
        assert!((b.rgb(0, 0)[2] - 1.0).abs() < 1e-6);
        assert_eq!(b.alpha(0, 0), 1.0);
    }

    #[test]
    fn floats_are_linear_and_stay_so() {
        let half = PixelData::F16(vec![f16::from_f32(7.5); 3]);
        let b =
            PixelBuffer::new(1, 1, ChannelLayout::Rgb, half).unwrap().with_transfer(TransferFunction::Srgb);
        assert_eq!(b.rgb(0, 0), [7.5; 3]);
        assert_eq!((b.byte_len(), b.is_float()), (6, true));
        assert_eq!(b.to_image().data(), [7.5; 3]);
    }

    #[test]
    fn a_wrong_number_of_values_is_refused() {
        assert!(PixelBuffer::new(2, 2, ChannelLayout::Rgb, PixelData::U8(vec![0; 11])).is_err());
        assert!(PixelBuffer::new(0, 2, ChannelLayout::Rgb, PixelData::U8(vec![])).is_err());
    }
}
