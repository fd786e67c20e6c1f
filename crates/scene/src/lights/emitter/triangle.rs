//! A triangle, sampled uniformly in solid angle [Arvo1995] unless that is tiny or nearly a hemisphere.
//!
//! The solid angle, `tan(Ω/2) = |v₀ · (v₁ × v₂)| / (1 + v₀·v₁ + v₁·v₂ + v₂·v₀)` for unit vectors to the corners
//! [VanOosterom1983], is all that a density needs. Its determinant uses the triangle's own edges, so that thin
//! triangles keep their digits in single precision.
//!
//! Left out: warping by the receiver's cosine [PBR4e, sec. 6.5.4].

use math::lanes::{Floats, PointLanes, Vec3Lanes};
use math::{Bounds, Dir, Point, Vec2, Vec3, error_bound::gamma, trig};
use sampling::{Area, Pdf, SolidAngle, warp};

use super::{NormalCone, SampleLanes, SurfaceSample, is_far, is_far_lanes, to_solid_angle};

/// Below this solid angle, in sr, digits are lost.
const LEAST_SOLID_ANGLE: f32 = 3e-4;
/// Above it, nearly a hemisphere, the corners lie in one plane with the viewer and digits are lost
/// (pbrt-v4's limit).
const MOST_SOLID_ANGLE: f32 = 6.22;

/// An emitting triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    p0: Vec3,
    /// Edges from `p0`.
    e1: Vec3,
    e2: Vec3,
    uv: [Vec2; 3],
    /// At each corner: cosine from the geometric to the shading normal, ±1 without shading normals.
    facing: [f32; 3],
}

impl Triangle {
    /// `None` if it has no area. `normals` are shading normals, to whose side it emits; without them it emits to
    /// the side from which its corners run counter-clockwise, or to the other with `flip`.
    pub(crate) fn new(p: [Point; 3], normals: Option<[Dir; 3]>, uv: [Vec2; 3], flip: bool) -> Option<Self> {
        let (e1, e2) = (p[1] - p[0], p[2] - p[0]);
        let n = e1.cross(e2).try_normalize()?;
        let side = if flip { -1.0 } else { 1.0 };
        let facing = normals.map_or([side; 3], |ns| ns.map(|s| s.0.dot(n)));
        Some(Self { p0: p[0].0, e1, e2, uv, facing })
    }

    fn cross(&self) -> Vec3 {
        self.e1.cross(self.e2)
    }

    pub(crate) fn area(&self) -> f32 {
        0.5 * self.cross().length()
    }

    pub(crate) fn pdf_area(&self) -> Pdf<Area> {
        Pdf::new(1.0 / self.area())
    }

    pub(crate) fn sample_area(&self, u: [f32; 2]) -> SurfaceSample<Area> {
        let [_, b1, b2] = warp::uniform_triangle(u);
        self.at(b1, b2, self.pdf_area())
    }

    /// `None`: sample by area.
    pub(crate) fn sample(&self, from: Point, u: [f32; 2]) -> Option<SurfaceSample<SolidAngle>> {
        let pdf = self.pdf(from)?;
        let corners = [self.p0, self.p0 + self.e1, self.p0 + self.e2].map(Point);
        let [b0, b1] = warp::SphericalTriangle::new(corners, from)?.sample(u).coordinates;
        Some(self.at(b1, (1.0 - b0 - b1).max(0.0), pdf))
    }

