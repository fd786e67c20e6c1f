//! From a surface point to texture coordinates, with the pixel's footprint carried along by the derivative
//! ([PBR4e], sec. 10.2).
//!
//! Departs from pbrt-v4: its spherical mapping gives (θ/π, φ/2π) with the derivatives of φ and θ swapped; here they
//! belong to their coordinates. On the axis of the spherical and cylindrical mappings, where the derivatives are
//! infinite, there is no footprint.

use std::f32::consts::PI;

use math::{Mat2, Mat4, Transform, Vec2, Vec3, trig};
use scene_desc::Mapping2d;

use super::attributes::{AttributeId, Attributes};
use crate::TextureContext;

/// A point of the texture plane and its change from pixel to pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Coord2 {
    /// (s, t); t runs upwards.
    pub(crate) st: Vec2,
    /// Change of (s, t) from one pixel to the next in x.
    pub(crate) dx: Vec2,
    /// The same in y.
    pub(crate) dy: Vec2,
}

/// A point of texture space and its change from pixel to pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Coord3 {
    /// The point.
    pub(crate) p: Vec3,
    /// Change from one pixel to the next in x.
    pub(crate) dx: Vec3,
    /// The same in y.
    pub(crate) dy: Vec3,
}

/// From a surface point to the texture plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Mapping {
    /// The surface's own coordinates, scaled and shifted.
    Uv {
        /// Factor.
        scale: Vec2,
        /// Added after it.
        shift: Vec2,
    },
    /// The surface's own coordinates under an affine map.
    Affine {
        /// The linear part.
        matrix: Mat2,
        /// Added after it.
        shift: Vec2,
    },
    /// Coordinates that the mesh carries under an affine map.
    Attribute {
        /// Which.
        id: AttributeId,
        /// The linear part.
        matrix: Mat2,
        /// Added after it.
        shift: Vec2,
    },
    /// (θ/π, φ/2π) about the texture's origin.
    Spherical(Mat4),
    /// (φ/2π + ½, z) about the texture's z axis.
    Cylindrical(Mat4),
    /// `s = axes[0] · p + shift.x`, `t = axes[1] · p + shift.y` with `p` in world space.
    Planar {
        /// World-space gradients of s and t.
        axes: [Vec3; 2],
        /// Their values at the world's origin.
        shift: Vec2,
    },
}

impl Mapping {
    /// Makes the mapping that a file asks for.
    pub(crate) fn compile(desc: &Mapping2d, attributes: &mut Attributes) -> Self {
        match desc {
            Mapping2d::Attribute { name, u, v, shift } => {
                Self::Attribute { id: attributes.id(name), matrix: Mat2::from_cols(*u, *v), shift: *shift }
            }
            Mapping2d::Uv { scale, shift } => {
                Self::Uv { scale: Vec2::from(*scale), shift: Vec2::from(*shift) }
            }
            Mapping2d::Affine { u, v, shift } => {
                Self::Affine { matrix: Mat2::from_cols(*u, *v), shift: *shift }
            }
            Mapping2d::Spherical(t) => Self::Spherical(t.matrix().as_mat4()),
            Mapping2d::Cylindrical(t) => Self::Cylindrical(t.matrix().as_mat4()),
            Mapping2d::Planar { texture_from_world, vs, vt, shift } => {
                let m = texture_from_world.matrix().as_mat4();
                let axis = |v: Vec3| {
                    Vec3::new(
                        m.x_axis.truncate().dot(v),
                        m.y_axis.truncate().dot(v),
                        m.z_axis.truncate().dot(v),
                    )
                };
                let origin = m.w_axis.truncate();
                Self::Planar {
                    axes: [axis(*vs), axis(*vt)],
                    shift: Vec2::from(*shift) + Vec2::new(origin.dot(*vs), origin.dot(*vt)),
                }
            }
        }
    }

