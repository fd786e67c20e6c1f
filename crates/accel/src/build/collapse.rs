//! The cheapest wide tree that a binary tree can be collapsed to, by dynamic programming [Ylitie2017].
//!
//! `C(n, i)` is the least cost of the subtree `n` as a forest of at most `i` roots:
//!
//! - `C(n, 1) = min(leaf, A(n) + min_k C(left, k) + C(right, W − k))`
//! - `C(n, i) = min(C(n, i − 1), min_k C(left, k) + C(right, i − k))`
//!
//! with the area `A(n)` in place of the chance of a visit.

use super::LeafCost;
use super::binary::{BinaryNode, Box4, Item, children};
use crate::kernels::memory;
use crate::layout::{ChildRef, NODE, Node, WideTree};

/// Smaller subtrees are not worth a task.
const TASK: usize = 4096;

/// What is best for one subtree.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plan {
    /// `C(n, i + 1)`.
    cost: [f32; NODE - 1],
    /// Roots given to the left child when there are `i + 1`; 0: use one fewer. Entry 0: 0 means a leaf. Last entry: the
    /// children of a node here.
    left: [u8; NODE],
}

impl Plan {
    /// The cost of the whole subtree, times its area.
    pub(crate) fn total(&self) -> f32 {
        self.cost[0]
    }
}

/// The best plans for all subtrees.
pub(crate) fn plan(nodes: &[BinaryNode], cost: &LeafCost) -> Vec<Plan> {
    let mut plans = vec![Plan { cost: [0.0; NODE - 1], left: [0; NODE] }; nodes.len()];
    fill(nodes, &mut plans, cost);
    plans
}

fn fill(nodes: &[BinaryNode], plans: &mut [Plan], cost: &LeafCost) {
    let (area, count) = (nodes[0].bounds.half_area(), nodes[0].count as usize);
    let leaf = area * (cost.fixed + cost.per_item * count as f32);
    if count == 1 {
        plans[0].cost = [leaf; NODE - 1];
        return;
    }
    let (_, right) = children(nodes);
    let (here, below) = plans.split_at_mut(1);
    let (l, r) = below.split_at_mut(right - 1);
    if count > TASK {
        rayon::join(|| fill(&nodes[1..right], l, cost), || fill(&nodes[right..], r, cost));
    } else {
        fill(&nodes[1..right], l, cost);
        fill(&nodes[right..], r, cost);
    }
    here[0] = combine(&l[0].cost, &r[0].cost, area, (count <= cost.max_items).then_some(leaf));
}

fn combine(l: &[f32; NODE - 1], r: &[f32; NODE - 1], area: f32, leaf: Option<f32>) -> Plan {
    let mut plan = Plan { cost: [0.0; NODE - 1], left: [0; NODE] };
    let distribute = |roots: usize| {
        let mut best = (f32::INFINITY, 1);
        for k in 1..roots {
            let c = l[k - 1] + r[roots - k - 1];
            if c < best.0 {
                best = (c, k as u8);
            }
        }
        best
    };
    let (below, k) = distribute(NODE);
    plan.left[NODE - 1] = k;
    plan.cost[0] = area + below;
    plan.left[0] = 1;
    if let Some(leaf) = leaf
        && leaf <= plan.cost[0]
    {
        plan.cost[0] = leaf;
        plan.left[0] = 0;
    }
    for i in 2..NODE {
        let (c, k) = distribute(i);
        (plan.cost[i - 1], plan.left[i - 1]) =
            if c < plan.cost[i - 2] { (c, k) } else { (plan.cost[i - 2], 0) };
    }
    plan
}

/// A subtree by its position in the nodes and of its first item.
#[derive(Clone, Copy, Debug)]
struct Sub {
    node: usize,
    first: usize,
}

/// Reads a plan.
struct Reader<'a> {
    nodes: &'a [BinaryNode],
    plans: &'a [Plan],
}

impl Reader<'_> {
    fn is_leaf(&self, s: Sub) -> bool {
        self.nodes[s.node].count == 1 || self.plans[s.node].left[0] == 0
    }

    fn halves(&self, s: Sub) -> (Sub, Sub) {
        let n = self.nodes[s.node + 1].count as usize;
        (Sub { node: s.node + 1, first: s.first }, Sub { node: s.node + 2 * n, first: s.first + n })
    }

    /// The children of the wide node at `s`.
    fn wide_children(&self, s: Sub, out: &mut Vec<Sub>) {
        let k = usize::from(self.plans[s.node].left[NODE - 1]);
        let (l, r) = self.halves(s);
        self.roots(l, k, out);
        self.roots(r, NODE - k, out);
    }

    fn roots(&self, s: Sub, mut n: usize, out: &mut Vec<Sub>) {
        if self.nodes[s.node].count == 1 {
            return out.push(s);
        }
        while n > 1 && self.plans[s.node].left[n - 1] == 0 {
            n -= 1;
        }
        if n == 1 {
            return out.push(s);
        }
        let k = usize::from(self.plans[s.node].left[n - 1]);
        let (l, r) = self.halves(s);
        self.roots(l, k, out);
        self.roots(r, n - k, out);
    }
}

