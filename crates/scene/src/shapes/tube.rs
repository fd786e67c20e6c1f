//! Strands that emit, as surfaces that can be drawn from: a tube around the strand, or a ribbon's own strip.
//!
//! A strand turns its width to every ray; seen from afar, that is a round tube. The tube has [`SIDES`] sides and the strand's
//! width on average over all views across it: a closed form's mean width is its perimeter over π.
//! Every method meets the same triangles, so that light and eye agree on them.
//! Left out: the offset across a strand that the hair BSDF asks for (its `v` runs around the tube).

use std::f32::consts::{PI, TAU};

use math::{Dir, Frame, Vec2, Vec3, trig};
use scene_desc::CurveKind;

use super::{Mesh, Strand};

/// Sides of a tube. An odd number: its width varies by 1.5 % over all views, that of eight sides by 8 %.
const SIDES: usize = 9;
/// Pieces of one segment at most.
const MOST_PIECES: usize = 64;
/// A ribbon turns by so much from piece to piece at most, in radians.
const RIBBON_TURN: f32 = 0.15;

/// The surface of a strand, in the strand's space.
pub(crate) fn tube(strand: &Strand) -> Mesh {
    let mut mesh = Mesh::default();
    let mut side: Option<Vec3> = None;
    let mut before = 0;
    for segment in 0..strand.segments.len() as u32 {
        let pieces = pieces(strand, segment);
        for i in 0..=pieces {
            if i == 0 && segment > 0 && joins(strand, segment) {
                continue;
            }
            let ring = Ring::new(strand, segment, i as f32 / pieces as f32, side);
            side = Some(ring.across);
            let first = mesh.positions.len() as u32;
            let n = ring.add_to(&mut mesh, strand.kind);
            if i > 0 {
                link([before, first], n, &mut mesh);
            }
            before = first;
        }
    }
    mesh
}

/// Does the segment go on where the one before ended?
fn joins(strand: &Strand, segment: u32) -> bool {
    let i = segment as usize;
    strand.segments[i - 1][3] == strand.segments[i][0]
}

/// In how many pieces a segment is cut: until the curve is within a twentieth of its width of the chords.
fn pieces(strand: &Strand, segment: u32) -> usize {
    let c = &strand.segments[segment as usize];
    let bend = (c[0] - c[1] * 2.0 + c[2]).length().max((c[1] - c[2] * 2.0 + c[3]).length());
    let width = strand.width[0].max(strand.width[1]);
    // A cubic's chord over 1/n of it is off by 6 bend / (8 n²) at most.
    let by_bend = (0.75 * bend / (0.05 * width).max(f32::MIN_POSITIVE)).sqrt();
    let normals = strand.normals.get(segment as usize..segment as usize + 2);
    let by_turn = normals.map_or(0.0, |n| trig::safe_acos(n[0].dot(n[1])) / RIBBON_TURN);
    (by_bend.max(by_turn).ceil().min(MOST_PIECES as f32) as usize).max(1)
}

/// A cut across the strand.
struct Ring {
    center: Vec3,
    axis: Dir,
    /// Across the strand; from ring to ring it turns as little as it can.
    across: Vec3,
    width: f32,
    along: f32,
}

impl Ring {
    fn new(strand: &Strand, segment: u32, u: f32, side: Option<Vec3>) -> Self {
        let axis = Dir::normalize(strand.tangent(segment, u));
        let wanted = match strand.kind {
            CurveKind::Ribbon => Some(strand.ribbon_normal(segment, u).cross(axis.0)),
            CurveKind::Flat | CurveKind::Cylinder => side.map(|s| s - axis.0 * s.dot(axis.0)),
        };
        let across = wanted.and_then(Vec3::try_normalize).unwrap_or_else(|| Frame::from_normal(axis).s);
        let along = (segment as f32 + u) / strand.segments.len() as f32;
        Self { center: strand.center(segment, u), axis, across, width: strand.width_at(along), along }
    }

