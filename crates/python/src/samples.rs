//! Points of samplers, and warps of the unit square, by the array.

use math::{Dir, LocalDir, Vec2, Vec3};
use numpy::PyReadonlyArray2;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use sampling::{Sampler, SamplerKind, warp};

use crate::arrays;
use crate::rays::rows;

/// Points of a sequence in `dimensions` dimensions, row by row: pairs of dimensions, as integrators ask for them.
#[pyfunction]
#[pyo3(signature = (kind, strata, seed, stream, begin, n, dimensions))]
#[expect(clippy::too_many_arguments, reason = "each is one thing that a point depends on")]
pub(crate) fn samples<'py>(
    py: Python<'py>,
    kind: &str,
    strata: [u32; 2],
    seed: u64,
    stream: u32,
    begin: u32,
    n: usize,
    dimensions: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let kind = match kind {
        "sobol" => SamplerKind::Sobol,
        "independent" => SamplerKind::Independent,
        "stratified" if strata.iter().all(|&s| s > 0) => {
            SamplerKind::Stratified { x: strata[0], y: strata[1] }
        }
        other => {
            let text = format!("`sampler` cannot be `{other}`: expected sobol, independent or stratified");
            return Err(crate::errors::error(py, "ParameterError", &text));
        }
    };
    let all = py.detach(|| {
        let mut sampler = Sampler::new(kind, seed);
        let mut all = Vec::with_capacity(n * dimensions);
        for i in 0..n {
            sampler.start([stream as i32, 0], begin.wrapping_add(i as u32));
            for _ in 0..dimensions / 2 {
                all.extend(sampler.next_2d());
            }
            if dimensions % 2 == 1 {
                all.push(sampler.next_1d());
            }
        }
        all
    });
    Ok(arrays::vector(py, all).into_any())
}

/// A warp, its inverse or its density by name. The unit square is (n, 2), directions (n, 3), densities (n, 1).
#[pyfunction]
#[pyo3(name = "warp")]
pub(crate) fn warp_array<'py>(
    py: Python<'py>,
    name: &str,
    x: PyReadonlyArray2<'py, f32>,
) -> PyResult<Bound<'py, PyAny>> {
    macro_rules! each {
        ($n:literal, |$x:ident| $f:expr) => {
            arrays::rows(py, rows::<$n>(name, &x)?.iter().map(|&$x| $f).collect()).map(Bound::into_any)
        };
    }
    let local = |x: [f32; 3]| LocalDir(Vec3::from_array(x));
    let dir = |x: [f32; 3]| Dir(Vec3::from_array(x));
    match name {
        "concentric_disk" => each!(2, |u| warp::concentric_disk(u).to_array()),
        "concentric_disk_inverse" => each!(2, |p| warp::concentric_disk_inverse(Vec2::from_array(p))),
        "concentric_disk_pdf" => each!(2, |p| [warp::concentric_disk_pdf(Vec2::from_array(p)).value()]),
        "uniform_hemisphere" => each!(2, |u| warp::uniform_hemisphere(u).0.to_array()),
        "uniform_hemisphere_inverse" => each!(3, |w| warp::uniform_hemisphere_inverse(local(w))),
        "uniform_hemisphere_pdf" => each!(3, |w| [warp::uniform_hemisphere_pdf(local(w)).value()]),
        "cosine_hemisphere" => each!(2, |u| warp::cosine_hemisphere(u).0.to_array()),
        "cosine_hemisphere_inverse" => each!(3, |w| warp::cosine_hemisphere_inverse(local(w))),
        "cosine_hemisphere_pdf" => each!(3, |w| [warp::cosine_hemisphere_pdf(local(w)).value()]),
        "uniform_sphere" => each!(2, |u| warp::uniform_sphere(u).0.to_array()),
        "uniform_sphere_inverse" => each!(3, |w| warp::uniform_sphere_inverse(dir(w))),
        "uniform_sphere_pdf" => each!(3, |_w| [warp::uniform_sphere_pdf().value()]),
        "equal_area_sphere" => each!(2, |u| warp::equal_area_sphere(u).0.to_array()),
        "equal_area_sphere_inverse" => each!(3, |w| warp::equal_area_sphere_inverse(dir(w))),
        "equal_area_sphere_pdf" => each!(3, |_w| [warp::equal_area_sphere_pdf().value()]),
        other => Err(PyValueError::new_err(format!("there is no warp `{other}`"))),
    }
}
