//! Every warp draws from the density that it claims (chi-squared), and its inverse leads back.

use std::f64::consts::TAU;

use math::{Dir, LocalDir, Point, Vec2, Vec3};
use steradian_sampling::distribution::{PiecewiseConstant1D, PiecewiseConstant2D};
use steradian_sampling::warp::{self, Rectangle, SphericalTriangle};
use testkit::chi2::{Chi2, Chi2Settings, chi2_interval, chi2_rectangle, chi2_sphere, uniform_pair};

fn settings(seed: u64) -> Chi2Settings {
    Chi2Settings { seed, ..Chi2Settings::default() }
}

fn unit(w: [f64; 3]) -> Vec3 {
    Vec3::new(w[0] as f32, w[1] as f32, w[2] as f32)
}

fn double(v: Vec3) -> [f64; 3] {
    [f64::from(v.x), f64::from(v.y), f64::from(v.z)]
}

/// Panics with what the test found.
fn passes(result: Result<Chi2, String>) {
    if let Err(e) = result {
        panic!("{e}");
    }
}

fn check_sphere(seed: u64, sample: impl Fn([f32; 2]) -> Vec3, pdf: impl Fn(Vec3) -> f32) {
    passes(chi2_sphere(&settings(seed), |u| Some(double(sample(u))), |w| f64::from(pdf(unit(w)))));
}

fn check_line(domain: [f64; 2], sample: impl Fn(f32) -> f32, pdf: impl Fn(f32) -> f32) {
    let pdf = |x: f64| f64::from(pdf(x as f32));
    passes(chi2_interval(domain, &settings(1), |u| Some(f64::from(sample(u))), pdf));
}

fn check_inverse(tolerance: f32, round_trip: impl Fn([f32; 2]) -> [f32; 2]) {
    for i in 0..20_000 {
        let u = uniform_pair(99, i);
        let v = round_trip(u);
        let error = (u[0] - v[0]).abs().max((u[1] - v[1]).abs());
        assert!(error < tolerance, "{u:?} came back as {v:?}");
    }
}

#[test]
fn the_disk_is_uniform() {
    // Polar: area is r dr dφ.
    let sample = |u| {
        let p = warp::concentric_disk(u);
        let phi = libm::atan2(f64::from(p.y), f64::from(p.x));
        Some([f64::from(p.length()), if phi < 0.0 { phi + TAU } else { phi }])
    };
    let pdf = |r: f64, _| r * f64::from(warp::concentric_disk_pdf(Vec2::new(r as f32, 0.0)).value());
    chi2_rectangle([[0.0, 1.0], [0.0, TAU]], &settings(0), sample, pdf).unwrap();
    check_inverse(2e-6, |u| warp::concentric_disk_inverse(warp::concentric_disk(u)));
}

#[test]
fn the_sphere_and_its_caps_are_uniform() {
    check_sphere(2, |u| warp::uniform_sphere(u).0, |_| warp::uniform_sphere_pdf().value());
    check_sphere(3, |u| warp::uniform_hemisphere(u).0, |w| warp::uniform_hemisphere_pdf(LocalDir(w)).value());
    for h in [0.25, 0.6, 1.4] {
        check_sphere(4, |u| warp::uniform_cone(u, h).0, |w| warp::uniform_cone_pdf(LocalDir(w), h).value());
        check_inverse(2e-4, |u| warp::uniform_cone_inverse(warp::uniform_cone(u, h), h));
    }
    check_inverse(2e-6, |u| warp::uniform_hemisphere_inverse(warp::uniform_hemisphere(u)));
}

#[test]
fn the_cone_of_the_sun_keeps_its_bits() {
    // Half-angle 0.2665°: sin² of it is 2.16e-5, and heights are uniform down to the smallest.
    let h = 1.081_724e-5;
    chi2_interval(
        [0.0, 1.0],
        &settings(5),
        |u| {
            let w = warp::uniform_cone([u, 0.377], h);
            assert!(warp::uniform_cone_pdf(w, h).is_positive());
            // The first coordinate moves through the square; the signed radius along its row is nearly u itself.
            Some(f64::from(warp::uniform_cone_inverse(w, h)[0]))
        },
        |_| 1.0,
    )
    .unwrap();
    check_inverse(1e-5, |u| warp::uniform_cone_inverse(warp::uniform_cone(u, h), h));
}

