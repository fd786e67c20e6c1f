//! The warps of diffuse surfaces and of lamps for sixteen paths at once, with the operations of the single ones.

use std::f32::consts::FRAC_PI_4;

use math::DVec3;
use math::lanes::{Doubles, Floats, Vec3Lanes, atan2, sin_cos_within_an_eighth};

use super::Rectangle;
use super::spherical::SMALLEST;

/// [`super::concentric_disk`].
#[inline(always)]
pub fn concentric_disk_lanes<F: Floats>(u: [F; 2]) -> [F; 2] {
    let (one, two, zero) = (F::splat(1.0), F::splat(2.0), F::splat(0.0));
    let (x, y) = (two * u[0] - one, two * u[1] - one);
    let exchange = !x.abs().gt(y.abs());
    let (along, across) = (y.or_else(exchange, x), x.or_else(exchange, y));
    let (sin, cos) = sin_cos_within_an_eighth(F::splat(FRAC_PI_4) * (across / along));
    let (a, b) = (along * cos, along * sin);
    let is_middle = along.eq(zero);
    [zero.or_else(is_middle, b.or_else(exchange, a)), zero.or_else(is_middle, a.or_else(exchange, b))]
}

/// [`super::cosine_hemisphere`].
#[inline(always)]
pub fn cosine_hemisphere_lanes<F: Floats>(u: [F; 2]) -> Vec3Lanes<F> {
    let [x, y] = concentric_disk_lanes(u);
    Vec3Lanes::new(x, y, (F::splat(1.0) - (x * x + y * y)).safe_sqrt())
}

/// [`super::uniform_triangle`].
#[inline(always)]
pub fn uniform_triangle_lanes<F: Floats>(u: [F; 2]) -> [F; 3] {
    let half = F::splat(0.5);
    let lower = u[0].lt(u[1]);
    let (a, b) = (half * u[0], half * u[1]);
    let (b0, b1) = (a.or_else(lower, u[0] - b), (u[1] - a).or_else(lower, b));
    [b0, b1, (F::splat(1.0) - b0 - b1).max(F::splat(0.0))]
}

/// One rectangle seen from sixteen points: see [`super::SphericalRectangle`].
#[derive(Clone, Copy)]
pub struct SphericalRectangleLanes<F: Floats> {
    x: [F::Doubles; 2],
    y: [F::Doubles; 2],
    z: F::Doubles,
    before: [F::Doubles; 2],
    solid_angle: F::Doubles,
    inv_size: [F::Doubles; 2],
}

impl Rectangle {
    /// [`Rectangle::seen_from`] of sixteen points, and from which of them it is seen.
    #[inline(always)]
    pub fn seen_from_lanes<F: Floats>(&self, from: Vec3Lanes<F>) -> (SphericalRectangleLanes<F>, F::Mask) {
        let c = F::Doubles::splat;
        let d = [
            c(self.corner.x) - from.x.doubles(),
            c(self.corner.y) - from.y.doubles(),
            c(self.corner.z) - from.z.doubles(),
        ];
        // (Not by `map`, of which calls are left.)
        let [along_x, along_y, along_z] = self.axes;
        let (x0, y0) = (dot::<F>(d, along_x), dot::<F>(d, along_y));
        let z = dot::<F>(d, along_z).abs();
        let (x, y) = ([x0, x0 + c(self.size[0])], [y0, y0 + c(self.size[1])]);
        let before = between::<F>(x[0], y, z);
        let whole = times::<F>(between::<F>(x[1], y, z), [before[0], -before[1]]);
        let zero = c(0.0);
        let is_inside = x[0].lt(zero) & zero.lt(x[1]) & y[0].lt(zero) & zero.lt(y[1]);
        let angle = argument::<F>(whole);
        let past_half = angle.lt(zero) & is_inside;
        let solid_angle = (angle + c(std::f64::consts::TAU)).or_else(past_half, angle);
        let usable = zero.lt(z) & c(SMALLEST).le(solid_angle);
        let inv_size = [c(self.inv_size[0]), c(self.inv_size[1])];
        (SphericalRectangleLanes { x, y, z, before, solid_angle, inv_size }, usable)
    }
}

