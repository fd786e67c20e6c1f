//! Points on surfaces by the array: what a small integrator in Python needs of them.

use std::sync::Arc;

use math::{Dir, Vec3};
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use render::{Opened, Workers};
use scatter::{Density, TransportMode};
use scene::{Shading, SurfaceInteraction, Surroundings};
use spectrum::Wavelengths;

use crate::arrays;
use crate::rays::{map, rays, rows};
use crate::run::workers;
use crate::scene::{Options, Scene};

/// What rays met: one entry a ray, some of them nothing. In RGB.
#[pyclass(frozen, module = "steradian._native")]
pub(crate) struct Surfaces {
    opened: Arc<Opened>,
    list: Vec<Option<Point>>,
}

#[derive(Clone)]
struct Point {
    si: SurfaceInteraction,
    /// `None` at a mere border of media.
    shading: Option<Shading>,
}

#[pymethods]
impl Scene {
    /// The surfaces that rays meet.
    fn surfaces<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<'py, f32>,
        directions: PyReadonlyArray2<'py, f32>,
        t_max: Option<PyReadonlyArray1<'py, f32>>,
    ) -> PyResult<Surfaces> {
        let opened = self.compiled(py, &Options::default(), None)?;
        let workers = workers(py, None)?;
        let rays = rays(&origins, &directions, t_max.as_ref(), 0.0)?;
        let scene = &opened.scene;
        let list = py.detach(|| {
            map(&workers, rays.len(), |i| {
                let ray = rays.get(i)?;
                let si = scene.interaction(&ray, &scene.intersect(&ray)?);
                let (around, mut wl) = (Surroundings::default(), Wavelengths::RGB);
                Some(Point { si, shading: scene.shade(&si, &around, &mut wl) })
            })
        });
        Ok(Surfaces { opened, list })
    }

    /// Light from infinity along directions, (n, 3).
    fn background<'py>(
        &self,
        py: Python<'py>,
        directions: PyReadonlyArray2<'py, f32>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let opened = self.compiled(py, &Options::default(), None)?;
        let directions = rows::<3>("directions", &directions)?;
        // Portals: as seen from the middle of the scene.
        let from = opened.scene.lights.world_sphere().0;
        let light = |w: &[f32; 3]| {
            let w = Dir::normalize(Vec3::from_array(*w));
            opened.scene.lights.background(from, w, &Wavelengths::RGB).rgb()
        };
        let all = py.detach(|| directions.iter().map(light).collect());
        Ok(arrays::rows(py, all)?.into_any())
    }
}

impl Surfaces {
    /// `f` of every point and the number that goes with it; one point alone goes with all numbers.
    fn map<T: Send + Default + Clone>(
        &self,
        py: Python<'_>,
        n: usize,
        f: impl Fn(&Point, usize) -> T + Sync + Send,
    ) -> PyResult<Vec<T>> {
        if n != self.list.len() && self.list.len() != 1 {
            return Err(PyValueError::new_err(format!("{n} values for {} points", self.list.len())));
        }
        let workers: Workers = workers(py, None)?;
        let point = |i: usize| if self.list.len() == 1 { &self.list[0] } else { &self.list[i] };
        Ok(py.detach(|| map(&workers, n, |i| point(i).as_ref().map_or_else(T::default, |p| f(p, i)))))
    }
}

#[pymethods]
impl Surfaces {
    fn __len__(&self) -> usize {
        self.list.len()
    }