#[test]
fn the_hemisphere_is_cosine_weighted() {
    check_sphere(6, |u| warp::cosine_hemisphere(u).0, |w| warp::cosine_hemisphere_pdf(LocalDir(w)).value());
    check_inverse(2e-6, |u| warp::cosine_hemisphere_inverse(warp::cosine_hemisphere(u)));
}

#[test]
fn the_octahedral_sphere_is_uniform_and_continuous() {
    check_sphere(7, |u| warp::equal_area_sphere(u).0, |_| warp::equal_area_sphere_pdf().value());
    check_inverse(1e-6, |u| warp::equal_area_sphere_inverse(warp::equal_area_sphere(u)));
    // The layout: +z in the middle, +x to the right, +y up the second axis, −z in the corners.
    for (u, w) in [
        ([0.5, 0.5], Vec3::Z),
        ([1.0, 0.5], Vec3::X),
        ([0.5, 1.0], Vec3::Y),
        ([0.0, 0.5], Vec3::NEG_X),
        ([1.0, 1.0], Vec3::NEG_Z),
        ([0.0, 1.0], Vec3::NEG_Z),
    ] {
        assert!((warp::equal_area_sphere(u).0 - w).length() < 1e-6, "{u:?}");
    }
    // Texels beyond an edge are neighbours on the sphere.
    let n = 64;
    let at = |p: [i32; 2]| warp::equal_area_sphere(p.map(|x| (x as f32 + 0.5) / n as f32)).0;
    for i in 0..n {
        for (inside, outside) in
            [([0, i], [-1, i]), ([n - 1, i], [n, i]), ([i, 0], [i, -1]), ([i, n - 1], [i, n])]
        {
            assert!((at(inside) - at(warp::wrap_equal_area(outside, n))).length() < 0.08, "{inside:?}");
        }
    }
}

#[test]
fn the_triangle_is_uniform() {
    let sample = |u| {
        let b = warp::uniform_triangle(u);
        assert!((b[0] + b[1] + b[2] - 1.0).abs() < 1e-6 && b.iter().all(|&x| x >= 0.0));
        Some([f64::from(b[0]), f64::from(b[1])])
    };
    // Barycentric coordinates fill half of the unit square.
    let pdf =
        |x: f64, y: f64| if x + y <= 1.0 { f64::from(warp::uniform_triangle_pdf(0.5).value()) } else { 0.0 };
    chi2_rectangle([[0.0, 1.0]; 2], &Chi2Settings { cells: [20, 20], ..settings(8) }, sample, pdf).unwrap();
    check_inverse(1e-6, |u| warp::uniform_triangle_inverse(warp::uniform_triangle(u)));
}

