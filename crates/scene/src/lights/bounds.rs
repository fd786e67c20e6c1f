//! Where a light is and into which directions it emits: what a tree of lights is built of [Conty2018].

use std::f32::consts::PI;

use math::{Bounds, Dir, Point, Ray, Vec3, trig};

use super::emitter::NormalCone;
use super::{Light, Lights};
use crate::LightId;

/// Bounds of one light or of many.
///
/// All normals lie within `θ_o` of `axis`, and all light within `θ_e` of a normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LightBounds {
    pub(crate) bounds: Bounds,
    pub(crate) axis: Dir,
    pub(crate) cos_theta_o: f32,
    pub(crate) cos_theta_e: f32,
    /// A measure of power: what the importance is in proportion to.
    pub(crate) power: f32,
    pub(crate) two_sided: bool,
}

impl LightBounds {
    /// Of both together.
    pub(crate) fn union(&self, other: &Self) -> Self {
        let (axis, cos_theta_o) = self.cone_with(other);
        Self {
            bounds: self.bounds.union(other.bounds),
            axis,
            cos_theta_o,
            cos_theta_e: self.cos_theta_e.min(other.cos_theta_e),
            power: self.power + other.power,
            two_sided: self.two_sided || other.two_sided,
        }
    }

    /// The cone around both cones of normals.
    fn cone_with(&self, other: &Self) -> (Dir, f32) {
        if self.cos_theta_o <= -1.0 || other.cos_theta_o <= -1.0 {
            return (self.axis, -1.0);
        }
        let (a, b) = (trig::safe_acos(self.cos_theta_o), trig::safe_acos(other.cos_theta_o));
        let cross = self.axis.0.cross(other.axis.0);
        let between = trig::atan2(cross.length(), self.axis.dot(other.axis));

        // One may hold the other.
        if (between + b).min(PI) <= a {
            return (self.axis, self.cos_theta_o);
        }
        if (between + a).min(PI) <= b {
            return (other.axis, other.cos_theta_o);
        }

        // Otherwise turn the axis to the middle, with a little room for rounding.
        let theta = 0.5 * (a + b + between) + 1e-4;
        let Some(turn) = cross.try_normalize().filter(|_| theta < PI) else { return (self.axis, -1.0) };
        let (sin, cos) = trig::sin_cos(theta - a);
        let axis = Dir::normalize(self.axis.0 * cos + turn.cross(self.axis.0) * sin);
        (axis, trig::cos(theta))
    }

    /// The surface area and orientation heuristic: `φ M_Ω A`, with `M_Ω` the measure of the directions into which it
    /// emits, by cosine beyond the cone of normals.
    pub(crate) fn cost(&self) -> f32 {
        let (o, e) = (trig::safe_acos(self.cos_theta_o), trig::safe_acos(self.cos_theta_e));
        let w = (o + e).min(PI);
        let (sin_o, cos_o) = trig::sin_cos(o);
        let m = 2.0 * PI * (1.0 - cos_o)
            + 0.5 * PI * (2.0 * w * sin_o - trig::cos(o - 2.0 * w) - 2.0 * o * sin_o + cos_o);
        self.power * m * self.bounds.surface_area()
    }
}

impl Lights {
    /// Where a light at a point is; `None` for all others.
    #[must_use]
    pub fn position(&self, light: LightId) -> Option<Point> {
        match &self.list[light.index()] {
            Light::Point(l) => Some(l.p),
            Light::Spot(l) => Some(l.p),
            Light::Goniometric(l) => Some(l.p()),
            Light::Projection(l) => Some(l.p()),
            Light::Dark
            | Light::Distant(_)
            | Light::InfiniteConstant(_)
            | Light::InfiniteImage(_)
            | Light::Portal(_)
            | Light::Area(_)
            | Light::Moving(_) => None,
        }
    }

    /// Learns how much of skies is seen from where in `bounds`; `is_blocked` tells of rays to infinity.
    pub fn look_at_skies(&mut self, bounds: &Bounds, is_blocked: impl Fn(&Ray) -> bool + Sync) {
        for light in &mut self.list {
            if let Light::InfiniteImage(sky) = light {
                sky.look(bounds, &is_blocked);
            }
        }
    }

    /// A sphere around all lights at finite places that emit, if there are any.
    #[must_use]
    pub fn finite_sphere(&self) -> Option<(Point, f32)> {
        self.finite
    }

    /// Where a light at a finite place is: a point in its middle.
    #[must_use]
    pub fn middle(&self, light: LightId) -> Option<Point> {
        self.position(light).or_else(|| self.surface_point(light).map(|(p, _)| p))
    }

    /// A point in the middle of an emitting surface at the moment zero, and its normal.
    pub(crate) fn surface_point(&self, light: LightId) -> Option<(Point, Dir)> {
        match &self.list[light.index()] {
            Light::Area(l) => {
                let s = l.emitter.sample_area([0.4, 0.3]);
                Some((s.p, s.n))
            }
            Light::Moving(l) => {
                let s = l.sample_area(0.0, [0.4, 0.3]);
                Some((s.p, s.n))
            }
            Light::Dark
            | Light::Point(_)
            | Light::Spot(_)
            | Light::Goniometric(_)
            | Light::Projection(_)
            | Light::Distant(_)
            | Light::InfiniteConstant(_)
            | Light::InfiniteImage(_)
            | Light::Portal(_) => None,
        }
    }

    /// Bounds of a light at a finite place that emits; `None` for all others.
    pub(crate) fn light_bounds(&self, light: LightId) -> Option<LightBounds> {
        let at = |p: Vec3, intensity: f32| LightBounds {
            bounds: Bounds::point(p),
            axis: Dir::Z,
            cos_theta_o: -1.0,
            cos_theta_e: 0.0,
            power: intensity,
            two_sided: false,
        };
        let power = self.power(light);
        if power <= 0.0 {
            return None;
        }
        let of_surface = |bounds, normals: NormalCone, power, two_sided| LightBounds {
            bounds,
            axis: normals.axis,
            cos_theta_o: normals.cos_theta,
            cos_theta_e: 0.0,
            power,
            two_sided,
        };
        let sphere = 4.0 * PI;
        Some(match &self.list[light.index()] {
            Light::Dark
            | Light::Distant(_)
            | Light::InfiniteConstant(_)
            | Light::InfiniteImage(_)
            | Light::Portal(_) => return None,
            // Lights at points count with 4π times their intensity, or its mean over where they shine.
            Light::Point(l) => at(l.p.0, power),
            Light::Goniometric(l) => at(l.p().0, power),
            Light::Projection(l) => at(l.p().0, power * sphere / l.slide_area().min(sphere)),
            Light::Spot(l) => LightBounds {
                axis: l.frame.n,
                cos_theta_o: l.cos_start,
                // Below one, or a hard edge would leave no directions in which it shines.
                cos_theta_e: trig::cos(trig::safe_acos(l.cos_end) - trig::safe_acos(l.cos_start)).min(0.9999),
                ..at(l.p.0, power * sphere / l.solid_angle())
            },
            Light::Area(l) => of_surface(l.emitter.bounds(), l.emitter.normals(), power, l.two_sided),
            Light::Moving(l) => of_surface(l.bounds(), l.normals(), power, l.area.two_sided),
        })
    }
}