/// The size of a wide tree.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Size {
    /// Nodes on the longest way down.
    pub(crate) depth: usize,
    /// All inner nodes.
    pub(crate) nodes: usize,
}

/// The size of the tree that the plan stands for.
pub(crate) fn size(nodes: &[BinaryNode], plans: &[Plan]) -> Size {
    let reader = Reader { nodes, plans };
    let (mut stack, mut size) = (vec![(Sub { node: 0, first: 0 }, 0)], Size::default());
    let mut below = Vec::new();
    while let Some((s, depth)) = stack.pop() {
        size.depth = size.depth.max(depth);
        if !reader.is_leaf(s) {
            size.nodes += 1;
            below.clear();
            reader.wide_children(s, &mut below);
            stack.extend(below.iter().map(|&c| (c, depth + 1)));
        }
    }
    size
}

/// Writes the wide tree in preorder.
pub(crate) fn emit(
    nodes: &[BinaryNode],
    plans: &[Plan],
    items: &[Item],
    size: Size,
    leaf: &mut dyn FnMut(&[Item]) -> ChildRef,
) -> WideTree {
    let area = nodes[0].bounds.half_area();
    let cost = if area > 0.0 { plans[0].cost[0] / area } else { 0.0 };
    let mut writer =
        Writer { reader: Reader { nodes, plans }, items, leaf, out: memory::with_capacity(size.nodes) };
    let root = writer.write(Sub { node: 0, first: 0 });
    let nodes = writer.out;
    WideTree { nodes, root, cost }
}

struct Writer<'a> {
    reader: Reader<'a>,
    items: &'a [Item],
    leaf: &'a mut dyn FnMut(&[Item]) -> ChildRef,
    out: Vec<Node>,
}

impl Writer<'_> {
    fn write(&mut self, s: Sub) -> ChildRef {
        if self.reader.is_leaf(s) {
            let count = self.reader.nodes[s.node].count as usize;
            return (self.leaf)(&self.items[s.first..s.first + count]);
        }
        let mut below = Vec::with_capacity(NODE);
        self.reader.wide_children(s, &mut below);
        let area = |c: &Sub| self.reader.nodes[c.node].bounds.half_area();
        below.sort_by(|a, b| area(a).total_cmp(&area(b)));

        let at = self.out.len();
        self.out.push(Node::EMPTY);
        for (lane, &child) in below.iter().enumerate() {
            let Box4 { min, max } = self.reader.nodes[child.node].bounds;
            let reference = self.write(child);
            let node = &mut self.out[at];
            for axis in 0..3 {
                node.planes[axis][0][lane] = min[axis];
                node.planes[axis][1][lane] = max[axis];
            }
            node.children[lane] = reference;
        }
        ChildRef::node(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::sah;
    use math::{Bounds, Vec3};

    #[test]
    fn the_wide_tree_holds_every_item_once_within_its_boxes() {
        let r = |i: u32| math::hash::unit_f32(math::hash::mix32(i));
        let boxes: Vec<Bounds> = (0..3000)
            .map(|i| {
                let p = Vec3::new(r(3 * i), r(3 * i + 1), r(3 * i + 2));
                Bounds { min: p, max: p + 0.02 }
            })
            .collect();
        let mut items: Vec<Item> = boxes.iter().zip(0..).map(|(b, i)| Item::new(b, i, 0)).collect();
        let nodes = sah::build(&mut items, sah::Split::Binned);
        let cost = LeafCost { max_items: 8, fixed: 1.0, per_item: 0.0 };
        let plans = plan(&nodes, &cost);
        let mut leaves: Vec<Vec<u32>> = Vec::new();
        let tree = emit(&nodes, &plans, &items, size(&nodes, &plans), &mut |leaf| {
            leaves.push(leaf.iter().map(Item::id).collect());
            ChildRef::block(leaves.len() - 1)
        });
        let mut seen = vec![0; boxes.len()];
        let mut stack = vec![(tree.root, Bounds { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY })];
        while let Some((r, within)) = stack.pop() {
            if r.is_node() {
                let node = &tree.nodes[r.index()];
                for lane in (0..NODE).filter(|&l| node.children[l] != ChildRef::EMPTY) {
                    let at = |i: usize| Vec3::from_array(std::array::from_fn(|a| node.planes[a][i][lane]));
                    let b = Bounds { min: at(0), max: at(1) };
                    assert!(b.min.cmpge(within.min).all() && b.max.cmple(within.max).all());
                    stack.push((node.children[lane], b));
                }
            } else {
                assert!(leaves[r.index()].len() <= 8);
                for &id in &leaves[r.index()] {
                    let b = &boxes[id as usize];
                    assert!(b.min.cmpge(within.min).all() && b.max.cmple(within.max).all());
                    seen[id as usize] += 1;
                }
            }
        }
        assert!(seen.iter().all(|&n| n == 1));
        let size = size(&nodes, &plans);
        assert!(size.depth < 12 && size.nodes == tree.nodes.len());
    }
}
