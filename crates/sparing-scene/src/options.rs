//! Limits that keep a hostile or broken file from eating the machine.

use crate::error::{ErrorKind, SceneError};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Limits of loading; exceeding one is an error that names it.
#[derive(Clone, Debug)]
pub struct LoadOptions {
    /// Folders that the files of a scene may be in, with all below them; [`crate::load_with`] adds that of the scene
    /// itself. `None`, the default: anywhere, for scenes that are trusted.
    pub folders: Option<Vec<PathBuf>>,
    /// Bytes of one text file.
    pub max_file_bytes: u64,
    /// Bytes that one byte of a compressed file may become.
    pub max_expansion: u64,
    /// Bytes of all files of a scene together; an included file counts each time.
    pub max_total_bytes: u64,
    /// Files included from within each other.
    pub max_include_depth: u64,
    /// Nested `AttributeBegin`, `ObjectBegin` and the like.
    pub max_nesting: u64,
    /// Parameters of one directive.
    pub max_params: u64,
    /// Values of one parameter.
    pub max_values: u64,
    /// Triangles and quads of the whole scene, before instancing.
    pub max_triangles: u64,
    /// Vertices of the whole scene, before instancing.
    pub max_vertices: u64,
    /// Shapes, instances, lights, materials and textures together.
    pub max_entities: u64,
    /// Warnings that are kept; the rest is counted.
    pub max_warnings: usize,
    /// Counts of what is loaded, to be looked at meanwhile.
    pub progress: Option<Arc<LoadProgress>>,
}

/// How far loading has come.
#[derive(Debug, Default)]
pub struct LoadProgress {
    files: AtomicU64,
    bytes: AtomicU64,
    triangles: AtomicU64,
}

impl LoadProgress {
    /// Files opened so far, their bytes, and triangles read (a quad counts as one).
    #[must_use]
    pub fn counts(&self) -> [u64; 3] {
        [&self.files, &self.bytes, &self.triangles].map(|count| count.load(Ordering::Relaxed))
    }
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self {
            folders: None,
            max_file_bytes: 4 << 30,
            max_expansion: 100,
            max_total_bytes: 16 << 30,
            max_include_depth: 32,
            max_nesting: 1000,
            max_params: 1000,
            max_values: 1 << 30,
            max_triangles: 1 << 30,
            max_vertices: 1 << 30,
            max_entities: 50_000_000,
            max_warnings: 200,
            progress: None,
        }
    }
}

impl LoadOptions {
    /// These options, with one more folder that files may be in.
    #[must_use]
    pub(crate) fn with_folder(&self, folder: &Path) -> Self {
        let mut options = self.clone();
        if let Some(folders) = &mut options.folders {
            // The folder of `scene.pbrt` is the empty path.
            let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
            folders.push(folder.to_owned());
        }
        options
    }

    pub(crate) fn count_file(&self, bytes: u64) {
        if let Some(progress) = &self.progress {
            progress.files.fetch_add(1, Ordering::Relaxed);
            progress.bytes.fetch_add(bytes, Ordering::Relaxed);
        }
    }

    pub(crate) fn count_triangles(&self, triangles: u64) {
        if let Some(progress) = &self.progress {
            progress.triangles.fetch_add(triangles, Ordering::Relaxed);
        }
    }

    pub(crate) fn exceeded(&self, name: &str, limit: u64, found: u64) -> SceneError {
        SceneError::new(ErrorKind::Limit, format!("the limit {name} = {limit} is exceeded by {found}"))
            .help(format!("raise LoadOptions::{name} if this is meant"))
    }
}
