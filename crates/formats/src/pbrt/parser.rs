//! Directives: from tokens to changes of state and to entities.
//!
//! After a mistake the reader goes on at the next directive, so that one run finds many mistakes.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

use math::{DVec3, DVec4, Transform};
use scene_desc::{ColorSpaceName, Span, TextureKind};

use super::lexer::{Kind, LexError, Lexer, Token};
use super::params::{self, Params, show};
use super::state::{
    Entities, Entity, GraphicsState, InstanceEntity, MaterialRef, Name, Named, NamedEntity, ObjectEntity,
    PlacedEntity, ShapeEntity, Target, TextureEntity, TransformSet,
};
use crate::report::Report;
use crate::{source, suggest};

/// A directive could not be carried out; that has been reported.
#[derive(Debug)]
pub(super) struct Refused;

type Done = Result<(), Refused>;

/// Files within files.
const MOST_FILES_DEEP: usize = 64;
/// Blocks within blocks.
const MOST_BLOCKS_DEEP: usize = 4096;
/// Files in all.
const MOST_FILES: usize = 1 << 20;
/// Bytes of files that are read again, in all.
const MOST_REPEATED_BYTES: usize = 1 << 30;

/// All directives.
const DIRECTIVES: [&str; 43] = [
    "Accelerator",
    "ActiveTransform",
    "AreaLightSource",
    "Attribute",
    "AttributeBegin",
    "AttributeEnd",
    "Camera",
    "ColorSpace",
    "ConcatTransform",
    "CoordSysTransform",
    "CoordinateSystem",
    "Film",
    "Identity",
    "Import",
    "Include",
    "Integrator",
    "LightSource",
    "LookAt",
    "MakeNamedMaterial",
    "MakeNamedMedium",
    "Material",
    "MediumInterface",
    "NamedMaterial",
    "ObjectBegin",
    "ObjectEnd",
    "ObjectInstance",
    "Option",
    "PixelFilter",
    "ReverseOrientation",
    "Rotate",
    "Sampler",
    "Scale",
    "Shape",
    "Texture",
    "Transform",
    "TransformBegin",
    "TransformEnd",
    "TransformTimes",
    "Translate",
    "WorldBegin",
    "WorldEnd",
    "Renderer",
    "SurfaceIntegrator",
];

/// Is this word a directive (of any version)?
pub(super) fn is_directive(word: &[u8]) -> bool {
    word.first().is_some_and(u8::is_ascii_uppercase) && DIRECTIVES.iter().any(|d| d.as_bytes() == word)
}

/// Reports a token that is none.
pub(super) fn lex_error(e: LexError, report: &mut Report<'_>) -> Refused {
    report.error(e.span, e.message).hint(e.hint);
    Refused
}

/// Reports a spelling of pbrt-v3; the first time, what to do about all of them.
pub(super) fn old_syntax(report: &mut Report<'_>, span: Span, what: &str, now: &str) {
    if report.first("pbrt-v3") {
        report
            .error(span, format!("{what} is pbrt-v3's: this looks like a pbrt-v3 scene"))
            .hint(format!("pbrt-v4 has {now}; `pbrt --upgrade old.pbrt > new.pbrt` converts a scene"));
    } else {
        report.error(span, format!("{what} is pbrt-v3's")).hint(format!("pbrt-v4 has {now}"));
    }
}

/// Reads a scene's main file and what it includes.
pub(super) fn parse(path: &Path, report: &mut Report<'_>) -> Entities {
    let file = report.add_source(path);
    let mut parser = Parser::new(path.parent().unwrap_or(Path::new("")).to_owned(), report);
    let done = parser.file(path, Span::file(file));
    if done.is_ok() && !parser.in_world && !parser.report.is_full() {
        parser
            .report
            .error(Span::file(file), "no WorldBegin: there is no scene in it")
            .hint("shapes and lights come after WorldBegin");
    }
    parser.close_blocks(0);
    parser.entities
}

/// What opened a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Block {
    Attribute,
    Object,
}

