//! Laws of light selection: probabilities are those of the choices, add up to one, and leave no light out.

use math::{AnimatedTransform, Bounds, Dir, Point, Transform, Vec3};
use scene_desc::{
    AreaLightDesc, Illuminant, ImageId, LightDesc, LightKind, LightSelection, Sink, Span, SpectrumDesc,
    SpotFalloff,
};
use spectrum::{ColorMode, ColorPipeline, ColorSpace, Wavelengths};
use steradian_scene::{
    EmitterGeometry, EmitterSource, LightContext, LightId, LightImage, LightSelector, Lights, LightsBuilder,
};
use testkit::chi2::{chi2_counts, uniform_pair};

fn no_images(_: ImageId) -> LightImage {
    unreachable!("no image is used")
}

fn white(scale: f32) -> Illuminant {
    Illuminant { spectrum: SpectrumDesc::srgb([1.0; 3]), scale, normalize: true }
}

fn place(seed: u64, i: u64) -> Vec3 {
    let ([x, y], [z, _]) = (uniform_pair(seed, i), uniform_pair(seed + 1000, i));
    Vec3::new(x, y, z) * 4.0 - 2.0
}

/// `n` lights of many kinds: emitting triangles, points, narrow spots, a sphere, and (with `sky`) a sun and a sky.
fn lights(n: u64, sky: bool) -> Lights {
    let mut sink = Sink::default();
    let mut builder = LightsBuilder::new(ColorPipeline::new(ColorMode::Rgb, ColorSpace::Srgb), &no_images);
    let mut add = |kind| {
        let world_from_light = AnimatedTransform::fixed(Transform::IDENTITY);
        builder.add_light(&LightDesc { kind, world_from_light, medium: None, span: Span::NONE }, &mut sink);
    };
    if sky {
        add(LightKind::InfiniteConstant { radiance: white(0.1), illuminance: None, portal: None });
        let (from, to) = (Vec3::new(0.2, 0.3, 1.0), Vec3::ZERO);
        add(LightKind::Distant { radiance: white(2.0), from, to, illuminance: None });
    }
    for i in 0..n / 4 {
        let (from, intensity) = (place(1, i), white(0.1 + uniform_pair(2, i)[0]));
        add(LightKind::Point { intensity: intensity.clone(), from, power: None });
        let to = from + place(3, i);
        add(LightKind::Spot {
            intensity,
            from,
            to,
            cone_angle: 35.0,
            cone_delta: 10.0,
            falloff: SpotFalloff::Smooth,
            power: None,
        });
    }
    // The others: small triangles, every fifth two-sided.
    for i in 0..n - 2 * (n / 4) {
        let p = place(4, i);
        let positions = [p, p + place(5, i) * 0.05, p + place(6, i) * 0.05];
        let desc = AreaLightDesc {
            radiance: white(0.1 + 5.0 * uniform_pair(7, i)[0]),
            image: None,
            two_sided: i % 5 == 0,
            power: None,
            span: Span::NONE,
        };
        let geometry =
            EmitterGeometry::Mesh { positions: &positions, normals: &[], uvs: &[], indices: &[[0, 1, 2]] };
        builder.add_emitter(
            &EmitterSource { geometry, flip: false, visible: true, motion: None, desc: &desc },
            &mut sink,
        );
    }
    assert!(sink.diagnostics().is_empty());
    builder.finish(Bounds { min: Vec3::splat(-2.0), max: Vec3::splat(2.0) })
}

fn contexts() -> impl Iterator<Item = LightContext> {
    (0..).map(|i| {
        // Some inside of the lights' box, some outside; some on surfaces, some in media.
        let p = Point(place(10, i) * if i % 3 == 0 { 4.0 } else { 1.0 });
        let n = (i % 4 != 0).then(|| Dir::normalize(place(11, i)));
        LightContext { p, p_error: Vec3::ZERO, ng: n, ns: n, time: 0.0 }
    })
}

const STRATEGIES: [LightSelection; 3] =
    [LightSelection::Uniform, LightSelection::Power, LightSelection::Spatial];

