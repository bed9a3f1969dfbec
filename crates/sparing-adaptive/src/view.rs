//! What is known of every pixel at a barrier.
//!
//! Radiance is multiplied by an exposure first ([`auto_exposure`] of the first layer unless given), so that 0.9 is bright, and
//! thresholds mean the same in every scene. The error of a pixel is estimated from the spread of its block means
//! ([`Pixel::blocks`]), which is honest under low-discrepancy sampling, where the variance of single samples is far too
//! large: measured, the estimate exceeds the true error by a nearly constant factor, [`BLOCK_EXCESS`].

use crate::pooling::Plane;
use rayon::prelude::*;
use sparing_image::color::{auto_exposure, ciede2000, luminance, rgb_to_lab};
use sparing_image::film::{BLOCKS, Film, Pixel};

/// By how much the spread of block means over-estimates the error under Owen-scrambled Sobol points, for 8 blocks.
pub const BLOCK_EXCESS: f64 = 1.35;

/// Luminance below which a relative error counts as if it were this bright, in exposed units.
pub const DARK: f64 = 0.1;

/// Statistics of one pixel, in exposed units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Samples.
    pub count: u32,
    /// Mean radiance.
    pub mean: [f32; 3],
    /// Standard error of the mean from block means, for each channel: an over-estimate by [`BLOCK_EXCESS`].
    pub error: [f32; 3],
    /// The same of the luminance, divided by the luminance plus [`DARK`].
    pub relative_error: f32,
    /// The same in CIEDE2000: half the difference between the mean plus and minus the error.
    pub perceived_error: f32,
    /// Mean of the first half of the blocks minus that of the second; 0 with fewer than two blocks.
    pub half_difference: [f32; 3],
    /// Luminance of the brightest block over that of the mean, 0 to 8; 1 where all is black.
    pub peak: f32,
    /// Share of the blocks that are black.
    pub zeros: f32,
    /// Distinct shapes that the camera rays met; 0 if the film does not count them.
    pub shapes: u32,
}

impl Statistics {
    /// Statistics of a pixel. All are finite for any film; errors are 0 with fewer than two blocks.
    #[must_use]
    pub fn of(pixel: &Pixel, shapes: u32, exposure: f32) -> Self {
        let scale = f64::from(exposure);
        let mean = (pixel.mean() * scale).to_array();
        let error = block_error(pixel).map(|e| e * scale);
        let luminance_of = |c: [f64; 3]| luminance(c.map(|x| x as f32));
        let (y, dy) = (luminance_of(mean), luminance_error(pixel) * scale);
        Self {
            count: pixel.count(),
            mean: mean.map(finite),
            error: error.map(finite),
            relative_error: finite(dy / (y + DARK)),
            perceived_error: finite(perceived(mean, error)),
            shapes,
            ..Self::default()
        }
        .with_blocks(pixel, exposure)
    }

    /// Adds what the blocks say beyond their spread.
    fn with_blocks(mut self, pixel: &Pixel, exposure: f32) -> Self {
        let mut blocks = [[0.0; 3]; BLOCKS];
        let mut n = 0;
        for (slot, block) in blocks.iter_mut().zip(full_blocks(pixel)) {
            *slot = block;
            n += 1;
        }
        let blocks = &blocks[..n];
        let y = |b: &[f64; 3]| 0.2126 * b[0] + 0.7152 * b[1] + 0.0722 * b[2];
        let (first, second) = blocks.split_at(n / 2);
        if n >= 2 {
            let mean =
                |half: &[[f64; 3]], c: usize| half.iter().map(|b| b[c]).sum::<f64>() / half.len() as f64;
            self.half_difference =
                std::array::from_fn(|c| finite((mean(first, c) - mean(second, c)) * f64::from(exposure)));
        }
        let mean = blocks.iter().map(y).sum::<f64>() / n.max(1) as f64;
        let largest = blocks.iter().map(y).fold(0.0, f64::max);
        self.peak = if mean > 0.0 { finite(largest / mean) } else { 1.0 };
        self.zeros = blocks.iter().filter(|b| **b == [0.0; 3]).count() as f32 / n.max(1) as f32;
        self
    }
}

