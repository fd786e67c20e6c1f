//! Paths that no connection makes, by manifold sampling.
//!
//! Light that reaches what is under water and is seen through the water comes on paths whose every edge has a delta at one of its
//! ends: specular, diffuse, specular. No strategy makes them but (0, t) and (s, 0), which hit the lamp or the lens by chance. If
//! the chain of deltas from the last vertex that scatters to the light is one that [`Manifold`] passes, they are left to it: a class
//! of paths that anyone can tell who knows the whole path (see [`Weighting::is_left_to_manifold`]). So paths are dealt out, not
//! weighed, and nobody needs the density of Newton's method.
//!
//! [`Weighting::is_left_to_manifold`]: super::Weighting::is_left_to_manifold

use scene::LightId;
use spectrum::Spectrum;

use super::strategies::{Joint, Subpaths};
use crate::common::Vertex;
use crate::manifold::{Manifold, aims_at};

impl Subpaths {
    /// Can nothing be connected in the eye's walk up to vertex `i`, which itself can?
    fn is_closed(&self, i: usize) -> bool {
        let Some((last, walk)) = self.eye.vertices.get(..=i).and_then(<[Vertex]>::split_last) else {
            return false;
        };
        let is_delta = |v: &Vertex| v.is_delta;
        last.is_connectible()
            && walk.first().is_some_and(is_delta)
            && walk.last().is_some_and(is_delta)
            && walk.windows(2).all(|edge| edge[0].is_delta || edge[1].is_delta)
    }
}

impl Joint<'_> {
    /// Light that reaches vertex `i` of the eye's walk over a chain of `n` deltas: radiance. `None` for nothing, or for paths that
    /// others make.
    pub(crate) fn over_deltas(&mut self, manifold: &Manifold, i: usize, n: usize) -> Option<Spectrum> {
        if !self.paths.is_closed(i) {
            return None;
        }
        let z = &self.paths.eye.vertices[i];
        let found = manifold.estimate(self.scene, (z, n), self.sampler, self.wl, self.counters);
        let value = z.throughput * found.radiance(&self.wl);
        (value.is_finite() && !value.is_black()).then_some(value)
    }

    /// Is the path whose links were gathered, from this light, not for us to make?
    pub(super) fn is_left_to_manifold(&self, light: LightId) -> bool {
        self.weighting.is_left_to_manifold(self.links) && aims_at(self.scene, light)
    }
}
