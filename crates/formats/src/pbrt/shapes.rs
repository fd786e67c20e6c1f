//! `Shape`: trianglemesh, plymesh, bilinearmesh, loopsubdiv, sphere, disk, cylinder (curves have their own file).

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use math::Vec3;
use scene_desc::{
    AreaLightDesc, BilinearMesh, DisplacementDesc, FloatInput, Geometry, LoopSubdiv, MaterialId,
    MaterialKind, MeshDesc, ShapeDesc, Span,
};

use super::build::Build;
use super::params::{Params, Type};
use super::state::{Entity, MaterialRef, ShapeEntity};
use crate::mesh::ply::Ply;
use crate::suggest;

const NAMES: [&str; 8] =
    ["bilinearmesh", "curve", "cylinder", "disk", "loopsubdiv", "plymesh", "sphere", "trianglemesh"];

/// Levels of subdivision: each has four times the triangles of the one before.
const MOST_LEVELS: u32 = 10;

impl Build<'_, '_> {
    pub(super) fn shapes(
        &mut self,
        shapes: Vec<ShapeEntity>,
        unnamed: &[MaterialId],
        area_lights: &[Option<AreaLightDesc>],
    ) {
        let plys = self.load_plys(&shapes);
        for mut shape in shapes {
            let alpha = self.alpha(&shape.entity.params);
            let geometry = self.geometry(&mut shape.entity, &plys);
            let Some(geometry) = geometry else { continue };
            let displacement = self.displacement(&shape.entity);
            shape.entity.params.report_unused(&format!("shape \"{}\"", shape.entity.kind), self.report);
            let Some(material) = self.shape_material(&shape.material, unnamed) else { continue };
            let area_light = self.shape_light(&shape, material, area_lights);
            let medium_interface = self.medium_interface(&shape, material);
            let world_from_object = shape.entity.ctm.animated();
            for geometry in geometry {
                let desc = ShapeDesc {
                    geometry,
                    world_from_object,
                    reverse_orientation: shape.reverse_orientation,
                    material,
                    alpha: alpha.clone(),
                    displacement: displacement.clone(),
                    area_light: area_light.clone(),
                    medium_interface,
                    span: shape.entity.span,
                };
                self.add_shape(desc, shape.object);
            }
        }
    }

    fn add_shape(&mut self, desc: ShapeDesc, object: Option<usize>) {
        match object.and_then(|o| self.scene.objects.get_mut(o)) {
            Some(object) => object.shapes.push(desc),
            None => self.scene.shapes.push(desc),
        }
    }

    fn alpha(&mut self, p: &Params) -> Option<FloatInput> {
        self.float_input(p, "alpha").filter(|a| *a != FloatInput::Constant(1.0))
    }

    fn shape_material(&mut self, material: &MaterialRef, unnamed: &[MaterialId]) -> Option<MaterialId> {
        match material {
            MaterialRef::Default => Some(MaterialId(0)),
            MaterialRef::Unnamed(i) => unnamed.get(*i).copied(),
            MaterialRef::Named(named) => {
                let found = self.named_materials.get(&named.name).copied();
                if found.is_none() {
                    let known: Vec<_> = self.named_materials.keys().cloned().collect();
                    self.unknown("named material", &named.name, named.span, known.iter());
                }
                found
            }
        }
    }

    /// The shape's emission. Where pbrt-v4 stays dark for want of support, it is said that this one shines.
    fn shape_light(
        &mut self,
        shape: &ShapeEntity,
        material: MaterialId,
        area_lights: &[Option<AreaLightDesc>],
    ) -> Option<AreaLightDesc> {
        let light = area_lights.get(shape.area_light?)?.clone()?;
        if self.scene.materials[material.index()].kind == MaterialKind::Interface {
            let ignored = "a shape of material \"interface\" cannot emit";
            self.report.warning(shape.entity.span, ignored).hint("its area light is ignored");
            return None;
        }
        let dark = if shape.object.is_some() {
            Some("a shape in an object emits")
        } else if shape.entity.ctm.is_animated() {
            Some("a shape that moves emits")
        } else {
            None
        };
        if let Some(what) = dark {
            self.report.warning(shape.entity.span, what).hint("pbrt-v4 has no such light: there it is dark");
        }
        Some(light)
    }

    /// Most shapes are one form; a PLY file of triangles and quadrilaterals is two.
    fn geometry(
        &mut self,
        entity: &mut Entity,
        plys: &HashMap<PathBuf, Option<Ply>>,
    ) -> Option<Vec<Geometry>> {
        let geometry = match entity.kind.as_str() {
            "trianglemesh" => self.triangle_mesh(entity)?,
            "bilinearmesh" => self.bilinear_mesh(entity)?,
            "loopsubdiv" => self.loop_subdiv(entity)?,
            "plymesh" => return self.ply_mesh(entity, plys),
            "sphere" => self.sphere(&entity.params, entity.span)?,
            "disk" => self.disk(&entity.params, entity.span)?,
            "cylinder" => self.cylinder(&entity.params, entity.span)?,
            "curve" => self.curve(entity)?,
            "cone" | "paraboloid" | "hyperboloid" | "heightfield" | "nurbs" => {
                let what = format!("shape \"{}\"", entity.kind);
                super::parser::old_syntax(self.report, entity.span, &what, "no such shape: use a mesh");
                return None;
            }
            name => {
                let hint = suggest::hint(name, &NAMES);
                return self.refuse(entity.span, format!("unknown shape \"{name}\""), hint);
            }
        };
        Some(vec![geometry])
    }

