//! The laboratory: comparisons and advice.

use std::path::PathBuf;

use lab::advise::{PILOTS, Question, advise};
use lab::comparison::{self, Budget, Entry, Plan, Truth};
use numpy::PyReadonlyArray3;
use pyo3::prelude::*;
use render::{Cancel, Precision};
use serde::Serialize;

use crate::arrays;
use crate::errors::{error, of_render};
use crate::film::pixels;
use crate::progress::Listener;
use crate::run::{seconds, workers};
use crate::scene::{Options, Scene};

/// What is to be compared, as Python says it.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Request<'py> {
    /// Labels and methods; the method as `NAME:KEY=VALUE`.
    methods: Vec<(String, String)>,
    spp: Option<u32>,
    /// In seconds.
    time: f64,
    seeds: Vec<u64>,
    /// Its name, its pixels, their variance.
    reference: Option<(String, PyReadonlyArray3<'py, f32>, Option<PyReadonlyArray3<'py, f32>>)>,
    reference_integrator: String,
    reference_error: f64,
    /// In seconds.
    reference_time: f64,
    cache: Option<PathBuf>,
    threads: Option<usize>,
    resolution: Option<[u32; 2]>,
    crop: Option<[i32; 4]>,
    spectral: bool,
}

/// What is asked, as Python says it.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Asked {
    methods: Vec<(String, String)>,
    /// √relMSE, as `1%` or `0.01`.
    error: String,
    /// In seconds.
    pilot: f64,
    allow_biased: bool,
    threads: Option<usize>,
    resolution: Option<[u32; 2]>,
    crop: Option<[i32; 4]>,
    spectral: bool,
}

/// A comparison that was run.
#[pyclass(frozen, module = "steradian._native")]
pub(crate) struct Comparison {
    of: comparison::Comparison,
}

#[pymethods]
impl Comparison {
    /// All figures as JSON.
    fn figures(&self, py: Python<'_>) -> PyResult<String> {
        to_json(py, &self.of)
    }

    /// The report: one page that opens without a network.
    fn page(&self, py: Python<'_>, title: &str, command: &str) -> PyResult<String> {
        py.detach(|| lab::page(&self.of, title, command)).map_err(|e| error(py, "OutputError", &e))
    }

    /// The report, the figures and all pictures, into a folder that is there.
    fn save(&self, py: Python<'_>, folder: PathBuf, title: &str, command: &str) -> PyResult<Vec<PathBuf>> {
        py.detach(|| lab::save(&folder, title, command, &self.of)).map_err(|e| of_render(py, &e))
    }

    /// Mean and variance of a method's first run, (height, width, 3) each; without an index, of the reference.
    fn picture<'py>(
        &self,
        py: Python<'py>,
        index: Option<usize>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let pictures = match index {
            None => Some(&self.of.truth),
            Some(i) => self.of.pictures.get(i),
        };
        let none = || pyo3::exceptions::PyIndexError::new_err("there is no such picture");
        let pictures = pictures.ok_or_else(none)?;
        let [width, height] = self.of.size;
        let array = |values: &[[f32; 3]]| {
            arrays::image(py, [height, width, 3], values.as_flattened().to_vec()).map(Bound::into_any)
        };
        Ok((array(&pictures.rgb)?, array(&pictures.variance)?))
    }
}

/// Runs a comparison. Ctrl-C ends it with what is complete.
#[pyfunction]
pub(crate) fn compare(
    py: Python<'_>,
    scene: &Scene,
    request: Request<'_>,
    listener: Option<Py<PyAny>>,
) -> PyResult<Comparison> {
    let plan = plan(py, &request)?;
    let options = Options {
        resolution: request.resolution,
        crop: request.crop,
        spectral: request.spectral,
        settings: Vec::new(),
    };
    let opened = scene.compiled(py, &options, request.threads)?;
    let workers = workers(py, request.threads)?;
    let cancel = Cancel::default();
    let mut listener = Listener::new(listener, cancel.clone());
    let compared = py.detach(|| {
        comparison::run(&plan, &opened.scene, &workers, &cancel, &mut |step| listener.on_step(step))
    });
    listener.end()?;
    Ok(Comparison { of: compared.map_err(|e| of_comparison(py, &e))? })
}

/// Runs pilots and gives, as JSON, what each method would need; the best first.
#[pyfunction(name = "advise")]
pub(crate) fn advise_scene(
    py: Python<'_>,
    scene: &Scene,
    asked: Asked,
    listener: Option<Py<PyAny>>,
) -> PyResult<String> {
    let Precision { target } = asked.error.parse().map_err(pyo3::exceptions::PyValueError::new_err)?;
    let pilot = seconds("pilot", asked.pilot)?;
    let entries = entries(py, &asked.methods)?;
    let options = Options {
        resolution: asked.resolution,
        crop: asked.crop,
        spectral: asked.spectral,
        settings: Vec::new(),
    };
    let opened = scene.compiled(py, &options, asked.threads)?;
    let workers = workers(py, asked.threads)?;
    let cancel = Cancel::default();
    let mut listener = Listener::new(listener, cancel.clone());
    let advice = py.detach(|| {
        let entries = match entries.is_empty() {
            true => lab::advise::candidates(&opened.scene),
            false => entries,
        };
        let question = Question { target, pilot, pilots: PILOTS, allow_biased: asked.allow_biased, entries };
        advise(&question, &opened.scene, &workers, &cancel, &mut |label| listener.on_pilot(label))
    });
    listener.end()?;
    to_json(py, &advice.map_err(|e| of_comparison(py, &e))?)
}

fn plan(py: Python<'_>, request: &Request<'_>) -> PyResult<Plan> {
    let budget = match request.spp {
        Some(n) => Budget::Samples(n),
        None => Budget::Time(seconds("time", request.time)?),
    };
    let truth = match &request.reference {
        Some((name, rgb, variance)) => Truth::Picture {
            name: name.clone(),
            rgb: pixels(rgb)?,
            variance: variance.as_ref().map(pixels).transpose()?,
        },
        None => Truth::Render {
            method: entry(py, "reference", &request.reference_integrator)?.method,
            relmse: request.reference_error,
            time: seconds("reference_time", request.reference_time)?,
            cache: request.cache.clone(),
        },
    };
    Ok(Plan { entries: entries(py, &request.methods)?, budget, seeds: request.seeds.clone(), truth })
}

fn entries(py: Python<'_>, methods: &[(String, String)]) -> PyResult<Vec<Entry>> {
    methods.iter().map(|(label, text)| entry(py, label, text)).collect()
}

fn entry(py: Python<'_>, label: &str, text: &str) -> PyResult<Entry> {
    let entry = Entry::parse(text).map_err(|e| error(py, "ParameterError", &e))?;
    Ok(Entry { label: label.to_owned(), ..entry })
}

fn of_comparison(py: Python<'_>, e: &comparison::Error) -> PyErr {
    if let comparison::Error::Render(e) = e {
        return of_render(py, e);
    }
    if matches!(e, comparison::Error::Interrupted) {
        return pyo3::exceptions::PyKeyboardInterrupt::new_err(e.to_string());
    }
    error(py, "ParameterError", &render::sentence(e))
}

fn to_json(py: Python<'_>, value: &impl Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(|e| error(py, "SteradianError", &e.to_string()))
}

/// Where references are kept unless somebody says otherwise.
#[pyfunction]
pub(crate) fn reference_cache() -> Option<PathBuf> {
    cli::user_cache()
}
