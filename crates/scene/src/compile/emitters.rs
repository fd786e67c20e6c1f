//! Shapes that emit, in the words of the lights.

use scene_desc::{AreaLightDesc, Geometry, ShapeDesc};

use crate::lights::{EmitterGeometry, EmitterSource};
use crate::shapes::ShapeGeometry;

/// The light of a shape of the world; `None` for a form that cannot emit.
pub(crate) fn source<'a>(
    desc: &'a ShapeDesc,
    light: &'a AreaLightDesc,
    baked: &'a ShapeGeometry,
    visible: bool,
) -> Option<EmitterSource<'a>> {
    let world_from_object = desc.world_from_object.start_ref();
    let (geometry, flip) = match baked {
        ShapeGeometry::Mesh(m) => (
            EmitterGeometry::Mesh {
                positions: &m.positions,
                normals: &m.normals,
                uvs: &m.uvs,
                indices: &m.indices,
            },
            m.flip,
        ),
        ShapeGeometry::Patches(m) => (
            EmitterGeometry::BilinearMesh {
                positions: &m.positions,
                normals: &m.normals,
                uvs: &m.uvs,
                indices: &m.indices,
            },
            m.flip,
        ),
        ShapeGeometry::Strand(_) => return None,
        ShapeGeometry::Quadric(_) => {
            let geometry = match desc.geometry {
                Geometry::Sphere { radius, z_min, z_max, phi_max } => {
                    EmitterGeometry::Sphere { radius, z: [z_min, z_max], phi_max, world_from_object }
                }
                Geometry::Disk { height, radius, inner_radius, phi_max } => EmitterGeometry::Disk {
                    height,
                    radii: [radius, inner_radius],
                    phi_max,
                    world_from_object,
                },
                Geometry::Cylinder { radius, z_min, z_max, phi_max } => {
                    EmitterGeometry::Cylinder { radius, z: [z_min, z_max], phi_max, world_from_object }
                }
                Geometry::Mesh(_)
                | Geometry::BilinearMesh(_)
                | Geometry::LoopSubdiv(_)
                | Geometry::Curve(_) => return None,
            };
            (geometry, desc.reverse_orientation)
        }
    };
    Some(EmitterSource { geometry, flip, visible, desc: light })
}
