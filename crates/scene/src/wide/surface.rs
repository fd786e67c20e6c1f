//! Points of surfaces.

use accel::{Hit, NO_INSTANCE};
use math::lanes::{Floats, FrameLanes, LANES, Mask, PointLanes, Vec3Lanes};
use math::{Vec2, Vec3, error_bound::gamma};
use spectrum::Spectrum;

use crate::materials::{Detail, Matt};
use crate::shapes::{Mesh, Shape, ShapeGeometry};
use crate::{Scene, Shading, SurfaceInteraction};

type Column = [f32; LANES];

/// What the triangles are that sixteen rays met, and how they scatter.
#[derive(Default)]
pub struct Corners {
    positions: [[Column; 3]; 3],
    /// Zeros where there are none.
    normals: [[Column; 3]; 3],
    uvs: [[Column; 2]; 3],
    at: [Column; 2],
    /// Of the side of the normal, and of the other.
    reflectance: [[Column; 4]; 2],
    /// Lanes whose geometric normal points against the winding.
    flipped: u32,
    /// Lanes whose frames lean towards a tangent.
    leaning: u32,
    /// Lanes whose sides differ.
    two_sided: u32,
    given: Given,
}

/// Surfaces that were found one by one.
#[derive(Default)]
pub struct Given {
    lanes: u32,
    p: [Column; 3],
    error: [Column; 3],
    ng: [Column; 3],
    frame: [[Column; 3]; 3],
}

/// How a surface can be worked out in lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MattSurface {
    /// As it is.
    InLanes,
    /// Its interaction and shading must be had first; then it may be.
    OneByOne,
    /// Not at all: it is not matt.
    No,
}

/// Sixteen points of matt surfaces.
#[derive(Clone, Copy)]
pub struct SurfaceLanes<F: Floats> {
    /// Where.
    pub at: PointLanes<F>,
    /// Geometric normals, on the side of the shading normals.
    pub ng: Vec3Lanes<F>,
    /// Shading frames.
    pub frame: FrameLanes<F>,
    /// The part of the light that is reflected.
    pub reflectance: [F; 4],
}

impl Scene {
    /// The shape that was met.
    #[inline]
    #[must_use]
    pub fn shape_at(&self, hit: &Hit) -> &Shape {
        &self.shapes[self.shape_of(hit).index()]
    }

    /// Is the shape matt?
    #[inline]
    #[must_use]
    pub fn is_matt(&self, hit: &Hit, shape: &Shape) -> MattSurface {
        match self.materials.matt(shape.material) {
            Matt::No => MattSurface::No,
            Matt::Varying => MattSurface::OneByOne,
            Matt::Constant(_) => match &shape.geometry {
                ShapeGeometry::Mesh(mesh) if hit.instance == NO_INSTANCE => {
                    let in_lanes = shape.detail == Detail::Frame || mesh.tangents.is_empty();
                    if in_lanes { MattSurface::InLanes } else { MattSurface::OneByOne }
                }
                ShapeGeometry::Mesh(_)
                | ShapeGeometry::MovingMesh(_)
                | ShapeGeometry::Patches(_)
                | ShapeGeometry::Quadric(_)
                | ShapeGeometry::Strand(_) => MattSurface::OneByOne,
            },
        }
    }

    /// Puts what was met into a lane. False if nothing is reflected there.
    #[inline]
    pub fn put_corners(&self, hit: &Hit, shape: &Shape, lane: usize, into: &mut Corners) -> bool {
        let (ShapeGeometry::Mesh(mesh), Matt::Constant([front, back])) =
            (&shape.geometry, self.materials.matt(shape.material))
        else {
            return false;
        };
        if front.is_black() && back.is_black() {
            return false;
        }
        into.put_mesh(mesh, shape.detail, hit, lane);
        into.put_reflectance(*front, lane);
        if front != back {
            into.two_sided |= 1 << lane;
            put(&mut into.reflectance[1], lane, back.lanes());
        }
        true
    }
}

impl Corners {
    /// Forgets all lanes.
    #[inline]
    pub fn clear(&mut self) {
        (self.flipped, self.leaning, self.two_sided, self.given.lanes) = (0, 0, 0, 0);
    }

    /// Puts a surface, found on its own, into a lane.
    pub fn give(&mut self, si: &SurfaceInteraction, shading: &Shading, reflectance: Spectrum, lane: usize) {
        let given = &mut self.given;
        given.lanes |= 1 << lane;
        put(&mut given.p, lane, si.p.0.to_array());
        put(&mut given.error, lane, si.p_error.to_array());
        put(&mut given.ng, lane, si.ng.0.to_array());
        let frame = &shading.frame;
        for (columns, v) in given.frame.iter_mut().zip([frame.s, frame.t, frame.n.0]) {
            put(columns, lane, v.to_array());
        }
        self.put_reflectance(reflectance, lane);
    }

    #[inline]
    fn put_reflectance(&mut self, reflectance: Spectrum, lane: usize) {
        put(&mut self.reflectance[0], lane, reflectance.lanes());
    }

