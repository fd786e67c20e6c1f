//! Every kernel and every tree gives the bits that trying all primitives gives.

mod common;

use common::{Mesh, Random, rays, soup};
use math::{AnimatedTransform, DVec3, Dir, Point, Ray, Transform, Vec3};
use steradian_accel::{
    Accel, Blas, BuildOptions, Curve, CurveKind, Cylinder, Disk, Geometry, Hit, Instance, Isa, Shape, Sphere,
    TreeKind, accept_all,
};

fn bits(hit: Option<Hit>) -> Option<[u32; 6]> {
    hit.map(|h| [h.t.to_bits(), h.u.to_bits(), h.v.to_bits(), h.instance, h.geometry, h.primitive])
}

/// Lets about half of the hits through, by what they are.
fn coin(hit: &Hit) -> bool {
    math::hash::of_floats(&[hit.u, hit.v, hit.primitive as f32]) & 1 == 0
}

fn check(build: &dyn Fn(TreeKind) -> Accel, rays: &[Ray]) {
    let accel = build(TreeKind::Halves);
    let expected: Vec<_> = rays.iter().map(|r| accel.intersect_by_trying_all(r, &mut coin)).collect();
    let found = expected.iter().flatten().count();
    assert!(found * 8 > rays.len(), "{found} hits of {} rays test too little", rays.len());
    for tree in TreeKind::ALL {
        for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
            let accel = build(tree).with_isa(isa);
            for (ray, expected) in rays.iter().zip(&expected) {
                let hit = accel.intersect(ray, &mut coin);
                assert_eq!(bits(hit), bits(*expected), "{isa:?} {tree:?} {ray:?} {hit:?} {expected:?}");
                assert_eq!(accel.occluded(ray, &mut coin), expected.is_some(), "{isa:?} {tree:?} {ray:?}");
            }
        }
    }
}

fn mesh_of(mesh: &Mesh) -> Shape<'_> {
    Shape::Mesh { positions: &mesh.positions, indices: &mesh.indices }
}

#[test]
fn every_kernel_agrees_with_the_oracle_on_triangles() {
    let mut random = Random::new(1);
    let (a, b) = (soup(300, &mut random), soup(200, &mut random));
    let build = |tree| {
        let all =
            [Geometry::opaque(mesh_of(&a)), Geometry::filtered(mesh_of(&b)), Geometry::opaque(mesh_of(&b))];
        Accel::from_static(Blas::build(&all, &BuildOptions { tree }).unwrap())
    };
    check(&build, &rays(10_000, &a.positions, &mut random));
}

#[test]
fn every_kernel_agrees_with_the_oracle_on_other_primitives() {
    let mut random = Random::new(2);
    let (a, b) = (soup(60, &mut random), soup(60, &mut random));
    let end: Vec<Vec3> = b.positions.iter().map(|p| *p + Vec3::splat(0.4)).collect();
    let place = |v: Vec3| Transform::translate(v.as_dvec3()) * Transform::rotate(DVec3::ONE, 1.0).unwrap();
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
    let build = |tree| {
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
        Accel::from_static(Blas::build(&all, &BuildOptions { tree }).unwrap())
    };
    check(&build, &rays(10_000, &a.positions, &mut random));
}

#[test]
fn every_kernel_agrees_with_the_oracle_on_instances() {
    let mut random = Random::new(3);
    let (a, b) = (soup(40, &mut random), soup(60, &mut random));
    let ball = Sphere::full(0.5, Transform::IDENTITY);
    let instances: Vec<Instance> = (0..30)
        .map(|i| {
            let turn = Transform::rotate(random.dir().0.as_dvec3(), f64::from(random.unit()) * 6.0).unwrap();
            let size = Transform::scale(DVec3::new(0.3, 0.2 + f64::from(random.unit()), -0.5)).unwrap();
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
    let build = |tree| {
        let blas = |g: &[Geometry<'_>]| Blas::build(g, &BuildOptions { tree }).unwrap();
        let world = blas(&[Geometry::opaque(mesh_of(&a))]);
        let objects = vec![
            blas(&[Geometry::filtered(mesh_of(&b))]),
            blas(&[Geometry::opaque(Shape::Sphere(&ball)), Geometry::opaque(mesh_of(&a))]),
        ];
        Accel::new(world, objects, &instances).unwrap()
    };
    check(&build, &rays(3_000, &a.positions, &mut random));
}

#[test]
fn rays_that_are_no_rays_hit_nothing() {
    let mut random = Random::new(4);
    let a = soup(100, &mut random);
    let blas = Blas::build(&[Geometry::opaque(mesh_of(&a))], &BuildOptions::default()).unwrap();
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
        let accel = Accel::from_static(blas.clone()).with_isa(isa);
        let good = Ray::new(Point(Vec3::ZERO), Dir(Vec3::X), 0.0);
        let bad = [
            Ray { origin: Point(Vec3::NAN), ..good },
            Ray { dir: Dir(Vec3::NAN), ..good },
            Ray { dir: Dir(Vec3::ZERO), ..good },
            Ray { origin: Point(Vec3::INFINITY), ..good },
            Ray { t_max: f32::NAN, ..good },
            Ray { t_max: 0.0, ..good },
            Ray { t_max: -1.0, ..good },
        ];
        for ray in bad {
            assert!(accel.intersect(&ray, &mut accept_all).is_none(), "{ray:?}");
            assert!(!accel.occluded(&ray, &mut accept_all), "{ray:?}");
        }
    }
}

#[test]
fn an_empty_scene_is_empty() {
    let accel = Accel::from_static(Blas::build(&[], &BuildOptions::default()).unwrap());
    assert!(accel.bounds().is_empty());
    assert!(accel.intersect(&Ray::new(Point(Vec3::ZERO), Dir(Vec3::X), 0.0), &mut accept_all).is_none());
}
