//! From boxes to a wide tree: a binary tree first, then the cheapest wide one that it can be collapsed to.

mod binary;
mod collapse;
mod emit;
mod few;
mod morton;
mod ploc;
mod sah;

pub(crate) use binary::Item;
pub(crate) use emit::Leaf;

use math::Bounds;
use rayon::prelude::*;

use binary::{BinaryNode, Box4, Place};
use collapse::{Costs, Part};
use emit::Reader;
use ploc::{Merges, Subtree};
use sah::Split;

use crate::kernels::memory;
use crate::layout::WideTree;

/// Deeper trees would overrun the stack of the kernels; they are built anew by halving.
const MAX_DEPTH: usize = crate::kernels::MAX_DEPTH;

/// How the binary tree is made. All give the same hits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TreeKind {
    /// That of the next two which costs less, by a sample if there are many primitives.
    #[default]
    Best,
    /// Top down, by the surface area heuristic over 32 bins [Wald2007], with blocks of primitives in place of primitives.
    BinnedSah,
    /// Bottom up, by merging neighbours [Meister2018]; small subtrees top down where that is better.
    Ploc,
    /// Halves of equal number: quick and shallow, but slow to trace.
    Halves,
}

impl TreeKind {
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::Best, Self::BinnedSah, Self::Ploc, Self::Halves];
}

/// How to build.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BuildOptions {
    /// The tree.
    pub tree: TreeKind,
}

/// Cost of a leaf against that of a node visit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LeafCost {
    /// Items in a leaf.
    pub(crate) max_items: usize,
    /// For each leaf, whatever it holds.
    pub(crate) fixed: f32,
}

/// Items of one task.
const SET: usize = 1024;
/// With more items than this, a sample of at least so many tells which tree is better.
const SAMPLE: usize = 1 << 13;
/// One of so many runs of items is in the sample, unless that is too few.
const STRIDE: usize = 16;
/// Items of a run: neighbours, most often, which are to show what they are like together.
const RUN: usize = 64;

/// Builds a tree over `items`, which it reorders. A leaf is referred to as the block with its number.
pub(crate) fn build(items: &mut [Item], options: &BuildOptions, cost: &LeafCost) -> (WideTree, Vec<Leaf>) {
    if items.is_empty() {
        return Default::default();
    }
    let whole = Whole::grow(items, options.tree, cost);
    let reader = Reader { nodes: &whole.nodes, items };
    if let Some(emitted) = emit::emit(reader, whole.root, whole.cost, MAX_DEPTH) {
        return emitted;
    }
    let whole = Whole::of_halves(items, cost);
    let reader = Reader { nodes: &whole.nodes, items };
    emit::emit(reader, whole.root, whole.cost, usize::MAX).unwrap_or_default()
}

/// The box around all items.
pub(crate) fn bounds(items: &[Item]) -> Bounds {
    let of = |items: &[Item]| items.iter().fold(Box4::EMPTY, |all, i| all.union(i.bounds()));
    items.par_chunks(1 << 14).map(of).reduce(|| Box4::EMPTY, Box4::union).to_bounds()
}

/// A binary tree with plans.
struct Whole {
    nodes: Vec<BinaryNode>,
    root: Place,
    /// Times the area.
    cost: f32,
}

impl Whole {
    fn grow(items: &mut [Item], kind: TreeKind, cost: &LeafCost) -> Self {
        match kind {
            TreeKind::Best => Self::best(items, cost),
            TreeKind::BinnedSah => Self::from_top(items, Split::Binned(cost.max_items), cost),
            TreeKind::Ploc => Self::from_bottom(items, cost),
            TreeKind::Halves => Self::of_halves(items, cost),
        }
    }

    /// Of few items both trees are built. Of many items a sample says which kind is better: what makes the one or the other
    /// better, large triangles among small ones, shows there too.
    fn best(items: &mut [Item], cost: &LeafCost) -> Self {
        let stride = if items.len() > SAMPLE { (items.len() / SAMPLE).min(STRIDE) } else { 1 };
        let mut sample: Vec<Item> = items.chunks(RUN).step_by(stride).flatten().copied().collect();
        let mut same = sample.clone();
        let (a, b) = rayon::join(
            || Self::from_top(&mut sample, Split::Binned(cost.max_items), cost),
            || Self::from_bottom(&mut same, cost),
        );
        let is_bottom_better = b.cost < a.cost;
        if stride == 1 {
            let (order, tree) = if is_bottom_better { (&same, b) } else { (&sample, a) };
            items.copy_from_slice(order);
            return tree;
        }
        let kind = if is_bottom_better { TreeKind::Ploc } else { TreeKind::BinnedSah };
        Self::grow(items, kind, cost)
    }

