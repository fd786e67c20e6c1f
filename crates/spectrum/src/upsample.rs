//! From RGB to smooth reflectances [Jakob2019].
//!
//! For each colour space a table of coefficients over (largest channel, its value, the others relative to it), made on
//! first use by least squares in CIELAB at every grid point, starting from the neighbour's solution. Reflectances
//! are integrated over nodes 5 nm apart with the weights of x̄, ȳ, z̄ times the illuminant of the straight lines
//! between them. Every operation is in a fixed order: the same bits on every machine.
//!
//! Departs from the paper: Levenberg–Marquardt steps instead of Gauss–Newton, 64 levels by 32 by 32
//! instead of 64³ points, coefficients in normalised wavelength.

use std::sync::OnceLock;

use glam::{DMat3, DVec3};
use math::trig::f64::pow;

use crate::{ColorSpace, SigmoidPolynomial, cie};

/// Grid points on the axes of the two smaller channels.
const RES: usize = 32;
/// Grid points on the axis of the largest channel.
const LEVELS: usize = 64;
/// Distance of the quadrature's nodes in nm.
const STEP: usize = 5;
const N_NODES: usize = 470 / STEP + 1;
/// No coefficient may be larger: edges of reflectances stay wider than a few nm.
const LIMIT: f64 = 200.0;

/// Coefficients for the whole gamut of one colour space.
pub struct RgbToSpectrumTable {
    /// Values of the largest channel, rising, dense near 0 and 1.
    levels: [f32; LEVELS],
    /// By largest channel, its level, and the next two channels relative to it.
    coefficients: Vec<[f32; 3]>,
}

impl RgbToSpectrumTable {
    /// The table of a space; the first call makes it (about a second).
    #[must_use]
    pub fn of(space: ColorSpace) -> &'static Self {
        static TABLES: [OnceLock<RgbToSpectrumTable>; 4] = [const { OnceLock::new() }; 4];
        TABLES[space as usize].get_or_init(|| Self::build(&Fit::new(space)))
    }

    /// The reflectance of a linear RGB, which is limited to [0, 1].
    #[must_use]
    pub fn coefficients(&self, rgb: [f32; 3]) -> SigmoidPolynomial {
        let rgb = rgb.map(|c| c.clamp(0.0, 1.0));
        if rgb[0] == rgb[1] && rgb[1] == rgb[2] {
            return SigmoidPolynomial::constant(rgb[0]);
        }

        // Where on the grid: the largest channel, its level, the other two relative to it.
        let largest = index_of_largest(rgb);
        let z = rgb[largest];
        let relative = ((RES - 1) as f32) / z;
        let x = rgb[(largest + 1) % 3] * relative;
        let y = rgb[(largest + 2) % 3] * relative;
        let (xi, yi) = ((x as usize).min(RES - 2), (y as usize).min(RES - 2));
        let zi = self.levels.partition_point(|l| *l <= z).clamp(1, LEVELS - 1) - 1;
        let (tx, ty) = (x - xi as f32, y - yi as f32);
        let tz = (z - self.levels[zi]) / (self.levels[zi + 1] - self.levels[zi]);

        // Trilinear interpolation.
        let row = |k: usize, j: usize| {
            let at = index(largest, k, j, xi);
            lerp(self.coefficients[at], self.coefficients[at + 1], tx)
        };
        let plane = |k: usize| lerp(row(k, yi), row(k, yi + 1), ty);
        SigmoidPolynomial::new(lerp(plane(zi), plane(zi + 1), tz))
    }

    /// A factor and a reflectance whose product looks like an RGB of any size: the factor is twice the largest
    /// channel, so that the reflectance stays in the middle of its range.
    #[must_use]
    pub fn unbounded(&self, rgb: [f32; 3]) -> (f32, SigmoidPolynomial) {
        let scale = 2.0 * rgb[0].max(rgb[1]).max(rgb[2]);
        if !(scale > 0.0 && scale.is_finite()) {
            return (0.0, SigmoidPolynomial::constant(0.0));
        }
        (scale, self.coefficients(rgb.map(|c| c / scale)))
    }

    fn build(fit: &Fit) -> Self {
        let levels = std::array::from_fn(|k| smooth(smooth(k as f64 / (LEVELS - 1) as f64)));
        let mut table =
            Self { levels: levels.map(|l| l as f32), coefficients: vec![[0.0; 3]; 3 * LEVELS * RES * RES] };
        for largest in 0..3 {
            for j in 0..RES {
                for i in 0..RES {
                    table.build_column(fit, &levels, [largest, j, i]);
                }
            }
        }
        table
    }

    /// All levels of one hue, from the middle outwards; each search starts where its two neighbours point.
    fn build_column(&mut self, fit: &Fit, levels: &[f64; LEVELS], [largest, j, i]: [usize; 3]) {
        let start = LEVELS / 5;
        let mut solved = [DVec3::ZERO; LEVELS];
        let mut solve = |k: usize, guess: DVec3| {
            let mut rgb = [levels[k]; 3];
            rgb[(largest + 1) % 3] *= i as f64 / (RES - 1) as f64;
            rgb[(largest + 2) % 3] *= j as f64 / (RES - 1) as f64;
            let c = fit.solve(rgb, guess);
            self.coefficients[index(largest, k, j, i)] = c.to_array().map(|x| x as f32);
            c
        };
        solved[start] = solve(start, DVec3::ZERO);
        solved[start + 1] = solve(start + 1, solved[start]);
        for k in start + 2..LEVELS {
            solved[k] = solve(k, solved[k - 1] * 2.0 - solved[k - 2]);
        }
        for k in (0..start).rev() {
            solved[k] = solve(k, solved[k + 1] * 2.0 - solved[k + 2]);
        }
    }
}

