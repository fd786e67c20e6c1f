//! The opening of a thin lens: a point, a disk or a polygon.
//!
//! Disk: concentric map [Shirley1997]. Polygon: a fan of triangles about the centroid, chosen by area; it must be
//! star-shaped about its centroid, as blades and stars are.

use std::f32::consts::PI;
use std::sync::Arc;

use math::Vec2;
use sampling::{Area, Pdf, warp};
use scene_desc::ApertureDesc;

/// An opening, in camera space at z = 0.
#[derive(Clone, Debug)]
pub(super) enum Aperture {
    Point,
    Disk { radius: f32 },
    Polygon { fan: Arc<Fan>, radius: f32 },
}

/// Triangles (centroid, corner, next corner) with the running sum of their areas, on the unit disk.
#[derive(Clone, Debug)]
pub(super) struct Fan {
    center: Vec2,
    corners: Vec<Vec2>,
    /// Area of all triangles up to and including each.
    area_until: Vec<f32>,
}

impl Aperture {
    /// `None` for a polygon without area.
    pub(super) fn new(radius: f32, shape: &ApertureDesc) -> Option<Self> {
        if radius <= 0.0 {
            return Some(Self::Point);
        }
        match shape {
            ApertureDesc::Disk => Some(Self::Disk { radius }),
            ApertureDesc::Polygon(corners) => {
                Fan::new(corners).map(|fan| Self::Polygon { fan: Arc::new(fan), radius })
            }
        }
    }

    pub(super) fn is_point(&self) -> bool {
        matches!(self, Self::Point)
    }

    /// Uniform over the opening.
    pub(super) fn sample(&self, u: [f32; 2]) -> Vec2 {
        match self {
            Self::Point => Vec2::ZERO,
            Self::Disk { radius } => warp::concentric_disk(u) * *radius,
            Self::Polygon { fan, radius } => fan.sample(u) * *radius,
        }
    }

    /// Is the point of the lens plane in the opening?
    pub(super) fn contains(&self, p: Vec2) -> bool {
        match self {
            Self::Point => false,
            Self::Disk { radius } => p.length_squared() < radius * radius,
            Self::Polygon { fan, radius } => fan.contains(p / *radius),
        }
    }

    /// Density of [`Aperture::sample`] in camera space; `None` for a point.
    pub(super) fn pdf(&self) -> Option<Pdf<Area>> {
        match self {
            Self::Point => None,
            Self::Disk { radius } => Some(Pdf::new(1.0 / (PI * radius * radius))),
            Self::Polygon { fan, radius } => Some(Pdf::new(1.0 / (fan.area() * radius * radius))),
        }
    }
}

impl Fan {
    fn new(corners: &[Vec2]) -> Option<Self> {
        // The centroid by area, from triangles about the first corner.
        let first = *corners.first()?;
        let (mut area, mut moment) = (0.0, Vec2::ZERO);
        for pair in corners.windows(2) {
            let a = 0.5 * (pair[0] - first).perp_dot(pair[1] - first);
            area += a;
            moment += a * (first + pair[0] + pair[1]) / 3.0;
        }
        if area == 0.0 || !area.is_finite() {
            return None;
        }
        let center = moment / area;

        let mut sum = 0.0;
        let area_until = (0..corners.len())
            .map(|i| {
                let (a, b) = (corners[i] - center, corners[(i + 1) % corners.len()] - center);
                sum += 0.5 * a.perp_dot(b).abs();
                sum
            })
            .collect();
        Some(Self { center, corners: corners.to_vec(), area_until })
    }

    fn area(&self) -> f32 {
        self.area_until.last().copied().unwrap_or(0.0)
    }

    fn contains(&self, p: Vec2) -> bool {
        (0..self.corners.len()).any(|i| {
            let (a, b) = (self.corners[i], self.corners[(i + 1) % self.corners.len()]);
            let side = |a: Vec2, b: Vec2| (b - a).perp_dot(p - a);
            let sides = [side(self.center, a), side(a, b), side(b, self.center)];
            sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0)
        })
    }

    fn sample(&self, u: [f32; 2]) -> Vec2 {
        // Pick a triangle by area and use what is left of the number again.
        let x = u[0] * self.area();
        let i = self.area_until.partition_point(|&a| a <= x).min(self.corners.len() - 1);
        let before = if i == 0 { 0.0 } else { self.area_until[i - 1] };
        let u0 = ((x - before) / (self.area_until[i] - before)).clamp(0.0, 1.0);

        // Uniform in the triangle: the square root keeps areas.
        let (a, b) = (self.corners[i], self.corners[(i + 1) % self.corners.len()]);
        let root = u0.sqrt();
        self.center + (a - self.center) * (root * (1.0 - u[1])) + (b - self.center) * (root * u[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polygon_is_filled_evenly() {
        // A triangle with corners (0,0), (1,0), (0,1): x + y < 1/2 holds a quarter of its area.
        let corners = vec![Vec2::ZERO, Vec2::X, Vec2::Y];
        let lens = Aperture::new(2.0, &ApertureDesc::Polygon(corners)).unwrap();
        assert!((lens.pdf().unwrap().value() - 0.5).abs() < 1e-6);
        let n = 200;
        let inside = (0..n * n)
            .filter(|i| {
                let u = [(i % n) as f32 + 0.5, (i / n) as f32 + 0.5].map(|x| x / n as f32);
                let p = lens.sample(u);
                assert!(lens.contains(p));
                assert!(p.x >= -1e-5 && p.y >= -1e-5 && p.x + p.y <= 2.0 + 1e-5);
                p.x + p.y < 1.0
            })
            .count();
        assert!((inside as f32 / (n * n) as f32 - 0.25).abs() < 0.01);
        assert!(!lens.contains(Vec2::new(1.1, 1.1)) && !lens.contains(Vec2::new(-0.1, 0.5)));
    }
}
