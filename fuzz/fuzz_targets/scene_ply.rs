//! PLY files: an error or a valid scene, within the limits.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sparing_scene::LoadOptions;

fuzz_target!(|bytes: &[u8]| {
    let folder = std::env::temp_dir().join(format!("sparing-fuzz-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let path = folder.join("a.ply");
    std::fs::write(&path, bytes).expect("written");
    let options = LoadOptions {
        max_vertices: 100_000,
        max_triangles: 100_000,
        max_entities: 1000,
        ..LoadOptions::default()
    };
    if let Ok(scene) = sparing_scene::load_with(&path, &options) {
        scene.validate().expect("what loads is valid");
    }
});
