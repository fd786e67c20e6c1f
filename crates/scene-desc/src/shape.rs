//! Surfaces.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use math::{AnimatedTransform, Vec2, Vec3};

use crate::{AreaLightDesc, FloatInput, MaterialId, MediumInterface, ObjectId, Span};

/// A surface with everything that belongs to it.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct ShapeDesc {
    /// Its form, in object space.
    pub geometry: Geometry,
    /// Its place in the world (in an object: in the object's space).
    pub world_from_object: AnimatedTransform,
    /// Does the normal point the other way?
    pub reverse_orientation: bool,
    /// Its look.
    pub material: MaterialId,
    /// The chance that it is there at all: cut-outs.
    pub alpha: Option<FloatInput>,
    /// How far its surface is moved; of meshes of triangles alone.
    #[serde(default)]
    pub displacement: Option<DisplacementDesc>,
    /// What it emits.
    pub area_light: Option<AreaLightDesc>,
    /// What is on both sides; `None` where it is no border of media.
    pub medium_interface: Option<MediumInterface>,
    /// Where it was written.
    #[serde(skip)]
    pub span: Span,
}

/// A relief: the mesh is cut into small triangles, whose corners are moved along the normal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DisplacementDesc {
    /// How far, in object space.
    pub height: FloatInput,
    /// No edge of a triangle is longer, in world space, before corners are moved.
    pub edge_length: f32,
}

/// Forms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Geometry {
    /// Triangles.
    Mesh(Arc<MeshDesc>),
    /// Bilinear patches.
    BilinearMesh(Arc<BilinearMesh>),
    /// A sphere around the origin, cut at z and φ.
    Sphere {
        /// Its radius.
        radius: f32,
        /// Kept from here up.
        z_min: f32,
        /// Kept up to here.
        z_max: f32,
        /// Kept up to this angle about z, in degrees.
        phi_max: f32,
    },
    /// A disk or ring across the z axis.
    Disk {
        /// Its z.
        height: f32,
        /// Outer radius.
        radius: f32,
        /// Radius of the hole.
        inner_radius: f32,
        /// Kept up to this angle about z, in degrees.
        phi_max: f32,
    },
    /// The side of a cylinder about the z axis.
    Cylinder {
        /// Its radius.
        radius: f32,
        /// From here.
        z_min: f32,
        /// To here.
        z_max: f32,
        /// Kept up to this angle about z, in degrees.
        phi_max: f32,
    },
    /// A mesh to be subdivided.
    LoopSubdiv(Arc<LoopSubdiv>),
    /// A strand.
    Curve(Arc<CurveDesc>),
}

/// Triangles with shared vertices. Per-vertex arrays are empty or as long as `positions`.
///
/// Where there are `end_positions`, vertices move on straight lines from `positions` at the first of `key_times` to them at the
/// second, and rest before and after. The shape's transform comes on top, and may move too.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MeshDesc {
    /// Vertices.
    #[schemars(with = "Vec<[f32; 3]>")]
    pub positions: Vec<Vec3>,
    /// Shading normals; empty for flat shading.
    #[schemars(with = "Vec<[f32; 3]>")]
    pub normals: Vec<Vec3>,
    /// Shading tangents.
    #[schemars(with = "Vec<[f32; 3]>")]
    pub tangents: Vec<Vec3>,
    /// Texture coordinates; empty for (0,0), (1,0), (1,1) on every triangle.
    #[schemars(with = "Vec<[f32; 2]>")]
    pub uvs: Vec<Vec2>,
    /// Corners of each triangle; every index is below `positions.len()`.
    pub indices: Vec<[u32; 3]>,
    /// More values over the surface, for textures to look up by name.
    #[serde(default)]
    pub attributes: Vec<MeshAttribute>,
    /// Vertices when their motion ends; empty where they rest.
    #[serde(default)]
    #[schemars(with = "Vec<[f32; 3]>")]
    pub end_positions: Vec<Vec3>,
    /// Shading normals then, between which and `normals` it is interpolated; empty where they do not turn.
    #[serde(default)]
    #[schemars(with = "Vec<[f32; 3]>")]
    pub end_normals: Vec<Vec3>,
    /// The moments at which the motion of vertices begins and ends.
    #[serde(default = "whole_shutter")]
    pub key_times: [f32; 2],
}

