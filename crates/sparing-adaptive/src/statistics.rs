//! Statistics of a pixel from its block means, for a tile at once.

use crate::view::DARK;
use multiversion::multiversion;
use sparing_image::color::fast::{ciede2000, rgb_to_lab};
use sparing_image::film::{BLOCKS, Pixel, TILE, Tile};

/// Statistics of one pixel, in exposed units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// Samples.
    pub count: u32,
    /// Mean radiance.
    pub mean: [f32; 3],
    /// Standard error of the mean from block means, for each channel: an over-estimate by
    /// [`BLOCK_EXCESS`](crate::view::BLOCK_EXCESS).
    pub error: [f32; 3],
    /// The same of the luminance, divided by the luminance plus [`DARK`].
    pub relative_error: f32,
    /// The same in CIEDE2000: half the difference between the mean plus and minus the error.
    pub perceived_error: f32,
    /// Mean of the first half of the blocks minus that of the second; 0 with fewer than two blocks.
    pub half_difference: [f32; 3],
    /// CIEDE2000 between the mean plus and minus half of that.
    pub perceived_half_difference: f32,
    /// L*a*b* of the mean as a display shows it: values beyond 1 are white.
    pub lab: [f32; 3],
    /// Luminance of the brightest block over that of the mean, 0 to 8; 1 where all is black.
    pub peak: f32,
    /// Share of the blocks that are black.
    pub zeros: f32,
    /// Distinct shapes that the camera rays met; 0 if the film does not count them.
    pub shapes: u32,
}

impl Default for Statistics {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl Statistics {
    /// Of a pixel without samples.
    pub const EMPTY: Self = Self {
        count: 0,
        mean: [0.0; 3],
        error: [0.0; 3],
        relative_error: 0.0,
        perceived_error: 0.0,
        half_difference: [0.0; 3],
        perceived_half_difference: 0.0,
        lab: [0.0; 3],
        peak: 1.0,
        zeros: 0.0,
        shapes: 0,
    };

    /// Statistics of a pixel. All are finite for any film; errors are 0 with fewer than two blocks.
    #[must_use]
    pub fn of(pixel: &Pixel, shapes: u32, exposure: f32) -> Self {
        let mut one = [Self::of_blocks(pixel, shapes, exposure)];
        perceive(&mut one, &mut Lanes::default());
        one[0]
    }

