//! What all targets do: put the bytes into a folder of their own and read them.

use std::path::Path;

/// Reads `name` in a fresh folder that holds these files; what is said about them is of no interest, only that it ends.
pub fn read(name: &str, files: &[(&str, &[u8])]) {
    let Ok(folder) = tempfile::tempdir() else { return };
    for (name, bytes) in files {
        if std::fs::write(folder.path().join(Path::new(name)), bytes).is_err() {
            return;
        }
    }
    let mut sink = scene_desc::Sink::default();
    let _ = formats::load(&folder.path().join(name), &mut sink);
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
