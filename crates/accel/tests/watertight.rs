//! No ray leaves a closed mesh through an edge or a vertex.

mod common;

use common::{Mesh, Random, closed_sphere};
use math::{Dir, Point, Ray, Vec3};
use steradian_accel::{Accel, Blas, BuildOptions, Geometry, Isa, Shape, accept_all};

fn accel(mesh: &Mesh) -> Accel {
    let shape = Shape::Mesh { positions: &mesh.positions, indices: &mesh.indices };
    Accel::from_static(
        Blas::build(&[Geometry::opaque(shape)], &BuildOptions::default()).expect("a proper mesh"),
    )
}

/// Aims `n` rays from `origin` at points of edges and at vertices; counts those that leave.
fn leaks(accel: &Accel, mesh: &Mesh, origin: &mut dyn FnMut(&mut Random) -> Vec3, n: usize) -> usize {
    let mut random = Random::new(7);
    let mut missed = 0;
    for i in 0..n {
        let face = mesh.indices[random.below(mesh.indices.len())];
        let at = random.below(3);
        let [a, b] = [face[at], face[(at + 1) % 3]].map(|v| mesh.positions[v as usize]);
        let target = if i % 4 == 0 { a } else { a.lerp(b, random.unit()) };
        let o = origin(&mut random);
        let ray = Ray::new(Point(o), Dir::normalize(target - o), 0.0);
        missed += usize::from(accel.intersect(&ray, &mut accept_all).is_none());
        missed += usize::from(!accel.occluded(&ray, &mut accept_all));
    }
    missed
}

#[test]
fn no_ray_leaks_from_a_closed_sphere_near_or_far() {
    for (center, radius) in [(Vec3::ZERO, 1.0), (Vec3::new(100.0, -70.0, 130.0), 1.0), (Vec3::ZERO, 1000.0)] {
        let mesh = closed_sphere(100, 200, radius, center);
        for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
            let accel = accel(&mesh).with_isa(isa);
            let inside = &mut |random: &mut Random| center + random.vec() * (radius * 0.5);
            assert_eq!(leaks(&accel, &mesh, inside, 20_000), 0, "{isa:?} inside {center} {radius}");
        }
    }
}

#[test]
fn no_ray_slips_past_from_far_away() {
    // Aimed at edges of the near half, well inside of the outline.
    let mesh = closed_sphere(100, 200, 1.0, Vec3::ZERO);
    let accel = accel(&mesh);
    let mut random = Random::new(8);
    for _ in 0..50_000 {
        let face = mesh.indices[random.below(mesh.indices.len())];
        let target = mesh.positions[face[0] as usize].lerp(mesh.positions[face[1] as usize], random.unit());
        let o = target * 150.0 + random.vec() * 30.0;
        let ray = Ray::new(Point(o), Dir::normalize(target - o), 0.0);
        assert!(accel.intersect(&ray, &mut accept_all).is_some(), "{ray:?}");
    }
}

/// A box of two triangles a side: long edges, faces in planes of the axes, as walls have.
fn room(min: Vec3, max: Vec3) -> Mesh {
    let pick = |i: u32, bit: u32, a: f32, b: f32| if i & bit == 0 { a } else { b };
    let corner = |i| Vec3::new(pick(i, 1, min.x, max.x), pick(i, 2, min.y, max.y), pick(i, 4, min.z, max.z));
    let sides: [[u32; 4]; 6] =
        [[0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [0, 1, 3, 2], [4, 5, 7, 6]];
    Mesh {
        positions: (0..8).map(corner).collect(),
        indices: sides.iter().flat_map(|s| [[s[0], s[1], s[2]], [s[0], s[2], s[3]]]).collect(),
    }
}

#[test]
fn no_ray_leaks_where_the_walls_of_a_room_meet_however_near() {
    for shift in [Vec3::ZERO, Vec3::new(31.7, -250.3, 77.1)] {
        let (min, max) = (Vec3::new(-7.3, -1.1, -11.9) + shift, Vec3::new(5.9, 2.7, 10.3) + shift);
        let mesh = room(min, max);
        let accel = accel(&mesh);
        for nearness in [0.5, 1e-2, 1e-4, 1e-6] {
            let inside = &mut |random: &mut Random| {
                // Close to one of the corners, edges or sides.
                let t = Vec3::new(random.unit(), random.unit(), random.unit());
                let side = Vec3::new(random.unit(), random.unit(), random.unit()).round();
                let near = min.lerp(max, 0.5) + (side - 0.5) * (max - min) * (1.0 - t * nearness);
                let free = random.below(4);
                let mut o = near;
                if free < 3 {
                    o[free] = min[free] + (max[free] - min[free]) * (0.01 + 0.98 * random.unit());
                }
                let pad = Vec3::splat(1e-6) + shift.abs() * 4e-7 + 4e-6;
                o.clamp(min + pad, max - pad)
            };
            assert_eq!(leaks(&accel, &mesh, inside, 20_000), 0, "{shift} {nearness}");
        }
    }
}

#[test]
fn rays_along_the_axes_through_vertices_do_not_leak() {
    // A grid on whole numbers: every ray meets an edge or a vertex exactly.
    let n = 16_u32;
    let mut mesh = Mesh::default();
    for y in 0..=n {
        for x in 0..=n {
            mesh.positions.push(Vec3::new(x as f32, y as f32, ((x * 7 + y * 3) % 5) as f32));
        }
    }
    for y in 0..n {
        for x in 0..n {
            let a = y * (n + 1) + x;
            mesh.indices.extend([[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]);
        }
    }
    let accel = accel(&mesh);
    for y in 0..=2 * n {
        for x in 0..=2 * n {
            let o = Point::new(x as f32 * 0.5, y as f32 * 0.5, 50.0);
            let hit = accel.intersect(&Ray::new(o, Dir(Vec3::NEG_Z), 0.0), &mut accept_all);
            assert!(hit.is_some(), "{o:?}");
        }
    }
}
