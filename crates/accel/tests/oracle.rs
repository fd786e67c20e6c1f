//! Every kernel and every tree gives the bits that trying all primitives gives.

mod common;

use common::{Random, bits, rays, scenes, scenes::mesh_of, soup};
use math::{Dir, Point, Ray, Vec3};
use steradian_accel::{Accel, Blas, BuildOptions, Geometry, Hit, Isa, TreeKind, accept_all};

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

#[test]
fn every_kernel_agrees_with_the_oracle_on_triangles() {
    let mut random = Random::new(1);
    let scene = scenes::triangles(&mut random);
    check(&scene.build, &rays(10_000, &scene.targets, &mut random));
}

#[test]
fn every_kernel_agrees_with_the_oracle_on_other_primitives() {
    let mut random = Random::new(2);
    let scene = scenes::other_primitives(&mut random);
    check(&scene.build, &rays(10_000, &scene.targets, &mut random));
}

#[test]
fn every_kernel_agrees_with_the_oracle_on_instances() {
    let mut random = Random::new(3);
    let scene = scenes::instances(&mut random);
    check(&scene.build, &rays(3_000, &scene.targets, &mut random));
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
