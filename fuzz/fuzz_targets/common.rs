//! What all targets do: put the bytes into a folder of their own and read them.

use std::path::Path;

/// Reads `name` in a fresh folder that holds these files; what is said about them is of no interest, only that it ends.
#[allow(dead_code, reason = "not every target needs each")]
pub fn read(name: &str, files: &[(&str, &[u8])]) {
    let _ = load(name, files);
}

/// The same, and compiles what was read.
#[allow(dead_code, reason = "not every target needs each")]
pub fn compile(name: &str, files: &[(&str, &[u8])]) {
    if let Some((desc, _folder)) = load(name, files) {
        let mut sink = scene_desc::Sink::default();
        let _ = scene::compile(&desc, &scene::CompileOptions::default(), &mut sink);
    }
}

fn load(name: &str, files: &[(&str, &[u8])]) -> Option<(scene_desc::SceneDesc, tempfile::TempDir)> {
    let folder = tempfile::tempdir().ok()?;
    for (name, bytes) in files {
        std::fs::write(folder.path().join(Path::new(name)), bytes).ok()?;
    }
    let mut sink = scene_desc::Sink::default();
    let desc = formats::load(&folder.path().join(name), &mut sink)?;
    Some((desc, folder))
}

/// A target for libFuzzer, or without it a program that runs it once.
#[macro_export]
macro_rules! target {
    ($run:expr) => {
        #[cfg(feature = "libfuzzer")]
        libfuzzer_sys::fuzz_target!(|bytes: &[u8]| { ($run)(bytes) });

        #[cfg(not(feature = "libfuzzer"))]
        fn main() {
            let path = std::env::args().nth(1).expect("the file of an input");
            ($run)(&std::fs::read(path).expect("readable"));
        }
    };
}
