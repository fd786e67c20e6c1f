//! Triangles as binary PLY.

use scene_desc::MeshDesc;

/// The bytes of a file.
pub(super) fn bytes(mesh: &MeshDesc) -> Vec<u8> {
    let (has_normals, has_uvs) = (!mesh.normals.is_empty(), !mesh.uvs.is_empty());
    let mut properties = vec!["x", "y", "z"];
    if has_normals {
        properties.extend(["nx", "ny", "nz"]);
    }
    if has_uvs {
        properties.extend(["u", "v"]);
    }
    let mut head = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", mesh.positions.len());
    for name in properties {
        head.push_str(&format!("property float {name}\n"));
    }
    head.push_str(&format!(
        "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.indices.len()
    ));
    let mut out = head.into_bytes();
    let put = |out: &mut Vec<u8>, numbers: &[f32]| {
        numbers.iter().for_each(|x| out.extend_from_slice(&x.to_le_bytes()));
    };
    for (i, p) in mesh.positions.iter().enumerate() {
        put(&mut out, &p.to_array());
        if has_normals {
            put(&mut out, &mesh.normals[i].to_array());
        }
        if has_uvs {
            put(&mut out, &mesh.uvs[i].to_array());
        }
    }
    for t in &mesh.indices {
        out.push(3);
        t.iter().for_each(|i| out.extend_from_slice(&i.to_le_bytes()));
    }
    out
}
