//! Laws of lights: samples follow their densities, both ways of meeting a light agree, powers and irradiances are
//! those of closed forms.

#![expect(clippy::unwrap_used, reason = "helpers of tests are tests")]

use std::f32::consts::PI;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, FRAC_PI_8};

use math::{AnimatedTransform, Bounds, DVec3, Dir, Frame, Point, Transform, Vec2, Vec3, trig};
use sampling::{Pdf, SolidAngle};
use scatter::Density;
use scene_desc::{
    AreaLightDesc, ColorSpaceName, FovAxis, Illuminant, ImageId, LightDesc, LightKind, Sink, Span,
    SpectrumDesc, SphericalMapping, SpotFalloff, Throw,
};
use spectrum::{ColorMode, ColorPipeline, ColorSpace, Wavelengths};
use steradian_scene::{
    EmitterGeometry, EmitterSource, LightContext, LightId, LightImage, LightSample, Lights, LightsBuilder,
};
use testkit::chi2::{Chi2Settings, chi2_rectangle, chi2_sphere, uniform_pair};
use testkit::statistics::{Moments, sidak, t_test, welch_test};

const RGB: ColorPipeline = ColorPipeline::new(ColorMode::Rgb, ColorSpace::Srgb);

fn white(scale: f32) -> Illuminant {
    Illuminant { spectrum: SpectrumDesc::srgb([1.0; 3]), scale, normalize: true }
}

/// An image with a dark part, a bright spot and a gradient.
fn picture(id: ImageId) -> LightImage {
    let (w, h) = if id.0 == 0 { (8, 8) } else { (12, 6) };
    let pixels = (0..w * h).map(|i| {
        let (x, y) = (i % w, i / w);
        let v = if x == 2 && y == 3 {
            6.0
        } else if y == 1 {
            0.0
        } else {
            0.2 + 0.1 * (x + y) as f32
        };
        [v, 0.5 * v, 0.25 * v]
    });
    LightImage::new(w, h, pixels.collect(), ColorSpaceName::Srgb).unwrap()
}

fn area_desc(two_sided: bool) -> AreaLightDesc {
    AreaLightDesc { radiance: white(1.0), image: None, two_sided, power: None, span: Span::NONE }
}

/// Around the origin, large enough for all tests.
fn world() -> Bounds {
    Bounds { min: Vec3::splat(-2.0), max: Vec3::splat(2.0) }
}

fn only_light(kind: LightKind, t: Transform) -> Lights {
    let mut sink = Sink::default();
    let mut builder = LightsBuilder::new(RGB, &picture);
    let world_from_light = AnimatedTransform::fixed(t);
    builder.add_light(&LightDesc { kind, world_from_light, medium: None, span: Span::NONE }, &mut sink);
    assert!(sink.diagnostics().is_empty(), "{:?}", sink.diagnostics());
    builder.finish(world())
}

fn only_emitter(geometry: EmitterGeometry<'_>, flip: bool, desc: &AreaLightDesc) -> Lights {
    let mut sink = Sink::default();
    let mut builder = LightsBuilder::new(RGB, &picture);
    let first =
        builder.add_emitter(&EmitterSource { geometry, flip, visible: true, motion: None, desc }, &mut sink);
    assert_eq!(first, Some(LightId(0)), "{:?}", sink.diagnostics());
    builder.finish(world())
}

fn turned() -> Transform {
    let turn = Transform::rotate(DVec3::new(1.0, 2.0, 3.0), 1.1).unwrap();
    Transform::translate(DVec3::new(0.1, -0.2, 0.3)) * turn
}

/// Looks at the disk of `both_ways_of_meeting_a_light_agree`.
fn aimed() -> Transform {
    Transform::look_at(DVec3::new(0.1, -0.2, 0.3), DVec3::new(0.3, -0.8, -0.7), DVec3::Z).unwrap().inverse()
}

fn uneven() -> Transform {
    turned() * Transform::scale(DVec3::new(1.3, -0.6, 0.9)).unwrap()
}

/// All lights that are no surfaces.
#[allow(clippy::too_many_lines, reason = "a list")]
fn far_and_point_lights() -> Vec<(&'static str, Lights)> {
    let (from, to) = (Vec3::new(0.3, 0.2, 0.4), Vec3::new(-0.2, 0.1, -0.9));
    let image = |mapping| LightKind::InfiniteImage {
        image: ImageId(u32::from(mapping != SphericalMapping::EqualArea)),
        mapping,
        scale: 0.7,
        illuminance: None,
        portal: None,
    };
    let spot = |cone_angle, cone_delta| LightKind::Spot {
        intensity: white(3.0),
        from,
        to,
        cone_angle,
        cone_delta,
        falloff: SpotFalloff::Smooth,
        power: None,
    };
    let linear_spot = LightKind::Spot {
        intensity: white(3.0),
        from,
        to,
        cone_angle: 40.0,
        cone_delta: 15.0,
        falloff: SpotFalloff::Linear,
        power: None,
    };
    let thrown =
        |throw| LightKind::Projection { image: ImageId(1), fov: 50.0, scale: 2.0, power: None, throw };
    let goniometric =
        || LightKind::Goniometric { intensity: white(2.0), image: Some(ImageId(0)), power: None };
    let lamp = |name: &str| LightKind::Ies {
        path: format!("{}/../../scenes/lamps/{name}.ies", env!("CARGO_MANIFEST_DIR")).into(),
        intensity: white(0.01),
        power: None,
    };
    let projection = || thrown(Throw::Intensity);
    let cone = Throw::Cone { cone_angle: 35.0, cone_delta: 10.0 };
    let constant = LightKind::InfiniteConstant { radiance: white(0.4), illuminance: None, portal: None };
    let light = only_light;
    vec![
        ("point", light(LightKind::Point { intensity: white(2.0), from, power: None }, turned())),
        ("spot", light(spot(40.0, 15.0), turned())),
        ("wide spot", light(spot(120.0, 120.0), turned())),
        ("linear spot", light(linear_spot, turned())),
        ("goniometric", light(goniometric(), turned())),
        ("goniometric, uneven scale", light(goniometric(), uneven())),
        ("downlight", light(lamp("downlight"), turned())),
        ("wall washer", light(lamp("wall-washer"), turned())),
        ("wall washer, uneven scale", light(lamp("wall-washer"), uneven())),
        ("projection", light(projection(), aimed())),
        ("even projection with image", light(thrown(Throw::Irradiance { axis: FovAxis::Y }), aimed())),
        ("spot with image", light(thrown(cone), aimed())),
        (
            "projection, uneven scale",
            light(projection(), aimed() * Transform::scale(DVec3::new(1.3, -0.6, 0.9)).unwrap()),
        ),
        ("even sky through a portal", light(through_portal(None), turned())),
        ("portal with image", light(through_portal(Some(ImageId(0))), turned())),
        (
            "distant",
            light(LightKind::Distant { radiance: white(1.5), from, to, illuminance: None }, turned()),
        ),
        ("infinite", light(constant, turned())),
        ("equal-area image", light(image(SphericalMapping::EqualArea), turned())),
        ("equal-area image, uneven scale", light(image(SphericalMapping::EqualArea), uneven())),
        ("longitude and latitude", light(image(SphericalMapping::EquiRectangular), turned())),
        ("rows on poles, with image", light(image(SphericalMapping::EquiRectangularPoles), turned())),
    ]
}

