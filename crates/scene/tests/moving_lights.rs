//! Laws of emitting surfaces that move: at every moment they are what a light at rest would be there.

#![expect(clippy::unwrap_used, reason = "helpers of tests are tests")]

use math::{AnimatedTransform, Bounds, DMat4, DVec3, Dir, Point, Transform, Vec2, Vec3};
use scatter::Density;
use scene_desc::{AreaLightDesc, Illuminant, ImageId, LightSelection, Sink, Span, SpectrumDesc};
use spectrum::{ColorMode, ColorPipeline, ColorSpace, Wavelengths};
use steradian_scene::{
    EmitterGeometry, EmitterSource, LightContext, LightId, LightImage, LightSelector, Lights, LightsBuilder,
};
use testkit::chi2::{Chi2Settings, chi2_rectangle, uniform_pair};
use testkit::statistics::{Moments, sidak, t_test, welch_test};

const L: Wavelengths = Wavelengths::RGB;
const FIRST: LightId = LightId(0);

fn no_images(_: ImageId) -> LightImage {
    unreachable!("no image is used")
}

fn desc(power: Option<f32>) -> AreaLightDesc {
    let radiance = Illuminant { spectrum: SpectrumDesc::srgb([1.0; 3]), scale: 1.0, normalize: true };
    AreaLightDesc { radiance, image: None, two_sided: false, power, span: Span::NONE }
}

/// Names, keys at the moments 0.2 and 0.8, and whether the way between them keeps angles.
fn motions() -> Vec<(&'static str, AnimatedTransform, bool)> {
    let turn = |axis, angle| Transform::rotate(axis, angle).unwrap();
    let start = Transform::translate(DVec3::new(0.1, -0.2, 0.3)) * turn(DVec3::new(1.0, 2.0, 3.0), 1.1);
    let end = Transform::translate(DVec3::new(-0.4, 0.5, 0.1)) * turn(DVec3::new(-1.0, 2.0, 0.5), 0.4);
    let uneven = Transform::scale(DVec3::new(1.3, -0.6, 0.9)).unwrap();
    let other = Transform::scale(DVec3::new(0.7, -1.1, 0.5)).unwrap();
    let larger = Transform::scale(DVec3::splat(1.7)).unwrap();
    let to = |a, b| AnimatedTransform::new(a, b, [0.2, 0.8]);
    vec![
        ("turning", to(start, end), true),
        ("turning, uneven scale", to(start * uneven, end * uneven), true),
        ("growing", to(start, end * larger), true),
        ("changing form", to(start * uneven, end * other), false),
    ]
}

const CORNERS: [Vec3; 4] = [
    Vec3::new(-0.5, -0.4, 0.1),
    Vec3::new(0.6, -0.3, -0.1),
    Vec3::new(-0.4, 0.5, 0.0),
    Vec3::new(0.5, 0.6, 0.3),
];
const FLAT: [Vec3; 4] = [
    Vec3::new(-0.5, -0.3, 0.0),
    Vec3::new(0.5, -0.3, 0.0),
    Vec3::new(-0.5, 0.3, 0.0),
    Vec3::new(0.5, 0.3, 0.0),
];
const FORMS: [&str; 6] = ["triangle", "patch", "rectangle", "sphere", "disk", "cylinder"];

