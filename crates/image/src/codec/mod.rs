//! Image files: told apart by content, then by ending.
//!
//! No input makes these functions panic or allocate far more than the input can hold. What a format has and we leave out:
//! EXIF orientation, colour profiles and gamma notes, animation, deep EXR data, chroma-subsampled EXR (its luminance
//! alone is read).

mod common;
mod exr_read;
mod exr_write;
mod hdr;
mod pfm;
mod raw;

use std::path::Path;

use crate::{Display, Image, ImageError, PixelBuffer, write_atomically};

pub use raw::encode_pixels;

/// The most pixels an image may have: 2²⁸, a square of 16384.
pub const MAX_PIXELS: u64 = 1 << 28;

/// A kind of image file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Portable Network Graphics.
    Png,
    /// JPEG.
    Jpeg,
    /// Truevision TGA.
    Tga,
    /// Windows bitmap.
    Bmp,
    /// Radiance RGBE.
    Hdr,
    /// OpenEXR.
    Exr,
    /// Portable float map.
    Pfm,
    /// Decoded pixels, as they travel with a packed scene.
    Raw,
}

impl Format {
    /// By the first bytes. TGA has no mark at its beginning, only newer ones at their end.
    #[must_use]
    pub fn of_content(bytes: &[u8]) -> Option<Self> {
        let starts = |magic: &[u8]| bytes.starts_with(magic);
        if starts(b"\x89PNG\r\n\x1a\n") {
            Some(Self::Png)
        } else if starts(b"\xff\xd8\xff") {
            Some(Self::Jpeg)
        } else if starts(b"\x76\x2f\x31\x01") {
            Some(Self::Exr)
        } else if starts(b"#?RADIANCE") || starts(b"#?RGBE") {
            Some(Self::Hdr)
        } else if pfm::is_pfm(bytes) {
            Some(Self::Pfm)
        } else if raw::is_raw(bytes) {
            Some(Self::Raw)
        } else if starts(b"BM") {
            Some(Self::Bmp)
        } else if bytes.ends_with(b"TRUEVISION-XFILE.\0") {
            Some(Self::Tga)
        } else {
            None
        }
    }

    /// By a file's ending.
    #[must_use]
    pub fn of_path(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?.to_ascii_lowercase();
        Some(match ending.as_str() {
            "png" => Self::Png,
            "jpg" | "jpeg" => Self::Jpeg,
            "tga" => Self::Tga,
            "bmp" => Self::Bmp,
            "hdr" | "pic" | "rgbe" => Self::Hdr,
            "exr" => Self::Exr,
            "pfm" => Self::Pfm,
            _ => return None,
        })
    }

    /// For messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
            Self::Tga => "TGA",
            Self::Bmp => "BMP",
            Self::Hdr => "HDR",
            Self::Exr => "EXR",
            Self::Pfm => "PFM",
            Self::Raw => "packed",
        }
    }

    pub(crate) fn malformed(self, reason: impl ToString) -> ImageError {
        ImageError::Malformed { format: self.name(), reason: reason.to_string() }
    }

    /// Refuses sizes that no memory should be spent on: `bytes_per_pixel` times the pixels must not be more than
    /// `expansion` times the file, which is the most that the format's compression can do.
    pub(crate) fn check_size(
        self,
        size: [u64; 2],
        bytes_per_pixel: u64,
        most: Expansion,
    ) -> Result<(), ImageError> {
        let [width, height] = size;
        let refuse = |reason| Err(ImageError::TooLarge { format: self.name(), width, height, reason });
        if width == 0 || height == 0 {
            return refuse("it is empty");
        }
        if width.checked_mul(height).is_none_or(|n| n > MAX_PIXELS) {
            return refuse("more than 2^28 pixels are not supported");
        }
        let needed = u128::from(width * height) * u128::from(bytes_per_pixel);
        if needed > u128::from(most.file_len) * u128::from(most.factor) + 65_536 {
            return refuse("the file is too short for that");
        }
        Ok(())
    }
}

