//! Closed forms of energy, and closed forms against random walks.

use std::sync::Arc;

use math::{LocalDir, Vec3};
use spectrum::Spectrum;
use steradian_scatter::microfacet::Facets;
use steradian_scatter::{
    Bsdf, BsdfKind, Coat, CoatProfile, CoatedConductor, CoatedDiffuse, CompensatedConductor, Conductor,
    Dielectric, Hair, Measured, MeasuredTable, OrenNayar, Plastic, TransportMode,
};
use testkit::chi2::uniform_pair;
use testkit::statistics::{Moments, sidak, t_test, welch_test};

/// `Subject::albedo` of testkit, in one lane and with deltas.
fn albedo(bsdf: impl Into<Bsdf>, wo: LocalDir, n: u64) -> Moments {
    let b = bsdf.into();
    Moments::of((0..n).map(|i| {
        let s = b.sample(wo, uniform_pair(1, i)[0], uniform_pair(2, i), TransportMode::Importance);
        f64::from(s.map_or(0.0, |s| s.weight.lanes()[0]))
    }))
}

/// The mean of `albedo` over cosine-weighted directions.
fn average_albedo(bsdf: impl Into<Bsdf>, n: u64) -> Moments {
    let b = bsdf.into();
    Moments::of((0..n).map(|i| {
        let wo = sampling::warp::cosine_hemisphere(uniform_pair(3, i));
        let s = b.sample(wo, uniform_pair(1, i)[0], uniform_pair(2, i), TransportMode::Importance);
        f64::from(s.map_or(0.0, |s| s.weight.lanes()[0]))
    }))
}

fn at(mu: f32) -> LocalDir {
    LocalDir::normalize(Vec3::new((1.0 - mu * mu).sqrt() * 0.8, -(1.0 - mu * mu).sqrt() * 0.6, mu))
}

/// A coat of no thickness whose walks go on for ever.
fn ideal() -> Coat {
    Coat { thickness: 0.0, max_depth: 10_000, ..Coat::default() }
}

/// A medium that scatters nothing to speak of: the same light, by the random walk.
const NEXT_TO_NOTHING: Spectrum = Spectrum::splat(1e-30);

#[test]
fn smooth_plastic_has_the_albedos_of_the_table() {
    // Ground truth, sec. 7: rho, hemispherical and normal-incidence albedo at eta = 1.5.
    for (rho, hemispherical, normal) in
        [(0.1, 0.130_763_6, 0.081_208_2), (0.5, 0.352_958_9, 0.316_070_9), (0.9, 0.803_962_0, 0.792_785_8)]
    {
        let plastic = CoatedDiffuse::new(Spectrum::splat(rho), &ideal(), None);
        let found = average_albedo(plastic, 400_000);
        assert!((found.mean() - hemispherical).abs() < 5.0 * found.std_error() + 2e-5, "{found:?}");
        assert!(found.std_error() < 1e-3);
        let found = albedo(plastic, LocalDir::NORMAL, 400_000);
        assert!((found.mean() - normal).abs() < 5.0 * found.std_error() + 2e-5, "{rho}: {found:?}");
        assert!(found.std_error() < 1e-3);
    }
}

#[test]
fn lossless_things_give_back_all_they_get() {
    let white_plastic = CoatedDiffuse::new(Spectrum::ONE, &ideal(), None);
    let perfect_metal = Conductor::new(Spectrum::ZERO, Spectrum::ZERO, [0.0; 2]);
    for mu in [0.05, 0.4, 0.9, 1.0] {
        for bsdf in [
            Bsdf::from(Dielectric::new(1.5, [0.0; 2])),
            Dielectric::new(1.0 / 1.33, [0.0; 2]).into(),
            steradian_scatter::ThinDielectric::new(1.5).into(),
            CoatedConductor::new(perfect_metal, &ideal()).into(),
            white_plastic.into(),
        ] {
            let m = albedo(bsdf.clone(), at(mu), 50_000);
            assert!((m.mean() - 1.0).abs() < 5.0 * m.std_error() + 2e-4, "{} at {mu}: {m:?}", bsdf.name());
        }
    }
}