    /// The coordinates of a surface point.
    pub(crate) fn map(&self, ctx: &TextureContext, attributes: &Attributes) -> Coord2 {
        let f = &ctx.footprint;
        match self {
            Self::Uv { scale, shift } => {
                Coord2 { st: ctx.uv * *scale + *shift, dx: f.duvdx * *scale, dy: f.duvdy * *scale }
            }
            Self::Affine { matrix, shift } => {
                Coord2 { st: *matrix * ctx.uv + *shift, dx: *matrix * f.duvdx, dy: *matrix * f.duvdy }
            }
            Self::Attribute { id, matrix, shift } => {
                let [u, v, _] = attributes.at(*id, &ctx.place);
                Coord2 { st: *matrix * Vec2::new(u, v) + *shift, dx: Vec2::ZERO, dy: Vec2::ZERO }
            }
            Self::Spherical(m) => spherical(&transform(m, ctx)),
            Self::Cylindrical(m) => cylindrical(&transform(m, ctx)),
            Self::Planar { axes: [a, b], shift } => {
                let project = |v: Vec3| Vec2::new(a.dot(v), b.dot(v));
                Coord2 { st: project(ctx.p.0) + *shift, dx: project(f.dpdx), dy: project(f.dpdy) }
            }
        }
    }
}

/// From world to texture space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mapping3(Mat4);

impl Mapping3 {
    /// Makes the mapping that a file asks for.
    pub(crate) fn compile(texture_from_world: &Transform) -> Self {
        Self(texture_from_world.matrix().as_mat4())
    }

    /// The coordinates of a surface point.
    pub(crate) fn map(&self, ctx: &TextureContext) -> Coord3 {
        transform(&self.0, ctx)
    }
}

fn transform(m: &Mat4, ctx: &TextureContext) -> Coord3 {
    Coord3 {
        p: m.transform_point3(ctx.p.0),
        dx: m.transform_vector3(ctx.footprint.dpdx),
        dy: m.transform_vector3(ctx.footprint.dpdy),
    }
}

fn spherical(c: &Coord3) -> Coord2 {
    let p = c.p;
    let rho2 = p.x * p.x + p.y * p.y;
    let rho = rho2.sqrt();
    let theta = trig::atan2(rho, p.z);
    let st = Vec2::new(theta / PI, azimuth(p) / (2.0 * PI));
    if rho2 == 0.0 {
        return Coord2 { st, dx: Vec2::ZERO, dy: Vec2::ZERO };
    }
    let ds = Vec3::new(p.x * p.z / rho, p.y * p.z / rho, -rho) / (PI * (rho2 + p.z * p.z));
    let dt = Vec3::new(-p.y, p.x, 0.0) / (2.0 * PI * rho2);
    Coord2 { st, dx: Vec2::new(ds.dot(c.dx), dt.dot(c.dx)), dy: Vec2::new(ds.dot(c.dy), dt.dot(c.dy)) }
}

fn cylindrical(c: &Coord3) -> Coord2 {
    let p = c.p;
    let rho2 = p.x * p.x + p.y * p.y;
    let st = Vec2::new((PI + trig::atan2(p.y, p.x)) / (2.0 * PI), p.z);
    let ds = if rho2 > 0.0 { Vec3::new(-p.y, p.x, 0.0) / (2.0 * PI * rho2) } else { Vec3::ZERO };
    Coord2 { st, dx: Vec2::new(ds.dot(c.dx), c.dx.z), dy: Vec2::new(ds.dot(c.dy), c.dy.z) }
}

