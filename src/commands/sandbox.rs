//! Which files a scene may name.

use clap::Args;
use sparing_scene::{LoadOptions, SceneDescription};
use std::path::{Path, PathBuf};

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
}

impl FileArguments {
    /// Loads a scene under these rules.
    pub(super) fn load(&self, scene: &Path) -> Result<SceneDescription, sparing_scene::SceneError> {
        sparing_scene::load_with(scene, &self.options(scene))
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