/// One space's problem: find the coefficients of an RGB.
struct Fit {
    /// Wavelength from 0 to 1, and what the reflectance there adds to X, Y, Z under the illuminant.
    nodes: Vec<(f64, DVec3)>,
    /// XYZ of a reflectance of one.
    white: DVec3,
    xyz_from_rgb: DMat3,
}

/// CIELAB of some coefficients, and its derivative by them.
struct Appearance {
    lab: DVec3,
    lab_by_c: DMat3,
}

impl Fit {
    fn new(space: ColorSpace) -> Self {
        // Weight of each node: of the 1 nm sums, shared between the two nodes around.
        let mut weights = [DVec3::ZERO; N_NODES];
        for (i, bar) in cie::observer().iter().enumerate() {
            let light = f64::from(space.illuminant().values()[i]) / space.illuminant_photometric();
            let (node, t) = (i / STEP, (i % STEP) as f64 / STEP as f64);
            weights[node] += DVec3::from_array(*bar) * (light * (1.0 - t));
            if t > 0.0 {
                weights[node + 1] += DVec3::from_array(*bar) * (light * t);
            }
        }
        // Nodes that nobody sees are left out.
        let white: DVec3 = weights.iter().sum();
        let nodes = (0..N_NODES)
            .map(|k| (k as f64 / (N_NODES - 1) as f64, weights[k]))
            .filter(|(_, w)| w.max_element() > 1e-5)
            .collect();

        // The matrix whose (1, 1, 1) is the white of the spectrum, not of the standard's four digits: grey stays grey.
        let nominal = DMat3::from_cols_array_2d(&space.xyz_from_rgb_rows()).transpose();
        let adapt = DMat3::from_diagonal(white / (nominal * DVec3::ONE));
        Self { nodes, white, xyz_from_rgb: adapt * nominal }
    }

    /// Levenberg–Marquardt on the CIELAB distance.
    fn solve(&self, rgb: [f64; 3], start: DVec3) -> DVec3 {
        let target = self.lab(self.xyz_from_rgb * DVec3::from_array(rgb)).0;
        let (mut c, mut damping) = (limit(start), 1e-4);
        let mut now = self.appearance(c);
        let mut error = (now.lab - target).length_squared();

        for _ in 0..40 {
            if error < 1e-5 {
                break;
            }
            // (JᵀJ + μ diag JᵀJ) δ = Jᵀ r.
            let transposed = now.lab_by_c.transpose();
            let mut normal = transposed * now.lab_by_c;
            for a in 0..3 {
                let diagonal = normal.col(a)[a];
                normal.col_mut(a)[a] += damping * diagonal + 1e-12;
            }
            let step = normal.inverse() * (transposed * (now.lab - target));
            let next = limit(c - step);
            let there = self.appearance(next);
            let next_error = (there.lab - target).length_squared();

            // Keep what is better; else be more careful.
            if next_error < error {
                let gain = error - next_error;
                (c, now, error) = (next, there, next_error);
                damping = (damping * 0.1).max(1e-9);
                if gain < 1e-7 * error {
                    break;
                }
            } else {
                damping *= 10.0;
                if damping > 1e6 {
                    break;
                }
            }
        }
        c
    }

    fn appearance(&self, c: DVec3) -> Appearance {
        let (mut xyz, mut by_c0, mut by_c1, mut by_c2) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        for (t, weight) in &self.nodes {
            let x = (c.x * t + c.y) * t + c.z;
            let inverse_root = 1.0 / (1.0 + x * x).sqrt();
            let slope = 0.5 * inverse_root * inverse_root * inverse_root;
            let w = *weight * slope;
            xyz += *weight * (0.5 + 0.5 * x * inverse_root);
            by_c0 += w * (t * t);
            by_c1 += w * *t;
            by_c2 += w;
        }
        let (lab, lab_by_xyz) = self.lab(xyz);
        Appearance { lab, lab_by_c: lab_by_xyz * DMat3::from_cols(by_c0, by_c1, by_c2) }
    }

