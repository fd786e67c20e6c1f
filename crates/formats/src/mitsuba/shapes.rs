//! Shapes: forms, groups and instances.
//!
//! Mitsuba's sides: a mesh without normals in its file faces where its winding says, *after* `to_world`; everything else
//! keeps its outside outside under a mirror, as ours does.

use std::sync::Arc;

use math::{AnimatedTransform, DMat4, Transform, Vec2, Vec3};
use scene_desc::{
    AreaLightDesc, Geometry, InstanceDesc, MaterialId, MaterialKind, MediumInterface, MeshDesc, ObjectDesc,
    ObjectId, ShapeDesc,
};

use super::build::Build;
use super::tree::{Class, Node, NodeId};

/// Shapes that are known, supported or not.
const NAMES: [&str; 20] = [
    "bsplinecurve",
    "cube",
    "cylinder",
    "deformable",
    "disk",
    "ellipsoids",
    "ellipsoidsmesh",
    "hair",
    "heightfield",
    "instance",
    "linearcurve",
    "merge",
    "mesh",
    "obj",
    "ply",
    "rectangle",
    "sdfgrid",
    "serialized",
    "shapegroup",
    "sphere",
];

/// A form in its place.
pub(super) struct Form {
    pub(super) geometry: Geometry,
    /// To the shape's own space.
    pub(super) place: Transform,
    /// Does the normal point the other way?
    pub(super) flip: bool,
}

impl Form {
    pub(super) fn plain(geometry: Geometry) -> Self {
        Self { geometry, place: Transform::IDENTITY, flip: false }
    }
}

/// What shapes have besides their form.
struct Attached {
    material: MaterialId,
    light: Option<AreaLightDesc>,
    media: Option<MediumInterface>,
}

impl<'t> Build<'t, '_, '_> {
    /// A shape of the world.
    pub(super) fn shape(&mut self, node: &'t Node, id: NodeId) {
        match node.kind.as_str() {
            "instance" => self.instance(node),
            "shapegroup" => {
                self.group(node, id);
            }
            "merge" => {
                for (_, child, id) in self.children(node) {
                    match child.class {
                        Class::Shape if child.kind != "merge" => self.shape(child, id),
                        _ => self.misplaced(child, node),
                    }
                }
                self.unused(node);
            }
            _ => {
                let mut shapes = std::mem::take(&mut self.scene.shapes);
                self.add_form(node, &mut shapes);
                self.scene.shapes = shapes;
            }
        }
    }

    fn instance(&mut self, node: &'t Node) {
        let world_from_object = self.animated(node, "to_world");
        let children = self.children(node);
        match children.as_slice() {
            [(_, group, id)] if group.kind == "shapegroup" => {
                if let Some(object) = self.group(group, *id) {
                    let span = node.span;
                    self.scene.instances.push(InstanceDesc { object, world_from_object, span });
                }
            }
            _ => {
                let hint = "put <ref id=\"…\"/> of a shapegroup into it";
                self.report.error(node.span, "an instance of no shape group").hint(hint);
            }
        }
        self.unused(node);
    }

    /// The object of a shape group, made once.
    fn group(&mut self, node: &'t Node, id: NodeId) -> Option<ObjectId> {
        if let Some(found) = self.objects.get(&id) {
            return *found;
        }
        let mut shapes = Vec::new();
        for (_, child, _) in self.children(node) {
            let is_form = !matches!(child.kind.as_str(), "instance" | "shapegroup" | "merge");
            match child.class {
                Class::Shape if is_form => self.add_form(child, &mut shapes),
                _ => self.misplaced(child, node),
            }
        }
        self.unused(node);
        let name = node.id.clone().unwrap_or_default();
        self.scene.objects.push(ObjectDesc { name, shapes, instances: Vec::new() });
        let object = ObjectId(u32::try_from(self.scene.objects.len() - 1).unwrap_or(u32::MAX));
        self.objects.insert(id, Some(object));
        Some(object)
    }

    fn add_form(&mut self, node: &'t Node, shapes: &mut Vec<ShapeDesc>) {
        let world_from_object = self.animated(node, "to_world");
        let flip = self.boolean(node, "flip_normals", false);
        let forms = self.forms(node, &world_from_object);
        let attached = self.attached(node);
        self.unused(node);
        for form in forms.unwrap_or_default() {
            shapes.push(ShapeDesc {
                geometry: form.geometry,
                world_from_object: placed(&world_from_object, form.place),
                reverse_orientation: form.flip != flip,
                material: attached.material,
                alpha: None,
                displacement: None,
                area_light: attached.light.clone(),
                medium_interface: attached.media,
                span: node.span,
            });
        }
    }

    /// Material, light and media of a shape.
    fn attached(&mut self, node: &'t Node) -> Attached {
        let (mut material, mut light, mut media) = (None, None, MediumInterface::default());
        for (p, child, id) in self.children(node) {
            match (child.class, p.name.as_str()) {
                (Class::Bsdf, _) => material = Some(self.material(id)),
                (Class::Emitter, _) if child.kind == "area" => light = Some(self.area_light(child)),
                (Class::Emitter, _) => {
                    self.unsupported(child, "a shape takes an \"area\" emitter: this one is left out");
                }
                (Class::Medium, "interior") => media.inside = self.medium(id),
                (Class::Medium, "exterior") => media.outside = self.medium(id),
                (Class::Texture, _) => {
                    let what = format!("attribute \"{}\" of a shape", p.name);
                    self.report.warning(p.span, format!("{what} is not supported")).hint("it is ignored");
                }
                (Class::Subsurface, _) => {
                    self.unsupported(child, "the surface is shown without what is under it");
                }
                (Class::Medium, _) => {
                    self.report
                        .error(p.span, "a medium on neither side")
                        .hint("say which: name=\"interior\" or name=\"exterior\"");
                }
                _ => self.misplaced(child, node),
            }
        }
        let material = material.unwrap_or_else(|| self.no_material(light.is_some()));
        // Two materials say "inside" by other means: a border of nothing is none.
        let is_border = media.inside != media.outside;
        let is_null = matches!(self.scene.materials[material.index()].kind, MaterialKind::Interface);
        Attached {
            material,
            light,
            media: (is_border || (is_null && media.inside.is_some())).then_some(media),
        }
    }

