//! A binary tree from the bottom up: clusters in Morton order merge with their best neighbour [Meister2018].
//!
//! Each cluster looks at [`RADIUS`] others on both sides along the curve for the one with the smallest common box;
//! pairs that chose each other merge. Better than splitting from the top where triangles differ much in size, as in
//! furnished rooms. The tree does not depend on the number of threads.

use glam::Vec4;
use rayon::prelude::*;

use super::binary::{BinaryNode, Box4, Item, Place};

/// How far to look for a partner.
const RADIUS: usize = 14;
/// Clusters looked at by one task.
const CHUNK: usize = 1 << 12;
/// Clusters whose distances are kept at once.
const BLOCK: usize = 128;
/// Room before and after the clusters.
const PAD: usize = 16;
/// Coordinate of the boxes there: farther than any, with areas that are finite.
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

/// Boxes by plane, and the number of the node of each.
struct Clusters {
    planes: [Vec<f32>; 6],
    nodes: Vec<u32>,
    len: usize,
}

impl Clusters {
    fn with_room(n: usize) -> Self {
        Self { planes: std::array::from_fn(|_| vec![FAR; n + 2 * PAD]), nodes: vec![0; n], len: n }
    }

    fn of(items: &[Item]) -> Self {
        let mut all = Self::with_room(items.len());
        for (at, item) in items.iter().enumerate() {
            let Box4 { min, max } = item.bounds();
            for (plane, x) in all.planes.iter_mut().zip([min.x, min.y, min.z, max.x, max.y, max.z]) {
                plane[PAD + at] = x;
            }
            all.nodes[at] = at as u32;
        }
        all
    }

    /// Forgets all but the first `n`.
    fn truncate(&mut self, n: usize) {
        self.len = n;
        for plane in &mut self.planes {
            plane[PAD + n..n + 2 * PAD].fill(FAR);
        }
    }

    #[inline]
    fn bounds(&self, at: usize) -> Box4 {
        let [a, b, c, d, e, f] = &self.planes;
        let i = PAD + at;
        Box4 { min: Vec4::new(a[i], b[i], c[i], 0.0), max: Vec4::new(d[i], e[i], f[i], 0.0) }
    }

    /// Room for the outcome of tasks, the sizes of which are given.
    fn split(&mut self, sizes: impl Iterator<Item = usize>) -> Vec<Room<'_>> {
        let mut planes = self.planes.each_mut().map(|p| &mut p[PAD..]);
        let mut nodes = self.nodes.as_mut_slice();
        sizes
            .map(|n| {
                let first = planes.each_mut().map(|rest| {
                    let (first, after) = std::mem::take(rest).split_at_mut(n);
                    *rest = after;
                    first
                });
                let (first_nodes, after) = std::mem::take(&mut nodes).split_at_mut(n);
                nodes = after;
                Room { planes: first, nodes: first_nodes, len: 0 }
            })
            .collect()
    }
}

/// A part of clusters to be written.
struct Room<'a> {
    planes: [&'a mut [f32]; 6],
    nodes: &'a mut [u32],
    len: usize,
}

impl Room<'_> {
    #[inline]
    fn push(&mut self, b: &Box4, node: u32) {
        let at = self.len;
        let values = [b.min.x, b.min.y, b.min.z, b.max.x, b.max.y, b.max.z];
        for (plane, x) in self.planes.iter_mut().zip(values) {
            plane[at] = x;
        }
        self.nodes[at] = node;
        self.len += 1;
    }
}

impl Merges {
    /// Merges all items, which are in order of the curve.
    pub(crate) fn of(items: &[Item]) -> Self {
        let n = items.len();
        let mut all = Self { items: n, merges: Vec::with_capacity(n.saturating_sub(1)) };
        let (mut clusters, mut next) = (Clusters::of(items), Clusters::with_room(n));
        let mut partners = vec![0_u32; n];
        while clusters.len > 1 {
            partners.truncate(clusters.len);
            partners
                .par_chunks_mut(CHUNK)
                .enumerate()
                .for_each(|(chunk, out)| find_partners(&clusters, chunk * CHUNK, out));
            all.merge(&clusters, &mut partners, &mut next);
            std::mem::swap(&mut clusters, &mut next);
        }
        all
    }

