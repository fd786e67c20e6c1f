//! Laws of cameras: rays, importance and their densities agree; light tracing sees what path tracing sees.

#![expect(clippy::unwrap_used, reason = "helpers of tests are tests")]

use math::{AnimatedTransform, DMat4, DVec3, Dir, Frame, Point, Ray, Transform, Vec2, Vec3};
use scene_desc::{ApertureDesc, CameraDesc, CameraKind, SphericalMapping};
use steradian_scene::{Camera, CameraConnection};
use testkit::chi2::uniform_pair;
use testkit::statistics::{Moments, sidak, welch_test};

const RESOLUTION: [u32; 2] = [60, 40];

fn perspective(fov: f32, lens_radius: f32, focal_distance: f32) -> CameraKind {
    CameraKind::Perspective { fov, lens_radius, focal_distance, aperture: ApertureDesc::Disk }
}

/// Every kind of camera, in a place that is neither the origin nor aligned with an axis.
fn cameras() -> Vec<(&'static str, Camera)> {
    let turned = Transform::look_at(DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.2, -0.3, 0.1), DVec3::Y)
        .unwrap()
        .inverse();
    let uneven = turned * Transform::scale(DVec3::new(-1.5, 0.7, 1.2)).unwrap();
    let twice = turned * Transform::scale(DVec3::splat(2.0)).unwrap();
    let hexagon = (0..6).map(|i| {
        let (s, c) = math::trig::sin_cos(i as f32 * std::f32::consts::FRAC_PI_3);
        Vec2::new(c, s)
    });
    let hexagonal = CameraKind::Perspective {
        fov: 45.0,
        lens_radius: 0.3,
        focal_distance: 3.0,
        aperture: ApertureDesc::Polygon(hexagon.collect()),
    };
    let aperture = ApertureDesc::Gaussian;
    let gaussian = CameraKind::Perspective { fov: 45.0, lens_radius: 0.3, focal_distance: 3.0, aperture };
    let make = |kind, t| {
        let desc =
            CameraDesc { kind, world_from_camera: AnimatedTransform::fixed(t), ..CameraDesc::default() };
        Camera::compile(&desc, RESOLUTION).unwrap()
    };
    let spherical = |mapping| CameraKind::Spherical { mapping };
    let orthographic = |lens_radius| CameraKind::Orthographic { lens_radius, focal_distance: 3.0 };
    vec![
        ("pinhole", make(perspective(50.0, 0.0, 1e6), turned)),
        ("pinhole, uneven scale", make(perspective(50.0, 0.0, 1e6), uneven)),
        ("lens", make(perspective(50.0, 0.2, 3.0), turned)),
        ("lens, twice as large", make(perspective(50.0, 0.1, 1.5), twice)),
        ("lens, uneven scale", make(perspective(50.0, 0.1, 1.5), uneven)),
        ("hexagonal lens", make(hexagonal, turned)),
        ("Gaussian lens", make(gaussian, turned)),
        ("orthographic", make(orthographic(0.0), turned)),
        ("orthographic, uneven scale", make(orthographic(0.0), uneven)),
        ("orthographic with lens", make(orthographic(0.2), turned)),
        ("spherical, equal area", make(spherical(SphericalMapping::EqualArea), turned)),
        ("spherical, latitude and longitude", make(spherical(SphericalMapping::EquiRectangular), turned)),
    ]
}

