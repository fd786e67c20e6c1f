//! Light paths that are kept: the one emission routine, the record of a vertex, and the map of all of a pass.
//!
//! Paths are walked in blocks of fixed size on the threads of the current pool, and put together in the order of
//! their numbers: what a pass keeps is a function of scene, seed and pass alone. What a pass keeps is limited by a budget of memory:
//! blocks that would not fit are left out, and the paths that count are those of the blocks that did.
//!
//! Vertices on surfaces and in media are searched apart, since they are of other dimensions. What lies under surfaces is
//! found by nobody.
//!
//! A vertex takes 72 bytes, its place in the search tree 17, and a path 52: with three vertices kept, about 320
//! bytes a path.

use std::collections::BinaryHeap;

use math::{Dir, Point};
use rayon::prelude::{IntoParallelIterator, ParallelIterator};
use sampling::Sampler;
use scatter::TransportMode;
use scene::Scene;
use spectrum::{Spectrum, Wavelengths};

use super::{
    LightStart, Near, Neighbours, Place, Roulette, Shared, Site, Subpath, Vertex, Walk, direct_density,
};
use crate::Counters;
use crate::parameters::{ParameterInfo, ParameterKind};

/// Parameter: see [`Emission::budget`].
pub(crate) const MEMORY: ParameterInfo = ParameterInfo {
    name: "photon_memory",
    kind: ParameterKind::Integer(1024),
    doc: "most MiB for what a pass keeps of its light paths (about 320 bytes a path); what does not fit is left out",
};

/// Light paths of a block.
const BLOCK: u64 = 4096;

/// Blocks that are walked before it is asked what fits: a number of its own, not the threads', so that it does not matter
/// how many there are.
const WAVE: u64 = 64;

/// What shall be emitted.
#[derive(Clone, Copy)]
pub(crate) struct Emission<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) sampler: &'a Sampler,
    pub(crate) pass: u32,
    /// Keeps several emissions of a pass apart.
    pub(crate) stream: u32,
    /// Wavelengths and moment, for all paths the same.
    pub(crate) shared: Shared,
    pub(crate) n_paths: u64,
    /// Most vertices of a path.
    pub(crate) limit: usize,
    pub(crate) roulette: Roulette,
    /// Bytes that may be kept (at least one block is).
    pub(crate) budget: u64,
}

/// A light path, as it is offered to be kept.
pub(crate) struct LightPath<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) start: &'a LightStart,
    pub(crate) walk: &'a Subpath,
    /// With dispersion, secondary wavelengths may have ended on the way.
    pub(crate) wl: &'a Wavelengths,
}

/// What is kept of light paths.
pub(crate) trait Keeper: Default + Send {
    /// Keeps what it wants of the next path.
    fn keep(&mut self, path: &LightPath<'_>);
    /// Bytes of what it has.
    fn bytes(&self) -> u64;
    /// Adds what was kept of later paths.
    fn append(&mut self, later: Self);
}

/// What was kept, and of how many paths.
pub(crate) struct Emitted<K> {
    pub(crate) kept: K,
    /// What to divide by.
    pub(crate) n_paths: u64,
    pub(crate) counters: Counters,
    /// What the person should know: the budget was reached.
    pub(crate) warning: Option<String>,
}

impl Emission<'_> {
    /// Walks all paths and keeps what `K` keeps of them.
    pub(crate) fn run<K: Keeper>(&self) -> Emitted<K> {
        let n_blocks = self.n_paths.div_ceil(BLOCK);
        let mut all =
            Emitted { kept: K::default(), n_paths: 0, counters: Counters::default(), warning: None };
        for wave in 0..n_blocks.div_ceil(WAVE) {
            let blocks = wave * WAVE..((wave + 1) * WAVE).min(n_blocks);
            let done: Vec<(K, Counters)> = blocks.clone().into_par_iter().map(|b| self.block(b)).collect();
            for (block, (kept, counters)) in blocks.zip(done) {
                all.counters.add(&counters);
                if block > 0 && all.kept.bytes() + kept.bytes() > self.budget {
                    all.warning = Some(self.short_of_memory(all.n_paths));
                    return all;
                }
                all.kept.append(kept);
                all.n_paths = ((block + 1) * BLOCK).min(self.n_paths);
            }
        }
        all
    }

    fn block<K: Keeper>(&self, block: u64) -> (K, Counters) {
        let (mut kept, mut counters) = (K::default(), Counters::default());
        let (mut sampler, mut walk) = (self.sampler.clone(), Subpath::default());
        let scene = self.scene;
        let rules =
            Walk { scene, mode: TransportMode::Importance, limit: self.limit, roulette: self.roulette };
        let time = scene.camera.time(self.shared.u_time);
        for i in block * BLOCK..((block + 1) * BLOCK).min(self.n_paths) {
            sampler.start_path(u64::from(self.stream) << 32 | i, self.pass);
            counters.light_paths += 1;
            let mut wl = self.shared.wl;
            let Some(start) = LightStart::sample(scene, time, &wl, &mut sampler) else { continue };
            rules.run(&start.start, &mut sampler, &mut wl, &mut counters, &mut walk);
            kept.keep(&LightPath { scene, start: &start, walk: &walk, wl: &wl });
        }
        (kept, counters)
    }

