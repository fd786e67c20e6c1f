//! Shapes, objects and instances: baked, counted, and put into trees.

use accel::{Accel, Blas, BuildOptions, Instance};
use math::{AnimatedTransform, Transform, Vec3};
use rayon::prelude::*;
use scene_desc::{Geometry, InstanceDesc, MeshDesc, SceneDesc, ShapeDesc, Sink, Span};

use super::CompileOptions;
use super::kept::{KeptWorld, needs_filter};
use super::taken::Taken;
use crate::MaterialId;
use crate::materials::{Gaps, Materials};
use crate::media::MediumIds;
use crate::scene::SceneCounts;
use crate::shapes::{
    Mesh, MovingMesh, PatchMesh, Quadric, QuadricKind, Shape, ShapeGeometry, Strand, subdivide, tube,
};
use crate::surroundings::{Bodies, Body};
use crate::textures::{FloatHandle, TextureCompiler};

/// Nesting of objects within objects beyond this is taken for an endless circle.
const MAX_NESTING: u32 = 32;
/// Most instances after nested ones are multiplied out.
const MAX_INSTANCES: usize = 1 << 26;

/// Everything that rays can meet.
pub(crate) struct World<'a> {
    pub(crate) accel: Accel,
    pub(crate) shapes: Vec<Shape>,
    /// What each was made from, and in which space it is stored.
    pub(crate) descs: Vec<(&'a ShapeDesc, Place)>,
    /// Shapes of the world come first; those of object `k` from `object_base[k]` on.
    pub(crate) object_base: Vec<u32>,
    pub(crate) instances: Vec<Instance>,
    /// What may overlap.
    pub(crate) bodies: Bodies,
    pub(crate) counts: SceneCounts,
}

/// Bakes, builds and counts, or takes over what is `kept`. `None` only together with an error in `sink`.
pub(super) fn build<'a>(
    desc: &'a SceneDesc,
    materials: &Materials,
    textures: &mut TextureCompiler<'_>,
    (options, media): (&CompileOptions, &MediumIds),
    (kept, taken): (Option<KeptWorld>, Taken),
) -> Option<World<'a>> {
    let (forms, trees) = kept.map(KeptWorld::into_parts).unzip();
    let forms = forms.map(Vec::into_iter);
    let (shapes, descs) = (Vec::new(), Vec::new());
    let mut builder = Builder { desc, materials, textures, media, shapes, descs, forms, taken };

    // The world's own shapes; those that move become objects of their own.
    let animated = |i: &usize| desc.shapes[*i].world_from_object.is_animated();
    let (moving, still): (Vec<usize>, Vec<usize>) = (0..desc.shapes.len()).partition(animated);
    builder.add_shapes(still.iter().map(|&i| (i, &desc.shapes[i])).collect(), Place::World);
    let world_len = builder.shapes.len();
    let mut object_base = Vec::new();
    let mut numbers = desc.shapes.len()..;
    for object in &desc.objects {
        object_base.push(builder.shapes.len() as u32);
        let shapes = object.shapes.iter().map(|s| (numbers.next().unwrap_or_default(), s));
        builder.add_shapes(shapes.collect(), Place::Object);
    }
    let mut instances = builder.flatten_instances();
    for (i, shape) in moving.into_iter().map(|i| (i, &desc.shapes[i])) {
        let object = object_base.len() as u32;
        object_base.push(builder.shapes.len() as u32);
        builder.add_shapes(vec![(i, shape)], Place::Moving);
        instances.push(Instance { object, world_from_object: shape.world_from_object });
    }

    let (mut shapes, descs) = (builder.shapes, builder.descs);
    let bodies = bodies(&mut shapes, materials, textures.sink());
    let trees = trees.and_then(|(accel, filters)| KeptWorld::trees(accel, &filters, &shapes, options.isa));
    let accel = match trees {
        Some(accel) => accel,
        None => build_trees(&shapes, world_len, &object_base, &instances, textures.sink())?,
    };
    let accel = match options.isa {
        Some(isa) => accel.with_isa(isa),
        None => accel,
    };
    let counts = count(&shapes, instances.len(), &accel);
    Some(World { accel, shapes, descs, object_base, instances, bodies, counts })
}

