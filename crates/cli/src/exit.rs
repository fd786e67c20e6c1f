//! How a command ends: 0 done, 1 failed, 2 bad usage or bad input, 130 interrupted.

use crate::messages;
use std::fmt::Display;

/// How a command that did its work ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Status {
    /// As it should.
    Done,
    /// It says no: a difference above a threshold.
    No,
    /// A person stopped it; what there was is saved.
    Interrupted,
}

/// Why a command did not do its work.
#[derive(Debug)]
pub(crate) enum Failure {
    /// What was given cannot be used.
    Input(anyhow::Error),
    /// The same, and all was said.
    InputSaid,
    /// Something else went wrong.
    Failed(anyhow::Error),
}

/// What a command returns.
pub(crate) type Done = Result<Status, Failure>;

impl Failure {
    /// The person's input cannot be used.
    pub(crate) fn input(message: impl Display) -> Self {
        Self::Input(anyhow::anyhow!("{message}"))
    }

    /// Something went wrong that is not the person's doing.
    pub(crate) fn failed(message: impl Display) -> Self {
        Self::Failed(anyhow::anyhow!("{message}"))
    }
}

impl From<render::Error> for Failure {
    fn from(e: render::Error) -> Self {
        if e.is_input() { Self::Input(e.into()) } else { Self::Failed(e.into()) }
    }
}

/// Says what went wrong, if that was not said, and gives the exit status.
pub(crate) fn code(done: Done) -> u8 {
    match done {
        Ok(Status::Done) => 0,
        Ok(Status::No) => 1,
        Ok(Status::Interrupted) => 130,
        Err(Failure::InputSaid) => 2,
        Err(Failure::Input(e)) => {
            messages::error(&render::sentence(e.as_ref()));
            2
        }
        Err(Failure::Failed(e)) => {
            messages::error(&render::sentence(e.as_ref()));
            1
        }
    }
}
