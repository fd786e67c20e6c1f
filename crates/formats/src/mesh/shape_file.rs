//! Triangles of a mesh file of any kind, before anyone asks how they are shaded.

use std::path::Path;

use math::{Vec2, Vec3};
use scene_desc::MeshAttribute;

use super::ply::{Extras, PlyError, Remark};
use super::{obj, ply, serialized};

/// A mesh as its file has it; per-vertex lists are empty or as long as `positions`.
#[derive(Clone, Debug, Default)]
pub(crate) struct ShapeFile {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) normals: Vec<Vec3>,
    pub(crate) uvs: Vec<Vec2>,
    /// Every index is below `positions.len()`.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// What else the file says of vertices and faces.
    pub(crate) attributes: Vec<MeshAttribute>,
    pub(crate) hash: u64,
    /// What was not as it should be, but could be read.
    pub(crate) remarks: Vec<Remark>,
    /// Does the file itself say that faces are flat?
    pub(crate) face_normals: bool,
}

/// The kinds of mesh files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Obj,
    Ply,
    /// The shape of this index.
    Serialized(u32),
}

/// Reads a file.
pub(crate) fn load(path: &Path, kind: Kind) -> Result<ShapeFile, PlyError> {
    match kind {
        Kind::Obj => obj::load(path),
        Kind::Serialized(index) => serialized::load(path, index),
        Kind::Ply => ply::load(path, Extras::Kept).map(from_ply),
    }
}

/// Quadrilaterals become two triangles.
fn from_ply(ply: ply::Ply) -> ShapeFile {
    let mut out = ShapeFile { hash: ply.hash, remarks: ply.remarks, ..ShapeFile::default() };
    if let Some(mesh) = &ply.mesh {
        out.positions.clone_from(&mesh.positions);
        out.normals.clone_from(&mesh.normals);
        out.uvs.clone_from(&mesh.uvs);
        out.triangles.clone_from(&mesh.indices);
        out.attributes.clone_from(&mesh.attributes);
    }
    if let Some(patches) = &ply.patches {
        if out.positions.is_empty() {
            out.positions.clone_from(&patches.positions);
            out.normals.clone_from(&patches.normals);
            out.uvs.clone_from(&patches.uvs);
        }
        // Both have all vertices of the file. A patch's corners are (0,0), (1,0), (0,1), (1,1).
        out.triangles.extend(patches.indices.iter().flat_map(|[a, b, d, c]| [[*a, *b, *c], [*a, *c, *d]]));
    }
    out
}

/// Smooth normals of a mesh: face normals, weighted by the angle at the vertex [Thuermer1998]. Vertices of no face get
/// zero, which stands for the geometric normal.
pub(crate) fn smooth_normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut normals = vec![Vec3::ZERO; positions.len()];
    for t in triangles {
        let p = t.map(|i| positions[i as usize]);
        let n = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero();
        for k in 0..3 {
            let (a, b) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
            let (a, b) = (a.normalize_or_zero(), b.normalize_or_zero());
            // Twice the angle of half the chord: exact for small angles too.
            let angle = 2.0 * math::trig::asin((0.5 * (a - b).length()).min(1.0));
            normals[t[k] as usize] += n * angle;
        }
    }
    for n in &mut normals {
        *n = n.normalize_or_zero();
    }
    normals
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_s_corner_points_along_its_diagonal() {
        // Three faces at a corner, of which one is cut in two there: angles make them count alike.
        let p = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, Vec3::new(1.0, 1.0, 0.0)];
        let triangles = [[0, 4, 1], [0, 2, 4], [0, 3, 2], [0, 1, 3]];
        let n = smooth_normals(&p, &triangles);
        assert!((n[0] + Vec3::splat(1.0).normalize()).length() < 1e-6, "{}", n[0]);
    }
}
