//! Renders: cells on many threads, stop rules, checkpoints, events; and the way from a scene file to pictures.
//!
//! ```text
//! open ──► Opened { scene } ──► Job { integrator, film } ──render──► film ──picture──► save_picture
//! ```
//!
//! A command line, Python and a server call the same five functions.

mod bench;
mod bench_scene;
mod cells;
mod checkpoint;
mod error;
mod events;
mod job;
mod memory;
mod open;
mod output;
mod precision;
mod run;
mod schedule;
mod sheet;
mod sketch;
mod stop;
mod watch;
mod workers;

pub use bench::{BenchRays, RayRates};
pub use bench_scene::bench_scene;
pub use cells::{TILE_SIDE, of_pass};
pub use checkpoint::{Checkpoint, save_film};
pub use error::{Error, sentence};
pub use events::{Cancel, Event, Progress, Urgency};
pub use job::{Job, Method, Outcome, Replayed};
pub use open::{Contents, Opened, SCENE_SETTINGS, SceneOptions, compile, load, open, recompile};
pub use output::{VERSION, check_writable, is_picture, picture, save_picture, save_pictures};
pub use precision::Precision;
pub use run::{Checkpointer, Control, Passes, RunReport, Viewer, run};
pub use sheet::{save_sheet, sheet_path, strategy_sheet};
pub use stop::Stop;
pub use workers::Workers;
