//! How the shading normal changes from point to point of a surface: what the differentials of a ray that is mirrored or refracted
//! there depend on [Igehy1999].

use math::{Dir, Frame, Point, Transform, Vec3};

use super::local::normal_vector;
use super::{Mesh, PatchMesh, Quadric, QuadricKind, ShapeGeometry};

/// Two tangents of a surface at a point, and the derivatives of its unit shading normal along them.
#[derive(Clone, Copy, Debug)]
pub struct Curvature {
    normal: Dir,
    tangents: [Vec3; 2],
    changes: [Vec3; 2],
}

impl Curvature {
    /// Change of the unit shading normal, on the side of the interaction's, where the point moves by `d` in its tangent plane.
    #[must_use]
    pub fn along(&self, d: Vec3) -> Vec3 {
        let [a, b] = self.tangents;
        let (aa, ab, bb) = (a.dot(a), a.dot(b), b.dot(b));
        let (da, db) = (d.dot(a), d.dot(b));
        let inv = 1.0 / (aa * bb - ab * ab);
        let [x, y] = [(bb * da - ab * db) * inv, (aa * db - ab * da) * inv];
        let change = self.changes[0] * x + self.changes[1] * y;
        if change.is_finite() { change } else { Vec3::ZERO }
    }

    /// From a normal that is not unit, and its derivatives.
    fn new(normal: Vec3, tangents: [Vec3; 2], changes: [Vec3; 2]) -> Self {
        let length = normal.length();
        let n = Dir::normalize(normal);
        let unit = |c: Vec3| (c - n.0 * n.0.dot(c)) / length;
        Self { normal: n, tangents, changes: changes.map(unit) }
    }

    fn flat(tangents: [Vec3; 2]) -> Self {
        Self { normal: Dir::Z, tangents, changes: [Vec3::ZERO; 2] }
    }

    /// The same point in the space that `t` maps to.
    pub(crate) fn transformed(&self, t: &Transform) -> Self {
        let tangents = self.tangents.map(|v| t.vector(v));
        Self::new(normal_vector(t, self.normal.0), tangents, self.changes.map(|c| normal_vector(t, c)))
    }
}

impl ShapeGeometry {
    /// At a hit and a moment, in the space in which the geometry is stored, where the hit point is `p`; `None` for strands.
    pub(crate) fn curvature(&self, hit: &accel::Hit, p: Point, time: f32) -> Option<Curvature> {
        match self {
            Self::Mesh(m) => Some(m.curvature(hit.primitive, [hit.u, hit.v])),
            Self::MovingMesh(m) => Some(of_triangle(m.triangle(hit.primitive, time), [hit.u, hit.v])),
            Self::Patches(m) => Some(m.curvature(hit.primitive, [hit.u, hit.v])),
            Self::Quadric(q) => Some(q.curvature(p)),
            Self::Strand(_) => None,
        }
    }
}

impl Mesh {
    fn curvature(&self, triangle: u32, b: [f32; 2]) -> Curvature {
        let corners = self.indices[triangle as usize].map(|i| i as usize);
        let normals = (!self.normals.is_empty()).then(|| corners.map(|i| self.normals[i]));
        of_triangle((corners.map(|i| self.positions[i]), normals), b)
    }
}

/// Of positions and perhaps normals at three corners.
fn of_triangle(([p0, p1, p2], normals): ([Vec3; 3], Option<[Vec3; 3]>), [b1, b2]: [f32; 2]) -> Curvature {
    let tangents = [p1 - p0, p2 - p0];
    let Some([n0, n1, n2]) = normals else { return Curvature::flat(tangents) };
    Curvature::new(n0 * (1.0 - b1 - b2) + n1 * b1 + n2 * b2, tangents, [n1 - n0, n2 - n0])
}

impl PatchMesh {
    fn curvature(&self, patch: u32, [u, v]: [f32; 2]) -> Curvature {
        // The value at (u, v) and its derivatives.
        let of = |[c00, c10, c01, c11]: [Vec3; 4]| {
            let by_u = c10.lerp(c11, v) - c00.lerp(c01, v);
            let by_v = c01.lerp(c11, u) - c00.lerp(c10, u);
            (c00.lerp(c10, u).lerp(c01.lerp(c11, u), v), [by_u, by_v])
        };
        let corners = self.corners(patch);
        let (_, tangents) = of(corners);
        if !self.normals.is_empty() {
            let (n, changes) = of(self.indices[patch as usize].map(|i| self.normals[i as usize]));
            return Curvature::new(n, tangents, changes);
        }
        // The normal is the cross product of the derivatives, which change with each other's parameter alone.
        let [c00, c10, c01, c11] = corners;
        let twist = c11 - c10 - c01 + c00;
        let sign = if self.flip { -1.0 } else { 1.0 };
        let [by_u, by_v] = tangents;
        let changes = [by_u.cross(twist), twist.cross(by_v)].map(|c| c * sign);
        Curvature::new(by_u.cross(by_v) * sign, tangents, changes)
    }
}

impl Quadric {
    fn curvature(&self, p: Point) -> Curvature {
        let object = self.world_from_object.inverse().point(p).0;
        let sign = if self.flip { -1.0 } else { 1.0 };
        // The normal grows with what counts of the place; along it alone the surface is bent.
        let (counts, radius) = match self.kind {
            QuadricKind::Sphere { radius, .. } => (Vec3::ONE, radius),
            QuadricKind::Disk { .. } => (Vec3::ZERO, 1.0),
            QuadricKind::Cylinder { radius, .. } => (Vec3::new(1.0, 1.0, 0.0), radius),
        };
        let n = (object * counts).try_normalize().unwrap_or(Vec3::Z);
        let frame = Frame::from_normal(Dir(n));
        let tangents = [frame.s, frame.t];
        Curvature::new(n * sign, tangents, tangents.map(|d| d * counts * (sign / radius)))
            .transformed(&self.world_from_object)
    }
}

