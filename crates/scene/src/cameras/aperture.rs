//! The opening of a lens: a point, a disk, a polygon, or a table of how much of it is open.
//!
//! Disk: concentric map [Shirley1997]. Polygon: a fan of triangles about the centroid, chosen by area; it must be
//! star-shaped about its centroid, as blades and stars are. Images and Gaussians: by the cells of their table, within the disk
//! (pbrt-v4 lets an image's corners outside of it pass).

use std::f32::consts::PI;
use std::sync::Arc;

use math::{Vec2, trig};
use sampling::distribution::PiecewiseConstant2D;
use sampling::{Area, Pdf, warp};
use scene_desc::ApertureDesc;

/// An opening, in camera space at z = 0.
#[derive(Clone, Debug)]
pub(super) enum Aperture {
    Point,
    Disk { radius: f32 },
    Polygon { fan: Arc<Fan>, radius: f32 },
    Table { table: Arc<PiecewiseConstant2D>, radius: f32 },
}

/// Cells along the sides of a Gaussian's table: pbrt-v4's.
const GAUSSIAN: usize = 256;

/// Triangles (centroid, corner, next corner) with the running sum of their areas, on the unit disk.
#[derive(Clone, Debug)]
pub(super) struct Fan {
    center: Vec2,
    corners: Vec<Vec2>,
    /// Area of all triangles up to and including each.
    area_until: Vec<f32>,
}

impl Aperture {
    /// `None` for a polygon without area, for an image that is black or cannot be read.
    pub(super) fn new(radius: f32, shape: &ApertureDesc) -> Option<Self> {
        if radius <= 0.0 {
            return Some(Self::Point);
        }
        match shape {
            ApertureDesc::Disk => Some(Self::Disk { radius }),
            ApertureDesc::Polygon(corners) => {
                Fan::new(corners).map(|fan| Self::Polygon { fan: Arc::new(fan), radius })
            }
            ApertureDesc::Gaussian => {
                let edge = trig::exp(-1.0);
                Self::table(radius, [GAUSSIAN; 2], |_, p| trig::exp(-p.length_squared()) - edge)
            }
            ApertureDesc::Image(path) => {
                let image = image::load(path).ok()?;
                let mean = |[x, y]: [usize; 2], _| image.rgb(x, y).iter().sum::<f32>() / 3.0;
                Self::table(radius, [image.width(), image.height()], mean)
            }
        }
    }

    /// `f` gives how open a cell is, by its column and row from the top left, and its middle.
    fn table(radius: f32, [width, height]: [usize; 2], f: impl Fn([usize; 2], Vec2) -> f32) -> Option<Self> {
        let value = |i: usize| {
            let cell = [i % width, i / width];
            let at = |k: usize, n: usize| 2.0 * (k as f32 + 0.5) / n as f32 - 1.0;
            let middle = Vec2::new(at(cell[0], width), -at(cell[1], height));
            if middle.length_squared() < 1.0 { f(cell, middle).max(0.0) } else { 0.0 }
        };
        let values: Vec<f32> = (0..width * height).map(value).collect();
        let table = PiecewiseConstant2D::new(&values, width)?;
        (table.integral() > 0.0).then(|| Self::Table { table: Arc::new(table), radius })
    }

    pub(super) fn is_point(&self) -> bool {
        matches!(self, Self::Point)
    }

    /// Over the opening, by how open it is.
    pub(super) fn sample(&self, u: [f32; 2]) -> Vec2 {
        match self {
            Self::Point => Vec2::ZERO,
            Self::Disk { radius } => warp::concentric_disk(u) * *radius,
            Self::Polygon { fan, radius } => fan.sample(u) * *radius,
            Self::Table { table, radius } => {
                let [x, y] = table.sample(u).p;
                Vec2::new(2.0 * x - 1.0, 1.0 - 2.0 * y) * *radius
            }
        }
    }

    /// Is the point of the lens plane in the opening?
    pub(super) fn contains(&self, p: Vec2) -> bool {
        match self {
            Self::Point => false,
            Self::Disk { radius } => p.length_squared() < radius * radius,
            Self::Polygon { fan, radius } => fan.contains(p / *radius),
            Self::Table { table, radius } => table.pdf(on_table(p / *radius)).is_positive(),
        }
    }

    /// Density of [`Aperture::sample`] in camera space, at a point of the opening; `None` for a lens that is a point.
    pub(super) fn pdf(&self, p: Vec2) -> Option<Pdf<Area>> {
        match self {
            Self::Point => None,
            Self::Disk { radius } => Some(Pdf::new(1.0 / (PI * radius * radius))),
            Self::Polygon { fan, radius } => Some(Pdf::new(1.0 / (fan.area() * radius * radius))),
            // The square's area is 4.
            Self::Table { table, radius } => {
                Some(Pdf::new(table.pdf(on_table(p / *radius)).value() / (4.0 * radius * radius)))
            }
        }
    }
}

/// Where on the table a point of the unit disk is.
fn on_table(p: Vec2) -> [f32; 2] {
    [0.5 + 0.5 * p.x, 0.5 - 0.5 * p.y]
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
        assert!((lens.pdf(Vec2::splat(0.1)).unwrap().value() - 0.5).abs() < 1e-6);
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

    /// The mass within a circle, by samples, by the density, and in closed form.
    #[test]
    fn a_gaussian_opening_is_denser_in_its_middle() {
        let lens = Aperture::new(2.0, &ApertureDesc::Gaussian).unwrap();
        let share = |r2: f32| {
            let e = trig::exp(-1.0);
            (1.0 - trig::exp(-r2) - r2 * e) / (1.0 - 2.0 * e)
        };
        let n = 400;
        let (mut inside, mut all) = (0, 0.0);
        for i in 0..n * n {
            let u = [(i % n) as f32 + 0.5, (i / n) as f32 + 0.5].map(|x| x / n as f32);
            let p = lens.sample(u);
            let pdf = lens.pdf(p).unwrap().value();
            assert!(lens.contains(p) && pdf > 0.0);
            inside += u32::from(p.length() < 1.0);
            all += if p.length() < 1.4 { 1.0 / f64::from(pdf) } else { 0.0 };
        }
        assert!((inside as f32 / (n * n) as f32 - share(0.25)).abs() < 2e-3, "{inside} {}", share(0.25));
        // E[1 / p] over a circle is its area; the rim is left out, where p is almost none.
        assert!((all / f64::from(n * n) / f64::from(1.96 * PI) - 1.0).abs() < 0.02, "{all}");
        assert!(!lens.contains(Vec2::new(1.5, 1.5)));
    }

    #[test]
    fn an_image_of_an_opening_stands_upright() {
        let file = std::env::temp_dir().join(format!("steradian-aperture-{}.pfm", std::process::id()));
        // Open at the top right alone; rows of PFM go up.
        let numbers: Vec<u8> =
            [0.0_f32, 0.0, 0.0, 1.0].iter().flat_map(|v| [v.to_le_bytes(); 3].concat()).collect();
        std::fs::write(&file, [b"PF\n2 2\n-1.0\n".as_slice(), &numbers].concat()).unwrap();
        let lens = Aperture::new(1.0, &ApertureDesc::Image(file.clone()));
        std::fs::remove_file(&file).unwrap();
        let lens = lens.unwrap();
        assert!(lens.contains(Vec2::new(0.4, 0.4)) && !lens.contains(Vec2::new(0.4, -0.4)));
        assert!(!lens.contains(Vec2::new(-0.4, 0.4)));
        assert!((lens.pdf(Vec2::new(0.4, 0.4)).unwrap().value() - 1.0).abs() < 1e-6);
    }
}
