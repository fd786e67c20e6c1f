//! The cheapest wide tree that a binary tree can be collapsed to, by dynamic programming [Ylitie2017].
//!
//! `C(n, i)` is the least cost of the subtree `n` as a forest of at most `i` roots:
//!
//! - `C(n, 1) = min(leaf, A(n) + min_k C(left, k) + C(right, W − k))`
//! - `C(n, i) = min(C(n, i − 1), min_k C(left, k) + C(right, i − k))`
//!
//! with the area `A(n)` in place of the chance of a visit. A subtree of `m` items has no more than `m` roots, so `k` need
//! not go beyond the items of the smaller side: for most nodes it stops at one or two.

use glam::Vec4;

use super::LeafCost;
use super::binary::{BinaryNode, Place};
use crate::layout::NODE;

/// `C(n, i + 1)` of one subtree, after as many infinities: so a slice that begins earlier is of fewer roots. The last entry
/// is not used.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Costs([f32; 2 * NODE]);

impl Costs {
    const NONE: Self = Self([f32::INFINITY; 2 * NODE]);

    /// The same for any number of roots.
    #[inline]
    fn set_flat(&mut self, cost: f32) {
        self.0[NODE..].fill(cost);
    }

    #[inline]
    fn flat(cost: f32) -> Self {
        let mut costs = Self::NONE;
        costs.set_flat(cost);
        costs
    }

    /// The cost of the whole subtree, times its area.
    pub(crate) fn total(&self) -> f32 {
        self.0[NODE]
    }
}

/// What is best for one subtree: sixteen numbers of four bits. Number `i` is of the roots given to the left child when
/// there are `i + 2`, 0 meaning: use one fewer. The last is one for a leaf.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plan(u64);

impl Plan {
    pub(crate) const NONE: Self = Self(0);
    const LEAF: u64 = 1 << 60;

    #[inline]
    pub(crate) fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// Roots of the left child of 2 to [`NODE`] in all.
    #[inline]
    pub(crate) fn left(self, roots: usize) -> usize {
        (self.0 >> (4 * (roots - 2)) & 15) as usize
    }
}

/// What a tree is made of: an item, or a tree of items.
#[derive(Clone, Copy)]
pub(crate) enum Part<'a> {
    /// Its cost.
    Item(f32),
    /// Its costs, and how many items it has.
    Tree(&'a Costs, usize),
}

impl Part<'_> {
    /// The costs of a tree that is nothing else.
    pub(crate) fn costs(self) -> Costs {
        match self {
            Self::Item(cost) => Costs::flat(cost),
            Self::Tree(costs, _) => *costs,
        }
    }
}

/// Plans all nodes, which are in preorder, and returns the costs of the whole. `leaf` knows what the tree is made of.
pub(crate) fn plan<'a>(
    nodes: &mut [BinaryNode],
    cost: &LeafCost,
    scratch: &mut Vec<Costs>,
    leaf: impl Fn(usize) -> Part<'a>,
) -> Costs {
    if scratch.len() < nodes.len() {
        scratch.resize(nodes.len(), Costs::NONE);
    }
    for at in (0..nodes.len()).rev() {
        let (until, after) = scratch.split_at_mut(at + 1);
        let part = |p: Place| match p.index() {
            item if p.is_item() => leaf(item),
            node => Part::Tree(&after[node - at - 1], nodes[node].count as usize),
        };
        let node = &nodes[at];
        let area = node.half_area();
        let as_leaf = (node.count as usize <= cost.max_items).then_some(area * cost.fixed);
        let (left, right) = (part(node.children[0]), part(node.children[1]));
        let to = &mut until[at];
        nodes[at].plan = match (left, right) {
            (Part::Item(a), Part::Item(b)) => pair(a + b, area, as_leaf, to),
            (Part::Item(a), Part::Tree(many, n)) => {
                combine([(&Costs::flat(a), 1), (many, n)], true, area, as_leaf, to)
            }
            (Part::Tree(many, n), Part::Item(b)) => {
                combine([(&Costs::flat(b), 1), (many, n)], false, area, as_leaf, to)
            }
            (Part::Tree(a, n), Part::Tree(b, m)) if n <= m => {
                combine([(a, n), (b, m)], true, area, as_leaf, to)
            }
            (Part::Tree(a, n), Part::Tree(b, m)) => combine([(b, m), (a, n)], false, area, as_leaf, to),
        };
    }
    if nodes.is_empty() { leaf(0).costs() } else { scratch[0] }
}

/// The cost of one root, and is it a leaf?
#[inline]
fn one_root(as_node: f32, as_leaf: Option<f32>) -> (f32, u64) {
    match as_leaf {
        Some(leaf) if leaf <= as_node => (leaf, Plan::LEAF),
        _ => (as_node, 0),
    }
}

/// Plans a node over two items.
fn pair(both: f32, area: f32, as_leaf: Option<f32>, to: &mut Costs) -> Plan {
    let (one, flag) = one_root(area + both, as_leaf);
    to.set_flat(one.min(both));
    to.0[NODE] = one;
    // One root goes to the left where there are two, and as the children of a node.
    Plan(flag | u64::from(both < one) | 1 << (4 * (NODE - 2)))
}

/// Plans a node over two trees of so many items, the smaller first.
fn combine(
    [few, many]: [(&Costs, usize); 2],
    is_left_smaller: bool,
    area: f32,
    as_leaf: Option<f32>,
    to: &mut Costs,
) -> Plan {
    let (best, roots_of_few) = distribute(few, many.0);
    let of_left = |roots: usize| {
        let few = roots_of_few[roots - 1] as u64;
        if is_left_smaller { few } else { roots as u64 - few }
    };
    let (one, flag) = one_root(area + best[NODE - 1], as_leaf);
    let mut plan = flag | of_left(NODE) << (4 * (NODE - 2));
    let most = (few.1 + many.1).min(NODE - 1);
    let mut least = one;
    to.0[NODE] = one;
    for roots in 2..=most {
        let c = best[roots - 1];
        plan |= if c < least { of_left(roots) << (4 * (roots - 2)) } else { 0 };
        least = if c < least { c } else { least };
        to.0[NODE + roots - 1] = least;
    }
    to.0[NODE + most..].fill(least);
    Plan(plan)
}

/// For each number of roots less one: the least cost, and how many of them are the smaller side's.
#[inline]
fn distribute((few, count): (&Costs, usize), many: &Costs) -> ([f32; NODE], [f32; NODE]) {
    let (mut best, mut roots) = ([Vec4::INFINITY; NODE / 4], [Vec4::ONE; NODE / 4]);
    for k in 1..=count.min(NODE - 1) {
        let (here, k_here) = (Vec4::splat(few.0[NODE + k - 1]), Vec4::splat(k as f32));
        let others = &many.0[NODE - k..2 * NODE - k];
        for ((best, roots), other) in best.iter_mut().zip(&mut roots).zip(others.as_chunks().0) {
            let c = here + Vec4::from_array(*other);
            *roots = Vec4::select(c.cmplt(*best), k_here, *roots);
            *best = c.min(*best);
        }
    }
    let flat = |quads: [Vec4; NODE / 4]| {
        let mut all = [0.0; NODE];
        all.as_chunks_mut().0.iter_mut().zip(quads).for_each(|(to, q)| *to = q.to_array());
        all
    };
    (flat(best), flat(roots))
}