    fn short_of_memory(&self, kept: u64) -> String {
        format!(
            "photon_memory is reached: a pass keeps {kept} of {} light paths within {} MiB; \
             set photon_memory higher, or fewer light paths",
            self.n_paths,
            self.budget >> 20
        )
    }
}

/// A vertex of a light path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Photon {
    pub(crate) p: Point,
    /// Geometric normal; of no meaning in a medium.
    ng: Dir,
    /// Back to where the light came from.
    pub(crate) wi: Dir,
    /// What the path carries here, over its density: the photon's power times the number of paths. In a medium over its
    /// scattering coefficient: so a density is one of radiance over the sphere.
    power: [f32; 4],
    /// In a medium its extinction coefficient, as a mean over the lanes; zero on surfaces.
    pub(crate) extinction: f32,
    /// See [`Vertex`].
    pub(crate) forward: f32,
    /// See [`Vertex`].
    pub(crate) reverse: f32,
    /// Of [`PhotonMap::paths`].
    pub(crate) path: u32,
    /// Scattering events of its path before it, and flags.
    depth: u16,
    flags: u16,
}

/// The path leaves it by a delta lobe.
const DELTA: u16 = 1;
/// Its surface has delta lobes alone: nothing can be gathered here.
const HIDDEN: u16 = 2;
/// The path carries its hero wavelength alone.
const TERMINATED: u16 = 4;
/// All vertices before it, and there are some, were left by delta lobes.
const CAUSTIC: u16 = 8;
/// It is in a medium.
const MEDIUM: u16 = 16;

impl Photon {
    fn new(scene: &Scene, v: &Vertex, path: u32, is_caustic: bool, wl: &Wavelengths) -> Self {
        let flag = |is: bool, flag: u16| if is { flag } else { 0 };
        let (power, extinction) = match &v.site {
            Site::Surface { .. } => (v.throughput, 0.0),
            Site::Medium(m) => {
                let [absorbed, scattered] = scene.media.coefficients(m.medium, m.p, wl);
                (over(v.throughput, scattered), (absorbed + scattered).average())
            }
        };
        Self {
            p: v.p(),
            ng: v.place().n.unwrap_or(v.wo()),
            wi: v.wo(),
            power: power.lanes(),
            extinction,
            forward: v.forward,
            reverse: v.reverse,
            path,
            depth: u16::try_from(v.events.saturating_sub(1)).unwrap_or(u16::MAX),
            flags: flag(v.surface().is_none(), MEDIUM)
                | flag(v.is_delta, DELTA)
                | flag(!v.is_connectible(), HIDDEN)
                | flag(wl.is_terminated(), TERMINATED)
                | flag(is_caustic, CAUSTIC),
        }
    }

    /// The photon's power times the number of paths.
    pub(crate) fn power(&self) -> Spectrum {
        Spectrum::from_lanes(self.power)
    }

    /// Scattering events before this one.
    pub(crate) fn depth(&self) -> u32 {
        u32::from(self.depth)
    }

    /// Did the path leave it by a delta lobe?
    pub(crate) fn is_delta(&self) -> bool {
        self.flags & DELTA != 0
    }

    /// Is it of a surface that scatters by more than deltas?
    pub(crate) fn is_connectible(&self) -> bool {
        self.flags & HIDDEN == 0
    }

    /// Does it carry its hero wavelength alone?
    pub(crate) fn is_terminated(&self) -> bool {
        self.flags & TERMINATED != 0
    }

    /// Did it come from the light over delta lobes alone, and at least one?
    pub(crate) fn is_caustic(&self) -> bool {
        self.flags & CAUSTIC != 0
    }

    /// Is it in a medium?
    pub(crate) fn is_in_medium(&self) -> bool {
        self.flags & MEDIUM != 0
    }

    pub(crate) fn place(&self) -> Place {
        if self.is_in_medium() { Place::in_medium(self.p) } else { Place::on_surface(self.p, self.ng) }
    }
}

/// Lane by lane; nothing over nothing is nothing.
fn over(a: Spectrum, b: Spectrum) -> Spectrum {
    let (a, b) = (a.lanes(), b.lanes());
    Spectrum::from_lanes([0, 1, 2, 3].map(|i| if b[i] > 0.0 { a[i] / b[i] } else { 0.0 }))
}

