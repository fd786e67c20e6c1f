//! Path guiding [Mueller2017]: a path tracer that learns where light comes from, and draws directions from a mixture of
//! the BSDF and what it learned, with next-event estimation beside both.
//!
//! The guide of a pass is a function of scene, settings, seed and the number of the pass. It is learned from paths of its
//! own, which leave nothing on the film: rounds of 2¹², 2¹², 2¹³, 2¹⁴, … paths over the whole picture, each guided by
//! what the round before has taught, up to `training` thousand in all. A pass waits for the rounds whose paths,
//! together, are no more than half of those that have started on the film by its end (and for 2¹⁴ in any case). So training
//! never costs more than half of the picture, a render may begin at any pass for the bounded cost of all rounds, and
//! every pass is unbiased: they are combined by their number (see `docs/decisions/0060` and `0106`).
//!
//! With `combine=inverse-variance` the passes of each guide have a film of their own, and those are combined by the inverse of the
//! variance that they show [Mueller2019]: **biased**, as the metadata say, for values and weights come from the same samples; see
//! `docs/decisions/0180`. It costs a film for each guide, at most seven, and fewer the larger the picture.
//!
//! Memory: a leaf of space costs at most 28 KiB (512 nodes of its quadtree); `memory` bounds their number, which then
//! grows no more. A batch of records costs at most 25 MiB beside that.
//!
//! In media the walk scatters by the phase function alone, as `path` does.
//!
//! Cannot find: what `path` cannot find. What paths find rarely, it finds often once some of them have.

use std::ops::Range;

use rayon::prelude::*;
use scene::Scene;
use spectrum::Spectrum;

use crate::common::{
    DirectionSampling, LightStrategy, PathOutput, PixelLoop, Roulette, place_in, sampler_of,
};
use crate::guide::{Field, LEAF_BYTES, Record, RecordedPath, Teacher};
use crate::parameters::{ParameterInfo, ParameterKind, Parameters, shared};
use crate::path::{EQUIANGULAR, Path};
use crate::registry::{IntegratorInfo, Making, refuses_nothing};
use crate::{Cell, CellOutput, Counters, Integrator, PassContext, Prepared};

/// For the registry.
pub(crate) const INFO: IntegratorInfo = IntegratorInfo {
    name: "guided",
    purpose: "learns where light comes from: indirect light through doors and around corners, glossy light",
    misses: "what path misses; where light is easy it only costs more than path",
    unbiased: true,
    refuses: refuses_nothing,
    parameters,
    make,
};

fn parameters() -> Vec<ParameterInfo> {
    vec![
        shared::MAX_DEPTH,
        shared::RR_DEPTH,
        shared::HEURISTIC,
        EQUIANGULAR,
        ParameterInfo {
            name: "training",
            kind: ParameterKind::Integer(1024),
            doc: "paths to learn from, in thousands (1024); 0: none, which is `path`",
        },
        ParameterInfo {
            name: "combine",
            kind: ParameterKind::Choice(&["count", "inverse-variance"]),
            doc: "how passes count: all alike, or each guide's picture by the inverse of its variance, which is biased",
        },
        ParameterInfo {
            name: "memory",
            kind: ParameterKind::Integer(128),
            doc: "MiB that the guide may take; it then stays as fine as it is",
        },
    ]
}

fn make(p: &Parameters, making: &Making<'_>) -> Box<dyn Integrator> {
    let estimator = Path {
        max_depth: p.limit("max_depth"),
        roulette: Roulette::from(p.integer("rr_depth")),
        lights: Some(LightStrategy::Mis(shared::heuristic(p))),
        directions: DirectionSampling::Bsdf,
        equiangular: p.bool(EQUIANGULAR.name),
        shortcut: (),
        guide: None,
    };
    let max_leaves = (u64::from(p.integer("memory")) << 20) / LEAF_BYTES as u64;
    Box::new(Guided {
        walks: PixelLoop { estimator, sampler: sampler_of(making.sampler, making.seed) },
        training: u64::from(p.integer("training")) << 10,
        by_variance: p.text("combine") == "inverse-variance",
        max_leaves: usize::try_from(max_leaves).unwrap_or(usize::MAX).max(1),
        rounds: 0,
    })
}

