//! Where light comes from, learned from paths: the SD-tree and how it is taught.

mod field;
mod quadtree;
mod records;

pub(crate) use field::{Field, LocalGuide};
pub(crate) use records::{Record, RecordedPath, Step, Teacher};

/// Bytes of a leaf of space at its largest.
pub(crate) const LEAF_BYTES: usize = quadtree::Quadtree::most_bytes();