impl<F: Floats> SphericalRectangleLanes<F> {
    /// See [`super::SphericalRectangle::solid_angle`].
    #[inline(always)]
    pub fn solid_angle(&self) -> F {
        self.solid_angle.floats()
    }

    /// The density of every direction to the rectangle, per steradian.
    #[inline(always)]
    pub fn pdf(&self) -> F {
        (F::Doubles::splat(1.0) / self.solid_angle).floats()
    }

    /// [`super::SphericalRectangle::coordinates`], and where they are right: elsewhere, where the angle is large, they must be had
    /// one by one.
    #[inline(always)]
    pub fn coordinates(&self, u: [F; 2]) -> ([F; 2], F::Mask) {
        let c = F::Doubles::splat;
        let one = c(1.0);
        let z2 = self.z * self.z;
        let [y0, y1] = self.y;
        let (r0, r1) = ((y0 * y0 + z2).sqrt(), (y1 * y1 + z2).sqrt());
        let size = (self.x[0] * self.x[0] + z2) * r0 * r1;
        let angle = c(0.5) * u[0].doubles() * self.solid_angle;
        let half = times::<F>(half::<F>(self.before, size), turn::<F>(angle));
        let half2 = half[0] * half[0] + half[1] * half[1];
        let rr = r0 * r1;
        let (difference, product) = (y1 * r0 - y0 * r1, c(4.0) * y0 * y1 * rr);
        let side2 = half2 * (difference * difference * half2 + product * half[1] * half[1]);
        let n = c(2.0) * half[1] * half[0] * rr;
        let x = n * self.z / (side2 - n * n).max(c(1e-300)).sqrt();
        let x = clamp::<F>(x, self.x);

        let d2 = x * x + z2;
        let (h0, h1) = (sine::<F>(y0, d2), sine::<F>(y1, d2));
        let h = h0 + u[1].doubles() * (h1 - h0);
        let y = h * (d2 / (one - h * h).max(c(1e-300))).sqrt();
        let y = clamp::<F>(y, self.y);
        let [x, y] = [(x - self.x[0]) * self.inv_size[0], (y - self.y[0]) * self.inv_size[1]];
        ([x.floats(), y.floats()], angle.le(c(super::spherical::SERIES_MOST)))
    }
}

#[inline(always)]
fn clamp<F: Floats>(x: F::Doubles, [lo, hi]: [F::Doubles; 2]) -> F::Doubles {
    let x = lo.or_else(x.lt(lo), x);
    hi.or_else(hi.lt(x), x)
}

#[inline(always)]
fn turn<F: Floats>(angle: F::Doubles) -> [F::Doubles; 2] {
    let c = F::Doubles::splat;
    let one = c(1.0);
    let t = angle * angle;
    let re = one - series::<F>(t, [1.0 / 90.0, 1.0 / 56.0, 1.0 / 30.0, 1.0 / 12.0, 1.0 / 2.0]);
    let im = angle * (one - series::<F>(t, [1.0 / 110.0, 1.0 / 72.0, 1.0 / 42.0, 1.0 / 20.0, 1.0 / 6.0]));
    [re, im]
}

#[inline(always)]
fn series<F: Floats>(t: F::Doubles, k: [f64; 5]) -> F::Doubles {
    let c = F::Doubles::splat;
    let mut sum = c(0.0);
    let mut i = 0;
    while i < 5 {
        sum = (c(1.0) - sum) * t * c(k[i]);
        i += 1;
    }
    sum
}

#[inline(always)]
fn dot<F: Floats>(d: [F::Doubles; 3], axis: DVec3) -> F::Doubles {
    let c = F::Doubles::splat;
    d[0] * c(axis.x) + d[1] * c(axis.y) + d[2] * c(axis.z)
}

