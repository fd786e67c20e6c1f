//! Scenes of `tests/scenes` for the tests of this crate's insides.

use scene::{CompileOptions, Scene, compile};
use scene_desc::Sink;

/// The scene of this name.
pub(crate) fn load(name: &str, spectral: bool) -> Scene {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/scenes");
    let mut sink = Sink::default();
    let desc = formats::load(&path.join(format!("{name}.pbrt")), &mut sink);
    let options = CompileOptions { spectral, ..CompileOptions::default() };
    let scene = desc.and_then(|d| compile(&d, &options, &mut sink));
    scene.unwrap_or_else(|| panic!("{}", sink.render()))
}
