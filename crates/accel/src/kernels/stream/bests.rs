//! The best candidates of sixteen rays.

use math::Ray;

use super::rays::{RAYS, Rays, Row, axes};
use crate::accel::Accel;
use crate::blas::Blas;
use crate::hit::{Best, Hit, NOWHERE, place};
use crate::kernels::lanes::Lanes;
use crate::layout::WIDTH;

/// No block.
const NO_BLOCK: u32 = u32::MAX;

/// What a [`Best`] holds, for sixteen rays.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Bests {
    pub(super) t: Row,
    instance: [u32; RAYS],
    item: [u32; RAYS],
    /// The triangle, as [`place`] has it; or [`NO_BLOCK`].
    block: [u32; RAYS],
    slot: [u32; RAYS],
    u: Row,
    v: Row,
    /// A bit for each ray that found something.
    pub(super) found: u32,
}

/// A triangle that rays may have met.
#[derive(Clone, Copy)]
pub(super) struct Met {
    pub(super) instance: u32,
    pub(super) item: u32,
    pub(super) block: u32,
    pub(super) slot: u32,
}

impl Bests {
    /// Nothing yet, and nothing can beat it.
    pub(super) const NOTHING: Self = Self {
        t: [-1.0; RAYS],
        instance: [0; RAYS],
        item: [0; RAYS],
        block: [NO_BLOCK; RAYS],
        slot: [0; RAYS],
        u: [0.0; RAYS],
        v: [0.0; RAYS],
        found: 0,
    };

    /// Nothing yet: only `t < t_max` beats it.
    #[inline(always)]
    pub(super) fn clear(&mut self, rays: &[Ray]) {
        self.t = [-1.0; RAYS];
        self.instance = [0; RAYS];
        self.item = [0; RAYS];
        self.block = [NO_BLOCK; RAYS];
        self.found = 0;
        for (t, ray) in self.t.iter_mut().zip(rays) {
            *t = ray.t_max;
        }
    }

    #[inline(always)]
    pub(super) fn get(&self, i: usize) -> Best {
        let i = i & (RAYS - 1);
        let at = if self.block[i] == NO_BLOCK {
            NOWHERE
        } else {
            place(self.block[i] as usize, self.slot[i] as usize)
        };
        let found = self.found >> i & 1 != 0;
        let (u, v) = (self.u[i], self.v[i]);
        Best { t: self.t[i], instance: self.instance[i], item: self.item[i], u, v, place: at, found }
    }

    #[inline(always)]
    pub(super) fn set(&mut self, i: usize, best: &Best) {
        let i = i & (RAYS - 1);
        self.t[i] = best.t;
        self.instance[i] = best.instance;
        self.item[i] = best.item;
        self.block[i] = if best.place == NOWHERE { NO_BLOCK } else { (best.place >> 3) as u32 };
        self.slot[i] = (best.place & 7) as u32;
        self.u[i] = best.u;
        self.v[i] = best.v;
        self.found = self.found & !(1 << i) | u32::from(best.found) << i;
    }

    /// Rays with `t_max > 0`.
    #[inline(always)]
    pub(super) fn ahead(&self) -> u32 {
        let mut mask = 0;
        for i in 0..RAYS {
            mask |= u32::from(self.t[i] > 0.0) << i;
        }
        mask
    }

    /// The largest `t` of some rays; less than 0 if there are none.
    #[inline(always)]
    pub(super) fn farthest<L: Lanes<RAYS>>(&self, among: u32) -> f32 {
        L::load(&self.t).keep(among, L::splat(-1.0)).most()
    }

    /// Those of the rays in the mask that meet the triangle at `t` before what they have take it. The rule of
    /// `Visit::offer` and [`Best::loses_to`]; no hit lies before `floor`.
    #[inline(always)]
    pub(super) fn take(&mut self, mask: u32, t: &Row, floor: &Row, met: Met) {
        let mut taken = [0_u32; RAYS];
        for i in 0..RAYS {
            let at = if t[i] > floor[i] { t[i] } else { floor[i] };
            let before = (met.instance < self.instance[i])
                | ((met.instance == self.instance[i]) & (met.item < self.item[i]));
            let is_better = (at < self.t[i]) | ((at == self.t[i]) & before);
            let takes = (mask >> i & 1 != 0) & (t[i] > 0.0) & is_better;
            taken[i] = u32::from(takes) << i;
            self.t[i] = if takes { at } else { self.t[i] };
            self.instance[i] = if takes { met.instance } else { self.instance[i] };
            self.item[i] = if takes { met.item } else { self.item[i] };
            self.block[i] = if takes { met.block } else { self.block[i] };
            self.slot[i] = if takes { met.slot } else { self.slot[i] };
        }
        for bit in taken {
            self.found |= bit;
        }
    }

