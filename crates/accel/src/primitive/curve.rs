//! Cubic Bézier curves with width: hair, fur and grass.
//!
//! The curve is seen along the ray, subdivided until straight, and hit where the ray's distance to it is below half the
//! width [Nakamaru2002], as in [PBR4e, sec. 6.7]. Each curve enters the tree as [`PIECES`] parts with boxes of their own.
//!
//! Left out: the thickness of [`CurveKind::Cylinder`] (the hit is where the ray passes the axis; only shading tells it
//! from a flat curve); a filter that refuses the first hit on a piece refuses the piece.

use math::{Bounds, DVec3, Vec3};

use super::{Root, Roots};
use crate::ray_space::RaySpace;

/// Parts of a curve in the tree.
pub(crate) const PIECES: u32 = 8;
/// Subdivision goes no deeper within a piece.
const MAX_DEPTH: u32 = 7;

/// How the cross-section lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CurveKind {
    /// Flat, always turned to the ray.
    Flat,
    /// Round.
    Cylinder,
    /// Flat, with the normals at both ends given (unit); turns evenly between them.
    Ribbon([Vec3; 2]),
}

/// One cubic segment, in the space of its [`Blas`](crate::Blas). `u` runs along it, `v` across.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curve {
    /// Bézier control points.
    pub points: [Vec3; 4],
    /// Full width at both ends, linear between.
    pub widths: [f32; 2],
    /// The cross-section.
    pub kind: CurveKind,
}

type Cubic = [DVec3; 4];

impl Curve {
    pub(crate) fn is_degenerate(&self) -> bool {
        let points = self.points.iter().all(|p| p.abs().max_element() < 1e18);
        let widths = self.widths.iter().all(|w| w.is_finite() && *w >= 0.0);
        !points || !widths || self.widths == [0.0, 0.0] || self.points.iter().all(|p| *p == self.points[0])
    }

    /// The box of one piece.
    pub(crate) fn piece_bounds(&self, piece: u32) -> Bounds {
        let hull = self.piece(piece).iter().fold(Bounds::EMPTY, |b, p| b.grow(p.as_vec3()));
        let half = Vec3::splat(self.widths[0].max(self.widths[1]) * 0.5);
        super::round_outwards(&Bounds { min: hull.min - half, max: hull.max + half })
    }

    fn piece(&self, piece: u32) -> Cubic {
        let at = |i: u32| f64::from(i) / f64::from(PIECES);
        part(&self.points.map(|p| p.as_dvec3()), at(piece), at(piece + 1))
    }

    pub(crate) fn roots(&self, piece: u32, ray: &RaySpace) -> Roots {
        let (o, d) = (ray.origin(), ray.direction());
        let length = d.length();
        let z = d / length;
        let x = z.any_orthonormal_vector();
        let y = z.cross(x);
        let seen = self.piece(piece).map(|p| {
            let v = p - o;
            DVec3::new(v.dot(x), v.dot(y), v.dot(z))
        });
        let search = Search { curve: self, z, depth: self.depth(&seen) };
        let from = f64::from(piece) / f64::from(PIECES);
        let hit = search.nearest(&seen, [from, from + 1.0 / f64::from(PIECES)], 0);
        [hit.map(|r| Root { t: r.t / length, ..r }), None]
    }

    /// Subdivisions until the error of a chord is below a twentieth of the width.
    fn depth(&self, c: &Cubic) -> u32 {
        let bend = (0..2).map(|i| (c[i] - c[i + 1] * 2.0 + c[i + 2]).truncate().abs().max_element());
        let bend = bend.fold(0.0, f64::max);
        let tolerance = f64::from(self.widths[0].max(self.widths[1])) * 0.05;
        let mut error = std::f64::consts::SQRT_2 * 6.0 * bend / 8.0;
        let mut depth = 0;
        while error > tolerance && depth < MAX_DEPTH {
            error *= 0.25;
            depth += 1;
        }
        depth
    }

    /// Width at `u` as the ray sees it, `z` being the ray's direction.
    fn width(&self, u: f64, z: DVec3) -> f64 {
        let [a, b] = self.widths.map(f64::from);
        let w = a + (b - a) * u;
        match self.kind {
            CurveKind::Flat | CurveKind::Cylinder => w,
            CurveKind::Ribbon([n0, n1]) => w * ribbon_normal(n0.as_dvec3(), n1.as_dvec3(), u).dot(z).abs(),
        }
    }
}

/// Turns evenly from one unit normal to the other.
fn ribbon_normal(n0: DVec3, n1: DVec3, u: f64) -> DVec3 {
    let angle = math::trig::f64::acos(n0.dot(n1).clamp(-1.0, 1.0));
    let sin = |x: f64| math::trig::f64::sin(x);
    if sin(angle) < 1e-6 { n0 } else { (n0 * sin((1.0 - u) * angle) + n1 * sin(u * angle)) / sin(angle) }
}

/// The descent through one piece, seen along the ray (at the origin, along z).
struct Search<'a> {
    curve: &'a Curve,
    z: DVec3,
    depth: u32,
}

