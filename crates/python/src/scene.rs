//! A scene: its description, and what was compiled of it last.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use math::Bounds2i;
use pyo3::prelude::*;
use render::{Opened, SceneOptions, Workers};
use scene_desc::{SceneDesc, Sink};

use crate::errors::{of_render, of_scene, warn};
use crate::run::workers;

/// A scene. Compiled when it is first needed, and again when something changed.
#[pyclass(frozen, module = "steradian._native")]
pub(crate) struct Scene {
    state: Mutex<State>,
    strict: bool,
}

struct State {
    desc: Arc<SceneDesc>,
    compiled: Option<(Options, Arc<Opened>)>,
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

impl Scene {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The description as it is now.
    pub(crate) fn desc(&self, py: Python<'_>) -> Arc<SceneDesc> {
        py.detach(|| Arc::clone(&self.lock().desc))
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
            if let Some((of, opened)) = &state.compiled
                && of == options
            {
                return Some(Arc::clone(opened));
            }
            let scene_options = options.to_scene_options(self.strict);
            let desc = (*state.desc).clone();
            let opened = Arc::new(render::compile(desc, &scene_options, &workers, &mut sink)?);
            state.compiled = Some((options.clone(), Arc::clone(&opened)));
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
        Ok(Self { state: Mutex::new(State { desc: Arc::new(desc), compiled: None }), strict })
    }

    /// A hash of all that was read.
    fn content_hash(&self, py: Python<'_>) -> String {
        format!("{:016x}", self.desc(py).content_hash)
    }
}