#[test]
fn probabilities_add_up_to_one_and_are_those_of_the_choices() {
    for (n, sky) in [(1, false), (7, false), (14, true), (60, false), (300, true)] {
        let lights = lights(n, sky);
        for strategy in STRATEGIES {
            let selector = LightSelector::new(strategy, &lights);
            for context in contexts().take(8) {
                let p: Vec<f64> =
                    lights.ids().map(|l| f64::from(selector.probability(&context, l))).collect();
                let sum: f64 = p.iter().sum();
                let nothing = sum == 0.0;
                assert!(nothing || (sum - 1.0).abs() < 1e-4 || n > 16, "{strategy:?} {n}: {sum}");
                assert!(sum < 1.0 + 1e-4);

                let samples = 40_000;
                let mut observed = vec![0; lights.len()];
                let mut none = 0;
                for i in 0..samples {
                    let u = uniform_pair(12, i)[0];
                    match selector.select(&context, u) {
                        Some((light, chosen)) => {
                            let expected = p[light.index()];
                            assert!(
                                (f64::from(chosen) / expected - 1.0).abs() < 1e-3,
                                "{strategy:?} {n}: {chosen} {expected}"
                            );
                            observed[light.index()] += 1;
                        }
                        None => none += 1,
                    }
                }
                // Where a branch of the tree turns out to hold nothing, no light is chosen: what is missing to one.
                observed.push(none);
                let mut expected: Vec<f64> = p.iter().map(|p| p * samples as f64).collect();
                expected.push((1.0 - sum).max(0.0) * samples as f64);
                if expected.iter().filter(|e| **e > 1.0).count() > 1 {
                    chi2_counts(&observed, &expected, 1e-6)
                        .unwrap_or_else(|e| panic!("{strategy:?} {n} {sky}: {e}"));
                }
            }
        }
    }
}

#[test]
fn every_light_that_contributes_can_be_chosen() {
    for (n, sky) in [(12, true), (400, true), (400, false)] {
        let lights = lights(n, sky);
        let selectors = STRATEGIES.map(|s| LightSelector::new(s, &lights));
        let mut contributions = 0;
        for (i, context) in contexts().take(60).enumerate() {
            for light in lights.ids() {
                let u = uniform_pair(13 + u64::from(light.0), i as u64);
                let Some(s) = lights.sample(light, &context, u, &Wavelengths::RGB) else { continue };
                if context.ns.is_some_and(|n| n.abs_dot(s.wi) < 1e-6) {
                    continue;
                }
                contributions += 1;
                for selector in &selectors {
                    assert!(
                        selector.probability(&context, light) > 0.0,
                        "{light:?} of {n} reaches {context:?} with {:?}",
                        s.li
                    );
                }
            }
        }
        assert!(contributions > 200);
    }
}

/// The reason to have it: the irradiance estimate has less variance than with a choice by power.
#[test]
fn the_tree_lowers_the_variance() {
    let lights = lights(1000, false);
    let [power, tree] = [LightSelection::Power, LightSelection::Spatial].map(|strategy| {
        let selector = LightSelector::new(strategy, &lights);
        let mut variance = 0.0;
        for context in contexts().filter(|c| c.ns.is_some()).take(20) {
            let n = context.ns.unwrap();
            let m = testkit::statistics::Moments::of((0..4000).map(|i| {
                let Some((light, p)) = selector.select(&context, uniform_pair(14, i)[0]) else { return 0.0 };
                let u = uniform_pair(15, i);
                let Some(s) = lights.sample(light, &context, u, &Wavelengths::RGB) else { return 0.0 };
                let density = match s.density {
                    scatter::Density::Smooth(p) => p.value(),
                    scatter::Density::Delta { probability } => probability,
                };
                f64::from(s.li.rgb()[0] * s.wi.dot(n).max(0.0) / (p * density))
            }));
            variance += m.variance() / (m.mean() * m.mean()).max(1e-12);
        }
        variance
    });
    assert!(tree < 0.5 * power, "relative variances: tree {tree}, power {power}");
}

#[test]
fn light_paths_start_by_power() {
    let lights = lights(40, true);
    let selector = LightSelector::new(LightSelection::Spatial, &lights);
    let total: f32 = lights.ids().map(|l| lights.power(l)).sum();
    for light in lights.ids() {
        let expected = lights.power(light) / total;
        assert!((selector.emission_probability(light) / expected - 1.0).abs() < 1e-4);
    }
    for i in 0..1000 {
        let (light, p) = selector.select_emission(uniform_pair(16, i)[0]).unwrap();
        assert_eq!(p, selector.emission_probability(light));
    }
}

#[test]
fn without_light_nothing_is_chosen() {
    let lights = lights(0, false);
    for strategy in STRATEGIES {
        let selector = LightSelector::new(strategy, &lights);
        assert!(selector.select(&contexts().next().unwrap(), 0.3).is_none());
        assert!(selector.select_emission(0.3).is_none());
    }
    // A black light is there, but never chosen.
    let mut builder = LightsBuilder::new(ColorPipeline::new(ColorMode::Rgb, ColorSpace::Srgb), &no_images);
    let kind = LightKind::Point { intensity: white(0.0), from: Vec3::ZERO, power: None };
    let world_from_light = AnimatedTransform::fixed(Transform::IDENTITY);
    let desc = LightDesc { kind, world_from_light, medium: None, span: Span::NONE };
    builder.add_light(&desc, &mut Sink::default());
    let lights = builder.finish(Bounds::EMPTY);
    for strategy in STRATEGIES {
        let selector = LightSelector::new(strategy, &lights);
        assert!(selector.select(&contexts().next().unwrap(), 0.3).is_none());
        assert_eq!(selector.probability(&contexts().next().unwrap(), LightId(0)), 0.0);
    }
}