    /// What the points are.
    fn fields<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let n = self.list.len();
        let d = PyDict::new(py);
        let scene = &self.opened.scene;
        let v = |f: &(dyn Fn(&Point) -> Vec3 + Sync)| self.map(py, n, |p, _| f(p).to_array());
        let valid: Vec<bool> = self.list.iter().map(Option::is_some).collect();
        d.set_item("valid", arrays::vector(py, valid))?;
        d.set_item("p", arrays::rows(py, v(&|p| p.si.p.0)?)?)?;
        d.set_item("ng", arrays::rows(py, v(&|p| p.si.ng.0)?)?)?;
        d.set_item(
            "n",
            arrays::rows(py, v(&|p| p.shading.as_ref().map_or(p.si.frame.n, |s| s.frame.n).0)?)?,
        )?;
        d.set_item("wo", arrays::rows(py, v(&|p| p.si.wo.0)?)?)?;
        d.set_item("uv", arrays::rows(py, self.map(py, n, |p, _| p.si.uv.to_array())?)?)?;
        d.set_item("t", arrays::vector(py, self.map(py, n, |p, _| p.si.t)?))?;
        d.set_item("shape", arrays::vector(py, self.map(py, n, |p, _| p.si.shape.0)?))?;
        d.set_item("primitive", arrays::vector(py, self.map(py, n, |p, _| p.si.primitive)?))?;
        d.set_item("material", arrays::vector(py, self.map(py, n, |p, _| p.si.material.0)?))?;
        let emitted = self.map(py, n, |p, _| scene.lights.emitted_at(&p.si, &Wavelengths::RGB).rgb())?;
        d.set_item("emitted", arrays::rows(py, emitted)?)?;
        Ok(d)
    }

    /// f(wo, wi) in 1/sr without the cosine, (n, 3), and its density per steradian, (n,). `wo`: as the rays came.
    fn eval<'py>(
        &self,
        py: Python<'py>,
        wi: PyReadonlyArray2<'py, f32>,
        wo: Option<PyReadonlyArray2<'py, f32>>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let wi = rows::<3>("wi", &wi)?;
        let wo = match &wo {
            Some(wo) => Some(rows::<3>("wo", wo)?),
            None => None,
        };
        if wo.is_some_and(|wo| wo.len() != wi.len()) {
            return Err(PyValueError::new_err("wo and wi must have one shape"));
        }
        let values = self.map(py, wi.len(), |p, i| {
            let Some(s) = &p.shading else { return [0.0; 4] };
            let dir = |w: [f32; 3]| s.frame.to_local(Dir::normalize(Vec3::from_array(w)));
            let wo = wo.map_or_else(|| s.frame.to_local(p.si.wo), |wo| dir(wo[i]));
            let (f, pdf) = s.bsdf.eval_pdf(wo, dir(wi[i]), TransportMode::Radiance);
            let [r, g, b] = f.rgb();
            [r, g, b, pdf.value()]
        })?;
        let f = values.iter().map(|v| [v[0], v[1], v[2]]).collect();
        let pdf = values.iter().map(|v| v[3]).collect();
        Ok((arrays::rows(py, f)?.into_any(), arrays::vector(py, pdf).into_any()))
    }

    /// Directions drawn from the BSDF with three numbers each.
    fn sample<'py>(
        &self,
        py: Python<'py>,
        u: PyReadonlyArray2<'py, f32>,
        wo: Option<PyReadonlyArray2<'py, f32>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let u = rows::<3>("u", &u)?;
        let wo = match &wo {
            Some(wo) => Some(rows::<3>("wo", wo)?),
            None => None,
        };
        if wo.is_some_and(|wo| wo.len() != u.len()) {
            return Err(PyValueError::new_err("wo and u must have one length"));
        }
        let drawn = self.map(py, u.len(), |p, i| {
            let s = p.shading.as_ref()?;
            let dir = |w: [f32; 3]| s.frame.to_local(Dir::normalize(Vec3::from_array(w)));
            let wo = wo.map_or_else(|| s.frame.to_local(p.si.wo), |wo| dir(wo[i]));
            let [lobe, x, y] = u[i];
            let sample = s.bsdf.sample(wo, lobe, [x, y], TransportMode::Radiance)?;
            Some((s.frame.to_world(sample.wi).0.to_array(), sample.weight.rgb(), sample.density))
        })?;
        let d = PyDict::new(py);
        let wi = drawn.iter().map(|s| s.map_or([0.0; 3], |s| s.0)).collect();
        let weight = drawn.iter().map(|s| s.map_or([0.0; 3], |s| s.1)).collect();
        d.set_item("wi", arrays::rows(py, wi)?)?;
        d.set_item("weight", arrays::rows(py, weight)?)?;
        densities(py, &d, drawn.iter().map(|s| s.map(|s| s.2)))?;
        Ok(d)
    }

    /// Light that may reach the points, one light each, chosen and sampled with three numbers.
    fn sample_lights<'py>(
        &self,
        py: Python<'py>,
        u: PyReadonlyArray2<'py, f32>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let u = rows::<3>("u", &u)?;
        let scene = &self.opened.scene;
        let drawn = self.map(py, u.len(), |p, i| {
            let from = p.shading.as_ref().map_or_else(|| p.si.light_context(), |s| s.light_context(&p.si));
            let [choice, x, y] = u[i];
            let (light, chance) = scene.light_selector.select(&from, choice)?;
            let sample = scene.lights.sample(light, &from, [x, y], &Wavelengths::RGB)?;
            let visible = scene.unoccluded(&from, &sample);
            // The choice of the light is in the density.
            let li = sample.li.rgb().map(|x| x / chance);
            Some((sample.wi.0.to_array(), li, sample.density, visible))
        })?;
        let d = PyDict::new(py);
        let wi = drawn.iter().map(|s| s.map_or([0.0; 3], |s| s.0)).collect();
        let li = drawn.iter().map(|s| s.map_or([0.0; 3], |s| s.1)).collect();
        d.set_item("wi", arrays::rows(py, wi)?)?;
        d.set_item("li", arrays::rows(py, li)?)?;
        d.set_item("visible", arrays::vector(py, drawn.iter().map(|s| s.is_some_and(|s| s.3)).collect()))?;
        densities(py, &d, drawn.iter().map(|s| s.map(|s| s.2)))?;
        Ok(d)
    }

    /// Where rays that leave along `wi` begin, safely off the surface.
    fn spawn<'py>(&self, py: Python<'py>, wi: PyReadonlyArray2<'py, f32>) -> PyResult<Bound<'py, PyAny>> {
        let wi = rows::<3>("wi", &wi)?;
        let origins = self.map(py, wi.len(), |p, i| {
            p.si.spawn_ray(Dir::normalize(Vec3::from_array(wi[i]))).origin.0.to_array()
        })?;
        Ok(arrays::rows(py, origins)?.into_any())
    }
}

/// Densities per steradian, and where it is the probability of a delta instead.
fn densities(
    py: Python<'_>,
    d: &Bound<'_, PyDict>,
    all: impl Iterator<Item = Option<Density>>,
) -> PyResult<()> {
    let (pdf, delta): (Vec<f32>, Vec<bool>) = all
        .map(|density| match density {
            Some(Density::Smooth(pdf)) => (pdf.value(), false),
            Some(Density::Delta { probability }) => (probability, true),
            None => (0.0, false),
        })
        .unzip();
    d.set_item("pdf", arrays::vector(py, pdf))?;
    d.set_item("delta", arrays::vector(py, delta))
}
