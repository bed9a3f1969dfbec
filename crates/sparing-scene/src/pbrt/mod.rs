//! The pbrt text format of version 4 (<https://pbrt.org/fileformat-v4>), and of versions 2 and 3 by [`dialect`].
//!
//! Conventions: a left-handed camera (x right, y up, z forward); each transformation directive multiplies the
//! current matrix from the right, so the last one acts first; `Camera` stores the inverse of the current
//! matrix; matrices are written column by column; v = 0 is the bottom of a picture. File names are relative
//! to the folder of the scene file. Where vertex normals are given they decide which side is outside, as in
//! pbrt; without them the winding does, seen in the space of the shape, and `ReverseOrientation` flips it.
//!
//! Own extensions: `Shape "objmesh" "string filename"`, `PixelFilter "blackmanharris"`, `"rgb tint"` of
//! `dielectric`, and for pictures `"string wrap" "mirror"` and `"string encoding" "alpha"` (the alpha channel).

mod camera;
mod colorspace;
mod curve;
mod dialect;
mod directives;
mod graphics_state;
mod lights;
mod loopsubdiv;
mod materials;
mod mesh;
mod metallic_roughness;
#[cfg(test)]
mod motion_tests;
mod old_lights;
mod old_materials;
mod params;
mod parser;
mod placement;
mod prefetch;
mod procedural;
mod shapes;
mod spectrum;
mod tessellate;
#[cfg(test)]
mod tests;
mod textures;
mod tokenizer;
mod values;
mod write;

pub use write::{PbrtFiles, PbrtOptions};
pub(crate) use write::{files, save};

use crate::description::{ColorInput, FloatInput, MaterialId, PixelFilter, SceneDescription};
use crate::error::{ErrorKind, SceneError};
use crate::images::ImageTable;
use crate::options::LoadOptions;
use crate::source::{self, SourceFile, Span};
use crate::warnings::Warnings;
use dialect::Dialect;
use glam::DMat4;
use graphics_state::GraphicsState;
use parser::Parser;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Why a graphics state was saved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scope {
    Attribute,
    Transform,
    Object,
    Import,
}

/// Turns directives into a scene.
struct Builder<'o> {
    options: &'o LoadOptions,
    /// The version of pbrt whose rules apply.
    dialect: Dialect,
    /// Folder that file names are relative to.
    base: PathBuf,
    scene: SceneDescription,
    warnings: Warnings,
    images: ImageTable,
    prefetch: prefetch::Prefetch,
    state: GraphicsState,
    saved: Vec<(Scope, GraphicsState, Span)>,
    coordinate_systems: HashMap<String, [DMat4; 2]>,
    float_textures: HashMap<String, FloatInput>,
    color_textures: HashMap<String, ColorInput>,
    named_materials: HashMap<String, MaterialId>,
    default_material: Option<MaterialId>,
    objects: HashMap<String, u32>,
    /// Opacity of the shape being made.
    alpha: Option<FloatInput>,
    /// Where that is a threshold.
    alpha_cutoff: Option<f32>,
    /// Material of the mesh being made, where the mesh has its own.
    mesh_material: Option<MaterialId>,
    /// The object being defined.
    object: Option<u32>,
    /// Where the shape being made starts to move from; it may emit although it is an object.
    moving: Option<DMat4>,
    /// Shapes that move within objects.
    moving_parts: HashMap<u32, Vec<placement::MovingPart>>,
    /// When motion starts and ends.
    transform_times: [f64; 2],
    in_world: bool,
    has_camera: bool,
    entities: u64,
    triangles: u64,
    vertices: u64,
}

/// Loads a pbrt file.
pub(crate) fn load(path: &Path, options: &LoadOptions) -> Result<SceneDescription, SceneError> {
    let source = source::read(path, options)?;
    let base = path.parent().map(Path::to_owned).unwrap_or_default();
    load_source(source, base, options)
}

/// Loads pbrt text from memory.
pub(crate) fn load_text(
    name: &str,
    text: &[u8],
    base: &Path,
    options: &LoadOptions,
) -> Result<SceneDescription, SceneError> {
    let source = Arc::new(SourceFile { name: name.to_owned(), bytes: text.to_vec(), lines_before: 0 });
    load_source(source, base.to_owned(), options)
}

