//! Films and pictures: exact sums, and what is seen of them.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use film::Developed;
use image::{Display, Format, Image, SaveOptions, ToneMap};
use lab::{Picture, flip};
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::arrays;
use crate::errors::{error, of_film, of_render};

/// A render's exact sums. Immutable: merging makes a new one.
#[pyclass(frozen, module = "steradian._native")]
pub(crate) struct Film {
    pub(crate) film: Arc<film::Film>,
}

impl Film {
    pub(crate) fn new(film: film::Film) -> Self {
        Self { film: Arc::new(film) }
    }

    fn developed(&self, py: Python<'_>) -> Developed {
        py.detach(|| self.film.develop())
    }
}

#[pymethods]
impl Film {
    /// From what `to_bytes` gave.
    #[staticmethod]
    fn from_bytes(py: Python<'_>, bytes: &[u8]) -> PyResult<Self> {
        // The bytes object is immutable and lives as long as the call.
        py.detach(|| film::Film::from_bytes(bytes)).map(Self::new).map_err(|e| of_film(py, &e))
    }

    /// A partial film's file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        py.detach(|| film::Film::load(&path)).map(Self::new).map_err(|e| of_film(py, &e))
    }

    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = py.detach(|| self.film.to_bytes()).map_err(|e| of_film(py, &e))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// What `to_bytes` gives as an array, which pickles without a copy.
    fn to_array<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u8>>> {
        let bytes = py.detach(|| self.film.to_bytes()).map_err(|e| of_film(py, &e))?;
        Ok(arrays::vector(py, bytes))
    }

    /// Writes a partial film's file.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| self.film.save(&path)).map_err(|e| of_film(py, &e))
    }

    /// Writes a picture in the format of its ending.
    fn save_picture(&self, py: Python<'_>, path: PathBuf, exposure: f32) -> PyResult<()> {
        if !render::is_picture(&path) {
            let text = format!(
                "cannot write a picture named {}: the endings .exr, .png, .hdr and .pfm are known",
                path.display()
            );
            return Err(error(py, "OutputError", &text));
        }
        py.detach(|| {
            let workers = render::Workers::new(None)?;
            let developed = workers.install(|| self.film.develop());
            let picture = render::picture(&self.film.label(), &developed)
                .map_err(|e| render::Error::Output { path: path.clone(), reason: e.to_string() })?;
            workers.install(|| render::save_picture(&path, &picture, exposure))
        })
        .map_err(|e| of_render(py, &e))
    }

    /// What it is a film of, and how far it is.
    fn info<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (s, passes, bad) = (self.film.settings(), self.film.passes(), self.film.bad_samples());
        let d = PyDict::new(py);
        d.set_item("integrator", &s.key.integrator)?;
        d.set_item("settings", &s.key.settings)?;
        d.set_item("seed", s.key.seed)?;
        d.set_item("scene_hash", &s.key.scene)?;
        d.set_item("resolution", (s.resolution[0], s.resolution[1]))?;
        d.set_item("crop", (s.crop.min[0], s.crop.min[1], s.crop.max[0], s.crop.max[1]))?;
        d.set_item("spp", passes.len())?;
        d.set_item("passes", passes.to_string())?;
        d.set_item("dropped_samples", bad.count())?;
        d.set_item("version", render::VERSION)?;
        Ok(d)
    }

    /// The passes as pairs, half-open.
    fn passes(&self) -> Vec<(u32, u32)> {
        self.film.passes().ranges().iter().map(|r| (r.start, r.end)).collect()
    }

    /// Mean and variance (height, width, 3), further channels (height, width, n) with their names, relMSE.
    fn develop<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let developed = self.developed(py);
        let (relmse, mean_rgb) = (developed.relmse_estimate(), developed.mean_rgb());
        let size = [developed.bounds.height(), developed.bounds.width()];
        let names = &self.film.settings().aovs;
        let d = PyDict::new(py);
        d.set_item("mean", arrays::image(py, [size[0], size[1], 3], developed.mean.into_flattened())?)?;
        let variance = developed.variance.into_flattened();
        d.set_item("variance", arrays::image(py, [size[0], size[1], 3], variance)?)?;
        d.set_item("aovs", arrays::image(py, [size[0], size[1], names.len()], developed.aovs)?)?;
        d.set_item("aov_names", names)?;
        d.set_item("relmse_estimate", relmse)?;
        d.set_item("mean_rgb", mean_rgb)?;
        Ok(d)
    }
}

