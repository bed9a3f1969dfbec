//! Which files a scene may name.

use crate::session::loading::watched;
use clap::Args;
use sparing_scene::{LoadOptions, LoadProgress, SceneDescription};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Options of the commands that load a scene.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct FileArguments {
    /// Refuse every file that the scene names outside of its own folder. That is the default for scenes that are not
    /// below the current folder; those may name files below the current folder, too.
    #[arg(long, conflicts_with = "no_sandbox")]
    sandbox: bool,
    /// Also allow files below this folder; may be given several times.
    #[arg(long, value_name = "DIR", conflicts_with = "no_sandbox")]
    allow_path: Vec<PathBuf>,
    /// Let the scene name files anywhere.
    #[arg(long)]
    no_sandbox: bool,
    /// Whether nothing is said while a large scene loads.
    #[arg(skip)]
    quiet: bool,
}

impl FileArguments {
    /// The same rules, saying nothing while a large scene loads.
    pub(super) fn with_quiet(self, quiet: bool) -> Self {
        Self { quiet, ..self }
    }

    /// Loads a scene under these rules.
    pub(super) fn load(&self, scene: &Path) -> Result<SceneDescription, sparing_scene::SceneError> {
        let progress = Arc::new(LoadProgress::default());
        let shown = (!self.quiet).then(|| Arc::clone(&progress));
        let options = LoadOptions { progress: shown, ..self.options(scene) };
        let load = || sparing_scene::load_with(scene, &options);
        if self.quiet { load() } else { watched(&progress, load) }
    }

    fn options(&self, scene: &Path) -> LoadOptions {
        let mut folders = self.allow_path.clone();
        let here = std::env::current_dir().and_then(|folder| folder.canonicalize());
        if let (Ok(here), Ok(scene)) = (here, scene.canonicalize())
            && !self.sandbox
            && scene.starts_with(&here)
        {
            folders.push(here);
        }
        LoadOptions { folders: (!self.no_sandbox).then_some(folders), ..LoadOptions::default() }
    }
}
