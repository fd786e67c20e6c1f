//! Specular manifold sampling [Zeltner2020]: from a vertex, over surfaces that mirror or refract, to a point of a light, as no
//! walk would but by chance.
//!
//! Which directions lead from the vertex to the point is found by Newton's method [Jakob2012], begun anywhere. All that some
//! scouts find so counts as it is. Then come some trials for the rest: a direction that the scouts did not find is found with a
//! probability p of its own that nobody knows. But trials are independent: how many more it takes until the same direction is
//! found again is 1/p in the mean, which is what its contribution has to be multiplied by. So nothing is left out, however few scouts
//! there are; the more, the less is left to chance.
//!
//! | what                                                 | source                       | file     |
//! |------------------------------------------------------|------------------------------|----------|
//! | a ray over a chain of surfaces, and its differentials | [Igehy1999]                 | `chain`  |
//! | points of lights, and by how much a ray misses them  |                              | `aim`    |
//! | Newton's method, where it begins                     | [Jakob2012], [Zeltner2020] | `search` |
//! | 1/p                                                  | [Booth2007]                  | here     |
//!
//! Departs from [Zeltner2020]: the scouts, whose findings are taken out of the trial's; and the unknown is the direction at the vertex
//! alone, two numbers however long the chain, since all that follows from it is traced. By how much the ray misses the point, and how
//! that depends on the direction, is known from the ray's differentials; they say too how dense the light is there, so that there is
//! no other geometry term.
//!
//! Over surfaces that a normal map bends, that mix by chance or that also scatter otherwise, nothing is found (see
//! [`Scene::is_steady`]); nor is the sky, which walks find, nor a lamp that no ray hits.

mod aim;
mod chain;
mod search;

use sampling::Sampler;
use sampling::rng::Rng;
use scatter::TransportMode;
use scene::{LightId, Scene, SpecularSurfaces};
use spectrum::{Spectrum, Wavelengths};

use self::aim::Aim;
pub(crate) use self::chain::MOST_SURFACES;
use self::chain::{Carried, Start};
use self::search::{Search, Solution};
use crate::Counters;
use crate::common::{Gathered, Site, Vertex};
use crate::parameters::{ParameterInfo, ParameterKind, Parameters};

/// Parameter: see [`Manifold::longest`].
pub(crate) const PARAMETER: ParameterInfo = ParameterInfo {
    name: "manifold",
    kind: ParameterKind::Integer(0),
    doc: "most mirrors and refracting surfaces in a row over which lamps are searched by manifold sampling, up to 8: for \
          caustics seen through glass or water; 0: none",
};

/// Why a scene cannot be rendered with these settings, which are for integrators with [`PARAMETER`].
pub(crate) fn refuses(scene: &Scene, p: &Parameters) -> Option<&'static str> {
    let is_by_chance = p.integer(PARAMETER.name) > 0 && scene.has_surfaces_by_chance();
    is_by_chance.then_some(
        "manifold sampling needs surfaces that a ray either meets or not, and here chance decides: cut-outs by alpha, panes, or \
         mixtures with borders of media; set manifold=0, or use vcm",
    )
}

/// Finds light over surfaces that mirror or refract.
#[derive(Debug)]
pub(crate) struct Manifold {
    /// Most surfaces of a chain, at least one.
    pub(crate) longest: usize,
    surfaces: Option<SpecularSurfaces>,
}

/// What a path carries from the vertex on, and the wavelengths that are left of it.
#[derive(Clone, Copy, Debug)]
struct Found {
    value: Spectrum,
    wl: Wavelengths,
}

/// Trials for what the scouts did not find.
const TRIALS: usize = 4;

/// From so many trials on, chance decides whether there are more.
const SURE_TRIALS: u32 = 4096;

/// Then so much of them.
const SURVIVAL: f32 = 0.25;

/// May a walk that leaves the vertex by a delta pass it on a chain of [`Manifold`]?
pub(crate) fn passes(scene: &Scene, vertex: &Vertex) -> bool {
    match &vertex.site {
        Site::Surface { si, shading } => shading.bsdf.is_delta_only() && scene.is_steady(si),
        Site::Medium(_) => false,
    }
}

/// May a light be what [`Manifold`] finds?
pub(crate) fn aims_at(scene: &Scene, light: LightId) -> bool {
    // A lamp that rays hit, or distant light.
    let lights = &scene.lights;
    lights.position(light).is_some() || lights.is_delta(light) == lights.is_from_infinity(light)
}

impl Manifold {
    /// What [`PARAMETER`] was set to; `None` for none.
    pub(crate) fn of(scene: &Scene, p: &Parameters) -> Option<Self> {
        Self::new(scene, p.integer(PARAMETER.name))
    }

