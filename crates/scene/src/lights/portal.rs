//! Light from infinity that comes through a window alone [Bitterli2015], with pbrt-v4's meaning: a point is lit from a
//! direction only if the straight line from it passes the portal from behind; all else of the sky is black.
//!
//! The portal is a rectangle with corners p₀ to p₃ in order; light comes from the side of `(p₃ − p₀) × (p₁ − p₀)`. In
//! the angles (atan(x/z), atan(y/z)) about its frame, the portal is a rectangle from wherever it is seen, so that a
//! summed-area table over them gives the light within it.
//!
//! Departs from pbrt-v4: the sky's own image is what shines, not one resampled to those angles; the table only draws.
//! Rays from the light start at places of the portal, from outside of the scene: what stands before the portal throws its
//! shadow through it.

use std::f32::consts::PI;

use math::{Dir, Frame, LocalDir, Point, Vec3, trig};
use sampling::distribution::{WHOLE, Window, Windowed2D};
use sampling::{Area, Pdf, SolidAngle, warp};
use spectrum::{Spectrum, Wavelengths};

use super::emission::Emission;
use super::infinite::InfiniteImage;

/// Share of the table that is even: no direction that shines has density zero.
const EVEN: f64 = 0.03;
/// Largest and least number of the table's cells along a side.
const CELLS: [usize; 2] = [64, 1024];

/// A sky behind a window.
#[derive(Clone, Debug)]
pub(crate) struct PortalLight {
    /// s and t along the portal's sides, n to where the light comes from.
    frame: Frame,
    corner: Point,
    /// Along s and t.
    size: [f32; 2],
    sky: Sky,
    distribution: Windowed2D,
    power: f32,
}

/// The points before a portal, on the side to which light comes through it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Side {
    corner: Point,
    n: Dir,
}

impl Side {
    /// Is the point one of them?
    pub(crate) fn holds(&self, p: Point) -> bool {
        (self.corner - p).dot(self.n.0) > 0.0
    }
}

/// What is behind the window.
#[derive(Clone, Debug)]
pub(crate) enum Sky {
    Even(Emission),
    Image(Box<InfiniteImage>),
}

impl PortalLight {
    /// # Errors
    /// Corners that are no rectangle, in a sentence. `None` inside for a sky that is black.
    pub(super) fn new(corners: &[Vec3; 4], sky: Sky) -> Result<Option<Self>, String> {
        let [p0, p1, p2, p3] = *corners;
        let (s, t) = (p3 - p0, p1 - p0);
        let (Some(x), Some(y)) = (s.try_normalize(), t.try_normalize()) else {
            return Err("two neighbouring corners of the portal are one point".to_owned());
        };
        // pbrt-v4's tolerance.
        let largest = s.length().max(t.length());
        if x.dot(y).abs() > 1e-3 || (p0 + s + t - p2).length() > 1e-3 * largest {
            return Err("the portal's corners are no rectangle in order".to_owned());
        }
        let y = (y - x * x.dot(y)).normalize();
        let frame = Frame { s: x, t: y, n: Dir(x.cross(y)) };
        let size = [s.length(), t.length()];

        // The light's mass over the table, direction by direction: none is missed, however small its source.
        let side = match &sky {
            Sky::Even(_) => CELLS[0],
            Sky::Image(image) => image.side().clamp(CELLS[0], CELLS[1]),
        };
        let mut mass = vec![0.0_f64; side * side];
        let mut flux = 0.0_f64;
        sky.each_direction(|w, radiance, solid_angle| {
            let w = frame.to_local(w).0;
            if w.z > 0.0 {
                let [u, v] = uv(w).map(|x| ((x * side as f64) as usize).min(side - 1));
                let weight = f64::from(radiance) * f64::from(solid_angle);
                mass[v * side + u] += weight;
                flux += weight * f64::from(w.z);
            }
        });
        let even = EVEN * mass.iter().sum::<f64>() / mass.len() as f64;
        let values: Vec<f32> = mass.iter().map(|m| (m * (1.0 - EVEN) + even) as f32).collect();
        let power = (flux * f64::from(size[0]) * f64::from(size[1])) as f32;
        let light = Windowed2D::new(&values, side).filter(|_| power > 0.0);
        Ok(light.map(|distribution| Self { frame, corner: Point(p0), size, sky, distribution, power }))
    }

    /// Flux through the portal.
    pub(super) fn power(&self) -> f32 {
        self.power
    }

    /// Radiance from the direction `w` at a point.
    pub(super) fn radiance(&self, from: Point, w: Dir, wavelengths: &Wavelengths) -> Spectrum {
        self.window_around(from, w).map_or(Spectrum::ZERO, |_| self.sky.radiance(w, wavelengths))
    }

    /// A direction from the point through the portal, with its radiance and density.
    pub(super) fn sample(
        &self,
        from: Point,
        u: [f32; 2],
        wavelengths: &Wavelengths,
    ) -> Option<(Dir, Spectrum, Pdf<SolidAngle>)> {
        let (w, pdf) = self.draw(u, &self.window(from)?)?;
        Some((w, self.sky.radiance(w, wavelengths), pdf))
    }

    pub(super) fn pdf(&self, from: Point, w: Dir) -> Pdf<SolidAngle> {
        self.window_around(from, w).map_or(Pdf::ZERO, |window| self.density(w, &window))
    }

