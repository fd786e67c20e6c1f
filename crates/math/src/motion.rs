//! A transform that moves between two keys: translation and scale lerped, rotation slerped [PBR4e, sec. 3.10].

use glam::{DMat3, DMat4, DQuat, DVec3};

use crate::{Bounds, Transform};

/// A transform at each moment. Before the first key and after the second it stands still.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnimatedTransform {
    start: Transform,
    end: Transform,
    times: [f32; 2],
    parts: Option<[Parts; 2]>,
}

/// Translation, rotation and (possibly sheared) scale.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Parts {
    t: DVec3,
    r: DQuat,
    s: DMat3,
}

impl AnimatedTransform {
    /// Does not move.
    #[must_use]
    pub fn fixed(t: Transform) -> Self {
        Self { start: t, end: t, times: [0.0, 1.0], parts: None }
    }

    /// Moves from `start` at `times[0]` to `end` at `times[1]`.
    #[must_use]
    pub fn new(start: Transform, end: Transform, times: [f32; 2]) -> Self {
        if start == end || times[0] >= times[1] {
            return Self { start, end: start, times, parts: None };
        }
        let (a, mut b) = (decompose(start.matrix()), decompose(end.matrix()));
        if a.r.dot(b.r) < 0.0 {
            b.r = -b.r;
        }
        Self { start, end, times, parts: Some([a, b]) }
    }

    /// Does it move at all?
    #[must_use]
    pub fn is_animated(&self) -> bool {
        self.parts.is_some()
    }

    /// The transform at the first key.
    #[must_use]
    pub fn start(&self) -> Transform {
        self.start
    }

    /// The transform at the first key, where it stands.
    #[must_use]
    pub fn start_ref(&self) -> &Transform {
        &self.start
    }

    /// The transform at the second key.
    #[must_use]
    pub fn end(&self) -> Transform {
        self.end
    }

    /// The moments of the two keys.
    #[must_use]
    pub fn times(&self) -> [f32; 2] {
        self.times
    }

    /// The angle in radians by which it turns between the keys: at every moment, directions are within half of it from where
    /// they are halfway.
    #[must_use]
    pub fn turning_angle(&self) -> f32 {
        let Some([a, b]) = &self.parts else { return 0.0 };
        (2.0 * libm::acos(a.r.dot(b.r).clamp(-1.0, 1.0))) as f32
    }

    /// The transform at `time`.
    #[must_use]
    pub fn at(&self, time: f32) -> Transform {
        let Some([a, b]) = &self.parts else { return self.start };
        if time <= self.times[0] {
            return self.start;
        }
        if time >= self.times[1] {
            return self.end;
        }
        let x = f64::from((time - self.times[0]) / (self.times[1] - self.times[0]));
        let m = DMat4::from_translation(a.t.lerp(b.t, x))
            * DMat4::from_quat(slerp(a.r, b.r, x))
            * DMat4::from_mat3(a.s * (1.0 - x) + b.s * x);
        Transform::from_matrix(m).unwrap_or(self.start)
    }

    /// A box around everything that `b` sweeps, found by fine sampling and a margin for what lies between.
    #[must_use]
    pub fn motion_bounds(&self, b: Bounds) -> Bounds {
        const STEPS: u32 = 64;
        if self.parts.is_none() || b.is_empty() {
            return self.start.bounds(b);
        }
        let at = |i: u32| {
            let x = i as f32 / STEPS as f32;
            self.at(self.times[0] + (self.times[1] - self.times[0]) * x).bounds(b)
        };
        let mut all = at(0);
        let mut step = 0.0_f32;
        let mut last = all;
        for i in 1..=STEPS {
            let now = at(i);
            step = step.max((now.min - last.min).abs().max_element());
            step = step.max((now.max - last.max).abs().max_element());
            all = all.union(now);
            last = now;
        }
        let margin = glam::Vec3::splat(step * 0.25);
        Bounds { min: all.min - margin, max: all.max + margin }
    }
}

/// A motion within another, seen from outside; exact unless both move and turn.
impl std::ops::Mul for AnimatedTransform {
    type Output = Self;
    fn mul(self, inner: Self) -> Self {
        let times = if self.is_animated() { self.times } else { inner.times };
        let at = |t: f32| self.at(t) * inner.at(t);
        Self::new(at(times[0]), at(times[1]), times)
    }
}

/// Polar decomposition by Higham's iteration: M = T R S.
fn decompose(m: DMat4) -> Parts {
    let t = m.w_axis.truncate();
    let upper = DMat3::from_mat4(m);
    let mut r = upper;
    for _ in 0..100 {
        let next = (r + r.inverse().transpose()) * 0.5;
        let change = (next - r).to_cols_array().iter().fold(0.0_f64, |a, x| a.max(x.abs()));
        r = next;
        if change < 1e-12 {
            break;
        }
    }
    // A reflection goes into the scale: quaternions only turn.
    if r.determinant() < 0.0 {
        r *= -1.0;
    }
    Parts { t, r: DQuat::from_mat3(&r).normalize(), s: r.inverse() * upper }
}

/// Spherical interpolation with portable functions (glam's uses the platform's sine).
fn slerp(a: DQuat, b: DQuat, x: f64) -> DQuat {
    let cos = a.dot(b).clamp(-1.0, 1.0);
    if cos > 0.9995 {
        return (a * (1.0 - x) + b * x).normalize();
    }
    let theta = libm::acos(cos);
    ((a * libm::sin(theta * (1.0 - x)) + b * libm::sin(theta * x)) * (1.0 / libm::sin(theta))).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Point;

    #[test]
    fn half_a_quarter_turn_is_an_eighth() {
        let end = Transform::rotate(DVec3::Z, std::f64::consts::FRAC_PI_2).unwrap();
        let a = AnimatedTransform::new(Transform::IDENTITY, end, [0.0, 1.0]);
        let p = a.at(0.5).point(Point::new(1.0, 0.0, 0.0));
        assert!(p.distance(Point::new(0.5_f32.sqrt(), 0.5_f32.sqrt(), 0.0)) < 1e-6);
        assert!((a.turning_angle() - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
    }
}