#[test]
fn importance_is_the_inverse_of_ray_generation() {
    for (name, camera) in cameras() {
        for i in 0..500 {
            let [u, v] = uniform_pair(1, i);
            let raster = [u * RESOLUTION[0] as f32, v * RESOLUTION[1] as f32];
            let made = camera.generate_ray(raster, uniform_pair(2, i), 0.5).unwrap();
            assert_eq!(made.weight, 1.0);
            assert!((made.ray.dir.0.length() - 1.0).abs() < 1e-5);
            let (we, found) = camera.importance(&made.ray).unwrap_or_else(|| panic!("{name}: {raster:?}"));
            for a in 0..2 {
                assert!((raster[a] - found[a]).abs() < 2e-2, "{name}: {raster:?} {found:?}");
            }

            // We cos / (p_A p_ω) is the weight of a camera ray: one.
            let (position, direction) = camera.importance_pdf(&made.ray);
            assert_eq!(position.is_none(), camera.is_delta_position(), "{name}");
            assert_eq!(direction.is_none(), camera.is_delta_direction(), "{name}");
            let density = position.map_or(1.0, |p| p.value()) * direction.map_or(1.0, |p| p.value());
            assert!(we > 0.0 && density > 0.0);

            // From a point on the ray back to the lens: the same ray, the same place, the same We.
            let p = made.ray.at(2.0 + u);
            let back = camera.sample_importance(p, made.ray.time, uniform_pair(2, i)).unwrap();
            assert!((back.wi.0 + made.ray.dir.0).length() < 1e-4, "{name}");
            assert!(back.p_lens.distance(made.ray.origin) < 1e-4, "{name}");
            assert!((back.we / we - 1.0).abs() < 1e-3, "{name}: {} {we}", back.we);
            for a in 0..2 {
                assert!((raster[a] - back.raster[a]).abs() < 2e-2, "{name}: {raster:?} {:?}", back.raster);
            }
        }
    }
}

/// A uniform place on the film makes the density of directions `p_ω = 1 / (n_pixels |dω/d raster|)`: the solid angle
/// of a small square of the film, by differences, against the formula.
#[test]
fn directions_follow_their_density() {
    for (name, camera) in cameras() {
        if camera.is_delta_direction() {
            continue;
        }
        for i in 0..300 {
            let [u, v] = uniform_pair(8, i);
            let raster = [1.0 + u * (RESOLUTION[0] - 2) as f32, 1.0 + v * (RESOLUTION[1] - 2) as f32];
            let lens = uniform_pair(9, i);
            let dir = |x: f32, y: f32| {
                camera.generate_ray([raster[0] + x, raster[1] + y], lens, 0.0).unwrap().ray.dir.0.as_dvec3()
            };
            let h = 0.25_f32;
            let solid_angle = (dir(h, 0.0) - dir(-h, 0.0)).cross(dir(0.0, h) - dir(0.0, -h)).length();
            let density = f64::from(4.0 * h * h) / (f64::from(camera.n_pixels()) * solid_angle);
            // Equal-area maps have creases, where differences mean nothing.
            let q = [raster[0] / RESOLUTION[0] as f32 - 0.5, raster[1] / RESOLUTION[1] as f32 - 0.5]
                .map(f32::abs);
            let crease = q[0].min(q[1]).min((q[0] + q[1] - 0.5).abs()) < 0.02;
            if name == "spherical, equal area" && crease {
                continue;
            }
            let ray = camera.generate_ray(raster, lens, 0.0).unwrap().ray;
            let pdf = f64::from(camera.importance_pdf(&ray).1.unwrap().value());
            assert!((pdf / density - 1.0).abs() < 0.02, "{name} {raster:?}: {pdf} {density}");
        }
    }
}

#[test]
fn rays_that_the_camera_does_not_make_have_no_importance() {
    for (name, camera) in cameras().into_iter().take(9) {
        let ray = camera.generate_ray([30.0, 20.0], [0.5; 2], 0.0).unwrap().ray;
        // A pinhole's film ends at half the field of view; a lens' ray further out belongs to no place.
        let frame = Frame::from_normal(ray.dir);
        let aside = Dir::normalize(ray.dir.0 + frame.s * 3.0);
        let (origin, dir) = if camera.is_delta_direction() {
            (ray.origin + frame.s * 9.0, ray.dir)
        } else {
            (ray.origin, aside)
        };
        let stray = Ray::new(origin, dir, 0.0);
        assert!(camera.importance(&stray).is_none(), "{name}");
        let (position, direction) = camera.importance_pdf(&stray);
        assert!(position.is_some_and(|p| !p.is_positive()) || direction.is_some_and(|p| !p.is_positive()));
        if !camera.is_delta_direction() {
            assert!(camera.importance(&Ray::new(ray.origin, -ray.dir, 0.0)).is_none(), "{name}");
        }
    }
}

