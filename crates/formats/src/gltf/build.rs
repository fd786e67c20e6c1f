//! The scene: nodes with what they carry; a camera and lights where the file has none.

use std::sync::Arc;

use math::{AnimatedTransform, Bounds, DMat4, DVec3, Point, Transform, Vec3, trig};
use scene_desc::{
    CameraDesc, FilmDesc, Geometry, Illuminant, InstanceDesc, IntegratorDesc, LightDesc, LightKind,
    MediumInterface, MeshDesc, ObjectDesc, ObjectId, SceneDesc, ShapeDesc, SpectrumDesc, SpotFalloff,
};

use super::camera::{Lens, perspective};
use super::container::Container;
use super::geometry::{Joints, Pose, from_parts};
use super::json::{Light, Node, Primitive};
use super::materials::{Look, Materials};
use crate::report::Report;

/// Height of a picture whose file has a camera.
const HEIGHT: f32 = 720.0;
/// What Blender's exporter multiplies watts with: the efficacy of green light.
const LUMENS_PER_WATT: f32 = 683.0;
/// Most vertices of all shapes that are not repetitions.
const MOST_VERTICES: usize = 1 << 31;

/// What the file makes; errors are in the report.
pub(super) fn scene(file: &Container, report: &mut Report<'_>) -> (SceneDesc, Vec<u64>) {
    let mut scene = SceneDesc {
        integrator: IntegratorDesc { max_depth: None, ..IntegratorDesc::default() },
        ..SceneDesc::default()
    };
    let mut materials = Materials::new(file, &mut scene, report);
    let (looks, colored) = materials.all();
    let hashes = std::mem::take(&mut materials.hashes);
    let mut build = Build {
        file,
        looks,
        colored,
        worlds: vec![None; file.root.nodes.len()],
        uses: vec![0; file.root.meshes.len()],
        objects: vec![None; file.root.meshes.len()],
        bounds: Bounds::EMPTY,
        n_vertices: 0,
        has_camera: false,
        scene,
        report,
    };
    build.all();
    (build.scene, hashes)
}

struct Build<'a, 'r, 's> {
    file: &'a Container,
    looks: Vec<Look>,
    /// The same with colours of vertices, where some mesh has them.
    colored: Vec<Option<Look>>,
    /// World from node, of nodes that the scene reaches.
    worlds: Vec<Option<DMat4>>,
    /// How many nodes show each mesh.
    uses: Vec<u32>,
    /// What repeats each mesh that is shown more than once.
    objects: Vec<Option<ObjectId>>,
    /// Of all that was placed.
    bounds: Bounds,
    n_vertices: usize,
    has_camera: bool,
    scene: SceneDesc,
    report: &'r mut Report<'s>,
}

