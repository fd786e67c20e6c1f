//! How large a pixel is on a surface, without ray differentials [PBR4e, sec. 10.1.1].
//!
//! The smallest differentials over the film stand for all of it: what they give is never too blurred. As in
//! pbrt-v4 the pixel's footprint is shrunk, since many samples share the pixel; pbrt shrinks by 1/√spp down to an
//! eighth, we by an eighth always: a pass must not know how many there will be.

use math::{Dir, Frame, Point, Vec3};

use super::{Pose, Projection};
use crate::Footprint;

/// pbrt-v4's factor for 64 samples a pixel and more.
const SCALE: f32 = 0.125;

/// Smallest change of a camera ray from one pixel to the next, in the frame about the ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct PixelDifferentials {
    /// Of the origin, for x and y.
    origin: [Vec3; 2],
    /// Of the direction, for x and y.
    dir: [Vec3; 2],
}

impl PixelDifferentials {
    pub(super) fn of(projection: &Projection, resolution: [u32; 2]) -> Self {
        const N: u32 = 24;
        let mut least = Self { origin: [Vec3::INFINITY; 2], dir: [Vec3::INFINITY; 2] };
        let ray_at = |raster| {
            let (o, d) = projection.chief_ray(raster, resolution);
            (o, Dir::normalize(d))
        };
        for i in 0..N * N {
            let at = |k: u32, axis: usize| (k as f32 + 0.5) / N as f32 * resolution[axis] as f32;
            let raster = [at(i % N, 0), at(i / N, 1)];
            let (o, d) = ray_at(raster);
            let frame = Frame::from_normal_tangent(d, Vec3::X);
            for axis in 0..2 {
                let mut next = raster;
                next[axis] += 1.0;
                let (o1, d1) = ray_at(next);
                let local = |v: Vec3| Vec3::new(v.dot(frame.s), v.dot(frame.t), v.dot(frame.n.0));
                keep_shorter(&mut least.origin[axis], local(o1 - o));
                keep_shorter(&mut least.dir[axis], local(d1.0 - d.0));
            }
        }
        least
    }

    /// See [`super::Camera::approximate_footprint`].
    pub(super) fn footprint(&self, pose: &Pose, p: Point, n: Dir) -> Footprint {
        // In a camera frame whose z axis passes through the point, the pixel's ray comes down z.
        let to_p = pose.camera_point(p);
        let frame = Frame::from_normal_tangent(Dir::normalize(to_p), Vec3::X);
        let normal = pose.camera_normal(n);
        let normal = Vec3::new(normal.dot(frame.s), normal.dot(frame.t), normal.dot(frame.n.0));
        let z = to_p.length();
        let d = normal.z * z;

        let change = |axis: usize| {
            let (o, dir) = (self.origin[axis], Vec3::Z + self.dir[axis]);
            let t = (d - normal.dot(o)) / normal.dot(dir);
            let moved = (o + dir * t - Vec3::Z * z) * SCALE;
            let moved = if moved.is_finite() { moved } else { Vec3::ZERO };
            pose.vector(frame.s * moved.x + frame.t * moved.y + frame.n.0 * moved.z)
        };
        Footprint { dpdx: change(0), dpdy: change(1), ..Footprint::default() }
    }

    /// See [`super::Camera::pixel_width`].
    pub(super) fn width(&self, distance: f32) -> f32 {
        let along = |axis: usize| (self.origin[axis] + self.dir[axis] * distance).length();
        along(0).max(along(1))
    }
}

fn keep_shorter(least: &mut Vec3, v: Vec3) {
    if v.length_squared() < least.length_squared() {
        *least = v;
    }
}