    /// A place of the portal and a direction towards the light, of all before it: where a ray from the light passes.
    pub(super) fn sample_emission(
        &self,
        u_position: [f32; 2],
        u_direction: [f32; 2],
        wavelengths: &Wavelengths,
    ) -> Option<(Point, Dir, Spectrum, Pdf<SolidAngle>)> {
        let (w, pdf) = self.draw(u_direction, &WHOLE)?;
        let place =
            self.frame.s * (u_position[0] * self.size[0]) + self.frame.t * (u_position[1] * self.size[1]);
        Some((self.corner + place, w, self.sky.radiance(w, wavelengths), pdf))
    }

    /// Densities of [`PortalLight::sample_emission`] for the straight line through `p` towards the light: of its place,
    /// per area across it, and of its direction.
    pub(super) fn emission_pdf(&self, p: Point, to_light: Dir) -> (Pdf<Area>, Pdf<SolidAngle>) {
        let cos = self.frame.n.dot(to_light);
        if cos <= 0.0 {
            return (Pdf::ZERO, Pdf::ZERO);
        }
        let t = (self.corner - p).dot(self.frame.n.0) / cos;
        let d = p + to_light.0 * t - self.corner;
        let [x, y] = [d.dot(self.frame.s), d.dot(self.frame.t)];
        // As sampled places may be rounded out of it.
        let is_inside = |x: f32, size: f32| x >= -1e-4 * size && x <= 1.0001 * size;
        let position = match is_inside(x, self.size[0]) && is_inside(y, self.size[1]) {
            true => self.position_pdf(to_light),
            false => Pdf::ZERO,
        };
        (position, self.density(to_light, &WHOLE))
    }

    /// Per area across the direction.
    pub(super) fn position_pdf(&self, to_light: Dir) -> Pdf<Area> {
        let across = self.size[0] * self.size[1] * self.frame.n.dot(to_light);
        if across > 0.0 { Pdf::new(1.0 / across) } else { Pdf::ZERO }
    }

    /// The portal as seen from a point, if the straight line from there passes it from behind.
    fn window_around(&self, from: Point, w: Dir) -> Option<Window> {
        let local = self.frame.to_local(w).0;
        if local.z <= 0.0 {
            return None;
        }
        let p = uv(local);
        self.window(from).filter(|window| (0..2).all(|i| p[i] >= window[i][0] && p[i] <= window[i][1]))
    }

    /// Where its light can be.
    pub(super) fn side(&self) -> Side {
        Side { corner: self.corner, n: self.frame.n }
    }

    /// The portal as seen from a point; `None` from its back.
    fn window(&self, from: Point) -> Option<Window> {
        if !self.side().holds(from) {
            return None;
        }
        let d = self.corner - from;
        let [x, y, z] = [d.dot(self.frame.s), d.dot(self.frame.t), d.dot(self.frame.n.0)];
        let [low, high] = [Vec3::new(x, y, z), Vec3::new(x + self.size[0], y + self.size[1], z)].map(uv);
        Some([[low[0], high[0]], [low[1], high[1]]])
    }

    fn draw(&self, u: [f32; 2], window: &Window) -> Option<(Dir, Pdf<SolidAngle>)> {
        let p = self.distribution.sample(u, window)?;
        let [(sa, ca), (sb, cb)] = p.map(|x| trig::sin_cos((x - 0.5) * PI));
        let local = Vec3::new(sa * cb, ca * sb, ca * cb).try_normalize()?;
        let pdf = self.distribution.pdf(p, window).value() * square_density(local);
        let w = self.frame.to_world(LocalDir(local));
        (local.z > 0.0 && pdf > 0.0 && pdf.is_finite()).then(|| (w, Pdf::new(pdf)))
    }

    fn density(&self, w: Dir, window: &Window) -> Pdf<SolidAngle> {
        let local = self.frame.to_local(w).0;
        if local.z <= 0.0 {
            return Pdf::ZERO;
        }
        let p = uv(local).map(|x| x as f32);
        let pdf = self.distribution.pdf(p, window).value() * square_density(local);
        Pdf::new(if pdf.is_finite() { pdf } else { 0.0 })
    }
}

impl Sky {
    fn radiance(&self, w: Dir, wavelengths: &Wavelengths) -> Spectrum {
        match self {
            Self::Even(emission) => emission.value(wavelengths),
            Self::Image(image) => image.radiance(w, wavelengths),
        }
    }

    /// Directions, the radiance of each and its share of the sphere.
    fn each_direction(&self, mut f: impl FnMut(Dir, f32, f32)) {
        match self {
            Self::Even(emission) => {
                const N: u16 = 512;
                let share = 4.0 * PI / (f32::from(N) * f32::from(N));
                for (i, j) in (0..N).flat_map(|i| (0..N).map(move |j| (i, j))) {
                    let u = [i, j].map(|k| (f32::from(k) + 0.5) / f32::from(N));
                    f(warp::equal_area_sphere(u), emission.mean(), share);
                }
            }
            Self::Image(image) => image.each_direction(f),
        }
    }
}

/// The angles of a vector of the portal's frame with z > 0, over π, in the unit square.
fn uv(v: Vec3) -> [f64; 2] {
    let angle = |x: f32| trig::f64::atan2(f64::from(x), f64::from(v.z)) / std::f64::consts::PI + 0.5;
    [angle(v.x), angle(v.y)]
}

/// Area of the square of angles per solid angle, of a unit vector: `wz / (π² (1 − wx²) (1 − wy²))`.
fn square_density(w: Vec3) -> f32 {
    let [x2, y2, z2] = (w * w).to_array();
    w.z / (PI * PI * (y2 + z2) * (x2 + z2))
}
