//! Directions to a triangle or a rectangle, uniform in the solid angle that it subtends.
//!
//! | shape     | idea         | solid angle                                   |
//! |-----------|--------------|-----------------------------------------------|
//! | triangle  | [Arvo1995]   | [VanOosterom1983]                             |
//! | rectangle | [Urena2013]  | four arctangents at once, by complex products |
//!
//! Departs from the papers: the first coordinate is found by formulas of our own that do not cancel when the shape is small or
//! far. Triangle: with half the arc from A to C′ as the unknown, `tan(Ω/2) = p k sin α / (1 + p k cos α)`, where p and
//! k are the tangents of half the arcs that meet at A, is linear in p. Rectangle: the corner's arctangent is an
//! arcsine of the product of the sines b, c of its elevations, and `asin(b₁ c) − asin(b₀ c) = τ` is a triangle
//! with sides b₀, b₁ and angle τ. All is in double precision but for the rectangle's solid angle, which is a factor only, and
//! both have inverses.

use math::trig::f64 as trig;
use math::{DVec3, Dir, Point, Vec3};

use crate::{Pdf, SolidAngle};

/// A sampled direction and the point that it leads to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionOnShape {
    /// From the reference point; unit.
    pub direction: Dir,
    /// The first two barycentric coordinates on a triangle; the position along the two edges of a rectangle, in [0, 1].
    pub coordinates: [f32; 2],
}

/// Below this, in steradian, a shape counts as seen edge-on.
pub(super) const SMALLEST: f64 = 1e-14;
/// Up to this angle its sine and cosine are their series.
pub(super) const SERIES_MOST: f64 = 0.75;

/// A triangle as seen from a point.
#[derive(Clone, Copy, Debug)]
pub struct SphericalTriangle {
    /// Corners relative to the reference point.
    corners: [DVec3; 3],
    /// Unit vectors to them.
    a: DVec3,
    b: DVec3,
    c: DVec3,
    /// Tangent of half the arc from a to b.
    k: f64,
    /// Sine and cosine of the angle at a.
    sin_alpha: f64,
    cos_alpha: f64,
    solid_angle: f64,
}

impl SphericalTriangle {
    /// The triangle with these corners, seen from `from`; `None` if it is seen edge-on.
    #[must_use]
    pub fn new(corners: [Point; 3], from: Point) -> Option<Self> {
        let corners = corners.map(|p| p.0.as_dvec3() - from.0.as_dvec3());
        let [a, b, c] = corners.map(DVec3::try_normalize);
        let (a, b, c) = (a?, b?, c?);
        let solid_angle = solid_angle(a, b, c);
        if solid_angle.is_nan() || solid_angle < SMALLEST {
            return None;
        }
        // The angle at a is that between the planes (a, b) and (a, c).
        let (n_ab, n_ac) = (a.cross(b - a).try_normalize()?, a.cross(c - a).try_normalize()?);
        let (cos_alpha, sin_alpha) = (n_ab.dot(n_ac), n_ab.cross(n_ac).length());
        let k = (a - b).length() / (a + b).length();
        k.is_finite().then_some(Self { corners, a, b, c, k, sin_alpha, cos_alpha, solid_angle })
    }

    /// In steradian.
    #[must_use]
    pub fn solid_angle(&self) -> f32 {
        self.solid_angle as f32
    }

    /// The density of every direction to the triangle.
    #[must_use]
    pub fn pdf(&self) -> Pdf<SolidAngle> {
        Pdf::new((1.0 / self.solid_angle) as f32)
    }

    /// A direction to the triangle.
    #[must_use]
    pub fn sample(&self, u: [f32; 2]) -> DirectionOnShape {
        // c' on the edge from a to c, such that the triangle (a, b, c') has the share u0 of the solid angle:
        // tan(arc/2) = sin(Ω'/2) / (k sin(α − Ω'/2)).
        let (sin, cos) = trig::sin_cos(0.5 * f64::from(u[0]) * self.solid_angle);
        let (s, t) = (sin, self.k * (self.sin_alpha * cos - self.cos_alpha * sin));
        let norm = s * s + t * t;
        let c = self.a * ((t * t - s * s) / norm) + orthogonal(self.c, self.a) * (2.0 * s * t / norm);

        // On the arc from b to c', heights below b are uniform.
        let h = f64::from(u[1]) * 0.5 * (c - self.b).length_squared();
        let w = self.b * (1.0 - h) + orthogonal(c, self.b) * (h * (2.0 - h)).max(0.0).sqrt();
        DirectionOnShape { direction: Dir(w.normalize_or_zero().as_vec3()), coordinates: self.barycentric(w) }
    }

