//! FLIP: how different two pictures look when one flips between them on a screen, from 0 (the same) to 1.
//!
//! | step                                        | source                    |
//! |---------------------------------------------|---------------------------|
//! | contrast sensitivity filters, Hunt, `HyAB`   | [Andersson2020], sec. 4.1 |
//! | edges and points                            | [Andersson2020], sec. 4.2 |
//! | pictures of high dynamic range: the largest error over a range of exposures | [Andersson2021] |
//!
//! Viewing distance: 0.7 m from a screen 0.7 m wide with 3840 pixels, so 67 pixels a degree.
//! Filters are separable sums of Gaussians; at the border the picture's edge goes on.

use math::trig;
use rayon::prelude::*;
use spectrum::ColorSpace;

use crate::Picture;

/// Pixels that one degree of the field of view covers.
const PIXELS_PER_DEGREE: f64 = 0.7 * 3840.0 / 0.7 * std::f64::consts::PI / 180.0;
/// Exponents and share of the two parts of the colour error [Andersson2020, sec. 4.1.3].
const QC: f64 = 0.7;
const PC: f64 = 0.4;
const PT: f64 = 0.95;
/// Exponent of the feature error, and width of an edge in degrees [Andersson2020, sec. 4.2].
const QF: f64 = 0.5;
const EDGE_DEGREES: f64 = 0.082;

/// FLIP of each pixel, row by row, for linear R, G, B shown as they are: values beyond [0, 1] are cut off.
///
/// Both pictures have `width` columns and the same number of pixels, at least one.
#[must_use]
pub fn flip_ldr(picture: &[[f32; 3]], reference: &[[f32; 3]], width: usize) -> Vec<f32> {
    let clamp = |p: &[[f32; 3]]| p.iter().map(|c| c.map(|x| finite(x).clamp(0.0, 1.0))).collect::<Vec<_>>();
    of_screens(&Plane::new(clamp(picture), width), &Plane::new(clamp(reference), width))
}

/// FLIP of each pixel of a picture `a` against `b`, of the same size: as screens show them if both have eight bits, else over a range
/// of exposures.
#[must_use]
pub fn between(a: &Picture, b: &Picture) -> Vec<f32> {
    let flip = if a.is_float || b.is_float { flip_hdr } else { flip_ldr };
    flip(&a.rgb, &b.rgb, a.size[0])
}

/// FLIP of each pixel of pictures of high dynamic range: the largest over a range of exposures, from the one that keeps
/// the reference's brightest pixel below white to the one that shows its median well [Andersson2021].
#[must_use]
pub fn flip_hdr(picture: &[[f32; 3]], reference: &[[f32; 3]], width: usize) -> Vec<f32> {
    let [start, stop] = exposures(reference);
    let n = ((stop - start).ceil() as usize).max(2);
    let mut worst = vec![0.0_f32; picture.len()];
    for i in 0..n {
        let exposure = start + (stop - start) * i as f64 / (n - 1) as f64;
        let shown = |p: &[[f32; 3]]| {
            let factor = libm::exp2(exposure) as f32;
            p.iter().map(|c| c.map(|x| filmic(finite(x).max(0.0) * factor))).collect::<Vec<_>>()
        };
        let errors = of_screens(&Plane::new(shown(picture), width), &Plane::new(shown(reference), width));
        worst.iter_mut().zip(errors).for_each(|(w, e)| *w = w.max(e));
    }
    worst
}

/// The mean over pixels: FLIP as one number.
#[must_use]
pub fn mean(errors: &[f32]) -> f64 {
    errors.iter().map(|&e| f64::from(e)).sum::<f64>() / errors.len().max(1) as f64
}

fn finite(x: f32) -> f32 {
    if x.is_finite() { x } else { 0.0 }
}

/// The curve that exposures are shown with, a fit to ACES [Narkowicz2016] at 0.6 of the light; in [0, 1].
fn filmic(x: f32) -> f32 {
    let x = 0.6 * x.min(1e6);
    ((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)).clamp(0.0, 1.0)
}

