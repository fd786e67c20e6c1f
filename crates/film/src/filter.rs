//! Reconstruction filters: how much a sample counts in the pixels around it.
//!
//! | filter   | source                                            |
//! |----------|---------------------------------------------------|
//! | Gaussian | truncated by subtracting its value at the radius [PBR4e, sec. 8.8] |
//! | Mitchell | [Mitchell1988]                                    |
//! | Sinc     | windowed by the first lobe of a wider sinc: Lanczos [Duchon1979] |
//!
//! Parameters and defaults are those of pbrt-v4, positions are relative to the pixel's centre, in pixels. All filters
//! are products of two functions of one axis. A sample belongs to the pixels whose centres lie in a half-open box
//! around it, so that a box of half a pixel takes every sample exactly once.
//!
//! Departs from pbrt-v4, which draws samples in proportion to the filter: ours spreads each sample over the footprint
//! with weights, tabulated along each axis (512 steps, linear between) and normalised to integrate to one.

use serde::{Deserialize, Serialize};

use math::trig::f64 as trig;

/// A reconstruction filter with its half-widths along x and y.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Filter {
    /// Constant.
    Box {
        /// Half-widths, in pixels.
        radius: [f32; 2],
    },
    /// Falls off linearly.
    Triangle {
        /// Half-widths, in pixels.
        radius: [f32; 2],
    },
    /// A Gaussian that reaches zero at the radius.
    Gaussian {
        /// Half-widths, in pixels.
        radius: [f32; 2],
        /// Standard deviation, in pixels.
        sigma: f32,
    },
    /// Mitchell and Netravali's cubic, with negative lobes.
    Mitchell {
        /// Half-widths, in pixels.
        radius: [f32; 2],
        /// Blur.
        b: f32,
        /// Ringing.
        c: f32,
    },
    /// Lanczos-windowed sinc, with negative lobes.
    Sinc {
        /// Half-widths, in pixels.
        radius: [f32; 2],
        /// Half-width of the window's lobe.
        tau: f32,
    },
}

impl Default for Filter {
    fn default() -> Self {
        Self::gaussian()
    }
}

/// The widest filter, in pixels.
pub const MAX_RADIUS: f32 = 16.0;

impl Filter {
    /// The box of one pixel.
    #[must_use]
    pub const fn pixel_box() -> Self {
        Self::Box { radius: [0.5; 2] }
    }

    /// pbrt-v4's `"triangle"`.
    #[must_use]
    pub const fn triangle() -> Self {
        Self::Triangle { radius: [2.0; 2] }
    }

    /// pbrt-v4's `"gaussian"`, the default.
    #[must_use]
    pub const fn gaussian() -> Self {
        Self::Gaussian { radius: [1.5; 2], sigma: 0.5 }
    }

    /// pbrt-v4's `"mitchell"`.
    #[must_use]
    pub const fn mitchell() -> Self {
        Self::Mitchell { radius: [2.0; 2], b: 1.0 / 3.0, c: 1.0 / 3.0 }
    }

    /// pbrt-v4's `"sinc"`.
    #[must_use]
    pub const fn sinc() -> Self {
        Self::Sinc { radius: [4.0; 2], tau: 3.0 }
    }

    /// Half-widths along x and y, in pixels.
    #[must_use]
    pub const fn radius(&self) -> [f32; 2] {
        match *self {
            Self::Box { radius }
            | Self::Triangle { radius }
            | Self::Gaussian { radius, .. }
            | Self::Mitchell { radius, .. }
            | Self::Sinc { radius, .. } => radius,
        }
    }

    /// Does every sample count in its own pixel alone, with weight one?
    #[must_use]
    pub fn is_pixel_box(&self) -> bool {
        *self == Self::pixel_box()
    }

    /// How many pixels away a sample may still count.
    #[must_use]
    pub fn reach(&self) -> i32 {
        let [x, y] = self.radius();
        (x.max(y) - 0.5).ceil().max(0.0) as i32
    }

    /// The filter's value at an offset from the centre, not normalised.
    #[must_use]
    pub fn evaluate(&self, d: [f32; 2]) -> f32 {
        (self.along(0, f64::from(d[0])) * self.along(1, f64::from(d[1]))) as f32
    }

    /// Its integral over the plane.
    #[must_use]
    pub fn integral(&self) -> f32 {
        let axis = |a: usize| AxisTable::sample(self, a).1;
        (axis(0) * axis(1)) as f32
    }