    /// The `u` of a direction to the triangle.
    #[must_use]
    pub fn inverse(&self, w: Dir) -> [f32; 2] {
        let w = w.0.as_dvec3().normalize_or_zero();
        // c' is where the great circle through b and w meets the edge from a to c.
        let Some(c) = self.b.cross(w).cross(self.c.cross(self.a)).try_normalize() else { return [0.0; 2] };
        let c = if c.dot(self.a + self.c) < 0.0 { -c } else { c };
        let u0 = solid_angle(self.a, self.b, c) / self.solid_angle;
        // 1 − w·b = |w − b|² / 2 keeps its bits when both are close.
        let u1 = (w - self.b).length_squared() / (c - self.b).length_squared();
        [u0, u1].map(|x| x.clamp(0.0, 1.0) as f32)
    }

    /// The first two barycentric coordinates of where the direction meets the triangle.
    fn barycentric(&self, w: DVec3) -> [f32; 2] {
        let [p0, p1, p2] = self.corners;
        // Volumes of the tetrahedra that w spans with the edges.
        let (v0, v1, v2) = (w.dot(p1.cross(p2)), w.dot(p2.cross(p0)), w.dot(p0.cross(p1)));
        let sum = v0 + v1 + v2;
        let b0 = (v0 / sum).clamp(0.0, 1.0);
        [b0 as f32, (v1 / sum).clamp(0.0, 1.0 - b0) as f32]
    }
}

/// Of the spherical triangle with these unit corners [VanOosterom1983].
fn solid_angle(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let volume = a.dot((b - a).cross(c - a)).abs();
    2.0 * trig::atan2(volume, 1.0 + a.dot(b) + b.dot(c) + c.dot(a))
}

/// The unit vector in the plane of x and y that is perpendicular to y, on the side of x.
fn orthogonal(x: DVec3, y: DVec3) -> DVec3 {
    let d = x - y;
    (d - y * d.dot(y)).normalize_or_zero()
}

/// A rectangle, ready to be seen from many points.
#[derive(Clone, Copy, Debug)]
pub struct Rectangle {
    pub(super) corner: DVec3,
    /// World axes along the edges and along the normal.
    pub(super) axes: [DVec3; 3],
    /// Lengths of the edges, and their reciprocals.
    pub(super) size: [f64; 2],
    pub(super) inv_size: [f64; 2],
}

/// A rectangle as seen from a point.
#[derive(Clone, Copy, Debug)]
pub struct SphericalRectangle<'a> {
    rectangle: &'a Rectangle,
    /// −1 where it is seen from the side of its normal: the third axis points towards it.
    side: f64,
    /// Its extent along the edges, and its distance along the normal.
    x: [f64; 2],
    y: [f64; 2],
    z: f64,
    /// Of the solid angle between x = 0 and x0, which is the argument.
    before: Complex,
    /// To single precision: as it is a factor of the first number, its error moves samples within the rectangle only.
    solid_angle: f64,
}

impl Rectangle {
    /// From `corner` along two edges, which must be perpendicular; `None` if it has no area.
    #[must_use]
    pub fn new(corner: Point, edges: [Vec3; 2]) -> Option<Self> {
        let edges = edges.map(|e| e.as_dvec3());
        let (x, y) = (edges[0].try_normalize()?, edges[1].try_normalize()?);
        let size = edges.map(DVec3::length);
        let inv_size = size.map(|s| 1.0 / s);
        Some(Self { corner: corner.0.as_dvec3(), axes: [x, y, x.cross(y)], size, inv_size })
    }

