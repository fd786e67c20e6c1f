//! Rays that lights emit, for methods that trace light [PBR3e, sec. 16.1.2], [Veach1997].
//!
//! Surfaces: position by area, direction by cosine. Lights at points: direction by intensity. Light from infinity:
//! direction by radiance, position uniform on the disk of the scene's sphere across it, pushed out by its radius; through
//! a portal, uniform on it. Nothing counts that such a ray meets before it has passed its `p`.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use math::{Dir, Frame, LocalDir, Point, Ray, Vec3, error_bound};
use sampling::{Area, Pdf, SolidAngle, warp};
use spectrum::{Spectrum, Wavelengths};

use super::emitter::SurfaceSample;
use super::{AreaLight, EmissionSample, Light, Lights, WorldSphere};
use crate::LightId;

/// Density of a position, of a direction; `None` for a delta.
pub(super) type EmissionPdf = (Option<Pdf<Area>>, Option<Pdf<SolidAngle>>);

impl Lights {
    /// A ray that the light emits, with densities [`Lights::emission_pdf`]; `None` where it emits nothing.
    #[must_use]
    #[allow(clippy::too_many_lines, reason = "one arm a kind")]
    pub fn sample_emission(
        &self,
        light: LightId,
        u_position: [f32; 2],
        u_direction: [f32; 2],
        time: f32,
        wavelengths: &Wavelengths,
    ) -> Option<EmissionSample> {
        let from_point = |p: Point, dir: Dir, le: Spectrum, pdf: Pdf<SolidAngle>| EmissionSample {
            light,
            ray: Ray::new(p, dir, time),
            p,
            p_error: Vec3::ZERO,
            n: None,
            le,
            pdf_position: None,
            pdf_direction: Some(pdf),
            is_infinite: false,
            is_outside: true,
        };
        let from_infinity = |to_light: Dir, le: Spectrum, pdf: Option<Pdf<SolidAngle>>| {
            let p = self.world.point_on_disk(to_light, u_position);
            EmissionSample {
                light,
                ray: Ray::new(p, -to_light, time),
                p,
                p_error: Vec3::ZERO,
                n: None,
                le,
                pdf_position: Some(self.world.disk_pdf()),
                pdf_direction: pdf,
                is_infinite: true,
                is_outside: true,
            }
        };
        let sample = match &self.list[light.index()] {
            Light::Dark => return None,
            Light::Point(l) => {
                let dir = warp::uniform_sphere(u_direction);
                from_point(l.p, dir, l.intensity.value(wavelengths), warp::uniform_sphere_pdf())
            }
            Light::Spot(l) => {
                let dir = l.sample_direction(u_direction);
                from_point(l.p, dir, l.intensity(dir, wavelengths), l.pdf_direction(dir))
            }
            Light::Goniometric(l) => {
                let dir = l.sample_direction(u_direction);
                from_point(l.p(), dir, l.intensity(dir, wavelengths), l.pdf_direction(dir))
            }
            Light::Projection(l) => {
                let dir = l.sample_direction(u_direction);
                from_point(l.p(), dir, l.intensity(dir, wavelengths), l.pdf_direction(dir))
            }
            Light::Distant(l) => from_infinity(l.to_light, l.irradiance.value(wavelengths), None),
            Light::InfiniteConstant(l) => {
                let w = warp::uniform_sphere(u_direction);
                from_infinity(w, l.radiance.value(wavelengths), Some(warp::uniform_sphere_pdf()))
            }
            Light::InfiniteImage(l) => {
                let (w, le, pdf) = l.sample(None, u_direction, wavelengths)?;
                from_infinity(w, le, Some(pdf))
            }
            Light::Portal(l) => {
                let (p, to_light, le, pdf) = l.sample_emission(u_position, u_direction, wavelengths)?;
                let outside = 2.0 * self.world.radius + p.distance(self.world.center);
                EmissionSample {
                    p,
                    pdf_position: Some(l.position_pdf(to_light)),
                    ray: Ray::new(p + to_light.0 * outside, -to_light, time),
                    ..from_infinity(to_light, le, Some(pdf))
                }
            }
            Light::Area(l) => {
                let s = l.emitter.sample_area(u_position);
                self.emit_from_surface((light, l), &s, u_direction, (time, wavelengths))?
            }
            Light::Moving(l) => {
                let s = l.sample_area(time, u_position);
                self.emit_from_surface((light, &l.area), &s, u_direction, (time, wavelengths))?
            }
        };
        sample.is_possible().then_some(sample)
    }

