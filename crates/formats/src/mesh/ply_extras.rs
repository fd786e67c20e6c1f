//! What a PLY file says beyond positions, normals and coordinates: values by name.

use scene_desc::MeshAttribute;

use super::ply_body::number;
use super::ply_header::{Element, Group, Scalar};

/// Without values yet.
pub(super) fn attribute(element: &Element, group: &Group) -> MeshAttribute {
    let per_face = element.name == "face";
    MeshAttribute { name: group.name.clone(), channels: group.n as u32, per_face, values: Vec::new() }
}

/// Bytes stand for parts of one.
pub(super) fn unit(ty: Scalar) -> f32 {
    if ty == Scalar::U8 { 1.0 / 255.0 } else { 1.0 }
}

/// The values of an item's groups, of all its numbers.
pub(super) fn take_groups(element: &Element, values: &[f32], out: &mut [MeshAttribute]) {
    for (group, attribute) in element.groups.iter().zip(out) {
        let range = group.first..group.first + group.n;
        let properties = &element.properties[range.clone()];
        attribute.values.extend(values[range].iter().zip(properties).map(|(x, p)| x * unit(p.ty)));
    }
}

/// One property of all vertices.
pub(super) struct Column<'a> {
    pub(super) block: &'a [u8],
    pub(super) stride: usize,
    pub(super) offset: usize,
    pub(super) ty: Scalar,
}

impl Column<'_> {
    pub(super) fn read<const BIG: bool>(&self, put: &mut dyn FnMut(usize, f32)) {
        for (i, item) in self.block.chunks_exact(self.stride).enumerate() {
            put(i, number::<BIG>(&item[self.offset..], self.ty) as f32);
        }
    }
}
