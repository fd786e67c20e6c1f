//! One step of all paths: from the rays to the surfaces that they meet, and on.

mod look;

use std::f32::consts::FRAC_1_PI;

use accel::{Wide, run_wide};
use math::Ray;
use math::lanes::{Floats, LANES, Mask, Vec3Lanes, Words, in_lane, offset_ray_origin};
use math::{Dir, Point};
use sampling::mis::Heuristic;
use sampling::{Sampler, SobolLanes, warp};
use scene::Scene;
use scene::wide::{Corners, LightLanes, PlaceLanes, SurfaceLanes};
use spectrum::{Spectrum, Wavelengths};

use super::state::{MOST, Paths, Record, Shadows, column, word};
use crate::Counters;
use crate::common::LightStrategy;
use crate::path::Path;

/// What a step works with.
pub(super) struct Step<'a> {
    path: &'a Path,
    scene: &'a Scene,
    sampler: &'a mut Sampler,
    /// Of each path.
    radiance: &'a mut [Spectrum; MOST],
    counters: &'a mut Counters,
    wl: Wavelengths,
}

/// All groups of sixteen, in lanes.
struct Groups<'a, 's> {
    step: &'a mut Step<'s>,
    paths: &'a mut Paths,
    shadows: &'a mut Shadows,
    corners: Corners,
    /// Paths of a group that took the step alone and go on.
    alone: Vec<Record>,
    /// How many paths go on so far.
    n_on: usize,
}

/// Sixteen paths, each at a surface.
struct Sixteen<F: Floats> {
    /// Those that are; the others are not of the group.
    here: F::Mask,
    place: PlaceLanes<F>,
    surface: SurfaceLanes<F>,
    /// In the surface's frame, where it came from.
    wo: Vec3Lanes<F>,
    numbers: SobolLanes<F>,
    throughput: [F; 4],
    eta_scale: F,
    depth: F::Words,
    slots: F::Words,
}

impl<'a> Step<'a> {
    pub(super) fn new(
        (path, scene): (&'a Path, &'a Scene),
        sampler: &'a mut Sampler,
        radiance: &'a mut [Spectrum; MOST],
        counters: &'a mut Counters,
    ) -> Self {
        Self { path, scene, sampler, radiance, counters, wl: Wavelengths::RGB }
    }

    /// Takes it: those that go on are left.
    pub(super) fn take(mut self, paths: &mut Paths, shadows: &mut Shadows) {
        let n = paths.len();
        self.scene.intersect_many(&paths.rays, &mut paths.hits[..n]);

        shadows.rays.clear();
        shadows.light.clear();
        let groups = Groups {
            step: &mut self,
            paths,
            shadows,
            corners: Corners::default(),
            alone: Vec::new(),
            n_on: 0,
        };
        // (There are lanes: `PathLoop::goes_wide` asked.)
        let n_on = run_wide(groups.step.scene.accel().isa(), groups);
        paths.rays.truncate(n_on.unwrap_or(0));

        let occluded = &mut shadows.occluded[..shadows.rays.len()];
        self.scene.occluded_many(&shadows.rays, occluded);
        for ((light, slot), occluded) in shadows.light.iter().zip(&*occluded) {
            if !occluded {
                self.radiance[*slot as usize] += Spectrum::from_rgb(*light);
            }
        }
    }
}

impl Groups<'_, '_> {
    /// The step of sixteen paths from `at` on, of which `lanes` are on matt surfaces: `Path::scatter`.
    #[inline(always)]
    fn scatter<F: Floats>(&mut self, at: usize, lanes: u32) {
        let mut sixteen = self.sixteen::<F>(at, lanes);
        let numbers = &mut sixteen.numbers;

        // Next-event estimation.
        let scene = self.step.scene;
        let u_choice = if scene.light_selector.has_choice() {
            numbers.next_1d()
        } else {
            numbers.skip();
            F::splat(0.5)
        };
        let u = numbers.next_2d();
        let light = scene.sample_light_lanes(&sixteen.place, sixteen.here, (u_choice, u), &self.step.wl);
        self.direct(&sixteen, &light);
        self.go_on(&mut sixteen);
    }

