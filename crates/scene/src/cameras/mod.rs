//! Cameras: from a place on the film to a ray, and back for light that arrives at the lens.
//!
//! | kind                      | source                                                        |
//! |---------------------------|---------------------------------------------------------------|
//! | perspective, thin lens    | [PBR4e], sec. 5.2; importance [PBR3e], sec. 16.1.1 [Veach1997] |
//! | orthographic              | [PBR4e], sec. 5.2.2                                           |
//! | stack of lenses           | `lens_stack`; without importance: light paths cannot be joined to it |
//! | spherical                 | [PBR4e], sec. 5.3; equal-area mapping [Clarberg2008]          |
//!
//! Conventions are pbrt-v4's: camera space is left-handed (x right, y up, z forward), raster x runs right and
//! raster y **down**, the field of view spans the shorter side, every camera ray has weight 1 but those of a stack of lenses.
//!
//! **Normalisation of importance.** The whole film is one sensor of unit response: `∫∫ We |cos θ| dω dA = 1`
//! over the *full* film (crops do not change it), so that `We = p_A p_ω / |cos θ|` for the densities of
//! [`Camera::generate_ray`] under a uniform raster position. A pixel's value, the average radiance over its
//! area, is then the number of pixels of the full film, [`Camera::n_pixels`], times the mean over light paths of
//! what they splat into it.
//!
//! Departs from pbrt-v4: densities account for camera transforms that scale unevenly; a lens may be a polygon.
//! As in pbrt-v4, an orthographic camera *with a lens* puts the lens around the origin: every ray starts on it
//! and passes the plane in focus at the film's point, which makes it a perspective camera with its film there.
//! Left out: a shape of its own for the stop of a stack of lenses, which is round.

mod aperture;
mod footprint;
mod importance;
mod lens_stack;
mod pose;
mod rays;

use math::{Dir, Point, Ray, Vec3, trig};
use sampling::{Area, Pdf, SolidAngle, warp};
use scene_desc::{CameraDesc, CameraKind, SphericalMapping};

use aperture::Aperture;
use footprint::PixelDifferentials;
use lens_stack::LensStack;
use pose::{Placement, Pose};
pub use rays::{CameraConnection, CameraRay, LensHit};

/// A camera, ready to make rays.
#[derive(Clone, Debug)]
pub struct Camera {
    projection: Projection,
    placement: Placement,
    shutter: [f32; 2],
    resolution: [u32; 2],
    /// How far outside of the film, in pixels, light still counts: as far as the pixel filter reaches.
    border: f32,
    differentials: PixelDifferentials,
}

/// The kinds of projection.
#[derive(Clone, Debug)]
enum Projection {
    /// Through a pinhole or a thin lens.
    Perspective {
        /// Raster to the film plane at z = 1.
        film: FilmPlane,
        /// Distance of the plane in focus; 1 for a pinhole, where it makes no difference.
        focal_distance: f32,
        lens: Aperture,
    },
    /// Parallel along +z from the plane z = 0.
    Orthographic { film: FilmPlane },
    /// Through a stack of lenses.
    Realistic(Box<LensStack>),
    /// All directions at once.
    Spherical { mapping: SphericalMapping },
}

/// An affine map from raster to a plane of camera space: `x = x0 + dx · raster_x`, `y = y0 + dy · raster_y`.
#[derive(Clone, Copy, Debug)]
struct FilmPlane {
    origin: [f32; 2],
    step: [f32; 2],
    /// Area of the whole film on the plane.
    area: f32,
}

