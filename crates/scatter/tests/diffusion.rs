//! The diffusion profile: all of the albedo leaves, and radii follow their density.

use spectrum::Spectrum;
use steradian_scatter::DiffusionProfile;
use testkit::chi2::{Chi2Settings, chi2_interval};

fn profile() -> DiffusionProfile {
    let albedo = Spectrum::from_rgb([0.9, 0.5, 0.02]);
    DiffusionProfile::new(albedo, Spectrum::from_rgb([0.3, 2.0, 0.01]))
}

/// `∫ 2π r R(r) dr = A`, by the midpoint rule over the square root of the radius.
#[test]
fn what_leaves_is_the_albedo() {
    let p = profile();
    for lane in 0..3 {
        let (n, far) = (200_000, f64::from(p.reach(lane)).sqrt());
        let sum: f64 = (0..n)
            .map(|i| {
                let root = far * (f64::from(i) + 0.5) / f64::from(n);
                let r = root * root;
                let leaving = f64::from(p.eval(r as f32).lanes()[lane]);
                leaving * std::f64::consts::TAU * r * 2.0 * root * far / f64::from(n)
            })
            .sum();
        let albedo = f64::from(p.albedo().lanes()[lane]);
        assert!((sum / albedo - 1.0).abs() < 1e-5, "lane {lane}: {sum} is not {albedo}");
    }
}

#[test]
fn radii_follow_their_density() {
    let p = profile();
    for lane in 0..3 {
        let far = f64::from(p.reach(lane)) * 0.5;
        let settings = Chi2Settings { samples: 200_000, cells: [50, 1], ..Chi2Settings::default() };
        let sample = |u| Some(f64::from(p.sample(lane, u))).filter(|r| *r < far);
        let found =
            chi2_interval([0.0, far], &settings, sample, |r| f64::from(p.pdf(lane, r as f32).value()));
        found.unwrap_or_else(|e| panic!("lane {lane}: {e}"));
    }
}

/// Denser stuff spreads less, and the density per area is that of the radius over its ring.
#[test]
fn densities_are_of_one_profile() {
    let p = profile();
    for r in [0.01_f32, 0.1, 0.5, 3.0] {
        for lane in 0..3 {
            let (length, area) = (p.pdf(lane, r).value(), p.pdf_area(lane, r).value());
            assert!((length - area * std::f32::consts::TAU * r).abs() <= 1e-5 * length);
            let share = p.eval(r).lanes()[lane] / p.albedo().lanes()[lane];
            assert!((share - area).abs() <= 1e-5 * area);
        }
    }
    assert!(p.sample(1, 0.9) > p.sample(0, 0.9) && p.sample(0, 0.9) > p.sample(2, 0.9));
}
