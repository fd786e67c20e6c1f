//! From the tree to a scene: what properties are asked for, what nobody asked for, and the order of building.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use math::{AnimatedTransform, Transform, Vec3};
use scene_desc::{
    ImageDesc, ImageEncoding, ImageId, ImageTile, MaterialId, MediumId, MeshDesc, ObjectId, SceneDesc, Span,
    TextureId, TextureKind,
};

use super::meshes::MeshKey;
use super::text;
use super::tree::{Class, Node, NodeId, Prop, Tree, Value};
use crate::mesh::shape_file::ShapeFile;
use crate::report::Report;
use crate::resources::{self, EncodingKey};
use crate::{source, suggest};

/// What building needs at hand.
pub(super) struct Build<'t, 'r, 's> {
    pub(super) tree: &'t Tree,
    pub(super) report: &'r mut Report<'s>,
    pub(super) scene: SceneDesc,
    pub(super) materials: HashMap<NodeId, MaterialId>,
    pub(super) textures: HashMap<(NodeId, TextureKind), Option<TextureId>>,
    pub(super) media: HashMap<NodeId, MediumId>,
    pub(super) objects: HashMap<NodeId, Option<ObjectId>>,
    pub(super) images: HashMap<(PathBuf, EncodingKey), ImageId>,
    pub(super) files: HashMap<(PathBuf, u32), Option<Arc<ShapeFile>>>,
    pub(super) meshes: HashMap<MeshKey, Arc<MeshDesc>>,
    pub(super) hashes: Vec<u64>,
    /// Objects within objects that are being built, for references that go round in a circle.
    pub(super) building: Vec<NodeId>,
    pub(super) default_material: Option<MaterialId>,
}

/// Builds the scene as far as it goes; mistakes are in `report`.
pub(super) fn build(tree: &Tree, report: &mut Report<'_>) -> SceneDesc {
    let mut build = Build {
        tree,
        report,
        scene: SceneDesc::default(),
        materials: HashMap::new(),
        textures: HashMap::new(),
        media: HashMap::new(),
        objects: HashMap::new(),
        images: HashMap::new(),
        files: HashMap::new(),
        meshes: HashMap::new(),
        hashes: tree.hashes.clone(),
        building: Vec::new(),
        default_material: None,
    };
    if let Some(root) = tree.nodes.first() {
        build.root(root);
    }
    build.finish()
}

impl<'t> Build<'t, '_, '_> {
    fn root(&mut self, root: &'t Node) {
        self.load_shape_files();
        let children = self.children(root);
        self.sensor(&children);
        self.integrator(&children);
        // What is only referred to is checked as well: a mistake shall not wait for the first use.
        for (_, node, id) in &children {
            match node.class {
                Class::Shape => self.shape(node, *id),
                Class::Emitter => self.emitter(node),
                Class::Bsdf => {
                    self.material(*id);
                }
                Class::Medium => {
                    self.medium(*id);
                }
                Class::Sensor | Class::Integrator | Class::Texture | Class::Volume => {}
                Class::Scene
                | Class::Film
                | Class::Filter
                | Class::Sampler
                | Class::Phase
                | Class::Subsurface => self.misplaced(node, root),
            }
        }
        for p in root.props.iter().filter(|p| !p.used.get()) {
            if matches!(p.value, Value::Object(_) | Value::Ref(_)) {
                continue;
            }
            let message = format!("a scene has no property \"{}\"", text::show(&p.name));
            self.report.warning(p.span, message).hint("it is ignored");
        }
    }

    /// The objects within an object, references followed, in order. They are marked as used.
    pub(super) fn children(&mut self, node: &'t Node) -> Vec<(&'t Prop, &'t Node, NodeId)> {
        let mut out = Vec::new();
        for p in &node.props {
            if let Some(id) = self.object_of(p) {
                p.used.set(true);
                out.push((p, self.tree.node(id), id));
            }
        }
        out
    }

    /// The object that a property holds or refers to; an unknown reference is an error.
    pub(super) fn object_of(&mut self, p: &Prop) -> Option<NodeId> {
        match &p.value {
            Value::Object(id) => Some(*id),
            Value::Ref(id) => {
                let found = self.tree.ids.get(id).copied();
                if found.is_none() && self.report.first(&format!("unknown id {:?}", p.span)) {
                    let mut known: Vec<_> = self.tree.ids.keys().map(String::as_str).collect();
                    known.sort_unstable();
                    let hint =
                        if known.is_empty() { "nothing has an id".into() } else { suggest::hint(id, &known) };
                    self.report
                        .error(p.span, format!("nothing has the id \"{}\"", text::show(id)))
                        .hint(hint);
                }
                p.used.set(true);
                found
            }
            _ => None,
        }
    }

