//! Small scenes from text, rendered.

use anyhow::anyhow;
use sparing_image::film::{Film, FilmOptions};
use sparing_render::integrator::Wave;
use sparing_render::{BuildOptions, RenderSettings, Renderer, Scene};
use sparing_scene::{LoadOptions, SceneDescription, load_pbrt_text};
use std::path::Path;

/// Side of the pictures, pixels.
pub(super) const SIDE: u32 = 24;

/// What was rendered.
pub(super) struct Picture {
    pub(super) pixels: Vec<[f32; 3]>,
    pub(super) invalid: u64,
}

impl Picture {
    /// Mean of all channels.
    pub(super) fn mean(&self) -> f64 {
        self.pixels.iter().flatten().map(|v| f64::from(*v)).sum::<f64>() / (3 * self.pixels.len()) as f64
    }

    /// Largest channel.
    pub(super) fn max(&self) -> f64 {
        self.pixels.iter().flatten().fold(0.0, |m, v| f64::max(m, (*v).into()))
    }

    /// Values that are not finite or negative, and samples that were not.
    pub(super) fn bad(&self) -> f64 {
        let bad = |v: &&f32| !v.is_finite() || **v < 0.0;
        self.pixels.iter().flatten().filter(bad).count() as f64 + self.invalid as f64
    }

    /// How far the mean is from the surroundings, which shine with 1, and what is bad. Single pixels have noise.
    pub(super) fn off_white(&self) -> f64 {
        (self.mean() - 1.0).abs() + self.bad()
    }

    /// By how much the mean is above the surroundings, and what is bad.
    pub(super) fn excess(&self) -> f64 {
        (self.mean() - 1.0).max(0.0) + self.bad()
    }

    /// Pixels that are not black.
    pub(super) fn lit(&self) -> f64 {
        self.pixels.iter().filter(|p| p.iter().any(|v| *v > 0.0)).count() as f64
    }
}

/// Renders a world seen from (0, 0, -4) along +z with 40 degrees, unless `camera` says otherwise.
pub(super) fn render(world: &str, spp: u32) -> anyhow::Result<Picture> {
    with("LookAt 0 0 -4  0 0 0  0 1 0 Camera \"perspective\" \"float fov\" 40", world, spp, 16, true)
}

/// Renders with a camera of one's own and so many bounces.
pub(super) fn with(camera: &str, world: &str, spp: u32, depth: u32, robust: bool) -> anyhow::Result<Picture> {
    let settings = RenderSettings { max_depth: depth, ..RenderSettings::default() };
    picture(described(camera, world)?, spp, settings, robust)
}

/// The description of a world.
pub(super) fn described(camera: &str, world: &str) -> anyhow::Result<SceneDescription> {
    let text = format!(
        "{camera}\nFilm \"rgb\" \"integer xresolution\" {SIDE} \"integer yresolution\" {SIDE}\nPixelFilter \"box\"\nWorldBegin\n{world}\n"
    );
    load_pbrt_text(text.as_bytes(), Path::new("."), &LoadOptions::default())
        .map_err(|e| anyhow!("{}", e.report()))
}

/// Renders a description of the size of the other pictures.
pub(super) fn picture(
    description: SceneDescription,
    spp: u32,
    settings: RenderSettings,
    robust: bool,
) -> anyhow::Result<Picture> {
    let scene = Scene::build(description, BuildOptions { threads: 0, robust })?;
    let mut film = Film::new([SIDE; 2], [0, 0, SIDE, SIDE], FilmOptions::default());
    Renderer::new(&scene, settings, FilmOptions::default()).run(&mut film, &Wave::default(), |_, _| spp);
    Ok(Picture { pixels: film.beauty(), invalid: film.invalid_samples() })
}

/// Light of radiance 1 from everywhere.
pub(super) const WHITE: &str = "LightSource \"infinite\" \"rgb L\" [1 1 1]\n";
