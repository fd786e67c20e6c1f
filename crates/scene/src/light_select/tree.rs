//! A tree of clusters of lights, four children to a node [Conty2018], [PBR4e, sec. 12.6.3].
//!
//! Built in twos, top down, by the surface area and orientation heuristic over twelve buckets along each axis; then
//! every second level is dropped. A light is chosen by walking down, each time to a child in proportion to the
//! children's importances for the point; its probability is the product on the way back up.
//!
//! The walk uses a number of 53 bits: the 24 of `u` and, below them, a hash of `u` and the point. 24 bits alone
//! would be used up after as many levels, and lights of small probability would never be chosen.

use math::{Bounds, hash};

use super::importance::{Clusters, LANES};
use crate::lights::LightBounds;
use crate::{LightContext, LightId};

const N_BUCKETS: usize = 12;
/// Subtrees of more lights than this are built in parallel.
const PARALLEL_FROM: usize = 4096;

/// Nodes; the root is the first.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    /// Node and lane of each light; `NONE` for those outside of the tree.
    place_of: Vec<Place>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    clusters: Clusters,
    children: [Link; LANES],
    /// Where this node hangs; `NONE` for the root.
    parent: Place,
}

#[derive(Clone, Copy, Debug)]
enum Link {
    Empty,
    Leaf(LightId),
    Node(u32),
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Place {
    node: u32,
    lane: u32,
}

const NONE: Place = Place { node: u32::MAX, lane: 0 };

/// The tree in twos.
enum Binary {
    Leaf(LightId, LightBounds),
    Inner(LightBounds, Box<[Self; 2]>),
}

impl Tree {
    /// Over at least one light; `n_lights` is the number of all lights of the scene.
    pub(super) fn new(lights: &[(LightId, LightBounds)], n_lights: usize) -> Self {
        let mut tree = Self { nodes: Vec::with_capacity(lights.len() / 2), place_of: vec![NONE; n_lights] };
        tree.add(&binary(&mut lights.to_vec()), NONE);
        tree
    }

    /// Adds the subtree; gives its index.
    fn add(&mut self, binary: &Binary, parent: Place) -> u32 {
        let index = self.nodes.len() as u32;
        let children = grandchildren(binary);
        let clusters = Clusters::new(children.iter().map(|c| c.bounds()));
        self.nodes.push(Node { clusters, children: [Link::Empty; LANES], parent });
        for (lane, child) in children.into_iter().enumerate() {
            let place = Place { node: index, lane: lane as u32 };
            let link = match child {
                Binary::Leaf(light, _) => {
                    self.place_of[light.index()] = place;
                    Link::Leaf(*light)
                }
                Binary::Inner(..) => Link::Node(self.add(child, place)),
            };
            self.nodes[index as usize].children[lane] = link;
        }
        index
    }

    /// Importances of the root's children.
    pub(super) fn importances(&self, context: &LightContext) -> [f32; LANES] {
        self.nodes[0].clusters.importances(context)
    }

    /// `root` are the root's importances for the point.
    pub(super) fn select(
        &self,
        context: &LightContext,
        root: [f32; LANES],
        u: f32,
    ) -> Option<(LightId, f32)> {
        let p = context.p.0;
        let low = hash::of_floats(&[u, p.x, p.y, p.z]) >> 35;
        let mut u = f64::from(u) + low as f64 * (1.0 / (1_u64 << 53) as f64);
        let (mut node, mut importances, mut probability) = (&self.nodes[0], root, 1.0);
        loop {
            let sum: f32 = importances.iter().sum();
            if sum <= 0.0 {
                return None;
            }
            // The lane that u falls in, the last one that is not zero if rounding leads past the end.
            let mut rest = u * f64::from(sum);
            let mut lane = 0;
            for (i, &x) in importances.iter().enumerate() {
                if x > 0.0 {
                    lane = i;
                    if rest < f64::from(x) {
                        break;
                    }
                    rest -= f64::from(x);
                }
            }
            u = (rest / f64::from(importances[lane])).clamp(0.0, 1.0 - f64::EPSILON);
            probability *= importances[lane] / sum;
            match node.children[lane] {
                Link::Empty => return None,
                Link::Leaf(light) => return (probability > 0.0).then_some((light, probability)),
                Link::Node(next) => node = &self.nodes[next as usize],
            }
            importances = node.clusters.importances(context);
        }
    }

