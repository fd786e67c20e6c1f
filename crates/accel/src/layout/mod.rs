//! What traversal reads: plain, flat arrays.
//!
//! | record     | bytes | holds |
//! |------------|------:|-------|
//! | [`Node`]   |   448 | sixteen boxes in full precision, by axis, and sixteen [`ChildRef`]s |
//! | [`TriBlock`] | 320 | up to eight triangles, by coordinate, and their item numbers |
//! | [`MixedLeaf`] | 12 | a block and a range of other primitives |

use rayon::prelude::*;

use crate::primitive::Corners;

/// Children of a node.
pub(crate) const NODE: usize = 16;
/// Triangles of a block.
pub(crate) const WIDTH: usize = 8;
/// Item numbers and references have 30 bits.
pub(crate) const MAX_ITEMS: usize = 1 << 30;
/// Set in an item number if hits go through the filter.
pub(crate) const FILTER_BIT: u32 = 1 << 31;

/// A tagged index: the upper two bits say of what.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub(crate) struct ChildRef(pub(crate) u32);

impl ChildRef {
    const TAG: u32 = 3 << 30;
    const BLOCK: u32 = 1 << 30;
    const MIXED: u32 = 2 << 30;
    /// No child.
    pub(crate) const EMPTY: Self = Self(u32::MAX);

    pub(crate) fn node(i: usize) -> Self {
        Self(i as u32)
    }

    pub(crate) fn block(i: usize) -> Self {
        Self(i as u32 | Self::BLOCK)
    }

    pub(crate) fn mixed(i: usize) -> Self {
        Self(i as u32 | Self::MIXED)
    }

    #[inline(always)]
    pub(crate) fn is_node(self) -> bool {
        self.0 & Self::TAG == 0
    }

    #[inline(always)]
    pub(crate) fn is_block(self) -> bool {
        self.0 & Self::TAG == Self::BLOCK
    }

    #[inline(always)]
    pub(crate) fn index(self) -> usize {
        (self.0 & !Self::TAG) as usize
    }
}

/// An inner node. An unused slot has an empty box, which no ray meets.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Node {
    /// `planes[axis][0]` the lower, `planes[axis][1]` the upper, one lane per child.
    pub(crate) planes: [[[f32; NODE]; 2]; 3],
    /// Biggest box last, so that it is the first off the stack when any hit will do.
    pub(crate) children: [ChildRef; NODE],
}

impl Node {
    pub(crate) const EMPTY: Self = Self {
        planes: [[[f32::INFINITY; NODE], [f32::NEG_INFINITY; NODE]]; 3],
        children: [ChildRef::EMPTY; NODE],
    };
}

/// Up to eight triangles. Unused lanes are NaN, which no ray meets.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct TriBlock {
    /// `v[vertex][axis][lane]`.
    pub(crate) v: [[[f32; WIDTH]; 3]; 3],
    /// Item numbers, with [`FILTER_BIT`].
    pub(crate) items: [u32; WIDTH],
}

impl TriBlock {
    pub(crate) const EMPTY: Self = Self { v: [[[f32::NAN; WIDTH]; 3]; 3], items: [0; WIDTH] };
}

/// One triangle of a block. The lane is below [`WIDTH`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lane<'a>(pub(crate) &'a TriBlock, pub(crate) usize);

impl Corners for Lane<'_> {
    #[inline(always)]
    fn coordinate(self, vertex: usize, axis: usize) -> f32 {
        self.0.v[vertex][axis][self.1 & (WIDTH - 1)]
    }
}

/// A leaf that holds more than triangles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MixedLeaf {
    /// A block, or [`ChildRef::EMPTY`].
    pub(crate) block: ChildRef,
    /// Range in the list of other primitives.
    pub(crate) first: u32,
    /// Its length.
    pub(crate) count: u32,
}

/// A tree of [`Node`] whose leaves mean what their owner says.
#[derive(Clone, Debug)]
pub(crate) struct WideTree {
    pub(crate) nodes: Vec<Node>,
    pub(crate) root: ChildRef,
    /// Expected cost of a random ray (in node visits), by the surface area heuristic.
    pub(crate) cost: f32,
}

impl Default for WideTree {
    /// Nothing in it.
    fn default() -> Self {
        Self { nodes: Vec::new(), root: ChildRef::EMPTY, cost: 0.0 }
    }
}

impl WideTree {
    /// Refers to what `of` says in place of the blocks of these numbers.
    pub(crate) fn refer(&mut self, of: impl Fn(usize) -> ChildRef + Sync) {
        let change = |r: &mut ChildRef| {
            if r.is_block() {
                *r = of(r.index());
            }
        };
        self.nodes.par_iter_mut().for_each(|node| node.children.iter_mut().for_each(change));
        change(&mut self.root);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_have_the_sizes_of_the_table() {
        assert_eq!(size_of::<Node>(), 448);
        assert_eq!(size_of::<TriBlock>(), 320);
        assert_eq!(size_of::<MixedLeaf>(), 12);
    }

    #[test]
    fn references_keep_kind_and_index() {
        assert!(ChildRef::node(7).is_node() && ChildRef::block(7).is_block());
        assert!(!ChildRef::mixed(7).is_node() && !ChildRef::mixed(7).is_block());
        assert!(!ChildRef::EMPTY.is_node() && !ChildRef::EMPTY.is_block());
        for r in [ChildRef::node(7), ChildRef::block(7), ChildRef::mixed(7)] {
            assert_eq!(r.index(), 7);
        }
    }
}
