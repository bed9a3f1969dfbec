//! glTF 2.0, as JSON with files beside it or as one binary file.
//!
//! The world is as in glTF: right-handed, y up. Texture coordinates are turned over on the way in (v = 0 is the top
//! of a picture in glTF and the bottom here). A mesh at one node becomes shapes of the scene; one at several nodes
//! becomes an object with instances. A file without a camera or without lights gets what models get
//! (see [`crate::model`]).

mod accessors;
mod container;
mod json;
mod materials;
mod meshes;
mod nodes;
#[cfg(test)]
mod tests;
mod textures;
mod views;

use crate::description::{ImageId, ImageSource, SceneDescription};
use crate::error::{ErrorKind, SceneError};
use crate::model::{self, Framing};
use crate::options::LoadOptions;
use crate::warnings::Warnings;
use container::Buffers;
use json::Node;
use materials::BuiltMaterial;
use std::collections::HashMap;
use std::path::Path;

/// Extensions that are understood.
const EXTENSIONS: [&str; 10] = [
    "KHR_lights_punctual",
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];
/// Sets of texture coordinates that a material may name.
const MAX_UV_SETS: usize = 1000;

/// Turns a file into a scene.
struct Loader<'a> {
    root: Node<'a>,
    options: &'a LoadOptions,
    buffers: Buffers<'a>,
    reader: accessors::Reader,
    scene: SceneDescription,
    warnings: Warnings,
    /// Where each picture of the file is; `None`: nowhere.
    pictures: HashMap<usize, Option<ImageSource>>,
    images: HashMap<(usize, String), ImageId>,
    /// By index and whether vertices have colours.
    materials: HashMap<(Option<usize>, bool), BuiltMaterial>,
    /// Set of texture coordinates that is the second one of the material at hand, if it has two.
    second_uv_set: Option<usize>,
    vertices: u64,
    triangles: u64,
    entities: u64,
    has_camera: bool,
    /// Whether the file means to light itself: it has lights, or something brighter than white.
    lit_by_itself: bool,
}

/// Loads a `.gltf` or `.glb` file.
pub(crate) fn load(path: &Path, options: &LoadOptions) -> Result<SceneDescription, SceneError> {
    read(path, options).map_err(|error| error.in_file(path))
}

fn read(path: &Path, options: &LoadOptions) -> Result<SceneDescription, SceneError> {
    let file = container::read(path, options)?;
    let root = Node::root(&file.json);
    let mut loader = Loader {
        root: root.clone(),
        options,
        buffers: Buffers::new(root.clone(), file.binary, path, options)?,
        reader: accessors::Reader::default(),
        scene: SceneDescription { name: path.display().to_string(), ..SceneDescription::default() },
        warnings: Warnings::new(options.max_warnings),
        pictures: HashMap::new(),
        images: HashMap::new(),
        materials: HashMap::new(),
        second_uv_set: None,
        vertices: 0,
        triangles: 0,
        entities: 0,
        has_camera: false,
        lit_by_itself: false,
    };
    loader.check_version()?;
    loader.check_extensions()?;
    loader.scene()?;
    if !root.list("animations")?.is_empty() {
        loader.warnings.add("animations are not supported: everything stands still".to_owned());
    }
    let framing = Framing { camera: !loader.has_camera, light: !loader.lit_by_itself, room: false };
    model::finish_with(loader.scene, loader.warnings, path, framing)
}

impl Loader<'_> {
    fn check_version(&self) -> Result<(), SceneError> {
        let asset = self.root.require("asset")?;
        let version = asset.text("minVersion")?.or(asset.text("version")?).unwrap_or_default();
        if version.split('.').next() != Some("2") {
            let version: String = version.chars().take(20).collect();
            let message = format!("this is version `{version}` of glTF; only 2 is read");
            return Err(asset.error_of(ErrorKind::Unsupported, message));
        }
        Ok(())
    }

    fn check_extensions(&mut self) -> Result<(), SceneError> {
        let required = self.root.list("extensionsRequired")?;
        for extension in &required {
            let name = extension.as_str()?;
            if !EXTENSIONS.contains(&name) {
                let name: String = name.chars().take(60).collect();
                let message = format!("the file needs the extension `{name}`, which is not supported");
                let error = extension.error_of(ErrorKind::Unsupported, message);
                return Err(error.help(format!("supported are: {}", EXTENSIONS.join(", "))));
            }
        }
        for extension in self.root.list("extensionsUsed")? {
            let name = extension.as_str()?;
            if !EXTENSIONS.contains(&name) {
                let name: String = name.chars().take(60).collect();
                self.warnings.add(format!("the extension `{name}` is not supported and ignored"));
            }
        }
        Ok(())
    }
}
