//! What a render tells while it runs: one stream of events, for terminal, Python, page and cluster alike.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::Duration;

use integrators::Counters;

/// Something that happened.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum Event<'a> {
    /// How far it is; some ten times a second.
    Progress(&'a Progress),
    /// A checkpoint was written.
    Checkpoint {
        /// Where.
        path: &'a Path,
        /// Passes in it.
        passes: u64,
    },
    /// Something that the person should know; the render goes on.
    Warning(&'a str),
}

/// How far a render is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Complete passes of this run.
    pub passes: u32,
    /// Passes that this run will have, if that is known.
    pub of_passes: Option<u32>,
    /// Share of the work that is done, in [0, 1].
    pub fraction: f64,
    /// Since the first sample.
    pub elapsed: Duration,
    /// An estimate of what is left.
    pub remaining: Option<Duration>,
    /// What was done so far.
    pub counters: Counters,
}

/// A handle that stops a render from anywhere: a signal handler, another thread, Python.
#[derive(Clone, Debug, Default)]
pub struct Cancel(Arc<AtomicU8>);

/// How urgently.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Urgency {
    /// Go on.
    None,
    /// Stop, but with at least one pass.
    Soon,
    /// Stop, even with nothing.
    Now,
}

impl Cancel {
    /// Asks to stop; asked twice, it means now.
    pub fn cancel(&self) {
        let _ = self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| Some(n.saturating_add(1)));
    }

    /// What was asked for.
    #[must_use]
    pub fn urgency(&self) -> Urgency {
        match self.0.load(Ordering::Relaxed) {
            0 => Urgency::None,
            1 => Urgency::Soon,
            2.. => Urgency::Now,
        }
    }
}
