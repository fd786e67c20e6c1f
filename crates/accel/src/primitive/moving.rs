//! A triangle whose corners move on straight lines between two moments.

use math::Bounds;

use super::{Root, Roots, triangle};
use crate::ray_space::RaySpace;

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

    /// Not a triangle at one of its keys?
    pub(crate) fn is_degenerate(&self) -> bool {
        self.keys.iter().any(triangle::is_degenerate)
    }

    /// The corners at a moment, never outside of [`MovingTriangle::bounds`].
    fn at(&self, time: f32) -> [[f32; 3]; 3] {
        let x = ((time - self.times[0]) / (self.times[1] - self.times[0])).clamp(0.0, 1.0);
        let x = if x.is_nan() { 0.0 } else { x };
        std::array::from_fn(|i| {
            std::array::from_fn(|axis| {
                let (a, b) = (self.keys[0][i][axis], self.keys[1][i][axis]);
                (a + (b - a) * x).clamp(a.min(b), a.max(b))
            })
        })
    }

    pub(crate) fn roots(&self, ray: &RaySpace) -> Roots {
        let p = self.at(ray.time);
        let (entry, exit) = ray.slab(&p.iter().fold(Bounds::EMPTY, |b, &q| b.grow(q.into())));
        if !(entry <= exit) {
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
}