/// A window above everything, a little tilted: its first corner, and its sides.
const PORTAL: [Vec3; 3] =
    [Vec3::new(-0.6, -0.3, 1.4), Vec3::new(1.1, 0.11, 0.22), Vec3::new(0.0, 0.9, -0.45)];

fn through_portal(image: Option<ImageId>) -> LightKind {
    let [p, s, t] = PORTAL;
    let portal = Some([p, p + t, p + t + s, p + s]);
    let (mapping, scale, illuminance) = (SphericalMapping::EqualArea, 0.7, None);
    match image {
        Some(image) => LightKind::InfiniteImage { image, mapping, scale, illuminance, portal },
        None => LightKind::InfiniteConstant { radiance: white(0.4), illuminance, portal },
    }
}

const CORNERS: [Vec3; 4] = [
    Vec3::new(-0.5, -0.4, 0.1),
    Vec3::new(0.6, -0.3, -0.1),
    Vec3::new(-0.4, 0.5, 0.0),
    Vec3::new(0.5, 0.6, 0.3),
];

/// A rectangle with corners in the order of a patch.
fn rectangle(size: [f32; 2]) -> [Vec3; 4] {
    let (x, y) = (Vec3::X * size[0], Vec3::Y * size[1]);
    [-x - y, x - y, -x + y, x + y]
}

/// All kinds of emitting surface.
fn emitters(two_sided: bool) -> Vec<(&'static str, Lights)> {
    let desc = area_desc(two_sided);
    let imaged = AreaLightDesc { image: Some(ImageId(1)), ..desc.clone() };
    let (turned, uneven) = (turned(), uneven());
    let triangle =
        EmitterGeometry::Mesh { positions: &CORNERS, normals: &[], uvs: &[], indices: &[[0, 1, 2]] };
    let patch = EmitterGeometry::BilinearMesh {
        positions: &CORNERS,
        normals: &[],
        uvs: &[],
        indices: &[[0, 1, 2, 3]],
    };
    let flat = rectangle([0.5, 0.3]);
    let rectangle =
        EmitterGeometry::BilinearMesh { positions: &flat, normals: &[], uvs: &[], indices: &[[0, 1, 2, 3]] };
    let sphere = |t, z, phi_max| EmitterGeometry::Sphere { radius: 0.4, z, phi_max, world_from_object: t };
    let disk =
        |t, radii, phi_max| EmitterGeometry::Disk { height: 0.1, radii, phi_max, world_from_object: t };
    let cylinder =
        |t| EmitterGeometry::Cylinder { radius: 0.3, z: [-0.5, 0.4], phi_max: 250.0, world_from_object: t };
    let make = only_emitter;
    vec![
        ("triangle", make(triangle, false, &desc)),
        ("triangle with image", make(triangle, true, &imaged)),
        ("patch", make(patch, false, &desc)),
        ("rectangle", make(rectangle, false, &desc)),
        ("rectangle with image", make(rectangle, false, &imaged)),
        ("sphere", make(sphere(&turned, [-0.4, 0.4], 360.0), false, &desc)),
        ("part of a sphere", make(sphere(&turned, [-0.1, 0.3], 200.0), false, &imaged)),
        ("ellipsoid", make(sphere(&uneven, [-0.4, 0.4], 360.0), false, &desc)),
        ("disk", make(disk(&turned, [0.4, 0.0], 360.0), false, &desc)),
        ("sector of a ring, uneven scale", make(disk(&uneven, [0.4, 0.2], 200.0), true, &imaged)),
        ("cylinder", make(cylinder(&turned), false, &desc)),
        ("cylinder, uneven scale", make(cylinder(&uneven), false, &desc)),
    ]
}

fn at(p: Point) -> LightContext {
    LightContext { p, p_error: Vec3::ZERO, ng: None, ns: None, time: 0.0 }
}

const FIRST: LightId = LightId(0);
const L: Wavelengths = Wavelengths::RGB;

/// Estimator's value for a receiver that counts `f` of the direction.
fn estimate(s: &LightSample, f: impl Fn(Dir) -> f32) -> f32 {
    let density = match s.density {
        Density::Smooth(p) => p.value(),
        Density::Delta { probability } => probability,
    };
    s.li.rgb()[0] * f(s.wi) / density
}

fn smooth(s: &LightSample) -> Option<Pdf<SolidAngle>> {
    match s.density {
        Density::Smooth(p) => Some(p),
        Density::Delta { .. } => None,
    }
}

#[test]
fn a_samples_density_is_the_density_of_its_direction() {
    for (name, lights) in far_and_point_lights().into_iter().chain(emitters(true)) {
        let mut n = 0;
        for i in 0..1000 {
            let [a, b] = uniform_pair(20, i);
            let context = at(Point::new(3.0 * a - 1.5, 2.0 - 3.5 * b, uniform_pair(21, i)[0] * 3.0 - 1.5));
            let Some(s) = lights.sample(FIRST, &context, uniform_pair(22, i), &L) else { continue };
            n += 1;
            assert!((s.wi.0.length() - 1.0).abs() < 1e-5 && s.li.is_finite(), "{name}");
            let pdf = lights.pdf(FIRST, &context, s.p, s.n, s.wi);
            match smooth(&s) {
                Some(p) => {
                    assert!(!lights.is_delta(FIRST), "{name}");
                    let ratio = pdf.value() / p.value();
                    // Seen nearly edge-on, the cosine itself is rounding.
                    let cos = s.n.abs_dot(s.wi);
                    assert!((ratio - 1.0).abs() < 1e-3 + 1e-5 / cos, "{name}: {pdf:?} {p:?} {cos}");
                }
                None => assert!(lights.is_delta(FIRST) && !pdf.is_positive(), "{name}"),
            }
            // What is sampled is what a ray would find.
            let seen = if s.is_infinite && !lights.is_delta(FIRST) {
                lights.infinite_emitted(FIRST, context.p, s.wi, &L)
            } else {
                lights.emitted(FIRST, s.n, s.uv, -s.wi, &L)
            };
            let pixel_edge = name.contains("image") || name.contains("longitude");
            if !lights.is_delta(FIRST) && !pixel_edge {
                assert!((seen.rgb()[0] / s.li.rgb()[0] - 1.0).abs() < 1e-4, "{name}");
            }
        }
        assert!(n > 25, "{name}: {n} samples");
    }
}

