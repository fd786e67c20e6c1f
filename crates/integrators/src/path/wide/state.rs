//! Paths on their way, one column for each number of theirs.

use accel::Hit;
use math::lanes::{Floats, LANES, Longs, Vec3Lanes, Words};
use math::{Dir, Point, Ray, Vec3};
use sampling::{LongsOf, PathState, Pdf, SolidAngle};
use scene::LightContext;
use spectrum::Spectrum;

/// How many paths go together: a multiple of [`LANES`]. What belongs to them fits into a core's second cache.
pub(super) const MOST: usize = 256;

/// A path as it is kept between two surfaces. Media, shortcuts and guides are not: paths with any go one by one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Record {
    pub(super) ray: Ray,
    /// Where its numbers come from.
    pub(super) state: PathState,
    pub(super) throughput: Spectrum,
    /// Where it last scattered, and the density of its direction there; `None` after the camera or a delta.
    pub(super) rival: Option<(LightContext, Pdf<SolidAngle>)>,
    pub(super) eta_scale: f32,
    /// Scattering events so far.
    pub(super) depth: u32,
    /// Which of the paths it is.
    pub(super) slot: u32,
}

impl Record {
    /// A path from the eye.
    pub(super) fn start(ray: &Ray, state: PathState, slot: u32) -> Self {
        Self { ray: *ray, state, throughput: Spectrum::ONE, rival: None, eta_scale: 1.0, depth: 0, slot }
    }
}

/// Columns of floats.
pub(super) mod column {
    pub(in super::super) const THROUGHPUT: usize = 0;
    /// Where it last scattered: point, its error, geometric and shading normal.
    pub(in super::super) const P: usize = 4;
    pub(in super::super) const ERROR: usize = 7;
    pub(in super::super) const NG: usize = 10;
    pub(in super::super) const NS: usize = 13;
    /// The density of its direction there; negative if nothing competes.
    pub(in super::super) const RIVAL: usize = 16;
    pub(in super::super) const ETA_SCALE: usize = 17;
    pub(in super::super) const COUNT: usize = 18;
}

/// Columns of words.
pub(super) mod word {
    pub(in super::super) const DEPTH: usize = 0;
    pub(in super::super) const DIMENSION: usize = 1;
    pub(in super::super) const SLOT: usize = 2;
    pub(in super::super) const COUNT: usize = 3;
}

/// The paths, in columns.
pub(super) struct Paths {
    floats: Box<[[f32; MOST]; column::COUNT]>,
    words: Box<[[u32; MOST]; word::COUNT]>,
    keys: Box<[u64; MOST]>,
    /// Where they go.
    pub(super) rays: Vec<Ray>,
    /// What they meet.
    pub(super) hits: Vec<Option<Hit>>,
    /// Of the pass.
    pub(super) index: u32,
}

/// Rays to lamps, and what they bring if nothing is in between.
pub(super) struct Shadows {
    pub(super) rays: Vec<Ray>,
    pub(super) light: Vec<([f32; 3], u32)>,
    pub(super) occluded: Vec<bool>,
}

impl Shadows {
    pub(super) fn new() -> Self {
        Self { rays: Vec::with_capacity(MOST), light: Vec::with_capacity(MOST), occluded: vec![false; MOST] }
    }
}

