//! Scenes, and the rays that renderers send through them.

use math::{DMat4, DVec3, Dir, Point, Ray, Transform, Vec3};
use steradian_accel::{Accel, Geometry, Hit, Shape, accept_all};

use crate::ply::{self, Mesh};

/// Meshes and where the camera is.
pub(crate) struct Scene {
    pub(crate) meshes: Vec<Mesh>,
    world_from_camera: Transform,
    /// Half the field of view's tangent.
    spread: f32,
}

impl Scene {
    pub(crate) fn geometries(&self) -> Vec<Geometry<'_>> {
        let of = |m| {
            let Mesh { positions, indices }: &Mesh = m;
            Geometry::opaque(Shape::Mesh { positions, indices })
        };
        self.meshes.iter().map(of).collect()
    }
}

/// Rays of one kind.
pub(crate) struct RaySet {
    pub(crate) name: &'static str,
    pub(crate) any: bool,
    pub(crate) rays: Vec<Ray>,
}

impl RaySet {
    pub(crate) fn chunks(&self) -> usize {
        self.rays.len().div_ceil(crate::CHUNK)
    }
}

pub(crate) fn unit(i: u64, dimension: u64) -> f32 {
    math::hash::unit_f32((math::hash::combine(math::hash::mix64(i), dimension) >> 32) as u32)
}

/// A PLY file, or a folder of a pbrt scene, or a number of triangles.
pub(crate) fn load(path: &str) -> Scene {
    if let Ok(n) = path.parse() {
        return landscape(n);
    }
    let path = std::path::Path::new(path);
    if path.is_file() {
        let mesh = ply::read(path);
        let (lo, hi) = mesh
            .positions
            .iter()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(a, b), p| (a.min(*p), b.max(*p)));
        let (center, size) = ((lo + hi).as_dvec3() * 0.5, f64::from((hi - lo).length()));
        let eye = center + DVec3::new(0.3, 0.25, 0.9) * size;
        let camera = Transform::look_at(eye, center, DVec3::Y).expect("a proper view");
        return Scene { meshes: vec![mesh], world_from_camera: camera.inverse(), spread: 0.35 };
    }
    let folder = |p: &std::path::Path| {
        let mut all: Vec<_> =
            std::fs::read_dir(p).expect("a folder").map(|e| e.expect("an entry").path()).collect();
        all.sort();
        all
    };
    let is = |p: &std::path::Path, ext: &str| p.extension().is_some_and(|e| e == ext);
    let meshes = folder(&path.join("models")).iter().filter(|p| is(p, "ply")).map(|p| ply::read(p)).collect();
    let pbrt = folder(path).into_iter().find(|p| is(p, "pbrt")).expect("a pbrt file");
    let text = std::fs::read_to_string(pbrt).expect("a readable file");
    let line = text.lines().find(|l| l.starts_with("Transform")).expect("a camera");
    let numbers: Vec<f64> = line.split_whitespace().filter_map(|w| w.parse().ok()).collect();
    let camera = Transform::from_matrix(DMat4::from_cols_slice(&numbers)).expect("a proper camera");
    Scene { meshes, world_from_camera: camera.inverse(), spread: 0.6 }
}

/// A closed room with rows of balls, boards and slats: about half a million triangles.
pub(crate) fn furnished_room() -> Scene {
    let mut meshes = vec![cuboid(Vec3::new(-8.0, -2.0, -10.0), Vec3::new(8.0, 4.0, 6.0))];
    for i in 0..60_u64 {
        let r = |d: u64| unit(i, 100 + d);
        let center = Vec3::new(r(0) * 14.0 - 7.0, r(1) * 3.0 - 2.0, r(2) * 12.0 - 9.0);
        if i % 3 == 0 {
            meshes.push(ball(center, 0.2 + 0.5 * r(3), 60 + (i as u32 % 5) * 20));
        } else {
            for k in 0..20 {
                let low = center + Vec3::new(0.0, 0.06 * k as f32, 0.0);
                meshes.push(cuboid(low, low + Vec3::new(0.1 + r(4), 0.02, 0.1 + r(5))));
            }
        }
    }
    let camera = Transform::look_at(DVec3::new(0.5, 0.8, 5.5), DVec3::new(0.0, 0.0, -3.0), DVec3::Y);
    Scene { meshes, world_from_camera: camera.expect("a proper view").inverse(), spread: 0.7 }
}

