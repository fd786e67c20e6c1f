//! The compiled scene and the questions that integrators ask it.

use accel::{Accel, Hit, NO_INSTANCE, accept_all};
use math::{Bounds, Bounds2i, Dir, Point, Ray, error_bound, hash};
use spectrum::{Sensor, Spectrum, Wavelengths};

use crate::cameras::Camera;
use crate::light_select::LightSelector;
use crate::lights::{LightSample, Lights};
use crate::materials::{Gaps, Materials, Shading};
use crate::media::Media;
use crate::shapes::{Curvature, LocalSurface, Shape, ShapeGeometry};
use crate::surroundings::Bodies;
use crate::textures::Textures;
use crate::{
    Footprint, LightContext, LightId, MediumId, Place, ShapeId, SurfaceInteraction, Surroundings,
    TextureContext,
};

/// Shadow rays end this fraction short of their light, so that rounding cannot make it shadow itself.
pub(crate) const SHADOW_EPSILON: f32 = 1e-4;

/// Everything that a render reads: immutable.
pub struct Scene {
    pub(crate) accel: Accel,
    pub(crate) shapes: Vec<Shape>,
    /// Shapes of the world start at 0; those of object `k` at `object_base[k]`.
    pub(crate) object_base: Vec<u32>,
    pub(crate) instances: Vec<accel::Instance>,
    /// The first light of each instance.
    pub(crate) instance_lights: Vec<u32>,
    /// Must shadow rays look at what they hit (cut-outs, borders of media)?
    pub(crate) shadow_filter: bool,
    /// Must nearest hits be looked at (cut-outs)?
    pub(crate) hit_filter: bool,
    /// Images, and values that vary over surfaces.
    pub textures: Textures,
    /// Surfaces' looks.
    pub materials: Materials,
    /// What fills space.
    pub media: Media,
    /// What may overlap.
    pub(crate) bodies: Bodies,
    pub(crate) camera_surroundings: Surroundings,
    /// Media inside and outside of each light; empty without media.
    pub(crate) light_media: Vec<[Option<MediumId>; 2]>,
    /// Everything that emits.
    pub lights: Lights,
    /// Which light to ask.
    pub light_selector: LightSelector,
    /// The eye.
    pub camera: Camera,
    /// Spectral samples to the film's RGB.
    pub sensor: Sensor,
    pub(crate) settings: SceneSettings,
}

/// What the scene says about its picture.
#[derive(Clone, Debug)]
pub struct SceneSettings {
    /// Width and height of the whole film.
    pub resolution: [u32; 2],
    /// The pixels that are rendered.
    pub crop: Bounds2i,
    /// How samples become pixels.
    pub filter: scene_desc::FilterDesc,
    /// Where samples come from.
    pub sampler: scene_desc::SamplerDesc,
    /// The method that the file asks for.
    pub integrator: scene_desc::IntegratorDesc,
    /// What radiance is multiplied with.
    pub imaging_ratio: f32,
    /// Four wavelengths rather than R, G, B?
    pub spectral: bool,
    /// Where the file wants its picture.
    pub filename: Option<String>,
    /// A hash of all that was read.
    pub content_hash: u64,
    /// What is in it.
    pub counts: SceneCounts,
}

impl SceneSettings {
    /// The pixels that camera samples are needed in: the crop and a border, as wide as the filter reaches.
    #[must_use]
    pub fn sample_bounds(&self) -> Bounds2i {
        self.crop.expand(self.filter.reach() as i32)
    }
}

/// What is in a scene, and what it costs.
#[derive(Clone, Copy, Debug, Default)]
pub struct SceneCounts {
    /// Triangles, instances not multiplied.
    pub triangles: u64,
    /// Bilinear patches, quadrics and strand segments.
    pub other_primitives: u64,
    /// Shapes.
    pub shapes: u64,
    /// Instances.
    pub instances: u64,
    /// Bytes of the acceleration structure.
    pub accel_bytes: u64,
    /// Bytes of vertices, normals, indices.
    pub geometry_bytes: u64,
    /// Bytes of images.
    pub texture_bytes: u64,
}

