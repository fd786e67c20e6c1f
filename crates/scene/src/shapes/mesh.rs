//! Triangle meshes.

use math::{Dir, Frame, Point, Transform, Vec2, Vec3, error_bound::gamma};
use rayon::prelude::*;
use scene_desc::MeshDesc;

use super::LocalSurface;
use crate::materials::Detail;

/// Triangles in the space in which they are traced. Per-vertex arrays are empty or as long as `positions`.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mesh {
    pub(crate) positions: Vec<Vec3>,
    /// Unit; already flipped where the shape's orientation is reversed.
    pub(crate) normals: Vec<Vec3>,
    pub(crate) tangents: Vec<Vec3>,
    pub(crate) uvs: Vec<Vec2>,
    pub(crate) indices: Vec<[u32; 3]>,
    /// Without vertex normals: does the geometric normal point against the winding?
    pub(crate) flip: bool,
}

impl Mesh {
    /// Maps a mesh as pbrt does: positions, normals and tangents; reversed orientation turns the normals.
    pub(crate) fn new(desc: &MeshDesc, t: &Transform, reverse_orientation: bool) -> Self {
        let mesh = Self {
            positions: desc.positions.clone(),
            normals: desc.normals.clone(),
            tangents: desc.tangents.clone(),
            uvs: desc.uvs.clone(),
            indices: desc.indices.clone(),
            flip: false,
        };
        mesh.mapped(t, reverse_orientation)
    }

    /// The same of a mesh that nobody else needs.
    pub(crate) fn from_owned(desc: MeshDesc, t: &Transform, reverse_orientation: bool) -> Self {
        let MeshDesc { positions, normals, tangents, uvs, indices, .. } = desc;
        Self { positions, normals, tangents, uvs, indices, flip: false }.mapped(t, reverse_orientation)
    }

    fn mapped(mut self, t: &Transform, reverse_orientation: bool) -> Self {
        let sign = if reverse_orientation { -1.0 } else { 1.0 };
        if *t != Transform::IDENTITY {
            each(&mut self.positions, |p| t.point(Point(p)).0);
        }
        each(&mut self.normals, |n| t.normal(Dir(n)).0 * sign);
        each(&mut self.tangents, |v| t.vector(v));
        self.flip = super::flips(reverse_orientation, t);
        self
    }

    /// The same mesh where `t` leads.
    pub(crate) fn placed(&self, t: &Transform) -> Self {
        Self {
            positions: self.positions.iter().map(|p| t.point(Point(*p)).0).collect(),
            normals: self.normals.iter().map(|n| t.normal(Dir(*n)).0).collect(),
            tangents: self.tangents.iter().map(|v| t.vector(*v)).collect(),
            flip: super::flips(self.flip, t),
            ..self.clone()
        }
    }

    /// Texture coordinates of a triangle's corners.
    pub(crate) fn corner_uvs(&self, triangle: u32) -> [Vec2; 3] {
        if self.uvs.is_empty() {
            return [Vec2::ZERO, Vec2::X, Vec2::ONE];
        }
        self.indices[triangle as usize].map(|i| self.uvs[i as usize])
    }

    /// Interpolated texture coordinates.
    pub(crate) fn uv(&self, triangle: u32, b1: f32, b2: f32) -> Vec2 {
        let uv = self.corner_uvs(triangle);
        uv[0] * (1.0 - b1 - b2) + uv[1] * b1 + uv[2] * b2
    }

    /// The surface at barycentric coordinates. With [`Detail::Frame`] derivatives and tangent are zero, and those of the normal
    /// short of [`Detail::Curvature`].
    #[inline]
    pub(crate) fn at(&self, triangle: u32, [b1, b2]: [f32; 2], detail: Detail) -> LocalSurface {
        // (Not by `map`, of which calls are left.)
        let [i0, i1, i2] = self.indices[triangle as usize];
        let [i0, i1, i2] = [i0 as usize, i1 as usize, i2 as usize];
        let positions = [self.positions[i0], self.positions[i1], self.positions[i2]];
        let normals = match self.normals.is_empty() {
            true => None,
            false => Some([self.normals[i0], self.normals[i1], self.normals[i2]]),
        };
        self.surface([i0, i1, i2], (positions, normals), [b1, b2], detail)
    }

