//! What a render tells while it runs, handed to Python; and Ctrl-C, handed to the render.

use image::{Display, Format, Image, SaveOptions, ToneMap};
use lab::comparison::Step;
use math::Bounds2i;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use render::{Cancel, Event, Progress};

use crate::film::Film;

/// Between a render and Python: hears events on the thread that called, some ten times a second.
pub(crate) struct Listener {
    /// Called with a dict for each event; `None`: nobody listens.
    listener: Option<Py<PyAny>>,
    cancel: Cancel,
    /// What a callback raised: the render stops, and it goes on in Python.
    raised: Option<PyErr>,
    /// Was it Ctrl-C?
    interrupted: bool,
}

impl Listener {
    pub(crate) fn new(listener: Option<Py<PyAny>>, cancel: Cancel) -> Self {
        Self { listener, cancel, raised: None, interrupted: false }
    }

    /// Hands an event over, and looks whether somebody pressed Ctrl-C. Takes the interpreter's lock.
    pub(crate) fn on(&mut self, event: Event<'_>) {
        self.tell(|py| dict(py, event));
    }

    /// The film while it is rendered, as a film of its own.
    pub(crate) fn on_film(&mut self, film: &film::Film) {
        let copy = film::Film::new(film.settings().clone()).and_then(|mut copy| {
            copy.merge(film)?;
            Ok(copy)
        });
        // Without memory for a second film there is nothing to look at.
        let Ok(copy) = copy else { return };
        self.tell(|py| {
            let d = PyDict::new(py);
            d.set_item("event", "film")?;
            d.set_item("film", Py::new(py, Film::new(copy))?)?;
            Ok(Some(d))
        });
    }

    /// The sketch of the picture of these pixels, before there is a film.
    pub(crate) fn on_sketch(&mut self, sketch: &Image, crop: Bounds2i) {
        let display = Display { tone_map: ToneMap::Filmic, ..Display::default() };
        let Ok(png) = image::encode(sketch, Format::Png, &SaveOptions { display }) else { return };
        self.tell(|py| {
            let d = PyDict::new(py);
            d.set_item("event", "sketch")?;
            d.set_item("png", PyBytes::new(py, &png))?;
            d.set_item("size", (crop.width(), crop.height()))?;
            Ok(Some(d))
        });
    }

    /// A step of a comparison, or an event within it.
    pub(crate) fn on_step(&mut self, step: Step<'_>) {
        match step {
            Step::Reference => self.tell(|py| dict_of_step(py, "reference", 0, 0)),
            Step::Trial { label, number, of } => self.tell(|py| dict_of_step(py, label, number, of)),
            Step::Event(event) => self.on(event),
        }
    }

    /// The pilot of a method begins.
    pub(crate) fn on_pilot(&mut self, label: &str) {
        self.on_step(Step::Trial { label, number: 0, of: 0 });
    }

    /// Hands over what `make` makes. The lock is taken, and Ctrl-C looked for, in any case.
    pub(crate) fn tell<'e>(
        &mut self,
        make: impl for<'py> FnOnce(Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> + 'e,
    ) {
        let told = Python::attach(|py| {
            py.check_signals()?;
            if let (Some(listener), Some(event)) = (&self.listener, make(py)?) {
                // `True` asks the render to stop with what it has.
                let answer = listener.bind(py).call1((event,))?;
                if answer.is_truthy()? {
                    self.cancel.cancel();
                }
            }
            Ok(())
        });
        if let Err(e) = told {
            self.stop(e);
        }
    }

    fn stop(&mut self, e: PyErr) {
        self.cancel.cancel();
        let is_interrupt = Python::attach(|py| e.is_instance_of::<pyo3::exceptions::PyKeyboardInterrupt>(py));
        if is_interrupt {
            self.interrupted = true;
        } else {
            // The first one counts; nothing more is told.
            self.listener = None;
            self.raised = self.raised.take().or(Some(e));
        }
    }

    /// What a callback raised.
    pub(crate) fn end(self) -> Result<bool, PyErr> {
        match self.raised {
            Some(e) => Err(e),
            None => Ok(self.interrupted),
        }
    }
}

/// An event as Python sees it.
fn dict<'py>(py: Python<'py>, event: Event<'_>) -> PyResult<Option<Bound<'py, PyDict>>> {
    let d = PyDict::new(py);
    match event {
        Event::Progress(p) => progress(&d, p)?,
        Event::Checkpoint { path, passes } => {
            d.set_item("event", "checkpoint")?;
            d.set_item("path", path)?;
            d.set_item("passes", passes)?;
        }
        Event::Warning(text) => {
            d.set_item("event", "warning")?;
            d.set_item("message", text)?;
        }
        _ => return Ok(None),
    }
    Ok(Some(d))
}

fn dict_of_step<'py>(
    py: Python<'py>,
    label: &str,
    number: usize,
    of: usize,
) -> PyResult<Option<Bound<'py, PyDict>>> {
    let d = PyDict::new(py);
    d.set_item("event", "step")?;
    d.set_item("label", label)?;
    d.set_item("number", number)?;
    d.set_item("of", of)?;
    Ok(Some(d))
}

fn progress(d: &Bound<'_, PyDict>, p: &Progress) -> PyResult<()> {
    d.set_item("event", "progress")?;
    d.set_item("passes", p.passes)?;
    d.set_item("of_passes", p.of_passes)?;
    d.set_item("fraction", p.fraction)?;
    d.set_item("elapsed_seconds", p.elapsed.as_secs_f64())?;
    d.set_item("remaining_seconds", p.remaining.map(|t| t.as_secs_f64()))?;
    d.set_item("rays", p.counters.rays)?;
    d.set_item("camera_paths", p.counters.camera_paths)?;
    d.set_item("light_paths", p.counters.light_paths)
}
