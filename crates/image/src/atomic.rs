//! Files that are whole or not there.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::ImageError;

/// Writes a file so that its name always means a whole file, the old or the new one, also after a crash: into a
/// temporary file beside it, which is flushed to disk and then takes the name.
///
/// # Errors
/// [`ImageError::Io`]; then the old file is as it was and the temporary one is gone.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    let (mut file, temporary) = create_beside(path).map_err(|source| ImageError::Io {
        action: "cannot create a file beside",
        path: path.into(),
        source,
    })?;
    let written = file.write_all(bytes).and_then(|()| file.sync_all());
    drop(file);
    let renamed = written.and_then(|()| fs::rename(&temporary, path));
    if let Err(source) = renamed {
        // Nothing is lost if this fails as well: the error that matters is the first one.
        let _ = fs::remove_file(&temporary);
        return Err(ImageError::Io { action: "cannot write", path: path.into(), source });
    }
    sync_folder(path);
    Ok(())
}

/// A new file in the same folder (thus on the same file system), hidden, of a name that nobody else has.
fn create_beside(path: &Path) -> io::Result<(File, PathBuf)> {
    let name = path.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "no file name"))?;
    let process = std::process::id();
    let mut attempt = 0_u32;
    loop {
        let mut hidden = std::ffi::OsString::from(".");
        hidden.push(name);
        hidden.push(format!(".{process}-{attempt}.tmp"));
        let temporary = path.with_file_name(hidden);
        match OpenOptions::new().write(true).create_new(true).open(&temporary) {
            Ok(file) => return Ok((file, temporary)),
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists && attempt < 1000 => attempt += 1,
            Err(e) => return Err(e),
        }
    }
}

/// Makes the new name itself survive a power cut, where the system knows how.
fn sync_folder(path: &Path) {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if let Ok(folder) = File::open(folder) {
        // Some file systems refuse: the content is safe all the same.
        let _ = folder.sync_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_and_nothing_is_left_over() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        write_atomically(&path, b"old").unwrap();
        write_atomically(&path, b"newer").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"newer");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_failure_leaves_the_old_file_and_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let occupied = folder.path().join("is-a-folder");
        fs::create_dir(&occupied).unwrap();
        fs::write(occupied.join("inside"), b"x").unwrap();
        let error = write_atomically(&occupied, b"bytes").unwrap_err();
        assert!(error.to_string().starts_with("cannot write"), "{error}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(write_atomically(&folder.path().join("no/such/folder.png"), b"").is_err());
        assert!(write_atomically(Path::new("/"), b"").is_err());
    }
}
