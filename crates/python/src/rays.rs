//! Rays by the array: nearest hits, occlusion, camera rays.

use math::{Dir, Point, Ray, Vec3};
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;
use render::Workers;

use crate::arrays;
use crate::run::workers;
use crate::scene::{Options, Scene};

/// Rays that a thread takes at a time.
const CHUNK: usize = 4096;

/// Rays as arrays: origins and directions (n, 3), ends (n,).
pub(crate) struct Rays<'a> {
    origins: &'a [[f32; 3]],
    directions: &'a [[f32; 3]],
    t_max: Option<&'a [f32]>,
    time: f32,
}

impl Rays<'_> {
    pub(crate) fn len(&self) -> usize {
        self.origins.len()
    }

    /// Directions are made unit, so that t is a distance; a ray without one hits nothing.
    pub(crate) fn get(&self, i: usize) -> Option<Ray> {
        let d = Vec3::from_array(self.directions[i]);
        let squared = d.length_squared();
        let unit = if (squared - 1.0).abs() < 1e-6 { d } else { d / squared.sqrt() };
        let origin = Vec3::from_array(self.origins[i]);
        let ray = Ray::new(Point(origin), Dir(unit), self.time);
        let t_max = self.t_max.map_or(ray.t_max, |t| t[i]);
        (unit.is_finite() && origin.is_finite() && t_max > 0.0).then_some(Ray { t_max, ..ray })
    }
}

pub(crate) fn rows<'a, const N: usize>(
    name: &str,
    a: &'a PyReadonlyArray2<'_, f32>,
) -> PyResult<&'a [[f32; N]]> {
    let wrong = || PyValueError::new_err(format!("{name}: expected a C-contiguous array of shape (n, {N})"));
    if a.as_array().ncols() != N {
        return Err(wrong());
    }
    Ok(a.as_slice().map_err(|_| wrong())?.as_chunks::<N>().0)
}

pub(crate) fn rays<'a>(
    origins: &'a PyReadonlyArray2<'_, f32>,
    directions: &'a PyReadonlyArray2<'_, f32>,
    t_max: Option<&'a PyReadonlyArray1<'_, f32>>,
    time: f32,
) -> PyResult<Rays<'a>> {
    let (origins, directions) = (rows("origins", origins)?, rows("directions", directions)?);
    let t_max = match t_max {
        Some(t) => Some(t.as_slice().map_err(|_| PyValueError::new_err("t_max: expected shape (n,)"))?),
        None => None,
    };
    let n = origins.len();
    if directions.len() != n || t_max.is_some_and(|t| t.len() != n) {
        return Err(PyValueError::new_err(format!("{n} origins, {} directions", directions.len())));
    }
    Ok(Rays { origins, directions, t_max, time })
}

/// `f` of every number below `n`, on all threads if there are enough to be worth it.
pub(crate) fn map<T: Send + Default + Clone>(
    workers: &Workers,
    n: usize,
    f: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    let mut all = vec![T::default(); n];
    let fill = |(chunk, out): (usize, &mut [T])| {
        out.iter_mut().enumerate().for_each(|(i, x)| *x = f(chunk * CHUNK + i));
    };
    if n <= CHUNK {
        fill((0, &mut all));
    } else {
        workers.install(|| all.par_chunks_mut(CHUNK).enumerate().for_each(fill));
    }
    all
}

/// What is written for a ray.
#[derive(Clone, Copy)]
struct Found {
    t: f32,
    uv: [f32; 2],
    ids: [u32; 3],
}

impl Default for Found {
    fn default() -> Self {
        Self { t: f32::INFINITY, uv: [0.0; 2], ids: [u32::MAX; 3] }
    }
}

#[pymethods]
impl Scene {
    /// Nearest hits: distances (infinite for none), surface parameters, (instance, geometry, primitive).
    #[expect(clippy::too_many_arguments, reason = "as Python's caller names them")]
    #[pyo3(signature = (origins, directions, t_max, time, threads))]
    fn intersect<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<'py, f32>,
        directions: PyReadonlyArray2<'py, f32>,
        t_max: Option<PyReadonlyArray1<'py, f32>>,
        time: f32,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let opened = self.compiled(py, &Options::default(), threads)?;
        let workers = workers(py, threads)?;
        let rays = rays(&origins, &directions, t_max.as_ref(), time)?;
        let scene = &opened.scene;
        let (t, uv, ids) = py.detach(|| {
            let n = rays.len();
            let (mut t, mut uv, mut ids) = (vec![0.0_f32; n], vec![[0.0_f32; 2]; n], vec![[0_u32; 3]; n]);
            let trace = |i: usize| {
                let hit = rays.get(i).and_then(|ray| scene.intersect(&ray));
                hit.map_or(Found::default(), |h| Found {
                    t: h.t,
                    uv: [h.u, h.v],
                    ids: [h.instance, h.geometry, h.primitive],
                })
            };
            workers.install(|| {
                t.par_chunks_mut(CHUNK)
                    .zip(uv.par_chunks_mut(CHUNK))
                    .zip(ids.par_chunks_mut(CHUNK))
                    .enumerate()
                    .for_each(|(chunk, ((t, uv), ids))| {
                        for i in 0..t.len() {
                            let found = trace(chunk * CHUNK + i);
                            (t[i], uv[i], ids[i]) = (found.t, found.uv, found.ids);
                        }
                    });
            });
            (t, uv, ids)
        });
        let d = PyDict::new(py);
        d.set_item("t", arrays::vector(py, t))?;
        d.set_item("uv", arrays::rows(py, uv)?)?;
        d.set_item("ids", arrays::rows(py, ids)?)?;
        Ok(d)
    }

    /// Is anything opaque before the rays' ends?
    #[expect(clippy::too_many_arguments, reason = "as Python's caller names them")]
    #[pyo3(signature = (origins, directions, t_max, time, threads))]
    fn occluded<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<'py, f32>,
        directions: PyReadonlyArray2<'py, f32>,
        t_max: Option<PyReadonlyArray1<'py, f32>>,
        time: f32,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let opened = self.compiled(py, &Options::default(), threads)?;
        let workers = workers(py, threads)?;
        let rays = rays(&origins, &directions, t_max.as_ref(), time)?;
        let hits = py.detach(|| {
            map(&workers, rays.len(), |i| rays.get(i).is_some_and(|ray| opened.scene.occluded(&ray)))
        });
        Ok(arrays::vector(py, hits).into_any())
    }

    /// Camera rays through places on the film in pixels, from the middle of lens and shutter: origins, directions.
    fn camera_rays<'py>(
        &self,
        py: Python<'py>,
        raster: PyReadonlyArray2<'py, f32>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let opened = self.compiled(py, &Options::default(), None)?;
        let raster = rows::<2>("raster", &raster)?;
        let (origins, directions) = py.detach(|| {
            let ray = |at: &[f32; 2]| opened.scene.camera.generate_ray(*at, [0.5; 2], 0.5);
            let both = raster.iter().map(|at| {
                ray(at).map_or(([0.0; 3], [0.0; 3]), |r| (r.ray.origin.0.to_array(), r.ray.dir.0.to_array()))
            });
            both.unzip::<_, _, Vec<_>, Vec<_>>()
        });
        Ok((arrays::rows(py, origins)?.into_any(), arrays::rows(py, directions)?.into_any()))
    }
}