    fn of_halves(items: &mut [Item], cost: &LeafCost) -> Self {
        Self::from_top(items, Split::Halves, cost)
    }

    fn from_top(items: &mut [Item], split: Split, cost: &LeafCost) -> Self {
        let mut nodes = memory::filled(items.len(), BinaryNode::NONE);
        let mut spare = memory::filled(items.len(), items[0]);
        let (top, sizes) = sah::divide_into(items, &mut spare, SET, split);
        let jobs = jobs(items, &mut nodes, sizes.into_iter().map(|n| (n, ())));
        let spare = || (vec![spare[0]; SET], Vec::new());
        let sets = jobs.into_par_iter().map_init(spare, |(spare, scratch), job| {
            sah::build(job.items, job.nodes, spare, split);
            job.plan(cost, scratch)
        });
        let sets = sets.collect();
        Self::join(nodes, top, sets, cost)
    }

    /// By merging; each set is built from the top too, and keeps the tree that costs less.
    fn from_bottom(items: &mut [Item], cost: &LeafCost) -> Self {
        let mut nodes = memory::filled(items.len(), BinaryNode::NONE);
        let sorted = morton::sorted(items);
        let merges = Merges::of(&sorted);
        let (top, subtrees) = merges.divide_into(SET);
        let sizes = subtrees.iter().map(|&s| (merges.count(s), s));
        let jobs = jobs(items, &mut nodes, sizes);
        let sets = jobs.into_par_iter().map_init(Scratch::default, |scratch, job| {
            let to = Subtree { items: job.items, nodes: job.nodes, at: 0, first: 0 };
            merges.write(job.of, &sorted, to);
            job.better(cost, scratch)
        });
        let sets = sets.collect();
        Self::join(nodes, top, sets, cost)
    }

    /// Joins the trees of sets, of which `nodes` has room for one node per item, by a tree over the sets.
    fn join(mut nodes: Vec<BinaryNode>, mut top: Vec<BinaryNode>, sets: Vec<Set>, cost: &LeafCost) -> Self {
        for node in &mut top {
            let range = &sets[node.first as usize..(node.first + node.count) as usize];
            node.first = range[0].first as u32;
            node.count = range.iter().map(|s| s.count as u32).sum();
        }
        let leaf = |s: usize| Part::Tree(&sets[s].costs, sets[s].count);
        let total = collapse::plan(&mut top, cost, &mut Vec::new(), leaf).total();
        let at = nodes.len();
        let place = |c: Place| if c.is_item() { sets[c.index()].root() } else { c.offset(at) };
        let root = place(if top.is_empty() { Place::item(0) } else { Place::node(0) });
        nodes.extend(top.into_iter().map(|node| BinaryNode { children: node.children.map(place), ..node }));
        Self { nodes, root, cost: total }
    }
}

/// What one task made a tree of.
struct Set {
    first: usize,
    count: usize,
    costs: Costs,
}

impl Set {
    fn root(&self) -> Place {
        if self.count == 1 { Place::item(self.first) } else { Place::node(self.first) }
    }
}

/// Room for one set.
struct Job<'a, T> {
    items: &'a mut [Item],
    nodes: &'a mut [BinaryNode],
    /// The first item, and the first node.
    first: usize,
    of: T,
}

fn jobs<'a, T>(
    mut items: &'a mut [Item],
    mut nodes: &'a mut [BinaryNode],
    sizes: impl Iterator<Item = (usize, T)>,
) -> Vec<Job<'a, T>> {
    let mut next = 0;
    sizes
        .map(|(n, of)| {
            let (my_items, my_nodes, first) = (items.split_off_mut(..n), nodes.split_off_mut(..n), next);
            next += n;
            let (items, nodes) = (my_items.unwrap_or_default(), my_nodes.unwrap_or_default());
            Job { items, nodes: &mut nodes[..n - 1], first, of }
        })
        .collect()
}

/// Room for a second tree.
#[derive(Default)]
struct Scratch {
    costs: Vec<Costs>,
    items: Vec<Item>,
    spare: Vec<Item>,
    nodes: Vec<BinaryNode>,
}