#[test]
fn radiance_in_glass_is_concentrated_by_eta_squared() {
    // From inside, radiance that comes through is divided by (1/η)²; from outside by η².
    let glass = Bsdf::from(Dielectric::new(1.5, [0.0; 2]));
    for (wo, scale) in [(at(0.9), 1.0 / 2.25), (-at(0.9), 2.25)] {
        let s = glass.sample(wo, 0.99, [0.5; 2], TransportMode::Radiance).unwrap();
        assert!(s.lobe.is_transmission() && (s.weight.lanes()[0] - scale).abs() < 1e-5, "{s:?}");
        let s = glass.sample(wo, 0.99, [0.5; 2], TransportMode::Importance).unwrap();
        assert!((s.weight.lanes()[0] - 1.0).abs() < 1e-5);
    }
}

#[test]
fn refraction_obeys_snell() {
    let glass = Bsdf::from(Dielectric::new(1.5, [0.0; 2]));
    for mu in [0.1, 0.5, 0.99] {
        let wo = at(mu);
        let s = glass.sample(wo, 0.9999, [0.5; 2], TransportMode::Radiance).unwrap();
        assert!((s.wi.0.truncate() * 1.5 + wo.0.truncate()).length() < 1e-5, "{s:?}");
        assert_eq!(s.eta, 1.5);
        let back = glass.sample(s.wi, 0.9999, [0.5; 2], TransportMode::Radiance).unwrap();
        assert!((back.wi.0 - wo.0).length() < 1e-4, "{back:?}");
    }
}

/// Mean weight in eight regions, deltas in a ninth.
fn by_region(b: &Bsdf, wo: LocalDir, seed: u64, n: u64) -> [Moments; 9] {
    let mut all = [Moments::default(); 9];
    for i in 0..n {
        let s = b.sample(wo, uniform_pair(seed, i)[0], uniform_pair(seed + 1, i), TransportMode::Radiance);
        let hit = s.map(|s| {
            let w = s.wi.0;
            let quarter = usize::from(w.x > 0.0) + 2 * usize::from(w.y > 0.0);
            let region = if s.is_specular() { 8 } else { quarter + 4 * usize::from(w.z > 0.6) };
            (region, f64::from(s.weight.lanes()[0] + 0.7 * s.weight.lanes()[1]))
        });
        for (k, m) in all.iter_mut().enumerate() {
            m.push(hit.map_or(0.0, |(region, x)| if region == k { x } else { 0.0 }));
        }
    }
    all
}

fn assert_same_light(a: impl Into<Bsdf>, b: impl Into<Bsdf>, what: &str) {
    let (a, b) = (a.into(), b.into());
    for wo in [at(0.95), at(0.5), -at(0.15)] {
        let (a, b) = (by_region(&a, wo, 10, 60_000), by_region(&b, wo, 20, 60_000));
        for (k, (a, b)) in a.iter().zip(&b).enumerate() {
            let m = format!("{what}, {wo:?}, region {k}: {} and {}", a.mean(), b.mean());
            welch_test(a, b).assert_consistent(sidak(1e-6, 27), &m);
        }
    }
}

const SAND: Spectrum = Spectrum::from_rgb([0.9, 0.4, 0.2]);

#[test]
fn a_smooth_coats_closed_form_is_the_walk() {
    for (thickness, max_depth, eta) in [(0.01, 10, 1.5), (0.3, 10, 1.5), (0.01, 3, 1.33), (0.01, 200, 1.8)] {
        let coat = Coat { thickness, max_depth, eta, ..Coat::default() };
        let closed = CoatedDiffuse::new(SAND, &coat, None);
        let walk = CoatedDiffuse::new(SAND, &Coat { albedo: NEXT_TO_NOTHING, ..coat }, None);
        assert_same_light(closed, walk, &format!("{thickness} {max_depth} {eta}"));
    }
}

#[test]
fn a_rough_coats_closed_form_is_the_walk() {
    for (alpha, thickness) in [(0.05, 0.01), (0.3, 0.01), (0.3, 0.5), (0.8, 0.01)] {
        let coat = Coat { alpha: [alpha; 2], thickness, ..Coat::default() };
        let profile = CoatProfile::new(coat.eta, alpha, thickness);
        let closed = CoatedDiffuse::new(SAND, &coat, Some(profile));
        let walk = CoatedDiffuse::new(SAND, &coat, None);
        assert_same_light(closed, walk, &format!("alpha {alpha}, thickness {thickness}"));
    }
}

