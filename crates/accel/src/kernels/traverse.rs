//! Traversal of the 8-wide tree, generic over the lanes.
//!
//! Nearest hit: children are visited by entry distance; the stack holds 64-bit keys with the distance (never negative,
//! so its bits are ordered) in the upper half. Any hit: in the order of the slots, biggest box first.
#![allow(unsafe_code, reason = "an uninitialised stack; see each SAFETY note")]

use std::mem::MaybeUninit;

use math::{Ray, Vec3};

use super::lanes::Lanes;
use crate::accel::Accel;
use crate::blas::Blas;
use crate::hit::{Best, Hit, NO_INSTANCE};
use crate::layout::{ChildRef, FILTER_BIT, Node8, TriBlock, WIDTH, WideTree};
use crate::primitive::triangle;
use crate::ray_space::{EXIT_SCALE, RaySpace};

/// Wide nodes on a way down that the stack has room for.
pub(crate) const MAX_DEPTH: usize = 64;
const STACK: usize = MAX_DEPTH * (WIDTH - 1) + WIDTH + 1;

/// A ray in registers, for boxes.
struct SlabRay<L> {
    o: [L; 3],
    o_far: [L; 3],
    inv: [L; 3],
    near: [usize; 3],
    pad: L,
}

impl<L: Lanes> SlabRay<L> {
    #[inline(always)]
    fn new(r: &RaySpace) -> Self {
        Self {
            o: r.o.map(L::splat),
            o_far: r.o_far.map(L::splat),
            inv: r.inv.map(L::splat),
            near: r.near,
            pad: L::splat(r.pad),
        }
    }

    /// The boxes met before `t_max`, and where they are entered. The operations of [`RaySpace::slab`].
    #[inline(always)]
    fn boxes(&self, planes: [[L; 2]; 3], t_max: f32) -> (u32, L, L) {
        let near = |i: usize| planes[i][0].sub(self.o[i]).mul(self.inv[i]);
        let far = |i: usize| planes[i][1].sub(self.o_far[i]).mul(self.inv[i]);
        let entry = near(0).max(near(1)).max(near(2)).max(L::splat(0.0));
        let exit = far(0).min(far(1)).min(far(2)).mul(L::splat(EXIT_SCALE)).add(self.pad);
        (entry.le(exit.min(L::splat(t_max))), entry, exit)
    }

    #[inline(always)]
    fn node(&self, node: &Node8, t_max: f32) -> (u32, L) {
        let planes = std::array::from_fn(|i| {
            let near = self.near[i] & 1;
            [L::load(&node.planes[i][near]), L::load(&node.planes[i][near ^ 1])]
        });
        let (mask, entry, _) = self.boxes(planes, t_max);
        (mask, entry)
    }
}

/// Candidates in a block of triangles.
struct Candidates {
    mask: u32,
    entry: [f32; WIDTH],
    exit: [f32; WIDTH],
}

/// Lanes whose triangle the ray's line may pass through, and whose box it meets before `t_max`.
#[inline(always)]
fn block_candidates<L: Lanes>(
    ray: &RaySpace,
    slab: &SlabRay<L>,
    block: &TriBlock,
    t_max: f32,
) -> Option<Candidates> {
    let [kx, ky, kz] = ray.k;
    let corner = |v: usize| {
        let z = L::load(&block.v[v][kz]).sub(L::splat(ray.o[kz]));
        let shear = |axis: usize, s: f32| {
            L::load(&block.v[v][axis]).sub(L::splat(ray.o[axis])).sub(L::splat(s).mul(z))
        };
        [shear(kx, ray.shear[0]), shear(ky, ray.shear[1])]
    };
    let [a, b, c] = [corner(0), corner(1), corner(2)];
    let cross = |p: [L; 2], q: [L; 2]| p[0].mul(q[1]).sub(p[1].mul(q[0]));
    let (u, v, w) = (cross(c, b), cross(a, c), cross(b, a));
    let zero = L::splat(0.0);
    let mask = zero.le(u.min(v).min(w)) | u.max(v).max(w).le(zero);
    if mask == 0 {
        return None;
    }

    let planes = std::array::from_fn(|i| {
        let p = |v: usize| L::load(&block.v[v][i]);
        let (lower, upper) = (p(0).min(p(1)).min(p(2)), p(0).max(p(1)).max(p(2)));
        if ray.near[i] == 0 { [lower, upper] } else { [upper, lower] }
    });
    let (met, entry, exit) = slab.boxes(planes, t_max);
    let mask = mask & met;
    if mask == 0 {
        return None;
    }
    let mut found = Candidates { mask, entry: [0.0; WIDTH], exit: [0.0; WIDTH] };
    entry.store(&mut found.entry);
    exit.store(&mut found.exit);
    Some(found)
}