/// A glowing disk in front of the camera: the mean of the picture by rays from the camera equals the mean by light
/// paths from the disk.
#[test]
fn light_tracing_and_path_tracing_see_the_same_picture() {
    let disk_center = Point::new(0.1, 0.0, 0.3);
    let normal = Dir::normalize(Vec3::new(0.4, 0.5, 0.9));
    let radius = 0.6;
    let area = std::f64::consts::PI * f64::from(radius * radius);
    let frame = Frame::from_normal(normal);
    let kinds = cameras();
    let alpha = sidak(1e-4, kinds.len());
    for (name, camera) in &kinds {
        // Only the left half of the picture counts, so that places on the film matter too.
        let counts = |raster: [f32; 2]| raster[0] < 0.5 * RESOLUTION[0] as f32;
        let n = 200_000;
        let by_rays = Moments::of((0..n).map(|i| {
            let [u, v] = uniform_pair(3, i);
            let raster = [u * RESOLUTION[0] as f32, v * RESOLUTION[1] as f32];
            let ray = camera.generate_ray(raster, uniform_pair(4, i), 0.0).unwrap().ray;
            let t = (disk_center - ray.origin).dot(normal.0) / ray.dir.dot(normal);
            let inside = t > 0.0 && ray.at(t).distance(disk_center) < radius && ray.dir.dot(normal) < 0.0;
            f64::from(u8::from(inside && counts(raster)))
        }));
        let by_light = Moments::of((0..n).map(|i| {
            let d = sampling::warp::concentric_disk(uniform_pair(5, i)) * radius;
            let p = disk_center + frame.s * d.x + frame.t * d.y;
            match camera.sample_importance(p, 0.0, uniform_pair(6, i)) {
                Some(CameraConnection { wi, raster, weight, .. }) if counts(raster) => {
                    area * f64::from(wi.dot(normal).max(0.0) * weight)
                }
                _ => 0.0,
            }
        }));
        assert!(by_rays.mean() > 1e-3, "{name}: the disk is out of sight");
        welch_test(&by_rays, &by_light)
            .assert_consistent(alpha, &format!("{name}: {} {}", by_rays.mean(), by_light.mean()));
    }
}

#[test]
fn the_density_of_a_connection_is_that_of_the_lens() {
    // ∫ over the lens: the share of lens points as seen from a point has density r² / (A cos).
    let (_, camera) = cameras().swap_remove(2);
    let p = Point::new(0.3, 0.2, 0.1);
    for i in 0..100 {
        let Some(c) = camera.sample_importance(p, 0.0, uniform_pair(7, i)) else { continue };
        let cos = c.n_lens.unwrap().abs_dot(c.wi);
        let expected = p.distance_squared(c.p_lens) / (std::f32::consts::PI * 0.04 * cos);
        let pdf = c.pdf.unwrap().value();
        assert!((pdf / expected - 1.0).abs() < 1e-3);
        assert!((c.weight / (c.we / pdf) - 1.0).abs() < 1e-4);
    }
}

#[test]
fn field_of_view_aspect_and_window_follow_pbrt() {
    let camera = |desc: CameraDesc| Camera::compile(&desc, [200, 100]).unwrap();
    let dir = |c: &Camera, x, y| c.generate_ray([x, y], [0.5; 2], 0.0).unwrap().ray.dir.0;
    let desc = CameraDesc { kind: perspective(90.0, 0.0, 1e6), ..CameraDesc::default() };

    // The shorter side, here the height, spans the field of view; y points down; the centre looks along +z.
    let c = camera(desc.clone());
    assert!((dir(&c, 100.0, 0.0) - Vec3::new(0.0, 1.0, 1.0).normalize()).length() < 1e-6);
    assert!((dir(&c, 200.0, 50.0) - Vec3::new(2.0, 0.0, 1.0).normalize()).length() < 1e-6);
    assert!((dir(&c, 100.0, 50.0) - Vec3::Z).length() < 1e-6);

    // A tall frame on a wide film: the width is the shorter side and pixels are not square.
    let c = camera(CameraDesc { frame_aspect_ratio: Some(0.5), ..desc.clone() });
    assert!((dir(&c, 200.0, 50.0) - Vec3::new(1.0, 0.0, 1.0).normalize()).length() < 1e-6);
    assert!((dir(&c, 100.0, 100.0) - Vec3::new(0.0, -2.0, 1.0).normalize()).length() < 1e-6);

    let c = camera(CameraDesc { screen_window: Some([0.0, 1.0, -0.5, 0.5]), ..desc.clone() });
    assert!((dir(&c, 0.0, 0.0) - Vec3::new(0.0, 0.5, 1.0).normalize()).length() < 1e-6);

    // pbrt's spherical cameras: y is up, the picture's top row looks up.
    let kind = CameraKind::Spherical { mapping: SphericalMapping::EquiRectangular };
    let c = camera(CameraDesc { kind, ..desc.clone() });
    assert!((dir(&c, 0.0, 0.0) - Vec3::Y).length() < 1e-6);
    assert!((dir(&c, 0.0, 50.0) - Vec3::X).length() < 1e-6);
    assert!((dir(&c, 50.0, 50.0) - Vec3::Z).length() < 1e-6);

    // Nonsense is refused.
    assert!(
        Camera::compile(&CameraDesc { kind: perspective(180.0, 0.0, 1.0), ..desc.clone() }, [4, 4]).is_none()
    );
    assert!(Camera::compile(&CameraDesc { screen_window: Some([0.0; 4]), ..desc }, [4, 4]).is_none());
}

