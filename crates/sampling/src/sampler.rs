//! Samplers: the only place where random numbers are made.
//!
//! Every number is a pure function of (seed, pixel or path, pass, dimension): a cell of the render may run anywhere and
//! twice. A sampler sees the index of its pass, never the number of passes, so every render can be extended.
//!
//! | kind        | numbers of one dimension over the passes of a pixel                   |
//! |-------------|-----------------------------------------------------------------------|
//! | Sobol       | Owen-scrambled (0, 2)-sequence, one padded pair per request [Burley2020] |
//! | Independent | hashes                                                                |
//! | Stratified  | `x y` strata jittered, in a random order, then the next `x y` [Cook1984] |
//!
//! A fourth, made by [`Sampler::replay`], reads a list: primary sample space for Metropolis methods [Kelemen2002].
//!
//! Light paths ([`Sampler::start_path`]) are the points of one sequence *within* a pass, scrambled anew for every pass:
//! paths of one pass cover the emitters evenly, and passes are independent.
//!
//! Left out: error distributed as blue noise over the pixels: the known constructions that keep the order of convergence
//! need the number of samples in advance [Ahmed2020], which an extensible render does not have.

use math::hash::{combine, mix64, unit_f32};

use crate::sobol::{PairSeeds, scrambled_1d, scrambled_2d};

/// Which points a sampler makes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum SamplerKind {
    /// Owen-scrambled Sobol' pairs.
    #[default]
    Sobol,
    /// Independent numbers.
    Independent,
    /// Jittered strata: `x × y` for pairs, `x y` for single numbers.
    Stratified {
        /// Strata along the first axis, at least one.
        x: u32,
        /// Strata along the second axis, at least one.
        y: u32,
    },
}

/// Makes the numbers of one path at a time. Copies cheaply; starting a path allocates nothing.
#[derive(Clone, Debug)]
pub struct Sampler {
    source: Source,
    /// Number of independent scrambles that passes are dealt to.
    randomisations: u32,
    /// Hash of the seed.
    base: u64,
    /// Hash of what the path belongs to.
    key: u64,
    /// Which point of the sequence; for Sobol with its bits reversed.
    index: u32,
    /// Counts the requests.
    dimension: u32,
}

#[derive(Clone, Debug)]
enum Source {
    Sobol,
    Independent,
    Stratified { x: u32, y: u32 },
    Replay(Vec<f32>),
}

/// Where a Sobol' path is, so that it can go on later, or beside others in lanes ([`crate::SobolLanes`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathState {
    /// Hash of what the path belongs to.
    pub key: u64,
    /// Which point of the sequence, its bits reversed: the same for all camera paths of a pass.
    pub index: u32,
    /// Which request comes next.
    pub dimension: u32,
}

/// Domains that keep the numbers of camera paths, light paths and recorded paths apart.
const CAMERA: u64 = 0xca_3e7a;
const LIGHT: u64 = 0x11_9477;
const REPLAY: u64 = 0x4e_91a7;

impl Sampler {
    /// A sampler for a whole render; [`Sampler::start`] it before the first number.
    #[must_use]
    pub fn new(kind: SamplerKind, seed: u64) -> Self {
        let source = match kind {
            SamplerKind::Sobol => Source::Sobol,
            SamplerKind::Independent => Source::Independent,
            SamplerKind::Stratified { x, y } => Source::Stratified { x: x.max(1), y: y.max(1) },
        };
        let base = combine(0, seed);
        Self { source, randomisations: 1, base, key: base, index: 0, dimension: 0 }
    }

    /// Deals passes to `r` independent randomisations: pass p is point p / r of scramble p mod r. Their spread gives an
    /// error interval, which the passes of one low-discrepancy sequence cannot.
    #[must_use]
    pub fn with_randomisations(self, r: u32) -> Self {
        Self { randomisations: r.max(1), ..self }
    }