    /// The same, of three vertices with positions and normals in place of the mesh's own.
    #[inline(always)]
    pub(super) fn surface(
        &self,
        [i0, i1, i2]: [usize; 3],
        ([p0, p1, p2], normals): ([Vec3; 3], Option<[Vec3; 3]>),
        [b1, b2]: [f32; 2],
        detail: Detail,
    ) -> LocalSurface {
        let b0 = 1.0 - b1 - b2;

        // The point, and a bound on its error [PBR4e, eq. 6.24 ff.].
        let parts = [p0 * b0, p1 * b1, p2 * b2];
        let p = parts[0] + parts[1] + parts[2];
        let p_error = (parts[0].abs() + parts[1].abs() + parts[2].abs()) * gamma(7);

        // Geometric and shading normal: the latter says which side is outside.
        let (dp02, dp12) = (p0 - p2, p1 - p2);
        let ng = Dir::normalize(dp02.cross(dp12));
        let (ng, ns) = match normals {
            Some([n0, n1, n2]) => {
                let ns = (n0 * b0 + n1 * b1 + n2 * b2).try_normalize().map_or(ng, Dir);
                (ng.face_forward(ns), ns)
            }
            None => {
                let ng = if self.flip { -ng } else { ng };
                (ng, ng)
            }
        };

        let uvs = match self.uvs.is_empty() {
            true => [Vec2::ZERO, Vec2::X, Vec2::ONE],
            false => [self.uvs[i0], self.uvs[i1], self.uvs[i2]],
        };
        let mut surface = LocalSurface {
            p: Point(p),
            p_error,
            ng,
            ns,
            tangent: Vec3::ZERO,
            uv: uvs[0] * b0 + uvs[1] * b1 + uvs[2] * b2,
            dpdu: Vec3::ZERO,
            dpdv: Vec3::ZERO,
            dndu: Vec3::ZERO,
            dndv: Vec3::ZERO,
        };
        if detail == Detail::Frame {
            return surface;
        }

        // Derivatives by u and v.
        (surface.dpdu, surface.dpdv) = derivatives(&uvs, dp02, dp12, ng);
        surface.tangent = surface.dpdu;
        if !self.tangents.is_empty() {
            let t = &self.tangents;
            surface.tangent = t[i0] * b0 + t[i1] * b1 + t[i2] * b2;
        }
        if let (Detail::Curvature, Some([n0, n1, n2])) = (detail, normals) {
            (surface.dndu, surface.dndv) = solve(&uvs, n0 - n2, n1 - n2).unwrap_or_default();
        }
        surface
    }

    /// Bytes of heap memory.
    pub(crate) fn memory(&self) -> usize {
        12 * (self.positions.len() + self.normals.len() + self.tangents.len() + self.indices.len())
            + 8 * self.uvs.len()
    }
}

/// Maps vectors in place.
fn each(vectors: &mut [Vec3], map: impl Fn(Vec3) -> Vec3 + Sync) {
    vectors.par_iter_mut().with_min_len(4096).for_each(|v| *v = map(*v));
}

/// Derivatives of the point; where (u, v) is degenerate, any tangents.
fn derivatives(uvs: &[Vec2; 3], dp02: Vec3, dp12: Vec3, ng: Dir) -> (Vec3, Vec3) {
    match solve(uvs, dp02, dp12) {
        Some((u, v)) if u.cross(v).length_squared() > 0.0 => (u, v),
        _ => {
            let f = Frame::from_normal(ng);
            (f.s, f.t)
        }
    }
}

/// Derivatives by u and v of what changes by `d02` and `d12` along two edges; `None` where (u, v) is degenerate.
fn solve(uv: &[Vec2; 3], d02: Vec3, d12: Vec3) -> Option<(Vec3, Vec3)> {
    let (duv02, duv12) = (uv[0] - uv[2], uv[1] - uv[2]);
    let det = duv02.x * duv12.y - duv02.y * duv12.x;
    if det.abs() < 1e-9 {
        return None;
    }
    let inv = 1.0 / det;
    Some(((d02 * duv12.y - d12 * duv02.y) * inv, (d12 * duv02.x - d02 * duv12.x) * inv))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(normals: Vec<Vec3>) -> MeshDesc {
        MeshDesc {
            positions: vec![Vec3::ZERO, Vec3::X * 2.0, Vec3::new(2.0, 2.0, 0.0), Vec3::Y * 2.0],
            normals,
            uvs: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
            indices: vec![[0, 1, 2], [0, 2, 3]],
            ..MeshDesc::default()
        }
    }

    #[test]
    fn derivatives_follow_the_texture_coordinates() {
        let m = Mesh::new(&square(vec![]), &Transform::IDENTITY, false);
        let s = m.at(1, [0.25; 2], Detail::Tangents);
        assert!((s.dpdu - Vec3::X * 2.0).length() < 1e-6 && (s.dpdv - Vec3::Y * 2.0).length() < 1e-6);
        assert_eq!((s.ng.0, s.ns.0), (Vec3::Z, Vec3::Z));
    }

    #[test]
    fn the_shading_normal_says_which_side_is_outside() {
        let m = Mesh::new(&square(vec![-Vec3::Z; 4]), &Transform::IDENTITY, false);
        assert_eq!(m.at(0, [0.2; 2], Detail::Frame).ng.0, -Vec3::Z);
        let reversed = Mesh::new(&square(vec![-Vec3::Z; 4]), &Transform::IDENTITY, true);
        assert_eq!(reversed.at(0, [0.2; 2], Detail::Frame).ng.0, Vec3::Z);
        let mirrored = Transform::scale(math::DVec3::new(-1.0, 1.0, 1.0)).unwrap();
        let m = Mesh::new(&square(vec![]), &mirrored, false);
        assert_eq!(m.at(0, [0.2; 2], Detail::Frame).ng.0, Vec3::Z, "a mirror keeps the outside outside");
    }
}
