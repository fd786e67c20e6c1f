//! Emitting surfaces: places and directions drawn from them, with their densities.
//!
//! | surface          | by solid angle, where that is safe                    | otherwise                      |
//! |------------------|-------------------------------------------------------|--------------------------------|
//! | triangle         | uniform in the spherical triangle [Arvo1995]          | uniform area                   |
//! | whole sphere     | uniform in its cone [PBR4e, sec. 6.2.4]               | uniform area (from the inside) |
//! | rectangle        | uniform in the spherical rectangle [Urena2013]        | uniform area                   |
//! | sphere's part, disk, cylinder, patch | –                                 | by area                        |
//!
//! Solid angle is not worth its arctangents where a flat surface is far for its size: its density by area, `r³` but for a
//! factor, hardly varies there. From [`FAR`] on it is drawn by area.
//!
//! Normals point to the side that emits. Analytic surfaces under an affine map that is no similarity are drawn
//! uniformly in object space; their density per world area says so.

mod cylinder;
mod disk;
mod patch;
mod sphere;
mod triangle;

use math::lanes::{Floats, PointLanes, Vec3Lanes};
use math::{Bounds, Dir, Point, Vec2, Vec3};
use sampling::{Area, Geometry, Measure, Pdf, SolidAngle};

pub(crate) use cylinder::Cylinder;
pub(crate) use disk::Disk;
pub(crate) use patch::{FlatRectangle, Patch};
pub(crate) use sphere::Sphere;
pub(crate) use triangle::Triangle;

/// A flat surface is far from this many times its radius on: `r³` varies by (5/3)³ at the most, where the surface lies along
/// the line of sight, and hardly at all where it faces the viewer.
const FAR: f32 = 4.0;

/// Is a flat surface far, whose points lie within the root of `radius_squared` of `middle`?
#[inline]
fn is_far(from: Point, middle: Vec3, radius_squared: f32) -> bool {
    from.0.distance_squared(middle) > FAR * FAR * radius_squared
}

/// A surface that emits. Triangles are many and stay flat; the others are few.
#[derive(Clone, Debug)]
pub(crate) enum Emitter {
    Triangle(Triangle),
    Sphere(Box<Sphere>),
    Disk(Box<Disk>),
    Cylinder(Box<Cylinder>),
    Patch(Box<Patch>),
}

/// A point of an emitting surface, drawn with a density per `M`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceSample<M: Measure> {
    pub(crate) p: Point,
    pub(crate) p_error: Vec3,
    /// To the side that emits.
    pub(crate) n: Dir,
    pub(crate) uv: Vec2,
    pub(crate) pdf: Pdf<M>,
}

/// Directions in which a surface's normals point: all within `cos_theta` of `axis`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NormalCone {
    pub(crate) axis: Dir,
    pub(crate) cos_theta: f32,
}

impl NormalCone {
    pub(crate) const ALL: Self = Self { axis: Dir::Z, cos_theta: -1.0 };
}

impl<M: Measure> SurfaceSample<M> {
    pub(crate) fn with_pdf<N: Measure>(self, pdf: Pdf<N>) -> SurfaceSample<N> {
        SurfaceSample { p: self.p, p_error: self.p_error, n: self.n, uv: self.uv, pdf }
    }
}

/// A flat emitter, of which sixteen points can be drawn at once.
#[derive(Clone, Copy)]
pub(crate) enum FlatEmitter<'a> {
    Triangle(&'a Triangle),
    Rectangle(FlatRectangle<'a>),
}

/// Points, normals, densities per steradian, and where all that is right.
pub(super) type SampleLanes<F> = (PointLanes<F>, Vec3Lanes<F>, F, <F as Floats>::Mask);

impl FlatEmitter<'_> {
    /// [`Emitter::sample`] from sixteen points: densities are zero where there is no sample.
    #[inline(always)]
    pub(crate) fn sample_lanes<F: Floats>(&self, from: Vec3Lanes<F>, u: [F; 2]) -> SampleLanes<F> {
        match self {
            Self::Triangle(t) => t.sample_lanes(from, u),
            Self::Rectangle(r) => r.sample_lanes(from, u),
        }
    }
}

/// [`Pdf::to_solid_angle`] of a density by area with [`geometry`]; zero where that is `None`.
#[inline(always)]
fn to_solid_angle<F: Floats>(pdf: F, from: Vec3Lanes<F>, p: Vec3Lanes<F>, n: Vec3Lanes<F>) -> F {
    let zero = F::splat(0.0);
    let d = from - p;
    let distance_squared = d.dot(d);
    let abs_cos = n.dot(d).abs() / distance_squared.sqrt();
    let pdf = pdf * distance_squared / abs_cos;
    let is_seen = zero.lt(distance_squared) & zero.lt(abs_cos) & pdf.is_finite();
    pdf.or_else(is_seen, zero)
}