impl Camera {
    /// Makes the camera for a film of `resolution` pixels. `None` where the description has no meaning (a
    /// transform without inverse, an empty screen window, a field of view outside (0°, 180°)).
    #[must_use]
    pub fn compile(desc: &CameraDesc, resolution: [u32; 2]) -> Option<Self> {
        let resolution = resolution.map(|r| r.max(1));
        let window = screen_window(desc, resolution)?;
        let projection = match &desc.kind {
            CameraKind::Perspective { fov, lens_radius, focal_distance, aperture } => {
                let tan = trig::f64::tan(f64::from(*fov).to_radians() * 0.5);
                if !(*fov > 0.0 && *fov < 180.0 && tan.is_finite()) {
                    return None;
                }
                let lens = Aperture::new(*lens_radius, aperture)?;
                let focal_distance = if lens.is_point() { 1.0 } else { *focal_distance };
                Projection::Perspective {
                    film: FilmPlane::new(window, tan as f32, resolution),
                    focal_distance,
                    lens,
                }
            }
            CameraKind::Orthographic { lens_radius, focal_distance } if *lens_radius > 0.0 => {
                Projection::Perspective {
                    film: FilmPlane::new(window, 1.0 / focal_distance, resolution),
                    focal_distance: *focal_distance,
                    lens: Aperture::new(*lens_radius, &scene_desc::ApertureDesc::Disk)?,
                }
            }
            CameraKind::Orthographic { .. } => {
                Projection::Orthographic { film: FilmPlane::new(window, 1.0, resolution) }
            }
            CameraKind::Realistic(stack) => {
                Projection::Realistic(Box::new(LensStack::new(stack, resolution)?))
            }
            CameraKind::Spherical { mapping } => Projection::Spherical { mapping: *mapping },
        };
        let shutter = [desc.shutter_open.min(desc.shutter_close), desc.shutter_open.max(desc.shutter_close)];
        let placement = Placement::new(&desc.world_from_camera)?;
        let differentials = PixelDifferentials::of(&projection, resolution);
        Some(Self { projection, placement, shutter, resolution, border: 0.0, differentials })
    }

    /// With importance that goes on for `pixels` around the film, so that what a filter as wide gathers at the
    /// film's border is the same for light paths as for camera samples.
    #[must_use]
    pub fn with_border(self, pixels: u32) -> Self {
        Self { border: pixels as f32, ..self }
    }

    /// Width and height of the full film in pixels.
    #[must_use]
    pub fn resolution(&self) -> [u32; 2] {
        self.resolution
    }

    /// Number of pixels of the full film: the factor from importance to pixel values (see the head).
    #[must_use]
    pub fn n_pixels(&self) -> f32 {
        self.resolution[0] as f32 * self.resolution[1] as f32
    }

    /// Does a ray need a place on the lens?
    #[must_use]
    pub fn has_lens(&self) -> bool {
        match &self.projection {
            Projection::Perspective { lens, .. } => !lens.is_point(),
            Projection::Realistic(_) => true,
            Projection::Orthographic { .. } | Projection::Spherical { .. } => false,
        }
    }

    /// Does a ray need a moment?
    #[must_use]
    pub fn has_shutter(&self) -> bool {
        self.shutter[1] > self.shutter[0]
    }

    /// The moment in the shutter's interval at `u` ∈ [0, 1).
    #[must_use]
    pub fn time(&self, u: f32) -> f32 {
        self.shutter[0] + (self.shutter[1] - self.shutter[0]) * u
    }

    /// Where the camera is at `time`: the centre of its lens.
    #[must_use]
    pub fn position(&self, time: f32) -> Point {
        self.placement.at(time).point(Vec3::ZERO)
    }

    /// Is there a lens of positive size (or, for parallel projection, a film plane) that a ray starts from?
    #[must_use]
    pub fn is_delta_position(&self) -> bool {
        match &self.projection {
            Projection::Perspective { lens, .. } => lens.is_point(),
            Projection::Orthographic { .. } | Projection::Realistic(_) => false,
            Projection::Spherical { .. } => true,
        }
    }

    /// Can light paths be joined to it?
    #[must_use]
    pub fn has_importance(&self) -> bool {
        !matches!(self.projection, Projection::Realistic(_))
    }

    /// Do all rays leave in one direction?
    #[must_use]
    pub fn is_delta_direction(&self) -> bool {
        matches!(self.projection, Projection::Orthographic { .. })
    }

    /// The ray through `raster` (pixels; pixel (i, j) covers [i, i+1) × [j, j+1)), from the point of the lens at
    /// `u_lens`, at the moment `u_time` of the shutter. `None` where no ray belongs to the place on the film.
    #[must_use]
    pub fn generate_ray(&self, raster: [f32; 2], u_lens: [f32; 2], u_time: f32) -> Option<CameraRay> {
        let ((origin, dir), weight) = self.projection.ray(raster, u_lens, self.resolution)?;
        let time = self.time(u_time);
        let pose = self.placement.at(time);
        let ray = Ray::new(pose.point(origin), Dir::normalize(pose.vector(dir)), time);
        Some(CameraRay { ray, weight })
    }

    /// Densities of [`Camera::generate_ray`] for a uniform place on the film: of the ray's origin per area of the
    /// lens and of its direction per solid angle. A delta has `None`; a ray that the camera does not make, zero.
    #[must_use]
    pub fn importance_pdf(&self, ray: &Ray) -> (Option<Pdf<Area>>, Option<Pdf<SolidAngle>>) {
        let pose = self.placement.at(ray.time);
        let (position, direction, _) = importance::densities(self, pose.as_ref(), ray);
        (position, direction)
    }

