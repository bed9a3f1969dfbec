//! Writes the scenes to learn from and to validate with as pbrt files, with their pictures:
//! `cargo run --release -p sparing-scene --example training_scenes -- OUT_DIR [SEED]`

use sparing_scene::generate::training::{Split, scene};
use std::error::Error;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let out = PathBuf::from(arguments.next().ok_or("say where the scenes shall go")?);
    let seed = arguments.next().map_or(Ok(1), |text| text.parse())?;
    std::fs::create_dir_all(&out)?;
    for split in [Split::Training, Split::Validation] {
        for index in 0..split.scenes() {
            let scene = scene(index, seed, split);
            let path = out.join(&scene.name).with_extension("pbrt");
            sparing_scene::save_pbrt(&scene, &path)?;
            println!("{}", path.display());
        }
    }
    Ok(())
}
