//! Vertex connection and merging [Georgiev2012]: bidirectional path tracing whose light paths also leave photons, which
//! eye walks gather at every surface that is no delta and wherever media scatter; all ways of making a path weighted against each other.
//!
//! | mode    | emitters found     | connections | light paths to the lens | merging                            |
//! |---------|--------------------|-------------|-------------------------|------------------------------------|
//! | `light` | seen directly      |             | yes                     |                                    |
//! | `ppm`   | over deltas        |             |                         | where only deltas lead to the eye  |
//! | `bpm`   | all                |             |                         | everywhere                         |
//! | `bpt`   | all                | yes         | yes                     |                                    |
//! | `vcm`   | all                | yes         | yes                     | everywhere                         |
//!
//! `bpt` is `bdpt` to the bit. The radius shrinks from pass to pass as in `sppm`, and with it the bias, which only merging
//! has: where connections do well, they have most of the weight.

use crate::Integrator;
use crate::bdpt::{Bidirectional, Emitters, Merges, Merging, Techniques, Weighting, weighting};
use crate::common::{
    KERNEL, Kernel, MEDIUM_RADIUS, MEMORY, PhotonMap, RADIUS, RADIUS_PIXELS, Radius, Roulette, Shared,
    sampler_of,
};
use crate::parameters::{ParameterInfo, ParameterKind, Parameters, shared};
use crate::photon::{PHOTONS, n_photons};
use crate::registry::{IntegratorInfo, Making, refuses_for_light_paths};

/// For the registry.
pub(crate) const INFO: IntegratorInfo = IntegratorInfo {
    name: "vcm",
    purpose: "bidirectional path tracing and photon mapping in one: robust where light and eye are behind glass",
    misses: "nothing in the end; merged light is blurred over a radius, which shrinks slowly; dear where light is easy",
    unbiased: false,
    refuses: refuses_for_light_paths,
    parameters,
    make,
};

fn parameters() -> Vec<ParameterInfo> {
    vec![
        shared::MAX_DEPTH,
        shared::RR_DEPTH,
        ParameterInfo {
            name: "mode",
            kind: ParameterKind::Choice(&["vcm", "light", "ppm", "bpm", "bpt"]),
            doc: "which ways of making paths are used: all; light paths alone; photons at the first surface; photons \
                  everywhere; connections alone",
        },
        shared::HEURISTIC,
        PHOTONS,
        ParameterInfo {
            name: "alpha",
            kind: ParameterKind::Float(0.75),
            doc: "how the radius shrinks, r² ~ passes^(alpha − 1): 1 not at all, smaller is less biased and noisier",
        },
        RADIUS,
        RADIUS_PIXELS,
        MEDIUM_RADIUS,
        ParameterInfo { kind: ParameterKind::Choice(&["constant", "epanechnikov", "cone"]), ..KERNEL },
        MEMORY,
    ]
}

fn techniques(mode: &str) -> Techniques {
    let none =
        Techniques { emitters: Emitters::All, connections: false, lens: false, merges: Merges::Nowhere };
    match mode {
        "light" => Techniques { emitters: Emitters::Seen, lens: true, ..none },
        "ppm" => Techniques { emitters: Emitters::OverDeltas, merges: Merges::First, ..none },
        "bpm" => Techniques { merges: Merges::Everywhere, ..none },
        "bpt" => Techniques::BIDIRECTIONAL,
        _ => Techniques { merges: Merges::Everywhere, ..Techniques::BIDIRECTIONAL },
    }
}

fn make(p: &Parameters, making: &Making<'_>) -> Box<dyn Integrator> {
    let sampler = sampler_of(making.sampler, making.seed);
    let (max_depth, roulette) = (p.limit("max_depth"), Roulette::from(p.integer("rr_depth")));
    let techniques = techniques(p.text("mode"));
    let merging = (techniques.merges != Merges::Nowhere).then(|| Merging {
        sampler: sampler.clone(),
        seed: making.seed,
        n_photons: n_photons(p, making.scene),
        limit: max_depth as usize,
        roulette,
        budget: u64::from(p.integer(MEMORY.name)) << 20,
        radius: Radius::of(p, p.float("alpha")),
        kernel: Kernel::of(p),
        shared: Shared::of_pass(making.scene, making.seed, 0),
        map: PhotonMap::default(),
        merges: Vec::new(),
    });
    let weighting = Weighting { techniques, ..weighting(making.scene, shared::heuristic(p)) };
    Box::new(Bidirectional { max_depth, roulette, weighting, layers: None, merging, manifold: None, sampler })
}
