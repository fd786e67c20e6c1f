//! Where the camera is: single-precision maps at one moment.

use std::borrow::Cow;

use math::{AnimatedTransform, Dir, Point, Transform, Vec3};

use crate::linear_map::AffineMap;

/// The camera's place over time.
#[derive(Clone, Debug)]
pub(super) enum Placement {
    Fixed(Pose),
    Moving(Box<AnimatedTransform>),
}

/// The camera's place at one moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    world_from_camera: AffineMap,
    /// World area of a unit of camera space's xy plane.
    film_scale: f32,
    /// +z of the film plane as a world normal.
    forward: Dir,
}

impl Placement {
    /// `None` if the transform is not finite or not affine.
    pub(super) fn new(t: &AnimatedTransform) -> Option<Self> {
        let (start, _) = (Pose::new(&t.start())?, Pose::new(&t.end())?);
        Some(if t.is_animated() { Self::Moving(Box::new(*t)) } else { Self::Fixed(start) })
    }

    #[inline]
    pub(super) fn at(&self, time: f32) -> Cow<'_, Pose> {
        match self {
            Self::Fixed(pose) => Cow::Borrowed(pose),
            // Between two affine keys every transform is affine.
            Self::Moving(t) => Cow::Owned(Pose::new(&t.at(time)).unwrap_or_default()),
        }
    }
}

impl Default for Pose {
    fn default() -> Self {
        Self { world_from_camera: AffineMap::IDENTITY, film_scale: 1.0, forward: Dir::Z }
    }
}

impl Pose {
    fn new(t: &Transform) -> Option<Self> {
        let world_from_camera = AffineMap::of(t)?;
        let film_scale = world_from_camera.linear.area_ratio(Vec3::Z);
        Some(Self { world_from_camera, film_scale, forward: world_from_camera.normal(Vec3::Z) })
    }

    #[inline]
    pub(super) fn point(&self, p: Vec3) -> Point {
        self.world_from_camera.point(p)
    }

    #[inline]
    pub(super) fn vector(&self, v: Vec3) -> Vec3 {
        self.world_from_camera.linear.apply(v)
    }

    pub(super) fn camera_vector(&self, v: Vec3) -> Vec3 {
        self.world_from_camera.linear.apply_inverse(v)
    }

    pub(super) fn camera_point(&self, p: Point) -> Vec3 {
        self.world_from_camera.inverse_point(p)
    }

    /// A normal into camera space; not unit.
    pub(super) fn camera_normal(&self, n: Dir) -> Vec3 {
        self.world_from_camera.linear.apply_inverse_normal(n.0)
    }

    /// The film plane's forward normal.
    pub(super) fn forward(&self) -> Dir {
        self.forward
    }

    /// World area of a unit of camera space's xy plane.
    pub(super) fn film_scale(&self) -> f32 {
        self.film_scale
    }

    /// `dω_camera / dω_world` about a world direction whose image in camera space has the length `mapped`.
    pub(super) fn solid_angle_ratio(&self, mapped: f32) -> f32 {
        self.world_from_camera.linear.inverse_solid_angle_ratio(mapped)
    }
}