/// A form where `t` leads, at rest or going on as `motion` says.
fn light(form: &str, t: &Transform, motion: Option<&AnimatedTransform>, desc: &AreaLightDesc) -> Lights {
    let corners = if form == "rectangle" { FLAT } else { CORNERS }.map(|p| t.point(Point(p)).0);
    let (positions, normals, uvs) = (&corners[..], &[][..], &[][..]);
    let geometry = match form {
        "triangle" => EmitterGeometry::Mesh { positions, normals, uvs, indices: &[[0, 1, 2]] },
        "sphere" => {
            EmitterGeometry::Sphere { radius: 0.4, z: [-0.4, 0.4], phi_max: 360.0, world_from_object: t }
        }
        "disk" => {
            EmitterGeometry::Disk { height: 0.1, radii: [0.4, 0.1], phi_max: 300.0, world_from_object: t }
        }
        "cylinder" => {
            EmitterGeometry::Cylinder { radius: 0.3, z: [-0.5, 0.4], phi_max: 250.0, world_from_object: t }
        }
        _ => EmitterGeometry::BilinearMesh { positions, normals, uvs, indices: &[[0, 1, 2, 3]] },
    };
    // A mirror turns the windings of meshes, not the outside of the others.
    let is_mesh = ["triangle", "patch", "rectangle"].contains(&form);
    let flip = is_mesh && t.swaps_handedness();
    let mut sink = Sink::default();
    let mut builder = LightsBuilder::new(ColorPipeline::new(ColorMode::Rgb, ColorSpace::Srgb), &no_images);
    let source = EmitterSource { geometry, flip, visible: true, motion, desc };
    assert_eq!(builder.add_emitter(&source, &mut sink), Some(FIRST));
    assert!(sink.diagnostics().is_empty(), "{}", sink.render());
    builder.finish(Bounds { min: Vec3::splat(-2.0), max: Vec3::splat(2.0) })
}

fn moving(form: &str, motion: &AnimatedTransform) -> Lights {
    light(form, &motion.start(), Some(motion), &desc(None))
}

fn at(p: Point, time: f32) -> LightContext {
    LightContext { p, p_error: Vec3::ZERO, ng: None, ns: None, time }
}

/// Before the first key, between them, after the second.
const MOMENTS: [f32; 4] = [0.0, 0.35, 0.61, 1.0];

#[test]
fn densities_are_those_of_samples_at_every_moment() {
    for (name, motion, _) in motions() {
        for form in FORMS {
            let lights = moving(form, &motion);
            for i in 0..800 {
                let time = MOMENTS[i as usize % 4];
                let [a, b] = uniform_pair(20, i);
                let p = Point::new(3.0 * a - 1.5, 2.0 - 3.5 * b, uniform_pair(21, i)[0] * 3.0 - 1.5);
                let context = at(p, time);
                if let Some(s) = lights.sample(FIRST, &context, uniform_pair(22, i), &L) {
                    let Density::Smooth(pdf) = s.density else { panic!("{name} {form}") };
                    let again = lights.pdf(FIRST, &context, s.p, s.n, s.wi);
                    let cos = s.n.abs_dot(s.wi);
                    let off = (again.value() / pdf.value() - 1.0).abs();
                    assert!(off < 2e-3 + 2e-5 / cos, "{name} {form}: {pdf:?} {again:?} {cos}");
                }
                let (u, v) = (uniform_pair(23, i), uniform_pair(24, i));
                let s = lights.sample_emission(FIRST, u, v, time, &L).unwrap();
                let (position, direction) = lights.emission_pdf(FIRST, s.p, s.n, s.ray.dir, time);
                for (a, b) in [
                    (position.unwrap().value(), s.pdf_position.unwrap().value()),
                    (direction.unwrap().value(), s.pdf_direction.unwrap().value()),
                ] {
                    assert!((a / b - 1.0).abs() < 2e-3, "{name} {form}: {a} {b}");
                }
            }
        }
    }
}