    /// CIELAB [CIE15] and its derivative by XYZ.
    fn lab(&self, xyz: DVec3) -> (DVec3, DMat3) {
        const DELTA: f64 = 6.0 / 29.0;
        let f = |r: f64| {
            if r > DELTA * DELTA * DELTA {
                let root = pow(r, 1.0 / 3.0);
                (root, root / (3.0 * r))
            } else {
                (r / (3.0 * DELTA * DELTA) + 4.0 / 29.0, 1.0 / (3.0 * DELTA * DELTA))
            }
        };
        let r = xyz / self.white;
        let ((fx, dx), (fy, dy), (fz, dz)) = (f(r.x), f(r.y), f(r.z));
        let lab = DVec3::new(116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz));
        let d = DVec3::new(dx, dy, dz) / self.white;
        let by_xyz = DMat3::from_cols(
            DVec3::new(0.0, 500.0 * d.x, 0.0),
            DVec3::new(116.0 * d.y, -500.0 * d.y, 200.0 * d.y),
            DVec3::new(0.0, 0.0, -200.0 * d.z),
        );
        (lab, by_xyz)
    }
}

/// Scaled down as a whole when a coefficient is too large.
fn limit(c: DVec3) -> DVec3 {
    let largest = c.abs().max_element();
    if largest > LIMIT { c * (LIMIT / largest) } else { c }
}

fn index(largest: usize, k: usize, j: usize, i: usize) -> usize {
    ((largest * LEVELS + k) * RES + j) * RES + i
}

fn index_of_largest(rgb: [f32; 3]) -> usize {
    if rgb[0] > rgb[1] {
        if rgb[0] > rgb[2] { 0 } else { 2 }
    } else if rgb[1] > rgb[2] {
        1
    } else {
        2
    }
}

fn lerp(a: [f32; 3], b: [f32; 3], t: f32) -> [f32; 3] {
    std::array::from_fn(|i| a[i] * (1.0 - t) + b[i] * t)
}

fn smooth(x: f64) -> f64 {
    x * x * (3.0 - 2.0 * x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SpectralCurve;

    /// RGB of the upsampled reflectance under the space's white, by the full 1 nm integral.
    fn round_trip(space: ColorSpace, rgb: [f32; 3]) -> [f32; 3] {
        let p = RgbToSpectrumTable::of(space).coefficients(rgb);
        let points: Vec<f32> = (360..=830).flat_map(|l| [l as f32, p.eval(l as f32)]).collect();
        SpectralCurve::from_interleaved(&points).unwrap().reflectance_rgb(space)
    }

    fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
        (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, f32::max)
    }

    #[test]
    fn rgb_comes_back_from_its_spectrum() {
        // Inside the gamut; the values are off the grid points.
        let (mut worst, mut at, mut sum, mut n) = (0.0_f32, [0.0; 3], 0.0, 0);
        let steps = [0.02, 0.1, 0.33, 0.57, 0.75, 0.9];
        for r in steps {
            for g in steps {
                for b in steps {
                    let rgb = [r, g, b];
                    let d = distance(round_trip(ColorSpace::Srgb, rgb), rgb);
                    sum += d;
                    n += 1;
                    if d > worst {
                        (worst, at) = (d, rgb);
                    }
                }
            }
        }
        assert!(worst < 8e-3, "{worst} at {at:?}");
        assert!(sum / (n as f32) < 1e-3, "{}", sum / n as f32);
    }

    #[test]
    fn greys_are_constant() {
        let p = RgbToSpectrumTable::of(ColorSpace::Srgb).coefficients([0.3; 3]);
        assert!((p.eval(400.0) - 0.3).abs() < 1e-6 && (p.eval(700.0) - 0.3).abs() < 1e-6);
        assert!(distance(round_trip(ColorSpace::Srgb, [0.3, 0.301, 0.3]), [0.3, 0.301, 0.3]) < 1e-3);
    }

    #[test]
    fn the_corners_of_the_gamut_stay_close() {
        for rgb in [
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 1.0],
            [1.0, 0.0, 1.0],
        ] {
            let back = round_trip(ColorSpace::Srgb, rgb);
            assert!(distance(back, rgb) < 5e-3, "{rgb:?} {back:?}");
        }
        assert!(distance(round_trip(ColorSpace::Srgb, [0.0; 3]), [0.0; 3]) < 1e-6);
        assert!(distance(round_trip(ColorSpace::Srgb, [1.0; 3]), [1.0; 3]) < 1e-6);
    }

    #[test]
    fn any_size_is_reached_by_a_factor() {
        let (scale, p) = RgbToSpectrumTable::of(ColorSpace::Srgb).unbounded([10.0, 4.0, 2.0]);
        assert_eq!(scale, 20.0);
        assert!((0..=470).all(|i| p.eval(360.0 + i as f32) <= 1.0));
        let (scale, p) = RgbToSpectrumTable::of(ColorSpace::Srgb).unbounded([0.0; 3]);
        assert_eq!(scale * p.eval(500.0), 0.0);
    }

    #[test]
    fn junk_gives_a_reflectance_all_the_same() {
        let t = RgbToSpectrumTable::of(ColorSpace::Srgb);
        for rgb in [[-1.0, 0.5, 2.0], [f32::INFINITY, 0.0, 0.0], [1e-30, 0.0, 0.0], [0.999_999_9, 1.0, 0.5]] {
            let v = t.coefficients(rgb).eval(555.0);
            assert!((0.0..=1.0).contains(&v), "{rgb:?} {v}");
        }
    }
}
