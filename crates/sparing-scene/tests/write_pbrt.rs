//! Scenes written as pbrt text read back the same.

use sparing_scene::SceneDescription;
use sparing_scene::description::{Geometry, ImageSource, TriangleMesh};
use sparing_scene::generate::icosphere;
use sparing_scene::generate::training::{Split, scene};
use std::path::{Path, PathBuf};

/// Everything but what may change: names and the numbering and places of pictures.
fn comparable(scene: &SceneDescription) -> (String, Vec<String>) {
    let mut scene = scene.clone();
    scene.name.clear();
    scene.warnings.clear();
    scene.materials.iter_mut().for_each(|m| m.name.clear());
    scene.objects.iter_mut().for_each(|o| o.name.clear());
    let bytes = |source: ImageSource| match source {
        ImageSource::File(path) => std::fs::read(path).expect("a picture"),
        ImageSource::Bytes { bytes, .. } => bytes.to_vec(),
    };
    let images =
        scene.images.drain(..).map(|image| format!("{:?} {:?}", image.encoding, bytes(image.source)));
    let mut images: Vec<String> = images.collect();
    images.sort();
    images.dedup();
    let text = format!("{scene:?}");
    let parts = text.split("ImageId(").map(|part| part.split_once(')').map_or(part, |(_, rest)| rest));
    (parts.collect(), images)
}

/// The same but for the last bits of numbers: the loader makes normals and axes unit.
#[track_caller]
fn assert_same(a: &SceneDescription, b: &SceneDescription) {
    let (a, b) = ((&a.name, comparable(a)), comparable(b));
    assert!(a.1.1 == b.1, "{}: pictures", a.0);
    fn words(text: &str) -> impl Iterator<Item = &str> {
        text.split(|c: char| !(c.is_ascii_alphanumeric() || "+-._\"".contains(c)))
            .filter(|word| !word.is_empty())
    }
    assert_eq!(words(&a.1.0).count(), words(&b.0).count(), "{}", a.0);
    for (i, (x, y)) in words(&a.1.0).zip(words(&b.0)).enumerate() {
        let close = || Some((x.parse::<f64>().ok()?, y.parse::<f64>().ok()?));
        let close = close().is_some_and(|(x, y)| (x - y).abs() <= 1e-6 * x.abs().max(1.0));
        assert!(x == y || close, "{}: word {i}: {x} is now {y}", a.0);
    }
}

fn written(scene: &SceneDescription, folder: &Path, name: &str) -> SceneDescription {
    let path = folder.join(name);
    sparing_scene::save_pbrt(scene, &path).unwrap_or_else(|error| panic!("{}", error.report()));
    let back = sparing_scene::load(&path).unwrap_or_else(|error| panic!("{}", error.report()));
    assert_eq!(back.warnings, Vec::<String>::new(), "{}", scene.name);
    back
}

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn scenes_of_the_repository_read_back_the_same() {
    let folder = tempfile::tempdir().expect("a folder");
    for from in ["scenes", "scenes/tests", "scenes/tests/guards", "crates/sparing-scene/tests/fixtures"] {
        for entry in std::fs::read_dir(repository().join(from)).expect("scenes") {
            let path = entry.expect("an entry").path();
            if path.extension().is_none_or(|e| e != "pbrt") {
                continue;
            }
            let original = sparing_scene::load(&path).expect("loads");
            assert_same(&original, &written(&original, folder.path(), "written.pbrt"));
        }
    }
}

#[test]
fn made_scenes_read_back_the_same() {
    let folder = tempfile::tempdir().expect("a folder");
    for split in [Split::Training, Split::Validation] {
        for index in 0..split.scenes() / 2 {
            let original = scene(index, 3, split);
            let back = written(&original, folder.path(), &format!("{}.pbrt", original.name));
            assert_same(&original, &back);
        }
    }
}

#[test]
fn what_pbrt_cannot_say_is_an_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.pbrt");
    let mut colored = scene(0, 1, Split::Training);
    let mesh = TriangleMesh { colors: Some(vec![[1.0; 4]; 12]), ..icosphere(0) };
    colored.shapes[0].geometry = Geometry::Triangles(mesh);
    let message = sparing_scene::save_pbrt(&colored, &path).expect_err("refused").to_string();
    assert_eq!(message, format!("{}: pbrt files cannot say the colours of vertices", path.display()));
    assert!(!path.exists(), "no half of a file");
    let mut broken = scene(0, 1, Split::Training);
    broken.shapes[0].material.0 = 1000;
    assert!(sparing_scene::save_pbrt(&broken, &path).is_err());
    let nowhere = folder.path().join("no/such/folder/scene.pbrt");
    assert!(sparing_scene::save_pbrt(&scene(0, 1, Split::Training), &nowhere).is_err());
}

#[test]
fn names_are_quoted_and_made_unique() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut original = scene(13, 1, Split::Training);
    for (material, name) in
        original.materials.iter_mut().zip(["", "a\"", "a\"", "back\\slash\\", "two\nlines"])
    {
        material.name = name.to_owned();
    }
    original.objects.iter_mut().for_each(|object| object.name = "\"".to_owned());
    let back = written(&original, folder.path(), "scene.pbrt");
    assert_same(&original, &back);
    let names: Vec<&str> = back.materials.iter().take(5).map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["material 0", "a\"", "a\" 2", "back\\slash\\", "two lines"]);
}

/// What only older versions have names for, and every class of textures and lights.
#[test]
fn fixtures_read_back_the_same() {
    for name in ["everything.pbrt", "older.pbrt"] {
        let scene = sparing_scene::load(&Path::new("tests/fixtures").join(name)).expect("it loads");
        let folder = tempfile::tempdir().expect("a folder");
        let back = written(&scene, folder.path(), name);
        assert_eq!(back.materials.len(), scene.materials.len());
        assert_eq!(back.textures.len(), scene.textures.len());
        assert_eq!(back.lights.len(), scene.lights.len());
        let again = written(&back, folder.path(), "again.pbrt");
        assert_same(&back, &again);
    }
}
