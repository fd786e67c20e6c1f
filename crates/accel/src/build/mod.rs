//! From boxes to a wide tree: a binary tree first, then the cheapest 8-wide one that it can be collapsed to.

mod binary;
mod collapse;
mod sah;

pub(crate) use binary::Item;

use crate::layout::{ChildRef, WideTree};

/// Deeper trees would overrun the stack of the kernels; they are built anew by halving.
const MAX_DEPTH: usize = crate::kernels::MAX_DEPTH;

/// How the binary tree is made. All give the same hits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TreeKind {
    /// Top down, by the surface area heuristic over 32 bins [Wald2007].
    #[default]
    BinnedSah,
    /// Halves of equal number: quick and shallow, but slow to trace.
    Halves,
}

impl TreeKind {
    /// All kinds.
    pub const ALL: [Self; 2] = [Self::BinnedSah, Self::Halves];
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
    let nodes = match options.tree {
        TreeKind::BinnedSah => sah::build(items, sah::Split::Binned),
        TreeKind::Halves => sah::build(items, sah::Split::Halves),
    };
    let plan = collapse::plan(&nodes, cost);
    let plan = if collapse::depth(&nodes, &plan) <= MAX_DEPTH {
        (nodes, plan)
    } else {
        let nodes = sah::build(items, sah::Split::Halves);
        let plan = collapse::plan(&nodes, cost);
        (nodes, plan)
    };
    collapse::emit(&plan.0, &plan.1, items, leaf)
}