struct Parser<'r, 's> {
    report: &'r mut Report<'s>,
    /// Paths are relative to the main file's folder.
    base: PathBuf,
    state: GraphicsState,
    blocks: Vec<(Block, Span, GraphicsState)>,
    coordinate_systems: HashMap<String, TransformSet>,
    in_world: bool,
    object: Option<usize>,
    /// Files being read, outermost first.
    open_files: Vec<PathBuf>,
    files_read: HashMap<PathBuf, usize>,
    n_files: usize,
    repeated_bytes: usize,
    /// Where named things were defined, by kind and name.
    defined: HashMap<(&'static str, String), Span>,
    entities: Entities,
}

impl<'r, 's> Parser<'r, 's> {
    fn new(base: PathBuf, report: &'r mut Report<'s>) -> Self {
        Self {
            report,
            base,
            state: GraphicsState::default(),
            blocks: Vec::new(),
            coordinate_systems: HashMap::new(),
            in_world: false,
            object: None,
            open_files: Vec::new(),
            files_read: HashMap::new(),
            n_files: 0,
            repeated_bytes: 0,
            defined: HashMap::new(),
            entities: Entities::default(),
        }
    }

    /// Reads one file; `asked_at` is where it was asked for.
    fn file(&mut self, path: &Path, asked_at: Span) -> Done {
        let identity = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        if self.open_files.contains(&identity) {
            let chain: Vec<_> = self.open_files.iter().map(|p| p.display().to_string()).collect();
            return self.refuse(
                asked_at,
                format!("{} includes itself", path.display()),
                format!("the chain is {} → {}", chain.join(" → "), identity.display()),
            );
        }
        if self.open_files.len() >= MOST_FILES_DEEP {
            return self.refuse(
                asked_at,
                format!("files are included more than {MOST_FILES_DEEP} deep"),
                "include them from one place",
            );
        }
        let source = match source::read(path) {
            Ok(source) => source,
            Err(e) => {
                let message = format!("{} cannot be read: {e}", path.display());
                return self.refuse(asked_at, message, "paths are relative to the main scene file's folder");
            }
        };
        self.n_files += 1;
        let times = self.files_read.entry(identity.clone()).or_insert(0);
        *times += 1;
        if *times > 1 {
            self.repeated_bytes += source.bytes.len();
        }
        if self.n_files > MOST_FILES || self.repeated_bytes > MOST_REPEATED_BYTES {
            return self.refuse(
                asked_at,
                "the same files are included again and again",
                "use ObjectBegin and ObjectInstance for repetition",
            );
        }
        self.entities.hashes.push(source.hash);
        let file = self.report.add_source(path);
        self.open_files.push(identity);
        let done = self.text(&source.bytes, Span::file(file));
        self.open_files.pop();
        done
    }

    /// Reads directives to the end of a file.
    fn text(&mut self, bytes: &[u8], whole: Span) -> Done {
        if let Some(what) = not_text(bytes) {
            return self.refuse(whole, what, "expected pbrt-v4's text");
        }
        let Some(file) = whole.file else { return Err(Refused) };
        let mut lexer = Lexer::new(bytes, file);
        while let Some(token) = lexer.next() {
            let done = match token {
                Ok(token) => self.directive(token, &mut lexer),
                Err(e) => Err(lex_error(e, self.report)),
            };
            if done.is_err() {
                if self.report.is_full() {
                    return Err(Refused);
                }
                skip_to_directive(&mut lexer);
            }
        }
        Ok(())
    }

    fn refuse(&mut self, span: Span, message: impl Into<String>, hint: impl Into<String>) -> Done {
        self.report.error(span, message).hint(hint);
        Err(Refused)
    }