/// How much larger than its file an image can be.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Expansion {
    pub(crate) file_len: u64,
    pub(crate) factor: u64,
}

/// How an image is written where the format leaves a choice.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SaveOptions {
    /// For formats of display values (PNG); formats of light ignore it.
    pub display: Display,
}

/// The pixels of a file as it stores them; of an EXR file, its main colour channels. `name` helps when the content
/// does not say what it is.
///
/// # Errors
/// When it is no image, broken, or absurdly large.
pub fn decode(bytes: &[u8], name: Option<&Path>) -> Result<PixelBuffer, ImageError> {
    match format_of(bytes, name)? {
        Format::Exr => exr_read::decode_pixels(bytes),
        Format::Pfm => pfm::decode(bytes),
        Format::Hdr => hdr::decode(bytes),
        Format::Raw => raw::decode(bytes),
        format @ (Format::Png | Format::Jpeg | Format::Tga | Format::Bmp) => common::decode(bytes, format),
    }
}

/// A file as linear floats; of an EXR file, all channels by their names, and its notes.
///
/// # Errors
/// When it is no image, broken, or absurdly large.
pub fn decode_image(bytes: &[u8], name: Option<&Path>) -> Result<Image, ImageError> {
    match format_of(bytes, name)? {
        Format::Exr => exr_read::decode_image(bytes),
        Format::Png | Format::Jpeg | Format::Tga | Format::Bmp | Format::Hdr | Format::Pfm | Format::Raw => {
            decode(bytes, name).map(|b| b.to_image())
        }
    }
}

/// [`decode`] of a file.
///
/// # Errors
/// When it cannot be read, or see [`decode`].
pub fn load(path: &Path) -> Result<PixelBuffer, ImageError> {
    decode(&read(path)?, Some(path)).map_err(|e| in_file(path, e))
}

/// [`decode_image`] of a file.
///
/// # Errors
/// When it cannot be read, or see [`decode_image`].
pub fn load_image(path: &Path) -> Result<Image, ImageError> {
    decode_image(&read(path)?, Some(path)).map_err(|e| in_file(path, e))
}

/// The bytes of a file, the same for the same image. EXR keeps all channels and notes; the others R, G and B (or Y).
///
/// # Errors
/// When the format cannot be written or cannot hold the image.
pub fn encode(image: &Image, format: Format, options: &SaveOptions) -> Result<Vec<u8>, ImageError> {
    match format {
        Format::Exr => exr_write::encode(image),
        Format::Png => common::encode_png(&image.to_rgb()?, options.display),
        Format::Hdr => hdr::encode(&image.to_rgb()?),
        Format::Pfm => pfm::encode(&image.to_rgb()?),
        Format::Jpeg | Format::Tga | Format::Bmp | Format::Raw => Err(ImageError::Encode {
            format: format.name(),
            reason: "only EXR, PNG, HDR and PFM are written".into(),
        }),
    }
}

/// Writes a file in the format of its ending, whole or not at all.
///
/// # Errors
/// When the ending is unknown, the image does not fit the format, or the file cannot be written.
pub fn save(path: &Path, image: &Image, options: &SaveOptions) -> Result<(), ImageError> {
    let unknown = || ImageError::UnknownEnding(path.display().to_string());
    let format = Format::of_path(path).ok_or_else(unknown)?;
    write_atomically(path, &encode(image, format, options)?)
}

fn format_of(bytes: &[u8], name: Option<&Path>) -> Result<Format, ImageError> {
    Format::of_content(bytes).or_else(|| name.and_then(Format::of_path)).ok_or(ImageError::UnknownFormat)
}

fn read(path: &Path) -> Result<Vec<u8>, ImageError> {
    std::fs::read(path).map_err(|source| ImageError::Io { action: "cannot read", path: path.into(), source })
}

fn in_file(path: &Path, source: ImageError) -> ImageError {
    ImageError::InFile { path: path.into(), source: Box::new(source) }
}
