//! Shapes, objects and instances.

use std::sync::Arc;

use scene_desc::{
    AreaLightDesc, BilinearMesh, CurveDesc, CurveKind, FloatInput, Geometry, InstanceDesc, LoopSubdiv,
    MeshDesc, ShapeDesc,
};

use super::params::Params;
use super::{WriteError, Writer, ply};

impl Writer<'_, '_, '_> {
    pub(super) fn shapes(&mut self) -> Result<(), WriteError> {
        self.scene.shapes.iter().try_for_each(|s| self.shape(0, s))
    }

    pub(super) fn objects(&mut self) -> Result<(), WriteError> {
        for (i, object) in self.scene.objects.iter().enumerate() {
            self.line(0, &format!("ObjectBegin \"object-{i}\""));
            object.shapes.iter().filter(|s| s.area_light.is_none()).try_for_each(|s| self.shape(1, s))?;
            if !object.instances.is_empty() {
                let span = object.instances[0].span;
                self.otherwise(span, "instance within an object", "it is left out");
            }
            self.line(0, "ObjectEnd");
        }
        Ok(())
    }

    /// Instances; what emits of an object, which pbrt-v4 leaves dark, is written once for each as a shape of the world.
    pub(super) fn instances(&mut self) -> Result<(), WriteError> {
        for InstanceDesc { object, world_from_object, span } in &self.scene.instances {
            self.line(0, "AttributeBegin");
            self.transform(1, world_from_object, *span);
            self.line(1, &format!("ObjectInstance \"object-{}\"", object.0));
            self.line(0, "AttributeEnd");
            let object = &self.scene.objects[object.index()];
            for shape in object.shapes.iter().filter(|s| s.area_light.is_some()) {
                let placed = *world_from_object * shape.world_from_object;
                self.otherwise(
                    shape.span,
                    "light in an object",
                    "it is written for every instance, outside of the object",
                );
                self.shape(0, &ShapeDesc { world_from_object: placed, ..shape.clone() })?;
            }
        }
        Ok(())
    }

    fn shape(&mut self, depth: usize, shape: &ShapeDesc) -> Result<(), WriteError> {
        self.line(depth, "AttributeBegin");
        self.transform(depth + 1, &shape.world_from_object, shape.span);
        if shape.reverse_orientation {
            self.line(depth + 1, "ReverseOrientation");
        }
        self.line(depth + 1, &format!("NamedMaterial \"material-{}\"", shape.material.0));
        if let Some(media) = shape.medium_interface {
            let name = |id: Option<scene_desc::MediumId>| {
                id.map(|id| format!("medium-{}", id.0)).unwrap_or_default()
            };
            let (inside, outside) = (name(media.inside), name(media.outside));
            self.line(depth + 1, &format!("MediumInterface \"{inside}\" \"{outside}\""));
        }
        if let Some(light) = &shape.area_light {
            if shape.world_from_object.is_animated() {
                self.otherwise(
                    shape.span,
                    "light that moves",
                    "it is written so: pbrt-v4 will leave it dark",
                );
            }
            if matches!(shape.geometry, Geometry::Curve(_)) {
                self.otherwise(shape.span, "curve that emits", "it is written so: pbrt-v4 will stop there");
            }
            self.area_light(depth + 1, light)?;
        }
        let mut p = Params::default();
        if let Some(alpha) = self.alpha(shape) {
            Self::float_input(&mut p, "alpha", &alpha);
        }
        if let Geometry::Mesh(mesh) = &shape.geometry
            && mesh.is_moving()
        {
            let instead = match shape.displacement {
                None => "they are written as \"P1\" and \"N1\", which pbrt-v4 does not know",
                Some(_) => "a displaced mesh is written as it begins",
            };
            self.otherwise(shape.span, "vertices that move", instead);
            self.check_times(mesh.key_times, shape.span);
        }
        let kind = match (&shape.geometry, &shape.displacement) {
            (Geometry::Mesh(mesh), Some(displacement)) => {
                Self::float_input(&mut p, "displacement", &displacement.height);
                p.float("displacement.edgelength", displacement.edge_length);
                self.ply_mesh(&mut p, mesh)?
            }
            (geometry, _) => self.geometry(&mut p, geometry)?,
        };
        self.line(depth + 1, &format!("Shape \"{kind}\"{}", p.0));
        self.line(depth, "AttributeEnd");
        Ok(())
    }

    /// Cut-outs of the shape and of its material: pbrt has them with the shape.
    fn alpha(&mut self, shape: &ShapeDesc) -> Option<FloatInput> {
        let opacity = self.scene.materials[shape.material.index()].opacity.clone();
        match (shape.alpha.clone(), opacity) {
            (alpha, None) => alpha,
            (None, opacity) => opacity,
            (Some(FloatInput::Constant(a)), Some(FloatInput::Constant(b))) => Some((a * b).into()),
            (Some(alpha), Some(_)) => {
                self.otherwise(
                    shape.span,
                    "cut-outs of shape and material at once",
                    "the shape's is written",
                );
                Some(alpha)
            }
        }
    }

    fn area_light(&mut self, depth: usize, light: &AreaLightDesc) -> Result<(), WriteError> {
        let mut p = Params::default();
        match light.image {
            Some(id) => {
                let name = self.image(id)?;
                p.string("filename", &name);
                p.float_unless("scale", light.radiance.scale, 1.0);
            }
            None => self.illuminant(&mut p, "L", &light.radiance, light.span),
        }
        if light.two_sided {
            p.boolean("twosided", true);
        }
        if let Some(power) = light.power {
            p.float("power", power);
        }
        self.line(depth, &format!("AreaLightSource \"diffuse\"{}", p.0));
        Ok(())
    }

    fn geometry(&mut self, p: &mut Params, geometry: &Geometry) -> Result<&'static str, WriteError> {
        Ok(match geometry {
            Geometry::Mesh(mesh) => return self.mesh(p, mesh),
            Geometry::BilinearMesh(mesh) => {
                bilinear(p, mesh);
                "bilinearmesh"
            }
            Geometry::LoopSubdiv(mesh) => {
                let LoopSubdiv { positions, indices, levels } = &**mesh;
                p.integer("levels", *levels);
                p.vec3s("point3", "P", positions);
                p.indices(indices.iter().flatten().copied());
                "loopsubdiv"
            }
            Geometry::Curve(curve) => {
                self.curve(p, curve);
                "curve"
            }
            Geometry::Sphere { radius, z_min, z_max, phi_max } => {
                p.float("radius", *radius);
                p.float_unless("zmin", *z_min, -radius);
                p.float_unless("zmax", *z_max, *radius);
                p.float_unless("phimax", *phi_max, 360.0);
                "sphere"
            }
            Geometry::Disk { height, radius, inner_radius, phi_max } => {
                p.float("height", *height);
                p.float("radius", *radius);
                p.float_unless("innerradius", *inner_radius, 0.0);
                p.float_unless("phimax", *phi_max, 360.0);
                "disk"
            }
            Geometry::Cylinder { radius, z_min, z_max, phi_max } => {
                p.float("radius", *radius);
                p.float("zmin", *z_min);
                p.float("zmax", *z_max);
                p.float_unless("phimax", *phi_max, 360.0);
                "cylinder"
            }
        })
    }

    /// Small meshes stand in the text, as do those with tangents or moving vertices, which PLY files have no place for.
    fn mesh(&mut self, p: &mut Params, mesh: &Arc<MeshDesc>) -> Result<&'static str, WriteError> {
        const SMALL: usize = 12;
        if mesh.indices.len() <= SMALL || !mesh.tangents.is_empty() || mesh.is_moving() {
            p.vec3s("point3", "P", &mesh.positions);
            p.indices(mesh.indices.iter().flatten().copied());
            if !mesh.normals.is_empty() {
                p.vec3s("normal", "N", &mesh.normals);
            }
            if !mesh.tangents.is_empty() {
                p.vec3s("vector3", "S", &mesh.tangents);
            }
            if !mesh.uvs.is_empty() {
                p.vec2s("point2", "uv", &mesh.uvs);
            }
            if mesh.is_moving() {
                p.vec3s("point3", "P1", &mesh.end_positions);
                if !mesh.end_normals.is_empty() {
                    p.vec3s("normal", "N1", &mesh.end_normals);
                }
            }
            return Ok("trianglemesh");
        }
        self.ply_mesh(p, mesh)
    }

    fn ply_mesh(&mut self, p: &mut Params, mesh: &Arc<MeshDesc>) -> Result<&'static str, WriteError> {
        let key = Arc::as_ptr(mesh) as usize;
        let name = match self.meshes.get(&key) {
            Some(name) => name.clone(),
            None => {
                let name = self.file(&format!("mesh-{}.ply", self.n_meshes), &ply::bytes(mesh))?;
                self.n_meshes += 1;
                self.meshes.insert(key, name.clone());
                name
            }
        };
        p.string("filename", &name);
        Ok("plymesh")
    }

    fn curve(&mut self, p: &mut Params, curve: &CurveDesc) {
        let CurveDesc { segments, kind, width, normals } = curve;
        p.string(
            "type",
            match kind {
                CurveKind::Flat => "flat",
                CurveKind::Cylinder => "cylinder",
                CurveKind::Ribbon => "ribbon",
            },
        );
        // Segments share their ends.
        let first = segments.first().map(|s| s[0]);
        let points: Vec<_> =
            first.into_iter().chain(segments.iter().flat_map(|s| [s[1], s[2], s[3]])).collect();
        p.vec3s("point3", "P", &points);
        p.float("width0", width[0]);
        p.float("width1", width[1]);
        if !normals.is_empty() {
            p.vec3s("normal", "N", normals);
        }
    }
}

fn bilinear(p: &mut Params, mesh: &BilinearMesh) {
    p.vec3s("point3", "P", &mesh.positions);
    p.indices(mesh.indices.iter().flatten().copied());
    if !mesh.normals.is_empty() {
        p.vec3s("normal", "N", &mesh.normals);
    }
    if !mesh.uvs.is_empty() {
        p.vec2s("point2", "uv", &mesh.uvs);
    }
}
