//! Forms of shapes: quadrics as data, meshes from arrays. Behind an `Arc`: a scene and Python share them.

use std::sync::Arc;

use math::{Vec2, Vec3};
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use scene_desc::{BilinearMesh, CurveDesc, CurveKind, LoopSubdiv, MeshDesc};

use crate::arrays;
use crate::errors::error;

/// A form, in object space.
#[pyclass(frozen, module = "steradian._native")]
pub(crate) struct Geometry {
    pub(crate) geometry: scene_desc::Geometry,
}

/// Arrays of float32 and uint32 by name, C-contiguous: Python sees to it.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Arrays<'py> {
    positions: PyReadonlyArray2<'py, f32>,
    normals: Option<PyReadonlyArray2<'py, f32>>,
    tangents: Option<PyReadonlyArray2<'py, f32>>,
    uvs: Option<PyReadonlyArray2<'py, f32>>,
    end_positions: Option<PyReadonlyArray2<'py, f32>>,
    end_normals: Option<PyReadonlyArray2<'py, f32>>,
    key_times: [f32; 2],
    indices: Option<PyReadonlyArray2<'py, u32>>,
    width: Option<PyReadonlyArray1<'py, f32>>,
    levels: u32,
    facing: String,
    /// Values that meshes carry, as JSON.
    attributes: String,
}

#[pymethods]
impl Geometry {
    /// From JSON, for what has no arrays.
    #[staticmethod]
    fn from_json(py: Python<'_>, json: &str) -> PyResult<Self> {
        let geometry = serde_json::from_str(json).map_err(|e| error(py, "SceneError", &e.to_string()))?;
        Self::checked(py, geometry)
    }

