//! Ctrl-C: before rendering the program ends at once; while rendering it stops with what it has; twice, it stops now.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use render::{Cancel, Urgency};

use crate::exit::Failure;
use crate::messages;

/// What the signal handler shares with the render.
pub(crate) struct Interrupt {
    /// For the render.
    pub(crate) cancel: Cancel,
    is_rendering: Arc<AtomicBool>,
}

impl Interrupt {
    /// Takes over Ctrl-C and the polite request to end.
    pub(crate) fn install() -> Result<Self, Failure> {
        let (cancel, is_rendering) = (Cancel::default(), Arc::new(AtomicBool::new(false)));
        let (theirs, rendering) = (cancel.clone(), is_rendering.clone());
        ctrlc::set_handler(move || {
            let urgent = theirs.urgency() == Urgency::Now;
            if urgent || !rendering.load(Ordering::Relaxed) {
                messages::note("interrupted; nothing was rendered");
                std::process::exit(130);
            }
            theirs.cancel();
        })
        .map_err(|e| Failure::failed(format!("cannot listen to Ctrl-C: {e}")))?;
        Ok(Self { cancel, is_rendering })
    }

    /// From now on Ctrl-C stops the render, not the program.
    pub(crate) fn rendering(&self) {
        self.is_rendering.store(true, Ordering::Relaxed);
    }
}
