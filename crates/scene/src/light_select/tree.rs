//! A binary tree of clusters of lights [Conty2018], [PBR4e, sec. 12.6.3].
//!
//! Built top down by the surface area and orientation heuristic over twelve buckets along each axis. A light is
//! chosen by walking down, each time to a child in proportion to the children's importances for the point; its
//! probability is the product on the way back up.
//!
//! The walk uses a number of 53 bits: the 24 of `u` and, below them, a hash of `u` and the point. 24 bits alone
//! would be used up after as many levels, and lights of small probability would never be chosen.

use math::hash;

use super::importance::Cluster;
use crate::lights::LightBounds;
use crate::{LightContext, LightId};

const N_BUCKETS: usize = 12;

/// Nodes in depth-first order: a node's first child comes right behind it.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    /// The leaf of each light; `NONE` for those outside of the tree.
    leaf_of: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    cluster: Cluster,
    parent: u32,
    link: Link,
}

#[derive(Clone, Copy, Debug)]
enum Link {
    Leaf(LightId),
    /// Index of the second child.
    Children(u32),
}

const NONE: u32 = u32::MAX;

impl Tree {
    /// Over at least one light; `n_lights` is the number of all lights of the scene.
    pub(super) fn new(lights: &[(LightId, LightBounds)], n_lights: usize) -> Self {
        let mut tree = Self { nodes: Vec::with_capacity(2 * lights.len()), leaf_of: vec![NONE; n_lights] };
        tree.build(&mut lights.to_vec(), NONE);
        tree
    }

    /// Adds the subtree of `lights` and gives its bounds.
    fn build(&mut self, lights: &mut [(LightId, LightBounds)], parent: u32) -> LightBounds {
        let index = self.nodes.len() as u32;
        if let [(light, bounds)] = lights {
            self.leaf_of[light.index()] = index;
            self.nodes.push(Node { cluster: Cluster::new(bounds), parent, link: Link::Leaf(*light) });
            return *bounds;
        }

        // The node's own bounds are known once its children are.
        self.nodes.push(Node { cluster: Cluster::new(&lights[0].1), parent, link: Link::Children(NONE) });
        let middle = split(lights);
        let (first, second) = lights.split_at_mut(middle);
        let first = self.build(first, index);
        let second_index = self.nodes.len() as u32;
        let second = self.build(second, index);
        let bounds = first.union(&second);
        let node = &mut self.nodes[index as usize];
        (node.cluster, node.link) = (Cluster::new(&bounds), Link::Children(second_index));
        bounds
    }

    /// Of the whole tree.
    pub(super) fn importance(&self, context: &LightContext) -> f32 {
        self.nodes[0].cluster.importance(context)
    }

    pub(super) fn select(&self, context: &LightContext, u: f32) -> Option<(LightId, f32)> {
        let p = context.p.0;
        let low = hash::of_floats(&[u, p.x, p.y, p.z]) >> 35;
        let mut u = f64::from(u) + low as f64 * (1.0 / (1_u64 << 53) as f64);
        let (mut index, mut probability) = (0, 1.0);
        loop {
            let second = match self.nodes[index].link {
                Link::Leaf(light) => return (probability > 0.0).then_some((light, probability)),
                Link::Children(second) => second as usize,
            };
            let first = self.first_child_probability([index + 1, second], context)?;
            let p = f64::from(first);
            if u < p {
                u /= p;
                (index, probability) = (index + 1, probability * first);
            } else {
                u = (u - p) / (1.0 - p);
                (index, probability) = (second, probability * (1.0 - first));
            }
            u = u.min(1.0 - f64::EPSILON);
        }
    }

    /// `None` for lights outside of the tree.
    pub(super) fn probability(&self, context: &LightContext, light: LightId) -> Option<f32> {
        let mut index = self.leaf_of[light.index()];
        if index == NONE {
            return None;
        }
        let mut probability = 1.0;
        while index != 0 {
            let parent = self.nodes[index as usize].parent;
            let Link::Children(second) = self.nodes[parent as usize].link else { break };
            let children = [parent as usize + 1, second as usize];
            let Some(first) = self.first_child_probability(children, context) else { return Some(0.0) };
            probability *= if index == second { 1.0 - first } else { first };
            index = parent;
        }
        Some(probability)
    }

    /// `None` if neither child reaches the point.
    fn first_child_probability(&self, children: [usize; 2], context: &LightContext) -> Option<f32> {
        let [a, b] = children.map(|i| self.nodes[i].cluster.importance(context));
        (a + b > 0.0).then(|| a / (a + b))
    }
}

/// Orders the lights into two parts and gives the size of the first, neither empty.
fn split(lights: &mut [(LightId, LightBounds)]) -> usize {
    let all = bounds_of(lights);
    let centroids = lights.iter().fold(math::Bounds::EMPTY, |b, l| b.grow(l.1.bounds.center().0));
    let (low, size) = (centroids.min, centroids.size());
    let bucket_of = |b: &LightBounds, axis: usize| {
        let share = (b.bounds.center().0[axis] - low[axis]) / size[axis];
        ((share * N_BUCKETS as f32) as usize).min(N_BUCKETS - 1)
    };

    // The cheapest of all borders between buckets along all axes.
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in 0..3 {
        if size[axis] <= 0.0 {
            continue;
        }
        let mut buckets: [Option<LightBounds>; N_BUCKETS] = [None; N_BUCKETS];
        for (_, b) in &*lights {
            let bucket = &mut buckets[bucket_of(b, axis)];
            *bucket = Some(bucket.map_or(*b, |old| old.union(b)));
        }
        let regularity = size_ratio(&all, axis);
        for border in 1..N_BUCKETS {
            let join =
                |part: &[Option<LightBounds>]| part.iter().flatten().copied().reduce(|a, b| a.union(&b));
            let (Some(a), Some(b)) = (join(&buckets[..border]), join(&buckets[border..])) else { continue };
            let cost = regularity * (a.cost() + b.cost());
            if cost > 0.0 && best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, border));
            }
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

fn bounds_of(lights: &[(LightId, LightBounds)]) -> math::Bounds {
    lights.iter().fold(math::Bounds::EMPTY, |b, l| b.union(l.1.bounds))
}

/// Longest side over the side along `axis`: thin slices cost more.
fn size_ratio(b: &math::Bounds, axis: usize) -> f32 {
    let size = b.size();
    size.max_element() / size[axis].max(f32::MIN_POSITIVE)
}
