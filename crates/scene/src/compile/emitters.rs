//! Shapes that emit, in the words of the lights: those of the world, and those of objects once for each instance.
//!
//! Most lamps are rectangles of two triangles. Where all of a mesh pairs up into rectangles, each pair is one light:
//! no number is spent on choosing between its halves, and a point is stratified over all of it.
//!
//! A mesh whose vertices move does not emit: it is said so, with what to write instead.
//!
//! The lights of an instance follow each other, in the order of the object's shapes: a shape of an object knows its
//! lights' place among them, an instance where its lights begin.

use math::{AnimatedTransform, Transform};
use scene_desc::{AreaLightDesc, Geometry, ShapeDesc, Sink};

use super::geometry::{Place, World};
use crate::LightId;
use crate::lights::{AreaEmission, EmitterGeometry, EmitterSource, LightsBuilder};
use crate::shapes::{Mesh, Shape, ShapeGeometry};
use crate::textures::FloatHandle;

/// Adds the lights of all shapes that emit, and tells the shapes of them. Gives the first light of each instance.
pub(super) fn declare(world: &mut World<'_>, lights: &mut LightsBuilder<'_>, sink: &mut Sink) -> Vec<u32> {
    let mut emission = |((desc, _), shape): (&(&ShapeDesc, Place), &Shape)| {
        let light = desc.area_light.as_ref()?;
        if matches!(shape.geometry, ShapeGeometry::MovingMesh(_)) {
            sink.warning(desc.span, "a mesh whose vertices move cannot emit")
                .hint("it is left dark: move it by its transform instead (in pbrt files: no \"P1\")");
            return None;
        }
        lights.add_emission(light, sink)
    };
    let emissions: Vec<Option<AreaEmission>> =
        world.descs.iter().zip(&world.shapes).map(&mut emission).collect();
    let world_len = world.object_base.first().map_or(world.shapes.len(), |b| *b as usize);
    let mut lamps = Lamps { world, emissions: &emissions, lights, sink };
    for i in 0..world_len {
        lamps.add(i, 0, None);
    }

    let mut first = Vec::with_capacity(lamps.world.instances.len());
    for i in 0..lamps.world.instances.len() {
        let instance = lamps.world.instances[i];
        let base = lamps.lights.len() as u32;
        first.push(base);
        let of_object = lamps.world.shapes_of(instance.object);
        for shape in of_object.filter(|s| emissions[*s].is_some()) {
            lamps.add(shape, base, Some(&instance.world_from_object));
        }
    }
    first
}

struct Lamps<'a, 'w, 'l> {
    world: &'a mut World<'w>,
    /// Of each shape, if it emits.
    emissions: &'a [Option<AreaEmission>],
    lights: &'a mut LightsBuilder<'l>,
    sink: &'a mut Sink,
}

impl Lamps<'_, '_, '_> {
    /// Adds the lights of a shape where it is placed; the shape counts them from `base`.
    fn add(&mut self, i: usize, base: u32, placed: Option<&AnimatedTransform>) {
        let (desc, place) = self.world.descs[i];
        let (Some(light), Some(emission)) = (&desc.area_light, self.emissions[i]) else { return };
        let shape = &mut self.world.shapes[i];
        let visible = !matches!(shape.alpha, Some(FloatHandle::Constant(a)) if a <= 0.0);
        let rectangles = rectangles(&shape.geometry, light);
        shape.primitives_per_light = if rectangles.is_some() { 2 } else { 1 };

        // Where it stands at the first key.
        let own = match place {
            Place::World | Place::Object => desc.world_from_object.start(),
            Place::Moving => Transform::IDENTITY,
        };
        let moved = placed.map(|p| (shape.geometry.placed(p.start_ref()), p.start() * own));
        let (form, map) = match &moved {
            Some((form, map)) => (form, map),
            None => (&shape.geometry, &own),
        };
        let Some(source) = source((desc, light), form, map, rectangles.as_deref()) else { return };
        let first = self.lights.add_emitter_of(
            &EmitterSource { visible, motion: placed, ..source },
            emission,
            self.sink,
        );
        shape.first_light = Some(LightId(first.0 - base));
    }
}

/// The light of a shape in world space; `None` for a form that cannot emit.
fn source<'a>(
    (desc, light): (&'a ShapeDesc, &'a AreaLightDesc),
    baked: &'a ShapeGeometry,
    world_from_object: &'a Transform,
    rectangles: Option<&'a [[u32; 4]]>,
) -> Option<EmitterSource<'a>> {
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
        ShapeGeometry::Strand(_) | ShapeGeometry::MovingMesh(_) => return None,
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
    Some(EmitterSource { geometry, flip, visible: true, motion: None, desc: light })
}

/// The corners of a mesh's rectangles at (u, v) = (0,0), (1,0), (0,1), (1,1), if triangles 2k and 2k + 1 make one for every
/// k. An image or a stated power belongs to triangles, and leaves them apart.
fn rectangles(baked: &ShapeGeometry, light: &AreaLightDesc) -> Option<Vec<[u32; 4]>> {
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
