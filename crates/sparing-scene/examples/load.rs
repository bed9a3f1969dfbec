//! Loads scene files and says what is in them: `cargo run -p sparing-scene --example load -- FILES...`
//!
//! Prints one line a file, its warnings with `-v`, and the full report of an error. Exit code 1 if any failed.

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

fn main() -> ExitCode {
    let mut failed = 0;
    let mut verbose = false;
    for argument in std::env::args().skip(1) {
        if argument == "-v" {
            verbose = true;
            continue;
        }
        let start = Instant::now();
        match sparing_scene::load(Path::new(&argument)) {
            Ok(scene) => {
                println!(
                    "{argument}: {} triangles, {} shapes, {} objects, {} instances, {} lights, {} emitters, \
                     {} materials, {} textures, {} images, {} warnings, {:.0} ms",
                    scene.triangle_count(),
                    scene.shapes.len(),
                    scene.objects.len(),
                    scene.instances.len(),
                    scene.lights.len(),
                    scene.shapes.iter().filter(|shape| shape.emission.is_some()).count(),
                    scene.materials.len(),
                    scene.textures.len(),
                    scene.images.len(),
                    scene.warnings.len(),
                    start.elapsed().as_secs_f64() * 1e3
                );
                if verbose {
                    scene.warnings.iter().for_each(|warning| println!("  warning: {warning}"));
                }
            }
            Err(error) => {
                failed += 1;
                println!("{}", error.report());
            }
        }
    }
    if failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
