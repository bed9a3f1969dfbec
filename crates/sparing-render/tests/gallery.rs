//! All scenes of the gallery load without a warning and render.

mod common;
#[allow(dead_code, reason = "its `main`")]
#[path = "../../sparing-scene/examples/gallery/main.rs"]
mod generator;

use common::film_mean;
use sparing_image::film::FilmOptions;
use sparing_render::integrator::Wave;
use sparing_render::{BuildOptions, RenderSettings, Renderer, Scene};
use std::path::{Path, PathBuf};

/// Copies the files of a folder of scenes; where to.
fn copy(name: &str, to: &Path) -> Vec<PathBuf> {
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name);
    let to = to.join(name);
    std::fs::create_dir_all(&to).expect("a folder");
    let files = std::fs::read_dir(from).expect("a folder").map(|entry| entry.expect("an entry").path());
    files
        .filter(|path| path.is_file())
        .map(|path| {
            let copy = to.join(path.file_name().expect("a name"));
            std::fs::copy(&path, &copy).expect("a copy");
            copy
        })
        .collect()
}

#[test]
fn every_scene_renders() {
    let folder = tempfile::tempdir().expect("a folder");
    generator::make(&folder.path().join("gallery/made")).expect("the meshes");
    copy("textures", folder.path());
    let mut count = 0;
    for path in copy("gallery", folder.path()) {
        let mut scene = sparing_scene::load(&path).unwrap_or_else(|error| panic!("{}", error.report()));
        let place = path.display();
        // The lamp that passes lights the scene by chance; docs/gallery.md shows that.
        let known = |w: &String| w.contains("moves") && path.ends_with("motion.pbrt");
        scene.warnings.retain(|warning| !known(warning));
        assert_eq!(scene.warnings, Vec::<String>::new(), "{place}");
        [scene.film.width, scene.film.height] = [32, 24];
        scene.film.crop = None;
        let settings = RenderSettings { max_depth: scene.integrator.max_depth, ..RenderSettings::default() };
        let scene = Scene::build(scene, BuildOptions::default()).expect("it builds");
        let (size, options) = ([32, 24], FilmOptions::default());
        let mut film = sparing_image::film::Film::new(size, [0, 0, 32, 24], options);
        Renderer::new(&scene, settings, options).run(&mut film, &Wave::default(), |_, _| 2);
        let (mean, _) = film_mean(&film);
        assert!(mean.is_finite() && (0.01..10.0).contains(&mean), "{place}: mean {mean}");
        count += 1;
    }
    assert!(count >= 8, "{count}");
}