/// Visits the leaves that the ray meets, until the tree is exhausted or (`ANY`) something is found.
#[inline(always)]
fn leaves<L: Lanes, const ANY: bool>(
    tree: &WideTree,
    slab: &SlabRay<L>,
    best: &mut Best,
    leaf: &mut impl FnMut(ChildRef, &mut Best),
) {
    let mut stack = [MaybeUninit::<u64>::uninit(); STACK];
    let mut height = 0;
    let mut now = tree.root;
    if now == ChildRef::EMPTY {
        return;
    }
    loop {
        if now.is_node() {
            let node = &tree.nodes[now.index()];
            let (mut mask, entry) = slab.node(node, best.t);
            if mask != 0 {
                let mut distance = [0.0; WIDTH];
                if !ANY {
                    entry.store(&mut distance);
                }
                let base = height;
                while mask != 0 {
                    let lane = mask.trailing_zeros() as usize;
                    mask &= mask - 1;
                    let mut key = u64::from(node.children[lane].0);
                    if !ANY {
                        key |= u64::from(distance[lane].to_bits()) << 32;
                    }
                    // Insert: farthest at the bottom.
                    let mut at = height;
                    if !ANY {
                        while at > base {
                            // SAFETY: entries below `height` were written.
                            let below = unsafe { stack[at - 1].assume_init() };
                            if below >= key {
                                break;
                            }
                            stack[at].write(below);
                            at -= 1;
                        }
                    }
                    stack[at].write(key);
                    height += 1;
                }
            }
        } else {
            leaf(now, best);
            if ANY && best.found {
                return;
            }
        }
        // The next that is not behind the best hit.
        loop {
            if height == 0 {
                return;
            }
            height -= 1;
            // SAFETY: entries below the old `height` were written.
            let key = unsafe { stack[height].assume_init() };
            if ANY || f32::from_bits((key >> 32) as u32) <= best.t {
                now = ChildRef(key as u32);
                break;
            }
        }
    }
}

/// What is the same for all leaves of one structure.
struct Visit<'a> {
    blas: &'a Blas,
    ray: &'a RaySpace,
    instance: u32,
    /// No hit lies before this.
    entry: f32,
}

