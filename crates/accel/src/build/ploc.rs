//! A binary tree from the bottom up: clusters in Morton order merge with their best neighbour [Meister2018].
//!
//! Each cluster looks at [`RADIUS`] others on both sides along the curve for the one with the smallest common box;
//! pairs that chose each other merge. Better than splitting from the top where triangles differ much in size, as in
//! furnished rooms. The tree does not depend on the number of threads.

use glam::Vec4;
use rayon::prelude::*;

use super::binary::{BinaryNode, Box4, Item};

/// How far to look for a partner.
const RADIUS: usize = 14;
/// Clusters looked at by one task.
const CHUNK: usize = 1024;

/// A subtree in the making.
#[derive(Clone, Copy)]
struct Cluster {
    bounds: Box4,
    node: u32,
}

/// An inner node: its children, by number. Leaves are numbered first, in Morton order.
struct Merge {
    bounds: Box4,
    children: [u32; 2],
    count: u32,
}

/// Reorders the items and returns the nodes in preorder.
pub(crate) fn build(items: &mut [Item]) -> Vec<BinaryNode> {
    sort(items);
    let merges = merge_all(items);
    preorder(items, &merges)
}

/// Along the Morton curve, 21 bits an axis.
fn sort(items: &mut [Item]) {
    let grow = |b: Box4, i: &Item| b.grow(i.center2());
    let centers = items
        .par_chunks(1 << 14)
        .map(|c| c.iter().fold(Box4::EMPTY, grow))
        .reduce(|| Box4::EMPTY, Box4::union);
    let d = centers.max - centers.min;
    // One scale for all axes: cells are cubes.
    let scale = 2_097_151.0 / d.x.max(d.y).max(d.z).max(1e-30);
    let mut keyed: Vec<(u64, u32)> = items
        .par_iter()
        .zip(0..items.len() as u32)
        .map(|(item, at)| {
            let c: Vec4 = (item.center2() - centers.min) * scale;
            (spread(c.x as u32) | spread(c.y as u32) << 1 | spread(c.z as u32) << 2, at)
        })
        .collect();
    keyed.par_sort_unstable();
    let sorted: Vec<Item> = keyed.par_iter().map(|&(_, at)| items[at as usize]).collect();
    items.copy_from_slice(&sorted);
}

/// Two zero bits after each of the lower 21.
fn spread(x: u32) -> u64 {
    let mut x = u64::from(x.min(0x1f_ffff));
    x = (x | x << 32) & 0x001f_0000_0000_ffff;
    x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

fn merge_all(items: &[Item]) -> Vec<Merge> {
    let n = items.len();
    let mut clusters: Vec<Cluster> =
        items.iter().zip(0..).map(|(i, node)| Cluster { bounds: i.bounds(), node }).collect();
    let mut merges: Vec<Merge> = Vec::with_capacity(n - 1);
    let (mut partners, mut next) = (vec![0_u32; n], Vec::with_capacity(n));
    while clusters.len() > 1 {
        partners.truncate(clusters.len());
        partners
            .par_chunks_mut(CHUNK)
            .enumerate()
            .for_each(|(chunk, out)| find_partners(&clusters, chunk * CHUNK, out));
        // Some pair always agrees, see there; were it not so, this keeps the loop from going on for ever.
        if !(0..clusters.len()).any(|i| partners[partners[i] as usize] as usize == i) {
            (partners[0], partners[1]) = (1, 0);
        }
        next.clear();
        for (i, cluster) in clusters.iter().enumerate() {
            let j = partners[i] as usize;
            if partners[j] as usize != i {
                next.push(*cluster);
            } else if i < j {
                let other = clusters[j];
                let count = |node: u32| if (node as usize) < n { 1 } else { merges[node as usize - n].count };
                let (bounds, children) = (cluster.bounds.union(other.bounds), [cluster.node, other.node]);
                let count = count(cluster.node) + count(other.node);
                next.push(Cluster { bounds, node: (n + merges.len()) as u32 });
                merges.push(Merge { bounds, children, count });
            }
        }
        std::mem::swap(&mut clusters, &mut next);
    }
    merges
}

/// The best partners of the clusters from `first` on. Of equal pairs the one first in order counts, for both sides, so
/// that the least pair of all merges and every round makes progress.
fn find_partners(clusters: &[Cluster], first: usize, out: &mut [u32]) {
    // Distances to the `RADIUS` clusters before, kept in a ring: each pair is looked at once.
    let begin = first.saturating_sub(RADIUS);
    let mut ring = [[f32::INFINITY; RADIUS]; RADIUS + 1];
    for i in begin..first + out.len() {
        let row = &mut ring[i % (RADIUS + 1)];
        let here = clusters[i].bounds;
        let (mut best, mut partner) = (f32::INFINITY, usize::MAX);
        for (d, area) in row.iter_mut().enumerate() {
            let j = i + 1 + d;
            *area = clusters.get(j).map_or(f32::INFINITY, |c| here.union(c.bounds).half_area());
        }
        if i < first {
            continue;
        }
        for j in i.saturating_sub(RADIUS)..i {
            let area = ring[j % (RADIUS + 1)][i - j - 1];
            if area < best || partner == usize::MAX {
                (best, partner) = (area, j);
            }
        }
        for (d, &area) in ring[i % (RADIUS + 1)].iter().enumerate() {
            if i + 1 + d < clusters.len() && (area < best || partner == usize::MAX) {
                (best, partner) = (area, i + 1 + d);
            }
        }
        out[i - first] = partner as u32;
    }
}

/// Writes nodes and items depth first.
fn preorder(items: &mut [Item], merges: &[Merge]) -> Vec<BinaryNode> {
    let n = items.len();
    let mut nodes = vec![BinaryNode::NONE; 2 * n - 1];
    let mut sorted = items.to_vec();
    let root = if n == 1 { 0 } else { (2 * n - 2) as u32 };
    let tree = Tree { items, merges };
    tree.write(root, &mut nodes, &mut sorted);
    items.copy_from_slice(&sorted);
    nodes
}

struct Tree<'a> {
    items: &'a [Item],
    merges: &'a [Merge],
}

