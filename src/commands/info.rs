//! `sparing info`.

use super::render::load;
use super::sandbox::FileArguments;
use crate::session::console::{note, print};
use clap::Args;
use sparing_image::exr::{ExrAttribute, read_exr};
use sparing_render::{BuildOptions, Needs, Scene};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Arguments of `sparing info`.
#[derive(Debug, Args)]
pub(super) struct InfoArguments {
    /// A scene (.pbrt, .obj) or a picture (.exr).
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
    let warnings = description.warnings.len();
    let scene = Scene::build(description, BuildOptions::default())?;
    for warning in &scene.warnings {
        note(format_args!("warning: {warning}"));
    }
    let (s, needs) = (scene.statistics, scene.needs());
    if json {
        let value = serde_json::json!({
            "scene": path.display().to_string(),
            "width": film.width, "height": film.height,
            "spp": sampler.spp, "max_depth": integrator.max_depth,
            "triangles": s.triangles, "quads": s.quads, "shapes": s.shapes, "instances": s.instances,
            "lights": s.lights, "materials": s.materials,
            "geometry_bytes": s.geometry_bytes, "texture_bytes": s.texture_bytes, "embree_bytes": s.embree_bytes,
            "needs": needs.names(), "skipped": needs.complement().names(),
            "warnings": warnings + scene.warnings.len(),
        });
        print(serde_json::to_string_pretty(&value)?)?;
        return Ok(ExitCode::SUCCESS);
    }
    let mib = |b: u64| format!("{:.1} MiB", b as f64 / 1_048_576.0);
    let spp = sampler.spp.map_or("64 (default)".into(), |n| n.to_string());
    let mut lines = vec![
        format!("scene      {}", path.display()),
        format!("picture    {}x{}, {spp} spp, depth {}", film.width, film.height, integrator.max_depth),
        format!(
            "geometry   {} triangles, {} quads, {} shapes, {} instances",
            s.triangles, s.quads, s.shapes, s.instances
        ),
        format!("lights     {} (emitting faces counted singly)", s.lights),
        format!("materials  {}", s.materials),
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
    print(lines.join("\n"))?;
    Ok(ExitCode::SUCCESS)
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
