//! Bytes of files, plain or gzip, with limits: what a file claims never decides how much memory is taken.
//!
//! Files are read whole rather than memory-mapped: mapping needs `unsafe` (a file that another program cuts short
//! would crash us), and a copy from the page cache costs a few milliseconds for a million triangles.

use std::fs;
use std::io::Read;
use std::path::Path;

use xxhash_rust::xxh3::xxh3_64;

/// Decompressed bytes that are always allowed.
const INFLATED_FREELY: u64 = 256 << 20;
/// Beyond that, how many times its packed size a file may become.
const INFLATION: u64 = 64;

/// A file's bytes, unpacked, and the hash of what stands on disk.
#[derive(Debug)]
pub(crate) struct Source {
    pub(crate) bytes: Vec<u8>,
    pub(crate) hash: u64,
}

/// Why a file gives no bytes.
#[derive(Debug, thiserror::Error)]
pub(crate) enum SourceError {
    #[error("{0}")]
    Io(#[from] std::io::Error),
    #[error("not a regular file")]
    NotAFile,
    #[error("damaged gzip data: {0}")]
    Gzip(std::io::Error),
    #[error("unpacks to more than {0} bytes, more than {INFLATION} times its size")]
    Inflates(u64),
}

impl SourceError {
    /// Is there no such file?
    pub(crate) fn is_absent(&self) -> bool {
        matches!(self, Self::Io(e) if e.kind() == std::io::ErrorKind::NotFound)
    }

    /// What to do about it.
    pub(crate) fn hint(&self) -> &'static str {
        match self {
            Self::Io(e) if e.kind() == std::io::ErrorKind::NotFound => {
                "paths are relative to the main scene file's folder"
            }
            Self::Io(_) | Self::NotAFile => "is it the right file?",
            Self::Gzip(_) => "the file is truncated or damaged",
            Self::Inflates(_) => "unpack it to see whether it is meant so",
        }
    }
}

/// Reads a file; gzip is seen by its first bytes, whatever the name.
pub(crate) fn read(path: &Path) -> Result<Source, SourceError> {
    if !fs::metadata(path)?.is_file() {
        return Err(SourceError::NotAFile);
    }
    let packed = fs::read(path)?;
    let hash = xxh3_64(&packed);
    if !packed.starts_with(&[0x1f, 0x8b]) {
        return Ok(Source { bytes: packed, hash });
    }
    let limit = INFLATED_FREELY.max(packed.len() as u64 * INFLATION);
    let mut bytes = Vec::new();
    flate2::read::MultiGzDecoder::new(packed.as_slice())
        .take(limit + 1)
        .read_to_end(&mut bytes)
        .map_err(SourceError::Gzip)?;
    if bytes.len() as u64 > limit {
        return Err(SourceError::Inflates(limit));
    }
    Ok(Source { bytes, hash })
}

/// The hash of a file that somebody else will read.
pub(crate) fn hash(path: &Path) -> Result<u64, SourceError> {
    if !fs::metadata(path)?.is_file() {
        return Err(SourceError::NotAFile);
    }
    Ok(hash_of(&fs::read(path)?))
}

/// The hash of bytes.
pub(crate) fn hash_of(bytes: &[u8]) -> u64 {
    xxh3_64(bytes)
}

/// One hash of many, in order.
pub(crate) fn combine(hashes: &[u64]) -> u64 {
    let bytes: Vec<u8> = hashes.iter().flat_map(|h| h.to_le_bytes()).collect();
    xxh3_64(&bytes)
}