#[test]
fn the_walks_evaluation_has_the_closed_forms_mean() {
    // Not by samples: `eval` of both, over a small cone of directions.
    for alpha in [0.0, 0.25] {
        let coat = Coat { alpha: [alpha; 2], ..Coat::default() };
        let profile = CoatProfile::new(coat.eta, alpha, coat.thickness);
        let closed = CoatedDiffuse::new(SAND, &coat, Some(profile));
        let walk = CoatedDiffuse::new(SAND, &Coat { albedo: NEXT_TO_NOTHING, ..coat }, None);
        let (closed, walk) = (Bsdf::from(closed), Bsdf::from(walk));
        for (wo, wi) in [(at(0.9), at(0.5)), (at(0.3), LocalDir::NORMAL), (at(0.2), at(0.25).reflect())] {
            let m = Moments::of((0..40_000).map(|i| {
                let [x, y] = uniform_pair(30, i);
                let wi = LocalDir::normalize(wi.0 + Vec3::new(x, y, 0.0) * 0.02);
                let f = |b: &Bsdf| b.eval(wo, wi, TransportMode::Radiance).lanes()[0];
                f64::from(f(&walk) - f(&closed))
            }));
            // The profile may be off by its interpolation, 1e-3 of the value.
            let value = f64::from(closed.eval(wo, wi, TransportMode::Radiance).lanes()[0]);
            assert!(
                m.mean().abs() < 5.0 * m.std_error() + 1e-3 * value,
                "{alpha} {wo:?} {wi:?}: {m:?} {value}"
            );
        }
    }
}

#[test]
fn a_coated_mirrors_closed_form_is_the_walk() {
    let gold = Conductor::new(Spectrum::splat(0.3), Spectrum::splat(3.0), [0.0; 2]);
    for (mu, thickness) in [(1.0, 0.01), (0.5, 0.2), (0.1, 0.01)] {
        let coat = Coat { thickness, ..Coat::default() };
        let closed = albedo(CoatedConductor::new(gold, &coat), at(mu), 1).mean();
        let walk = CoatedConductor::new(gold, &Coat { albedo: NEXT_TO_NOTHING, ..coat });
        let walk = albedo(walk, at(mu), 200_000);
        t_test(&walk, closed)
            .assert_consistent(1e-6, &format!("{mu}: closed {closed}, walk {}", walk.mean()));
    }
}

#[test]
fn a_lossless_milky_coat_over_white_gives_back_all() {
    let coat = Coat { albedo: Spectrum::ONE, thickness: 1.0, g: 0.5, max_depth: 10_000, ..Coat::default() };
    for mu in [1.0, 0.3] {
        let m = albedo(CoatedDiffuse::new(Spectrum::ONE, &coat, None), at(mu), 20_000);
        assert!((m.mean() - 1.0).abs() < 5.0 * m.std_error() + 1e-4, "{mu}: {m:?}");
    }
}

#[test]
fn extreme_parameters_give_finite_numbers() {
    let metal = |k: f32, alpha| Conductor::new(Spectrum::splat(0.05), Spectrum::splat(k), alpha);
    for (alpha, eta) in [
        ([1e-3, 1e-3], 1.5),
        ([1e-4, 0.5], 0.3),
        ([0.3, 0.3], 1.000_1),
        ([1.0, 1.0], 4.0),
        ([5.0, 0.01], 1.3),
    ] {
        let coat = Coat { alpha, eta, thickness: 3.0, ..Coat::default() };
        let milky = Coat { albedo: Spectrum::ONE, g: 0.999, ..coat };
        let profile = CoatProfile::new(eta, alpha[0], 3.0);
        for bsdf in [
            Bsdf::from(Dielectric::new(eta, alpha)),
            metal(1000.0, alpha).into(),
            CoatedDiffuse::new(SAND, &coat, Some(profile)).into(),
            CoatedConductor::new(metal(3.0, alpha), &milky).into(),
        ] {
            testkit::laws::bsdf::Subject::new(bsdf).is_finite_everywhere();
        }
    }
}