/// Irradiance at a point and power, moving and at rest.
#[test]
fn a_moving_light_is_at_every_moment_a_light_at_rest() {
    let n = 6000;
    let alpha = sidak(1e-4, 4 * FORMS.len() * MOMENTS.len() * 2);
    let normal = Dir::normalize(Vec3::new(0.1, -0.5, 0.8));
    for (name, motion, _) in motions() {
        for form in FORMS {
            let lights = moving(form, &motion);
            for time in MOMENTS {
                let rest = light(form, &motion.at(time), None, &desc(None));
                let what = format!("{name} {form} {time}");
                // Samples of one and the other are drawn with other numbers.
                let irradiance = |lights: &Lights, from: Point, seed: u64| {
                    Moments::of((0..n).map(|i| {
                        let s = lights.sample(FIRST, &at(from, time), uniform_pair(seed, i), &L);
                        f64::from(s.map_or(0.0, |s| match s.density {
                            Density::Smooth(pdf) => s.li.rgb()[0] * s.wi.abs_dot(normal) / pdf.value(),
                            Density::Delta { .. } => f32::NAN,
                        }))
                    }))
                };
                // On the side where a one-sided surface shines, whichever that is.
                let middle = rest.sample_emission(FIRST, [0.4, 0.3], [0.5; 2], time, &L).unwrap();
                let from = middle.p + middle.n.unwrap().0 * 0.7 + normal.0 * 0.2;
                let (a, b) = (irradiance(&lights, from, 31), irradiance(&rest, from, 32));
                assert!(a.mean() > 0.0, "{what}");
                welch_test(&a, &b).assert_consistent(alpha, &format!("{what}: {} {}", a.mean(), b.mean()));
                let emitted = Moments::of((0..n).map(|i| {
                    let (u, v) = (uniform_pair(33, i), uniform_pair(34, i));
                    let s = lights.sample_emission(FIRST, u, v, time, &L);
                    f64::from(s.map_or(0.0, |s| s.throughput().rgb()[0]))
                }));
                let power = f64::from(rest.power(FIRST));
                if emitted.std_error() < 1e-5 * power {
                    assert!((emitted.mean() / power - 1.0).abs() < 1e-3, "{what}: {}", emitted.mean());
                } else {
                    t_test(&emitted, power).assert_consistent(alpha, &format!("{what}: {}", emitted.mean()));
                }
            }
        }
    }
}

#[test]
fn samples_of_moving_patches_follow_their_density() {
    for (name, motion, _) in motions() {
        for (form, corners) in [("patch", CORNERS), ("rectangle", FLAT)] {
            let lights = moving(form, &motion);
            for time in [0.35, 1.0] {
                let c = corners.map(|p| motion.at(time).point(Point(p)).0);
                let bilinear = |u: f32, v: f32| (c[0].lerp(c[1], u)).lerp(c[2].lerp(c[3], u), v);
                let cross = |u: f32, v: f32| {
                    (c[1].lerp(c[3], v) - c[0].lerp(c[2], v)).cross(c[2].lerp(c[3], u) - c[0].lerp(c[1], u))
                };
                let sign = if motion.at(time).swaps_handedness() { -1.0 } else { 1.0 };
                let from = Point(bilinear(0.4, 0.7) + cross(0.5, 0.5).normalize() * 0.5 * sign);
                let context = at(from, time);
                let sample = |u| {
                    let s = lights.sample(FIRST, &context, u, &L)?;
                    Some([f64::from(s.uv.x), f64::from(s.uv.y)])
                };
                let pdf = |u: f64, v: f64| {
                    let (u, v) = (u as f32, v as f32);
                    let (p, n) = (Point(bilinear(u, v)), cross(u, v));
                    let d = p - from;
                    let pdf = lights.pdf(FIRST, &context, p, Dir(n.normalize() * sign), Dir::normalize(d));
                    f64::from(pdf.value() * n.dot(d.normalize()).abs() / d.length_squared())
                };
                let settings = Chi2Settings { cells: [10, 10], samples: 40_000, ..Chi2Settings::default() };
                chi2_rectangle([[0.0, 1.0]; 2], &settings, sample, pdf)
                    .unwrap_or_else(|e| panic!("{name} {form} {time}: {e}"));
            }
        }
    }
}

