//! The Python module `steradian._native`: a thin layer over the house.
//!
//! What a person sees (names, defaults, documentation) is in `python/steradian`; here numbers and arrays cross over. Rules
//! of the border: whatever takes long runs without the interpreter's lock; no lock of ours is held while Python's is
//! awaited; no thread outlives a call, so that a fork finds none missing.

mod arrays;
mod compare;
mod edit;
mod errors;
mod film;
mod geometry;
mod progress;
mod rays;
mod run;
mod samples;
mod scene;
mod surfaces;

use pyo3::prelude::*;

/// What `steradian` is made of.
#[pymodule(gil_used = true)]
fn _native(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("__version__", render::VERSION)?;
    m.add_class::<scene::Scene>()?;
    m.add_class::<film::Film>()?;
    m.add_class::<compare::Comparison>()?;
    m.add_class::<film::Sum>()?;
    m.add_class::<geometry::Geometry>()?;
    m.add_class::<surfaces::Surfaces>()?;
    m.add_function(wrap_pyfunction!(samples::samples, m)?)?;
    m.add_function(wrap_pyfunction!(samples::warp_array, m)?)?;
    m.add_function(wrap_pyfunction!(edit::schema, m)?)?;
    m.add_function(wrap_pyfunction!(command, m)?)?;
    m.add_function(wrap_pyfunction!(run::render_scene, m)?)?;
    m.add_function(wrap_pyfunction!(run::list_integrators, m)?)?;
    m.add_function(wrap_pyfunction!(compare::compare, m)?)?;
    m.add_function(wrap_pyfunction!(compare::advise_scene, m)?)?;
    m.add_function(wrap_pyfunction!(compare::reference_cache, m)?)?;
    m.add_function(wrap_pyfunction!(run::rounds, m)?)?;
    m.add_function(wrap_pyfunction!(run::learn, m)?)?;
    m.add_function(wrap_pyfunction!(film::merge, m)?)?;
    m.add_function(wrap_pyfunction!(film::diff, m)?)?;
    m.add_function(wrap_pyfunction!(film::load_picture, m)?)?;
    m.add_function(wrap_pyfunction!(film::png, m)?)?;
    Ok(())
}

/// Runs a command line, the program's name first, and gives its exit status; `python` is the interpreter that asks.
#[pyfunction]
#[pyo3(signature = (args, python=None))]
fn command(py: Python<'_>, args: Vec<String>, python: Option<std::path::PathBuf>) -> u8 {
    py.detach(|| cli::run(args, python.as_deref()))
}