#[test]
fn lines_follow_their_densities() {
    for (a, b) in [(1.0, 3.0), (0.0, 2.0), (5.0, 0.0), (1.0, 1.0), (0.0, 0.0), (1e-30, 1e-30), (1e30, 1e30)] {
        check_line([0.0, 1.0], |u| warp::linear(u, a, b), |x| warp::linear_pdf(x, a, b).value());
        check_inverse(1e-6, |u| [warp::linear_inverse(warp::linear(u[0], a, b), a, b), u[1]]);
    }
    check_line([-2.0, 2.0], |u| warp::tent(u, 2.0), |x| warp::tent_pdf(x, 2.0).value());
    check_inverse(1e-6, |u| [warp::tent_inverse(warp::tent(u[0], 2.0), 2.0), u[1]]);
    // The longest path of 24 bits is ln 2²⁴ / σ.
    check_line([0.0, 8.4], |u| warp::exponential(u, 2.0), |x| warp::exponential_pdf(x, 2.0).value());
    check_inverse(1e-6, |u| [warp::exponential_inverse(warp::exponential(u[0], 2.0), 2.0), u[1]]);
    for (sigma, max) in [(2.0, 0.7), (30.0, 1.5), (1e-6, 4.0)] {
        check_line(
            [0.0, f64::from(max)],
            |u| warp::truncated_exponential(u, sigma, max),
            |x| warp::truncated_exponential_pdf(x, sigma, max).value(),
        );
        check_inverse(2e-6, |u| {
            let x = warp::truncated_exponential(u[0], sigma, max);
            [warp::truncated_exponential_inverse(x, sigma, max), u[1]]
        });
    }
    // A light beside, before and far behind the piece, almost on it, and far from a short one.
    for ([lo, hi], h) in
        [([-1.0, 2.0], 0.5), ([0.3, 1.0], 0.2), ([-9.0, -8.0], 3.0), ([-2.0, 2.0], 0.02), ([30.0, 31.0], 7.0)]
    {
        let line = warp::Equiangular::new([lo, hi], h);
        check_line([f64::from(lo), f64::from(hi)], |u| line.sample(u), |x| line.pdf(x).value());
        check_inverse(1e-3, |u| [line.inverse(line.sample(u[0])), u[1]]);
    }
    // Without an end: 1 − atan(100) / (π/2) of all is beyond 100.
    let endless = warp::Equiangular::new([0.0, f32::INFINITY], 1.0);
    let most = 0.993_634_1;
    check_line([0.0, 100.0], |u| endless.sample(u * most), |x| endless.pdf(x).value() / most);
    check_inverse(1e-6, |u| [endless.inverse(endless.sample(u[0])), u[1]]);
    for exponent in [-2.5, -1.0, 0.0, 1.0, 3.0] {
        let range = [0.5, 4.0];
        check_line(
            [0.5, 4.0],
            |u| warp::power_law(u, range, exponent),
            |x| warp::power_law_pdf(x, range, exponent).value(),
        );
        check_inverse(3e-6, |u| {
            [warp::power_law_inverse(warp::power_law(u[0], range, exponent), range, exponent), u[1]]
        });
    }
}

#[test]
fn bilinear_patches_follow_their_densities() {
    for w in [[1.0, 2.0, 3.0, 4.0], [0.0, 0.0, 0.0, 1.0], [0.0, 1.0, 1.0, 0.0], [0.0; 4]] {
        let sample = |u| Some(warp::bilinear(u, w).map(f64::from));
        let pdf = |x: f64, y: f64| f64::from(warp::bilinear_pdf([x as f32, y as f32], w).value());
        chi2_rectangle([[0.0, 1.0]; 2], &settings(9), sample, pdf).unwrap();
        check_inverse(2e-5, |u| warp::bilinear_inverse(warp::bilinear(u, w), w));
    }
}

#[test]
fn tables_follow_their_densities() {
    let values: Vec<f32> = (0..60).map(|i| if i / 10 == 2 { 0.0 } else { (i % 7) as f32 }).collect();
    let d = PiecewiseConstant2D::new(&values, 10).unwrap();
    let sample = |u| {
        let s = d.sample(u);
        assert_eq!(s.pdf, d.pdf(s.p));
        Some(s.p.map(f64::from))
    };
    let pdf = |x: f64, y: f64| f64::from(d.pdf([x as f32, y as f32]).value());
    chi2_rectangle([[0.0, 1.0]; 2], &Chi2Settings { cells: [20, 18], ..settings(10) }, sample, pdf).unwrap();
    check_inverse(2e-6, |u| d.inverse(d.sample(u).p));
    let line = PiecewiseConstant1D::new(&values).unwrap();
    check_line([0.0, 1.0], |u| line.sample(u).x, |x| line.pdf(x).value());
}