    /// For chains of up to `longest` surfaces; `None` for none.
    pub(crate) fn new(scene: &Scene, longest: u32) -> Option<Self> {
        let longest = (longest as usize).min(MOST_SURFACES);
        (longest > 0).then(|| Self { longest, surfaces: SpecularSurfaces::of(scene) })
    }

    /// Light that comes to a vertex over a chain of `n` surfaces: `f |cos θ|` times radiance, an estimate of the integral
    /// over all directions.
    pub(crate) fn estimate(
        &self,
        scene: &Scene,
        (vertex, n): (&Vertex, usize),
        sampler: &mut Sampler,
        wl: Wavelengths,
        counters: &mut Counters,
    ) -> Gathered {
        let (u_light, u_place, u_key) = (sampler.next_1d(), sampler.next_2d(), sampler.next_2d());
        let mut rng = Rng::from_parts(&u_key.map(|u| u64::from(u.to_bits())));
        let start = Start { scene, vertex, wl };
        let aim = Aim::sample(&start, u_light, u_place);
        match (aim, &self.surfaces) {
            (Some(aim), Some(surfaces)) => {
                Search::new(start, aim, (surfaces, n), &mut rng, &mut counters.rays)
                    .sum(&mut rng, &mut counters.rays)
            }
            (Some(_) | None, _) => Gathered::default(),
        }
    }
}

