//! Image files and measurements that a scene refers to: looked for and hashed, not decoded.

use std::path::{Path, PathBuf};

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

/// What stands for the number of a tile in a file's name.
const UDIM: &str = "<UDIM>";
/// The number of the tile at the origin; the next to the right is one more, the next above ten more.
const FIRST_TILE: u32 = 1001;

/// The files of a set of tiles, with the lower left corner of each: none if the name stands for a single file; `None` (and an
/// error) if there is no tile. Gaps in a row are told.
pub(crate) fn tiles(path: &Path, span: Span, report: &mut Report<'_>) -> Option<Vec<([u32; 2], PathBuf)>> {
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let Some((before, after)) = name.split_once(UDIM) else { return Some(Vec::new()) };
    let number = |file: &str| {
        let digits = file.strip_prefix(before)?.strip_suffix(after)?;
        let all_digits = digits.len() == 4 && digits.bytes().all(|b| b.is_ascii_digit());
        digits.parse().ok().filter(|n| all_digits && *n >= FIRST_TILE)
    };
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut found: Vec<(u32, PathBuf)> = std::fs::read_dir(folder)
        .into_iter()
        .flatten()
        .filter_map(|entry| {
            let entry = entry.ok()?;
            Some((number(&entry.file_name().to_string_lossy())?, entry.path()))
        })
        .collect();
    found.sort();
    if found.is_empty() {
        report
            .error(span, format!("there is no tile of {}", path.display()))
            .hint(format!("{UDIM} stands for {FIRST_TILE}, {} and so on", FIRST_TILE + 1));
        return None;
    }
    let is_gap = |n: &u32| !found.iter().any(|(m, _)| m == n);
    let same_row = |a: u32, b: u32| (a - FIRST_TILE) / 10 == (b - FIRST_TILE) / 10;
    let pairs = found.windows(2).filter(|p| same_row(p[0].0, p[1].0));
    let gaps: Vec<String> =
        pairs.flat_map(|p| p[0].0..p[1].0).filter(is_gap).map(|n| n.to_string()).collect();
    if !gaps.is_empty() {
        report
            .warning(span, format!("tiles {} of {} are missing", gaps.join(", "), path.display()))
            .hint("they are black");
    }
    let corner = |n: u32| [(n - FIRST_TILE) % 10, (n - FIRST_TILE) / 10];
    Some(found.into_iter().map(|(n, path)| (corner(n), path)).collect())
}
