//! Figures of error against values from elsewhere: `scripts/flip-values.py` makes the table and the same pictures.

use anyhow::Context;
use sparing_image::metrics::{Exposure, FlipOptions, compare, flip_map};

const VALUES: &str = include_str!("../../../crates/sparing-image/tests/data/flip.txt");
const WIDTH: u32 = 64;
const HEIGHT: u32 = 48;

/// A line of the table.
struct Expected {
    image: Vec<[f32; 3]>,
    reference: Vec<[f32; 3]>,
    flip: f64,
    rel_mse: f64,
    /// FLIP at single pixels.
    pixels: Vec<([usize; 2], f64)>,
}

/// Largest difference from FLIP of the authors' program: means and single pixels.
pub(super) fn flip() -> anyhow::Result<f64> {
    let mut worst: f64 = 0.0;
    for e in table()? {
        let options = FlipOptions::default();
        let map = flip_map(&e.image, &e.reference, WIDTH, HEIGHT, Exposure::Scale(1.0), &options)?;
        let mean = map.iter().map(|v| f64::from(*v)).sum::<f64>() / map.len() as f64;
        worst = worst.max((mean - e.flip).abs());
        for ([x, y], value) in e.pixels {
            worst = worst.max((f64::from(map[y * WIDTH as usize + x]) - value).abs());
        }
    }
    Ok(worst)
}

/// Largest relative difference from relMSE in exact fractions.
pub(super) fn rel_mse() -> anyhow::Result<f64> {
    let mut worst: f64 = 0.0;
    for e in table()? {
        let c = compare(&e.image, &e.reference, WIDTH, HEIGHT, Exposure::Scale(1.0))?;
        worst = worst.max((c.rel_mse / e.rel_mse - 1.0).abs());
    }
    Ok(worst)
}

fn table() -> anyhow::Result<Vec<Expected>> {
    let places =
        VALUES.lines().find_map(|l| l.split_once("single pixels: ")).context("no pixels are named")?.1;
    let places: Vec<[usize; 2]> = places
        .split_whitespace()
        .filter_map(|p| p.split_once(','))
        .map(|(x, y)| Ok([x.parse()?, y.parse()?]))
        .collect::<anyhow::Result<_>>()?;
    let lines = VALUES.lines().filter(|l| !l.starts_with('#') && !l.is_empty());
    let table: Vec<Expected> = lines
        .map(|line| {
            let (name, values) = line.split_once(' ').context("a name and values")?;
            let values: Vec<f64> = values.split(' ').map(str::parse).collect::<Result<_, _>>()?;
            anyhow::ensure!(values.len() == 2 + places.len(), "{name}: {} values", values.len());
            let picture = |which: usize| {
                (0..HEIGHT)
                    .flat_map(|y| (0..WIDTH).map(move |x| (x, y)))
                    .map(|(x, y)| [0, 1, 2].map(|c| pair(name, x, y, c)[which] as f32 / 1024.0))
                    .collect()
            };
            Ok(Expected {
                image: picture(0),
                reference: picture(1),
                flip: values[0],
                rel_mse: values[1],
                pixels: places.iter().copied().zip(values[2..].iter().copied()).collect(),
            })
        })
        .collect::<anyhow::Result<_>>()?;
    anyhow::ensure!(table.len() == 8, "{} pairs of pictures", table.len());
    Ok(table)
}

/// 0 to 1023, by a hash.
fn noise(x: u32, y: u32, channel: u32, seed: u32) -> u32 {
    let mut h = x.wrapping_mul(73_856_093);
    for (value, factor) in [(y, 19_349_663), (channel, 83_492_791), (seed, 2_654_435_761)] {
        h = h.wrapping_add(value.wrapping_mul(factor));
    }
    h = (h ^ (h >> 15)).wrapping_mul(2_246_822_519);
    h = (h ^ (h >> 13)).wrapping_mul(3_266_489_917);
    (h ^ (h >> 16)) % 1024
}

/// A channel of picture and reference, in units of 1/1024. Names that are not known are black.
fn pair(name: &str, x: u32, y: u32, c: u32) -> [u32; 2] {
    let smooth = [x * 16, y * 21, (x + y) * 9][c as usize];
    let edge = |at: u32| if x + y / 2 < at { 900 } else { 100 };
    let block = |seed: u32| noise(x / 8, y / 8, c, seed);
    match name {
        "gradient-noise" => [(smooth + noise(x, y, c, 1) / 8).saturating_sub(64).min(1023), smooth],
        "gradient-speckle" => [if noise(x, y, 0, 2) < 20 { 1023 } else { smooth }, smooth],
        "edge-shifted" => [edge(41), edge(40)],
        "blocks" => [block(3), block(4)],
        "blocks-tinted" => [if c == 2 { block(3) * 7 / 8 } else { block(3) }, block(3)],
        "points" => [if x % 7 == 3 && y % 5 == 2 { 1023 } else { 30 }, 30],
        "dark" => [5, 6].map(|seed| noise(x, y, c, seed) / 64),
        "opposite" => [1, 2].map(|own| if c == own { 1023 } else { 0 }),
        _ => [0, 0],
    }
}
