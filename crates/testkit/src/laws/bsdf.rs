//! The laws of BSDFs, one test each for every kind: see [`bsdf_laws!`](crate::bsdf_laws).
//!
//! | law                        | what it finds                                                              |
//! |----------------------------|----------------------------------------------------------------------------|
//! | `sampling_follows_pdf`     | a warp and a density that differ; a density of the wrong mass (χ²)         |
//! | `weights_are_f_cos_over_pdf` | a sample that disagrees with `eval` and `pdf` at its own direction       |
//! | `sampling_agrees_with_eval` | a sample whose mean differs from the integral of `eval`, region by region |
//! | `is_reciprocal`            | `f` without a cosine, `G1` for `G2`, a missing or surplus η²               |
//! | `conserves_energy`         | more light out than in                                                     |
//! | `is_finite_everywhere`     | NaN, infinities and negative values at any angle                           |
//!
//! Every statistical test has a fixed seed and rejects a right BSDF with probability below 1e-6.
//! Random walks between layers (`pdf_is_proportional`) have no exact density and a random `eval`: for them the χ² test
//! and the test of weights give way to a test of the density's mass, and reciprocity holds in the mean.

use math::hash::{combine, unit_f32};
use math::{LocalDir, Vec3};
use scatter::{Bsdf, BsdfSample, TransportMode};
use spectrum::Spectrum;

use crate::chi2::{Chi2Settings, chi2_sphere, uniform_pair};
use statistics::{Moments, sidak, welch_test};

/// Writes the tests of all laws for each line `name: bsdf;`, in a module of that name.
#[macro_export]
macro_rules! bsdf_laws {
    ($($name:ident: $bsdf:expr;)*) => {$(
        mod $name {
            #[allow(unused_imports, reason = "a line may need no name from around it")]
            use super::*;

            fn bsdf() -> $crate::laws::bsdf::Subject {
                $crate::laws::bsdf::Subject::new($bsdf)
            }

            #[test]
            fn sampling_follows_pdf() {
                bsdf().sampling_follows_pdf();
            }

            #[test]
            fn weights_are_f_cos_over_pdf() {
                bsdf().weights_are_f_cos_over_pdf();
            }

            #[test]
            fn sampling_agrees_with_eval() {
                bsdf().sampling_agrees_with_eval();
            }

            #[test]
            fn is_reciprocal() {
                bsdf().is_reciprocal();
            }

            #[test]
            fn conserves_energy() {
                bsdf().conserves_energy();
            }

            #[test]
            fn is_finite_everywhere() {
                bsdf().is_finite_everywhere();
            }
        }
    )*};
}

/// Chance of rejecting a right BSDF, for each law.
const SIGNIFICANCE: f64 = 1e-6;

/// A BSDF under test.
pub struct Subject {
    bsdf: Bsdf,
    /// Its samples come from a walk between layers.
    is_walk: bool,
}

/// Three numbers for sample `index` of stream `seed`.
fn numbers(seed: u64, index: u64) -> (f32, [f32; 2]) {
    (uniform_pair(seed ^ 0x10be, index)[0], uniform_pair(seed, index))
}

/// Uniform on the sphere.
fn on_sphere(u: [f32; 2]) -> LocalDir {
    let z = 1.0 - 2.0 * u[0];
    let (sin, cos) = math::trig::sin_cos(std::f32::consts::TAU * u[1]);
    let r = math::trig::safe_sqrt(1.0 - z * z);
    LocalDir(Vec3::new(r * cos, r * sin, z))
}

/// Steep, slanted and grazing directions on both sides.
fn directions() -> Vec<LocalDir> {
    let mut all = Vec::new();
    for (x, y, z) in [(0.05, 0.1, 1.0), (0.5, -0.3, 0.8), (-0.7, 0.6, 0.5), (0.3, 1.0, 0.12)] {
        all.push(LocalDir::normalize(Vec3::new(x, y, z)));
        all.push(LocalDir::normalize(Vec3::new(y, -x, -z)));
    }
    all
}

impl Subject {
    /// The BSDF, tested for whether it is a walk.
    #[must_use]
    pub fn new(bsdf: impl Into<Bsdf>) -> Self {
        let bsdf = bsdf.into();
        let wo = LocalDir::normalize(Vec3::new(0.3, 0.2, 1.0));
        let is_walk = (0..200).any(|i| {
            let (u_lobe, u) = numbers(0, i);
            bsdf.sample(wo, u_lobe, u, TransportMode::Radiance).is_some_and(|s| s.pdf_is_proportional)
        });
        Self { bsdf, is_walk }
    }

    fn sample(&self, wo: LocalDir, seed: u64, index: u64, mode: TransportMode) -> Option<BsdfSample> {
        let (u_lobe, u) = numbers(seed, index);
        self.bsdf.sample(wo, u_lobe, u, mode)
    }