/// Hills under a sky of few triangles, with balls of many sizes lying about: about `n` triangles, half of them in balls.
fn landscape(n: usize) -> Scene {
    let side = (n as f32 / 4.0).sqrt() as u32;
    let height = |x: f32, z: f32| {
        let wave = |f: f32, a: f32| a * math::trig::sin(f * x) * math::trig::cos(f * 1.1 * z + x);
        wave(0.7, 1.0) + wave(2.3, 0.3) + wave(7.1, 0.1) + wave(31.0, 0.02)
    };
    let mut hills = Mesh { positions: Vec::new(), indices: Vec::new() };
    for i in 0..=side {
        for j in 0..=side {
            let [x, z] = [i, j].map(|k| k as f32 / side as f32 * 20.0 - 10.0);
            hills.positions.push(Vec3::new(x, height(x, z), z));
        }
    }
    for i in 0..side {
        for j in 0..side {
            let a = i * (side + 1) + j;
            hills.indices.extend([[a, a + 1, a + side + 1], [a + 1, a + side + 2, a + side + 1]]);
        }
    }
    let sky = cuboid(Vec3::new(-11.0, -3.0, -11.0), Vec3::new(11.0, 8.0, 11.0));
    let (mut meshes, mut left) = (vec![hills, sky], n / 2);
    for i in 0.. {
        let r = |d: u64| unit(i, 200 + d);
        let rows = (20.0 + 180.0 * r(3)) as u32;
        if left < (4 * rows * rows) as usize {
            break;
        }
        left -= (4 * rows * rows) as usize;
        let (x, z) = (r(0) * 20.0 - 10.0, r(1) * 20.0 - 10.0);
        meshes.push(ball(Vec3::new(x, height(x, z), z), 0.02 + 0.3 * r(2) * r(2), rows));
    }
    let camera = Transform::look_at(DVec3::new(0.0, 2.5, 9.0), DVec3::ZERO, DVec3::Y);
    Scene { meshes, world_from_camera: camera.expect("a proper view").inverse(), spread: 0.6 }
}

