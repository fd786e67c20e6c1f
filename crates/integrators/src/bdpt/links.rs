//! The links of a path: what its weights are had from, gathered from the walks that made it.

use math::Dir;
use scatter::TransportMode;

use super::strategies::{Joint, Subpaths};
use super::weight::Link;
use crate::common::{Leaving, Place, Vertex};
use crate::manifold;

impl Joint<'_> {
    /// The links of a path of the first `s` vertices of the light's walk, or of `first` alone, and the first `t` of the
    /// eye's, as far as the walks know them.
    pub(super) fn gather(&mut self, s: usize, first: Option<Link>, t: usize) -> &mut Vec<Link> {
        let over = |v: &Vertex| self.weighting.manifold > 0 && v.is_delta && manifold::passes(self.scene, v);
        let Subpaths { light, light_merges, .. } = self.paths;
        let links = &mut *self.links;
        links.clear();
        links.extend(first);
        if s > 0 {
            links.push(Link { from_eye: light.start_reverse, ..Link::default() });
        }
        let of_light = |(i, v): (usize, &Vertex)| Link {
            from_light: v.forward,
            from_eye: v.reverse,
            is_delta: v.is_delta,
            merge: light_merges.get(i).copied().unwrap_or(0.0),
            is_passable: over(v),
        };
        links.extend(light.vertices.iter().enumerate().take(s.saturating_sub(1)).map(of_light));
        self.add_eye_links(t)
    }

    /// The links of a photon's path before it, and of the first `t` vertices of the eye's walk.
    pub(super) fn gather_merged(&mut self, before: impl Iterator<Item = Link>, t: usize) -> &mut Vec<Link> {
        self.links.clear();
        self.links.extend(before);
        self.add_eye_links(t)
    }

    fn add_eye_links(&mut self, t: usize) -> &mut Vec<Link> {
        let over = |v: &Vertex| self.weighting.manifold > 0 && v.is_delta && manifold::passes(self.scene, v);
        let Subpaths { eye, eye_start, eye_merges, .. } = self.paths;
        let links = &mut *self.links;
        let of_eye = |(i, v): (usize, &Vertex)| Link {
            from_light: v.reverse,
            from_eye: v.forward,
            is_delta: v.is_delta,
            merge: eye_merges.get(i).copied().unwrap_or(0.0),
            is_passable: over(v),
        };
        links.extend(eye.vertices[..t.saturating_sub(1)].iter().enumerate().rev().map(of_eye));
        if t > 0 {
            let position = eye_start.map_or(1.0, |c| c.position);
            links.push(Link { from_light: eye.start_reverse, from_eye: position, ..Link::default() });
        }
        links
    }
}

/// Sets the four densities that depend on the edge from `y`, vertex s − 1 of the path, along `w` to `z`, vertex s.
pub(super) fn join(
    links: &mut [Link],
    s: usize,
    y: &Vertex,
    z: &Vertex,
    (w, before_y, before_z): (Dir, Option<Place>, Option<Place>),
) {
    let at = |leaving: Leaving, place: Option<Place>| place.map_or(0.0, |p| leaving.density_at(&p));
    links[s].from_light = at(y.leaving(y.wo(), w, TransportMode::Importance), Some(z.place()));
    links[s + 1].from_light = at(z.leaving(-w, z.wo(), TransportMode::Importance), before_z);
    links[s - 1].from_eye = at(z.leaving(z.wo(), -w, TransportMode::Radiance), Some(y.place()));
    links[s - 2].from_eye = at(y.leaving(w, y.wo(), TransportMode::Radiance), before_y);
    links[s - 1].is_delta = false;
    links[s].is_delta = false;
}