    /// Histograms of smooth samples against the integral of the density, from eight directions.
    pub fn sampling_follows_pdf(&self) {
        let (b, mode) = (&self.bsdf, TransportMode::Radiance);
        for (i, wo) in directions().into_iter().enumerate() {
            let pdf = |w: [f64; 3]| {
                let w = LocalDir::normalize(Vec3::new(w[0] as f32, w[1] as f32, w[2] as f32));
                f64::from(b.pdf(wo, w, mode).value())
            };
            if b.is_delta_only() {
                assert_eq!(pdf([0.6, 0.0, 0.8]), 0.0, "a delta has no density");
                assert_eq!(pdf([0.6, 0.0, -0.8]), 0.0, "a delta has no density");
                continue;
            }
            if self.is_walk {
                let mass = mean_over_sphere(|w| pdf([f64::from(w.0.x), f64::from(w.0.y), f64::from(w.0.z)]));
                assert!((0.05..1.1).contains(&mass), "{wo:?}: the density's mass is {mass}");
                continue;
            }
            // A surface that is black from this side has nothing to draw from, and says so.
            if (0..1000).all(|i| self.sample(wo, 9, i, mode).is_none()) {
                let mass = mean_over_sphere(|w| pdf([f64::from(w.0.x), f64::from(w.0.y), f64::from(w.0.z)]));
                assert_eq!(mass, 0.0, "{wo:?}: a density, but no samples");
                continue;
            }
            let settings = Chi2Settings {
                seed: i as u64,
                significance: sidak(SIGNIFICANCE, 8),
                ..Chi2Settings::default()
            };
            let sample = |u: [f32; 2]| {
                let u_lobe = unit_f32(combine(u64::from(u[0].to_bits()), u64::from(u[1].to_bits())) as u32);
                let s = b.sample(wo, u_lobe, u, mode).filter(|s| !s.is_specular())?;
                Some(s.wi.0.to_array().map(f64::from))
            };
            if let Err(why) = chi2_sphere(&settings, sample, pdf) {
                panic!("from {wo:?}: {why}");
            }
        }
    }

    /// Weight and density of each sample against `eval` and `pdf` at its direction.
    pub fn weights_are_f_cos_over_pdf(&self) {
        for mode in [TransportMode::Radiance, TransportMode::Importance] {
            for wo in directions() {
                let samples = (0..2000).filter_map(|i| self.sample(wo, 1, i, mode));
                // Where the cosine has few bits left, so has the density.
                for s in samples.filter(|s| !s.is_specular() && s.wi.abs_cos_theta() > 0.02) {
                    let (f, pdf) = self.bsdf.eval_pdf(wo, s.wi, mode);
                    let claimed = s.pdf().expect("it is smooth").value();
                    assert!((pdf.value() / claimed - 1.0).abs() < 5e-3, "{wo:?} {s:?}: {pdf:?}");
                    if self.is_walk {
                        assert!(s.f().is_none(), "a walk has no exact f");
                        continue;
                    }
                    let expected = f * (s.wi.abs_cos_theta() / pdf.value());
                    let off = (expected - s.weight).map(f32::abs).max_component();
                    assert!(off <= 5e-3 * s.weight.max_component(), "{wo:?} {s:?}: weight {expected:?}");
                }
            }
        }
    }

    /// Mean weight of samples in each of eight regions against `∫ f |cos|` over it, for smooth lobes.
    pub fn sampling_agrees_with_eval(&self) {
        if self.bsdf.is_delta_only() {
            return;
        }
        let (n, mode) = (40_000, TransportMode::Radiance);
        for wo in directions().into_iter().step_by(3) {
            let mut by_sample = [Moments::default(); 8];
            let mut by_eval = [Moments::default(); 8];
            for i in 0..n {
                let s = self.sample(wo, 2, i, mode).filter(|s| !s.is_specular());
                push(&mut by_sample, s.map(|s| (s.wi, s.weight.average())));

                // A direction from the BSDF's own density would hide what it never samples: half are uniform.
                let wi = on_sphere(uniform_pair(3, i));
                let (wi, pdf) = self.mixed(wo, wi, i);
                let f = self.bsdf.eval(wo, wi, mode);
                push(&mut by_eval, Some((wi, f.average() * wi.abs_cos_theta() / pdf)));
            }
            for (region, (a, b)) in by_sample.iter().zip(&by_eval).enumerate() {
                welch_test(a, b).assert_consistent(
                    sidak(SIGNIFICANCE, 24),
                    &format!("from {wo:?}, region {region}: {} by samples, {} by eval", a.mean(), b.mean()),
                );
            }
        }
    }

