//! Displacement: meshes whose vertices are moved along their normals by a texture, in a description of the same scene
//! with plain meshes in their place, which every later step takes for what was written. Bilinear patches and subdivision
//! surfaces become meshes first.
//!
//! | step          | how                                                                                       |
//! |---------------|-------------------------------------------------------------------------------------------|
//! | tessellation  | every edge that is longer (in the world) than asked for is halved, until none is          |
//! | height        | the texture at the vertex; where vertices of a seam share a place, the mean of them       |
//! | normal before | the mesh's own; without any, or along seams, the sum of the normals of faces around       |
//! | normal after  | the sum of the normals of faces around the place, by area                                 |
//!
//! An edge is halved or not by its ends alone, and its middle does not depend on their order: faces on both sides agree,
//! also where they do not share vertices but places, so that what was closed stays closed.
//! As in pbrt-v4, textures see points in the space of the shape, and heights are lengths there.
//! Left out: the motion of vertices, values that meshes carry by name, tangents (all are dropped, with a warning), footprints (images are seen
//! without filtering).

use std::collections::HashMap;
use std::sync::Arc;

use math::{Dir, Point, Transform, Vec2, Vec3};
use scene_desc::{Geometry, LoopSubdiv, MeshDesc, SceneDesc, ShapeDesc, Sink};
use spectrum::ColorPipeline;

use super::patch_grid;
use crate::shapes::subdivide;
use crate::textures::{FloatHandle, TextureCompiler, Textures};
use crate::{Footprint, Place, TextureContext};

/// Triangles of a tessellated mesh beyond which nobody means it.
const MOST_TRIANGLES: usize = 1 << 26;

/// The scene with all displacement done; `None` if it has none.
pub(super) fn displaced(desc: &SceneDesc, colors: ColorPipeline, sink: &mut Sink) -> Option<SceneDesc> {
    let is_moved = |s: &ShapeDesc| s.displacement.is_some();
    let in_objects = desc.objects.iter().flat_map(|o| &o.shapes);
    if !desc.shapes.iter().chain(in_objects).any(is_moved) {
        return None;
    }

    // The heights' textures alone, with the images that they look up.
    let mut scene = desc.clone();
    let mut compiler = TextureCompiler::of_surfaces(desc, colors, sink);
    let mut all: Vec<&mut ShapeDesc> = scene.shapes.iter_mut().collect();
    all.extend(scene.objects.iter_mut().flat_map(|o| &mut o.shapes));
    let moved: Vec<_> = all
        .into_iter()
        .filter_map(|shape| {
            let displacement = shape.displacement.take()?;
            let height = compiler.float(&displacement.height, shape.span);
            Some((shape, height, displacement.edge_length))
        })
        .collect();
    let textures = compiler.finish();
    for (shape, height, edge_length) in moved {
        displace(shape, &textures, height, edge_length, sink);
    }
    Some(scene)
}

fn displace(
    shape: &mut ShapeDesc,
    textures: &Textures,
    height: FloatHandle,
    edge_length: f32,
    sink: &mut Sink,
) {
    if edge_length.is_nan() || edge_length <= 0.0 {
        sink.error(shape.span, format!("displacement with edges of length {edge_length}"))
            .hint("expected a number above 0");
        return;
    }
    let Some(mesh) = triangles(&shape.geometry, edge_length, &shape.world_from_object.start()) else {
        sink.warning(shape.span, "curves, spheres, disks and cylinders cannot be displaced")
            .hint("it is rendered as it is");
        return;
    };
    if mesh.is_moving() {
        sink.warning(shape.span, "the vertices of a displaced mesh cannot move")
            .hint("they rest where they begin: move the shape by its transform");
    }
    if !mesh.attributes.is_empty() || !mesh.tangents.is_empty() {
        sink.warning(shape.span, "tangents and named values of a displaced mesh are dropped")
            .hint("textures that ask for them find zero");
    }
    let Some(mut fine) = Tessellation::new(&mesh).refined(edge_length, &shape.world_from_object.start())
    else {
        sink.error(
            shape.span,
            format!(
                "displacement with edges of length {edge_length} makes more than {MOST_TRIANGLES} triangles"
            ),
        )
        .hint("make the edges longer");
        return;
    };
    fine.push_out(textures, &height);
    shape.geometry = Geometry::Mesh(Arc::new(fine.mesh));
}

