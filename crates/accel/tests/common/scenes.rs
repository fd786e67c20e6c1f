//! Scenes of every kind of primitive, with filters, for each tree.

use math::{AnimatedTransform, DVec3, Transform, Vec3};
use steradian_accel::{
    Accel, Blas, BuildOptions, Curve, CurveKind, Cylinder, Disk, Geometry, Instance, Shape, Sphere, TreeKind,
};

use super::{Mesh, Random, closed_sphere, soup};

/// A scene for each tree, and points to aim at.
pub(crate) struct Scene {
    pub(crate) build: Box<dyn Fn(TreeKind) -> Accel>,
    pub(crate) targets: Vec<Vec3>,
}

pub(crate) fn mesh_of(mesh: &Mesh) -> Shape<'_> {
    Shape::Mesh { positions: &mesh.positions, indices: &mesh.indices }
}

/// Triangles, half of them filtered.
pub(crate) fn triangles(random: &mut Random) -> Scene {
    filtered_and_not(soup(300, random), soup(200, random))
}

/// A closed room of few triangles with a few in it.
pub(crate) fn small_room(random: &mut Random) -> Scene {
    filtered_and_not(closed_sphere(4, 5, 2.0, Vec3::ZERO), soup(8, random))
}

/// Triangles that are opaque, and others of which each is filtered and opaque too.
fn filtered_and_not(a: Mesh, b: Mesh) -> Scene {
    let targets = a.positions.clone();
    let build = move |tree| {
        let all =
            [Geometry::opaque(mesh_of(&a)), Geometry::filtered(mesh_of(&b)), Geometry::opaque(mesh_of(&b))];
        Accel::from_static(Blas::build(&all, &BuildOptions { tree }).expect("a proper scene"))
    };
    Scene { build: Box::new(build), targets }
}

/// One of each other primitive, and triangles at rest and moving.
pub(crate) fn other_primitives(random: &mut Random) -> Scene {
    let (a, b) = (soup(60, random), soup(60, random));
    let end: Vec<Vec3> = b.positions.iter().map(|p| *p + Vec3::splat(0.4)).collect();
    let place = |v: Vec3| {
        Transform::translate(v.as_dvec3()) * Transform::rotate(DVec3::ONE, 1.0).expect("a proper transform")
    };
    let sphere = Sphere { z_min: -0.3, phi_max: 4.0, ..Sphere::full(0.5, place(random.vec())) };
    let full = Sphere::full(0.4, place(random.vec()));
    let disk = Disk {
        height: 0.1,
        radius: 0.8,
        inner_radius: 0.2,
        phi_max: 5.0,
        object_from_local: place(random.vec()),
    };
    let tube = Cylinder {
        radius: 0.3,
        z_min: -1.0,
        z_max: 1.0,
        phi_max: 4.0,
        object_from_local: place(random.vec()),
    };
    let patches: Vec<Vec3> = (0..40).map(|_| random.vec() * 2.0).collect();
    let faces: Vec<[u32; 4]> = (0..10).map(|i| [4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 3]).collect();
    let kinds = [CurveKind::Flat, CurveKind::Cylinder, CurveKind::Ribbon([Vec3::X, Vec3::Y])];
    let curves: Vec<Curve> = (0..12)
        .map(|i| Curve {
            points: [(); 4].map(|()| random.vec() * 2.0),
            widths: [0.2, 0.05],
            kind: kinds[i % 3],
        })
        .collect();
    let targets = a.positions.clone();
    let build = move |tree| {
        let moving =
            Shape::MovingMesh { positions: [&b.positions, &end], times: [0.25, 0.75], indices: &b.indices };
        let all = [
            Geometry::opaque(mesh_of(&a)),
            Geometry::filtered(moving),
            Geometry::opaque(Shape::Sphere(&sphere)),
            Geometry::filtered(Shape::Sphere(&full)),
            Geometry::opaque(Shape::Disk(&disk)),
            Geometry::filtered(Shape::Cylinder(&tube)),
            Geometry::opaque(Shape::PatchMesh { positions: &patches, indices: &faces }),
            Geometry::opaque(Shape::Curves(&curves)),
        ];
        Accel::from_static(Blas::build(&all, &BuildOptions { tree }).expect("a proper scene"))
    };
    Scene { build: Box::new(build), targets }
}

/// Instances, some of them moving, and triangles of the world.
pub(crate) fn instances(random: &mut Random) -> Scene {
    let (a, b) = (soup(40, random), soup(60, random));
    let ball = Sphere::full(0.5, Transform::IDENTITY);
    let instances: Vec<Instance> = (0..30)
        .map(|i| {
            let turn = Transform::rotate(random.dir().0.as_dvec3(), f64::from(random.unit()) * 6.0)
                .expect("a proper transform");
            let size = Transform::scale(DVec3::new(0.3, 0.2 + f64::from(random.unit()), -0.5))
                .expect("a proper transform");
            let start = Transform::translate(random.vec().as_dvec3() * 2.0) * turn * size;
            let end = Transform::translate(DVec3::new(0.0, 0.5, 0.2)) * start * turn;
            let world_from_object = if i % 3 == 0 {
                AnimatedTransform::new(start, end, [0.0, 1.0])
            } else {
                AnimatedTransform::fixed(if i % 3 == 1 { start } else { Transform::IDENTITY })
            };
            Instance { object: i % 2, world_from_object }
        })
        .collect();
    let targets = a.positions.clone();
    let build = move |tree| {
        let blas = |g: &[Geometry<'_>]| Blas::build(g, &BuildOptions { tree }).expect("a proper scene");
        let world = blas(&[Geometry::opaque(mesh_of(&a))]);
        let objects = vec![
            blas(&[Geometry::filtered(mesh_of(&b))]),
            blas(&[Geometry::opaque(Shape::Sphere(&ball)), Geometry::opaque(mesh_of(&a))]),
        ];
        Accel::new(world, objects, &instances).expect("objects that are there")
    };
    Scene { build: Box::new(build), targets }
}
