//! Rendering: the one call that takes long.

use std::cell::RefCell;
use std::num::NonZero;
use std::path::PathBuf;
use std::time::Duration;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use render::{Cancel, Checkpoint, Event, Job, Method, Outcome, Precision, SCENE_SETTINGS, Stop, Workers};

use crate::errors::{error, of_render};
use crate::film::Film;
use crate::progress::Listener;
use crate::scene::{Options, Scene};

/// What a render shall be, as Python says it.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Request {
    integrator: Option<String>,
    /// Parameters as text, those of the scene among them.
    settings: Vec<(String, String)>,
    seed: Option<u64>,
    threads: Option<usize>,
    resolution: Option<[u32; 2]>,
    crop: Option<[i32; 4]>,
    spectral: bool,
    /// Half-open; `None`: by time, or the scene's own number.
    passes: Option<[u32; 2]>,
    /// In seconds.
    time: Option<f64>,
    /// √relMSE, as `1%` or `0.01`.
    error: Option<String>,
    /// Seconds between looks at the film while it is rendered.
    view_every: Option<f64>,
    checkpoint: Option<PathBuf>,
    /// In seconds.
    checkpoint_every: f64,
    resume: bool,
}

/// When a render is done.
enum Until {
    Stop(Stop),
    Precise(Precision),
}

/// As many threads as asked for.
pub(crate) fn workers(py: Python<'_>, threads: Option<usize>) -> PyResult<Workers> {
    let threads = match threads {
        Some(n) => Some(
            NonZero::new(n).ok_or_else(|| PyValueError::new_err("threads must be a whole number from 1"))?,
        ),
        None => None,
    };
    py.detach(|| Workers::new(threads)).map_err(|e| of_render(py, &e))
}

impl Request {
    /// What decides about compilation.
    pub(crate) fn options(&self) -> Options {
        let is_scenes = |(k, _): &&(String, String)| SCENE_SETTINGS.contains(&k.as_str());
        Options {
            resolution: self.resolution,
            crop: self.crop,
            spectral: self.spectral,
            settings: self.settings.iter().filter(is_scenes).cloned().collect(),
        }
    }

    fn precision(&self) -> PyResult<Option<Precision>> {
        self.error.as_deref().map(str::parse).transpose().map_err(PyValueError::new_err)
    }

    fn stop(&self, scene: &scene::Scene) -> PyResult<Stop> {
        match (self.passes, self.time) {
            (Some([a, b]), _) if a < b => Ok(Stop::Passes(a..b)),
            (Some([a, b]), _) => Err(PyValueError::new_err(format!("passes {a}..{b} are none"))),
            (None, Some(time)) => Ok(Stop::Time(seconds("time", time)?)),
            (None, None) => Ok(Stop::Passes(0..scene.settings().sampler.spp.max(1))),
        }
    }
}

pub(crate) fn seconds(name: &str, value: f64) -> PyResult<Duration> {
    let valid = (value > 0.0).then(|| Duration::try_from_secs_f64(value).ok()).flatten();
    valid.ok_or_else(|| PyValueError::new_err(format!("{name} must be a number of seconds above 0")))
}

impl Request {
    fn method(&self) -> Method {
        Method { integrator: self.integrator.clone(), settings: self.settings.clone(), seed: self.seed }
    }
}

/// What was learned elsewhere is not what this version learns.
fn refused(py: Python<'_>) -> PyErr {
    error(py, "SteradianError", "what was learned elsewhere is of another version, or damaged")
}

/// The rounds of what passes 0 to `n` read, each with its first pass; none if passes know nothing of each other.
#[pyfunction]
pub(crate) fn rounds(py: Python<'_>, scene: &Scene, request: Request, n: u32) -> PyResult<Vec<(u32, u32)>> {
    let opened = scene.compiled(py, &request.options(), request.threads)?;
    let job = Job::new(&opened.scene, &request.method()).map_err(|e| of_render(py, &e))?;
    let mut rounds: Vec<(u32, u32)> = (0..n).filter_map(|pass| Some((job.round(pass)?, pass))).collect();
    rounds.dedup_by_key(|r| r.0);
    Ok(rounds)
}

/// Learns what a pass reads, on from `learned`; gives that as bytes, and the rays that it took.
#[pyfunction]
#[pyo3(signature = (scene, request, pass_, learned=None))]
pub(crate) fn learn<'py>(
    py: Python<'py>,
    scene: &Scene,
    request: Request,
    pass_: u32,
    learned: Option<&[u8]>,
) -> PyResult<(Bound<'py, PyBytes>, u64)> {
    let opened = scene.compiled(py, &request.options(), request.threads)?;
    let workers = workers(py, request.threads)?;
    let learned = py.detach(|| {
        let mut job = Job::new(&opened.scene, &request.method())?;
        let is_taken = learned.is_none_or(|bytes| job.take_learned(bytes));
        Ok(is_taken.then(|| job.learn(pass_, &workers)))
    });
    let (bytes, prepared) = learned.map_err(|e| of_render(py, &e))?.ok_or_else(|| refused(py))?;
    Ok((PyBytes::new(py, &bytes.unwrap_or_default()), prepared.counters.rays))
}