    fn directive(&mut self, token: Token<'_>, lexer: &mut Lexer<'_>) -> Done {
        let span = token.span;
        let word = match token.kind {
            Kind::Word(word) => word,
            Kind::Text(text) => {
                let message = format!("expected a directive, found the string \"{}\"", show(text.as_bytes()));
                return self.refuse(span, message, "is something missing before it?");
            }
            Kind::Open | Kind::Close => {
                return self.refuse(span, "expected a directive, found a bracket", "is one too many?");
            }
        };
        match std::str::from_utf8(word).unwrap_or_default() {
            "Identity" | "Translate" | "Scale" | "Rotate" | "LookAt" | "Transform" | "ConcatTransform"
            | "CoordinateSystem" | "CoordSysTransform" | "TransformTimes" | "ActiveTransform" => {
                self.transform(word, span, lexer)
            }
            "Camera" | "Film" | "Sampler" | "Integrator" | "PixelFilter" | "Accelerator" | "Option"
            | "ColorSpace" | "WorldBegin" => self.option(word, span, lexer),
            "AttributeBegin" | "AttributeEnd" | "TransformBegin" | "TransformEnd" | "ObjectBegin"
            | "ObjectEnd" | "ObjectInstance" | "Include" | "Import" => self.structure(word, span, lexer),
            "Shape" | "Material" | "MakeNamedMaterial" | "NamedMaterial" | "Texture" | "LightSource"
            | "AreaLightSource" | "MediumInterface" | "MakeNamedMedium" | "ReverseOrientation"
            | "Attribute" => self.world(word, span, lexer),
            "WorldEnd" => {
                old_syntax(self.report, span, "WorldEnd", "no such directive: the scene ends with the file");
                Err(Refused)
            }
            "Renderer" | "SurfaceIntegrator" => {
                old_syntax(self.report, span, &show(word), "Integrator");
                Err(Refused)
            }
            _ => {
                let word = show(word);
                let hint = match suggest::nearest(&word, DIRECTIVES) {
                    Some(d) => format!("did you mean {d}?"),
                    None => "directives are words such as Shape or Material".to_owned(),
                };
                self.refuse(span, format!("unknown directive {word}"), hint)
            }
        }
    }

    // ── Transforms ──────────────────────────────────────────────────────────────────────────────────────────────

    fn transform(&mut self, word: &[u8], span: Span, lexer: &mut Lexer<'_>) -> Done {
        match word {
            b"Identity" => self.state.change(|_| Transform::IDENTITY),
            b"Translate" => {
                let d = self.numbers::<3>("Translate", lexer)?;
                let t = Transform::translate(DVec3::from_array(d));
                self.state.change(|ctm| ctm * t);
            }
            b"Scale" => {
                let s = self.numbers::<3>("Scale", lexer)?;
                let t = self.regular(Transform::scale(DVec3::from_array(s)), span, "no factor may be 0")?;
                self.state.change(|ctm| ctm * t);
            }
            b"Rotate" => {
                let [angle, x, y, z] = self.numbers::<4>("Rotate", lexer)?;
                let t = Transform::rotate(DVec3::new(x, y, z), angle.to_radians());
                let t = self.regular(t, span, "the axis must not be zero")?;
                self.state.change(|ctm| ctm * t);
            }
            b"LookAt" => {
                let v = self.numbers::<9>("LookAt", lexer)?;
                let at = |i: usize| DVec3::new(v[i], v[i + 1], v[i + 2]);
                let t = Transform::look_at(at(0), at(3), at(6));
                let hint = "eye and target must differ, and up must not point along the view";
                let t = self.regular(t, span, hint)?;
                self.state.change(|ctm| ctm * t);
            }
            b"Transform" => {
                let t = self.matrix("Transform", span, lexer)?;
                self.state.change(|_| t);
            }
            b"ConcatTransform" => {
                let t = self.matrix("ConcatTransform", span, lexer)?;
                self.state.change(|ctm| ctm * t);
            }
            b"CoordinateSystem" => {
                let name = self.text_argument("CoordinateSystem", lexer)?.name;
                self.coordinate_systems.insert(name, (*self.state.ctm).clone());
            }
            b"CoordSysTransform" => return self.named_transform(lexer),
            b"TransformTimes" => {
                let [start, end] = self.numbers::<2>("TransformTimes", lexer)?;
                self.before_world("TransformTimes", span)?;
                Arc::make_mut(&mut self.state.ctm).times = [start as f32, end as f32];
            }
            _ => return self.active_transform(lexer),
        }
        Ok(())
    }

    fn named_transform(&mut self, lexer: &mut Lexer<'_>) -> Done {
        let Named { name, span } = self.text_argument("CoordSysTransform", lexer)?;
        if let Some(set) = self.coordinate_systems.get(&name) {
            Arc::make_mut(&mut self.state.ctm).at = set.at;
        } else {
            let mut known: Vec<_> = self.coordinate_systems.keys().map(String::as_str).collect();
            known.sort_unstable();
            let hint = format!("the directive is ignored, as in pbrt; {}", suggest::hint(&name, &known));
            self.report.warning(span, format!("unknown coordinate system \"{name}\"")).hint(hint);
        }
        Ok(())
    }

