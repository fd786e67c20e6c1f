//! Free flights and transmittances of all media against their densities.

use math::{Dir, Point, Ray, Transform};
use sampling::rng::Rng;
use scene_desc::{
    GridBorder, GridEmission, GridLayout, MediumDesc, MediumKind, PhaseDesc, Sink, Span, SpectrumDesc,
};
use spectrum::{ColorMode, ColorPipeline, ColorSpace, Spectrum, Wavelengths};
use testkit::statistics::{Moments, ks_test, sidak, t_test};

use super::Media;
use crate::MediumId;

const IT: MediumId = MediumId(0);
const HALF: f32 = 0.5;

fn compile(kind: MediumKind, mode: ColorMode) -> Media {
    let desc = MediumDesc {
        name: String::new(),
        kind,
        phase: PhaseDesc::Isotropic,
        world_from_medium: Transform::IDENTITY,
        span: Span::NONE,
    };
    let mut sink = Sink::default();
    let (media, _) = Media::compile(&[desc], &[], ColorPipeline::new(mode, ColorSpace::Srgb), &mut sink);
    assert!(sink.diagnostics().is_empty() && media.len() == 1, "{}", sink.render());
    media
}

fn homogeneous(sigma_a: [f32; 3], sigma_s: [f32; 3]) -> MediumKind {
    let [sigma_a, sigma_s] = [sigma_a, sigma_s].map(SpectrumDesc::srgb);
    MediumKind::Homogeneous { sigma_a, sigma_s, le: None, scale: 1.0, le_scale: 1.0 }
}

fn layout(resolution: [u32; 3]) -> GridLayout {
    GridLayout { resolution, bounds: [math::Vec3::ZERO, math::Vec3::ONE], border: GridBorder::Clamp }
}

/// Density 0.5 at z < ¼, 1.5 at z > ¾, linear in between: optical depth of one through the unit cube.
fn ramp(sigma_a: [f32; 3], sigma_s: [f32; 3]) -> MediumKind {
    let [sigma_a, sigma_s] = [sigma_a, sigma_s].map(SpectrumDesc::srgb);
    MediumKind::Grid {
        layout: layout([1, 1, 2]),
        density: vec![0.5, 1.5].into(),
        sigma_a,
        sigma_s,
        scale: 1.0,
        emission: GridEmission::None,
    }
}

/// The same in one colour of a grid of colours.
fn rgb_ramp(sigma: [f32; 3]) -> MediumKind {
    MediumKind::RgbGrid {
        layout: layout([1, 1, 2]),
        sigma_a: Some(vec![[0.0; 3]; 2].into()),
        sigma_s: Some(vec![sigma.map(|s| 0.5 * s), sigma.map(|s| 1.5 * s)].into()),
        le: None,
        space: scene_desc::ColorSpaceName::Srgb,
        scale: 1.0,
        le_scale: 1.0,
    }
}

/// Optical depth of the ramp up to height z, and its density there.
fn depth(z: f64) -> (f64, f64) {
    let z = z.clamp(0.0, 1.0);
    if z < 0.25 {
        (0.5 * z, 0.5)
    } else if z < 0.75 {
        let x = z - 0.25;
        (0.125 + 0.5 * x + x * x, 0.5 + 2.0 * x)
    } else {
        (0.625 + 1.5 * (z - 0.75), 1.5)
    }
}

/// From z = −½ upwards.
fn up(t_max: f32) -> Ray {
    Ray { t_max, ..Ray::new(Point::new(0.4, 0.6, -HALF), Dir::Z, 0.0) }
}

#[test]
fn free_paths_follow_their_density() {
    let n = 20_000;
    for (kind, cdf) in [
        (homogeneous([0.5; 3], [1.5; 3]), (|t| 1.0 - math::trig::f64::exp(-2.0 * t)) as fn(f64) -> f64),
        (ramp([0.0; 3], [1.0; 3]), |t| {
            (1.0 - math::trig::f64::exp(-depth(t - 0.5).0)) / (1.0 - math::trig::f64::exp(-1.0))
        }),
    ] {
        let media = compile(kind, ColorMode::Rgb);
        let mut rng = Rng::from_parts(&[4]);
        let mut distances = Vec::new();
        for _ in 0..n {
            let mut u = || rng.next_f32();
            let flight = media.fly(IT, &up(f32::INFINITY), Spectrum::ONE, &Wavelengths::RGB, &mut u);
            distances.extend(flight.scatters_at.map(f64::from));
        }
        assert!(distances.len() > n / 2);
        ks_test(&mut distances, cdf).assert_consistent(1e-3, "distances");
    }
}