    /// An object at a place where its class has no business.
    pub(super) fn misplaced(&mut self, node: &Node, parent: &Node) {
        let message = format!("{} within {}", node.title(), parent.title());
        if self.report.first(&format!("{message} {:?}", node.span)) {
            self.report.warning(node.span, message).hint("it is ignored: it does not belong there");
        }
    }

    // ── Properties ───────────────────────────────────────────────────────────────────────────────────────────────

    fn wrong_type(&mut self, node: &Node, p: &Prop, expected: &str) {
        let message = format!("\"{}\" of {} is a <{}>", p.name, node.title(), p.value.element());
        self.report.error(p.span, message).hint(format!("expected <{expected}>"));
    }

    /// A number, if there is one.
    pub(super) fn float_opt(&mut self, node: &Node, name: &'static str) -> Option<f32> {
        let p = node.find(name)?;
        match &p.value {
            Value::Float(x) => Some(*x as f32),
            Value::Integer(n) => Some(*n as f32),
            // A constant spectrum or colour will do where a number is wanted.
            Value::Spectrum(super::spectra::Spectral::Constant(c)) => Some(*c),
            Value::Rgb([r, g, b]) if r == g && g == b => Some(*r),
            _ => {
                self.wrong_type(node, p, "float");
                None
            }
        }
    }

    pub(super) fn float(&mut self, node: &Node, name: &'static str, default: f32) -> f32 {
        self.float_opt(node, name).unwrap_or(default)
    }

    /// A number that must be above zero.
    pub(super) fn positive(&mut self, node: &Node, name: &'static str, default: f32) -> f32 {
        let x = self.float(node, name, default);
        if x > 0.0 {
            return x;
        }
        self.report.error(node.span_of(name), format!("\"{name}\" is {x}")).hint("it must be above 0");
        default
    }

    pub(super) fn integer_opt(&mut self, node: &Node, name: &'static str) -> Option<i64> {
        let p = node.find(name)?;
        match &p.value {
            Value::Integer(n) => Some(*n),
            Value::Float(x) if x.fract() == 0.0 && x.abs() < 1e15 => Some(*x as i64),
            _ => {
                self.wrong_type(node, p, "integer");
                None
            }
        }
    }

    /// A whole number within a range.
    pub(super) fn count(
        &mut self,
        node: &Node,
        name: &'static str,
        default: u32,
        range: std::ops::RangeInclusive<i64>,
    ) -> u32 {
        let Some(n) = self.integer_opt(node, name) else { return default };
        if range.contains(&n) {
            return u32::try_from(n).unwrap_or(default);
        }
        let (a, b) = (range.start(), range.end());
        self.report
            .error(node.span_of(name), format!("\"{name}\" is {n}"))
            .hint(format!("expected {a} to {b}"));
        default
    }

    pub(super) fn boolean(&mut self, node: &Node, name: &'static str, default: bool) -> bool {
        let Some(p) = node.find(name) else { return default };
        match p.value {
            Value::Bool(b) => b,
            _ => {
                self.wrong_type(node, p, "boolean");
                default
            }
        }
    }

    pub(super) fn string(&mut self, node: &Node, name: &'static str) -> Option<String> {
        let p = node.find(name)?;
        match &p.value {
            Value::Text(s) => Some(s.clone()),
            _ => {
                self.wrong_type(node, p, "string");
                None
            }
        }
    }

