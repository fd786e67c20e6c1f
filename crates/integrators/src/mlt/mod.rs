//! Metropolis light transport over the strategies of bidirectional path tracing, multiplexed [Hachisuka2014]: Markov chains
//! in the space of the random numbers that make a path [Kelemen2002], each state of which is one path by one strategy.
//!
//! | what                                          | source                     | file     |
//! |-----------------------------------------------|----------------------------|----------|
//! | the numbers of a path and small steps of them | [Kelemen2002]              | `space`  |
//! | the value of a point                          | [Hachisuka2014]            | `target` |
//! | weights of chains without start-up bias       | [Veach1997, sec. 11.3.1]   | `block`  |
//! | expected values                               | [Veach1997, sec. 11.5]     | `block`  |
//! | as many chains as there is light              | [Cline2005]                | `block`  |
//! | sizes over the brightness of a coarse image   | [Veach1997, sec. 11.5]     | `map`    |
//!
//! A pass has one sample of bidirectional path tracing in every pixel. Its paths are the bootstrap: chains start at them,
//! and carry the mean of what they add. They are not thrown away: every path that a sample and a chain may both
//! make is shared between them, by multiple importance sampling over the two densities. So chains have the paths that are
//! bright and seldom found, and samples all the rest; where nothing is hard to find, little is lost.
//!
//! A block of a pass is a pure function of (seed, pass, block) and of the plan, which is made once, before the first pass,
//! by a pilot.
//!
//! Steps of a chain are: all numbers a little; one of the walks anew from some number on, the other kept; a vertex more or less
//! on one side; and large steps to new paths, by the techniques in proportion to what the pilot saw them make.
//!
//! Departs from [Hachisuka2014]: a chain visits paths of all lengths. Emitters that are seen directly (depth 0) come from
//! camera rays. Left out: paths of more than 200 scattering events, and steps that change the strategy and keep the path.

mod block;
mod map;
mod plan;
mod space;
mod target;

use math::hash::combine;
use scene::Scene;

use self::block::{Block, Places, Rules, Survival};
use self::plan::Plan;
use self::space::Kinds;
use self::target::World;
use crate::bdpt::{Weighting, weighting};
use crate::common::{DirectionSampling, PixelLoop, Roulette, sampler_of};
use crate::manifold::{self, Manifold};
use crate::parameters::{ParameterInfo, ParameterKind, Parameters, shared};
use crate::path::Path;
use crate::registry::{IntegratorInfo, Making, refuses_for_light_paths};
use crate::{Cell, CellOutput, Integrator, PassContext, Prepared};

/// For the registry.
pub(crate) const INFO: IntegratorInfo = IntegratorInfo {
    name: "mlt",
    purpose: "chains that stay where the light is: light that is hard to find, such as through a door ajar",
    misses: "what bdpt misses; where light is easy to find it is slower than bdpt, and its noise is blotchy",
    unbiased: true,
    refuses: refuses_for_light_paths,
    parameters,
    make,
};

fn parameters() -> Vec<ParameterInfo> {
    vec![
        shared::MAX_DEPTH,
        shared::HEURISTIC,
        ParameterInfo {
            name: "mutations",
            kind: ParameterKind::Integer(3),
            doc: "steps of chains per pixel and pass, where there is as much light as the pilot found",
        },
        ParameterInfo { name: "chain", kind: ParameterKind::Integer(1024), doc: "steps of a chain" },
        ParameterInfo {
            name: "large_steps",
            kind: ParameterKind::Float(0.02),
            doc: "probability of a step to a new, independent path",
        },
        ParameterInfo {
            name: "pilot",
            kind: ParameterKind::Integer(4096),
            doc: "paths that are traced before the first pass, to see how bright the image is and where",
        },
        manifold::PARAMETER,
    ]
}

fn make(p: &Parameters, making: &Making<'_>) -> Box<dyn Integrator> {
    let scene = making.scene;
    let directly = PixelLoop {
        estimator: Path {
            max_depth: 0,
            roulette: Roulette::from(0),
            lights: None,
            directions: DirectionSampling::Bsdf,
            equiangular: false,
            shortcut: (),
            guide: None,
        },
        sampler: sampler_of(making.sampler, making.seed),
    };
    let manifold = Manifold::of(scene, p);
    let longest = manifold.as_ref().map_or(0, |m| m.longest);
    let weighting = Weighting { manifold: longest, ..weighting(scene, shared::heuristic(p)) };
    let rules = Rules {
        weighting,
        max_depth: p.limit("max_depth"),
        survival: Survival::in_scene(scene),
        mutations: p.integer("mutations"),
        chain: p.integer("chain").max(1),
        large_steps: p.float("large_steps").clamp(0.0, 1.0),
    };
    let plan = Plan::blank(scene.settings().sample_bounds(), &rules, Kinds::of(scene, &weighting));
    let pilot = Some(p.integer("pilot").min(MOST_PILOTS) as usize);
    Box::new(Metropolis { directly, seed: making.seed, rules, manifold, plan, pilot })
}

/// More paths before the first pass would be of no use.
const MOST_PILOTS: u32 = 1 << 24;

/// Samples of a block.
const PER_BLOCK: usize = 1024;

struct Metropolis {
    /// Emitters that the eye sees.
    directly: PixelLoop<Path>,
    seed: u64,
    rules: Rules,
    manifold: Option<Manifold>,
    plan: Plan,
    /// Paths of the pilot; `None` once it is home.
    pilot: Option<usize>,
}

impl Metropolis {
    fn world<'a>(&'a self, scene: &'a Scene) -> World<'a> {
        World { scene, manifold: self.manifold.as_ref() }
    }
}

/// Keeps the numbers of chains apart from those of samplers.
const CHAIN: u64 = 0x3317;

impl Integrator for Metropolis {
    fn prepares(&self) -> bool {
        true
    }

    fn prepare(&mut self, ctx: PassContext<'_>) -> Prepared {
        let done = Prepared { until: u32::MAX, ..Prepared::default() };
        let Some(samples) = self.pilot.take() else { return done };
        let (plan, counters) = Plan::by_pilot(self.world(ctx.scene), self.rules, samples, self.seed);
        self.plan = plan;
        Prepared { counters, ..done }
    }

    fn splats(&self) -> bool {
        true
    }

    fn light_blocks(&self, scene: &Scene) -> u32 {
        let blocks = n_samples(scene).div_ceil(PER_BLOCK);
        if self.rules.max_depth == 0 { 0 } else { u32::try_from(blocks).unwrap_or(u32::MAX) }
    }

    fn cell(&self, ctx: PassContext<'_>, cell: Cell, out: &mut CellOutput) {
        match cell {
            Cell::Tile(_) => self.directly.cell(ctx, cell, out),
            Cell::LightBlock(number) => {
                let key = [self.seed, u64::from(ctx.pass), u64::from(number)];
                let key = key.iter().fold(CHAIN, |h, &x| combine(h, x));
                let stride = self.light_blocks(ctx.scene) as usize;
                let places = Places { first: number as usize, stride, of: n_samples(ctx.scene) };
                let mut block = Block::new(self.rules, &self.plan, self.world(ctx.scene), key, places);
                block.run(&mut |raster, rgb| out.splats.add(raster, rgb));
                out.counters.add(&block.counters());
            }
        }
    }
}

/// Samples of a pass: one in every pixel that is rendered.
fn n_samples(scene: &Scene) -> usize {
    scene.settings().sample_bounds().area()
}