#[test]
fn an_emitted_rays_densities_are_those_of_the_ray() {
    for (name, lights) in far_and_point_lights().into_iter().chain(emitters(true)).chain(emitters(false)) {
        for i in 0..1000 {
            let Some(s) = lights.sample_emission(FIRST, uniform_pair(1, i), uniform_pair(2, i), 0.0, &L)
            else {
                continue;
            };
            let (position, direction) = lights.emission_pdf(FIRST, s.p, s.n, s.ray.dir, 0.0);
            assert_eq!(position.is_none(), s.is_delta_position(), "{name}");
            assert_eq!(direction.is_none(), s.is_delta_direction(), "{name}");
            if let (Some(a), Some(b)) = (position, s.pdf_position) {
                assert!((a.value() / b.value() - 1.0).abs() < 1e-3, "{name}: {a:?} {b:?}");
            }
            if let (Some(a), Some(b)) = (direction, s.pdf_direction) {
                assert!((a.value() / b.value() - 1.0).abs() < 2e-3, "{name}: {a:?} {b:?}");
            }
        }
    }
}

/// A light path's start is worth the light's power; `power` is integrated in another way.
#[test]
fn emitted_rays_carry_the_lights_power() {
    let all: Vec<_> =
        far_and_point_lights().into_iter().chain(emitters(true)).chain(emitters(false)).collect();
    let alpha = sidak(1e-4, all.len());
    for (name, lights) in &all {
        // Under such maps the power of a light with an image is an estimate for the choice among lights alone.
        let is_surface = name.contains("ring") || name.contains("cylinder");
        if name.contains("uneven") && !is_surface {
            continue;
        }
        let m = Moments::of((0..50_000).map(|i| {
            let s = lights.sample_emission(FIRST, uniform_pair(3, i), uniform_pair(4, i), 0.0, &L);
            f64::from(s.map_or(0.0, |s| s.throughput().rgb().iter().sum::<f32>() / 3.0))
        }));
        let power = f64::from(lights.power(FIRST));
        assert!(power > 0.0);
        // The mean of an image over a surface is an estimate; its power serves the choice among lights alone.
        if *name == "sector of a ring, uneven scale" || name.contains("with image") || name.contains("part") {
            assert!((m.mean() / power - 1.0).abs() < 0.1, "{name}: {} {power}", m.mean());
            continue;
        }
        // Zero variance, but for rounding: compare directly.
        if m.std_error() < 1e-5 * power {
            assert!((m.mean() / power - 1.0).abs() < 2e-4, "{name}: {} {power}", m.mean());
        } else {
            t_test(&m, power).assert_consistent(alpha, &format!("{name}: {} {power}", m.mean()));
        }
    }
}

/// The flux through a disk, by rays from the light and by samples from points of the disk.
#[test]
fn both_ways_of_meeting_a_light_agree() {
    let center = Point::new(0.2, -0.9, -0.7);
    let normal = Dir::normalize(Vec3::new(0.1, 0.5, 0.8));
    let frame = Frame::from_normal(normal);
    let radius = 0.6;
    let all: Vec<_> =
        far_and_point_lights().into_iter().chain(emitters(true)).chain(emitters(false)).collect();
    let alpha = sidak(1e-4, all.len());
    // Without occlusion the far side of a two-sided sphere would shine through the near one; samples leave it out.
    let through = |lights: &Lights, name: &str| name == "sphere" && lights.power(FIRST) > 5.0;
    let mut n_dark = 0;
    for (name, lights) in all.iter().filter(|(name, lights)| !through(lights, name)) {
        let n = 60_000;
        let from_light = Moments::of((0..n).map(|i| {
            let s = lights.sample_emission(FIRST, uniform_pair(5, i), uniform_pair(6, i), 0.0, &L);
            let flux = s.map_or(0.0, |s| {
                let t = (center - s.ray.origin).dot(normal.0) / s.ray.dir.dot(normal);
                let hits = t > 0.0 && s.ray.at(t).distance(center) < radius;
                if hits { s.throughput().rgb()[0] } else { 0.0 }
            });
            f64::from(flux)
        }));
        let area = PI * radius * radius;
        let from_disk = Moments::of((0..n).map(|i| {
            let d = sampling::warp::concentric_disk(uniform_pair(7, i)) * radius;
            let p = center + frame.s * d.x + frame.t * d.y;
            let s = lights.sample(FIRST, &at(p), uniform_pair(8, i), &L);
            f64::from(s.map_or(0.0, |s| area * estimate(&s, |w| w.abs_dot(normal))))
        }));
        // One-sided surfaces may face away: then both must find nothing.
        if from_disk.mean() == 0.0 {
            assert!(from_light.mean() == 0.0 && n_dark < 6, "{name}");
            n_dark += 1;
            continue;
        }
        welch_test(&from_light, &from_disk)
            .assert_consistent(alpha, &format!("{name}: {} {}", from_light.mean(), from_disk.mean()));
    }
}

/// A surface by its parameters: point, and area per unit of parameters.
type Surface = Box<dyn Fn(Vec2) -> (Point, Dir, f32)>;

fn chi2_on_surface(name: &str, lights: &Lights, from: Point, surface: &Surface) {
    let context = at(from);
    let settings = Chi2Settings { cells: [10, 10], samples: 60_000, ..Chi2Settings::default() };
    let sample = |u| {
        let s = lights.sample(FIRST, &context, u, &L)?;
        Some([f64::from(s.uv.x), f64::from(s.uv.y)])
    };
    let pdf = |u: f64, v: f64| {
        let (p, n, area) = surface(Vec2::new(u as f32, v as f32));
        let d = p - from;
        let wi = Dir::normalize(d);
        let pdf = lights.pdf(FIRST, &context, p, n, wi).value();
        f64::from(pdf * n.abs_dot(wi) / d.length_squared() * area)
    };
    chi2_rectangle([[0.0, 1.0]; 2], &settings, sample, pdf).unwrap_or_else(|e| panic!("{name}: {e}"));
}