fn cuboid(min: Vec3, max: Vec3) -> Mesh {
    let pick = |i: u32, bit: u32, a: f32, b: f32| if i & bit == 0 { a } else { b };
    let corner = |i| Vec3::new(pick(i, 1, min.x, max.x), pick(i, 2, min.y, max.y), pick(i, 4, min.z, max.z));
    let sides: [[u32; 4]; 6] =
        [[0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [0, 1, 3, 2], [4, 5, 7, 6]];
    let indices = sides.iter().flat_map(|s| [[s[0], s[1], s[2]], [s[0], s[2], s[3]]]).collect();
    Mesh { positions: (0..8).map(corner).collect(), indices }
}

fn ball(center: Vec3, radius: f32, rows: u32) -> Mesh {
    let columns = 2 * rows;
    let mut mesh = Mesh { positions: Vec::new(), indices: Vec::new() };
    for row in 0..=rows {
        let (st, ct) = math::trig::sin_cos(std::f32::consts::PI * row as f32 / rows as f32);
        for column in 0..columns {
            let (sp, cp) = math::trig::sin_cos(std::f32::consts::TAU * column as f32 / columns as f32);
            mesh.positions.push(center + Vec3::new(st * cp, ct, st * sp) * radius);
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let at = |r: u32, c: u32| r * columns + c % columns;
            let [a, b, c, d] =
                [at(row, column), at(row, column + 1), at(row + 1, column), at(row + 1, column + 1)];
            mesh.indices.extend([[a, c, b], [b, c, d]]);
        }
    }
    mesh
}

/// Where the ray hit, moved off the surface to the ray's side, and the normal there.
fn surface(scene: &Scene, ray: &Ray, hit: &Hit) -> (Point, Vec3) {
    let mesh = &scene.meshes[hit.geometry as usize];
    let [a, b, c] = mesh.indices[hit.primitive as usize].map(|v| mesh.positions[v as usize]);
    let n = (b - a).cross(c - a).normalize_or(Vec3::Z);
    let n = if n.dot(ray.dir.0) > 0.0 { -n } else { n };
    let p = a + (b - a) * hit.u + (c - a) * hit.v;
    (Point(p + n * (p.abs().max_element() + 1.0) * 4e-6), n)
}

/// A direction about `n`, cosine-weighted.
fn diffuse(n: Vec3, i: u64, dimension: u64) -> Dir {
    let z = 2.0 * unit(i, dimension) - 1.0;
    let (s, c) = math::trig::sin_cos(std::f32::consts::TAU * unit(i, dimension + 1));
    let r = (1.0 - z * z).max(0.0).sqrt();
    Dir::normalize(n + Vec3::new(r * c, r * s, z) * 0.9999)
}

/// Rows of pixels as tiles of 4 x 4, as a renderer has them.
fn tiles(rays: &[Ray], side: usize) -> Vec<Ray> {
    let whole = side / 4 * 4;
    let corners = (0..whole).step_by(4).flat_map(|y| (0..whole).step_by(4).map(move |x| (x, y)));
    corners.flat_map(|(x, y)| (0..16).map(move |i| rays[(y + i / 4) * side + x + i % 4])).collect()
}

/// From the first hits of some rays to a light, in their order.
fn shadows(scene: &Scene, accel: &Accel, rays: &[Ray], light: Point) -> Vec<Ray> {
    let shadow = |ray: &Ray| {
        let (p, normal) = surface(scene, ray, &accel.intersect(ray, &mut accept_all)?);
        let to_light = light - p;
        let t_max = to_light.length();
        (to_light.dot(normal) > 0.0).then(|| Ray { t_max, ..Ray::new(p, Dir::normalize(to_light), 0.0) })
    };
    rays.iter().filter_map(shadow).collect()
}

/// Camera rays, two bounces, bounces out of order, ambient occlusion and shadow rays.
pub(crate) fn rays(scene: &Scene, accel: &Accel, n: usize) -> Vec<RaySet> {
    let side = (n as f32).sqrt() as u32;
    let origin = scene.world_from_camera.point(Point::default());
    let mut camera = Vec::new();
    for y in 0..side {
        for x in 0..side {
            let at = |v: u32| ((v as f32 + 0.5) / side as f32 * 2.0 - 1.0) * scene.spread;
            let d = scene.world_from_camera.vector(Vec3::new(at(x), -at(y), 1.0));
            camera.push(Ray::new(origin, Dir::normalize(d), 0.0));
        }
    }
    let bounds = accel.bounds();
    let (reach, light) = (bounds.size().length() * 0.1, bounds.min.lerp(bounds.max, 0.5));
    let light = Point(Vec3::new(light.x, bounds.max.y - bounds.size().y * 0.08, light.z));
    let (mut bounce, mut ao, mut shadow) = (Vec::new(), Vec::new(), Vec::new());
    let mut now = camera.clone();
    for depth in 0..3 {
        let mut next = Vec::new();
        for (ray, i) in now.iter().zip(0_u64..) {
            let Some(hit) = accel.intersect(ray, &mut accept_all) else { continue };
            let (p, normal) = surface(scene, ray, &hit);
            next.push(Ray::new(p, diffuse(normal, i, 10 * depth), 0.0));
            ao.push(Ray { t_max: reach, ..Ray::new(p, diffuse(normal, i, 10 * depth + 2), 0.0) });
            let to_light = light - p;
            if to_light.dot(normal) > 0.0 {
                shadow.push(Ray { t_max: to_light.length(), ..Ray::new(p, Dir::normalize(to_light), 0.0) });
            }
        }
        if depth < 2 {
            bounce.extend_from_slice(&next);
        }
        now = next;
    }
    let mut shuffled = bounce.clone();
    for i in (1..shuffled.len()).rev() {
        shuffled.swap(i, math::hash::mix64(i as u64) as usize % (i + 1));
    }
    // One ray again and again, and rays past everything: what a ray costs where no branch is mispredicted, and at least.
    let miss: Vec<Ray> =
        camera.iter().map(|r| Ray::new(Point(bounds.max + bounds.size()), Dir(r.dir.0.abs()), 0.0)).collect();
    let single: Vec<Ray> = camera.iter().map(|_| camera[camera.len() / 2 + side as usize / 2]).collect();
    let tiled = tiles(&camera, side as usize);
    let lit = shadows(scene, accel, &tiled, light);
    vec![
        RaySet { name: "none hit", any: false, rays: miss.clone() },
        RaySet { name: "none hit, any", any: true, rays: miss },
        RaySet { name: "same ray", any: false, rays: single.clone() },
        RaySet { name: "same ray, any", any: true, rays: single },
        RaySet { name: "camera 4 x 4", any: false, rays: tiled },
        RaySet { name: "shadow 4 x 4", any: true, rays: lit },
        RaySet { name: "camera", any: false, rays: camera },
        RaySet { name: "bounce", any: false, rays: bounce },
        RaySet { name: "bounce shuffled", any: false, rays: shuffled },
        RaySet { name: "ambient occlusion", any: true, rays: ao },
        RaySet { name: "shadow", any: true, rays: shadow },
    ]
}
