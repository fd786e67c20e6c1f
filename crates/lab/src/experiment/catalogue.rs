//! The experiments, in the order of the lecture.

use super::Experiment;
use super::claim::{Claim, Per};

const BOX: &str = include_str!("../../scenes/box.pbrt");
const GLOSSY: &str = include_str!("../../scenes/glossy.pbrt");
const PLATES: &str = include_str!("../../scenes/plates.pbrt");
const CAUSTIC: &str = include_str!("../../scenes/caustic.pbrt");
const WAX: &str = include_str!("../../scenes/wax.pbrt");
const ROOM: &str = include_str!("../../scenes/room.pbrt");

const fn lower(better: &'static str, worse: &'static str, factor: f64) -> Claim {
    Claim::Lower { better, worse, factor, per: Per::Sample }
}

const fn independent(of: &'static str) -> Claim {
    Claim::Falls { of, exponent: -1.0, within: 0.1 }
}

/// Runs of each method that most claims are settled by.
const RUNS: u32 = 6;

/// All of them.
pub const CATALOGUE: &[Experiment] = &[
    Experiment {
        name: "ambient-occlusion",
        title: "Ambient occlusion: uniform and cosine sampling",
        theory: "The share of the sky that a point sees, weighted by the cosine, is the simplest integral of rendering. Uniform \
                 directions give 2/N Σ V cos θ, directions in proportion to the cosine 1/N Σ V: the cosine is in the density and \
                 leaves the estimator. In the open the second has no variance at all. Four times the samples halve the error of both.",
        scene: BOX,
        methods: &[
            ("uniform", "ao:sampling=uniform:distance=0.8"),
            ("cosine", "ao:sampling=cosine:distance=0.8"),
        ],
        spp: 64,
        seeds: RUNS,
        reference: "ao:sampling=cosine:distance=0.8:samples=4",
        claims: &[
            lower("cosine", "uniform", 1.5),
            independent("uniform"),
            independent("cosine"),
            Claim::Agree { a: "uniform", b: "cosine" },
        ],
    },
    Experiment {
        name: "glossy",
        title: "Importance sampling: the BSDF against blind directions",
        theory: "A glossy surface takes its light from few directions. Directions drawn uniformly seldom meet them and give fireflies \
                 when they do; directions drawn from the BSDF put samples where the integrand is large.",
        scene: GLOSSY,
        methods: &[
            ("uniform", "direct:sampling=uniform"),
            ("cosine", "direct:sampling=cosine"),
            ("bsdf", "direct:sampling=bsdf"),
        ],
        spp: 32,
        seeds: RUNS,
        reference: "direct:sampling=mis:light_samples=2:bsdf_samples=2",
        claims: &[
            lower("bsdf", "uniform", 10.0),
            lower("bsdf", "cosine", 10.0),
            Claim::Agree { a: "bsdf", b: "reference" },
        ],
    },
    Experiment {
        name: "light-sampling",
        title: "Sampling the lamp instead of the hemisphere",
        theory: "A small lamp is missed by nearly all directions of the hemisphere. Points drawn on the lamp hit it always; what is left \
                 to chance is the shadow.",
        scene: BOX,
        methods: &[
            ("uniform", "direct:sampling=uniform"),
            ("cosine", "direct:sampling=cosine"),
            ("light", "direct:sampling=light"),
        ],
        spp: 32,
        seeds: RUNS,
        reference: "direct:sampling=mis",
        claims: &[
            lower("light", "uniform", 10.0),
            lower("light", "cosine", 10.0),
            lower("cosine", "uniform", 1.0),
        ],
    },
    Experiment {
        name: "mis",
        title: "Veach's plates: each strategy, and both",
        theory: "Light samples fail on smooth plates under large lamps, BSDF samples on rough plates under small ones. Multiple importance \
                 sampling weighs each sample by how likely every strategy was to make it, and is about as good as the better one everywhere.",
        scene: PLATES,
        methods: &[
            ("light", "direct:sampling=light"),
            ("bsdf", "direct:sampling=bsdf"),
            ("mis", "direct:sampling=mis"),
        ],
        spp: 32,
        seeds: RUNS,
        reference: "direct:sampling=mis:light_samples=2:bsdf_samples=2",
        claims: &[
            lower("mis", "light", 1.0),
            lower("mis", "bsdf", 3.0),
            Claim::Agree { a: "mis", b: "reference" },
        ],
    },
    Experiment {
        name: "local-global",
        title: "Local and global illumination",
        theory: "Light straight from lamps leaves ceilings black. What surfaces pass on to each other fills the room and carries colour from \
                 wall to wall.",
        scene: BOX,
        methods: &[("local", "direct"), ("global", "path")],
        spp: 32,
        seeds: RUNS,
        reference: "path",
        claims: &[
            Claim::Brighter { a: "global", b: "local", factor: 1.1 },
            Claim::Differ { a: "global", b: "local" },
            Claim::Agree { a: "global", b: "reference" },
        ],
    },
    Experiment {
        name: "recursion",
        title: "Recursive ray tracing of two levels against path tracing",
        theory: "Many rays at every hit make a tree: most of the work is done deep down, where it matters least, while the pixel, the lens and \
                 the first hit are sampled once. At equal numbers of rays, many thin paths beat few bushy trees.",
        scene: BOX,
        methods: &[
            ("path", "path:max_depth=2:rr_depth=99"),
            ("1 ray", "recursive:max_depth=2:branching=1"),
            ("4 rays", "recursive:max_depth=2:branching=4"),
            ("16 rays", "recursive:max_depth=2:branching=16"),
        ],
        spp: 8,
        seeds: RUNS,
        reference: "path:max_depth=2",
        claims: &[
            lower("16 rays", "1 ray", 1.0),
            Claim::Lower { better: "path", worse: "16 rays", factor: 1.5, per: Per::Ray },
            Claim::Lower { better: "1 ray", worse: "16 rays", factor: 1.0, per: Per::Ray },
            Claim::Agree { a: "path", b: "16 rays" },
        ],
    },
    Experiment {
        name: "shadow-rays",
        title: "With and without shadow rays",
        theory: "A path that must find the lamp by chance does so seldom. One shadow ray at every vertex (next-event estimation) finds it each \
                 time; both estimators have the same mean.",
        scene: BOX,
        methods: &[("without", "path:shadow_rays=false"), ("with", "path:mis=false"), ("with mis", "path")],
        spp: 32,
        seeds: RUNS,
        reference: "path",
        claims: &[
            lower("with mis", "without", 10.0),
            lower("with", "without", 10.0),
            Claim::Agree { a: "with mis", b: "without" },
            independent("with mis"),
        ],
    },
    Experiment {
        name: "convergence",
        title: "Four times the samples, half the error",
        theory: "The variance of a mean of N independent samples is 1/N of one sample's, whatever the dimension; relMSE falls as 1/N, its root \
                 as 1/√N. Every unbiased method obeys.",
        scene: BOX,
        methods: &[
            ("path", "path:max_depth=2"),
            ("bdpt", "bdpt:max_depth=2"),
            ("recursive", "recursive:max_depth=2:branching=2"),
        ],
        spp: 64,
        seeds: RUNS,
        reference: "path:max_depth=2",
        claims: &[
            independent("path"),
            independent("bdpt"),
            independent("recursive"),
            Claim::Agree { a: "path", b: "bdpt" },
            Claim::Agree { a: "path", b: "recursive" },
        ],
    },
    Experiment {
        name: "subsurface",
        title: "Under the skin: light that comes out elsewhere",
        theory: "What passes the border of wax or skin wanders below, is scattered many times, and comes out somewhere else. Reflection at \
                 the surface alone leaves such things dark. A random walk under the border is the whole theory; it is the same walk from \
                 the eye and from the lamp, so that path, light and bidirectional path tracing must show one picture.",
        scene: WAX,
        methods: &[
            ("surface alone", "path:max_depth=1"),
            ("path", "path"),
            ("bdpt", "bdpt"),
            ("light", "light"),
        ],
        spp: 24,
        seeds: RUNS,
        reference: "path",
        claims: &[
            Claim::Brighter { a: "path", b: "surface alone", factor: 1.05 },
            Claim::Differ { a: "path", b: "surface alone" },
            Claim::Agree { a: "path", b: "bdpt" },
            Claim::Agree { a: "path", b: "light" },
        ],
    },
    Experiment {
        name: "caustics",
        title: "Caustics by each method",
        theory: "Light that a glass ball gathers on the floor reaches the eye over a path that next-event estimation cannot make: the last edge to \
                 the lamp is refracted. Path tracing must hit the lamp by chance. Light tracing and bidirectional path tracing start at the \
                 lamp. In the mirror the same caustic is seen over a specular-diffuse-specular path: no connection makes it, bidirectional \
                 path tracing is as noisy there as path tracing, and only density estimation samples it well.",
        scene: CAUSTIC,
        methods: &[
            ("path", "path"),
            ("light", "light"),
            ("bdpt", "bdpt"),
            ("mlt", "mlt"),
            ("photon", "photon"),
            ("sppm", "sppm"),
        ],
        spp: 48,
        seeds: 20,
        reference: "vcm",
        claims: &[
            lower("bdpt", "path", 3.0),
            lower("sppm", "path", 3.0),
            lower("sppm", "light", 1.0),
            Claim::Differ { a: "light", b: "bdpt" },
        ],
    },
    Experiment {
        name: "photon-maps",
        title: "Photon maps: blur for noise",
        theory: "The raw density of photons blurs over its radius and is blotchy; final gathering moves that error one bounce away. \
                 Progressive passes shrink the radius, so that blur vanishes as well as noise.",
        scene: BOX,
        methods: &[
            ("raw", "photon:gather=direct"),
            ("gathered", "photon:gather_rays=8"),
            ("sppm", "sppm"),
            ("fixed radius", "sppm:alpha=1"),
        ],
        spp: 12,
        seeds: RUNS,
        reference: "path",
        claims: &[lower("gathered", "raw", 1.0), Claim::Differ { a: "raw", b: "reference" }],
    },
    Experiment {
        name: "hard-light",
        title: "Light that is hard to find",
        theory: "The lamp stands behind a screen: nearly no shadow ray reaches it, and light comes over several diffuse bounces. Connecting walks \
                 from both ends helps a little; chains that stay where light was found help where nothing else does.",
        scene: ROOM,
        methods: &[("path", "path"), ("bdpt", "bdpt"), ("mlt", "mlt")],
        spp: 16,
        seeds: RUNS,
        reference: "bdpt",
        claims: &[lower("bdpt", "path", 1.5), Claim::Agree { a: "bdpt", b: "path" }],
    },
    Experiment {
        name: "virtual-lights",
        title: "Many lights: what clamping takes away",
        theory: "Instant radiosity turns light paths into virtual lamps and every pixel looks at them all. Close to one the inverse square law \
                 makes spots; clamping them loses light in corners; tracing what was clamped brings it back. All pixels of a pass see \
                 the same lamps, so there is no grain, but error that is alike everywhere.",
        scene: ROOM,
        methods: &[
            ("path", "path"),
            ("clamped", "many-light:compensation=false:clamping=0.5"),
            ("compensated", "many-light:clamping=0.5:error=0.002"),
            ("lightcuts", "many-light"),
        ],
        spp: 6,
        seeds: RUNS,
        reference: "bdpt",
        claims: &[
            lower("lightcuts", "path", 1.5),
            Claim::Differ { a: "clamped", b: "reference" },
            Claim::Agree { a: "compensated", b: "reference" },
            Claim::Brighter { a: "compensated", b: "clamped", factor: 1.02 },
        ],
    },
    Experiment {
        name: "irradiance-cache",
        title: "Irradiance is smooth: compute it seldom, interpolate",
        theory: "Light that matt walls pass on to each other changes slowly. Few places get many rays; gradients carry what they found to all \
                 pixels around them. The error that is left is no noise: more samples do not remove it.",
        scene: ROOM,
        methods: &[
            ("path", "path"),
            ("cache", "irradiance-cache"),
            ("no gradients", "irradiance-cache:gradients=false"),
        ],
        spp: 16,
        seeds: RUNS,
        reference: "bdpt",
        claims: &[lower("cache", "path", 3.0), lower("cache", "no gradients", 1.0)],
    },
    Experiment {
        name: "connection-and-merging",
        title: "Vertex connection and merging",
        theory: "Photon mapping is one more way of making paths: the eye's walk ends near where a light's walk ended. Weighed together with all \
                 connections it takes over where only it works, as for the caustic in the mirror.",
        scene: CAUSTIC,
        methods: &[("bdpt", "bdpt"), ("sppm", "sppm"), ("bpt", "vcm:mode=bpt"), ("vcm", "vcm")],
        spp: 32,
        seeds: RUNS,
        reference: "vcm",
        claims: &[lower("vcm", "bdpt", 1.5), lower("vcm", "sppm", 1.0), lower("vcm", "bpt", 1.5)],
    },
];
