//! The graphics state that directives change, and the entities that they leave behind.

use std::rc::Rc;
use std::sync::Arc;

use math::{AnimatedTransform, Transform};
use scene_desc::{ColorSpaceName, Span};

use super::params::{Param, Params};

/// A name as it was written, with its place. `None` where pbrt has an empty name.
pub(super) type Name = Option<Arc<Named>>;

/// A name and where it was used.
#[derive(Debug)]
pub(super) struct Named {
    pub(super) name: String,
    pub(super) span: Span,
}

/// The current transformation at the two ends of the motion.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TransformSet {
    pub(super) at: [Transform; 2],
    pub(super) times: [f32; 2],
}

impl TransformSet {
    pub(super) fn animated(&self) -> AnimatedTransform {
        AnimatedTransform::new(self.at[0], self.at[1], self.times)
    }

    pub(super) fn is_animated(&self) -> bool {
        self.at[0] != self.at[1]
    }

    pub(super) fn inverse(&self) -> Self {
        Self { at: self.at.map(Transform::inverse), times: self.times }
    }
}

/// Which material a shape gets.
#[derive(Clone, Debug)]
pub(super) enum MaterialRef {
    /// One of [`Entities::materials`].
    Unnamed(usize),
    /// By name, defined before or after.
    Named(Arc<Named>),
    /// pbrt's default.
    Default,
}

/// The kinds of things that `Attribute` gives default parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    Shape,
    Light,
    Material,
    Medium,
    Texture,
}

/// What directives change and `AttributeBegin`/`AttributeEnd` save and restore.
#[derive(Clone, Debug)]
pub(super) struct GraphicsState {
    pub(super) ctm: Arc<TransformSet>,
    /// Which of the two transforms directives change.
    pub(super) active: [bool; 2],
    pub(super) reverse_orientation: bool,
    pub(super) space: ColorSpaceName,
    pub(super) material: MaterialRef,
    /// Index into [`Entities::area_lights`].
    pub(super) area_light: Option<usize>,
    pub(super) inside: Name,
    pub(super) outside: Name,
    pub(super) defaults: [Rc<Vec<Param>>; 5],
}

impl Default for GraphicsState {
    fn default() -> Self {
        let identity = TransformSet { at: [Transform::IDENTITY; 2], times: [0.0, 1.0] };
        Self {
            ctm: Arc::new(identity),
            active: [true; 2],
            reverse_orientation: false,
            space: ColorSpaceName::Srgb,
            material: MaterialRef::Default,
            area_light: None,
            inside: None,
            outside: None,
            defaults: Default::default(),
        }
    }
}

impl GraphicsState {
    pub(super) fn defaults(&self, target: Target) -> Rc<Vec<Param>> {
        Rc::clone(&self.defaults[target as usize])
    }

    /// Changes the active transforms.
    pub(super) fn change(&mut self, f: impl Fn(Transform) -> Transform) {
        let ctm = Arc::make_mut(&mut self.ctm);
        for (t, active) in ctm.at.iter_mut().zip(self.active) {
            if active {
                *t = f(*t);
            }
        }
    }
}

/// A thing with a type and parameters.
#[derive(Debug)]
pub(super) struct Entity {
    /// Its type: `"sphere"`, `"diffuse"`.
    pub(super) kind: String,
    pub(super) params: Params,
    pub(super) ctm: Arc<TransformSet>,
    pub(super) span: Span,
}

/// A shape and what the state says about it.
#[derive(Debug)]
pub(super) struct ShapeEntity {
    pub(super) entity: Entity,
    pub(super) reverse_orientation: bool,
    pub(super) material: MaterialRef,
    pub(super) area_light: Option<usize>,
    pub(super) inside: Name,
    pub(super) outside: Name,
    /// Index into [`Entities::objects`].
    pub(super) object: Option<usize>,
}

/// A named thing.
#[derive(Debug)]
pub(super) struct NamedEntity {
    pub(super) name: String,
    pub(super) entity: Entity,
}

/// A texture before it is built.
#[derive(Debug)]
pub(super) struct TextureEntity {
    pub(super) name: String,
    pub(super) kind: scene_desc::TextureKind,
    pub(super) entity: Entity,
}

/// A light or camera and the medium that it is in.
#[derive(Debug)]
pub(super) struct PlacedEntity {
    pub(super) entity: Entity,
    pub(super) medium: Name,
}

/// Shapes under a name.
#[derive(Debug)]
pub(super) struct ObjectEntity {
    pub(super) name: String,
}

/// One use of an object.
#[derive(Debug)]
pub(super) struct InstanceEntity {
    pub(super) object: Named,
    pub(super) ctm: Arc<TransformSet>,
}

/// All that the files said, before names are resolved.
#[derive(Debug, Default)]
pub(super) struct Entities {
    pub(super) camera: Option<PlacedEntity>,
    pub(super) film: Option<Entity>,
    pub(super) filter: Option<Entity>,
    pub(super) sampler: Option<Entity>,
    pub(super) integrator: Option<Entity>,
    pub(super) seed: Option<i64>,
    pub(super) textures: Vec<TextureEntity>,
    pub(super) named_materials: Vec<NamedEntity>,
    pub(super) materials: Vec<Entity>,
    pub(super) media: Vec<NamedEntity>,
    pub(super) lights: Vec<PlacedEntity>,
    pub(super) area_lights: Vec<Entity>,
    pub(super) shapes: Vec<ShapeEntity>,
    pub(super) objects: Vec<ObjectEntity>,
    pub(super) instances: Vec<InstanceEntity>,
    /// Are they pbrt-v3's?
    pub(super) is_old: bool,
    /// Hashes of the files read, in order.
    pub(super) hashes: Vec<u64>,
}
