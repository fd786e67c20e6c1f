//! Image files and measurements that a scene refers to: looked for and hashed, not decoded.

use std::path::Path;

use rayon::prelude::*;
use scene_desc::{ImageDesc, ImageEncoding, Span};

use crate::report::Report;
use crate::source;

/// An encoding that can be compared: the same file with the same encoding is one image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum EncodingKey {
    Auto,
    Srgb,
    Linear,
    Gamma(u32),
}

impl From<ImageEncoding> for EncodingKey {
    fn from(encoding: ImageEncoding) -> Self {
        match encoding {
            ImageEncoding::Auto => Self::Auto,
            ImageEncoding::Srgb => Self::Srgb,
            ImageEncoding::Linear => Self::Linear,
            ImageEncoding::Gamma(g) => Self::Gamma(g.to_bits()),
        }
    }
}

/// Can a file be opened?
pub(crate) fn readable(path: &Path) -> Result<(), String> {
    match std::fs::metadata(path) {
        Ok(m) if m.is_file() => std::fs::File::open(path).map(drop).map_err(|e| e.to_string()),
        Ok(_) => Err("not a regular file".into()),
        Err(e) => Err(e.to_string()),
    }
}

/// The hashes of all images, in order; what cannot be read is reported.
pub(crate) fn hash_images(images: &[ImageDesc], report: &mut Report<'_>) -> Vec<u64> {
    // What is part of another file is in that file's hash.
    let images: Vec<&ImageDesc> = images.iter().filter(|i| i.embedded.is_none()).collect();
    let hashes: Vec<_> = images.par_iter().map(|i| source::hash(&i.path)).collect();
    let mut good = Vec::new();
    for (image, hash) in images.into_iter().zip(hashes) {
        match hash {
            Ok(hash) => good.push(hash),
            Err(e) => {
                report
                    .error(image.span, format!("image {} cannot be read: {e}", image.path.display()))
                    .hint("it was there a moment ago");
            }
        }
    }
    good
}

/// The hash of a measured surface's file; one that cannot be read is reported.
pub(crate) fn hash_measured(path: &Path, span: Span, report: &mut Report<'_>) -> Option<u64> {
    match source::hash(path) {
        Ok(hash) => Some(hash),
        Err(e) => {
            report
                .error(span, format!("measured surface {} cannot be read: {e}", path.display()))
                .hint(e.hint());
            None
        }
    }
}