/// Distance of a direction from a plane through the origin decides whether it is inside a spherical triangle.
fn inside(corners: [Vec3; 3], w: Vec3) -> bool {
    let [a, b, c] = corners;
    let s = [a.cross(b).dot(w), b.cross(c).dot(w), c.cross(a).dot(w)];
    s.iter().all(|&x| x >= 0.0) || s.iter().all(|&x| x <= 0.0)
}

#[test]
fn directions_to_a_triangle_are_uniform_in_solid_angle() {
    let from = Point::new(0.1, -0.2, 0.3);
    for corners in [
        [Vec3::new(1.0, 0.2, 1.0), Vec3::new(-0.3, 1.0, 0.8), Vec3::new(0.1, -1.0, 1.2)],
        [Vec3::new(5.0, 0.0, 0.2), Vec3::new(-3.0, 4.0, 0.3), Vec3::new(-3.0, -4.0, -0.4)],
    ] {
        let seen = corners.map(|c| c - from.0);
        let t = SphericalTriangle::new(corners.map(Point), from).unwrap();
        let pdf = |w: Vec3| if inside_cone(seen, w) { t.pdf().value() } else { 0.0 };
        check_sphere(11, |u| t.sample(u).direction.0, pdf);
        check_inverse(2e-4, |u| t.inverse(t.sample(u).direction));
        for i in 0..1000 {
            let s = t.sample(uniform_pair(1, i));
            let [b0, b1] = s.coordinates;
            let p = corners[0] * b0 + corners[1] * b1 + corners[2] * (1.0 - b0 - b1);
            assert!((Dir::normalize(p - from.0).0 - s.direction.0).length() < 1e-5);
        }
    }
}

/// Inside the triangle, and not opposite to it.
fn inside_cone(corners: [Vec3; 3], w: Vec3) -> bool {
    let [a, b, c] = corners;
    // The ray along w meets the plane in front.
    let n = (b - a).cross(c - a);
    inside(corners, w) && n.dot(a) * n.dot(w) > 0.0
}

#[test]
fn small_far_triangles_are_sampled_as_evenly_as_flat_ones() {
    // A triangle of a millimetre at a kilometre: area sampling and solid angle sampling are the same thing there.
    let corners = [Vec3::new(1000.0, 0.0, 0.0), Vec3::new(1000.0, 0.002, 0.0), Vec3::new(1000.0, 0.0, 0.001)];
    let t = SphericalTriangle::new(corners.map(Point), Point::new(0.0, 0.0, 0.0)).unwrap();
    assert!((t.solid_angle() / 1e-12 - 1.0).abs() < 1e-5, "{}", t.solid_angle());
    let sample = |u| Some(t.sample(u).coordinates.map(f64::from));
    let pdf = |x: f64, y: f64| if x + y <= 1.0 { 2.0 } else { 0.0 };
    chi2_rectangle([[0.0, 1.0]; 2], &Chi2Settings { cells: [20, 20], ..settings(12) }, sample, pdf).unwrap();
}

#[test]
fn directions_to_a_rectangle_are_uniform_in_solid_angle() {
    let (corner, edges) = (Vec3::new(-0.4, -0.5, 0.7), [Vec3::new(1.5, 0.0, 0.3), Vec3::new(0.0, 2.0, 0.0)]);
    for from in [Vec3::ZERO, Vec3::new(2.0, 1.0, 0.2), Vec3::new(0.0, 0.3, 3.0)] {
        let r = Rectangle::new(Point(corner), edges).unwrap();
        let r = r.seen_from(Point(from)).unwrap();
        let n = edges[0].cross(edges[1]);
        let pdf = |w: Vec3| {
            let t = (corner - from).dot(n) / w.dot(n);
            let d = from + w * t - corner;
            let on = |e: Vec3| (0.0..=1.0).contains(&(d.dot(e) / e.length_squared()));
            if t > 0.0 && on(edges[0]) && on(edges[1]) { r.pdf().value() } else { 0.0 }
        };
        check_sphere(13, |u| r.sample(u).direction.0, pdf);
        check_inverse(2e-4, |u| r.inverse(r.sample(u).direction));
        for i in 0..1000 {
            let s = r.sample(uniform_pair(2, i));
            let p = corner + edges[0] * s.coordinates[0] + edges[1] * s.coordinates[1];
            assert!((Dir::normalize(p - from).0 - s.direction.0).length() < 1e-5);
        }
    }
}