impl Paths {
    pub(super) fn new() -> Self {
        Self {
            floats: Box::new([[0.0; MOST]; column::COUNT]),
            words: Box::new([[0; MOST]; word::COUNT]),
            keys: Box::new([0; MOST]),
            rays: Vec::with_capacity(MOST),
            hits: vec![None; MOST],
            index: 0,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.rays.len()
    }

    /// Adds a path at the end.
    pub(super) fn push(&mut self, record: &Record) {
        self.rays.push(record.ray);
        self.set(self.rays.len() - 1, record);
    }

    /// Makes a path the `i`th.
    pub(super) fn set(&mut self, i: usize, record: &Record) {
        self.rays[i] = record.ray;
        let f = &mut self.floats;
        let mut put = |at: usize, values: &[f32]| {
            for (k, v) in values.iter().enumerate() {
                f[at + k][i] = *v;
            }
        };
        put(column::THROUGHPUT, &record.throughput.lanes());
        let pdf = match &record.rival {
            Some((from, pdf)) => {
                put(column::P, &from.p.0.to_array());
                put(column::ERROR, &from.p_error.to_array());
                put(column::NG, &from.ng.unwrap_or_default().0.to_array());
                put(column::NS, &from.ns.map_or(Vec3::ZERO, |n| n.0).to_array());
                pdf.value()
            }
            None => -1.0,
        };
        put(column::RIVAL, &[pdf]);
        put(column::ETA_SCALE, &[record.eta_scale]);
        self.words[word::DEPTH][i] = record.depth;
        self.words[word::DIMENSION][i] = record.state.dimension;
        self.words[word::SLOT][i] = record.slot;
        self.keys[i] = record.state.key;
        self.index = record.state.index;
    }

    /// Path `i`.
    pub(super) fn record(&self, i: usize) -> Record {
        let f = &self.floats;
        let vec3 = |at: usize| Vec3::new(f[at][i], f[at + 1][i], f[at + 2][i]);
        let ray = self.rays[i];
        let pdf = f[column::RIVAL][i];
        let rival = (pdf >= 0.0).then(|| {
            let from = LightContext {
                p: Point(vec3(column::P)),
                p_error: vec3(column::ERROR),
                ng: Some(Dir(vec3(column::NG))),
                // (None is kept as zero.)
                ns: Some(Dir(vec3(column::NS))).filter(|n| n.0 != Vec3::ZERO),
                time: ray.time,
            };
            (from, Pdf::new(pdf))
        });
        let t = column::THROUGHPUT;
        Record {
            ray,
            state: PathState {
                key: self.keys[i],
                index: self.index,
                dimension: self.words[word::DIMENSION][i],
            },
            throughput: Spectrum::from_lanes([f[t][i], f[t + 1][i], f[t + 2][i], f[t + 3][i]]),
            rival,
            eta_scale: f[column::ETA_SCALE][i],
            depth: self.depth(i),
            slot: self.slot(i),
        }
    }

    pub(super) fn depth(&self, i: usize) -> u32 {
        self.words[word::DEPTH][i]
    }

    pub(super) fn slot(&self, i: usize) -> u32 {
        self.words[word::SLOT][i]
    }

    /// Sixteen of a column, from `at` on.
    #[inline(always)]
    pub(super) fn floats<F: Floats>(&self, column: usize, at: usize) -> F {
        F::load(lanes_at(&self.floats[column], at))
    }

    #[inline(always)]
    pub(super) fn words<F: Floats>(&self, column: usize, at: usize) -> F::Words {
        F::Words::load(lanes_at(&self.words[column], at))
    }

    #[inline(always)]
    pub(super) fn keys<F: Floats>(&self, at: usize) -> LongsOf<F> {
        LongsOf::<F>::load(lanes_at(&self.keys[..], at))
    }

    /// Writes the lanes of the mask from `at` on, with what is undefined after them up to sixteen.
    #[inline(always)]
    pub(super) fn put<F: Floats>(&mut self, column: usize, at: usize, value: F, mask: F::Mask) {
        value.front(mask).store(lanes_at_mut(&mut self.floats[column], at));
    }

    #[inline(always)]
    pub(super) fn put3<F: Floats>(&mut self, column: usize, at: usize, v: Vec3Lanes<F>, mask: F::Mask) {
        self.put(column, at, v.x, mask);
        self.put(column + 1, at, v.y, mask);
        self.put(column + 2, at, v.z, mask);
    }

    #[inline(always)]
    pub(super) fn put_words<F: Floats>(&mut self, column: usize, at: usize, value: F::Words, mask: F::Mask) {
        value.floats().front(mask).bits().store(lanes_at_mut(&mut self.words[column], at));
    }

    #[inline(always)]
    pub(super) fn put_keys<F: Floats>(&mut self, at: usize, value: LongsOf<F>, mask: F::Mask) {
        let (high, low) = (value.high().floats().front(mask), value.low().floats().front(mask));
        LongsOf::<F>::of_halves(high.bits(), low.bits()).store(lanes_at_mut(&mut self.keys[..], at));
    }
}

#[inline(always)]
fn lanes_at<T>(column: &[T], at: usize) -> &[T; LANES] {
    // Groups lie within the columns: `at` is at most `MOST - LANES`.
    match column[at..].first_chunk() {
        Some(lanes) => lanes,
        None => unreachable!("a group of lanes within the columns"),
    }
}

#[inline(always)]
fn lanes_at_mut<T>(column: &mut [T], at: usize) -> &mut [T; LANES] {
    match column[at..].first_chunk_mut() {
        Some(lanes) => lanes,
        None => unreachable!("a group of lanes within the columns"),
    }
}
