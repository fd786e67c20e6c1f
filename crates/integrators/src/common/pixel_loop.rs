//! One camera sample in every pixel of a tile: film position, wavelengths, lens, time, ray; then the estimator.

use math::{Bounds2i, Ray};
use sampling::{Sampler, SamplerKind};
use scene::Scene;
use scene_desc::SamplerDesc;
use spectrum::{Spectrum, Wavelengths};

use super::Shared;
use crate::guide::RecordedPath;
use crate::{Cell, CellOutput, Counters, Integrator, PassContext};

/// A path that starts at the eye.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraPath {
    /// Its first ray.
    pub(crate) ray: Ray,
    /// What the four lanes mean.
    pub(crate) wl: Wavelengths,
    /// Its pass.
    pub(crate) pass: u32,
}

/// What an estimator leaves behind besides the radiance.
pub(crate) struct PathOutput<'a> {
    pub(crate) counters: &'a mut Counters,
    /// Where a walk writes down what a guide learns from.
    pub(crate) recorded: Option<&'a mut RecordedPath>,
}

/// Estimates the radiance that arrives along camera rays.
pub(crate) trait CameraEstimator: Send + Sync {
    /// Wavelengths and moment that all paths of the pass have; `None`: each its own.
    fn shared(&self) -> Option<Shared> {
        None
    }

    /// Radiance along the path's ray. Dispersion may end its secondary wavelengths.
    fn radiance(
        &self,
        scene: &Scene,
        path: &mut CameraPath,
        sampler: &mut Sampler,
        out: &mut PathOutput<'_>,
    ) -> Spectrum;
}

/// The integrator that runs an estimator over pixels.
pub(crate) struct PixelLoop<E> {
    pub(crate) estimator: E,
    pub(crate) sampler: Sampler,
}

/// The sampler that a scene asks for.
pub(crate) fn sampler_of(desc: &SamplerDesc, seed: u64) -> Sampler {
    let kind = match desc.name.as_str() {
        "independent" => SamplerKind::Independent,
        "stratified" => SamplerKind::Stratified { x: desc.strata[0], y: desc.strata[1] },
        _ => SamplerKind::Sobol,
    };
    Sampler::new(kind, seed)
}

/// A point of the pixels in `region`.
pub(crate) fn place_in(region: &Bounds2i, u: [f32; 2]) -> [f32; 2] {
    let size = [region.width() as f32, region.height() as f32];
    [0, 1].map(|a| {
        // Rounding must not carry a place over the edge.
        (region.min[a] as f32 + u[a] * size[a]).min((region.max[a] as f32).next_down())
    })
}

impl<E: CameraEstimator> PixelLoop<E> {
    fn pixel(&self, ctx: PassContext<'_>, pixel: [i32; 2], sampler: &mut Sampler, out: &mut CellOutput) {
        let u = sampler.pixel_2d();
        let raster = [pixel[0] as f32 + u[0], pixel[1] as f32 + u[1]];
        let extra = &mut PathOutput { counters: &mut out.counters, recorded: None };
        let traced = self.trace(ctx, raster, sampler, extra);
        let rgb = traced.map_or([0.0; 3], |(radiance, wl)| ctx.scene.film_rgb(radiance, &wl));
        out.tile.add_sample(pixel, u, rgb);
    }

    /// What a path through a point of the film brings, and in which wavelengths; `None` where no ray starts.
    pub(crate) fn trace(
        &self,
        ctx: PassContext<'_>,
        raster: [f32; 2],
        sampler: &mut Sampler,
        out: &mut PathOutput<'_>,
    ) -> Option<(Spectrum, Wavelengths)> {
        let (mut path, weight) = self.camera_path(ctx, raster, sampler, out.counters)?;
        let radiance = self.estimator.radiance(ctx.scene, &mut path, sampler, out);
        Some((radiance * weight, path.wl))
    }

    /// A path through a point of the film, and what the radiance that it brings counts; `None` where no ray starts.
    pub(crate) fn camera_path(
        &self,
        ctx: PassContext<'_>,
        raster: [f32; 2],
        sampler: &mut Sampler,
        counters: &mut Counters,
    ) -> Option<(CameraPath, f32)> {
        let scene = ctx.scene;
        let shared = self.estimator.shared();
        let wl = match (shared, scene.settings().spectral) {
            (Some(shared), _) => shared.wl,
            (None, true) => Wavelengths::sample_visible(sampler.next_1d()),
            (None, false) => Wavelengths::RGB,
        };
        let u_lens = if scene.camera.has_lens() { sampler.next_2d() } else { [0.5; 2] };
        let u_time = match shared {
            Some(shared) => shared.u_time,
            None if scene.camera.has_shutter() => sampler.next_1d(),
            None => 0.0,
        };

        counters.camera_paths += 1;
        let camera_ray = scene.camera.generate_ray(raster, u_lens, u_time)?;
        Some((CameraPath { ray: camera_ray.ray, wl, pass: ctx.pass }, camera_ray.weight))
    }
}

impl<E: CameraEstimator> Integrator for PixelLoop<E> {
    fn cell(&self, ctx: PassContext<'_>, cell: Cell, out: &mut CellOutput) {
        let Cell::Tile(bounds) = cell else { return };
        let mut sampler = self.sampler.clone();
        for y in bounds.min[1]..bounds.max[1] {
            for x in bounds.min[0]..bounds.max[0] {
                sampler.start([x, y], ctx.pass);
                self.pixel(ctx, [x, y], &mut sampler, out);
            }
        }
    }
}