    /// What is kept of the paths, at their surfaces.
    #[inline(always)]
    fn sixteen<F: Floats>(&self, at: usize, lanes: u32) -> Sixteen<F> {
        let mut dirs = [[0.0; LANES]; 4];
        for (lane, ray) in self.paths.rays[at..].iter().take(LANES).enumerate() {
            let d = ray.dir.0;
            (dirs[0][lane], dirs[1][lane], dirs[2][lane], dirs[3][lane]) = (d.x, d.y, d.z, ray.time);
        }
        let wo = -Vec3Lanes::new(F::load(&dirs[0]), F::load(&dirs[1]), F::load(&dirs[2]));
        let surface = SurfaceLanes::<F>::new(&self.corners, wo);
        let (paths, t) = (&*self.paths, column::THROUGHPUT);
        Sixteen {
            here: F::Mask::from_bits(lanes),
            place: PlaceLanes {
                at: surface.at,
                ng: surface.ng,
                // Light is of use on the side that is looked at: `Shading::light_context`.
                ns: surface.frame.n.face_forward(wo),
                time: F::load(&dirs[3]),
            },
            wo: surface.frame.to_local(wo),
            surface,
            numbers: SobolLanes {
                keys: paths.keys::<F>(at),
                index: paths.index,
                dimension: paths.words::<F>(word::DIMENSION, at),
            },
            throughput: [
                paths.floats(t, at),
                paths.floats(t + 1, at),
                paths.floats(t + 2, at),
                paths.floats(t + 3, at),
            ],
            eta_scale: paths.floats(column::ETA_SCALE, at),
            depth: paths.words::<F>(word::DEPTH, at),
            slots: paths.words::<F>(word::SLOT, at),
        }
    }

    /// The way on, and what is left of the paths: it moves to the front.
    #[inline(always)]
    fn go_on<F: Floats>(&mut self, sixteen: &mut Sixteen<F>) {
        let c = F::splat;
        let zero = c(0.0);
        let surface = &sixteen.surface;

        // (No number chooses a lobe.)
        sixteen.numbers.skip();
        let w = warp::cosine_hemisphere_lanes(sixteen.numbers.next_2d());
        let wi = Vec3Lanes::new(w.x, w.y, w.z.copysign(sixteen.wo.z));
        let on = sixteen.here & zero.lt(sixteen.wo.z * wi.z);
        let pdf = wi.z.abs() * c(FRAC_1_PI);
        let (t, r) = (&sixteen.throughput, &surface.reflectance);
        let [a, b, d, e] = [t[0] * r[0], t[1] * r[1], t[2] * r[2], t[3] * r[3]];
        let on = on & !(a.eq(zero) & b.eq(zero) & d.eq(zero) & e.eq(zero));
        let dir = surface.frame.to_world(wi);
        let origin = offset_ray_origin(&surface.at, surface.ng, dir);

        let depth = sixteen.depth + F::Words::splat(1);
        let chance = self.step.path.roulette.chance_lanes(depth, [a, b, d, e], sixteen.eta_scale);
        let (on, factor) = survive(on, chance, &mut sixteen.numbers);

        let (paths, n) = (&mut *self.paths, self.n_on);
        let t = column::THROUGHPUT;
        paths.put(t, n, a * factor, on);
        paths.put(t + 1, n, b * factor, on);
        paths.put(t + 2, n, d * factor, on);
        paths.put(t + 3, n, e * factor, on);
        paths.put3(column::P, n, surface.at.p, on);
        paths.put3(column::ERROR, n, surface.at.error, on);
        paths.put3(column::NG, n, surface.ng, on);
        paths.put3(column::NS, n, sixteen.place.ns, on);
        paths.put(column::RIVAL, n, pdf, on);
        paths.put(column::ETA_SCALE, n, sixteen.eta_scale, on);
        paths.put_words::<F>(word::DEPTH, n, depth, on);
        paths.put_words::<F>(word::DIMENSION, n, sixteen.numbers.dimension, on);
        paths.put_words::<F>(word::SLOT, n, sixteen.slots, on);
        paths.put_keys::<F>(n, sixteen.numbers.keys, on);
        let (origin, dir, mut time) = (origin.stored(), dir.stored(), [0.0; LANES]);
        sixteen.place.time.store(&mut time);
        each(on.bits(), |lane| {
            let ray = Ray::new(Point(in_lane(&origin, lane)), Dir(in_lane(&dir, lane)), time[lane]);
            paths.rays[self.n_on] = ray;
            self.n_on += 1;
        });
    }