    fn triangle_mesh(&mut self, entity: &mut Entity) -> Option<Geometry> {
        let positions = self.positions(entity)?;
        let indices = self.indices::<3>(entity, positions.len())?;
        let p = &entity.params;
        p.accept(&[("faceIndices", Type::Integer)]);
        let n = positions.len();
        let uvs = p.vec2s("uv");
        let normals = p.vec3s("N", Type::Normal);
        let tangents = p.vec3s("S", Type::Vector3);
        // Ours: vertices that move, from the time at which transforms have their start to that of their end.
        let end_positions = p.vec3s("P1", Type::Point3);
        let end_normals = p.vec3s("N1", Type::Normal);
        let ends = [("P1", end_positions.len()), ("N1", end_normals.len())];
        for (name, len) in
            [("uv", uvs.len()), ("N", normals.len()), ("S", tangents.len())].into_iter().chain(ends)
        {
            self.per_vertex(entity, name, len, n)?;
        }
        if let Some(at) = p.span_of("N1").filter(|_| normals.is_empty() || end_positions.is_empty()) {
            return self.refuse(at, "\"N1\" without \"N\" and \"P1\"", "it says how the normals \"N\" turn");
        }
        let mut mesh = MeshDesc { positions, normals, tangents, uvs, indices, ..MeshDesc::default() };
        if !end_positions.is_empty() {
            (mesh.end_positions, mesh.end_normals) = (end_positions, end_normals);
            mesh.key_times = entity.ctm.times;
        }
        Some(Geometry::Mesh(Arc::new(mesh)))
    }

    fn bilinear_mesh(&mut self, entity: &mut Entity) -> Option<Geometry> {
        let positions = self.positions(entity)?;
        let indices = self.indices::<4>(entity, positions.len())?;
        let p = &entity.params;
        p.accept(&[("faceIndices", Type::Integer)]);
        if let Some((_, span)) = p.string_opt("emissionfilename", self.report) {
            self.report
                .warning(span, "\"emissionfilename\" is not supported")
                .hint("it is ignored: it guides pbrt's sampling and changes no picture");
        }
        let uvs = p.vec2s("uv");
        let normals = p.vec3s("N", Type::Normal);
        for (name, len) in [("uv", uvs.len()), ("N", normals.len())] {
            self.per_vertex(entity, name, len, positions.len())?;
        }
        Some(Geometry::BilinearMesh(Arc::new(BilinearMesh { positions, normals, uvs, indices })))
    }

    fn loop_subdiv(&mut self, entity: &mut Entity) -> Option<Geometry> {
        entity.params.accept(&[("scheme", Type::String)]);
        let levels = entity.params.count("levels", 3, 0..=MOST_LEVELS, self.report);
        let positions = self.positions(entity)?;
        let indices = self.indices::<3>(entity, positions.len())?;
        Some(Geometry::LoopSubdiv(Arc::new(LoopSubdiv { positions, indices, levels })))
    }

    fn positions(&mut self, entity: &Entity) -> Option<Vec<Vec3>> {
        let positions = entity.params.vec3s("P", Type::Point3);
        if positions.is_empty() {
            if entity.params.was_dropped("P") {
                return None;
            }
            if let Some(at) = entity.params.span_of("P") {
                return self.refuse(at, "\"P\" is of the wrong type", "it takes \"point3\"");
            }
            let message = format!("shape \"{}\" has no vertices", entity.kind);
            return self.refuse(entity.span, message, "add \"point3 P\" [ … ]");
        }
        Some(positions)
    }

    /// Corners of faces, all below `n_vertices`.
    fn indices<const N: usize>(&mut self, entity: &mut Entity, n_vertices: usize) -> Option<Vec<[u32; N]>> {
        let Some((raw, span)) = entity.params.take_integers("indices") else {
            if entity.params.was_dropped("indices") {
                return None;
            }
            if n_vertices == N {
                return Some(vec![std::array::from_fn(|i| i as u32)]);
            }
            let message = format!("shape \"{}\" has no indices", entity.kind);
            return self.refuse(entity.span, message, "add \"integer indices\" [ … ]");
        };
        if raw.len() % N != 0 {
            let message = format!("{} indices do not make faces of {N} corners", raw.len());
            return self.refuse(span, message, format!("expected a multiple of {N}"));
        }
        let out_of_range = |i: &i32| usize::try_from(*i).map_or(true, |i| i >= n_vertices);
        if let Some(at) = raw.iter().position(out_of_range) {
            let message = format!("index {} (number {}) is out of range", raw[at], at + 1);
            return self.refuse(
                span,
                message,
                format!("there are {n_vertices} vertices: 0 to {}", n_vertices - 1),
            );
        }
        Some(raw.chunks_exact(N).map(|c| std::array::from_fn(|i| c[i] as u32)).collect())
    }

