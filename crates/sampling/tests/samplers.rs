//! Samplers: nets, convergence, uniformity and independence.
//!
//! Significance: 1e-6 for each single test, with fixed seeds.

use steradian_sampling::{Sampler, SamplerKind};
use testkit::chi2::chi2_counts;
use testkit::statistics::{Moments, ks_test, log_log_slope, t_test};

const ALPHA: f64 = 1e-6;

fn sobol(seed: u64) -> Sampler {
    Sampler::new(SamplerKind::Sobol, seed)
}

/// Is each of the 2^k elementary intervals of every shape hit exactly once?
fn assert_net(points: &[[f32; 2]], what: &str) {
    let k = points.len().ilog2();
    for a in 0..=k {
        let mut hits = vec![0; points.len()];
        for p in points {
            let x = (f64::from(p[0]) * f64::from(1 << a)) as usize;
            let y = (f64::from(p[1]) * f64::from(1 << (k - a))) as usize;
            hits[x << (k - a) | y] += 1;
        }
        assert!(hits.iter().all(|&h| h == 1), "{what}: intervals of 2^-{a} by 2^-{}", k - a);
    }
}

#[test]
fn every_pair_of_every_block_is_a_net() {
    let mut s = sobol(11);
    for k in 0..=9_u32 {
        for block in [0, 1, 5] {
            for dimension in [0, 1, 2, 7, 100] {
                let points: Vec<[f32; 2]> = (0..1 << k)
                    .map(|i| {
                        s.start([3, -2], block << k | i);
                        s.set_dimension(dimension);
                        s.next_2d()
                    })
                    .collect();
                assert_net(&points, &format!("block {block} of 2^{k}, dimension {dimension}"));
            }
        }
    }
}

#[test]
fn single_numbers_are_nets_too() {
    let mut s = sobol(12);
    for k in [0, 3, 8, 12_u32] {
        let mut hits = vec![0; 1 << k];
        for i in 0..1 << k {
            s.start([0, 0], 1 << k | i);
            s.set_dimension(3);
            hits[(s.next_1d() * (1 << k) as f32) as usize] += 1;
        }
        assert!(hits.iter().all(|&h| h == 1));
    }
}

#[test]
fn light_paths_of_one_pass_form_a_net_and_passes_differ() {
    let mut s = sobol(13);
    let mut pass = |p: u32, first: u64| -> Vec<[f32; 2]> {
        (first..first + 256)
            .map(|i| {
                s.start_path(i, p);
                s.next_2d()
            })
            .collect()
    };
    let (a, b) = (pass(0, 0), pass(1, 0));
    assert_net(&a, "pass 0");
    assert_net(&b, "pass 1");
    assert_net(&pass(0, 512), "paths 512..768");
    assert_net(&pass(0, 3 << 32), "paths from 3·2³² on");
    assert!(a.iter().zip(&b).all(|(a, b)| a != b));
}

