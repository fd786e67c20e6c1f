//! Strands: cubic Bézier segments with width [PBR4e, sec. 6.7].

use math::{Dir, Point, Ray, Transform, Vec2, Vec3, trig};
use scene_desc::{CurveDesc, CurveKind};

use super::LocalSurface;

/// A strand in the space in which it is traced.
#[derive(Clone, Debug)]
pub(crate) struct Strand {
    pub(crate) segments: Vec<[Vec3; 4]>,
    pub(crate) kind: CurveKind,
    /// Width at the ends of the strand.
    pub(crate) width: [f32; 2],
    /// For ribbons: one more than segments.
    pub(crate) normals: Vec<Vec3>,
}

impl Strand {
    /// Maps a strand; widths grow by the mean scale of the transform.
    pub(crate) fn new(desc: &CurveDesc, t: &Transform) -> Self {
        let m = math::DVec3::new(
            t.matrix().x_axis.truncate().length(),
            t.matrix().y_axis.truncate().length(),
            t.matrix().z_axis.truncate().length(),
        );
        let scale = (m.element_sum() / 3.0) as f32;
        Self {
            segments: desc.segments.iter().map(|s| s.map(|p| t.point(Point(p)).0)).collect(),
            kind: desc.kind,
            width: desc.width.map(|w| w * scale),
            normals: desc.normals.iter().map(|n| t.normal(Dir(*n)).0).collect(),
        }
    }

    /// Width at parameter `u` of the whole strand.
    pub(crate) fn width_at(&self, u: f32) -> f32 {
        self.width[0] + (self.width[1] - self.width[0]) * u
    }

    /// The surface at (u along the segment, v across) where the ray met it at `p`.
    pub(crate) fn at(&self, segment: u32, u: f32, v: f32, ray: &Ray, p: Point) -> LocalSurface {
        let n = self.segments.len() as f32;
        let along = (segment as f32 + u) / n;
        let width = self.width_at(along);
        let tangent = self.tangent(segment, u);
        let axis = Dir::normalize(tangent);

        // Across the strand: turned to the ray, or by the ribbon's own normal.
        let facing = match self.kind {
            CurveKind::Ribbon => self.ribbon_normal(segment, u).cross(axis.0),
            CurveKind::Flat | CurveKind::Cylinder => ray.dir.0.cross(axis.0),
        };
        let mut across = facing.try_normalize().unwrap_or_else(|| math::Frame::from_normal(axis).s);
        if self.kind == CurveKind::Cylinder {
            across = turn(across, axis, -std::f32::consts::FRAC_PI_2 * (2.0 * v - 1.0));
        }
        let dpdu = tangent * n;
        let dpdv = across * width;
        let mut ng = Dir::normalize(dpdu.cross(dpdv));
        if self.kind != CurveKind::Ribbon {
            ng = ng.face_forward(-ray.dir);
        }
        LocalSurface {
            p,
            // Strips turn to every ray: a ray that leaves must clear the strand, not the strip that was met (pbrt-v4).
            p_error: Vec3::splat(width) + p.0.abs() * math::error_bound::gamma(5),
            ng,
            ns: ng,
            tangent: dpdu,
            uv: Vec2::new(along, v),
            dpdu,
            dpdv,
            dndu: Vec3::ZERO,
            dndv: Vec3::ZERO,
        }
    }

    /// The middle of the strand.
    pub(crate) fn center(&self, segment: u32, u: f32) -> Vec3 {
        let [a, b, c, d] = self.segments[segment as usize];
        let (ab, bc, cd) = (a.lerp(b, u), b.lerp(c, u), c.lerp(d, u));
        ab.lerp(bc, u).lerp(bc.lerp(cd, u), u)
    }

    /// Its derivative by `u`; the chord where it vanishes.
    pub(crate) fn tangent(&self, segment: u32, u: f32) -> Vec3 {
        derivative(&self.segments[segment as usize], u)
    }

    /// The normal that a ribbon is given there.
    pub(crate) fn ribbon_normal(&self, segment: u32, u: f32) -> Vec3 {
        let (Some(a), Some(b)) = (self.normals.get(segment as usize), self.normals.get(segment as usize + 1))
        else {
            return Vec3::Z;
        };
        a.lerp(*b, u).try_normalize().unwrap_or(*a)
    }

    /// Bytes of heap memory.
    pub(crate) fn memory(&self) -> usize {
        48 * self.segments.len() + 12 * self.normals.len()
    }
}

/// Derivative of a cubic Bézier curve; the chord where it vanishes.
fn derivative(c: &[Vec3; 4], u: f32) -> Vec3 {
    let (a, b) = ((c[1] - c[0]).lerp(c[2] - c[1], u), (c[2] - c[1]).lerp(c[3] - c[2], u));
    let d = a.lerp(b, u) * 3.0;
    if d.length_squared() > 0.0 { d } else { c[3] - c[0] }
}

/// `v` turned about a unit axis that it is perpendicular to.
fn turn(v: Vec3, axis: Dir, angle: f32) -> Vec3 {
    let (sin, cos) = trig::sin_cos(angle);
    v * cos + axis.0.cross(v) * sin
}
