//! Bilinear patches [PBR4e, sec. 6.6].

use math::{Dir, Point, Transform, Vec2, Vec3, error_bound::gamma};
use scene_desc::BilinearMesh;

use super::LocalSurface;

/// Patches in the space in which they are traced; corners at (u, v) = (0,0), (1,0), (0,1), (1,1).
#[derive(Clone, Debug, Default)]
pub(crate) struct PatchMesh {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) normals: Vec<Vec3>,
    pub(crate) uvs: Vec<Vec2>,
    pub(crate) indices: Vec<[u32; 4]>,
    pub(crate) flip: bool,
}

impl PatchMesh {
    /// Maps a patch mesh as [`super::Mesh::new`] maps triangles.
    pub(crate) fn new(desc: &BilinearMesh, t: &Transform, reverse_orientation: bool) -> Self {
        let sign = if reverse_orientation { -1.0 } else { 1.0 };
        Self {
            positions: desc.positions.iter().map(|p| t.point(Point(*p)).0).collect(),
            normals: desc.normals.iter().map(|n| t.normal(Dir(*n)).0 * sign).collect(),
            uvs: desc.uvs.clone(),
            indices: desc.indices.clone(),
            flip: super::flips(reverse_orientation, t),
        }
    }

    /// The same patches where `t` leads.
    pub(crate) fn placed(&self, t: &Transform) -> Self {
        Self {
            positions: self.positions.iter().map(|p| t.point(Point(*p)).0).collect(),
            normals: self.normals.iter().map(|n| t.normal(Dir(*n)).0).collect(),
            flip: super::flips(self.flip, t),
            ..self.clone()
        }
    }

    /// Corners of a patch.
    pub(crate) fn corners(&self, patch: u32) -> [Vec3; 4] {
        self.indices[patch as usize].map(|i| self.positions[i as usize])
    }

    /// Texture coordinates at patch parameters.
    pub(crate) fn uv(&self, patch: u32, u: f32, v: f32) -> Vec2 {
        if self.uvs.is_empty() {
            return Vec2::new(u, v);
        }
        let c = self.indices[patch as usize].map(|i| self.uvs[i as usize]);
        c[0].lerp(c[1], u).lerp(c[2].lerp(c[3], u), v)
    }

    /// The surface at patch parameters.
    pub(crate) fn at(&self, patch: u32, u: f32, v: f32) -> LocalSurface {
        let [p00, p10, p01, p11] = self.corners(patch);
        let p = p00.lerp(p10, u).lerp(p01.lerp(p11, u), v);
        let (by_u, by_v) = (p10.lerp(p11, v) - p00.lerp(p01, v), p01.lerp(p11, u) - p00.lerp(p10, u));
        let mut ng = Dir::normalize(by_u.cross(by_v));
        let (dpdu, dpdv) = self.by_texture(patch, [u, v], by_u, by_v);

        let (ns, dndu, dndv) = match self.normals.is_empty() {
            true => {
                ng = if self.flip { -ng } else { ng };
                (ng, Vec3::ZERO, Vec3::ZERO)
            }
            false => {
                let n = self.indices[patch as usize].map(|i| self.normals[i as usize]);
                let ns = n[0].lerp(n[1], u).lerp(n[2].lerp(n[3], u), v);
                let ns = ns.try_normalize().map_or(ng, Dir);
                let (nu, nv) =
                    (n[1].lerp(n[3], v) - n[0].lerp(n[2], v), n[2].lerp(n[3], u) - n[0].lerp(n[1], u));
                let (dndu, dndv) = self.by_texture(patch, [u, v], nu, nv);
                (ns, dndu, dndv)
            }
        };
        // In a plane through zero the coordinate itself has no error, but a ray's distance to the patch has (in
        // double precision): without the second term half of the rays that leave such a plane would meet it again.
        let size = p00.abs().max(p10.abs()).max(p01.abs()).max(p11.abs());
        let p_error = size * gamma(6) + Vec3::splat(size.max_element() * 1e-9);
        LocalSurface {
            p: Point(p),
            p_error,
            ng: ng.face_forward(ns),
            ns,
            tangent: dpdu,
            uv: self.uv(patch, u, v),
            dpdu,
            dpdv,
            dndu,
            dndv,
        }
    }

    /// Derivatives by texture coordinates from derivatives by patch parameters (unchanged without coordinates).
    fn by_texture(&self, patch: u32, at: [f32; 2], by_u: Vec3, by_v: Vec3) -> (Vec3, Vec3) {
        if self.uvs.is_empty() {
            return (by_u, by_v);
        }
        let c = self.indices[patch as usize].map(|i| self.uvs[i as usize]);
        let st_u = c[1].lerp(c[3], at[1]) - c[0].lerp(c[2], at[1]);
        let st_v = c[2].lerp(c[3], at[0]) - c[0].lerp(c[1], at[0]);
        let det = st_u.x * st_v.y - st_u.y * st_v.x;
        if det.abs() < 1e-12 {
            return (by_u, by_v);
        }
        ((by_u * st_v.y - by_v * st_u.y) / det, (by_v * st_u.x - by_u * st_v.x) / det)
    }

    /// Bytes of heap memory.
    pub(crate) fn memory(&self) -> usize {
        12 * (self.positions.len() + self.normals.len()) + 16 * self.indices.len() + 8 * self.uvs.len()
    }
}
