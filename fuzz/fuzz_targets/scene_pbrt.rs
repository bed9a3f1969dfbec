//! pbrt text: an error, or a scene that is valid. Tokenizer, parser, and all directives; files are not found.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sparing_scene::{LoadOptions, load_pbrt_text};
use std::path::Path;

fuzz_target!(|text: &[u8]| {
    let limits = LoadOptions {
        folders: Some(Vec::new()),
        max_values: 1000,
        max_entities: 1000,
        max_nesting: 20,
        max_triangles: 10_000,
        max_vertices: 100_000,
        ..LoadOptions::default()
    };
    if let Ok(scene) = load_pbrt_text(text, Path::new("fuzz/seeds"), &limits) {
        scene.validate().expect("what loads is valid");
    }
});
