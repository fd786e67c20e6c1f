//! The ray kernel: BVH construction and traversal, usable alone.
