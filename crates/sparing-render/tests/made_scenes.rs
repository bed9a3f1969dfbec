//! The scenes that are made to learn from, and those made to fool a sampler: all build, and show something.

mod common;

use common::render;
use sparing_image::color::luminance;
use sparing_image::film::Film;
use sparing_render::RenderSettings;
use sparing_scene::SceneDescription;
use sparing_scene::generate::training::{Split, scene};

/// A small picture at a few samples; `render` fails on any invalid one.
fn small(mut description: SceneDescription) -> Film {
    let film = &mut description.film;
    let longer = film.width.max(film.height);
    (film.width, film.height) = (film.width * 32 / longer, film.height * 32 / longer);
    let settings =
        RenderSettings { max_depth: description.integrator.max_depth, ..RenderSettings::default() };
    render(description, settings, 8)
}

#[test]
fn every_training_and_validation_scene_is_lit() {
    for split in [Split::Training, Split::Validation] {
        for (index, seed) in (0..split.scenes()).flat_map(|index| [(index, 1), (index, 77)]) {
            let description = scene(index, seed, split);
            let name = format!("{} of seed {seed}", description.name);
            let scale = f64::from(description.film.scale);
            let pixels = small(description).beauty();
            let values: Vec<f64> = pixels.iter().map(|p| luminance(*p)).collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64 / scale;
            assert!((1e-4..1e3).contains(&mean), "{name}: mean {mean}");
            let lit = values.iter().filter(|v| **v > 0.0).count() as f64 / values.len() as f64;
            // The dark frames are meant to be dark.
            let enough = if name.contains("dark-frame") { 0.01 } else { 0.05 };
            assert!(lit > enough, "{name}: {lit} of the pixels are lit");
            let spread = values.iter().fold(0.0, |a: f64, v| a.max(*v)) / (mean * scale);
            assert!(spread > 1.2, "{name}: nothing to see");
        }
    }
}

#[test]
fn every_guard_renders() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/tests/guards");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).expect("the guards are there") {
        let path = entry.expect("an entry").path();
        let description = sparing_scene::load(&path).expect("the guard loads");
        assert!(description.warnings.is_empty(), "{}: {:?}", path.display(), description.warnings);
        let film = &description.film;
        assert!(film.width.max(film.height) <= 128, "{}", path.display());
        let settings =
            RenderSettings { max_depth: description.integrator.max_depth, ..RenderSettings::default() };
        let pixels = render(description, settings, 4).beauty();
        assert!(pixels.iter().any(|p| luminance(*p) > 0.0), "{} is black", path.display());
        count += 1;
    }
    assert_eq!(count, 9);
}

#[test]
fn the_lit_block_is_one_tile() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/tests/guards/lit-block.pbrt");
    let mut description = sparing_scene::load(path.as_ref()).expect("the guard loads");
    description.filter = sparing_scene::description::PixelFilter::Box { radius: [0.5, 0.5] };
    let film = render(description, RenderSettings::default(), 8);
    let (width, pixels) = (film.width() as usize, film.beauty());
    let lit: Vec<(usize, usize)> =
        (0..pixels.len()).filter(|i| luminance(pixels[*i]) > 0.0).map(|i| (i % width, i / width)).collect();
    assert_eq!(lit.len(), 64);
    assert!(lit.iter().all(|(x, y)| (88..96).contains(x) && (24..32).contains(y)), "{:?}", lit[0]);
}

#[test]
fn the_constant_colour_has_no_variance() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/tests/guards/constant-colour.pbrt");
    let film = render(sparing_scene::load(path.as_ref()).expect("loads"), RenderSettings::default(), 16);
    let spread = film.map(|tile, i| tile.pixels[i].variance_of_mean().max_element());
    assert!(spread.iter().all(|v| v.abs() < 1e-15), "{:?}", spread[0]);
}

#[test]
fn written_scenes_render_the_same() {
    let folder = tempfile::tempdir().expect("a folder");
    for (index, split) in [(1, Split::Training), (6, Split::Training), (13, Split::Training)]
        .into_iter()
        .chain([(0, Split::Validation), (1, Split::Validation), (10, Split::Validation)])
    {
        let original = scene(index, 1, split);
        let path = folder.path().join("scene.pbrt");
        sparing_scene::save_pbrt(&original, &path).expect("it is written");
        let name = original.name.clone();
        let (before, after) =
            (small(original).beauty(), small(sparing_scene::load(&path).expect("loads")).beauty());
        // A ray may meet another leaf where a last bit differs.
        let same = |(a, b): &(&[f32; 3], &[f32; 3])| {
            let (a, b) = (luminance(**a), luminance(**b));
            (a - b).abs() <= 1e-3 * a.max(b)
        };
        let count = before.iter().zip(&after).filter(same).count();
        assert!(count * 100 >= before.len() * 98, "{name}: {count} of {} pixels are the same", before.len());
    }
}