    fn active_transform(&mut self, lexer: &mut Lexer<'_>) -> Done {
        let here = lexer.here();
        self.state.active = match self.token(lexer)?.kind {
            Kind::Word(b"All") => [true, true],
            Kind::Word(b"StartTime") => [true, false],
            Kind::Word(b"EndTime") => [false, true],
            Kind::Word(_) | Kind::Text(_) | Kind::Open | Kind::Close => {
                return self.refuse(
                    here,
                    "unknown ActiveTransform",
                    "expected StartTime, EndTime or All, without quotes",
                );
            }
        };
        Ok(())
    }

    /// A transform, unless it is singular.
    fn regular(&mut self, t: Option<Transform>, span: Span, hint: &str) -> Result<Transform, Refused> {
        t.ok_or_else(|| {
            self.report.error(span, "a singular transform: it has no inverse").hint(hint);
            Refused
        })
    }

    fn numbers<const N: usize>(&mut self, what: &str, lexer: &mut Lexer<'_>) -> Result<[f64; N], Refused> {
        let mut out = [0.0; N];
        for (i, x) in out.iter_mut().enumerate() {
            *x = self.number(&format!("{what}: number {} of {N}", i + 1), lexer)?;
        }
        Ok(out)
    }

    fn number(&mut self, what: &str, lexer: &mut Lexer<'_>) -> Result<f64, Refused> {
        let token = self.token(lexer)?;
        let Kind::Word(word) = token.kind else {
            self.report.error(token.span, format!("{what} is missing")).hint("expected a number");
            return Err(Refused);
        };
        match super::number::f64_at(word) {
            Some((x, _)) if x.abs() <= f64::from(f32::MAX) => Ok(x),
            Some(_) => {
                let message = format!("{what}: {} does not fit a 32-bit float", show(word));
                self.report.error(token.span, message).hint("floats go up to 3.4e38");
                Err(Refused)
            }
            None => {
                let message = format!("{what}: {} is no number", show(word));
                self.report.error(token.span, message).hint("expected a number");
                if is_directive(word) {
                    lexer.put_back(token);
                }
                Err(Refused)
            }
        }
    }

    /// Sixteen numbers in brackets, column by column.
    fn matrix(&mut self, what: &str, span: Span, lexer: &mut Lexer<'_>) -> Result<Transform, Refused> {
        self.bracket(Kind::Open, what, lexer)?;
        let v = self.numbers::<16>(what, lexer)?;
        self.bracket(Kind::Close, what, lexer)?;
        let column = |i: usize| DVec4::new(v[i], v[i + 1], v[i + 2], v[i + 3]);
        let m = math::DMat4::from_cols(column(0), column(4), column(8), column(12));
        self.regular(Transform::from_matrix(m), span, "no two axes may coincide and none may be zero")
    }

    fn bracket(&mut self, kind: Kind<'static>, what: &str, lexer: &mut Lexer<'_>) -> Done {
        let token = self.token(lexer)?;
        if token.kind == kind {
            return Ok(());
        }
        let bracket = if kind == Kind::Open { "[" } else { "]" };
        self.refuse(token.span, format!("{what}: expected {bracket}"), "it takes 16 numbers in brackets")
    }

    // ── Before WorldBegin ───────────────────────────────────────────────────────────────────────────────────────

    fn option(&mut self, word: &[u8], span: Span, lexer: &mut Lexer<'_>) -> Done {
        match word {
            b"Option" => return self.set_option(lexer),
            b"ColorSpace" => return self.color_space(lexer),
            b"WorldBegin" => {
                self.before_world("WorldBegin", span)?;
                self.in_world = true;
                self.state.active = [true; 2];
                self.state.change(|_| Transform::IDENTITY);
                self.coordinate_systems.insert("world".into(), (*self.state.ctm).clone());
                return Ok(());
            }
            _ => {}
        }
        let entity = self.entity(&show(word), span, None, lexer)?;
        self.before_world(&show(word), span)?;
        match word {
            b"Camera" => {
                let world_from_camera = self.state.ctm.inverse();
                self.coordinate_systems.insert("camera".into(), world_from_camera);
                let medium = self.state.outside.clone();
                self.entities.camera = Some(PlacedEntity { entity, medium });
            }
            b"Film" => self.entities.film = Some(entity),
            b"Sampler" => self.entities.sampler = Some(entity),
            b"Integrator" => self.entities.integrator = Some(entity),
            b"PixelFilter" => self.entities.filter = Some(entity),
            // Our ray kernel builds its own tree: pbrt's choice changes no picture.
            _ => {}
        }
        Ok(())
    }

