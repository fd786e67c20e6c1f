//! Meshes that a description gives away: they become the scene's own instead of being copied, so that a scene that nobody else holds
//! is in memory once.

use std::sync::Arc;

use scene_desc::{Geometry, MeshDesc, SceneDesc, ShapeDesc};

/// Meshes by their shapes: those of the world, then those of objects, in order. None where the description keeps a mesh.
#[derive(Default)]
pub(super) struct Taken(Vec<Option<MeshDesc>>);

impl Taken {
    /// Takes what nobody else holds, and what nothing but geometry needs.
    pub(super) fn from(desc: &mut SceneDesc) -> Self {
        let of_objects = desc.objects.iter_mut().flat_map(|o| &mut o.shapes);
        Self(desc.shapes.iter_mut().chain(of_objects).map(take).collect())
    }

    /// The mesh of a shape, once.
    pub(super) fn mesh(&mut self, shape: usize) -> Option<MeshDesc> {
        self.0.get_mut(shape)?.take()
    }
}

fn take(shape: &mut ShapeDesc) -> Option<MeshDesc> {
    let Geometry::Mesh(mesh) = &mut shape.geometry else { return None };
    let mesh = Arc::get_mut(mesh)?;
    // Reliefs and textures look at the description.
    let is_plain = shape.displacement.is_none() && mesh.attributes.is_empty() && !mesh.is_moving();
    is_plain.then(|| std::mem::take(mesh))
}
