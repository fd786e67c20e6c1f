//! `--events FILE`: what happens, one JSON object a line, for whoever builds a monitor. `docs/guide/farms.md` has the fields.

use std::fs::File;
use std::io::Write;
use std::path::Path;

use film::Film;
use render::Event;
use serde_json::{Value, json};

use crate::exit::Failure;
use crate::messages;

/// A file of events, or none.
pub(crate) struct EventLog(Option<File>);

impl EventLog {
    /// Appends to a file, if there shall be one.
    pub(crate) fn open(path: Option<&Path>) -> Result<Self, Failure> {
        let open = |path: &Path| {
            let file = File::options().create(true).append(true).open(path);
            file.map_err(|e| Failure::failed(format!("cannot write {}: {e}", path.display())))
        };
        Ok(Self(path.map(open).transpose()?))
    }

    /// A render begins; the film is still empty, or what it goes on from.
    pub(crate) fn start(&mut self, scene: &Path, film: &Film) {
        let (settings, key) = (film.settings(), &film.settings().key);
        self.write(&json!({
            "event": "start",
            "scene": scene,
            "scene_hash": key.scene,
            "integrator": key.integrator,
            "settings": key.settings,
            "seed": key.seed,
            "resolution": settings.resolution,
        }));
    }

    /// Something happened.
    pub(crate) fn on(&mut self, event: &Event<'_>) {
        let line = match event {
            Event::Progress(p) => json!({
                "event": "progress",
                "passes": p.passes,
                "of_passes": p.of_passes,
                "fraction": p.fraction,
                "elapsed_seconds": p.elapsed.as_secs_f64(),
                "remaining_seconds": p.remaining.map(|t| t.as_secs_f64()),
                "rays": p.counters.rays,
                "camera_paths": p.counters.camera_paths,
                "light_paths": p.counters.light_paths,
            }),
            Event::Checkpoint { path, passes } => {
                json!({ "event": "checkpoint", "path": path, "passes": passes })
            }
            Event::Warning(text) => json!({ "event": "warning", "message": text }),
            _ => return,
        };
        self.write(&line);
    }

    /// A render ends.
    pub(crate) fn end(&mut self, film: &Film, interrupted: bool) {
        self.write(&json!({ "event": "end", "spp": film.passes().len(), "interrupted": interrupted }));
    }

    /// The picture is worth more than its log: after a failure nothing more is written.
    fn write(&mut self, line: &Value) {
        if let Some(file) = &mut self.0
            && let Err(e) = writeln!(file, "{line}")
        {
            messages::warning(&format!("events are no longer written: {e}"));
            self.0 = None;
        }
    }
}
