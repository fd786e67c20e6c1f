//! What every integrator is: a maker of cells.

use film::{FilmTile, SplatList};
use math::Bounds2i;
use scene::Scene;

/// What a cell may read.
#[derive(Clone, Copy)]
pub struct PassContext<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Number of the pass.
    pub pass: u32,
}

/// A piece of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cell {
    /// One camera sample in every pixel of a tile. Tiles are cut on a grid that is fixed to the film.
    Tile(Bounds2i),
    /// A block of light paths: its number within the pass.
    LightBlock(u32),
}

/// What was done, for the report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Rays traced, shadow rays too.
    pub rays: u64,
    /// Camera paths started.
    pub camera_paths: u64,
    /// Light paths started.
    pub light_paths: u64,
}

impl Counters {
    /// Adds what another worker did.
    pub fn add(&mut self, other: &Self) {
        self.rays += other.rays;
        self.camera_paths += other.camera_paths;
        self.light_paths += other.light_paths;
    }
}

/// What a cell makes. Kept by a worker and used again, so that a cell allocates nothing.
pub struct CellOutput {
    /// Camera samples; for [`Cell::Tile`] it covers the tile and the filter's border around it.
    pub tile: FilmTile,
    /// What light paths leave on the film.
    pub splats: SplatList,
    /// What was done.
    pub counters: Counters,
}

/// Names of further channels that an integrator fills beside the image, such as `albedo.R`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Channels {
    /// Averaged over camera samples: every one of them is given to [`FilmTile::add_aovs`].
    pub samples: Vec<String>,
    /// Summed over a pass: what is given to [`SplatList::add_aov`].
    pub splats: Vec<String>,
}

/// What [`Integrator::prepare`] did.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Prepared {
    /// For the report.
    pub counters: Counters,
    /// Something that the person should know, such as a limit that was reached; told once, the render goes on.
    pub warning: Option<String>,
    /// Later passes up to this one, without it, read the same: preparing them would change nothing, and they may begin before the
    /// prepared one is complete.
    pub until: u32,
}

/// A light transport algorithm.
///
/// `render` calls [`Integrator::prepare`] before a pass (alone), then [`Integrator::cell`] for every cell of it from
/// many threads. Both are pure functions of scene, settings, seed and pass.
pub trait Integrator: Send + Sync {
    /// Builds what the pass reads (photon map, virtual lights, …), on the threads of the current rayon pool; what it
    /// builds must not depend on their number. Most need nothing.
    fn prepare(&mut self, ctx: PassContext<'_>) -> Prepared {
        let _ = ctx;
        Prepared::default()
    }

    /// Does a pass need [`Integrator::prepare`]? Then whole passes are the unit of work.
    fn prepares(&self) -> bool {
        false
    }

    /// For integrators that keep what [`Integrator::prepare`] learned for later passes: the round that a pass reads. Passes of one
    /// round read the same; later passes never read earlier rounds. `None` for all whose passes know nothing of each other.
    fn round(&self, ctx: PassContext<'_>) -> Option<u32> {
        let _ = ctx;
        None
    }

    /// First passes of the iterations whose pictures shall be combined by the inverse of their variance, less the first one's: see
    /// [`film::FilmSettings::iterations`]. Empty where all passes count alike, as they do for all that is unbiased.
    fn iterations(&self, scene: &Scene) -> Vec<u32> {
        let _ = scene;
        Vec::new()
    }

    /// What was learned by the last [`Integrator::prepare`], for another process of the same version.
    fn learned(&self) -> Option<Vec<u8>> {
        None
    }

    /// Takes over what [`Integrator::learned`] gave for the same scene, settings and seed, instead of learning it again: the bits
    /// are the same. False if the bytes are no such thing.
    fn take_learned(&mut self, bytes: &[u8]) -> bool {
        let _ = bytes;
        false
    }

    /// Can cells leave splats?
    fn splats(&self) -> bool {
        false
    }

    /// What its cells fill beside the image.
    fn channels(&self) -> Channels {
        Channels::default()
    }

    /// Blocks of light paths in a pass.
    fn light_blocks(&self, scene: &Scene) -> u32 {
        let _ = scene;
        0
    }

    /// Renders one cell into `out`, whose tile was made ready for it and whose splats are empty.
    fn cell(&self, ctx: PassContext<'_>, cell: Cell, out: &mut CellOutput);
}
