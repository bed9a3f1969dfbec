//! Wavefront OBJ with MTL materials, read through `tobj`.
//!
//! Faces become triangles (fans), one mesh for each group and material. Where a group lacks normals at any of
//! its vertices it is shaded flat. An OBJ file alone has no camera and perhaps no light: see [`crate::model`].

mod lines;
mod mtl;
#[cfg(test)]
mod tests;

pub(crate) use mtl::add_materials;

use crate::description::{Geometry, SceneDescription, Shape, TriangleMesh};
use crate::error::{ErrorKind, SceneError};
use crate::images::ImageTable;
use crate::model;
use crate::options::LoadOptions;
use crate::source::{self, SourceFile};
use crate::warnings::Warnings;
use lines::LineReader;
use std::cell::RefCell;
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
    let mut default = None;
    for part in file.parts {
        let own = part.material.and_then(|index| materials.get(index));
        let material = match own {
            Some(own) => own.material,
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
    let (file, _) = source::open(path, options)?;
    let folder = path.parent().map(Path::to_owned).unwrap_or_default();
    let mut reader = LineReader::new(file, path);
    let settings =
        tobj::LoadOptions { single_index: true, triangulate: true, ignore_points: true, ignore_lines: true };
    let once = RefCell::new((HashSet::new(), &mut *warnings));
    let loaded = tobj::load_obj_buf(&mut reader, &settings, |name| {
        let mut all = (Vec::new(), HashMap::default());
        let (libraries, warnings) = &mut *once.borrow_mut();
        for library in mtl::library_paths(&folder, name) {
            if !libraries.insert(library.clone()) {
                continue;
            }
            match mtl::read_library(&library, options, warnings) {
                Ok(materials) => {
                    for material in materials {
                        all.1.insert(material.name.clone(), all.0.len());
                        all.0.push(material);
                    }
                }
                Err(error) => warnings.add(format!("{error}: its materials are grey")),
            }
        }
        Ok(all)
    });
    if let Some(error) = reader.error.take() {
        return Err(error);
    }
    let (models, materials) = loaded.map_err(|error| reader.explain(error))?;
    let materials = materials.map_err(|error| reader.explain(error))?;
    for (name, (line, text)) in &reader.used_materials {
        if !materials.iter().any(|material| material.name == *name) {
            let span = SourceFile::line(&path.display().to_string(), *line, text.as_bytes());
            warnings.at(&span, format!("there is no material `{name}`: grey instead"));
        }
    }
    let mut parts = Vec::with_capacity(models.len());
    let mut triangles = 0;
    for model in models {
        let material = model.mesh.material_id;
        let mesh = convert(&model.mesh, &model.name, path, warnings)?;
        triangles += mesh.indices.len() as u64;
        if triangles > options.max_triangles {
            return Err(options.exceeded("max_triangles", options.max_triangles, triangles).in_file(path));
        }
        if !mesh.indices.is_empty() {
            parts.push(Part { mesh, material });
        }
    }
    Ok(ObjFile { parts, materials, folder })
}

fn convert(
    mesh: &tobj::Mesh,
    name: &str,
    path: &Path,
    warnings: &mut Warnings,
) -> Result<TriangleMesh, SceneError> {
    let finite = |values: &[f32]| values.iter().all(|v| v.is_finite());
    if !(finite(&mesh.positions) && finite(&mesh.normals) && finite(&mesh.texcoords)) {
        let message = format!("a vertex of group `{name}` is not finite");
        return Err(SceneError::new(ErrorKind::Value, message).in_file(path));
    }
    let positions = mesh.positions.as_chunks::<3>().0.to_vec();
    let normals = mesh.normals.as_chunks::<3>().0;
    let uvs = mesh.texcoords.as_chunks::<2>().0;
    let mut complete = |count: usize, what: &str, effect: &str| {
        if count != 0 && count != positions.len() {
            let place = path.display();
            warnings.add(format!("{place}: some vertices of group `{name}` have no {what}: {effect}"));
        }
        count == positions.len() && count != 0
    };
    let normals = complete(normals.len(), "normal", "it is shaded flat").then(|| normals.to_vec());
    let uvs = complete(uvs.len(), "texture coordinates", "it has none").then(|| uvs.to_vec());
    let indices = mesh.indices.as_chunks::<3>().0.to_vec();
    Ok(TriangleMesh { positions, indices, normals, uvs, ..TriangleMesh::default() })
}
