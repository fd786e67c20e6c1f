//! PLY, the polygon file format [Turk1994]: ASCII and binary of both endians, plain or gzip.
//!
//! Triangles become a mesh, quadrilaterals bilinear patches (as in pbrt), faces of more corners fans of triangles.
//! Vertices may have `nx ny nz` and one of `u v`, `s t`, `texture_u texture_v`, `texture_s texture_t`, of any
//! numeric type; other properties and elements are skipped. What the header claims is held against the file's size
//! before memory is taken.
//!
//! Left out: `face_indices` (only ptex needs them), colours, triangle strips.

use std::path::Path;
use std::sync::Arc;

use math::{Vec2, Vec3};
use scene_desc::{BilinearMesh, MeshAttribute, MeshDesc};

use super::{ply_body, ply_header};
use crate::source;

/// What a PLY file holds.
#[derive(Clone, Debug)]
pub(crate) struct Ply {
    /// Its triangles, if it has any.
    pub(crate) mesh: Option<Arc<MeshDesc>>,
    /// Its quadrilaterals, if it has any.
    pub(crate) patches: Option<Arc<BilinearMesh>>,
    /// Hash of the file.
    pub(crate) hash: u64,
    /// What was not as it should be, but could be read.
    pub(crate) remarks: Vec<Remark>,
}

/// Something that a person should know.
#[derive(Clone, Debug)]
pub(crate) struct Remark {
    pub(crate) what: String,
    pub(crate) instead: &'static str,
}

/// Why a file gives no mesh.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PlyError {
    pub(crate) message: String,
    pub(crate) hint: String,
}

impl PlyError {
    pub(super) fn new(message: impl Into<String>, hint: impl Into<String>) -> Self {
        Self { message: message.into(), hint: hint.into() }
    }
}

/// Vertices and faces as they are in a file.
#[derive(Debug, Default)]
pub(super) struct Raw {
    pub(super) positions: Vec<Vec3>,
    pub(super) normals: Vec<Vec3>,
    pub(super) uvs: Vec<Vec2>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// In the file's order, around the face.
    pub(super) quads: Vec<[u32; 4]>,
    /// What else there is.
    pub(super) attributes: Vec<MeshAttribute>,
    /// Triangles that each face became, if faces say more than their corners.
    pub(super) triangles_of: Vec<u32>,
    /// Faces with fewer than three corners.
    pub(super) n_degenerate: usize,
}

/// What a file says beyond positions, normals and coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Extras {
    Skipped,
    Kept,
}

/// Reads a file.
pub(crate) fn load(path: &Path, extras: Extras) -> Result<Ply, PlyError> {
    let source = source::read(path).map_err(|e| PlyError::new(format!("cannot be read: {e}"), e.hint()))?;
    parse(&source.bytes, source.hash, extras)
}

/// Reads a file's bytes.
pub(crate) fn parse(bytes: &[u8], hash: u64, extras: Extras) -> Result<Ply, PlyError> {
    let mut header = ply_header::parse(bytes)?;
    if extras == Extras::Skipped {
        header.elements.iter_mut().for_each(|e| e.groups.clear());
    }
    let mut raw = ply_body::read(&header, &bytes[header.length..])?;
    let mut remarks = Vec::new();
    check_positions(&raw.positions)?;
    check_indices(&raw)?;
    if raw.n_degenerate > 0 {
        let what = format!("{} faces have fewer than three corners", raw.n_degenerate);
        remarks.push(Remark { what, instead: "they are left out" });
    }
    let bad_normals = replace_bad(&mut raw.normals, |n| n.is_finite(), Vec3::ZERO);
    if bad_normals > 0 {
        let what = format!("{bad_normals} normals are not finite");
        remarks.push(Remark { what, instead: "the geometric normal is used there" });
    }
    let bad_uvs = replace_bad(&mut raw.uvs, |uv| uv.is_finite(), Vec2::ZERO);
    if bad_uvs > 0 {
        let what = format!("{bad_uvs} texture coordinates are not finite");
        remarks.push(Remark { what, instead: "0 0 is used there" });
    }
    if raw.triangles.is_empty() && raw.quads.is_empty() {
        return Err(PlyError::new("has no faces", "pbrt refuses such a file too"));
    }
    Ok(split(raw, hash, remarks))
}