/// φ in [0, 2π).
fn azimuth(p: Vec3) -> f32 {
    let phi = trig::atan2(p.y, p.x);
    if phi < 0.0 { phi + 2.0 * PI } else { phi }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Footprint, Place};
    use math::{DVec3, Dir, Point};

    fn none() -> Attributes {
        Attributes::default()
    }

    fn compile(m: &Mapping2d) -> Mapping {
        Mapping::compile(m, &mut none())
    }

    fn at(p: Vec3, uv: Vec2, footprint: Footprint) -> TextureContext {
        TextureContext { p: Point(p), n: Dir::Z, uv, footprint, place: Place::default() }
    }

    fn turned() -> Transform {
        Transform::translate(DVec3::new(0.3, -0.2, 0.5))
            * Transform::rotate(DVec3::new(1.0, 2.0, -1.0), 0.8).unwrap()
    }

    #[test]
    fn known_points_have_known_coordinates() {
        let id = Transform::IDENTITY;
        let st = |m: Mapping2d, p: Vec3| {
            compile(&m).map(&at(p, Vec2::new(0.25, 0.5), Footprint::default()), &none()).st
        };
        let uv = Mapping2d::Uv { scale: [4.0, 2.0], shift: [0.5, -1.0] };
        assert_eq!(st(uv, Vec3::ZERO), Vec2::new(1.5, 0.0));
        assert!(st(Mapping2d::Spherical(id), Vec3::Y * 3.0).distance(Vec2::new(0.5, 0.25)) < 1e-6);
        assert!(
            st(Mapping2d::Spherical(id), Vec3::new(0.0, -1.0, -1.0)).distance(Vec2::new(0.75, 0.75)) < 1e-6
        );
        assert!(
            st(Mapping2d::Cylindrical(id), Vec3::new(0.0, 2.0, 7.0)).distance(Vec2::new(0.75, 7.0)) < 1e-6
        );
        let planar = Mapping2d::Planar {
            texture_from_world: turned(),
            vs: Vec3::X,
            vt: Vec3::Z * 2.0,
            shift: [1.0, 0.0],
        };
        let q = turned().point(Point::new(0.4, 0.5, 0.6)).0;
        assert!(st(planar, Vec3::new(0.4, 0.5, 0.6)).distance(Vec2::new(q.x + 1.0, q.z * 2.0)) < 1e-5);
    }

    #[test]
    fn the_footprint_is_the_change_of_the_coordinates() {
        let planar = Mapping2d::Planar {
            texture_from_world: turned(),
            vs: Vec3::new(1.0, 0.5, 0.0),
            vt: Vec3::Y,
            shift: [0.0; 2],
        };
        for m in [Mapping2d::Spherical(turned()), Mapping2d::Cylindrical(turned()), planar] {
            let mapping = compile(&m);
            let (p, dpdx, dpdy) =
                (Vec3::new(0.4, -0.9, 0.7), Vec3::new(1.0, 0.2, 0.1), Vec3::new(-0.3, 0.1, 0.8));
            let c =
                mapping.map(&at(p, Vec2::ZERO, Footprint { dpdx, dpdy, ..Footprint::default() }), &none());
            let st = |q: Vec3| mapping.map(&at(q, Vec2::ZERO, Footprint::default()), &none()).st;
            let h = 1e-2;
            let numeric = |d: Vec3| (st(p + d * h) - st(p - d * h)) / (2.0 * h);
            assert!(c.dx.distance(numeric(dpdx)) < 1e-3, "{m:?} {} {}", c.dx, numeric(dpdx));
            assert!(c.dy.distance(numeric(dpdy)) < 1e-3, "{m:?}");
        }
    }

    #[test]
    fn the_axis_has_no_footprint_rather_than_an_infinite_one() {
        let f = Footprint { dpdx: Vec3::X, dpdy: Vec3::Y, ..Footprint::default() };
        for m in [Mapping2d::Spherical(Transform::IDENTITY), Mapping2d::Cylindrical(Transform::IDENTITY)] {
            let c = compile(&m).map(&at(Vec3::Z, Vec2::ZERO, f), &none());
            assert!(c.st.is_finite() && c.dx.is_finite() && c.dy.is_finite(), "{c:?}");
        }
    }
}
