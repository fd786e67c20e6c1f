//! Photon mapping [Jensen1996]: photons of all lights are walked through the scene and kept where they meet surfaces
//! that are no deltas, or scatter in media [JensenChristensen1998]; then walks from the eye gather them. See [`GatherWalk`] for which path is found how.
//!
//! The map of a pass is made of the pass's own light paths, so that passes average: noise fades as with any other
//! method. The radius of the search stays the same in `photon`, and with it the bias; it shrinks in `sppm`.
//!
//! Departs from the book: maps are not balanced between caustic and global photons by projection maps; caustic photons have
//! light paths of their own instead (`caustic_photons`).

mod state;
mod walk;

use sampling::Sampler;
use scene::Scene;

pub(crate) use walk::{AtDiffuse, GatherWalk};

use crate::common::{
    Emission, Emitted, KERNEL, Keeper, Kernel, LightPath, MEDIUM_RADIUS, MEMORY, PhotonMap, Photons,
    PixelLoop, RADIUS, RADIUS_PIXELS, Radius, Roulette, Shared, sampler_of,
};
use crate::parameters::{ParameterInfo, ParameterKind, Parameters, shared};
use crate::registry::{IntegratorInfo, Making, refuses_for_light_walks, refuses_glow};
use crate::{Cell, CellOutput, Counters, Integrator, PassContext, Prepared};

/// For the registry.
pub(crate) const INFO: IntegratorInfo = IntegratorInfo {
    name: "photon",
    purpose: "photon maps with final gathering: caustics, also those seen in mirrors and through glass",
    misses: "nothing, but blurs caustics and shadows of indirect light over the radius of its search",
    unbiased: false,
    refuses: |scene| refuses_glow(scene).or_else(|| refuses_for_light_walks(scene)),
    parameters,
    make,
};

/// Parameter: light paths of a pass.
pub(crate) const PHOTONS: ParameterInfo = ParameterInfo {
    name: "photons",
    kind: ParameterKind::Integer(0),
    doc: "light paths of a pass; 0: as many as the whole film has pixels",
};

fn parameters() -> Vec<ParameterInfo> {
    vec![
        shared::MAX_DEPTH,
        shared::RR_DEPTH,
        PHOTONS,
        ParameterInfo {
            name: "caustic_photons",
            kind: ParameterKind::Integer(0),
            doc: "light paths of a pass for the caustic map; 0: as many as photons",
        },
        ParameterInfo {
            name: "gather",
            kind: ParameterKind::Choice(&["final", "direct"]),
            doc: "final: rays from the first diffuse surface gather; direct: the raw density estimate there",
        },
        ParameterInfo {
            name: "gather_rays",
            kind: ParameterKind::Integer(2),
            doc: "rays of final gathering; passes average more",
        },
        ParameterInfo {
            name: "nearest",
            kind: ParameterKind::Integer(50),
            doc: "so many nearest photons make an estimate, if the radius holds as many; 0: all within the radius",
        },
        RADIUS,
        ParameterInfo { kind: ParameterKind::Float(20.0), ..RADIUS_PIXELS },
        MEDIUM_RADIUS,
        KERNEL,
        MEMORY,
    ]
}

fn make(p: &Parameters, making: &Making<'_>) -> Box<dyn Integrator> {
    let is_raw = p.text("gather") == "direct";
    let at_diffuse = if is_raw { AtDiffuse::Raw } else { AtDiffuse::Rays(p.integer("gather_rays").max(1)) };
    let nearest = p.integer("nearest") as usize;
    let photons = Some(p.integer("caustic_photons")).filter(|n| *n > 0);
    let mut mapping = PhotonMapping::new(p, making, (at_diffuse, nearest, 1.0));
    mapping.caustic_photons = (!is_raw).then_some(photons.map_or(mapping.photons, u64::from));
    Box::new(mapping)
}

/// Photons, then walks that gather them.
pub(crate) struct PhotonMapping {
    walks: PixelLoop<GatherWalk>,
    sampler: Sampler,
    seed: u64,
    photons: u64,
    /// Light paths of a caustic map, if there is one.
    caustic_photons: Option<u64>,
    /// In bytes, for all maps.
    budget: u64,
}

