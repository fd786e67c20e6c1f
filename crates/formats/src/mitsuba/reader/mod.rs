//! XML files to a [`Tree`]: `include`, `default` and `$parameters`, `path`, `alias`, and the values of properties.
//!
//! After a mistake the reader goes on with the next element, so that one run finds many.

mod names;
mod properties;

use std::borrow::Cow;
use std::cell::{Cell, RefCell};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use roxmltree::{Document, ParsingOptions};
use scene_desc::Span;

use super::text::{self, Lines};

use super::tree::{Class, Node, NodeId, Prop, Tree, Value, resolve};
use super::value;
use crate::report::Report;
use crate::{source, suggest};

/// Files within files, as in Mitsuba.
const MOST_FILES_DEEP: usize = 15;
/// Elements within elements.
const MOST_ELEMENTS_DEEP: usize = 64;
/// Files in all.
const MOST_FILES: usize = 4096;
/// Elements of all files together.
const MOST_ELEMENTS: usize = 1 << 24;
/// Longest text of an attribute after its parameters are put in.
const LONGEST_TEXT: usize = 1 << 26;

/// Elements that are no objects.
const ELEMENTS: [&str; 20] = [
    "float",
    "integer",
    "boolean",
    "string",
    "vector",
    "point",
    "rgb",
    "srgb",
    "spectrum",
    "blackbody",
    "transform",
    "animation",
    "ref",
    "include",
    "default",
    "path",
    "alias",
    "translate",
    "rotate",
    "scale",
];

/// A `$parameter`.
struct Parameter {
    name: String,
    value: String,
    /// From the command line, and not used so far?
    unused: bool,
}

/// Reads a file and all that it includes. `defines` are the values of `$parameters` that the command line gives.
pub(super) fn read(path: &Path, defines: &[(String, String)], report: &mut Report<'_>) -> Tree {
    let file = report.add_source(path);
    let parameter = |(name, value): &(String, String)| Parameter {
        name: name.clone(),
        value: value.clone(),
        unused: true,
    };
    // The last of the same name counts.
    let mut parameters: Vec<Parameter> = Vec::new();
    for p in defines.iter().rev().map(parameter) {
        if parameters.iter().all(|q| q.name != p.name) {
            parameters.push(p);
        }
    }
    let mut reader =
        Reader { report, tree: Tree::default(), parameters, open: Vec::new(), n_files: 0, n_elements: 0 };
    reader.file(path, Span::file(file), None, &[]);
    let unused = reader.parameters.iter().filter(|p| p.unused).map(|p| p.name.clone());
    for name in unused.collect::<Vec<_>>() {
        let known: Vec<_> = reader.parameters.iter().filter(|p| !p.unused).map(|p| p.name.as_str()).collect();
        let hint = if known.is_empty() { "it has none".to_owned() } else { suggest::hint(&name, &known) };
        reader.report.error(Span::NONE, format!("the scene has no parameter `{name}`")).hint(hint);
    }
    reader.tree
}

struct Reader<'r, 's> {
    report: &'r mut Report<'s>,
    tree: Tree,
    parameters: Vec<Parameter>,
    /// Files being read, outermost first.
    open: Vec<PathBuf>,
    n_files: usize,
    n_elements: usize,
}

/// What all elements of a file share.
struct File<'t> {
    lines: Lines<'t>,
    is_old: bool,
    dirs: Rc<Vec<PathBuf>>,
}

/// The attributes of an element, parameters put in.
struct Attributes<'a> {
    list: Vec<(&'a str, Cow<'a, str>)>,
    span: Span,
}

impl Attributes<'_> {
    fn get(&self, name: &str) -> Option<&str> {
        self.list.iter().find(|a| a.0 == name).map(|a| &*a.1)
    }
}

type Xml<'a> = roxmltree::Node<'a, 'a>;

