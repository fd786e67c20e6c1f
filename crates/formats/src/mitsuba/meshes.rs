//! Meshes of files and strands of curves, in the form that a shape asks for.

use std::path::PathBuf;
use std::sync::Arc;

use math::{AnimatedTransform, Vec2, Vec3};
use rayon::prelude::*;
use scene_desc::{CurveDesc, CurveKind, Geometry, MeshDesc, Span};

use super::build::Build;
use super::shapes::Form;
use super::text;
use super::tree::{Class, Node, Value};
use crate::mesh::shape_file::{self, Kind, ShapeFile};
use crate::source;

/// A mesh file as a key: serialized files hold many.
type Key = (PathBuf, u32);

/// How a mesh of a file is shaped: the same file in the same way is one mesh.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct MeshKey {
    file: Key,
    face_normals: bool,
    flip_v: bool,
}

fn key_of(node: &Node) -> Option<(Key, Kind)> {
    let text = |name: &str| match node.props.iter().rev().find(|p| p.name == name).map(|p| &p.value) {
        Some(Value::Text(s)) => Some(s.as_str()),
        _ => None,
    };
    let path = node.resolve(text("filename")?);
    let index = match node.props.iter().rev().find(|p| p.name == "shape_index").map(|p| &p.value) {
        Some(Value::Integer(n)) => u32::try_from(*n).unwrap_or(u32::MAX),
        _ => 0,
    };
    match node.kind.as_str() {
        "obj" => Some(((path, 0), Kind::Obj)),
        "ply" => Some(((path, 0), Kind::Ply)),
        "serialized" => Some(((path, index), Kind::Serialized(index))),
        _ => None,
    }
}

impl<'t> Build<'t, '_, '_> {
    /// Reads every mesh file that shapes name, once and in parallel.
    pub(super) fn load_shape_files(&mut self) {
        let mut wanted: Vec<(Key, Kind, Span)> = Vec::new();
        let mut seen = std::collections::HashSet::new();
        for node in self.tree.nodes.iter().filter(|n| n.class == Class::Shape) {
            let Some((key, kind)) = key_of(node) else { continue };
            if seen.insert(key.clone()) {
                wanted.push((key, kind, node.span_of("filename")));
            }
        }
        let loaded: Vec<_> =
            wanted.par_iter().map(|(key, kind, _)| shape_file::load(&key.0, *kind)).collect();
        for ((key, _, span), file) in wanted.into_iter().zip(loaded) {
            let shown = key.0.display().to_string();
            match file {
                Ok(file) => {
                    self.hashes.push(file.hash);
                    for remark in &file.remarks {
                        self.report.warning(span, format!("{shown}: {}", remark.what)).hint(remark.instead);
                    }
                    self.files.insert(key, Some(Arc::new(file)));
                }
                Err(e) => {
                    self.report.error(span, format!("{shown}: {}", e.message)).hint(e.hint);
                    self.files.insert(key, None);
                }
            }
        }
    }

    pub(super) fn mesh(&mut self, node: &'t Node, world_from_object: &AnimatedTransform) -> Option<Form> {
        if self.string(node, "filename").is_none() {
            let hint = "add <string name=\"filename\" value=\"…\"/>";
            return self.refuse(node.span, format!("{} has no \"filename\"", node.title()), hint);
        }
        node.accept(&["shape_index", "max_smooth_angle", "collapse", "srgb"]);
        let (key, kind) = key_of(node)?;
        let file = self.files.get(&key).cloned().flatten()?;
        let face_normals = self.boolean(node, "face_normals", false) || file.face_normals;
        let flip_v = self.boolean(node, "flip_tex_coords", kind == Kind::Obj);
        let has_own_normals = !file.normals.is_empty() && !face_normals;
        // Winding alone tells such a mesh's side, and a mirror turns it.
        let flip = !has_own_normals && world_from_object.start().swaps_handedness();
        let mesh_key = MeshKey { file: key, face_normals, flip_v };
        let mesh =
            self.meshes.entry(mesh_key).or_insert_with(|| Arc::new(shaped(&file, face_normals, flip_v)));
        let geometry = Geometry::Mesh(Arc::clone(mesh));
        Some(Form { flip, ..Form::plain(geometry) })
    }