/// Light paths of a pass by [`PHOTONS`].
pub(crate) fn n_photons(p: &Parameters, scene: &Scene) -> u64 {
    let [w, h] = scene.camera.resolution();
    match p.integer(PHOTONS.name) {
        0 => u64::from(w) * u64::from(h),
        n => u64::from(n),
    }
}

impl PhotonMapping {
    /// From parameters; with what is done at diffuse surfaces, the number of nearest photons, and how fast the radius shrinks.
    pub(crate) fn new(
        p: &Parameters,
        making: &Making<'_>,
        (at_diffuse, nearest, alpha): (AtDiffuse, usize, f32),
    ) -> Self {
        let sampler = sampler_of(making.sampler, making.seed);
        let estimator = GatherWalk {
            max_depth: p.limit("max_depth"),
            roulette: Roulette::from(p.integer("rr_depth")),
            at_diffuse,
            kernel: Kernel::of(p),
            radius: Radius::of(p, alpha),
            nearest,
            shared: Shared::of_pass(making.scene, making.seed, 0),
            global: PhotonMap::default(),
            caustic: None,
        };
        Self {
            walks: PixelLoop { estimator, sampler: sampler.clone() },
            sampler,
            seed: making.seed,
            photons: n_photons(p, making.scene),
            caustic_photons: None,
            budget: u64::from(p.integer(MEMORY.name)) << 20,
        }
    }

    fn emission<'a>(&'a self, ctx: PassContext<'a>) -> Emission<'a> {
        let walk = &self.walks.estimator;
        Emission {
            scene: ctx.scene,
            sampler: &self.sampler,
            pass: ctx.pass,
            stream: 0,
            shared: walk.shared,
            n_paths: self.photons,
            limit: walk.max_depth as usize,
            roulette: walk.roulette,
            budget: if self.caustic_photons.is_some() { self.budget / 2 } else { self.budget },
        }
    }
}

impl Integrator for PhotonMapping {
    fn prepares(&self) -> bool {
        true
    }

    fn prepare(&mut self, ctx: PassContext<'_>) -> Prepared {
        let walk = &mut self.walks.estimator;
        walk.shared = Shared::of_pass(ctx.scene, self.seed, ctx.pass);
        walk.radius = walk.radius.for_pass(ctx.pass);
        // The old maps go before the new ones come.
        (walk.global, walk.caustic) = (PhotonMap::default(), None);

        let emission = self.emission(ctx);
        let (global, mut prepared) = told(emission.run::<Photons>());
        let caustic = self.caustic_photons.map(|n_paths| {
            let (caustic, more) = told(Emission { n_paths, stream: 1, ..emission }.run::<Caustics>());
            prepared.counters.add(&more.counters);
            prepared.warning = prepared.warning.take().or(more.warning);
            PhotonMap::new(caustic.kept.0, caustic.n_paths)
        });
        let global = PhotonMap::new(global.kept, global.n_paths);
        let walk = &mut self.walks.estimator;
        (walk.global, walk.caustic) = (global, caustic);
        prepared
    }

    fn cell(&self, ctx: PassContext<'_>, cell: Cell, out: &mut CellOutput) {
        self.walks.cell(ctx, cell, out);
    }
}

/// What an emission did, apart.
pub(crate) fn told<K>(mut emitted: Emitted<K>) -> (Emitted<K>, Prepared) {
    let counters: Counters = emitted.counters;
    let warning = emitted.warning.take();
    (emitted, Prepared { counters, warning, until: 0 })
}

/// Keeps caustic photons alone.
#[derive(Default)]
struct Caustics(Photons);

impl Keeper for Caustics {
    fn keep(&mut self, path: &LightPath<'_>) {
        if path.walk.vertices.first().is_some_and(|v| v.is_delta) {
            self.0.keep(path);
            self.0.keep_caustic_of_last();
        }
    }

    fn bytes(&self) -> u64 {
        self.0.bytes()
    }

    fn append(&mut self, later: Self) {
        self.0.append(later.0);
    }
}