impl Search<'_> {
    fn nearest(&self, c: &Cubic, u: [f64; 2], depth: u32) -> Option<Root> {
        let half = f64::from(self.curve.widths[0].max(self.curve.widths[1])) * 0.5;
        let misses = |axis: usize| c.iter().all(|p| p[axis] > half) || c.iter().all(|p| p[axis] < -half);
        if misses(0) || misses(1) {
            return None;
        }
        if depth >= self.depth {
            return self.chord(c, u);
        }
        let (left, right) = halves(c);
        let middle = (u[0] + u[1]) * 0.5;
        let a = self.nearest(&left, [u[0], middle], depth + 1).filter(|r| r.t > 0.0);
        let b = self.nearest(&right, [middle, u[1]], depth + 1).filter(|r| r.t > 0.0);
        match (a, b) {
            (Some(a), Some(b)) => Some(if b.t < a.t { b } else { a }),
            (a, b) => a.or(b),
        }
    }

    /// The curve is almost its chord here.
    fn chord(&self, c: &Cubic, u: [f64; 2]) -> Option<Root> {
        // Beyond the lines across the ends?
        let (start, end) = ((c[1] - c[0]).truncate(), (c[2] - c[3]).truncate());
        if start.dot(-c[0].truncate()) < 0.0 || end.dot(-c[3].truncate()) < 0.0 {
            return None;
        }
        let along = (c[3] - c[0]).truncate();
        let w = -c[0].truncate().dot(along) / along.length_squared();
        let w = if w.is_nan() { 0.0 } else { w.clamp(0.0, 1.0) };
        let at = u[0] + (u[1] - u[0]) * w;
        let (p, tangent) = point_and_tangent(c, w);
        let (width, distance) = (self.curve.width(at, self.z), p.truncate().length());
        if !(distance <= width * 0.5) || width == 0.0 {
            return None;
        }
        let left = tangent.y * p.x - tangent.x * p.y > 0.0;
        let v = 0.5 + distance / width * if left { 1.0 } else { -1.0 };
        Some(Root { t: p.z, u: at as f32, v: v as f32 })
    }
}

fn halves(c: &Cubic) -> (Cubic, Cubic) {
    let mid = |a: DVec3, b: DVec3| (a + b) * 0.5;
    let (ab, bc, cd) = (mid(c[0], c[1]), mid(c[1], c[2]), mid(c[2], c[3]));
    let (abc, bcd) = (mid(ab, bc), mid(bc, cd));
    let m = mid(abc, bcd);
    ([c[0], ab, abc, m], [m, bcd, cd, c[3]])
}

/// The part from `a` to `b`, by its blossoms.
fn part(c: &Cubic, a: f64, b: f64) -> Cubic {
    let blossom = |x: f64, y: f64, z: f64| {
        let (p, q, r) = (c[0].lerp(c[1], x), c[1].lerp(c[2], x), c[2].lerp(c[3], x));
        p.lerp(q, y).lerp(q.lerp(r, y), z)
    };
    [blossom(a, a, a), blossom(a, a, b), blossom(a, b, b), blossom(b, b, b)]
}

fn point_and_tangent(c: &Cubic, w: f64) -> (DVec3, DVec3) {
    let (p, q, r) = (c[0].lerp(c[1], w), c[1].lerp(c[2], w), c[2].lerp(c[3], w));
    let (s, t) = (p.lerp(q, w), q.lerp(r, w));
    let tangent = if t == s { c[3] - c[0] } else { (t - s) * 3.0 };
    (s.lerp(t, w), tangent)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::primitive::test_ray;

    fn straight(kind: CurveKind) -> Curve {
        Curve { points: [0.0, 1.0, 2.0, 3.0].map(|x| Vec3::new(x, 0.0, 0.0)), widths: [0.2, 0.4], kind }
    }

    fn hit(curve: &Curve, o: [f32; 3]) -> Option<Root> {
        let ray = test_ray(o, [0.0, 0.0, -1.0]);
        (0..PIECES).filter_map(|i| curve.roots(i, &ray)[0]).min_by(|a, b| a.t.total_cmp(&b.t))
    }

    #[test]
    fn a_straight_curve_is_a_strip_of_growing_width() {
        let c = straight(CurveKind::Flat);
        let r = hit(&c, [1.5, 0.0, 2.0]).unwrap();
        assert!((r.t - 2.0).abs() < 1e-9 && (r.u - 0.5).abs() < 1e-6 && (r.v - 0.5).abs() < 1e-6);
        assert!(hit(&c, [1.5, 0.149, 2.0]).is_some() && hit(&c, [1.5, 0.151, 2.0]).is_none());
        assert!(hit(&c, [-0.05, 0.0, 2.0]).is_none() && hit(&c, [3.05, 0.0, 2.0]).is_none());
        let (a, b) = (hit(&c, [1.5, 0.1, 2.0]).unwrap().v, hit(&c, [1.5, -0.1, 2.0]).unwrap().v);
        assert!((a + b - 1.0).abs() < 1e-6 && (a - b).abs() > 0.5);
    }

    #[test]
    fn a_ribbon_seen_from_its_edge_vanishes() {
        assert!(hit(&straight(CurveKind::Ribbon([Vec3::Z; 2])), [1.5, 0.1, 2.0]).is_some());
        assert!(hit(&straight(CurveKind::Ribbon([Vec3::Y; 2])), [1.5, 0.01, 2.0]).is_none());
    }

    #[test]
    fn pieces_join_to_the_whole_curve() {
        let points =
            [[0.0, 0.0, 0.0], [1.0, 2.0, 1.0], [2.0, -1.0, 0.0], [3.0, 1.0, 2.0]].map(Vec3::from_array);
        let c = Curve { points, widths: [0.05, 0.05], kind: CurveKind::Flat };
        let whole = points.map(|p| p.as_dvec3());
        for i in 0..=200 {
            let u = f64::from(i) / 200.0;
            let p = point_and_tangent(&whole, u).0.as_vec3();
            let boxed = (0..PIECES).any(|k| c.piece_bounds(k).contains(math::Point(p)));
            assert!(boxed, "u = {u}");
            if i % 40 != 0 {
                let r = hit(&c, [p.x, p.y, 5.0]).unwrap();
                assert!((f64::from(r.u) - u).abs() < 0.02 && (r.t - f64::from(5.0 - p.z)).abs() < 0.05);
            }
        }
    }
}
