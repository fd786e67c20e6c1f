//! The irradiance cache [Ward1988]: light that matt surfaces get from matt surfaces changes slowly, so that it is
//! computed at few places and interpolated in between.
//!
//! | step                                       | source                       | file         |
//! |--------------------------------------------|------------------------------|--------------|
//! | split-sphere error, weights                | [Ward1988], [Tabellion2004]  | `record`     |
//! | gradients by rotation and translation      | [Ward1992], [Krivanek2005]   | `hemisphere` |
//! | neighbour clamping                         | [Krivanek2006]               | `record`     |
//! | overture in rounds                         | –                            | `build`      |
//! | wavelengths                                | –                            | `basis`      |
//!
//! Only what one Lambertian surface sends to another is cached, its emission left out. Direct light is sampled at every
//! hit; mirrors, glass, metal, coats and media are walked through, and what they send to a matt surface is found by walks
//! too (so a caustic is as noisy as in `path`, but never smeared). Where no record reaches, the walk goes on as in
//! `path`. What arrives at a record is traced like a walk from the eye, which uses the records that are there already.
//!
//! With a limit of depth there is a cache for every number of scattering events before it; without one, one for all.
//!
//! **Biased**: interpolation is not exact, and a record keeps its noise for all passes; both vanish with `error` and
//! `min_spacing` → 0 and `rays` → ∞. Passes share the records, so that their variance does not show this error.
//! Where shapes move nothing is cached.

mod basis;
mod build;
mod cache;
mod hemisphere;
mod record;

use math::Dir;
use sampling::Sampler;
use sampling::mis::Heuristic;
use scatter::{Bsdf, TransportMode};
use scene::{Shading, SurfaceInteraction};
use spectrum::Spectrum;

use self::basis::Basis;
use self::build::Build;
use self::cache::{Cache, Rules};
use crate::common::{DirectionSampling, Gathered, LightStrategy, PixelLoop, Roulette, sampler_of};
use crate::parameters::{ParameterInfo, ParameterKind, Parameters, shared};
use crate::path::Path;
use crate::registry::{IntegratorInfo, Making, refuses_diffusion};
use crate::shortcut::{LIGHT_SAMPLES, Shortcut};
use crate::walker::Walker;
use crate::{Cell, CellOutput, Integrator, PassContext, Prepared};

/// For the registry.
pub(crate) const INFO: IntegratorInfo = IntegratorInfo {
    name: "irradiance-cache",
    purpose: "light between matt surfaces interpolated from few places: smooth interiors, soon and without noise",
    misses: "what path misses; detail of indirect light below its spacing, and its interpolation error is not in the variance",
    unbiased: false,
    refuses: refuses_diffusion,
    parameters,
    make,
};

fn parameters() -> Vec<ParameterInfo> {
    let parameter = |name, kind, doc| ParameterInfo { name, kind, doc };
    vec![
        shared::MAX_DEPTH,
        shared::RR_DEPTH,
        shared::HEURISTIC,
        parameter(
            "error",
            ParameterKind::Float(0.3),
            "allowed error of a record where it is used: distance over mean distance of what it sees, and turn",
        ),
        parameter("rays", ParameterKind::Integer(1024), "rays over the hemisphere of a record"),
        parameter("min_spacing", ParameterKind::Float(4.0), "a record reaches at least so many pixels"),
        parameter("max_spacing", ParameterKind::Float(32.0), "a record reaches at most so many pixels"),
        parameter("gradients", ParameterKind::Bool(true), "extrapolate with gradients"),
        parameter("clamping", ParameterKind::Bool(true), "records limit the reach of their neighbours"),
        LIGHT_SAMPLES,
        parameter(
            "cache_memory",
            ParameterKind::Integer(1024),
            "most MiB for records (166 bytes each, 502 in spectral mode); where it is full the rest is path traced",
        ),
    ]
}

fn make(p: &Parameters, making: &Making<'_>) -> Box<dyn Integrator> {
    let scene = making.scene;
    let settings = Settings {
        max_depth: p.limit("max_depth"),
        rules: Rules {
            error: p.float("error").clamp(1e-3, 1.0),
            gradients: p.bool("gradients"),
            clamping: p.bool("clamping"),
        },
        rays: p.integer("rays").clamp(16, 1 << 24),
        spacing: [p.float("min_spacing").max(0.0), p.float("max_spacing").max(0.0)],
        memory: u64::from(p.integer("cache_memory")) << 20,
        basis: if scene.settings().spectral { Basis::Bins } else { Basis::Rgb },
        light_samples: p.integer(LIGHT_SAMPLES.name).max(1),
        has_others: scene.has_media() || !scene.materials.are_all_lambertian(),
    };
    let heuristic = shared::heuristic(p);
    let roulette = Roulette::from(p.integer("rr_depth"));
    let shortcut = Interpolation { settings, caches: Vec::new() };
    let sampler = sampler_of(making.sampler, making.seed);
    let estimator = path(settings.max_depth, roulette, heuristic, shortcut);
    let arriving = path(settings.max_depth, roulette, heuristic, ());
    Box::new(IrradianceCache { pixels: PixelLoop { estimator, sampler: sampler.clone() }, sampler, arriving })
}

fn path<S>(max_depth: u32, roulette: Roulette, heuristic: Heuristic, shortcut: S) -> Path<S> {
    let lights = Some(LightStrategy::Mis(heuristic));
    Path {
        max_depth,
        roulette,
        lights,
        directions: DirectionSampling::Bsdf,
        equiangular: false,
        shortcut,
        guide: None,
    }
}

