//! Looking at a scene's description and changing it, piece by piece, as JSON. `python/steradian/_describe.py` makes and
//! reads the JSON; here it becomes the very types that file readers make.

use pyo3::exceptions::{PyIndexError, PyKeyError};
use pyo3::prelude::*;
use scene_desc::{InstanceDesc, MaterialId, ObjectDesc, SceneDesc, ShapeDesc, Span};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::errors::error;
use crate::geometry::Geometry;
use crate::scene::Scene;

/// What a description can be made of: its schema, and the defaults of every kind.
#[pyfunction]
pub(crate) fn schema(py: Python<'_>) -> PyResult<(String, String)> {
    let text = |json: serde_json::Result<String>| json.map_err(|e| error(py, "SceneError", &e.to_string()));
    let schema = text(serde_json::to_string(&schemars::schema_for!(SceneDesc)))?;
    Ok((schema, text(serde_json::to_string(&scene_desc::prototypes()))?))
}

/// Something done to the list that a section's name stands for, borrowed as `[&]` or `[&mut]`.
macro_rules! with_list {
    ([$($borrow:tt)+] $desc:expr, $section:expr, |$list:ident| $do:expr) => {
        with_list!(all [$($borrow)+] $desc, $section, $list, $do, materials textures images media lights instances)
    };
    (all $borrow:tt $desc:expr, $section:expr, $list:ident, $do:expr, $($name:ident)+) => {
        match $section {
            $(stringify!($name) => with_list!(one $borrow $desc, $name, $list, $do),)+
            other => Err(PyKeyError::new_err(other.to_owned())),
        }
    };
    (one [$($borrow:tt)+] $desc:expr, $name:ident, $list:ident, $do:expr) => {{
        let $list = $($borrow)+ $desc.$name;
        $do
    }};
}

#[pymethods]
impl Scene {
    /// An empty scene.
    #[new]
    fn new(strict: bool) -> Self {
        Self::from_desc(SceneDesc::default(), strict)
    }

    /// How many things a list has.
    fn len(&self, py: Python<'_>, section: &str) -> PyResult<usize> {
        let desc = self.desc(py);
        match section {
            "shapes" => Ok(desc.shapes.len()),
            "objects" => Ok(desc.objects.len()),
            _ => with_list!([&] desc, section, |list| Ok(list.len())),
        }
    }

    /// The names of the things in a list.
    fn names(&self, py: Python<'_>, section: &str) -> PyResult<Vec<String>> {
        let desc = self.desc(py);
        match section {
            "materials" => Ok(desc.materials.iter().map(|m| m.name.clone()).collect()),
            "textures" => Ok(desc.textures.iter().map(|t| t.name.clone()).collect()),
            "media" => Ok(desc.media.iter().map(|m| m.name.clone()).collect()),
            "objects" => Ok(desc.objects.iter().map(|o| o.name.clone()).collect()),
            "images" => Ok(desc.images.iter().map(|i| i.path.display().to_string()).collect()),
            other => Err(PyKeyError::new_err(other.to_owned())),
        }
    }

    /// One thing of a list.
    fn get(&self, py: Python<'_>, section: &str, index: usize) -> PyResult<String> {
        let desc = self.desc(py);
        with_list!([&] desc, section, |list| to_json(py, list.get(index).ok_or_else(|| no(index))?))
    }

    /// Puts a thing into a list, in the place of another or at the end; gives its index.
    fn put(&self, py: Python<'_>, section: &str, index: Option<usize>, json: &str) -> PyResult<usize> {
        self.edit(py, |desc| with_list!([&mut] desc, section, |list| put(list, index, from_json(py, json)?)))
    }

    /// Takes lights, shapes or instances away.
    fn remove(&self, py: Python<'_>, section: &str, index: usize) -> PyResult<()> {
        fn take<T>(list: &mut Vec<T>, index: usize) -> PyResult<()> {
            if index >= list.len() {
                return Err(no(index));
            }
            list.remove(index);
            Ok(())
        }
        self.edit(py, |desc| match section {
            "lights" => take(&mut desc.lights, index),
            "shapes" => take(&mut desc.shapes, index),
            "instances" => take(&mut desc.instances, index),
            other => Err(PyKeyError::new_err(other.to_owned())),
        })
    }

