//! From boxes to a wide tree: a binary tree first, then the cheapest wide one that it can be collapsed to.

mod binary;
mod collapse;
mod ploc;
mod sah;

pub(crate) use binary::Item;

use binary::BinaryNode;
use collapse::Plan;

use crate::layout::{ChildRef, WideTree};

/// Deeper trees would overrun the stack of the kernels; they are built anew by halving.
const MAX_DEPTH: usize = crate::kernels::MAX_DEPTH;

/// How the binary tree is made. All give the same hits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TreeKind {
    /// Both of the next two; the one with the lower cost is kept.
    #[default]
    Best,
    /// Top down, by the surface area heuristic over 32 bins [Wald2007].
    BinnedSah,
    /// Bottom up, by merging neighbours [Meister2018].
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
    /// For each leaf.
    pub(crate) fixed: f32,
    /// For each item.
    pub(crate) per_item: f32,
}

/// Builds a tree over `items`, which it reorders; `leaf` is told of every leaf, in order, and says how to refer to it.
pub(crate) fn build(
    items: &mut [Item],
    options: &BuildOptions,
    cost: &LeafCost,
    leaf: &mut dyn FnMut(&[Item]) -> ChildRef,
) -> WideTree {
    if items.is_empty() {
        return WideTree { nodes: Vec::new(), root: ChildRef::EMPTY, cost: 0.0 };
    }
    let plan = match options.tree {
        TreeKind::BinnedSah => Planned::new(sah::build(items, sah::Split::Binned), cost),
        TreeKind::Ploc => Planned::new(ploc::build(items), cost),
        TreeKind::Halves => Planned::new(sah::build(items, sah::Split::Halves), cost),
        TreeKind::Best => {
            let mut others = items.to_vec();
            let (a, b) = rayon::join(
                || Planned::new(sah::build(items, sah::Split::Binned), cost),
                || Planned::new(ploc::build(&mut others), cost),
            );
            if b.cost() < a.cost() {
                items.copy_from_slice(&others);
                b
            } else {
                a
            }
        }
    };
    let (plan, size) = match collapse::size(&plan.nodes, &plan.plans) {
        size if size.depth <= MAX_DEPTH => (plan, size),
        _ => {
            let plan = Planned::new(sah::build(items, sah::Split::Halves), cost);
            let size = collapse::size(&plan.nodes, &plan.plans);
            (plan, size)
        }
    };
    collapse::emit(&plan.nodes, &plan.plans, items, size, leaf)
}

/// A binary tree and how to collapse it.
struct Planned {
    nodes: Vec<BinaryNode>,
    plans: Vec<Plan>,
}

impl Planned {
    fn new(nodes: Vec<BinaryNode>, cost: &LeafCost) -> Self {
        let plans = collapse::plan(&nodes, cost);
        Self { nodes, plans }
    }

    fn cost(&self) -> f32 {
        self.plans[0].total()
    }
}
