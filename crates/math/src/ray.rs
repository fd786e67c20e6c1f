//! A ray: half a line with an end, at a moment.

use crate::{Dir, Point};

/// From `origin` along `dir` up to distance `t_max`, at `time`.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where it starts.
    pub origin: Point,
    /// Where it goes; unit.
    pub dir: Dir,
    /// Hits at `t >= t_max` do not count.
    pub t_max: f32,
    /// The moment, in the scene's units of time.
    pub time: f32,
}

impl Ray {
    /// An endless ray.
    #[must_use]
    pub fn new(origin: Point, dir: Dir, time: f32) -> Self {
        Self { origin, dir, t_max: f32::INFINITY, time }
    }

    /// The point at distance `t`.
    #[must_use]
    pub fn at(&self, t: f32) -> Point {
        self.origin + self.dir.0 * t
    }
}
