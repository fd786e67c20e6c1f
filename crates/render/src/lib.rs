//! Renders: cells on many threads, stop rules, checkpoints, events; and the way from a scene file to pictures.

mod cells;
mod error;
mod events;
mod run;
mod schedule;
mod stop;
mod watch;
mod workers;

pub use cells::{TILE_SIDE, of_pass};
pub use error::Error;
pub use events::{Cancel, Event, Progress, Urgency};
pub use run::{Checkpointer, Control, Passes, RunReport, run};
pub use stop::Stop;
pub use workers::Workers;