    /// A sentence on what is wrong with the parameters, if anything is.
    pub(crate) fn check(&self) -> Result<(), String> {
        let [x, y] = self.radius();
        for (axis, r) in [("x", x), ("y", y)] {
            if !(r > 0.0 && r <= MAX_RADIUS) {
                return Err(format!("filter {axis}radius {r} is outside (0, {MAX_RADIUS}]"));
            }
        }
        match *self {
            Self::Gaussian { sigma, .. } if !(sigma > 0.0 && sigma.is_finite()) => {
                Err(format!("filter sigma {sigma} is not positive"))
            }
            Self::Sinc { tau, .. } if !(tau > 0.0 && tau.is_finite()) => {
                Err(format!("filter tau {tau} is not positive"))
            }
            Self::Mitchell { b, c, .. } if !(b.is_finite() && c.is_finite()) => {
                Err(format!("filter B {b} and C {c} are not finite"))
            }
            Self::Box { .. }
            | Self::Triangle { .. }
            | Self::Gaussian { .. }
            | Self::Mitchell { .. }
            | Self::Sinc { .. } => {
                let [ix, iy] = [0, 1].map(|a| AxisTable::sample(self, a).1);
                let usable = |i: f64| i > 1e-9 && i.is_finite();
                if usable(ix) && usable(iy) { Ok(()) } else { Err("the filter integrates to nothing".into()) }
            }
        }
    }

    /// The factor of one axis.
    fn along(&self, axis: usize, d: f64) -> f64 {
        let r = f64::from(self.radius()[axis]);
        let d = d.abs();
        if d > r {
            return 0.0;
        }
        match *self {
            Self::Box { .. } => 1.0,
            Self::Triangle { .. } => r - d,
            Self::Gaussian { sigma, .. } => gaussian(d, sigma) - gaussian(r, sigma),
            Self::Mitchell { b, c, .. } => mitchell(2.0 * d / r, f64::from(b), f64::from(c)),
            Self::Sinc { tau, .. } => sinc(d) * sinc(d / f64::from(tau)),
        }
    }
}

fn gaussian(x: f64, sigma: f32) -> f64 {
    let s = f64::from(sigma);
    trig::exp(-x * x / (2.0 * s * s)) / (std::f64::consts::TAU.sqrt() * s)
}

/// [Mitchell1988], the family of cubics on [−2, 2].
fn mitchell(x: f64, b: f64, c: f64) -> f64 {
    if x <= 1.0 {
        ((12.0 - 9.0 * b - 6.0 * c) * x * x * x + (-18.0 + 12.0 * b + 6.0 * c) * x * x + (6.0 - 2.0 * b))
            / 6.0
    } else if x <= 2.0 {
        ((-b - 6.0 * c) * x * x * x
            + (6.0 * b + 30.0 * c) * x * x
            + (-12.0 * b - 48.0 * c) * x
            + (8.0 * b + 24.0 * c))
            / 6.0
    } else {
        0.0
    }
}

/// sin(πx) / (πx).
fn sinc(x: f64) -> f64 {
    let t = std::f64::consts::PI * x;
    if t.abs() < 1e-5 { 1.0 - t * t / 6.0 } else { trig::sin(t) / t }
}

/// Both axes of a filter, tabulated.
#[derive(Clone, Debug)]
pub(crate) struct FilterTable {
    axes: [AxisTable; 2],
}

/// The pixels that a sample reaches along one axis, relative to its own, and what it weighs there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footprint {
    /// The first pixel.
    pub(crate) first: i32,
    /// How many.
    pub(crate) n: usize,
    /// Their weights.
    pub(crate) weights: [f32; 2 * MAX_RADIUS as usize + 2],
}

impl FilterTable {
    pub(crate) fn new(filter: &Filter) -> Self {
        Self { axes: [0, 1].map(|a| AxisTable::new(filter, a)) }
    }

    /// For a sample at `offset` ∈ [0, 1) in its pixel.
    #[inline]
    pub(crate) fn footprint(&self, axis: usize, offset: f32) -> Footprint {
        let table = &self.axes[axis];
        let (low, high) = (offset - 0.5 - table.radius, offset - 0.5 + table.radius);
        let (first, last) = (low.floor() as i32 + 1, high.floor() as i32);
        let mut weights = [0.0; 2 * MAX_RADIUS as usize + 2];
        let n = ((last - first + 1).max(0) as usize).min(weights.len());
        for (k, w) in weights[..n].iter_mut().enumerate() {
            *w = table.at(offset - 0.5 - (first + k as i32) as f32);
        }
        Footprint { first, n, weights }
    }
}

#[derive(Clone, Debug)]
struct AxisTable {
    radius: f32,
    steps_per_pixel: f32,
    /// At 0, r/512, …, r, and once more.
    values: Vec<f32>,
}

const STEPS: usize = 512;

impl AxisTable {
    fn new(filter: &Filter, axis: usize) -> Self {
        let radius = filter.radius()[axis];
        let (values, integral) = Self::sample(filter, axis);
        let mut values: Vec<f32> = values.iter().map(|v| (v / integral) as f32).collect();
        values.push(values[STEPS]);
        Self { radius, steps_per_pixel: STEPS as f32 / radius, values }
    }