    /// `uniform`, or a sample of the BSDF in its place, with the density of the mixture. Walks stay uniform.
    fn mixed(&self, wo: LocalDir, uniform: LocalDir, index: u64) -> (LocalDir, f32) {
        let (mode, flat) = (TransportMode::Radiance, 0.25 * std::f32::consts::FRAC_1_PI);
        if self.is_walk {
            return (uniform, flat);
        }
        let drawn = self.sample(wo, 4, index, mode).filter(|s| !s.is_specular() && index % 2 == 1);
        // An invalid sample falls back to the uniform one, and with it the density of the mixture would be off:
        // it counts as a direction that carries nothing.
        match (index % 2 == 1, drawn) {
            (true, None) => (uniform, f32::INFINITY),
            (true, Some(s)) => (s.wi, 0.5 * (flat + self.bsdf.pdf(wo, s.wi, mode).value())),
            (false, _) => (uniform, 0.5 * (flat + self.bsdf.pdf(wo, uniform, mode).value())),
        }
    }

    /// Radiance one way is importance the other; on one side both are the same; between sides they differ by η².
    pub fn is_reciprocal(&self) {
        if self.is_walk {
            return self.is_reciprocal_in_the_mean();
        }
        for i in 0..20_000 {
            let (wo, wi) = (on_sphere(uniform_pair(5, i)), on_sphere(uniform_pair(6, i)));
            self.assert_reciprocal(wo, wi, None);
            let below = self.sample(wo, 7, i, TransportMode::Radiance).filter(|s| !s.is_specular());
            if let Some(s) = below.filter(|s| s.wi.abs_cos_theta() > 0.02 && wo.abs_cos_theta() > 0.02) {
                self.assert_reciprocal(wo, s.wi, Some(s.eta));
            }
        }
    }

    fn assert_reciprocal(&self, wo: LocalDir, wi: LocalDir, eta: Option<f32>) {
        let close = |a: Spectrum, b: Spectrum| {
            let off = (a - b).map(f32::abs).max_component();
            off <= 2e-3 * a.max_component().max(b.max_component()) + 1e-9
        };
        let radiance = self.bsdf.eval(wo, wi, TransportMode::Radiance);
        let back = self.bsdf.eval(wi, wo, TransportMode::Importance);
        assert!(close(radiance, back), "{wo:?} {wi:?}: {radiance:?}, and as importance {back:?}");
        if !self.bsdf.is_reciprocal() {
            return;
        }
        if wo.same_hemisphere(wi) {
            let back = self.bsdf.eval(wi, wo, TransportMode::Radiance);
            assert!(close(radiance, back), "{wo:?} {wi:?}: {radiance:?}, and back {back:?}");
        }
        if let Some(eta) = eta {
            let importance = self.bsdf.eval(wo, wi, TransportMode::Importance);
            assert!(close(radiance * (eta * eta), importance), "{radiance:?} is not {importance:?} / {eta}²");
        }
    }

    /// The mean of a random `eval` over two small cones, one way and back.
    fn is_reciprocal_in_the_mean(&self) {
        let near = |w: Vec3, u: [f32; 2]| LocalDir::normalize(w + 0.05 * on_sphere(u).0);
        for (k, (a, b)) in [
            (Vec3::new(0.2, 0.1, 0.9), Vec3::new(-0.7, 0.3, 0.5)),
            (Vec3::new(0.9, 0.0, 0.3), Vec3::new(-0.5, -0.1, 0.6)),
        ]
        .into_iter()
        .enumerate()
        {
            let (mut there, mut back) = (Moments::default(), Moments::default());
            for i in 0..60_000 {
                let at = |seed: u64| uniform_pair(seed + 10 * k as u64, i);
                let f = self.bsdf.eval(near(a, at(100)), near(b, at(101)), TransportMode::Radiance);
                there.push(f64::from(f.average()));
                let f = self.bsdf.eval(near(b, at(102)), near(a, at(103)), TransportMode::Radiance);
                back.push(f64::from(f.average()));
            }
            welch_test(&there, &back).assert_consistent(
                sidak(SIGNIFICANCE, 2),
                &format!("{a:?} {b:?}: {} there, {} back", there.mean(), back.mean()),
            );
        }
    }

    /// Mean weight, deltas included, with its standard error.
    #[must_use]
    pub fn albedo(&self, wo: LocalDir, n: u64) -> Moments {
        let weight =
            |i| self.sample(wo, 8, i, TransportMode::Importance).map_or(0.0, |s| s.weight.lanes()[0]);
        Moments::of((0..n).map(|i| f64::from(weight(i))))
    }