#[test]
fn the_estimate_of_a_smooth_coats_albedo_is_exact() {
    for mu in [0.1, 0.6, 1.0] {
        let plastic = Bsdf::from(CoatedDiffuse::new(SAND, &Coat::default(), None));
        let estimate = f64::from(plastic.albedo_estimate(-at(mu)).lanes()[0]);
        let m = albedo(plastic, at(mu), 100_000);
        assert!((m.mean() - estimate).abs() < 5.0 * m.std_error() + 1e-4, "{mu}: {m:?} {estimate}");
    }
}

#[test]
fn smooth_plastic_has_the_albedo_of_the_table() {
    // Ground truth, sec. 7, η = 1.5: at normal incidence, and under uniform light.
    for (rho, normal, average) in
        [(0.1, 0.081_208_2, 0.130_763_6), (0.5, 0.316_070_9, 0.352_958_9), (0.9, 0.792_785_8, 0.803_962_0)]
    {
        let profile = CoatProfile::smooth(1.5, 0.0);
        let plastic = Plastic::new(Spectrum::splat(rho), 1.5, Facets::SMOOTH, profile, true);
        let found = |mu: f32| f64::from(plastic.albedo_estimate(at(mu)).lanes()[0]);
        assert!((found(1.0) - normal).abs() < 1e-4, "{rho}: {} is not {normal}", found(1.0));
        let m = albedo(plastic, at(1.0), 100_000);
        assert!((m.mean() - normal).abs() < 5.0 * m.std_error() + 1e-4, "{rho}: {m:?}");
        let n = 2000;
        let mean: f64 = (0..n)
            .map(|i| (f64::from(i) + 0.5) / f64::from(n))
            .map(|mu| 2.0 * mu * found(mu as f32) / f64::from(n))
            .sum();
        assert!((mean - average).abs() < 2e-4, "{rho}: {mean} is not {average}");
    }
}

#[test]
fn linear_plastic_loses_no_colour_between_bounces() {
    // Linear: ρ (1 − Fi)⁻¹ in place of ρ (1 − ρ Fi)⁻¹. A white base is the same for both.
    let profile = CoatProfile::smooth(1.5, 0.0);
    let of = |rho, nonlinear| Plastic::new(Spectrum::splat(rho), 1.5, Facets::SMOOTH, profile, nonlinear);
    let base = |p: Plastic| p.eval(at(0.5), at(0.9), TransportMode::Radiance).lanes()[0];
    assert!((base(of(1.0, true)) / base(of(1.0, false)) - 1.0).abs() < 1e-4);
    assert!((base(of(0.5, false)) / base(of(1.0, false)) - 0.5).abs() < 1e-4);
}

#[test]
fn oren_and_nayar_send_back_more_than_lambert_towards_the_light() {
    let rough = OrenNayar::new(Spectrum::ONE, 0.6);
    let f = |wi| rough.eval(at(0.3), wi, TransportMode::Radiance).lanes()[0];
    assert!(f(at(0.3)) > f(at(0.3).reflect()), "retro-reflection");
    let smooth = OrenNayar::new(Spectrum::ONE, 0.0);
    let at_zero = smooth.eval(at(0.3), at(0.3), TransportMode::Radiance).lanes()[0];
    assert!((at_zero - std::f32::consts::FRAC_1_PI).abs() < 1e-6);
}

#[test]
fn a_white_hair_gives_back_all_it_gets() {
    // Over all of its width, from any angle [PBR4e, sec. 9.9.6]: without absorption the lobes add up to one.
    for (beta, mu) in [([0.3, 0.3], 0.4), ([0.6, 0.9], 0.9), ([0.25, 0.2], 0.7)] {
        let wo = at(mu);
        let m = Moments::of((0..40_000).map(|i| {
            let [u, h] = uniform_pair(41, i);
            let hair = Hair::new(Spectrum::ZERO, 2.0 * h - 1.0, 1.55, beta, 0.0);
            let s = hair.sample(wo, u, uniform_pair(42, i), TransportMode::Radiance);
            f64::from(s.map_or(0.0, |s| s.weight.lanes()[0]))
        }));
        assert!((m.mean() - 1.0).abs() < 5.0 * m.std_error() + 2e-3, "{beta:?} {mu}: {m:?}");
    }
}

