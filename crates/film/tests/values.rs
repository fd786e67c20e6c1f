//! What comes out of a film: means, variances, splats, bad samples.

#![expect(clippy::unwrap_used, reason = "helpers of tests are tests")]

use math::Bounds2i;
use math::hash::{combine, unit_f32};
use steradian_film::{BadKind, BadSamples, CONTRIBUTION_LIMIT, Film, FilmSettings, Filter, Sign};

const ALL: [Filter; 6] = [
    Filter::pixel_box(),
    Filter::Box { radius: [1.3, 0.7] },
    Filter::triangle(),
    Filter::gaussian(),
    Filter::mitchell(),
    Filter::sinc(),
];

fn random(pass: u32, at: u64, k: u64) -> f32 {
    unit_f32((combine(combine(u64::from(pass) ^ 0xabcd, at), k) >> 32) as u32)
}

/// One sample in every pixel per pass, at a random offset, with values of `f(position, pass, hash)`.
fn render(s: FilmSettings, passes: u32, f: impl Fn([f32; 2], u32, u64) -> [f32; 3]) -> Film {
    render_with(s, passes, 0, f)
}

/// The same with other random numbers.
fn render_with(s: FilmSettings, passes: u32, seed: u64, f: impl Fn([f32; 2], u32, u64) -> [f32; 3]) -> Film {
    let film = Film::new(s).unwrap();
    let bounds = film.settings().sample_bounds();
    let (mut buffer, mut tile) = (film.pass_buffer().unwrap(), film.tile());
    for pass in 0..passes {
        buffer.begin(pass);
        tile.begin(bounds, pass);
        for y in bounds.min[1]..bounds.max[1] {
            for x in bounds.min[0]..bounds.max[0] {
                let at = combine(seed, (y as u64) << 32 ^ x as u64);
                let offset = [random(pass, at, 0), random(pass, at, 1)];
                tile.add_sample([x, y], offset, f([x as f32 + offset[0], y as f32 + offset[1]], pass, at));
            }
        }
        buffer.add_tile(&tile);
        film.add_pass(&mut buffer).unwrap();
    }
    film
}

#[test]
fn a_constant_image_is_that_constant_with_no_variance() {
    for filter in ALL {
        let image = render(FilmSettings::new([9, 7], filter), 16, |_, _, _| [0.3, 1.0, 700.0]).develop();
        for (m, v) in image.mean.iter().zip(&image.variance) {
            for (c, truth) in [0.3_f32, 1.0, 700.0].into_iter().enumerate() {
                assert!((m[c] / truth - 1.0).abs() < 1e-6, "{filter:?} {m:?}");
                assert!(v[c] < 1e-9 * truth * truth, "{filter:?} {v:?}");
            }
        }
    }
}

#[test]
fn a_linear_ramp_is_reconstructed_at_pixel_centres() {
    // Symmetric filters reproduce a linear image at their centres. The ratio estimator's bias is O(1/n).
    for filter in ALL {
        let film = render(FilmSettings::new([6, 5], filter), 500, |p, _, _| [10.0 + p[0], 10.0 + p[1], 1.0]);
        let image = film.develop();
        for i in 0..30 {
            let truth = [10.5 + (i % 6) as f32, 10.5 + (i / 6) as f32, 1.0];
            for (c, truth) in truth.into_iter().enumerate() {
                let sigma = image.variance[i][c].sqrt();
                assert!((image.mean[i][c] - truth).abs() < 5.0 * sigma + 2e-3, "{filter:?} {i} {sigma}");
            }
        }
    }
}

#[test]
fn the_variance_of_the_mean_is_that_of_many_repetitions() {
    for filter in [Filter::pixel_box(), Filter::gaussian(), Filter::mitchell()] {
        let n = 64;
        let (mut of_means, mut claimed, mut sum, mut count) = (0.0, 0.0, 0.0, 0.0);
        for seed in 0..60_u64 {
            let s = FilmSettings { sign: Sign::Any, ..FilmSettings::new([8, 8], filter) };
            let noise = |_, pass, at| [2.0 * random(pass, at, combine(seed, 2)), 0.0, 0.0];
            // Offsets must differ between repetitions too.
            let film = render_with(s, n, seed, noise);
            let image = film.develop();
            for (m, v) in image.mean.iter().zip(&image.variance) {
                of_means += (f64::from(m[0]) - 1.0).powi(2);
                sum += f64::from(m[0]);
                claimed += f64::from(v[0]);
                count += 1.0;
            }
        }
        // 3840 pixels, correlated over the footprint: the ratio of variances is known to some per cent.
        assert!((sum / count - 1.0).abs() < 0.01, "{filter:?} {}", sum / count);
        assert!((claimed / of_means - 1.0).abs() < 0.12, "{filter:?} {}", claimed / of_means);
        if filter == Filter::pixel_box() {
            assert!((claimed / count * f64::from(n) * 3.0 - 1.0).abs() < 0.02);
        }
    }
}

