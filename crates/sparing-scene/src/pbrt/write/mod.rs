//! Writes a scene as pbrt text, the inverse of the loader.
//!
//! Loading what was written gives the same scene, apart from names that were not unique, the numbering of pictures,
//! constant textures (which are folded into their users), and the last bits of axes that were not quite unit.

mod procedural;
mod surfaces;
mod text;

use crate::description::{
    ImageId, ImageSource, Light, PixelFilter, Projection, SamplerKind, SceneDescription, SphereMapping,
    SpotEdge, TextureEncoding, TriangleMesh,
};
use crate::error::{ErrorKind, SceneError};
use glam::{Mat3, Mat4, Vec3};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use text::{Text, color, number, numbers, quoted};

/// A scene as pbrt text, and the files that go with it; names are relative to the text's folder.
#[derive(Debug, Default)]
pub struct PbrtFiles<'a> {
    /// The scene.
    pub text: String,
    /// Meshes to be written as PLY.
    pub meshes: Vec<(PathBuf, &'a TriangleMesh)>,
    /// Pictures to be written: the encoded bytes of those that the scene carries, or files to be copied.
    pub pictures: Vec<(PathBuf, &'a ImageSource)>,
}

/// What becomes a file of its own.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PbrtOptions {
    /// Folder for meshes and pictures, relative to the text's; `None`: meshes become text, pictures that the scene
    /// carries lie beside it.
    pub folder: Option<PathBuf>,
    /// Whether pictures that are files are copied, too, or just named.
    pub copy_pictures: bool,
}

/// See [`crate::save_pbrt`].
pub(crate) fn save(scene: &SceneDescription, path: &Path) -> Result<(), SceneError> {
    // Nothing is written unless all can be said.
    let files = files(scene, path, &PbrtOptions::default())?;
    for (name, source) in &files.pictures {
        if let ImageSource::Bytes { bytes, .. } = source {
            let file = path.with_file_name(name);
            std::fs::write(&file, bytes).map_err(|error| file_error(&file, &error))?;
        }
    }
    std::fs::write(path, files.text).map_err(|error| file_error(path, &error))
}

/// See [`crate::pbrt_files`].
pub(crate) fn files<'a>(
    scene: &'a SceneDescription,
    path: &Path,
    options: &PbrtOptions,
) -> Result<PbrtFiles<'a>, SceneError> {
    scene.validate()?;
    let mut files = PbrtFiles::default();
    let mut pictures = Vec::new();
    let mut copies: HashMap<&Path, PathBuf> = HashMap::new();
    let mut embedded: HashMap<*const u8, PathBuf> = HashMap::new();
    for (i, image) in scene.images.iter().enumerate() {
        let new = |name: &Path| match &options.folder {
            Some(folder) => {
                folder.join(format!("picture-{i}")).with_extension(name.extension().unwrap_or_default())
            }
            None => beside(path, i, name),
        };
        let (name, known) = match &image.source {
            ImageSource::File(file) if !options.copy_pictures => {
                pictures.push(quoted(&reference(file, path)?.to_string_lossy()));
                continue;
            }
            ImageSource::File(file) => {
                let known = copies.contains_key(file.as_path());
                (copies.entry(file).or_insert_with(|| new(file)), known)
            }
            ImageSource::Bytes { name, bytes } => {
                let known = embedded.contains_key(&bytes.as_ptr());
                (embedded.entry(bytes.as_ptr()).or_insert_with(|| new(Path::new(name))), known)
            }
        };
        pictures.push(quoted(&name.to_string_lossy()));
        if !known {
            files.pictures.push((name.clone(), &image.source));
        }
    }
    let meshes = options.folder.clone();
    let names = Names::new(scene);
    let mut writer = Writer { scene, out: Text::default(), names, pictures, meshes, files };
    writer.settings()?;
    writer.out.line("\nWorldBegin\n");
    writer.textures()?;
    writer.materials();
    writer.lights()?;
    writer.shapes()?;
    Ok(PbrtFiles { text: writer.out.finish(), ..writer.files })
}

fn file_error(path: &Path, error: &std::io::Error) -> SceneError {
    SceneError::new(ErrorKind::File, format!("cannot write `{}`: {error}", path.display()))
}

fn unsupported(what: &str) -> SceneError {
    SceneError::new(ErrorKind::Unsupported, format!("pbrt files cannot say {what}"))
}

struct Writer<'a> {
    scene: &'a SceneDescription,
    out: Text,
    names: Names,
    /// File name of each picture, quoted.
    pictures: Vec<String>,
    /// Folder of meshes that become files.
    meshes: Option<PathBuf>,
    files: PbrtFiles<'a>,
}