    fn color_space(&mut self, lexer: &mut Lexer<'_>) -> Done {
        const NAMES: [&str; 4] = ["srgb", "dci-p3", "rec2020", "aces2065-1"];
        let Named { name, span } = self.text_argument("ColorSpace", lexer)?;
        self.state.space = match name.to_lowercase().as_str() {
            "srgb" => ColorSpaceName::Srgb,
            "dci-p3" => ColorSpaceName::DciP3,
            "rec2020" => ColorSpaceName::Rec2020,
            "aces2065-1" => ColorSpaceName::Aces2065_1,
            _ => {
                let hint = suggest::hint(&name, &NAMES);
                return self.refuse(span, format!("unknown colour space \"{name}\""), hint);
            }
        };
        Ok(())
    }

    /// `Option "seed" 3`: the value is a bare or quoted word.
    fn set_option(&mut self, lexer: &mut Lexer<'_>) -> Done {
        const NAMES: [&str; 11] = [
            "disablepixeljitter",
            "disabletexturefiltering",
            "disablewavelengthjitter",
            "displacementedgescale",
            "forcediffuse",
            "msereferenceimage",
            "msereferenceout",
            "pixelstats",
            "rendercoordsys",
            "seed",
            "wavefront",
        ];
        let Named { name, span } = self.text_argument("Option", lexer)?;
        let token = self.token(lexer)?;
        let value = match &token.kind {
            Kind::Word(word) => String::from_utf8_lossy(word).into_owned(),
            Kind::Text(text) => text.clone().into_owned(),
            Kind::Open | Kind::Close => {
                return self.refuse(token.span, format!("option \"{name}\" has no value"), "add it");
            }
        };
        // pbrt reads names without regard to case, - and _.
        let plain: String = name.to_lowercase().chars().filter(|c| !matches!(c, '-' | '_')).collect();
        match (plain.as_str(), value.as_str()) {
            ("seed", _) => match value.parse() {
                Ok(seed) => self.entities.seed = Some(seed),
                Err(_) => {
                    let message = format!("option \"seed\": {} is no number", show(value.as_bytes()));
                    return self.refuse(token.span, message, "expected a whole number");
                }
            },
            // These change only how pbrt runs, or say what we do anyway.
            ("msereferenceimage" | "msereferenceout" | "pixelstats" | "rendercoordsys" | "wavefront", _)
            | ("displacementedgescale", _)
            | (_, "false")
                if NAMES.contains(&plain.as_str()) => {}
            (known, _) if NAMES.contains(&known) => {
                self.report
                    .warning(span, format!("option \"{name}\" is not supported"))
                    .hint("it is ignored");
            }
            (_, _) => {
                let hint = suggest::hint(&name, &NAMES);
                return self.refuse(span, format!("unknown option \"{name}\""), hint);
            }
        }
        Ok(())
    }

    fn before_world(&mut self, what: &str, span: Span) -> Done {
        if self.in_world {
            let hint = "options, such as camera and film, stand before WorldBegin";
            return self.refuse(span, format!("{what} after WorldBegin"), hint);
        }
        Ok(())
    }

    fn after_world(&mut self, what: &str, span: Span) -> Done {
        if !self.in_world {
            let hint = "shapes, lights and materials stand after WorldBegin";
            return self.refuse(span, format!("{what} before WorldBegin"), hint);
        }
        Ok(())
    }

    // ── Structure ───────────────────────────────────────────────────────────────────────────────────────────────

