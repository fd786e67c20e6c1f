//! A record of the cache: where irradiance was computed, how far it may be used, and with what weight [Ward1988].
//!
//! The error of using a record at distance d under another normal is ε = d / R + √(1 − n·nᵢ), with R the harmonic
//! mean of the distances that the record sees (the split-sphere model). A record counts while ε is below the allowed
//! error a, with the weight 1 − ε/a [Tabellion2004], so that the interpolated irradiance has no steps.
//!
//! R is limited: by E / |∇E|, so that the gradient does not make light negative; by neighbours, from which a surface
//! cannot be farther away than from here by more than the distance in between [Krivanek2006]; and so that a R stays
//! between the least and the greatest spacing in pixels. What the least spacing adds to R is taken from the gradient.

use math::{Dir, Point};

/// Where irradiance is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Record {
    pub(super) p: Point,
    pub(super) n: Dir,
    /// R after all limits but the least.
    pub(super) radius: f32,
    /// Least R, by the size of a pixel.
    pub(super) least: f32,
}

/// A point may lie this much of R below a record's plane.
const BELOW: f32 = 0.02;

impl Record {
    /// R as it is used.
    pub(super) fn used_radius(&self) -> f32 {
        self.radius.max(self.least)
    }

    /// Weight of the record at `p` under the normal `n`, with the allowed error `a`; zero if it does not count.
    pub(super) fn weight(&self, p: Point, n: Dir, a: f32) -> f32 {
        let d = p - self.p;
        let (radius, cos) = (self.used_radius(), n.dot(self.n));
        let (reach, distance_squared) = (a * radius, d.length_squared());
        if distance_squared >= reach * reach || 1.0 - cos >= a * a {
            return 0.0;
        }
        // From record to point goes down: the record may see what the point, in a fold, does not.
        let mean_normal = (n.0 + self.n.0) * 0.5;
        if d.dot(mean_normal) < -BELOW * reach {
            return 0.0;
        }
        let error = distance_squared.sqrt() / radius + (1.0 - cos).max(0.0).sqrt();
        (1.0 - error / a).max(0.0)
    }

    /// By how much the gradient counts.
    pub(super) fn gradient_share(&self) -> f32 {
        (self.radius / self.used_radius()).min(1.0)
    }

    /// Neighbour clamping of both by each other.
    pub(super) fn clamp_both(&mut self, other: &mut Self) {
        let d = self.p.distance(other.p);
        if self.radius > other.radius + d {
            self.radius = other.radius + d;
        } else if other.radius > self.radius + d {
            other.radius = self.radius + d;
        }
    }
}

#[cfg(test)]
mod tests {
    use math::Vec3;

    use super::*;

    const RECORD: Record = Record { p: Point::new(0.0, 0.0, 0.0), n: Dir::Z, radius: 2.0, least: 0.5 };

    #[test]
    fn weights_fall_to_zero_at_the_allowed_error() {
        let at = |x: f32, n: Dir| RECORD.weight(Point::new(x, 0.0, 0.0), n, 0.25);
        assert_eq!(at(0.0, Dir::Z), 1.0);
        assert!((at(0.25, Dir::Z) - 0.5).abs() < 1e-6);
        assert_eq!(at(0.5001, Dir::Z), 0.0);
        assert!(at(0.499, Dir::Z) > 0.0);
        let tilted = Dir::normalize(Vec3::new(0.2, 0.0, 1.0));
        assert!(at(0.0, tilted) < 1.0 && at(0.0, tilted) > 0.0);
        assert_eq!(at(0.0, -Dir::Z), 0.0);
        assert_eq!(RECORD.weight(Point::new(0.1, 0.0, -0.1), Dir::Z, 0.25), 0.0, "below");
    }

    #[test]
    fn neighbours_know_what_is_near() {
        let (mut a, mut b) = (RECORD, Record { p: Point::new(0.3, 0.0, 0.0), radius: 0.1, ..RECORD });
        a.clamp_both(&mut b);
        assert!((a.radius - 0.4).abs() < 1e-6 && b.radius == 0.1);
        assert_eq!(a.used_radius(), 0.5);
        assert!((a.gradient_share() - 0.8).abs() < 1e-6);
        let mut c = Record { radius: 5.0, ..RECORD };
        b.clamp_both(&mut c);
        assert!((c.radius - 0.4).abs() < 1e-6);
    }
}
