//! `sparing convert`: any scene as one pbrt file, with meshes and pictures in a folder beside it.

use super::Usage;
use super::render::load;
use super::sandbox::FileArguments;
use crate::session::console::print;
use anyhow::Context;
use clap::Args;
use sparing_image::atomic::{OutputError, write_atomic};
use sparing_scene::description::ImageSource;
use sparing_scene::{PbrtFiles, PbrtOptions, SceneDescription, pbrt_files, write_ply};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Arguments of `sparing convert`.
#[derive(Debug, Args)]
pub(super) struct ConvertArguments {
    /// A scene (.pbrt, .gltf, .glb, .obj, .ply).
    scene: PathBuf,
    /// The pbrt file to write; meshes and pictures go into the folder NAME-files beside it.
    #[arg(short, long, value_name = "FILE.pbrt")]
    output: PathBuf,
    /// Copy pictures that are files, too, instead of naming them where they are.
    #[arg(long)]
    copy_pictures: bool,
    /// Overwrite files that exist.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    files: FileArguments,
}

pub(super) fn run(a: &ConvertArguments) -> anyhow::Result<ExitCode> {
    let output = &a.output;
    let (Some(stem), true) =
        (output.file_stem(), output.extension().is_some_and(|e| e.eq_ignore_ascii_case("pbrt")))
    else {
        return Err(Usage::error(format!("the output {} must end in .pbrt", output.display())));
    };
    let mut folder = stem.to_os_string();
    folder.push("-files");
    let beside = output.with_file_name(&folder);
    for path in [output, &beside] {
        if path.exists() && !a.force {
            anyhow::bail!("{} exists already: --force overwrites it", path.display());
        }
    }
    let scene = load(&a.scene, &a.files)?;
    let options = PbrtOptions { folder: Some(folder.into()), copy_pictures: a.copy_pictures };
    let files = pbrt_files(&scene, output, &options).map_err(|error| anyhow::anyhow!("{error}"))?;
    let new = !beside.exists();
    let result = write(&files, output, &beside);
    if result.is_err() && new {
        // Nothing was there before, and nothing stays.
        let _ = std::fs::remove_dir_all(&beside);
    }
    result?;
    print(summary(&scene, &files, output))?;
    Ok(ExitCode::SUCCESS)
}

/// Every file appears when it is complete, the scene last.
fn write(files: &PbrtFiles<'_>, output: &Path, beside: &Path) -> anyhow::Result<()> {
    if !(files.meshes.is_empty() && files.pictures.is_empty() || beside.is_dir()) {
        std::fs::create_dir(beside)
            .with_context(|| format!("cannot make the folder {}", beside.display()))?;
    }
    for (name, mesh) in &files.meshes {
        let path = output.with_file_name("").join(name);
        write_atomic(&path, |file| write_ply(mesh, file).map_err(OutputError::io(&path)))?;
    }
    for (name, source) in &files.pictures {
        let path = output.with_file_name("").join(name);
        match source {
            ImageSource::Bytes { bytes, .. } => {
                write_atomic(&path, |file| file.write_all(bytes).map_err(OutputError::io(&path)))?;
            }
            ImageSource::File(from) => {
                let bytes = std::fs::read(from).with_context(|| format!("cannot read {}", from.display()))?;
                write_atomic(&path, |file| file.write_all(&bytes).map_err(OutputError::io(&path)))?;
            }
        }
    }
    write_atomic(output, |file| file.write_all(files.text.as_bytes()).map_err(OutputError::io(output)))?;
    Ok(())
}

fn summary(scene: &SceneDescription, files: &PbrtFiles<'_>, output: &Path) -> String {
    format!(
        "{}: {} triangles, {} meshes, {} pictures written",
        output.display(),
        scene.triangle_count(),
        files.meshes.len(),
        files.pictures.len()
    )
}
