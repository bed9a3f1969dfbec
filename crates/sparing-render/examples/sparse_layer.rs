//! How fast a layer with few active pixels is, against a layer that takes as many samples of all pixels.
//!
//!     cargo run --release -p sparing-render --example sparse_layer -- SCENE [THREADS]
//!
//! One in a hundred pixels is active: together in a block, or spread over the picture. Rates differ by what the pixels cost;
//! that threads gain as much as in the full layer shows that they are busy to the end.

use sparing_image::film::{Film, FilmOptions, Tile};
use sparing_render::integrator::Wave;
use sparing_render::{BuildOptions, RenderSettings, Renderer, Scene};
use std::time::Instant;

const SIDE: u32 = 256;
const FIRST: u32 = 64;
const LAST: u32 = 512;

type Active = fn(u32, u32) -> bool;
/// 26 x 25 pixels together, and one in a hundred.
const CASES: [(&str, Active); 3] = [
    ("all", |_, _| true),
    ("block", |x, y| (115..141).contains(&x) && (180..205).contains(&y)),
    ("spread", |x, y| x % 10 == 3 && y % 10 == 7),
];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("which scene?")?;
    let most: usize = arguments.next().map_or(Ok(2), |n| n.parse())?;
    let mut description = sparing_scene::load(std::path::Path::new(&path))?;
    (description.film.width, description.film.height) = (SIDE, SIDE);
    let scene = Scene::build(description, BuildOptions { threads: most, robust: true })?;
    let renderer = Renderer::new(&scene, RenderSettings::default(), FilmOptions::default());
    for (name, active) in CASES {
        let last = if name == "all" { FIRST + 16 } else { LAST };
        let mut seconds = Vec::new();
        for threads in [1, most] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
            let best = (0..5).map(|_| pool.install(|| layer(&renderer, active, last))).min_by(f64::total_cmp);
            seconds.push(best.ok_or("no run")?);
        }
        let pixels = (0..SIDE * SIDE).filter(|i| active(i % SIDE, i / SIDE)).count();
        let samples = pixels as f64 * f64::from(last - FIRST);
        println!(
            "{name:8}{:8.3} million samples/s on 1 thread, {most} threads are {:.2} times as fast",
            samples / seconds[0] / 1e6,
            seconds[0] / seconds[1],
        );
    }
    Ok(())
}

/// Seconds of a layer that brings active pixels from [`FIRST`] to `last` samples.
fn layer(renderer: &Renderer<'_>, active: Active, last: u32) -> f64 {
    let mut film = Film::new([SIDE, SIDE], [0, 0, SIDE, SIDE], FilmOptions::default());
    // The counts are all that matters: the earlier samples are black.
    for tile in &mut film.tiles {
        for pixel in &mut tile.pixels {
            (0..FIRST).for_each(|_| pixel.add(glam::Vec3::ZERO));
        }
    }
    let start = Instant::now();
    renderer.run(&mut film, &Wave::default(), |tile: &Tile, index| {
        let (x, y) = tile.position(index);
        if active(x, y) { last } else { FIRST }
    });
    start.elapsed().as_secs_f64()
}