    /// Values along the axis and the integral of the line between them, from −r to r.
    fn sample(filter: &Filter, axis: usize) -> (Vec<f64>, f64) {
        let step = f64::from(filter.radius()[axis]) / STEPS as f64;
        let values: Vec<f64> = (0..=STEPS).map(|i| filter.along(axis, i as f64 * step)).collect();
        let inner: f64 = values[1..STEPS].iter().sum();
        let integral = step * (2.0 * inner + values[0] + values[STEPS]);
        (values, integral)
    }

    #[inline]
    fn at(&self, d: f32) -> f32 {
        let x = (d.abs() * self.steps_per_pixel).min(STEPS as f32);
        let i = x as usize;
        let f = x - i as f32;
        self.values[i] * (1.0 - f) + self.values[i + 1] * f
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Filter; 6] = [
        Filter::pixel_box(),
        Filter::Box { radius: [1.3, 0.7] },
        Filter::triangle(),
        Filter::gaussian(),
        Filter::mitchell(),
        Filter::sinc(),
    ];

    #[test]
    fn integrals_are_those_of_the_formulas() {
        assert!((Filter::pixel_box().integral() - 1.0).abs() < 1e-6);
        assert!((Filter::triangle().integral() - 16.0).abs() < 1e-4);
        // Mitchell's cubic integrates to one on [−2, 2] for all B and C.
        assert!((Filter::mitchell().integral() - 1.0).abs() < 1e-4);
        let axis = libm_erf(1.5 / (0.5 * std::f64::consts::SQRT_2)) - 3.0 * gaussian(1.5, 0.5);
        assert!((f64::from(Filter::gaussian().integral()) - axis * axis).abs() < 1e-5);
    }

    fn libm_erf(x: f64) -> f64 {
        math::trig::f64::erf(x)
    }

    #[test]
    fn tables_follow_the_filter() {
        for f in ALL {
            let t = FilterTable::new(&f);
            let scale = f.integral();
            for i in 0..200 {
                let o = [(i as f32 + 0.5) / 200.0, (i as f32 * 0.618_034).fract()];
                let (fx, fy) = (t.footprint(0, o[0]), t.footprint(1, o[1]));
                for a in 0..fx.n {
                    for b in 0..fy.n {
                        let d = [
                            o[0] - 0.5 - (fx.first + a as i32) as f32,
                            o[1] - 0.5 - (fy.first + b as i32) as f32,
                        ];
                        let (w, v) = (fx.weights[a] * fy.weights[b], f.evaluate(d) / scale);
                        assert!((w - v).abs() < 2e-4, "{f:?} {d:?} {w} {v}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_sample_weighs_one_over_all_pixels_on_average_and_its_footprint_is_whole() {
        for f in ALL {
            let t = FilterTable::new(&f);
            // Fine enough for the edges of the boxes: 2 × 0.71 / n < 1e-5.
            let n = 1 << 18;
            let (mut sum, reach) = ([0.0_f64; 2], f.reach());
            for i in 0..n {
                let o = (i as f32 + 0.5) / n as f32;
                for (axis, sum) in sum.iter_mut().enumerate() {
                    let p = t.footprint(axis, o);
                    assert!(p.first >= -reach && p.first + p.n as i32 - 1 <= reach, "{f:?} {p:?}");
                    *sum += p.weights[..p.n].iter().map(|&w| f64::from(w)).sum::<f64>() / f64::from(n);
                }
            }
            assert!(sum.iter().all(|s| (s - 1.0).abs() < 1e-5), "{f:?} {sum:?}");
        }
    }

    #[test]
    fn the_pixel_box_takes_each_sample_once() {
        let t = FilterTable::new(&Filter::pixel_box());
        for o in [0.0, 1e-7, 0.5, 1.0_f32.next_down()] {
            let p = t.footprint(0, o);
            assert_eq!((p.first, p.n, p.weights[0]), (0, 1, 1.0), "{o}");
        }
    }

    #[test]
    fn bad_parameters_are_refused_with_a_sentence() {
        for f in [
            Filter::Box { radius: [0.0, 0.5] },
            Filter::Box { radius: [f32::NAN, 0.5] },
            Filter::Triangle { radius: [0.5, 100.0] },
            Filter::Gaussian { radius: [1.5; 2], sigma: 0.0 },
            Filter::Sinc { radius: [4.0; 2], tau: -1.0 },
            Filter::Mitchell { radius: [2.0; 2], b: f32::INFINITY, c: 0.0 },
        ] {
            assert!(f.check().is_err(), "{f:?}");
        }
        assert!(ALL.iter().all(|f| f.check().is_ok()));
    }
}
