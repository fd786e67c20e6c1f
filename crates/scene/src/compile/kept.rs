//! What a compile takes over from an earlier one of nearly the same description: baked forms, trees, decoded images.
//!
//! Colours, lights, media, the eye and the film may change freely; if a form, a place or an instance does, all geometry is made
//! anew, but images are kept. What is taken over is what a compile from nothing would make, to the bit.

use accel::{Accel, Isa};
use scene_desc::{Geometry, InstanceDesc, SceneDesc, ShapeDesc};

use crate::materials::Gaps;
use crate::scene::Scene;
use crate::shapes::{Shape, ShapeGeometry};
use crate::textures::KeptImages;

/// The parts of a scene that are dear to make.
pub struct Kept {
    /// What they were made from.
    desc: SceneDesc,
    forms: Vec<ShapeGeometry>,
    /// Which shapes rays must look at closely: trees know.
    filters: Vec<bool>,
    accel: Accel,
    images: KeptImages,
}

/// Geometry for a compile to take over.
pub(super) struct KeptWorld {
    pub(super) forms: Vec<ShapeGeometry>,
    filters: Vec<bool>,
    accel: Accel,
}

impl Scene {
    /// Takes the scene apart. `desc` is what it was compiled from.
    #[must_use]
    pub fn into_kept(self, desc: SceneDesc) -> Kept {
        let filters = self.shapes.iter().map(needs_filter).collect();
        let forms = self.shapes.into_iter().map(|s| s.geometry).collect();
        let images = KeptImages { descs: desc.images.clone(), images: self.textures.into_images() };
        Kept { desc, forms, filters, accel: self.accel, images }
    }
}

impl Kept {
    /// The images, and the geometry if `desc` has the same.
    pub(super) fn split(self, desc: &SceneDesc) -> (KeptImages, Option<KeptWorld>) {
        let is_same = has_same_geometry(&self.desc, desc);
        let world = KeptWorld { forms: self.forms, filters: self.filters, accel: self.accel };
        (self.images, is_same.then_some(world))
    }
}

impl KeptWorld {
    /// The trees, if they are those of these shapes.
    pub(super) fn trees(accel: Accel, filters: &[bool], shapes: &[Shape], isa: Option<Isa>) -> Option<Accel> {
        let fits = shapes.iter().map(needs_filter).eq(filters.iter().copied());
        // Nobody asked for a kernel, or for this one.
        (fits && isa.is_none_or(|isa| isa == accel.isa())).then_some(accel)
    }

    /// Forms in the order of a compile; then what decides about trees.
    pub(super) fn into_parts(self) -> (Vec<ShapeGeometry>, (Accel, Vec<bool>)) {
        (self.forms, (self.accel, self.filters))
    }
}

/// Must a hit on the shape be looked at before it counts?
pub(super) fn needs_filter(shape: &Shape) -> bool {
    shape.alpha.is_some() || shape.gaps != Gaps::Nowhere
}

fn has_same_geometry(a: &SceneDesc, b: &SceneDesc) -> bool {
    same(&a.shapes, &b.shapes, is_same_form)
        && same(&a.instances, &b.instances, is_same_instance)
        && same(&a.objects, &b.objects, |a, b| {
            same(&a.shapes, &b.shapes, is_same_form) && same(&a.instances, &b.instances, is_same_instance)
        })
}

fn same<T>(a: &[T], b: &[T], is_same: impl Fn(&T, &T) -> bool) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| is_same(a, b))
}

fn is_same_instance(a: &InstanceDesc, b: &InstanceDesc) -> bool {
    a.object == b.object && a.world_from_object == b.world_from_object
}

fn is_same_form(a: &ShapeDesc, b: &ShapeDesc) -> bool {
    use std::sync::Arc;
    let form = match (&a.geometry, &b.geometry) {
        // Mostly they are one and the same; else they may still be equal.
        (Geometry::Mesh(a), Geometry::Mesh(b)) => Arc::ptr_eq(a, b) || a == b,
        (Geometry::BilinearMesh(a), Geometry::BilinearMesh(b)) => Arc::ptr_eq(a, b) || a == b,
        (Geometry::LoopSubdiv(a), Geometry::LoopSubdiv(b)) => Arc::ptr_eq(a, b) || a == b,
        (Geometry::Curve(a), Geometry::Curve(b)) => Arc::ptr_eq(a, b) || a == b,
        (a, b) => a == b,
    };
    // What a relief looks like is a texture's affair.
    let is_plain = a.displacement.is_none() && b.displacement.is_none();
    // A strand that emits is a tube.
    form && is_plain
        && (!matches!(a.geometry, Geometry::Curve(_)) || a.area_light.is_some() == b.area_light.is_some())
        && a.reverse_orientation == b.reverse_orientation
        && a.world_from_object == b.world_from_object
}
