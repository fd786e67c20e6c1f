//! What the XML says, before anyone asks what it means: objects with their properties, each with its place.

use std::cell::Cell;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use math::AnimatedTransform;
use scene_desc::Span;

use super::spectra::Spectral;

/// Index into [`Tree::nodes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct NodeId(pub(super) usize);

/// Everything that was read.
#[derive(Debug, Default)]
pub(super) struct Tree {
    /// The first is the scene.
    pub(super) nodes: Vec<Node>,
    pub(super) ids: HashMap<String, NodeId>,
    /// Hashes of the files read, in order.
    pub(super) hashes: Vec<u64>,
}

/// The classes of objects: their XML elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Class {
    Scene,
    Shape,
    Bsdf,
    Emitter,
    Sensor,
    Film,
    Filter,
    Sampler,
    Integrator,
    Medium,
    Phase,
    Texture,
    Volume,
    Subsurface,
}

/// Elements that make objects, with those of old versions.
const CLASSES: [(&str, Class); 16] = [
    ("scene", Class::Scene),
    ("shape", Class::Shape),
    ("bsdf", Class::Bsdf),
    ("emitter", Class::Emitter),
    ("luminaire", Class::Emitter),
    ("sensor", Class::Sensor),
    ("camera", Class::Sensor),
    ("film", Class::Film),
    ("rfilter", Class::Filter),
    ("sampler", Class::Sampler),
    ("integrator", Class::Integrator),
    ("medium", Class::Medium),
    ("phase", Class::Phase),
    ("texture", Class::Texture),
    ("volume", Class::Volume),
    ("subsurface", Class::Subsurface),
];

impl Class {
    pub(super) fn of(element: &str) -> Option<Self> {
        CLASSES.iter().find(|c| c.0 == element).map(|c| c.1)
    }

    pub(super) fn name(self) -> &'static str {
        CLASSES.iter().find(|c| c.1 == self).map_or("", |c| c.0)
    }

    pub(super) fn elements() -> impl Iterator<Item = &'static str> {
        CLASSES.iter().map(|c| c.0)
    }
}

/// An object: a plug-in with its properties.
#[derive(Debug)]
pub(super) struct Node {
    pub(super) class: Class,
    /// The plug-in: `"diffuse"`.
    pub(super) kind: String,
    pub(super) id: Option<String>,
    pub(super) props: Vec<Prop>,
    pub(super) span: Span,
    /// Where its file names are looked for, first to last.
    pub(super) dirs: Rc<Vec<PathBuf>>,
    /// All names that were asked for, for hints.
    pub(super) asked: std::cell::RefCell<Vec<&'static str>>,
}

/// A property.
#[derive(Clone, Debug)]
pub(super) struct Prop {
    /// Empty for what has none.
    pub(super) name: String,
    pub(super) value: Value,
    pub(super) span: Span,
    pub(super) used: Cell<bool>,
}

/// What a property holds.
#[derive(Clone, Debug)]
pub(super) enum Value {
    Float(f64),
    Integer(i64),
    Bool(bool),
    Text(String),
    Vector([f64; 3]),
    Rgb([f32; 3]),
    Spectrum(Spectral),
    Transform(Box<AnimatedTransform>),
    Object(NodeId),
    /// An id and where it is used.
    Ref(String),
}

impl Value {
    /// The element that makes it.
    pub(super) fn element(&self) -> &'static str {
        match self {
            Self::Float(_) => "float",
            Self::Integer(_) => "integer",
            Self::Bool(_) => "boolean",
            Self::Text(_) => "string",
            Self::Vector(_) => "vector",
            Self::Rgb(_) => "rgb",
            Self::Spectrum(_) => "spectrum",
            Self::Transform(_) => "transform",
            Self::Object(_) => "object",
            Self::Ref(_) => "ref",
        }
    }
}

impl Node {
    /// `bsdf "diffuse"`.
    pub(super) fn title(&self) -> String {
        format!("{} \"{}\"", self.class.name(), self.kind)
    }

    /// The property of a name, marked as used.
    pub(super) fn find(&self, name: &'static str) -> Option<&Prop> {
        self.asked.borrow_mut().push(name);
        let found = self.props.iter().rev().find(|p| p.name == name);
        if let Some(p) = found {
            p.used.set(true);
        }
        found
    }

    /// Is there such a property? It is not marked.
    pub(super) fn has(&self, name: &'static str) -> bool {
        self.asked.borrow_mut().push(name);
        self.props.iter().any(|p| p.name == name)
    }

    /// Where a property is, else the object.
    pub(super) fn span_of(&self, name: &str) -> Span {
        self.props.iter().rev().find(|p| p.name == name).map_or(self.span, |p| p.span)
    }

    /// Marks properties that change no picture.
    pub(super) fn accept(&self, names: &[&'static str]) {
        for name in names {
            self.find(name);
        }
    }

    /// Marks everything, for what a stand-in replaces.
    pub(super) fn accept_all(&self) {
        self.props.iter().for_each(|p| p.used.set(true));
    }

    /// The path that a file name means.
    pub(super) fn resolve(&self, name: &str) -> PathBuf {
        resolve(&self.dirs, name)
    }
}

/// The first folder that has the file; where none has it, the first.
pub(super) fn resolve(dirs: &[PathBuf], name: &str) -> PathBuf {
    // Files that came from Windows.
    let name = if cfg!(windows) { name.to_owned() } else { name.replace('\\', "/") };
    let name = Path::new(&name);
    let found = dirs.iter().map(|d| d.join(name)).find(|p| p.exists());
    found.unwrap_or_else(|| dirs.first().map_or_else(|| name.to_owned(), |d| d.join(name)))
}

impl Tree {
    pub(super) fn node(&self, id: NodeId) -> &Node {
        &self.nodes[id.0]
    }
}
