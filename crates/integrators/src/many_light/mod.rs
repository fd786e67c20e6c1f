//! Many-light rendering: light paths leave virtual lights on matt surfaces [Keller1997], and what those send to other
//! matt surfaces is summed over all of them or, by lightcuts, over clusters of them [Walter2005].
//!
//! | step                                     | source        | file     |
//! |------------------------------------------|---------------|----------|
//! | virtual lights                           | [Keller1997]  | `lights` |
//! | near ones bounded, the rest traced       | [Kollig2006]  | `lights` |
//! | light tree, cuts, bound on their error   | [Walter2005]  | `tree`   |
//!
//! Virtual lights are made anew for every pass, so that passes average and their grain fades. Only what one matt surface
//! (Lambertian, perhaps under a smooth coat) sends to another is had from them; light that really is emitted is sampled
//! at every hit by the tree of [`scene::LightSelector`], k of n lights in k log n steps, dealt to the tree's branches, and glossy and delta lobes go
//! on with the eye's walk, as does what they, and media on the way, send to a matt surface.
//!
//! A virtual light near a surface would make a bright spot: `G = |cos cos'| / d²` counts up to a bound. What that takes away
//! is given back by the walk (`compensation`): it goes on to the next surface, and light from there counts by the share that
//! was cut off, `1 − bound / G`; with it the bound is no bias.
//!
//! With `gather=all` and compensation the method is unbiased. A cut is right on average over passes for given clusters; which
//! clusters are split depends on what their representatives show, hence a bias of up to about `error`, in practice far less.

mod lights;
mod tree;

use math::hash::combine;
use sampling::Sampler;
use scatter::Bsdf;
use scene::{Shading, SurfaceInteraction};

use self::lights::{Bound, Receiver, VirtualLight, VirtualLights, is_matt};
use self::tree::{CutRules, LightTree};
use crate::common::{
    DirectionSampling, Emission, Gathered, LightStrategy, MEMORY, PixelLoop, Roulette, Shared, Tools,
    sampler_of,
};
use crate::parameters::{ParameterInfo, ParameterKind, Parameters, shared};
use crate::path::Path;
use crate::registry::{IntegratorInfo, Making, refuses_for_light_walks};
use crate::shortcut::{LIGHT_SAMPLES, Shortcut};
use crate::walker::Walker;
use crate::{Cell, CellOutput, Integrator, PassContext, Prepared};

/// For the registry.
pub(crate) const INFO: IntegratorInfo = IntegratorInfo {
    name: "many-light",
    purpose: "virtual lights, by lightcuts: diffuse scenes whose indirect light is even, after few passes",
    misses: "what path misses; glossy surfaces are path traced, and lightcuts may be wrong by a part of `error`",
    unbiased: false,
    refuses: refuses_for_light_walks,
    parameters,
    make,
};

fn parameters() -> Vec<ParameterInfo> {
    let parameter = |name, kind, doc| ParameterInfo { name, kind, doc };
    vec![
        shared::MAX_DEPTH,
        shared::RR_DEPTH,
        shared::HEURISTIC,
        parameter("light_paths", ParameterKind::Integer(1024), "light paths of a pass"),
        parameter(
            "gather",
            ParameterKind::Choice(&["lightcuts", "all"]),
            "lightcuts: clusters of virtual lights, as many as error asks for; all: every one",
        ),
        parameter(
            "error",
            ParameterKind::Float(0.02),
            "bound on the error of a cluster in a cut, as a share of the whole",
        ),
        parameter("max_cut", ParameterKind::Integer(1000), "most clusters in a cut"),
        parameter(
            "clamping",
            ParameterKind::Float(0.1),
            "distance, as a share of the scene's radius, at which a facing virtual light counts most; 0: no bound",
        ),
        parameter("compensation", ParameterKind::Bool(true), "trace what clamping takes away"),
        ParameterInfo { kind: ParameterKind::Integer(8), ..LIGHT_SAMPLES },
        ParameterInfo {
            doc: "most MiB for the virtual lights of a pass (512 bytes each); paths that do not fit are left out",
            ..MEMORY
        },
    ]
}

fn make(p: &Parameters, making: &Making<'_>) -> Box<dyn Integrator> {
    let sampler = sampler_of(making.sampler, making.seed);
    let nearest = p.float("clamping").max(0.0) * making.scene.lights.world_sphere().1;
    let rules = CutRules { error: p.float("error").max(0.0), most: p.integer("max_cut").max(1) as usize };
    let shortcut = Gathering {
        max_depth: p.limit("max_depth"),
        bound: Bound { most: 1.0 / (nearest * nearest) },
        compensation: p.bool("compensation") && nearest > 0.0,
        cuts: (p.text("gather") != "all").then_some(rules),
        has_others: making.scene.has_media() || !making.scene.materials.are_all_lambertian(),
        light_samples: p.integer(LIGHT_SAMPLES.name).max(1),
        shared: Shared::of_pass(making.scene, making.seed, 0),
        lights: Vec::new(),
        n_paths: 0,
        trees: Vec::new(),
    };
    let estimator = Path {
        max_depth: p.limit("max_depth"),
        roulette: Roulette::from(p.integer("rr_depth")),
        lights: Some(LightStrategy::Mis(shared::heuristic(p))),
        directions: DirectionSampling::Bsdf,
        equiangular: false,
        shortcut,
        guide: None,
    };
    Box::new(ManyLight {
        pixels: PixelLoop { estimator, sampler: sampler.clone() },
        sampler,
        seed: making.seed,
        light_paths: u64::from(p.integer("light_paths").max(1)),
        budget: u64::from(p.integer(MEMORY.name)) << 20,
    })
}

