//! A binary tree from the top down, by the surface area heuristic over bins of centres [Wald2007]; a few items are joined
//! from the bottom up.

use glam::{Mat4, Vec4};
use rayon::prelude::*;

use super::binary::{BinaryNode, Box4, Item};
use super::few;

const BINS: usize = 32;
/// Larger sets are binned by several tasks.
const CHUNK: usize = 1 << 16;

/// How a set is divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Split {
    /// By the least cost, for leaves of at most so many items.
    Binned(usize),
    Halves,
}

/// Reorders the items and writes the nodes of a tree over them in preorder, one fewer than there are items. `spare` has
/// room for as many items.
pub(crate) fn build(items: &mut [Item], nodes: &mut [BinaryNode], spare: &mut [Item], split: Split) {
    subtree(Part { items, nodes, at: 0, first: 0 }, spare, split);
}

/// Items and room for the nodes over them, with the place of both in the whole.
struct Part<'a> {
    items: &'a mut [Item],
    nodes: &'a mut [BinaryNode],
    at: usize,
    first: usize,
}

fn subtree(part: Part<'_>, spare: &mut [Item], split: Split) {
    let Part { items, nodes, at, first } = part;
    match items.len() {
        0 | 1 => return,
        2..=few::MOST if split != Split::Halves => return few::join(items, nodes, at, first),
        _ => {}
    }
    let (bounds, left) = divide(items, spare, split);
    let right = items.len() - left;
    let (here, below) = nodes.split_at_mut(1);
    here[0] = BinaryNode::in_preorder(&bounds, at, first, [left, right]);
    let (left_items, right_items) = items.split_at_mut(left);
    let (left_nodes, right_nodes) = below.split_at_mut(left - 1);
    subtree(Part { items: left_items, nodes: left_nodes, at: at + 1, first }, spare, split);
    let right = Part { items: right_items, nodes: right_nodes, at: at + left, first: first + left };
    subtree(right, spare, split);
}

/// Divides the set into sets of at most `most` items: reorders the items, and returns a tree whose items are these sets.
pub(crate) fn divide_into(
    items: &mut [Item],
    spare: &mut [Item],
    most: usize,
    split: Split,
) -> (Vec<BinaryNode>, Vec<usize>) {
    if items.len() <= most {
        return (Vec::new(), vec![items.len()]);
    }
    let (bounds, left) = divide(items, spare, split);
    let (left_items, right_items) = items.split_at_mut(left);
    let (left_spare, right_spare) = spare.split_at_mut(left);
    let (a, b) = rayon::join(
        || divide_into(left_items, left_spare, most, split),
        || divide_into(right_items, right_spare, most, split),
    );
    let sizes = [a.1.len(), b.1.len()];
    let mut nodes = vec![BinaryNode::in_preorder(&bounds, 0, 0, sizes)];
    let mut append = |below: &[BinaryNode], at: usize, first: usize| {
        nodes.extend(below.iter().map(|node| node.offset(at, first)));
    };
    append(&a.0, 1, 0);
    append(&b.0, sizes[0], sizes[0]);
    (nodes, [a.1, b.1].concat())
}

/// Moves one side of the set to the front; returns the box of all and how many those are.
fn divide(items: &mut [Item], spare: &mut [Item], split: Split) -> (Box4, usize) {
    let (bounds, centers) = extent(items);
    let plane = match split {
        Split::Halves => None,
        Split::Binned(leaf) => best_split(items, &centers, leaf),
    };
    let left = plane.map_or(0, |plane| plane.partition(items, spare));
    if left == 0 || left == items.len() {
        return (bounds, halve(items, &centers));
    }
    (bounds, left)
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
    /// Axes along which the centres differ.
    axes: [bool; 3],
    bins: usize,
}

/// Added to a number below 2²², it leaves the nearest integer in the low bits.
const ROUND: f32 = 12_582_912.0;

impl Grid {
    fn new(centers: &Box4, n: usize) -> Self {
        // Small sets need few bins, and clearing more than they need would be most of the work.
        let most = if n <= 24 { BINS / 2 } else { BINS };
        let bins = (n / 2 + 4).min(most);
        let d = centers.max - centers.min;
        let axes = [d.x, d.y, d.z].map(|x| x > 1e-30);
        // Positions go from 0 to almost `bins`; half less, the nearest integer is the bin.
        let inv = |x: f32| if x > 1e-30 { bins as f32 * 0.999 / x } else { 0.0 };
        Self { low: centers.min, scale: Vec4::new(inv(d.x), inv(d.y), inv(d.z), 0.0), axes, bins }
    }