    /// From arrays. Each is copied once, as it is; nothing is converted.
    #[staticmethod]
    fn from_arrays(py: Python<'_>, kind: &str, arrays: Arrays<'_>) -> PyResult<Self> {
        let bad = |name: &str| {
            error(py, "SceneError", &format!("{name} of a {kind}: wrong shape, or not C-contiguous"))
        };
        let rows3 = |name, a: &Option<PyReadonlyArray2<'_, f32>>| match a {
            Some(a) => vec3s(a).ok_or_else(|| bad(name)),
            None => Ok(Vec::new()),
        };
        let positions = vec3s(&arrays.positions).ok_or_else(|| bad("positions"))?;
        let (normals, tangents) = (rows3("normals", &arrays.normals)?, rows3("tangents", &arrays.tangents)?);
        let uvs = match &arrays.uvs {
            Some(a) => vec2s(a).ok_or_else(|| bad("uvs"))?,
            None => Vec::new(),
        };
        let geometry = match kind {
            "mesh" => {
                let indices = corners(&arrays.indices).ok_or_else(|| bad("indices"))?;
                scene_desc::Geometry::Mesh(Arc::new(MeshDesc {
                    positions,
                    normals,
                    tangents,
                    uvs,
                    indices,
                    attributes: serde_json::from_str(&arrays.attributes)
                        .map_err(|e| error(py, "SceneError", &format!("attributes of a mesh: {e}")))?,
                    end_positions: rows3("end_positions", &arrays.end_positions)?,
                    end_normals: rows3("end_normals", &arrays.end_normals)?,
                    key_times: arrays.key_times,
                }))
            }
            "bilinear_mesh" => {
                let indices = corners(&arrays.indices).ok_or_else(|| bad("indices"))?;
                scene_desc::Geometry::BilinearMesh(Arc::new(BilinearMesh {
                    positions,
                    normals,
                    uvs,
                    indices,
                }))
            }
            "loop_subdiv" => {
                let indices = corners(&arrays.indices).ok_or_else(|| bad("indices"))?;
                let levels = arrays.levels;
                scene_desc::Geometry::LoopSubdiv(Arc::new(LoopSubdiv { positions, indices, levels }))
            }
            "curve" => {
                let segments = positions.chunks_exact(4).map(|c| [c[0], c[1], c[2], c[3]]).collect();
                let width = arrays.width.as_ref().and_then(|w| w.as_slice().ok()?.try_into().ok());
                let facing = match arrays.facing.as_str() {
                    "cylinder" => CurveKind::Cylinder,
                    "ribbon" => CurveKind::Ribbon,
                    _ => CurveKind::Flat,
                };
                let width = width.ok_or_else(|| bad("width"))?;
                scene_desc::Geometry::Curve(Arc::new(CurveDesc { segments, kind: facing, width, normals }))
            }
            _ => return Err(error(py, "SceneError", &format!("a {kind} has no arrays"))),
        };
        Self::checked(py, geometry)
    }

    /// JSON of what has no arrays; else the kind alone.
    fn to_json(&self) -> String {
        let kind = match &self.geometry {
            scene_desc::Geometry::Mesh(_) => "mesh",
            scene_desc::Geometry::BilinearMesh(_) => "bilinear_mesh",
            scene_desc::Geometry::LoopSubdiv(_) => "loop_subdiv",
            scene_desc::Geometry::Curve(_) => "curve",
            scene_desc::Geometry::Sphere { .. }
            | scene_desc::Geometry::Disk { .. }
            | scene_desc::Geometry::Cylinder { .. } => {
                return serde_json::to_string(&self.geometry).unwrap_or_default();
            }
        };
        format!("\"{kind}\"")
    }

    /// Copies of its arrays by name; empty for what has none.
    fn to_arrays<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let d = PyDict::new(py);
        let v3 = |v: &[Vec3]| arrays::rows(py, v.iter().map(|p| p.to_array()).collect());
        let v2 = |v: &[Vec2]| arrays::rows(py, v.iter().map(|p| p.to_array()).collect());
        match &self.geometry {
            scene_desc::Geometry::Mesh(m) => {
                d.set_item("positions", v3(&m.positions)?)?;
                d.set_item("normals", v3(&m.normals)?)?;
                d.set_item("tangents", v3(&m.tangents)?)?;
                d.set_item("uvs", v2(&m.uvs)?)?;
                d.set_item("indices", arrays::rows(py, m.indices.clone())?)?;
                d.set_item("attributes", serde_json::to_string(&m.attributes).unwrap_or_default())?;
                d.set_item("end_positions", v3(&m.end_positions)?)?;
                d.set_item("end_normals", v3(&m.end_normals)?)?;
                d.set_item("key_times", m.key_times)?;
            }
            scene_desc::Geometry::BilinearMesh(m) => {
                d.set_item("positions", v3(&m.positions)?)?;
                d.set_item("normals", v3(&m.normals)?)?;
                d.set_item("uvs", v2(&m.uvs)?)?;
                d.set_item("indices", arrays::rows(py, m.indices.clone())?)?;
            }
            scene_desc::Geometry::LoopSubdiv(l) => {
                d.set_item("positions", v3(&l.positions)?)?;
                d.set_item("indices", arrays::rows(py, l.indices.clone())?)?;
                d.set_item("levels", l.levels)?;
            }
            scene_desc::Geometry::Curve(c) => {
                d.set_item("positions", v3(c.segments.as_flattened())?)?;
                d.set_item("normals", v3(&c.normals)?)?;
                d.set_item("width", c.width)?;
                d.set_item("kind", serde_json::to_string(&c.kind).unwrap_or_default().trim_matches('"'))?;
            }
            scene_desc::Geometry::Sphere { .. }
            | scene_desc::Geometry::Disk { .. }
            | scene_desc::Geometry::Cylinder { .. } => {}
        }
        Ok(d)
    }
}

impl Geometry {
    fn checked(py: Python<'_>, geometry: scene_desc::Geometry) -> PyResult<Self> {
        py.detach(|| geometry.check()).map_err(|e| error(py, "SceneError", &e))?;
        Ok(Self { geometry })
    }
}

fn rows<T: numpy::Element + Copy, const N: usize>(a: &PyReadonlyArray2<'_, T>) -> Option<Vec<[T; N]>> {
    let array = a.as_array();
    if array.ncols() != N && array.nrows() > 0 {
        return None;
    }
    Some(a.as_slice().ok()?.as_chunks::<N>().0.to_vec())
}

fn vec3s(a: &PyReadonlyArray2<'_, f32>) -> Option<Vec<Vec3>> {
    let array = a.as_array();
    (array.ncols() == 3).then_some(())?;
    Some(a.as_slice().ok()?.as_chunks::<3>().0.iter().map(|p| Vec3::from_array(*p)).collect())
}

fn vec2s(a: &PyReadonlyArray2<'_, f32>) -> Option<Vec<Vec2>> {
    let array = a.as_array();
    (array.ncols() == 2).then_some(())?;
    Some(a.as_slice().ok()?.as_chunks::<2>().0.iter().map(|p| Vec2::from_array(*p)).collect())
}

fn corners<const N: usize>(a: &Option<PyReadonlyArray2<'_, u32>>) -> Option<Vec<[u32; N]>> {
    a.as_ref().and_then(rows)
}