type Integrand = (&'static str, fn(f64, f64) -> f64, f64);

/// Ground truth, sec. 11.
fn integrands() -> [Integrand; 5] {
    let e = std::f64::consts::E;
    let erf = math::trig::f64::erf(1.0);
    [
        ("smooth", |x, y| x * x + x * y + libm::exp(y), 1.0 / 3.0 + 0.25 + e - 1.0),
        ("gaussian", |x, y| libm::exp(-x * x - y * y), std::f64::consts::PI / 4.0 * erf * erf),
        ("product", |x, y| x * y, 0.25),
        ("disk", |x, y| f64::from(u8::from(x * x + y * y < 2.0 / std::f64::consts::PI)), 0.5),
        ("triangle", |x, y| f64::from(u8::from(y > x)), 0.5),
    ]
}

/// Slope of the RMSE over 16, 64, …, 4096 samples, and the last of them.
fn convergence(make: impl Fn(u32) -> Sampler, (_, f, truth): Integrand) -> (f64, f64) {
    const REPEATS: i32 = 400;
    let counts: Vec<u32> = (2..=6).map(|k| 4_u32.pow(k)).collect();
    let errors: Vec<(f64, f64)> = counts
        .iter()
        .map(|&n| {
            let mut s = make(n);
            let squares: f64 = (0..REPEATS)
                .map(|r| {
                    let sum: f64 = (0..n)
                        .map(|i| {
                            s.start([r, 77], i);
                            let [x, y] = s.next_2d();
                            f(f64::from(x), f64::from(y))
                        })
                        .sum();
                    (sum / f64::from(n) - truth).powi(2)
                })
                .sum();
            (f64::from(n), (squares / f64::from(REPEATS)).sqrt())
        })
        .collect();
    (log_log_slope(&errors), errors[4].1)
}

#[test]
fn owen_scrambled_points_converge_at_the_known_rates() {
    // RMSE at 4096 as measured in the ground truth, for the smooth integrand and the disk.
    let last = [Some(4.13e-6), None, None, Some(7.62e-4), None];
    for (i, f) in integrands().into_iter().enumerate() {
        let (slope, rmse) = convergence(|_| sobol(1), f);
        let window = if i < 3 { -1.65..=-1.3 } else { -0.85..=-0.65 };
        assert!(window.contains(&slope), "{}: slope {slope}", f.0);
        if let Some(truth) = last[i] {
            // 400 squares of errors with tails: their mean is known to about 5 %.
            assert!((rmse / truth - 1.0).abs() < 0.2, "{}: {rmse}", f.0);
        }
    }
}

#[test]
fn independent_and_stratified_points_converge_at_the_known_rates() {
    for (i, f) in integrands().into_iter().enumerate() {
        let (slope, _) = convergence(|_| Sampler::new(SamplerKind::Independent, 2), f);
        assert!((-0.56..=-0.44).contains(&slope), "{}: slope {slope}", f.0);
        let stratified = |n: u32| Sampler::new(SamplerKind::Stratified { x: n.isqrt(), y: n.isqrt() }, 3);
        let (slope, _) = convergence(stratified, f);
        let window = if i < 3 { -1.1..=-0.9 } else { -0.85..=-0.65 };
        assert!(window.contains(&slope), "{}: slope {slope}", f.0);
    }
}

const KINDS: [SamplerKind; 3] =
    [SamplerKind::Sobol, SamplerKind::Independent, SamplerKind::Stratified { x: 4, y: 4 }];

#[test]
fn one_number_is_uniform_over_pixels() {
    // For unbiasedness each number alone must be uniform over the randomisation.
    for kind in KINDS {
        let mut s = Sampler::new(kind, 4);
        for (pass, dimension) in [(0, 0), (1, 0), (5, 3), (1000, 17)] {
            for component in 0..3 {
                let mut numbers: Vec<f64> = (0..40_000)
                    .map(|i| {
                        s.start([i % 200, i / 200], pass);
                        s.set_dimension(dimension);
                        f64::from(if component < 2 { s.next_2d()[component] } else { s.next_1d() })
                    })
                    .collect();
                assert!(numbers.iter().all(|x| (0.0..1.0).contains(x)));
                let what = format!("{kind:?}, pass {pass}, dimension {dimension}.{component}");
                t_test(&Moments::of(numbers.iter().copied()), 0.5).assert_consistent(ALPHA, &what);
                ks_test(&mut numbers, |x| x).assert_consistent(ALPHA, &what);
            }
        }
    }
}

/// Counts pairs of numbers in a grid of 32 × 32.
fn assert_independent(pairs: impl Iterator<Item = (f32, f32)>, what: &str) {
    let mut counts = vec![0_u64; 1024];
    let mut n = 0.0;
    for (x, y) in pairs {
        counts[(x * 32.0) as usize * 32 + (y * 32.0) as usize] += 1;
        n += 1.0;
    }
    if let Err(e) = chi2_counts(&counts, &vec![n / 1024.0; 1024], ALPHA) {
        panic!("{what}: {e}");
    }
}

#[test]
fn padded_dimensions_are_independent() {
    // Within the passes of one pixel: shuffled sequences may be more even than chance, never less.
    for kind in KINDS {
        let mut s = Sampler::new(kind, 5);
        let n = 1 << 14;
        let mut table: Vec<Vec<f32>> = vec![Vec::new(); 9];
        for i in 0..n {
            s.start([640, 360], i as u32);
            for k in 0..3 {
                let [a, b] = s.next_2d();
                table[3 * k].push(a);
                table[3 * k + 1].push(b);
                table[3 * k + 2].push(s.next_1d());
            }
        }
        for a in 0..9 {
            for b in 0..a {
                let pairs = table[a].iter().copied().zip(table[b].iter().copied());
                assert_independent(pairs, &format!("{kind:?}: numbers {a} and {b}"));
            }
        }
    }
}

#[test]
fn few_samples_of_padded_dimensions_are_independent_over_pixels() {
    // The order in which two pairs run through their points must not be related, from the first points on.
    let mut s = sobol(6);
    for pass in 0..8 {
        let mut pairs = Vec::new();
        for i in 0..30_000 {
            s.start([i % 173, i / 173], pass);
            let a = s.next_2d();
            let first = s.next_2d();
            s.start([i % 173, i / 173], pass + 1);
            let b = s.next_2d();
            pairs.push((a, first, b));
        }
        for c in 0..2 {
            assert_independent(pairs.iter().map(|p| (p.0[c], p.1[c])), &format!("pads, pass {pass}"));
            assert_independent(pairs.iter().map(|p| (p.0[0], p.0[1])), &format!("pair, pass {pass}"));
            if pass % 2 == 1 {
                // Passes 2k and 2k+1 lie in opposite halves; 2k+1 and 2k+2 need not.
                assert_halves(&pairs.iter().map(|p| (p.0[c], p.2[c])).collect::<Vec<_>>());
            }
        }
        // Neighbouring pixels.
        assert_independent(
            pairs.windows(2).step_by(2).map(|w| (w[0].0[0], w[1].0[0])),
            &format!("neighbours, pass {pass}"),
        );
    }
}

/// Means of the product of two centred numbers: stratification may make it negative, nothing may make it positive.
fn assert_halves(pairs: &[(f32, f32)]) {
    let m = Moments::of(pairs.iter().map(|p| f64::from(p.0 - 0.5) * f64::from(p.1 - 0.5)));
    assert!(m.mean() < 5.0 * m.std_error(), "{} ± {}", m.mean(), m.std_error());
}

#[test]
fn randomisations_are_independent_estimates() {
    // The mean over R scrambles, with the spread between them, covers the truth as a t interval should.
    let (r, per) = (8, 64);
    let mut outside = 0;
    for pixel in 0..1000 {
        let mut s = sobol(7).with_randomisations(r);
        let mut sums = vec![0.0; r as usize];
        for pass in 0..r * per {
            s.start([pixel, 0], pass);
            let [x, y] = s.next_2d();
            sums[(pass % r) as usize] += f64::from(x * x + x * y) / f64::from(per);
        }
        let test = t_test(&Moments::of(sums), 1.0 / 3.0 + 0.25);
        outside += i32::from(!test.is_consistent(0.05));
    }
    // Binomial(1000, 0.05): mean 50, standard deviation 6.9.
    assert!((15..=85).contains(&outside), "{outside}");
}
