//! From entities to a scene: options first, then what others refer to, then shapes and lights.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use math::AnimatedTransform;
use scene_desc::{
    ImageId, InstanceDesc, MaterialId, MaterialKind, MediumId, MediumInterface, ObjectDesc, ObjectId,
    SceneDesc, Span, TextureId,
};

use super::state::{Entities, InstanceEntity, Name, ObjectEntity, ShapeEntity, TransformSet};
use crate::report::Report;
use crate::resources::EncodingKey;
use crate::{source, suggest};

/// Wavelengths and values.
pub(super) type Pairs = Arc<[(f32, f32)]>;

/// What building needs at hand.
pub(super) struct Build<'r, 's> {
    pub(super) report: &'r mut Report<'s>,
    /// Paths are relative to the main file's folder.
    pub(super) base: PathBuf,
    pub(super) scene: SceneDesc,
    pub(super) float_textures: HashMap<String, TextureId>,
    pub(super) spectrum_textures: HashMap<String, TextureId>,
    pub(super) named_materials: HashMap<String, MaterialId>,
    pub(super) media: HashMap<String, MediumId>,
    pub(super) images: HashMap<(PathBuf, EncodingKey), ImageId>,
    pub(super) spectra: HashMap<PathBuf, Option<Pairs>>,
    pub(super) hashes: Vec<u64>,
    /// Is it a scene of pbrt-v3?
    pub(super) is_old: bool,
}

/// Builds the scene as far as it goes; mistakes are in `report`.
pub(super) fn build(entities: Entities, main: &Path, report: &mut Report<'_>) -> SceneDesc {
    let mut build = Build {
        report,
        base: main.parent().unwrap_or(Path::new("")).to_owned(),
        scene: SceneDesc::default(),
        float_textures: HashMap::new(),
        spectrum_textures: HashMap::new(),
        named_materials: HashMap::new(),
        media: HashMap::new(),
        images: HashMap::new(),
        spectra: HashMap::new(),
        hashes: entities.hashes,
        is_old: entities.is_old,
    };
    build.media(entities.media);
    // The camera's shutter is the film's exposure time.
    build.camera(entities.camera.as_ref(), entities.film.as_ref());
    build.film(entities.film.as_ref());
    build.filter(entities.filter.as_ref());
    build.sampler(entities.sampler.as_ref(), entities.seed);
    build.integrator(entities.integrator.as_ref());
    build.textures(entities.textures);
    let unnamed = build.materials(entities.named_materials, entities.materials);
    let area_lights = build.area_lights(&entities.area_lights);
    let objects = build.objects(entities.objects);
    build.shapes(entities.shapes, &unnamed, &area_lights);
    build.instances(&entities.instances, &objects);
    build.lights(&entities.lights);
    build.finish()
}

impl Build<'_, '_> {
    fn objects(&mut self, objects: Vec<ObjectEntity>) -> HashMap<String, ObjectId> {
        let mut ids = HashMap::new();
        for object in objects {
            let id = ObjectId(u32::try_from(self.scene.objects.len()).unwrap_or(u32::MAX));
            ids.insert(object.name.clone(), id);
            self.scene.objects.push(ObjectDesc { name: object.name, ..ObjectDesc::default() });
        }
        ids
    }

    fn instances(&mut self, instances: &[InstanceEntity], objects: &HashMap<String, ObjectId>) {
        for instance in instances {
            let span = instance.object.span;
            let Some(object) = objects.get(&instance.object.name) else {
                self.unknown("object", &instance.object.name, span, objects.keys());
                continue;
            };
            let world_from_object = instance.ctm.animated();
            self.scene.instances.push(InstanceDesc { object: *object, world_from_object, span });
        }
    }

    /// Reports a name that nothing has; once for each place.
    pub(super) fn unknown<'n>(
        &mut self,
        what: &str,
        name: &str,
        span: Span,
        known: impl Iterator<Item = &'n String>,
    ) {
        if !self.report.first(&format!("unknown {what} {name} {span:?}")) {
            return;
        }
        let mut known: Vec<_> = known.map(String::as_str).collect();
        known.sort_unstable();
        let hint =
            if known.is_empty() { format!("no {what} is defined") } else { suggest::hint(name, &known) };
        self.report.error(span, format!("unknown {what} \"{name}\"")).hint(hint);
    }

    /// The medium of a name; an unknown one is an error.
    pub(super) fn medium(&mut self, name: &Name) -> Option<MediumId> {
        let named = name.as_ref()?;
        let found = self.media.get(&named.name).copied();
        if found.is_none() {
            let known: Vec<_> = self.media.keys().cloned().collect();
            self.unknown("medium", &named.name, named.span, known.iter());
        }
        found
    }

    /// The media on both sides; `None` where they are the same, and no border is crossed. Under a subsurface material is
    /// another medium, whatever the file says.
    pub(super) fn medium_interface(
        &mut self,
        shape: &ShapeEntity,
        material: MaterialId,
    ) -> Option<MediumInterface> {
        let (inside, outside) = (self.medium(&shape.inside), self.medium(&shape.outside));
        let kind = self.scene.materials.get(material.index()).map(|m| &m.kind);
        let is_border = inside != outside || matches!(kind, Some(MaterialKind::Subsurface { .. }));
        is_border.then_some(MediumInterface { inside, outside })
    }

    /// The transform at the start, for things that cannot move.
    pub(super) fn fixed(&mut self, ctm: &TransformSet, what: &str, span: Span) -> AnimatedTransform {
        if ctm.is_animated() {
            self.report
                .warning(span, format!("{what} cannot move"))
                .hint("its transform at the start time is used, as in pbrt");
        }
        AnimatedTransform::fixed(ctm.at[0])
    }

    fn finish(mut self) -> SceneDesc {
        self.hash_images();
        self.scene.content_hash = source::combine(&self.hashes);
        self.scene.sources = self.report.sources().clone();
        self.scene
    }
}