/// A film that grows: partial films are added in place, one after the other.
#[pyclass(frozen, module = "steradian._native")]
pub(crate) struct Sum {
    sum: Mutex<Option<film::Film>>,
}

impl Sum {
    fn add_bytes(&self, part: &[u8]) -> Result<bool, film::Error> {
        let mut sum = self.sum.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(sum) = &mut *sum {
            return Ok(sum.merge_bytes(part)? == film::Merged::Added);
        }
        *sum = Some(film::Film::from_bytes(part)?);
        Ok(true)
    }
}

/// A partial film's bytes, as they come.
#[derive(FromPyObject)]
enum FilmBytes<'py> {
    Bytes(Bound<'py, PyBytes>),
    Array(PyReadonlyArray1<'py, u8>),
}

#[pymethods]
impl Sum {
    /// Nothing yet.
    #[new]
    fn new() -> Self {
        Self { sum: Mutex::new(None) }
    }

    /// Adds a partial film's bytes. False if all its passes are there already.
    fn add(&self, py: Python<'_>, bytes: FilmBytes<'_>) -> PyResult<bool> {
        let bytes = match &bytes {
            FilmBytes::Bytes(bytes) => bytes.as_bytes(),
            FilmBytes::Array(array) => array.as_slice()?,
        };
        py.detach(|| self.add_bytes(bytes)).map_err(|e| of_film(py, &e))
    }

    /// A copy of what is there; `None` if nothing is.
    fn film(&self, py: Python<'_>) -> PyResult<Option<Film>> {
        py.detach(|| {
            let sum = self.sum.lock().unwrap_or_else(PoisonError::into_inner);
            let Some(sum) = &*sum else { return Ok(None) };
            let mut copy = film::Film::new(sum.settings().clone())?;
            copy.merge(sum)?;
            Ok(Some(Film::new(copy)))
        })
        .map_err(|e| of_film(py, &e))
    }

    /// The bytes of a partial film, as an array; `None` if nothing is there.
    fn to_array<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray1<u8>>>> {
        let bytes = py.detach(|| {
            let sum = self.sum.lock().unwrap_or_else(PoisonError::into_inner);
            sum.as_ref().map(film::Film::to_bytes).transpose()
        });
        Ok(bytes.map_err(|e| of_film(py, &e))?.map(|b| arrays::vector(py, b)))
    }

    /// Writes a partial film's file, if anything is there.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| {
            let sum = self.sum.lock().unwrap_or_else(PoisonError::into_inner);
            sum.as_ref().map_or(Ok(()), |sum| sum.save(&path))
        })
        .map_err(|e| of_film(py, &e))
    }

    /// The passes as pairs, half-open.
    fn passes(&self) -> Vec<(u32, u32)> {
        let sum = self.sum.lock().unwrap_or_else(PoisonError::into_inner);
        let passes = sum.as_ref().map(film::Film::passes);
        passes.iter().flat_map(film::PassSet::ranges).map(|r| (r.start, r.end)).collect()
    }
}

/// All films as one; and which of them added nothing.
#[pyfunction]
pub(crate) fn merge(py: Python<'_>, films: Vec<PyRef<'_, Film>>) -> PyResult<(Film, Vec<usize>)> {
    let films: Vec<Arc<film::Film>> = films.iter().map(|f| Arc::clone(&f.film)).collect();
    let first = films.first().ok_or_else(|| PyValueError::new_err("nothing to merge"))?;
    py.detach(|| {
        let mut all = film::Film::new(first.settings().clone())?;
        let mut duplicates = Vec::new();
        for (i, film) in films.iter().enumerate() {
            if all.merge(film)? == film::Merged::AlreadyThere {
                duplicates.push(i);
            }
        }
        Ok((Film::new(all), duplicates))
    })
    .map_err(|e| of_film(py, &e))
}