/// Point, normal and area element of a parametrised surface, by differences.
fn surface(t: Transform, f: impl Fn(f64, f64) -> DVec3 + 'static) -> Surface {
    Box::new(move |uv| {
        let (u, v) = (f64::from(uv.x), f64::from(uv.y));
        let world = |u, v| t.matrix().transform_point3(f(u, v));
        let h = 1e-4;
        let (lo, hi) = (|x: f64| (x - h).max(0.0), |x: f64| (x + h).min(1.0));
        let du = (world(hi(u), v) - world(lo(u), v)) / (hi(u) - lo(u));
        let dv = (world(u, hi(v)) - world(u, lo(v))) / (hi(v) - lo(v));
        let cross = du.cross(dv);
        (Point(world(u, v).as_vec3()), Dir::normalize(cross.as_vec3()), cross.length() as f32)
    })
}

#[test]
fn samples_of_surfaces_follow_their_density() {
    let lerp = |c: [Vec3; 4]| {
        let c = c.map(|v| v.as_dvec3());
        move |u: f64, v: f64| (c[0] * (1.0 - u) + c[1] * u) * (1.0 - v) + (c[2] * (1.0 - u) + c[3] * u) * v
    };
    let (sin_cos, tau) = (libm_sincos, std::f64::consts::TAU);
    let ring = move |r0: f64, r1: f64, phi_max: f64| {
        move |u: f64, v: f64| {
            let ((s, c), r) = (sin_cos(u * phi_max), r1 - v * (r1 - r0));
            DVec3::new(r * c, r * s, 0.1)
        }
    };
    let sphere = move |z: [f64; 2], phi_max: f64| {
        move |u: f64, v: f64| {
            let theta = |z: f64| math::trig::f64::atan2((0.16 - z * z).max(0.0).sqrt(), z);
            let (s, c) = sin_cos(theta(z[0]) + v * (theta(z[1]) - theta(z[0])));
            let (sp, cp) = sin_cos(u * phi_max);
            DVec3::new(s * cp, s * sp, c) * 0.4
        }
    };
    let cylinder = move |u: f64, v: f64| {
        let (s, c) = sin_cos(u * 250.0_f64.to_radians());
        DVec3::new(0.3 * c, 0.3 * s, -0.5 + 0.9 * v)
    };
    let d200 = 200.0_f64.to_radians();
    let surfaces: [(&str, Surface); 9] = [
        ("patch", surface(Transform::IDENTITY, lerp(CORNERS))),
        ("rectangle", surface(Transform::IDENTITY, lerp(rectangle([0.5, 0.3])))),
        ("part of a sphere", surface(turned(), sphere([-0.1, 0.3], d200))),
        ("ellipsoid", surface(uneven(), sphere([-0.4, 0.4], tau))),
        ("disk", surface(turned(), ring(0.0, 0.4, tau))),
        ("sector of a ring, uneven scale", surface(uneven(), ring(0.2, 0.4, d200))),
        ("cylinder", surface(turned(), cylinder)),
        ("cylinder, uneven scale", surface(uneven(), cylinder)),
        ("rectangle with image", surface(Transform::IDENTITY, lerp(rectangle([0.5, 0.3])))),
    ];
    let all = emitters(true);
    for (name, surface) in &surfaces {
        let (_, lights) = all.iter().find(|(n, _)| n == name).unwrap();
        // Images have a dark row, whose samples are dropped: they are in the next test.
        if name.contains("image") || name.contains("ring") || name.contains("part") {
            continue;
        }
        for from in [Point::new(0.3, 0.4, 1.1), Point::new(-0.2, 1.0, 0.15), Point::new(2.0, -9.0, 4.0)] {
            chi2_on_surface(name, lights, from, surface);
        }
    }
}

fn libm_sincos(x: f64) -> (f64, f64) {
    math::trig::f64::sin_cos(x)
}

#[test]
fn samples_of_partial_surfaces_follow_their_density() {
    let desc = area_desc(true);
    let (turned, uneven) = (turned(), uneven());
    let part =
        EmitterGeometry::Sphere { radius: 0.4, z: [-0.1, 0.3], phi_max: 200.0, world_from_object: &turned };
    let ring =
        EmitterGeometry::Disk { height: 0.1, radii: [0.4, 0.2], phi_max: 200.0, world_from_object: &uneven };
    let d200 = 200.0_f64.to_radians();
    let theta = |z: f64| math::trig::f64::atan2((0.16 - z * z).sqrt(), z);
    let on_sphere = surface(turned, move |u, v| {
        let (s, c) = libm_sincos(theta(-0.1) + v * (theta(0.3) - theta(-0.1)));
        let (sp, cp) = libm_sincos(u * d200);
        DVec3::new(s * cp, s * sp, c) * 0.4
    });
    let on_ring = surface(uneven, move |u, v| {
        let ((s, c), r) = (libm_sincos(u * d200), 0.4 - v * 0.2);
        DVec3::new(r * c, r * s, 0.1)
    });
    for from in [Point::new(0.3, 0.4, 1.1), Point::new(0.1, -0.2, 0.35)] {
        chi2_on_surface("part of a sphere", &only_emitter(part, false, &desc), from, &on_sphere);
        chi2_on_surface("sector of a ring", &only_emitter(ring, false, &desc), from, &on_ring);
    }
}

/// A triangle's parameters (s, t): b₂ = s, b₁ = t (1 − s), area 2A (1 − s) ds dt.
#[test]
fn samples_of_triangles_follow_their_density_near_and_far() {
    let [p0, p1, p2, _] = CORNERS;
    let uvs = [Vec2::ZERO, Vec2::X, Vec2::Y];
    let geometry =
        EmitterGeometry::Mesh { positions: &CORNERS[..3], normals: &[], uvs: &uvs, indices: &[[0, 1, 2]] };
    let lights = only_emitter(geometry, false, &area_desc(true));
    let cross = (p1 - p0).cross(p2 - p0);
    // From within a hair of the plane (nearly a hemisphere) to where the triangle is a dot; edge-on at the end.
    let inside = (p0 + p1 + p2) / 3.0;
    let n = cross.normalize();
    let places = [
        inside + n * 0.004,
        inside + n * 0.5,
        inside - n * 3.0,
        inside + n * 30.0,
        inside + n * 300.0,
        p1 * 3.0 + n * 0.01,
        p0 + n * 0.1,
    ];
    for (i, from) in places.into_iter().enumerate() {
        let context = at(Point(from));
        let settings = Chi2Settings { cells: [14, 14], ..Chi2Settings::default() };
        let sample = |u| {
            let s = lights.sample(FIRST, &context, u, &L)?;
            let (b1, b2) = (f64::from(s.uv.x), f64::from(s.uv.y));
            Some([b2, (b1 / (1.0 - b2).max(1e-12)).min(1.0)])
        };
        let pdf = |s: f64, t: f64| {
            let (b2, b1) = (s as f32, (t * (1.0 - s)) as f32);
            let p = Point(p0 + (p1 - p0) * b1 + (p2 - p0) * b2);
            let d = p.0 - from;
            let cos = (d.normalize().dot(n)).abs();
            let pdf = lights.pdf(FIRST, &context, p, Dir(n), Dir::normalize(d)).value();
            f64::from(pdf * cos / d.length_squared() * cross.length()) * (1.0 - s)
        };
        chi2_rectangle([[0.0, 1.0]; 2], &settings, sample, pdf).unwrap_or_else(|e| panic!("place {i}: {e}"));
    }
}