fn load_source(
    source: Arc<SourceFile>,
    base: PathBuf,
    options: &LoadOptions,
) -> Result<SceneDescription, SceneError> {
    let name = source.name.clone();
    let mut builder = Builder {
        options,
        dialect: dialect::detect(&source),
        base,
        scene: SceneDescription { name: name.clone(), ..SceneDescription::default() },
        warnings: Warnings::new(options.max_warnings),
        images: ImageTable::default(),
        prefetch: prefetch::Prefetch::default(),
        state: GraphicsState::default(),
        saved: Vec::new(),
        coordinate_systems: HashMap::new(),
        float_textures: HashMap::new(),
        color_textures: HashMap::new(),
        named_materials: HashMap::new(),
        default_material: None,
        objects: HashMap::new(),
        alpha: None,
        alpha_cutoff: None,
        mesh_material: None,
        object: None,
        moving: None,
        moving_parts: HashMap::new(),
        transform_times: [0.0, 1.0],
        in_world: false,
        has_camera: false,
        entities: 0,
        triangles: 0,
        vertices: 0,
    };
    builder.scene.integrator.max_depth = 5;
    [builder.scene.film.width, builder.scene.film.height] = camera::default_size(builder.dialect);
    if builder.dialect != Dialect::V4 {
        builder.scene.filter = PixelFilter::Box { radius: [0.5; 2] };
    }
    builder.expect_meshes(&source);
    let run = builder.run(&mut Parser::new(source, options)).and_then(|()| builder.finish());
    run.map_err(|error| error.in_file(Path::new(&name)))
}

impl Builder<'_> {
    /// Counts a shape, material, texture, light or instance against the limit.
    fn count_entity(&mut self) -> Result<(), SceneError> {
        self.entities += 1;
        if self.entities > self.options.max_entities {
            return Err(self.options.exceeded("max_entities", self.options.max_entities, self.entities));
        }
        Ok(())
    }

    /// Counts a mesh against the limits.
    fn count_mesh(&mut self, vertices: usize, faces: usize) -> Result<(), SceneError> {
        let options = self.options;
        self.vertices += vertices as u64;
        if self.vertices > options.max_vertices {
            return Err(options.exceeded("max_vertices", options.max_vertices, self.vertices));
        }
        self.triangles += faces as u64;
        if self.triangles > options.max_triangles {
            return Err(options.exceeded("max_triangles", options.max_triangles, self.triangles));
        }
        Ok(())
    }

    /// A file named in the scene, which must exist, in a folder that may be read.
    fn existing_file(&self, name: &str, at: &Span) -> Result<PathBuf, SceneError> {
        match self.find_file(name, at)? {
            Some(path) => Ok(path),
            None => {
                let path = self.base.join(name);
                Err(SceneError::new(ErrorKind::File, format!("there is no file `{}`", path.display())).at(at))
            }
        }
    }

    /// [`Self::existing_file`] or nothing.
    fn find_file(&self, name: &str, at: &Span) -> Result<Option<PathBuf>, SceneError> {
        // Files beside an included file that is in another folder.
        let beside = Path::new(&at.source.name).parent().map(|folder| folder.join(name));
        let Some(path) =
            [Some(self.base.join(name)), beside].into_iter().flatten().find(|path| path.is_file())
        else {
            return Ok(None);
        };
        source::check_folder(&path, self.options).map_err(|error| error.at(at))?;
        Ok(Some(path))
    }

    /// The colour of a spectrum-like parameter, in the colour space in force.
    fn color(&self, param: &params::Param, quantity: spectrum::Quantity) -> Result<glam::Vec3, SceneError> {
        let find = |name: &str| self.find_file(name, &param.value_span(0));
        spectrum::color(param, quantity, self.state.color_space, &find, self.options)
    }

    fn finish(mut self) -> Result<SceneDescription, SceneError> {
        if let Some((scope, _, at)) = self.saved.last() {
            let name = match scope {
                Scope::Attribute => "AttributeBegin",
                Scope::Transform => "TransformBegin",
                Scope::Object => "ObjectBegin",
                Scope::Import => "Import",
            };
            let message = format!("this {name} is never closed");
            return Err(SceneError::new(ErrorKind::Syntax, message).at(at));
        }
        let scene = &self.scene;
        if scene.shapes.is_empty() && scene.instances.is_empty() && scene.lights.is_empty() {
            let error = SceneError::new(ErrorKind::Invalid, "nothing to render: no shapes and no lights");
            return Err(if self.in_world { error } else { error.help("there is no WorldBegin") });
        }
        if !self.has_camera {
            self.warnings.add("there is no Camera: one at the origin looks along +z".to_owned());
        }
        // Motions of the description go from 0 to 1.
        let [start, end] = self.transform_times;
        let shutter = &mut self.scene.camera.shutter;
        *shutter = shutter.map(|t| ((f64::from(t) - start) / (end - start)) as f32);
        if !shutter.iter().all(|t| t.is_finite()) {
            return Err(SceneError::new(ErrorKind::Value, "TransformTimes are too close for this shutter"));
        }
        self.scene.warnings = self.warnings.into_vec();
        Ok(self.scene)
    }
}

/// The error for a parameter that is not there.
fn missing(name: &str, ty: &str, at: &Span) -> SceneError {
    SceneError::new(ErrorKind::Value, format!("the parameter \"{ty} {name}\" is missing")).at(at)
}