impl Reader<'_, '_> {
    /// Reads a file; what it holds goes to `parent`, or becomes the root.
    fn file(&mut self, path: &Path, asked_at: Span, parent: Option<NodeId>, dirs: &[PathBuf]) {
        let Some((text, whole)) = self.text_of(path, asked_at) else { return };
        let options = ParsingOptions { nodes_limit: MOST_ELEMENTS as u32, ..ParsingOptions::default() };
        let file_id = whole.file.unwrap_or(scene_desc::FileId(0));
        let document = match Document::parse_with_options(&text, options) {
            Ok(document) => document,
            Err(e) => {
                let at = e.pos();
                let span = Span { line: at.row, column: at.col, ..whole };
                let hint = match e {
                    roxmltree::Error::DtdDetected => "take the DOCTYPE out: scenes have none",
                    _ => "the XML itself is damaged",
                };
                self.report.error(span, damage(&e)).hint(hint);
                self.open.pop();
                return;
            }
        };
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let dirs: Vec<PathBuf> = std::iter::once(folder).chain(dirs.iter().cloned()).collect();
        let lines = Lines::new(&text, file_id);
        let root = document.root_element();
        let span = lines.span(root.range().start);
        let is_old = self.is_old(root, span);
        let mut file = File { lines, is_old, dirs: Rc::new(dirs) };
        match parent {
            Some(parent) if root.tag_name().name() == "scene" => self.children(root, parent, &mut file, 1),
            Some(parent) => self.element(root, parent, &mut file, 1),
            None if root.tag_name().name() == "scene" => {
                let node = Node {
                    class: Class::Scene,
                    kind: "scene".into(),
                    id: None,
                    props: Vec::new(),
                    span,
                    dirs: Rc::clone(&file.dirs),
                    asked: RefCell::default(),
                };
                self.tree.nodes.push(node);
                self.children(root, NodeId(0), &mut file, 1);
            }
            None => {
                let message = format!("the root is <{}>, not <scene>", text::show(root.tag_name().name()));
                self.report.error(span, message).hint("is it a Mitsuba scene?");
            }
        }
        self.open.pop();
    }

    /// The text of a file that may be read, and its span; it is then open.
    fn text_of(&mut self, path: &Path, asked_at: Span) -> Option<(String, Span)> {
        let identity = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        if self.open.contains(&identity) {
            let hint = "take one of the includes out";
            self.report.error(asked_at, format!("{} includes itself", path.display())).hint(hint);
            return None;
        }
        if self.open.len() > MOST_FILES_DEEP || self.n_files >= MOST_FILES {
            self.report.give_up();
            self.report
                .error(asked_at, "files are included too often, or too deep")
                .hint(format!("at most {MOST_FILES_DEEP} within each other, {MOST_FILES} in all"));
            return None;
        }
        let source = match source::read(path) {
            Ok(source) => source,
            Err(e) => {
                let hint =
                    if self.open.is_empty() && e.is_absent() { "is it the right path?" } else { e.hint() };
                self.report.error(asked_at, format!("{} cannot be read: {e}", path.display())).hint(hint);
                return None;
            }
        };
        self.n_files += 1;
        self.tree.hashes.push(source.hash);
        let whole = Span::file(self.report.add_source(path));
        let Some(text) = decode(source.bytes) else {
            self.report.error(whole, "not text in UTF-8 or Latin-1").hint("is it an XML file?");
            return None;
        };
        self.open.push(identity);
        Some((text, whole))
    }

    fn is_old(&mut self, root: Xml<'_>, span: Span) -> bool {
        let Some(version) = root.attribute("version") else {
            self.report
                .warning(span, format!("<{}> has no version", text::show(root.tag_name().name())))
                .hint("it is read as version 3.0.0: add version=\"3.0.0\"");
            return false;
        };
        match version.split('.').next().and_then(|v| v.trim().parse::<u32>().ok()) {
            Some(major) => major < 2,
            None => {
                self.report
                    .error(span, format!("version \"{}\" is none", text::show(version)))
                    .hint("expected three numbers, as in version=\"3.0.0\"");
                false
            }
        }
    }

    fn children(&mut self, xml: Xml<'_>, parent: NodeId, file: &mut File<'_>, depth: usize) {
        for child in xml.children() {
            if self.report.is_over() {
                return;
            }
            if child.is_element() {
                self.element(child, parent, file, depth);
            } else if child.is_text() && child.text().is_some_and(|t| !t.trim().is_empty()) {
                let span = file.lines.span(child.range().start);
                let shown = text::show(child.text().unwrap_or_default().trim());
                self.report.warning(span, format!("text between elements: {shown}")).hint("it is ignored");
            }
        }
    }