impl Tree<'_> {
    fn count(&self, node: u32) -> usize {
        (node as usize).checked_sub(self.items.len()).map_or(1, |at| self.merges[at].count as usize)
    }

    fn write(&self, node: u32, nodes: &mut [BinaryNode], items: &mut [Item]) {
        let Some(at) = (node as usize).checked_sub(self.items.len()) else {
            items[0] = self.items[node as usize];
            nodes[0] = BinaryNode { bounds: items[0].bounds(), count: 1 };
            return;
        };
        let merge = &self.merges[at];
        nodes[0] = BinaryNode { bounds: merge.bounds, count: merge.count };
        let [a, b] = merge.children;
        let left = self.count(a);
        let (left_items, right_items) = items.split_at_mut(left);
        let (left_nodes, right_nodes) = nodes[1..].split_at_mut(2 * left - 1);
        if merge.count > 4096 {
            rayon::join(|| self.write(a, left_nodes, left_items), || self.write(b, right_nodes, right_items));
        } else {
            self.write(a, left_nodes, left_items);
            self.write(b, right_nodes, right_items);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::binary::children;
    use super::*;
    use math::{Bounds, Vec3};

    fn check(nodes: &[BinaryNode], items: &[Item]) {
        assert_eq!((nodes.len(), nodes[0].count as usize), (2 * items.len() - 1, items.len()));
        if items.len() > 1 {
            let (l, r) = children(nodes);
            let n = nodes[1].count as usize;
            check(&nodes[l..r], &items[..n]);
            check(&nodes[r..], &items[n..]);
        }
        let bounds = items.iter().fold(Box4::EMPTY, |b, i| b.union(i.bounds()));
        assert_eq!(bounds.to_bounds(), nodes[0].bounds.to_bounds());
    }

    #[test]
    fn every_subtree_is_a_slice_of_nodes_and_items() {
        let r = |i: u32| math::hash::unit_f32(math::hash::mix32(i));
        for n in [1_u32, 2, 3, 29, 100, 5000] {
            for grid in [false, true] {
                let mut items: Vec<Item> = (0..n)
                    .map(|i| {
                        let p = Vec3::new(r(3 * i), r(3 * i + 1), r(3 * i + 2));
                        let p = if grid { (p * 4.0).floor() } else { p };
                        Item::new(&Bounds { min: p, max: p + 0.01 }, i, 0)
                    })
                    .collect();
                let nodes = build(&mut items);
                check(&nodes, &items);
                let mut ids: Vec<u32> = items.iter().map(Item::id).collect();
                ids.sort_unstable();
                assert!(ids.iter().copied().eq(0..n));
            }
        }
    }

    #[test]
    fn bits_are_spread_by_three() {
        assert_eq!(spread(0b1011), 0b001_000_001_001);
        assert_eq!(spread(0x1f_ffff).count_ones(), 21);
    }
}