/// Saturates: sums of f32 radiance can exceed f32.
fn finite(x: f64) -> f32 {
    if x.is_nan() { f32::MAX } else { x.clamp(-f64::from(f32::MAX), f64::from(f32::MAX)) as f32 }
}

/// Means of the blocks that are full, at most eight.
fn full_blocks(pixel: &Pixel) -> impl Iterator<Item = [f64; 3]> + '_ {
    let size = pixel.blocks().next().map_or(1, |b| b.1);
    pixel.blocks().filter(move |b| b.1 == size).map(move |b| (b.0 / f64::from(size)).to_array())
}

/// Standard error of the mean of `values`, from their spread about their own mean; two passes, so that nothing cancels.
fn standard_error(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let n = values.clone().count() as f64;
    if n < 2.0 {
        return 0.0;
    }
    let mean = values.clone().sum::<f64>() / n;
    let squares: f64 = values.map(|v| (v - mean) * (v - mean)).sum();
    (squares / (n * (n - 1.0))).sqrt()
}

fn block_error(pixel: &Pixel) -> [f64; 3] {
    let mut blocks = [[0.0; 3]; 8];
    let mut n = 0;
    for (slot, block) in blocks.iter_mut().zip(full_blocks(pixel)) {
        *slot = block;
        n += 1;
    }
    std::array::from_fn(|c| standard_error(blocks[..n].iter().map(move |b| b[c])))
}

fn luminance_error(pixel: &Pixel) -> f64 {
    let mut blocks = [0.0; 8];
    let mut n = 0;
    for (slot, block) in blocks.iter_mut().zip(full_blocks(pixel)) {
        *slot = luminance(block.map(|x| x as f32));
        n += 1;
    }
    standard_error(blocks[..n].iter().copied())
}

/// CIEDE2000 between the mean and the mean plus the error, as a display shows them: values beyond 1 are white.
fn perceived(mean: [f64; 3], error: [f64; 3]) -> f64 {
    if error.iter().all(|e| *e == 0.0) {
        return 0.0;
    }
    let lab = |sign: f64| rgb_to_lab(std::array::from_fn(|c| (mean[c] + sign * error[c]).clamp(0.0, 1.0)));
    ciede2000(lab(1.0), lab(-1.0)) / 2.0
}

/// Statistics of all pixels of a film, in rows.
#[derive(Clone, Debug)]
pub struct View {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// What radiance is multiplied by.
    pub exposure: f32,
    /// `width * height`
    pub pixels: Vec<Statistics>,
}

impl View {
    /// Looks at a film.
    #[must_use]
    pub fn new(film: &Film, exposure: f32) -> Self {
        let mut pixels = vec![Statistics::default(); film.width() as usize * film.height() as usize];
        let width = film.width() as usize;
        let parts: Vec<Vec<(usize, Statistics)>> = film
            .tiles
            .par_iter()
            .map(|tile| {
                let mut part = Vec::with_capacity(tile.pixels.len());
                for y in tile.y0..tile.y0 + tile.height {
                    for x in tile.x0..tile.x0 + tile.width {
                        let i = tile.index(x, y);
                        let shapes = tile.shapes.get(i).map_or(0, |s| s.len());
                        let at = (y - film.crop[1]) as usize * width + (x - film.crop[0]) as usize;
                        part.push((at, Statistics::of(&tile.pixels[i], shapes, exposure)));
                    }
                }
                part
            })
            .collect();
        for (at, statistics) in parts.into_iter().flatten() {
            pixels[at] = statistics;
        }
        Self { width, height: film.height() as usize, exposure, pixels }
    }

    /// The exposure that a film suggests.
    #[must_use]
    pub fn auto_exposure(film: &Film) -> f32 {
        auto_exposure(&film.beauty())
    }

    /// One number a pixel.
    pub fn plane(&self, f: impl Fn(&Statistics) -> f32 + Sync + Send) -> Plane {
        Plane { width: self.width, height: self.height, values: self.pixels.par_iter().map(f).collect() }
    }
}
