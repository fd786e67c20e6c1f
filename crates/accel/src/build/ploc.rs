//! A binary tree from the bottom up: clusters in Morton order merge with their best neighbour [Meister2018].
//!
//! Each cluster looks at [`RADIUS`](partners::RADIUS) others on both sides along the curve for the one with the smallest common box;
//! pairs that chose each other merge. Better than splitting from the top where triangles differ much in size, as in
//! furnished rooms. The tree does not depend on the number of threads.

use rayon::prelude::*;

use super::binary::{BinaryNode, Box4, Item, Place};
use crate::kernels::memory;
use crate::kernels::partners::{self, BLOCK, PAD, Planes};

/// Clusters looked at by one task.
const CHUNK: usize = 1 << 12;
/// Coordinate of the boxes beyond the first and last: farther than any, with areas that are finite.
const FAR: f32 = 1e19;

/// An inner node: its children, by number. Leaves are numbered first, in order of the curve.
#[derive(Clone, Copy)]
struct Merge {
    bounds: Box4,
    children: [u32; 2],
    count: u32,
}

impl Merge {
    const NONE: Self = Self { bounds: Box4::EMPTY, children: [0; 2], count: 0 };
}

/// What was merged, over items in order of the curve.
pub(crate) struct Merges {
    items: usize,
    merges: Vec<Merge>,
}

/// A subtree in the making: a box with the number of its node, and of items below in place of the geometry.
type Cluster = Item;

impl Merges {
    /// Merges all items, which are in order of the curve.
    pub(crate) fn of(items: &[Item]) -> Self {
        let n = items.len();
        let mut all = Self { items: n, merges: memory::with_capacity(n.saturating_sub(1)) };
        let mut clusters: Vec<Cluster> = memory::with_capacity(n);
        let number = |(item, node): (&Item, u32)| Cluster::numbered(&item.bounds(), node, 1);
        clusters.par_extend(items.par_iter().zip(0..n as u32).map(number));
        let mut next = memory::filled(n, clusters[0]);
        let mut chosen = vec![0_u32; n];
        let mut len = n;
        while len > 1 {
            chosen.truncate(len);
            let choose =
                |(chunk, out): (usize, &mut [u32])| find_partners(&clusters[..len], chunk * CHUNK, out);
            chosen.par_chunks_mut(CHUNK).enumerate().for_each(choose);
            len = all.merge(&clusters[..len], &mut chosen, &mut next);
            std::mem::swap(&mut clusters, &mut next);
        }
        all
    }

    /// Merges those that chose each other, and returns how many clusters are left.
    fn merge(&mut self, clusters: &[Cluster], chosen: &mut [u32], next: &mut [Cluster]) -> usize {
        let mut counts = pairs(chosen);
        // Some pair always agrees, see there; were it not so, this keeps the loop from going on for ever.
        if counts.iter().all(|c| c.firsts == 0) {
            (chosen[0], chosen[1]) = (1, 0);
            counts = pairs(chosen);
        }
        let (first_new, total) = (self.merges.len(), counts.iter().map(|c| c.firsts).sum::<usize>());
        self.merges.resize(first_new + total, Merge::NONE);
        let mut number = self.items + first_new;
        let (mut merges, mut next) = (&mut self.merges[first_new..], next);
        let mut tasks = Vec::with_capacity(counts.len());
        for (c, part) in counts.iter().zip(chosen.chunks(CHUNK)) {
            // A pair leaves one cluster, at the place of its first.
            let (mine, out);
            (mine, merges) = merges.split_at_mut(c.firsts);
            (out, next) = next.split_at_mut(part.len() - c.seconds);
            tasks.push((mine, out, number));
            number += c.firsts;
        }
        let chosen = &*chosen;
        tasks.into_par_iter().enumerate().for_each(|(c, (merges, out, mut number))| {
            let mut merges = merges.iter_mut();
            let mut out = out.iter_mut();
            for i in c * CHUNK..((c + 1) * CHUNK).min(clusters.len()) {
                let (j, one) = (chosen[i] as usize, &clusters[i]);
                let is_pair = chosen[j] as usize == i;
                if is_pair && j < i {
                    continue;
                }
                let Some(to) = out.next() else { break };
                *to = *one;
                if is_pair && let Some(merge) = merges.next() {
                    let other = &clusters[j];
                    let (bounds, count) =
                        (one.bounds().union(other.bounds()), one.geometry() + other.geometry());
                    *merge = Merge { bounds, children: [one.id(), other.id()], count };
                    *to = Cluster::numbered(&bounds, number as u32, count);
                    number += 1;
                }
            }
        });
        clusters.len() - total
    }

    fn root(&self) -> u32 {
        if self.items == 1 { 0 } else { (2 * self.items - 2) as u32 }
    }

    fn get(&self, node: u32) -> Option<&Merge> {
        (node as usize).checked_sub(self.items).map(|at| &self.merges[at])
    }

    /// Items below a node.
    pub(crate) fn count(&self, node: u32) -> usize {
        self.get(node).map_or(1, |m| m.count as usize)
    }

