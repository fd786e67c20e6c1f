//! What can go wrong with images.

use std::path::PathBuf;

/// Why an image cannot be read, made or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// Neither content nor name says what it is.
    #[error("not an image of a known format (PNG, JPEG, TGA, BMP, HDR, EXR, PFM)")]
    UnknownFormat,
    /// The name's ending is no format that can be written.
    #[error("cannot write an image named {0:?}: the endings .exr, .png, .hdr and .pfm are known")]
    UnknownEnding(String),
    /// The bytes are not what their format asks for.
    #[error("broken {format} image: {reason}")]
    Malformed {
        /// Such as `PNG`.
        format: &'static str,
        /// What was wrong.
        reason: String,
    },
    /// More than we are willing to hold, or than the file can hold.
    #[error("{format} image claims {width} x {height} pixels: {reason}")]
    TooLarge {
        /// Such as `PNG`.
        format: &'static str,
        /// As claimed.
        width: u64,
        /// As claimed.
        height: u64,
        /// Which limit.
        reason: &'static str,
    },
    /// Size, channels and data do not belong together.
    #[error("image of {width} x {height} pixels with {channels} channels cannot have {values} values")]
    Shape {
        /// As given.
        width: usize,
        /// As given.
        height: usize,
        /// As given.
        channels: usize,
        /// As given.
        values: usize,
    },
    /// A rectangle that is not inside the image.
    #[error("crop {crop:?} is not inside an image of {width} x {height} pixels")]
    CropOutside {
        /// x0, y0, x1, y1.
        crop: [i32; 4],
        /// Of the image.
        width: usize,
        /// Of the image.
        height: usize,
    },
    /// No channel of that name.
    #[error("no channel {wanted:?} among {have:?}")]
    NoChannel {
        /// The name.
        wanted: String,
        /// What there is.
        have: Vec<String>,
    },
    /// What the format cannot hold.
    #[error("cannot write {format}: {reason}")]
    Encode {
        /// Such as `PNG`.
        format: &'static str,
        /// What it cannot hold.
        reason: String,
    },
    /// The file system's word.
    #[error("{action} {path:?}")]
    Io {
        /// What was tried.
        action: &'static str,
        /// With which file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// A file whose content is wrong.
    #[error("{path:?}")]
    InFile {
        /// Which file.
        path: PathBuf,
        /// What is wrong in it.
        source: Box<Self>,
    },
}
