//! Arrays in and out. Out: the vector becomes the array's memory, nothing is copied.

use numpy::ndarray::{Array1, Array2, Array3};
use numpy::{Element, IntoPyArray, PyArray1, PyArray2, PyArray3};
use pyo3::prelude::*;

/// Rows of `N` numbers as an array of shape (n, N).
pub(crate) fn rows<T: Element, const N: usize>(
    py: Python<'_>,
    rows: Vec<[T; N]>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let n = rows.len();
    Ok(Array2::from_shape_vec((n, N), rows.into_flattened()).map_err(shape)?.into_pyarray(py))
}

/// A vector as an array.
pub(crate) fn vector<T: Element>(py: Python<'_>, data: Vec<T>) -> Bound<'_, PyArray1<T>> {
    Array1::from_vec(data).into_pyarray(py)
}

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