    /// Adds its vertices; gives how many they are.
    fn add_to(&self, mesh: &mut Mesh, kind: CurveKind) -> usize {
        if kind == CurveKind::Ribbon {
            for v in [0.0, 1.0] {
                mesh.positions.push(self.center + self.across * (self.width * (v - 0.5)));
                mesh.normals.push(self.axis.0.cross(self.across));
                mesh.uvs.push(Vec2::new(self.along, v));
            }
            return 2;
        }
        let n = SIDES as f32;
        let radius = self.width * PI / (2.0 * n * trig::sin_cos(PI / n).0);
        let up = self.across.cross(self.axis.0);
        for i in 0..=SIDES {
            let (sin, cos) = trig::sin_cos((i % SIDES) as f32 / n * TAU);
            let out = self.across * cos + up * sin;
            mesh.positions.push(self.center + out * radius);
            mesh.normals.push(out);
            mesh.uvs.push(Vec2::new(self.along, i as f32 / n));
        }
        SIDES + 1
    }
}

/// Triangles between two rings of `n` vertices.
fn link([before, first]: [u32; 2], n: usize, mesh: &mut Mesh) {
    for i in 0..n as u32 - 1 {
        let [a, b, c, d] = [before + i, before + i + 1, first + i, first + i + 1];
        mesh.indices.extend([[a, c, b], [b, c, d]]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use math::Transform;
    use scene_desc::CurveDesc;

    fn strand(kind: CurveKind, width: [f32; 2], normals: Vec<Vec3>) -> Strand {
        // A quarter of a circle of radius 2, nearly, and a straight piece after it.
        let k = 0.552_285;
        let bow = [Vec3::X * 2.0, Vec3::new(2.0, 2.0 * k, 0.0), Vec3::new(2.0 * k, 2.0, 0.0), Vec3::Y * 2.0];
        let line = [2.0, 4.0 / 3.0, 2.0 / 3.0, 0.0].map(|x| Vec3::new(x - 2.0, 2.0, 0.0));
        let desc = CurveDesc { segments: vec![bow, line], kind, width, normals };
        Strand::new(&desc, &Transform::IDENTITY)
    }

    fn area(m: &Mesh) -> f32 {
        let at = |i: u32| m.positions[i as usize];
        m.indices.iter().map(|t| 0.5 * (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).length()).sum()
    }

    const LENGTH: f32 = PI + 2.0;

    #[test]
    fn a_tube_has_the_area_of_a_round_one() {
        for kind in [CurveKind::Flat, CurveKind::Cylinder] {
            let m = tube(&strand(kind, [0.1, 0.1], vec![]));
            let expected = PI * 0.1 * LENGTH;
            assert!((area(&m) / expected - 1.0).abs() < 5e-3, "{} {expected}", area(&m));
            let m = tube(&strand(kind, [0.1, 0.0], vec![]));
            // Width goes by parameters: from 0.1 to 0.05 on the bow, from there to nothing on the line.
            let expected = PI * (0.075 * PI + 0.025 * 2.0);
            assert!((area(&m) / expected - 1.0).abs() < 0.03, "{} {expected}", area(&m));
        }
    }

    #[test]
    fn a_ribbon_is_as_wide_as_its_strand_and_faces_its_normals() {
        let m = tube(&strand(CurveKind::Ribbon, [0.2, 0.2], vec![Vec3::Z; 3]));
        assert!((area(&m) / (0.2 * LENGTH) - 1.0).abs() < 5e-3, "{}", area(&m));
        assert!(m.normals.iter().all(|n| (*n - Vec3::Z).length() < 1e-5));
    }

    #[test]
    fn windings_and_normals_look_outwards() {
        let twisted = vec![Vec3::Z, Vec3::Z, Vec3::Y];
        let forms = [(CurveKind::Flat, vec![]), (CurveKind::Cylinder, vec![]), (CurveKind::Ribbon, twisted)];
        for (kind, normals) in forms {
            let m = tube(&strand(kind, [0.1, 0.05], normals));
            for t in &m.indices {
                let p = t.map(|i| m.positions[i as usize]);
                let n = (p[1] - p[0]).cross(p[2] - p[0]);
                let ns: Vec3 = t.iter().map(|i| m.normals[*i as usize]).sum();
                assert!(n.dot(ns) > 0.0, "{kind:?}: {n} {ns}");
            }
        }
    }
}
