//! `sparing info`.

use super::render::load;
use super::sandbox::FileArguments;
use crate::session::console::{note, print};
use clap::Args;
use sparing_image::exr::{ExrAttribute, read_exr};
use sparing_render::{BuildOptions, Needs, Scene};
use sparing_scene::SceneDescription;
use sparing_scene::description::{Geometry, Image, ImageSource, Material, Projection, Shape};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Arguments of `sparing info`.
#[derive(Debug, Args)]
pub(super) struct InfoArguments {
    /// A scene (.pbrt, .gltf, .glb, .obj, .ply) or a picture (.exr).
    file: PathBuf,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    files: FileArguments,
}

pub(super) fn run(a: &InfoArguments) -> anyhow::Result<ExitCode> {
    let is_exr = a.file.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    if is_exr { picture(&a.file, a.json) } else { scene(a) }
}

fn scene(a: &InfoArguments) -> anyhow::Result<ExitCode> {
    let (path, json) = (a.file.as_path(), a.json);
    let description = load(path, &a.files)?;
    let (film, sampler, integrator) = (description.film.clone(), description.sampler, description.integrator);
    let contents = Contents::of(&description);
    let mut ignored = description.warnings.clone();
    let camera = description.camera.clone();
    let scene = Scene::build(description, BuildOptions::default())?;
    for warning in &scene.warnings {
        note(format_args!("warning: {warning}"));
    }
    ignored.extend_from_slice(&scene.warnings);
    let (s, needs) = (scene.statistics, scene.needs());
    let to_world = camera.camera_to_world;
    let eye = to_world.w_axis.truncate();
    let forward = to_world.z_axis.truncate().normalize_or_zero();
    if json {
        let (projection, fov) = match camera.projection {
            Projection::Perspective { fov } => ("perspective", Some(fov)),
            Projection::Orthographic => ("orthographic", None),
            Projection::EqualArea => ("equal-area", None),
            Projection::Equirectangular => ("equirectangular", None),
        };
        let value = serde_json::json!({
            "scene": path.display().to_string(),
            "width": film.width, "height": film.height,
            "spp": sampler.spp, "max_depth": integrator.max_depth,
            "camera": {
                "projection": projection, "fov": fov, "position": eye.to_array(), "direction": forward.to_array(),
                "lens_radius": camera.lens_radius, "moves": camera.end.is_some(), "shutter": camera.shutter,
            },
            "triangles": s.triangles, "quads": s.quads, "shapes": s.shapes, "instances": s.instances,
            "moving_instances": contents.moving,
            "objects": contents.objects, "vertices": contents.vertices,
            "lights": s.lights, "light_kinds": contents.lights,
            "materials": s.materials, "material_kinds": contents.materials,
            "textures": contents.textures, "pictures": contents.pictures,
            "geometry_bytes": s.geometry_bytes, "texture_bytes": s.texture_bytes, "embree_bytes": s.embree_bytes,
            "needs": needs.names(), "skipped": needs.complement().names(),
            "warnings": ignored.len(), "ignored": ignored,
        });
        print(serde_json::to_string_pretty(&value)?)?;
        return Ok(ExitCode::SUCCESS);
    }
    let mib = |b: u64| format!("{:.1} MiB", b as f64 / 1_048_576.0);
    let spp = sampler.spp.map_or("64 (default)".into(), |n| n.to_string());
    let moves = |moving: bool, text: String| if moving { text } else { String::new() };
    let [open, close] = camera.shutter;
    let view = match camera.projection {
        Projection::Perspective { fov } => format!("perspective, {fov:.1} degrees"),
        Projection::Orthographic => "orthographic".to_owned(),
        Projection::EqualArea => "spherical, equal-area".to_owned(),
        Projection::Equirectangular => "spherical, latitude-longitude".to_owned(),
    };
    let mut lines = vec![
        format!("scene      {}", path.display()),
        format!("picture    {}x{}, {spp} spp, depth {}", film.width, film.height, integrator.max_depth),
        format!(
            "camera     {view}, at {eye:.3}, looking along {forward:.3}{}{}",
            moves(camera.end.is_some(), ", moving".to_owned()),
            moves(
                camera.end.is_some() || contents.moving > 0,
                format!(", shutter from {open} to {close} of the motion")
            )
        ),
        format!(
            "geometry   {} triangles, {} quads, {} vertices, {} shapes, {} objects, {} instances{}",
            s.triangles,
            s.quads,
            contents.vertices,
            s.shapes,
            contents.objects,
            s.instances,
            moves(contents.moving > 0, format!(" ({} moving)", contents.moving))
        ),
        format!("lights     {} (emitting faces counted singly){}", s.lights, list(&contents.lights)),
        format!("materials  {}{}", s.materials, list(&contents.materials)),
        format!("textures   {}, {} pictures", contents.textures, contents.pictures),
        format!(
            "memory     {} geometry, {} Embree, {} textures",
            mib(s.geometry_bytes),
            mib(s.embree_bytes),
            mib(s.texture_bytes)
        ),
    ];
    for (title, needed) in [("needs", true), ("skipped", false)] {
        lines.push(title.to_owned());
        let flags = Needs::describe().into_iter().filter(|(_, flag, _)| needs.contains(*flag) == needed);
        lines.extend(flags.map(|(name, _, meaning)| format!("  {name:<20} {meaning}")));
    }
    if !ignored.is_empty() {
        lines.push("ignored".to_owned());
        lines.extend(ignored.iter().map(|warning| format!("  {warning}")));
    }
    print(lines.join("\n"))?;
    Ok(ExitCode::SUCCESS)
}