#[cfg(test)]
mod tests {
    use math::{DVec3, Ray};
    use scene_desc::{BilinearMesh, MeshDesc};

    use super::*;
    use crate::materials::Detail;

    const STEP: f32 = 2e-3;

    /// The point and the shading normal at parameters of primitive 0; for quadrics at a point.
    fn at(geometry: &ShapeGeometry, at: [f32; 2], p: Point) -> (Vec3, Vec3) {
        let surface = geometry.at(&hit(at), &Ray::new(p, Dir::Z, 0.0), p, Detail::Curvature);
        (surface.p.0, surface.ns.0)
    }

    fn hit([u, v]: [f32; 2]) -> accel::Hit {
        accel::Hit { t: 1.0, u, v, primitive: 0, geometry: 0, instance: accel::NO_INSTANCE }
    }

    /// Central differences along both parameters, before and after a map that keeps no angles.
    fn check(geometry: &ShapeGeometry, middle: [f32; 2], place: impl Fn([f32; 2]) -> Point) {
        let turn = Transform::rotate(DVec3::new(1.0, 2.0, 3.0), 0.7).unwrap();
        let map = turn * Transform::scale(DVec3::new(0.5, 2.0, -1.5)).unwrap();
        let own = geometry.curvature(&hit(middle), place(middle), 0.0).unwrap();
        for (t, curvature) in [(Transform::IDENTITY, own), (map, own.transformed(&map))] {
            for axis in [[1.0, 0.0], [0.0, 1.0], [0.6, -0.8]] {
                let [(p, n), (q, m)] = [STEP, -STEP].map(|h| {
                    let moved = [0, 1].map(|i| middle[i] + h * axis[i]);
                    let (p, n) = at(geometry, moved, place(moved));
                    (t.point(Point(p)).0, t.normal(Dir(n)).0)
                });
                let (found, expected) = (curvature.along((p - q) / (2.0 * STEP)), (n - m) / (2.0 * STEP));
                assert!(found.distance(expected) < 2e-3 * expected.length().max(1.0), "{found} {expected}");
            }
        }
    }

    fn normals() -> Vec<Vec3> {
        [[0.1, 0.5, 0.8], [-0.6, 0.0, 0.8], [0.3, -0.2, 0.6], [0.0, 0.7, 0.7]]
            .map(|n| Vec3::from(n).normalize())
            .to_vec()
    }

    fn positions() -> Vec<Vec3> {
        vec![Vec3::ZERO, Vec3::new(2.0, 0.1, 0.0), Vec3::new(0.3, 1.5, 0.2), Vec3::new(2.1, 1.4, 0.6)]
    }

    #[test]
    fn normals_of_triangles_change_as_they_are_interpolated() {
        for normals in [normals(), vec![]] {
            let desc =
                MeshDesc { positions: positions(), normals, indices: vec![[0, 1, 2]], ..MeshDesc::default() };
            for reverse in [false, true] {
                let mesh = ShapeGeometry::Mesh(Mesh::new(&desc, &Transform::IDENTITY, reverse));
                check(&mesh, [0.3, 0.4], |_| Point::default());
            }
        }
    }

    #[test]
    fn patches_turn_with_their_normals_or_with_themselves() {
        for (normals, reverse) in [(normals(), false), (vec![], false), (vec![], true)] {
            let desc = BilinearMesh {
                positions: positions(),
                normals,
                indices: vec![[0, 1, 2, 3]],
                ..BilinearMesh::default()
            };
            let patches = ShapeGeometry::Patches(PatchMesh::new(&desc, &Transform::IDENTITY, reverse));
            check(&patches, [0.3, 0.6], |_| Point::default());
        }
    }

    #[test]
    fn quadrics_are_bent_by_their_radius() {
        let tau = std::f32::consts::TAU;
        let world_from_object = Transform::translate(DVec3::new(1.0, 2.0, 3.0))
            * Transform::scale(DVec3::new(1.0, 0.5, 2.0)).unwrap();
        let radius = 2.0;
        let sphere = QuadricKind::Sphere { radius, z_min: -2.0, z_max: 2.0, phi_max: tau };
        let cylinder = QuadricKind::Cylinder { radius, z_min: -2.0, z_max: 2.0, phi_max: tau };
        let disk = QuadricKind::Disk { height: 0.5, radius, inner_radius: 0.0, phi_max: tau };
        for (kind, flip) in [(sphere, false), (sphere, true), (cylinder, true), (disk, false)] {
            let geometry = ShapeGeometry::Quadric(Quadric { kind, world_from_object, flip });
            check(&geometry, [0.7, 0.4], |[a, b]| {
                // Longitude and height.
                let (sin, cos) = math::trig::sin_cos(a);
                let [r, z] = match kind {
                    QuadricKind::Sphere { .. } => [(4.0 - b * b).sqrt(), b],
                    QuadricKind::Cylinder { .. } => [radius, b],
                    QuadricKind::Disk { height, .. } => [1.0 + b, height],
                };
                world_from_object.point(Point::new(r * cos, r * sin, z))
            });
        }
    }
}