    /// [`super::Emitter::sample`] from sixteen points, and where it is right: from where the triangle is far.
    #[inline(always)]
    pub(super) fn sample_lanes<F: Floats>(&self, from: Vec3Lanes<F>, u: [F; 2]) -> SampleLanes<F> {
        let (middle, radius_squared) = self.extent();
        let is_far = is_far_lanes(from, middle, radius_squared);
        let [_, b1, b2] = warp::uniform_triangle_lanes(u);
        let c = F::splat;
        let b0 = c(1.0) - b1 - b2;
        let splat = Vec3Lanes::<F>::splat;
        let p = splat(self.p0) + splat(self.e1) * b1 + splat(self.e2) * b2;
        let error = splat((self.p0.abs() + self.e1.abs() + self.e2.abs()) * gamma(6));
        let n = splat(Dir::normalize(self.cross()).0);
        let facing = b0 * c(self.facing[0]) + b1 * c(self.facing[1]) + b2 * c(self.facing[2]);
        let n = n.negated_where(facing.lt(c(0.0)));
        let pdf = to_solid_angle(c(self.pdf_area().value()), from, p, n);
        (PointLanes { p, error }, n, pdf, is_far)
    }

    /// Its middle, and the square of a radius around it.
    #[inline]
    fn extent(&self) -> (Vec3, f32) {
        // No corner is farther from the middle than two thirds of the longest edge.
        let edges = [self.e1, self.e2, self.e2 - self.e1].map(Vec3::length_squared);
        let longest = edges[0].max(edges[1]).max(edges[2]);
        (self.p0 + (self.e1 + self.e2) * (1.0 / 3.0), longest * (4.0 / 9.0))
    }

    /// `None`: by area.
    pub(crate) fn pdf(&self, from: Point) -> Option<Pdf<SolidAngle>> {
        let (middle, radius_squared) = self.extent();
        if is_far(from, middle, radius_squared) {
            return None;
        }
        let to_p0 = self.p0 - from.0;
        let corners = [to_p0, to_p0 + self.e1, to_p0 + self.e2];
        let length = corners.map(Vec3::length);
        let v = [corners[0] / length[0], corners[1] / length[1], corners[2] / length[2]];
        // v₀ · (v₁ × v₂) by the edges: p₀ · (e₁ × e₂) is the same volume.
        let det = (to_p0.dot(self.cross()) / (length[0] * length[1] * length[2])).abs();
        let sum = 1.0 + v[0].dot(v[1]) + v[1].dot(v[2]) + v[2].dot(v[0]);
        let solid_angle = 2.0 * trig::atan2(det, sum);
        let good = solid_angle > LEAST_SOLID_ANGLE && solid_angle < MOST_SOLID_ANGLE;
        good.then(|| Pdf::new(1.0 / solid_angle))
    }

    fn at<M: sampling::Measure>(&self, b1: f32, b2: f32, pdf: Pdf<M>) -> SurfaceSample<M> {
        let b0 = 1.0 - b1 - b2;
        let p = self.p0 + self.e1 * b1 + self.e2 * b2;
        let size = self.p0.abs() + self.e1.abs() + self.e2.abs();
        SurfaceSample {
            p: Point(p),
            p_error: size * gamma(6),
            n: self.normal(b0, b1, b2),
            uv: self.uv[0] * b0 + self.uv[1] * b1 + self.uv[2] * b2,
            pdf,
        }
    }

    fn normal(&self, b0: f32, b1: f32, b2: f32) -> Dir {
        let n = Dir::normalize(self.cross());
        if b0 * self.facing[0] + b1 * self.facing[1] + b2 * self.facing[2] < 0.0 { -n } else { n }
    }

    pub(crate) fn bounds(&self) -> Bounds {
        Bounds::point(self.p0).grow(self.p0 + self.e1).grow(self.p0 + self.e2)
    }

    pub(crate) fn normals(&self) -> NormalCone {
        let third = 1.0 / 3.0;
        // Shading normals on both sides of the plane: it emits to either, here and there.
        let (least, most) = self.facing.iter().fold((f32::MAX, f32::MIN), |(a, b), &f| (a.min(f), b.max(f)));
        let cos_theta = if least < 0.0 && most > 0.0 { -1.0 } else { 1.0 };
        NormalCone { axis: self.normal(third, third, third), cos_theta }
    }
}
