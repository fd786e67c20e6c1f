//! The overture: all records are made before the first sample, from the seed alone.
//!
//! The film is looked at through the middles of every 32nd pixel in each direction, then every 16th, … and at last
//! every one. Where a walk from the eye needs irradiance that no record covers, a record is made. A round looks at
//! pixels in a shuffled order in batches of fixed sizes: all of a batch see the records of the batches before it, and
//! theirs are added in their order. So the cache does not depend on the number of threads.

use math::hash::combine;
use math::{Dir, Frame, Ray};
use rayon::prelude::{IntoParallelIterator, IntoParallelRefIterator, ParallelIterator};
use sampling::Sampler;
use scatter::Bsdf;
use scene::{Scene, Shading, SurfaceInteraction, Surroundings};
use spectrum::{Spectrum, Wavelengths};
use std::sync::{Mutex, PoisonError};

use super::cache::Cache;
use super::hemisphere::{Found, Irradiance, Strata, mean_inverse_distance};
use super::record::Record;
use super::{Interpolation, Settings};
use super::{is_matt, sides};
use crate::Counters;
use crate::common::Gathered;
use crate::path::Path;
use crate::shortcut::Shortcut;
use crate::walker::Walker;

/// Every so many pixels are looked at in the first round.
const FIRST_STEP: i32 = 32;

/// A pass that no camera sample has: numbers of the build are its own.
const BUILD: u32 = u32::MAX;

/// Pixels of a batch: at least so many, and a part of the round.
const LEAST_BATCH: usize = 64;
const BATCHES: usize = 64;

/// Builds caches.
pub(super) struct Build<'a> {
    pub(super) scene: &'a Scene,
    pub(super) settings: &'a Settings,
    pub(super) sampler: &'a Sampler,
    /// How walks are traced.
    pub(super) path: &'a Path,
}

/// Where a record is wanted.
#[derive(Clone, Copy)]
struct Wanted {
    si: SurfaceInteraction,
    /// Of the side.
    n: Dir,
    /// What a walk came through to it.
    around: Surroundings,
    depth: u32,
}

/// What a build did.
pub(super) struct Built {
    pub(super) counters: Counters,
    /// Was the budget reached?
    pub(super) is_full: bool,
}

