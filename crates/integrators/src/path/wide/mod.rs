//! `path` over the pixels of a cell: many paths side by side, where that is faster, with the bits that they have one by one.
//!
//! Up to [`MOST`] paths go from surface to surface together. Between two surfaces their rays are traced as a batch; at the surfaces
//! sixteen paths share each instruction ([`step`]), as long as they are matt: that is what most of a room is. A path that comes
//! to another surface takes this step alone, by [`Path::arrive`], and rejoins the others after it. So every feature
//! of a surface or lamp is supported as it is there, and what is written here are only the operations of `Path::scatter` in the same
//! order: a film tells no difference (`tests/tests/side_by_side.rs`).
//!
//! Paths through media, in wavelengths, with other samplers than Sobol' or with parameters for teaching go one by one altogether.

mod state;
mod step;

use math::Bounds2i;
use spectrum::{Spectrum, Wavelengths};

use self::state::{MOST, Paths, Record, Shadows};
use self::step::Step;
use super::Path;
use crate::common::{DirectionSampling, LightStrategy, PixelLoop};
use crate::{Cell, CellOutput, Integrator, PassContext};

/// The integrator.
pub(super) struct PathLoop {
    pixels: PixelLoop<Path>,
}

/// Where a path began.
#[derive(Clone, Copy, Debug, Default)]
struct Start {
    pixel: [i32; 2],
    /// Where in it.
    offset: [f32; 2],
    /// What its radiance counts.
    weight: f32,
}

impl PathLoop {
    pub(super) fn new(pixels: PixelLoop<Path>) -> Self {
        Self { pixels }
    }

    /// Can and should paths go side by side?
    fn goes_wide(&self, ctx: PassContext<'_>) -> bool {
        let Path { lights, directions, guide, .. } = &self.pixels.estimator;
        let scene = ctx.scene;
        let is_plain = matches!(lights, Some(LightStrategy::Mis(_)))
            && *directions == DirectionSampling::Bsdf
            && guide.is_none();
        let isa = scene.accel().isa();
        is_plain
            && accel::has_lanes(isa)
            && scene.is_empty_space()
            && !scene.settings().spectral
            && self.pixels.sampler.path_state().is_some()
    }

    /// A path in each of some pixels.
    fn side_by_side(
        &self,
        ctx: PassContext<'_>,
        pixels: &mut dyn Iterator<Item = [i32; 2]>,
        paths: &mut Paths,
        shadows: &mut Shadows,
        out: &mut CellOutput,
    ) -> bool {
        let mut sampler = self.pixels.sampler.clone();
        let mut starts = [Start::default(); MOST];
        let mut radiance = [Spectrum::ZERO; MOST];
        let mut n = 0;
        for pixel in pixels.take(MOST) {
            sampler.start(pixel, ctx.pass);
            let offset = sampler.pixel_2d();
            let raster = [pixel[0] as f32 + offset[0], pixel[1] as f32 + offset[1]];
            starts[n] = Start { pixel, offset, weight: 0.0 };
            if let Some((path, weight)) =
                self.pixels.camera_path(ctx, raster, &mut sampler, &mut out.counters)
                && let Some(state) = sampler.path_state()
            {
                starts[n].weight = weight;
                paths.push(&Record::start(&path.ray, state, n as u32));
            }
            n += 1;
        }

        while paths.len() > 0 {
            out.counters.rays += paths.len() as u64;
            let path = &self.pixels.estimator;
            let step = Step::new((path, ctx.scene), &mut sampler, &mut radiance, &mut out.counters);
            step.take(paths, shadows);
        }
        for (start, radiance) in starts[..n].iter().zip(&radiance) {
            let rgb = ctx.scene.film_rgb(*radiance * start.weight, &Wavelengths::RGB);
            out.tile.add_sample(start.pixel, start.offset, rgb);
        }
        n == MOST
    }
}

/// Row by row.
fn pixels_of(bounds: Bounds2i) -> impl Iterator<Item = [i32; 2]> {
    (bounds.min[1]..bounds.max[1]).flat_map(move |y| (bounds.min[0]..bounds.max[0]).map(move |x| [x, y]))
}

impl Integrator for PathLoop {
    fn cell(&self, ctx: PassContext<'_>, cell: Cell, out: &mut CellOutput) {
        let Cell::Tile(bounds) = cell else { return };
        if !self.goes_wide(ctx) {
            return self.pixels.cell(ctx, cell, out);
        }
        let mut pixels = pixels_of(bounds);
        let (mut paths, mut shadows) = (Paths::new(), Shadows::new());
        while self.side_by_side(ctx, &mut pixels, &mut paths, &mut shadows, out) {}
    }
}
