//! Intensity over directions as lamps are measured: bilinear between the angles of a photometric file [IES2002].
//!
//! Light space of a web: straight down is −z, horizontal angles run from +x towards +y. Symmetries are unfolded.
//!
//! Directions are drawn by a table whose cells lie between measured angles: each with the exact integral of the intensity
//! over it, and a little of its largest, so that no direction that shines has density zero; even in solid angle within a cell.

use std::f32::consts::{PI, TAU};

use math::{Dir, Vec3, trig};
use sampling::distribution::PiecewiseConstant2D;

use super::ies::Photometry;

/// Largest size of a cell of the table, in degrees.
const CELL: [f32; 2] = [6.0, 1.5];
/// Share of a cell's weight that goes by its largest intensity.
const FLOOR: f64 = 0.02;

/// Intensities with their distribution. Angles in radians.
#[derive(Clone, Debug)]
pub(super) struct Web {
    /// From straight down; ascending.
    vertical: Vec<f32>,
    /// From 0 to 2π; ascending.
    horizontal: Vec<f32>,
    /// For each horizontal angle, over the vertical ones.
    values: Vec<f32>,
    /// Borders of the table's columns (horizontal) and rows (vertical).
    columns: Vec<f32>,
    rows: Vec<f32>,
    distribution: PiecewiseConstant2D,
    power: f64,
}

impl Web {
    /// `None` if it is black.
    pub(super) fn new(p: &Photometry) -> Option<Self> {
        let (horizontal, rows) = unfold(p);
        let n = p.vertical.len();
        let values: Vec<f32> = rows.iter().flat_map(|&i| &p.candela[i * n..(i + 1) * n]).copied().collect();
        let is_even = values.chunks(n).all(|c| *c == values[..n]);
        let columns = if is_even { vec![0.0, 360.0] } else { split(&horizontal, CELL[0]) };
        let radians = |angles: &[f32]| angles.iter().map(|a| a.to_radians()).collect::<Vec<_>>();
        let mut web = Self {
            vertical: radians(&p.vertical),
            horizontal: radians(&horizontal),
            values,
            columns: radians(&columns),
            rows: radians(&split(&p.vertical, CELL[1])),
            distribution: PiecewiseConstant2D::new(&[1.0], 1)?,
            power: 0.0,
        };
        // The largest angle is exact, whatever the conversion did.
        (*web.horizontal.last_mut()?, *web.columns.last_mut()?) = (TAU, TAU);

        let mut weights = Vec::new();
        for row in web.rows.windows(2) {
            for column in web.columns.windows(2) {
                let (integral, most) = web.over(row, column);
                web.power += integral;
                weights.push(((1.0 - FLOOR) * integral + FLOOR * most) as f32);
            }
        }
        web.distribution = PiecewiseConstant2D::new(&weights, web.columns.len() - 1)?;
        (web.power > 0.0).then_some(web)
    }

    /// Integral over the sphere.
    pub(super) fn power(&self) -> f32 {
        self.power as f32
    }

    /// Intensity in a direction of its space.
    pub(super) fn at(&self, w: Dir) -> f32 {
        let [phi, theta] = angles(w);
        self.at_angles(phi, theta)
    }

    fn at_angles(&self, phi: f32, theta: f32) -> f32 {
        let n = self.vertical.len();
        if theta < self.vertical[0] || theta > self.vertical[n - 1] {
            return 0.0;
        }
        let (i, x) = place(&self.horizontal, phi);
        let (j, y) = place(&self.vertical, theta);
        let along = |i: usize| self.values[i * n + j] * (1.0 - y) + self.values[i * n + j + 1] * y;
        along(i) * (1.0 - x) + along(i + 1) * x
    }

