//! Mesh files: to triangles and bilinear patches.

pub(crate) mod ply;
mod ply_body;
mod ply_header;
