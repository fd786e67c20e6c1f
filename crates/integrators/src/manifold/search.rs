//! One trial: a direction, drawn somehow, and Newton's method from there.
//!
//! It begins about the straight line to the light [Hanika2015], at a surface that mirrors or refracts, or anywhere: so that every
//! solution is found with a probability that is not zero. Steps are halved until the miss falls.
//!
//! Over waves there are dozens of solutions, a walk comes as far as the next crest, and few that began far away arrive. But where one is,
//! there are others: so scouts are sent first, and half of all walks begin about a solution that is known.

use math::{Dir, Frame, trig};
use sampling::rng::Rng;
use sampling::warp;
use scatter::TransportMode;
use scene::SpecularSurfaces;

use super::aim::{Aim, Miss};
use super::chain::{Chain, Sides, Start};

/// A search for the directions that lead from a vertex to a point of a light.
pub(super) struct Search<'a> {
    pub(super) start: Start<'a>,
    pub(super) aim: Aim,
    pub(super) surfaces: &'a SpecularSurfaces,
    /// Surfaces of a chain.
    pub(super) n: usize,
    /// What the scouts found.
    found: [Option<Solution>; MOST_FOUND],
}

/// A direction that leads there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solution {
    pub(super) dir: Dir,
    pub(super) sides: Sides,
}

impl Solution {
    /// The same, but for rounding?
    pub(super) fn is(&self, other: &Self) -> bool {
        self.sides == other.sides && self.dir.0.distance_squared(other.dir.0) < SAME * SAME
    }
}

/// Directions so near to each other are the same solution.
const SAME: f32 = 1e-3;

/// A ray that misses by less meets.
const TOLERANCE: f32 = 2e-5;

/// Nothing is gained by less: about the rounding of a hit.
const FINEST: f32 = 1e-6;

/// Steps of Newton's method, halved ones too.
const MOST_STEPS: usize = 24;

/// A step is halved so many times before it is given up.
const LEAST_SCALE: f32 = 1.0 / 16.0;

/// Longest step, a tangent of an angle.
const LONGEST_STEP: f32 = 0.5;

/// Most scouts, and how many in a row may find nothing new before there are no more.
const MOST_SCOUTS: usize = 64;
const PATIENCE: usize = 16;

/// Most solutions that are kept of them.
const MOST_FOUND: usize = 48;

/// Of walks, the share that begins about a solution, once there is one; and of the rest those about the straight line, and at the
/// surfaces.
const NEAR: f32 = 0.5;
const STRAIGHT: f32 = 0.5;
const SURFACES: f32 = 0.4;

/// Least and most distance from a direction to begin about, as a tangent.
const ABOUT_NEAR: [f32; 2] = [3e-3, 0.3];
const ABOUT_STRAIGHT: [f32; 2] = [0.02, 1.0];

impl<'a> Search<'a> {
    /// Sends scouts first.
    pub(super) fn new(
        start: Start<'a>,
        aim: Aim,
        (surfaces, n): (&'a SpecularSurfaces, usize),
        rng: &mut Rng,
        rays: &mut u64,
    ) -> Self {
        let mut search = Self { start, aim, surfaces, n, found: [None; MOST_FOUND] };
        let mut in_vain = 0;
        for _ in 0..MOST_SCOUTS {
            let is_new = search.trial(rng, rays).is_some_and(|s| search.keep(s));
            in_vain = if is_new { 0 } else { in_vain + 1 };
            if in_vain == PATIENCE {
                break;
            }
        }
        search
    }

    /// Solutions that the scouts found.
    pub(super) fn found(&self) -> impl Iterator<Item = &Solution> {
        self.found.iter().map_while(Option::as_ref)
    }

    /// A solution or none. All trials of one search, but for those of the scouts, are alike.
    pub(super) fn trial(&self, rng: &mut Rng, rays: &mut u64) -> Option<Solution> {
        let dir = self.begin(rng)?;
        if self.start.vertex.scatter(dir, TransportMode::Radiance).is_black() {
            return None;
        }
        let (chain, sides) = self.start.draw(dir, self.n, rng, rays)?;
        let miss = self.aim.miss(&chain)?;
        self.newton(Solution { dir, sides }, miss, rays)
    }

    fn newton(&self, mut at: Solution, mut miss: Miss, rays: &mut u64) -> Option<Solution> {
        let mut scale = 1.0;
        for _ in 0..MOST_STEPS {
            if miss.error < FINEST {
                break;
            }
            let [a, b] = miss.step;
            let shorter = scale * (LONGEST_STEP / (a * a + b * b).sqrt()).min(1.0);
            let dir = beside(at.dir, [a * shorter, b * shorter]);
            let chain = self.start.follow(dir, &at.sides, None, rays);
            let next = chain.and_then(|c: Chain| self.aim.miss(&c)).filter(|m| m.error < miss.error);
            if let Some(next) = next {
                (at.dir, miss) = (dir, next);
                scale = f32::min(2.0 * scale, 1.0);
            } else if scale <= LEAST_SCALE || miss.error < TOLERANCE {
                break;
            } else {
                scale *= 0.5;
            }
        }
        (miss.error < TOLERANCE).then_some(at)
    }

    /// Keeps a solution; false if it is known, or if there are too many.
    fn keep(&mut self, solution: Solution) -> bool {
        let place = self.found.iter_mut().find(|f| f.is_none_or(|f| f.is(&solution)));
        match place {
            Some(place @ None) => {
                *place = Some(solution);
                true
            }
            Some(Some(_)) | None => false,
        }
    }

    /// A direction to begin with.
    fn begin(&self, rng: &mut Rng) -> Option<Dir> {
        let Start { scene, vertex, .. } = self.start;
        let (chance, choice) = (rng.next_f32(), rng.next_f32());
        let mut u = || [rng.next_f32(), rng.next_f32()];
        let found = self.found().count();
        if chance < NEAR && found > 0 {
            let near = self.found[(choice * found as f32) as usize]?;
            return Some(beside(near.dir, about(ABOUT_NEAR, u())));
        }
        if choice < STRAIGHT {
            let straight = self.aim.direction(vertex.p())?;
            return Some(beside(straight, about(ABOUT_STRAIGHT, u())));
        }
        if choice < STRAIGHT + SURFACES {
            let ([a, b], [c, d]) = (u(), u());
            let p = self.surfaces.sample(scene, [a, b, c, d], vertex.time());
            return (p - vertex.p()).try_normalize().map(Dir);
        }
        Some(warp::uniform_sphere(u()))
    }
}

/// The direction beside another, by tangents along its axes.
fn beside(w: Dir, [a, b]: [f32; 2]) -> Dir {
    let Frame { s, t, .. } = Frame::from_normal(w);
    Dir::normalize(w.0 + s * a + t * b)
}

/// In any direction; as likely to be between 1 and 2 away as between 2 and 4.
fn about([least, most]: [f32; 2], [u, v]: [f32; 2]) -> [f32; 2] {
    let distance = least * trig::exp(v * trig::ln(most / least));
    let (sin, cos) = trig::sin_cos(std::f32::consts::TAU * u);
    [distance * cos, distance * sin]
}