    /// A direction of its space by the table.
    pub(super) fn sample(&self, u: [f32; 2]) -> Dir {
        let s = self.distribution.sample(u);
        let [n_columns, n_rows] = self.distribution.size();
        let within = |p: f32, n: usize, i: usize| (p * n as f32 - i as f32).clamp(0.0, 1.0);
        let (x, y) = (within(s.p[0], n_columns, s.cell[0]), within(s.p[1], n_rows, s.cell[1]));
        let phi = self.columns[s.cell[0]] * (1.0 - x) + self.columns[s.cell[0] + 1] * x;
        let [below, above] = [self.rows[s.cell[1]], self.rows[s.cell[1] + 1]].map(trig::cos);
        let cos = below * (1.0 - y) + above * y;
        let sin = trig::safe_sqrt((1.0 - cos) * (1.0 + cos));
        let (sin_phi, cos_phi) = trig::sin_cos(phi);
        Dir::normalize(Vec3::new(sin * cos_phi, sin * sin_phi, -cos))
    }

    /// Density of [`Web::sample`], per solid angle of its space.
    pub(super) fn pdf(&self, w: Dir) -> f32 {
        let [phi, theta] = angles(w);
        let (first, last) = (self.rows[0], self.rows[self.rows.len() - 1]);
        if theta < first || theta > last {
            return 0.0;
        }
        let (i, _) = place(&self.columns, phi);
        let (j, _) = place(&self.rows, theta);
        let [n_columns, n_rows] = self.distribution.size();
        let center = |i: usize, n: usize| (i as f32 + 0.5) / n as f32;
        let p = self.distribution.pdf([center(i, n_columns), center(j, n_rows)]).value();
        let width = self.columns[i + 1] - self.columns[i];
        let solid_angle = width * (trig::cos(self.rows[j]) - trig::cos(self.rows[j + 1]));
        p / (n_columns as f32 * n_rows as f32 * solid_angle)
    }

    /// Exact integral over a cell within which the intensity is bilinear, and its largest times the solid angle.
    fn over(&self, row: &[f32], column: &[f32]) -> (f64, f64) {
        let f = |phi: f32, theta: f32| f64::from(self.at_angles(phi, theta));
        let at = |theta: f32| [f(column[0], theta), f(column[1], theta)];
        let ([a, b], [c, d]) = (at(row[0]), at(row[1]));
        let (near, far) = (0.5 * (a + b), 0.5 * (c + d));
        let (s0, c0) = trig::f64::sin_cos(f64::from(row[0]));
        let (s1, c1) = trig::f64::sin_cos(f64::from(row[1]));
        let width = f64::from(column[1] - column[0]);

        // ∫ (g₀ + s (θ − θ₀)) sin θ dθ by parts.
        let slope = (far - near) / f64::from(row[1] - row[0]);
        let integral = near * c0 - far * c1 + slope * (s1 - s0);
        (width * integral.max(0.0), a.max(b).max(c).max(d) * width * (c0 - c1))
    }
}

/// Horizontal angle in [0, 2π) and angle from straight down.
fn angles(w: Dir) -> [f32; 2] {
    let v = w.0;
    let phi = trig::atan2(v.y, v.x);
    let phi = if phi < 0.0 { phi + TAU } else { phi };
    [phi, trig::atan2((v.x * v.x + v.y * v.y).sqrt(), -v.z).min(PI)]
}

/// The interval that holds `x`, and where in it.
fn place(borders: &[f32], x: f32) -> (usize, f32) {
    let i = borders.partition_point(|&b| b <= x).clamp(1, borders.len() - 1) - 1;
    (i, ((x - borders[i]) / (borders[i + 1] - borders[i])).clamp(0.0, 1.0))
}

/// Borders with pieces no larger than `most` between.
fn split(borders: &[f32], most: f32) -> Vec<f32> {
    let mut all = vec![borders[0]];
    for pair in borders.windows(2) {
        let n = ((pair[1] - pair[0]) / most).ceil().max(1.0) as u16;
        all.extend((1..n).map(|k| pair[0] + (pair[1] - pair[0]) * (f32::from(k) / f32::from(n))));
        all.push(pair[1]);
    }
    all
}