struct ManyLight {
    pixels: PixelLoop<Path<Gathering>>,
    sampler: Sampler,
    seed: u64,
    light_paths: u64,
    /// In bytes.
    budget: u64,
}

/// Keeps the choice of representatives apart from other numbers.
const REPRESENTATIVES: u64 = 0x4e9;

impl Integrator for ManyLight {
    fn prepares(&self) -> bool {
        true
    }

    fn prepare(&mut self, ctx: PassContext<'_>) -> Prepared {
        let path = &mut self.pixels.estimator;
        let shared = Shared::of_pass(ctx.scene, self.seed, ctx.pass);
        let emission = Emission {
            scene: ctx.scene,
            sampler: &self.sampler,
            pass: ctx.pass,
            stream: 0,
            shared,
            n_paths: self.light_paths,
            // One event at the surface that is lit.
            limit: path.max_depth.saturating_sub(1) as usize,
            roulette: path.roulette,
            budget: self.budget,
        };
        let emitted = emission.run::<VirtualLights>();
        let key = combine(combine(REPRESENTATIVES, self.seed), u64::from(ctx.pass));
        path.shortcut.shared = shared;
        path.shortcut.n_paths = emitted.n_paths;
        path.shortcut.set_lights(emitted.kept.0, key);
        Prepared { counters: emitted.counters, warning: emitted.warning, until: 0 }
    }

    fn cell(&self, ctx: PassContext<'_>, cell: Cell, out: &mut CellOutput) {
        self.pixels.cell(ctx, cell, out);
    }
}

/// Sums over virtual lights.
struct Gathering {
    max_depth: u32,
    bound: Bound,
    compensation: bool,
    /// `None`: all lights.
    cuts: Option<CutRules>,
    light_samples: u32,
    /// Are there surfaces with other lobes than Lambert's, or media?
    has_others: bool,
    shared: Shared,
    lights: Vec<VirtualLight>,
    n_paths: u64,
    /// For walks that may be joined to any light, and for those of one, two, … events more.
    trees: Vec<LightTree>,
}

impl Gathering {
    fn set_lights(&mut self, lights: Vec<VirtualLight>, key: u64) {
        self.lights = lights;
        self.trees.clear();
        if self.cuts.is_none() {
            return;
        }
        let (free, deepest) = (self.free_depth(), self.deepest());
        let last = deepest.min(self.max_depth.saturating_sub(2));
        for extra in 0..=last {
            let most = self.max_depth.saturating_sub(2).saturating_sub(free.saturating_add(extra));
            self.trees.push(LightTree::new(&self.lights, key, |l| l.depth <= most));
            if !self.has_others && !self.compensation {
                // Walks end where lights are gathered.
                break;
            }
        }
    }

    /// Scattering events before the deepest light.
    fn deepest(&self) -> u32 {
        self.lights.iter().map(|l| l.depth).max().unwrap_or(0)
    }

    /// A walk with so many scattering events may be joined to any light.
    fn free_depth(&self) -> u32 {
        self.max_depth.saturating_sub(2).saturating_sub(self.deepest())
    }
}

impl Shortcut for Gathering {
    fn shared(&self) -> Option<Shared> {
        Some(self.shared)
    }

    fn takes(&self, bsdf: &Bsdf) -> bool {
        is_matt(bsdf)
    }

    fn light(&self, walk: &mut Walker<'_>, si: &SurfaceInteraction, shading: &Shading) -> Option<Gathered> {
        let receiver = Receiver { scene: walk.scene, si, shading, around: walk.around, bound: self.bound };
        let mut tools = Tools { sampler: walk.sampler, wl: walk.wl, counters: walk.counters };
        let sum = match &self.cuts {
            Some(rules) => {
                let extra = walk.depth.saturating_sub(self.free_depth());
                let tree = self.trees.get(extra as usize)?;
                tree.gather(&receiver, &self.lights, rules, &mut tools).0
            }
            None => {
                let mut sum = Gathered::default();
                let most = self.max_depth - walk.depth - 2;
                for light in self.lights.iter().filter(|l| l.depth <= most) {
                    sum.add(receiver.reflected(light, &mut tools), light.is_terminated);
                }
                sum
            }
        };
        let mut light = Gathered::default();
        light.add_scaled(&sum, spectrum::Spectrum::splat(1.0 / self.n_paths.max(1) as f32));
        Some(light)
    }

    fn remainder(&self, from: (&SurfaceInteraction, &Shading), to: &SurfaceInteraction) -> f32 {
        if self.compensation { 1.0 - self.bound.share(from, to) } else { 0.0 }
    }

    fn light_samples(&self) -> u32 {
        self.light_samples
    }

    fn leaves_something(&self) -> bool {
        self.has_others || self.compensation
    }
}