/// The triangles of a form that can be displaced; a curved one is cut finely enough for edges of `longest` in the world.
fn triangles(geometry: &Geometry, longest: f32, world_from_object: &Transform) -> Option<Arc<MeshDesc>> {
    /// Of the edge: how far triangles may be from a patch.
    const TOLERANCE: f32 = 0.05;
    let length = |v: Vec3| world_from_object.vector(v).length();
    match geometry {
        Geometry::Mesh(mesh) => Some(Arc::clone(mesh)),
        Geometry::BilinearMesh(patches) => {
            let scale = [Vec3::X, Vec3::Y, Vec3::Z].map(length).into_iter().fold(f32::MIN_POSITIVE, f32::max);
            Some(Arc::new(patch_grid::triangles(patches, TOLERANCE * longest / scale)))
        }
        Geometry::LoopSubdiv(control) => {
            // Each level halves edges; what is still long is halved as that of a mesh.
            let edges = |f: &[u32; 3]| [0, 1, 2].map(|k| [f[k], f[(k + 1) % 3]]);
            let at = |i: u32| control.positions[i as usize];
            let edges = control.indices.iter().flat_map(edges).map(|[a, b]| length(at(b) - at(a)));
            let mut control = LoopSubdiv::clone(control);
            let mut edge = edges.fold(0.0, f32::max) * 0.5_f32.powi(control.levels as i32);
            let mut faces = control.indices.len() << (2 * control.levels.min(16));
            while edge > longest && 4 * faces <= MOST_TRIANGLES / 16 {
                (edge, faces, control.levels) = (0.5 * edge, 4 * faces, control.levels + 1);
            }
            Some(Arc::new(subdivide(&control)))
        }
        Geometry::Sphere { .. } | Geometry::Disk { .. } | Geometry::Cylinder { .. } | Geometry::Curve(_) => {
            None
        }
    }
}

/// A mesh on its way.
struct Tessellation {
    mesh: MeshDesc,
}

impl Tessellation {
    fn new(mesh: &MeshDesc) -> Self {
        let MeshDesc { positions, normals, uvs, indices, .. } = mesh.clone();
        let mut mesh = MeshDesc { positions, normals, uvs, indices, ..MeshDesc::default() };
        if mesh.normals.is_empty() {
            mesh.normals = around(&mesh, &places(&mesh.positions));
        }
        Self { mesh }
    }

    /// With no edge longer than `longest` in the world; `None` if that takes too many triangles.
    fn refined(mut self, longest: f32, world_from_object: &Transform) -> Option<Self> {
        let is_long = |a: Vec3, b: Vec3| world_from_object.vector(b - a).length() > longest;
        loop {
            let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
            let mut faces = Vec::with_capacity(self.mesh.indices.len());
            let old = std::mem::take(&mut self.mesh.indices);
            for face in &old {
                // The middle of each edge, if it is long.
                let middle = [0, 1, 2].map(|k| {
                    let (a, b) = (face[k], face[(k + 1) % 3]);
                    let (low, high) = (a.min(b), a.max(b));
                    let [p, q] = [low, high].map(|i| self.mesh.positions[i as usize]);
                    is_long(p, q)
                        .then(|| *middles.entry([low, high]).or_insert_with(|| self.halve(low, high)))
                });
                self.split(*face, middle, &mut faces);
            }
            self.mesh.indices = faces;
            if middles.is_empty() {
                return Some(self);
            }
            if self.mesh.indices.len() > MOST_TRIANGLES {
                return None;
            }
        }
    }

    /// A new vertex in the middle of two.
    fn halve(&mut self, a: u32, b: u32) -> u32 {
        let m = &mut self.mesh;
        let (a, b) = (a as usize, b as usize);
        m.positions.push((m.positions[a] + m.positions[b]) * 0.5);
        let n = m.normals[a] + m.normals[b];
        m.normals.push(n.try_normalize().unwrap_or(m.normals[a]));
        if !m.uvs.is_empty() {
            m.uvs.push((m.uvs[a] + m.uvs[b]) * 0.5);
        }
        (m.positions.len() - 1) as u32
    }