impl Build<'_> {
    /// Fills the caches, one for each number of scattering events before.
    pub(super) fn run(&self, caches: &mut [Cache]) -> Built {
        let mut built = Built { counters: Counters::default(), is_full: false };
        let mut step = FIRST_STEP;
        while step > 0 {
            let pixels = self.pixels(step);
            for batch in pixels.chunks((pixels.len() / BATCHES).max(LEAST_BATCH)) {
                self.batch(batch, caches, &mut built);
                if built.is_full {
                    return built;
                }
            }
            step /= 2;
        }
        built
    }

    /// The pixels of a round, in its order: those of the step's grid that no round before it had.
    fn pixels(&self, step: i32) -> Vec<[i32; 2]> {
        let bounds = self.scene.settings().sample_bounds();
        let on_grid = |c: i32, step: i32| c.rem_euclid(step) == 0;
        let mut pixels: Vec<[i32; 2]> = (bounds.min[1]..bounds.max[1])
            .flat_map(|y| (bounds.min[0]..bounds.max[0]).map(move |x| [x, y]))
            .filter(|p| p.iter().all(|&c| on_grid(c, step)))
            .filter(|p| step == FIRST_STEP || !p.iter().all(|&c| on_grid(c, 2 * step)))
            .collect();
        let key = |p: &[i32; 2]| combine(u64::from(p[0] as u32), u64::from(p[1] as u32));
        pixels.sort_unstable_by_key(|p| (key(p), *p));
        pixels
    }

    fn batch(&self, pixels: &[[i32; 2]], caches: &mut [Cache], built: &mut Built) {
        let seen: Vec<(Vec<Wanted>, Counters)> = pixels.par_iter().map(|&p| self.look(p, caches)).collect();
        let mut wanted = Vec::new();
        for (of_pixel, counters) in seen {
            wanted.extend(of_pixel);
            built.counters.add(&counters);
        }
        let first: usize = caches.iter().map(Cache::len).sum();
        let room = self.settings.most_records().saturating_sub(first as u64);
        built.is_full = wanted.len() as u64 > room;
        wanted.truncate(usize::try_from(room).unwrap_or(usize::MAX));
        let known: &[Cache] = caches;
        let records: Vec<(Record, Vec<Irradiance>, Counters)> = (0..wanted.len())
            .into_par_iter()
            .map(|i| self.record(&wanted[i], (first + i) as u64, known))
            .collect();
        for (wanted, (record, groups, counters)) in wanted.iter().zip(records) {
            built.counters.add(&counters);
            if let Some(cache) = self.settings.cache_of(wanted.depth).and_then(|i| caches.get_mut(i)) {
                cache.add(record, &groups);
            }
        }
        caches.iter_mut().for_each(Cache::update);
    }

    /// Where a walk through the middle of a pixel lacks records.
    fn look(&self, pixel: [i32; 2], caches: &[Cache]) -> (Vec<Wanted>, Counters) {
        let mut counters = Counters::default();
        let mut sampler = self.sampler.clone();
        sampler.start(pixel, BUILD);
        let camera = &self.scene.camera;
        let u_lens = if camera.has_lens() { sampler.next_2d() } else { [0.5; 2] };
        let u_time = if camera.has_shutter() { sampler.next_1d() } else { 0.0 };
        let raster = pixel.map(|c| c as f32 + 0.5);
        let Some(start) = camera.generate_ray(raster, u_lens, u_time) else { return (Vec::new(), counters) };
        let mut wl = self.settings.basis.wavelengths(0, 0, 0.5);
        let surveyor = Surveyor { settings: self.settings, caches, wanted: Mutex::default() };
        let walk = Path { lights: None, ..self.path.with(surveyor) };
        walk.walk(&mut Walker::new(self.scene, (start.ray, &mut wl), &mut sampler, &mut counters));
        (walk.shortcut.wanted.into_inner().unwrap_or_else(PoisonError::into_inner), counters)
    }

    /// Computes a record: its number decides about all random numbers.
    fn record(&self, wanted: &Wanted, number: u64, caches: &[Cache]) -> (Record, Vec<Irradiance>, Counters) {
        let mut counters = Counters::default();
        let frame = Frame::from_normal(wanted.n);
        let basis = self.settings.basis;
        // Many rays share the noise of lamps.
        let settings = Settings { light_samples: 1, ..*self.settings };
        let path = self.path.with(Interpolation { settings, caches });
        let strata = Strata::new(self.settings.rays / basis.n_groups() as u32);
        let mut sampler = self.sampler.clone();
        let mut found = Vec::with_capacity(strata.len());
        let mut inverse_distance = 0.0;
        let mut groups = Vec::with_capacity(basis.n_groups());
        for group in 0..basis.n_groups() {
            found.clear();
            for i in 0..strata.len() {
                sampler.start_path(number << 32 | (group * strata.len() + i) as u64, BUILD);
                let mut wl = basis.wavelengths(group, i, sampler.next_1d());
                let w = frame.to_world(strata.direction(i, sampler.next_2d()));
                let ray = (wanted, w);
                let mut ray_found = self.trace(&path, ray, &mut wl, &mut sampler, &mut counters);
                ray_found.radiance = basis.store(ray_found.radiance, i, &wl);
                found.push(ray_found);
            }
            inverse_distance += mean_inverse_distance(&found) / basis.n_groups() as f32;
            groups.push(strata.integrate(&found, &frame));
        }
        let width = self.scene.camera.pixel_width(wanted.si.p, wanted.si.time);
        let [least, most] = self.settings.spacing.map(|pixels| pixels * width / self.settings.rules.error);
        let by_gradient = if self.settings.rules.gradients { gradient_limit(&groups) } else { f32::INFINITY };
        let radius = (1.0 / inverse_distance).min(by_gradient).min(most);
        (Record { p: wanted.si.p, n: wanted.n, radius, least }, groups, counters)
    }

    /// What a matt surface sends along `-w` to the place, without its emission, and less what media take away.
    fn trace(
        &self,
        path: &Path<impl Shortcut>,
        (wanted, w): (&Wanted, Dir),
        wl: &mut Wavelengths,
        sampler: &mut Sampler,
        counters: &mut Counters,
    ) -> Found {
        let mut found = Found { radiance: Spectrum::ZERO, distance: f32::INFINITY };
        let mut ray = wanted.si.spawn_ray(w);
        let mut around = self.scene.surroundings_after(&wanted.si, w, &wanted.around);
        let mut through = Spectrum::ONE;
        loop {
            counters.rays += 1;
            let Some(hit) = self.scene.intersect(&ray) else { return found };
            if let Some(medium) = around.medium() {
                let ray = Ray { t_max: hit.t, ..ray };
                through *= self.scene.media.pass(medium, &ray, wl, &mut || sampler.next_1d()).factor;
            }
            let si = self.scene.interaction(&ray, &hit);
            let Some(shading) = self.scene.shade(&si, &around, wl) else {
                around = self.scene.surroundings_after(&si, w, &around);
                ray = si.spawn_ray(w);
                continue;
            };
            found.distance = (si.p - wanted.si.p).length().max(f32::MIN_POSITIVE);
            if is_matt(&shading.bsdf) {
                let mut walk = Walker::new(self.scene, (ray, wl), sampler, counters);
                walk.depth = wanted.depth + 1;
                walk.around = around;
                walk.throughput = through;
                if path.scatter(&mut walk, &si, &shading) {
                    path.walk(&mut walk);
                }
                found.radiance = walk.radiance();
            }
            return found;
        }
    }
}

/// The R within which the gradient does not take all light away.
fn gradient_limit(groups: &[Irradiance]) -> f32 {
    let e: f32 = groups.iter().map(|g| g.e.average()).sum();
    let axis = |i: usize| groups.iter().map(|g| g.by_translation[i].average()).sum::<f32>();
    let gradient = [0, 1, 2].map(axis).iter().map(|g| g * g).sum::<f32>().sqrt();
    let limit = e / gradient;
    if limit > 0.0 { limit } else { f32::INFINITY }
}

/// Goes with a walk and writes down where records are wanted.
struct Surveyor<'a> {
    settings: &'a Settings,
    caches: &'a [Cache],
    wanted: Mutex<Vec<Wanted>>,
}

impl Shortcut for Surveyor<'_> {
    fn takes(&self, bsdf: &Bsdf) -> bool {
        is_matt(bsdf)
    }

    fn light(&self, walk: &mut Walker<'_>, si: &SurfaceInteraction, shading: &Shading) -> Option<Gathered> {
        let cache = &self.caches[self.settings.cache_of(walk.depth)?];
        let new = sides(si, shading).into_iter().flatten().filter(|(n, _)| !cache.covers(si.p, *n));
        let new = new.map(|(n, _)| Wanted { si: *si, n, around: walk.around, depth: walk.depth });
        self.wanted.lock().unwrap_or_else(PoisonError::into_inner).extend(new);
        Some(Gathered::default())
    }

    fn remainder(&self, _: (&SurfaceInteraction, &Shading), _: &SurfaceInteraction) -> f32 {
        0.0
    }

    fn leaves_something(&self) -> bool {
        self.settings.has_others
    }
}
