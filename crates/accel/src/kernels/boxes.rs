//! A ray against the boxes of a node, and against the triangles of a block and their boxes, all lanes at once.
#![allow(unsafe_code, reason = "unchecked indices; see each SAFETY note")]

use super::lanes::Lanes;
use super::stream::Beam;
use crate::layout::{NODE, Node, TriBlock, WIDTH};
use crate::ray_space::RaySpace;

/// Where a node has the lower (0) or upper (1) planes of an axis.
#[inline(always)]
fn plane_at(axis: usize, upper: usize) -> usize {
    (2 * axis + upper) * NODE
}

/// `N` numbers of a nested array, from its `at`-th on. (With an index in place of `at`, each access would be multiplied
/// and checked.)
///
/// # Safety
///
/// `T` is an array of arrays of `f32` with at least `at + N` of them in all.
#[inline(always)]
pub(super) unsafe fn numbers<T, const N: usize>(all: &T, at: usize) -> &[f32; N] {
    let first: *const f32 = std::ptr::from_ref(all).cast();
    // SAFETY: the contract is that these are within `all`.
    unsafe { &*first.add(at).cast() }
}

/// A ray, or what bounds several, in registers, for nodes.
pub(super) struct NodeRay<L> {
    // For a ray the two are the same.
    inv_near: [L; 3],
    inv_far: [L; 3],
    c_near: [L; 3],
    c_far: [L; 3],
    /// Where a node has its near and far planes, as numbers from its start.
    near: [usize; 3],
    far: [usize; 3],
}

/// A ray for blocks of triangles: where a block has the coordinates along each axis (numbers from the start of a corner),
/// and the origin along each.
#[derive(Clone, Copy)]
pub(super) struct BlockRay {
    k: [usize; 3],
    o_k: [f32; 3],
}

#[inline(always)]
fn splat3<L: Lanes<NODE>>(v: &[f32; 4]) -> [L; 3] {
    [L::splat(v[0]), L::splat(v[1]), L::splat(v[2])]
}

// No closures on lanes here, and no `array::map`: a closure is a function without the kernel's target features, and
// what is not inlined into the kernel falls back to calls.
impl<L: Lanes<NODE>> NodeRay<L> {
    #[inline(always)]
    pub(super) fn new(r: &RaySpace) -> Self {
        let inv = splat3(&r.inv);
        let up = |i: usize| (r.negative >> i & 1) as usize;
        Self {
            inv_near: inv,
            inv_far: inv,
            c_near: splat3(&r.c_near),
            c_far: splat3(&r.c_far),
            near: [plane_at(0, up(0)), plane_at(1, up(1)), plane_at(2, up(2))],
            far: [plane_at(0, 1 - up(0)), plane_at(1, 1 - up(1)), plane_at(2, 1 - up(2))],
        }
    }

    #[inline(always)]
    pub(super) fn around(r: &Beam) -> Self {
        let up = |i: usize| (r.negative >> i & 1) as usize;
        Self {
            inv_near: splat3(&r.inv_near),
            inv_far: splat3(&r.inv_far),
            c_near: splat3(&r.c_near),
            c_far: splat3(&r.c_far),
            near: [plane_at(0, up(0)), plane_at(1, up(1)), plane_at(2, up(2))],
            far: [plane_at(0, 1 - up(0)), plane_at(1, 1 - up(1)), plane_at(2, 1 - up(2))],
        }
    }
}

impl BlockRay {
    #[inline(always)]
    pub(super) fn new(r: &RaySpace) -> Self {
        let k = [(r.k[0] & 3) as usize, (r.k[1] & 3) as usize, (r.k[2] & 3) as usize];
        Self { k: [k[0] * WIDTH, k[1] * WIDTH, k[2] * WIDTH], o_k: [r.o[k[0]], r.o[k[1]], r.o[k[2]]] }
    }
}

/// The boxes met before `t_max`, their entries and exits. The operations of [`RaySpace::slab`].
#[inline(always)]
pub(super) fn meet<const N: usize, L: Lanes<N>>(x: (L, L), y: (L, L), z: (L, L), t_max: L) -> (u32, L, L) {
    let entry = x.0.max(y.0).max(z.0.max(L::splat(0.0)));
    let (a, b) = (x.1.min(y.1), z.1);
    (entry.le(a.min(b.min(t_max))), entry, a.min(b))
}

impl<L: Lanes<NODE>> NodeRay<L> {
    /// Where one axis's near and far planes are met.
    #[inline(always)]
    fn axis(&self, i: usize, node: &Node) -> (L, L) {
        // SAFETY: these are places of `plane_at`.
        let (near, far) =
            unsafe { (numbers(&node.planes, self.near[i]), numbers(&node.planes, self.far[i])) };
        let (near, far) = (L::load(near), L::load(far));
        (near.mul_add(self.inv_near[i], self.c_near[i]), far.mul_add(self.inv_far[i], self.c_far[i]))
    }

    /// The children met before `t_max`, and where.
    #[inline(always)]
    pub(super) fn meet(&self, node: &Node, t_max: f32) -> (u32, L) {
        let (x, y, z) = (self.axis(0, node), self.axis(1, node), self.axis(2, node));
        let (mask, entry, _) = meet(x, y, z, L::splat(t_max));
        (mask, entry)
    }
}