    /// A triangle by the middles of its edges: `middle[k]` is that of the corners k and k + 1.
    fn split(&self, face: [u32; 3], middle: [Option<u32>; 3], faces: &mut Vec<[u32; 3]>) {
        let turned = |k: usize| [face[k], face[(k + 1) % 3], face[(k + 2) % 3]];
        match middle {
            [None, None, None] => faces.push(face),
            [Some(ab), Some(bc), Some(ca)] => {
                let [a, b, c] = face;
                faces.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
            }
            [Some(m), None, None] => Self::halves(turned(0), m, faces),
            [None, Some(m), None] => Self::halves(turned(1), m, faces),
            [None, None, Some(m)] => Self::halves(turned(2), m, faces),
            [Some(m), Some(n), None] => self.thirds(turned(0), m, n, faces),
            [None, Some(m), Some(n)] => self.thirds(turned(1), m, n, faces),
            [Some(n), None, Some(m)] => self.thirds(turned(2), m, n, faces),
        }
    }

    /// The edge `ab` has a middle.
    fn halves([a, b, c]: [u32; 3], ab: u32, faces: &mut Vec<[u32; 3]>) {
        faces.extend([[a, ab, c], [ab, b, c]]);
    }

    /// The edges `ab` and `bc` have middles: a corner, and a quadrilateral cut along its shorter diagonal.
    fn thirds(&self, [a, b, c]: [u32; 3], ab: u32, bc: u32, faces: &mut Vec<[u32; 3]>) {
        let length = |i: u32, j: u32| {
            let [p, q] = [i, j].map(|i| self.mesh.positions[i as usize]);
            p.distance_squared(q)
        };
        faces.push([ab, b, bc]);
        match length(a, bc) <= length(ab, c) {
            true => faces.extend([[a, ab, bc], [a, bc, c]]),
            false => faces.extend([[a, ab, c], [ab, bc, c]]),
        }
    }

    /// Moves the vertices.
    fn push_out(&mut self, textures: &Textures, height: &FloatHandle) {
        let m = &mut self.mesh;
        let places = places(&m.positions);
        let n_places = places.iter().map(|p| p + 1).max().unwrap_or(0);

        // One height and one normal for all vertices at a place.
        let mut sums = vec![(0.0_f32, 0_u32, Vec3::ZERO); n_places];
        for (i, place) in places.iter().enumerate() {
            let uv = m.uvs.get(i).copied().unwrap_or(Vec2::ZERO);
            let (p, n) = (Point(m.positions[i]), Dir(m.normals[i]));
            let ctx = TextureContext { p, n, uv, footprint: Footprint::default(), place: Place::default() };
            let sum = &mut sums[*place];
            let h = textures.float(height, &ctx);
            *sum = (sum.0 + if h.is_finite() { h } else { 0.0 }, sum.1 + 1, sum.2 + m.normals[i]);
        }
        for (p, place) in m.positions.iter_mut().zip(&places) {
            let (h, count, n) = sums[*place];
            *p += n.try_normalize().unwrap_or(Vec3::ZERO) * (h / count as f32);
        }
        m.normals = around(m, &places);
    }
}

/// A number for each vertex, the same for those at one place.
fn places(positions: &[Vec3]) -> Vec<usize> {
    let mut known: HashMap<[u32; 3], usize> = HashMap::new();
    positions
        .iter()
        .map(|p| {
            // Zero has two signs.
            let key = (*p + Vec3::ZERO).to_array().map(f32::to_bits);
            let next = known.len();
            *known.entry(key).or_insert(next)
        })
        .collect()
}