/// In every lane, whatever it is weighed with, the mean of the factor over flights that end in a piece of the way is
/// `∫ σ_s e^{−τ}`, and over those that pass e^{−τ}: means are right for many wavelengths at once.
#[test]
fn factors_are_right_in_every_lane() {
    const BINS: usize = 5;
    let colours = [0.2, 1.0, 6.0];
    let mut failures = String::new();
    let kinds = [
        ("homogeneous", homogeneous([0.0; 3], colours), [0.0; 3]),
        ("that absorbs", homogeneous([3.0, 1.0, 0.0], colours), [3.0, 1.0, 0.0]),
        ("ramp", ramp([0.0; 3], colours), [0.0; 3]),
        ("ramp that absorbs", ramp([3.0, 0.0, 1.0], colours), [3.0, 0.0, 1.0]),
        ("ramp of colours", rgb_ramp(colours), [0.0; 3]),
    ];
    for (name, kind, absorption) in kinds {
        let is_even = name == "homogeneous" || name == "that absorbs";
        let media = compile(kind, ColorMode::Rgb);
        let mut rng = Rng::from_parts(&[5]);
        let mut found = [[Moments::default(); BINS + 1]; 3];
        let carried = Spectrum::from_rgb([1.0, 0.3, 2.0]);
        for _ in 0..60_000 {
            let mut u = || rng.next_f32();
            let flight = media.fly(IT, &up(1.5), carried, &Wavelengths::RGB, &mut u);
            let bin = flight.scatters_at.map_or(BINS, |t| (t / 1.5 * BINS as f32) as usize);
            for (lane, bins) in found.iter_mut().enumerate() {
                for (i, m) in bins.iter_mut().enumerate() {
                    m.push(if i == bin { f64::from(flight.factor.lanes()[lane]) } else { 0.0 });
                }
            }
        }
        for (lane, bins) in found.iter().enumerate() {
            let (s, a) = (f64::from(colours[lane]), absorption[lane]);
            let passed = |t: f64| {
                let tau = if is_even { t } else { depth(t - 0.5).0 };
                math::trig::f64::exp(-tau * (s + a))
            };
            for (i, m) in bins.iter().enumerate() {
                let at = |i: usize| passed(1.5 * i as f64 / BINS as f64);
                let truth = if i == BINS { passed(1.5) } else { s / (s + a) * (at(i) - at(i + 1)) };
                let result = t_test(m, truth);
                if truth > 0.0 && !result.is_consistent(sidak(1e-3, 5 * 3 * (BINS + 1))) {
                    failures += &format!("{name}, lane {lane}, {i}: {} is not {truth}\n", m.mean());
                }
            }
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn transmittances_are_unbiased_and_ratio_tracking_has_its_variance() {
    // A bound of two for an optical depth of one: ground truth, sec. 6. (Two points further on are the bound.)
    let kind = MediumKind::Grid {
        layout: layout([2, 1, 1]),
        density: vec![1.0, 2.0].into(),
        sigma_a: SpectrumDesc::Constant(1.0),
        sigma_s: SpectrumDesc::Constant(0.0),
        scale: 1.0,
        emission: GridEmission::None,
    };
    let media = compile(kind, ColorMode::Spectral);
    let ray = Ray { t_max: 9.0, ..Ray::new(Point::new(0.2, 0.5, -HALF), Dir::Z, 0.0) };
    let wl = Wavelengths::sample_visible(0.3);
    let mut rng = Rng::from_parts(&[9]);
    let mut m = Moments::default();
    for _ in 0..200_000 {
        let flight = media.pass(IT, &ray, &wl, &mut || rng.next_f32());
        m.push(f64::from(flight.factor.lanes()[2]));
    }
    t_test(&m, 0.367_879_4).assert_consistent(1e-3, "transmittance");
    assert!((m.variance() / 0.087_794_9 - 1.0).abs() < 0.02, "{}", m.variance());
}

#[test]
fn rays_beside_a_grid_meet_nothing() {
    let media = compile(ramp([1.0; 3], [1.0; 3]), ColorMode::Rgb);
    for (origin, dir) in [([1.5, 0.5, 0.5], Dir::Z), ([0.5, 0.5, 1.5], Dir::Z), ([-1.0, 0.5, 0.5], -Dir::Z)] {
        let ray = Ray::new(Point::new(origin[0], origin[1], origin[2]), dir, 0.0);
        let flight = media.fly(IT, &ray, Spectrum::ONE, &Wavelengths::RGB, &mut || 0.5);
        assert!(flight.scatters_at.is_none() && flight.factor == Spectrum::ONE);
    }
}
