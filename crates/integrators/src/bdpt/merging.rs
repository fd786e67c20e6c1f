//! Vertex merging [Georgiev2012]: photons of the pass's own light paths, gathered at the vertices of the eye's walks and
//! weighed against all other ways of making the same path.
//!
//! A photon may be seen from many eye walks, so that all paths of a pass have the same wavelengths and moment. Departs
//! from the paper: the weight is had from all densities of the path and not from three running sums, so that it is the
//! one of `bdpt`; and light paths that are connected and photons are drawn apart, which saves their surfaces' memory.
//!
//! In a medium a photon is found in a ball. The walk that is merged must scatter there, of which densities say nothing
//! (see `common::subpath`), so that its extinction coefficient, a function of the place, counts with the volume.

use rayon::prelude::{IntoParallelRefIterator, ParallelIterator};
use sampling::Sampler;
use scatter::TransportMode;
use scene::Scene;

use super::strategies::{Contribution, Joint};
use super::weight::{LightEnd, Link, Strategy};
use crate::common::{
    Emission, Kernel, Leaving, Near, Photon, PhotonMap, Photons, Place, Radius, Roulette, Shared, Site,
    Vertex, ball, disk,
};
use crate::{Counters, PassContext, Prepared};

/// What is merged with: photons of the pass.
pub(crate) struct Merging {
    pub(crate) sampler: Sampler,
    pub(crate) seed: u64,
    /// Light paths of a pass.
    pub(crate) n_photons: u64,
    /// Most vertices of one.
    pub(crate) limit: usize,
    pub(crate) roulette: Roulette,
    /// In bytes.
    pub(crate) budget: u64,
    pub(crate) radius: Radius,
    pub(crate) kernel: Kernel,
    /// Of the pass.
    pub(crate) shared: Shared,
    pub(crate) map: PhotonMap,
    /// How many photons are found at every vertex of the map's paths; see [`Link`].
    pub(crate) merges: Vec<f32>,
}

/// A photon's contribution, and whether it has its hero wavelength alone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Merged {
    pub(crate) contribution: Contribution,
    pub(crate) is_terminated: bool,
}

impl Merging {
    /// Makes the map of a pass.
    pub(crate) fn prepare(&mut self, ctx: PassContext<'_>) -> Prepared {
        self.shared = Shared::of_pass(ctx.scene, self.seed, ctx.pass);
        self.radius = self.radius.for_pass(ctx.pass);
        self.map = PhotonMap::default();
        let emission = Emission {
            scene: ctx.scene,
            sampler: &self.sampler,
            pass: ctx.pass,
            stream: 0,
            shared: self.shared,
            n_paths: self.n_photons,
            limit: self.limit,
            roulette: self.roulette,
            budget: self.budget,
        };
        let emitted = emission.run::<Photons>();
        self.map = PhotonMap::new(emitted.kept, emitted.n_paths);
        let time = ctx.scene.camera.time(self.shared.u_time);
        let merges = self.map.photons.vertices.par_iter().map(|v| match v.is_connectible() {
            true => self.expected_at(ctx.scene, v, time),
            false => 0.0,
        });
        self.merges = merges.collect();
        let counters: Counters = emitted.counters;
        Prepared { counters, warning: emitted.warning, until: 0 }
    }

    /// N π r² at a vertex, or in a medium N 4/3 π r³ σt; see [`Link`].
    pub(crate) fn expected(&self, scene: &Scene, vertex: &Vertex) -> f32 {
        let radius = self.radius.at(scene, vertex);
        let size = match &vertex.site {
            Site::Surface { .. } => disk(radius),
            Site::Medium(m) => {
                let [absorbed, scattered] = scene.media.coefficients(m.medium, m.p, &self.shared.wl);
                ball(radius) * (absorbed + scattered).average()
            }
        };
        self.map.n_paths as f32 * size
    }