#[test]
fn a_spot_with_a_hard_edge_is_chosen_where_it_shines() {
    let mut sink = Sink::default();
    let mut builder = LightsBuilder::new(ColorPipeline::new(ColorMode::Rgb, ColorSpace::Srgb), &no_images);
    let (from, to) = (Vec3::Z, Vec3::ZERO);
    let kind = LightKind::Spot {
        intensity: white(1.0),
        from,
        to,
        cone_angle: 20.0,
        cone_delta: 0.0,
        falloff: SpotFalloff::Smooth,
        power: None,
    };
    let world_from_light = AnimatedTransform::fixed(Transform::IDENTITY);
    builder.add_light(&LightDesc { kind, world_from_light, medium: None, span: Span::NONE }, &mut sink);
    let lights = builder.finish(Bounds { min: Vec3::splat(-2.0), max: Vec3::splat(2.0) });
    for strategy in STRATEGIES {
        let n = Some(Dir::Z);
        let p = Point(Vec3::new(0.1, 0.1, 0.0));
        let context = LightContext { p, p_error: Vec3::ZERO, ng: n, ns: n, time: 0.0 };
        let chosen = LightSelector::new(strategy, &lights).select(&context, 0.5);
        assert!(chosen.is_some_and(|(_, p)| p > 0.99), "{strategy:?}: {chosen:?}");
    }
}

/// A sky through a portal is never chosen where the portal turns its back, and the others get its share.
#[test]
fn portals_are_chosen_where_their_light_comes() {
    let mut sink = Sink::default();
    let mut builder = LightsBuilder::new(ColorPipeline::new(ColorMode::Rgb, ColorSpace::Srgb), &no_images);
    let mut add = |kind| {
        let world_from_light = AnimatedTransform::fixed(Transform::IDENTITY);
        builder.add_light(&LightDesc { kind, world_from_light, medium: None, span: Span::NONE }, &mut sink)
    };
    // Windows in the planes z = 1 and z = −1: light comes down through the first and up through the second.
    let window = |z: f32| {
        let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]];
        let [a, b, c, d] = corners.map(|[x, y]: [f32; 2]| Vec3::new(x, y, z));
        if z > 0.0 { [a, b, c, d] } else { [a, d, c, b] }
    };
    let sky =
        |z| LightKind::InfiniteConstant { radiance: white(1.0), illuminance: None, portal: Some(window(z)) };
    let (above, below) = (add(sky(1.0)), add(sky(-1.0)));
    let point = add(LightKind::Point { intensity: white(0.5), from: Vec3::X * 3.0, power: None });
    assert!(sink.diagnostics().is_empty(), "{}", sink.render());
    let lights = builder.finish(Bounds { min: Vec3::splat(-4.0), max: Vec3::splat(4.0) });
    let selector = LightSelector::new(LightSelection::Spatial, &lights);
    for (z, sees) in [(0.0, [true, true]), (2.0, [false, true]), (-2.0, [true, false])] {
        let p = Point(Vec3::new(0.2, 0.1, z));
        let context = LightContext { p, p_error: Vec3::ZERO, ng: None, ns: None, time: 0.0 };
        let chances = [above, below, point].map(|l| selector.probability(&context, l));
        assert_eq!([chances[0] > 0.0, chances[1] > 0.0], sees, "{z}: {chances:?}");
        assert!((chances.iter().sum::<f32>() - 1.0).abs() < 1e-5, "{z}: {chances:?}");
        for (i, light) in [above, below].into_iter().enumerate() {
            let found = (0..64)
                .any(|k| lights.sample(light, &context, uniform_pair(50, k), &Wavelengths::RGB).is_some());
            assert_eq!(found, sees[i], "{z}");
        }
        let mut observed = [0; 3];
        for i in 0..20_000 {
            let (light, chance) = selector.select(&context, uniform_pair(51, i)[0]).unwrap();
            assert_eq!(chance, selector.probability(&context, light));
            observed[light.index()] += 1;
        }
        let expected: Vec<f64> = chances.iter().map(|c| f64::from(*c) * 20_000.0).collect();
        chi2_counts(&observed, &expected, 1e-6).unwrap_or_else(|e| panic!("{z}: {e}"));
    }
}