    /// Rays to the lamps, with what they bring: `DirectLight::contribution`.
    #[inline(always)]
    fn direct<F: Floats>(&mut self, sixteen: &Sixteen<F>, light: &LightLanes<F>) {
        let Sixteen { surface, place, wo, throughput, slots, .. } = sixteen;
        let c = F::splat;
        let (zero, one) = (c(0.0), c(1.0));
        let wi = surface.frame.to_local(light.wi);
        let reflects = zero.lt(wo.z * wi.z);
        let cos = wi.z.abs();
        let r = &surface.reflectance;
        let lit = |k: usize| (r[k] * c(FRAC_1_PI)) * light.li[k] * cos;
        let reflected = [lit(0), lit(1), lit(2)];
        let is_black = reflected[0].eq(zero) & reflected[1].eq(zero) & reflected[2].eq(zero);
        let asks = light.found & reflects & !is_black;
        self.step.counters.rays += u64::from(asks.bits().count_ones());

        // The weight against the direction that finds the lamp, over the density.
        let density = light.density * light.chosen;
        let ratio = cos * c(FRAC_1_PI) / density;
        let ratio = match self.step.path.lights {
            Some(LightStrategy::Mis(Heuristic::Power)) => ratio * ratio,
            Some(LightStrategy::Mis(Heuristic::Balance) | LightStrategy::Alone) | None => ratio,
        };
        let share = (one / (one + ratio)).or_else(zero.lt(density), zero);
        let weight = (one / density).or_else(light.is_delta, share / density);
        let asks = asks & weight.is_finite();
        let bits = asks.bits();
        if bits == 0 {
            return;
        }
        let mut brings = [[0.0; LANES]; 3];
        for (k, brings) in brings.iter_mut().enumerate() {
            (throughput[k] * (reflected[k] * weight)).store(brings);
        }
        let rays = light.shadow_rays(place);
        let (origin, dir) = (rays.origin.stored(), rays.dir.stored());
        let (mut t_max, mut time, mut slot) = ([0.0; LANES], [0.0; LANES], [0; LANES]);
        rays.t_max.store(&mut t_max);
        place.time.store(&mut time);
        slots.store(&mut slot);
        let shadows = &mut *self.shadows;
        each(bits, |lane| {
            let (origin, dir) = (Point(in_lane(&origin, lane)), Dir(in_lane(&dir, lane)));
            shadows.rays.push(Ray { origin, dir, t_max: t_max[lane], time: time[lane] });
            shadows.light.push(([brings[0][lane], brings[1][lane], brings[2][lane]], slot[lane]));
        });
    }
}

impl Wide for Groups<'_, '_> {
    type Output = usize;

    #[inline(always)]
    fn run<F: Floats>(mut self) -> usize {
        let n = self.paths.len();
        let mut at = 0;
        while at < n {
            let lanes = self.look(at);
            if lanes != 0 {
                self.scatter::<F>(at, lanes);
            }
            // Those that went alone follow their group, whose columns nobody needs any more.
            while let Some(record) = self.alone.pop() {
                self.paths.set(self.n_on, &record);
                self.n_on += 1;
            }
            at += LANES;
        }
        self.n_on
    }
}

/// Russian roulette: which of `on` survive, and what their throughputs are paid.
#[inline(always)]
fn survive<F: Floats>(on: F::Mask, chance: F, numbers: &mut SobolLanes<F>) -> (F::Mask, F) {
    let one = F::splat(1.0);
    let is_asked = on & !one.le(chance);
    if !is_asked.any() {
        numbers.skip();
        return (on, one);
    }
    let survives = numbers.next_1d().lt(chance);
    (on & (survives | !is_asked), (one / chance).or_else(is_asked, one))
}

/// Each lane of a mask.
#[inline(always)]
fn each(mut bits: u32, mut visit: impl FnMut(usize)) {
    while bits != 0 {
        visit(bits.trailing_zeros() as usize & (LANES - 1));
        bits &= bits - 1;
    }
}