    /// `We` of a ray that leaves the lens, and where on the film it belongs; `None` outside of the film.
    /// For deltas the density is left out of `We`: for a pinhole it is 1/m² less, for parallel projection 1/sr.
    #[must_use]
    pub fn importance(&self, ray: &Ray) -> Option<(f32, [f32; 2])> {
        let pose = self.placement.at(ray.time);
        let (position, direction, seen) = importance::densities(self, pose.as_ref(), ray);
        let (raster, cos) = seen?;
        let density = position.map_or(1.0, Pdf::value) * direction.map_or(1.0, Pdf::value);
        Some((density / cos, raster))
    }

    /// Connects the point `p` to the place of the lens at `u_lens`; `None` if the camera does not see it from there.
    #[must_use]
    pub fn sample_importance(&self, p: Point, time: f32, u_lens: [f32; 2]) -> Option<CameraConnection> {
        let pose = self.placement.at(time);
        importance::connect(self, pose.as_ref(), p, time, u_lens)
    }

    /// Where a ray passes the lens on its way in, before `t_max`; `None` if it misses the lens or what it sees is
    /// off the film, and for cameras without a lens of positive size.
    #[must_use]
    pub fn lens_hit(&self, ray: &Ray, t_max: f32) -> Option<LensHit> {
        let Projection::Perspective { lens, .. } = &self.projection else { return None };
        if lens.is_point() {
            return None;
        }
        let pose = self.placement.at(ray.time);
        let (o, d) = (pose.camera_point(ray.origin), pose.camera_vector(ray.dir.0));
        let t = -o.z / d.z;
        let on_lens = d.z < 0.0 && t > 0.0 && t < t_max && lens.contains((o + d * t).truncate());
        if !on_lens {
            return None;
        }
        let p = ray.at(t);
        let (we, raster) = self.importance(&Ray::new(p, -ray.dir, ray.time))?;
        Some(LensHit { p, t, n: pose.forward(), raster, we })
    }

    /// How far apart neighbouring pixels' rays fall on a surface at `p` with normal `n`, from the camera's least
    /// differentials alone [PBR4e, sec. 10.1.1]: right for what is seen directly, an approximation after bounces.
    /// The (u, v) parts are left zero: the surface knows them.
    #[must_use]
    pub fn approximate_footprint(&self, p: Point, n: Dir, time: f32) -> crate::Footprint {
        let pose = self.placement.at(time);
        self.differentials.footprint(pose.as_ref(), p, n)
    }

    /// How wide a pixel is at `p`, across the line of sight, at the least over the film, in units of the scene.
    #[must_use]
    pub fn pixel_width(&self, p: Point, time: f32) -> f32 {
        self.differentials.width((p - self.position(time)).length())
    }
}

impl Projection {
    /// Origin and (not normalised) direction in camera space, and the weight.
    #[inline]
    fn ray(&self, raster: [f32; 2], u_lens: [f32; 2], resolution: [u32; 2]) -> Option<((Vec3, Vec3), f32)> {
        let ray = match self {
            Self::Perspective { film, focal_distance, lens } => {
                let [x, y] = film.point(raster);
                if lens.is_point() {
                    return Some(((Vec3::ZERO, Vec3::new(x, y, 1.0)), 1.0));
                }
                let p = lens.sample(u_lens).extend(0.0);
                (p, Vec3::new(x, y, 1.0) * *focal_distance - p)
            }
            Self::Orthographic { film } => {
                let [x, y] = film.point(raster);
                (Vec3::new(x, y, 0.0), Vec3::Z)
            }
            Self::Realistic(stack) => return stack.ray(unit_square(raster, resolution), u_lens),
            Self::Spherical { mapping } => {
                (Vec3::ZERO, spherical_direction(*mapping, unit_square(raster, resolution)))
            }
        };
        Some((ray, 1.0))
    }

    /// The ray in the middle of those of a place on the film.
    fn chief_ray(&self, raster: [f32; 2], resolution: [u32; 2]) -> (Vec3, Vec3) {
        if let Self::Realistic(stack) = self {
            return stack.chief(unit_square(raster, resolution));
        }
        self.ray(raster, [0.5; 2], resolution).map_or((Vec3::ZERO, Vec3::Z), |(ray, _)| ray)
    }
}