#[test]
fn splats_add_to_samples_and_their_spread_counts_as_a_replicate() {
    for filter in ALL {
        let film = Film::new(FilmSettings { splats: true, ..FilmSettings::new([12, 12], filter) }).unwrap();
        let mut buffer = film.pass_buffer().unwrap();
        let (mut tile, mut list) = (film.tile(), film.splat_list());
        let (passes, per_pass) = (150, 2000_u64);
        for pass in 0..passes {
            // Samples see 1; splats, uniform over more than the film, see 2 per pixel.
            buffer.begin(pass);
            let bounds = film.settings().sample_bounds();
            tile.begin(bounds, pass);
            for y in bounds.min[1]..bounds.max[1] {
                for x in bounds.min[0]..bounds.max[0] {
                    let at = (y as u64) << 32 ^ x as u64;
                    tile.add_sample([x, y], [random(pass, at, 0), random(pass, at, 1)], [1.0; 3]);
                }
            }
            buffer.add_tile(&tile);
            list.begin(pass);
            for i in 0..per_pass {
                let p = [0, 1].map(|a| 24.0 * random(pass, i | 1 << 50, a) - 6.0);
                list.add(p, [2.0 * 24.0 * 24.0 / per_pass as f32; 3]);
            }
            buffer.add_splats(&mut list);
            film.add_pass(&mut buffer).unwrap();
        }
        let image = film.develop();
        let (mut chi2, mean) = (0.0, image.mean_rgb()[0]);
        for (m, v) in image.mean.iter().zip(&image.variance) {
            chi2 += f64::from((m[1] - 3.0).powi(2) / v[1]) / 144.0;
        }
        assert!((mean - 3.0).abs() < 0.01, "{filter:?} {mean}");
        assert!((0.5..1.6).contains(&chi2), "{filter:?} {chi2}");
    }
}

/// A further channel of splats is a sum over the pass, as the image's splats are, and does not reach the image.
#[test]
fn further_channels_of_splats_are_sums_of_a_pass() {
    for filter in [Filter::pixel_box(), Filter::gaussian()] {
        let names = ["R", "G", "B"].map(|c| format!("s2t1.{c}")).to_vec();
        let settings = FilmSettings { splats: true, ..FilmSettings::new([9, 9], filter) };
        let (plain, with) =
            (Film::new(settings.clone()), Film::new(FilmSettings { splat_aovs: names, ..settings }));
        let (plain, with) = (plain.unwrap(), with.unwrap());
        for pass in 0..5 {
            for film in [&plain, &with] {
                let (mut buffer, mut list) = (film.pass_buffer().unwrap(), film.splat_list());
                buffer.begin(pass);
                list.begin(pass);
                let (position, rgb) = ([4.3 + 0.1 * pass as f32, 4.6], [1.0, 2.0 + pass as f32, 0.25]);
                match film.settings().splat_aovs.is_empty() {
                    true => list.add(position, rgb),
                    false => list.add_aov(0, position, rgb),
                }
                buffer.add_splats(&mut list);
                film.add_pass(&mut buffer).unwrap();
            }
        }
        let (plain, with) = (plain.develop(), with.develop());
        assert_eq!(with.mean_rgb(), [0.0; 3]);
        assert!(plain.mean_rgb()[1] > 0.0);
        assert_eq!(with.aovs, plain.mean.as_flattened(), "{filter:?}");
    }
}

#[test]
fn a_splat_just_outside_the_film_reaches_into_it() {
    let film =
        Film::new(FilmSettings { splats: true, ..FilmSettings::new([4, 4], Filter::gaussian()) }).unwrap();
    let (mut buffer, mut list) = (film.pass_buffer().unwrap(), film.splat_list());
    for (pass, position, expected) in [
        (0, [-0.2, 1.5], true),
        (1, [4.3, 4.3], true),
        (2, [-1.2, 1.5], false),
        (3, [f32::NAN, 1.0], false),
        (4, [f32::INFINITY, 1.0], false),
        (5, [-1e30, 1.0], false),
    ] {
        buffer.begin(pass);
        list.begin(pass);
        list.add(position, [1.0; 3]);
        buffer.add_splats(&mut list);
        let before = film.develop().mean_rgb()[0] * f64::from(pass);
        film.add_pass(&mut buffer).unwrap();
        let gained = film.develop().mean_rgb()[0] * f64::from(pass + 1) - before;
        assert_eq!(gained > 1e-6, expected, "{position:?} {gained}");
    }
}