    /// Divides the set into subtrees of at most `most` items: a tree whose items are these subtrees, and their numbers.
    pub(crate) fn divide_into(&self, most: usize) -> (Vec<BinaryNode>, Vec<u32>) {
        let (mut nodes, mut subtrees) = (Vec::new(), Vec::new());
        self.top(self.root(), most, &mut nodes, &mut subtrees);
        (nodes, subtrees)
    }

    fn top(&self, node: u32, most: usize, nodes: &mut Vec<BinaryNode>, subtrees: &mut Vec<u32>) -> Place {
        match self.get(node) {
            Some(merge) if merge.count as usize > most => {
                let (at, first) = (nodes.len(), subtrees.len());
                nodes.push(BinaryNode::NONE);
                let children = merge.children.map(|c| self.top(c, most, nodes, subtrees));
                nodes[at] = BinaryNode::new(&merge.bounds, children, first, subtrees.len() - first);
                Place::node(at)
            }
            _ => {
                subtrees.push(node);
                Place::item(subtrees.len() - 1)
            }
        }
    }

    /// Writes the subtree: its items from `sorted`, and its nodes in preorder, beginning at `at`; the items begin at `first`.
    pub(crate) fn write(&self, node: u32, sorted: &[Item], to: Subtree<'_>) {
        let Subtree { items, nodes, at, first } = to;
        let Some(merge) = self.get(node) else {
            items[0] = sorted[node as usize];
            return;
        };
        let [a, b] = merge.children;
        let [left, right] = [self.count(a), self.count(b)];
        let (here, below) = nodes.split_at_mut(1);
        here[0] = BinaryNode::in_preorder(&merge.bounds, at, first, [left, right]);
        let (left_items, right_items) = items.split_at_mut(left);
        let (left_nodes, right_nodes) = below.split_at_mut(left - 1);
        self.write(a, sorted, Subtree { items: left_items, nodes: left_nodes, at: at + 1, first });
        let to = Subtree { items: right_items, nodes: right_nodes, at: at + left, first: first + left };
        self.write(b, sorted, to);
    }
}

/// Room for a subtree.
pub(crate) struct Subtree<'a> {
    pub(crate) items: &'a mut [Item],
    pub(crate) nodes: &'a mut [BinaryNode],
    pub(crate) at: usize,
    pub(crate) first: usize,
}

/// Clusters of a chunk that chose each other.
struct Pairs {
    /// With a later one.
    firsts: usize,
    /// With one before.
    seconds: usize,
}

fn pairs(chosen: &[u32]) -> Vec<Pairs> {
    let of = |(c, part): (usize, &[u32])| {
        let (mut firsts, mut seconds) = (0, 0);
        for (i, &j) in (c * CHUNK..).zip(part) {
            let is_pair = chosen[j as usize] as usize == i;
            firsts += usize::from(is_pair && i < j as usize);
            seconds += usize::from(is_pair && i > j as usize);
        }
        Pairs { firsts, seconds }
    };
    chosen.par_chunks(CHUNK).enumerate().map(of).collect()
}

/// The best partners of the clusters from `first` on. Of equal pairs the one first in order counts, for both sides, so
/// that the least pair of all merges and every round makes progress.
fn find_partners(clusters: &[Cluster], first: usize, out: &mut [u32]) {
    let mut planes: Planes = [[FAR; BLOCK + 2 * PAD]; 6];
    let mut steps = [0; BLOCK];
    for (block, out) in out.chunks_mut(BLOCK).enumerate() {
        let first = first + block * BLOCK;
        fill(&mut planes, clusters, first);
        partners::best_steps(&planes, &mut steps);
        for ((out, step), i) in out.iter_mut().zip(steps).zip(first..) {
            let j = i.wrapping_add_signed(step as isize);
            let other = if i + 1 < clusters.len() { i + 1 } else { i - 1 };
            *out = if j < clusters.len() { j as u32 } else { other as u32 };
        }
    }
}

/// The planes of the boxes around the block that begins at `first`.
fn fill(planes: &mut Planes, clusters: &[Cluster], first: usize) {
    let begin = first.saturating_sub(PAD);
    let end = (first + BLOCK + PAD).min(clusters.len());
    let skip = begin + PAD - first;
    for plane in planes.iter_mut() {
        plane[..skip].fill(FAR);
        plane[skip + end - begin..].fill(FAR);
    }
    for (at, cluster) in (skip..).zip(&clusters[begin..end]) {
        let Box4 { min, max } = cluster.bounds();
        for (plane, x) in planes.iter_mut().zip([min.x, min.y, min.z, max.x, max.y, max.z]) {
            plane[at] = x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::binary::tests::{boxes, check};
    use super::super::morton;
    use super::*;

    #[test]
    fn every_subtree_is_a_slice_of_items() {
        for n in [1_u32, 2, 3, 29, 100, 5000] {
            for grid in [false, true] {
                let sorted = morton::sorted(&boxes(n, grid));
                let merges = Merges::of(&sorted);
                let (mut items, mut nodes) = (sorted.clone(), vec![BinaryNode::NONE; n as usize - 1]);
                merges.write(
                    merges.root(),
                    &sorted,
                    Subtree { items: &mut items, nodes: &mut nodes, at: 0, first: 0 },
                );
                check(if n == 1 { Place::item(0) } else { Place::node(0) }, &nodes, &items);
            }
        }
    }
}
