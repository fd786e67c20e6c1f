//! The reference: a picture that is given, or a render that is made to a stated accuracy and kept.

use std::time::{Duration, Instant};

use film::Developed;
use render::{Cancel, Checkpoint, Event, Job, Method, Stop, Workers};
use scene::Scene;
use serde::Serialize;

use super::plan::Truth;
use crate::{Metrics, metrics};

/// The seed of references: far from those that people use, since a reference must not share its noise with what it judges.
pub const REFERENCE_SEED: u64 = 0x7265_6665_7265_6e63;

/// What runs are measured against.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Linear R, G, B, row by row.
    pub rgb: Vec<[f32; 3]>,
    /// Variance of each value; zero if it is not known.
    pub variance: Vec<[f32; 3]>,
    /// What it is.
    pub facts: ReferenceFacts,
}

/// What a report says of a reference.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ReferenceFacts {
    /// The file, or the integrator.
    pub name: String,
    /// Its settings, if it was made here.
    pub settings: Option<String>,
    /// Passes in it, if it was made here.
    pub spp: Option<u64>,
    /// relMSE of its own noise: part of every error, and taken off relMSE. Unknown without a variance.
    pub relmse: Option<f64>,
    /// Is its noise as small as was asked for?
    pub is_accurate: bool,
}

impl Reference {
    /// The distances of a picture from this one.
    #[must_use]
    pub fn metrics(&self, developed: &Developed) -> Metrics {
        metrics::compare(&developed.mean, &self.rgb).unwrap_or_else(|_| Metrics::unknown())
    }

    /// Takes what is given, or renders.
    ///
    /// # Errors
    /// The picture has another size, or the render fails.
    pub fn obtain(
        truth: &Truth,
        scene: &Scene,
        workers: &Workers,
        cancel: &Cancel,
        on_event: &mut dyn FnMut(Event<'_>),
    ) -> Result<Self, super::Error> {
        match truth {
            Truth::Picture { name, rgb, variance } => {
                let crop = scene.settings().crop;
                if rgb.len() != crop.area() {
                    return Err(super::Error::ReferenceSize {
                        name: name.clone(),
                        width: crop.width(),
                        height: crop.height(),
                    });
                }
                Ok(Self::given(name, rgb, variance.as_deref()))
            }
            Truth::Render { method, relmse, time, cache } => {
                let method = Method { seed: Some(method.seed.unwrap_or(REFERENCE_SEED)), ..method.clone() };
                let job = Job::new(scene, &method)?;
                let checkpoint = cache.as_ref().map(|folder| checkpoint(folder, &job, scene));
                let maker = Maker { workers, cancel, relmse: *relmse, time: *time };
                maker.make(job, checkpoint.as_ref(), on_event)
            }
        }
    }

    fn given(name: &str, rgb: &[[f32; 3]], variance: Option<&[[f32; 3]]>) -> Self {
        let relmse = variance.map(|v| noise(rgb, v));
        let variance = variance.map_or_else(|| vec![[0.0; 3]; rgb.len()], <[_]>::to_vec);
        let facts =
            ReferenceFacts { name: name.to_owned(), relmse, is_accurate: true, ..ReferenceFacts::default() };
        Self { rgb: rgb.to_vec(), variance, facts }
    }
}

/// Where a reference is kept: a partial film, named by all that decides its bits.
fn checkpoint(folder: &std::path::Path, job: &Job<'_>, scene: &Scene) -> Checkpoint {
    let settings = job.film().settings();
    let key = &settings.key;
    let name = format!("{:?} {:?} {:?} {:?}", key, settings.resolution, settings.crop, settings.filter);
    let hash = name.bytes().fold(0, |h, b| math::hash::combine(h, u64::from(b)));
    let scene = &scene.settings().content_hash;
    let path = folder.join(format!("{scene:016x}-{}-{hash:016x}.partial", key.integrator));
    Checkpoint { path, every: Duration::from_secs(30), resume: true }
}

struct Maker<'a> {
    workers: &'a Workers,
    cancel: &'a Cancel,
    relmse: f64,
    time: Duration,
}

impl Maker<'_> {
    /// Doubles the passes until the noise is small enough or the time is spent.
    fn make(
        &self,
        mut job: Job<'_>,
        checkpoint: Option<&Checkpoint>,
        on_event: &mut dyn FnMut(Event<'_>),
    ) -> Result<Reference, super::Error> {
        let start = Instant::now();
        let mut wanted = 8_u32;
        loop {
            let before = start.elapsed();
            let stop = Stop::Passes(0..wanted);
            let outcome = job.render(&stop, checkpoint, self.workers, self.cancel, on_event)?;
            let film = job.film();
            let developed = film.develop();
            let is_accurate = developed.relmse_estimate() <= self.relmse;
            let took = start.elapsed().saturating_sub(before);
            let has_time = start.elapsed() + took * 2 < self.time || outcome.report.passes == 0;
            if is_accurate || !has_time || outcome.report.cancelled || wanted > u32::MAX / 4 {
                if film.passes().is_empty() {
                    return Err(super::Error::Interrupted);
                }
                let key = &film.settings().key;
                let facts = ReferenceFacts {
                    name: key.integrator.clone(),
                    settings: Some(key.settings.clone()),
                    spp: Some(developed.n_passes),
                    relmse: Some(noise(&developed.mean, &developed.variance)),
                    is_accurate,
                };
                return Ok(Reference { rgb: developed.mean, variance: developed.variance, facts });
            }
            // Resumed passes cost nothing: go on from what there is.
            wanted = wanted.max(u32::try_from(film.passes().len()).unwrap_or(wanted)).saturating_mul(2);
        }
    }
}

/// relMSE that noise alone makes.
fn noise(rgb: &[[f32; 3]], variance: &[[f32; 3]]) -> f64 {
    let relative = |(m, v): (&[f32; 3], &[f32; 3])| {
        (0..3)
            .map(|c| f64::from(v[c]) / (f64::from(m[c]).powi(2) + 0.01))
            .filter(|x| x.is_finite())
            .sum::<f64>()
    };
    rgb.iter().zip(variance).map(relative).sum::<f64>() / (3 * rgb.len().max(1)) as f64
}
