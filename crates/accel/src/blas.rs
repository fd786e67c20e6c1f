//! A tree over geometries in one space.

use math::Bounds;
use rayon::prelude::*;

use crate::build::{self, BuildOptions, Item, Leaf, LeafCost};
use crate::error::BuildError;
use crate::geometry::{Geometry, Shape};
use crate::hit::{Best, Hit};
use crate::kernels::memory;
use crate::layout::{ChildRef, FILTER_BIT, MAX_ITEMS, MixedLeaf, Node, TriBlock, WIDTH, WideTree};
use crate::numbering::Numbering;
use crate::primitive::{self, Curve, MovingTriangle, PIECES, Primitive, triangle};
use crate::ray_space;

/// A leaf of eight triangles costs about a node visit; from 0.7 to 2.0 the speed is the same within noise.
const LEAF_COST: LeafCost = LeafCost { max_items: WIDTH, fixed: 1.0 };

/// The bottom level: many geometries, one tree.
#[derive(Clone, Debug)]
pub struct Blas {
    pub(crate) tree: WideTree,
    pub(crate) blocks: Vec<TriBlock>,
    pub(crate) mixed: Vec<MixedLeaf>,
    pub(crate) others: Vec<Other>,
    pub(crate) curves: Vec<Curve>,
    pub(crate) bounds: Bounds,
    /// See [`ray_space::reach`].
    pub(crate) reach: f32,
    numbering: Numbering,
    skipped: usize,
}

/// A primitive that is no triangle at rest.
#[derive(Clone, Debug)]
pub(crate) struct Other {
    pub(crate) bounds: Bounds,
    /// Item number with [`FILTER_BIT`].
    pub(crate) tagged: u32,
    pub(crate) primitive: Primitive,
}

/// Takes what is no triangle at rest.
struct Sink<'a> {
    others: &'a mut Vec<Other>,
    items: &'a mut Vec<Item>,
    /// [`FILTER_BIT`] or 0.
    tag: u32,
    geometry: u32,
}

impl Sink<'_> {
    /// Keeps the primitive unless it is out of reach.
    fn put(&mut self, item: u32, bounds: Bounds, primitive: Primitive) {
        if bounds.min.abs().max(bounds.max.abs()).max_element() < 1e18 {
            self.others.push(Other { bounds, tagged: item | self.tag, primitive });
            self.items.push(Item::new(&bounds, item, self.geometry));
        }
    }

    fn put_curves(&mut self, curves: &[Curve], first: u32, kept: &mut Vec<Curve>) {
        for (c, i) in curves.iter().zip(0..).filter(|(c, _)| !c.is_degenerate()) {
            let curve = kept.len() as u32;
            kept.push(*c);
            for piece in 0..PIECES {
                let primitive = Primitive::CurvePiece { curve, piece };
                self.put(first + i * PIECES + piece, c.piece_bounds(piece), primitive);
            }
        }
    }
}

/// What a [`Blas`] consists of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BlasStats {
    /// Triangles at rest.
    pub triangles: usize,
    /// Other primitives, a curve counting once per piece.
    pub others: usize,
    /// Left out: without area, or with coordinates that are not finite (or beyond 10¹⁸).
    pub skipped: usize,
    /// Inner nodes.
    pub nodes: usize,
    /// Blocks of up to eight triangles.
    pub blocks: usize,
    /// Expected node visits of a random ray, by the surface area heuristic.
    pub sah_cost: f32,
    /// Size in memory.
    pub bytes: usize,
}

impl Default for Blas {
    /// Nothing in it.
    fn default() -> Self {
        Self {
            tree: WideTree::default(),
            blocks: Vec::new(),
            mixed: Vec::new(),
            others: Vec::new(),
            curves: Vec::new(),
            bounds: Bounds::EMPTY,
            reach: 0.0,
            numbering: Numbering::default(),
            skipped: 0,
        }
    }
}

