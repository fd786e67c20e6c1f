//! Primitives and where lines meet them, each in one scalar routine that every kernel shares.

mod bilinear;
mod curve;
mod cylinder;
mod disk;
mod moving;
mod sphere;
pub(crate) mod triangle;

use math::{Bounds, DVec3, Transform, Vec3};

use crate::ray_space::RaySpace;

pub use curve::{Curve, CurveKind};
pub use cylinder::Cylinder;
pub use disk::Disk;
pub use moving::{share_of_motion, vertex_between};
pub use sphere::Sphere;

pub(crate) use bilinear::{bounds as patch_bounds, is_degenerate as patch_is_degenerate};
pub(crate) use curve::PIECES;
pub(crate) use moving::MovingTriangle;
pub(crate) use triangle::Corners;

/// A point where the ray's line meets a primitive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Root {
    pub(crate) t: f64,
    pub(crate) u: f32,
    pub(crate) v: f32,
}

/// At most two of them, the nearer first.
pub(crate) type Roots = [Option<Root>; 2];

/// What is not a triangle that stands still.
#[derive(Clone, Debug)]
pub(crate) enum Primitive {
    Moving(Box<MovingTriangle>),
    Patch(Box<[Vec3; 4]>),
    Sphere(Box<Sphere>),
    Disk(Box<Disk>),
    Cylinder(Box<Cylinder>),
    /// Part `piece` of the curve with this index.
    CurvePiece {
        curve: u32,
        piece: u32,
    },
}

impl Primitive {
    /// Where the line meets it, the interval of the primitive's own box given.
    pub(crate) fn roots(&self, curves: &[Curve], ray: &RaySpace) -> Roots {
        match self {
            Self::Moving(m) => m.roots(ray),
            Self::Patch(corners) => bilinear::roots(corners, ray),
            Self::Sphere(s) => s.roots(ray),
            Self::Disk(d) => d.roots(ray),
            Self::Cylinder(c) => c.roots(ray),
            Self::CurvePiece { curve, piece } => curves[*curve as usize].roots(*piece, ray),
        }
    }

    /// Bytes outside of the enum itself.
    pub(crate) fn heap(&self) -> usize {
        match self {
            Self::Moving(_) => size_of::<MovingTriangle>(),
            Self::Patch(_) => size_of::<[Vec3; 4]>(),
            Self::Sphere(_) => size_of::<Sphere>(),
            Self::Disk(_) => size_of::<Disk>(),
            Self::Cylinder(_) => size_of::<Cylinder>(),
            Self::CurvePiece { .. } => 0,
        }
    }
}

/// The ray's line in a quadric's own space, in double precision.
pub(crate) struct Line {
    pub(crate) o: DVec3,
    pub(crate) d: DVec3,
}

impl Line {
    pub(crate) fn local(ray: &RaySpace, object_from_local: &Transform) -> Self {
        let m = object_from_local.inverse_matrix();
        Self { o: m.transform_point3(ray.origin()), d: m.transform_vector3(ray.direction()) }
    }

    pub(crate) fn at(&self, t: f64) -> DVec3 {
        self.o + self.d * t
    }
}

/// Angle about the z axis, in [0, 2π).
pub(crate) fn phi(p: DVec3) -> f64 {
    let phi = math::trig::f64::atan2(p.y, p.x);
    if phi < 0.0 { phi + std::f64::consts::TAU } else { phi }
}

/// The box of a mapped local box, rounded outwards.
pub(crate) fn mapped_bounds(object_from_local: &Transform, min: DVec3, max: DVec3) -> Bounds {
    let mut all = Bounds::EMPTY;
    for i in 0..8 {
        let pick = |bit: usize, axis: usize| if i & bit == 0 { min[axis] } else { max[axis] };
        let p = object_from_local.matrix().transform_point3(DVec3::new(pick(1, 0), pick(2, 1), pick(4, 2)));
        all = all.grow(p.as_vec3());
    }
    round_outwards(&all)
}

/// Larger by two roundings on every side.
pub(crate) fn round_outwards(b: &Bounds) -> Bounds {
    let grow = |x: f32, sign: f32| x + sign * (x.abs() * (2.0 * f32::EPSILON)).max(f32::MIN_POSITIVE);
    let map = |v: Vec3, sign: f32| Vec3::new(grow(v.x, sign), grow(v.y, sign), grow(v.z, sign));
    Bounds { min: map(b.min, -1.0), max: map(b.max, 1.0) }
}

/// A ray for tests.
#[cfg(test)]
pub(crate) fn test_ray(o: [f32; 3], d: [f32; 3]) -> RaySpace {
    RaySpace::new(Vec3::from_array(o), Vec3::from_array(d), 0.0, 10.0).expect("a proper ray")
}
