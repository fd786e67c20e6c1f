//! How fast this machine is: rays of three kinds through a scene, on all workers.
//!
//! | kind   | rays                                                                                  |
//! |--------|---------------------------------------------------------------------------------------|
//! | camera | through the centres of the pixels, row by row                                         |
//! | bounce | from what those hit, in directions drawn in proportion to the cosine: no two are near |
//! | shadow | from what those hit, to what other camera rays hit                                    |

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use math::{Dir, Frame, Ray, hash};
use sampling::warp;
use scene::Scene;

use crate::Workers;

/// Most rays of a kind.
const MOST: usize = 1 << 18;
/// Rays between two looks at the clock.
const CHUNK: usize = 1024;

/// Rays to measure with, the same for the same scene.
pub struct BenchRays {
    /// From the camera.
    pub camera: Vec<Ray>,
    /// Reflected by diffuse surfaces.
    pub bounce: Vec<Ray>,
    /// Between surfaces.
    pub shadow: Vec<Ray>,
}

/// Rays a second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayRates {
    /// Nearest hits of camera rays.
    pub camera: f64,
    /// Nearest hits of bounced rays.
    pub bounce: f64,
    /// Any hits of shadow rays.
    pub shadow: f64,
}

impl BenchRays {
    /// Rays of a scene.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let [w, h] = scene.settings().resolution.map(u64::from);
        let step = ((w * h) as f64 / MOST as f64).sqrt().max(1.0);
        let at = |n: u64| (0..).map(move |i| (f64::from(i) + 0.5) * step).take_while(move |x| *x < n as f64);
        let camera: Vec<Ray> = at(h)
            .flat_map(|y| at(w).map(move |x| [x as f32, y as f32]))
            .filter_map(|raster| scene.camera.generate_ray(raster, [0.5; 2], 0.5))
            .map(|r| r.ray)
            .collect();

        let surfaces: Vec<_> =
            camera.iter().filter_map(|ray| Some(scene.interaction(ray, &scene.intersect(ray)?))).collect();
        let random = |i: usize, k: u64| hash::unit_f32((hash::combine(k, i as u64) >> 32) as u32);
        let bounce = surfaces.iter().enumerate().map(|(i, si)| {
            let frame = Frame::from_normal(si.ng.face_forward(si.wo));
            si.spawn_ray(frame.to_world(warp::cosine_hemisphere([random(i, 1), random(i, 2)])))
        });
        let shadow = surfaces.iter().enumerate().filter_map(|(i, si)| {
            // A surface may meet itself.
            let other = &surfaces[(random(i, 3) * surfaces.len() as f32) as usize % surfaces.len()];
            let d = other.p.0 - si.p.0;
            let dir = (d.length_squared() > 0.0).then(|| Dir::normalize(d))?;
            Some(Ray { t_max: d.length() * 0.999, ..si.spawn_ray(dir) })
        });
        Self { bounce: bounce.collect(), shadow: shadow.collect(), camera }
    }

    /// Traces each kind for `time`.
    #[must_use]
    pub fn measure(&self, scene: &Scene, workers: &Workers, time: Duration) -> RayRates {
        let nearest = |ray: &Ray| scene.intersect(ray).is_some();
        let any = |ray: &Ray| scene.occluded(ray);
        RayRates {
            camera: rate(&self.camera, workers, time, nearest),
            bounce: rate(&self.bounce, workers, time, nearest),
            shadow: rate(&self.shadow, workers, time, any),
        }
    }
}

/// Rays a second on all workers, each of which begins elsewhere; zero without rays.
fn rate(rays: &[Ray], workers: &Workers, time: Duration, trace: impl Fn(&Ray) -> bool + Sync) -> f64 {
    if rays.is_empty() {
        return 0.0;
    }
    let (n_traced, n_hits, turn) = (AtomicU64::new(0), AtomicU64::new(0), AtomicU64::new(0));
    let chunks: Vec<&[Ray]> = rays.chunks(CHUNK).collect();
    let start = Instant::now();
    let work = || {
        let (mut traced, mut hits) = (0, 0);
        while start.elapsed() < time {
            let chunk = chunks[turn.fetch_add(1, Ordering::Relaxed) as usize % chunks.len()];
            hits += chunk.iter().filter(|ray| trace(ray)).count() as u64;
            traced += chunk.len() as u64;
        }
        n_traced.fetch_add(traced, Ordering::Relaxed);
        n_hits.fetch_add(hits, Ordering::Relaxed);
    };
    if workers.run(work, || ()).is_err() {
        return 0.0;
    }
    // What was found is used, so that it has to be found.
    std::hint::black_box(n_hits.into_inner());
    n_traced.into_inner() as f64 / start.elapsed().as_secs_f64()
}
