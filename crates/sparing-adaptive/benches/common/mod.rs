//! What the benches share: scenes like those of Lin and Wu (2015), and the models in the program.

use sparing_adaptive::goal::Goal;
use sparing_adaptive::machine::Machine;
use sparing_adaptive::policy::{Paper, Svm};
use sparing_render::{BuildOptions, RenderSettings, Scene};
use std::path::{Path, PathBuf};

/// Side of the pictures: 150 in the report.
pub const SIDE: u32 = 75;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A scene of `scenes/paper`, built for square pictures of [`SIDE`].
pub fn scene(name: &str) -> (Scene, RenderSettings) {
    let path = root().join("scenes/paper").join(name).with_extension("pbrt");
    let mut description = sparing_scene::load(&path).unwrap_or_else(|e| panic!("{}", e.report()));
    [description.film.width, description.film.height] = [SIDE; 2];
    let settings =
        RenderSettings { max_depth: description.integrator.max_depth, ..RenderSettings::default() };
    (Scene::build(description, BuildOptions::default()).expect("the scene builds"), settings)
}

/// The policy `svm` with the default model, for a tolerance of 1.
pub fn svm() -> Svm {
    let machine = Machine::read(root().join("models/svm/default.model")).expect("the default model");
    Svm::new(Goal::Tolerance(1.0), machine)
}

/// The sampler of 2015.
pub fn paper() -> Paper {
    Paper::read(root().join("models/svm/paper")).expect("the models of the sampler of 2015")
}