    /// As it is seen from there; `None` if it is seen edge-on.
    ///
    /// The four arctangents of its corners are arguments of complex numbers: products and one arctangent give the solid
    /// angle.
    #[must_use]
    #[inline]
    pub fn seen_from(&self, from: Point) -> Option<SphericalRectangle<'_>> {
        let d = self.corner - from.0.as_dvec3();
        let [axis_x, axis_y, axis_z] = self.axes;
        let (x0, y0, z) = (d.dot(axis_x), d.dot(axis_y), d.dot(axis_z));
        let (side, z) = (1.0_f64.copysign(z), z.abs());
        let (x, y) = ([x0, x0 + self.size[0]], [y0, y0 + self.size[1]]);
        let before = between(x[0], y, z);
        let whole = between(x[1], y, z).times(before.conjugate());
        let is_inside = |[lo, hi]: [f64; 2]| lo < 0.0 && hi > 0.0;
        let solid_angle = match whole.argument() {
            // More than half of the sphere's half: only from close above, where the foot is inside.
            negative if negative < 0.0 && is_inside(x) && is_inside(y) => negative + std::f64::consts::TAU,
            angle => angle,
        };
        let usable = z > 0.0 && solid_angle >= SMALLEST;
        usable.then_some(SphericalRectangle { rectangle: self, side, x, y, z, before, solid_angle })
    }
}

impl SphericalRectangle<'_> {
    /// In steradian.
    #[must_use]
    #[inline]
    pub fn solid_angle(&self) -> f32 {
        self.solid_angle as f32
    }

    /// The density of every direction to the rectangle.
    #[must_use]
    #[inline]
    pub fn pdf(&self) -> Pdf<SolidAngle> {
        Pdf::new((1.0 / self.solid_angle) as f32)
    }

    /// A direction to the rectangle.
    #[must_use]
    pub fn sample(&self, u: [f32; 2]) -> DirectionOnShape {
        let [x, y] = self.point(u);
        let [along_x, along_y, towards] = self.axes();
        let w = along_x * x + along_y * y + towards * self.z;
        DirectionOnShape {
            direction: Dir(w.normalize_or_zero().as_vec3()),
            coordinates: self.coordinates_of([x, y]),
        }
    }

    /// [`DirectionOnShape::coordinates`] of [`SphericalRectangle::sample`].
    #[must_use]
    #[inline]
    pub fn coordinates(&self, u: [f32; 2]) -> [f32; 2] {
        self.coordinates_of(self.point(u))
    }

    /// World axes along the edges and along the normal, towards the rectangle.
    fn axes(&self) -> [DVec3; 3] {
        let [x, y, z] = self.rectangle.axes;
        [x, y, z * self.side]
    }

    #[inline]
    fn coordinates_of(&self, [x, y]: [f64; 2]) -> [f32; 2] {
        let inv = self.rectangle.inv_size;
        [((x - self.x[0]) * inv[0]) as f32, ((y - self.y[0]) * inv[1]) as f32]
    }

    /// Along the two axes.
    #[inline]
    fn point(&self, u: [f32; 2]) -> [f64; 2] {
        // The stripe up to x has the share u0 of the solid angle. c = x / √(x² + z²) solves
        // asin(b1 c) − asin(b0 c) = τ, with the sines b = y / r of the edges' elevations: the law of cosines, in the form that
        // does not cancel. τ is twice the argument of `half`; its size and the r's are divided out at the end, once.
        let z2 = self.z * self.z;
        let [r0, r1] = self.y.map(|y| (y * y + z2).sqrt());
        let size = (self.x[0] * self.x[0] + z2) * r0 * r1;
        let half = self.before.half(size).times(turn(0.5 * f64::from(u[0]) * self.solid_angle));
        let half2 = half.re * half.re + half.im * half.im;
        let [y0, y1] = self.y;
        let rr = r0 * r1;
        let (difference, product) = (y1 * r0 - y0 * r1, 4.0 * y0 * y1 * rr);
        let side2 = half2 * (difference * difference * half2 + product * half.im * half.im);
        // x = c z / √(1 − c²) with c = n / √side2.
        let n = 2.0 * half.im * half.re * rr;
        let x = n * self.z / (side2 - n * n).max(1e-300).sqrt();
        let x = x.clamp(self.x[0], self.x[1]);

        // Along the stripe, sines are uniform.
        let d2 = x * x + z2;
        let [h0, h1] = self.y.map(|y| sine(y, d2));
        let h = h0 + f64::from(u[1]) * (h1 - h0);
        let y = (h * (d2 / (1.0 - h * h).max(1e-300)).sqrt()).clamp(self.y[0], self.y[1]);
        [x, y]
    }

    /// The `u` of a direction to the rectangle.
    #[must_use]
    pub fn inverse(&self, w: Dir) -> [f32; 2] {
        let w = w.0.as_dvec3();
        let [along_x, along_y, towards] = self.axes();
        let scale = self.z / w.dot(towards);
        let x = (w.dot(along_x) * scale).clamp(self.x[0], self.x[1]);
        let y = (w.dot(along_y) * scale).clamp(self.y[0], self.y[1]);
        let d2 = x * x + self.z * self.z;
        let [h0, h1] = self.y.map(|y| sine(y, d2));
        let angle = |c: Complex| trig::atan2(c.im, c.re);
        let u0 = (angle(between(x, self.y, self.z)) - angle(self.before)) / self.solid_angle;
        let u1 = (sine(y, d2) - h0) / (h1 - h0);
        [u0, u1].map(|v| v.clamp(0.0, 1.0) as f32)
    }
}