#[test]
fn compensated_metal_loses_nothing_between_facets() {
    // Ground truth, sec. 8: 1 ± 1e-3 for a white metal, by quadrature over `wi`.
    let white = Conductor::new(Spectrum::splat(1.0), Spectrum::splat(1e6), [0.0; 2]);
    assert!(white.albedo_estimate(at(0.5)).lanes()[0] > 0.999_99);
    for facets in
        [0.1, 0.25, 0.5, 0.75, 1.0].into_iter().flat_map(|a| [Facets::ggx(a, a), Facets::beckmann(a, a)])
    {
        let metal = CompensatedConductor::new(Conductor::new(Spectrum::ONE, Spectrum::splat(1e6), facets));
        for mu in [0.1, 0.5, 1.0] {
            let n = 60_000_u32;
            let sum: f64 = (0..n)
                .map(|i| {
                    let u = [(i as f32 + 0.5) / n as f32, math::hash::unit_f32(i.wrapping_mul(0x9e37_79b9))];
                    let s = metal.sample(
                        at(mu),
                        math::hash::unit_f32(i.wrapping_mul(0x85eb_ca6b)),
                        u,
                        TransportMode::Radiance,
                    );
                    f64::from(s.map_or(0.0, |s| s.weight.lanes()[0]))
                })
                .sum();
            let found = sum / f64::from(n);
            assert!((found - 1.0).abs() < 1e-3, "{facets:?}, {mu}: {found}");
        }
    }
}

/// Mean weight of what an eye sees by, in one lane.
fn seen(measured: &Measured, wo: LocalDir, n: u64) -> Moments {
    Moments::of((0..n).map(|i| {
        let s = measured.sample(wo, 0.5, uniform_pair(2, i), TransportMode::Radiance);
        f64::from(s.map_or(0.0, |s| s.weight.lanes()[0]))
    }))
}

/// Without a Jacobian, `f cos` is the table's own number: 0.9 of the light over the hemisphere, from wherever it is seen.
#[test]
fn an_even_table_reflects_what_it_holds() {
    let held = 0.9 * 0.5 * std::f32::consts::FRAC_1_PI;
    let mut parts = testkit::measured::tabulate([0.6; 2], false, |_, _| [held]).unwrap();
    // Below the horizon as well, lest interpolation sees its edge.
    parts.spectra.values.fill(held);
    let even = Measured::new(Arc::new(MeasuredTable::new(parts).unwrap()), [0.0; 4]);
    for (x, z) in [(0.05, 1.0), (0.7, 0.7), (0.9, 0.3), (-0.5, -0.8)] {
        let wo = LocalDir::normalize(Vec3::new(x, 0.1, z));
        let wi = LocalDir::normalize(Vec3::new(0.3, -0.5, z));
        let f = even.eval(wo, wi, TransportMode::Radiance).lanes()[0] * wi.abs_cos_theta();
        assert!((f / held - 1.0).abs() < 1e-5, "{f} is not {held}");
        let m = seen(&even, wo, 40_000);
        assert!((m.mean() - 0.9).abs() < 5.0 * m.std_error(), "{wo:?}: {} ± {}", m.mean(), m.std_error());
    }
}

/// A tabulated metal is the metal: its albedo within a percent, round and brushed, from any azimuth.
#[test]
fn a_tabulated_metal_has_the_metals_albedo() {
    for alpha in [[0.4, 0.4], [0.3, 0.6]] {
        let metal = Conductor::new(Spectrum::splat(0.2), Spectrum::splat(3.5), alpha);
        let parts = testkit::measured::tabulate(alpha, true, |wo, wi| {
            [metal.eval(wo, wi, TransportMode::Radiance).lanes()[0] * wi.abs_cos_theta()]
        });
        let table = Arc::new(parts.and_then(MeasuredTable::new).unwrap());
        let measured = Measured::new(table, [0.0; 4]);
        for wo in [Vec3::new(0.2, 0.1, 0.9), Vec3::new(-0.4, 0.5, 0.6), Vec3::new(0.6, -0.3, -0.5)] {
            let wo = LocalDir::normalize(wo);
            let (a, b) = (albedo(metal, wo, 40_000), seen(&measured, wo, 40_000));
            let off = (b.mean() / a.mean() - 1.0).abs();
            assert!(off < 0.01, "{alpha:?} {wo:?}: {} as a table, {} as a formula", b.mean(), a.mean());
        }
    }
}
