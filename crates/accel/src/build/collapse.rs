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

/// `C(n, i + 1)` of one subtree; the last entry is not used.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Costs([f32; NODE]);

impl Costs {
    pub(crate) const NONE: Self = Self([0.0; NODE]);

    /// The same for any number of roots: a single item.
    #[inline]
    pub(crate) fn flat(cost: f32) -> Self {
        Self([cost; NODE])
    }

    /// The cost of the whole subtree, times its area.
    pub(crate) fn total(&self) -> f32 {
        self.0[0]
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

/// Plans all nodes, which are in preorder, and returns the costs of the whole. `leaf` knows those of the items.
pub(crate) fn plan(
    nodes: &mut [BinaryNode],
    cost: &LeafCost,
    scratch: &mut Vec<Costs>,
    leaf: impl Fn(usize) -> Side,
) -> Costs {
    scratch.clear();
    scratch.resize(nodes.len(), Costs::NONE);
    for at in (0..nodes.len()).rev() {
        let node = &nodes[at];
        let side = |p: Place| match p.index() {
            item if p.is_item() => leaf(item),
            node => Side { costs: scratch[node], count: nodes[node].count as usize },
        };
        let sides = node.children.map(side);
        let area = node.half_area();
        let as_leaf = (node.count as usize <= cost.max_items).then_some(area * cost.fixed);
        (scratch[at], nodes[at].plan) = combine(&sides, area, as_leaf);
    }
    scratch.first().copied().unwrap_or_else(|| leaf(0).costs)
}

/// One child.
pub(crate) struct Side {
    pub(crate) costs: Costs,
    /// Items.
    pub(crate) count: usize,
}

fn combine(sides: &[Side; 2], area: f32, leaf: Option<f32>) -> (Costs, Plan) {
    let [left, right] = sides;
    let is_left_smaller = left.count <= right.count;
    let (few, many) = if is_left_smaller { (left, right) } else { (right, left) };
    let (best, roots_of_few) = distribute(few, many);
    let of_left = |roots: usize| {
        let few = roots_of_few[roots - 1] as u64;
        if is_left_smaller { few } else { roots as u64 - few }
    };
    let mut costs = [0.0; NODE];
    let mut plan = of_left(NODE) << (4 * (NODE - 2));
    costs[0] = area + best[NODE - 1];
    if let Some(leaf) = leaf
        && leaf <= costs[0]
    {
        costs[0] = leaf;
        plan |= Plan::LEAF;
    }
    let most = (left.count + right.count).min(NODE - 1);
    for roots in 2..=most {
        let (c, fewer) = (best[roots - 1], costs[roots - 2]);
        costs[roots - 1] = if c < fewer { c } else { fewer };
        plan |= if c < fewer { of_left(roots) << (4 * (roots - 2)) } else { 0 };
    }
    let last = costs[most - 1];
    costs[most..].fill(last);
    (Costs(costs), Plan(plan))
}

/// For each number of roots less one: the least cost, and how many of them are the smaller side's.
#[inline]
fn distribute(few: &Side, many: &Side) -> ([f32; NODE], [f32; NODE]) {
    let mut padded = [f32::INFINITY; 2 * NODE];
    padded[NODE..].copy_from_slice(&many.costs.0);
    let (mut best, mut roots) = ([Vec4::INFINITY; NODE / 4], [Vec4::ONE; NODE / 4]);
    for k in 1..=few.count.min(NODE - 1) {
        let (here, k_here) = (Vec4::splat(few.costs.0[k - 1]), Vec4::splat(k as f32));
        let others = &padded[NODE - k..2 * NODE - k];
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
