//! Files that appear under their name only when they are complete.
//!
//! The contents go to a temporary file in the same folder, which is synced and renamed over the target. Whatever
//! happens before that, a full disk included, the target keeps its old contents or stays absent, and the
//! temporary file is removed. After a kill it can stay behind: its name begins with a dot and ends in `.tmp`.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// Why a file could not be written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The folder, the disk or the file refused.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// The file that was asked for.
        path: PathBuf,
        /// Cause.
        source: io::Error,
    },
    /// The contents cannot be stored in this format.
    #[error("cannot write {}: {reason}", path.display())]
    Encode {
        /// The file that was asked for.
        path: PathBuf,
        /// Cause.
        reason: String,
    },
}

impl OutputError {
    /// An [`OutputError::Io`] for this path, for use with `map_err`.
    pub fn io(path: &Path) -> impl Fn(io::Error) -> Self + '_ {
        |source| Self::Io { path: path.to_owned(), source }
    }

    /// An [`OutputError::Encode`].
    #[must_use]
    pub fn encode(path: &Path, reason: String) -> Self {
        Self::Encode { path: path.to_owned(), reason }
    }
}

/// A buffered file being written beside its target. Dropped without [`AtomicFile::commit`], it vanishes.
///
/// A target that exists and is not a regular file (`/dev/null`, a pipe) is written directly.
#[derive(Debug)]
pub struct AtomicFile {
    /// As given, for messages.
    path: PathBuf,
    /// Where the rename goes: `path` with symbolic links followed.
    target: PathBuf,
    /// `None` when writing directly.
    temporary: Option<PathBuf>,
    file: BufWriter<File>,
}

impl AtomicFile {
    /// Creates the temporary file.
    ///
    /// # Errors
    /// The folder does not exist or cannot be written to, or the path is a folder.
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        let fail = OutputError::io(path);
        let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        match fs::metadata(&target) {
            Ok(existing) if existing.is_dir() => return Err(fail(io::ErrorKind::IsADirectory.into())),
            Ok(existing) if !existing.is_file() => {
                let file = OpenOptions::new().write(true).open(&target).map_err(fail)?;
                return Ok(Self {
                    path: path.to_owned(),
                    target,
                    temporary: None,
                    file: BufWriter::new(file),
                });
            }
            _ => {}
        }
        let Some(name) = target.file_name() else { return Err(fail(io::ErrorKind::InvalidFilename.into())) };
        // The number tells apart files of one process, the process id those of several; another machine on the
        // same shared folder can still collide, which create_new notices.
        static NEXT: AtomicU32 = AtomicU32::new(0);
        for _ in 0..100 {
            let mut hidden = OsString::from(".");
            hidden.push(name);
            hidden.push(format!(".{}-{}.tmp", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed)));
            let temporary = target.with_file_name(hidden);
            match OpenOptions::new().write(true).create_new(true).open(&temporary) {
                Ok(file) => {
                    let (path, file) = (path.to_owned(), BufWriter::with_capacity(1 << 18, file));
                    return Ok(Self { path, target, temporary: Some(temporary), file });
                }
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                Err(e) => return Err(fail(e)),
            }
        }
        Err(fail(io::ErrorKind::AlreadyExists.into()))
    }

    /// The path that was asked for.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes everything to the disk and gives the file its name.
    ///
    /// # Errors
    /// The disk is full or fails; the temporary file is then removed and the target is as before.
    pub fn commit(mut self) -> Result<(), OutputError> {
        self.finish().map_err(OutputError::io(&self.path))
    }

    fn finish(&mut self) -> io::Result<()> {
        self.file.flush()?;
        let Some(temporary) = &self.temporary else { return Ok(()) };
        self.file.get_ref().sync_all()?;
        fs::rename(temporary, &self.target)?;
        self.temporary = None;
        // The rename itself reaches the disk with the folder; not every file system can sync one.
        if let Some(folder) = self.target.parent().filter(|f| !f.as_os_str().is_empty()) {
            let _ = File::open(folder).and_then(|f| f.sync_all());
        }
        Ok(())
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for AtomicFile {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        self.file.seek(position)
    }
}

impl Drop for AtomicFile {
    fn drop(&mut self) {
        if let Some(temporary) = self.temporary.take() {
            let _ = fs::remove_file(temporary);
        }
    }
}

/// Creates a file through `write`, which gets the open file; nothing stays behind if it fails.
///
/// # Errors
/// Those of `write`, and of [`AtomicFile::create`] and [`AtomicFile::commit`].
pub fn write_atomic(
    path: &Path,
    write: impl FnOnce(&mut AtomicFile) -> Result<(), OutputError>,
) -> Result<(), OutputError> {
    let mut file = AtomicFile::create(path)?;
    write(&mut file)?;
    file.commit()
}

/// Whether a file could be created at `path`, asked before hours of work are spent on its contents.
///
/// # Errors
/// What [`AtomicFile::create`] would say. The target itself is not touched.
pub fn check_writable(path: &Path) -> Result<(), OutputError> {
    AtomicFile::create(path).map(drop)
}