impl World<'_> {
    /// The shapes of an object.
    pub(crate) fn shapes_of(&self, object: u32) -> std::ops::Range<usize> {
        let end = self.object_base.get(object as usize + 1).map_or(self.shapes.len(), |b| *b as usize);
        self.object_base[object as usize] as usize..end
    }
}

/// In which space a shape is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    /// World space.
    World,
    /// Space of an object: the shape's own transform leads there.
    Object,
    /// Object space of a shape that moves: its transform is the instance's.
    Moving,
}

struct Builder<'d, 'a, 'b> {
    desc: &'d SceneDesc,
    materials: &'a Materials,
    textures: &'a mut TextureCompiler<'b>,
    media: &'a MediumIds,
    shapes: Vec<Shape>,
    descs: Vec<(&'d ShapeDesc, Place)>,
    /// Of an earlier compile, in the same order.
    forms: Option<std::vec::IntoIter<ShapeGeometry>>,
    /// Meshes that the description gave away.
    taken: Taken,
}

impl<'d> Builder<'d, '_, '_> {
    /// Adds shapes with their numbers among all of the description.
    fn add_shapes(&mut self, shapes: Vec<(usize, &'d ShapeDesc)>, place: Place) {
        let (numbers, shapes): (Vec<usize>, Vec<&ShapeDesc>) = shapes.into_iter().unzip();
        let taken: Vec<Option<MeshDesc>> = numbers.into_iter().map(|i| self.taken.mesh(i)).collect();
        let baked: Vec<ShapeGeometry> = match &mut self.forms {
            Some(forms) => forms.take(shapes.len()).collect(),
            None => shapes.par_iter().zip(taken).map(|(s, mesh)| bake(s, mesh, place)).collect(),
        };
        self.descs.extend(shapes.iter().map(|s| (*s, place)));
        for (desc, geometry) in shapes.into_iter().zip(baked) {
            let material = &self.desc.materials[desc.material.index()];
            let inputs = [&desc.alpha, &material.opacity];
            let factors = inputs.map(|a| a.as_ref().map(|a| self.textures.float(a, desc.span)));
            let alpha = match factors {
                [Some(a), Some(b)] => Some(self.textures.product(a, b)),
                [a, b] => a.or(b),
            };
            if let Geometry::Mesh(mesh) = &desc.geometry {
                self.textures.attach(self.shapes.len() as u32, mesh);
            }
            self.shapes.push(Shape {
                geometry,
                material: MaterialId(desc.material.0),
                alpha: alpha.filter(|a| !matches!(a, FloatHandle::Constant(x) if *x >= 1.0)),
                first_light: None,
                primitives_per_light: 1,
                medium_interface: self.media.sides(desc.medium_interface, desc.material),
                body: None,
                gaps: self.materials.gaps(MaterialId(desc.material.0)),
                detail: self.materials.detail(MaterialId(desc.material.0)),
            });
        }
    }

    /// Instances of the world, with objects that hold instances multiplied out.
    fn flatten_instances(&mut self) -> Vec<Instance> {
        let mut flat = Vec::new();
        for instance in &self.desc.instances {
            self.flatten(instance, None, 0, &mut flat);
        }
        flat
    }

    fn flatten(
        &mut self,
        instance: &InstanceDesc,
        outer: Option<&AnimatedTransform>,
        depth: u32,
        flat: &mut Vec<Instance>,
    ) {
        if depth > MAX_NESTING || flat.len() >= MAX_INSTANCES {
            self.textures
                .sink()
                .error(instance.span, "objects are nested without end, or there are too many instances");
            return;
        }
        let placed = match outer {
            None => instance.world_from_object,
            Some(outer) => *outer * instance.world_from_object,
        };
        let Some(object) = self.desc.objects.get(instance.object.index()) else { return };
        if !object.shapes.is_empty() {
            flat.push(Instance { object: instance.object.0, world_from_object: placed });
        }
        for inner in &object.instances {
            self.flatten(inner, Some(&placed), depth + 1, flat);
        }
    }
}

/// A shape where it is traced; `taken` is its mesh, if the description does not have it any more.
fn bake(desc: &ShapeDesc, taken: Option<MeshDesc>, place: Place) -> ShapeGeometry {
    let own = desc.world_from_object.start();
    let t = if place == Place::Moving { Transform::IDENTITY } else { own };
    // Normals map by the transform, so that a mirrored shape keeps its outside out: a mesh undoes the turn of its
    // winding where positions are mapped, a quadric's normal never turns.
    let reverse = desc.reverse_orientation;
    if let Some(mesh) = taken {
        return ShapeGeometry::Mesh(Mesh::from_owned(mesh, &t, reverse));
    }
    let quadric = |kind| ShapeGeometry::Quadric(Quadric { kind, world_from_object: t, flip: reverse });
    match &desc.geometry {
        Geometry::Mesh(m) if m.is_moving() => {
            ShapeGeometry::MovingMesh(Box::new(MovingMesh::new(m, &t, reverse)))
        }
        Geometry::Mesh(m) => ShapeGeometry::Mesh(Mesh::new(m, &t, reverse)),
        Geometry::LoopSubdiv(l) => ShapeGeometry::Mesh(Mesh::new(&subdivide(l), &t, reverse)),
        Geometry::BilinearMesh(m) => ShapeGeometry::Patches(PatchMesh::new(m, &t, reverse)),
        // What emits must have a surface to be drawn from.
        Geometry::Curve(c) if desc.area_light.is_some() => ShapeGeometry::Mesh(tube(&Strand::new(c, &t))),
        Geometry::Curve(c) => ShapeGeometry::Strand(Strand::new(c, &t)),
        Geometry::Sphere { radius, z_min, z_max, phi_max } => quadric(QuadricKind::Sphere {
            radius: *radius,
            z_min: z_min.min(*z_max).clamp(-radius, *radius),
            z_max: z_max.max(*z_min).clamp(-radius, *radius),
            phi_max: phi_max.clamp(0.0, 360.0).to_radians(),
        }),
        Geometry::Disk { height, radius, inner_radius, phi_max } => quadric(QuadricKind::Disk {
            height: *height,
            radius: *radius,
            inner_radius: *inner_radius,
            phi_max: phi_max.clamp(0.0, 360.0).to_radians(),
        }),
        Geometry::Cylinder { radius, z_min, z_max, phi_max } => quadric(QuadricKind::Cylinder {
            radius: *radius,
            z_min: z_min.min(*z_max),
            z_max: z_max.max(*z_min),
            phi_max: phi_max.clamp(0.0, 360.0).to_radians(),
        }),
    }
}

/// Gives shapes of materials with a priority their bodies.
fn bodies(shapes: &mut [Shape], materials: &Materials, sink: &mut Sink) -> Bodies {
    let body = |s: &Shape| {
        let priority = materials.priority(s.material).filter(|_| s.alpha.is_none())?;
        let medium = s.medium_interface.and_then(|[inside, _]| inside);
        Some(Body { priority, material: s.material, medium })
    };
    let bodies = Bodies::new(shapes.iter().filter_map(body).collect());
    let mut without = 0;
    for shape in shapes {
        let Some(body) = body(shape) else { continue };
        shape.body = bodies.id(&body);
        without += usize::from(shape.body.is_none());
        if shape.gaps == Gaps::Nowhere {
            shape.gaps = Gaps::WhereDisplaced;
        }
    }
    if without > 0 {
        sink.error(Span::NONE, format!("{without} shapes have priorities that are one too many")).hint(
            "give fewer materials a priority: there may be 65535 pairs of such a material and a medium",
        );
    }
    bodies
}

fn build_trees(
    shapes: &[Shape],
    world_len: usize,
    object_base: &[u32],
    instances: &[Instance],
    sink: &mut Sink,
) -> Option<Accel> {
    let ends = object_base.iter().skip(1).map(|b| *b as usize).chain([shapes.len()]);
    let objects: Vec<&[Shape]> = object_base.iter().zip(ends).map(|(b, e)| &shapes[*b as usize..e]).collect();
    let built = blas(&shapes[..world_len])
        .and_then(|world| Ok((world, objects.par_iter().map(|o| blas(o)).collect::<Result<Vec<_>, _>>()?)))
        .and_then(|(world, objects)| Accel::new(world, objects, instances));
    match built {
        Ok(accel) => Some(accel),
        Err(e) => {
            sink.error(scene_desc::Span::NONE, e.to_string());
            None
        }
    }
}

fn blas(shapes: &[Shape]) -> Result<Blas, accel::BuildError> {
    let prepared: Vec<Prepared<'_>> = shapes.iter().map(Prepared::new).collect();
    let geometries: Vec<accel::Geometry<'_>> = shapes
        .iter()
        .zip(&prepared)
        .map(|(s, p)| accel::Geometry { shape: p.shape(), needs_filter: needs_filter(s) })
        .collect();
    Blas::build(&geometries, &BuildOptions::default())
}

/// A shape in the ray kernel's words.
enum Prepared<'a> {
    Mesh(&'a Mesh),
    MovingMesh(&'a MovingMesh),
    Patches(&'a PatchMesh),
    Sphere(accel::Sphere),
    Disk(accel::Disk),
    Cylinder(accel::Cylinder),
    Curves(Vec<accel::Curve>),
}

impl<'a> Prepared<'a> {
    fn new(shape: &'a Shape) -> Self {
        match &shape.geometry {
            ShapeGeometry::Mesh(m) => Self::Mesh(m),
            ShapeGeometry::MovingMesh(m) => Self::MovingMesh(m),
            ShapeGeometry::Patches(m) => Self::Patches(m),
            ShapeGeometry::Strand(s) => Self::Curves(curves(s)),
            ShapeGeometry::Quadric(q) => {
                let object_from_local = q.world_from_object;
                match q.kind {
                    QuadricKind::Sphere { radius, z_min, z_max, phi_max } => {
                        Self::Sphere(accel::Sphere { radius, z_min, z_max, phi_max, object_from_local })
                    }
                    QuadricKind::Disk { height, radius, inner_radius, phi_max } => {
                        Self::Disk(accel::Disk { height, radius, inner_radius, phi_max, object_from_local })
                    }
                    QuadricKind::Cylinder { radius, z_min, z_max, phi_max } => {
                        Self::Cylinder(accel::Cylinder { radius, z_min, z_max, phi_max, object_from_local })
                    }
                }
            }
        }
    }

    fn shape(&self) -> accel::Shape<'_> {
        match self {
            Self::Mesh(m) => accel::Shape::Mesh { positions: &m.positions, indices: &m.indices },
            Self::MovingMesh(m) => accel::Shape::MovingMesh {
                positions: [&m.start.positions, &m.end_positions],
                times: m.times,
                indices: &m.start.indices,
            },
            Self::Patches(m) => accel::Shape::PatchMesh { positions: &m.positions, indices: &m.indices },
            Self::Sphere(s) => accel::Shape::Sphere(s),
            Self::Disk(d) => accel::Shape::Disk(d),
            Self::Cylinder(c) => accel::Shape::Cylinder(c),
            Self::Curves(c) => accel::Shape::Curves(c),
        }
    }
}

fn curves(strand: &Strand) -> Vec<accel::Curve> {
    let n = strand.segments.len() as f32;
    let normal = |i: usize| strand.normals.get(i).copied().unwrap_or(Vec3::Z);
    let segment = |(i, points): (usize, &[Vec3; 4])| accel::Curve {
        points: *points,
        widths: [strand.width_at(i as f32 / n), strand.width_at((i + 1) as f32 / n)],
        kind: match strand.kind {
            scene_desc::CurveKind::Flat => accel::CurveKind::Flat,
            scene_desc::CurveKind::Cylinder => accel::CurveKind::Cylinder,
            scene_desc::CurveKind::Ribbon => accel::CurveKind::Ribbon([normal(i), normal(i + 1)]),
        },
    };
    strand.segments.iter().enumerate().map(segment).collect()
}

fn count(shapes: &[Shape], instances: usize, accel: &Accel) -> SceneCounts {
    let mut counts = SceneCounts {
        shapes: shapes.len() as u64,
        instances: instances as u64,
        accel_bytes: accel.memory() as u64,
        ..SceneCounts::default()
    };
    for shape in shapes {
        let n = shape.geometry.primitives() as u64;
        match &shape.geometry {
            ShapeGeometry::Mesh(_) | ShapeGeometry::MovingMesh(_) => counts.triangles += n,
            ShapeGeometry::Patches(_) | ShapeGeometry::Quadric(_) | ShapeGeometry::Strand(_) => {
                counts.other_primitives += n;
            }
        }
        counts.geometry_bytes += shape.geometry.memory() as u64;
    }
    counts
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::materials::Detail;
    use math::{AnimatedTransform, DMat4, DVec3, Dir, Transform, Vec3};

    fn normal_of_bake(desc: &ShapeDesc, place: Place) -> Dir {
        match bake(desc, None, place) {
            ShapeGeometry::Mesh(m) => m.at(0, [0.2; 2], Detail::Frame).ng,
            ShapeGeometry::Quadric(q) => {
                let p = q.world_from_object.point(math::Point(Vec3::new(0.6, 0.0, 0.8)));
                q.at(0.0, 0.5, p).ng
            }
            ShapeGeometry::MovingMesh(_) | ShapeGeometry::Patches(_) | ShapeGeometry::Strand(_) => {
                unreachable!("not tested here")
            }
        }
    }

    /// The outside of a mirrored shape stays outside, at rest and where it moves: as its light has it.
    #[test]
    fn mirrored_shapes_keep_their_outside() {
        let matrix = DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0)) * DMat4::from_rotation_y(0.3);
        let mirror = Transform::from_matrix(matrix).unwrap();
        let triangle = MeshDesc {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            indices: vec![[0, 1, 2]],
            ..MeshDesc::default()
        };
        let disk = Geometry::Disk { height: 0.0, radius: 1.0, inner_radius: 0.0, phi_max: 360.0 };
        let sphere = Geometry::Sphere { radius: 1.0, z_min: -1.0, z_max: 1.0, phi_max: 360.0 };
        let sphere_normal = Vec3::new(0.6, 0.0, 0.8);
        for (geometry, outside) in
            [(Geometry::Mesh(Arc::new(triangle)), Vec3::Z), (disk, Vec3::Z), (sphere, sphere_normal)]
        {
            for reverse_orientation in [false, true] {
                let desc = ShapeDesc {
                    geometry: geometry.clone(),
                    world_from_object: AnimatedTransform::fixed(mirror),
                    reverse_orientation,
                    material: scene_desc::MaterialId(0),
                    alpha: None,
                    displacement: None,
                    area_light: None,
                    medium_interface: None,
                    span: Span::NONE,
                };
                let sign = if reverse_orientation { -1.0 } else { 1.0 };
                let expected = mirror.normal(Dir(outside * sign));
                let at_rest = normal_of_bake(&desc, Place::World);
                let moving = mirror.normal(normal_of_bake(&desc, Place::Moving));
                assert!((at_rest.0 - expected.0).length() < 1e-5, "{geometry:?}: {at_rest:?} {expected:?}");
                assert!((moving.0 - expected.0).length() < 1e-5, "{geometry:?} moving: {moving:?}");
            }
        }
    }
}
