//! Densities over directions everywhere in the scene: a binary tree over space with a [`Quadtree`] in every leaf, the
//! SD-tree [Mueller2017, sec. 3].

use std::collections::VecDeque;

use math::{Bounds, Dir, Point, Vec3};
use sampling::{Pdf, SolidAngle};
use serde::{Deserialize, Serialize};

use super::quadtree::Quadtree;

/// What is known of light in a leaf.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Leaf {
    pub(crate) tree: Quadtree,
    /// Probability of a direction by the BSDF.
    pub(crate) by_bsdf: f32,
    pub(crate) heard: Heard,
}

/// What a leaf was told in all rounds; when it is cut, each half counts for half of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Heard {
    /// Records.
    pub(crate) n: f64,
    /// Sum of what the tree has learned from.
    pub(crate) light: f64,
    /// Sum of estimates of reflected radiance, direct light left out.
    pub(crate) reflected: f64,
}

impl Heard {
    /// Mean reflected radiance, once enough is known.
    fn brightness(&self) -> Option<f32> {
        (self.n >= FEWEST_FOR_BRIGHTNESS && self.reflected > 0.0).then(|| (self.reflected / self.n) as f32)
    }

    fn halve(&mut self) {
        self.n *= 0.5;
        self.light *= 0.5;
        self.reflected *= 0.5;
    }
}

/// The SD-tree.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Field {
    corner: Vec3,
    side: f32,
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
}

/// Cuts go through the middle, along x, y, z in turn.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
enum Node {
    Cut { halves: [u32; 2] },
    Leaf(u32),
}

/// The leaf that a point lies in, and the leaf's size along the axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) leaf: usize,
    pub(crate) size: [f32; 3],
}

/// Most cuts on the way to a leaf: leaves of 2⁻¹⁴ of the scene.
const MAX_CUTS: u32 = 42;
/// A leaf with fewer records does not know how bright it is.
const FEWEST_FOR_BRIGHTNESS: f64 = 200.0;

impl Field {
    /// Nothing known.
    pub(crate) fn new(bounds: &Bounds) -> Self {
        let side = bounds.size().max_element();
        let leaf = Leaf { tree: Quadtree::uniform(), by_bsdf: 0.5, heard: Heard::default() };
        let side = if side.is_finite() && side > 0.0 { side } else { 1.0 };
        let corner = if bounds.is_empty() { Vec3::ZERO } else { bounds.min };
        Self { corner, side, nodes: vec![Node::Leaf(0)], leaves: vec![leaf] }
    }

    /// The density at a point.
    pub(crate) fn at(&self, p: Point) -> LocalGuide<'_> {
        let leaf = &self.leaves[self.place(p).leaf];
        LocalGuide { tree: &leaf.tree, by_bsdf: leaf.by_bsdf, brightness: leaf.heard.brightness() }
    }

    /// Where a point lies; one outside of the scene counts as on its edge.
    pub(crate) fn place(&self, p: Point) -> Place {
        let d = (p.0 - self.corner) / self.side;
        let mut at = [d.x, d.y, d.z].map(|x| x.clamp(0.0, 1.0_f32.next_down()));
        let (mut size, mut node, mut axis) = ([self.side; 3], 0_usize, 0_usize);
        loop {
            match self.nodes[node] {
                Node::Leaf(leaf) => return Place { leaf: leaf as usize, size },
                Node::Cut { halves } => {
                    at[axis] *= 2.0;
                    let upper = at[axis] >= 1.0;
                    at[axis] -= f32::from(u8::from(upper));
                    size[axis] *= 0.5;
                    node = halves[usize::from(upper)] as usize;
                    axis = (axis + 1) % 3;
                }
            }
        }
    }

    pub(crate) fn leaves(&self) -> &[Leaf] {
        &self.leaves
    }

    pub(crate) fn leaves_mut(&mut self) -> &mut [Leaf] {
        &mut self.leaves
    }

    /// Cuts leaves in which more than `limit` records were found until none has more, as far as `max_leaves` allows.
    /// Both halves know what the whole knew.
    pub(crate) fn cut(&mut self, counts: &[u64], limit: u64, max_leaves: usize) {
        let mut open = VecDeque::from([(0_usize, 0_u32, None)]);
        while let Some((node, depth, count)) = open.pop_front() {
            match self.nodes[node] {
                Node::Cut { halves } => {
                    open.extend(halves.map(|h| (h as usize, depth + 1, None)));
                }
                Node::Leaf(leaf) => {
                    let count: u64 = count.unwrap_or_else(|| counts.get(leaf as usize).copied().unwrap_or(0));
                    if count <= limit || self.leaves.len() >= max_leaves || depth >= MAX_CUTS {
                        continue;
                    }
                    let first = self.nodes.len() as u32;
                    self.nodes.extend([Node::Leaf(leaf), Node::Leaf(self.leaves.len() as u32)]);
                    self.leaves[leaf as usize].heard.halve();
                    self.leaves.push(self.leaves[leaf as usize].clone());
                    self.nodes[node] = Node::Cut { halves: [first, first + 1] };
                    open.extend([first, first + 1].map(|h| (h as usize, depth + 1, Some(count / 2))));
                }
            }
        }
    }
}

/// The density of one leaf, which a walk mixes with that of the BSDF.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalGuide<'a> {
    pub(crate) tree: &'a Quadtree,
    /// Probability of a direction by the BSDF.
    pub(crate) by_bsdf: f32,
    /// Mean radiance that surfaces here reflect, direct light left out; `None`: not known yet.
    pub(crate) brightness: Option<f32>,
}

impl LocalGuide<'_> {
    /// Density of the mixture in direction `w`, where that of the BSDF is `bsdf`.
    pub(crate) fn mixed(&self, bsdf: Pdf<SolidAngle>, w: Dir) -> Pdf<SolidAngle> {
        bsdf * self.by_bsdf + self.tree.pdf(w) * (1.0 - self.by_bsdf)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_are_cut_where_records_are_and_their_sizes_fill_the_scene() {
        let bounds = Bounds { min: Vec3::new(-1.0, 0.0, 2.0), max: Vec3::new(3.0, 1.0, 4.0) };
        let mut field = Field::new(&bounds);
        field.cut(&[1000], 130, 100);
        assert_eq!(field.leaves().len(), 8, "1000 → 8 × 125");
        let mut counts = [0; 8];
        counts[field.place(Point::new(-0.9, 0.1, 2.1)).leaf] = 200;
        field.cut(&counts, 130, 100);
        assert_eq!(field.leaves().len(), 9);
        let near = field.place(Point::new(-0.9, 0.1, 2.1));
        assert_eq!(near.size, [1.0, 2.0, 2.0]);
        assert_eq!(field.place(Point::new(2.9, 3.0, 5.9)).size, [2.0; 3]);
        assert_ne!(near.leaf, field.place(Point::new(0.1, 0.1, 2.1)).leaf);
        assert_eq!(near.leaf, field.place(Point::new(-50.0, -1.0, f32::NAN)).leaf, "outside is on the edge");
        field.cut(&[u64::MAX; 9], 1, 20);
        assert_eq!(field.leaves().len(), 20, "no more than there is room for");
    }
}
