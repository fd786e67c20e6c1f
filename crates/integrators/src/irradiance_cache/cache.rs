//! The records, and what is interpolated between them.

use math::{Dir, Point, Vec3};
use spectrum::{Spectrum, Wavelengths};

use super::basis::Basis;
use super::hemisphere::Irradiance;
use super::record::Record;
use crate::common::Neighbours;

/// How records are used.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rules {
    /// Allowed error a.
    pub(super) error: f32,
    /// Extrapolate with gradients?
    pub(super) gradients: bool,
    /// Do records clamp their neighbours?
    pub(super) clamping: bool,
}

/// Records of one scattering event's place in a path.
#[derive(Debug)]
pub(super) struct Cache {
    rules: Rules,
    basis: Basis,
    records: Vec<Record>,
    /// All groups of the basis of the first record, then of the second, …
    irradiance: Vec<Irradiance>,
    tree: Neighbours,
    /// Records that the tree knows.
    n_in_tree: usize,
}

/// A cache as plain numbers, for another process: of each record p, n, radius and least; of each irradiance its seven spectra.
pub(super) type Parts = (Vec<[f32; 8]>, Vec<[[f32; 4]; 7]>);

impl Cache {
    /// What [`Cache::from_parts`] makes the same cache of.
    pub(super) fn parts(&self) -> Parts {
        let record = |r: &Record| {
            let (p, n) = (r.p.0, r.n.0);
            [p.x, p.y, p.z, n.x, n.y, n.z, r.radius, r.least]
        };
        let irradiance = |e: &Irradiance| {
            let ([a, b, c], [d, f, g]) = (e.by_rotation, e.by_translation);
            [e.e, a, b, c, d, f, g].map(|s| s.0.to_array())
        };
        (self.records.iter().map(record).collect(), self.irradiance.iter().map(irradiance).collect())
    }

    /// The cache of such numbers, known to lookups; `None` if their counts do not belong together.
    pub(super) fn from_parts(rules: Rules, basis: Basis, (records, irradiance): &Parts) -> Option<Self> {
        let mut cache = Self::new(rules, basis);
        let record = |&[px, py, pz, nx, ny, nz, radius, least]: &[f32; 8]| {
            let (p, n) = (Point::new(px, py, pz), Dir(Vec3::new(nx, ny, nz)));
            Record { p, n, radius, least }
        };
        cache.records = records.iter().map(record).collect();
        cache.irradiance = irradiance
            .iter()
            .map(|s| {
                let [e, a, b, c, d, f, g] = s.map(|lanes| Spectrum(math::Vec4::from_array(lanes)));
                Irradiance { e, by_rotation: [a, b, c], by_translation: [d, f, g] }
            })
            .collect();
        cache.update();
        (cache.irradiance.len() == cache.records.len() * basis.n_groups()).then_some(cache)
    }

    pub(super) fn new(rules: Rules, basis: Basis) -> Self {
        let (records, irradiance) = (Vec::new(), Vec::new());
        Self { rules, basis, records, irradiance, tree: Neighbours::default(), n_in_tree: 0 }
    }

    pub(super) fn len(&self) -> usize {
        self.records.len()
    }

    /// Bytes of a record, its place in the tree included.
    pub(super) fn bytes_per_record(basis: Basis) -> u64 {
        (size_of::<Record>() + basis.n_groups() * size_of::<Irradiance>() + 22) as u64
    }

    /// Irradiance at `p` under the normal `n`, as a path of some wavelengths sees it; `None` if no record reaches.
    pub(super) fn interpolate(&self, p: Point, n: Dir, wl: &Wavelengths) -> Option<Spectrum> {
        let n_groups = self.basis.n_groups();
        let (mut sum, mut weights) = ([Spectrum::ZERO; 4], 0.0);
        self.tree.reaching(p, |near| {
            let record = &self.records[near.index as usize];
            let weight = record.weight(p, n, self.rules.error);
            if weight > 0.0 {
                let first = near.index as usize * n_groups;
                let share = if self.rules.gradients { record.gradient_share() } else { 0.0 };
                let (turn, step) = (record.n.0.cross(n.0) * share, (p - record.p) * share);
                for (s, e) in sum.iter_mut().zip(&self.irradiance[first..first + n_groups]) {
                    *s += e.moved(turn, step) * weight;
                }
                weights += weight;
            }
        });
        let groups = sum.map(|s| s * (1.0 / weights));
        (weights > 0.0).then(|| self.basis.load(&groups, wl))
    }

    /// Does a record reach `p` well within the allowed error? The build asks for less error than a lookup allows, so
    /// that what lies between two places where it looked is covered too.
    pub(super) fn covers(&self, p: Point, n: Dir) -> bool {
        const PART: f32 = 0.8;
        let mut covered = false;
        self.tree.reaching(p, |near| {
            covered |= self.records[near.index as usize].weight(p, n, PART * self.rules.error) > 0.0;
        });
        covered
    }

