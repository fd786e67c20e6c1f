//! The watch: the thread that renders nothing, and looks at the clock, the person and the checkpoint.

use std::sync::{MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::Error;
use crate::events::{Event, Progress, Urgency};
use crate::run::{Control, RunReport, Shared, State};
use crate::stop::Stop;

/// How often it looks.
const TICK: Duration = Duration::from_millis(50);
/// How often it tells.
const TELL: Duration = Duration::from_millis(100);

pub(crate) struct Watch<'a, 'c> {
    shared: &'a Shared<'a>,
    control: Control<'c>,
    /// How many passes there will be, if that is known.
    of_passes: Option<u32>,
    limit: Option<Duration>,
    /// Passes without which the run does not end, unless it must.
    at_least: u32,
    start: Instant,
    told: Option<Instant>,
    saved: Instant,
    /// The last look; none before the first.
    shown: Option<Instant>,
    /// How long the last look took.
    look_took: Duration,
    warned: Vec<String>,
    cancelled: Urgency,
}

impl<'a, 'c> Watch<'a, 'c> {
    pub(crate) fn new(shared: &'a Shared<'a>, stop: &Stop, control: Control<'c>) -> Self {
        let n = shared.list.len();
        let (of_passes, limit) = match stop {
            Stop::Passes(_) => (Some(n), None),
            Stop::Time(limit) => (None, Some(*limit)),
        };
        let at_least = u32::from(shared.film.passes().is_empty());
        let start = Instant::now();
        let cancelled = Urgency::None;
        Self {
            shared,
            control,
            of_passes,
            limit,
            at_least,
            start,
            told: None,
            saved: start,
            shown: None,
            look_took: Duration::ZERO,
            warned: Vec::new(),
            cancelled,
        }
    }

    /// Looks and tells until all is done.
    pub(crate) fn until_done(mut self) -> Result<RunReport, Error> {
        let mut state = self.shared.lock();
        self.look(&mut state);
        while !state.is_over() {
            let wait = self.limit.map_or(TICK, |limit| limit.saturating_sub(self.start.elapsed()).min(TICK));
            let wait = wait.max(Duration::from_millis(1));
            state = self.shared.news.wait_timeout(state, wait).unwrap_or_else(PoisonError::into_inner).0;
            self.look(&mut state);
            state = self.warn(state);
            if self.is_time_to_tell() {
                let progress = self.progress(&state);
                drop(state);
                (self.control.on_event)(Event::Progress(&progress));
                state = self.shared.lock();
            }
            let (save, show) = (self.is_time_to_save(), self.is_time_to_show(state.schedule.folded()));
            if (save || show) && !state.is_over() {
                state = self.pause(state, |watch| {
                    if show {
                        watch.show();
                    }
                    if save {
                        watch.save();
                    }
                });
            }
        }
        state = self.warn(state);
        self.end(state)
    }

    /// Tells what workers have to say, everything once.
    fn warn(&mut self, mut state: MutexGuard<'a, State>) -> MutexGuard<'a, State> {
        if state.warnings.is_empty() {
            return state;
        }
        let warnings = std::mem::take(&mut state.warnings);
        drop(state);
        for warning in warnings {
            if !self.warned.contains(&warning) {
                (self.control.on_event)(Event::Warning(&warning));
                self.warned.push(warning);
            }
        }
        self.shared.lock()
    }

    /// Has the person or the clock something to say?
    fn look(&mut self, state: &mut State) {
        let urgency = self.control.cancel.urgency();
        if urgency > self.cancelled {
            match urgency {
                Urgency::None => {}
                Urgency::Soon => state.schedule.stop(self.at_least),
                Urgency::Now => state.schedule.abort(),
            }
            self.cancelled = urgency;
            self.shared.work.notify_all();
        }
        if self.limit.is_some_and(|limit| self.start.elapsed() >= limit) {
            state.schedule.stop(self.at_least);
            self.limit = None;
            self.of_passes = Some(state.schedule.end());
            self.shared.work.notify_all();
        }
    }

    fn is_time_to_tell(&mut self) -> bool {
        let now = Instant::now();
        let due = self.told.is_none_or(|told| now - told >= TELL);
        if due {
            self.told = Some(now);
        }
        due
    }

    fn progress(&self, state: &State) -> Progress {
        let elapsed = self.start.elapsed();
        let so_far = state.schedule.passes_so_far();
        let fraction = match (self.limit, self.of_passes) {
            (Some(limit), _) => elapsed.as_secs_f64() / limit.as_secs_f64().max(1e-9),
            (None, Some(n)) => so_far / f64::from(n.max(1)),
            (None, None) => 0.0,
        };
        let fraction = fraction.clamp(0.0, 1.0);
        let remaining = match self.limit {
            Some(limit) => Some(limit.saturating_sub(elapsed)),
            None if fraction > 0.0 => {
                Duration::try_from_secs_f64(elapsed.as_secs_f64() * (1.0 - fraction) / fraction).ok()
            }
            None => None,
        };
        let of_passes = self.of_passes;
        let (passes, counters) = (state.schedule.folded(), state.schedule.counters_so_far());
        Progress { passes, of_passes, fraction, elapsed, remaining, counters }
    }

    fn is_time_to_save(&self) -> bool {
        self.control.checkpoint.as_ref().is_some_and(|c| self.saved.elapsed() >= c.every)
    }

    /// The first pass is shown at once. Looks take no more than a tenth of the time, however large the film is.
    fn is_time_to_show(&self, passes: u32) -> bool {
        let due = |every: Duration| match self.shown {
            None => passes > 0,
            Some(shown) => shown.elapsed() >= every.max(9 * self.look_took),
        };
        self.control.viewer.as_ref().is_some_and(|v| due(v.every))
    }

    /// Waits until the film holds whole passes only, looks at it while the workers go on with cells, and lets them fold again.
    fn pause(
        &mut self,
        mut state: MutexGuard<'a, State>,
        look: impl FnOnce(&mut Self),
    ) -> MutexGuard<'a, State> {
        while !state.schedule.hold() && !state.is_over() {
            state = self.shared.news.wait_timeout(state, TICK).unwrap_or_else(PoisonError::into_inner).0;
        }
        drop(state);
        if !self.shared.film.passes().is_empty() {
            look(self);
        }
        let mut state = self.shared.lock();
        state.schedule.release();
        self.shared.work.notify_all();
        state
    }

    fn save(&mut self) {
        if let Some(checkpoint) = &mut self.control.checkpoint {
            let passes = self.shared.film.passes().len();
            match (checkpoint.save)(self.shared.film) {
                Ok(()) => (self.control.on_event)(Event::Checkpoint { path: checkpoint.path, passes }),
                Err(e) => (self.control.on_event)(Event::Warning(&format!("{e}; the render goes on"))),
            }
        }
        self.saved = Instant::now();
    }

    fn show(&mut self) {
        let start = Instant::now();
        if let Some(viewer) = &mut self.control.viewer {
            (viewer.show)(self.shared.film);
        }
        self.shown = Some(Instant::now());
        self.look_took = start.elapsed();
    }

    fn end(self, mut state: MutexGuard<'_, State>) -> Result<RunReport, Error> {
        if let Some(e) = state.error.take() {
            return Err(e.into());
        }
        let n = state.schedule.folded();
        let cut_short = self.cancelled > Urgency::None && self.of_passes.is_none_or(|of| n < of);
        Ok(RunReport {
            passes: n,
            elapsed: self.start.elapsed(),
            counters: state.schedule.counters(),
            cancelled: cut_short,
        })
    }
}
