//! The scene that is built in, for measuring: hills of triangles under an even sky.

use std::sync::Arc;

use math::{AnimatedTransform, DVec3, Transform, Vec3, hash};
use scene_desc::{
    CameraDesc, CameraKind, FilmDesc, Geometry, Illuminant, LightDesc, LightKind, MaterialDesc, MaterialId,
    MaterialKind, MeshDesc, SceneDesc, ShapeDesc, Span, SpectrumDesc, SpectrumInput,
};

/// Cells of the terrain along each side.
const SIDE: u32 = 512;
/// Its size in the scene.
const EXTENT: f32 = 100.0;

/// Half a million triangles, seen from a hill.
#[must_use]
pub fn bench_scene() -> SceneDesc {
    let mut desc = SceneDesc { content_hash: 1, ..SceneDesc::default() };
    desc.film = FilmDesc { resolution: [640, 360], ..FilmDesc::default() };
    let view = Transform::look_at(DVec3::new(0.0, -52.0, 18.0), DVec3::new(0.0, 0.0, 2.0), DVec3::Z);
    desc.camera = CameraDesc { world_from_camera: AnimatedTransform::fixed(camera_pose(view)), ..camera() };
    desc.materials.push(MaterialDesc {
        name: "ground".into(),
        ..MaterialDesc::new(
            MaterialKind::Diffuse { reflectance: SpectrumInput::Constant(SpectrumDesc::Constant(0.5)) },
            Span::NONE,
        )
    });
    desc.lights.push(LightDesc {
        kind: LightKind::InfiniteConstant {
            radiance: Illuminant { spectrum: SpectrumDesc::Constant(1.0), scale: 1.0, normalize: false },
            illuminance: None,
            portal: None,
        },
        world_from_light: AnimatedTransform::fixed(Transform::IDENTITY),
        medium: None,
        span: Span::NONE,
    });
    desc.shapes.push(ShapeDesc {
        geometry: Geometry::Mesh(Arc::new(hills())),
        world_from_object: AnimatedTransform::fixed(Transform::IDENTITY),
        reverse_orientation: false,
        material: MaterialId(0),
        alpha: None,
        displacement: None,
        area_light: None,
        medium_interface: None,
        span: Span::NONE,
    });
    desc
}

fn camera() -> CameraDesc {
    let default = CameraDesc::default();
    let kind = match default.kind {
        CameraKind::Perspective { lens_radius, focal_distance, aperture, .. } => {
            CameraKind::Perspective { fov: 45.0, lens_radius, focal_distance, aperture }
        }
        other @ (CameraKind::Orthographic { .. }
        | CameraKind::Realistic(_)
        | CameraKind::Spherical { .. }) => other,
    };
    CameraDesc { kind, ..default }
}

/// `look_at` gives the camera's view of the world; its inverse is where the camera stands.
fn camera_pose(camera_from_world: Option<Transform>) -> Transform {
    camera_from_world.map_or(Transform::IDENTITY, Transform::inverse)
}

fn hills() -> MeshDesc {
    let n = SIDE + 1;
    let at = |i: u32| (i as f32 / SIDE as f32 - 0.5) * EXTENT;
    let vertex = |i: u32| {
        let (column, row) = (i % n, i / n);
        Vec3::new(at(column), at(row), height(column as f32, row as f32))
    };
    let corners = |i: u32| {
        let (column, row) = (i % SIDE, i / SIDE);
        let a = row * n + column;
        [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]
    };
    MeshDesc {
        positions: (0..n * n).map(vertex).collect(),
        indices: (0..SIDE * SIDE).flat_map(corners).collect(),
        ..MeshDesc::default()
    }
}

/// Five octaves of smooth noise.
fn height(x: f32, y: f32) -> f32 {
    let mut sum = 0.0;
    let (mut scale, mut amplitude) = (1.0 / 96.0, 10.0);
    for octave in 0..5 {
        sum += amplitude * noise(x * scale, y * scale, octave);
        scale *= 2.1;
        amplitude *= 0.45;
    }
    sum
}

/// Random values at whole coordinates, smoothly joined; in [0, 1).
fn noise(x: f32, y: f32, octave: u64) -> f32 {
    let (x0, y0) = (x.floor(), y.floor());
    let smooth = |t: f32| t * t * (3.0 - 2.0 * t);
    let (u, v) = (smooth(x - x0), smooth(y - y0));
    let value = |dx: f32, dy: f32| {
        let key = hash::combine(hash::combine(octave, (x0 + dx) as u64), (y0 + dy) as u64);
        hash::unit_f32((key >> 32) as u32)
    };
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    mix(mix(value(0.0, 0.0), value(1.0, 0.0), u), mix(value(0.0, 1.0), value(1.0, 1.0), u), v)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hills_are_triangles_on_a_grid() {
        let mesh = hills();
        assert_eq!(mesh.indices.len() as u32, 2 * SIDE * SIDE);
        assert!(mesh.indices.iter().flatten().all(|&i| (i as usize) < mesh.positions.len()));
        let heights = mesh.positions.iter().map(|p| p.z);
        assert!(heights.clone().all(|z| (0.0..25.0).contains(&z)));
        assert!(heights.fold(0.0, f32::max) > 8.0);
    }
}