/// First and last exposure, in stops: they put the largest and the median luminance where the curve is at 0.85.
fn exposures(reference: &[[f32; 3]]) -> [f64; 2] {
    let mut luminances: Vec<f32> =
        reference.iter().map(|&c| ColorSpace::Srgb.luminance(c.map(finite)).max(0.0)).collect();
    luminances.sort_unstable_by(f32::total_cmp);
    let n = luminances.len();
    let median = 0.5 * (luminances[n / 2] + luminances[(n - 1) / 2]);
    let at = |y: f32| libm::log2(where_filmic_is(0.85) / f64::from(y).max(1e-6));
    let (start, stop) = (at(luminances[n - 1]), at(median));
    [start, stop.max(start)]
}

/// Where the curve has the value `t`.
fn where_filmic_is(t: f64) -> f64 {
    let (a, b, c) = (0.36 * (2.51 - 2.43 * t), 0.6 * (0.03 - 0.59 * t), -0.14 * t);
    (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a)
}

/// Three channels, row by row.
struct Plane {
    data: Vec<[f32; 3]>,
    width: usize,
}

impl Plane {
    fn new(data: Vec<[f32; 3]>, width: usize) -> Self {
        Self { data, width: width.max(1) }
    }

    fn map(&self, f: impl Fn([f32; 3]) -> [f32; 3] + Sync) -> Self {
        Self { data: self.data.par_iter().map(|&c| f(c)).collect(), width: self.width }
    }

    /// Each channel convolved with its own kernel along rows, or along columns.
    fn convolve(&self, kernels: [&[f64]; 3], along_rows: bool) -> Self {
        let (w, h) = (self.width as isize, (self.data.len() / self.width) as isize);
        let at = |i: usize| {
            let (x, y) = (i as isize % w, i as isize / w);
            [0, 1, 2].map(|c| {
                let radius = (kernels[c].len() / 2) as isize;
                let taps = kernels[c].iter().enumerate().map(|(k, weight)| {
                    let d = k as isize - radius;
                    let (x, y) = if along_rows { (x + d, y) } else { (x, y + d) };
                    let from = y.clamp(0, h - 1) * w + x.clamp(0, w - 1);
                    weight * f64::from(self.data[from as usize][c])
                });
                taps.sum::<f64>() as f32
            })
        };
        Self { data: (0..self.data.len()).into_par_iter().map(at).collect(), width: self.width }
    }
}

/// FLIP of two pictures as a screen shows them, linear in [0, 1].
fn of_screens(picture: &Plane, reference: &Plane) -> Vec<f32> {
    let (colors_a, colors_b) = (perceived(picture), perceived(reference));
    let (features_a, features_b) = (Features::of(picture), Features::of(reference));
    let largest = largest_color_difference();
    let error = |i: usize| {
        let color = color_error(hyab(colors_a.data[i], colors_b.data[i]), largest);
        let edge = (features_a.edges[i] - features_b.edges[i]).abs();
        let point = (features_a.points[i] - features_b.points[i]).abs();
        let feature = libm::pow(f64::from(edge.max(point)) / std::f64::consts::SQRT_2, QF);
        libm::pow(color, 1.0 - feature) as f32
    };
    (0..picture.data.len()).into_par_iter().map(error).collect()
}

/// What the eye makes of a picture: blurred by its contrast sensitivity, in L*a*b* with Hunt's adjustment.
fn perceived(screen: &Plane) -> Plane {
    // Each part of a filter is separable: along x, along y, then their sum.
    let blurred = screen.map(opponent_from_rgb);
    let [narrow, wide] = csf();
    let first = blurred.convolve(narrow.each(), true).convolve(narrow.each(), false);
    let second = blurred.convolve(wide.each(), true).convolve(wide.each(), false);
    let mix = |i: usize| {
        let [a, b] = [first.data[i], second.data[i]];
        hunt_from_opponent(
            [0, 1, 2].map(|c| (narrow.share[c] * f64::from(a[c]) + wide.share[c] * f64::from(b[c])) as f32),
        )
    };
    Plane { data: (0..first.data.len()).into_par_iter().map(mix).collect(), width: screen.width }
}

