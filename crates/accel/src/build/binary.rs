//! Items and binary trees over them.
//!
//! A subtree of `n` items has `2n − 1` nodes and is stored in preorder: its left child follows it at once, and the right
//! child follows the left subtree. So both nodes and items of any subtree are slices.

use glam::Vec4;
use math::{Bounds, Vec3};

/// A box with a number. The number rides in the fourth lane of `min`, which every operation here ignores.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct Item {
    min: Vec4,
    max: Vec4,
}

/// Makes the bits of an id those of a normal float, so that no arithmetic on the lane is slow.
const ID_BASE: u32 = 0x4000_0000;

impl Item {
    pub(crate) fn new(b: &Bounds, id: u32, geometry: u32) -> Self {
        Self {
            min: b.min.extend(f32::from_bits(ID_BASE + id)),
            max: b.max.extend(f32::from_bits(ID_BASE + geometry)),
        }
    }

    pub(crate) fn id(&self) -> u32 {
        self.min.w.to_bits() - ID_BASE
    }

    pub(crate) fn geometry(&self) -> u32 {
        self.max.w.to_bits() - ID_BASE
    }

    pub(crate) fn bounds(&self) -> Box4 {
        Box4 { min: self.min, max: self.max }
    }

    /// Twice the centre.
    #[inline]
    pub(crate) fn center2(&self) -> Vec4 {
        self.min + self.max
    }
}

/// A box in registers of four lanes; the fourth means nothing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Box4 {
    pub(crate) min: Vec4,
    pub(crate) max: Vec4,
}

impl Box4 {
    pub(crate) const EMPTY: Self = Self { min: Vec4::INFINITY, max: Vec4::NEG_INFINITY };

    #[inline]
    pub(crate) fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    #[inline]
    pub(crate) fn grow(self, p: Vec4) -> Self {
        Self { min: self.min.min(p), max: self.max.max(p) }
    }

    /// Half the surface; zero for the empty box.
    #[inline]
    pub(crate) fn half_area(&self) -> f32 {
        let d = (self.max - self.min).max(Vec4::ZERO);
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    pub(crate) fn to_bounds(self) -> Bounds {
        let three = |v: Vec4| Vec3::new(v.x, v.y, v.z);
        Bounds { min: three(self.min), max: three(self.max) }
    }
}

/// A node of a binary tree in preorder.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BinaryNode {
    pub(crate) bounds: Box4,
    /// Items below it; 1 means a leaf.
    pub(crate) count: u32,
}

impl BinaryNode {
    pub(crate) const NONE: Self = Self { bounds: Box4::EMPTY, count: 0 };
}

/// Positions of the children of an inner node at position 0 of its subtree's slice.
#[inline]
pub(crate) fn children(nodes: &[BinaryNode]) -> (usize, usize) {
    (1, 2 * nodes[1].count as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_carry_their_numbers() {
        let b = Bounds { min: Vec3::ZERO, max: Vec3::ONE };
        let item = Item::new(&b, (1 << 30) - 1, 12345);
        assert_eq!((item.id(), item.geometry()), ((1 << 30) - 1, 12345));
        assert_eq!(item.bounds().to_bounds(), b);
        assert_eq!(item.bounds().half_area(), 3.0);
    }
}
