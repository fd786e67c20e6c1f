//! Arrays in and out. Out: the vector becomes the array's memory, nothing is copied.

use numpy::ndarray::Array3;
use numpy::{IntoPyArray, PyArray3};
use pyo3::prelude::*;

/// An image of `channels` numbers a pixel.
pub(crate) fn image(
    py: Python<'_>,
    [height, width, channels]: [usize; 3],
    data: Vec<f32>,
) -> PyResult<Bound<'_, PyArray3<f32>>> {
    Ok(Array3::from_shape_vec((height, width, channels), data).map_err(shape)?.into_pyarray(py))
}

fn shape(e: numpy::ndarray::ShapeError) -> PyErr {
    pyo3::exceptions::PyValueError::new_err(e.to_string())
}