    /// Adds a record, in the basis's groups. Lookups find it after [`Cache::update`].
    pub(super) fn add(&mut self, mut record: Record, groups: &[Irradiance]) {
        if self.rules.clamping {
            self.clamp_neighbours(&mut record);
        }
        self.records.push(record);
        self.irradiance.extend_from_slice(groups);
    }

    /// Lets the new record and all whose reaches overlap its own limit each other.
    fn clamp_neighbours(&mut self, new: &mut Record) {
        let range = 2.0 * self.rules.error;
        let mut near: Vec<u32> = Vec::new();
        self.tree.within(new.p, range * new.used_radius(), |n| near.push(n.index));
        self.tree.reaching(new.p, |n| near.push(n.index));
        near.sort_unstable();
        near.dedup();
        near.extend(self.n_in_tree as u32..self.records.len() as u32);
        for i in near {
            let other = &mut self.records[i as usize];
            let overlap = range * new.used_radius().max(other.used_radius());
            if new.p.distance_squared(other.p) < overlap * overlap {
                new.clamp_both(other);
            }
        }
    }

    /// Makes all records known to lookups.
    pub(super) fn update(&mut self) {
        if self.n_in_tree < self.records.len() {
            let (records, error) = (&self.records, self.rules.error);
            let tree = Neighbours::build(records.iter().map(|r| r.p).zip(0..));
            self.tree = tree.with_reach(|i| error * records[i as usize].used_radius());
            self.n_in_tree = self.records.len();
        }
    }
}

impl Irradiance {
    /// After a small turn of the normal and a step; light does not become negative.
    fn moved(&self, turn: Vec3, step: Vec3) -> Spectrum {
        let mut e = self.e;
        for i in 0..3 {
            e += self.by_rotation[i] * turn[i] + self.by_translation[i] * step[i];
        }
        Spectrum(e.0.max(math::Vec4::ZERO))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rules(clamping: bool) -> Rules {
        Rules { error: 0.3, gradients: true, clamping }
    }

    #[test]
    fn a_record_costs_what_is_said() {
        let bytes = [Basis::Rgb, Basis::Bins].map(Cache::bytes_per_record);
        assert_eq!(bytes, [166, 502], "what the parameter's text and docs/performance.md say");
    }

    /// E = 2 + 3x is told by records with the right gradient, wherever one looks.
    #[test]
    fn a_linear_field_is_interpolated_exactly() {
        let mut cache = Cache::new(rules(true), Basis::Rgb);
        for (i, x) in [0.0_f32, 0.2, 0.35, 0.7].into_iter().enumerate() {
            let record = Record { p: Point::new(x, 0.1 * i as f32, 0.0), n: Dir::Z, radius: 1.0, least: 0.0 };
            let by_translation = [Spectrum::splat(3.0), Spectrum::ZERO, Spectrum::ZERO];
            let e = Spectrum::splat(2.0 + 3.0 * x);
            cache.add(record, &[Irradiance { e, by_translation, ..Irradiance::default() }]);
        }
        assert!(cache.interpolate(Point::new(0.1, 0.1, 0.0), Dir::Z, &Wavelengths::RGB).is_none());
        cache.update();
        for x in [0.05, 0.1, 0.3, 0.5, 0.72] {
            let p = Point::new(x, 0.1, 0.0);
            let e = cache.interpolate(p, Dir::Z, &Wavelengths::RGB).unwrap().lanes()[0];
            assert!((e - (2.0 + 3.0 * x)).abs() < 1e-5, "{x}: {e}");
        }
        assert!(cache.covers(Point::new(0.1, 0.1, 0.0), Dir::Z));
        assert!(!cache.covers(Point::new(0.1, 0.1, 0.0), -Dir::Z));
        assert!(cache.interpolate(Point::new(3.0, 0.0, 0.0), Dir::Z, &Wavelengths::RGB).is_none());
    }

    /// A record at an edge limits those beside it, whichever came first, known to the tree or not.
    #[test]
    fn neighbours_limit_each_other() {
        let near_edge = Record { p: Point::new(0.0, 0.0, 0.0), n: Dir::Z, radius: 0.1, least: 0.0 };
        let careless = Record { p: Point::new(0.2, 0.0, 0.0), n: Dir::Z, radius: 3.0, least: 0.0 };
        for (first, second) in [(near_edge, careless), (careless, near_edge)] {
            for update in [false, true] {
                let mut cache = Cache::new(rules(true), Basis::Rgb);
                cache.add(first, &[Irradiance::default()]);
                if update {
                    cache.update();
                }
                cache.add(second, &[Irradiance::default()]);
                let widest = cache.records.iter().map(|r| r.radius).fold(0.0, f32::max);
                assert!((widest - 0.3).abs() < 1e-6, "{widest}");
            }
        }
    }
}
