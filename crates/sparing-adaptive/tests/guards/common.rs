//! Scenes at small sizes, all policies, renders.

use sparing_adaptive::goal::{Bounds, Goal};
use sparing_adaptive::layers::{Limits, Outcome, Unwatched, render};
use sparing_adaptive::machine::Machine;
use sparing_adaptive::policy::{HalfBuffer, Paper, Planned, Policy, Shapes, Svm, Threshold};
use sparing_adaptive::state::State;
use sparing_image::film::Film;
use sparing_render::{BuildOptions, RenderSettings, Renderer, Scene};
use sparing_scene::SceneDescription;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::sync::atomic::AtomicBool;

pub const BOUNDS: Bounds = Bounds { min_spp: 8, max_spp: 512 };

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The machine that comes with the program.
pub static MACHINE: LazyLock<Machine> =
    LazyLock::new(|| Machine::read(root().join("models/svm/default.model")).expect("the shipped model"));
/// The machines of 2015 that come with it.
pub static PAPER: LazyLock<Paper> =
    LazyLock::new(|| Paper::read(root().join("models/svm/paper")).expect("the shipped models of 2015"));

/// All adaptive policies; those that have no goal leave it.
pub fn policies(goal: Goal) -> Vec<Box<dyn Policy>> {
    vec![
        Box::new(Threshold::new(goal)),
        Box::new(Svm::new(goal, MACHINE.clone())),
        Box::new(Planned { goal }),
        Box::new(PAPER.clone()),
        Box::new(Shapes),
        Box::new(HalfBuffer { threshold: 0.01 }),
    ]
}

/// A guard of this width, in its own proportions. The camera is fixed when a scene is built, so the size comes first.
pub fn guard(name: &str, width: u32) -> SceneDescription {
    let path = root().join("scenes/tests/guards").join(name).with_extension("pbrt");
    let mut description = sparing_scene::load(&path).expect("the guard loads");
    let film = &mut description.film;
    (film.width, film.height) = (width, (film.height * width).div_ceil(film.width));
    description
}

/// A scene that is built, and what its file says about paths.
pub struct Stage {
    pub scene: Scene,
    pub size: [u32; 2],
    max_depth: u32,
}

impl Stage {
    pub fn new(description: SceneDescription) -> Self {
        let size = [description.film.width, description.film.height];
        let max_depth = description.integrator.max_depth;
        let options = BuildOptions { threads: 1, robust: true };
        Self { scene: Scene::build(description, options).expect("the scene builds"), size, max_depth }
    }

    pub fn settings(&self, seed: u64) -> RenderSettings {
        RenderSettings { seed, max_depth: self.max_depth, ..RenderSettings::default() }
    }

    /// Renders the picture, or a crop of it.
    pub fn render(
        &self,
        seed: u64,
        crop: Option<[u32; 4]>,
        policy: &mut dyn Policy,
        limits: &Limits,
    ) -> (Film, Outcome) {
        let options = policy.film_options();
        let crop = crop.unwrap_or([0, 0, self.size[0], self.size[1]]);
        let mut state = State::new(Film::new(self.size, crop, options));
        let renderer = Renderer::new(&self.scene, self.settings(seed), options);
        let interrupt = AtomicBool::new(false);
        let outcome = render(&renderer, &mut state, policy, limits, &interrupt, &mut Unwatched);
        (state.film, outcome)
    }
}

pub fn limits(bounds: Bounds) -> Limits {
    Limits { bounds, time: None, exposure: None }
}

pub fn counts(film: &Film) -> Vec<u32> {
    film.map(|t, i| t.pixels[i].count())
}

pub fn average(film: &Film) -> f64 {
    film.samples() as f64 / (f64::from(film.width()) * f64::from(film.height()))
}