/// A picture of linear light, (height, width, 3).
pub(crate) fn pixels(x: &PyReadonlyArray3<'_, f32>) -> PyResult<Vec<[f32; 3]>> {
    if x.shape()[2] != 3 {
        return Err(PyValueError::new_err("expected arrays of shape (height, width, 3)"));
    }
    let data: Vec<f32> = x.as_array().iter().copied().collect();
    Ok(data.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect())
}

/// Metrics of two pictures of one size, (height, width, 3) of linear light; `is_float`: they may hold more than a screen shows.
#[pyfunction]
pub(crate) fn diff<'py>(
    py: Python<'py>,
    a: PyReadonlyArray3<'py, f32>,
    b: PyReadonlyArray3<'py, f32>,
    is_float: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let picture = |x: &PyReadonlyArray3<'py, f32>| -> PyResult<Picture> {
        Ok(Picture { size: [x.shape()[1], x.shape()[0]], rgb: pixels(x)?, variance: None, is_float })
    };
    let (a, b) = (picture(&a)?, picture(&b)?);
    let metrics = py
        .detach(|| {
            let metrics = lab::compare(&a.rgb, &b.rgb)?;
            let flip = if a.size == b.size { Some(flip::mean(&flip::between(&a, &b))) } else { None };
            Ok(lab::Metrics { flip, ..metrics })
        })
        .map_err(|e: lab::MetricError| error(py, "FilmError", &render::sentence(&e)))?;
    let d = PyDict::new(py);
    for metric in lab::Metric::ALL {
        d.set_item(metric.name(), metric.of(&metrics))?;
    }
    d.set_item("mean", metrics.mean)?;
    d.set_item("mean_reference", metrics.mean_reference)?;
    d.set_item("pixels", metrics.pixels)?;
    d.set_item("non_finite", metrics.non_finite)?;
    Ok(d)
}

/// A picture file as linear light, (height, width, 3), its variance if the file has it, and whether it may hold more than a screen
/// shows. Eight bits are decoded from sRGB.
#[pyfunction]
pub(crate) fn load_picture(
    py: Python<'_>,
    path: PathBuf,
) -> PyResult<(Bound<'_, PyAny>, Option<Bound<'_, PyAny>>, bool)> {
    let picture = py.detach(|| Picture::load(&path)).map_err(|e| error(py, "FilmError", &e.to_string()))?;
    let size = [picture.size[1], picture.size[0], 3];
    let rgb = arrays::image(py, size, picture.rgb.into_flattened())?.into_any();
    let variance = match picture.variance {
        Some(v) => Some(arrays::image(py, size, v.into_flattened())?.into_any()),
        None => None,
    };
    Ok((rgb, variance, picture.is_float))
}

/// A PNG of linear light, (height, width, 3). Values above one are compressed if `filmic`, else white.
#[pyfunction]
pub(crate) fn png<'py>(
    py: Python<'py>,
    pixels: PyReadonlyArray3<'py, f32>,
    exposure: f32,
    filmic: bool,
) -> PyResult<Bound<'py, PyBytes>> {
    let [h, w, c] = [0, 1, 2].map(|a| pixels.shape()[a]);
    if c != 3 || h == 0 || w == 0 {
        return Err(PyValueError::new_err("expected an array of shape (height, width, 3)"));
    }
    let data: Vec<f32> = pixels.as_array().iter().copied().collect();
    let tone_map = if filmic { ToneMap::Filmic } else { ToneMap::Clamp };
    let display = Display { exposure, tone_map };
    let bytes = py
        .detach(|| {
            let picture = Image::from_data(w, h, ["R", "G", "B"].map(str::to_owned).to_vec(), data)?;
            image::encode(&picture, Format::Png, &SaveOptions { display })
        })
        .map_err(|e| error(py, "OutputError", &render::sentence(&e)))?;
    Ok(PyBytes::new(py, &bytes))
}