    #[inline(always)]
    fn bins_of(&self, item: &Item) -> [usize; 3] {
        let b = ((item.center2() - self.low) * self.scale - Vec4::splat(0.4995)) + Vec4::splat(ROUND);
        [b.x.to_bits() as usize % BINS, b.y.to_bits() as usize % BINS, b.z.to_bits() as usize % BINS]
    }

    /// One of [`Grid::bins_of`].
    #[inline(always)]
    fn bin_of(&self, item: &Item, axis: usize) -> usize {
        let b = ((item.center2()[axis] - self.low[axis]) * self.scale[axis] - 0.4995) + ROUND;
        b.to_bits() as usize % BINS
    }
}

#[derive(Clone)]
struct Histogram {
    boxes: [[Box4; 3]; BINS],
    counts: [[i32; 4]; BINS],
}

impl Histogram {
    fn of(items: &[Item], grid: &Grid) -> Self {
        let mut h = Self { boxes: [[Box4::EMPTY; 3]; BINS], counts: [[0; 4]; BINS] };
        for item in items {
            for (axis, bin) in grid.bins_of(item).into_iter().enumerate() {
                h.boxes[bin][axis] = h.boxes[bin][axis].union(item.bounds());
                h.counts[bin][axis] += 1;
            }
        }
        h
    }

    fn merge(mut self, other: &Self) -> Self {
        for bin in 0..BINS {
            for axis in 0..3 {
                self.boxes[bin][axis] = self.boxes[bin][axis].union(other.boxes[bin][axis]);
                self.counts[bin][axis] += other.counts[bin][axis];
            }
        }
        self
    }

    /// Cheapest axis and last bin of the left side.
    fn sweep(&self, grid: &Grid, leaf: usize) -> Option<(usize, usize)> {
        // A started leaf counts as a whole one: ⌈n / leaf⌉, by rounding to the nearest integer.
        let (scale, shift) = (Vec4::splat(1.0 / leaf as f32), Vec4::splat(0.5 - 0.5 / leaf as f32));
        let leaves = |n: Vec4| (n * scale + shift + Vec4::splat(ROUND)) - Vec4::splat(ROUND);
        let mut right = [Vec4::ZERO; BINS];
        let (mut b, mut n) = ([Box4::EMPTY; 3], Vec4::ZERO);
        for i in (1..grid.bins).rev() {
            (b, n) = self.with(i, b, n);
            right[i - 1] = half_areas(&b) * leaves(n);
        }
        let (mut b, mut n) = ([Box4::EMPTY; 3], Vec4::ZERO);
        let (mut best, mut at) = (Vec4::INFINITY, [0_usize; 3]);
        for (i, &right) in right[..grid.bins - 1].iter().enumerate() {
            (b, n) = self.with(i, b, n);
            let cost = half_areas(&b) * leaves(n) + right;
            let less = cost.cmplt(best).bitmask();
            best = cost.min(best);
            for (axis, at) in at.iter_mut().enumerate() {
                *at = if less >> axis & 1 != 0 { i } else { *at };
            }
        }
        let mut found = None;
        let mut least = f32::INFINITY;
        for axis in 0..3 {
            if grid.axes[axis] && best[axis] < least {
                (least, found) = (best[axis], Some((axis, at[axis])));
            }
        }
        found
    }

    #[inline]
    fn with(&self, i: usize, b: [Box4; 3], n: Vec4) -> ([Box4; 3], Vec4) {
        let here = &self.boxes[i];
        (
            [b[0].union(here[0]), b[1].union(here[1]), b[2].union(here[2])],
            n + Vec4::from_array(self.counts[i].map(|n| n as f32)),
        )
    }
}

/// Half the surface of each.
#[inline]
fn half_areas(b: &[Box4; 3]) -> Vec4 {
    let products = |b: &Box4| {
        let d = b.max - b.min;
        d * Vec4::new(d.y, d.z, d.x, d.w)
    };
    let t = Mat4::from_cols(products(&b[0]), products(&b[1]), products(&b[2]), Vec4::ZERO).transpose();
    t.x_axis + t.y_axis + t.z_axis
}