    /// One of some words; the first is the default.
    pub(super) fn word(&mut self, node: &Node, name: &'static str, words: &[&'static str]) -> &'static str {
        let default = words.first().copied().unwrap_or_default();
        let Some(s) = self.string(node, name) else { return default };
        match words.iter().find(|w| **w == s.to_ascii_lowercase()) {
            Some(w) => w,
            None => {
                let message = format!("\"{name}\" is \"{}\"", text::show(&s));
                self.report.error(node.span_of(name), message).hint(suggest::hint(&s, words));
                default
            }
        }
    }

    pub(super) fn vector(&mut self, node: &Node, name: &'static str) -> Option<Vec3> {
        let p = node.find(name)?;
        match p.value {
            Value::Vector(v) => Some(Vec3::from_array(v.map(|x| x as f32))),
            _ => {
                self.wrong_type(node, p, "point");
                None
            }
        }
    }

    pub(super) fn animated(&mut self, node: &Node, name: &'static str) -> AnimatedTransform {
        let identity = AnimatedTransform::fixed(Transform::IDENTITY);
        let Some(p) = node.find(name) else { return identity };
        match &p.value {
            Value::Transform(t) => **t,
            _ => {
                self.wrong_type(node, p, "transform");
                identity
            }
        }
    }

    pub(super) fn transform(&mut self, node: &Node, name: &'static str) -> Transform {
        let t = self.animated(node, name);
        if t.is_animated() {
            self.report
                .warning(node.span_of(name), format!("{} cannot move", node.title()))
                .hint("its place at the first key is used");
        }
        t.start()
    }

    /// Says what nobody asked for.
    pub(super) fn unused(&mut self, node: &Node) {
        for p in node.props.iter().filter(|p| !p.used.get()) {
            p.used.set(true);
            let what = match (&p.value, p.name.as_str()) {
                (Value::Object(id), "") => self.tree.node(*id).title(),
                (Value::Ref(id), "") => format!("the reference to \"{}\"", text::show(id)),
                (_, name) => format!("property \"{}\"", text::show(name)),
            };
            let asked = node.asked.borrow();
            let hint = match suggest::nearest(&p.name, asked.iter().copied()) {
                Some(near) => format!("it is ignored; did you mean \"{near}\"?"),
                None => "it is ignored".to_owned(),
            };
            self.report.warning(p.span, format!("{} has no use for {what}", node.title())).hint(hint);
        }
    }

    /// Reports an error and gives nothing.
    pub(super) fn refuse<T>(
        &mut self,
        span: Span,
        message: impl Into<String>,
        hint: impl Into<String>,
    ) -> Option<T> {
        self.report.error(span, message).hint(hint);
        None
    }

    /// Says what is not supported, and what is done instead.
    pub(super) fn unsupported(&mut self, node: &Node, instead: &str) {
        node.accept_all();
        if self.report.first(&format!("unsupported {:?}", node.span)) {
            self.report.warning(node.span, format!("{} is not supported", node.title())).hint(instead);
        }
    }

    /// An unknown plug-in.
    pub(super) fn unknown(&mut self, node: &Node, known: &[&str]) {
        node.accept_all();
        if self.report.first(&format!("unknown {:?}", node.span)) {
            let message = format!("unknown {}", node.title());
            self.report.error(node.span, message).hint(suggest::hint(&node.kind, known));
        }
    }

    // ── Files ────────────────────────────────────────────────────────────────────────────────────────────────────

    /// The image that `filename` names; a file that is not there is an error.
    pub(super) fn image(&mut self, node: &Node, encoding: ImageEncoding) -> Option<ImageId> {
        let Some(name) = self.string(node, "filename") else {
            let hint = "add <string name=\"filename\" value=\"…\"/>";
            return self.refuse(node.span, format!("{} has no \"filename\"", node.title()), hint);
        };
        self.image_at(&node.resolve(&name), node.span_of("filename"), encoding)
    }

    /// The image that `filename` names, or those of a set of tiles: the first of them, and all.
    pub(super) fn images_of(
        &mut self,
        node: &Node,
        encoding: ImageEncoding,
    ) -> Option<(ImageId, Vec<ImageTile>)> {
        let name = node.find("filename").map(|p| &p.value);
        let Some(Value::Text(name)) = name.filter(|v| matches!(v, Value::Text(n) if n.contains("<UDIM>")))
        else {
            return Some((self.image(node, encoding)?, Vec::new()));
        };
        let span = node.span_of("filename");
        node.accept(&["filename"]);
        let files = resources::tiles(&node.resolve(name), span, self.report)?;
        let tile = |(at, path): ([u32; 2], _)| {
            Some(ImageTile { at, image: self.image_at(Path::new(&path), span, encoding)? })
        };
        let tiles = files.into_iter().map(tile).collect::<Option<Vec<_>>>()?;
        Some((tiles.first()?.image, tiles))
    }

    pub(super) fn image_at(&mut self, path: &Path, span: Span, encoding: ImageEncoding) -> Option<ImageId> {
        let key = (path.to_owned(), encoding.into());
        if let Some(id) = self.images.get(&key) {
            return Some(*id);
        }
        if let Err(e) = resources::readable(path) {
            if self.report.first(&format!("image {}", path.display())) {
                self.report
                    .error(span, format!("image {} cannot be read: {e}", path.display()))
                    .hint("paths are relative to the scene file's folder, and to those of <path>");
            }
            return None;
        }
        let id = ImageId(u32::try_from(self.scene.images.len()).unwrap_or(u32::MAX));
        let space = scene_desc::ColorSpaceName::Srgb;
        self.scene.images.push(ImageDesc {
            path: path.to_owned(),
            encoding,
            space,
            channel: None,
            embedded: None,
            span,
        });
        self.images.insert(key, id);
        Some(id)
    }

    fn finish(mut self) -> SceneDesc {
        let hashes = resources::hash_images(&self.scene.images, self.report);
        self.hashes.extend(hashes);
        self.scene.content_hash = source::combine(&self.hashes);
        self.scene.sources = self.report.sources().clone();
        self.scene
    }
}
