//! Files that appear under their name only when they are complete.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use crate::error::{Result, SvmError};

/// Writes through `write` to a temporary file in the same folder, then renames it. If anything fails, the
/// target keeps its old contents or stays absent. A target that exists and is no regular file (`/dev/null`, a
/// pipe) is written to directly.
pub(crate) fn write_file(path: &Path, write: impl FnOnce(&mut dyn Write) -> Result<()>) -> Result<()> {
    let fail = SvmError::writing(path);
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    match fs::metadata(&target) {
        Ok(existing) if existing.is_dir() => return Err(fail(io::ErrorKind::IsADirectory.into())),
        Ok(existing) if !existing.is_file() => {
            let mut file = BufWriter::new(OpenOptions::new().write(true).open(&target).map_err(&fail)?);
            write(&mut file)?;
            return file.flush().map_err(&fail);
        }
        _ => {}
    }
    let name = target.file_name().ok_or_else(|| fail(io::ErrorKind::InvalidFilename.into()))?;
    let (file, temporary) = temporary_file(&target, name).map_err(&fail)?;
    let mut file = BufWriter::with_capacity(1 << 18, file);
    let result = write(&mut file).and_then(|()| {
        file.flush().and_then(|()| file.get_ref().sync_all()).map_err(&fail)?;
        fs::rename(&temporary, &target).map_err(&fail)
    });
    if result.is_err() {
        let _ = fs::remove_file(&temporary);
    }
    result
}

/// A new file beside the target. What a killed process left behind under the same name is passed over.
fn temporary_file(target: &Path, name: &OsStr) -> io::Result<(File, PathBuf)> {
    // The number tells apart files of one process, the process id those of several.
    static NEXT: AtomicU32 = AtomicU32::new(0);
    for _ in 0..100 {
        let mut hidden = OsString::from(".");
        hidden.push(name);
        hidden.push(format!(".{}-{}.tmp", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed)));
        let path = target.with_file_name(hidden);
        match OpenOptions::new().write(true).create_new(true).open(&path) {
            Ok(file) => return Ok((file, path)),
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
            Err(e) => return Err(e),
        }
    }
    Err(io::ErrorKind::AlreadyExists.into())
}
