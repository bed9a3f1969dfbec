//! The exact report for each broken file of `tests/malformed`.

use std::fmt::Write;
use std::path::Path;

#[test]
fn every_malformed_file_has_one_clear_error() {
    let folder = Path::new("tests/malformed");
    let mut names: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    names.sort();
    assert!(names.len() > 60);
    let mut reports = String::new();
    for path in names {
        match sparing_scene::load(&path) {
            Ok(scene) => panic!("{} loads: {:?}", path.display(), scene.warnings),
            Err(error) => {
                let place = error.file().is_some();
                assert!(place, "{}: the error names no file", path.display());
                writeln!(reports, "{}", error.report()).unwrap();
            }
        }
    }
    insta::assert_snapshot!(reports);
}

#[test]
fn missing_files_and_folders_are_errors() {
    let report = |path: &str| sparing_scene::load(path.as_ref()).unwrap_err().to_string();
    assert_eq!(report("nowhere.pbrt"), "nowhere.pbrt: there is no such file");
    assert_eq!(report("tests/nowhere.obj"), "tests/nowhere.obj: there is no such file");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("folder.pbrt");
    std::fs::create_dir(&path).unwrap();
    let error = sparing_scene::load(&path).unwrap_err();
    assert_eq!(error.message(), "this is not a regular file");
}
