//! A bilinear patch; where it is a rectangle, it is sampled by solid angle.
//!
//! By area: a bilinear warp towards the corners' area elements, then the exact density `p_uv / |∂p/∂u × ∂p/∂v|`
//! [PBR4e, sec. 6.6.2]. The parameters of a point are found again by inverting the patch's projection along its
//! largest normal component; of the quadratic's two roots the one counts whose point is nearer.

use math::lanes::{Floats, Mask, PointLanes, Vec3Lanes};
use math::{Bounds, Dir, Point, Vec2, Vec3, error_bound::gamma};
use sampling::{Area, Pdf, SolidAngle, warp};

use super::{NormalCone, SampleLanes, SurfaceSample, is_far, is_far_lanes, to_solid_angle};

/// Below this solid angle, in sr, digits are lost.
const LEAST_SOLID_ANGLE: f32 = 1e-4;
/// Above it, nearly a hemisphere, the viewer may lie on the patch itself but for rounding: its own back would be lit.
const MOST_SOLID_ANGLE: f32 = 6.22;

/// An emitting patch. Corners at (u, v) = (0,0), (1,0), (0,1), (1,1).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    p: [Vec3; 4],
    uv: [Vec2; 4],
    /// Shading normals, to whose side it emits, or none.
    normals: Option<[Dir; 4]>,
    /// −1: emits to the other side of ∂p/∂u × ∂p/∂v.
    side: f32,
    /// If it is one: sampled by solid angle.
    rectangle: Option<warp::Rectangle>,
    /// Its normal, if that is the same everywhere.
    flat: Option<Dir>,
    p_error: Vec3,
    area: f32,
    middle: Vec3,
    /// Squared distance from the middle to the farthest corner.
    radius_squared: f32,
}

impl Patch {
    /// `None` if it has no area. `normals` are shading normals, to whose side it emits; without them it emits to
    /// the side of ∂p/∂u × ∂p/∂v, or to the other with `flip`.
    pub(crate) fn new(p: [Point; 4], normals: Option<[Dir; 4]>, uv: [Vec2; 4], flip: bool) -> Option<Self> {
        let p = p.map(|p| p.0);
        let (eu, ev) = (p[1] - p[0], p[2] - p[0]);
        let size = eu.length() + ev.length();
        let is_rectangle =
            (p[3] - p[1] - ev).length() < 1e-5 * size && eu.dot(ev).abs() < 1e-5 * eu.length() * ev.length();
        let rectangle = if is_rectangle { warp::Rectangle::new(Point(p[0]), [eu, ev]) } else { None };
        // In a plane through zero the coordinate has no error, but a ray's distance to the patch has: without
        // the second term light that leaves such a lamp would meet it again (as in `PatchMesh::at`).
        let size_of_p = p.iter().fold(Vec3::ZERO, |a, p| a.max(p.abs()));
        let p_error = size_of_p * gamma(8) + Vec3::splat(size_of_p.max_element() * 1e-9);
        let side = if flip { -1.0 } else { 1.0 };
        let middle = bilerp(p, [0.5; 2]);
        let radius_squared = p.iter().fold(0.0, |r: f32, p| r.max(p.distance_squared(middle)));
        let (flat, area) = (None, 0.0);
        let mut patch = Self { p, uv, normals, side, rectangle, flat, p_error, area, middle, radius_squared };
        patch.area = patch.integrated_area();
        patch.flat = (rectangle.is_some() && normals.is_none()).then(|| patch.normal([0.5; 2]));
        (patch.area > 0.0 && patch.area.is_finite()).then_some(patch)
    }

    fn point(&self, [u, v]: [f32; 2]) -> Vec3 {
        bilerp(self.p, [u, v])
    }

    /// ∂p/∂u × ∂p/∂v.
    fn cross(&self, [u, v]: [f32; 2]) -> Vec3 {
        let du = (self.p[1] - self.p[0]) * (1.0 - v) + (self.p[3] - self.p[2]) * v;
        let dv = (self.p[2] - self.p[0]) * (1.0 - u) + (self.p[3] - self.p[1]) * u;
        du.cross(dv)
    }

    fn integrated_area(&self) -> f32 {
        const N: u16 = 32;
        let mut sum = 0.0_f64;
        for i in 0..N * N {
            let uv = [i % N, i / N].map(|k| (f32::from(k) + 0.5) / f32::from(N));
            sum += f64::from(self.cross(uv).length());
        }
        (sum / f64::from(N * N)) as f32
    }

    pub(crate) fn area(&self) -> f32 {
        self.area
    }