    /// All but what depends on perception: one look at the blocks, a second at their deviations, so that nothing cancels.
    fn of_blocks(pixel: &Pixel, shapes: u32, exposure: f32) -> Self {
        if pixel.count() == 0 {
            return Self { shapes, ..Self::EMPTY };
        }
        // Red, green, blue and luminance of the means of the blocks that are full.
        let mut blocks = [[0.0; 4]; BLOCKS];
        let (mut n, mut size) = (0, 0);
        for (sum, samples) in pixel.blocks() {
            if n == 0 {
                size = samples;
            }
            if samples == size {
                let [r, g, b] = (sum * (f64::from(exposure) / f64::from(size))).to_array();
                blocks[n] = [r, g, b, luminance([r, g, b])];
                n += 1;
            }
        }
        let blocks = &blocks[..n];
        let sum =
            |blocks: &[[f64; 4]]| blocks.iter().fold([0.0; 4], |s, b| std::array::from_fn(|c| s[c] + b[c]));
        let (first, second) = blocks.split_at(n / 2);
        let (first, second) = (sum(first), sum(second));
        let inverse = 1.0 / n as f64;
        let average: [f64; 4] = std::array::from_fn(|c| (first[c] + second[c]) * inverse);
        let (mut squares, mut largest, mut zeros) = ([0.0; 4], 0.0_f64, 0_u8);
        for block in blocks {
            for c in 0..4 {
                squares[c] += (block[c] - average[c]) * (block[c] - average[c]);
            }
            largest = largest.max(block[3]);
            zeros += u8::from(block[3] == 0.0);
        }
        let several = n >= 2;
        let error = |c: usize| if several { (squares[c] * inverse / (n - 1) as f64).sqrt() } else { 0.0 };
        let half = |c: usize| {
            if several { first[c] / (n / 2) as f64 - second[c] / (n - n / 2) as f64 } else { 0.0 }
        };
        let mean = (pixel.mean() * f64::from(exposure)).to_array();
        Self {
            count: pixel.count(),
            mean: mean.map(finite),
            error: std::array::from_fn(|c| finite(error(c))),
            relative_error: finite(error(3) / (luminance(mean) + DARK)),
            half_difference: std::array::from_fn(|c| finite(half(c))),
            peak: if average[3] > 0.0 { finite(largest / average[3]) } else { 1.0 },
            zeros: f32::from(zeros) * inverse as f32,
            shapes,
            ..Self::EMPTY
        }
    }
}

/// Luminance of linear Rec.709 (ITU-R BT.709-6, item 3.2).
fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Saturates: sums of f32 radiance can exceed f32.
fn finite(x: f64) -> f32 {
    if x.is_nan() { f32::MAX } else { x.clamp(-f64::from(f32::MAX), f64::from(f32::MAX)) as f32 }
}

const PIXELS: usize = (TILE * TILE) as usize;

/// Colours of the pixels of a tile, a channel at a time, for loops that the compiler turns into vector code.
struct Lanes {
    mean: [[f32; PIXELS]; 3],
    /// What is added to the mean and taken from it.
    offset: [[f32; PIXELS]; 3],
    lab: [[f32; PIXELS]; 3],
    difference: [f32; PIXELS],
}

impl Default for Lanes {
    fn default() -> Self {
        let channels = [[0.0; PIXELS]; 3];
        Self { mean: channels, offset: channels, lab: channels, difference: [0.0; PIXELS] }
    }
}

/// L*a*b* of the first `n` means, as a display shows them. No fused operations: the same bits on every machine.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2"))]
fn labs(lanes: &mut Lanes, n: usize) {
    let Lanes { mean: [r, g, b], lab: [l, a, bb], .. } = lanes;
    let n = n.min(PIXELS);
    for i in 0..n {
        [l[i], a[i], bb[i]] = rgb_to_lab([r[i], g[i], b[i]].map(|x| x.clamp(0.0, 1.0)));
    }
}

/// CIEDE2000 between the first `n` means plus and minus their offsets.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2"))]
fn differences(lanes: &mut Lanes, n: usize) {
    let Lanes { mean: [r, g, b], offset: [dr, dg, db], difference, .. } = lanes;
    let n = n.min(PIXELS);
    for i in 0..n {
        let plus = [r[i] + dr[i], g[i] + dg[i], b[i] + db[i]].map(|x| x.clamp(0.0, 1.0));
        let minus = [r[i] - dr[i], g[i] - dg[i], b[i] - db[i]].map(|x| x.clamp(0.0, 1.0));
        difference[i] = ciede2000(rgb_to_lab(plus), rgb_to_lab(minus));
    }
}

/// Fills in what depends on perception, for at most a tile.
fn perceive(statistics: &mut [Statistics], lanes: &mut Lanes) {
    let n = statistics.len();
    for (i, s) in statistics.iter().enumerate() {
        for c in 0..3 {
            lanes.mean[c][i] = s.mean[c];
            lanes.offset[c][i] = s.error[c];
        }
    }
    labs(lanes, n);
    differences(lanes, n);
    for (i, s) in statistics.iter_mut().enumerate() {
        s.lab = [0, 1, 2].map(|c| lanes.lab[c][i]);
        // Rounding leaves nothing where there is nothing.
        s.perceived_error = if s.error == [0.0; 3] { 0.0 } else { 0.5 * lanes.difference[i] };
        for c in 0..3 {
            lanes.offset[c][i] = 0.5 * s.half_difference[c];
        }
    }
    differences(lanes, n);
    for (i, s) in statistics.iter_mut().enumerate() {
        s.perceived_half_difference = if s.half_difference == [0.0; 3] { 0.0 } else { lanes.difference[i] };
    }
}

/// Brings the statistics of a tile up to date where counts have changed; `rows` begins at its first pixel and is `width`
/// wide.
pub(crate) fn update_tile(tile: &Tile, exposure: f32, rows: &mut [Statistics], width: usize) {
    let mut changed = [Statistics::EMPTY; PIXELS];
    let mut places = [0; PIXELS];
    let mut n = 0;
    for y in 0..tile.height {
        for x in 0..tile.width {
            let (i, at) = (tile.index(tile.x0 + x, tile.y0 + y), y as usize * width + x as usize);
            if tile.pixels[i].count() != rows[at].count {
                let shapes = tile.shapes.get(i).map_or(0, |s| s.len());
                (changed[n], places[n]) = (Statistics::of_blocks(&tile.pixels[i], shapes, exposure), at);
                n += 1;
            }
        }
    }
    if n > 0 {
        perceive(&mut changed[..n], &mut Lanes::default());
        for (at, statistics) in places.into_iter().zip(&changed[..n]) {
            rows[at] = *statistics;
        }
    }
}