impl Search<'_> {
    /// What all solutions contribute: those that the scouts found, and one of the others if a trial finds it.
    fn sum(&self, rng: &mut Rng, rays: &mut u64) -> Gathered {
        let mut sum = Gathered::default();
        let mut add = |found: Found, factor: f32| sum.add(found.value * factor, found.wl.is_terminated());
        for solution in self.found() {
            if let Some(found) = self.value(solution, rng, rays) {
                add(found, 1.0);
            }
        }
        for _ in 0..TRIALS {
            let other = self.trial(rng, rays).filter(|s| !self.found().any(|f| f.is(s)));
            if let Some(solution) = other
                && let Some(found) = self.value(&solution, rng, rays)
            {
                let trials = self.trials_until(&solution, rng, rays);
                add(found, trials / TRIALS as f32);
            }
        }
        sum
    }

    /// What a solution contributes, but for 1/p; `None` for nothing.
    fn value(&self, solution: &Solution, rng: &mut Rng, rays: &mut u64) -> Option<Found> {
        let Start { scene, vertex, .. } = self.start;
        let scattered = vertex.scatter(solution.dir, TransportMode::Radiance);
        let mut u = || rng.next_f32();
        let mut carried = Carried { throughput: scattered, u: &mut u };
        let chain = self.start.follow(solution.dir, &solution.sides, Some(&mut carried), rays)?;
        let arriving = self.aim.light(scene, &chain)?;
        *rays += 1;
        let through = scene.transmittance(&arriving.ray, &chain.around, &chain.wl, &mut || (carried.u)());
        let value = carried.throughput * through * arriving.li * (1.0 / chain.spread(&self.aim));
        (value.is_finite() && !value.is_black()).then_some(Found { value, wl: chain.wl })
    }

    /// How many trials it takes to find the solution, an estimate of 1/p.
    fn trials_until(&self, solution: &Solution, rng: &mut Rng, rays: &mut u64) -> f32 {
        let (mut sum, mut weight, mut n, mut limit) = (0.0, 1.0, 0, SURE_TRIALS);
        loop {
            sum += weight;
            if self.trial(rng, rays).is_some_and(|s| s.is(solution)) {
                return sum;
            }
            n += 1;
            if n == limit {
                if rng.next_f32() >= SURVIVAL {
                    return sum;
                }
                weight /= SURVIVAL;
                limit *= 2;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use math::{Dir, Frame, Point, Ray, Vec3};
    use sampling::warp;
    use scene::Surroundings;
    use testkit::statistics::Moments;

    use super::chain::Chain;
    use super::*;
    use crate::test_scene::load;

    /// What a ray straight down meets first below a height.
    fn below(scene: &Scene, x: f32, y: f32, height: f32) -> Vertex {
        let ray = Ray::new(Point::new(x, y, height), -Dir::Z, 0.0);
        let si = scene.interaction(&ray, &scene.intersect(&ray).unwrap());
        let mut wl = Wavelengths::RGB;
        let shading = scene.shade(&si, &Surroundings::default(), &mut wl).unwrap();
        Vertex {
            site: Site::Surface { si, shading },
            around: Surroundings::default(),
            throughput: Spectrum::ONE,
            forward: 0.0,
            reverse: 0.0,
            is_delta: false,
            events: 1,
        }
    }

    #[test]
    fn rays_change_as_their_differentials_say() {
        const STEP: f32 = 1e-3;
        let scene = load("caustics", false);
        let (mut compared, mut rng, mut rays) = ([0; 4], Rng::from_parts(&[5]), 0);
        for i in 0..6000 {
            let [x, y] = [rng.next_f32(), rng.next_f32()].map(|u| 6.0 * u - 3.0);
            let vertex = below(&scene, x, y, 0.1);
            let start = Start { scene: &scene, vertex: &vertex, wl: Wavelengths::RGB };
            let w = warp::uniform_sphere([rng.next_f32(), rng.next_f32()]);
            let (w, n) = (Dir(Vec3::new(w.0.x, w.0.y, w.0.z.abs())), 1 + i % 3);
            let Some((chain, sides)) = start.draw(w, n, &mut rng, &mut rays) else { continue };
            let Frame { s, t, .. } = Frame::from_normal(w);
            for (axis, by_place, by_dir) in
                [(s, chain.by_place[0], chain.by_dir[0]), (t, chain.by_place[1], chain.by_dir[1])]
            {
                let at = |h: f32| start.follow(Dir::normalize(w.0 + axis * h), &sides, None, &mut 0);
                let (Some(after), Some(before)) = (at(STEP), at(-STEP)) else { continue };
                // Leave out edges of triangles and of surfaces.
                let by_halves = |f: fn(&Chain) -> Vec3| {
                    let [a, b] = [(f(&after) - f(&chain)) / STEP, (f(&chain) - f(&before)) / STEP];
                    let size = (a + b).length().max(2.0);
                    (0.5 * (a + b), a.distance(b) / size)
                };
                let (place, place_bend) = by_halves(|c| c.last.p.0);
                let (dir, dir_bend) = by_halves(|c| c.dir.0);
                if place_bend.max(dir_bend) > 0.02 {
                    continue;
                }
                compared[n] += 1;
                let is_near = |a: Vec3, b: Vec3| a.distance(b) < 0.01 * b.length().max(1.0);
                assert!(is_near(by_place, place), "{n} {sides:?}: {by_place} is not {place}");
                assert!(is_near(by_dir, dir), "{n} {sides:?}: {by_dir} is not {dir}");
            }
        }
        assert!(compared[1..].iter().all(|n| *n > 100), "{compared:?}");
    }

    /// The trials until a solution is found again are 1/p in the mean, whichever of several it is.
    #[test]
    fn trials_are_one_over_the_chance() {
        let scene = load("caustics", false);
        let surfaces = SpecularSurfaces::of(&scene).unwrap();
        let (mut rays, mut rng, mut found) = (0, Rng::from_parts(&[7]), 0);
        // Under waves, under a ball, in a tube.
        for (x, y, n) in
            [(-2.0, -2.0, 1), (-1.6, -2.4, 1), (1.5, 0.1, 2), (1.72, 0.0, 2), (0.2, 3.1, 1), (0.6, 3.2, 1)]
        {
            let vertex = below(&scene, x, y, 0.1);
            let start = Start { scene: &scene, vertex: &vertex, wl: Wavelengths::RGB };
            let aim = Aim::sample(&start, 0.5, [0.3, 0.9]).unwrap();
            let search = Search::new(start, aim, (&surfaces, n), &mut rng, &mut rays);
            let mut solutions: Vec<(Solution, f64)> = Vec::new();
            let trials = 20_000;
            for _ in 0..trials {
                let Some(one) = search.trial(&mut rng, &mut rays) else { continue };
                match solutions.iter_mut().find(|(s, _)| s.is(&one)) {
                    Some((_, n)) => *n += 1.0,
                    None => solutions.push((one, 1.0)),
                }
            }
            for (solution, n) in &solutions {
                let p = n / f64::from(trials);
                if p > 0.01 {
                    found += 1;
                    let until = Moments::of(
                        (0..800).map(|_| f64::from(search.trials_until(solution, &mut rng, &mut rays))),
                    );
                    let error = p * until.std_error() + until.mean() * (p / f64::from(trials)).sqrt();
                    assert!((p * until.mean() - 1.0).abs() < 4.0 * error, "{p} {}", until.mean());
                }
            }
        }
        assert!(found > 6, "{found} solutions");
    }

    #[test]
    fn lamps_are_aimed_at_and_the_sky_is_not() {
        let scene = load("large-lamp", false);
        assert!(Manifold::new(&scene, 0).is_none());
        assert_eq!(Manifold::new(&scene, 100).unwrap().longest, MOST_SURFACES);
        for light in scene.lights.ids() {
            assert!(aims_at(&scene, light));
        }
        let sky = load("sky", false);
        let aims: Vec<_> = sky.lights.ids().map(|l| aims_at(&sky, l)).collect();
        assert!(aims.contains(&false), "the sky is left to walks");
    }
}
