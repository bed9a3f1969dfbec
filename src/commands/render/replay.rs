//! `--pixel X,Y --sample N`: one sample again, with all that is known of it.

use super::plan::Plan;
use crate::session::console::print;
use anyhow::bail;
use glam::Vec3;
use serde_json::{Value, json};
use sparing_image::film::{Film, FilmOptions};
use sparing_render::integrator::inspect::PathVertex;
use sparing_render::{Renderer, Scene};
use std::process::ExitCode;

/// Traces one sample and prints it.
pub(super) fn replay(scene: &Scene, plan: &Plan, pixel: [u32; 2], sample: u32) -> anyhow::Result<ExitCode> {
    let [x, y] = pixel;
    if x >= plan.size[0] || y >= plan.size[1] {
        bail!("pixel {x},{y} is outside the picture of {}x{}", plan.size[0], plan.size[1]);
    }
    let options = FilmOptions { auxiliary: true, shapes: false, luminance: false };
    let mut film = Film::new(plan.size, [x, y, x + 1, y + 1], options);
    let renderer = Renderer::new(scene, plan.settings, options);
    let tile = &mut film.tiles[0];
    let rays = renderer.sample_pixel(tile, 0, sample, sample + 1);
    let a = tile.auxiliary[0];
    // As it was rendered: in its packet, with the code that the film of the render wants.
    let renderer = Renderer::new(scene, plan.settings, plan.film);
    let spp = plan.shard.most(plan.choice.bounds.max_spp);
    let seen = renderer.inspect(plan.size, pixel, sample, spp);
    let value = seen.radiance * seen.weight; // what the film would add
    let json = json!({
        "pixel": pixel,
        "sample": sample,
        "radiance": vector(value),
        "filter_weight": number(seen.weight),
        "invalid": !(value.is_finite() && seen.radiance.min_element() >= 0.0),
        "first_hit": (a.hits > 0).then(|| json!({
            "albedo": vector(a.albedo), "normal": vector(a.normal), "depth": number(a.depth),
        })),
        "bounce_rays": rays.bounce,
        "shadow_rays": rays.shadow,
        "path": seen.vertices.iter().map(vertex).collect::<Vec<_>>(),
    });
    print(serde_json::to_string_pretty(&json)?)?;
    Ok(ExitCode::SUCCESS)
}

fn vertex(v: &PathVertex) -> Value {
    let hit = v.hit.as_ref().map(|hit| {
        json!({
            "shape": hit.surface.shape,
            "instance": hit.surface.instance,
            "face": hit.surface.face,
            "material": hit.material,
            "distance": number(hit.t),
            "position": vector(hit.p),
            "geometric_normal": vector(hit.ng),
            "shading_normal": vector(hit.ns),
        })
    });
    json!({
        "depth": v.depth,
        "origin": vector(v.origin),
        "direction": vector(v.direction),
        "hit": hit,
        "throughput": vector(v.throughput),
        "pdf": number(v.pdf),
        "radiance": vector(v.radiance),
    })
}

fn vector(v: Vec3) -> Value {
    v.to_array().map(number).to_vec().into()
}

/// JSON has no word for what is not finite; here that is what matters.
fn number(v: f32) -> Value {
    if v.is_finite() { json!(v) } else { v.to_string().into() }
}
