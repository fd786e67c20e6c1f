//! Checkpoints: the film on disk every so often, so that no accident costs more than an interval.
//!
//! A checkpoint is a partial film: whole passes, exact. As every pass is a pure function of its number, nothing else has to be
//! kept, and a resumed render has the bits of an uninterrupted one.

use std::path::{Path, PathBuf};
use std::time::Duration;

use film::Film;

use crate::Error;

/// Where and how often.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Checkpoint {
    /// The file.
    pub path: PathBuf,
    /// How often it is written.
    pub every: Duration,
    /// Go on from it, if it is there?
    pub resume: bool,
}

impl Checkpoint {
    /// The film to go on from; `None` to begin anew. A file that is no checkpoint is never overwritten.
    ///
    /// # Errors
    /// There is a file that is not a film, is damaged, or cannot be read.
    pub fn begin(&self) -> Result<Option<Film>, Error> {
        // A killed render may have left half a file beside it.
        Film::remove_leftovers(&self.path);
        if !self.path.exists() {
            return Ok(None);
        }
        match Film::load(&self.path) {
            Ok(film) if self.resume => Ok(Some(film)),
            Ok(_) => Ok(None),
            Err(e) if self.resume => Err(self.refused(&e)),
            // What was a checkpoint once may be replaced, even if it is damaged.
            Err(film::Error::File { source, .. }) if matches!(*source, film::Error::Checksum) => Ok(None),
            Err(e) => Err(Error::Output {
                path: self.path.clone(),
                reason: format!("there is a file that is no checkpoint ({})", innermost(&e)),
            }),
        }
    }

    /// Takes over what the file had.
    pub(crate) fn refused(&self, e: &film::Error) -> Error {
        Error::Resume { path: self.path.clone(), reason: innermost(e) }
    }
}

/// Writes a film as a partial file, whole or not at all.
///
/// # Errors
/// Why not; then an old file is as it was.
pub fn save_film(film: &Film, path: &Path) -> Result<(), Error> {
    film.save(path).map_err(|e| Error::Output { path: path.to_owned(), reason: innermost(&e) })
}

/// What is wrong, without the path, which is said already.
fn innermost(e: &film::Error) -> String {
    let mut innermost: &dyn std::error::Error = e;
    while let Some(source) = innermost.source() {
        innermost = source;
    }
    innermost.to_string()
}
