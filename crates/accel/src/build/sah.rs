//! A binary tree from the top down, by the surface area heuristic over bins of centres [Wald2007].
//!
//! Subtrees are built by all threads; the tree does not depend on how many there are.

use glam::Vec4;
use rayon::prelude::*;

use super::binary::{BinaryNode, Box4, Item};

const BINS: usize = 32;
/// Smaller subtrees are not worth a task.
const TASK: usize = 2048;
/// Larger sets are binned by several tasks.
const CHUNK: usize = 1 << 16;

/// How a set is divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Split {
    Binned,
    Halves,
}

/// Reorders the items and returns the nodes in preorder.
pub(crate) fn build(items: &mut [Item], split: Split) -> Vec<BinaryNode> {
    let mut nodes = vec![BinaryNode::NONE; 2 * items.len() - 1];
    subtree(items, &mut nodes, split);
    nodes
}

fn subtree(items: &mut [Item], nodes: &mut [BinaryNode], split: Split) {
    let (bounds, centers) = extent(items);
    nodes[0] = BinaryNode { bounds, count: items.len() as u32 };
    if items.len() == 1 {
        return;
    }
    // Small sets need few bins, and clearing more than they need would be most of the work.
    let plane = match (split, items.len()) {
        (Split::Halves, _) | (_, 2) => None,
        (Split::Binned, ..=8) => best_split::<8>(items, &centers),
        (Split::Binned, ..=24) => best_split::<16>(items, &centers),
        (Split::Binned, _) => best_split::<BINS>(items, &centers),
    };
    let at = match plane {
        Some(plane) => plane.partition(items),
        None => halve(items, &centers),
    };
    let (left_items, right_items) = items.split_at_mut(at);
    let (left, right) = nodes[1..].split_at_mut(2 * at - 1);
    if left_items.len() + right_items.len() > TASK {
        rayon::join(|| subtree(left_items, left, split), || subtree(right_items, right, split));
    } else {
        subtree(left_items, left, split);
        subtree(right_items, right, split);
    }
}

/// The box of the items, and of their (doubled) centres.
fn extent(items: &[Item]) -> (Box4, Box4) {
    let of = |items: &[Item]| {
        items.iter().fold((Box4::EMPTY, Box4::EMPTY), |(b, c), i| (b.union(i.bounds()), c.grow(i.center2())))
    };
    if items.len() <= CHUNK {
        return of(items);
    }
    let both = |a: (Box4, Box4), b: (Box4, Box4)| (a.0.union(b.0), a.1.union(b.1));
    items.par_chunks(CHUNK / 4).map(of).reduce(|| (Box4::EMPTY, Box4::EMPTY), both)
}

/// By the median along the longest axis of the centres.
fn halve(items: &mut [Item], centers: &Box4) -> usize {
    let d = centers.max - centers.min;
    let axis = if d.x >= d.y && d.x >= d.z { 0 } else { 1 + usize::from(d.z > d.y) };
    let at = items.len() / 2;
    items.select_nth_unstable_by(at, |a, b| {
        a.center2()[axis].total_cmp(&b.center2()[axis]).then(a.id().cmp(&b.id()))
    });
    at
}

/// Maps centres to bins.
#[derive(Clone, Copy)]
struct Grid {
    low: Vec4,
    scale: Vec4,
    bins: usize,
}

impl Grid {
    fn new(centers: &Box4, n: usize, most: usize) -> Self {
        let bins = (n / 2 + 4).min(most);
        let d = centers.max - centers.min;
        let inv = |x: f32| if x > 1e-30 { bins as f32 * 0.9999 / x } else { 0.0 };
        Self { low: centers.min, scale: Vec4::new(inv(d.x), inv(d.y), inv(d.z), 0.0), bins }
    }

    #[inline]
    fn bins_of(&self, item: &Item) -> [usize; 3] {
        let b = (item.center2() - self.low) * self.scale;
        let last = self.bins - 1;
        [(b.x as usize).min(last), (b.y as usize).min(last), (b.z as usize).min(last)]
    }
}

#[derive(Clone)]
struct Histogram<const N: usize> {
    boxes: [[Box4; N]; 3],
    counts: [[u32; N]; 3],
}

impl<const N: usize> Histogram<N> {
    const EMPTY: Self = Self { boxes: [[Box4::EMPTY; N]; 3], counts: [[0; N]; 3] };

