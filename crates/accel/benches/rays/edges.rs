//! Rays aimed at shared edges and vertices of closed meshes from inside: how many get out?

use math::{Dir, Point, Ray, Vec3};
use rayon::prelude::*;
use steradian_accel::{Accel, Blas, BuildOptions, Geometry, Shape, accept_all, accept_all_of};

#[path = "../../tests/common/mod.rs"]
mod common;

use common::{Mesh, closed_sphere};

/// Rays of one task.
const BATCH: u64 = 1 << 16;

/// Aims `n` rays in all at spheres near the origin and far from it, small and large; prints how many leave each.
pub(crate) fn run(n: u64) {
    let spheres = [
        ("at the origin", Vec3::ZERO, 1.0),
        ("200 units away", Vec3::new(100.0, -70.0, 130.0), 1.0),
        ("of radius 1000", Vec3::new(3.0, 1.0, -2.0), 1000.0),
        ("of radius 0.01, a unit away", Vec3::new(0.5, 0.7, -0.4), 0.01),
    ];
    for (name, center, radius) in spheres {
        let mesh = closed_sphere(350, 700, radius, center);
        let shape = Shape::Mesh { positions: &mesh.positions, indices: &mesh.indices };
        let blas = Blas::build(&[Geometry::opaque(shape)], &BuildOptions::default()).expect("a proper mesh");
        let accel = Accel::from_static(blas);
        let batches = n / spheres.len() as u64 / BATCH;
        let leaks = |b| leaks(&accel, &mesh, (center, radius), b);
        let missed: u64 = (0..batches).into_par_iter().map(leaks).sum();
        println!("sphere {name}: {missed} of {} rays leave", batches * BATCH);
    }
}

fn leaks(accel: &Accel, mesh: &Mesh, sphere: (Vec3, f32), batch: u64) -> u64 {
    let first = batch * BATCH;
    if batch.is_multiple_of(2) {
        return (first..first + BATCH)
            .map(|i| u64::from(!is_met(accel, &aimed(mesh, sphere, i, i), i % 2 == 0)))
            .sum();
    }
    // Sixteen side by side, at edges of one face and its neighbours, so that they travel together.
    let (mut hits, mut blocked) = (vec![None; 1 << 10], vec![false; 1 << 10]);
    let mut missed = 0;
    for start in (first..first + BATCH).step_by(hits.len()) {
        let rays: Vec<Ray> =
            (start..start + hits.len() as u64).map(|i| aimed(mesh, sphere, i, i / 16)).collect();
        missed += if start % 2048 == 0 {
            accel.intersect_many(&rays, &mut hits, &mut accept_all_of);
            hits.iter().filter(|h| h.is_none()).count()
        } else {
            accel.occluded_many(&rays, &mut blocked, &mut accept_all_of);
            blocked.iter().filter(|b| !**b).count()
        } as u64;
    }
    missed
}

/// In turn by the two searches, which visit nodes in another order.
fn is_met(accel: &Accel, ray: &Ray, nearest: bool) -> bool {
    if nearest {
        accel.intersect(ray, &mut accept_all).is_some()
    } else {
        accel.occluded(ray, &mut accept_all)
    }
}

/// Ray `i`, from an origin and at a face (or one of the next) that are the same for all of its `group`.
fn aimed(mesh: &Mesh, (center, radius): (Vec3, f32), i: u64, group: u64) -> Ray {
    let (r, own) = (
        |dimension: u64| crate::workload::unit(group, dimension),
        |dimension: u64| crate::workload::unit(i, dimension),
    );
    let near = if i == group { 0 } else { (own(5) * 3.0) as usize };
    let face = (r(0) * mesh.indices.len() as f32) as usize + near;
    let face = mesh.indices[face % mesh.indices.len()];
    let side = (i % 3) as usize;
    let [a, b] = [face[side], face[(side + 1) % 3]].map(|v| mesh.positions[v as usize]);
    let target = if i.is_multiple_of(4) { a } else { a.lerp(b, own(1)) };
    let origin = center + (Vec3::new(r(2), r(3), r(4)) - 0.5) * radius;
    Ray::new(Point(origin), Dir::normalize(target - origin), 0.0)
}