/// What a description has, before it is built.
struct Contents {
    objects: usize,
    /// Instances that move.
    moving: usize,
    vertices: usize,
    textures: usize,
    /// Files or embedded pictures, each once.
    pictures: usize,
    lights: BTreeMap<String, usize>,
    materials: BTreeMap<String, usize>,
}

impl Contents {
    fn of(d: &SceneDescription) -> Self {
        let vertices = |shape: &Shape| match &shape.geometry {
            Geometry::Triangles(mesh) => mesh.positions.len(),
            Geometry::Quads(mesh) => mesh.positions.len(),
            Geometry::Sphere { .. } | Geometry::Disk { .. } => 0,
        };
        let shapes = || d.shapes.iter().chain(d.objects.iter().flat_map(|object| &object.shapes));
        let mut lights = kinds(&d.lights);
        let emitters = shapes().filter(|shape| shape.emission.is_some()).count();
        if emitters > 0 {
            lights.insert("emitting shape".to_owned(), emitters);
        }
        let kind_of = |m: &Material| m.kind.clone();
        let name = |image: &Image| match &image.source {
            ImageSource::File(path) => path.display().to_string(),
            ImageSource::Bytes { name, .. } => name.clone(),
        };
        let pictures: BTreeSet<String> = d.images.iter().map(name).collect();
        Self {
            objects: d.objects.len(),
            moving: d.instances.iter().filter(|instance| instance.end.is_some()).count(),
            vertices: shapes().map(vertices).sum(),
            textures: d.textures.len(),
            pictures: pictures.len(),
            lights,
            materials: kinds(&d.materials.iter().map(kind_of).collect::<Vec<_>>()),
        }
    }
}

/// How many there are of each variant of an enum: `AreaLight { .. }` is "area light".
fn kinds<T: std::fmt::Debug>(all: &[T]) -> BTreeMap<String, usize> {
    let mut kinds = BTreeMap::new();
    for item in all {
        let text = format!("{item:?}");
        let mut name = String::new();
        for c in text.chars().take_while(char::is_ascii_alphanumeric) {
            if c.is_ascii_uppercase() && !name.is_empty() {
                name.push(' ');
            }
            name.push(c.to_ascii_lowercase());
        }
        *kinds.entry(name).or_default() += 1;
    }
    kinds
}

/// `: 2 point, 1 spot`.
fn list(kinds: &BTreeMap<String, usize>) -> String {
    let parts: Vec<String> = kinds.iter().map(|(name, count)| format!("{count} {name}")).collect();
    if parts.is_empty() { String::new() } else { format!(": {}", parts.join(", ")) }
}

fn picture(path: &Path, json: bool) -> anyhow::Result<ExitCode> {
    let image = read_exr(path)?;
    let channels: Vec<&str> = image.channels.iter().map(|c| c.name.as_str()).collect();
    if json {
        let attributes: serde_json::Map<String, serde_json::Value> =
            image.attributes.iter().map(|(k, v)| (k.clone(), serde_json::Value::String(text(v)))).collect();
        let value = serde_json::json!({
            "picture": path.display().to_string(), "width": image.width, "height": image.height,
            "data_origin": image.data_origin, "display_size": image.display_size,
            "channels": channels, "attributes": attributes,
        });
        print(serde_json::to_string_pretty(&value)?)?;
        return Ok(ExitCode::SUCCESS);
    }
    let ([x, y], [w, h]) = (image.data_origin, image.display_size);
    let mut lines = vec![
        format!("picture    {}", path.display()),
        format!("pixels     {}x{} at {x},{y} of {w}x{h}", image.width, image.height),
        format!("channels   {}", channels.join(" ")),
    ];
    lines.extend(image.attributes.iter().map(|(name, value)| format!("{name}: {}", text(value))));
    print(lines.join("\n"))?;
    Ok(ExitCode::SUCCESS)
}

/// An attribute as people read it.
fn text(value: &ExrAttribute) -> String {
    match value {
        ExrAttribute::String(v) => v.clone(),
        ExrAttribute::Int(v) => v.to_string(),
        ExrAttribute::Float(v) => v.to_string(),
        ExrAttribute::Double(v) => v.to_string(),
        other => format!("{other:?}"),
    }
}
