//! A validation scene set up for a comparison.

use sparing_image::film::{Film, FilmOptions};
use sparing_render::integrator::Wave;
use sparing_render::{BuildOptions, RenderSettings, Renderer, Scene};
use sparing_scene::generate::training::{Split, scene};

/// Seed of references: no policy is replayed with it.
const REFERENCE_SEED: u64 = 990_001;
/// Seed of the first replicate.
const FIRST_SEED: u64 = 7000;

/// A scene, built for pictures of a size.
pub struct Stage {
    pub name: String,
    pub scene: Scene,
    pub size: [u32; 2],
    settings: RenderSettings,
}

impl Stage {
    /// Validation scene number `index`, its picture's sides multiplied by `scale`.
    pub fn new(index: u32, scale: f64) -> Result<Self, Box<dyn std::error::Error>> {
        let mut description = scene(index, 1, Split::Validation);
        let side = |pixels: u32| (f64::from(pixels) * scale).round().max(1.0) as u32;
        let size = [side(description.film.width), side(description.film.height)];
        // The camera is built for the film's size.
        [description.film.width, description.film.height] = size;
        let settings = RenderSettings { max_depth: description.integrator.max_depth, ..Default::default() };
        let name = description.name.clone();
        let scene = Scene::build(description, BuildOptions { threads: 0, robust: true })?;
        Ok(Self { name, scene, size, settings })
    }

    /// Settings of replicate number `k`.
    pub fn replicate(&self, k: u64) -> RenderSettings {
        RenderSettings { seed: FIRST_SEED + k, ..self.settings }
    }

    /// An even render with a seed of its own.
    pub fn reference(&self, spp: u32) -> Film {
        let [width, height] = self.size;
        let mut film = Film::new(self.size, [0, 0, width, height], FilmOptions::default());
        let settings = RenderSettings { seed: REFERENCE_SEED, ..self.settings };
        let renderer = Renderer::new(&self.scene, settings, FilmOptions::default());
        renderer.run(&mut film, &Wave::default(), |_, _| spp);
        film
    }
}
