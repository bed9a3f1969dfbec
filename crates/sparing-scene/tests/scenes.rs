//! All scenes and meshes of the repository load without a warning.

use std::path::{Path, PathBuf};

fn files(folder: &str, extension: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(folder);
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.filter(|path| path.extension().is_some_and(|found| found == extension)).collect()
}

#[test]
fn scenes_and_meshes_load_without_warnings() {
    let folders = ["scenes", "scenes/tests", "scenes/tests/guards"];
    let mut paths = folders.map(|folder| files(folder, "pbrt")).concat();
    paths.extend(files("models/meshes", "obj"));
    assert!(paths.len() > 15, "{paths:?}");
    for path in paths {
        let scene = sparing_scene::load(&path).unwrap_or_else(|error| panic!("{}", error.report()));
        assert_eq!(scene.warnings, Vec::<String>::new(), "{}", path.display());
    }
}
