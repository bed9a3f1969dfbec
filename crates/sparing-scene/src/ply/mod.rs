//! The Stanford polygon format, PLY 1.0: text and binary of either byte order, plain or gzip'd.
//!
//! Of the element `vertex` x y z, nx ny nz, u v (also s t, texture_u texture_v) and red green blue alpha are used; of
//! `face` the list `vertex_indices` or `vertex_index`. All else is passed over. Files are read a piece at a time, and
//! a number of elements is believed only if so many fit into the file.

mod faces;
mod header;
mod input;
#[cfg(test)]
mod tests;
mod values;
mod vertices;
mod write;

pub(crate) use vertices::srgb_to_linear;
pub use write::write_ply;

use crate::description::{SceneDescription, TriangleMesh};
use crate::error::{ErrorKind, SceneError};
use crate::model;
use crate::options::LoadOptions;
use crate::warnings::Warnings;
use header::Element;
use input::Input;
use std::path::Path;
use values::Values;

/// Reads a mesh. Its triangles are as in the file, also those without an area.
pub(crate) fn load(
    path: &Path,
    options: &LoadOptions,
    warnings: &mut Warnings,
) -> Result<TriangleMesh, SceneError> {
    read(path, options, warnings).map_err(|error| error.in_file(path))
}

/// Loads a PLY file as a scene of its own.
pub(crate) fn load_scene(path: &Path, options: &LoadOptions) -> Result<SceneDescription, SceneError> {
    let mut warnings = Warnings::new(options.max_warnings);
    let mesh = load(path, options, &mut warnings)?;
    let mut scene = SceneDescription { name: path.display().to_string(), ..SceneDescription::default() };
    if let Some(mesh) = model::without_slivers(mesh, &mut warnings, path) {
        let material = match mesh.colors {
            Some(_) => model::add_colored_material(&mut scene),
            None => model::add_default_material(&mut scene),
        };
        model::add_shape(&mut scene, mesh, material);
    }
    model::finish(scene, warnings, path)
}

fn read(path: &Path, options: &LoadOptions, warnings: &mut Warnings) -> Result<TriangleMesh, SceneError> {
    let mut input = Input::open(path, options)?;
    let name = path.display().to_string();
    let header = header::read(&mut input, &name)?;
    let find = |name: &str| header.elements.iter().position(|element| element.name == name);
    let (Some(vertex), Some(face)) = (find("vertex"), find("face")) else {
        let message = "a mesh needs the elements `vertex` and `face`";
        return Err(SceneError::new(ErrorKind::Unsupported, message));
    };
    if face < vertex {
        return Err(SceneError::new(ErrorKind::Unsupported, "the faces come before the vertices"));
    }
    let mut values = Values::new(input, header.format, &name, header.lines);
    let mut mesh = TriangleMesh::default();
    for (i, element) in header.elements.iter().enumerate().take(face + 1) {
        check_count(element, element.least_bytes(header.format), &values)?;
        if i == vertex {
            let most = options.max_vertices.min(u64::from(u32::MAX));
            if element.count > most {
                return Err(options.exceeded("max_vertices", most, element.count));
            }
            vertices::read(&mut values, element, &mut mesh)?;
        } else if i == face {
            if element.count > options.max_triangles {
                return Err(options.exceeded("max_triangles", options.max_triangles, element.count));
            }
            faces::read(&mut values, element, &mut mesh, options, warnings)?;
        } else {
            for _ in 0..if element.properties.is_empty() { 0 } else { element.count } {
                element.properties.iter().try_for_each(|property| values.skip(property))?;
            }
        }
    }
    options.count_triangles(mesh.indices.len() as u64);
    Ok(mesh)
}

/// That so many elements can be in the rest of the file.
fn check_count(element: &Element, least: u64, values: &Values) -> Result<(), SceneError> {
    let rest = values.rest();
    if element.count.checked_mul(least).is_none_or(|bytes| bytes > rest) {
        let name: String = element.name.chars().take(40).collect();
        let message = format!("{} elements `{name}` do not fit into the file", element.count);
        let help = "a compressed file is taken to become at most LoadOptions::max_expansion times as large";
        let error = SceneError::new(ErrorKind::Value, message);
        return Err(error.maybe_help(values.is_compressed().then(|| help.to_owned())));
    }
    Ok(())
}