    /// Under uniform light from both sides, no more comes out than went in (in importance mode: energy, not radiance,
    /// which a denser medium concentrates).
    pub fn conserves_energy(&self) {
        // Of a surface that is not reciprocal, radiance alone is bounded; it has no η².
        let mode = match self.bsdf.is_reciprocal() {
            true => TransportMode::Importance,
            false => TransportMode::Radiance,
        };
        for wo in directions() {
            for lane in 0..4 {
                let weight = |i| {
                    let s = self.sample(wo, 8, i, mode);
                    f64::from(s.map_or(0.0, |s| s.weight.lanes()[lane]))
                };
                let m = Moments::of((0..20_000).map(weight));
                assert!(
                    m.mean() <= 1.0 + 1e-5 + 5.0 * m.std_error(),
                    "from {wo:?}, lane {lane}: {} comes out",
                    m.mean()
                );
            }
        }
    }

    /// No NaN, infinity or negative number for any pair of directions, in the surface or not.
    pub fn is_finite_everywhere(&self) {
        for i in 0..30_000 {
            let (wo, wi) = (edge(i, 0), edge(i, 1));
            for mode in [TransportMode::Radiance, TransportMode::Importance] {
                let (f, pdf) = self.bsdf.eval_pdf(wo, wi, mode);
                assert_fine(f, &format!("f({wo:?}, {wi:?})"));
                assert_eq!(f, self.bsdf.eval(wo, wi, mode), "eval_pdf is eval: {wo:?} {wi:?}");
                assert_eq!(pdf, self.bsdf.pdf(wo, wi, mode), "eval_pdf is pdf: {wo:?} {wi:?}");
                assert!(pdf.value().is_finite() && pdf.value() >= 0.0);
                let Some(s) =
                    self.bsdf.sample(wo, edge_number(i, 2), [3, 4].map(|k| edge_number(i, k)), mode)
                else {
                    continue;
                };
                assert_fine(s.weight, &format!("weight of {s:?} from {wo:?}"));
                assert!((s.wi.0.length() - 1.0).abs() < 1e-3, "{s:?} from {wo:?} is not unit");
                assert!(s.eta.is_finite() && s.eta > 0.0);
                if !s.is_specular() {
                    assert_eq!(s.lobe.is_transmission(), !wo.same_hemisphere(s.wi), "{s:?} from {wo:?}");
                }
            }
        }
    }
}

fn assert_fine(s: Spectrum, what: &str) {
    assert!(s.is_finite() && s.lanes().iter().all(|x| *x >= 0.0), "{what}: {s:?}");
}

/// A direction that is often in the surface, nearly in it, or the normal.
fn edge(index: u64, stream: u64) -> LocalDir {
    let u = uniform_pair(200 + stream, index);
    let any = on_sphere(u);
    let with_z = |z: f32| {
        let flat = Vec3::new(any.0.x, any.0.y, 0.0).try_normalize().unwrap_or(Vec3::X);
        LocalDir(flat * (1.0 - z * z).sqrt() + Vec3::Z * z)
    };
    match combine(stream + 17, index) % 12 {
        0 => with_z(0.0),
        1 => with_z(-0.0),
        2 => with_z(1e-38),
        3 => with_z(1e-12),
        4 => with_z(-3e-8),
        5 => with_z(2e-7),
        6 => with_z(1e-4),
        7 => LocalDir::NORMAL,
        8 => -LocalDir::NORMAL,
        _ => any,
    }
}

/// A number in [0, 1), often at its ends.
fn edge_number(index: u64, stream: u64) -> f32 {
    match combine(stream + 31, index) % 8 {
        0 => 0.0,
        1 => 1.0 - f32::EPSILON / 2.0,
        _ => uniform_pair(300 + stream, index)[1],
    }
}

/// The mean of `4π f` over directions of a lattice on the sphere: its integral.
fn mean_over_sphere(f: impl Fn(LocalDir) -> f64) -> f64 {
    let n = 100_000_u32;
    let at = |i: u32| [(i as f32 + 0.5) / n as f32, unit_f32(i.wrapping_mul(0x9e37_79b9))];
    (0..n).map(|i| f(on_sphere(at(i)))).sum::<f64>() / f64::from(n) * 4.0 * std::f64::consts::PI
}

/// Counts a value in the region of its direction, and nothing in the others.
fn push(regions: &mut [Moments; 8], value: Option<(LocalDir, f32)>) {
    let hit = value.map(|(w, x)| {
        let bit = |b: bool, k: usize| usize::from(b) << k;
        (bit(w.0.x > 0.0, 0) | bit(w.0.z > 0.0, 1) | bit(w.0.z.abs() > 0.5, 2), f64::from(x))
    });
    for (k, m) in regions.iter_mut().enumerate() {
        m.push(hit.map_or(0.0, |(region, x)| if region == k { x } else { 0.0 }));
    }
}
