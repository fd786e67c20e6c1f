//! Densities on a line, by inversion of their distribution functions, and the bilinear patch made of two of them.

use math::trig;

use crate::{Length, Pdf, PrimarySpace};

/// On [0, 1], with density in proportion to the line from `a` at 0 to `b` at 1; neither may be negative, and the line
/// that is zero everywhere counts as constant.
#[must_use]
pub fn linear(u: f32, a: f32, b: f32) -> f32 {
    // The root of F(x) = (a x + (b − a) x²/2) / ((a + b)/2) = u, in the form that does not cancel.
    // Only the ratio of a and b counts; squares of tiny values would be lost.
    let (a, b) = (a / a.max(b), b / a.max(b));
    let root = (a * a * (1.0 - u) + b * b * u).sqrt();
    let x = u * (a + b) / (a + root);
    if x.is_finite() { x.min(BELOW_ONE) } else { u }
}

/// The `u` of a point: the distribution function.
#[must_use]
pub fn linear_inverse(x: f32, a: f32, b: f32) -> f32 {
    if a + b > 0.0 { x * (a * (2.0 - x) + b * x) / (a + b) } else { x }
}

/// Density of [`linear`].
#[must_use]
pub fn linear_pdf(x: f32, a: f32, b: f32) -> Pdf<PrimarySpace> {
    if !(0.0..=1.0).contains(&x) {
        return Pdf::ZERO;
    }
    Pdf::new(if a + b > 0.0 { 2.0 * (a * (1.0 - x) + b * x) / (a + b) } else { 1.0 })
}

/// On [−r, r], falling off linearly from the middle.
#[must_use]
pub fn tent(u: f32, r: f32) -> f32 {
    if u < 0.5 { r * (trig::safe_sqrt(2.0 * u) - 1.0) } else { r * (1.0 - trig::safe_sqrt(2.0 * (1.0 - u))) }
}

/// The `u` of a point.
#[must_use]
pub fn tent_inverse(x: f32, r: f32) -> f32 {
    let t = (1.0 - x.abs() / r).max(0.0);
    if x < 0.0 { 0.5 * t * t } else { 1.0 - 0.5 * t * t }
}

/// Density of [`tent`].
#[must_use]
pub fn tent_pdf(x: f32, r: f32) -> Pdf<Length> {
    Pdf::new((r - x.abs()).max(0.0) / (r * r))
}

/// A free path: on [0, ∞), density σ exp(−σ x).
#[must_use]
pub fn exponential(u: f32, sigma: f32) -> f32 {
    -trig::ln(1.0 - u) / sigma
}

/// The `u` of a path length.
#[must_use]
pub fn exponential_inverse(x: f32, sigma: f32) -> f32 {
    1.0 - trig::exp(-sigma * x)
}

/// Density of [`exponential`].
#[must_use]
pub fn exponential_pdf(x: f32, sigma: f32) -> Pdf<Length> {
    Pdf::new(if x >= 0.0 { sigma * trig::exp(-sigma * x) } else { 0.0 })
}

/// A free path that ends before `x_max`: on [0, `x_max`), density in proportion to exp(−σ x).
#[must_use]
pub fn truncated_exponential(u: f32, sigma: f32, x_max: f32) -> f32 {
    let tau = sigma * x_max;
    // A thin stretch is uniform to within rounding, and the logarithm would have no bits.
    if tau < 1e-4 {
        return u * x_max;
    }
    (-trig::ln(1.0 - u * (1.0 - trig::exp(-tau))) / sigma).min(x_max)
}

/// The `u` of a path length.
#[must_use]
pub fn truncated_exponential_inverse(x: f32, sigma: f32, x_max: f32) -> f32 {
    let tau = sigma * x_max;
    if tau < 1e-4 { x / x_max } else { (1.0 - trig::exp(-sigma * x)) / (1.0 - trig::exp(-tau)) }
}

/// Density of [`truncated_exponential`].
#[must_use]
pub fn truncated_exponential_pdf(x: f32, sigma: f32, x_max: f32) -> Pdf<Length> {
    let tau = sigma * x_max;
    if !(0.0..=x_max).contains(&x) {
        Pdf::ZERO
    } else if tau < 1e-4 {
        Pdf::new(1.0 / x_max)
    } else {
        Pdf::new(sigma * trig::exp(-sigma * x) / (1.0 - trig::exp(-tau)))
    }
}

/// On [lo, hi] with 0 < lo < hi, density in proportion to x^`exponent`.
#[must_use]
pub fn power_law(u: f32, [lo, hi]: [f32; 2], exponent: f32) -> f32 {
    let n = exponent + 1.0;
    let x = if n.abs() < 1e-4 {
        lo * trig::pow(hi / lo, u)
    } else {
        // (lo^n + u (hi^n − lo^n))^{1/n}, in units of lo so that the powers stay small.
        lo * trig::pow(1.0 + u * (trig::pow(hi / lo, n) - 1.0), 1.0 / n)
    };
    x.clamp(lo, hi)
}

