//! Wavefront OBJ with MTL materials.
//!
//! Faces become triangles, one mesh for each group and material. Where a group lacks normals at any of its vertices
//! its smoothing groups say what is smooth; without them it is shaded flat. An OBJ file alone has no camera and perhaps no light: see [`crate::model`].

mod lines;
mod mtl;
mod parts;
mod statements;
#[cfg(test)]
mod tests;

pub(crate) use mtl::add_materials;

use crate::description::{Geometry, SceneDescription, Shape, TriangleMesh};
use crate::error::SceneError;
use crate::images::ImageTable;
use crate::model;
use crate::options::LoadOptions;
use crate::source::SourceFile;
use crate::warnings::Warnings;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

/// Triangles of one group and material.
pub(crate) struct Part {
    pub mesh: TriangleMesh,
    pub material: Option<usize>,
}

/// An OBJ file with its materials.
pub(crate) struct ObjFile {
    pub parts: Vec<Part>,
    materials: Vec<tobj::Material>,
    /// Folder that texture names are relative to.
    folder: PathBuf,
}

/// Loads an OBJ file as a scene of its own.
pub(crate) fn load(path: &Path, options: &LoadOptions) -> Result<SceneDescription, SceneError> {
    let mut warnings = Warnings::new(options.max_warnings);
    let file = read(path, options, &mut warnings)?;
    let mut scene = SceneDescription { name: path.display().to_string(), ..SceneDescription::default() };
    let materials = add_materials(&file, &mut scene, &mut ImageTable::default(), &mut warnings);
    let (mut default, mut colored) = (None, None);
    for part in file.parts {
        let own = part.material.and_then(|index| materials.get(index));
        let material = match own {
            Some(own) => own.material,
            None if part.mesh.colors.is_some() => {
                *colored.get_or_insert_with(|| model::add_colored_material(&mut scene))
            }
            None => *default.get_or_insert_with(|| model::add_default_material(&mut scene)),
        };
        let Some(mesh) = model::without_slivers(part.mesh, &mut warnings, path) else { continue };
        scene.shapes.push(Shape {
            geometry: Geometry::Triangles(mesh),
            material,
            emission: own.and_then(|own| own.emission.clone()),
            alpha: own.and_then(|own| own.alpha),
            alpha_cutoff: None,
            reverse_orientation: false,
        });
    }
    model::finish(scene, warnings, path)
}

/// Reads an OBJ file and the MTL files it names.
pub(crate) fn read(
    path: &Path,
    options: &LoadOptions,
    warnings: &mut Warnings,
) -> Result<ObjFile, SceneError> {
    let statements = statements::read(path, options)?;
    let folder = path.parent().map(Path::to_owned).unwrap_or_default();
    let mut materials: Vec<tobj::Material> = Vec::new();
    let mut by_name: HashMap<String, usize> = HashMap::new();
    let mut read = HashSet::new();
    for name in &statements.libraries {
        for library in mtl::library_paths(&folder, name) {
            if !read.insert(library.clone()) {
                continue;
            }
            match mtl::read_library(&library, options, warnings) {
                Ok(more) => {
                    for material in more {
                        by_name.insert(material.name.clone(), materials.len());
                        materials.push(material);
                    }
                }
                Err(error) => warnings.add(format!("{error}: its materials are grey")),
            }
        }
    }
    for (name, (line, text)) in &statements.used_materials {
        if !by_name.contains_key(name) {
            let span = SourceFile::line(&path.display().to_string(), *line, text.as_bytes());
            warnings.at(&span, format!("there is no material `{name}`: grey instead"));
        }
    }
    let place = path.display();
    if statements.skipped > 0 {
        let count = statements.skipped;
        warnings.add(format!("{place}: {count} faces with fewer than three corners are left out"));
    }
    if statements.fanned > 0 {
        let count = statements.fanned;
        warnings.add(format!(
            "{place}: {count} faces that are not convex have too many corners: they become fans"
        ));
    }
    let mut parts = Vec::with_capacity(statements.parts.len());
    for part in statements.parts {
        let material = part.material.as_ref().and_then(|name| by_name.get(name)).copied();
        let mesh = part.finish(&statements.vertices, path, warnings);
        parts.push(Part { mesh, material });
    }
    Ok(ObjFile { parts, materials, folder })
}
