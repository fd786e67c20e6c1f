//! The two ends of a path, the eye and the light: how walks start there, and the densities of finding them.

use math::{Dir, Ray};
use sampling::{Pdf, Sampler};
use scene::{CameraConnection, LightContext, LightId, LightSample, Scene, segment};
use spectrum::{Spectrum, Wavelengths};

use super::{Leaving, Place, Shared, Start, Vertex};
use crate::Counters;

/// A walk's start at the eye.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraStart {
    pub(crate) start: Start,
    /// Density per area of the lens; 1 for a pinhole or parallel rays.
    pub(crate) position: f32,
}

impl CameraStart {
    /// A camera ray through `raster`, at a moment that is shared or its own.
    pub(crate) fn sample(
        scene: &Scene,
        raster: [f32; 2],
        shared: Option<Shared>,
        sampler: &mut Sampler,
    ) -> Option<Self> {
        let camera = &scene.camera;
        let u_lens = if camera.has_lens() { sampler.next_2d() } else { [0.5; 2] };
        let u_time = match shared {
            Some(shared) => shared.u_time,
            None if camera.has_shutter() => sampler.next_1d(),
            None => 0.0,
        };
        let sample = camera.generate_ray(raster, u_lens, u_time)?;
        let (position, leaving) = camera_densities(scene, &sample.ray);
        let start = Start {
            ray: sample.ray,
            around: scene.camera_surroundings(),
            place: lens_place(scene, &sample.ray),
            leaving,
            throughput: Spectrum::splat(sample.weight),
        };
        Some(Self { start, position })
    }
}

/// The density of a place on the lens, and how rays leave it along `ray`.
pub(crate) fn camera_densities(scene: &Scene, ray: &Ray) -> (f32, Leaving) {
    let (position, direction) = scene.camera.importance_pdf(ray);
    match direction {
        Some(density) => {
            let leaving = Leaving::Point { from: ray.origin, density: density.value() };
            (position.map_or(1.0, Pdf::value), leaving)
        }
        // Parallel projection: We is the density across the rays.
        None => {
            let density = scene.camera.importance(ray).map_or(0.0, |(we, _)| we);
            (1.0, Leaving::Parallel { density, dir: ray.dir })
        }
    }
}

/// The start of a camera ray as a place that a walk from a light may find: only a lens can be.
fn lens_place(scene: &Scene, ray: &Ray) -> Place {
    let back = Ray { origin: ray.at(1.0), dir: -ray.dir, ..*ray };
    let hit = match scene.camera.has_lens() {
        true => scene.camera.lens_hit(&back, f32::INFINITY),
        false => None,
    };
    hit.map_or(Place::point(ray.origin), |h| Place::on_surface(ray.origin, h.n))
}

/// A walk's start at a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightStart {
    pub(crate) start: Start,
    pub(crate) light: LightId,
    /// Density of the place, the choice of the light included.
    pub(crate) emit: f32,
}

impl LightStart {
    /// A ray from a light that is chosen by its power. Takes the same numbers whatever happens.
    pub(crate) fn sample(scene: &Scene, time: f32, wl: &Wavelengths, sampler: &mut Sampler) -> Option<Self> {
        let (u_light, u_position, u_direction) = (sampler.next_1d(), sampler.next_2d(), sampler.next_2d());
        let (light, chosen) = scene.light_selector.select_emission(u_light)?;
        let sample = scene.lights.sample_emission(light, u_position, u_direction, time, wl)?;
        let throughput = sample.throughput() / chosen;
        if throughput.is_black() || !throughput.is_finite() {
            return None;
        }
        let place = Place { p: sample.p, n: sample.n, is_infinite: sample.is_infinite, is_medium: false };
        let (emit, leaving) = emission_densities(scene, light, &place, (sample.ray.dir, time));
        let around = scene.emission_surroundings(&sample);
        Some(Self { start: Start { ray: sample.ray, around, place, leaving, throughput }, light, emit })
    }
}

/// Density with which a walk from a light starts at the place, the choice of the light included, and how it leaves
/// along `w` at a moment. A light that no ray finds has no density but its choice.
pub(crate) fn emission_densities(
    scene: &Scene,
    light: LightId,
    place: &Place,
    (w, time): (Dir, f32),
) -> (f32, Leaving) {
    let chosen = scene.light_selector.emission_probability(light);
    let (position, direction) = scene.lights.emission_pdf(light, place.p, place.n, w, time);
    let (position, direction) = (position.map(Pdf::value), direction.map(Pdf::value));
    let is_delta = scene.lights.is_delta(light);
    if place.is_infinite {
        // Its place is its direction.
        let leaving = Leaving::Parallel { density: position.unwrap_or(0.0), dir: w };
        let of_direction = if is_delta { 1.0 } else { direction.unwrap_or(0.0) };
        return (chosen * of_direction, leaving);
    }
    let leaving = Leaving::Point { from: place.p, density: direction.unwrap_or(0.0) };
    let of_position = if is_delta { 1.0 } else { position.unwrap_or(0.0) };
    (chosen * of_position, leaving)
}

/// The place of a light sample.
pub(crate) fn place_of(sample: &LightSample) -> Place {
    Place { p: sample.p, n: Some(sample.n), is_infinite: sample.is_infinite, is_medium: false }
}

/// Density with which next-event estimation at `from` finds the light's place in direction `w`, in the same measure
/// as [`emission_densities`]: per area, per solid angle at infinity, and without one for a light that no ray finds.
pub(crate) fn direct_density(
    scene: &Scene,
    from: &LightContext,
    light: LightId,
    place: &Place,
    w: Dir,
) -> f32 {
    let chosen = scene.light_selector.probability(from, light);
    if scene.lights.is_delta(light) {
        return chosen;
    }
    let pdf = scene.lights.pdf(light, from, place.p, place.n.unwrap_or(w), w);
    Leaving::Point { from: from.p, density: chosen * pdf.value() }.density_at(place)
}

/// Connects a vertex to the eye; `None` if it is not seen. The second value is what media leave of the light.
pub(crate) fn connect_to_eye(
    scene: &Scene,
    vertex: &Vertex,
    (sampler, wl): (&mut Sampler, &Wavelengths),
    counters: &mut Counters,
) -> Option<(CameraConnection, Spectrum)> {
    let u_lens = if scene.camera.has_lens() { sampler.next_2d() } else { [0.5; 2] };
    if !vertex.is_connectible() {
        return None;
    }
    let eye = scene.camera.sample_importance(vertex.p(), vertex.time(), u_lens)?;
    counters.rays += 1;
    let origin = vertex.spawn_ray(eye.wi).origin;
    let ray = segment(origin, eye.p_lens, vertex.time());
    let around = vertex.surroundings_towards(scene, eye.wi);
    let through = scene.transmittance(&ray, &around, wl, &mut || sampler.next_1d());
    (!through.is_black()).then_some((eye, through))
}