/// Names of materials and objects, made unique and quoted.
struct Names {
    materials: Vec<String>,
    objects: Vec<String>,
}

impl Names {
    fn new(scene: &SceneDescription) -> Self {
        let unique = |names: &mut dyn Iterator<Item = &String>, kind: &str| {
            let mut taken: HashSet<String> = HashSet::new();
            let mut all = Vec::new();
            for (i, name) in names.enumerate() {
                let mut wanted = if name.is_empty() { format!("{kind} {i}") } else { name.clone() };
                while !taken.insert(quoted(&wanted)) {
                    wanted = format!("{wanted} {i}");
                }
                all.push(quoted(&wanted));
            }
            all
        };
        Self {
            materials: unique(&mut scene.materials.iter().map(|m| &m.name), "material"),
            objects: unique(&mut scene.objects.iter().map(|o| &o.name), "object"),
        }
    }
}

/// The file name of a picture in memory: beside the scene, named after it.
fn beside(path: &Path, index: usize, name: &Path) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let extension = name.extension().unwrap_or_default().to_string_lossy();
    format!("{stem}-picture-{index}.{extension}").into()
}

/// How a scene at `path` names a file.
fn reference(file: &Path, path: &Path) -> Result<PathBuf, SceneError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    match file.strip_prefix(folder) {
        Ok(inside) if !folder.as_os_str().is_empty() => Ok(inside.to_owned()),
        _ => std::path::absolute(file).map_err(|error| file_error(file, &error)),
    }
}