    /// Merges those that chose each other.
    fn merge(&mut self, clusters: &Clusters, partners: &mut [u32], next: &mut Clusters) {
        let count = |partners: &[u32]| -> Vec<usize> {
            let merges = |i: &usize| {
                let j = partners[*i] as usize;
                *i < j && partners[j] as usize == *i
            };
            let chunks = 0..clusters.len.div_ceil(CHUNK);
            let range = |c: usize| c * CHUNK..((c + 1) * CHUNK).min(clusters.len);
            chunks.into_par_iter().map(|c| range(c).filter(merges).count()).collect()
        };
        let mut counts = count(partners);
        // Some pair always agrees, see there; were it not so, this keeps the loop from going on for ever.
        if counts.iter().all(|&c| c == 0) {
            (partners[0], partners[1]) = (1, 0);
            counts = count(partners);
        }
        // A pair leaves one cluster, at the place of its first.
        let seconds: Vec<usize> = partners
            .par_chunks(CHUNK)
            .enumerate()
            .map(|(c, chosen)| {
                let second =
                    |&(i, &j): &(usize, &u32)| (j as usize) < i && partners[j as usize] as usize == i;
                (c * CHUNK..).zip(chosen).filter(second).count()
            })
            .collect();
        let sizes = partners.chunks(CHUNK).zip(&seconds).map(|(c, s)| c.len() - s);
        let (first_new, total) = (self.merges.len(), counts.iter().sum::<usize>());
        self.merges.resize(first_new + total, Merge::NONE);
        let (old, mut new) = self.merges.split_at_mut(first_new);
        let (items, mut number) = (self.items, self.items + first_new);
        let mut tasks = Vec::with_capacity(counts.len());
        for (room, &n) in next.split(sizes).into_iter().zip(&counts) {
            let (here, rest) = std::mem::take(&mut new).split_at_mut(n);
            new = rest;
            tasks.push((room, here, number));
            number += n;
        }
        let count = |node: u32| (node as usize).checked_sub(items).map_or(1, |at| old[at].count);
        let partners = &*partners;
        tasks.into_par_iter().enumerate().for_each(|(c, (mut room, merges, first))| {
            let mut made = 0;
            for i in c * CHUNK..((c + 1) * CHUNK).min(clusters.len) {
                let j = partners[i] as usize;
                if partners[j] as usize != i {
                    room.push(&clusters.bounds(i), clusters.nodes[i]);
                } else if i < j {
                    let bounds = clusters.bounds(i).union(clusters.bounds(j));
                    let children = [clusters.nodes[i], clusters.nodes[j]];
                    room.push(&bounds, (first + made) as u32);
                    merges[made] = Merge { bounds, children, count: count(children[0]) + count(children[1]) };
                    made += 1;
                }
            }
        });
        next.truncate(clusters.len - total);
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

/// The best partners of the clusters from `first` on. Of equal pairs the one first in order counts, for both sides, so
/// that the least pair of all merges and every round makes progress.
fn find_partners(clusters: &Clusters, first: usize, out: &mut [u32]) {
    let mut areas = Areas([[0.0; BLOCK + PAD]; RADIUS]);
    for (block, out) in out.chunks_mut(BLOCK).enumerate() {
        let first = first + block * BLOCK;
        areas.fill(&clusters.planes, first);
        for (quad, out) in out.chunks_mut(4).enumerate() {
            let steps = areas.best_steps(4 * quad);
            for ((out, step), i) in out.iter_mut().zip(steps.to_array()).zip(first + 4 * quad..) {
                let j = i.wrapping_add_signed(step as isize);
                let other = if i + 1 < clusters.len { i + 1 } else { i - 1 };
                *out = if step == 0.0 || j >= clusters.len { other as u32 } else { j as u32 };
            }
        }
    }
}

/// Areas of the common box of a cluster with that `d + 1` further on. Row `d` begins [`PAD`] clusters before the block.
struct Areas([[f32; BLOCK + PAD]; RADIUS]);

impl Areas {
    #[inline]
    fn fill(&mut self, planes: &[Vec<f32>; 6], first: usize) {
        let end = (first + BLOCK + 2 * PAD).min(planes[0].len());
        for (row, d) in self.0.iter_mut().zip(1..) {
            let n = (end - first - d).min(BLOCK + PAD);
            let [ax, ay, az, bx, by, bz] =
                planes.each_ref().map(|p| (&p[first..first + n], &p[first + d..first + d + n]));
            row[n..].fill(f32::INFINITY);
            for (i, area) in row[..n].iter_mut().enumerate() {
                let x = greater(bx.0[i], bx.1[i]) - less(ax.0[i], ax.1[i]);
                let y = greater(by.0[i], by.1[i]) - less(ay.0[i], ay.1[i]);
                let z = greater(bz.0[i], bz.1[i]) - less(az.0[i], az.1[i]);
                *area = x * y + y * z + z * x;
            }
        }
    }

    /// How far it is to the best partners of four clusters; 0: to none.
    #[inline]
    fn best_steps(&self, first: usize) -> Vec4 {
        let (mut best, mut steps) = (Vec4::INFINITY, Vec4::ZERO);
        let mut choose = |row: usize, at: usize, step: f32| {
            let areas = Vec4::from_slice(&self.0[row][at..]);
            steps = Vec4::select(areas.cmplt(best), Vec4::splat(step), steps);
            best = areas.min(best);
        };
        for d in (1..=RADIUS).rev() {
            choose(d - 1, PAD + first - d, -(d as f32));
        }
        for d in 1..=RADIUS {
            choose(d - 1, PAD + first, d as f32);
        }
        steps
    }
}

/// One instruction, where `f32::min` asks for numbers that are none.
#[inline]
fn less(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
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