/// Horizontal angles from 0 to 360 degrees, and for each the measured one that it repeats.
fn unfold(p: &Photometry) -> (Vec<f32>, Vec<usize>) {
    let measured: Vec<(f32, usize)> = p.horizontal.iter().copied().zip(0..).collect();
    let mirrored = |about: f32, of: &[(f32, usize)]| {
        let mut back: Vec<_> = of.iter().rev().map(|&(a, i)| (2.0 * about - a, i)).collect();
        back.retain(|(a, _)| of.iter().all(|(b, _)| a != b));
        [of, &back].concat()
    };
    let last = p.horizontal[p.horizontal.len() - 1];
    let all = match (p.horizontal[0], last) {
        (_, 0.0) => vec![(0.0, 0), (360.0, 0)],
        (_, 90.0) => mirrored(180.0, &mirrored(90.0, &measured)),
        (_, 180.0) => mirrored(180.0, &measured),
        // About the plane of 90 and 270: up to 450, of which the end is the beginning.
        (90.0, _) => {
            let turned = |(a, i): (f32, usize)| if a >= 360.0 { (a - 360.0, i) } else { (a, i) };
            let mut all: Vec<_> = mirrored(270.0, &measured).into_iter().map(turned).collect();
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
            all.dedup_by_key(|(a, _)| *a);
            all.push((360.0, all[0].1));
            all
        }
        _ => measured,
    };
    all.into_iter().unzip()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn web(horizontal: &[f32], candela: &[f32]) -> Web {
        let vertical = vec![0.0, 60.0, 180.0];
        Web::new(&Photometry { vertical, horizontal: horizontal.to_vec(), candela: candela.to_vec() })
            .unwrap()
    }

    fn towards(phi: f32, theta: f32) -> Dir {
        let ((sp, cp), (st, ct)) = (trig::sin_cos(phi.to_radians()), trig::sin_cos(theta.to_radians()));
        Dir(Vec3::new(st * cp, st * sp, -ct))
    }

    #[test]
    fn symmetries_are_unfolded() {
        let quarter = web(&[0.0, 90.0], &[9.0, 4.0, 0.0, 9.0, 2.0, 0.0]);
        let half = web(&[0.0, 90.0, 180.0], &[9.0, 4.0, 0.0, 9.0, 2.0, 0.0, 9.0, 4.0, 0.0]);
        let other = web(&[90.0, 180.0, 270.0], &[9.0, 2.0, 0.0, 9.0, 4.0, 0.0, 9.0, 2.0, 0.0]);
        for phi in [0.1, 30.0, 90.0, 100.0, 179.0, 200.0, 290.0, 359.9] {
            let folded = 90.0_f32 - ((phi % 180.0) - 90.0_f32).abs();
            for (theta, down, up) in [(30.0, 4.5, 0.5), (60.0, 0.0, 1.0), (120.0, 0.0, 0.5)] {
                let expected = down + up * (4.0 - 2.0 * folded / 90.0);
                for w in [&quarter, &half, &other] {
                    let value = w.at(towards(phi, theta));
                    assert!((value - expected).abs() < 1e-3, "{phi} {theta}: {value} {expected}");
                }
            }
        }
        let round = web(&[0.0], &[9.0, 4.0, 0.0]);
        assert!((round.at(towards(123.0, 30.0)) - 6.5).abs() < 1e-4);
    }

    /// ∫ of a straight line in θ over the sphere, in closed form.
    #[test]
    fn power_is_the_integral() {
        let (theta, pi) = (60.0_f32.to_radians(), PI);
        let round = web(&[0.0], &[1.0, 1.0, 0.0]);
        // One up to θ₁, then a line to zero at π: 1 − cos θ₁ + cos θ₁ + sin θ₁ / (π − θ₁).
        let expected = TAU * (1.0 + trig::sin(theta) / (pi - theta));
        assert!((round.power() - expected).abs() < 1e-4, "{} {expected}", round.power());
    }

    #[test]
    fn what_is_drawn_shines_and_has_its_density() {
        let w = web(&[0.0, 10.0, 360.0], &[0.0, 0.0, 3.0, 0.0, 5.0, 0.0, 0.0, 0.0, 3.0]);
        for i in 0..10_000_u16 {
            let u = [(f32::from(i) + 0.5) / 10_000.0, f32::from(i % 100) / 100.0];
            let d = w.sample(u);
            assert!(w.pdf(d) > 0.0 && w.at(d) >= 0.0, "{d:?}");
            // Intensity over density: never far above the power.
            assert!(w.at(d) / w.pdf(d) < 1.6 * w.power(), "{d:?}");
        }
    }
}
