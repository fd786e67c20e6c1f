//! Films that keep iterations apart and combine them by the inverse of their variance: how they count, what is gained, and that
//! the bias, which there is, falls.

#![expect(clippy::unwrap_used, reason = "helpers of tests are tests")]

use math::hash::{combine, unit_f32};
use steradian_film::{Developed, Film, FilmSettings, Filter};

fn uniform(seed: u64, pass: u32, x: i32) -> f32 {
    unit_f32((combine(combine(seed, u64::from(pass)), x as u64) >> 32) as u32)
}

/// A film of one row: before pass `n` its values are 1/p with probability p, from then on one or two of equal chance, less a half:
/// the mean is one in both, the variances are 1/p − 1 and 1/4.
fn render(seed: u64, width: u32, n: u32, p: f32, iterations: Vec<u32>, filter: Filter) -> Film {
    let settings = FilmSettings { iterations, ..FilmSettings::new([width, 1], filter) };
    let film = Film::new(settings).unwrap();
    let (mut buffer, mut tile) = (film.pass_buffer().unwrap(), film.tile());
    for pass in 0..2 * n {
        buffer.begin(pass);
        tile.begin(film.settings().sample_bounds(), pass);
        for x in 0..width as i32 {
            let u = uniform(seed, pass, x);
            let value = match pass < n {
                true if u < p => 1.0 / p,
                true => 0.0,
                false if u < 0.5 => 0.5,
                false => 1.5,
            };
            tile.add_sample([x, 0], [0.5; 2], [value; 3]);
        }
        buffer.add_tile(&tile);
        film.add_pass(&mut buffer).unwrap();
    }
    film
}

fn developed(seed: u64, width: u32, n: u32, p: f32) -> Developed {
    render(seed, width, n, p, vec![n], Filter::pixel_box()).develop()
}

#[test]
fn weights_are_inverse_variances() {
    let image = developed(1, 1024, 256, 0.1);
    let [first, second] = image.weights[..] else { panic!("two iterations") };
    assert!((first + second - 1.0).abs() < 1e-12);
    // Variances of 9 and ¼.
    assert!((second / first / 36.0 - 1.0).abs() < 0.05, "{first} {second}");
    let variance = image.variance.iter().map(|v| f64::from(v[0])).sum::<f64>() / 1024.0;
    let best = 1.0 / (256.0 / 9.0 + 256.0 / 0.25);
    assert!((variance / best - 1.0).abs() < 0.05, "{variance} {best}");
    let alike = render(1, 1024, 256, 0.1, Vec::new(), Filter::pixel_box()).develop();
    let spread = |d: &Developed| d.mean.iter().map(|m| (f64::from(m[0]) - 1.0).powi(2)).sum::<f64>() / 1024.0;
    assert!((spread(&image) / best - 1.0).abs() < 0.1, "{} {best}", spread(&image));
    assert!(spread(&alike) > 5.0 * spread(&image));
    assert_eq!(alike.weights, [1.0]);
}

/// The mean over many films less one, and its standard error.
fn bias(width: u32, n: u32) -> (f64, f64) {
    let films = 16_000 / width;
    let means: Vec<f64> =
        (0..films).map(|seed| developed(u64::from(seed), width, n, 0.25).mean_rgb()[0]).collect();
    let mean = means.iter().sum::<f64>() / f64::from(films);
    let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / f64::from(films - 1);
    (mean - 1.0, (variance / f64::from(films)).sqrt())
}

#[test]
fn the_bias_falls_with_passes_and_with_pixels() {
    let [few, many, wide] = [(1, 8), (1, 32), (16, 8)].map(|(width, n)| bias(width, n));
    // Values that are low go with weights that are high.
    assert!(few.0 < -6.0 * few.1, "{few:?}");
    for (bias, error) in [many, wide] {
        assert!(-bias - 3.0 * error < -few.0 / 2.5 && bias.abs() < -few.0 / 2.0, "{few:?} {bias} ± {error}");
    }
}

#[test]
fn where_no_variance_is_known_passes_count_alike() {
    // Too few passes for an iteration of their own, then no variance at all.
    let [gaussian, pixel_box] = [Filter::gaussian(), Filter::pixel_box()];
    let [few, flat] = [(3, 0.1, gaussian), (8, 1.0, pixel_box)].map(|(n, p, filter)| {
        let [apart, alike] = [vec![n], Vec::new()].map(|i| render(2, 9, n, p, i, filter).develop());
        for (a, b) in apart.mean.iter().zip(&alike.mean) {
            assert!((a[0] - b[0]).abs() <= 1e-6 * b[0], "{a:?} {b:?}");
        }
        apart.weights
    });
    assert_eq!((few, flat), (vec![1.0], vec![0.5, 0.5]));
}

#[test]
fn nonsense_and_strangers_are_refused() {
    let settings = |iterations| FilmSettings { iterations, ..FilmSettings::new([4, 4], Filter::pixel_box()) };
    for bad in [vec![0], vec![3, 3], vec![5, 2], (1..40).collect()] {
        assert!(Film::new(settings(bad)).is_err());
    }
    let mut film = Film::new(settings(vec![2])).unwrap();
    let e = film.merge(&Film::new(settings(vec![3])).unwrap()).unwrap_err();
    assert!(e.to_string().contains("iterations"), "{e}");
}