    /// Reads `values` in order; past their end, hashes of (seed, position) that are kept, so that
    /// [`Sampler::replayed`] tells all that the path used.
    #[must_use]
    pub fn replay(values: Vec<f32>, seed: u64) -> Self {
        let base = combine(REPLAY, seed);
        Self { source: Source::Replay(values), randomisations: 1, base, key: base, index: 0, dimension: 0 }
    }

    /// Begins the camera path of `pixel` in `pass`.
    #[inline]
    pub fn start(&mut self, pixel: [i32; 2], pass: u32) {
        let at = u64::from(pixel[0] as u32) << 32 | u64::from(pixel[1] as u32);
        let (scramble, point) = (pass % self.randomisations, pass / self.randomisations);
        self.begin(combine(combine(self.base ^ CAMERA, at), u64::from(scramble)), point);
    }

    /// Begins light path number `path` of `pass`.
    #[inline]
    pub fn start_path(&mut self, path: u64, pass: u32) {
        let key = combine(combine(self.base ^ LIGHT, u64::from(pass)), path >> 32);
        self.begin(key, path as u32);
    }

    fn begin(&mut self, key: u64, point: u32) {
        self.dimension = 0;
        match &self.source {
            Source::Sobol => (self.key, self.index) = (key, point.reverse_bits()),
            Source::Independent => (self.key, self.index) = (combine(key, u64::from(point)), 0),
            Source::Stratified { x, y } => {
                let n = x.saturating_mul(*y);
                (self.key, self.index) = (combine(key, u64::from(point / n)), point % n);
            }
            // A recorded path is what it is; only the reading starts over.
            Source::Replay(_) => {}
        }
    }

    /// Where the path is; `None` for other kinds than Sobol'.
    #[must_use]
    pub fn path_state(&self) -> Option<PathState> {
        match self.source {
            Source::Sobol => Some(PathState { key: self.key, index: self.index, dimension: self.dimension }),
            Source::Independent | Source::Stratified { .. } | Source::Replay(_) => None,
        }
    }

    /// Goes on where another Sobol' sampler, or this one, was.
    #[inline]
    pub fn resume(&mut self, state: PathState) {
        (self.key, self.index, self.dimension) = (state.key, state.index, state.dimension);
    }

    /// Which request comes next.
    #[must_use]
    pub fn dimension(&self) -> u32 {
        self.dimension
    }

    /// Makes request number `dimension` the next, so that a bounce always uses the same dimensions, whatever those
    /// before it did.
    pub fn set_dimension(&mut self, dimension: u32) {
        self.dimension = dimension;
    }

    /// Uniform in [0, 1).
    #[inline]
    pub fn next_1d(&mut self) -> f32 {
        let d = self.dimension;
        self.dimension = d.wrapping_add(1);
        let hash = self.hash(d);
        match self.source {
            Source::Sobol => unit_f32(scrambled_1d(self.index, PairSeeds::new(hash))),
            Source::Independent | Source::Stratified { .. } | Source::Replay(_) => self.other_1d(d, hash),
        }
    }

    /// Request `d` of the kinds that are rare.
    #[inline(never)]
    fn other_1d(&mut self, d: u32, hash: u64) -> f32 {
        match &mut self.source {
            Source::Sobol | Source::Independent => unit_f32((hash >> 32) as u32),
            Source::Stratified { x, y } => {
                let n = x.saturating_mul(*y);
                let i = permute(self.index, n, hash as u32);
                jitter(i, n, combine(hash, u64::from(i)))
            }
            Source::Replay(values) => read(values, d as usize, self.key),
        }
    }

    /// Leaves out a number that nobody would look at: those after it are what they would be.
    #[inline]
    pub fn skip_1d(&mut self) {
        self.dimension = self.dimension.wrapping_add(1);
    }