#[test]
fn a_moving_camera_is_where_it_is_at_the_rays_time() {
    let end = Transform::translate(DVec3::new(2.0, 0.0, 0.0));
    let desc = CameraDesc {
        world_from_camera: AnimatedTransform::new(Transform::IDENTITY, end, [0.0, 1.0]),
        shutter_open: 0.5,
        shutter_close: 1.0,
        ..CameraDesc::default()
    };
    let camera = Camera::compile(&desc, RESOLUTION).unwrap();
    let ray = camera.generate_ray([30.0, 20.0], [0.5; 2], 0.5).unwrap().ray;
    assert!((ray.time - 0.75).abs() < 1e-6 && ray.origin.distance(Point::new(1.5, 0.0, 0.0)) < 1e-5);
    let back = camera.sample_importance(Point::new(1.5, 0.0, 4.0), 0.75, [0.5; 2]).unwrap();
    assert!((back.raster[0] - 30.0).abs() < 1e-3 && (back.raster[1] - 20.0).abs() < 1e-3);
}

#[test]
fn a_footprint_is_an_eighth_of_the_distance_between_pixels() {
    let desc = CameraDesc { kind: perspective(20.0, 0.0, 1e6), ..CameraDesc::default() };
    let camera = Camera::compile(&desc, [400, 400]).unwrap();
    // A plane across the view at z = 5: pixels are 10 tan(10°) / 400 apart; the least differential, at the
    // corner of the film, is smaller by the cosine squared there at most.
    let f = camera.approximate_footprint(Point::new(0.0, 0.0, 5.0), Dir(-Vec3::Z), 0.0);
    let apart = 10.0 * math::trig::tan(10.0_f32.to_radians()) / 400.0 / 8.0;
    for d in [f.dpdx, f.dpdy] {
        assert!(d.length() < apart * 1.001 && d.length() > apart * 0.93, "{d:?} {apart}");
        assert!(d.z.abs() < 1e-4 * d.length());
    }
    // Tilted by 60°, the footprint is longer along the tilt and stays in the plane.
    let n = Dir::normalize(Vec3::new(3.0_f32.sqrt(), 0.0, -1.0));
    let g = camera.approximate_footprint(Point::new(0.0, 0.0, 5.0), n, 0.0);
    assert!(g.dpdx.dot(n.0).abs() < 1e-3 * g.dpdx.length());
    assert!((g.dpdx.length() / f.dpdx.length() - 2.0).abs() < 0.02);
    // The mapped size follows a camera that is scaled.
    let scaled = Transform::from_matrix(DMat4::from_scale(DVec3::splat(3.0))).unwrap();
    let desc = CameraDesc { world_from_camera: AnimatedTransform::fixed(scaled), ..desc };
    let camera = Camera::compile(&desc, [400, 400]).unwrap();
    let h = camera.approximate_footprint(Point::new(0.0, 0.0, 5.0), Dir(-Vec3::Z), 0.0);
    assert!((h.dpdx.length() / f.dpdx.length() - 1.0).abs() < 1e-3);
}
