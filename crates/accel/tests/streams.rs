//! Many rays at once have the bits of one ray after the other.

mod common;

use common::{Random, bits, bundles, rays, scenes};
use math::{Dir, Point, Ray, Vec3};
use steradian_accel::{Accel, Hit, Isa, TreeKind, accept_all_of};

/// Lets about half of the hits through, by what they are and whose.
fn coin(ray: &Ray, hit: &Hit) -> bool {
    math::hash::of_floats(&[hit.u, hit.v, hit.primitive as f32, ray.dir.0.x]) & 1 == 0
}

/// Traces the rays in batches of the sizes given, in turn, and compares.
fn check(accel: &Accel, rays: &[Ray], mut sizes: impl Iterator<Item = usize>) {
    let (mut first, mut found) = (0, 0);
    while first < rays.len() {
        let n = sizes.next().unwrap_or(16).min(rays.len() - first);
        let batch = &rays[first..first + n];
        let (mut hits, mut blocked) = (vec![None; n], vec![false; n]);
        accel.intersect_many(batch, &mut hits, &mut |i, hit| coin(&batch[i], hit));
        accel.occluded_many(batch, &mut blocked, &mut |i, hit| coin(&batch[i], hit));
        for (i, ray) in batch.iter().enumerate() {
            let expected = accel.intersect(ray, &mut |hit| coin(ray, hit));
            let isa = accel.isa();
            assert_eq!(
                bits(hits[i]),
                bits(expected),
                "{isa:?} {i} of {n}: {ray:?} {:?} {expected:?}",
                hits[i]
            );
            assert_eq!(blocked[i], expected.is_some(), "{isa:?} {i} of {n}: {ray:?}");
            found += usize::from(expected.is_some());
        }
        first += n;
    }
    assert!(found * 8 > rays.len(), "{found} hits of {} rays test too little", rays.len());
}

fn every_kernel(scene: &scenes::Scene, random: &mut Random, n: usize) {
    let mut mixed = rays(n, &scene.targets, random);
    mixed.extend(bundles(n, &scene.targets, random));
    mixed.extend(rays(n / 10, &scene.targets, random));
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
        let accel = (scene.build)(TreeKind::default()).with_isa(isa);
        check(&accel, &mixed, (0..=70).cycle());
        mixed.reverse();
        check(&accel, &mixed, std::iter::repeat(4096));
    }
}

#[test]
fn batches_of_any_size_give_the_bits_of_single_rays_on_triangles() {
    let mut random = Random::new(21);
    let scene = scenes::triangles(&mut random);
    every_kernel(&scene, &mut random, 20_000);
}

#[test]
fn batches_of_any_size_give_the_bits_of_single_rays_on_few_triangles() {
    let mut random = Random::new(26);
    let scene = scenes::small_room(&mut random);
    every_kernel(&scene, &mut random, 20_000);
}

#[test]
fn batches_of_any_size_give_the_bits_of_single_rays_on_other_primitives() {
    let mut random = Random::new(22);
    let scene = scenes::other_primitives(&mut random);
    every_kernel(&scene, &mut random, 10_000);
}

#[test]
fn batches_of_any_size_give_the_bits_of_single_rays_on_instances() {
    let mut random = Random::new(23);
    let scene = scenes::instances(&mut random);
    every_kernel(&scene, &mut random, 5_000);
}

#[test]
fn rays_that_are_no_rays_disturb_none_of_their_batch() {
    for scene in [scenes::triangles, scenes::small_room] {
        rays_that_are_no_rays(scene);
    }
}

fn rays_that_are_no_rays(scene: fn(&mut Random) -> scenes::Scene) {
    let mut random = Random::new(24);
    let scene = scene(&mut random);
    let mut mixed = bundles(2000, &scene.targets, &mut random);
    for (i, ray) in mixed.iter_mut().enumerate() {
        match i % 9 {
            0 => ray.origin = Point(Vec3::NAN),
            2 => ray.dir = Dir(Vec3::ZERO),
            3 => ray.dir = Dir(Vec3::new(f32::NAN, 1.0, 0.0)),
            5 => ray.t_max = f32::NAN,
            7 => ray.t_max = [0.0, -1.0, -0.0][i % 3],
            _ => {}
        }
    }
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
        let accel = (scene.build)(TreeKind::default()).with_isa(isa);
        check(&accel, &mixed, (0..=70).cycle());
        check(&accel, &mixed, std::iter::repeat(600));
    }
}

#[test]
fn rays_without_a_place_for_their_hit_are_left_out() {
    let mut random = Random::new(25);
    let scene = scenes::triangles(&mut random);
    let (accel, rays) = ((scene.build)(TreeKind::default()), bundles(100, &scene.targets, &mut random));
    let (mut hits, mut blocked) = ([None; 5], [true; 120]);
    accel.intersect_many(&rays, &mut hits, &mut accept_all_of);
    accel.occluded_many(&rays[..50], &mut blocked, &mut accept_all_of);
    for (ray, hit) in rays.iter().zip(hits) {
        assert_eq!(bits(hit), bits(accel.intersect(ray, &mut |_| true)));
    }
    assert!(blocked[50..].iter().all(|b| *b), "what has no ray is not written");
}
