//! Points and directions that refuse nonsense: `Point + Point` and a world direction in a BSDF do not compile.

use std::ops::{Add, Mul, Neg, Sub};

use glam::Vec3;

/// A position in world space (or in the object space that a name states), in scene units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(transparent)]
pub struct Point(pub Vec3);

/// A unit vector in world space: a direction or a normal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(transparent)]
pub struct Dir(pub Vec3);

/// A unit vector in a shading frame, whose third axis is the normal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(transparent)]
pub struct LocalDir(pub Vec3);

impl Point {
    /// The point (x, y, z).
    #[must_use]
    pub const fn new(x: f32, y: f32, z: f32) -> Self {
        Self(Vec3::new(x, y, z))
    }

    /// Squared distance to `other`.
    #[must_use]
    pub fn distance_squared(self, other: Self) -> f32 {
        self.0.distance_squared(other.0)
    }

    /// Distance to `other`.
    #[must_use]
    pub fn distance(self, other: Self) -> f32 {
        self.0.distance(other.0)
    }
}

impl Sub for Point {
    type Output = Vec3;
    fn sub(self, other: Self) -> Vec3 {
        self.0 - other.0
    }
}

impl Add<Vec3> for Point {
    type Output = Self;
    fn add(self, v: Vec3) -> Self {
        Self(self.0 + v)
    }
}

impl Sub<Vec3> for Point {
    type Output = Self;
    fn sub(self, v: Vec3) -> Self {
        Self(self.0 - v)
    }
}

impl Dir {
    /// The z axis.
    pub const Z: Self = Self(Vec3::Z);

    /// `v` made unit. The zero vector gives the z axis: callers that care test for it first.
    #[must_use]
    pub fn normalize(v: Vec3) -> Self {
        Self(v.try_normalize().unwrap_or(Vec3::Z))
    }

    /// Cosine of the angle between two directions.
    #[must_use]
    pub fn dot(self, other: Self) -> f32 {
        self.0.dot(other.0)
    }

    /// |cos| of the angle between two directions.
    #[must_use]
    pub fn abs_dot(self, other: Self) -> f32 {
        self.0.dot(other.0).abs()
    }

    /// This direction, turned to the side of `reference`.
    #[must_use]
    pub fn face_forward(self, reference: Self) -> Self {
        if self.dot(reference) < 0.0 { -self } else { self }
    }
}

impl Neg for Dir {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Mul<f32> for Dir {
    type Output = Vec3;
    fn mul(self, s: f32) -> Vec3 {
        self.0 * s
    }
}

impl LocalDir {
    /// The normal itself.
    pub const NORMAL: Self = Self(Vec3::Z);

    /// The direction (x, y, z), which must be unit.
    #[must_use]
    pub const fn new(x: f32, y: f32, z: f32) -> Self {
        Self(Vec3::new(x, y, z))
    }

    /// `v` made unit; the zero vector gives the normal.
    #[must_use]
    pub fn normalize(v: Vec3) -> Self {
        Self(v.try_normalize().unwrap_or(Vec3::Z))
    }

    /// Signed cosine of the angle to the normal.
    #[must_use]
    pub fn cos_theta(self) -> f32 {
        self.0.z
    }

    /// |cos θ|.
    #[must_use]
    pub fn abs_cos_theta(self) -> f32 {
        self.0.z.abs()
    }

    /// sin² θ, at least zero.
    #[must_use]
    pub fn sin2_theta(self) -> f32 {
        (1.0 - self.0.z * self.0.z).max(0.0)
    }

    /// Do both directions lie on one side of the surface (and neither in it)?
    #[must_use]
    pub fn same_hemisphere(self, other: Self) -> bool {
        self.0.z * other.0.z > 0.0
    }

    /// Dot product.
    #[must_use]
    pub fn dot(self, other: Self) -> f32 {
        self.0.dot(other.0)
    }

    /// The mirror image about the normal: (−x, −y, z).
    #[must_use]
    pub fn reflect(self) -> Self {
        Self(Vec3::new(-self.0.x, -self.0.y, self.0.z))
    }
}

impl Neg for LocalDir {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}
