//! Scenes and rays for the tests.
#![allow(dead_code, reason = "each test file uses a part")]

pub(crate) mod scenes;

use math::{Dir, Point, Ray, Vec3};
use steradian_accel::Hit;

/// All that makes a hit.
pub(crate) fn bits(hit: Option<Hit>) -> Option<[u32; 6]> {
    hit.map(|h| [h.t.to_bits(), h.u.to_bits(), h.v.to_bits(), h.instance, h.geometry, h.primitive])
}

/// Uniform numbers from a counter.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(math::hash::mix64(seed))
    }

    pub(crate) fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        math::hash::unit_f32((math::hash::mix64(self.0) >> 32) as u32)
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        ((self.unit() * n as f32) as usize).min(n - 1)
    }

    /// In [−1, 1)³.
    pub(crate) fn vec(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    pub(crate) fn dir(&mut self) -> Dir {
        loop {
            let v = self.vec();
            if (1e-4..1.0).contains(&v.length_squared()) {
                return Dir::normalize(v);
            }
        }
    }
}

/// Vertices and faces.
#[derive(Clone, Default)]
pub(crate) struct Mesh {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) indices: Vec<[u32; 3]>,
}

/// A closed sphere of `rows × columns` quads, each halved, with fans at the poles.
pub(crate) fn closed_sphere(rows: u32, columns: u32, radius: f32, center: Vec3) -> Mesh {
    let mut mesh = Mesh::default();
    let at = |theta: f32, phi: f32| {
        let (st, ct) = math::trig::sin_cos(theta);
        let (sp, cp) = math::trig::sin_cos(phi);
        center + Vec3::new(st * cp, st * sp, ct) * radius
    };
    mesh.positions.push(at(0.0, 0.0));
    for row in 1..rows {
        for column in 0..columns {
            let theta = std::f32::consts::PI * row as f32 / rows as f32;
            mesh.positions.push(at(theta, std::f32::consts::TAU * column as f32 / columns as f32));
        }
    }
    mesh.positions.push(at(std::f32::consts::PI, 0.0));
    let last = mesh.positions.len() as u32 - 1;
    let vertex = |row: u32, column: u32| match row {
        0 => 0,
        r if r == rows => last,
        r => 1 + (r - 1) * columns + column % columns,
    };
    for row in 0..rows {
        for column in 0..columns {
            let (a, b) = (vertex(row, column), vertex(row, column + 1));
            let (c, d) = (vertex(row + 1, column), vertex(row + 1, column + 1));
            if row > 0 {
                mesh.indices.push([a, c, b]);
            }
            if row + 1 < rows {
                mesh.indices.push([b, c, d]);
            }
        }
    }
    mesh
}

/// Triangles of many sizes, some axis-parallel, some sharing corners, some without area.
pub(crate) fn soup(n: usize, random: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..n {
        let size = [0.02, 0.1, 0.5, 2.0][i % 4];
        let p = random.vec() * 2.0;
        let mut corners = [p, p + random.vec() * size, p + random.vec() * size];
        match i % 7 {
            0 => corners.iter_mut().for_each(|c| c.z = 0.5),
            1 => corners.iter_mut().for_each(|c| c.x = (c.x * 4.0).round() / 4.0),
            2 => corners[2] = corners[1],
            3 => corners.iter_mut().for_each(|c| *c = (*c * 8.0).round() / 8.0),
            _ => {}
        }
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners);
        mesh.indices.push([first, first + 1, first + 2]);
    }
    mesh
}

/// Rays from inside, outside, far away, on grid planes, along axes, with ends.
pub(crate) fn rays(n: usize, targets: &[Vec3], random: &mut Random) -> Vec<Ray> {
    (0..n)
        .map(|i| {
            let mut o = random.vec() * [1.0, 3.0, 100.0, 2.0][i % 4];
            let mut d = random.dir().0;
            match i % 11 {
                0 => d = [Vec3::X, Vec3::NEG_Y, Vec3::Z][random.below(3)],
                1 => d[random.below(3)] = 0.0,
                2 => d[random.below(3)] = 1e-30,
                3 => o = (o * 8.0).round() / 8.0,
                4 => {
                    o = (o * 4.0).round() / 4.0;
                    d = [Vec3::NEG_X, Vec3::Y, Vec3::NEG_Z][random.below(3)];
                }
                5 => o = targets[random.below(targets.len())],
                _ => {}
            }
            if i % 3 == 0 {
                d = targets[random.below(targets.len())] - o;
            }
            let mut ray = Ray::new(Point(o), Dir::normalize(d), random.unit());
            if i % 5 == 0 {
                ray.t_max = random.unit() * 4.0;
            }
            ray
        })
        .collect()
}

/// Bundles of up to forty rays that go more or less the same way, to one target.
pub(crate) fn bundles(n: usize, targets: &[Vec3], random: &mut Random) -> Vec<Ray> {
    let mut all = Vec::with_capacity(n + 40);
    while all.len() < n {
        let (o, target) =
            (random.vec() * [1.0, 3.0, 20.0][random.below(3)], targets[random.below(targets.len())]);
        let spread = [0.0, 1e-3, 0.02, 0.1][random.below(4)];
        let apart = [0.0, 0.0, 1e-2, 0.1][random.below(4)];
        let end =
            if random.below(3) == 0 { (target - o).length() * 1.1 * random.unit() } else { f32::INFINITY };
        let time = random.unit();
        for _ in 0..random.below(41) {
            let o = o + random.vec() * apart;
            let d = (target - o) + random.vec() * (spread * (target - o).length());
            all.push(Ray { t_max: end, ..Ray::new(Point(o), Dir::normalize(d), time) });
        }
    }
    all
}