/// A plane between bins.
struct Plane {
    grid: Grid,
    axis: usize,
    last_left: usize,
}

fn best_split(items: &[Item], centers: &Box4, leaf: usize) -> Option<Plane> {
    let grid = Grid::new(centers, items.len());
    let histogram = if items.len() <= CHUNK {
        Histogram::of(items, &grid)
    } else {
        let parts: Vec<_> = items.par_chunks(CHUNK / 4).map(|c| Histogram::of(c, &grid)).collect();
        parts.iter().skip(1).fold(parts[0].clone(), Histogram::merge)
    };
    histogram.sweep(&grid, leaf).map(|(axis, last_left)| Plane { grid, axis, last_left })
}

impl Plane {
    /// Moves the left side to the front, keeps the order on both, and returns the length of the left. `spare` has room for
    /// as many items.
    fn partition(&self, items: &mut [Item], spare: &mut [Item]) -> usize {
        if items.len() > CHUNK {
            return self.partition_by_tasks(items, spare);
        }
        // Which side is a coin toss, so no branch: each item is written to both.
        let (mut left, mut right) = (0, 0);
        for i in 0..items.len() {
            let item = items[i];
            let is_left = self.is_left(&item);
            (items[left], spare[right]) = (item, item);
            left += usize::from(is_left);
            right += usize::from(!is_left);
        }
        items[left..].copy_from_slice(&spare[..right]);
        left
    }

    fn partition_by_tasks(&self, items: &mut [Item], spare: &mut [Item]) -> usize {
        let part = CHUNK / 4;
        let of = |c: &[Item]| c.iter().filter(|i| self.is_left(i)).count();
        let counts: Vec<usize> = items.par_chunks(part).map(of).collect();
        let left = counts.iter().sum();
        let spare = &mut spare[..items.len()];
        let (mut to_left, mut to_right) = spare.split_at_mut(left);
        let mut tasks = Vec::with_capacity(counts.len());
        for (from, &n) in items.chunks(part).zip(&counts) {
            let (l, r);
            (l, to_left) = to_left.split_at_mut(n);
            (r, to_right) = to_right.split_at_mut(from.len() - n);
            tasks.push((from, l, r));
        }
        tasks.into_par_iter().for_each(|(from, l, r)| {
            let (mut l, mut r) = (l.iter_mut(), r.iter_mut());
            for item in from {
                let to = if self.is_left(item) { l.next() } else { r.next() };
                to.into_iter().for_each(|to| *to = *item);
            }
        });
        items
            .par_chunks_mut(part)
            .zip(spare.par_chunks(part))
            .for_each(|(to, from)| to.copy_from_slice(from));
        left
    }

    #[inline(always)]
    fn is_left(&self, item: &Item) -> bool {
        self.grid.bin_of(item, self.axis) <= self.last_left
    }
}

#[cfg(test)]
mod tests {
    use super::super::binary::Place;
    use super::super::binary::tests::{boxes, check};
    use super::*;
    use math::{Bounds, Vec3};

    fn over(items: &mut [Item], split: Split) -> Vec<BinaryNode> {
        let mut nodes = vec![BinaryNode::NONE; items.len() - 1];
        build(items, &mut nodes, &mut items.to_vec(), split);
        nodes
    }

    fn root(items: &[Item]) -> Place {
        if items.len() == 1 { Place::item(0) } else { Place::node(0) }
    }

    #[test]
    fn every_subtree_is_a_slice_of_items() {
        for n in [1_u32, 2, 3, 8, 9, 100, 5000] {
            for split in [Split::Binned(8), Split::Halves] {
                for grid in [false, true] {
                    let mut items = boxes(n, grid);
                    let nodes = over(&mut items, split);
                    check(root(&items), &nodes, &items);
                }
            }
        }
    }

    #[test]
    fn equal_boxes_are_halved() {
        let b = Bounds { min: Vec3::ZERO, max: Vec3::ONE };
        let mut items: Vec<Item> = (0..1000).map(|i| Item::new(&b, i, 0)).collect();
        let nodes = over(&mut items, Split::Binned(8));
        check(root(&items), &nodes, &items);
    }
}
