//! Writes the wide tree that the plans of a binary tree stand for.
//!
//! Big nodes first, then the subtrees below them one after the other, each in preorder and written by one task.

use rayon::prelude::*;

use super::binary::{BinaryNode, Box4, Item, Place};
use crate::kernels::memory;
use crate::layout::{ChildRef, NODE, Node, WideTree};

/// Smaller subtrees are written by one task.
const TASK: usize = 1 << 13;

/// A range of items.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Leaf {
    pub(crate) first: u32,
    pub(crate) count: u32,
}

impl Leaf {
    pub(crate) fn of<'a>(&self, items: &'a [Item]) -> &'a [Item] {
        &items[self.first as usize..(self.first + self.count) as usize]
    }
}

/// A binary tree with plans.
#[derive(Clone, Copy)]
pub(crate) struct Reader<'a> {
    pub(crate) nodes: &'a [BinaryNode],
    pub(crate) items: &'a [Item],
}

/// Up to [`NODE`] places.
#[derive(Clone, Copy)]
struct Places {
    places: [Place; NODE],
    len: usize,
}

impl Places {
    fn push(&mut self, p: Place) {
        self.places[self.len] = p;
        self.len += 1;
    }

    fn as_slice(&self) -> &[Place] {
        &self.places[..self.len]
    }
}

impl Reader<'_> {
    fn is_leaf(&self, p: Place) -> bool {
        p.is_item() || self.nodes[p.index()].plan.is_leaf()
    }

    fn leaf(&self, p: Place) -> Leaf {
        if p.is_item() {
            return Leaf { first: p.index() as u32, count: 1 };
        }
        let node = &self.nodes[p.index()];
        Leaf { first: node.first, count: node.count }
    }

    fn bounds(&self, p: Place) -> ([f32; 3], [f32; 3]) {
        if p.is_item() {
            let Box4 { min, max } = self.items[p.index()].bounds();
            return ([min.x, min.y, min.z], [max.x, max.y, max.z]);
        }
        let node = &self.nodes[p.index()];
        (node.min, node.max)
    }

    fn half_area(&self, p: Place) -> f32 {
        let (min, max) = self.bounds(p);
        let d: [f32; 3] = std::array::from_fn(|axis| max[axis] - min[axis]);
        d[0] * d[1] + d[1] * d[2] + d[2] * d[0]
    }

    /// The children of the wide node at `p`.
    fn wide_children(&self, p: Place) -> Places {
        let node = &self.nodes[p.index()];
        let mut out = Places { places: [Place::node(0); NODE], len: 0 };
        let k = node.plan.left(NODE);
        self.roots(node.children[0], k, &mut out);
        self.roots(node.children[1], NODE - k, &mut out);
        out
    }

    /// The same, the smallest first.
    fn sorted_children(&self, p: Place) -> Places {
        let mut out = self.wide_children(p);
        let mut areas = [0.0; NODE];
        for (area, &p) in areas.iter_mut().zip(out.as_slice()) {
            *area = self.half_area(p);
        }
        for i in 1..out.len {
            let mut at = i;
            while at > 0 && areas[at] < areas[at - 1] {
                areas.swap(at, at - 1);
                out.places.swap(at, at - 1);
                at -= 1;
            }
        }
        out
    }

    fn roots(&self, p: Place, mut n: usize, out: &mut Places) {
        if p.is_item() {
            return out.push(p);
        }
        let node = &self.nodes[p.index()];
        while n > 1 && node.plan.left(n) == 0 {
            n -= 1;
        }
        if n == 1 {
            return out.push(p);
        }
        let k = node.plan.left(n);
        self.roots(node.children[0], k, out);
        self.roots(node.children[1], n - k, out);
    }

    fn size(&self, root: Place) -> Size {
        let (mut stack, mut size) = (vec![(root, 0)], Size::default());
        while let Some((p, depth)) = stack.pop() {
            size.depth = size.depth.max(depth);
            if self.is_leaf(p) {
                size.leaves += 1;
            } else {
                size.nodes += 1;
                stack.extend(self.wide_children(p).as_slice().iter().map(|&c| (c, depth + 1)));
            }
        }
        size
    }

    fn node(&self, children: &Places, refer: impl FnMut(Place) -> ChildRef) -> Node {
        let mut node = Node::EMPTY;
        for (lane, &child) in children.as_slice().iter().enumerate() {
            let (min, max) = self.bounds(child);
            for axis in 0..3 {
                node.planes[axis][0][lane] = min[axis];
                node.planes[axis][1][lane] = max[axis];
            }
        }
        let places = children.as_slice().iter().copied();
        node.children.iter_mut().zip(places.map(refer)).for_each(|(to, r)| *to = r);
        node
    }
}

