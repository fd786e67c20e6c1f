//! An orthonormal frame, whose `n` is the normal.

use glam::Vec3;

use crate::{Dir, LocalDir};

/// Right-handed orthonormal axes in world space: `s × t = n`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// First tangent.
    pub s: Vec3,
    /// Second tangent.
    pub t: Vec3,
    /// The normal.
    pub n: Dir,
}

impl Frame {
    /// A frame about `n`, continuous but for one seam [Duff2017].
    #[must_use]
    pub fn from_normal(n: Dir) -> Self {
        let v = n.0;
        let sign = 1.0_f32.copysign(v.z);
        let a = -1.0 / (sign + v.z);
        let b = v.x * v.y * a;
        Self {
            s: Vec3::new(1.0 + sign * v.x * v.x * a, sign * b, -sign * v.x),
            t: Vec3::new(b, sign + v.y * v.y * a, -v.y),
            n,
        }
    }

    /// A frame about `n` whose `s` leans towards `tangent`; any frame where `tangent` is zero or parallel to `n`.
    #[must_use]
    pub fn from_normal_tangent(n: Dir, tangent: Vec3) -> Self {
        match (tangent - n.0 * n.0.dot(tangent)).try_normalize() {
            Some(s) => Self { s, t: n.0.cross(s), n },
            None => Self::from_normal(n),
        }
    }

    /// From world to this frame.
    #[must_use]
    pub fn to_local(&self, v: Dir) -> LocalDir {
        LocalDir(Vec3::new(v.0.dot(self.s), v.0.dot(self.t), v.0.dot(self.n.0)))
    }

    /// From this frame to world.
    #[must_use]
    pub fn to_world(&self, v: LocalDir) -> Dir {
        Dir(self.s * v.0.x + self.t * v.0.y + self.n.0 * v.0.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_orthonormal_and_right_handed() {
        for v in [Vec3::Z, -Vec3::Z, Vec3::X, Vec3::new(0.3, -0.5, -0.8), Vec3::new(1e-4, 1e-4, -1.0)] {
            let f = Frame::from_normal(Dir::normalize(v));
            assert!((f.s.length() - 1.0).abs() < 1e-5 && (f.t.length() - 1.0).abs() < 1e-5);
            assert!((f.s.cross(f.t) - f.n.0).length() < 1e-5, "{v:?}");
            let w = LocalDir::normalize(Vec3::new(0.1, 0.7, 0.4));
            assert!((f.to_local(f.to_world(w)).0 - w.0).length() < 1e-5);
        }
    }
}