/// What was set.
#[derive(Clone, Copy, Debug)]
struct Settings {
    max_depth: u32,
    rules: Rules,
    rays: u32,
    /// Least and greatest, in pixels.
    spacing: [f32; 2],
    /// Bytes.
    memory: u64,
    basis: Basis,
    light_samples: u32,
    /// Is there anything that is no matt surface: others, or media?
    has_others: bool,
}

impl Settings {
    fn most_records(&self) -> u64 {
        self.memory / Cache::bytes_per_record(self.basis)
    }

    fn n_caches(&self) -> usize {
        match self.max_depth {
            u32::MAX => 1,
            limit => limit.saturating_sub(1).min(MOST_CACHES) as usize,
        }
    }

    /// Which cache is for walks with so many scattering events before; `None`: that deep nothing is cached.
    fn cache_of(&self, depth: u32) -> Option<usize> {
        let i = if self.max_depth == u32::MAX { 0 } else { depth as usize };
        (i < self.n_caches()).then_some(i)
    }
}

/// Deeper in a path nothing is cached.
const MOST_CACHES: u32 = 16;

struct IrradianceCache {
    pixels: PixelLoop<Path<Interpolation<Vec<Cache>>>>,
    sampler: Sampler,
    /// Traces what arrives at records.
    arriving: Path,
}

impl Integrator for IrradianceCache {
    fn prepares(&self) -> bool {
        true
    }

    /// Before the first pass, whichever it is, all records are made; they do not depend on it.
    fn prepare(&mut self, ctx: PassContext<'_>) -> Prepared {
        let shortcut = &mut self.pixels.estimator.shortcut;
        let settings = &shortcut.settings;
        let done = Prepared { until: u32::MAX, ..Prepared::default() };
        if !shortcut.caches.is_empty() {
            return done;
        }
        shortcut.caches =
            (0..settings.n_caches()).map(|_| Cache::new(settings.rules, settings.basis)).collect();
        if ctx.scene.has_moving_shapes() {
            let warning = "shapes move: irradiance-cache caches nothing and traces all paths".to_owned();
            return Prepared { warning: Some(warning), ..done };
        }
        let build = Build { scene: ctx.scene, settings, sampler: &self.sampler, path: &self.arriving };
        let built = build.run(&mut shortcut.caches);
        let warning = built.is_full.then(|| {
            let records: usize = shortcut.caches.iter().map(Cache::len).sum();
            format!(
                "cache_memory is reached: {records} records fill {} MiB, and what they do not cover is path traced; \
                 set cache_memory higher, or error or min_spacing",
                settings.memory >> 20
            )
        });
        Prepared { counters: built.counters, warning, ..done }
    }

    fn round(&self, _: PassContext<'_>) -> Option<u32> {
        Some(0)
    }

    fn learned(&self) -> Option<Vec<u8>> {
        let caches: Vec<_> = self.pixels.estimator.shortcut.caches.iter().map(Cache::parts).collect();
        postcard::to_allocvec(&caches).ok()
    }

    fn take_learned(&mut self, bytes: &[u8]) -> bool {
        let shortcut = &mut self.pixels.estimator.shortcut;
        let (rules, basis) = (shortcut.settings.rules, shortcut.settings.basis);
        let Ok(parts) = postcard::from_bytes::<Vec<cache::Parts>>(bytes) else { return false };
        let caches = parts.iter().map(|parts| Cache::from_parts(rules, basis, parts));
        let Some(caches) = caches.collect::<Option<Vec<_>>>() else { return false };
        let fits = caches.len() == shortcut.settings.n_caches();
        if fits {
            shortcut.caches = caches;
        }
        fits
    }

    fn cell(&self, ctx: PassContext<'_>, cell: Cell, out: &mut CellOutput) {
        self.pixels.cell(ctx, cell, out);
    }
}

/// Looks irradiance up, in caches by scattering events before.
struct Interpolation<C> {
    settings: Settings,
    caches: C,
}

impl<C: AsRef<[Cache]> + Send + Sync> Shortcut for Interpolation<C> {
    fn takes(&self, bsdf: &Bsdf) -> bool {
        is_matt(bsdf)
    }

    fn light(&self, walk: &mut Walker<'_>, si: &SurfaceInteraction, shading: &Shading) -> Option<Gathered> {
        let cache = self.caches.as_ref().get(self.settings.cache_of(walk.depth)?)?;
        let mut light = Gathered::default();
        for (n, f) in sides(si, shading).into_iter().flatten() {
            light.add(f * cache.interpolate(si.p, n, walk.wl)?, false);
        }
        Some(light)
    }

    fn remainder(&self, _: (&SurfaceInteraction, &Shading), _: &SurfaceInteraction) -> f32 {
        0.0
    }

    fn light_samples(&self) -> u32 {
        self.settings.light_samples
    }

    fn leaves_something(&self) -> bool {
        self.settings.has_others
    }
}

/// Is it Lambert's law, on one side or on both, and nothing else?
fn is_matt(bsdf: &Bsdf) -> bool {
    matches!(bsdf, Bsdf::Diffuse(_) | Bsdf::DiffuseTransmission(_))
}

/// The sides of a matt surface from which light is sent towards `si.wo`: normals, and `f`.
fn sides(si: &SurfaceInteraction, shading: &Shading) -> [Option<(Dir, Spectrum)>; 2] {
    let frame = &shading.frame;
    let wo = frame.to_local(si.wo);
    [frame.n, -frame.n].map(|n| {
        let f = shading.bsdf.eval(wo, frame.to_local(n), TransportMode::Radiance);
        (!f.is_black()).then_some((n, f))
    })
}