struct Guided {
    walks: PixelLoop<Path>,
    /// Paths to learn from.
    training: u64,
    max_leaves: usize,
    /// Are the pictures of the guides combined by the inverse of their variance?
    by_variance: bool,
    /// Rounds that the guide has learned from.
    rounds: u32,
}

/// Paths of the first round; every one but the second has twice as many as the one before.
const FIRST_ROUND: u64 = 1 << 12;
/// Paths that all passes wait for.
const AT_LEAST: u64 = 1 << 14;
/// Paths on the film for each that teaches.
const PICTURE_PER_TRAINING: u64 = 2;
/// Paths whose records are in memory at a time, and those that one thread traces in one go.
const BATCH: u64 = 1 << 14;
const CHUNK: u64 = 1 << 8;
/// A leaf is cut when it has had more records than this in the first round; √2 times as many in each that doubles
/// [Mueller2017, sec. 3.3].
const CUT_ABOVE: f64 = 300.0;

/// Paths of all rounds before round `k`.
fn paths_before(k: u32) -> u64 {
    if k == 0 { 0 } else { FIRST_ROUND << (k - 1).min(40) }
}

impl Guided {
    /// Rounds that a pass needs.
    fn rounds_for(&self, pass: u32, pixels: u64) -> u32 {
        let started = (u64::from(pass) + 1).saturating_mul(pixels);
        let most = (started / PICTURE_PER_TRAINING).max(AT_LEAST).min(self.training);
        (1..40).take_while(|&k| paths_before(k) <= most).last().unwrap_or(0)
    }

    /// The passes from which on a guide of more rounds is read, one for each such guide.
    fn first_passes(&self, pixels: u64) -> Vec<u32> {
        let last = self.rounds_for(u32::MAX, pixels);
        let mut firsts: Vec<u32> = (self.rounds_for(0, pixels) + 1..=last)
            .map(|k| {
                // The film must have started on twice the paths of the rounds.
                let passes = (PICTURE_PER_TRAINING * paths_before(k)).div_ceil(pixels.max(1));
                u32::try_from(passes - 1).unwrap_or(u32::MAX)
            })
            .collect();
        firsts.dedup();
        firsts
    }

    /// One round: its paths are guided by what the rounds before have taught.
    fn train(&mut self, scene: &Scene, round: u32) -> Counters {
        let field = self.walks.estimator.guide.take().unwrap_or_else(|| Field::new(&scene.bounds()));
        let mut teacher = Teacher::begin(&field);
        self.walks.estimator.guide = Some(field);
        let mut counters = Counters::default();
        for batch in (paths_before(round)..paths_before(round + 1)).step_by(BATCH as usize) {
            let end = (batch + BATCH).min(paths_before(round + 1));
            let starts: Vec<u64> = (batch..end).step_by(CHUNK as usize).collect();
            let chunks: Vec<_> = starts.par_iter().map(|&s| self.chunk(scene, s..s + CHUNK)).collect();
            let records: Vec<Record> = chunks.iter().flat_map(|c| &c.0).copied().collect();
            chunks.iter().for_each(|c| counters.add(&c.1));
            if let Some(field) = &self.walks.estimator.guide {
                teacher.hear(field, &records);
            }
        }
        let doublings = f64::from(round.saturating_sub(1));
        let limit = CUT_ABOVE * math::trig::f64::exp2(0.5 * doublings);
        if let Some(field) = &mut self.walks.estimator.guide {
            teacher.end(field, limit as u64, self.max_leaves);
        }
        counters
    }

    /// Paths through points of the film that are spread evenly over it.
    fn chunk(&self, scene: &Scene, paths: Range<u64>) -> (Vec<Record>, Counters) {
        let region = scene.settings().sample_bounds();
        let (mut sampler, mut counters) = (self.walks.sampler.clone(), Counters::default());
        let (mut recorded, mut records) = (RecordedPath::default(), Vec::new());
        for path in paths {
            sampler.start_path(path, 0);
            let raster = place_in(&region, sampler.next_2d());
            let mut out = PathOutput { counters: &mut counters, recorded: Some(&mut recorded) };
            let traced = self.walks.trace(PassContext { scene, pass: 0 }, raster, &mut sampler, &mut out);
            recorded.finish(traced.map_or(Spectrum::ZERO, |t| t.0), &mut records);
        }
        (records, counters)
    }
}