impl Blas {
    /// Builds on the threads of the current rayon pool. Primitives without area or with coordinates that are not finite
    /// are left out and counted.
    pub fn build(geometries: &[Geometry<'_>], options: &BuildOptions) -> Result<Self, BuildError> {
        let mut blas = Self::default();
        let total = blas.number(geometries)?;
        let mut items: Vec<Item> = memory::with_capacity(total);
        for (geometry, i) in geometries.iter().zip(0..) {
            blas.gather(geometry, i, &mut items)?;
        }
        blas.skipped = total - items.len();
        blas.bounds = build::bounds(&items);
        blas.reach = ray_space::reach(&blas.bounds);

        let (tree, leaves) = build::build(&mut items, options, &LEAF_COST);
        blas.tree = tree;
        if blas.others.is_empty() {
            let filled = leaves.par_iter().map(|leaf| blas.fill(leaf.of(&items), geometries));
            let mut blocks = memory::with_capacity(leaves.len());
            filled.collect_into_vec(&mut blocks);
            blas.blocks = blocks;
        } else {
            blas.fill_mixed(&items, &leaves, geometries);
        }
        Ok(blas)
    }

    /// Numbers all items; returns how many there are.
    fn number(&mut self, geometries: &[Geometry<'_>]) -> Result<usize, BuildError> {
        let mut total = 0_usize;
        for geometry in geometries {
            let (count, stride) = match geometry.shape {
                Shape::Mesh { indices, .. } | Shape::MovingMesh { indices, .. } => (indices.len(), 1),
                Shape::PatchMesh { indices, .. } => (indices.len(), 1),
                Shape::Sphere(_) | Shape::Disk(_) | Shape::Cylinder(_) => (1, 1),
                Shape::Curves(curves) => (curves.len(), PIECES),
            };
            self.numbering.push(total as u32, stride);
            total += count * stride as usize;
            if total >= MAX_ITEMS {
                return Err(BuildError::TooManyPrimitives(total));
            }
        }
        self.numbering.finish(total as u32);
        Ok(total)
    }

    /// Appends the items of one geometry.
    fn gather(
        &mut self,
        geometry: &Geometry<'_>,
        index: u32,
        items: &mut Vec<Item>,
    ) -> Result<(), BuildError> {
        let first = self.numbering.first(index);
        let tag = if geometry.needs_filter { FILTER_BIT } else { 0 };
        let mut sink = Sink { others: &mut self.others, items, tag, geometry: index };
        match geometry.shape {
            Shape::Mesh { positions, indices } => {
                check(index, indices, positions.len())?;
                let item = |(face, i): (&[u32; 3], u32)| {
                    let p = face.map(|v| positions[v as usize]);
                    let bounds = p.iter().fold(Bounds::EMPTY, |b, &q| b.grow(q));
                    let is_degenerate = triangle::is_degenerate(&p.map(|q| q.to_array()));
                    if is_degenerate { Item::NONE } else { Item::new(&bounds, first + i, index) }
                };
                let before = items.len();
                items.par_extend(indices.par_iter().zip(0..indices.len() as u32).map(item));
                if items[before..].par_iter().any(Item::is_none) {
                    let kept: Vec<Item> = items.drain(before..).filter(|i| !i.is_none()).collect();
                    items.extend(kept);
                }
            }
            Shape::MovingMesh { positions: [start, end], times, indices } => {
                if start.len() != end.len() {
                    return Err(BuildError::KeysDiffer {
                        geometry: index,
                        start: start.len(),
                        end: end.len(),
                    });
                }
                check(index, indices, start.len())?;
                for (face, i) in indices.iter().zip(first..) {
                    let keys = [start, end].map(|key| face.map(|v| key[v as usize].to_array()));
                    let moving = MovingTriangle { keys, times };
                    if !moving.is_degenerate() {
                        sink.put(i, moving.bounds(), Primitive::Moving(Box::new(moving)));
                    }
                }
            }
            Shape::PatchMesh { positions, indices } => {
                check(index, indices, positions.len())?;
                for (face, i) in indices.iter().zip(first..) {
                    let p = face.map(|v| positions[v as usize]);
                    if !primitive::patch_is_degenerate(&p) {
                        sink.put(i, primitive::patch_bounds(&p), Primitive::Patch(Box::new(p)));
                    }
                }
            }
            Shape::Sphere(s) if s.is_degenerate() => {}
            Shape::Disk(d) if d.is_degenerate() => {}
            Shape::Cylinder(c) if c.is_degenerate() => {}
            Shape::Sphere(s) => sink.put(first, s.bounds(), Primitive::Sphere(Box::new(*s))),
            Shape::Disk(d) => sink.put(first, d.bounds(), Primitive::Disk(Box::new(*d))),
            Shape::Cylinder(c) => sink.put(first, c.bounds(), Primitive::Cylinder(Box::new(*c))),
            Shape::Curves(curves) => sink.put_curves(curves, first, &mut self.curves),
        }
        Ok(())
    }

    /// A block of those among the items that are triangles at rest.
    fn fill(&self, items: &[Item], geometries: &[Geometry<'_>]) -> TriBlock {
        let mut block = TriBlock::EMPTY;
        let mut lane = 0;
        for item in items {
            let geometry = &geometries[item.geometry() as usize];
            let Shape::Mesh { positions, indices } = geometry.shape else { continue };
            let face = indices[(item.id() - self.numbering.first(item.geometry())) as usize];
            for (corner, v) in block.v.iter_mut().zip(face) {
                let p = positions[v as usize].to_array();
                for (lanes, x) in corner.iter_mut().zip(p) {
                    lanes[lane] = x;
                }
            }
            block.items[lane] = item.id() | if geometry.needs_filter { FILTER_BIT } else { 0 };
            lane += 1;
        }
        block
    }

    /// Fills the leaves where not all items are triangles at rest.
    fn fill_mixed(&mut self, items: &[Item], leaves: &[Leaf], geometries: &[Geometry<'_>]) {
        let all_others = std::mem::take(&mut self.others);
        let is_triangle = |i: &Item| matches!(geometries[i.geometry() as usize].shape, Shape::Mesh { .. });
        let mut with_block = Vec::new();
        let mut references = Vec::with_capacity(leaves.len());
        for leaf in leaves {
            let held = leaf.of(items);
            let mut reference = ChildRef::EMPTY;
            if held.iter().any(is_triangle) {
                reference = ChildRef::block(with_block.len());
                with_block.push(*leaf);
            }
            let first = self.others.len() as u32;
            let of_item =
                |i: &Item| all_others.binary_search_by_key(&i.id(), |o| o.tagged & !FILTER_BIT).ok();
            self.others.extend(held.iter().filter_map(of_item).map(|at| all_others[at].clone()));
            let count = self.others.len() as u32 - first;
            if count > 0 {
                self.mixed.push(MixedLeaf { block: reference, first, count });
                reference = ChildRef::mixed(self.mixed.len() - 1);
            }
            references.push(reference);
        }
        self.tree.refer(|leaf| references[leaf]);
        self.blocks = with_block.par_iter().map(|leaf| self.fill(leaf.of(items), geometries)).collect();
    }

    /// Begins to load what stands behind a reference.
    #[inline(always)]
    pub(crate) fn fetch(&self, child: ChildRef) {
        if child.is_block() {
            memory::fetch(self.blocks.as_ptr().wrapping_add(child.index()));
        } else if child.is_node() {
            memory::fetch(self.tree.nodes.as_ptr().wrapping_add(child.index()));
        }
    }

    /// The hit that a candidate stands for.
    #[inline(always)]
    pub(crate) fn hit(&self, best: &Best) -> Hit {
        let (geometry, primitive) = self.numbering.locate(best.item);
        Hit { t: best.t, u: best.u, v: best.v, instance: best.instance, geometry, primitive }
    }

    /// The box around everything.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Bytes in memory.
    #[must_use]
    pub fn memory(&self) -> usize {
        self.tree.nodes.len() * size_of::<Node>()
            + self.blocks.len() * size_of::<TriBlock>()
            + self.mixed.len() * size_of::<MixedLeaf>()
            + self.others.iter().map(|o| size_of::<Other>() + o.primitive.heap()).sum::<usize>()
            + self.curves.len() * size_of::<Curve>()
            + self.numbering.memory()
    }

    /// What it consists of.
    #[must_use]
    pub fn stats(&self) -> BlasStats {
        let in_block = |b: &TriBlock| b.v[0][0].iter().filter(|x| !x.is_nan()).count();
        BlasStats {
            triangles: self.blocks.iter().map(in_block).sum(),
            others: self.others.len(),
            skipped: self.skipped,
            nodes: self.tree.nodes.len(),
            blocks: self.blocks.len(),
            sah_cost: self.tree.cost,
            bytes: self.memory(),
        }
    }
}

/// Do all faces name vertices that exist?
fn check<const N: usize>(geometry: u32, indices: &[[u32; N]], len: usize) -> Result<(), BuildError> {
    let bad = |face: &[u32; N]| face.iter().any(|&v| v as usize >= len);
    match indices.par_iter().position_first(bad) {
        None => Ok(()),
        Some(at) => {
            let index = indices[at].iter().copied().find(|&v| v as usize >= len).unwrap_or_default();
            Err(BuildError::IndexOutOfRange { geometry, primitive: at as u32, index, len })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use math::Vec3;

    fn corners(p: [[f32; 3]; 3]) -> Vec<Vec3> {
        p.map(Vec3::from_array).to_vec()
    }

    #[test]
    fn an_index_out_of_range_is_an_error_that_names_it() {
        let p = corners([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let mesh = Shape::Mesh { positions: &p, indices: &[[0, 1, 2], [0, 7, 1]] };
        let e = Blas::build(&[Geometry::opaque(mesh)], &BuildOptions::default()).unwrap_err();
        assert_eq!(e, BuildError::IndexOutOfRange { geometry: 0, primitive: 1, index: 7, len: 3 });
        assert_eq!(e.to_string(), "geometry 0: primitive 1 uses vertex 7, but there are only 3 vertices");
    }

    #[test]
    fn degenerate_triangles_are_left_out_and_counted() {
        let mut p = corners([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        p.extend([Vec3::NAN, Vec3::INFINITY, Vec3::new(2.0, 0.0, 0.0)]);
        let indices = [[0, 1, 2], [0, 0, 1], [0, 1, 3], [0, 1, 4], [0, 1, 5]];
        let mesh = Shape::Mesh { positions: &p, indices: &indices };
        let blas = Blas::build(&[Geometry::opaque(mesh)], &BuildOptions::default()).unwrap();
        let stats = blas.stats();
        assert_eq!((stats.triangles, stats.skipped), (1, 4));
        assert!(blas.bounds().max == Vec3::new(1.0, 1.0, 0.0));
    }
}
