//! Renders the generated scenes to look at: `cargo run --release -p sparing-render --example training_sheet -- OUT`
//!
//! Writes one PNG for each scene of both splits at auto-exposure, and says what each costs and holds. Further
//! arguments: samples per pixel (64), seed (1), and scene files to render instead.

use sparing_image::color::{auto_exposure, luminance};
use sparing_image::film::{Film, FilmOptions};
use sparing_image::png::write_png;
use sparing_render::integrator::Wave;
use sparing_render::{BuildOptions, RenderSettings, Renderer, Scene};
use sparing_scene::SceneDescription;
use sparing_scene::generate::training::{Split, scene};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let out = PathBuf::from(arguments.next().ok_or("say where the pictures shall go")?);
    let spp = arguments.next().map_or(Ok(64), |text| text.parse())?;
    let seed = arguments.next().map_or(Ok(1), |text| text.parse())?;
    std::fs::create_dir_all(&out)?;
    println!("us/sample  mean      exposure  lit   invalid  scene");
    let files: Vec<String> = arguments.collect();
    for file in &files {
        picture(sparing_scene::load(file.as_ref())?, &out, spp)?;
    }
    if files.is_empty() {
        for split in [Split::Training, Split::Validation] {
            for index in 0..split.scenes() {
                picture(scene(index, seed, split), &out, spp)?;
            }
        }
    }
    Ok(())
}

fn picture(description: SceneDescription, out: &Path, spp: u32) -> Result<(), Box<dyn Error>> {
    let name = Path::new(&description.name).file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let max_depth = description.integrator.max_depth;
    let size = [description.film.width, description.film.height];
    let scene = Scene::build(description, BuildOptions::default())?;
    let settings = RenderSettings { max_depth, ..RenderSettings::default() };
    let mut film = Film::new(size, [0, 0, size[0], size[1]], FilmOptions::default());
    let start = Instant::now();
    let wave = Wave::default();
    Renderer::new(&scene, settings, FilmOptions::default()).run(&mut film, &wave, |_, _| spp);
    let cost = start.elapsed().as_secs_f64() * 1e6 / film.samples() as f64;
    let pixels = film.beauty();
    let count = pixels.len() as f64;
    let mean = pixels.iter().map(|p| luminance(*p)).sum::<f64>() / count;
    let lit = pixels.iter().filter(|p| luminance(**p) > 0.0).count() as f64 / count;
    let exposure = auto_exposure(&pixels);
    let invalid = film.invalid_samples();
    println!("{cost:9.2}  {mean:8.2e}  {exposure:8.2}  {:3.0}%  {invalid:7}  {name}", 100.0 * lit);
    write_png(&out.join(format!("{name}.png")), size[0], size[1], &pixels, exposure.log2())?;
    Ok(())
}