    fn structure(&mut self, word: &[u8], span: Span, lexer: &mut Lexer<'_>) -> Done {
        match word {
            b"AttributeBegin" => self.begin(Block::Attribute, "AttributeBegin", span),
            b"AttributeEnd" => self.end(Block::Attribute, "AttributeEnd", span),
            // Deprecated: pbrt-v4 takes them for AttributeBegin and AttributeEnd.
            b"TransformBegin" => self.begin(Block::Attribute, "TransformBegin", span),
            b"TransformEnd" => self.end(Block::Attribute, "TransformEnd", span),
            b"ObjectBegin" => self.object_begin(span, lexer),
            b"ObjectEnd" => {
                self.after_world("ObjectEnd", span)?;
                self.end(Block::Object, "ObjectEnd", span)?;
                self.object = None;
                Ok(())
            }
            b"ObjectInstance" => {
                let object = self.text_argument("ObjectInstance", lexer)?;
                self.after_world("ObjectInstance", span)?;
                if self.object.is_some() {
                    let hint = "pbrt has no instances within objects: repeat the shapes";
                    return self.refuse(span, "ObjectInstance within ObjectBegin", hint);
                }
                let ctm = Arc::clone(&self.state.ctm);
                self.entities.instances.push(InstanceEntity { object, ctm });
                Ok(())
            }
            b"Include" => {
                let Named { name, span } = self.text_argument("Include", lexer)?;
                self.file(&self.base.join(name), span)
            }
            _ => self.import(span, lexer),
        }
    }

    /// Like `Include`, but what it does to the state ends with it.
    fn import(&mut self, span: Span, lexer: &mut Lexer<'_>) -> Done {
        let Named { name, span: name_span } = self.text_argument("Import", lexer)?;
        self.after_world("Import", span)?;
        let state = self.state.clone();
        let systems = self.coordinate_systems.clone();
        let depth = self.blocks.len();
        let done = self.file(&self.base.join(name), name_span);
        self.close_blocks(depth);
        self.state = state;
        self.coordinate_systems = systems;
        done
    }

    fn begin(&mut self, block: Block, what: &str, span: Span) -> Done {
        self.after_world(what, span)?;
        if self.blocks.len() >= MOST_BLOCKS_DEEP {
            let message = format!("blocks are nested more than {MOST_BLOCKS_DEEP} deep");
            self.blocks.clear();
            return self.refuse(span, message, "is there an AttributeEnd for each AttributeBegin?");
        }
        self.blocks.push((block, span, self.state.clone()));
        Ok(())
    }

    fn end(&mut self, block: Block, what: &str, span: Span) -> Done {
        self.after_world(what, span)?;
        match self.blocks.pop() {
            Some((open, _, state)) if open == block => {
                self.state = state;
                Ok(())
            }
            Some((open, begin, state)) => {
                // The other block ends here too, so that one slip is one message.
                self.state = state;
                self.object = None;
                let open = if open == Block::Object { "ObjectBegin" } else { "AttributeBegin" };
                let hint = format!("{open} at {} is still open", self.report.locate(begin));
                self.refuse(span, format!("unmatched {what}"), hint)
            }
            None => self.refuse(span, format!("unmatched {what}"), "no block is open here: remove it"),
        }
    }

    fn object_begin(&mut self, span: Span, lexer: &mut Lexer<'_>) -> Done {
        let Named { name, span: name_span } = self.text_argument("ObjectBegin", lexer)?;
        self.begin(Block::Object, "ObjectBegin", span)?;
        if self.object.is_some() {
            return self.refuse(span, "ObjectBegin within ObjectBegin", "objects do not nest: end the first");
        }
        self.object = Some(self.entities.objects.len());
        self.entities.objects.push(ObjectEntity { name: name.clone() });
        self.define("object", &name, name_span)
    }

    /// Reports blocks that are still open beyond a depth.
    fn close_blocks(&mut self, depth: usize) {
        while self.blocks.len() > depth {
            if let Some((block, span, state)) = self.blocks.pop() {
                let (begin, end) = match block {
                    Block::Attribute => ("AttributeBegin", "AttributeEnd"),
                    Block::Object => ("ObjectBegin", "ObjectEnd"),
                };
                self.report.error(span, format!("{begin} without {end}")).hint(format!("add {end}"));
                self.state = state;
            }
        }
    }

    // ── After WorldBegin ────────────────────────────────────────────────────────────────────────────────────────

