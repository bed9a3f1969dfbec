//! Sample-count maps and crops, policies side by side.

use super::plan::Plan;
use super::record::Record;
use super::results::{SceneResult, Study};
use crate::plot::{Anchor, Canvas, linear_pixels};
use anyhow::Context;
use sparing_image::exr::read_exr;
use sparing_image::metrics::false_color;
use sparing_image::png::write_png;
use std::path::Path;

/// PNG files of a scene.
pub(super) struct Pictures {
    pub(super) counts: Vec<u8>,
    pub(super) crops: Vec<u8>,
}

/// Columns that a tile fills at least, and the space between tiles and for their names.
const TILE_WIDTH: u32 = 220;
const GAP: u32 = 8;
const LABEL: u32 = 22;
/// Side of a crop as a share of the picture's.
const CROP: f64 = 1.0 / 3.0;

/// A small picture with its name.
struct Tile {
    label: String,
    size: [u32; 2],
    pixels: Vec<[f32; 3]>,
}

/// A render as far as it is shown.
struct Shown<'a> {
    record: &'a Record,
    pixels: Vec<[f32; 3]>,
    counts: Vec<f32>,
}

pub(super) fn write(plan: &Plan, study: &Study) -> anyhow::Result<Vec<Pictures>> {
    study.scenes.iter().map(|s| of_scene(plan, study, s)).collect()
}

fn of_scene(plan: &Plan, study: &Study, scene: &SceneResult) -> anyhow::Result<Pictures> {
    let runs = &scene.runs;
    let level = f64::from(study.levels.first().copied().unwrap_or(64));
    let mut shown = Vec::new();
    for record in study.policies.iter().filter_map(|p| runs.nearest(*p, level)) {
        let picture = read_exr(&record.picture(plan, &runs.name))?;
        let (pixels, counts) = (picture.rgb(""), picture.channel("SampleCount.Y").map(|c| c.data.clone()));
        let (pixels, counts) =
            pixels.zip(counts).context("a render has lost its channels; render it again")?;
        if pixels.len() != runs.reference.pixels.len() {
            anyhow::bail!("a render has another size than the reference; render it again");
        }
        shown.push(Shown { record, pixels, counts });
    }
    let file = |name: &str| plan.folder.join("pictures").join(format!("{}-{name}.png", runs.name));
    let counts = write_strip(&file("counts"), &counts(scene, &shown))?;
    let crops = write_strip(&file("crops"), &crops(scene, &shown))?;
    Ok(Pictures { counts, crops })
}

/// The picture, then counts in false colour by their logarithm, all on one scale.
fn counts(scene: &SceneResult, shown: &[Shown<'_>]) -> Vec<Tile> {
    let runs = &scene.runs;
    let adaptive = shown.iter().skip(1);
    let all = || adaptive.clone().flat_map(|s| &s.counts);
    let most = all().copied().fold(1.0, f32::max).log2();
    let least = all().copied().fold(f32::INFINITY, f32::min).clamp(1.0, 1e9).log2();
    let map = |n: &f32| false_color((n.max(1.0).log2() - least) / (most - least).max(1e-3));
    let reference =
        Tile { label: "reference".into(), size: runs.size, pixels: exposed(scene, &runs.reference.pixels) };
    let maps = adaptive.clone().map(|s| Tile {
        label: format!("{}, {:.0} spp", s.record.policy.name(), s.record.average_spp),
        size: runs.size,
        pixels: s.counts.iter().map(map).collect(),
    });
    std::iter::once(reference).chain(maps).collect()
}

/// The part where uniform sampling is worst: reference and policies.
fn crops(scene: &SceneResult, shown: &[Shown<'_>]) -> Vec<Tile> {
    let runs = &scene.runs;
    let size = runs.size.map(|s| ((f64::from(s) * CROP).round() as u32).clamp(1, s));
    let at = shown.first().map_or([0, 0], |uniform| worst(scene, &uniform.pixels, size));
    let cut = |pixels: &[[f32; 3]]| -> Vec<[f32; 3]> {
        let rows = (at[1]..at[1] + size[1]).map(|y| (y * runs.size[0] + at[0]) as usize);
        rows.flat_map(|i| exposed(scene, &pixels[i..i + size[0] as usize])).collect()
    };
    let reference = Tile { label: "reference".into(), size, pixels: cut(&runs.reference.pixels) };
    let renders = shown.iter().map(|s| Tile {
        label: format!("{}, {:.0} spp", s.record.policy.name(), s.record.average_spp),
        size,
        pixels: cut(&s.pixels),
    });
    std::iter::once(reference).chain(renders).collect()
}

fn exposed(scene: &SceneResult, pixels: &[[f32; 3]]) -> Vec<[f32; 3]> {
    pixels.iter().map(|p| p.map(|v| v * scene.runs.reference.exposure)).collect()
}

/// The corner of the window of the largest relative error, in steps of a quarter of the window.
fn worst(scene: &SceneResult, pixels: &[[f32; 3]], size: [u32; 2]) -> [u32; 2] {
    let [w, h] = scene.runs.size;
    let scale = scene.runs.reference.exposure;
    let errors: Vec<f32> = pixels
        .iter()
        .zip(&scene.runs.reference.pixels)
        .map(|(p, r)| {
            let e = |i: usize| ((p[i] - r[i]) * scale).abs() / ((r[i] * scale).abs() + 0.1);
            let sum = e(0) + e(1) + e(2);
            if sum.is_finite() { sum.min(3.0) } else { 3.0 }
        })
        .collect();
    let steps = |most: u32, size: u32| (0..=most - size).step_by((size / 4).max(1) as usize);
    let sum = |x: u32, y: u32| -> f32 {
        let rows = (y..y + size[1]).map(|r| (r * w + x) as usize);
        rows.map(|i| errors[i..i + size[0] as usize].iter().sum::<f32>()).sum()
    };
    let all = steps(h, size[1]).flat_map(|y| steps(w, size[0]).map(move |x| [x, y]));
    all.max_by(|a, b| sum(a[0], a[1]).total_cmp(&sum(b[0], b[1]))).unwrap_or([0, 0])
}

/// Writes tiles of one size in a row, each enlarged by a whole factor and named, and gives the file's bytes.
fn write_strip(path: &Path, tiles: &[Tile]) -> anyhow::Result<Vec<u8>> {
    let size = tiles.first().map_or([1, 1], |t| t.size);
    let factor = TILE_WIDTH.div_ceil(size[0]).max(1);
    let [tile_w, tile_h] = size.map(|s| s * factor);
    let width = tiles.len() as u32 * (tile_w + GAP) - GAP;
    let height = tile_h + LABEL;
    let mut labels = Canvas::new([f64::from(width), f64::from(LABEL)]);
    for (i, tile) in tiles.iter().enumerate() {
        let middle = f64::from(i as u32 * (tile_w + GAP)) + 0.5 * f64::from(tile_w);
        labels.text([middle, f64::from(LABEL) - 7.0], 13.0, Anchor::Middle, false, tile.label.clone());
    }
    let (_, _, mut pixels) = linear_pixels(&labels, 1.0);
    pixels.resize((width * height) as usize, [1.0; 3]);
    for (i, tile) in tiles.iter().enumerate() {
        let x0 = i as u32 * (tile_w + GAP);
        for y in 0..tile_h {
            let row = ((LABEL + y) * width + x0) as usize;
            for x in 0..tile_w {
                pixels[row + x as usize] = tile.pixels[(y / factor * size[0] + x / factor) as usize];
            }
        }
    }
    write_png(path, width, height, &pixels, 0.0)?;
    std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))
}
