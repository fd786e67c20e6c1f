//! The progress bar: on a terminal only, on standard error.

use std::io::IsTerminal;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use render::{Cancel, Event, Progress, Urgency};

/// Steps of the bar.
const STEPS: u64 = 1000;

/// A bar, or nothing.
pub(crate) struct Bar {
    bar: ProgressBar,
    cancel: Cancel,
    told: Urgency,
}

impl Bar {
    /// A bar if `wanted` and there is somebody to see it.
    pub(crate) fn new(wanted: bool, cancel: Cancel) -> Self {
        let bar = ProgressBar::new(STEPS);
        if !wanted || !std::io::stderr().is_terminal() {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        let style = ProgressStyle::with_template("{wide_bar:.cyan/blue} {percent:>3} %  {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self { bar, cancel, told: Urgency::None }
    }

    /// Shows an event.
    pub(crate) fn on(&mut self, event: Event<'_>) {
        match event {
            Event::Progress(p) => {
                self.bar.set_position((p.fraction * STEPS as f64) as u64);
                self.bar.set_message(self.message(p));
            }
            Event::Warning(text) => self.bar.suspend(|| crate::messages::warning(text)),
            Event::Checkpoint { .. } | _ => {}
        }
        if self.cancel.urgency() > self.told {
            self.told = self.cancel.urgency();
            self.bar.println("stopping; Ctrl-C again to stop at once");
        }
    }

    /// Removes the bar.
    pub(crate) fn end(&self) {
        self.bar.finish_and_clear();
    }

    fn message(&self, p: &Progress) -> String {
        let passes = match p.of_passes {
            Some(n) => format!("{} of {n} passes", p.passes),
            None => format!("{} passes", p.passes),
        };
        let rate = p.counters.rays as f64 / p.elapsed.as_secs_f64().max(1e-9) * 1e-6;
        let left = p.remaining.map(|t| format!("  {} left", clock(t))).unwrap_or_default();
        format!("{passes}  {rate:.1} Mrays/s{left}")
    }
}

/// A time for people: `12 s`, `3 min 07 s`, `2 h 05 min`.
pub(crate) fn clock(t: Duration) -> String {
    let s = t.as_secs();
    match s {
        0..=59 => format!("{s} s"),
        60..=3599 => format!("{} min {:02} s", s / 60, s % 60),
        3600.. => format!("{} h {:02} min", s / 3600, s / 60 % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_for_people() {
        let read = |s| clock(Duration::from_secs(s));
        assert_eq!([read(12), read(187), read(7500)], ["12 s", "3 min 07 s", "2 h 05 min"]);
    }
}