/// The start of a light path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Origin {
    pub(crate) place: Place,
    /// Can a ray find the light?
    pub(crate) is_hittable: bool,
    /// Density of the start; see [`LightStart`].
    pub(crate) emit: f32,
    /// Density of next-event estimation from the first vertex to the start.
    pub(crate) direct: f32,
    /// Density with which a walk from the other end finds it.
    pub(crate) reverse: f32,
    /// Of its vertices, which follow each other, the first.
    pub(crate) first: u32,
}

/// Whole light paths, in the order of their numbers.
#[derive(Debug, Default)]
pub(crate) struct Photons {
    pub(crate) vertices: Vec<Photon>,
    pub(crate) paths: Vec<Origin>,
}

impl Photons {
    /// Of the last path, keeps caustic photons on surfaces alone.
    pub(crate) fn keep_caustic_of_last(&mut self) {
        if let Some(last) = self.paths.last() {
            let first = last.first as usize;
            let mut kept = first;
            for i in first..self.vertices.len() {
                let photon = &self.vertices[i];
                if photon.is_caustic() && photon.is_connectible() && !photon.is_in_medium() {
                    self.vertices[kept] = self.vertices[i];
                    kept += 1;
                }
            }
            self.vertices.truncate(kept);
            if kept == first {
                self.paths.pop();
            }
        }
    }
}

impl Keeper for Photons {
    fn keep(&mut self, path: &LightPath<'_>) {
        let LightPath { scene, start, walk, wl } = path;
        let Some(v) = walk.vertices.first() else { return };
        let number = self.paths.len() as u32;
        self.paths.push(Origin {
            place: start.start.place,
            is_hittable: !scene.lights.is_delta(start.light),
            emit: start.emit,
            direct: direct_density(scene, &v.light_context(), start.light, &start.start.place, v.wo()),
            reverse: walk.start_reverse,
            first: self.vertices.len() as u32,
        });
        let mut deltas_before = true;
        for (depth, v) in walk.vertices.iter().enumerate() {
            self.vertices.push(Photon::new(scene, v, number, depth > 0 && deltas_before, wl));
            deltas_before &= v.is_delta;
        }
    }

    fn bytes(&self) -> u64 {
        // A place in the tree is 16 bytes and an eighth of 8.
        (self.vertices.len() * (size_of::<Photon>() + 17) + self.paths.len() * size_of::<Origin>()) as u64
    }

    fn append(&mut self, later: Self) {
        let (first, number) = (self.vertices.len() as u32, self.paths.len() as u32);
        self.paths.extend(later.paths.into_iter().map(|p| Origin { first: p.first + first, ..p }));
        self.vertices.extend(later.vertices.into_iter().map(|v| Photon { path: v.path + number, ..v }));
    }
}

/// The light paths of a pass, with a search for the vertices that are no deltas.
#[derive(Debug, Default)]
pub(crate) struct PhotonMap {
    pub(crate) photons: Photons,
    on_surfaces: Neighbours,
    in_media: Neighbours,
    /// How many paths were emitted: what [`Photon::power`] is to be divided by.
    pub(crate) n_paths: u64,
}

impl PhotonMap {
    /// Uses the threads of the current pool.
    pub(crate) fn new(photons: Photons, n_paths: u64) -> Self {
        let tree = |in_medium: bool| {
            let all = photons.vertices.iter().zip(0..);
            let wanted = all.filter(|(v, _)| v.is_connectible() && v.is_in_medium() == in_medium);
            Neighbours::build(wanted.map(|(v, i)| (v.p, i)))
        };
        let (on_surfaces, in_media) = (tree(false), tree(true));
        Self { photons, on_surfaces, in_media, n_paths }
    }

    fn tree_of(&self, at: &Vertex) -> &Neighbours {
        if at.surface().is_some() { &self.on_surfaces } else { &self.in_media }
    }

    /// Calls `visit` with every photon within `radius`, on a surface or in a medium as the vertex is, and with the square
    /// of its distance.
    pub(crate) fn within(&self, at: &Vertex, radius: f32, mut visit: impl FnMut(&Photon, f32)) {
        self.tree_of(at).within(at.p(), radius, |near| {
            visit(&self.photons.vertices[near.index as usize], near.distance_squared);
        });
    }

    /// Every such photon, into `found`, which keeps what it has.
    pub(crate) fn near(&self, at: &Vertex, radius: f32, found: &mut Vec<Near>) {
        self.tree_of(at).within(at.p(), radius, |near| found.push(near));
    }

    /// The `k` nearest of them within `radius`; see [`Neighbours::nearest`].
    pub(crate) fn nearest(&self, at: &Vertex, k: usize, radius: f32, found: &mut BinaryHeap<Near>) {
        self.tree_of(at).nearest(at.p(), k, radius, found);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_photon_costs_what_is_said() {
        let bytes = [size_of::<Photon>() + 17, size_of::<Origin>()];
        assert_eq!(bytes, [89, 52], "what the head, the parameter's text and docs/performance.md say");
    }
}
