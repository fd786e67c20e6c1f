//! What can go wrong with films.

use std::path::PathBuf;

/// Why a film was not made, merged, written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The settings make no sense.
    #[error("{0}")]
    Settings(String),
    /// Not enough memory for so many pixels.
    #[error("a film of {width} x {height} pixels does not fit into memory")]
    TooLarge {
        /// Columns of the crop.
        width: usize,
        /// Rows of the crop.
        height: usize,
    },
    /// Two films are not parts of one render.
    #[error("the films are not of one render: {0}")]
    Mismatch(String),
    /// Some passes are in both films, others only in one.
    #[error("passes {overlap} are already in the film, which has {present}; merge each pass once")]
    Overlap {
        /// What both have.
        overlap: String,
        /// What was there.
        present: String,
    },
    /// A pass was begun twice.
    #[error("pass {0} is already in the film")]
    DuplicatePass(u32),
    /// A pass that has not begun, or has not ended.
    #[error("pass {0} is not complete")]
    OpenPass(u32),
    /// The bytes are not a partial film.
    #[error("not a partial film: {0}")]
    Format(String),
    /// The bytes were changed since they were written.
    #[error("the partial film is damaged: its checksum does not match")]
    Checksum,
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A partial film that could not be read, with its path.
    #[error("{}: {source}", path.display())]
    File {
        /// Which file.
        path: PathBuf,
        /// Why.
        #[source]
        source: Box<Self>,
    },
}