/// Where one axis's near and far planes of the triangles' boxes are met.
#[inline(always)]
fn block_axis<L: Lanes<WIDTH>>(ray: &RaySpace, i: usize, block: &TriBlock) -> (L, L) {
    let (a, b, c) = (L::load(&block.v[0][i]), L::load(&block.v[1][i]), L::load(&block.v[2][i]));
    let (inv, c_near, c_far) = (L::splat(ray.inv[i]), L::splat(ray.c_near[i]), L::splat(ray.c_far[i]));
    // As rounding is monotone, the planes need not be sorted first.
    let (x, y) = (a.min(b).min(c), a.max(b).max(c));
    (x.mul_add(inv, c_near).min(y.mul_add(inv, c_near)), x.mul_add(inv, c_far).max(y.mul_add(inv, c_far)))
}

/// One corner of all triangles, seen along the ray. The operations of [`RaySpace::sheared`].
#[inline(always)]
fn sheared<L: Lanes<WIDTH>>(ray: &RaySpace, at: &BlockRay, block: &TriBlock, vertex: usize) -> (L, L) {
    let corner = &block.v[vertex];
    // SAFETY: each of `k` is the place of the coordinates along an axis, see `BlockRay::new`.
    let (x, y, z) = unsafe { (numbers(corner, at.k[0]), numbers(corner, at.k[1]), numbers(corner, at.k[2])) };
    let z = L::load(z).sub(L::splat(at.o_k[2]));
    let x = z.mul_add(L::splat(ray.shear[0]), L::load(x).sub(L::splat(at.o_k[0])));
    let y = z.mul_add(L::splat(ray.shear[1]), L::load(y).sub(L::splat(at.o_k[1])));
    (x, y)
}

/// Candidates in a block of triangles.
pub(super) struct Candidates {
    pub(super) mask: u32,
    /// Of those, the ones that are hit for sure.
    pub(super) sure: u32,
    pub(super) entry: [f32; WIDTH],
    pub(super) exit: [f32; WIDTH],
}

#[inline(always)]
pub(super) fn cross<const N: usize, L: Lanes<N>>(p: (L, L), q: (L, L)) -> L {
    p.0.mul(q.1).sub(p.1.mul(q.0))
}

/// Lanes whose triangle the ray's line may pass through, and whose box it meets before `t_max`.
#[inline(always)]
pub(super) fn block_candidates<L: Lanes<WIDTH>>(
    ray: &RaySpace,
    at: &BlockRay,
    block: &TriBlock,
    t_max: f32,
) -> Option<Candidates> {
    let a: (L, L) = sheared(ray, at, block, 0);
    let (b, c) = (sheared(ray, at, block, 1), sheared(ray, at, block, 2));
    let (u, v, w) = (cross(c, b), cross(a, c), cross(b, a));
    let zero = L::splat(0.0);
    let (least, most) = (u.min(v).min(w), u.max(v).max(w));
    let mask = zero.le(least) | most.le(zero);
    if mask == 0 {
        return None;
    }

    let (x, y, z) = (block_axis::<L>(ray, 0, block), block_axis(ray, 1, block), block_axis(ray, 2, block));
    let (met, entry, exit) = meet(x, y, z, L::splat(t_max));
    let mask = mask & met;
    if mask == 0 {
        return None;
    }
    // Not on an edge or corner: then `0 ≤ least` and `least ≤ 0` are not both true.
    let sure = !(least.le(zero) & zero.le(most));
    let mut found = Candidates { mask, sure, entry: [0.0; WIDTH], exit: [0.0; WIDTH] };
    entry.store(&mut found.entry);
    exit.store(&mut found.exit);
    Some(found)
}

/// What is found once for a block and a beam.
#[repr(C, align(64))]
pub(super) struct BlockBeam {
    /// The boxes of the triangles: `planes[axis][0]` the lower, `planes[axis][1]` the upper.
    pub(super) planes: [[[f32; WIDTH]; 2]; 3],
    /// The corners seen from the rays' origin, if they have it in common.
    pub(super) v: [[[f32; WIDTH]; 3]; 3],
}

impl BlockBeam {
    #[inline(always)]
    pub(super) fn of<L: Lanes<WIDTH>>(block: &TriBlock, beam: &Beam) -> Self {
        let mut found = Self { planes: [[[0.0; WIDTH]; 2]; 3], v: [[[0.0; WIDTH]; 3]; 3] };
        for (i, [lower, upper]) in found.planes.iter_mut().enumerate() {
            let (a, b, c) = (L::load(&block.v[0][i]), L::load(&block.v[1][i]), L::load(&block.v[2][i]));
            a.min(b).min(c).store(lower);
            a.max(b).max(c).store(upper);
            if let Some(o) = beam.origin {
                let o = L::splat(o[i]);
                a.sub(o).store(&mut found.v[0][i]);
                b.sub(o).store(&mut found.v[1][i]);
                c.sub(o).store(&mut found.v[2][i]);
            }
        }
        found
    }

    #[inline(always)]
    fn axis<L: Lanes<WIDTH>>(&self, i: usize, beam: &Beam) -> (L, L) {
        let up = (beam.negative >> i & 1) as usize;
        let (near, far) = (L::load(&self.planes[i][up]), L::load(&self.planes[i][1 - up]));
        let (inv_near, inv_far) = (L::splat(beam.inv_near[i]), L::splat(beam.inv_far[i]));
        (near.mul_add(inv_near, L::splat(beam.c_near[i])), far.mul_add(inv_far, L::splat(beam.c_far[i])))
    }

    /// The triangles whose boxes a ray of the beam may meet before `t_max`.
    #[inline(always)]
    pub(super) fn meet<L: Lanes<WIDTH>>(&self, beam: &Beam, t_max: f32) -> u32 {
        // Unused lanes are no numbers.
        let is_used = L::load(&self.planes[0][0]).le(L::load(&self.planes[0][1]));
        let (x, y, z) = (self.axis::<L>(0, beam), self.axis(1, beam), self.axis(2, beam));
        is_used & meet(x, y, z, L::splat(t_max)).0
    }
}
