//! Rays aimed at shared edges and vertices of closed meshes from inside: how many get out?

use math::{Dir, Point, Ray, Vec3};
use rayon::prelude::*;
use steradian_accel::{Accel, Blas, BuildOptions, Geometry, Shape, accept_all};

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
        let missed: u64 =
            (0..batches).into_par_iter().map(|b| leaks(&accel, &mesh, (center, radius), b)).sum();
        println!("sphere {name}: {missed} of {} rays leave", batches * BATCH);
    }
}

fn leaks(accel: &Accel, mesh: &Mesh, (center, radius): (Vec3, f32), batch: u64) -> u64 {
    let mut missed = 0;
    for i in batch * BATCH..(batch + 1) * BATCH {
        let r = |dimension: u64| crate::workload::unit(i, dimension);
        let face = mesh.indices[(r(0) * mesh.indices.len() as f32) as usize % mesh.indices.len()];
        let side = (i % 3) as usize;
        let [a, b] = [face[side], face[(side + 1) % 3]].map(|v| mesh.positions[v as usize]);
        let target = if i.is_multiple_of(4) { a } else { a.lerp(b, r(1)) };
        let origin = center + (Vec3::new(r(2), r(3), r(4)) - 0.5) * radius;
        let ray = Ray::new(Point(origin), Dir::normalize(target - origin), 0.0);
        // In turn by the two searches, which visit nodes in another order.
        missed += u64::from(if i % 2 == 0 {
            accel.intersect(&ray, &mut accept_all).is_none()
        } else {
            !accel.occluded(&ray, &mut accept_all)
        });
    }
    missed
}