    fn forms(&mut self, node: &'t Node, world_from_object: &AnimatedTransform) -> Option<Vec<Form>> {
        Some(match node.kind.as_str() {
            "obj" | "ply" | "serialized" => vec![self.mesh(node, world_from_object)?],
            "rectangle" => vec![Form::plain(Geometry::Mesh(Arc::new(rectangle())))],
            "cube" => vec![Form::plain(Geometry::Mesh(Arc::new(cube())))],
            "sphere" => vec![self.sphere(node)],
            "disk" => {
                let disk = Geometry::Disk { height: 0.0, radius: 1.0, inner_radius: 0.0, phi_max: 360.0 };
                vec![Form::plain(disk)]
            }
            "cylinder" => vec![self.cylinder(node)?],
            "bsplinecurve" | "linearcurve" | "hair" => self.curves(node, world_from_object)?,
            name if NAMES.contains(&name) => {
                self.unsupported(node, "it is left out");
                return None;
            }
            _ => {
                self.unknown(node, &NAMES);
                return None;
            }
        })
    }

    fn sphere(&mut self, node: &Node) -> Form {
        let radius = self.positive(node, "radius", 1.0);
        let center = self.vector(node, "center").unwrap_or(Vec3::ZERO);
        Form {
            geometry: Geometry::Sphere { radius, z_min: -radius, z_max: radius, phi_max: 360.0 },
            place: Transform::translate(center.as_dvec3()),
            flip: false,
        }
    }

    /// From p0 to p1, its normal outwards.
    fn cylinder(&mut self, node: &Node) -> Option<Form> {
        let radius = self.positive(node, "radius", 1.0);
        let p0 = self.vector(node, "p0").unwrap_or(Vec3::ZERO).as_dvec3();
        let p1 = self.vector(node, "p1").unwrap_or(Vec3::Z).as_dvec3();
        let length = (p1 - p0).length();
        let Some(axis) = (p1 - p0).try_normalize() else {
            return self.refuse(node.span, "a cylinder without height", "\"p0\" and \"p1\" must differ");
        };
        let (s, t) = axis.any_orthonormal_pair();
        // It begins at p1, so that v runs from p1 to p0.
        let m = DMat4::from_cols(s.extend(0.0), t.extend(0.0), (-axis).extend(0.0), p1.extend(1.0));
        let geometry = Geometry::Cylinder { radius, z_min: 0.0, z_max: length as f32, phi_max: 360.0 };
        Transform::from_matrix(m).map(|place| Form { geometry, place, flip: false })
    }
}

fn placed(world_from_object: &AnimatedTransform, place: Transform) -> AnimatedTransform {
    if place == Transform::IDENTITY {
        return *world_from_object;
    }
    let t = world_from_object;
    AnimatedTransform::new(t.start() * place, t.end() * place, t.times())
}

/// From −1 to 1 in x and y, facing +z.
fn rectangle() -> MeshDesc {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(Vec2::from);
    MeshDesc {
        positions: corners.map(|c| c.extend(0.0)).to_vec(),
        uvs: corners.map(|c| Vec2::new(0.5 * (c.x + 1.0), 0.5 * (1.0 - c.y))).to_vec(),
        indices: vec![[0, 1, 2], [0, 2, 3]],
        ..MeshDesc::default()
    }
}

/// From −1 to 1: six faces, each with all of the texture, its corners in Mitsuba's order.
fn cube() -> MeshDesc {
    const FACES: [[[f32; 3]; 4]; 6] = [
        [[1.0, -1.0, -1.0], [1.0, -1.0, 1.0], [-1.0, -1.0, 1.0], [-1.0, -1.0, -1.0]],
        [[1.0, 1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, 1.0, 1.0], [1.0, 1.0, 1.0]],
        [[1.0, -1.0, -1.0], [1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [1.0, -1.0, 1.0]],
        [[1.0, -1.0, 1.0], [1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [-1.0, -1.0, 1.0]],
        [[-1.0, -1.0, 1.0], [-1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, -1.0]],
        [[1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, -1.0], [-1.0, 1.0, -1.0]],
    ];
    // Mitsuba's (0,1), (1,1), (1,0), (0,0) with v upwards.
    const UVS: [[f32; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let mut mesh = MeshDesc::default();
    for (i, face) in FACES.iter().enumerate() {
        let first = 4 * i as u32;
        mesh.positions.extend(face.map(Vec3::from));
        mesh.uvs.extend(UVS.map(Vec2::from));
        mesh.indices.extend([[0, 1, 2], [3, 0, 2]].map(|t: [u32; 3]| t.map(|k| first + k)));
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_faces_outwards() {
        let cube = cube();
        for t in &cube.indices {
            let [a, b, c] = t.map(|i| cube.positions[i as usize]);
            assert!((b - a).cross(c - a).dot(a + b + c) > 0.0);
        }
    }
}