#[test]
fn solid_angles_are_those_of_closed_forms() {
    // An octant; a face of a cube seen from its middle; edge-on.
    let octant = SphericalTriangle::new([Vec3::X, Vec3::Y, Vec3::Z].map(Point), Point(Vec3::ZERO)).unwrap();
    assert!((f64::from(octant.solid_angle()) - TAU / 4.0).abs() < 1e-6);
    let edges = [Vec3::new(2.0, 0.0, 0.0), Vec3::new(0.0, 2.0, 0.0)];
    let face = Rectangle::new(Point::new(-1.0, -1.0, -1.0), edges).unwrap();
    let face = face.seen_from(Point(Vec3::ZERO)).unwrap();
    assert!((f64::from(face.solid_angle()) - TAU / 3.0).abs() < 1e-6);
    let beside = Rectangle::new(Point::new(-1.0, -1.0, 0.0), edges).unwrap();
    assert!(
        beside.seen_from(Point(Vec3::ZERO)).is_none()
            && beside.seen_from(Point::new(5.0, 0.0, 0.0)).is_none()
    );
    let flat = [Vec3::X, Vec3::Y, Vec3::new(-1.0, -2.0, 0.0)].map(Point);
    assert!(SphericalTriangle::new(flat, Point::new(3.0, 3.0, 0.0)).is_none());
}

/// From the middle above a square of half-size a at height h: Ω = 4 asin(a² / (a² + h²)); from far away and from close above.
#[test]
fn a_squares_solid_angle_keeps_its_bits_near_and_far() {
    let edges = [Vec3::new(2.0, 0.0, 0.0), Vec3::new(0.0, 2.0, 0.0)];
    let square = Rectangle::new(Point::new(-1.0, -1.0, 0.0), edges).unwrap();
    for h in [1e-3_f64, 0.02, 0.5, 1.0, 3.0, 40.0, 1e3, 1e4] {
        let seen = square.seen_from(Point::new(0.0, 0.0, h as f32)).unwrap();
        let h = f64::from(h as f32);
        let truth = 4.0 * libm::asin(1.0 / (1.0 + h * h));
        let found = f64::from(seen.solid_angle());
        assert!((found / truth - 1.0).abs() < 3e-7, "{h}: {found} {truth}");
        for i in 0..200 {
            let u = uniform_pair(3, i);
            let s = seen.sample(u);
            assert_eq!(s.coordinates, seen.coordinates(u));
            let back = seen.inverse(s.direction);
            assert!((back[0] - u[0]).abs() < 1e-3 && (back[1] - u[1]).abs() < 1e-3, "{h} {u:?} {back:?}");
        }
    }
    // From below the plane of the square and beside it, at grazing angles.
    for from in [[3.0, 0.4, 1e-3], [1.0, 1.0, -0.2], [-7.0, 5.0, 1e-2]] {
        let seen = square.seen_from(Point::new(from[0], from[1], from[2])).unwrap();
        let n = 400;
        let at = |i: u32| -1.0 + (f64::from(i) + 0.5) * 2.0 / f64::from(n);
        let [x, y, z] = from.map(f64::from);
        let cell = |i, j| {
            let d2 = (at(i) - x).powi(2) + (at(j) - y).powi(2) + z * z;
            z.abs() / (d2 * d2.sqrt())
        };
        let sum: f64 = (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).map(|(i, j)| cell(i, j)).sum();
        let truth = sum * 4.0 / f64::from(n * n);
        assert!((f64::from(seen.solid_angle()) / truth - 1.0).abs() < 2e-3, "{from:?} {truth}");
    }
}