    /// Camera, film, filter, sampler or integrator.
    fn get_one(&self, py: Python<'_>, section: &str) -> PyResult<String> {
        let desc = self.desc(py);
        match section {
            "camera" => to_json(py, &desc.camera),
            "film" => to_json(py, &desc.film),
            "filter" => to_json(py, &desc.filter),
            "sampler" => to_json(py, &desc.sampler),
            "integrator" => to_json(py, &desc.integrator),
            other => Err(PyKeyError::new_err(other.to_owned())),
        }
    }

    /// Another camera, film, filter, sampler or integrator.
    fn set_one(&self, py: Python<'_>, section: &str, json: &str) -> PyResult<()> {
        self.edit(py, |desc| {
            match section {
                "camera" => desc.camera = from_json(py, json)?,
                "film" => desc.film = from_json(py, json)?,
                "filter" => desc.filter = from_json(py, json)?,
                "sampler" => desc.sampler = from_json(py, json)?,
                "integrator" => desc.integrator = from_json(py, json)?,
                other => return Err(PyKeyError::new_err(other.to_owned())),
            }
            Ok(())
        })
    }

    /// A shape without its geometry, and the geometry.
    fn get_shape(&self, py: Python<'_>, index: usize) -> PyResult<(String, Geometry)> {
        let desc = self.desc(py);
        let shape = desc.shapes.get(index).ok_or_else(|| no(index))?;
        let (json, geometry) = taken_apart(py, shape)?;
        Ok((json, Geometry { geometry }))
    }

    /// Puts a shape in the place of another or at the end; gives its index.
    fn put_shape(
        &self,
        py: Python<'_>,
        index: Option<usize>,
        json: &str,
        geometry: PyRef<'_, Geometry>,
    ) -> PyResult<usize> {
        let shape = put_together(py, json, &geometry)?;
        self.edit(py, |desc| put(&mut desc.shapes, index, shape))
    }

    /// Adds an object that instances repeat; gives its index.
    fn add_object(
        &self,
        py: Python<'_>,
        name: String,
        shapes: Vec<(String, PyRef<'_, Geometry>)>,
        instances: &str,
    ) -> PyResult<usize> {
        let shapes = shapes.iter().map(|(json, g)| put_together(py, json, g)).collect::<PyResult<_>>()?;
        let instances: Vec<InstanceDesc> = from_json(py, instances)?;
        self.edit(py, |desc| put(&mut desc.objects, None, ObjectDesc { name, shapes, instances }))
    }
}

fn no(index: usize) -> PyErr {
    PyIndexError::new_err(format!("there is no number {index}"))
}

fn put<T>(list: &mut Vec<T>, index: Option<usize>, thing: T) -> PyResult<usize> {
    match index {
        Some(i) => {
            *list.get_mut(i).ok_or_else(|| no(i))? = thing;
            Ok(i)
        }
        None => {
            list.push(thing);
            Ok(list.len() - 1)
        }
    }
}

/// A shape's JSON has a placeholder for its geometry, which may be large.
fn taken_apart(py: Python<'_>, shape: &ShapeDesc) -> PyResult<(String, scene_desc::Geometry)> {
    let placeholder = scene_desc::Geometry::Sphere { radius: 1.0, z_min: -1.0, z_max: 1.0, phi_max: 360.0 };
    let rest = ShapeDesc {
        geometry: placeholder,
        world_from_object: shape.world_from_object,
        reverse_orientation: shape.reverse_orientation,
        material: MaterialId(shape.material.0),
        alpha: shape.alpha.clone(),
        displacement: shape.displacement.clone(),
        area_light: shape.area_light.clone(),
        medium_interface: shape.medium_interface,
        span: Span::NONE,
    };
    Ok((to_json(py, &rest)?, shape.geometry.clone()))
}

fn put_together(py: Python<'_>, json: &str, geometry: &Geometry) -> PyResult<ShapeDesc> {
    let rest: ShapeDesc = from_json(py, json)?;
    Ok(ShapeDesc { geometry: geometry.geometry.clone(), ..rest })
}

fn to_json(py: Python<'_>, value: &impl Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(|e| error(py, "SceneError", &e.to_string()))
}

fn from_json<T: DeserializeOwned>(py: Python<'_>, json: &str) -> PyResult<T> {
    serde_json::from_str(json).map_err(|e| {
        // Where it stands in the JSON tells nobody anything.
        let text = e.to_string();
        let sentence = text.split(" at line ").next().unwrap_or(&text);
        error(py, "SceneError", sentence)
    })
}