    /// Per-vertex values are as many as vertices, or none.
    fn per_vertex(&mut self, entity: &Entity, name: &str, len: usize, n: usize) -> Option<()> {
        if len == 0 || len == n {
            return Some(());
        }
        let at = entity.params.span_of(name).unwrap_or(entity.span);
        self.refuse(at, format!("\"{name}\" has {len} items for {n} vertices"), format!("expected {n}"))
    }

    fn ply_mesh(&mut self, entity: &Entity, plys: &HashMap<PathBuf, Option<Ply>>) -> Option<Vec<Geometry>> {
        let p = &entity.params;
        let Some((name, _)) = p.string_opt("filename", self.report) else {
            let hint = "add \"string filename\" \"…\"";
            return self.refuse(entity.span, "shape \"plymesh\" has no \"filename\"", hint);
        };
        let ply = plys.get(&self.resolve(&name))?.as_ref()?;
        if p.find("displacement", &[Type::Texture]).is_some() {
            let quads = ply.patches.iter().map(|patches| Arc::new(triangles(patches)));
            return Some(ply.mesh.clone().into_iter().chain(quads).map(Geometry::Mesh).collect());
        }
        let mesh = ply.mesh.clone().map(Geometry::Mesh);
        let patches = ply.patches.clone().map(Geometry::BilinearMesh);
        Some(mesh.into_iter().chain(patches).collect())
    }

    /// How the mesh of a file is moved.
    fn displacement(&mut self, entity: &Entity) -> Option<DisplacementDesc> {
        let p = &entity.params;
        if entity.kind != "plymesh" {
            return None;
        }
        let names = ["displacement.edgelength", "edgelength"];
        let given = names.into_iter().find(|n| p.span_of(n).is_some());
        let edge_length = given.map_or(1.0, |name| p.float(name, 1.0, self.report));
        let height = self.float_input(p, "displacement")?;
        if edge_length > 0.0 {
            return Some(DisplacementDesc { height, edge_length });
        }
        let at = given.and_then(|name| p.span_of(name)).unwrap_or(entity.span);
        self.refuse(at, format!("edges of length {edge_length}"), "it must be above 0")
    }

    fn sphere(&mut self, p: &Params, span: Span) -> Option<Geometry> {
        let radius = self.radius(p, span)?;
        let (a, b) = (p.float("zmin", -radius, self.report), p.float("zmax", radius, self.report));
        let cut = |z: f32| z.clamp(-radius, radius);
        let phi_max = self.phi_max(p, span);
        Some(Geometry::Sphere { radius, z_min: cut(a.min(b)), z_max: cut(a.max(b)), phi_max })
    }

    fn disk(&mut self, p: &Params, span: Span) -> Option<Geometry> {
        let height = p.float("height", 0.0, self.report);
        let radius = self.radius(p, span)?;
        let inner_radius = p.float("innerradius", 0.0, self.report);
        if !(0.0..radius).contains(&inner_radius) {
            let at = p.span_of("innerradius").unwrap_or(span);
            let message = format!("\"innerradius\" is {inner_radius}");
            return self.refuse(at, message, format!("expected 0 to the radius, {radius}"));
        }
        Some(Geometry::Disk { height, radius, inner_radius, phi_max: self.phi_max(p, span) })
    }

    fn cylinder(&mut self, p: &Params, span: Span) -> Option<Geometry> {
        let radius = self.radius(p, span)?;
        let (a, b) = (p.float("zmin", -1.0, self.report), p.float("zmax", 1.0, self.report));
        if a == b {
            let at = p.span_of("zmax").or(p.span_of("zmin")).unwrap_or(span);
            return self.refuse(at, "a cylinder without height", "\"zmin\" and \"zmax\" must differ");
        }
        Some(Geometry::Cylinder { radius, z_min: a.min(b), z_max: a.max(b), phi_max: self.phi_max(p, span) })
    }

    fn radius(&mut self, p: &Params, span: Span) -> Option<f32> {
        let radius = p.float("radius", 1.0, self.report);
        if radius > 0.0 {
            return Some(radius);
        }
        let at = p.span_of("radius").unwrap_or(span);
        self.refuse(at, format!("\"radius\" is {radius}"), "it must be above 0")
    }

    fn phi_max(&mut self, p: &Params, span: Span) -> f32 {
        let phi = p.float("phimax", 360.0, self.report);
        if phi <= 0.0 {
            let at = p.span_of("phimax").unwrap_or(span);
            self.report.error(at, format!("\"phimax\" is {phi}")).hint("expected above 0, up to 360");
        }
        phi.min(360.0)
    }
}

/// Patches cut along a diagonal.
fn triangles(patches: &BilinearMesh) -> MeshDesc {
    let BilinearMesh { positions, normals, uvs, indices } = patches.clone();
    let indices = indices.into_iter().flat_map(|[a, b, c, d]| [[a, b, d], [a, d, c]]).collect();
    MeshDesc { positions, normals, uvs, indices, ..MeshDesc::default() }
}