    /// One control point with its radius a line, strands apart by empty lines.
    pub(super) fn curves(&mut self, node: &'t Node) -> Option<Vec<Form>> {
        let Some(name) = self.string(node, "filename") else {
            let hint = "add <string name=\"filename\" value=\"…\"/>";
            return self.refuse(node.span, format!("{} has no \"filename\"", node.title()), hint);
        };
        let (path, span) = (node.resolve(&name), node.span_of("filename"));
        let source = match source::read(&path) {
            Ok(source) => source,
            Err(e) => return self.refuse(span, format!("{} cannot be read: {e}", path.display()), e.hint()),
        };
        self.hashes.push(source.hash);
        let content = String::from_utf8_lossy(&source.bytes);
        let mut strands: Vec<Vec<[f32; 4]>> = vec![Vec::new()];
        for (i, line) in content.lines().enumerate() {
            if line.trim().is_empty() {
                strands.push(Vec::new());
                continue;
            }
            match text::numbers(line).as_deref() {
                Ok([x, y, z, r]) if *r >= 0.0 => {
                    let point = [*x, *y, *z, *r].map(|v| v as f32);
                    strands.last_mut().into_iter().for_each(|s| s.push(point));
                }
                _ => {
                    let message =
                        format!("{}:{}: no control point: {}", path.display(), i + 1, text::show(line));
                    return self.refuse(span, message, "expected x y z radius");
                }
            }
        }
        strands.retain(|s| !s.is_empty());
        let degree = if node.kind == "linearcurve" { 1 } else { 3 };
        let short = strands.iter().filter(|s| s.len() <= degree).count();
        if short > 0 {
            let message = format!("{short} strands of {} have too few points", path.display());
            self.report
                .warning(span, message)
                .hint(format!("they are left out: at least {} are needed", degree + 1));
        }
        Some(
            strands
                .iter()
                .filter(|s| s.len() > degree)
                .flat_map(|s| strand(s, degree))
                .map(Form::plain)
                .collect(),
        )
    }
}

/// The mesh as it is shaded, v upwards.
fn shaped(file: &ShapeFile, face_normals: bool, flip_v: bool) -> MeshDesc {
    let normals = match (face_normals, file.normals.is_empty()) {
        (true, _) => Vec::new(),
        (false, false) => file.normals.clone(),
        (false, true) => shape_file::smooth_normals(&file.positions, &file.triangles),
    };
    // Mitsuba flips v where the file's runs upwards, and then has it run down.
    let upwards = |uv: &Vec2| if flip_v { *uv } else { Vec2::new(uv.x, 1.0 - uv.y) };
    MeshDesc {
        positions: file.positions.clone(),
        normals,
        tangents: Vec::new(),
        uvs: file.uvs.iter().map(upwards).collect(),
        indices: file.triangles.clone(),
        attributes: file.attributes.clone(),
    }
}

/// A strand as Bézier segments: all of them together where the radius does not change, else each by itself.
fn strand(points: &[[f32; 4]], degree: usize) -> Vec<Geometry> {
    let at = |p: &[f32; 4]| Vec3::new(p[0], p[1], p[2]);
    let segments: Vec<([Vec3; 4], [f32; 2])> = points
        .windows(degree + 1)
        .map(|w| {
            let p: Vec<Vec3> = w.iter().map(at).collect();
            if degree == 1 {
                let (a, b) = (p[0], p[1]);
                return ([a, a.lerp(b, 1.0 / 3.0), a.lerp(b, 2.0 / 3.0), b], [w[0][3], w[1][3]]);
            }
            // The uniform B-spline's Bézier points, and its radius at both ends.
            let (a, b, c, d) = (p[0], p[1], p[2], p[3]);
            let bezier =
                [(a + 4.0 * b + c) / 6.0, (2.0 * b + c) / 3.0, (b + 2.0 * c) / 3.0, (b + 4.0 * c + d) / 6.0];
            let radius = |i: usize| (w[i][3] + 4.0 * w[i + 1][3] + w[i + 2][3]) / 6.0;
            (bezier, [radius(0), radius(1)])
        })
        .collect();
    let first = segments[0].1[0];
    let curve = |segments: Vec<[Vec3; 4]>, radii: [f32; 2]| {
        let width = radii.map(|r| 2.0 * r);
        Geometry::Curve(Arc::new(CurveDesc {
            segments,
            kind: CurveKind::Cylinder,
            width,
            normals: Vec::new(),
        }))
    };
    if segments.iter().all(|(_, r)| r.iter().all(|r| (r - first).abs() <= 1e-6 * first)) {
        return vec![curve(segments.iter().map(|s| s.0).collect(), [first; 2])];
    }
    segments.into_iter().map(|(points, radii)| curve(vec![points], radii)).collect()
}