    fn emit_from_surface(
        &self,
        (light, area): (LightId, &AreaLight),
        s: &SurfaceSample<Area>,
        mut u_direction: [f32; 2],
        (time, wavelengths): (f32, &Wavelengths),
    ) -> Option<EmissionSample> {
        // Half of the rays to either side if there are two; the number is used again.
        let (mut n, mut is_outside) = (s.n, true);
        if area.two_sided {
            u_direction[0] *= 2.0;
            if u_direction[0] >= 1.0 {
                u_direction[0] -= 1.0;
                (n, is_outside) = (-n, false);
            }
        }
        let local = warp::cosine_hemisphere(u_direction);
        let dir = Frame::from_normal(n).to_world(local);
        let pdf = warp::cosine_hemisphere_pdf(local) * (1.0 / area.sides());
        let le = area.emitted(&self.emissions, s.n, s.uv, dir, wavelengths);
        s.pdf.is_positive().then(|| EmissionSample {
            light,
            ray: Ray::new(error_bound::offset_ray_origin(s.p, s.p_error, n, dir), dir, time),
            p: s.p,
            p_error: s.p_error,
            n: Some(n),
            le,
            pdf_position: Some(s.pdf),
            pdf_direction: Some(pdf),
            is_infinite: false,
            is_outside,
        })
    }

    /// Densities of [`Lights::sample_emission`] for a ray from `p` along `w` (away from the light); `n` is the normal
    /// of an emitting surface, which may move. Position: per area of the surface, or of the disk across `w` for light from infinity, of
    /// which `p` may be any point of the ray.
    /// `None` for deltas.
    #[must_use]
    pub fn emission_pdf(&self, light: LightId, p: Point, n: Option<Dir>, w: Dir, time: f32) -> EmissionPdf {
        let by_cosine = |two_sided: bool| {
            let cos = n.map_or(0.0, |n| n.dot(w));
            let (cos, sides) = if two_sided { (cos.abs(), 2.0) } else { (cos.max(0.0), 1.0) };
            Some(Pdf::new(cos * FRAC_1_PI / sides))
        };
        match &self.list[light.index()] {
            Light::Dark => (Some(Pdf::ZERO), Some(Pdf::ZERO)),
            Light::Point(_) => (None, Some(warp::uniform_sphere_pdf())),
            Light::Spot(l) => (None, Some(l.pdf_direction(w))),
            Light::Goniometric(l) => (None, Some(l.pdf_direction(w))),
            Light::Projection(l) => (None, Some(l.pdf_direction(w))),
            Light::Distant(_) => (Some(self.world.disk_pdf()), None),
            Light::InfiniteConstant(_) => (Some(self.world.disk_pdf()), Some(warp::uniform_sphere_pdf())),
            Light::InfiniteImage(l) => (Some(self.world.disk_pdf()), Some(l.pdf(None, -w))),
            Light::Portal(l) => {
                let (position, direction) = l.emission_pdf(p, -w);
                (Some(position), Some(direction))
            }
            Light::Area(l) => (Some(l.emitter.pdf_area(p)), by_cosine(l.two_sided)),
            Light::Moving(l) => {
                let position = n.map_or(Pdf::ZERO, |n| l.pdf_area(p, n, time));
                (Some(position), by_cosine(l.area.two_sided))
            }
        }
    }

    /// See [`Lights::power`].
    pub(super) fn compute_power(&self, light: LightId) -> f32 {
        let disk = PI * self.world.radius * self.world.radius;
        let power = match &self.list[light.index()] {
            Light::Dark => 0.0,
            Light::Point(l) => 2.0 * TAU * l.intensity.mean(),
            Light::Spot(l) => l.solid_angle() * l.intensity.mean(),
            Light::Goniometric(l) => 2.0 * TAU * l.factor.mean() * l.intensity.mean(),
            Light::Projection(l) => l.distribution.integral() as f32,
            Light::Distant(l) => disk * l.irradiance.mean(),
            Light::InfiniteConstant(l) => disk * 2.0 * TAU * l.radiance.mean(),
            Light::InfiniteImage(l) => disk * 2.0 * TAU * l.mean(),
            Light::Portal(l) => l.power(),
            Light::Area(l) => {
                PI * l.sides() * l.emitter.area() * l.mean(&self.emissions[l.emission as usize])
            }
            Light::Moving(l) => {
                PI * l.area.sides() * l.area() * l.area.mean(&self.emissions[l.area.emission as usize])
            }
        };
        if power.is_finite() { power.max(0.0) } else { f32::MAX }
    }
}

impl WorldSphere {
    /// On the disk across `to_light`, outside of the sphere.
    fn point_on_disk(&self, to_light: Dir, u: [f32; 2]) -> Point {
        let d = warp::concentric_disk(u) * self.radius;
        let frame = Frame::from_normal(to_light);
        self.center + frame.to_world(LocalDir(Vec3::new(d.x, d.y, self.radius))).0
    }

    fn disk_pdf(&self) -> Pdf<Area> {
        Pdf::new(1.0 / (PI * self.radius * self.radius))
    }
}
