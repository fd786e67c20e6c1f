//! Axis-aligned boxes.

use glam::Vec3;

use crate::Point;

/// An axis-aligned box in space. The empty box has `min > max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lower corner.
    pub min: Vec3,
    /// Upper corner.
    pub max: Vec3,
}

impl Default for Bounds {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl Bounds {
    /// Holds nothing; the neutral element of [`Bounds::union`].
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The box of one point.
    #[must_use]
    pub fn point(p: Vec3) -> Self {
        Self { min: p, max: p }
    }

    /// The smallest box around both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The smallest box around this one and a point.
    #[must_use]
    pub fn grow(self, p: Vec3) -> Self {
        Self { min: self.min.min(p), max: self.max.max(p) }
    }

    /// Nothing inside?
    #[must_use]
    pub fn is_empty(&self) -> bool {
        !(self.min.cmple(self.max).all())
    }

    /// Extent along each axis.
    #[must_use]
    pub fn size(&self) -> Vec3 {
        self.max - self.min
    }

    /// The middle.
    #[must_use]
    pub fn center(&self) -> Point {
        Point(self.min * 0.5 + self.max * 0.5)
    }

    /// Area of the six faces; zero for the empty box.
    #[must_use]
    pub fn surface_area(&self) -> f32 {
        if self.is_empty() {
            return 0.0;
        }
        let d = self.size();
        2.0 * (d.x * d.y + d.y * d.z + d.z * d.x)
    }

    /// Is `p` inside or on the border?
    #[must_use]
    pub fn contains(&self, p: Point) -> bool {
        p.0.cmpge(self.min).all() && p.0.cmple(self.max).all()
    }

    /// The eight corners.
    #[must_use]
    pub fn corners(&self) -> [Vec3; 8] {
        std::array::from_fn(|i| {
            let pick = |bit: usize, lo: f32, hi: f32| if i & bit == 0 { lo } else { hi };
            Vec3::new(
                pick(1, self.min.x, self.max.x),
                pick(2, self.min.y, self.max.y),
                pick(4, self.min.z, self.max.z),
            )
        })
    }

    /// Centre and radius of the sphere around the box.
    #[must_use]
    pub fn bounding_sphere(&self) -> (Point, f32) {
        let c = self.center();
        (c, if self.is_empty() { 0.0 } else { c.0.distance(self.max) })
    }
}

/// A half-open rectangle of pixels: `min` belongs to it, `max` does not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Bounds2i {
    /// First column and row.
    pub min: [i32; 2],
    /// One past the last column and row.
    pub max: [i32; 2],
}

impl Bounds2i {
    /// From `min` to `max`.
    #[must_use]
    pub fn new(min: [i32; 2], max: [i32; 2]) -> Self {
        Self { min, max }
    }

    /// Columns; never negative.
    #[must_use]
    pub fn width(&self) -> usize {
        (self.max[0] - self.min[0]).max(0) as usize
    }

    /// Rows; never negative.
    #[must_use]
    pub fn height(&self) -> usize {
        (self.max[1] - self.min[1]).max(0) as usize
    }

    /// Number of pixels.
    #[must_use]
    pub fn area(&self) -> usize {
        self.width() * self.height()
    }

    /// Is the pixel inside?
    #[must_use]
    pub fn contains(&self, p: [i32; 2]) -> bool {
        (0..2).all(|a| self.min[a] <= p[a] && p[a] < self.max[a])
    }

    /// What both share.
    #[must_use]
    pub fn intersect(&self, other: &Self) -> Self {
        Self {
            min: [self.min[0].max(other.min[0]), self.min[1].max(other.min[1])],
            max: [self.max[0].min(other.max[0]), self.max[1].min(other.max[1])],
        }
    }

    /// Larger by `n` pixels on every side.
    #[must_use]
    pub fn expand(&self, n: i32) -> Self {
        Self { min: [self.min[0] - n, self.min[1] - n], max: [self.max[0] + n, self.max[1] + n] }
    }
}
