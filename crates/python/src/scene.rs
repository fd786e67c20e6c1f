//! A scene: its description, and what was compiled of it last.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ::scene::Kept;
use formats::HashCache;
use math::Bounds2i;
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use pyo3::types::PyBytes;
use render::{Opened, SceneOptions, Workers};
use scene_desc::{SceneDesc, Sink};

use crate::errors::{error, of_render, of_scene, warn};
use crate::run::workers;

/// A scene. Compiled when it is first needed, and again when something changed.
#[pyclass(frozen, module = "steradian._native")]
pub(crate) struct Scene {
    state: Mutex<State>,
    strict: bool,
}

struct State {
    desc: Arc<SceneDesc>,
    /// Was it changed since its content was hashed?
    edited: bool,
    hashes: HashCache,
    compiled: Option<Compiled>,
}

/// The last compile: with which options, and of what.
struct Compiled {
    options: Options,
    desc: Arc<SceneDesc>,
    opened: Arc<Opened>,
}

/// What decides about compilation beside the description.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Options {
    /// Width and height.
    pub(crate) resolution: Option<[u32; 2]>,
    /// x₀, y₀, x₁, y₁.
    pub(crate) crop: Option<[i32; 4]>,
    /// Four wavelengths instead of R, G, B.
    pub(crate) spectral: bool,
    /// Those that [`render::SCENE_SETTINGS`] names.
    pub(crate) settings: Vec<(String, String)>,
}

impl Options {
    fn to_scene_options(&self, strict: bool) -> SceneOptions {
        SceneOptions {
            resolution: self.resolution,
            crop: self.crop.map(|[x0, y0, x1, y1]| Bounds2i::new([x0, y0], [x1, y1])),
            spectral: self.spectral,
            settings: self.settings.clone(),
            strict,
            ..SceneOptions::default()
        }
    }
}

impl Compiled {
    /// What a later compile can use; nothing while a render has the scene still.
    fn into_kept(self) -> Option<Kept> {
        let opened = Arc::into_inner(self.opened)?;
        Some(opened.scene.into_kept(Arc::unwrap_or_clone(self.desc)))
    }
}

impl State {
    fn new(desc: SceneDesc, edited: bool) -> Self {
        Self { desc: Arc::new(desc), edited, hashes: HashCache::default(), compiled: None }
    }

    fn hashed(&mut self) -> Arc<SceneDesc> {
        if self.edited {
            let hash = self.hashes.content_hash(&self.desc);
            Arc::make_mut(&mut self.desc).content_hash = hash;
            self.edited = false;
        }
        Arc::clone(&self.desc)
    }
}

impl Scene {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn from_desc(desc: SceneDesc, strict: bool) -> Self {
        Self { state: Mutex::new(State::new(desc, true)), strict }
    }

    /// The description as it is now; its hash may be of before.
    pub(crate) fn desc(&self, py: Python<'_>) -> Arc<SceneDesc> {
        py.detach(|| Arc::clone(&self.lock().desc))
    }

    /// Changes the description. Renders that run go on with what they began with.
    pub(crate) fn edit<R>(
        &self,
        py: Python<'_>,
        change: impl FnOnce(&mut SceneDesc) -> PyResult<R>,
    ) -> PyResult<R> {
        // Whoever holds this lock may compile meanwhile, but never waits for the interpreter.
        let mut state = self.state.lock_py_attached(py).unwrap_or_else(PoisonError::into_inner);
        let result = change(Arc::make_mut(&mut state.desc))?;
        state.edited = true;
        Ok(result)
    }

    /// The description with the hash of its content.
    fn hashed(&self) -> Arc<SceneDesc> {
        self.lock().hashed()
    }

    /// The compiled scene; compiles it if there is none for these options. Warnings are told once, then.
    pub(crate) fn compiled(
        &self,
        py: Python<'_>,
        options: &Options,
        threads: Option<usize>,
    ) -> PyResult<Arc<Opened>> {
        let workers = workers(py, threads)?;
        let mut sink = Sink::default();
        // Two threads that ask at once compile one after the other: the second finds the first one's.
        let opened = py.detach(|| {
            let mut state = self.lock();
            let desc = state.hashed();
            if let Some(last) = &state.compiled
                && last.options == *options
                && last.opened.scene.settings().content_hash == desc.content_hash
            {
                return Some(Arc::clone(&last.opened));
            }
            let kept = state.compiled.take().and_then(Compiled::into_kept);
            let scene_options = options.to_scene_options(self.strict);
            let opened = render::recompile((*desc).clone(), &scene_options, kept, &workers, &mut sink)?;
            let opened = Arc::new(opened);
            state.compiled = Some(Compiled { options: options.clone(), desc, opened: Arc::clone(&opened) });
            Some(opened)
        });
        let opened = opened.ok_or_else(|| of_scene(py, &sink, self.strict))?;
        warn(py, &sink)?;
        Ok(opened)
    }
}

#[pymethods]
impl Scene {
    /// Reads a scene file. Nothing is compiled yet.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf, strict: bool, defines: Vec<(String, String)>) -> PyResult<Self> {
        let mut sink = Sink::default();
        let desc = py.detach(|| {
            let workers = Workers::new(None)?;
            let options = SceneOptions { strict, defines, ..SceneOptions::default() };
            Ok(render::load(&path, &options, &workers, &mut sink))
        });
        let desc = desc.map_err(|e| of_render(py, &e))?.ok_or_else(|| of_scene(py, &sink, strict))?;
        warn(py, &sink)?;
        Ok(Self { state: Mutex::new(State::new(desc, false)), strict })
    }

    /// The same scene seen by another camera (as JSON). `content_hash`, if given, is what this function's result on another
    /// machine says of itself.
    #[pyo3(signature = (camera, content_hash=None))]
    fn with_camera(&self, py: Python<'_>, camera: &str, content_hash: Option<&str>) -> PyResult<Self> {
        let wrong = |text: String| error(py, "SceneError", &text);
        let desc = self.desc(py);
        let mut desc = py.detach(|| (*desc).clone());
        desc.camera = serde_json::from_str(camera).map_err(|e| wrong(e.to_string()))?;
        let Some(hash) = content_hash else { return Ok(Self::from_desc(desc, self.strict)) };
        desc.content_hash = u64::from_str_radix(hash, 16).map_err(|e| wrong(e.to_string()))?;
        Ok(Self { state: Mutex::new(State::new(desc, false)), strict: self.strict })
    }

    /// A hash of all that was read.
    fn content_hash(&self, py: Python<'_>) -> String {
        format!("{:016x}", py.detach(|| self.hashed()).content_hash)
    }

    /// The description with the bytes of all its files.
    fn pack<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let packed = py.detach(|| formats::pack(&self.hashed()));
        let packed = packed.map_err(|e| error(py, "SceneError", &render::sentence(&e)))?;
        Ok(PyBytes::new(py, &packed))
    }

    /// What `pack` gave; the files go to a folder.
    #[staticmethod]
    fn unpack(py: Python<'_>, bytes: &[u8], folder: PathBuf) -> PyResult<Self> {
        let desc = py.detach(|| formats::unpack(bytes, &folder));
        let desc = desc.map_err(|e| error(py, "SceneError", &render::sentence(&e)))?;
        Ok(Self { state: Mutex::new(State::new(desc, false)), strict: false })
    }
}