fn check_positions(positions: &[Vec3]) -> Result<(), PlyError> {
    match positions.iter().position(|p| !p.is_finite()) {
        None => Ok(()),
        Some(i) => {
            let p = positions[i];
            let message = format!("vertex {i} is not finite: {} {} {}", p.x, p.y, p.z);
            Err(PlyError::new(message, "repair the mesh with the program that wrote it"))
        }
    }
}

fn check_indices(raw: &Raw) -> Result<(), PlyError> {
    let n = raw.positions.len();
    let largest = |max: u32, face: &[u32]| face.iter().fold(max, |m, i| m.max(*i));
    let max = raw.triangles.iter().fold(0, |m, f| largest(m, f));
    let max = raw.quads.iter().fold(max, |m, f| largest(m, f));
    if (max as usize) < n || (raw.triangles.is_empty() && raw.quads.is_empty()) {
        return Ok(());
    }
    // As a signed number it is what the file says, if that is negative.
    let message = match max {
        u32::MAX => "a vertex index is negative or no whole number".to_owned(),
        _ => format!("vertex index {} is out of range", max as i32),
    };
    Err(PlyError::new(message, format!("there are {n} vertices: 0 to {}", n.saturating_sub(1))))
}

/// Replaces values that fail a test; gives their number.
fn replace_bad<T: Copy>(values: &mut [T], is_good: impl Fn(T) -> bool, good: T) -> usize {
    let mut n = 0;
    for v in values.iter_mut().filter(|v| !is_good(**v)) {
        *v = good;
        n += 1;
    }
    n
}

/// Values of faces become values of triangles; beside quadrilaterals they are left out.
fn attributes(raw: Vec<MeshAttribute>, triangles_of: &[u32], has_quads: bool) -> Vec<MeshAttribute> {
    let finite = |mut a: MeshAttribute| {
        replace_bad(&mut a.values, |x: f32| x.is_finite(), 0.0);
        if a.per_face {
            let faces = a.values.chunks_exact(a.channels as usize).zip(triangles_of);
            a.values =
                faces.flat_map(|(v, n)| std::iter::repeat_n(v, *n as usize)).flatten().copied().collect();
        }
        a
    };
    raw.into_iter().filter(|a| !(a.per_face && has_quads)).map(finite).collect()
}

/// Triangles to a mesh, quadrilaterals to patches, with a patch's order of corners: (0,0), (1,0), (0,1), (1,1).
fn split(raw: Raw, hash: u64, remarks: Vec<Remark>) -> Ply {
    let Raw { positions, normals, uvs, triangles, quads, .. } = raw;
    let attributes = attributes(raw.attributes, &raw.triangles_of, !quads.is_empty());
    let patches = (!quads.is_empty()).then(|| {
        let indices = quads.iter().map(|[a, b, c, d]| [*a, *b, *d, *c]).collect();
        let (positions, normals, uvs) = if triangles.is_empty() {
            (Vec::new(), Vec::new(), Vec::new())
        } else {
            (positions.clone(), normals.clone(), uvs.clone())
        };
        BilinearMesh { positions, normals, uvs, indices }
    });
    if triangles.is_empty() {
        let patches = patches.map(|p| Arc::new(BilinearMesh { positions, normals, uvs, ..p }));
        return Ply { mesh: None, patches, hash, remarks };
    }
    let mesh = MeshDesc {
        positions,
        normals,
        tangents: Vec::new(),
        uvs,
        indices: triangles,
        attributes,
        ..MeshDesc::default()
    };
    Ply { mesh: Some(Arc::new(mesh)), patches: patches.map(Arc::new), hash, remarks }
}