impl Build<'_, '_, '_> {
    fn all(&mut self) {
        let file = self.file;
        let order = self.order();
        for &i in &order {
            if let Some(uses) = file.root.nodes[i].mesh.and_then(|m| self.uses.get_mut(m)) {
                *uses += 1;
            }
        }
        for &i in &order {
            let node = &file.root.nodes[i];
            let world = self.worlds[i].unwrap_or(DMat4::IDENTITY);
            if let Some(light) = &node.extensions.light {
                self.light(light.light, &world);
            }
            if let Some(camera) = node.camera.filter(|_| !self.has_camera) {
                self.camera(camera, &world);
            }
            if let Some(mesh) = node.mesh
                && let Err(e) = self.mesh(node, mesh, &world)
            {
                self.error(format!("mesh {mesh}: {e}"));
            }
        }
        if self.scene.shapes.is_empty() && self.scene.instances.is_empty() && !self.report.has_errors() {
            self.report
                .warning(self.file.span, "there is nothing to see in it: no mesh is part of the scene");
        }
        if !self.has_camera {
            self.default_camera();
        }
        let in_objects = self.scene.objects.iter().flat_map(|o| &o.shapes);
        let glows = self.scene.shapes.iter().chain(in_objects).any(|s| s.area_light.is_some());
        if !glows && self.scene.lights.is_empty() {
            self.default_lights();
        }
    }

    fn error(&mut self, message: String) {
        self.report.error(self.file.span, message);
    }

    /// The nodes of the scene, parents first, each once; their places in the world are known then.
    fn order(&mut self) -> Vec<usize> {
        let root = &self.file.root;
        let roots: Vec<usize> = match root.scenes.get(root.scene.unwrap_or(0)) {
            Some(scene) => scene.nodes.clone(),
            // Without scenes: whatever is nobody's child.
            None => {
                let mut is_child = vec![false; root.nodes.len()];
                for &c in root.nodes.iter().flat_map(|n| &n.children) {
                    if let Some(is_child) = is_child.get_mut(c) {
                        *is_child = true;
                    }
                }
                (0..root.nodes.len()).filter(|&i| !is_child[i]).collect()
            }
        };
        let mut open: Vec<(usize, DMat4)> = roots.into_iter().rev().map(|i| (i, DMat4::IDENTITY)).collect();
        let mut order = Vec::new();
        while let Some((i, parent)) = open.pop() {
            let Some(node) = root.nodes.get(i) else {
                self.error(format!("there is no node {i}"));
                continue;
            };
            if self.worlds[i].is_some() {
                let message = format!("node {i} is reached twice: nodes make a tree, without loops");
                self.report.error(self.file.span, message).hint("every node has at most one parent");
                continue;
            }
            let world = parent * local(node);
            self.worlds[i] = Some(world);
            order.push(i);
            open.extend(node.children.iter().rev().map(|&c| (c, world)));
        }
        order
    }

    fn mesh(&mut self, node: &Node, index: usize, world: &DMat4) -> Result<(), String> {
        let mesh = self.file.root.meshes.get(index).ok_or("there is none of this number")?;
        // A mesh that others show as well is kept once, if nothing of it depends on its place.
        let repeats = self.uses[index] > 1 && node.skin.is_none() && node.weights.is_empty();
        if !repeats {
            let joints = node.skin.map(|s| self.joints(s)).transpose()?;
            // Joints alone say where a skin is.
            let place = if joints.is_some() { DMat4::IDENTITY } else { *world };
            let weights = if node.weights.is_empty() { &mesh.weights } else { &node.weights };
            let shapes = self.shapes(index, weights, joints.as_ref(), &place)?;
            self.scene.shapes.extend(shapes);
            return Ok(());
        }
        let object = match self.objects[index] {
            Some(object) => object,
            None => {
                let weights = &mesh.weights;
                let before = self.bounds;
                let shapes = self.shapes(index, weights, None, &DMat4::IDENTITY)?;
                self.bounds = before;
                let object = ObjectId(self.scene.objects.len() as u32);
                self.scene.objects.push(ObjectDesc {
                    name: format!("mesh {index}"),
                    shapes,
                    instances: vec![],
                });
                self.objects[index] = Some(object);
                object
            }
        };
        let Some(placed) = Transform::from_matrix(*world) else { return Ok(()) };
        for shape in &self.scene.objects[object.index()].shapes {
            if let Geometry::Mesh(mesh) = &shape.geometry {
                self.bounds = grown(self.bounds, mesh, &placed);
            }
        }
        let world_from_object = AnimatedTransform::fixed(placed);
        self.scene.instances.push(InstanceDesc { object, world_from_object, span: self.file.span });
        Ok(())
    }

    fn look_of(&self, primitive: &Primitive) -> &Look {
        let default = self.looks.len() - 1;
        let index = primitive.material.filter(|m| *m < default).unwrap_or(default);
        let colored = self.colored[index].as_ref().filter(|_| primitive.attributes.color_0.is_some());
        colored.unwrap_or(&self.looks[index])
    }

    /// What a mesh's primitives become at a place.
    fn shapes(
        &mut self,
        index: usize,
        weights: &[f32],
        joints: Option<&Joints>,
        world: &DMat4,
    ) -> Result<Vec<ShapeDesc>, String> {
        // A mesh without extent is not there.
        let Some(placed) = Transform::from_matrix(*world) else { return Ok(vec![]) };
        let mut shapes = Vec::new();
        for primitive in &self.file.root.meshes[index].primitives {
            if let Some(name) = primitive.extensions.keys().find(|k| k.contains("compression")) {
                return Err(format!("its triangles are compressed by {name}, which is not read"));
            }
            if primitive.material.is_some_and(|m| m >= self.file.root.materials.len()) {
                return Err(format!("there is no material {}", primitive.material.unwrap_or(0)));
            }
            let look = self.look_of(primitive).clone();
            let pose = Pose { weights, joints, uv_set: look.uv_set };
            let Some(mesh) = self.file.mesh(primitive, &pose)? else {
                self.once("points and lines have no surface: they are left out");
                continue;
            };
            if mesh.indices.is_empty() {
                continue;
            }
            self.n_vertices += mesh.positions.len() + mesh.indices.len();
            if self.n_vertices > MOST_VERTICES {
                return Err("there are more vertices than can be told apart".to_owned());
            }
            self.bounds = grown(self.bounds, &mesh, &placed);
            shapes.push(ShapeDesc {
                geometry: Geometry::Mesh(Arc::new(mesh)),
                world_from_object: AnimatedTransform::fixed(placed),
                reverse_orientation: false,
                material: look.material,
                alpha: None,
                displacement: None,
                area_light: look.area_light,
                medium_interface: look.medium.map(|m| MediumInterface { inside: Some(m), outside: None }),
                span: self.file.span,
            });
        }
        Ok(shapes)
    }

    fn once(&mut self, message: &str) {
        if self.report.first(message) {
            self.report.warning(self.file.span, message);
        }
    }

    /// World from the space in which a skin was bound, for every joint.
    fn joints(&self, skin: usize) -> Result<Joints, String> {
        let skin = self.file.root.skins.get(skin).ok_or_else(|| format!("there is no skin {skin}"))?;
        let inverse = skin.inverse_bind_matrices.map(|i| self.file.floats(i, 16)).transpose()?;
        let inverse = inverse.unwrap_or_default();
        let joint = |(i, &node): (usize, &usize)| {
            let world = self.worlds.get(node).copied().flatten();
            let world = world.ok_or_else(|| format!("joint {node} is not part of the scene"))?;
            let bind = inverse.get(16 * i..16 * i + 16).map_or(DMat4::IDENTITY, |m| {
                DMat4::from_cols_array(&std::array::from_fn(|k| f64::from(m[k])))
            });
            Ok(world * bind)
        };
        skin.joints.iter().enumerate().map(joint).collect()
    }

    fn light(&mut self, index: usize, world: &DMat4) {
        let Some(light) = self.file.root.extensions.lights.lights.get(index) else {
            return self.error(format!("there is no light {index}"));
        };
        let at = world.transform_point3(DVec3::ZERO).as_vec3();
        let towards = world.transform_vector3(-DVec3::Z).normalize_or_zero().as_vec3();
        if !at.is_finite() || towards == Vec3::ZERO {
            return;
        }
        match light_kind(light, self.light_unit(), at, at + towards) {
            Some(kind) => self.add_light(kind),
            None => self.error(format!("light {index} is of the unknown type `{}`", light.kind)),
        }
    }

    /// What the file's candela and lux are worth in watts (see the head of the module).
    fn light_unit(&self) -> f32 {
        let root = &self.file.root;
        let most = root.extensions.lights.lights.iter().map(|l| l.intensity).fold(0.0, f32::max);
        if root.asset.generator.contains("Blender") && most >= 10.0 { 1.0 / LUMENS_PER_WATT } else { 1.0 }
    }

    fn add_light(&mut self, kind: LightKind) {
        let world_from_light = AnimatedTransform::fixed(Transform::IDENTITY);
        self.scene.lights.push(LightDesc { kind, world_from_light, medium: None, span: self.file.span });
    }

    fn camera(&mut self, index: usize, world: &DMat4) {
        let camera = self.file.root.cameras.get(index).and_then(Lens::new);
        // Its scale does not count; glTF looks along -z.
        let (back, up) = (world.transform_vector3(DVec3::Z), world.transform_vector3(DVec3::Y));
        let place = placed(world.transform_point3(DVec3::ZERO), -back, up);
        let (Some(lens), Some(place)) = (camera, place) else {
            return self.error(format!(
                "camera {index} cannot be used: it is missing, or its numbers are out of range"
            ));
        };
        self.has_camera = true;
        let aspect = lens.aspect.clamp(0.05, 20.0);
        let width = (HEIGHT * aspect).round() as u32;
        self.scene.film = FilmDesc { resolution: [width, HEIGHT as u32], ..FilmDesc::default() };
        self.scene.camera = CameraDesc {
            kind: lens.kind,
            world_from_camera: AnimatedTransform::fixed(place),
            screen_window: lens.window,
            span: self.file.span,
            ..CameraDesc::default()
        };
    }

    /// From the front, a little from above and from the right, all in view.
    fn default_camera(&mut self) {
        let (center, radius) = match self.bounds.is_empty() {
            true => (Point::new(0.0, 0.0, 0.0), 1.0),
            false => self.bounds.bounding_sphere(),
        };
        let radius = if radius > 0.0 && radius.is_finite() { radius } else { 1.0 };
        let fov = 30.0_f32;
        let distance = f64::from(1.05 * radius / trig::sin((0.5 * fov).to_radians()));
        let back = DVec3::new(0.35, 0.25, 1.0).normalize();
        let center = center.0.as_dvec3();
        if let Some(place) = placed(center + back * distance, -back, DVec3::Y) {
            self.scene.camera = CameraDesc {
                kind: perspective(fov),
                world_from_camera: AnimatedTransform::fixed(place),
                span: self.file.span,
                ..CameraDesc::default()
            };
        }
    }

    /// An even sky, and a key light from above, left of where models look to.
    fn default_lights(&mut self) {
        let white = |scale| Illuminant { spectrum: SpectrumDesc::srgb([1.0; 3]), scale, normalize: false };
        self.add_light(LightKind::InfiniteConstant { radiance: white(0.6), illuminance: None, portal: None });
        let (from, to) = (Vec3::new(-0.5, 1.0, 0.8), Vec3::ZERO);
        self.add_light(LightKind::Distant { radiance: white(1.8), from, to, illuminance: None });
    }
}

