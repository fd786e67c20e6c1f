//! PNG, JPEG, TGA and BMP, by the `image` crate: integers of 8 or 16 bits, kept as they are.

use std::io::Cursor;

use codecs::{DynamicImage, ImageDecoder, ImageEncoder, ImageFormat, ImageReader, Limits};
use rayon::prelude::*;

use super::{Expansion, Format};
use crate::{ChannelLayout, Display, Image, ImageError, PixelBuffer, PixelData};

pub(super) fn decode(bytes: &[u8], format: Format) -> Result<PixelBuffer, ImageError> {
    // The header's claims first.
    let reader = ImageReader::with_format(Cursor::new(bytes), library_format(format));
    let mut decoder = reader.into_decoder().map_err(|e| format.malformed(e))?;
    let (width, height) = decoder.dimensions();
    let most = Expansion { file_len: bytes.len() as u64, factor: expansion(format) };
    format.check_size([width.into(), height.into()], decoder.color_type().bytes_per_pixel().into(), most)?;
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(decoder.total_bytes().saturating_mul(3) + (64 << 20));
    decoder.set_limits(limits).map_err(|e| format.malformed(e))?;

    let image = DynamicImage::from_decoder(decoder).map_err(|e| format.malformed(e))?;
    let (width, height) = (image.width() as usize, image.height() as usize);
    #[allow(
        clippy::wildcard_enum_match_arm,
        reason = "a foreign enum that may grow; these formats have no floats"
    )]
    let (layout, data) = match image {
        DynamicImage::ImageLuma8(b) => (ChannelLayout::L, PixelData::U8(b.into_raw())),
        DynamicImage::ImageLumaA8(b) => (ChannelLayout::La, PixelData::U8(b.into_raw())),
        DynamicImage::ImageRgb8(b) => (ChannelLayout::Rgb, PixelData::U8(b.into_raw())),
        DynamicImage::ImageRgba8(b) => (ChannelLayout::Rgba, PixelData::U8(b.into_raw())),
        DynamicImage::ImageLuma16(b) => (ChannelLayout::L, PixelData::U16(b.into_raw())),
        DynamicImage::ImageLumaA16(b) => (ChannelLayout::La, PixelData::U16(b.into_raw())),
        DynamicImage::ImageRgb16(b) => (ChannelLayout::Rgb, PixelData::U16(b.into_raw())),
        DynamicImage::ImageRgba16(b) => (ChannelLayout::Rgba, PixelData::U16(b.into_raw())),
        other => (ChannelLayout::Rgba, PixelData::U16(other.into_rgba16().into_raw())),
    };
    PixelBuffer::new(width, height, layout, data)
}

pub(super) fn encode_png(rgb: &Image, display: Display) -> Result<Vec<u8>, ImageError> {
    let failed = |e: &dyn std::error::Error| ImageError::Encode { format: "PNG", reason: e.to_string() };
    let width = u32::try_from(rgb.width()).map_err(|e| failed(&e))?;
    let height = u32::try_from(rgb.height()).map_err(|e| failed(&e))?;
    let mut pixels = vec![0; rgb.data().len()];
    // A row of at least one pixel, whatever the image.
    let row = 3 * rgb.width().max(1);
    pixels.par_chunks_mut(row).zip(rgb.data().par_chunks(row)).for_each(|(to, from)| {
        let (to, _) = to.as_chunks_mut::<3>();
        let (from, _) = from.as_chunks::<3>();
        to.iter_mut().zip(from).for_each(|(to, from)| *to = display.srgb_u8(*from));
    });
    let mut bytes = Vec::new();
    codecs::codecs::png::PngEncoder::new(&mut bytes)
        .write_image(&pixels, width, height, codecs::ExtendedColorType::Rgb8)
        .map_err(|e| failed(&e))?;
    Ok(bytes)
}

const fn library_format(format: Format) -> ImageFormat {
    match format {
        Format::Png => ImageFormat::Png,
        Format::Jpeg => ImageFormat::Jpeg,
        Format::Tga => ImageFormat::Tga,
        Format::Bmp => ImageFormat::Bmp,
        Format::Hdr => ImageFormat::Hdr,
        Format::Exr => ImageFormat::OpenExr,
        Format::Pfm | Format::Raw => ImageFormat::Pnm,
    }
}

/// The most bytes of pixels from a byte of file.
const fn expansion(format: Format) -> u64 {
    match format {
        // Deflate does 1032; a palette of one bit makes 32 bits of one.
        Format::Png => 1032 * 32,
        // Progressive files say many blocks at once.
        Format::Jpeg => 4096,
        // A packet of 128 pixels in two bytes at least, which a palette makes 4 bytes each.
        Format::Tga => 256,
        // Runs of 255 pixels in two bytes, and jumps over what stays blank.
        Format::Bmp => 4096,
        Format::Hdr | Format::Exr | Format::Pfm | Format::Raw => 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::decode as decode_any;

    fn png(color: codecs::ExtendedColorType, width: u32, height: u32, pixels: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        codecs::codecs::png::PngEncoder::new(&mut bytes).write_image(pixels, width, height, color).unwrap();
        bytes
    }

    #[test]
    fn png_of_every_depth_keeps_its_integers() {
        use codecs::ExtendedColorType as C;
        for (color, layout, n) in [
            (C::L8, ChannelLayout::L, 1),
            (C::La8, ChannelLayout::La, 2),
            (C::Rgb8, ChannelLayout::Rgb, 3),
            (C::Rgba8, ChannelLayout::Rgba, 4),
        ] {
            let pixels: Vec<u8> = (0..6 * n).map(|i| (i * 37) as u8).collect();
            let b = decode_any(&png(color, 3, 2, &pixels), None).unwrap();
            assert_eq!((b.layout(), b.data()), (layout, &PixelData::U8(pixels)));
        }
        let words: Vec<u16> = (0..18).map(|i| i * 3000).collect();
        let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_ne_bytes()).collect();
        let b = decode_any(&png(C::Rgb16, 3, 2, &bytes), None).unwrap();
        assert_eq!((b.layout(), b.data()), (ChannelLayout::Rgb, &PixelData::U16(words)));
    }

    #[test]
    fn a_written_png_is_the_displays_bytes() {
        let names = ["R", "G", "B"].map(str::to_owned).to_vec();
        let image = Image::from_data(2, 1, names, vec![0.0, 0.5, 1.0, 2.0, -1.0, f32::NAN]).unwrap();
        let b = decode_any(&encode_png(&image, Display::default()).unwrap(), None).unwrap();
        assert_eq!(b.data(), &PixelData::U8(vec![0, 188, 255, 255, 0, 0]));
    }

    #[test]
    fn a_header_that_claims_too_much_is_refused_before_allocation() {
        // The largest size a PNG header can state; the check sums are right.
        let mut bytes = png(codecs::ExtendedColorType::Rgb8, 1, 1, &[1, 2, 3]);
        bytes[16..24].copy_from_slice(&[0x00, 0x01, 0x00, 0x00, 0x00, 0x00, 0x20, 0x00]);
        let mut crc = flate2::Crc::new();
        crc.update(&bytes[12..29]);
        bytes[29..33].copy_from_slice(&crc.sum().to_be_bytes());
        let e = decode_any(&bytes, None).unwrap_err().to_string();
        assert!(e.contains("65536 x 8192") && e.contains("2^28"), "{e}");
    }
}
