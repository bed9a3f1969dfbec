//! Scene descriptions and their loaders.
//!
//! A loader turns a file into a [`SceneDescription`]: plain data, no Embree, no GPU, nothing decoded that
//! the renderer may not need. All loaders share one error type with file, line and column.
//!
//! ```no_run
//! let scene = sparing_scene::load("scenes/cornell-box.pbrt".as_ref())?;
//! println!("{} triangles", scene.triangle_count());
//! # Ok::<(), sparing_scene::SceneError>(())
//! ```

pub mod description;
mod error;
pub mod generate;
mod gltf;
mod images;
mod model;
mod obj;
mod options;
mod pbrt;
mod ply;
mod polygon;
mod source;
mod spectrum;
mod warnings;

pub use description::SceneDescription;
pub use error::{ErrorKind, SceneError};
pub use options::{LoadOptions, LoadProgress};
pub use pbrt::{PbrtFiles, PbrtOptions};
pub use ply::write_ply;

use std::path::Path;

/// Loads a scene, choosing the format by the file name: `.pbrt`, `.gltf`, `.glb`, `.obj`, `.ply` or
/// `.ply.gz`.
///
/// # Errors
/// When the file is missing, of another format, broken, or beyond the default limits.
pub fn load(path: &Path) -> Result<SceneDescription, SceneError> {
    load_with(path, &LoadOptions::default())
}

/// [`load`] with limits of one's own.
///
/// # Errors
/// As [`load`].
pub fn load_with(path: &Path, options: &LoadOptions) -> Result<SceneDescription, SceneError> {
    let options = &options.with_folder(path.parent().unwrap_or(Path::new("")));
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let stem = path.file_stem().map(Path::new).and_then(Path::extension);
    let compressed = extension == "gz" && stem.is_some_and(|inner| inner.eq_ignore_ascii_case("pbrt"));
    let scene = match extension.as_str() {
        "gz" if compressed => pbrt::load(path, options)?,
        "pbrt" => pbrt::load(path, options)?,
        "obj" => obj::load(path, options)?,
        "gltf" | "glb" => gltf::load(path, options)?,
        "ply" => ply::load_scene(path, options)?,
        "gz" if path.file_stem().is_some_and(|stem| is_ply(stem.as_ref())) => ply::load_scene(path, options)?,
        "" => {
            let error = SceneError::new(ErrorKind::Format, "a file name without extension says no format");
            return Err(error.in_file(path).help(SUPPORTED));
        }
        other => {
            let error =
                SceneError::new(ErrorKind::Format, format!("scene files of type `.{other}` cannot be read"));
            return Err(error.in_file(path).help(SUPPORTED));
        }
    };
    check_pictures(&scene, options).map_err(|error| error.in_file(path))?;
    scene.validate().map_err(|error| error.in_file(path))?;
    Ok(scene)
}

/// Pictures are decoded later, by the renderer: here they are held to the folders that may be read.
fn check_pictures(scene: &SceneDescription, options: &LoadOptions) -> Result<(), SceneError> {
    scene.images.iter().try_for_each(|image| match &image.source {
        description::ImageSource::File(path) => source::check_folder(path, options),
        description::ImageSource::Bytes { .. } => Ok(()),
    })
}

fn is_ply(name: &Path) -> bool {
    name.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("ply"))
}

/// Loads pbrt text that is not in a file; `base` is the folder that file names in it are relative to.
///
/// # Errors
/// As [`load`].
pub fn load_pbrt_text(
    text: &[u8],
    base: &Path,
    options: &LoadOptions,
) -> Result<SceneDescription, SceneError> {
    let options = &options.with_folder(base);
    let scene = pbrt::load_text("text", text, base, options)?;
    scene.validate()?;
    Ok(scene)
}

/// Writes a scene as a pbrt file; pictures that the scene carries become files beside it, named after it. What is
/// loaded from there renders as the scene does. Numbers are written so that they read back the same.
///
/// # Errors
/// When the scene is not [valid](SceneDescription::validate), a file cannot be written, or the scene has what pbrt
/// text cannot say: emission inside an object, a picture of the surroundings with a colour factor, colours of vertices
/// (which [`pbrt_files`] puts into PLY files).
pub fn save_pbrt(scene: &SceneDescription, path: &Path) -> Result<(), SceneError> {
    pbrt::save(scene, path).map_err(|error| error.in_file(path))
}

/// What [`save_pbrt`] writes, as data, with meshes and pictures in files of their own where `options` say so. `path` is
/// where the text will be.
///
/// # Errors
/// As [`save_pbrt`], but for writing.
pub fn pbrt_files<'a>(
    scene: &'a SceneDescription,
    path: &Path,
    options: &PbrtOptions,
) -> Result<PbrtFiles<'a>, SceneError> {
    pbrt::files(scene, path, options).map_err(|error| error.in_file(path))
}

const SUPPORTED: &str = "supported are .pbrt, .gltf, .glb, .obj and .ply";