    /// Fills in `u` and `v` of the triangles of one structure.
    #[inline(always)]
    pub(super) fn resolve(&mut self, blas: &Blas, rays: &Rays, instance: u32) {
        let mut rest = 0;
        for i in 0..RAYS {
            rest |= u32::from((self.block[i] != NO_BLOCK) & (self.instance[i] == instance)) << i;
        }
        // Neighbours often hit the same triangle.
        while rest != 0 {
            let first = rest.trailing_zeros() as usize & (RAYS - 1);
            let (block, slot) = (self.block[first], self.slot[first]);
            let mut same = 0;
            for i in 0..RAYS {
                same |= u32::from((self.block[i] == block) & (self.slot[i] == slot)) << i;
            }
            same &= rays.of_class(rays.class(first), rest);
            if same.count_ones() < 4 {
                break;
            }
            rest &= !same;
            let ([kx, ky, kz], slot) = (axes(rays.class(first)), slot as usize & (WIDTH - 1));
            let v = &blas.blocks[block as usize].v;
            let p = [0, 1, 2]
                .map(|corner: usize| [v[corner][kx][slot], v[corner][ky][slot], v[corner][kz][slot]]);
            let o = [&rays.o[kx], &rays.o[ky], &rays.o[kz]];
            self.weigh(rays, same, |corner, j, _| p[corner][j], o);
        }
        if rest != 0 {
            self.resolve_each(blas, rays, rest);
        }
    }

    /// The same where each ray has a triangle of its own.
    #[allow(clippy::needless_range_loop, reason = "the same lane of many rows")]
    #[inline(always)]
    fn resolve_each(&mut self, blas: &Blas, rays: &Rays, mask: u32) {
        let zero = [[0.0_f32; RAYS]; 3];
        // By corner, then along the axes of `k`.
        let (mut p, mut o) = ([zero; 3], zero);
        let mut rest = mask;
        while rest != 0 {
            let i = rest.trailing_zeros() as usize & (RAYS - 1);
            rest &= rest - 1;
            let k = axes(rays.class(i));
            let block = &blas.blocks[self.block[i] as usize];
            let slot = self.slot[i] as usize & (WIDTH - 1);
            for (j, axis) in k.into_iter().enumerate() {
                o[j][i] = rays.o[axis][i];
                for corner in 0..3 {
                    p[corner][j][i] = block.v[corner][axis][slot];
                }
            }
        }
        self.weigh(rays, mask, |corner, j, i| p[corner][j][i], [&o[0], &o[1], &o[2]]);
    }

    /// `u` and `v` of some rays, given the corners of their triangles (by corner, axis and ray) and their origins, along
    /// the axes of `k`. The operations of `triangle::barycentrics`.
    #[allow(clippy::needless_range_loop, reason = "the same lane of many rows")]
    #[inline(always)]
    fn weigh(&mut self, rays: &Rays, mask: u32, p: impl Fn(usize, usize, usize) -> f32, o: [&Row; 3]) {
        for i in 0..RAYS {
            let (sx, sy) = (rays.shear[0][i], rays.shear[1][i]);
            let (mut x, mut y) = ([0.0_f64; 3], [0.0_f64; 3]);
            for corner in 0..3 {
                let z = p(corner, 2, i) - o[2][i];
                x[corner] = f64::from(z.mul_add(sx, p(corner, 0, i) - o[0][i]));
                y[corner] = f64::from(z.mul_add(sy, p(corner, 1, i) - o[1][i]));
            }
            let u = x[2] * y[1] - y[2] * x[1];
            let v = x[0] * y[2] - y[0] * x[2];
            let w = x[1] * y[0] - y[1] * x[0];
            let det = u + v + w;
            let is_in = mask >> i & 1 != 0;
            let (u, v) = ((v / det) as f32, (w / det) as f32);
            self.u[i] = if is_in { u } else { self.u[i] };
            self.v[i] = if is_in { v } else { self.v[i] };
            self.block[i] = if is_in { NO_BLOCK } else { self.block[i] };
        }
    }

    /// Writes the hits of as many rays as there are places.
    #[inline(always)]
    pub(super) fn write(&self, accel: &Accel, hits: &mut [Option<Hit>]) {
        // Neighbours often hit the same primitive.
        let mut last = [u32::MAX; 4];
        for (i, hit) in hits.iter_mut().enumerate().take(RAYS) {
            if self.found >> i & 1 == 0 {
                *hit = None;
                continue;
            }
            let (instance, item) = (self.instance[i], self.item[i]);
            if last[0] != item || last[1] != instance {
                let hit = accel.hit(&self.get(i));
                last = [item, instance, hit.geometry, hit.primitive];
            }
            let [_, _, geometry, primitive] = last;
            *hit = Some(Hit { t: self.t[i], u: self.u[i], v: self.v[i], instance, geometry, primitive });
        }
    }
}
