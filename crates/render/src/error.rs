//! What can go wrong with a render.

use std::path::PathBuf;

use integrators::parameters::ParameterError;

/// Why a render was not done, or its picture not saved.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No threads.
    #[error("cannot start {n} threads: {message}")]
    Threads {
        /// How many were asked for.
        n: usize,
        /// What the system says.
        message: String,
    },
    /// The film.
    #[error(transparent)]
    Film(#[from] film::Error),
    /// The integrator's name or one of its parameters.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A file that shall be written cannot be.
    #[error("cannot write {}: {reason}", path.display())]
    Output {
        /// Which file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// A checkpoint that does not fit.
    #[error("{} cannot be resumed: {reason}", path.display())]
    Resume {
        /// Which file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
}

impl Error {
    /// Is it about what was given (a name, a setting, a file to go on from), not about the machine?
    #[must_use]
    pub fn is_input(&self) -> bool {
        match self {
            Self::Parameter(_) | Self::Resume { .. } => true,
            Self::Film(e) => !matches!(e, film::Error::Io { .. }),
            Self::Threads { .. } | Self::Output { .. } => false,
        }
    }
}
