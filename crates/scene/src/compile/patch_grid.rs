//! Bilinear patches as triangles, for displacement.
//!
//! Patches are halved along both parameters, all of a mesh alike, until what is cut follows them; halves of an edge do not
//! depend on its direction, so that patches that shared an edge still do. Every patch keeps its own vertices: without
//! texture coordinates its parameters are those.

use math::{Vec2, Vec3};
use scene_desc::{BilinearMesh, MeshDesc};

/// Halvings at most.
const MOST_LEVELS: u32 = 8;

/// Triangles that are nowhere farther than `tolerance` from the patches.
pub(super) fn triangles(patches: &BilinearMesh, tolerance: f32) -> MeshDesc {
    // A patch's middle is a quarter of its twist off each diagonal's triangles, and a halving quarters that. Texture
    // coordinates and normals are as crooked where the patch is no parallelogram.
    let twist = |q: &[u32; 4]| {
        let p = q.map(|i| patches.positions[i as usize]);
        (p[0] - p[1] - p[2] + p[3]).length()
    };
    let mut off = patches.indices.iter().map(twist).fold(0.0, f32::max) * 0.25;
    let mut levels = 0;
    while off > tolerance && levels < MOST_LEVELS {
        (off, levels) = (off * 0.25, levels + 1);
    }
    let mut mesh = MeshDesc::default();
    for q in &patches.indices {
        add(patches, *q, levels, &mut mesh);
    }
    mesh
}

fn add(patches: &BilinearMesh, q: [u32; 4], levels: u32, mesh: &mut MeshDesc) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(grid(q.map(|i| patches.positions[i as usize]), levels));
    let uvs = match patches.uvs.is_empty() {
        true => [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE],
        false => q.map(|i| patches.uvs[i as usize]),
    };
    mesh.uvs.extend(grid(uvs, levels));
    if !patches.normals.is_empty() {
        let normals = grid(q.map(|i| patches.normals[i as usize]), levels);
        mesh.normals.extend(normals.into_iter().map(|n: Vec3| n.try_normalize().unwrap_or(Vec3::Z)));
    }
    let n = 1 << levels;
    for (row, column) in (0..n).flat_map(|r| (0..n).map(move |c| (r, c))) {
        let a = first + row * (n + 1) + column;
        let [b, c, d] = [a + 1, a + n + 1, a + n + 2];
        mesh.indices.extend([[a, b, d], [a, d, c]]);
    }
}

/// Corners at (u, v) = (0,0), (1,0), (0,1), (1,1), halved: rows of equal v.
fn grid<T>(corners: [T; 4], levels: u32) -> Vec<T>
where
    T: Copy + std::ops::Add<Output = T> + std::ops::Mul<f32, Output = T>,
{
    let middle = |a: T, b: T| (a + b) * 0.5;
    let mut rows = vec![corners[..2].to_vec(), corners[2..].to_vec()];
    for _ in 0..levels {
        let halved = |row: &Vec<T>| between(row, |a, b| middle(*a, *b));
        let long: Vec<Vec<T>> = rows.iter().map(halved).collect();
        rows = between(&long, |a, b| a.iter().zip(b).map(|(a, b)| middle(*a, *b)).collect());
    }
    rows.concat()
}

/// The items, and between each two of them one that is made of both.
fn between<T: Clone>(items: &[T], middle: impl Fn(&T, &T) -> T) -> Vec<T> {
    let mut all: Vec<T> = items.windows(2).flat_map(|w| [w[0].clone(), middle(&w[0], &w[1])]).collect();
    all.extend(items.last().cloned());
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_twisted_patch_is_followed_and_a_flat_one_left_alone() {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(1.0, 1.0, 0.0)];
        let mut patches = BilinearMesh { positions, indices: vec![[0, 1, 2, 3]], ..BilinearMesh::default() };
        assert_eq!(triangles(&patches, 0.01).indices.len(), 2);
        // The hyperbolic paraboloid z = xy.
        patches.positions[3].z = 1.0;
        let mesh = triangles(&patches, 0.01);
        assert_eq!(mesh.indices.len(), 2 * 8 * 8);
        for (p, uv) in mesh.positions.iter().zip(&mesh.uvs) {
            assert!((p.z - p.x * p.y).abs() < 1e-6 && (uv.x - p.x).abs() < 1e-6 && (uv.y - p.y).abs() < 1e-6);
        }
        for t in &mesh.indices {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            assert!((b - a).cross(c - a).z > 0.0, "the winding is that of ∂p/∂u × ∂p/∂v");
        }
    }
}
