//! Emitting surfaces that move: drawn where they stand at the first key, then carried to where they are at the path's moment.
//!
//! Where the way from the first key only turns, shifts and scales evenly, solid angles go with it, and the surface is drawn
//! as it would be at rest, from where the viewer stands in its space. Elsewhere it is drawn by area there, and the density
//! follows the map's stretch of areas.

use std::sync::Arc;

use math::{AnimatedTransform, Bounds, Dir, Point, Transform, trig};
use sampling::{Area, Pdf, SolidAngle};

use super::area::AreaLight;
use super::emitter::{NormalCone, SurfaceSample, geometry};
use crate::linear_map::AffineMap;

/// An emitting surface that moves.
#[derive(Clone, Debug)]
pub(super) struct MovingLight {
    /// At the first key, in world space.
    pub(super) area: AreaLight,
    pub(super) motion: Arc<Motion>,
}

/// The way of a shape, shared by all its lights.
#[derive(Clone, Debug)]
pub(super) struct Motion {
    world_from_object: AnimatedTransform,
    object_from_start: Transform,
    /// Does the way from the first key keep angles?
    keeps_angles: bool,
}

impl Motion {
    /// `None` where it has no meaning: a key with a perspective.
    pub(super) fn new(world_from_object: &AnimatedTransform) -> Option<Self> {
        if !world_from_object.start().is_affine() || !world_from_object.end().is_affine() {
            return None;
        }
        let object_from_start = world_from_object.start().inverse();
        let end = world_from_object.end() * object_from_start;
        let map = AffineMap::of_affine(&end)?;
        // Scales are lerped and orientations apart from them: what keeps angles at the end does so on the way, unless it is
        // turned inside out.
        let keeps_angles = map.linear.uniform_scale().is_some() && !end.swaps_handedness();
        Some(Self { world_from_object: *world_from_object, object_from_start, keeps_angles })
    }

    /// The map from where things are at the first key to where they are at `time`.
    fn at(&self, time: f32) -> AffineMap {
        let from_start = self.world_from_object.at(time) * self.object_from_start;
        AffineMap::of_affine(&from_start).unwrap_or(AffineMap::IDENTITY)
    }

    /// Both keys and the moment between them.
    fn moments(&self) -> [f32; 3] {
        let [a, b] = self.world_from_object.times();
        [a, 0.5 * (a + b), b]
    }
}

impl MovingLight {
    /// A point as seen from `from`, with [`MovingLight::pdf`] as its density.
    pub(super) fn sample(&self, from: Point, time: f32, u: [f32; 2]) -> Option<SurfaceSample<SolidAngle>> {
        let map = self.motion.at(time);
        if self.motion.keeps_angles {
            let s = self.area.emitter.sample(Point(map.inverse_point(from)), u)?;
            return Some(moved(&s, &map, s.pdf));
        }
        let s = self.sample_area_by(&map, u);
        let pdf = s.pdf.to_solid_angle(geometry(from, s.p, s.n)?);
        pdf.is_positive().then_some(s.with_pdf(pdf))
    }

    /// See [`super::Lights::pdf`], but that it does not ask whether rays find the surface.
    pub(super) fn pdf(&self, from: Point, (p, n): (Point, Dir), time: f32) -> Pdf<SolidAngle> {
        let map = self.motion.at(time);
        if self.motion.keeps_angles {
            let [from, p] = [from, p].map(|p| Point(map.inverse_point(p)));
            return self.area.emitter.pdf(from, p, normal_at_start(&map, n));
        }
        geometry(from, p, n).map_or(Pdf::ZERO, |g| self.pdf_area_by(&map, p, n).to_solid_angle(g))
    }

    /// A point of the surface at a moment, with [`MovingLight::pdf_area`] as its density.
    pub(super) fn sample_area(&self, time: f32, u: [f32; 2]) -> SurfaceSample<Area> {
        self.sample_area_by(&self.motion.at(time), u)
    }

    /// Density of [`MovingLight::sample_area`] at a point with a normal.
    pub(super) fn pdf_area(&self, p: Point, n: Dir, time: f32) -> Pdf<Area> {
        self.pdf_area_by(&self.motion.at(time), p, n)
    }

    fn sample_area_by(&self, map: &AffineMap, u: [f32; 2]) -> SurfaceSample<Area> {
        let s = self.area.emitter.sample_area(u);
        moved(&s, map, s.pdf * (1.0 / map.linear.area_ratio(s.n.0)))
    }

    fn pdf_area_by(&self, map: &AffineMap, p: Point, n: Dir) -> Pdf<Area> {
        let at_start = self.area.emitter.pdf_area(Point(map.inverse_point(p)));
        at_start * (1.0 / map.linear.area_ratio(normal_at_start(map, n).0))
    }

    /// Area, its mean over the motion (Simpson's rule: exact where the scale is even).
    pub(super) fn area(&self) -> f32 {
        const N: u16 = 8;
        let emitter = &self.area.emitter;
        let [a, m, b] = self.motion.moments().map(|time| {
            let map = self.motion.at(time);
            if self.motion.keeps_angles {
                return emitter.area() * map.linear.area_ratio(math::Vec3::Z);
            }
            let ratio = |i: u16| {
                let u = [i % N, i / N].map(|k| (f32::from(k) + 0.5) / f32::from(N));
                map.linear.area_ratio(emitter.sample_area(u).n.0)
            };
            emitter.area() * (0..N * N).map(ratio).sum::<f32>() / f32::from(N * N)
        });
        (a + 4.0 * m + b) / 6.0
    }

    /// A box around it at all moments.
    pub(super) fn bounds(&self) -> Bounds {
        let start = self.motion.world_from_object.start();
        let in_object = start.inverse().bounds(self.area.emitter.bounds());
        self.motion.world_from_object.motion_bounds(in_object)
    }

    /// A cone around its normals at all moments.
    pub(super) fn normals(&self) -> NormalCone {
        let start = self.area.emitter.normals();
        let angle = trig::safe_acos(start.cos_theta) + 0.5 * self.motion.world_from_object.turning_angle();
        if !self.motion.keeps_angles || angle >= 3.1 {
            return NormalCone::ALL;
        }
        let axis = self.motion.at(self.motion.moments()[1]).normal(start.axis.0);
        // A little room for rounding.
        NormalCone { axis, cos_theta: trig::cos(angle + 1e-3) }
    }
}

/// A sample where the map carries it.
fn moved<M: sampling::Measure, N: sampling::Measure>(
    s: &SurfaceSample<M>,
    map: &AffineMap,
    pdf: Pdf<N>,
) -> SurfaceSample<N> {
    let (p, p_error) = map.point_with_error(s.p.0, s.p_error);
    SurfaceSample { p, p_error, n: map.normal(s.n.0), uv: s.uv, pdf }
}

fn normal_at_start(map: &AffineMap, n: Dir) -> Dir {
    Dir::normalize(map.linear.apply_inverse_normal(n.0))
}