fn local(node: &Node) -> DMat4 {
    if let Some(m) = &node.matrix {
        return DMat4::from_cols_array(m);
    }
    let rotation = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    from_parts(node.translation.unwrap_or([0.0; 3]), rotation, node.scale.unwrap_or([1.0; 3]))
}

fn grown(bounds: Bounds, mesh: &MeshDesc, placed: &Transform) -> Bounds {
    let Some(&first) = mesh.positions.first() else { return bounds };
    let own = mesh.positions.iter().fold(Bounds::point(first), |b, &p| b.grow(p));
    bounds.union(placed.bounds(own))
}

/// World from camera at `eye`. The world is right-handed, our camera's space (x right, y up, z forward) is not.
fn placed(eye: DVec3, towards: DVec3, up: DVec3) -> Option<Transform> {
    let forward = towards.try_normalize()?;
    let right = forward.cross(up).try_normalize()?;
    let up = right.cross(forward);
    Transform::from_matrix(DMat4::from_cols(
        right.extend(0.0),
        up.extend(0.0),
        forward.extend(0.0),
        eye.extend(1.0),
    ))
}

fn light_kind(light: &Light, unit: f32, at: Vec3, to: Vec3) -> Option<LightKind> {
    let spectrum = SpectrumDesc::srgb(light.color);
    let size = Illuminant { spectrum, scale: light.intensity.max(0.0) * unit, normalize: false };
    Some(match light.kind.as_str() {
        "point" => LightKind::Point { intensity: size, from: at, power: None },
        "directional" => LightKind::Distant { radiance: size, from: at, to, illuminance: None },
        "spot" => {
            let outer = light.spot.outer_cone_angle.to_degrees().clamp(0.01, 90.0);
            let inner = light.spot.inner_cone_angle.to_degrees().clamp(0.0, outer);
            LightKind::Spot {
                intensity: size,
                from: at,
                to,
                cone_angle: outer,
                cone_delta: outer - inner,
                falloff: SpotFalloff::Smooth,
                power: None,
            }
        }
        _ => return None,
    })
}