#[test]
fn samples_of_a_sphere_fill_its_cone_evenly() {
    let lights = emitters(true).swap_remove(5).1;
    let center = turned().point(Point::default());
    for d in [0.402_f32, 0.6, 3.0, 400.0] {
        let to_center = Dir::normalize(Vec3::new(0.3, -0.8, 0.5));
        let from = center - to_center.0 * d;
        let context = at(from);
        let sin2 = f64::from(0.4 / d).powi(2);
        let cap = sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt());
        let frame = Frame::from_normal(to_center);
        let sample = |u| {
            let s = lights.sample(FIRST, &context, u, &L)?;
            assert!((s.p.distance(center) / 0.4 - 1.0).abs() < 1e-4);
            let w = frame.to_local(s.wi).0;
            // 1 − cos by the sine, which has digits for small cones; far away, a point's own digits end.
            let sin2 = f64::from(w.x * w.x + w.y * w.y);
            let phi = f64::from(trig::atan2(w.y, w.x));
            let h = sin2 / (1.0 + f64::from(w.z));
            Some([(h / cap).min(1.0), (phi / std::f64::consts::TAU).rem_euclid(1.0)])
        };
        let pdf = |h: f64, phi: f64| {
            // The point where the direction meets the sphere's near side.
            let cos = 1.0 - h * cap;
            let sin = (1.0 - cos * cos).max(0.0).sqrt();
            let (s, c) = libm_sincos(phi * std::f64::consts::TAU);
            let w = frame.s * (sin * c) as f32 + frame.t * (sin * s) as f32 + to_center.0 * cos as f32;
            let dd = f64::from(d);
            let t = dd * cos - (0.16_f64.min(0.16) - dd * dd * sin * sin).max(0.0).sqrt();
            let p = from + w * t as f32;
            let n = Dir::normalize(p - center);
            let pdf = f64::from(lights.pdf(FIRST, &context, p, n, Dir(w)).value());
            pdf * cap * std::f64::consts::TAU
        };
        let settings = Chi2Settings { cells: [14, 14], ..Chi2Settings::default() };
        chi2_rectangle([[0.0, 1.0]; 2], &settings, sample, pdf).unwrap_or_else(|e| panic!("{d}: {e}"));
    }
}

#[test]
fn directions_of_infinite_lights_follow_their_density() {
    // From anywhere; then before surfaces, where half of space sees the upper half of the sky alone.
    let (any, n) = (at(Point::new(0.3, 0.4, 0.5)), Some(Dir::normalize(Vec3::new(0.3, 0.5, -0.4))));
    let contexts = [any, LightContext { ns: n, ..any }];
    let cases = contexts.into_iter().enumerate();
    for (i, context, (name, mut lights)) in
        cases.flat_map(|(i, c)| far_and_point_lights().into_iter().skip(16).map(move |l| (i, c, l)))
    {
        if i > 0 {
            let bounds = Bounds { min: Vec3::splat(-1.0), max: Vec3::splat(1.0) };
            lights.look_at_skies(&bounds, |ray| ray.origin.0.x > 0.0 && ray.dir.0.z < 0.0);
        }
        let settings = Chi2Settings { cells: [8, 16], ..Chi2Settings::default() };
        // Images have a dark row: its directions must have no density.
        chi2_sphere(
            &settings,
            |u| {
                let s = lights.sample(FIRST, &context, u, &L);
                s.map(|s| s.wi.0.as_dvec3().to_array())
            },
            |w| {
                let w = Dir(DVec3::from_array(w).as_vec3());
                f64::from(lights.pdf(FIRST, &context, Point::default(), w, w).value())
            },
        )
        .unwrap_or_else(|e| panic!("{name} {i}: {e}"));
    }
}

/// Where the line from a point meets the window: near it, far from it, and almost in its plane.
#[test]
fn samples_through_a_portal_follow_their_density() {
    let [corner, s, t] = PORTAL;
    let normal = Dir::normalize(s.cross(t));
    let area = f64::from(s.length() * t.length());
    for (image, from) in [
        (Some(ImageId(0)), Point::new(0.1, 0.2, -1.0)),
        (Some(ImageId(0)), Point::new(-0.2, 0.0, 0.8)),
        (Some(ImageId(1)), Point::new(1.4, 0.5, 0.3)),
        (None, Point::new(-1.9, -1.0, 0.4)),
    ] {
        let lights = only_light(through_portal(image), turned());
        let context = at(from);
        let settings = Chi2Settings { cells: [12, 12], ..Chi2Settings::default() };
        let sample = |u| {
            let wi = lights.sample(FIRST, &context, u, &L)?.wi;
            let d = from + wi.0 * ((Point(corner) - from).dot(normal.0) / wi.dot(normal)) - Point(corner);
            Some([d.dot(s) / s.length_squared(), d.dot(t) / t.length_squared()].map(f64::from))
        };
        let pdf = |x: f64, y: f64| {
            let d = corner + s * x as f32 + t * y as f32 - from.0;
            let wi = Dir::normalize(d);
            let pdf = lights.pdf(FIRST, &context, from, wi, wi).value();
            f64::from(pdf * wi.dot(normal) / d.length_squared()) * area
        };
        chi2_rectangle([[0.0, 1.0]; 2], &settings, sample, pdf).unwrap_or_else(|e| panic!("{from:?}: {e}"));
    }
}