    fn world(&mut self, word: &[u8], span: Span, lexer: &mut Lexer<'_>) -> Done {
        match word {
            b"Shape" => self.shape(span, lexer),
            b"Material" => {
                let entity = self.entity("Material", span, Some(Target::Material), lexer)?;
                self.after_world("Material", span)?;
                self.state.material = MaterialRef::Unnamed(self.entities.materials.len());
                self.entities.materials.push(entity);
                Ok(())
            }
            b"NamedMaterial" => {
                let name = self.text_argument("NamedMaterial", lexer)?;
                self.after_world("NamedMaterial", span)?;
                self.state.material = MaterialRef::Named(Arc::new(name));
                Ok(())
            }
            b"MakeNamedMaterial" => {
                let NamedEntity { name, entity } = self.named_entity("MakeNamedMaterial", span, lexer)?;
                self.after_world("MakeNamedMaterial", span)?;
                self.define("material", &name, span)?;
                self.entities.named_materials.push(NamedEntity { name, entity });
                Ok(())
            }
            b"MakeNamedMedium" => {
                let NamedEntity { name, entity } = self.named_entity("MakeNamedMedium", span, lexer)?;
                self.define("medium", &name, span)?;
                self.entities.media.push(NamedEntity { name, entity });
                Ok(())
            }
            b"MediumInterface" => self.medium_interface(lexer),
            b"Texture" => self.texture(span, lexer),
            b"LightSource" => {
                let entity = self.entity("LightSource", span, Some(Target::Light), lexer)?;
                self.after_world("LightSource", span)?;
                let medium = self.state.outside.clone();
                self.entities.lights.push(PlacedEntity { entity, medium });
                Ok(())
            }
            b"AreaLightSource" => {
                let entity = self.entity("AreaLightSource", span, Some(Target::Light), lexer)?;
                self.after_world("AreaLightSource", span)?;
                self.state.area_light = (!entity.kind.is_empty()).then_some(self.entities.area_lights.len());
                self.entities.area_lights.push(entity);
                Ok(())
            }
            b"ReverseOrientation" => {
                self.after_world("ReverseOrientation", span)?;
                self.state.reverse_orientation = !self.state.reverse_orientation;
                Ok(())
            }
            _ => self.attribute(lexer),
        }
    }

    fn shape(&mut self, span: Span, lexer: &mut Lexer<'_>) -> Done {
        let entity = self.entity("Shape", span, Some(Target::Shape), lexer)?;
        self.after_world("Shape", span)?;
        self.entities.shapes.push(ShapeEntity {
            entity,
            reverse_orientation: self.state.reverse_orientation,
            material: self.state.material.clone(),
            area_light: self.state.area_light,
            inside: self.state.inside.clone(),
            outside: self.state.outside.clone(),
            object: self.object,
        });
        Ok(())
    }

    fn texture(&mut self, span: Span, lexer: &mut Lexer<'_>) -> Done {
        let Named { name, span: name_span } = self.text_argument("Texture", lexer)?;
        let Named { name: kind, span: kind_span } = self.text_argument("Texture: the kind", lexer)?;
        let entity = self.entity("Texture", span, Some(Target::Texture), lexer)?;
        self.after_world("Texture", span)?;
        let (kind, word) = match kind.as_str() {
            "float" => (TextureKind::Float, "float texture"),
            "spectrum" => (TextureKind::Spectrum, "spectrum texture"),
            "color" => {
                old_syntax(self.report, kind_span, "texture kind \"color\"", "\"spectrum\"");
                return Err(Refused);
            }
            _ => {
                let message = format!("unknown texture kind \"{kind}\"");
                return self.refuse(kind_span, message, "possible are \"float\" and \"spectrum\"");
            }
        };
        self.define(word, &name, name_span)?;
        self.entities.textures.push(TextureEntity { name, kind, entity });
        Ok(())
    }

    fn medium_interface(&mut self, lexer: &mut Lexer<'_>) -> Done {
        let inside = self.text_argument("MediumInterface", lexer)?;
        let outside = match lexer.peek() {
            Some(Ok(Token { kind: Kind::Text(_), .. })) => self.text_argument("MediumInterface", lexer)?,
            Some(_) | None => Named { name: inside.name.clone(), span: inside.span },
        };
        let name = |n: Named| -> Name { (!n.name.is_empty()).then(|| Arc::new(n)) };
        self.state.inside = name(inside);
        self.state.outside = name(outside);
        Ok(())
    }

    /// Default parameters for what follows.
    fn attribute(&mut self, lexer: &mut Lexer<'_>) -> Done {
        let Named { name, span } = self.text_argument("Attribute", lexer)?;
        let mut list = params::parse_list(lexer, self.report)?;
        let target = match name.as_str() {
            "shape" => Target::Shape,
            "light" => Target::Light,
            "material" => Target::Material,
            "medium" => Target::Medium,
            "texture" => Target::Texture,
            _ => {
                let names = ["shape", "light", "material", "medium", "texture"];
                let hint = suggest::hint(&name, &names);
                return self.refuse(span, format!("unknown Attribute target \"{name}\""), hint);
            }
        };
        for p in &mut list {
            p.space = Some(self.state.space);
        }
        Rc::make_mut(&mut self.state.defaults[target as usize]).extend(list);
        Ok(())
    }