    #[inline]
    fn put_mesh(&mut self, mesh: &Mesh, detail: Detail, hit: &Hit, lane: usize) {
        let [i0, i1, i2] = mesh.indices[hit.primitive as usize];
        let [i0, i1, i2] = [i0 as usize, i1 as usize, i2 as usize];
        put(&mut self.at, lane, [hit.u, hit.v]);
        put(&mut self.positions[0], lane, mesh.positions[i0].to_array());
        put(&mut self.positions[1], lane, mesh.positions[i1].to_array());
        put(&mut self.positions[2], lane, mesh.positions[i2].to_array());
        let normals = match mesh.normals.is_empty() {
            true => [Vec3::ZERO; 3],
            false => [mesh.normals[i0], mesh.normals[i1], mesh.normals[i2]],
        };
        put(&mut self.normals[0], lane, normals[0].to_array());
        put(&mut self.normals[1], lane, normals[1].to_array());
        put(&mut self.normals[2], lane, normals[2].to_array());
        self.flipped |= u32::from(mesh.normals.is_empty() && mesh.flip) << lane;
        if detail != Detail::Frame {
            let uvs = match mesh.uvs.is_empty() {
                true => [Vec2::ZERO, Vec2::X, Vec2::ONE],
                false => [mesh.uvs[i0], mesh.uvs[i1], mesh.uvs[i2]],
            };
            for (columns, uv) in self.uvs.iter_mut().zip(uvs) {
                put(columns, lane, uv.to_array());
            }
            self.leaning |= 1 << lane;
        }
    }
}

#[inline(always)]
fn put<const N: usize>(columns: &mut [Column; N], lane: usize, values: [f32; N]) {
    let mut k = 0;
    while k < N {
        columns[k][lane & (LANES - 1)] = values[k];
        k += 1;
    }
}

impl<F: Floats> SurfaceLanes<F> {
    /// The points, where rays came from `wo`: `Mesh::surface` and the choice of a material's side.
    #[inline(always)]
    pub fn new(corners: &Corners, wo: Vec3Lanes<F>) -> Self {
        let [p0, p1, p2] = [
            Vec3Lanes::<F>::load(&corners.positions[0]),
            Vec3Lanes::<F>::load(&corners.positions[1]),
            Vec3Lanes::<F>::load(&corners.positions[2]),
        ];
        let (b1, b2) = (F::load(&corners.at[0]), F::load(&corners.at[1]));
        let b0 = F::splat(1.0) - b1 - b2;

        let parts = [p0 * b0, p1 * b1, p2 * b2];
        let p = parts[0] + parts[1] + parts[2];
        let error = (parts[0].abs() + parts[1].abs() + parts[2].abs()) * F::splat(gamma(7));

        // Without normals `ns` is no direction, and the geometric one stands for it.
        let (dp02, dp12) = (p0 - p2, p1 - p2);
        let ng = dp02.cross(dp12).normalize().negated_where(F::Mask::from_bits(corners.flipped));
        let [n0, n1, n2] = [
            Vec3Lanes::<F>::load(&corners.normals[0]),
            Vec3Lanes::<F>::load(&corners.normals[1]),
            Vec3Lanes::<F>::load(&corners.normals[2]),
        ];
        let (ns, has_one) = (n0 * b0 + n1 * b1 + n2 * b2).try_normalize();
        let ns = ns.or_else(has_one, ng);
        let ng = ng.face_forward(ns);

        let mut frame = FrameLanes::from_normal(ns);
        if corners.leaning != 0 {
            let tangent = tangent::<F>(&corners.uvs, (dp02, dp12), ng);
            let leaning = FrameLanes::from_normal_tangent(ns, tangent);
            frame = leaning.or_else(F::Mask::from_bits(corners.leaning), frame);
        }
        let mut surface = Self { at: PointLanes { p, error }, ng, frame, reflectance: [b0; 4] };
        if corners.given.lanes != 0 {
            surface.take(&corners.given);
        }

        let [front, back] = &corners.reflectance;
        let mut c = 0;
        while c < 4 {
            surface.reflectance[c] = F::load(&front[c]);
            c += 1;
        }
        if corners.two_sided != 0 {
            let behind = F::Mask::from_bits(corners.two_sided) & !F::splat(0.0).le(surface.ng.dot(wo));
            let mut c = 0;
            while c < 4 {
                surface.reflectance[c] = F::load(&back[c]).or_else(behind, surface.reflectance[c]);
                c += 1;
            }
        }
        surface
    }

    #[inline(always)]
    fn take(&mut self, given: &Given) {
        let mask = F::Mask::from_bits(given.lanes);
        self.at.p = Vec3Lanes::<F>::load(&given.p).or_else(mask, self.at.p);
        self.at.error = Vec3Lanes::<F>::load(&given.error).or_else(mask, self.at.error);
        self.ng = Vec3Lanes::<F>::load(&given.ng).or_else(mask, self.ng);
        let [s, t, n] = &given.frame;
        self.frame =
            FrameLanes { s: Vec3Lanes::<F>::load(s), t: Vec3Lanes::<F>::load(t), n: Vec3Lanes::<F>::load(n) }
                .or_else(mask, self.frame);
    }
}

/// The derivative of the point by u; where (u, v) is degenerate, any tangent.
#[inline(always)]
fn tangent<F: Floats>(
    uvs: &[[Column; 2]; 3],
    (dp02, dp12): (Vec3Lanes<F>, Vec3Lanes<F>),
    ng: Vec3Lanes<F>,
) -> Vec3Lanes<F> {
    let (zero, one) = (F::splat(0.0), F::splat(1.0));
    let (x2, y2) = (F::load(&uvs[2][0]), F::load(&uvs[2][1]));
    let (x02, y02) = (F::load(&uvs[0][0]) - x2, F::load(&uvs[0][1]) - y2);
    let (x12, y12) = (F::load(&uvs[1][0]) - x2, F::load(&uvs[1][1]) - y2);
    let det = x02 * y12 - y02 * x12;
    let inv = one / det;
    let u = (dp02 * y12 - dp12 * y02) * inv;
    let v = (dp12 * x02 - dp02 * x12) * inv;
    let normal = u.cross(v);
    let is_good = !det.abs().lt(F::splat(1e-9)) & normal.dot(normal).gt(zero);
    u.or_else(is_good, FrameLanes::from_normal(ng).s)
}
