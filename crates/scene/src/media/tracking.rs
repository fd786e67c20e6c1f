//! Null collisions along a ray through cells with an upper bound each [Woodcock1965], [PBR4e, sec. 11.2.1, 14.1.1].
//!
//! Tentative collisions come with the bound's rate, the same for all lanes. Each is real with the chance that the lanes'
//! extinctions, weighed with what is carried, have in the bound; else the flight goes on. Cells are walked through by a
//! digital differential analyser [Amanatides1987]; what is left of the optical depth is taken from cell to cell.

use math::{Vec3, trig};
use spectrum::{Spectrum, Wavelengths};

use super::grid::Majorants;
use super::{Flight, lane_weights};

/// A ray in the unit cube: `origin + t dir`, where t is the distance in the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct UnitRay {
    pub(super) origin: Vec3,
    pub(super) dir: Vec3,
    pub(super) t_max: f32,
}

/// What is at a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Collision {
    pub(super) sigma_a: Spectrum,
    pub(super) sigma_s: Spectrum,
    /// Radiance, times absorption per length.
    pub(super) le: Spectrum,
}

/// A way through cells.
pub(super) struct Track<'a> {
    pub(super) majorants: &'a Majorants,
    /// Factor on the bounds.
    pub(super) scale: f32,
    pub(super) ray: UnitRay,
}

/// A piece of the ray in one cell.
#[derive(Clone, Copy, Debug)]
struct Piece {
    from: f32,
    to: f32,
    bound: f32,
}

impl Track<'_> {
    /// A free flight. `at` tells what is at a point of the unit cube.
    pub(super) fn fly(
        &self,
        at: impl Fn(Vec3) -> Collision,
        carried: Spectrum,
        wl: &Wavelengths,
        u: &mut impl FnMut() -> f32,
    ) -> Flight {
        let mut flight = Flight::EMPTY;
        self.collisions(
            &mut |t, majorant, u: &mut dyn FnMut() -> f32| {
                let here = at(self.ray.origin + self.ray.dir * t);
                let sigma_t = here.sigma_a + here.sigma_s;
                flight.emitted += flight.factor * here.sigma_a * here.le * (1.0 / majorant);

                let weights = lane_weights(carried * flight.factor, wl);
                let sum: f32 = weights.iter().sum();
                if sum <= 0.0 {
                    flight.factor = Spectrum::ZERO;
                    return false;
                }
                let mean: f32 = weights.iter().zip(sigma_t.lanes()).map(|(w, s)| w * s).sum::<f32>() / sum;
                let real = mean / majorant;
                if u() < real {
                    flight.factor *= here.sigma_s / mean;
                    flight.scatters_at = Some(t);
                    return false;
                }
                flight.factor *= sigma_t.map(|s| (1.0 - s / majorant).max(0.0) / (1.0 - real));
                true
            },
            u,
        );
        flight
    }

    /// Transmittance by ratio tracking, and emission. Where little is left, roulette decides.
    pub(super) fn pass(&self, at: impl Fn(Vec3) -> Collision, u: &mut impl FnMut() -> f32) -> Flight {
        const LITTLE: f32 = 0.02;
        let mut flight = Flight::EMPTY;
        self.collisions(
            &mut |t, majorant, u: &mut dyn FnMut() -> f32| {
                let here = at(self.ray.origin + self.ray.dir * t);
                flight.emitted += flight.factor * here.sigma_a * here.le * (1.0 / majorant);
                flight.factor *= (here.sigma_a + here.sigma_s).map(|s| (1.0 - s / majorant).max(0.0));
                if flight.factor.max_component() < LITTLE {
                    flight.factor = if u() < 0.5 { flight.factor * 2.0 } else { Spectrum::ZERO };
                }
                !flight.factor.is_black()
            },
            u,
        );
        flight
    }

    /// Calls `on` with the distance and the bound of every tentative collision until it says no.
    fn collisions(
        &self,
        on: &mut impl FnMut(f32, f32, &mut dyn FnMut() -> f32) -> bool,
        u: &mut impl FnMut() -> f32,
    ) {
        let Some(mut cells) = Cells::new(&self.ray, self.majorants.resolution) else { return };
        let mut depth = -trig::ln(1.0 - u());
        while let Some(piece) = cells.next(self.majorants) {
            let majorant = piece.bound * self.scale;
            let mut t = piece.from;
            loop {
                let rest = (piece.to - t) * majorant;
                if depth >= rest {
                    depth -= rest;
                    break;
                }
                t += depth / majorant;
                depth = -trig::ln(1.0 - u());
                if !on(t, majorant, u) {
                    return;
                }
            }
        }
    }
}

/// A digital differential analyser in the unit cube.
struct Cells {
    cell: [i32; 3],
    step: [i32; 3],
    n: [i32; 3],
    /// Where the ray crosses into the next cell along each axis.
    next: [f32; 3],
    delta: [f32; 3],
    t: f32,
    end: f32,
}

impl Cells {
    /// `None` if the ray misses the cube.
    fn new(ray: &UnitRay, resolution: [u32; 3]) -> Option<Self> {
        let (mut from, mut end) = (0.0_f32, ray.t_max);
        for a in 0..3 {
            let (o, d) = (ray.origin[a], ray.dir[a]);
            if d == 0.0 {
                if !(0.0..=1.0).contains(&o) {
                    return None;
                }
                continue;
            }
            let (x, y) = ((0.0 - o) / d, (1.0 - o) / d);
            (from, end) = (from.max(x.min(y)), end.min(x.max(y)));
        }
        if from.is_nan() || end.is_nan() || from >= end {
            return None;
        }
        let n = resolution.map(|r| r as i32);
        let start = ray.origin + ray.dir * from;
        let mut cells = Self {
            cell: [0; 3],
            step: [0; 3],
            n,
            next: [f32::INFINITY; 3],
            delta: [f32::INFINITY; 3],
            t: from,
            end,
        };
        for a in 0..3 {
            let (size, d) = (n[a] as f32, ray.dir[a]);
            cells.cell[a] = ((start[a] * size) as i32).clamp(0, n[a] - 1);
            if d != 0.0 {
                let forward = d > 0.0;
                cells.step[a] = if forward { 1 } else { -1 };
                let border = (cells.cell[a] + i32::from(forward)) as f32 / size;
                cells.next[a] = (border - ray.origin[a]) / d;
                cells.delta[a] = 1.0 / (size * d.abs());
            }
        }
        Some(cells)
    }

    fn next(&mut self, majorants: &Majorants) -> Option<Piece> {
        if self.t >= self.end || (0..3).any(|a| !(0..self.n[a]).contains(&self.cell[a])) {
            return None;
        }
        let axis = if self.next[0] <= self.next[1] && self.next[0] <= self.next[2] {
            0
        } else if self.next[1] <= self.next[2] {
            1
        } else {
            2
        };
        let bound = majorants.at(self.cell.map(|c| c as u32));
        let piece = Piece { from: self.t, to: self.next[axis].min(self.end).max(self.t), bound };
        self.t = piece.to.max(self.next[axis]);
        self.cell[axis] += self.step[axis];
        self.next[axis] += self.delta[axis];
        Some(piece)
    }
}
