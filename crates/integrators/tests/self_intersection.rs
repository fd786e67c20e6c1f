//! A ray that leaves a flat surface does not find that surface again, also where the plane's coordinate is exactly
//! zero, so that bounds relative to the coordinates say nothing.

mod common;

use math::{Dir, Point, Ray, Vec3};
use sampling::{rng::Rng, warp};

#[test]
fn rays_off_planes_through_zero_escape() {
    let scene = common::scene("planes", false);
    let mut rng = Rng::new(3);
    let mut counts = std::collections::BTreeMap::<u32, [u32; 2]>::new();
    for _ in 0..40_000 {
        let mut u = || [rng.next_f32(), rng.next_f32()];
        let [x, z] = u().map(|u| 2.8 * u - 1.4);
        let down = warp::uniform_hemisphere(u()).0;
        let dir = Dir(Vec3::new(down.x, -down.z, down.y));
        let from = Point::new(x - 3.0 * dir.0.x / -dir.0.y, 3.0, z - 3.0 * dir.0.z / -dir.0.y);
        let ray = Ray::new(from, dir, 0.0);
        let Some(hit) = scene.intersect(&ray) else { continue };
        let si = scene.interaction(&ray, &hit);
        let up = warp::uniform_hemisphere(u()).0;
        let on = si.spawn_ray(Dir(Vec3::new(up.x, up.z, up.y)));
        let count = counts.entry(si.shape.0).or_default();
        count[0] += 1;
        count[1] += u32::from(scene.occluded(&on) || scene.intersect(&on).is_some());
    }
    assert_eq!(counts.len(), 4, "every shape is hit: {counts:?}");
    assert!(counts.values().all(|c| c[0] > 1000 && c[1] == 0), "hits and self-hits by shape: {counts:?}");
}
