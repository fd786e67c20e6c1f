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
    /// A film that does not fit into memory.
    #[error(
        "a film of {width} x {height} pixels needs {:.1} GiB of memory, and {:.1} GiB are free: \
         take a lower resolution, or render crops",
        gib(*needed), gib(*available)
    )]
    Memory {
        /// Columns of the crop.
        width: usize,
        /// Rows of the crop.
        height: usize,
        /// In bytes.
        needed: u64,
        /// In bytes.
        available: u64,
    },
    /// A pixel to be replayed that no sample of the film begins in.
    #[error("pixel {},{} lies outside of the film of {width} x {height} pixels", at[0], at[1])]
    Pixel {
        /// Column and row.
        at: [i32; 2],
        /// Columns of the film.
        width: u32,
        /// Rows of the film.
        height: u32,
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

/// An error's message with its causes, without saying twice what a message already has from its cause: what a person reads, on
/// the command line as in Python.
#[must_use]
pub fn sentence(error: &(dyn std::error::Error + 'static)) -> String {
    let mut text = error.to_string();
    for cause in std::iter::successors(error.source(), |e| e.source()) {
        let cause = cause.to_string();
        if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}

fn gib(bytes: u64) -> f64 {
    bytes as f64 / (1_u64 << 30) as f64
}

impl Error {
    /// Is it about what was given (a name, a setting, a file to go on from), not about the machine?
    #[must_use]
    pub fn is_input(&self) -> bool {
        match self {
            Self::Parameter(_) | Self::Resume { .. } | Self::Memory { .. } | Self::Pixel { .. } => true,
            Self::Film(e) => !matches!(e, film::Error::Io { .. }),
            Self::Threads { .. } | Self::Output { .. } => false,
        }
    }
}