    /// [`Sampler::next_1d`] where somebody looks at the number, else ½: those after it are the same.
    #[inline]
    pub fn next_1d_if(&mut self, is_wanted: bool) -> f32 {
        if is_wanted {
            return self.next_1d();
        }
        self.skip_1d();
        0.5
    }

    /// Uniform in [0, 1)².
    #[inline]
    pub fn next_2d(&mut self) -> [f32; 2] {
        let d = self.dimension;
        self.dimension = d.wrapping_add(1);
        let hash = self.hash(d);
        match self.source {
            Source::Sobol => scrambled_2d(self.index, PairSeeds::new(hash)).map(unit_f32),
            Source::Independent | Source::Stratified { .. } | Source::Replay(_) => self.other_2d(d, hash),
        }
    }

    /// Request `d` of the kinds that are rare.
    #[inline(never)]
    fn other_2d(&mut self, d: u32, hash: u64) -> [f32; 2] {
        match &mut self.source {
            Source::Sobol | Source::Independent => [unit_f32((hash >> 32) as u32), unit_f32(hash as u32)],
            Source::Stratified { x, y } => {
                let i = permute(self.index, x.saturating_mul(*y), hash as u32);
                let h = combine(hash, u64::from(i));
                [jitter(i % *x, *x, h), jitter(i / *x, *y, h << 32)]
            }
            Source::Replay(values) => {
                // Two numbers are two places of the list.
                self.dimension = d.wrapping_add(2);
                [read(values, d as usize, self.key), read(values, d as usize + 1, self.key)]
            }
        }
    }

    /// Where in its pixel the path starts: the first request of a camera path, by custom.
    #[inline]
    pub fn pixel_2d(&mut self) -> [f32; 2] {
        self.next_2d()
    }

    /// The list of a replaying sampler, with what was added at its end; empty for the other kinds.
    #[must_use]
    pub fn replayed(&self) -> &[f32] {
        match &self.source {
            Source::Replay(values) => values,
            Source::Sobol | Source::Independent | Source::Stratified { .. } => &[],
        }
    }

    /// The list itself, so that its memory serves the next path.
    #[must_use]
    pub fn into_replayed(self) -> Vec<f32> {
        match self.source {
            Source::Replay(values) => values,
            Source::Sobol | Source::Independent | Source::Stratified { .. } => Vec::new(),
        }
    }

    #[inline]
    fn hash(&self, dimension: u32) -> u64 {
        mix64(self.key ^ u64::from(dimension).wrapping_mul(0x9e37_79b9_7f4a_7c15))
    }
}

/// Number `at` of a list that grows by hashes.
fn read(values: &mut Vec<f32>, at: usize, key: u64) -> f32 {
    while values.len() <= at {
        values.push(unit_f32((combine(key, values.len() as u64) >> 32) as u32));
    }
    values[at]
}

/// A point of stratum `i` of `n`, by the upper half of `hash`; always below one.
fn jitter(i: u32, n: u32, hash: u64) -> f32 {
    ((i as f32 + unit_f32((hash >> 32) as u32)) / n as f32).min(1.0 - f32::EPSILON / 2.0)
}