/// Beside the window, and from behind it, the sky is black; and what is no rectangle is refused.
#[test]
fn a_portal_is_all_there_is_of_its_sky() {
    let lights = only_light(through_portal(None), turned());
    let [corner, s, t] = PORTAL;
    let (from, beyond) = (Point::new(0.1, 0.2, -1.0), Point::new(0.0, 0.0, 3.0));
    let towards = |from: Point, x: f32, y: f32| {
        let w = Dir::normalize(corner + s * x + t * y - from.0);
        lights.background(from, w, &L).rgb()[0]
    };
    assert!((towards(from, 0.01, 0.99) - 0.4).abs() < 1e-6 && (towards(from, 0.5, 0.5) - 0.4).abs() < 1e-6);
    assert_eq!([towards(from, -0.01, 0.5), towards(from, 0.5, 1.01), towards(beyond, 0.5, 0.5)], [0.0; 3]);
    assert!(lights.sample(FIRST, &at(beyond), [0.5; 2], &L).is_none());

    let corners = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.2, 0.0), Vec3::Y];
    let kind = LightKind::InfiniteConstant { radiance: white(1.0), illuminance: None, portal: Some(corners) };
    let mut sink = Sink::default();
    let world_from_light = AnimatedTransform::fixed(Transform::IDENTITY);
    let desc = LightDesc { kind, world_from_light, medium: None, span: Span::NONE };
    LightsBuilder::new(RGB, &picture).add_light(&desc, &mut sink);
    assert!(sink.has_errors() && sink.render().contains("no rectangle in order"), "{}", sink.render());
}

#[test]
fn emitted_directions_follow_their_density() {
    let two_sided = emitters(true).into_iter().take(3);
    let lights =
        far_and_point_lights().into_iter().chain(two_sided).chain(emitters(false).into_iter().skip(3));
    for (name, lights) in lights {
        // Frustums end sharply inside of cells; images with dark rows drop samples. Both have tests of their own.
        if name.contains("projection") || name.contains("distant") || name.contains("image") {
            continue;
        }
        // Surfaces: one place, so that the normal is one.
        let place = [0.3, 0.6];
        let Some(first) =
            (0..50).find_map(|i| lights.sample_emission(FIRST, place, uniform_pair(9, i), 0.0, &L))
        else {
            panic!("{name} emits nothing")
        };
        let settings = Chi2Settings { cells: [8, 16], samples: 60_000, ..Chi2Settings::default() };
        // The normal on the emitting side: of two-sided lights either will do.
        let frame = Frame::from_normal(first.n.unwrap_or(Dir::Z));
        chi2_sphere(
            &settings,
            |u| {
                let s = lights.sample_emission(FIRST, place, u, 0.0, &L)?;
                Some(frame.to_local(s.ray.dir).0.as_dvec3().to_array())
            },
            |w| {
                let dir = frame.to_world(math::LocalDir(DVec3::from_array(w).as_vec3()));
                f64::from(lights.emission_pdf(FIRST, first.p, first.n, dir, 0.0).1.unwrap().value())
            },
        )
        .unwrap_or_else(|e| panic!("{name}: {e}"));
    }
}

/// On the slide: (x, y) of the plane z = 1 over its half extent.
#[test]
fn a_projectors_directions_follow_its_slide() {
    for t in [turned(), uneven()] {
        let kind = LightKind::Projection {
            image: ImageId(0),
            fov: 50.0,
            scale: 2.0,
            power: None,
            throw: Throw::Intensity,
        };
        let lights = only_light(kind, t);
        let half = f64::from(trig::tan(25.0_f32.to_radians()));
        let settings = Chi2Settings { cells: [16, 16], ..Chi2Settings::default() };
        let sample = |u| {
            let s = lights.sample_emission(FIRST, [0.5; 2], u, 0.0, &L)?;
            let w = t.inverse().vector(s.ray.dir.0).as_dvec3();
            Some([w.x / w.z / half, w.y / w.z / half])
        };
        let world = |x: f64, y: f64| {
            let w = t.matrix().transform_vector3(DVec3::new(x * half, y * half, 1.0));
            w.normalize()
        };
        let pdf = |x: f64, y: f64| {
            let w = world(x, y);
            let pdf = lights.emission_pdf(FIRST, Point::default(), None, Dir(w.as_vec3()), 0.0).1.unwrap();
            let h = 1e-4;
            let (dx, dy) = (world(x + h, y) - world(x - h, y), world(x, y + h) - world(x, y - h));
            f64::from(pdf.value()) * dx.cross(dy).length() / (4.0 * h * h)
        };
        chi2_rectangle([[-1.0, 1.0]; 2], &settings, sample, pdf).unwrap_or_else(|e| panic!("{e}"));
    }
}

/// E / L at the origin, whose normal is +z, from lights with radiance one.
fn irradiance(lights: &Lights) -> Moments {
    Moments::of((0..100_000).map(|i| {
        let sum: f32 = lights
            .ids()
            .map(|l| {
                let u = uniform_pair(30 + u64::from(l.0), i);
                let s = lights.sample(l, &at(Point::default()), u, &L);
                s.map_or(0.0, |s| estimate(&s, |w| w.0.z.max(0.0)))
            })
            .sum();
        f64::from(sum)
    }))
}