#[inline(always)]
fn times<F: Floats>(a: [F::Doubles; 2], b: [F::Doubles; 2]) -> [F::Doubles; 2] {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

#[inline(always)]
fn argument<F: Floats>([re, im]: [F::Doubles; 2]) -> F::Doubles {
    let scale = F::Doubles::splat(1.0) / (re.abs() + im.abs());
    atan2((im * scale).floats(), (re * scale).floats()).doubles()
}

#[inline(always)]
fn half<F: Floats>([re, im]: [F::Doubles; 2], size: F::Doubles) -> [F::Doubles; 2] {
    let is_right = F::Doubles::splat(0.0).le(re);
    [(size + re).or_else(is_right, im.abs()), im.or_else(is_right, (size - re).copysign(im))]
}

#[inline(always)]
fn between<F: Floats>(x: F::Doubles, [y0, y1]: [F::Doubles; 2], z: F::Doubles) -> [F::Doubles; 2] {
    let (re0, re1) = (z * (x * x + y0 * y0 + z * z).sqrt(), z * (x * x + y1 * y1 + z * z).sqrt());
    times::<F>([re1, x * y1], [re0, -(x * y0)])
}

#[inline(always)]
fn sine<F: Floats>(y: F::Doubles, d2: F::Doubles) -> F::Doubles {
    y / (d2 + y * y).sqrt()
}

#[cfg(test)]
mod tests {
    use math::lanes::{LANES, Mask, PortableFloats};
    use math::{Point, Vec3, hash};

    use super::*;
    use crate::warp;

    fn numbers(key: u64) -> [f32; LANES] {
        let mut out = [0.0; LANES];
        for (i, x) in out.iter_mut().enumerate() {
            *x = hash::unit_f32((hash::combine(key, i as u64) >> 32) as u32);
        }
        out
    }

    fn stored(x: PortableFloats) -> [f32; LANES] {
        let mut out = [0.0; LANES];
        x.store(&mut out);
        out
    }

    #[test]
    fn lanes_have_the_bits_of_single_warps() {
        for key in 0..2000 {
            let (mut u0, mut u1) = (numbers(2 * key), numbers(2 * key + 1));
            if key == 0 {
                // Middle, edges, diagonals.
                u0[..6].copy_from_slice(&[0.5, 0.0, 0.0, 0.25, 0.75, 0.5]);
                u1[..6].copy_from_slice(&[0.5, 0.0, 0.5, 0.25, 0.25, 0.0]);
            }
            let u = [PortableFloats::load(&u0), PortableFloats::load(&u1)];
            let w = cosine_hemisphere_lanes(u);
            let w = [stored(w.x), stored(w.y), stored(w.z)];
            let b = uniform_triangle_lanes(u).map(stored);
            for i in 0..LANES {
                let u = [u0[i], u1[i]];
                assert_eq!([w[0][i], w[1][i], w[2][i]], warp::cosine_hemisphere(u).0.to_array());
                assert_eq!([b[0][i], b[1][i], b[2][i]], warp::uniform_triangle(u));
            }
        }
    }

    #[test]
    fn lanes_see_a_rectangle_as_single_points_do() {
        let edges = [Vec3::new(0.5, 0.1, 0.0), Vec3::new(-0.1, 0.5, 0.0)];
        let rectangle = Rectangle::new(Point::new(-0.2, 0.1, 1.0), edges).unwrap();
        let mut series = 0;
        for key in 0..2000 {
            let at = [0, 1, 2].map(|i| numbers(5 * key + i).map(|x| 3.0 * x - 1.5));
            let (u0, u1) = (numbers(5 * key + 3), numbers(5 * key + 4));
            let [x, y, z] = at.map(|a| PortableFloats::load(&a));
            let (seen, usable) = rectangle.seen_from_lanes::<PortableFloats>(Vec3Lanes::new(x, y, z));
            let (coordinates, is_right) = seen.coordinates([u0, u1].map(|u| PortableFloats::load(&u)));
            let [c0, c1] = coordinates.map(stored);
            let (angle, pdf) = (stored(seen.solid_angle()), stored(seen.pdf()));
            for i in 0..LANES {
                let single = rectangle.seen_from(Point::new(at[0][i], at[1][i], at[2][i]));
                assert_eq!(usable.bits() >> i & 1 == 1, single.is_some());
                let Some(single) = single else { continue };
                assert_eq!((angle[i], pdf[i]), (single.solid_angle(), single.pdf().value()));
                if is_right.bits() >> i & 1 == 1 {
                    series += 1;
                    assert_eq!([c0[i], c1[i]], single.coordinates([u0[i], u1[i]]));
                }
            }
        }
        assert!(series > 20_000, "{series}");
    }
}