/// A permutation of 0..n that depends on `seed`: one of the next power of two, walked until it falls below n (as in
/// [Kensler2013], with rounds of our own).
fn permute(mut i: u32, n: u32, seed: u32) -> u32 {
    if n <= 1 {
        return 0;
    }
    let bits = 32 - (n - 1).leading_zeros();
    let mask = u32::MAX >> (32 - bits);
    let half = bits.div_ceil(2);
    loop {
        // Every step is a bijection of the lowest `bits` bits.
        for round in 0..3_u32 {
            let s = math::hash::mix32(seed.wrapping_add(round.wrapping_mul(0x9e37_79b9)));
            i = (i ^ s) & mask;
            i = i.wrapping_mul(s >> 7 | 1) & mask;
            i ^= i >> half;
            i = i.wrapping_mul(0x21f0_aaad) & mask;
        }
        if i < n {
            return i;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(s: &mut Sampler, pixel: [i32; 2], pass: u32) -> Vec<f32> {
        s.start(pixel, pass);
        let mut v = vec![s.next_1d()];
        v.extend(s.pixel_2d());
        v.push(s.next_1d());
        v.extend(s.next_2d());
        v
    }

    const KINDS: [SamplerKind; 3] =
        [SamplerKind::Sobol, SamplerKind::Independent, SamplerKind::Stratified { x: 5, y: 3 }];

    #[test]
    fn numbers_depend_on_seed_pixel_pass_and_dimension_and_on_nothing_else() {
        for kind in KINDS {
            let mut a = Sampler::new(kind, 1);
            let here = numbers(&mut a, [3, 4], 7);
            let _ = numbers(&mut a, [9, 9], 2);
            assert_eq!(here, numbers(&mut a, [3, 4], 7));
            assert_ne!(here, numbers(&mut a, [4, 3], 7));
            assert_ne!(here, numbers(&mut a, [3, 4], 8));
            assert_ne!(here, numbers(&mut Sampler::new(kind, 2), [3, 4], 7));
            a.start_path(3 << 32 | 4, 7);
            assert_ne!(here[0], a.next_1d());
            a.start([3, 4], 7);
            a.set_dimension(2);
            assert_eq!(here[3], a.next_1d());
            a.start([3, 4], 7);
            let _ = a.next_1d();
            a.skip_1d();
            assert_eq!(here[3], a.next_1d());
        }
    }

    #[test]
    fn permutations_are_permutations() {
        for n in [1, 2, 3, 7, 16, 100] {
            for seed in 0..20 {
                let mut seen: Vec<u32> = (0..n).map(|i| permute(i, n, seed)).collect();
                seen.sort_unstable();
                assert!(seen.iter().copied().eq(0..n), "{n}");
            }
        }
    }

    #[test]
    fn strata_are_filled_once_each_and_again_in_the_next_round() {
        let mut s = Sampler::new(SamplerKind::Stratified { x: 5, y: 3 }, 0);
        for round in 0..3 {
            let (mut pairs, mut singles) = (vec![0; 15], vec![0; 15]);
            for pass in round * 15..(round + 1) * 15 {
                s.start([1, 2], pass);
                let u = s.next_2d();
                pairs[(u[0] * 5.0) as usize + 5 * (u[1] * 3.0) as usize] += 1;
                singles[(s.next_1d() * 15.0) as usize] += 1;
            }
            assert!(pairs.iter().chain(&singles).all(|&c| c == 1), "{pairs:?} {singles:?}");
        }
    }

    #[test]
    fn a_replayed_path_reads_its_list_and_grows_it_by_hashes() {
        let mut s = Sampler::replay(vec![0.25, 0.5, 0.75], 9);
        assert_eq!((s.next_1d(), s.next_2d()), (0.25, [0.5, 0.75]));
        let more = s.next_2d();
        assert_eq!(s.replayed(), [0.25, 0.5, 0.75, more[0], more[1]]);
        // The same path again, from what it used.
        s.start([0, 0], 0);
        assert_eq!((s.next_2d(), s.next_1d(), s.next_2d()), ([0.25, 0.5], 0.75, more));
        assert_eq!(Sampler::replay(Vec::new(), 9).next_1d(), Sampler::replay(Vec::new(), 9).next_1d());
    }

    #[test]
    fn passes_are_dealt_to_randomisations() {
        let mut dealt = Sampler::new(SamplerKind::Sobol, 3).with_randomisations(4);
        // Every fourth pass belongs to one sequence, whose first 16 points hit each sixteenth once.
        for r in 0..4 {
            let mut cells = [0; 16];
            for p in 0..16 {
                dealt.start([5, 6], p * 4 + r);
                cells[(dealt.next_1d() * 16.0) as usize] += 1;
            }
            assert_eq!(cells, [1; 16]);
        }
    }
}
