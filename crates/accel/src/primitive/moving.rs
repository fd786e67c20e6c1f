//! A triangle whose corners move on straight lines between two moments.

use math::{Bounds, Vec3};

use super::{Root, Roots, triangle};
use crate::ray_space::RaySpace;

/// How much of the way between two keys is done at a moment: 0 before the first, 1 after the second.
#[must_use]
pub fn share_of_motion(times: [f32; 2], time: f32) -> f32 {
    let x = ((time - times[0]) / (times[1] - times[0])).clamp(0.0, 1.0);
    if x.is_nan() { 0.0 } else { x }
}

/// Where a vertex of a [moving mesh](crate::Shape::MovingMesh) is after a [share](share_of_motion) of its way, to the bit as rays
/// meet it.
#[must_use]
pub fn vertex_between(start: Vec3, end: Vec3, share: f32) -> Vec3 {
    (start + (end - start) * share).clamp(start.min(end), start.max(end))
}

/// Corners at two keys.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MovingTriangle {
    pub(crate) keys: [[[f32; 3]; 3]; 2],
    pub(crate) times: [f32; 2],
}

impl MovingTriangle {
    /// The box over all time.
    pub(crate) fn bounds(&self) -> Bounds {
        self.keys.iter().flatten().fold(Bounds::EMPTY, |b, &p| b.grow(p.into()))
    }

    /// Can no ray meet it? (One without area at its keys may have some on the way.)
    pub(crate) fn is_degenerate(&self) -> bool {
        self.keys.iter().flatten().any(triangle::is_far)
    }

    /// The corners at a moment, never outside of [`MovingTriangle::bounds`].
    fn at(&self, time: f32) -> [[f32; 3]; 3] {
        let share = share_of_motion(self.times, time);
        let [start, end] = &self.keys;
        std::array::from_fn(|i| vertex_between(start[i].into(), end[i].into(), share).to_array())
    }

    pub(crate) fn roots(&self, ray: &RaySpace) -> Roots {
        let p = self.at(ray.time);
        let (entry, exit) = ray.slab(&p.iter().fold(Bounds::EMPTY, |b, &q| b.grow(q.into())));
        if !(entry <= exit) || triangle::is_degenerate(&p) {
            return [None; 2];
        }
        let hit = triangle::finish(ray, &p, entry, exit);
        [hit.map(|(t, u, v)| Root { t: f64::from(t), u, v }), None]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::primitive::test_ray;

    #[test]
    fn it_is_halfway_at_half_time_and_rests_outside_of_its_keys() {
        let p = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let m = MovingTriangle { keys: [p, p.map(|q| [q[0], q[1], q[2] + 2.0])], times: [1.0, 3.0] };
        for (time, t) in [(0.0, 5.0), (1.0, 5.0), (2.0, 4.0), (3.0, 3.0), (9.0, 3.0)] {
            let ray = RaySpace { time, ..test_ray([0.2, 0.2, 5.0], [0.0, 0.0, -1.0]) };
            assert_eq!(m.roots(&ray)[0].map(|r| r.t), Some(t));
        }
    }

    #[test]
    fn what_grows_from_a_point_is_met_once_it_has_grown() {
        let p = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let m = MovingTriangle { keys: [[[0.0; 3]; 3], p], times: [0.0, 1.0] };
        assert!(!m.is_degenerate());
        for (time, t) in [(0.0, None), (0.3, None), (0.5, Some(5.0)), (1.0, Some(5.0))] {
            let ray = RaySpace { time, ..test_ray([0.2, 0.2, 5.0], [0.0, 0.0, -1.0]) };
            assert_eq!(m.roots(&ray)[0].map(|r| r.t), t, "at {time}");
        }
        let far = MovingTriangle { keys: [p, [[f32::NAN, 0.0, 0.0]; 3]], times: [0.0, 1.0] };
        assert!(far.is_degenerate());
    }
}