impl Visit<'_> {
    /// Takes the candidate if it is better and the filter agrees.
    #[inline(always)]
    fn offer<F: FnMut(&Hit) -> bool>(
        &self,
        tagged: u32,
        (t, u, v): (f32, f32, f32),
        best: &mut Best,
        filter: &mut F,
    ) {
        let item = tagged & !FILTER_BIT;
        let at = if t > self.entry { t } else { self.entry };
        if !(t > 0.0 && best.loses_to(at, self.instance, item)) {
            return;
        }
        let candidate = Best { t: at, instance: self.instance, item, u, v, found: true };
        if tagged & FILTER_BIT == 0 || filter(&self.blas.hit(&candidate)) {
            *best = candidate;
        }
    }

    #[inline(always)]
    fn block<L: Lanes, F: FnMut(&Hit) -> bool>(
        &self,
        slab: &SlabRay<L>,
        block: &TriBlock,
        best: &mut Best,
        filter: &mut F,
    ) {
        let Some(c) = block_candidates(self.ray, slab, block, best.t) else { return };
        let mut mask = c.mask;
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            if let Some(hit) = triangle::finish(self.ray, &block.corners(lane), c.entry[lane], c.exit[lane]) {
                self.offer(block.items[lane], hit, best, filter);
            }
        }
    }

    /// Primitives that are no triangles at rest.
    #[inline(never)]
    fn others<F: FnMut(&Hit) -> bool>(&self, range: std::ops::Range<usize>, best: &mut Best, filter: &mut F) {
        for other in &self.blas.others[range] {
            let (entry, exit) = self.ray.slab(&other.bounds);
            if !(entry <= exit && entry <= best.t) {
                continue;
            }
            for root in other.primitive.roots(&self.blas.curves, self.ray).into_iter().flatten() {
                if root.t > 0.0 {
                    let t = triangle::clamp(root.t, entry, exit);
                    self.offer(other.tagged, (t, root.u, root.v), best, filter);
                }
            }
        }
    }

    #[inline(always)]
    fn run<L: Lanes, const ANY: bool, F: FnMut(&Hit) -> bool>(&self, best: &mut Best, filter: &mut F) {
        let slab = SlabRay::<L>::new(self.ray);
        leaves::<L, ANY>(&self.blas.tree, &slab, best, &mut |leaf, best| {
            if leaf.is_block() {
                self.block(&slab, &self.blas.blocks[leaf.index()], best, filter);
                return;
            }
            let mixed = self.blas.mixed[leaf.index()];
            if mixed.block != ChildRef::EMPTY {
                self.block(&slab, &self.blas.blocks[mixed.block.index()], best, filter);
            }
            self.others(mixed.first as usize..(mixed.first + mixed.count) as usize, best, filter);
        });
    }
}

/// The nearest hit, or any if `ANY`.
#[inline(always)]
pub(super) fn trace<L: Lanes, const ANY: bool, F>(accel: &Accel, ray: &Ray, filter: &mut F) -> Best
where
    F: FnMut(&Hit) -> bool,
{
    let mut best = Best::nothing(ray.t_max);
    if !(ray.t_max > 0.0) {
        return best;
    }
    let (o, d): (Vec3, Vec3) = (ray.origin.0, ray.dir.0);
    if let Some(local) = RaySpace::new(o, d, ray.time, &accel.world.bounds) {
        let visit = Visit { blas: &accel.world, ray: &local, instance: NO_INSTANCE, entry: 0.0 };
        visit.run::<L, ANY, F>(&mut best, filter);
        if accel.placed.is_empty() || (ANY && best.found) {
            return best;
        }
    }
    instances::<L, ANY, F>(accel, ray, &mut best, filter);
    best
}

#[inline(always)]
fn instances<L: Lanes, const ANY: bool, F: FnMut(&Hit) -> bool>(
    accel: &Accel,
    ray: &Ray,
    best: &mut Best,
    filter: &mut F,
) {
    let (o, d): (Vec3, Vec3) = (ray.origin.0, ray.dir.0);
    let Some(outer) = RaySpace::new(o, d, ray.time, &accel.top_bounds) else { return };
    let slab = SlabRay::<L>::new(&outer);
    leaves::<L, ANY>(&accel.top, &slab, best, &mut |leaf, best| {
        let placed = &accel.placed[leaf.index()];
        let (entry, exit) = outer.slab(&placed.bounds);
        if !(entry <= exit && entry <= best.t) {
            return;
        }
        let blas = &accel.objects[placed.object as usize];
        let (o, d) = placed.to_object(o, d, ray.time);
        if let Some(local) = RaySpace::new(o, d, ray.time, &blas.bounds) {
            let visit = Visit { blas, ray: &local, instance: leaf.index() as u32, entry };
            visit.run::<L, ANY, F>(best, filter);
        }
    });
}