/// The unit number with this argument in [0, π].
#[inline]
fn turn(angle: f64) -> Complex {
    if angle > SERIES_MOST {
        let (im, re) = trig::sin_cos(angle);
        return Complex { re, im };
    }
    // Taylor's series; what is left out is below 10⁻¹⁰.
    let t = angle * angle;
    let horner = |c: [f64; 5]| c.iter().fold(0.0, |sum, c| (1.0 - sum) * t * c);
    let re = 1.0 - horner([1.0 / 90.0, 1.0 / 56.0, 1.0 / 30.0, 1.0 / 12.0, 1.0 / 2.0]);
    let im = angle * (1.0 - horner([1.0 / 110.0, 1.0 / 72.0, 1.0 / 42.0, 1.0 / 20.0, 1.0 / 6.0]));
    Complex { re, im }
}

/// A number whose argument is an angle; its size does not matter.
#[derive(Clone, Copy, Debug)]
struct Complex {
    re: f64,
    im: f64,
}

impl Complex {
    /// Arguments are added.
    #[inline]
    fn times(self, other: Self) -> Self {
        Self { re: self.re * other.re - self.im * other.im, im: self.re * other.im + self.im * other.re }
    }

    fn conjugate(self) -> Self {
        Self { im: -self.im, ..self }
    }

    /// The argument in [−π, π], to single precision.
    #[inline]
    fn argument(self) -> f64 {
        // Scaled, so that single precision holds it.
        let scale = 1.0 / (self.re.abs() + self.im.abs());
        f64::from(math::trig::atan2((self.im * scale) as f32, (self.re * scale) as f32))
    }

    /// Of half the argument, which lies in [−π, π]; `size` is that of the number.
    #[inline]
    fn half(self, size: f64) -> Self {
        // w + |w| halves the angle; for negative real parts it is turned so that nothing cancels.
        match self.re >= 0.0 {
            true => Self { re: size + self.re, im: self.im },
            false => Self { re: self.im.abs(), im: (size - self.re).copysign(self.im) },
        }
    }
}

/// Its argument is the signed solid angle of the rectangle from 0 to x and from y0 to y1 at distance z.
#[inline]
fn between(x: f64, [y0, y1]: [f64; 2], z: f64) -> Complex {
    let corner = |y: f64| Complex { re: z * (x * x + y * y + z * z).sqrt(), im: x * y };
    corner(y1).times(corner(y0).conjugate())
}

/// y / √(d² + y²).
#[inline]
fn sine(y: f64, d2: f64) -> f64 {
    y / (d2 + y * y).sqrt()
}