/// Normals by the faces around each place, each counting by its area.
fn around(mesh: &MeshDesc, places: &[usize]) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; places.iter().map(|p| p + 1).max().unwrap_or(0)];
    for face in &mesh.indices {
        let [a, b, c] = face.map(|i| mesh.positions[i as usize]);
        let n = (b - a).cross(c - a);
        face.iter().for_each(|i| sums[places[*i as usize]] += n);
    }
    places.iter().map(|p| sums[*p].try_normalize().unwrap_or(Vec3::Z)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use math::AnimatedTransform;
    use scene_desc::{
        BilinearMesh, DisplacementDesc, FloatInput, MaterialId, Span, TextureDesc, TextureId, TextureKind,
        TextureNode,
    };
    use spectrum::{ColorMode, ColorSpace};

    /// The corners of a cube of side 2, each face with vertices and (u, v) of its own: nothing is shared but places.
    fn cube() -> MeshDesc {
        let mut mesh = MeshDesc::default();
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let base = mesh.positions.len() as u32;
                for (s, t) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                    let mut p = [0.0; 3];
                    (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, s * side, t);
                    mesh.positions.push(Vec3::from(p));
                    mesh.uvs.push(Vec2::new(0.5 + 0.5 * s, 0.5 + 0.5 * t));
                }
                mesh.indices.extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
            }
        }
        mesh
    }

    fn scene(mesh: MeshDesc, height: FloatInput, edge_length: f32, textures: Vec<TextureDesc>) -> SceneDesc {
        scene_of(Geometry::Mesh(Arc::new(mesh)), height, edge_length, textures)
    }

    fn scene_of(
        geometry: Geometry,
        height: FloatInput,
        edge_length: f32,
        textures: Vec<TextureDesc>,
    ) -> SceneDesc {
        let shape = ShapeDesc {
            geometry,
            world_from_object: AnimatedTransform::fixed(Transform::IDENTITY),
            reverse_orientation: false,
            material: MaterialId(0),
            alpha: None,
            displacement: Some(DisplacementDesc { height, edge_length }),
            area_light: None,
            medium_interface: None,
            span: Span::NONE,
        };
        SceneDesc { shapes: vec![shape], textures, ..SceneDesc::default() }
    }

    fn moved(scene: &SceneDesc) -> Arc<MeshDesc> {
        let mut sink = Sink::default();
        let colors = ColorPipeline::new(ColorMode::Rgb, ColorSpace::Srgb);
        let scene = displaced(scene, colors, &mut sink).unwrap();
        assert!(sink.diagnostics().is_empty(), "{}", sink.render());
        let Geometry::Mesh(mesh) = &scene.shapes[0].geometry else {
            panic!("{:?}", scene.shapes[0].geometry)
        };
        Arc::clone(mesh)
    }

    /// Every edge, by places, is met once each way.
    fn is_closed(mesh: &MeshDesc) -> bool {
        let places = places(&mesh.positions);
        let mut edges: HashMap<[usize; 2], i32> = HashMap::new();
        for f in &mesh.indices {
            for k in 0..3 {
                let [a, b] = [f[k], f[(k + 1) % 3]].map(|i| places[i as usize]);
                *edges.entry([a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { -1 };
            }
        }
        edges.values().all(|n| *n == 0)
    }

    fn volume(mesh: &MeshDesc) -> f64 {
        let corner = |i: u32| mesh.positions[i as usize].as_dvec3();
        mesh.indices.iter().map(|f| corner(f[0]).dot(corner(f[1]).cross(corner(f[2]))) / 6.0).sum()
    }

    #[test]
    fn a_height_of_nothing_leaves_the_form_as_it_was() {
        let mesh = moved(&scene(cube(), 0.0.into(), 0.3, Vec::new()));
        assert!(is_closed(&mesh) && (volume(&mesh) - 8.0).abs() < 1e-5, "{}", volume(&mesh));
        let length = |a: u32, b: u32| (mesh.positions[a as usize] - mesh.positions[b as usize]).length();
        let longest =
            mesh.indices.iter().map(|f| length(f[0], f[1]).max(length(f[1], f[2])).max(length(f[2], f[0])));
        let longest = longest.fold(0.0, f32::max);
        assert!(longest <= 0.3, "{longest}");
    }

    #[test]
    fn a_seam_of_texture_and_normals_does_not_tear() {
        // Checks whose two values differ at every edge of the cube.
        let node = TextureNode::Checkerboard {
            a: scene_desc::TextureInput::Float(0.0),
            b: scene_desc::TextureInput::Float(0.4),
            mapping: Some(scene_desc::Mapping2d::Uv { scale: [3.0, 5.0], shift: [0.1, 0.2] }),
            texture_from_world: Transform::IDENTITY,
        };
        let texture = TextureDesc { name: "t".into(), kind: TextureKind::Float, node, span: Span::NONE };
        let height = FloatInput::Texture(TextureId(0));
        let mesh = moved(&scene(cube(), height, 0.21, vec![texture]));
        assert!(is_closed(&mesh) && volume(&mesh) > 8.5);
        assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-4));
    }

    #[test]
    fn a_plane_moves_as_far_as_the_texture_says() {
        let plane = MeshDesc {
            positions: vec![Vec3::ZERO, Vec3::X * 4.0, Vec3::new(4.0, 1.0, 0.0), Vec3::Y],
            uvs: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
            indices: vec![[0, 1, 2], [0, 2, 3]],
            ..MeshDesc::default()
        };
        // A ramp: the height is 2u, so that the plane leans by 2 in 4.
        let number = scene_desc::TextureInput::Float;
        let node = TextureNode::Bilerp {
            corners: [number(0.0), number(0.0), number(2.0), number(2.0)],
            mapping: scene_desc::Mapping2d::default(),
        };
        let texture = TextureDesc { name: "t".into(), kind: TextureKind::Float, node, span: Span::NONE };
        let mesh = moved(&scene(plane, FloatInput::Texture(TextureId(0)), 0.5, vec![texture]));
        for (p, uv) in mesh.positions.iter().zip(&mesh.uvs) {
            assert!((p.z - 2.0 * uv.x).abs() < 1e-5 && (p.x - 4.0 * uv.x).abs() < 1e-5, "{p} {uv}");
        }
        let expected = Vec3::new(-0.5, 0.0, 1.0).normalize();
        assert!(mesh.normals.iter().all(|n| (*n - expected).length() < 1e-4));
    }

    /// Six patches that share their corners alone, and a height that has another value on each side of every edge.
    #[test]
    fn a_box_of_patches_stays_closed() {
        let cube = cube();
        let quads = |c: u32| [4 * c, 4 * c + 1, 4 * c + 3, 4 * c + 2];
        // Some are turned, so that their edges run the other way.
        let quads = (0..6).map(|c| match (quads(c), c % 2) {
            ([a, b, c, d], 0) => [b, d, a, c],
            (q, _) => q,
        });
        let mut positions = cube.positions.clone();
        // A corner that is pulled out twists three of them.
        positions.iter_mut().filter(|p| **p == Vec3::ONE).for_each(|p| *p = Vec3::new(1.7, 1.5, 1.9));
        let patches = BilinearMesh { positions, indices: quads.collect(), ..BilinearMesh::default() };
        let node = TextureNode::Checkerboard {
            a: scene_desc::TextureInput::Float(0.0),
            b: scene_desc::TextureInput::Float(0.3),
            mapping: Some(scene_desc::Mapping2d::Uv { scale: [3.0, 5.0], shift: [0.1, 0.2] }),
            texture_from_world: Transform::IDENTITY,
        };
        let texture = TextureDesc { name: "t".into(), kind: TextureKind::Float, node, span: Span::NONE };
        let patches = Geometry::BilinearMesh(Arc::new(patches));
        let flat = moved(&scene_of(patches.clone(), 0.0.into(), 0.2, Vec::new()));
        let rough = moved(&scene_of(patches, FloatInput::Texture(TextureId(0)), 0.2, vec![texture]));
        assert!(is_closed(&flat) && is_closed(&rough));
        assert!(volume(&flat) > 9.0 && volume(&rough) > volume(&flat) + 0.5, "{}", volume(&rough));
    }

    #[test]
    fn a_subdivided_surface_is_cut_finely_and_moved_along_its_normals() {
        let positions = vec![Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
        let indices =
            vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
        let control = Geometry::LoopSubdiv(Arc::new(LoopSubdiv { positions, indices, levels: 0 }));
        let [still, out] =
            [0.0, 0.2].map(|h: f32| moved(&scene_of(control.clone(), h.into(), 0.1, Vec::new())));
        assert_eq!(still.indices.len(), 8 * 256, "four levels");
        assert!(is_closed(&out));
        // A parallel surface: area and mean curvature of a ball of this volume, nearly.
        let radius = (volume(&still) * 0.75 / std::f64::consts::PI).cbrt();
        let grown = ((radius + 0.2) / radius).powi(3);
        assert!((volume(&out) / volume(&still) / grown - 1.0).abs() < 0.05, "{} {grown}", volume(&out));
    }

    #[test]
    fn edges_without_length_are_refused() {
        let triangle = MeshDesc {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            indices: vec![[0, 1, 2]],
            ..MeshDesc::default()
        };
        for edge_length in [0.0, -1.0, f32::NAN] {
            let mut sink = Sink::default();
            let colors = ColorPipeline::new(ColorMode::Rgb, ColorSpace::Srgb);
            displaced(&scene(triangle.clone(), 0.1.into(), edge_length, Vec::new()), colors, &mut sink);
            assert!(sink.has_errors(), "{edge_length}");
        }
    }
}
