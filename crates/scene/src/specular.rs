//! Points on the surfaces that mirror or refract: where a search for a specular path may begin [Zeltner2020].
//!
//! Such a search is right with any points, so that these are only about uniform by area: on patches and quadrics as if their
//! parameters were, on an instance that is scaled unevenly as on the object, and on the whole of what is a part of a sphere.
//! Left out: strands.

use std::f32::consts::PI;

use math::{Point, Vec3};
use sampling::distribution::AliasTable;
use sampling::warp;

use crate::Scene;
use crate::shapes::{Mesh, PatchMesh, QuadricKind, Shape, ShapeGeometry};

/// The surfaces of a scene that mirror or refract and do nothing else.
#[derive(Debug)]
pub struct SpecularSurfaces {
    surfaces: Vec<Surface>,
    choice: AliasTable,
}

#[derive(Debug)]
struct Surface {
    shape: u32,
    /// The instance that it is a part of.
    instance: Option<u32>,
    primitives: AliasTable,
}

impl SpecularSurfaces {
    /// Of a scene; `None` if there are none.
    #[must_use]
    pub fn of(scene: &Scene) -> Option<Self> {
        let (mut surfaces, mut areas) = (Vec::new(), Vec::new());
        let mut add = |shape: u32, instance: Option<u32>, scale: f32| {
            let own = &scene.shapes[shape as usize];
            if !scene.materials.may_be_specular(own.material) {
                return;
            }
            let of_primitives = primitive_areas(own);
            if let Some(primitives) = AliasTable::new(&of_primitives) {
                areas.push(of_primitives.iter().sum::<f32>() * scale);
                surfaces.push(Surface { shape, instance, primitives });
            }
        };
        let shapes_end = |object: usize| scene.object_base.get(object).copied();
        let all = scene.shapes.len() as u32;
        for shape in 0..shapes_end(0).unwrap_or(all) {
            add(shape, None, 1.0);
        }
        for (i, instance) in scene.instances.iter().enumerate() {
            let object = instance.object as usize;
            let volume = instance.world_from_object.start().matrix().determinant().abs();
            let scale = math::trig::pow(volume as f32, 2.0 / 3.0);
            for shape in scene.object_base[object]..shapes_end(object + 1).unwrap_or(all) {
                add(shape, Some(i as u32), scale);
            }
        }
        AliasTable::new(&areas).map(|choice| Self { surfaces, choice })
    }

    /// A point on one of them at a moment; `u` chooses the surface, its primitive and the place.
    #[must_use]
    pub fn sample(&self, scene: &Scene, u: [f32; 4], time: f32) -> Point {
        let surface = &self.surfaces[self.choice.sample(u[0]).index];
        let primitive = surface.primitives.sample(u[1]).index as u32;
        let p = point_on(&scene.shapes[surface.shape as usize], primitive, [u[2], u[3]], time);
        match surface.instance {
            None => p,
            Some(i) => scene.instances[i as usize].world_from_object.at(time).point(p),
        }
    }
}

/// Areas of a shape's primitives, in the space of its storage.
fn primitive_areas(shape: &Shape) -> Vec<f32> {
    match &shape.geometry {
        ShapeGeometry::Mesh(m) => (0..m.indices.len()).map(|i| area(triangle(m, i))).collect(),
        // The mean over the motion, by Simpson's rule.
        ShapeGeometry::MovingMesh(m) => {
            let [a, b] = m.times;
            let at = |i: usize, time| area(m.triangle(i as u32, time).0);
            let mean = |i| (at(i, a) + 4.0 * at(i, 0.5 * (a + b)) + at(i, b)) / 6.0;
            (0..m.start.indices.len()).map(mean).collect()
        }
        ShapeGeometry::Patches(m) => (0..m.indices.len())
            .map(|i| {
                let [p00, p10, p01, p11] = m.corners(i as u32);
                0.25 * (p10 + p11 - p00 - p01).cross(p01 + p11 - p00 - p10).length()
            })
            .collect(),
        ShapeGeometry::Quadric(q) => {
            let volume = q.world_from_object.matrix().determinant().abs() as f32;
            let area = match q.kind {
                QuadricKind::Sphere { radius, .. } => 4.0 * PI * radius * radius,
                QuadricKind::Disk { radius, .. } => PI * radius * radius,
                QuadricKind::Cylinder { radius, z_min, z_max, .. } => 2.0 * PI * radius * (z_max - z_min),
            };
            vec![area * math::trig::pow(volume, 2.0 / 3.0)]
        }
        ShapeGeometry::Strand(_) => Vec::new(),
    }
}

fn triangle(mesh: &Mesh, i: usize) -> [Vec3; 3] {
    mesh.indices[i].map(|i| mesh.positions[i as usize])
}

fn area([p0, p1, p2]: [Vec3; 3]) -> f32 {
    0.5 * (p1 - p0).cross(p2 - p0).length()
}

/// At a moment, in the space of the shape's storage.
fn point_on(shape: &Shape, primitive: u32, u: [f32; 2], time: f32) -> Point {
    let on_triangle = |[p0, p1, p2]: [Vec3; 3]| {
        let [x, y] = if u[0] + u[1] > 1.0 { u.map(|u| 1.0 - u) } else { u };
        Point(p0 + (p1 - p0) * x + (p2 - p0) * y)
    };
    match &shape.geometry {
        ShapeGeometry::Mesh(m) => on_triangle(triangle(m, primitive as usize)),
        ShapeGeometry::MovingMesh(m) => on_triangle(m.triangle(primitive, time).0),
        ShapeGeometry::Patches(m) => patch_point(m, primitive, u),
        ShapeGeometry::Quadric(q) => {
            let local = match q.kind {
                QuadricKind::Sphere { radius, .. } => warp::uniform_sphere(u).0 * radius,
                QuadricKind::Disk { height, radius, .. } => {
                    (warp::concentric_disk(u) * radius).extend(height)
                }
                QuadricKind::Cylinder { radius, z_min, z_max, .. } => {
                    let (sin, cos) = math::trig::sin_cos(2.0 * PI * u[0]);
                    Vec3::new(radius * cos, radius * sin, z_min + (z_max - z_min) * u[1])
                }
            };
            q.world_from_object.point(Point(local))
        }
        ShapeGeometry::Strand(s) => Point(s.segments.first().map_or(Vec3::ZERO, |s| s[0])),
    }
}

fn patch_point(mesh: &PatchMesh, patch: u32, [u, v]: [f32; 2]) -> Point {
    let [p00, p10, p01, p11] = mesh.corners(patch);
    Point(p00.lerp(p10, u).lerp(p01.lerp(p11, u), v))
}