impl Writer<'_> {
    fn settings(&mut self) -> Result<(), SceneError> {
        let SceneDescription { camera, film, filter, sampler, integrator, .. } = self.scene;
        let out = &mut self.out;
        out.line(&format!("Integrator \"path\" \"integer maxdepth\" {}", integrator.max_depth));
        let seed = u32::try_from(sampler.seed).map_err(|_| unsupported("a seed of more than 32 bits"))?;
        let kind = match sampler.kind {
            SamplerKind::Sobol => "zsobol",
            SamplerKind::Independent => "independent",
        };
        let spp = sampler.spp.map(|spp| format!(" \"integer pixelsamples\" {spp}")).unwrap_or_default();
        out.line(&format!("Sampler \"{kind}\"{spp} \"integer seed\" {}", seed as i32));
        let (kind, radius, further) = match *filter {
            PixelFilter::Box { radius } => ("box", radius, String::new()),
            PixelFilter::Triangle { radius } => ("triangle", radius, String::new()),
            PixelFilter::Gaussian { radius, sigma } => ("gaussian", radius, number("sigma", sigma)),
            PixelFilter::BlackmanHarris { radius } => ("blackmanharris", radius, String::new()),
            PixelFilter::Mitchell { radius, b, c } => ("mitchell", radius, number("B", b) + &number("C", c)),
        };
        let radius = number("xradius", radius[0]) + &number("yradius", radius[1]);
        out.line(&format!("PixelFilter \"{kind}\"{radius}{further}"));
        let mut text = format!(
            "Film \"rgb\" \"integer xresolution\" {} \"integer yresolution\" {}",
            film.width, film.height
        );
        if let Some([x0, y0, x1, y1]) = film.crop {
            text += &format!(" \"integer pixelbounds\" [ {x0} {x1} {y0} {y1} ]");
        }
        if let Some(name) = &film.filename {
            text += &format!(" \"string filename\" {}", quoted(name));
        }
        if film.scale != 1.0 {
            text += &number("exposuretime", film.scale);
        }
        out.line(&text);
        let inverse = |m: Mat4| m.as_dmat4().inverse().to_cols_array().map(|v| v.to_string()).join(" ");
        self.transform(&inverse(camera.camera_to_world), camera.end.map(inverse));
        let out = &mut self.out;
        let mut text = match camera.projection {
            Projection::Perspective { fov } => format!("Camera \"perspective\"{}", number("fov", fov)),
            Projection::Orthographic => "Camera \"orthographic\"".to_owned(),
            Projection::EqualArea => "Camera \"spherical\" \"string mapping\" \"equalarea\"".to_owned(),
            Projection::Equirectangular => {
                "Camera \"spherical\" \"string mapping\" \"equirectangular\"".to_owned()
            }
        };
        if let Some(window) = camera.screen_window {
            text += &numbers("float screenwindow", &window);
        }
        if camera.lens_radius > 0.0 {
            text += &number("lensradius", camera.lens_radius);
        }
        text += &number("focaldistance", camera.focal_distance);
        if camera.shutter != [0.0, 1.0] {
            let [open, close] = camera.shutter;
            text += &(number("shutteropen", open) + &number("shutterclose", close));
        }
        out.line(&text);
        Ok(())
    }

    fn lights(&mut self) -> Result<(), SceneError> {
        for light in &self.scene.lights {
            let text = match light {
                Light::Point { position, intensity } => {
                    let from = numbers("point3 from", &position.to_array());
                    format!("LightSource \"point\"{from}{}", color("I", *intensity))
                }
                Light::Spot { position, direction, intensity, cone_angle, cone_delta, edge } => {
                    let to = numbers("point3 to", &direction.to_array());
                    let cone = number("coneangle", *cone_angle) + &number("conedeltaangle", *cone_delta);
                    let [x, y, z] = position.to_array();
                    let edge = match edge {
                        SpotEdge::Smooth => "",
                        SpotEdge::Square => " \"string falloff\" \"square\"",
                        SpotEdge::Fourth => " \"string falloff\" \"fourth\"",
                    };
                    let light = format!("LightSource \"spot\"{to}{cone}{edge}{}", color("I", *intensity));
                    format!("AttributeBegin\n  Translate {x} {y} {z}\n  {light}\nAttributeEnd")
                }
                Light::Distant { direction, irradiance } => {
                    let to = numbers("point3 to", &direction.to_array());
                    format!("LightSource \"distant\"{to}{}", color("L", *irradiance))
                }
                Light::Environment { radiance, image, light_to_world } => {
                    let strength = match image {
                        None => color("L", *radiance),
                        Some(map) => {
                            let target =
                                map.illuminance.map(|lux| number("illuminance", lux)).unwrap_or_default();
                            self.surroundings(map.image)? + mapping(map.mapping) + &target + &grey(*radiance)?
                        }
                    };
                    in_frame(*light_to_world, Vec3::ZERO, &format!("LightSource \"infinite\"{strength}"))
                }
                Light::Goniometric { position, intensity, image, mapping: map, power, light_to_world } => {
                    let file = image.map(|id| self.surroundings(id)).transpose()?.unwrap_or_default();
                    let power = power.map(|watt| number("power", watt)).unwrap_or_default();
                    let light = format!(
                        "LightSource \"goniometric\"{file}{}{}{power}",
                        color("I", *intensity),
                        mapping(*map)
                    );
                    // The pole of the picture is the y axis of pbrt's light.
                    let axes = light_to_world.to_cols_array_2d().map(Vec3::from);
                    in_frame(Mat3::from_cols(axes[0], axes[2], axes[1]), *position, &light)
                }
                Light::Projection { position, intensity, image, fov, power, light_to_world } => {
                    let Some(image) = image else { return Err(unsupported("a projector without a slide")) };
                    let file = self.surroundings(*image)?;
                    let power = power.map(|watt| number("power", watt)).unwrap_or_default();
                    let factor = grey(*intensity)?;
                    let light =
                        format!("LightSource \"projection\"{file}{}{factor}{power}", number("fov", *fov));
                    let axes = light_to_world.to_cols_array_2d().map(Vec3::from);
                    in_frame(Mat3::from_cols(axes[0], -axes[1], axes[2]), *position, &light)
                }
            };
            self.out.line(&text);
        }
        Ok(())
    }

    pub fn surroundings(&self, id: ImageId) -> Result<String, SceneError> {
        if self.scene.images[id.0 as usize].encoding != TextureEncoding::Auto {
            return Err(unsupported("how to decode a picture of the surroundings"));
        }
        Ok(format!(" \"string filename\" {}", self.pictures[id.0 as usize]))
    }
}

/// A directive where a frame is the current transformation.
fn in_frame(axes: Mat3, origin: Vec3, directive: &str) -> String {
    let mut matrix = Mat4::from_mat3(axes);
    matrix.w_axis = origin.extend(1.0);
    let values = matrix.to_cols_array().map(|v| v.to_string());
    format!("AttributeBegin\n  Transform [ {} ]\n  {directive}\nAttributeEnd", values.join(" "))
}

fn mapping(mapping: SphereMapping) -> &'static str {
    match mapping {
        SphereMapping::Auto => "",
        SphereMapping::LatLong => " \"string mapping\" \"latlong\"",
        SphereMapping::EqualArea => " \"string mapping\" \"equalarea\"",
    }
}

fn grey(factor: glam::Vec3) -> Result<String, SceneError> {
    if factor.x != factor.y || factor.y != factor.z {
        return Err(unsupported("a colour on a picture of the surroundings"));
    }
    Ok(number("scale", factor.x))
}
