//! Lightcuts [Walter2005]: a tree of clusters of lights, each with a representative; a cut through it stands for all.
//!
//! A cut begins with the root. As long as the bound on some cluster's error is above a share of the whole, the cluster
//! with the largest bound is replaced by its children, one of which has the same representative and needs no new ray.
//!
//! A cluster's error is at most what all its lights would give from the best place, seen in full:
//!
//! `f_max · cos_max · cos'_max · min(1 / d_min², bound) · Σ intensity`,
//!
//! with the greatest cosines over the sphere around the cluster's box, and of its cone of normals.
//!
//! Departs from the paper: a representative is chosen in proportion to intensity and counts by one over its
//! probability, in its own colour, so that clusters are right on average over passes; the tree is built from the top, by
//! medians of places and normals. Left out: lights that really emit, which the tree of [`scene::LightSelector`] chooses from.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use math::hash::{combine, unit_f32};
use math::{Bounds, Dir, Point, Vec3, trig};
use scatter::{LobeFlags, TransportMode};
use spectrum::Spectrum;

use super::lights::{Receiver, VirtualLight, most_f};
use crate::common::{Gathered, Tools};

/// Of the tree.
pub(super) const BYTES_PER_LIGHT: usize = 2 * size_of::<Node>();

/// A cluster: a light, or two clusters.
#[derive(Clone, Copy, Debug)]
struct Node {
    center: Point,
    /// Of the sphere around all lights.
    radius: f32,
    /// Of the cone of normals.
    axis: Dir,
    cos_cone: f32,
    /// Sum over the lights.
    intensity: f32,
    /// Index of a light.
    representative: u32,
    /// The representative's intensity over the sum.
    probability: f32,
    /// Index of the second child; the first one follows the node. Zero: a leaf.
    second: u32,
}

/// What cuts are made of.
#[derive(Debug, Default)]
pub(super) struct LightTree {
    nodes: Vec<Node>,
}

/// How fine cuts are.
#[derive(Clone, Copy, Debug)]
pub(super) struct CutRules {
    /// Allowed bound on a cluster's error, as a share of the whole.
    pub(super) error: f32,
    /// Most clusters.
    pub(super) most: usize,
}

/// A cluster in a cut.
struct InCut {
    bound: f32,
    node: u32,
    /// Light of the representative, without what it stands for.
    shown: Spectrum,
}

/// A light that the tree is built of.
#[derive(Clone, Copy)]
struct Placed {
    light: u32,
    p: Vec3,
    /// `None`: shines to both sides.
    n: Option<Dir>,
    intensity: f32,
}

impl LightTree {
    /// Over the lights that are wanted; `key` chooses representatives.
    pub(super) fn new(lights: &[VirtualLight], key: u64, is_wanted: impl Fn(&VirtualLight) -> bool) -> Self {
        let wanted = lights.iter().zip(0..).filter(|(l, _)| is_wanted(l));
        let mut placed: Vec<Placed> = wanted.map(|(l, light)| Placed::new(l, light)).collect();
        let mut tree = Self { nodes: Vec::with_capacity(2 * placed.len()) };
        let bounds = placed.iter().fold(Bounds::EMPTY, |b, l| b.grow(l.p));
        // Opposite normals are as far apart as places at half of the scene's diagonal.
        let normal_scale = 0.25 * bounds.size().length();
        if !placed.is_empty() {
            tree.add(&mut placed, normal_scale, key);
        }
        tree
    }

    fn add(&mut self, lights: &mut [Placed], normal_scale: f32, key: u64) -> u32 {
        let index = self.nodes.len() as u32;
        self.nodes.push(Node::around(lights));
        if lights.len() > 1 {
            halve(lights, normal_scale);
            let (left, right) = lights.split_at_mut(lights.len() / 2);
            let first = self.add(left, normal_scale, key);
            let second = self.add(right, normal_scale, key);
            let [a, b] = [first, second].map(|i| self.nodes[i as usize]);
            let sum = a.intensity + b.intensity;
            let u = unit_f32((combine(key, u64::from(index)) >> 32) as u32);
            let chosen = if u * sum < a.intensity { a } else { b };
            let node = &mut self.nodes[index as usize];
            node.intensity = sum;
            node.representative = chosen.representative;
            node.probability = chosen.probability * (chosen.intensity / sum);
            node.second = second;
        }
        index
    }

    /// What the receiver sends on of all lights of the tree, times the number of paths; and the size of the cut.
    pub(super) fn gather(
        &self,
        receiver: &Receiver<'_>,
        lights: &[VirtualLight],
        rules: &CutRules,
        tools: &mut Tools<'_>,
    ) -> (Gathered, usize) {
        let mut sum = Gathered::default();
        if self.nodes.is_empty() {
            return (sum, 0);
        }
        let receiving = Receiving::new(receiver);
        let mut enter = |node: u32, shown: Option<Spectrum>| {
            let n = &self.nodes[node as usize];
            let shown =
                shown.unwrap_or_else(|| receiver.reflected(&lights[n.representative as usize], tools));
            let size = f64::from(shown.max_component() / n.probability);
            (InCut { bound: receiving.bound(n), node, shown }, size)
        };
        let mut cut: BinaryHeap<InCut> = BinaryHeap::with_capacity(256);
        let (root, mut whole) = enter(0, None);
        cut.push(root);
        while cut.len() < rules.most {
            let Some(top) = cut.peek().filter(|top| f64::from(top.bound) > f64::from(rules.error) * whole)
            else {
                break;
            };
            let InCut { node, shown, .. } = *top;
            cut.pop();
            let parent = &self.nodes[node as usize];
            whole -= f64::from(shown.max_component() / parent.probability);
            for child in [node + 1, parent.second] {
                let is_same = self.nodes[child as usize].representative == parent.representative;
                let (entry, size) = enter(child, is_same.then_some(shown));
                whole += size;
                cut.push(entry);
            }
        }
        for entry in &cut {
            let node = &self.nodes[entry.node as usize];
            let light = &lights[node.representative as usize];
            sum.add(entry.shown * (1.0 / node.probability), light.is_terminated);
        }
        (sum, cut.len())
    }
}