/// pbrt-v4's shutter and keys, where none are given.
fn whole_shutter() -> [f32; 2] {
    [0.0, 1.0]
}

impl MeshDesc {
    /// Do its vertices move?
    #[must_use]
    pub fn is_moving(&self) -> bool {
        let turns = !self.end_normals.is_empty() && self.end_normals != self.normals;
        let shifts = !self.end_positions.is_empty() && (turns || self.end_positions != self.positions);
        shifts && self.key_times[0] < self.key_times[1]
    }
}

impl Default for MeshDesc {
    fn default() -> Self {
        Self {
            positions: Vec::new(),
            normals: Vec::new(),
            tangents: Vec::new(),
            uvs: Vec::new(),
            indices: Vec::new(),
            attributes: Vec::new(),
            end_positions: Vec::new(),
            end_normals: Vec::new(),
            key_times: whole_shutter(),
        }
    }
}

/// Values that a mesh carries: colours, weights, further texture coordinates.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MeshAttribute {
    /// What textures ask for.
    pub name: String,
    /// Numbers at a place: 1, 2 (coordinates, the second upwards) or 3 (linear R, G, B).
    pub channels: u32,
    /// One place a triangle, rather than one a vertex?
    pub per_face: bool,
    /// `channels` numbers for each place, in order.
    pub values: Vec<f32>,
}

/// Bilinear patches with shared vertices.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BilinearMesh {
    /// Vertices.
    #[schemars(with = "Vec<[f32; 3]>")]
    pub positions: Vec<Vec3>,
    /// Shading normals or empty.
    #[schemars(with = "Vec<[f32; 3]>")]
    pub normals: Vec<Vec3>,
    /// Texture coordinates or empty.
    #[schemars(with = "Vec<[f32; 2]>")]
    pub uvs: Vec<Vec2>,
    /// Corners at (u, v) = (0,0), (1,0), (0,1), (1,1).
    pub indices: Vec<[u32; 4]>,
}

/// A control mesh of a Loop subdivision surface.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LoopSubdiv {
    /// Control points.
    #[schemars(with = "Vec<[f32; 3]>")]
    pub positions: Vec<Vec3>,
    /// Triangles.
    pub indices: Vec<[u32; 3]>,
    /// How many times to subdivide.
    pub levels: u32,
}

/// How a curve faces rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CurveKind {
    /// A flat strip turned to the ray.
    #[default]
    Flat,
    /// Round to the ray's eye.
    Cylinder,
    /// A flat strip with normals of its own.
    Ribbon,
}

/// Strands made of cubic Bézier segments (readers convert B-splines and lower degrees).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CurveDesc {
    /// Four control points a segment.
    #[schemars(with = "Vec<[[f32; 3]; 4]>")]
    pub segments: Vec<[Vec3; 4]>,
    /// How it faces rays.
    pub kind: CurveKind,
    /// Width at the strand's start and end.
    pub width: [f32; 2],
    /// Normals at segment ends, for ribbons: one more than segments.
    #[schemars(with = "Vec<[f32; 3]>")]
    pub normals: Vec<Vec3>,
}

/// Shapes that instances repeat together.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct ObjectDesc {
    /// As the file names it.
    pub name: String,
    /// What is in it; no area lights.
    pub shapes: Vec<ShapeDesc>,
    /// Objects within it.
    pub instances: Vec<InstanceDesc>,
}

/// A repetition of an object.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct InstanceDesc {
    /// What.
    pub object: ObjectId,
    /// Where.
    pub world_from_object: AnimatedTransform,
    /// Where it was written.
    #[serde(skip)]
    pub span: Span,
}
