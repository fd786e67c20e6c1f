//! Emitting shapes as the scene's compiler hands them over.

use std::f32::consts::TAU;

use math::{AnimatedTransform, Dir, Point, Transform, Vec2, Vec3};
use scene_desc::AreaLightDesc;

use super::emitter::{Cylinder, Disk, Emitter, Patch, Sphere, Triangle};
use crate::linear_map::AffineMap;

/// An emitting shape in world space.
#[derive(Clone, Copy, Debug)]
pub struct EmitterSource<'a> {
    /// Its form.
    pub geometry: EmitterGeometry<'a>,
    /// Meshes without normals: does it emit to the side from which its corners run clockwise (reverse orientation
    /// xor a map that swaps hands)? Analytic shapes: is the orientation reversed?
    pub flip: bool,
    /// Can rays hit it? `false` for an alpha of zero.
    pub visible: bool,
    /// How it moves, if it does; its form is then that at the first key.
    pub motion: Option<&'a AnimatedTransform>,
    /// What it emits.
    pub desc: &'a AreaLightDesc,
}

/// Forms of emitters. Meshes are in world space; normals are empty or shading normals in world space, to whose side
/// the surface emits; texture coordinates are empty or per vertex. Angles are in degrees, as in files.
#[derive(Clone, Copy, Debug)]
pub enum EmitterGeometry<'a> {
    /// Each triangle is one light.
    Mesh {
        /// Vertices.
        positions: &'a [Vec3],
        /// Shading normals or empty.
        normals: &'a [Vec3],
        /// Texture coordinates or empty.
        uvs: &'a [Vec2],
        /// Corners.
        indices: &'a [[u32; 3]],
    },
    /// Each patch is one light.
    BilinearMesh {
        /// Vertices.
        positions: &'a [Vec3],
        /// Shading normals or empty.
        normals: &'a [Vec3],
        /// Texture coordinates or empty.
        uvs: &'a [Vec2],
        /// Corners at (u, v) = (0,0), (1,0), (0,1), (1,1).
        indices: &'a [[u32; 4]],
    },
    /// See [`scene_desc::Geometry::Sphere`].
    Sphere {
        /// Its radius.
        radius: f32,
        /// Kept between these.
        z: [f32; 2],
        /// Kept up to this angle, in degrees.
        phi_max: f32,
        /// Its place.
        world_from_object: &'a Transform,
    },
    /// See [`scene_desc::Geometry::Disk`].
    Disk {
        /// Its z.
        height: f32,
        /// Outer and inner radius.
        radii: [f32; 2],
        /// Kept up to this angle, in degrees.
        phi_max: f32,
        /// Its place.
        world_from_object: &'a Transform,
    },
    /// See [`scene_desc::Geometry::Cylinder`].
    Cylinder {
        /// Its radius.
        radius: f32,
        /// Its ends.
        z: [f32; 2],
        /// Kept up to this angle, in degrees.
        phi_max: f32,
        /// Its place.
        world_from_object: &'a Transform,
    },
}

/// The emitters of a shape in order; `None` for parts without area.
pub(super) fn emitters(source: &EmitterSource<'_>) -> Vec<Option<Emitter>> {
    let flip = source.flip;
    let at = |m: &Transform| AffineMap::of(m);
    match source.geometry {
        EmitterGeometry::Mesh { positions, normals, uvs, indices } => {
            let defaults = [Vec2::ZERO, Vec2::X, Vec2::ONE];
            indices
                .iter()
                .map(|t| {
                    let p = t.map(|i| Point(positions[i as usize]));
                    Triangle::new(p, corner_normals(normals, t), corner_uvs(uvs, t, defaults), flip)
                        .map(Emitter::Triangle)
                })
                .collect()
        }
        EmitterGeometry::BilinearMesh { positions, normals, uvs, indices } => {
            let defaults = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE];
            indices
                .iter()
                .map(|q| {
                    let p = q.map(|i| Point(positions[i as usize]));
                    Patch::new(p, corner_normals(normals, q), corner_uvs(uvs, q, defaults), flip)
                        .map(|p| Emitter::Patch(Box::new(p)))
                })
                .collect()
        }
        EmitterGeometry::Sphere { radius, z, phi_max, world_from_object } => {
            let sphere =
                at(world_from_object).and_then(|m| Sphere::new(m, radius, z, radians(phi_max), flip));
            vec![sphere.map(|s| Emitter::Sphere(Box::new(s)))]
        }
        EmitterGeometry::Disk { height, radii, phi_max, world_from_object } => {
            let disk =
                at(world_from_object).and_then(|m| Disk::new(m, height, radii, radians(phi_max), flip));
            vec![disk.map(|s| Emitter::Disk(Box::new(s)))]
        }
        EmitterGeometry::Cylinder { radius, z, phi_max, world_from_object } => {
            let cylinder =
                at(world_from_object).and_then(|m| Cylinder::new(m, radius, z, radians(phi_max), flip));
            vec![cylinder.map(|s| Emitter::Cylinder(Box::new(s)))]
        }
    }
}

/// A full turn is exactly 2π.
fn radians(degrees: f32) -> f32 {
    if degrees >= 360.0 { TAU } else { degrees.to_radians() }
}

fn corner_normals<const N: usize>(normals: &[Vec3], corners: &[u32; N]) -> Option<[Dir; N]> {
    (!normals.is_empty()).then(|| corners.map(|i| Dir(normals[i as usize])))
}

fn corner_uvs<const N: usize>(uvs: &[Vec2], corners: &[u32; N], defaults: [Vec2; N]) -> [Vec2; N] {
    if uvs.is_empty() { defaults } else { corners.map(|i| uvs[i as usize]) }
}
