//! Loop subdivision, pushed to the limit surface [Loop1987; Hoppe1994 for borders].
//!
//! Departs from pbrt: a limit normal that degenerates falls back on the mean of the faces around it, which also
//! decides the side of every normal.

use std::collections::HashMap;
use std::f32::consts::{PI, TAU};

use math::{Vec3, trig};
use scene_desc::{LoopSubdiv, MeshDesc};

/// The limit surface's triangles, with normals.
pub(crate) fn subdivide(desc: &LoopSubdiv) -> MeshDesc {
    let mut mesh = Control { positions: desc.positions.clone(), faces: desc.indices.clone() };
    for _ in 0..desc.levels {
        mesh = mesh.refined();
    }
    mesh.limit()
}

struct Control {
    positions: Vec<Vec3>,
    faces: Vec<[u32; 3]>,
}

/// An edge: its ends, and the vertices across from it.
struct Edge {
    ends: [u32; 2],
    opposite: [u32; 2],
    faces: u32,
}

/// All edges, numbered in the order in which faces meet them.
struct Edges {
    list: Vec<Edge>,
    number: HashMap<[u32; 2], usize>,
}

impl Edges {
    fn of(faces: &[[u32; 3]]) -> Self {
        let mut edges = Self { list: Vec::new(), number: HashMap::new() };
        for f in faces {
            for k in 0..3 {
                let ends = sorted(f[k], f[(k + 1) % 3]);
                let next = edges.list.len();
                let i = *edges.number.entry(ends).or_insert(next);
                if i == next {
                    edges.list.push(Edge { ends, opposite: [0; 2], faces: 0 });
                }
                let edge = &mut edges.list[i];
                if edge.faces < 2 {
                    edge.opposite[edge.faces as usize] = f[(k + 2) % 3];
                }
                edge.faces += 1;
            }
        }
        edges
    }
}

fn sorted(a: u32, b: u32) -> [u32; 2] {
    if a < b { [a, b] } else { [b, a] }
}

/// What a vertex sees of its neighbours.
#[derive(Clone, Copy, Default)]
struct Ring {
    valence: u32,
    sum: Vec3,
    border_sum: Vec3,
    border: u32,
}

impl Control {
    fn rings(&self, edges: &Edges) -> Vec<Ring> {
        let mut rings = vec![Ring::default(); self.positions.len()];
        for e in &edges.list {
            for (v, other) in [(e.ends[0], e.ends[1]), (e.ends[1], e.ends[0])] {
                let (ring, p) = (&mut rings[v as usize], self.positions[other as usize]);
                ring.valence += 1;
                ring.sum += p;
                if e.faces == 1 {
                    ring.border += 1;
                    ring.border_sum += p;
                }
            }
        }
        rings
    }