/// [`is_far`] of sixteen points.
#[inline(always)]
fn is_far_lanes<F: Floats>(from: Vec3Lanes<F>, middle: Vec3, radius_squared: f32) -> F::Mask {
    let d = from - Vec3Lanes::splat(middle);
    d.dot(d).gt(F::splat(FAR * FAR * radius_squared))
}

impl Emitter {
    /// As one that lanes can draw.
    #[inline]
    pub(crate) fn flat(&self) -> Option<FlatEmitter<'_>> {
        match self {
            Self::Triangle(t) => Some(FlatEmitter::Triangle(t)),
            Self::Patch(p) => p.flat_rectangle().map(FlatEmitter::Rectangle),
            Self::Sphere(_) | Self::Disk(_) | Self::Cylinder(_) => None,
        }
    }

    /// World area.
    pub(crate) fn area(&self) -> f32 {
        match self {
            Self::Triangle(s) => s.area(),
            Self::Sphere(s) => s.area(),
            Self::Disk(s) => s.area(),
            Self::Cylinder(s) => s.area(),
            Self::Patch(s) => s.area(),
        }
    }

    /// A point with [`Emitter::pdf_area`] as its density.
    pub(crate) fn sample_area(&self, u: [f32; 2]) -> SurfaceSample<Area> {
        match self {
            Self::Triangle(s) => s.sample_area(u),
            Self::Sphere(s) => s.sample_area(u),
            Self::Disk(s) => s.sample_area(u),
            Self::Cylinder(s) => s.sample_area(u),
            Self::Patch(s) => s.sample_area(u),
        }
    }

    /// Density of [`Emitter::sample_area`] at the point `p` of the surface.
    pub(crate) fn pdf_area(&self, p: Point) -> Pdf<Area> {
        match self {
            Self::Triangle(s) => s.pdf_area(),
            Self::Sphere(s) => s.pdf_area(p),
            Self::Disk(s) => s.pdf_area(),
            Self::Cylinder(s) => s.pdf_area(p),
            Self::Patch(s) => s.pdf_area(p),
        }
    }

    /// A point as seen from `from`, with [`Emitter::pdf`] as its density.
    #[inline]
    pub(crate) fn sample(&self, from: Point, u: [f32; 2]) -> Option<SurfaceSample<SolidAngle>> {
        let by_angle = match self {
            Self::Triangle(s) => s.sample(from, u),
            Self::Sphere(s) => s.sample(from, u),
            Self::Patch(s) => s.sample(from, u),
            Self::Disk(_) | Self::Cylinder(_) => None,
        };
        if let Some(sample) = by_angle {
            return sample.pdf.is_positive().then_some(sample);
        }
        let s = self.sample_area(u);
        let pdf = s.pdf.to_solid_angle(geometry(from, s.p, s.n)?);
        pdf.is_positive().then_some(s.with_pdf(pdf))
    }

    /// Density of [`Emitter::sample`] at the surface's point `p` with normal `n`.
    pub(crate) fn pdf(&self, from: Point, p: Point, n: Dir) -> Pdf<SolidAngle> {
        let by_angle = match self {
            Self::Triangle(s) => s.pdf(from),
            Self::Sphere(s) => s.pdf(from, p),
            Self::Patch(s) => s.pdf(from),
            Self::Disk(_) | Self::Cylinder(_) => None,
        };
        by_angle
            .unwrap_or_else(|| geometry(from, p, n).map_or(Pdf::ZERO, |g| self.pdf_area(p).to_solid_angle(g)))
    }

    /// A box around it.
    pub(crate) fn bounds(&self) -> Bounds {
        match self {
            Self::Triangle(s) => s.bounds(),
            Self::Sphere(s) => s.bounds(),
            Self::Disk(s) => s.bounds(),
            Self::Cylinder(s) => s.bounds(),
            Self::Patch(s) => s.bounds(),
        }
    }

    /// A cone around its normals.
    pub(crate) fn normals(&self) -> NormalCone {
        match self {
            Self::Triangle(s) => s.normals(),
            Self::Disk(s) => s.normals(),
            Self::Patch(s) => s.normals(),
            Self::Sphere(_) | Self::Cylinder(_) => NormalCone::ALL,
        }
    }
}

/// How the surface's point `p` is seen from `from`; `None` edge-on or where both coincide.
pub(super) fn geometry(from: Point, p: Point, n: Dir) -> Option<Geometry> {
    let d = from - p;
    let distance_squared = d.length_squared();
    let abs_cos = n.0.dot(d).abs() / distance_squared.sqrt();
    (distance_squared > 0.0 && abs_cos > 0.0).then_some(Geometry { distance_squared, abs_cos })
}

/// The angle about z in [0, 2π).
fn azimuth(x: f32, y: f32) -> f32 {
    let phi = math::trig::atan2(y, x);
    if phi < 0.0 { phi + std::f32::consts::TAU } else { phi }
}
