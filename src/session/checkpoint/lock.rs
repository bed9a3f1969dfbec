//! One process a checkpoint.

use anyhow::{Context, bail};
use std::fs::{File, OpenOptions, TryLockError};
use std::path::{Path, PathBuf};

/// Keeps other processes from a file as long as it lives: a lock on a file `NAME.lock` beside it, which vanishes with it. The
/// system releases it when the process dies, however it dies.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    _file: File,
}

impl Lock {
    /// Takes the lock of a file.
    ///
    /// # Errors
    /// Another process has it, or the folder cannot be written to.
    pub fn take(of: &Path) -> anyhow::Result<Self> {
        let mut name = of.as_os_str().to_owned();
        name.push(".lock");
        let path = PathBuf::from(name);
        loop {
            let file = OpenOptions::new().create(true).append(true).open(&path);
            let file = file.with_context(|| format!("cannot write {}", path.display()))?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    bail!("another process renders with the checkpoint {}", of.display())
                }
                Err(TryLockError::Error(e)) => {
                    return Err(e).with_context(|| format!("cannot lock {}", path.display()));
                }
            }
            // The process that had it may have removed the file in between: then the lock is of a file without a name.
            if same_file(&file, &path) {
                return Ok(Self { path, _file: file });
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // Left behind it does no harm.
        let _ = std::fs::remove_file(&self.path);
    }
}

#[cfg(unix)]
fn same_file(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let id = |m: &std::fs::Metadata| (m.dev(), m.ino());
    matches!((file.metadata(), std::fs::metadata(path)), (Ok(a), Ok(b)) if id(&a) == id(&b))
}

#[cfg(not(unix))]
fn same_file(_file: &File, _path: &Path) -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_is_refused_until_the_first_is_gone() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("a.exr");
        let first = Lock::take(&file).expect("free");
        let error = Lock::take(&file).expect_err("taken").to_string();
        assert!(error.contains("another process"), "{error}");
        drop(first);
        drop(Lock::take(&file).expect("free again"));
        assert_eq!(std::fs::read_dir(folder.path()).expect("it is there").count(), 0);
        assert!(Lock::take(&folder.path().join("none/a.exr")).is_err());
    }
}