    /// One step: every triangle becomes four.
    fn refined(&self) -> Self {
        let edges = Edges::of(&self.faces);
        let rings = self.rings(&edges);
        let mut positions: Vec<Vec3> = self
            .positions
            .iter()
            .zip(&rings)
            .map(|(&p, r)| match r.border {
                0 if r.valence > 0 => {
                    let b = beta(r.valence);
                    p * (1.0 - r.valence as f32 * b) + r.sum * b
                }
                2 => p * 0.75 + r.border_sum * 0.125,
                _ => p,
            })
            .collect();

        // A new vertex on every edge.
        for e in &edges.list {
            let ends = self.positions[e.ends[0] as usize] + self.positions[e.ends[1] as usize];
            let across = self.positions[e.opposite[0] as usize] + self.positions[e.opposite[1] as usize];
            positions.push(if e.faces == 2 { ends * 0.375 + across * 0.125 } else { ends * 0.5 });
        }
        let base = self.positions.len();
        let middle = |a: u32, b: u32| (base + edges.number[&sorted(a, b)]) as u32;
        let faces = self.faces.iter().flat_map(|&[a, b, c]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        });
        Self { faces: faces.collect(), positions }
    }

    /// Moves every vertex to where infinitely many steps would move it.
    fn limit(&self) -> MeshDesc {
        let edges = Edges::of(&self.faces);
        let rings = self.rings(&edges);
        let positions: Vec<Vec3> = self
            .positions
            .iter()
            .zip(&rings)
            .map(|(&p, r)| match r.border {
                0 if r.valence > 0 => {
                    let g = 1.0 / (r.valence as f32 + 3.0 / (8.0 * beta(r.valence)));
                    p * (1.0 - r.valence as f32 * g) + r.sum * g
                }
                2 => p * 0.6 + r.border_sum * 0.2,
                _ => p,
            })
            .collect();
        let limit = Self { positions, faces: self.faces.clone() };
        let normals = limit.normals();
        MeshDesc { positions: limit.positions, normals, indices: limit.faces, ..MeshDesc::default() }
    }

    fn normals(&self) -> Vec<Vec3> {
        // next[v][a] = b for every face (v, a, b): walking it goes once around v.
        let mut next: Vec<Vec<(u32, u32)>> = vec![Vec::new(); self.positions.len()];
        let mut mean = vec![Vec3::ZERO; self.positions.len()];
        for &[a, b, c] in &self.faces {
            let [pa, pb, pc] = [a, b, c].map(|i| self.positions[i as usize]);
            let n = (pb - pa).cross(pc - pa);
            for (v, x, y) in [(a, b, c), (b, c, a), (c, a, b)] {
                next[v as usize].push((x, y));
                mean[v as usize] += n;
            }
        }
        (0..self.positions.len())
            .map(|v| {
                let n = self.tangent_normal(v, &next[v]).unwrap_or(mean[v]);
                let n = if n.dot(mean[v]) < 0.0 { -n } else { n };
                n.try_normalize().or_else(|| mean[v].try_normalize()).unwrap_or(Vec3::Z)
            })
            .collect()
    }

    /// Cross product of the two limit tangents.
    fn tangent_normal(&self, v: usize, next: &[(u32, u32)]) -> Option<Vec3> {
        let start = next.iter().find(|(a, _)| next.iter().all(|(_, b)| b != a));
        let border = start.is_some();
        let mut at = start.or(next.first())?.0;
        let mut ring = vec![self.positions[at as usize]];
        while let Some(&(_, b)) = next.iter().find(|(a, _)| *a == at) {
            if ring.len() >= next.len() + usize::from(border) {
                break;
            }
            ring.push(self.positions[b as usize]);
            at = b;
        }
        let (p, n) = (self.positions[v], ring.len());
        let (s, t) = if border {
            (ring[n - 1] - ring[0], border_tangent(p, &ring))
        } else {
            let sum = |f: fn(f32) -> f32| {
                ring.iter().enumerate().map(|(i, q)| *q * f(TAU * i as f32 / n as f32)).sum::<Vec3>()
            };
            (sum(trig::cos), sum(trig::sin))
        };
        let normal = s.cross(t);
        (normal.length_squared() > 0.0).then_some(normal)
    }
}

/// Weight of each neighbour of an inner vertex (Warren's choice).
fn beta(valence: u32) -> f32 {
    if valence == 3 { 3.0 / 16.0 } else { 3.0 / (8.0 * valence as f32) }
}

/// The tangent across a border [Hoppe1994].
fn border_tangent(p: Vec3, ring: &[Vec3]) -> Vec3 {
    match ring {
        [] | [_] => Vec3::ZERO,
        [a, b] => *a + *b - p * 2.0,
        [_, b, _] => *b - p,
        [a, b, c, d] => *b * 2.0 + *c * 2.0 - *a - *d - p * 2.0,
        [first, inner @ .., last] => {
            let theta = PI / (inner.len() + 1) as f32;
            let ends = (*first + *last) * trig::sin(theta);
            let w = 2.0 * trig::cos(theta) - 2.0;
            ends + inner
                .iter()
                .enumerate()
                .map(|(k, q)| *q * (w * trig::sin((k + 1) as f32 * theta)))
                .sum::<Vec3>()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_octahedron_becomes_round_with_outward_normals() {
        let positions = vec![Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
        let indices =
            vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
        let m = subdivide(&LoopSubdiv { positions, indices, levels: 3 });
        assert_eq!(m.indices.len(), 8 * 64);
        let radii: Vec<f32> = m.positions.iter().map(|p| p.length()).collect();
        let (lo, hi) = radii.iter().fold((f32::MAX, 0.0_f32), |(a, b), r| (a.min(*r), b.max(*r)));
        // A corner of valence four: γ = 1/8, and the four neighbours cancel.
        assert!((m.positions[0] - Vec3::X * 0.5).length() < 0.01, "{}", m.positions[0]);
        assert!(hi / lo < 1.25, "{lo} {hi}");
        for (p, n) in m.positions.iter().zip(&m.normals) {
            assert!(p.normalize().dot(*n) > 0.93);
        }
    }

    #[test]
    fn a_flat_sheet_stays_flat_and_keeps_its_border() {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
        let m = subdivide(&LoopSubdiv { positions, indices: vec![[0, 1, 2], [0, 2, 3]], levels: 2 });
        assert!(m.normals.iter().all(|n| (n.z - 1.0).abs() < 1e-5));
        assert!(m.positions.iter().all(|p| p.z == 0.0 && p.x >= 0.0 && p.x <= 1.0));
    }
}
