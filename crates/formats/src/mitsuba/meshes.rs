//! Meshes of files, in the form that a shape asks for.

use std::path::PathBuf;
use std::sync::Arc;

use math::{AnimatedTransform, Vec2};
use rayon::prelude::*;
use scene_desc::{Geometry, MeshDesc, Span};

use super::build::Build;
use super::shapes::Form;
use super::tree::{Class, Node, Value};
use crate::mesh::shape_file::{self, Kind, ShapeFile};

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
        ..MeshDesc::default()
    }
}