    /// Area elements at the corners.
    fn weights(&self) -> [f32; 4] {
        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|c| self.cross(c).length())
    }

    fn pdf_area_at(&self, uv: [f32; 2]) -> Pdf<Area> {
        if self.rectangle.is_some() {
            return Pdf::new(1.0 / self.area);
        }
        let p = warp::bilinear_pdf(uv, self.weights()).value() / self.cross(uv).length();
        Pdf::new(if p.is_finite() { p } else { 0.0 })
    }

    #[inline]
    pub(crate) fn sample_area(&self, u: [f32; 2]) -> SurfaceSample<Area> {
        if self.rectangle.is_some() {
            return self.at(u, Pdf::new(1.0 / self.area));
        }
        let uv = warp::bilinear(u, self.weights());
        self.at(uv, self.pdf_area_at(uv))
    }

    pub(crate) fn pdf_area(&self, p: Point) -> Pdf<Area> {
        let uv = if self.rectangle.is_some() { [0.5; 2] } else { self.parameters(p) };
        self.pdf_area_at(uv)
    }

    /// `None`: sample by area.
    #[inline]
    pub(crate) fn sample(&self, from: Point, u: [f32; 2]) -> Option<SurfaceSample<SolidAngle>> {
        let seen = self.seen(from)?;
        Some(self.at(seen.coordinates(u), seen.pdf()))
    }

    /// `None`: by area.
    pub(crate) fn pdf(&self, from: Point) -> Option<Pdf<SolidAngle>> {
        self.seen(from).map(|s| s.pdf())
    }

    #[inline]
    fn seen(&self, from: Point) -> Option<warp::SphericalRectangle<'_>> {
        let rectangle = self.rectangle.as_ref()?;
        if is_far(from, self.middle, self.radius_squared) {
            return None;
        }
        rectangle
            .seen_from(from)
            .filter(|r| r.solid_angle() > LEAST_SOLID_ANGLE && r.solid_angle() < MOST_SOLID_ANGLE)
    }

    /// The patch as a rectangle, if it is one.
    #[inline]
    pub(super) fn flat_rectangle(&self) -> Option<FlatRectangle<'_>> {
        Some(FlatRectangle { patch: self, rectangle: self.rectangle.as_ref()? })
    }

    /// [`Patch::normal`] of sixteen points.
    #[inline(always)]
    fn normal_lanes<F: Floats>(&self, [u, v]: [F; 2]) -> Vec3Lanes<F> {
        let splat = Vec3Lanes::<F>::splat;
        if let Some(n) = self.flat {
            return splat(n.0);
        }
        let one = F::splat(1.0);
        let [p00, p10, p01, p11] = self.p;
        let du = splat(p10 - p00) * (one - v) + splat(p11 - p01) * v;
        let dv = splat(p01 - p00) * (one - u) + splat(p11 - p10) * u;
        let n = du.cross(dv).normalize();
        match self.normals {
            Some([n00, n10, n01, n11]) => n.face_forward(bilerp_lanes([n00.0, n10.0, n01.0, n11.0], [u, v])),
            None => n * F::splat(self.side),
        }
    }

    #[inline]
    fn at<M: sampling::Measure>(&self, uv: [f32; 2], pdf: Pdf<M>) -> SurfaceSample<M> {
        SurfaceSample {
            p: Point(self.point(uv)),
            p_error: self.p_error,
            n: self.flat.unwrap_or_else(|| self.normal(uv)),
            uv: bilerp(self.uv, uv),
            pdf,
        }
    }

    fn normal(&self, uv: [f32; 2]) -> Dir {
        let n = Dir::normalize(self.cross(uv));
        match self.normals {
            Some(ns) => n.face_forward(Dir(bilerp(ns.map(|n| n.0), uv))),
            None => Dir(n.0 * self.side),
        }
    }

    /// (u, v) of a point on the patch.
    fn parameters(&self, p: Point) -> [f32; 2] {
        // Drop the axis along which the patch is thinnest, as seen by its middle's normal.
        let n = self.cross([0.5, 0.5]).abs();
        let keep = |v: Vec3| {
            if n.x >= n.y && n.x >= n.z {
                Vec2::new(v.y, v.z)
            } else if n.y >= n.z {
                Vec2::new(v.z, v.x)
            } else {
                Vec2::new(v.x, v.y)
            }
        };
        // p − p₀ = u e + v (f + u g): crossing with f + u g leaves a quadratic in u.
        let h = keep(p.0 - self.p[0]);
        let (e, f) = (keep(self.p[1] - self.p[0]), keep(self.p[2] - self.p[0]));
        let g = keep(self.p[0] - self.p[1] - self.p[2] + self.p[3]);
        let (a, b, c) = (e.perp_dot(g), e.perp_dot(f) - h.perp_dot(g), -h.perp_dot(f));
        let root = (b * b - 4.0 * a * c).max(0.0).sqrt();
        let q = -0.5 * (b + root.copysign(b));

        let candidate = |u: f32| {
            let u = if u.is_finite() { u.clamp(0.0, 1.0) } else { 0.0 };
            let d = f + g * u;
            let rest = h - e * u;
            let v = (rest.dot(d) / d.length_squared()).clamp(0.0, 1.0);
            [u, if v.is_finite() { v } else { 0.0 }]
        };
        let (first, second) = (candidate(c / q), candidate(q / a));
        let far = |uv: [f32; 2]| self.point(uv).distance_squared(p.0);
        if far(first) <= far(second) { first } else { second }
    }

    pub(crate) fn bounds(&self) -> Bounds {
        self.p.iter().fold(Bounds::EMPTY, |b, &p| b.grow(p))
    }

    pub(crate) fn normals(&self) -> NormalCone {
        let axis = self.normal([0.5, 0.5]);
        // ∂p/∂u depends on v alone and ∂p/∂v on u alone, so that their product is bilinear: its corners bound it.
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|c| self.normal(c));
        let cos_theta = corners.iter().fold(1.0_f32, |c, n| c.min(n.dot(axis)));
        if cos_theta > 0.0 { NormalCone { axis, cos_theta } } else { NormalCone::ALL }
    }
}