    /// `None` for lights outside of the tree.
    pub(super) fn probability(&self, context: &LightContext, light: LightId) -> Option<f32> {
        let mut place = self.place_of[light.index()];
        if place == NONE {
            return None;
        }
        let mut probability = 1.0;
        while place != NONE {
            let node = &self.nodes[place.node as usize];
            let importances = node.clusters.importances(context);
            let sum: f32 = importances.iter().sum();
            if sum <= 0.0 {
                return Some(0.0);
            }
            probability *= importances[place.lane as usize] / sum;
            place = node.parent;
        }
        Some(probability)
    }
}

impl Binary {
    fn bounds(&self) -> &LightBounds {
        match self {
            Self::Leaf(_, b) | Self::Inner(b, _) => b,
        }
    }

    fn children(&self) -> Option<&[Self; 2]> {
        match self {
            Self::Leaf(..) => None,
            Self::Inner(_, children) => Some(children),
        }
    }
}

/// Children and, for those that have some, grandchildren: at most four.
fn grandchildren(binary: &Binary) -> Vec<&Binary> {
    let Some(children) = binary.children() else { return vec![binary] };
    let mut all = Vec::with_capacity(LANES);
    for child in children {
        match child.children() {
            Some(two) => all.extend(two),
            None => all.push(child),
        }
    }
    all
}

/// The tree in twos; reorders the lights.
fn binary(lights: &mut [(LightId, LightBounds)]) -> Binary {
    if let [(light, bounds)] = lights {
        return Binary::Leaf(*light, *bounds);
    }
    let is_large = lights.len() > PARALLEL_FROM;
    let middle = split(lights);
    let (first, second) = lights.split_at_mut(middle);
    let (a, b) = if is_large {
        rayon::join(|| binary(first), || binary(second))
    } else {
        (binary(first), binary(second))
    };
    Binary::Inner(a.bounds().union(b.bounds()), Box::new([a, b]))
}

/// Orders the lights into two parts and gives the size of the first, neither empty.
fn split(lights: &mut [(LightId, LightBounds)]) -> usize {
    let centroids = lights.iter().fold(Bounds::EMPTY, |b, l| b.grow(l.1.bounds.center().0));
    let (low, size) = (centroids.min, centroids.size());
    let bucket_of = |b: &LightBounds, axis: usize| {
        let share = (b.bounds.center().0[axis] - low[axis]) / size[axis];
        ((share * N_BUCKETS as f32) as usize).min(N_BUCKETS - 1)
    };
    let all = lights.iter().fold(Bounds::EMPTY, |b, l| b.union(l.1.bounds)).size();

    // The cheapest of all borders between buckets along all axes.
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in (0..3).filter(|&a| size[a] > 0.0) {
        let mut buckets: [Option<LightBounds>; N_BUCKETS] = [None; N_BUCKETS];
        for (_, b) in &*lights {
            let bucket = &mut buckets[bucket_of(b, axis)];
            *bucket = Some(bucket.map_or(*b, |old| old.union(b)));
        }
        // Thin slices cost more.
        let regularity = all.max_element() / all[axis];
        if let Some((cost, border)) = cheapest_border(&buckets)
            && best.is_none_or(|(least, ..)| cost * regularity < least)
        {
            best = Some((cost * regularity, axis, border));
        }
    }
    if let Some((_, axis, border)) = best {
        let mut middle = 0;
        for i in 0..lights.len() {
            if bucket_of(&lights[i].1, axis) < border {
                lights.swap(i, middle);
                middle += 1;
            }
        }
        return middle;
    }

    // All in one place, or without extent: halves along the longest axis.
    let axis = (0..3).fold(0, |a, b| if size[b] > size[a] { b } else { a });
    let key = |l: &(LightId, LightBounds)| l.1.bounds.center().0[axis];
    lights.sort_by(|a, b| key(a).total_cmp(&key(b)).then(a.0.cmp(&b.0)));
    lights.len() / 2
}

/// Cost and place of the best border between buckets; both sides hold something, and not both cost nothing.
fn cheapest_border(buckets: &[Option<LightBounds>; N_BUCKETS]) -> Option<(f32, usize)> {
    let join = |a: Option<LightBounds>, b: Option<LightBounds>| match (a, b) {
        (Some(a), Some(b)) => Some(a.union(&b)),
        (a, b) => a.or(b),
    };
    // Everything from each bucket on.
    let mut after = *buckets;
    for i in (0..N_BUCKETS - 1).rev() {
        after[i] = join(buckets[i], after[i + 1]);
    }
    let mut before = None;
    let mut best: Option<(f32, usize)> = None;
    for border in 1..N_BUCKETS {
        before = join(before, buckets[border - 1]);
        let (Some(a), Some(b)) = (&before, &after[border]) else { continue };
        let cost = a.cost() + b.cost();
        if cost > 0.0 && best.is_none_or(|(least, _)| cost < least) {
            best = Some((cost, border));
        }
    }
    best
}