/// Side of the squares of pixels that a sketch has a sample for: a sixty-fourth of a pass.
const SKETCH_STEP: u32 = 8;

/// Renders; `start` is a film to go on from, `learned` what [`learn`] gave for the passes that are rendered. Gives a film and a report; Ctrl-C ends it with what there is.
#[pyfunction(name = "render")]
#[pyo3(signature = (scene, request, start, listener, learned=None))]
pub(crate) fn render_scene<'py>(
    py: Python<'py>,
    scene: &Scene,
    request: Request,
    start: Option<PyRef<'py, Film>>,
    listener: Option<Py<PyAny>>,
    learned: Option<&[u8]>,
) -> PyResult<(Film, Bound<'py, PyDict>)> {
    let began = std::time::Instant::now();
    let opened = scene.compiled(py, &request.options(), request.threads)?;
    let load_seconds = began.elapsed().as_secs_f64();
    let workers = workers(py, request.threads)?;
    let checkpoint = match &request.checkpoint {
        Some(path) => Some(Checkpoint {
            path: path.clone(),
            every: seconds("checkpoint_every", request.checkpoint_every)?,
            resume: request.resume,
        }),
        None => None,
    };
    let method = request.method();

    let until = match request.precision()? {
        Some(precision) => Until::Precise(precision),
        None => Until::Stop(request.stop(&opened.scene)?),
    };
    let view_every = request.view_every.map(|t| seconds("view_every", t)).transpose()?;
    let cancel = Cancel::default();
    let listener = Listener::new(listener, cancel.clone());
    let start = start.map(|film| film.film.clone());
    let (rendered, listener) = py.detach(|| {
        // Views and events are heard by one, on this thread.
        let listener = RefCell::new(listener);
        let job = Job::new(&opened.scene, &method).and_then(|mut job| {
            start.map_or(Ok(()), |film| job.merge(&film))?;
            Ok(job)
        });
        let rendered = job.and_then(|mut job| {
            if !learned.is_none_or(|bytes| job.take_learned(bytes)) {
                return Ok(None);
            }
            if let Some(every) = view_every {
                let is_new = job.film().passes().is_empty();
                if is_new && let Some(sketch) = job.sketch(SKETCH_STEP, &workers)? {
                    listener.borrow_mut().on_sketch(&sketch, job.film().settings().crop);
                }
                job.view(every, |film| listener.borrow_mut().on_film(film));
            }
            let mut on_event = |event: Event<'_>| listener.borrow_mut().on(event);
            let checkpoint = checkpoint.as_ref();
            let outcome = match until {
                Until::Precise(p) => job.render_until(p, checkpoint, &workers, &cancel, &mut on_event)?,
                Until::Stop(stop) => job.render(&stop, checkpoint, &workers, &cancel, &mut on_event)?,
            };
            Ok(Some((job.into_film(), outcome)))
        });
        (rendered, listener.into_inner())
    });
    let interrupted = listener.end()?;
    let (film, outcome) = rendered.map_err(|e| of_render(py, &e))?.ok_or_else(|| refused(py))?;
    let report = report(py, &outcome, load_seconds, workers.len())?;
    if interrupted && film.passes().is_empty() {
        return Err(pyo3::exceptions::PyKeyboardInterrupt::new_err(()));
    }
    if let Some(e) = &outcome.checkpoint_error {
        report.set_item("checkpoint_error", render::sentence(e))?;
    }
    Ok((Film::new(film), report))
}

fn report<'py>(
    py: Python<'py>,
    outcome: &Outcome,
    load_seconds: f64,
    threads: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let run = &outcome.report;
    let d = PyDict::new(py);
    d.set_item("load_seconds", load_seconds)?;
    d.set_item("render_seconds", run.elapsed.as_secs_f64())?;
    d.set_item("rays", run.counters.rays)?;
    d.set_item("camera_paths", run.counters.camera_paths)?;
    d.set_item("light_paths", run.counters.light_paths)?;
    d.set_item("passes_resumed", outcome.passes_resumed)?;
    d.set_item("threads", threads)?;
    d.set_item("interrupted", run.cancelled)?;
    Ok(d)
}

/// The integrators: names, what each is for and misses, parameters with defaults.
#[pyfunction(name = "integrators")]
pub(crate) fn list_integrators(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    let one = |info: &integrators::IntegratorInfo| {
        let d = PyDict::new(py);
        d.set_item("name", info.name)?;
        d.set_item("purpose", info.purpose)?;
        d.set_item("misses", info.misses)?;
        d.set_item("unbiased", info.unbiased)?;
        d.set_item("learns", integrators::learns(info.name))?;
        let parameters = PyDict::new(py);
        for p in (info.parameters)() {
            let about = PyDict::new(py);
            about.set_item("default", p.kind.default_text())?;
            about.set_item("expects", p.kind.expected())?;
            about.set_item("doc", p.doc)?;
            parameters.set_item(p.name, about)?;
        }
        d.set_item("parameters", parameters)?;
        Ok(d)
    };
    integrators::list().iter().map(one).collect()
}