#[test]
fn a_moving_light_has_its_stated_power_on_average() {
    for (name, motion, keeps_angles) in motions() {
        let lights = light("disk", &motion.start(), Some(&motion), &desc(Some(5.0)));
        assert!((lights.power(FIRST) - 5.0).abs() < 1e-3, "{name}: {}", lights.power(FIRST));
        if !keeps_angles {
            continue;
        }
        // Over the time between the keys, by Simpson's rule in another place: exact for even scales.
        let power = |t: f32| f64::from(light("disk", &motion.at(t), None, &desc(None)).power(FIRST));
        let mean = (power(0.2) + 4.0 * power(0.5) + power(0.8)) / 6.0;
        let moving = f64::from(moving("disk", &motion).power(FIRST));
        assert!((moving / mean - 1.0).abs() < 1e-4, "{name}: {moving} {mean}");
    }
}

/// Bounds hold at every moment: what contributes can be chosen.
#[test]
fn a_moving_light_that_contributes_can_be_chosen() {
    for (name, motion, _) in motions() {
        for form in FORMS {
            // A second light, so that there is a choice.
            let mut sink = Sink::default();
            let desc = desc(None);
            let pipeline = ColorPipeline::new(ColorMode::Rgb, ColorSpace::Srgb);
            let mut builder = LightsBuilder::new(pipeline, &no_images);
            let far = [Vec3::splat(9.0), Vec3::new(9.0, 9.1, 9.0), Vec3::new(9.1, 9.0, 9.0)];
            let geometry =
                EmitterGeometry::Mesh { positions: &far, normals: &[], uvs: &[], indices: &[[0, 1, 2]] };
            let corners =
                if form == "rectangle" { FLAT } else { CORNERS }.map(|p| motion.start().point(Point(p)).0);
            let flat = EmitterGeometry::Mesh {
                positions: &corners,
                normals: &[],
                uvs: &[],
                indices: &[[0, 1, 2], [2, 1, 3]],
            };
            let start = motion.start();
            let disk = EmitterGeometry::Disk {
                height: 0.1,
                radii: [0.4, 0.1],
                phi_max: 300.0,
                world_from_object: &start,
            };
            let own = if form == "disk" { disk } else { flat };
            let flip = motion.start().swaps_handedness() && form != "disk";
            for (geometry, motion) in [(geometry, None), (own, Some(&motion))] {
                let source = EmitterSource { geometry, flip, visible: true, motion, desc: &desc };
                builder.add_emitter(&source, &mut sink).unwrap();
            }
            let lights = builder.finish(Bounds { min: Vec3::splat(-2.0), max: Vec3::splat(2.0) });
            let selector = LightSelector::new(LightSelection::Spatial, &lights);
            let mut n = 0;
            for i in 0..2000 {
                let [x, y] = uniform_pair(41, i);
                let [z, time] = uniform_pair(42, i);
                let context = at(Point(Vec3::new(x, y, z) * 4.0 - 2.0), time);
                for light in lights.ids() {
                    if lights.sample(light, &context, uniform_pair(43, i), &L).is_some() {
                        n += 1;
                        assert!(selector.probability(&context, light) > 0.0, "{name} {form}");
                    }
                }
            }
            assert!(n > 500, "{name} {form}: {n}");
        }
    }
}

/// Texture coordinates and sides come along.
#[test]
fn what_a_surface_emits_moves_with_it() {
    let end = Transform::from_matrix(DMat4::from_rotation_x(std::f64::consts::PI)).unwrap();
    let motion = AnimatedTransform::new(Transform::IDENTITY, end, [0.0, 1.0]);
    let lights = moving("rectangle", &motion);
    let above = Point::new(0.1, 0.1, 2.0);
    let below = Point::new(0.1, 0.1, -2.0);
    let sees = |p: Point, time: f32| lights.sample(FIRST, &at(p, time), [0.3, 0.6], &L);
    assert!(sees(above, 0.0).is_some() && sees(below, 0.0).is_none());
    assert!(sees(above, 1.0).is_none());
    let s = sees(below, 1.0).unwrap();
    assert!((s.n.0 + Vec3::Z).length() < 1e-5);
    let expected = Vec2::new(s.p.0.x + 0.5, (0.3 - s.p.0.y) / 0.6);
    assert!((s.uv - expected).length() < 1e-4, "{} {expected}", s.uv);
}