impl Scene {
    /// What the scene says about its picture.
    #[must_use]
    pub fn settings(&self) -> &SceneSettings {
        &self.settings
    }

    /// A box around all surfaces.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        self.accel.bounds()
    }

    /// The same scene with the kernel for `isa`, if this processor runs it: for benchmarks and tests.
    #[must_use]
    pub fn with_isa(self, isa: accel::Isa) -> Self {
        Self { accel: self.accel.with_isa(isa), ..self }
    }

    /// The acceleration structure: for benchmarks and for those who want rays alone.
    #[must_use]
    pub fn accel(&self) -> &Accel {
        &self.accel
    }

    /// The shape of an interaction.
    #[must_use]
    pub fn shape(&self, id: ShapeId) -> &Shape {
        &self.shapes[id.index()]
    }

    /// Does any shape move (the camera does not count)?
    #[must_use]
    pub fn has_moving_shapes(&self) -> bool {
        self.instances.iter().any(|i| i.world_from_object.is_animated())
            || self.shapes.iter().any(|s| matches!(s.geometry, ShapeGeometry::MovingMesh(_)))
    }

    /// Are there strands that turn to every ray, so that light meets another surface than the eye?
    #[must_use]
    pub fn has_turning_strands(&self) -> bool {
        self.shapes.iter().any(|s| match &s.geometry {
            ShapeGeometry::Strand(strand) => strand.kind != scene_desc::CurveKind::Ribbon,
            ShapeGeometry::Mesh(_)
            | ShapeGeometry::MovingMesh(_)
            | ShapeGeometry::Patches(_)
            | ShapeGeometry::Quadric(_) => false,
        })
    }

    /// The nearest surface along a ray.
    #[must_use]
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        if !self.hit_filter {
            return self.accel.intersect(ray, &mut accept_all);
        }
        self.accel.intersect(ray, &mut |hit: &Hit| self.is_there(ray, hit))
    }

    /// Is anything opaque along the ray before its end? Borders of media do not count; surfaces of all bodies do.
    #[must_use]
    pub fn occluded(&self, ray: &Ray) -> bool {
        if !self.shadow_filter {
            return self.accel.occluded(ray, &mut accept_all);
        }
        self.accel.occluded(ray, &mut |hit: &Hit| self.blocks(ray, hit))
    }

    /// Does what a shadow ray meets keep light off?
    pub(crate) fn blocks(&self, ray: &Ray, hit: &Hit) -> bool {
        self.is_surface::<true>(ray, hit) && self.is_there(ray, hit)
    }

    /// The ray from a point to a light sample, just short of the light.
    #[must_use]
    pub fn shadow_ray(&self, from: &LightContext, to: &LightSample) -> Ray {
        let origin = match from.ng {
            Some(n) => error_bound::offset_ray_origin(from.p, from.p_error, n, to.wi),
            None => from.p,
        };
        if to.is_infinite {
            return Ray::new(origin, to.wi, from.time);
        }
        let target = error_bound::offset_ray_origin(to.p, to.p_error, to.n, -to.wi);
        segment(origin, target, from.time)
    }

    /// Can the light sample be seen from the point?
    #[must_use]
    pub fn unoccluded(&self, from: &LightContext, to: &LightSample) -> bool {
        !self.occluded(&self.shadow_ray(from, to))
    }

    /// The surface at a hit.
    #[inline]
    #[must_use]
    pub fn interaction(&self, ray: &Ray, hit: &Hit) -> SurfaceInteraction {
        let id = self.shape_of(hit);
        let shape = &self.shapes[id.index()];
        let surface = self.surface(ray, hit, shape);
        SurfaceInteraction {
            p: surface.p,
            p_error: surface.p_error,
            ng: surface.ng,
            frame: surface.frame(shape.detail),
            uv: surface.uv,
            dpdu: surface.dpdu,
            dpdv: surface.dpdv,
            dndu: surface.dndu,
            dndv: surface.dndv,
            wo: -ray.dir,
            time: ray.time,
            t: hit.t,
            shape: id,
            primitive: hit.primitive,
            at: [hit.u, hit.v],
            material: shape.material,
            light: shape.first_light.map(|l| self.light_of(hit, shape, l)),
        }
    }

    /// How the shading normal changes about a hit; `None` where [`Scene::is_steady`] is not true of it.
    #[must_use]
    pub fn curvature(&self, ray: &Ray, hit: &Hit) -> Option<Curvature> {
        let shape = &self.shapes[self.shape_of(hit).index()];
        if !self.materials.is_steady(shape.material) {
            return None;
        }
        let p = ray.at(hit.t);
        if hit.instance == NO_INSTANCE {
            return shape.geometry.curvature(hit, p, ray.time);
        }
        let world_from_object = self.instances[hit.instance as usize].world_from_object.at(ray.time);
        let local = shape.geometry.curvature(hit, world_from_object.inverse().point(p), ray.time)?;
        Some(local.transformed(&world_from_object))
    }

    /// Does the shading normal follow from the form alone (no bump or normal map, no strand), and its BSDF from the place without
    /// chance (no mixture)?
    #[must_use]
    pub fn is_steady(&self, si: &SurfaceInteraction) -> bool {
        let is_strand = matches!(self.shape(si.shape).geometry, ShapeGeometry::Strand(_));
        !is_strand && self.materials.is_steady(si.material)
    }

    /// Does chance decide whether a ray meets a surface: cut-outs, panes of glass, mixtures with borders of media?
    #[must_use]
    pub fn has_surfaces_by_chance(&self) -> bool {
        self.hit_filter || self.shapes.iter().any(|s| s.gaps == Gaps::Somewhere)
    }

    /// The BSDF of a surface in its (bumped) frame, to which a ray came through `around`; `None` for a border of media
    /// and where a body is displaced, which rays pass.
    #[must_use]
    pub fn shade(
        &self,
        si: &SurfaceInteraction,
        around: &Surroundings,
        wl: &mut Wavelengths,
    ) -> Option<Shading> {
        let footprint = match self.materials.is_uniform(si.material) {
            true => Footprint::default(),
            false => self.footprint(si),
        };
        if !self.bodies.is_empty() {
            if self.is_displaced(si, around) {
                return None;
            }
            if let Some(outside) = self.index_outside(si, around, wl) {
                return self.materials.shade_against(&self.textures, si, &footprint, (outside, wl));
            }
        }
        self.materials.shade(&self.textures, si, &footprint, wl)
    }

    /// How large a pixel is on the surface, as if the camera saw it directly [PBR4e, sec. 10.1.3].
    #[must_use]
    pub fn footprint(&self, si: &SurfaceInteraction) -> Footprint {
        self.camera.approximate_footprint(si.p, si.frame.n, si.time).with_uv(si.dpdu, si.dpdv)
    }

    /// Linear RGB on the film of one path's radiance.
    #[must_use]
    pub fn film_rgb(&self, radiance: Spectrum, wl: &Wavelengths) -> [f32; 3] {
        self.sensor.rgb(radiance, wl)
    }

    /// Is the surface, to which a ray came through `around`, nothing but a border of media, or not there at all, so that
    /// rays pass?
    #[must_use]
    pub fn is_interface(&self, si: &SurfaceInteraction, around: &Surroundings) -> bool {
        self.materials.is_interface(&self.textures, si)
            || !self.bodies.is_empty() && self.is_displaced(si, around)
    }

    /// Radiance that a surface emits along `w`.
    #[must_use]
    pub fn emitted(&self, si: &SurfaceInteraction, w: Dir, wl: &Wavelengths) -> Option<Spectrum> {
        si.light.map(|light| self.lights.emitted(light, si.ng, si.uv, w, wl))
    }

    #[inline]
    fn surface(&self, ray: &Ray, hit: &Hit, shape: &Shape) -> LocalSurface {
        let p = ray.at(hit.t);
        if hit.instance == NO_INSTANCE {
            return shape.geometry.at(hit, ray, p, shape.detail);
        }
        let world_from_object = self.instances[hit.instance as usize].world_from_object.at(ray.time);
        let object_from_world = world_from_object.inverse();
        let local_ray = Ray { dir: object_from_world.dir(ray.dir), ..*ray };
        let p = object_from_world.point(p);
        shape.geometry.at(hit, &local_ray, p, shape.detail).transformed(&world_from_object)
    }

    /// The light of a hit on a shape that emits, whose first light is `first` of the world's or of its instance's.
    fn light_of(&self, hit: &Hit, shape: &Shape, first: LightId) -> LightId {
        let base = match hit.instance {
            NO_INSTANCE => 0,
            i => self.instance_lights[i as usize],
        };
        LightId(base + first.0 + hit.primitive / shape.primitives_per_light)
    }

    /// Every shape that emits, with its first light, once for each place where it stands.
    pub(crate) fn emitting_shapes(&self) -> impl Iterator<Item = (&Shape, LightId)> {
        let base_of = |object: usize| self.object_base.get(object).map_or(self.shapes.len(), |b| *b as usize);
        let in_world = (&self.shapes[..base_of(0)], 0);
        let placed = self.instances.iter().zip(&self.instance_lights).map(move |(instance, first)| {
            let object = instance.object as usize;
            (&self.shapes[base_of(object)..base_of(object + 1)], *first)
        });
        std::iter::once(in_world).chain(placed).flat_map(|(shapes, first)| {
            shapes.iter().filter_map(move |s| s.first_light.map(|l| (s, LightId(first + l.0))))
        })
    }

    #[inline]
    pub(crate) fn shape_of(&self, hit: &Hit) -> ShapeId {
        let base = match hit.instance {
            NO_INSTANCE => 0,
            i => self.object_base[self.instances[i as usize].object as usize],
        };
        ShapeId(base + hit.geometry)
    }

    /// Cut-outs: a hit counts with the probability that its alpha says, decided by a hash of where and from where.
    pub(crate) fn is_there(&self, ray: &Ray, hit: &Hit) -> bool {
        let shape = &self.shapes[self.shape_of(hit).index()];
        let Some(alpha) = &shape.alpha else { return true };
        let uv = shape.geometry.uv(hit);
        let place = Place { shape: self.shape_of(hit).0, primitive: hit.primitive, at: [hit.u, hit.v] };
        let (p, n, footprint) = (ray.at(hit.t), -ray.dir, Footprint::default());
        let alpha = self.textures.alpha(alpha, &TextureContext { p, n, uv, footprint, place });
        if alpha >= 1.0 || alpha <= 0.0 {
            return alpha >= 1.0;
        }
        let (o, d) = (ray.origin.0, ray.dir.0);
        let key = hash::of_floats(&[o.x, o.y, o.z, d.x, d.y, d.z, uv.x, uv.y]);
        let key = hash::combine(key, u64::from(hit.primitive) << 32 | u64::from(hit.geometry));
        hash::unit_f32((key >> 32) as u32) < alpha
    }
}

/// The ray from one point to another, ending just short of it.
#[must_use]
pub fn segment(from: Point, to: Point, time: f32) -> Ray {
    let d = to - from;
    let length = d.length();
    let dir = if length > 0.0 { Dir(d / length) } else { Dir::Z };
    Ray { origin: from, dir, t_max: length * (1.0 - SHADOW_EPSILON), time }
}