    fn of(items: &[Item], grid: &Grid) -> Self {
        let mut h = Self::EMPTY;
        for item in items {
            let bins = grid.bins_of(item);
            for (axis, &bin) in bins.iter().enumerate() {
                h.boxes[axis][bin] = h.boxes[axis][bin].union(item.bounds());
                h.counts[axis][bin] += 1;
            }
        }
        h
    }

    fn merge(mut self, other: &Self) -> Self {
        for axis in 0..3 {
            for bin in 0..N {
                self.boxes[axis][bin] = self.boxes[axis][bin].union(other.boxes[axis][bin]);
                self.counts[axis][bin] += other.counts[axis][bin];
            }
        }
        self
    }

    /// Cheapest last bin of the left side along one axis, with its cost.
    fn sweep(&self, axis: usize, bins: usize) -> Option<(f32, usize)> {
        let (boxes, counts) = (&self.boxes[axis], &self.counts[axis]);
        let mut right_cost = [0.0; N];
        let (mut b, mut n) = (Box4::EMPTY, 0);
        for i in (1..bins).rev() {
            b = b.union(boxes[i]);
            n += counts[i];
            right_cost[i - 1] = if n == 0 { f32::INFINITY } else { b.half_area() * n as f32 };
        }
        let (mut b, mut n, mut best) = (Box4::EMPTY, 0, None);
        for i in 0..bins - 1 {
            b = b.union(boxes[i]);
            n += counts[i];
            let cost = b.half_area() * n as f32 + right_cost[i];
            if n > 0 && cost.is_finite() && best.is_none_or(|(c, _)| cost < c) {
                best = Some((cost, i));
            }
        }
        best
    }
}

/// A plane between bins.
struct Plane {
    grid: Grid,
    axis: usize,
    last_left: usize,
}

fn best_split<const N: usize>(items: &[Item], centers: &Box4) -> Option<Plane> {
    let grid = Grid::new(centers, items.len(), N);
    let histogram = if items.len() <= CHUNK {
        Histogram::<N>::of(items, &grid)
    } else {
        let parts = items.par_chunks(CHUNK / 4).map(|c| Histogram::<N>::of(c, &grid));
        parts.reduce(|| Histogram::<N>::EMPTY, |a, b| a.merge(&b))
    };
    let mut best: Option<(f32, Plane)> = None;
    for axis in 0..3 {
        if let Some((cost, last_left)) = histogram.sweep(axis, grid.bins)
            && best.as_ref().is_none_or(|(c, _)| cost < *c)
        {
            best = Some((cost, Plane { grid, axis, last_left }));
        }
    }
    best.map(|(_, plane)| plane)
}

impl Plane {
    /// Moves the left side to the front and returns its length.
    fn partition(&self, items: &mut [Item]) -> usize {
        let is_left = |i: &Item| self.grid.bins_of(i)[self.axis] <= self.last_left;
        let (mut lo, mut hi) = (0, items.len());
        loop {
            while lo < hi && is_left(&items[lo]) {
                lo += 1;
            }
            while lo < hi && !is_left(&items[hi - 1]) {
                hi -= 1;
            }
            if lo >= hi {
                return lo;
            }
            items.swap(lo, hi - 1);
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
        let (bounds, _) = extent(items);
        assert_eq!(bounds.to_bounds(), nodes[0].bounds.to_bounds());
    }

    #[test]
    fn every_subtree_is_a_slice_of_nodes_and_items() {
        for n in [1_u32, 2, 3, 100, 5000] {
            for split in [Split::Binned, Split::Halves] {
                let r = |i: u32| math::hash::unit_f32(math::hash::mix32(i));
                let mut items: Vec<Item> = (0..n)
                    .map(|i| {
                        let p = Vec3::new(r(3 * i), r(3 * i + 1), r(3 * i + 2));
                        Item::new(&Bounds { min: p, max: p + 0.01 }, i, 0)
                    })
                    .collect();
                let nodes = build(&mut items, split);
                check(&nodes, &items);
                let mut ids: Vec<u32> = items.iter().map(Item::id).collect();
                ids.sort_unstable();
                assert!(ids.iter().copied().eq(0..n));
            }
        }
    }

    #[test]
    fn equal_boxes_are_halved() {
        let b = Bounds { min: Vec3::ZERO, max: Vec3::ONE };
        let mut items: Vec<Item> = (0..1000).map(|i| Item::new(&b, i, 0)).collect();
        check(&build(&mut items, Split::Binned), &items);
    }
}