/// What the bound needs to know of a receiver.
struct Receiving {
    p: Point,
    /// On the side of `wo`.
    n: Dir,
    both_sides: bool,
    most_f: f32,
    most_g: f32,
}

impl Receiving {
    fn new(receiver: &Receiver<'_>) -> Self {
        let Receiver { si, shading, bound, .. } = receiver;
        Self {
            p: si.p,
            n: shading.frame.n.face_forward(si.wo),
            both_sides: shading.bsdf.flags().intersects(LobeFlags::TRANSMISSION),
            most_f: most_f(shading, si.wo, TransportMode::Radiance).max_component(),
            most_g: bound.most,
        }
    }

    /// The most that the cluster's light may be wrong by. A single light is right.
    fn bound(&self, node: &Node) -> f32 {
        if node.second == 0 || self.most_f <= 0.0 {
            return 0.0;
        }
        let d = node.center - self.p;
        let distance = d.length();
        let nearest = distance - node.radius;
        if nearest <= 0.0 {
            return self.most_f * self.most_g * node.intensity;
        }
        let sin_b = node.radius / distance;
        let cos_b = trig::safe_sqrt(1.0 - sin_b * sin_b);
        let to_light = d / distance;

        let cos = self.n.0.dot(to_light);
        let cos = if self.both_sides { cos.abs() } else { cos };
        let received = cos_difference(cos, (sin_b, cos_b));

        let sin_cone = trig::safe_sqrt(1.0 - node.cos_cone * node.cos_cone);
        let to_cone = match node.cos_cone <= -1.0 {
            true => 1.0,
            false => cos_difference(-node.axis.0.dot(to_light), (sin_cone, node.cos_cone)),
        };
        let sent = cos_difference(to_cone, (sin_b, cos_b));

        let g = received.max(0.0) * sent.max(0.0) / (nearest * nearest);
        self.most_f * g.min(self.most_g) * node.intensity
    }
}

/// cos(max(0, a − b)) by the cosine of a and sine and cosine of b.
fn cos_difference(cos_a: f32, (sin_b, cos_b): (f32, f32)) -> f32 {
    if cos_a >= cos_b { 1.0 } else { cos_a * cos_b + trig::safe_sqrt(1.0 - cos_a * cos_a) * sin_b }
}

impl Placed {
    fn new(light: &VirtualLight, index: u32) -> Self {
        let both_sides = light.shading.bsdf.flags().intersects(LobeFlags::TRANSMISSION);
        Self {
            light: index,
            p: light.si.p.0,
            n: (!both_sides).then(|| light.si.ng.face_forward(light.si.wo)),
            intensity: light.intensity(),
        }
    }
}

impl Node {
    /// A leaf, or what surrounds several lights.
    fn around(lights: &[Placed]) -> Self {
        let bounds = lights.iter().fold(Bounds::EMPTY, |b, l| b.grow(l.p));
        let sum: Vec3 = lights.iter().filter_map(|l| l.n).map(|n| n.0).sum();
        let cone = sum.try_normalize().filter(|_| lights.iter().all(|l| l.n.is_some())).map(|axis| {
            let cosines = lights.iter().filter_map(|l| l.n).map(|n| n.0.dot(axis));
            (Dir(axis), cosines.fold(1.0, f32::min))
        });
        let (axis, cos_cone) = cone.unwrap_or((Dir::Z, -1.0));
        Self {
            center: bounds.center(),
            // With room for rounding.
            radius: 0.5001 * bounds.size().length(),
            axis,
            cos_cone,
            intensity: lights[0].intensity,
            representative: lights[0].light,
            probability: 1.0,
            second: 0,
        }
    }
}

/// Orders lights so that halves differ in what they differ in most: a coordinate, or one of their normals.
fn halve(lights: &mut [Placed], normal_scale: f32) {
    let key = |l: &Placed, axis: usize| match axis {
        0..3 => l.p[axis],
        _ => l.n.map_or(0.0, |n| n.0[axis - 3]) * normal_scale,
    };
    let extent = |axis: usize| {
        let (low, high) = lights.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), l| {
            (low.min(key(l, axis)), high.max(key(l, axis)))
        });
        high - low
    };
    let extents = [0, 1, 2, 3, 4, 5].map(extent);
    let axis = (1..6).fold(0, |a, b| if extents[b] > extents[a] { b } else { a });
    let middle = lights.len() / 2;
    let order = |a: &Placed, b: &Placed| key(a, axis).total_cmp(&key(b, axis)).then(a.light.cmp(&b.light));
    lights.select_nth_unstable_by(middle, order);
}

impl Ord for InCut {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound.total_cmp(&other.bound).then(other.node.cmp(&self.node))
    }
}

impl PartialOrd for InCut {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for InCut {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for InCut {}