/// The `u` of a point.
#[must_use]
pub fn power_law_inverse(x: f32, [lo, hi]: [f32; 2], exponent: f32) -> f32 {
    let n = exponent + 1.0;
    if n.abs() < 1e-4 {
        trig::ln(x / lo) / trig::ln(hi / lo)
    } else {
        (trig::pow(x / lo, n) - 1.0) / (trig::pow(hi / lo, n) - 1.0)
    }
}

/// Density of [`power_law`].
#[must_use]
pub fn power_law_pdf(x: f32, [lo, hi]: [f32; 2], exponent: f32) -> Pdf<Length> {
    if !(lo..=hi).contains(&x) {
        return Pdf::ZERO;
    }
    let n = exponent + 1.0;
    Pdf::new(if n.abs() < 1e-4 {
        1.0 / (x * trig::ln(hi / lo))
    } else {
        n * trig::pow(x / lo, exponent) / (lo * (trig::pow(hi / lo, n) - 1.0))
    })
}

/// On [lo, hi] (hi may be infinite), with density in proportion to 1 / (h² + x²): as a point at distance h sees the
/// line by equal angles; x is measured from the foot of its perpendicular [Kulla2012].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equiangular {
    range: [f32; 2],
    h: f32,
    /// The angle under which the point sees the piece.
    angle: f32,
}

impl Equiangular {
    /// For a piece of a line and a point at distance `h` > 0.
    #[must_use]
    pub fn new(range: [f32; 2], h: f32) -> Self {
        Self { range, h, angle: seen_angle(range, h) }
    }

    /// The point of a number.
    #[must_use]
    pub fn sample(&self, u: f32) -> f32 {
        // x − lo = h (tan (θ₀ + φ) − tan θ₀), in the form that does not cancel.
        let ([lo, hi], h) = (self.range, self.h);
        let (sin, cos) = trig::sin_cos(u * self.angle);
        let x = lo + sin * (h * h + lo * lo) / (h * cos - lo * sin).max(f32::MIN_POSITIVE);
        x.clamp(lo, hi.min(f32::MAX))
    }

    /// The `u` of a point.
    #[must_use]
    pub fn inverse(&self, x: f32) -> f32 {
        seen_angle([self.range[0], x], self.h) / self.angle
    }

    /// Density of [`Equiangular::sample`].
    #[must_use]
    pub fn pdf(&self, x: f32) -> Pdf<Length> {
        if !(self.range[0]..=self.range[1]).contains(&x) {
            return Pdf::ZERO;
        }
        let pdf = self.h / (self.angle * (self.h * self.h + x * x));
        if pdf.is_finite() { Pdf::new(pdf) } else { Pdf::ZERO }
    }
}

/// The angle under which a point at distance `h` sees a piece of a line.
fn seen_angle([lo, hi]: [f32; 2], h: f32) -> f32 {
    if hi.is_finite() { trig::atan2(h * (hi - lo), h * h + lo * hi) } else { trig::atan2(h, lo) }
}

/// On the unit square, in proportion to the bilinear patch with values `w` at (0,0), (1,0), (0,1), (1,1), none negative.
#[must_use]
pub fn bilinear(u: [f32; 2], w: [f32; 4]) -> [f32; 2] {
    // The marginal along y is the line between the sums of the two rows.
    let y = linear(u[1], w[0] + w[1], w[2] + w[3]);
    let x = linear(u[0], lerp(w[0], w[2], y), lerp(w[1], w[3], y));
    [x, y]
}

/// The `u` of a point.
#[must_use]
pub fn bilinear_inverse(p: [f32; 2], w: [f32; 4]) -> [f32; 2] {
    let [x, y] = p;
    [linear_inverse(x, lerp(w[0], w[2], y), lerp(w[1], w[3], y)), linear_inverse(y, w[0] + w[1], w[2] + w[3])]
}

/// Density of [`bilinear`].
#[must_use]
pub fn bilinear_pdf(p: [f32; 2], w: [f32; 4]) -> Pdf<PrimarySpace> {
    let [x, y] = p;
    if !(0.0..=1.0).contains(&x) || !(0.0..=1.0).contains(&y) {
        return Pdf::ZERO;
    }
    let sum = w[0] + w[1] + w[2] + w[3];
    let value = lerp(lerp(w[0], w[1], x), lerp(w[2], w[3], x), y);
    Pdf::new(if sum > 0.0 { 4.0 * value / sum } else { 1.0 })
}

const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a * (1.0 - t) + b * t
}