impl<T> Job<'_, T> {
    /// The cheaper of the tree that is there and one from the top down.
    fn better(self, cost: &LeafCost, scratch: &mut Scratch) -> Set {
        let costs = plan(self.items, self.nodes, cost, &mut scratch.costs);
        if self.items.len() < 3 {
            return self.placed(costs);
        }
        scratch.items.clear();
        scratch.items.extend_from_slice(self.items);
        scratch.spare.clone_from(&scratch.items);
        scratch.nodes.clear();
        scratch.nodes.resize(self.nodes.len(), BinaryNode::NONE);
        sah::build(&mut scratch.items, &mut scratch.nodes, &mut scratch.spare, Split::Binned(cost.max_items));
        let others = plan(&scratch.items, &mut scratch.nodes, cost, &mut scratch.costs);
        if others.total() >= costs.total() {
            return self.placed(costs);
        }
        self.items.copy_from_slice(&scratch.items);
        self.nodes.copy_from_slice(&scratch.nodes);
        self.placed(others)
    }

    fn plan(self, cost: &LeafCost, scratch: &mut Vec<Costs>) -> Set {
        let costs = plan(self.items, self.nodes, cost, scratch);
        self.placed(costs)
    }

    /// Puts the tree at its place in the whole.
    fn placed(self, costs: Costs) -> Set {
        for node in self.nodes.iter_mut() {
            *node = node.offset(self.first, self.first);
        }
        Set { first: self.first, count: self.items.len(), costs }
    }
}

fn plan(items: &[Item], nodes: &mut [BinaryNode], cost: &LeafCost, scratch: &mut Vec<Costs>) -> Costs {
    let leaf = |i: usize| Part::Item(items[i].bounds().half_area() * cost.fixed);
    collapse::plan(nodes, cost, scratch, leaf)
}

#[cfg(test)]
mod tests {
    use super::binary::tests::boxes;
    use super::*;
    use crate::layout::{ChildRef, NODE};
    use math::Vec3;

    const COST: LeafCost = LeafCost { max_items: 8, fixed: 1.0 };

    fn tree_of(n: u32, tree: TreeKind) -> (WideTree, Vec<Vec<u32>>) {
        let mut items = boxes(n, false);
        let (wide, leaves) = build(&mut items, &BuildOptions { tree }, &COST);
        (wide, leaves.iter().map(|l| l.of(&items).iter().map(Item::id).collect()).collect())
    }

    #[test]
    fn the_wide_tree_holds_every_item_once_within_its_boxes() {
        let n = 30_000;
        let boxes = boxes(n, false);
        for kind in TreeKind::ALL {
            let (tree, leaves) = tree_of(n, kind);
            let mut seen = vec![0; boxes.len()];
            let mut stack = vec![(tree.root, Bounds { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY })];
            let mut visited = 0;
            while let Some((r, within)) = stack.pop() {
                if r.is_node() {
                    visited += 1;
                    let node = &tree.nodes[r.index()];
                    for lane in (0..NODE).filter(|&l| node.children[l] != ChildRef::EMPTY) {
                        let at =
                            |i: usize| Vec3::from_array(std::array::from_fn(|a| node.planes[a][i][lane]));
                        let b = Bounds { min: at(0), max: at(1) };
                        assert!(b.min.cmpge(within.min).all() && b.max.cmple(within.max).all());
                        stack.push((node.children[lane], b));
                    }
                } else {
                    assert!(leaves[r.index()].len() <= 8);
                    for &id in &leaves[r.index()] {
                        let b = boxes[id as usize].bounds().to_bounds();
                        assert!(b.min.cmpge(within.min).all() && b.max.cmple(within.max).all());
                        seen[id as usize] += 1;
                    }
                }
            }
            assert!(seen.iter().all(|&n| n == 1), "{kind:?}");
            assert_eq!(visited, tree.nodes.len());
        }
    }

    #[test]
    fn the_tree_does_not_depend_on_the_number_of_threads() {
        for kind in TreeKind::ALL {
            let with = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| tree_of(150_000, kind))
            };
            let (one, leaves) = with(1);
            for threads in [2, 3, 8] {
                let (many, other_leaves) = with(threads);
                assert_eq!(one.root, many.root);
                assert_eq!(one.cost.to_bits(), many.cost.to_bits());
                assert!(leaves == other_leaves, "{kind:?}");
                assert_eq!(one.nodes.len(), many.nodes.len());
                for (a, b) in one.nodes.iter().zip(&many.nodes) {
                    assert!(a.planes == b.planes && a.children == b.children, "{kind:?}");
                }
            }
        }
    }
}
