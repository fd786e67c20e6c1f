//! Light tracing [Arvo1986] [Veach1997]: random walks from all emitters; every surface that they meet and that is
//! no delta is connected to the eye.
//!
//! A pixel's value is the number of pixels of the whole film times the mean over light paths of what they splat into
//! it (see `scene::Camera`); there are as many paths in a pass as the whole film has pixels, so the factor is one.
//! Emitters that are seen directly (depth 0) come from camera rays, as in `path`.
//!
//! Cannot find: what the eye sees in mirrors and through glass, since no connection to the eye meets a delta lobe.

use sampling::Sampler;
use scatter::TransportMode;
use scene::Scene;
use spectrum::Wavelengths;

use crate::common::{
    DirectionSampling, LightStart, PixelLoop, Roulette, Subpath, Walk, connect_to_eye, sampler_of,
};
use crate::parameters::{ParameterInfo, Parameters, shared};
use crate::path::Path;
use crate::registry::{IntegratorInfo, Making, refuses_for_light_paths, refuses_glow};
use crate::{Cell, CellOutput, Integrator, PassContext};

/// For the registry.
pub(crate) const INFO: IntegratorInfo = IntegratorInfo {
    name: "light",
    purpose: "random walks from the lights, connected to the eye: caustics on diffuse surfaces",
    misses: "what is seen in mirrors and through smooth glass; far surfaces that light paths seldom meet are noisy",
    unbiased: true,
    refuses: |scene| refuses_glow(scene).or_else(|| refuses_for_light_paths(scene)),
    parameters,
    make,
};

fn parameters() -> Vec<ParameterInfo> {
    vec![shared::MAX_DEPTH, shared::RR_DEPTH]
}

fn make(p: &Parameters, making: &Making<'_>) -> Box<dyn Integrator> {
    let roulette = Roulette::from(p.integer("rr_depth"));
    let sampler = sampler_of(making.sampler, making.seed);
    let directly = PixelLoop {
        estimator: Path {
            max_depth: 0,
            roulette,
            lights: None,
            directions: DirectionSampling::Bsdf,
            equiangular: false,
            shortcut: (),
            guide: None,
        },
        sampler: sampler.clone(),
    };
    Box::new(LightTracing { directly, sampler, max_depth: p.limit("max_depth"), roulette })
}

struct LightTracing {
    /// Emitters that the eye sees.
    directly: PixelLoop<Path>,
    sampler: Sampler,
    max_depth: u32,
    roulette: Roulette,
}

/// Light paths of one block.
const BLOCK: u64 = 4096;

impl Integrator for LightTracing {
    fn splats(&self) -> bool {
        true
    }

    fn light_blocks(&self, scene: &Scene) -> u32 {
        if self.max_depth == 0 {
            return 0;
        }
        u32::try_from(n_paths(scene).div_ceil(BLOCK)).unwrap_or(u32::MAX)
    }

    fn cell(&self, ctx: PassContext<'_>, cell: Cell, out: &mut CellOutput) {
        match cell {
            Cell::Tile(_) => self.directly.cell(ctx, cell, out),
            Cell::LightBlock(block) => {
                let first = u64::from(block) * BLOCK;
                let mut sampler = self.sampler.clone();
                let mut path = Subpath::default();
                for i in first..(first + BLOCK).min(n_paths(ctx.scene)) {
                    sampler.start_path(i, ctx.pass);
                    self.trace(ctx.scene, &mut sampler, &mut path, out);
                }
            }
        }
    }
}

/// Light paths of a pass: as many as the film has pixels.
fn n_paths(scene: &Scene) -> u64 {
    let [w, h] = scene.camera.resolution();
    u64::from(w) * u64::from(h)
}

impl LightTracing {
    /// One light path and its splats.
    fn trace(&self, scene: &Scene, sampler: &mut Sampler, path: &mut Subpath, out: &mut CellOutput) {
        let mut wl = match scene.settings().spectral {
            true => Wavelengths::sample_visible(sampler.next_1d()),
            false => Wavelengths::RGB,
        };
        let u_time = if scene.camera.has_shutter() { sampler.next_1d() } else { 0.0 };
        let time = scene.camera.time(u_time);
        out.counters.light_paths += 1;
        let Some(light) = LightStart::sample(scene, time, &wl, sampler) else { return };
        let walk = Walk {
            scene,
            mode: TransportMode::Importance,
            limit: self.max_depth as usize,
            roulette: self.roulette,
        };
        walk.run(&light.start, sampler, &mut wl, &mut out.counters, path);
        for vertex in path.vertices.iter().filter(|v| v.is_connectible()) {
            let tools = (&mut *sampler, &wl);
            let Some((eye, through)) = connect_to_eye(scene, vertex, tools, &mut out.counters) else {
                continue;
            };
            let scattered = vertex.scatter(eye.wi, TransportMode::Importance);
            let value = vertex.throughput * scattered * through * eye.weight;
            out.splats.add(eye.raster, scene.film_rgb(value, &wl));
        }
    }
}
