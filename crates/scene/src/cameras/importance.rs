//! The camera as a receiver of light paths [PBR3e, sec. 16.1.1], [Veach1997].
//!
//! Perspective: for a fixed point of the lens, the point in focus is uniform over the film's image of area
//! `A f²` on the plane z = f, so `p_ω = r² / (A f² cos θ) = 1 / (A cos³ θ)`, whatever the lens.
//! All densities are per world area and world solid angle; `We = p_A p_ω / cos θ` by the normalisation.

use std::f32::consts::{FRAC_1_PI, PI};

use math::{Dir, Point, Ray, Vec3};
use sampling::{Area, Geometry, Pdf, SolidAngle};
use scene_desc::SphericalMapping;

use super::{Camera, CameraConnection, Pose, Projection, spherical_uv};

/// Densities of position and direction (`None`: a delta), and, if the ray is one of the camera's, where on the
/// film it belongs and its |cos| to the film's normal (1 for a spherical camera).
pub(super) type Densities = (Option<Pdf<Area>>, Option<Pdf<SolidAngle>>, Option<([f32; 2], f32)>);

pub(super) fn densities(camera: &Camera, pose: &Pose, ray: &Ray) -> Densities {
    let d = pose.camera_vector(ray.dir.0);
    match &camera.projection {
        Projection::Perspective { film, focal_distance, lens } => {
            let on_lens = pose.camera_point(ray.origin);
            let position = lens.pdf(on_lens.truncate()).map(|p| p * (1.0 / pose.film_scale()));
            let nothing = (position.map(|_| Pdf::ZERO), Some(Pdf::ZERO), None);
            let cos_world = pose.forward().dot(ray.dir);
            if d.z <= 0.0 || cos_world <= 0.0 {
                return nothing;
            }
            let focus = on_lens + d * (focal_distance / d.z);
            let Some(raster) =
                camera.on_film(film.raster([focus.x / focal_distance, focus.y / focal_distance]))
            else {
                return nothing;
            };
            let length = d.length();
            let cos = d.z / length;
            let p_omega = pose.solid_angle_ratio(length) / (film.area * cos * cos * cos);
            (position, Some(Pdf::new(p_omega)), Some((raster, cos_world)))
        }
        Projection::Orthographic { film } => {
            let p = pose.camera_point(ray.origin);
            match camera.on_film(film.raster([p.x, p.y])) {
                Some(raster) => {
                    let position = Pdf::new(1.0 / (film.area * pose.film_scale()));
                    (Some(position), None, Some((raster, pose.forward().abs_dot(ray.dir))))
                }
                None => (Some(Pdf::ZERO), None, None),
            }
        }
        // Nobody joins light paths to it: see `Camera::has_importance`.
        Projection::Realistic(_) => (Some(Pdf::ZERO), Some(Pdf::ZERO), None),
        Projection::Spherical { mapping } => {
            let length = d.length();
            let (raster, pdf) = spherical(camera, *mapping, d / length);
            (None, Some(Pdf::new(pdf * pose.solid_angle_ratio(length))), Some((raster, 1.0)))
        }
    }
}

/// See [`Camera::sample_importance`].
pub(super) fn connect(
    camera: &Camera,
    pose: &Pose,
    p: Point,
    time: f32,
    u_lens: [f32; 2],
) -> Option<CameraConnection> {
    match &camera.projection {
        Projection::Perspective { lens, .. } => {
            let p_lens = pose.point(lens.sample(u_lens).extend(0.0));
            let n = pose.forward();
            towards_point(camera, pose, p, time, (p_lens, Some(n)))
        }
        Projection::Orthographic { film } => {
            // The only ray that sees `p` comes down camera z: its foot on the film plane is the place.
            let q = pose.camera_point(p);
            let raster = camera.on_film(film.raster([q.x, q.y]))?;
            let p_lens = pose.point(Vec3::new(q.x, q.y, 0.0));
            let wi = -Dir::normalize(pose.vector(Vec3::Z));
            let cos = pose.forward().abs_dot(wi);
            // dA_film cos θ_film = dA_p |cos θ_p|: the surface's cosine is the caller's, the film's is here.
            let we = 1.0 / (film.area * pose.film_scale() * cos);
            (q.z > 0.0).then_some(CameraConnection {
                wi,
                p_lens,
                n_lens: Some(pose.forward()),
                raster,
                we,
                weight: we,
                pdf: None,
                is_delta_position: false,
                is_delta_direction: true,
            })
        }
        Projection::Realistic(_) => None,
        Projection::Spherical { .. } => towards_point(camera, pose, p, time, (pose.point(Vec3::ZERO), None)),
    }
}

/// A connection to the point `p_lens` of a lens with normal `n_lens` (none for a spherical camera).
fn towards_point(
    camera: &Camera,
    pose: &Pose,
    p: Point,
    time: f32,
    (p_lens, n_lens): (Point, Option<Dir>),
) -> Option<CameraConnection> {
    let to_lens = p_lens - p;
    let distance_squared = to_lens.length_squared();
    if distance_squared == 0.0 {
        return None;
    }
    let wi = Dir(to_lens / distance_squared.sqrt());
    let (position, direction, seen) = densities(camera, pose, &Ray::new(p_lens, -wi, time));
    let (raster, cos) = seen?;
    let p_omega = direction.map_or(1.0, Pdf::value);

    // We cos / (r² p_A) with We = p_A p_ω / cos: the lens' density cancels, a pinhole's delta with it.
    let weight = p_omega / distance_squared;
    Some(CameraConnection {
        wi,
        p_lens,
        n_lens,
        raster,
        we: position.map_or(1.0, Pdf::value) * p_omega / cos,
        weight,
        pdf: position.map(|p| p.to_solid_angle(Geometry { distance_squared, abs_cos: cos })),
        is_delta_position: position.is_none(),
        is_delta_direction: false,
    })
}

/// Where a unit camera direction falls on a spherical camera's film, and its density in camera space.
fn spherical(camera: &Camera, mapping: SphericalMapping, d: Vec3) -> ([f32; 2], f32) {
    let uv = spherical_uv(mapping, d);
    let size = camera.resolution.map(|r| r as f32);
    let pdf = match mapping {
        SphericalMapping::EqualArea => 0.25 * FRAC_1_PI,
        // du dv = dφ dθ / 2π² and dω = sin θ dθ dφ; y is up, so that sin² θ = x² + z².
        SphericalMapping::EquiRectangular | SphericalMapping::EquiRectangularPoles => {
            0.5 / (PI * PI * (d.x * d.x + d.z * d.z).sqrt().max(1e-6))
        }
    };
    ([(uv[0] * size[0]).min(size[0].next_down()), (uv[1] * size[1]).min(size[1].next_down())], pdf)
}

impl Camera {
    /// The place, if it is on the film or its border.
    fn on_film(&self, raster: [f32; 2]) -> Option<[f32; 2]> {
        let inside =
            |a: usize| raster[a] >= -self.border && raster[a] < self.resolution[a] as f32 + self.border;
        (inside(0) && inside(1)).then_some(raster)
    }
}
