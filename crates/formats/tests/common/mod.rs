//! Helpers of the readers' tests.
#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "helpers of tests; each uses its own part"
)]

use std::fs;
use std::path::{Path, PathBuf};

use scene_desc::{SceneDesc, Sink};
use tempfile::TempDir;

/// The folder of the shared scenes, where there is one: beside the workspace.
pub(crate) fn shared_scenes() -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let found = ["../shared/scenes", "../../shared/scenes"].map(|p| root.join(p));
    let found = found.into_iter().find(|p| p.is_dir());
    if found.is_none() {
        println!("skipped: there is no ../shared/scenes beside the workspace");
    }
    found
}

/// A scene and its files, in a folder of their own that lives as long as this.
pub(crate) struct Folder {
    pub(crate) dir: TempDir,
}

impl Folder {
    pub(crate) fn new() -> Self {
        Self { dir: TempDir::new().unwrap() }
    }

    pub(crate) fn with(self, name: &str, bytes: impl AsRef<[u8]>) -> Self {
        fs::write(self.dir.path().join(name), bytes).unwrap();
        self
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Loads a file; gives the scene and all messages, with paths relative to the folder.
    pub(crate) fn load(&self, name: &str) -> (Option<SceneDesc>, String) {
        let mut sink = Sink::default();
        let scene = steradian_formats::load(&self.path(name), &mut sink);
        assert_eq!(scene.is_none(), sink.has_errors(), "no scene if and only if there are errors");
        let real = self.dir.path().canonicalize().unwrap();
        let text = sink.render();
        let text = text.replace(&format!("{}/", self.dir.path().display()), "");
        (scene, text.replace(&format!("{}/", real.display()), ""))
    }
}

/// Loads a scene from text.
pub(crate) fn load(text: impl AsRef<[u8]>) -> (Option<SceneDesc>, String) {
    Folder::new().with("a.pbrt", text).load("a.pbrt")
}

/// Loads a world from text; there must be no message at all.
pub(crate) fn world(text: &str) -> SceneDesc {
    let (scene, messages) = load(format!("WorldBegin\n{text}"));
    assert_eq!(messages, "");
    scene.unwrap()
}

/// The messages of a world.
pub(crate) fn complaints(text: &str) -> String {
    load(format!("WorldBegin\n{text}")).1
}
