//! Shapes that emit, in the words of the lights.
//!
//! Most lamps are rectangles of two triangles. Where all of a mesh pairs up into rectangles, each pair is one light:
//! no number is spent on choosing between its halves, and a point is stratified over all of it.

use scene_desc::{AreaLightDesc, Geometry, ShapeDesc};

use crate::lights::{EmitterGeometry, EmitterSource};
use crate::shapes::{Mesh, ShapeGeometry};

/// The light of a shape of the world; `None` for a form that cannot emit.
pub(crate) fn source<'a>(
    desc: &'a ShapeDesc,
    light: &'a AreaLightDesc,
    baked: &'a ShapeGeometry,
    rectangles: Option<&'a [[u32; 4]]>,
) -> Option<EmitterSource<'a>> {
    let world_from_object = desc.world_from_object.start_ref();
    let (geometry, flip) = match baked {
        ShapeGeometry::Mesh(m) => {
            let (positions, normals, uvs) = (&m.positions, &m.normals, &m.uvs);
            let geometry = match rectangles {
                Some(indices) => EmitterGeometry::BilinearMesh { positions, normals, uvs, indices },
                None => EmitterGeometry::Mesh { positions, normals, uvs, indices: &m.indices },
            };
            (geometry, m.flip)
        }
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
    Some(EmitterSource { geometry, flip, visible: true, desc: light })
}

/// The corners of a mesh's rectangles at (u, v) = (0,0), (1,0), (0,1), (1,1), if triangles 2k and 2k + 1 make one for every
/// k. An image or a stated power belongs to triangles, and leaves them apart.
pub(crate) fn rectangles(baked: &ShapeGeometry, light: &AreaLightDesc) -> Option<Vec<[u32; 4]>> {
    let ShapeGeometry::Mesh(mesh) = baked else { return None };
    if light.image.is_some() || light.power.is_some() || mesh.indices.len() % 2 != 0 {
        return None;
    }
    mesh.indices.chunks_exact(2).map(|pair| rectangle(mesh, pair[0], pair[1])).collect()
}

fn rectangle(mesh: &Mesh, a: [u32; 3], b: [u32; 3]) -> Option<[u32; 4]> {
    let at = |i: u32| mesh.positions[i as usize];
    // The edge from s to t of one triangle runs from t to s in the other.
    (0..3).flat_map(|i| (0..3).map(move |k| (i, k))).find_map(|(i, k)| {
        let [x, s, t] = [0, 1, 2].map(|n| a[(i + n) % 3]);
        let [y, t2, s2] = [0, 1, 2].map(|n| b[(k + n) % 3]);
        if at(s) != at(s2) || at(t) != at(t2) {
            return None;
        }
        let (u, v) = (at(s) - at(x), at(t) - at(x));
        let size = u.length() + v.length();
        let closes = (at(x) + u + v - at(y)).length() < 1e-5 * size;
        let is_right = u.dot(v).abs() < 1e-5 * u.length() * v.length();
        (closes && is_right).then_some([x, s, t, y])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use math::Vec3;

    fn mesh(positions: Vec<Vec3>, indices: Vec<[u32; 3]>) -> Mesh {
        Mesh { positions, indices, ..Mesh::default() }
    }

    #[test]
    fn two_halves_of_a_rectangle_are_found_whichever_way_they_are_cut() {
        let corners = vec![Vec3::ZERO, Vec3::X * 2.0, Vec3::new(2.0, 0.0, 1.0), Vec3::Z];
        let by_turns = |n: usize| [[0, 1, 2], [1, 2, 0], [2, 0, 1]][n];
        for (i, k) in (0..3).flat_map(|i| (0..3).map(move |k| (i, k))) {
            let (a, b) = ([0_u32, 1, 2], [0_u32, 2, 3]);
            let (a, b) = (by_turns(i).map(|n| a[n]), by_turns(k).map(|n| b[n]));
            let m = mesh(corners.clone(), vec![a, b]);
            let q = rectangle(&m, a, b).unwrap();
            let p = q.map(|i| m.positions[i as usize]);
            let (n, area) = ((p[1] - p[0]).cross(p[2] - p[0]), 2.0);
            assert!((n.length() - area).abs() < 1e-6 && n.y < 0.0, "the winding's side is kept: {n}");
        }
    }

    #[test]
    fn other_pairs_stay_triangles() {
        let skew = vec![Vec3::ZERO, Vec3::X, Vec3::new(1.3, 1.0, 0.0), Vec3::new(0.3, 1.0, 0.0)];
        assert_eq!(rectangle(&mesh(skew, vec![]), [0, 1, 2], [0, 2, 3]), None, "a rhomboid");
        let square = vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
        assert_eq!(rectangle(&mesh(square, vec![]), [0, 1, 2], [0, 3, 2]), None, "opposite windings");
    }
}