/// One Gaussian of each channel's filter, normalised, and its share of the whole.
struct Csf {
    kernels: [Vec<f64>; 3],
    share: [f64; 3],
}

impl Csf {
    fn each(&self) -> [&[f64]; 3] {
        [&self.kernels[0], &self.kernels[1], &self.kernels[2]]
    }
}

/// The filters of the achromatic, red-green and blue-yellow channels [Andersson2020, table 1]: the pair of Gaussians.
fn csf() -> [Csf; 2] {
    const A: [[f64; 3]; 2] = [[1.0, 1.0, 34.1], [0.0, 0.0, 13.5]];
    const B: [[f64; 3]; 2] = [[0.0047, 0.0053, 0.04], [1e-5, 1e-5, 0.025]];
    let pi = std::f64::consts::PI;
    let radius = (3.0 * (0.04 / (2.0 * pi * pi)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
    // g(x) = Σ a √(π/b) e^{−π² x² / b} in two dimensions; along one axis without the front factor.
    let line = |b: f64| -> Vec<f64> {
        let x = |i: i32| f64::from(i) / PIXELS_PER_DEGREE;
        (-radius..=radius).map(|i| libm::exp(-pi * pi * x(i) * x(i) / b)).collect()
    };
    let sums = B.map(|row| row.map(|b| line(b).iter().sum::<f64>()));
    let mass = |k: usize, c: usize| A[k][c] * (pi / B[k][c]).sqrt() * sums[k][c] * sums[k][c];
    [0, 1].map(|k| Csf {
        kernels: [0, 1, 2].map(|c| line(B[k][c]).iter().map(|g| g / sums[k][c]).collect()),
        share: [0, 1, 2].map(|c| mass(k, c) / (mass(0, c) + mass(1, c))),
    })
}

/// White of the screen in XYZ: that of R = G = B = 1.
fn white() -> [f32; 3] {
    ColorSpace::Srgb.xyz_from_rgb([1.0; 3])
}

/// Linear opponent colours (Y, Cx, Cz): L*a*b* without its cube root.
fn opponent_from_rgb(rgb: [f32; 3]) -> [f32; 3] {
    let (xyz, w) = (ColorSpace::Srgb.xyz_from_rgb(rgb), white());
    let [x, y, z] = [xyz[0] / w[0], xyz[1] / w[1], xyz[2] / w[2]];
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn rgb_from_opponent([y, cx, cz]: [f32; 3]) -> [f32; 3] {
    let w = white();
    let y = (y + 16.0) / 116.0;
    let (x, z) = (y + cx / 500.0, y - cz / 200.0);
    ColorSpace::Srgb.rgb_from_xyz([x * w[0], y * w[1], z * w[2]])
}

fn hunt_from_opponent(opponent: [f32; 3]) -> [f32; 3] {
    hunt_from_rgb(rgb_from_opponent(opponent).map(|c| c.clamp(0.0, 1.0)))
}

/// CIE L*a*b* whose a and b grow with lightness, as colours in brighter light look more colourful.
fn hunt_from_rgb(rgb: [f32; 3]) -> [f32; 3] {
    let (xyz, w) = (ColorSpace::Srgb.xyz_from_rgb(rgb), white());
    let f = |t: f32| {
        let delta = 6.0_f32 / 29.0;
        if t > delta * delta * delta {
            trig::pow(t, 1.0 / 3.0)
        } else {
            t / (3.0 * delta * delta) + 4.0 / 29.0
        }
    };
    let [x, y, z] = [f(xyz[0] / w[0]), f(xyz[1] / w[1]), f(xyz[2] / w[2])];
    let l = 116.0 * y - 16.0;
    [l, 0.01 * l * 500.0 * (x - y), 0.01 * l * 200.0 * (y - z)]
}

fn hyab(a: [f32; 3], b: [f32; 3]) -> f64 {
    let d = [0, 1, 2].map(|c| f64::from(a[c] - b[c]));
    d[0].abs() + (d[1] * d[1] + d[2] * d[2]).sqrt()
}

/// The largest difference that a screen can show: green against blue.
fn largest_color_difference() -> f64 {
    libm::pow(hyab(hunt_from_rgb([0.0, 1.0, 0.0]), hunt_from_rgb([0.0, 0.0, 1.0])), QC)
}

/// A difference of colours to [0, 1]: most of the range for small ones.
fn color_error(difference: f64, largest: f64) -> f64 {
    let e = libm::pow(difference, QC);
    let knee = PC * largest;
    match e < knee {
        true => e * PT / knee,
        false => PT + (e - knee) / (largest - knee) * (1.0 - PT),
    }
}

/// How strongly each pixel is an edge, or a point.
struct Features {
    edges: Vec<f32>,
    points: Vec<f32>,
}

impl Features {
    fn of(screen: &Plane) -> Self {
        // All three channels are lightness; each gets another kernel.
        let lightness = screen.map(|c| [(opponent_from_rgb(c)[0] + 16.0) / 116.0; 3]);
        let [gauss, first, second] = feature_kernels();
        let across =
            lightness.convolve([&first, &second, &gauss], true).convolve([&gauss, &gauss, &gauss], false);
        let down =
            lightness.convolve([&gauss, &gauss, &gauss], true).convolve([&first, &second, &gauss], false);
        let strength = |c: usize| -> Vec<f32> {
            across.data.iter().zip(&down.data).map(|(a, b)| (a[c] * a[c] + b[c] * b[c]).sqrt()).collect()
        };
        Self { edges: strength(0), points: strength(1) }
    }
}

/// A Gaussian and its first and second derivative, whose positive and negative parts weigh one each when the other axis has the
/// Gaussian.
fn feature_kernels() -> [Vec<f64>; 3] {
    let sd = 0.5 * EDGE_DEGREES * PIXELS_PER_DEGREE;
    let radius = (3.0 * sd).ceil() as i32;
    let line = |f: &dyn Fn(f64) -> f64| -> Vec<f64> {
        let g = |x: f64| libm::exp(-x * x / (2.0 * sd * sd));
        (-radius..=radius).map(|i| f(f64::from(i)) * g(f64::from(i))).collect()
    };
    let of_sign = |v: &[f64], positive: bool| -> f64 {
        v.iter().filter(|x| (**x > 0.0) == positive).sum::<f64>().abs()
    };
    let balanced = |v: Vec<f64>| -> Vec<f64> {
        let (up, down) = (of_sign(&v, true), of_sign(&v, false));
        v.iter().map(|&x| if x > 0.0 { x / up } else { x / down }).collect()
    };
    let gauss = line(&|_| 1.0);
    let sum: f64 = gauss.iter().sum();
    let gauss = gauss.iter().map(|g| g / sum).collect();
    [gauss, balanced(line(&|x| -x)), balanced(line(&|x| x * x / (sd * sd) - 1.0))]
}

/// An error in [0, 1] as a colour that grows brighter evenly, in sRGB: black through purple and orange to near white
/// (eleven stops of matplotlib's `magma`).
#[must_use]
pub fn magma(x: f32) -> [f32; 3] {
    const STOPS: [[f32; 3]; 11] = [
        [0.001, 0.000, 0.014],
        [0.078, 0.054, 0.211],
        [0.232, 0.060, 0.438],
        [0.390, 0.100, 0.502],
        [0.550, 0.161, 0.506],
        [0.716, 0.215, 0.475],
        [0.868, 0.288, 0.409],
        [0.967, 0.440, 0.360],
        [0.994, 0.624, 0.427],
        [0.995, 0.812, 0.573],
        [0.987, 0.991, 0.750],
    ];
    let at = finite(x).clamp(0.0, 1.0) * (STOPS.len() - 1) as f32;
    let i = (at as usize).min(STOPS.len() - 2);
    let t = at - i as f32;
    [0, 1, 2].map(|c| STOPS[i][c] + (STOPS[i + 1][c] - STOPS[i][c]) * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 48;
    const HEIGHT: usize = 40;

    /// Ramps and a chequerboard, with pixels off by up to a tenth.
    fn picture(k: usize) -> Vec<[f32; 3]> {
        let pixel = |i: usize| {
            let (x, y) = (i % WIDTH, i / WIDTH);
            let noise = (x * 7919 + y * 104_729 + k * 1_299_709) % 1009;
            let base =
                [x as f32 / WIDTH as f32, y as f32 / HEIGHT as f32, ((x / 8 + y / 8) % 2) as f32 * 0.7 + 0.1];
            let off = |m: usize| if k == 0 { 0.0 } else { (noise % m) as f32 / m as f32 * 0.2 - 0.1 };
            [0, 1, 2].map(|c| (base[c] + off([17, 13, 11][c])).clamp(0.0, 1.0))
        };
        (0..WIDTH * HEIGHT).map(pixel).collect()
    }

    /// Figures of the authors' own program (`flip-evaluator` of the Python index) for the same pictures.
    #[test]
    fn figures_are_those_of_the_authors_program() {
        let (r, t) = (picture(0), picture(1));
        let map = flip_ldr(&t, &r, WIDTH);
        assert!((mean(&map) - 0.135_556).abs() < 2e-4, "{}", mean(&map));
        for (at, value) in [(20 * WIDTH + 24, 0.170_959), (0, 0.372_371), (39 * WIDTH + 47, 0.071_579)] {
            assert!((map[at] - value).abs() < 1e-3, "{at}: {}", map[at]);
        }

        let bright = |p: &[[f32; 3]]| -> Vec<_> {
            let factor = |i: usize| if i % WIDTH > 30 { 11.0 } else { 1.0 };
            p.iter().enumerate().map(|(i, c)| c.map(|x| x * factor(i))).collect()
        };
        let (r, t) = (bright(&r), bright(&t));
        let [start, stop] = exposures(&r);
        assert!((start + 2.322_118).abs() < 1e-3 && (stop - 1.733_285).abs() < 1e-3, "{start} {stop}");
        let map = flip_hdr(&t, &r, WIDTH);
        assert!((mean(&map) - 0.215_908).abs() < 3e-4, "{}", mean(&map));
        for (at, value) in [(20 * WIDTH + 24, 0.139_166), (0, 0.533_767), (39 * WIDTH + 47, 0.025_135)] {
            assert!((map[at] - value).abs() < 2e-3, "{at}: {}", map[at]);
        }
    }

    #[test]
    fn equal_pictures_do_not_flicker_and_opposite_ones_do() {
        let p = picture(1);
        assert_eq!(mean(&flip_ldr(&p, &p, WIDTH)), 0.0);
        let (black, white) = (vec![[0.0; 3]; 64], vec![[1.0; 3]; 64]);
        assert!(mean(&flip_ldr(&black, &white, 8)) > 0.9);
        let nan = vec![[f32::NAN; 3]; 64];
        assert_eq!(mean(&flip_ldr(&nan, &black, 8)), 0.0);
        assert!(flip_hdr(&nan, &black, 8).iter().all(|e| e.is_finite()));
    }

    #[test]
    fn the_colour_map_brightens() {
        let light = |x: f32| magma(x).iter().sum::<f32>();
        assert!((0..100).all(|i| light(i as f32 / 100.0) < light((i + 1) as f32 / 100.0)));
        assert_eq!(magma(f32::NAN), magma(0.0));
    }
}
