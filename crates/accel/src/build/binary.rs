//! Items and binary trees over them.

use glam::Vec4;
use math::{Bounds, Vec3};

use super::collapse::Plan;

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

    /// Stands for what is left out.
    pub(crate) const NONE: Self = Self { min: Vec4::NAN, max: Vec4::NAN };

    pub(crate) fn is_none(&self) -> bool {
        self.min.x.is_nan()
    }

    /// The same box with other numbers.
    #[inline]
    pub(crate) fn numbered(b: &Box4, id: u32, geometry: u32) -> Self {
        let with = |v: Vec4, n: u32| Vec4::new(v.x, v.y, v.z, f32::from_bits(ID_BASE.wrapping_add(n)));
        Self { min: with(b.min, id), max: with(b.max, geometry) }
    }

    #[inline]
    pub(crate) fn id(&self) -> u32 {
        self.min.w.to_bits().wrapping_sub(ID_BASE)
    }

    #[inline]
    pub(crate) fn geometry(&self) -> u32 {
        self.max.w.to_bits().wrapping_sub(ID_BASE)
    }

    #[inline]
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

/// The place of a node or of an item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Place(u32);

impl Place {
    const ITEM: u32 = 1 << 31;

    pub(crate) fn node(at: usize) -> Self {
        Self(at as u32)
    }

    pub(crate) fn item(at: usize) -> Self {
        Self(at as u32 | Self::ITEM)
    }

    #[inline]
    pub(crate) fn is_item(self) -> bool {
        self.0 & Self::ITEM != 0
    }

    #[inline]
    pub(crate) fn index(self) -> usize {
        (self.0 & !Self::ITEM) as usize
    }

    /// Moved by `by`.
    #[inline]
    pub(crate) fn offset(self, by: usize) -> Self {
        Self(self.0 + by as u32)
    }
}

/// An inner node of a binary tree. The items below it are neighbours.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BinaryNode {
    pub(crate) min: [f32; 3],
    pub(crate) max: [f32; 3],
    pub(crate) children: [Place; 2],
    /// The first item below.
    pub(crate) first: u32,
    /// Items below.
    pub(crate) count: u32,
    /// How to collapse it.
    pub(crate) plan: Plan,
}

impl BinaryNode {
    pub(crate) const NONE: Self =
        Self { min: [0.0; 3], max: [0.0; 3], children: [Place(0); 2], first: 0, count: 0, plan: Plan::NONE };

    #[inline]
    pub(crate) fn new(bounds: &Box4, children: [Place; 2], first: usize, count: usize) -> Self {
        let three = |v: Vec4| [v.x, v.y, v.z];
        let (min, max) = (three(bounds.min), three(bounds.max));
        Self { min, max, children, first: first as u32, count: count as u32, plan: Plan::NONE }
    }

    /// A node whose subtree is in preorder and begins at `at`, and whose items begin at `first`, as many of them on each side.
    #[inline]
    pub(crate) fn in_preorder(bounds: &Box4, at: usize, first: usize, [left, right]: [usize; 2]) -> Self {
        let place =
            |n: usize, node: usize, item: usize| if n == 1 { Place::item(item) } else { Place::node(node) };
        let children = [place(left, at + 1, first), place(right, at + left, first + left)];
        Self::new(bounds, children, first, left + right)
    }

    /// Moved to other places: nodes by `at`, items by `first`.
    pub(crate) fn offset(mut self, at: usize, first: usize) -> Self {
        self.children = self.children.map(|c| c.offset(if c.is_item() { first } else { at }));
        self.first += first as u32;
        self
    }

    #[inline]
    pub(crate) fn half_area(&self) -> f32 {
        let d: [f32; 3] = std::array::from_fn(|axis| (self.max[axis] - self.min[axis]).max(0.0));
        d[0] * d[1] + d[1] * d[2] + d[2] * d[0]
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Is this a tree over these items?
    pub(crate) fn check(root: Place, nodes: &[BinaryNode], items: &[Item]) {
        fn walk(place: Place, nodes: &[BinaryNode], items: &[Item], next: &mut usize) -> Box4 {
            if place.is_item() {
                assert_eq!(place.index(), *next);
                *next += 1;
                return items[place.index()].bounds();
            }
            let node = &nodes[place.index()];
            assert_eq!(node.first as usize, *next);
            let [a, b] = node.children.map(|c| walk(c, nodes, items, next));
            assert_eq!((node.first + node.count) as usize, *next);
            let all = a.union(b);
            assert_eq!(all.to_bounds(), Bounds { min: node.min.into(), max: node.max.into() });
            all
        }
        let mut next = 0;
        walk(root, nodes, items, &mut next);
        assert_eq!(next, items.len());
        let mut ids: Vec<u32> = items.iter().map(Item::id).collect();
        ids.sort_unstable();
        assert!(ids.iter().copied().eq(0..items.len() as u32));
    }

    /// Small boxes at random, or many at the same places.
    pub(crate) fn boxes(n: u32, grid: bool) -> Vec<Item> {
        let r = |i: u32| math::hash::unit_f32(math::hash::mix32(i));
        (0..n)
            .map(|i| {
                let p = Vec3::new(r(3 * i), r(3 * i + 1), r(3 * i + 2));
                let p = if grid { (p * 4.0).floor() } else { p };
                Item::new(&Bounds { min: p, max: p + 0.01 }, i, 0)
            })
            .collect()
    }

    #[test]
    fn items_carry_their_numbers() {
        let b = Bounds { min: Vec3::ZERO, max: Vec3::ONE };
        let item = Item::new(&b, (1 << 30) - 1, 12345);
        assert_eq!((item.id(), item.geometry()), ((1 << 30) - 1, 12345));
        assert_eq!(item.bounds().to_bounds(), b);
        assert_eq!(item.bounds().half_area(), 3.0);
    }
}