impl Integrator for Guided {
    fn prepares(&self) -> bool {
        true
    }

    fn prepare(&mut self, ctx: PassContext<'_>) -> Prepared {
        let pixels = ctx.scene.settings().sample_bounds().area() as u64;
        let needed = self.rounds_for(ctx.pass, pixels);
        if needed < self.rounds {
            // An earlier pass must not know what was learned later.
            (self.walks.estimator.guide, self.rounds) = (None, 0);
        }
        let mut counters = Counters::default();
        for round in self.rounds..needed {
            counters.add(&self.train(ctx.scene, round));
        }
        self.rounds = needed;
        // Paths of the picture are counted apart.
        counters.camera_paths = 0;
        let is_full = |f: &Field| f.leaves().len() >= self.max_leaves;
        let full = self.walks.estimator.guide.as_ref().is_some_and(is_full);
        let warning = "the guide has reached its limit, and stays as fine as it is: set `memory` to more MiB";
        let until = self.first_passes(pixels).into_iter().find(|&first| first > ctx.pass).unwrap_or(u32::MAX);
        Prepared { counters, warning: full.then(|| warning.to_owned()), until }
    }

    fn round(&self, ctx: PassContext<'_>) -> Option<u32> {
        Some(self.rounds_for(ctx.pass, ctx.scene.settings().sample_bounds().area() as u64))
    }

    fn iterations(&self, scene: &Scene) -> Vec<u32> {
        let pixels = scene.settings().sample_bounds().area() as u64;
        if self.by_variance { self.first_passes(pixels) } else { Vec::new() }
    }

    fn learned(&self) -> Option<Vec<u8>> {
        postcard::to_allocvec(&(self.rounds, &self.walks.estimator.guide)).ok()
    }

    fn take_learned(&mut self, bytes: &[u8]) -> bool {
        let Ok((rounds, guide)) = postcard::from_bytes(bytes) else { return false };
        (self.rounds, self.walks.estimator.guide) = (rounds, guide);
        true
    }

    fn cell(&self, ctx: PassContext<'_>, cell: Cell, out: &mut CellOutput) {
        self.walks.cell(ctx, cell, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guided(training: u64) -> Guided {
        let estimator = Path {
            max_depth: 3,
            roulette: Roulette::from(3),
            lights: None,
            directions: DirectionSampling::Bsdf,
            equiangular: false,
            shortcut: (),
            guide: None,
        };
        let sampler = sampler_of(&scene_desc::SamplerDesc::default(), 0);
        let walks = PixelLoop { estimator, sampler };
        Guided { walks, training, max_leaves: 1, by_variance: false, rounds: 0 }
    }

    #[test]
    fn training_never_costs_more_than_half_the_picture_and_ends() {
        let guided = guided(2048 << 10);
        assert_eq!(paths_before(guided.rounds_for(0, 1)), AT_LEAST, "for all");
        for (pass, pixels) in [(0, 100_000), (5, 50_000), (100, 3_000)] {
            let paths = paths_before(guided.rounds_for(pass, pixels));
            let most = (u64::from(pass) + 1) * pixels / 2;
            assert!(paths <= most && 2 * paths > most, "{paths} {most}");
        }
        assert_eq!(paths_before(guided.rounds_for(u32::MAX, u64::MAX)), 2048 << 10, "and then no more");
    }

    #[test]
    fn iterations_begin_where_the_guide_changes() {
        let guided = guided(1024 << 10);
        for pixels in [1, 3_000, 9_216, 50_000, 921_600, 1 << 22] {
            let firsts = guided.first_passes(pixels);
            assert!(firsts.len() < 8 && firsts.is_sorted_by(|a, b| a < b), "{firsts:?}");
            for &first in &firsts {
                assert!(
                    guided.rounds_for(first - 1, pixels) < guided.rounds_for(first, pixels),
                    "{pixels} {first}"
                );
            }
            let last = firsts.last().copied().unwrap_or(0);
            assert_eq!(guided.rounds_for(last, pixels), guided.rounds_for(u32::MAX, pixels));
        }
    }
}