#[test]
fn bad_samples_are_dropped_counted_and_named_in_any_order() {
    let bad = [
        ([f32::NAN, 0.0, 0.0], BadKind::Nan),
        ([f32::INFINITY, 0.0, 0.0], BadKind::TooLarge),
        ([0.0, -1.0, 0.0], BadKind::Negative),
        ([0.0, 0.0, CONTRIBUTION_LIMIT * 2.0], BadKind::TooLarge),
    ];
    let make = |passes: Vec<u32>| {
        let film = Film::new(FilmSettings::new([8, 1], Filter::pixel_box())).unwrap();
        let mut tile = film.tile();
        for pass in passes {
            film.begin_pass(pass).unwrap();
            tile.begin(Bounds2i::new([0, 0], [8, 1]), pass);
            for x in 0..8 {
                let value = if x < 4 { bad[x as usize].0 } else { [1.0; 3] };
                tile.add_sample([x, 0], [0.5; 2], value);
            }
            film.add_tile(&tile);
            film.end_pass(pass).unwrap();
        }
        film
    };
    let film = make((0..10).collect());
    let found = film.bad_samples();
    assert_eq!(found.count(), 40);
    assert_eq!(found.first().count(), BadSamples::REMEMBERED);
    for (i, b) in found.first().enumerate() {
        assert_eq!((b.pass, b.x, b.y, b.kind), (i as u32 / 4, i as i32 % 4, 0, bad[i % 4].1));
    }
    assert_eq!(
        film.develop().mean,
        [[0.0; 3], [0.0; 3], [0.0; 3], [0.0; 3], [1.0; 3], [1.0; 3], [1.0; 3], [1.0; 3]]
    );

    let mut late = make((5..10).rev().collect());
    late.merge(&make((0..5).collect())).unwrap();
    assert_eq!(late.bad_samples(), found);

    // Where any sign is good, only what is not a number or too large is bad.
    let film = Film::new(FilmSettings { sign: Sign::Any, ..FilmSettings::new([1, 1], Filter::pixel_box()) })
        .unwrap();
    let mut tile = film.tile();
    tile.begin(Bounds2i::new([0, 0], [1, 1]), 0);
    tile.add_sample([0, 0], [0.5; 2], [-3.0, 0.0, 1.0]);
    tile.add_sample([0, 0], [0.5; 2], [f32::NEG_INFINITY, 0.0, 1.0]);
    assert_eq!(tile.bad_samples().count(), 1);
}

#[test]
fn squares_that_do_not_fit_make_the_variance_unknown_and_nothing_else() {
    let film = render(FilmSettings::new([1, 1], Filter::pixel_box()), 300, |_, pass, _| {
        [if pass % 2 == 0 { CONTRIBUTION_LIMIT } else { 0.0 }, 1.0, 0.0]
    });
    let image = film.develop();
    assert_eq!(image.mean[0], [CONTRIBUTION_LIMIT / 2.0, 1.0, 0.0]);
    assert!(image.variance[0][0].is_infinite() && image.variance[0][1] == 0.0);
}

#[test]
fn one_pass_has_no_variance_to_show() {
    let film = render(FilmSettings::new([2, 2], Filter::pixel_box()), 1, |_, _, _| [1.0; 3]);
    assert!(film.develop().relmse_estimate().is_infinite());
    let film = render(FilmSettings::new([2, 2], Filter::pixel_box()), 2, |_, pass, _| [pass as f32; 3]);
    // Values 0 and 1: mean 1/2, variance of the mean 1/4.
    assert!((film.develop().relmse_estimate() - 0.25 / 0.26).abs() < 1e-6);
}

#[test]
fn nonsense_settings_are_refused_with_a_sentence() {
    let ok = FilmSettings::new([4, 4], Filter::pixel_box());
    let refused = |s: FilmSettings| Film::new(s).err().map(|e| e.to_string()).unwrap();
    assert!(refused(FilmSettings::new([0, 4], Filter::pixel_box())).contains("resolution 0 x 4"));
    assert!(refused(FilmSettings::new([1 << 20; 2], Filter::pixel_box())).contains("memory"));
    let crop = |min, max| FilmSettings { crop: Bounds2i::new(min, max), ..ok.clone() };
    assert!(refused(crop([2, 2], [2, 3])).contains("empty"));
    assert!(refused(crop([-1, 0], [2, 3])).contains("outside"));
    assert!(refused(crop([0, 0], [i32::MAX, 3])).contains("outside"));
    assert!(refused(crop([i32::MIN, 0], [i32::MAX, 3])).contains("outside"));
    assert!(refused(FilmSettings::new([4, 4], Filter::Box { radius: [-1.0, 1.0] })).contains("xradius"));
}
