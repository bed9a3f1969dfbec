//! `--pixel X,Y --sample N`: one sample again, with all that is known of it.

use super::plan::Plan;
use crate::session::console::print;
use anyhow::bail;
use sparing_image::film::{Film, FilmOptions};
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
    let value = tile.pixels[0].mean();
    let a = tile.auxiliary[0];
    let json = serde_json::json!({
        "pixel": pixel,
        "sample": sample,
        "radiance": value.to_array(),
        "invalid": tile.invalid > 0,
        "first_hit": (a.hits > 0).then(|| serde_json::json!({
            "albedo": a.albedo.to_array(), "normal": a.normal.to_array(), "depth": a.depth,
        })),
        "bounce_rays": rays.bounce,
        "shadow_rays": rays.shadow,
    });
    print(serde_json::to_string_pretty(&json)?)?;
    Ok(ExitCode::SUCCESS)
}