    /// The same at a photon.
    fn expected_at(&self, scene: &Scene, photon: &Photon, time: f32) -> f32 {
        let size = match photon.is_in_medium() {
            true => ball(self.radius.in_medium(scene, photon.p, time)) * photon.extinction,
            false => disk(self.radius.on_surface(scene, photon.p, time)),
        };
        self.map.n_paths as f32 * size
    }
}

/// What makes a photon's density that of the eye's vertex, as seen from the vertex before: that is often as near as the photon,
/// in media, under surfaces and in corners, and weights that are not those of one path would not add up to one.
fn moved(photon: &Photon, before: &Place, to: &Vertex) -> f32 {
    if before.is_infinite {
        return 1.0;
    }
    let leaving = Leaving::Point { from: before.p, density: 1.0 };
    let ratio = leaving.density_at(&to.place()) / leaving.density_at(&photon.place());
    if ratio.is_finite() { ratio } else { 1.0 }
}

impl Joint<'_> {
    /// Photons around vertex number `i` of the eye's walk, into `near`, which is emptied first; and the radius.
    pub(crate) fn find_photons(&self, merging: &Merging, i: usize, near: &mut Vec<Near>) -> f32 {
        near.clear();
        let Some(z) = self.paths.eye.vertices.get(i).filter(|v| v.is_connectible()) else { return 0.0 };
        let radius = merging.radius.at(self.scene, z);
        merging.map.near(z, radius, near);
        radius
    }

    /// A photon within a radius of vertex number `i` of the eye's walk; `None` if it adds nothing, or if the path has
    /// more events than `depth`.
    pub(crate) fn merge(
        &mut self,
        merging: &Merging,
        (i, radius): (usize, f32),
        near: Near,
        depth: usize,
    ) -> Option<Merged> {
        let photons = &merging.map.photons;
        let photon = &photons.vertices[near.index as usize];
        let paths = self.paths;
        let z = paths.eye.vertices.get(i)?;
        // Events before, and from here to the eye.
        if photon.depth() as usize + z.events as usize > depth {
            return None;
        }
        let kernel = match photon.is_in_medium() {
            true => merging.kernel.in_ball(near.distance_squared, radius),
            false => merging.kernel.at(near.distance_squared, radius),
        };
        let share = kernel / merging.map.n_paths as f32;
        let value = z.throughput * z.gather(photon.wi) * photon.power() * share;
        if value.is_black() || !value.is_finite() {
            return None;
        }

        let origin = &photons.paths[photon.path as usize];
        let end = LightEnd { emit: origin.emit, direct: origin.direct, is_hittable: origin.is_hittable };
        let first = origin.first as usize;
        // Vertices before it and the light.
        let m = near.index as usize - first + 1;
        let before = &photons.vertices[first..][..m - 1];
        let merges = &merging.merges[first..];
        let before_z = self.eye_place(i);
        let start = Link { from_eye: origin.reverse, ..Link::default() };
        let of_light = before.iter().zip(merges).map(|(v, &merge)| Link {
            from_light: v.forward,
            from_eye: v.reverse,
            is_delta: v.is_delta(),
            merge,
            ..Link::default()
        });
        let weighting = self.weighting;
        let links = self.gather_merged(std::iter::once(start).chain(of_light), i + 2);
        let place = before.last().map_or(origin.place, |v| v.place());
        links[m].from_light = photon.forward * moved(photon, &place, z);
        links[m].is_delta = false;
        let on = z.leaving(photon.wi, z.wo(), TransportMode::Importance);
        links[m + 1].from_light = before_z.map_or(0.0, |p| on.density_at(&p));
        let back = z.leaving(z.wo(), photon.wi, TransportMode::Radiance);
        links[m - 1].from_eye = back.density_at(&place);

        let weight = weighting.weight(links, &end, Strategy::Merge(m));
        let contribution = Contribution { unweighted: value, weighted: value * weight, splat: None };
        Some(Merged { contribution, is_terminated: photon.is_terminated() })
    }
}
