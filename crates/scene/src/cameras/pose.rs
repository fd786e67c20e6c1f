//! Where the camera is: single-precision matrices at one moment.

use std::borrow::Cow;

use math::{AnimatedTransform, Dir, Point, Transform, Vec3};

/// The camera's place over time.
#[derive(Clone, Debug)]
pub(super) enum Placement {
    Fixed(Pose),
    Moving(AnimatedTransform),
}

/// The camera's place at one moment. Columns are the images of the axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    /// Camera axes in world space.
    axes: [Vec3; 3],
    origin: Vec3,
    /// World axes in camera space.
    inverse_axes: [Vec3; 3],
    /// |det| of camera-from-world.
    inverse_det: f32,
    /// World area of a unit of camera space's xy plane.
    film_scale: f32,
    /// +z of the film plane as a world normal.
    forward: Dir,
}

impl Placement {
    /// `None` if the transform is not finite or not affine.
    pub(super) fn new(t: &AnimatedTransform) -> Option<Self> {
        let ok = |t: Transform| t.is_affine() && t.matrix().is_finite() && t.inverse_matrix().is_finite();
        if !ok(t.start()) || !ok(t.end()) {
            return None;
        }
        Some(if t.is_animated() { Self::Moving(*t) } else { Self::Fixed(Pose::new(&t.start())) })
    }

    #[inline]
    pub(super) fn at(&self, time: f32) -> Cow<'_, Pose> {
        match self {
            Self::Fixed(pose) => Cow::Borrowed(pose),
            Self::Moving(t) => Cow::Owned(Pose::new(&t.at(time))),
        }
    }
}

impl Pose {
    fn new(t: &Transform) -> Self {
        let (m, i) = (t.matrix(), t.inverse_matrix());
        let axes = [m.x_axis, m.y_axis, m.z_axis].map(|a| a.truncate());
        let inverse = glam_mat3(&i);
        Self {
            axes: axes.map(|a| a.as_vec3()),
            origin: m.w_axis.truncate().as_vec3(),
            inverse_axes: [inverse[0], inverse[1], inverse[2]].map(|a| a.as_vec3()),
            inverse_det: inverse[0].dot(inverse[1].cross(inverse[2])).abs() as f32,
            film_scale: axes[0].cross(axes[1]).length() as f32,
            forward: t.normal(Dir::Z),
        }
    }

    pub(super) fn point(&self, p: Vec3) -> Point {
        Point(self.origin + self.vector(p))
    }

    pub(super) fn vector(&self, v: Vec3) -> Vec3 {
        self.axes[0] * v.x + self.axes[1] * v.y + self.axes[2] * v.z
    }

    pub(super) fn camera_vector(&self, v: Vec3) -> Vec3 {
        self.inverse_axes[0] * v.x + self.inverse_axes[1] * v.y + self.inverse_axes[2] * v.z
    }

    pub(super) fn camera_point(&self, p: Point) -> Vec3 {
        self.camera_vector(p.0 - self.origin)
    }

    /// The film plane's forward normal.
    pub(super) fn forward(&self) -> Dir {
        self.forward
    }

    /// World area of a unit of camera space's xy plane.
    pub(super) fn film_scale(&self) -> f32 {
        self.film_scale
    }

    /// `dω_camera / dω_world` about a world direction whose image has the length `mapped`: |det M⁻¹| / |M⁻¹ w|³.
    pub(super) fn solid_angle_ratio(&self, mapped: f32) -> f32 {
        self.inverse_det / (mapped * mapped * mapped)
    }

    /// A normal into camera space (not unit): by the transpose of world-from-camera.
    pub(super) fn camera_normal(&self, n: Dir) -> Vec3 {
        Vec3::new(self.axes[0].dot(n.0), self.axes[1].dot(n.0), self.axes[2].dot(n.0))
    }
}

fn glam_mat3(m: &math::DMat4) -> [math::DVec3; 3] {
    [m.x_axis.truncate(), m.y_axis.truncate(), m.z_axis.truncate()]
}