    fn element(&mut self, xml: Xml<'_>, parent: NodeId, file: &mut File<'_>, depth: usize) {
        let span = file.lines.span(xml.range().start);
        self.n_elements += 1;
        if depth > MOST_ELEMENTS_DEEP || self.n_elements > MOST_ELEMENTS {
            self.report.give_up();
            let hint = format!("at most {MOST_ELEMENTS_DEEP} within each other, {MOST_ELEMENTS} in all");
            self.report.error(span, "too many elements").hint(hint);
            return;
        }
        let Some(attributes) = self.attributes(xml, span) else { return };
        let element = xml.tag_name().name();
        match element {
            "include" => self.include(&attributes, parent, file),
            "default" => self.default(&attributes),
            "path" => self.path(&attributes, file),
            "alias" => self.alias(&attributes),
            "ref" => {
                let Some(id) = self.required(&attributes, "id", "ref") else { return };
                self.add(parent, &attributes, file, Value::Ref(id));
            }
            "transform" | "animation" => {
                if let Some(t) = self.transform(xml, file, element == "animation") {
                    self.add(parent, &attributes, file, Value::Transform(Box::new(t)));
                }
            }
            "spectrum" if attributes.get("type").is_some() => {
                self.object(xml, Class::Texture, &attributes, parent, file, depth);
            }
            _ => {
                if let Some(class) = Class::of(element) {
                    self.object(xml, class, &attributes, parent, file, depth);
                } else {
                    self.property(xml, &attributes, parent, file);
                }
            }
        }
    }

    #[allow(clippy::too_many_arguments, reason = "what an element is, and where it stands")]
    fn object(
        &mut self,
        xml: Xml<'_>,
        class: Class,
        attributes: &Attributes<'_>,
        parent: NodeId,
        file: &mut File<'_>,
        depth: usize,
    ) {
        let element = xml.tag_name().name();
        if class == Class::Scene {
            self.report.error(attributes.span, "a <scene> within a scene").hint("use <include>");
            return;
        }
        let Some(kind) = self.required(attributes, "type", element) else { return };
        let id = attributes.get("id").map(str::to_owned);
        let node = NodeId(self.tree.nodes.len());
        self.tree.nodes.push(Node {
            class,
            kind,
            id: id.clone(),
            props: Vec::new(),
            span: attributes.span,
            dirs: Rc::clone(&file.dirs),
            asked: RefCell::default(),
        });
        if let Some(id) = id {
            self.define(id, node, attributes.span);
        }
        self.add(parent, attributes, file, Value::Object(node));
        self.children(xml, node, file, depth + 1);
        if file.is_old {
            value::upgrade(&mut self.tree.nodes[node.0]);
        }
    }

    fn add(&mut self, parent: NodeId, attributes: &Attributes<'_>, file: &File<'_>, value: Value) {
        let name = attributes.get("name").unwrap_or_default();
        let name = if file.is_old { text::underscored(name) } else { name.to_owned() };
        let Some(node) = self.tree.nodes.get_mut(parent.0) else { return };
        if !name.is_empty() && node.props.iter().any(|p| p.name == name) {
            self.report
                .warning(attributes.span, format!("\"{}\" is given twice", text::show(&name)))
                .hint("the last one counts");
            node.props.iter().filter(|p| p.name == name).for_each(|p| p.used.set(true));
        }
        node.props.push(Prop { name, value, span: attributes.span, used: Cell::new(false) });
    }

    fn required(&mut self, attributes: &Attributes<'_>, name: &str, element: &str) -> Option<String> {
        let found = attributes.get(name).filter(|v| !v.is_empty());
        if found.is_none() {
            let message = format!("<{element}> has no {name}");
            self.report.error(attributes.span, message).hint(format!("add {name}=\"…\""));
        }
        found.map(str::to_owned)
    }

    fn include(&mut self, attributes: &Attributes<'_>, parent: NodeId, file: &File<'_>) {
        let Some(name) = self.required(attributes, "filename", "include") else { return };
        let path = resolve(&file.dirs, &name);
        self.file(&path, attributes.span, Some(parent), &file.dirs);
    }
}

/// What is wrong with the XML, without the place, which is told apart.
fn damage(e: &roxmltree::Error) -> String {
    let text = e.to_string();
    let end = text.rfind(" at ").unwrap_or(text.len());
    text::show(&text[..end])
}

/// UTF-8, or Latin-1 where the file says so.
fn decode(bytes: Vec<u8>) -> Option<String> {
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(200)]).to_lowercase();
    match String::from_utf8(bytes) {
        Ok(text) => Some(text),
        Err(e) if head.contains("iso-8859-1") || head.contains("windows-1252") => {
            Some(e.as_bytes().iter().map(|b| char::from(*b)).collect())
        }
        Err(_) => None,
    }
}