/// A patch that is a rectangle.
#[derive(Clone, Copy)]
pub(crate) struct FlatRectangle<'a> {
    patch: &'a Patch,
    rectangle: &'a warp::Rectangle,
}

impl FlatRectangle<'_> {
    /// [`super::Emitter::sample`] from sixteen points, and where it is right: all but very close to it.
    #[inline(always)]
    pub(super) fn sample_lanes<F: Floats>(&self, from: Vec3Lanes<F>, u: [F; 2]) -> SampleLanes<F> {
        let (patch, c) = (self.patch, F::splat);
        let is_near = !is_far_lanes(from, patch.middle, patch.radius_squared);
        let (mut uv, mut pdf_near, mut by_angle) = (u, c(0.0), F::Mask::from_bits(0));
        let mut is_right = F::Mask::from_bits(u32::MAX);
        if is_near.any() {
            let (seen, usable) = self.rectangle.seen_from_lanes::<F>(from);
            let angle = seen.solid_angle();
            let is_good = angle.gt(c(LEAST_SOLID_ANGLE)) & angle.lt(c(MOST_SOLID_ANGLE));
            by_angle = is_near & usable & is_good;
            let (coordinates, is_exact) = seen.coordinates(u);
            uv = [coordinates[0].or_else(by_angle, u[0]), coordinates[1].or_else(by_angle, u[1])];
            pdf_near = seen.pdf();
            is_right = is_exact | !by_angle;
        }
        let (p, n) = (bilerp_lanes(patch.p, uv), patch.normal_lanes(uv));
        let far = to_solid_angle(c(1.0 / patch.area), from, p, n);
        let pdf = pdf_near.or_else(by_angle, far);
        (PointLanes { p, error: Vec3Lanes::splat(patch.p_error) }, n, pdf, is_right)
    }
}

/// [`bilerp`] at sixteen places.
#[inline(always)]
fn bilerp_lanes<F: Floats>(corners: [Vec3; 4], [u, v]: [F; 2]) -> Vec3Lanes<F> {
    let [c00, c10, c01, c11] = corners;
    let (one, splat) = (F::splat(1.0), Vec3Lanes::<F>::splat);
    (splat(c00) * (one - u) + splat(c10) * u) * (one - v) + (splat(c01) * (one - u) + splat(c11) * u) * v
}

#[inline]
fn bilerp<T>(c: [T; 4], [u, v]: [f32; 2]) -> T
where
    T: Copy + std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>,
{
    (c[0] * (1.0 - u) + c[1] * u) * (1.0 - v) + (c[2] * (1.0 - u) + c[3] * u) * v
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A viewer on the patch itself, but for rounding, must not take all of the hemisphere for the lamp.
    #[test]
    fn a_patch_is_not_seen_from_itself() {
        let p = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(1.0, 1.0, 0.0)].map(Point);
        let patch = Patch::new(p, None, [Vec2::ZERO; 4], false).unwrap();
        for height in [1e-7, -1e-7, 1e-5] {
            assert!(patch.sample(Point(Vec3::new(0.4, 0.3, height)), [0.3, 0.8]).is_none(), "{height}");
            assert!(patch.pdf(Point(Vec3::new(0.4, 0.3, height))).is_none(), "{height}");
        }
        assert!(patch.sample(Point(Vec3::new(0.4, 0.3, 0.1)), [0.3, 0.8]).is_some());
        assert!(
            patch.sample_area([0.3, 0.8]).p_error.min_element() > 0.0,
            "light must leave a plane through zero"
        );
    }
}