/// Ground truth, section 2.
#[test]
fn irradiances_are_those_of_closed_forms() {
    let desc = area_desc(true);
    let mut cases: Vec<(String, Lights, f64)> = Vec::new();
    let truth = [
        (0.0, FRAC_PI_4),
        (30.0, 0.680_174_8),
        (60.0, FRAC_PI_8),
        (75.0, 0.221_200_9),
        (90.0, 0.090_586_1),
        (110.0, 0.006_753_1),
    ];
    for (theta, e) in truth {
        let (s, c) = libm_sincos(f64::to_radians(theta));
        let t = Transform::translate(DVec3::new(2.0 * s, 0.0, 2.0 * c));
        let sphere =
            EmitterGeometry::Sphere { radius: 1.0, z: [-1.0, 1.0], phi_max: 360.0, world_from_object: &t };
        cases.push((format!("sphere at {theta}°"), only_emitter(sphere, false, &desc), e));
    }
    for (h, x, e) in [
        (1.0, 0.0, FRAC_PI_2),
        (1.0, 0.5, 1.375_963_0),
        (1.0, 1.0, 0.868_314_9),
        (1.0, 2.0, 0.165_833_4),
        (2.0, 0.0, 0.628_318_5),
    ] {
        let t = Transform::translate(DVec3::new(x, 0.0, h));
        let disk =
            EmitterGeometry::Disk { height: 0.0, radii: [1.0, 0.0], phi_max: 360.0, world_from_object: &t };
        cases.push((format!("disk at height {h}, offset {x}"), only_emitter(disk, false, &desc), e));
    }
    for (half, e) in [(1.0, 1.740_839_5), (0.5, 0.752_274_7), (0.25, 0.230_836_8)] {
        let corners = rectangle([half, half]).map(|p| p + Vec3::Z);
        let patch = EmitterGeometry::BilinearMesh {
            positions: &corners,
            normals: &[],
            uvs: &[],
            indices: &[[0, 1, 2, 3]],
        };
        cases.push((format!("rectangle of {half}"), only_emitter(patch, false, &desc), e));
        let mesh = EmitterGeometry::Mesh {
            positions: &corners,
            normals: &[],
            uvs: &[],
            indices: &[[0, 1, 2], [1, 3, 2]],
        };
        cases.push((format!("two triangles of {half}"), only_emitter(mesh, false, &desc), e));
    }
    let wall = [[1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 2.0], [1.0, 1.0, 2.0]].map(Vec3::from_array);
    let mesh =
        EmitterGeometry::Mesh { positions: &wall, normals: &[], uvs: &[], indices: &[[0, 1, 2], [1, 3, 2]] };
    cases.push(("wall".into(), only_emitter(mesh, false, &desc), 0.597_329_5));
    let corners = [[1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [-1.0, -1.0, 2.0]].map(Vec3::from_array);
    let mesh = EmitterGeometry::Mesh { positions: &corners, normals: &[], uvs: &[], indices: &[[0, 1, 2]] };
    cases.push(("triangle".into(), only_emitter(mesh, false, &desc), 0.687_617_6));

    let alpha = sidak(1e-4, cases.len());
    for (name, lights, truth) in &cases {
        let m = irradiance(lights);
        t_test(&m, *truth).assert_consistent(alpha, &format!("{name}: {} {truth}", m.mean()));
    }
}

#[test]
fn an_even_sky_gives_pi_and_distant_light_its_irradiance() {
    let all = far_and_point_lights();
    let t = irradiance(&all[16].1);
    t_test(&t, 0.4 * std::f64::consts::PI).assert_consistent(1e-6, "sky");
    // From (0.3, 0.2, 0.4) to (−0.2, 0.1, −0.9), turned: 1.5 times the cosine.
    let to_light = turned().dir(Dir::normalize(Vec3::new(0.5, 0.1, 1.3)));
    let m = irradiance(&all[15].1);
    let expected = f64::from(1.5 * to_light.0.z.max(0.0));
    assert!((m.mean() - expected).abs() < 1e-5, "{} {expected}", m.mean());
}

#[test]
fn stated_powers_and_illuminances_are_kept() {
    let luminance = |lights: &Lights| lights.power(FIRST);
    let near = |a: f32, b: f32, name: &str| assert!((a / b - 1.0).abs() < 1e-3, "{name}: {a} {b}");
    let (from, to) = (Vec3::ZERO, Vec3::Z);
    // White light: the mean of R, G and B is the luminance.
    let point = LightKind::Point { intensity: white(1.0), from, power: Some(7.0) };
    near(luminance(&only_light(point, turned())), 7.0, "point");
    let spot = LightKind::Spot {
        intensity: white(1.0),
        from,
        to,
        cone_angle: 50.0,
        cone_delta: 20.0,
        falloff: SpotFalloff::Smooth,
        power: Some(7.0),
    };
    near(luminance(&only_light(spot, turned())), 7.0, "spot");
    let gonio = LightKind::Goniometric { intensity: white(1.0), image: Some(ImageId(0)), power: Some(7.0) };
    near(luminance(&only_light(gonio, turned())), 7.0, "goniometric");
    let path = format!("{}/../../scenes/lamps/wall-washer.ies", env!("CARGO_MANIFEST_DIR")).into();
    let lamp = LightKind::Ies { path, intensity: white(1.0), power: Some(7.0) };
    near(luminance(&only_light(lamp, turned())), 7.0, "lamp");
    let sky = LightKind::InfiniteConstant { radiance: white(1.0), illuminance: Some(5.0), portal: None };
    near(
        only_light(sky, turned()).infinite_emitted(FIRST, Point::default(), Dir::Z, &L).rgb()[1],
        5.0 / PI,
        "sky",
    );
    let sun = LightKind::Distant { radiance: white(1.0), from, to, illuminance: Some(5.0) };
    let s = only_light(sun, turned()).sample(FIRST, &at(Point::default()), [0.5; 2], &L).unwrap();
    near(s.li.rgb()[1], 5.0, "sun");
    // Each triangle of a mesh has the power, as in pbrt.
    let desc = AreaLightDesc { power: Some(7.0), ..area_desc(true) };
    let mesh = EmitterGeometry::Mesh {
        positions: &CORNERS,
        normals: &[],
        uvs: &[],
        indices: &[[0, 1, 2], [1, 3, 2]],
    };
    let lights = only_emitter(mesh, false, &desc);
    near(lights.power(LightId(0)), 7.0, "first triangle");
    near(lights.power(LightId(1)), 7.0, "second triangle");
    // A projector's power is of its luminance.
    let projection = LightKind::Projection {
        image: ImageId(1),
        fov: 50.0,
        scale: 9.0,
        power: Some(7.0),
        throw: Throw::Intensity,
    };
    let lights = only_light(projection, turned());
    let m = Moments::of((0..50_000).map(|i| {
        let s = lights.sample_emission(FIRST, [0.5; 2], uniform_pair(11, i), 0.0, &L);
        f64::from(s.map_or(0.0, |s| ColorSpace::Srgb.luminance(s.throughput().rgb())))
    }));
    // The description's scale still counts, as in pbrt.
    assert!((m.mean() / 63.0 - 1.0).abs() < 5e-3, "{}", m.mean());
}

/// Straight down is −y, the first horizontal angle +x: a lamp's candela, and its 1 / r².
#[test]
fn a_lamp_shines_as_its_file_says() {
    let folder = format!("{}/../../scenes/lamps", env!("CARGO_MANIFEST_DIR"));
    let path = |name: &str| format!("{folder}/{name}.ies").into();
    let lamp = |name| LightKind::Ies { path: path(name), intensity: white(1.0), power: None };
    let seen = |lights: &Lights, p: [f32; 3]| {
        let s = lights.sample(FIRST, &at(Point(Vec3::from_array(p))), [0.5; 2], &L);
        s.map_or(0.0, |s| s.li.rgb()[1])
    };
    let down = only_light(lamp("downlight"), Transform::IDENTITY);
    assert!((seen(&down, [0.0, -2.0, 0.0]) - 960.0 / 4.0).abs() < 1e-3);
    assert_eq!(seen(&down, [0.0, 2.0, 0.0]), 0.0);
    let wash = only_light(lamp("wall-washer"), Transform::IDENTITY);
    assert!(seen(&wash, [1.0, -0.5, 0.0]) > 10.0 * seen(&wash, [-1.0, -0.5, 0.0]));
    assert!((seen(&wash, [0.5, -0.5, 0.8]) / seen(&wash, [0.5, -0.5, -0.8]) - 1.0).abs() < 1e-5);

    // A file that is none is an error that says where.
    let mut sink = Sink::default();
    let mut builder = LightsBuilder::new(RGB, &picture);
    let kind = LightKind::Ies { path: path("../first-light"), intensity: white(1.0), power: None };
    let world_from_light = AnimatedTransform::fixed(Transform::IDENTITY);
    builder.add_light(&LightDesc { kind, world_from_light, medium: None, span: Span::NONE }, &mut sink);
    assert!(sink.has_errors() && sink.render().contains("first-light.ies"), "{}", sink.render());
}

#[test]
fn light_leaves_the_side_that_pbrt_says() {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let (up, down) = (at(Point::new(0.2, 0.2, 1.0)), at(Point::new(0.2, 0.2, -1.0)));
    let desc = area_desc(false);
    let make = |normals: &[Vec3], flip| {
        let mesh = EmitterGeometry::Mesh { positions: &corners, normals, uvs: &[], indices: &[[0, 1, 2]] };
        only_emitter(mesh, flip, &desc)
    };
    let sees = |lights: &Lights, c: &LightContext| lights.sample(FIRST, c, [0.4, 0.6], &L).is_some();
    let plain = make(&[], false);
    assert!(sees(&plain, &up) && !sees(&plain, &down));
    let flipped = make(&[], true);
    assert!(!sees(&flipped, &up) && sees(&flipped, &down));
    // Shading normals decide where there are some, flip or not.
    for flip in [false, true] {
        let turned = make(&[-Vec3::Z; 3], flip);
        assert!(!sees(&turned, &up) && sees(&turned, &down));
    }
    let both = only_emitter(
        EmitterGeometry::Mesh { positions: &corners, normals: &[], uvs: &[], indices: &[[0, 1, 2]] },
        false,
        &area_desc(true),
    );
    assert!(sees(&both, &up) && sees(&both, &down));
    // A sphere emits outwards, reversed inwards, also where the map swaps hands.
    let t = Transform::scale(DVec3::new(-1.0, 1.0, 1.0)).unwrap();
    let sphere =
        EmitterGeometry::Sphere { radius: 0.5, z: [-0.5, 0.5], phi_max: 360.0, world_from_object: &t };
    let (outside, inside) = (at(Point::new(0.0, 0.0, 2.0)), at(Point::new(0.1, 0.0, 0.0)));
    let out = only_emitter(sphere, false, &desc);
    assert!(sees(&out, &outside) && !sees(&out, &inside));
    let inwards = only_emitter(sphere, true, &desc);
    assert!(!sees(&inwards, &outside) && sees(&inwards, &inside));
}

#[test]
fn an_invisible_lamp_shines_like_a_visible_one() {
    let desc = area_desc(false);
    let mesh = EmitterGeometry::Mesh { positions: &CORNERS, normals: &[], uvs: &[], indices: &[[0, 1, 2]] };
    let mut sink = Sink::default();
    let mut builder = LightsBuilder::new(RGB, &picture);
    builder.add_emitter(
        &EmitterSource { geometry: mesh, flip: false, visible: false, motion: None, desc: &desc },
        &mut sink,
    );
    let hidden = builder.finish(world());
    let shown = only_emitter(mesh, false, &desc);
    assert!(hidden.is_delta(FIRST) && !shown.is_delta(FIRST));
    let context = at(Point::new(0.2, 0.3, 2.0));
    for i in 0..100 {
        let u = uniform_pair(12, i);
        let (a, b) =
            (hidden.sample(FIRST, &context, u, &L).unwrap(), shown.sample(FIRST, &context, u, &L).unwrap());
        assert!(smooth(&a).is_none());
        assert!((estimate(&a, |_| 1.0) / estimate(&b, |_| 1.0) - 1.0).abs() < 1e-5);
    }
}

#[test]
fn an_area_lights_image_stands_upright() {
    // pbrt: v = 1 is the image's top row. Image 1 has 12 × 6 pixels; its row 1 is black.
    let desc = AreaLightDesc { image: Some(ImageId(1)), ..area_desc(false) };
    let flat = rectangle([1.0, 1.0]);
    let patch =
        EmitterGeometry::BilinearMesh { positions: &flat, normals: &[], uvs: &[], indices: &[[0, 1, 2, 3]] };
    let lights = only_emitter(patch, false, &desc);
    let le = |u: f32, v: f32| lights.emitted(FIRST, Dir::Z, Vec2::new(u, v), Dir::Z, &L).rgb()[0];
    assert!(le(0.5, 1.0 - 1.5 / 6.0) < 1e-6 && le(0.5, 1.5 / 6.0) > 0.1);
    assert!((le(2.5 / 12.0, 1.0 - 3.5 / 6.0) - 6.0).abs() < 1e-4);
}

#[test]
fn what_cannot_shine_is_said() {
    let mut sink = Sink::default();
    let mut builder = LightsBuilder::new(RGB, &picture);
    let world_from_light = AnimatedTransform::fixed(Transform::IDENTITY);
    let kind = LightKind::Point { intensity: white(0.0), from: Vec3::ZERO, power: None };
    let black =
        builder.add_light(&LightDesc { kind, world_from_light, medium: None, span: Span::NONE }, &mut sink);
    assert_eq!(sink.diagnostics()[0].message, "this light emits nothing");
    // A mesh keeps the order of its triangles, also of those without area.
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let geometry = EmitterGeometry::Mesh {
        positions: &corners,
        normals: &[],
        uvs: &[],
        indices: &[[0, 0, 1], [0, 1, 2]],
    };
    let desc = area_desc(false);
    let first = builder.add_emitter(
        &EmitterSource { geometry, flip: false, visible: true, motion: None, desc: &desc },
        &mut sink,
    );
    assert_eq!(first, Some(LightId(1)));
    let lights = builder.finish(world());
    assert_eq!((lights.power(black), lights.power(LightId(1))), (0.0, 0.0));
    assert!(lights.sample(LightId(1), &at(Point::new(0.0, 0.0, 1.0)), [0.5; 2], &L).is_none());
    assert!((lights.power(LightId(2)) - 0.5 * PI).abs() < 1e-5);
    assert!(lights.emission_pdf(LightId(1), Point::default(), None, Dir::Z, 0.0).1.is_some());
}