    // ── Parts of directives ─────────────────────────────────────────────────────────────────────────────────────

    /// A type in quotes and parameters.
    fn entity(
        &mut self,
        what: &str,
        span: Span,
        target: Option<Target>,
        lexer: &mut Lexer<'_>,
    ) -> Result<Entity, Refused> {
        let kind = self.text_argument(what, lexer)?.name;
        let list = params::parse_list(lexer, self.report)?;
        let defaults = target.map(|t| self.state.defaults(t)).unwrap_or_default();
        let params = Params::new(list, defaults, self.state.space);
        Ok(Entity { kind, params, ctm: Arc::clone(&self.state.ctm), span })
    }

    /// A name in quotes and parameters, one of which is the type.
    fn named_entity(
        &mut self,
        what: &'static str,
        span: Span,
        lexer: &mut Lexer<'_>,
    ) -> Result<NamedEntity, Refused> {
        let target = if what == "MakeNamedMedium" { Target::Medium } else { Target::Material };
        let mut entity = self.entity(what, span, Some(target), lexer)?;
        let Some((kind, _)) = entity.params.string_opt("type", self.report) else {
            let message = format!("{what} \"{}\" has no type", entity.kind);
            self.report.error(span, message).hint("add one, as in \"string type\" \"diffuse\"");
            return Err(Refused);
        };
        let name = std::mem::replace(&mut entity.kind, kind);
        Ok(NamedEntity { name, entity })
    }

    /// Remembers where a name was defined; twice is an error.
    fn define(&mut self, what: &'static str, name: &str, span: Span) -> Done {
        if let Some(first) = self.defined.insert((what, name.to_owned()), span) {
            let hint = format!("the first is at {}", self.report.locate(first));
            return self.refuse(span, format!("{what} \"{name}\" is defined twice"), hint);
        }
        Ok(())
    }

    fn text_argument(&mut self, what: &str, lexer: &mut Lexer<'_>) -> Result<Named, Refused> {
        let token = self.token(lexer)?;
        match token.kind {
            Kind::Text(text) => Ok(Named { name: text.into_owned(), span: token.span }),
            Kind::Word(word) => {
                let message = format!("{what}: expected a name in quotes, found {}", show(word));
                self.report.error(token.span, message).hint("write it as \"name\"");
                if is_directive(word) {
                    lexer.put_back(token);
                }
                Err(Refused)
            }
            Kind::Open | Kind::Close => {
                self.report
                    .error(token.span, format!("{what}: expected a name in quotes, found a bracket"))
                    .hint("write it as \"name\"");
                Err(Refused)
            }
        }
    }

    /// The next token, which must be there.
    fn token<'a>(&mut self, lexer: &mut Lexer<'a>) -> Result<Token<'a>, Refused> {
        match lexer.next() {
            Some(Ok(token)) => Ok(token),
            Some(Err(e)) => Err(lex_error(e, self.report)),
            None => {
                let here = lexer.here();
                self.report.error(here, "the file ends within a directive").hint("is it complete?");
                Err(Refused)
            }
        }
    }
}

/// Goes on to what looks like a directive.
fn skip_to_directive(lexer: &mut Lexer<'_>) {
    while let Some(token) = lexer.peek() {
        if matches!(token, Ok(Token { kind: Kind::Word(word), .. }) if is_directive(word)) {
            return;
        }
        lexer.next();
    }
}

/// Why bytes are no scene's text, judged by their beginning.
fn not_text(bytes: &[u8]) -> Option<&'static str> {
    let head = &bytes[..bytes.len().min(4096)];
    if head.starts_with(&[0xfe, 0xff]) || head.starts_with(&[0xff, 0xfe]) {
        return Some("UTF-16 text: only UTF-8 can be read");
    }
    let odd = head.iter().filter(|b| **b < 9 || (14..32).contains(*b) || **b == 127).count();
    (odd * 50 > head.len()).then_some("binary data, not a scene's text")
}