impl FilmPlane {
    /// `window` is x₀, x₁, y₀, y₁ on the screen; `scale` takes the screen to the plane.
    fn new(window: [f32; 4], scale: f32, resolution: [u32; 2]) -> Self {
        let [x0, x1, y0, y1] = window.map(|w| w * scale);
        Self {
            origin: [x0, y1],
            step: [(x1 - x0) / resolution[0] as f32, (y0 - y1) / resolution[1] as f32],
            area: ((x1 - x0) * (y1 - y0)).abs(),
        }
    }

    fn point(&self, raster: [f32; 2]) -> [f32; 2] {
        [self.origin[0] + raster[0] * self.step[0], self.origin[1] + raster[1] * self.step[1]]
    }

    /// The inverse of [`FilmPlane::point`].
    fn raster(&self, point: [f32; 2]) -> [f32; 2] {
        [(point[0] - self.origin[0]) / self.step[0], (point[1] - self.origin[1]) / self.step[1]]
    }
}

fn unit_square(raster: [f32; 2], resolution: [u32; 2]) -> [f32; 2] {
    [raster[0] / resolution[0] as f32, raster[1] / resolution[1] as f32]
}

/// pbrt-v4's rules: the shorter side spans −1 to 1 unless a window is given. `None` if it is empty.
fn screen_window(desc: &CameraDesc, resolution: [u32; 2]) -> Option<[f32; 4]> {
    let frame = desc.frame_aspect_ratio.unwrap_or(resolution[0] as f32 / resolution[1] as f32);
    let by_aspect =
        if frame > 1.0 { [-frame, frame, -1.0, 1.0] } else { [-1.0, 1.0, -1.0 / frame, 1.0 / frame] };
    let w = desc.screen_window.unwrap_or(by_aspect);
    (w.iter().all(|x| x.is_finite()) && w[0] != w[1] && w[2] != w[3]).then_some(w)
}

/// Directions of a spherical camera. pbrt's sphere mappings have z up; cameras have y up.
fn spherical_direction(mapping: SphericalMapping, uv: [f32; 2]) -> Vec3 {
    let d = match mapping {
        SphericalMapping::EqualArea => warp::equal_area_sphere(wrap_square(uv)).0,
        SphericalMapping::EquiRectangular | SphericalMapping::EquiRectangularPoles => {
            let (sin_theta, cos_theta) = trig::sin_cos(std::f32::consts::PI * uv[1]);
            let (sin_phi, cos_phi) = trig::sin_cos(std::f32::consts::TAU * uv[0]);
            Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
        }
    };
    Vec3::new(d.x, d.z, d.y)
}

/// The inverse of [`spherical_direction`]: (u, v) in the unit square.
fn spherical_uv(mapping: SphericalMapping, dir: Vec3) -> [f32; 2] {
    let d = Vec3::new(dir.x, dir.z, dir.y);
    match mapping {
        SphericalMapping::EqualArea => warp::equal_area_sphere_inverse(Dir(d)),
        SphericalMapping::EquiRectangular | SphericalMapping::EquiRectangularPoles => {
            let phi = trig::atan2(d.y, d.x) / std::f32::consts::TAU;
            [
                if phi < 0.0 { phi + 1.0 } else { phi },
                trig::atan2((d.x * d.x + d.y * d.y).sqrt(), d.z) / std::f32::consts::PI,
            ]
        }
    }
}

/// Where a point just outside the equal-area square lies inside it: the sphere goes on across an edge mirrored
/// about the edge's middle.
fn wrap_square([mut x, mut y]: [f32; 2]) -> [f32; 2] {
    if !(0.0..=1.0).contains(&x) {
        (x, y) = (if x < 0.0 { -x } else { 2.0 - x }, 1.0 - y);
    }
    if !(0.0..=1.0).contains(&y) {
        (x, y) = (1.0 - x, if y < 0.0 { -y } else { 2.0 - y });
    }
    [x, y]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_equal_area_square_continues_over_its_edges() {
        let at = |p| warp::equal_area_sphere(wrap_square(p)).0;
        for t in [0.1, 0.3, 0.7, 0.9] {
            for (inside, outside) in [
                ([1e-4, t], [-1e-4, t]),
                ([1.0 - 1e-4, t], [1.0001, t]),
                ([t, 1e-4], [t, -1e-4]),
                ([t, 1.0 - 1e-4], [t, 1.0001]),
            ] {
                assert!((at(inside) - at(outside)).length() < 2e-3);
            }
        }
    }
}
