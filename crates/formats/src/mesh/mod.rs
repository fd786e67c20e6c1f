//! Mesh files: to triangles and bilinear patches.

pub(crate) mod obj;
pub(crate) mod ply;
mod ply_body;
mod ply_extras;
mod ply_header;
pub(crate) mod serialized;
pub(crate) mod shape_file;