/// The size of a wide tree.
#[derive(Clone, Copy, Debug, Default)]
struct Size {
    /// Nodes on the longest way down.
    depth: usize,
    /// All inner nodes.
    nodes: usize,
    leaves: usize,
}

/// Writes the tree below `root`, of the given cost times area, or nothing if it is deeper than `max_depth`. The reference to a leaf is that to the block
/// with its number.
pub(crate) fn emit(
    reader: Reader<'_>,
    root: Place,
    cost: f32,
    max_depth: usize,
) -> Option<(WideTree, Vec<Leaf>)> {
    let mut big = Big { reader, nodes: Vec::new(), chunks: Vec::new() };
    big.visit(root, 0);
    let Big { nodes: big, chunks, .. } = big;
    let sizes: Vec<Size> = chunks.par_iter().map(|c| reader.size(c.root)).collect();
    if chunks.iter().zip(&sizes).any(|(c, s)| c.depth + s.depth > max_depth) {
        return None;
    }

    // Where each chunk begins.
    let (mut at_node, mut at_leaf) = (big.len(), 0);
    let mut starts = Vec::with_capacity(chunks.len());
    for size in &sizes {
        starts.push((at_node, at_leaf));
        at_node += size.nodes;
        at_leaf += size.leaves;
    }
    let mut nodes = memory::filled(at_node, Node::EMPTY);
    let mut leaves = vec![Leaf::default(); at_leaf];
    let refer = |target: Target| match target {
        Target::Big(at) => ChildRef::node(at),
        Target::Chunk(c) if sizes[c].nodes == 0 => ChildRef::block(starts[c].1),
        Target::Chunk(c) => ChildRef::node(starts[c].0),
    };

    let (first, mut rest) = nodes.split_at_mut(big.len());
    for (to, (children, targets)) in first.iter_mut().zip(&big) {
        let mut targets = targets.iter();
        *to = reader.node(children, |_| targets.next().map_or(ChildRef::EMPTY, |&t| refer(t)));
    }
    let mut rest_of_leaves = leaves.as_mut_slice();
    let mut tasks = Vec::with_capacity(chunks.len());
    for ((chunk, size), &(first_node, first_leaf)) in chunks.iter().zip(&sizes).zip(&starts) {
        let (nodes, leaves);
        (nodes, rest) = rest.split_at_mut(size.nodes);
        (leaves, rest_of_leaves) = rest_of_leaves.split_at_mut(size.leaves);
        tasks.push((
            chunk.root,
            Writer { reader, nodes, leaves, first_node, first_leaf, at_node: 0, at_leaf: 0 },
        ));
    }
    tasks.par_iter_mut().for_each(|(root, writer)| {
        writer.write(*root);
    });
    let area = reader.half_area(root);
    let cost = if area > 0.0 { cost / area } else { 0.0 };
    let root = if big.is_empty() { refer(Target::Chunk(0)) } else { ChildRef::node(0) };
    Some((WideTree { nodes, root, cost }, leaves))
}

/// A child of a big node.
#[derive(Clone, Copy)]
enum Target {
    Big(usize),
    Chunk(usize),
}

/// A subtree that one task writes.
struct Chunk {
    root: Place,
    depth: usize,
}

/// Finds the big nodes, in preorder.
struct Big<'a> {
    reader: Reader<'a>,
    nodes: Vec<(Places, Vec<Target>)>,
    chunks: Vec<Chunk>,
}

impl Big<'_> {
    fn visit(&mut self, p: Place, depth: usize) -> Target {
        if self.reader.is_leaf(p) || self.reader.leaf(p).count as usize <= TASK {
            self.chunks.push(Chunk { root: p, depth });
            return Target::Chunk(self.chunks.len() - 1);
        }
        let (at, children) = (self.nodes.len(), self.reader.sorted_children(p));
        self.nodes.push((children, Vec::new()));
        let targets = children.as_slice().iter().map(|&c| self.visit(c, depth + 1)).collect();
        self.nodes[at].1 = targets;
        Target::Big(at)
    }
}

/// Writes one chunk.
struct Writer<'a> {
    reader: Reader<'a>,
    nodes: &'a mut [Node],
    leaves: &'a mut [Leaf],
    first_node: usize,
    first_leaf: usize,
    at_node: usize,
    at_leaf: usize,
}

impl Writer<'_> {
    fn write(&mut self, p: Place) -> ChildRef {
        if self.reader.is_leaf(p) {
            self.leaves[self.at_leaf] = self.reader.leaf(p);
            self.at_leaf += 1;
            return ChildRef::block(self.first_leaf + self.at_leaf - 1);
        }
        let at = self.at_node;
        self.at_node += 1;
        let (reader, children) = (self.reader, self.reader.sorted_children(p));
        self.nodes[at] = reader.node(&children, |child| self.write(child));
        ChildRef::node(self.first_node + at)
    }
}
