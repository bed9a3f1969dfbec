//! Spreads what was taken from pixels over their neighbourhoods.

use crate::view::{DARK, View};
use rayon::prelude::*;
use sparing_image::color::luminance;

/// Pixels to each side: wide enough that an outlier hardly shows, narrow enough that little light leaves dark places.
const RADIUS: usize = 4;
/// Error of pixels that show none, in exposed units, so that shares are defined.
const LEAST_ERROR: f64 = 1e-6;

/// Light goes to pixels of about the same brightness: within bands this many octaves of luminance apart, which fade into each other.
/// Errors are larger where it is bright, so that one band would draw light out of the shadows.
const BAND: f64 = 2.0;
/// Luminance that is added first: what is darker is alike.
const BAND_FLOOR: f64 = 0.01;
/// What is brighter than this is alike, in bands above the floor.
const MOST_BANDS: f64 = 20.0;

/// No pixel changes by more than this share of its luminance plus [`DARK`]. Noise of single pixels, such as the outline of a lamp, is
/// no light that the neighbourhood lacks, and can be far brighter than it.
const MOST: f64 = 0.3;

/// Spreads `taken` (one colour a pixel, in rows) over squares of neighbours, in proportion to the root mean square error of 3 by
/// 3, among pixels of about the same brightness, and no pixel by more than 0.3 of its luminance plus [`DARK`]. But for that, the
/// sum over the picture is kept, to f32 rounding.
#[must_use]
pub fn spread_out(view: &View, taken: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let mut out = shares(view, taken);
    for (out, pixel) in out.iter_mut().zip(&view.pixels) {
        let change = luminance(*out).abs() * f64::from(view.exposure);
        let most = MOST * (luminance(pixel.mean) + DARK);
        if change > most {
            *out = out.map(|c| c * (most / change) as f32);
        }
    }
    out
}

fn shares(view: &View, taken: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let error = view.plane(|p| {
        let squares: f64 = p.error.iter().map(|e| f64::from(*e) * f64::from(*e)).sum();
        (squares / 3.0).sqrt().min(1e18) as f32
    });
    let spreading = Spreading {
        size: [view.width, view.height],
        error: error.pooled(0.0).values,
        light: view.plane(|p| luminance(p.mean) as f32).pooled(0.0).values,
        taken,
    };
    let mut out = vec![[0.0; 3]; taken.len()];
    let strips = out.par_chunks_mut((STRIP * view.width).max(1)).enumerate();
    strips.for_each(|(k, out)| spreading.strip(k * STRIP, out));
    out
}

/// Rows that one task works on: few enough for the cache, and enough that those around them, which it needs, too, are few.
const STRIP: usize = 32;

/// What light is spread by, one value a pixel.
struct Spreading<'a> {
    size: [usize; 2],
    /// Root mean square error of 3 by 3.
    error: Vec<f32>,
    /// Root mean square luminance of 3 by 3.
    light: Vec<f32>,
    taken: &'a [[f32; 3]],
}

impl Spreading<'_> {
    /// What the rows from `first` on get.
    fn strip(&self, first: usize, out: &mut [[f32; 3]]) {
        let [width, height] = self.size;
        // Who gives to them, and who takes from those.
        let top = first.saturating_sub(2 * RADIUS);
        let bottom = (first + out.len() / width + 2 * RADIUS).min(height);
        let rows = top * width..bottom * width;
        let taken = &self.taken[rows.clone()];
        let share: Vec<f64> = self.error[rows.clone()].iter().map(|e| f64::from(*e) + LEAST_ERROR).collect();
        let level: Vec<f64> = self.light[rows].iter().map(|y| level(f64::from(*y))).collect();
        let gives = || level.iter().zip(taken).filter(|(_, t)| **t != [0.0; 3]).map(|(l, _)| *l);
        let lowest = gives().fold(f64::INFINITY, f64::min);
        let highest = gives().fold(0.0, f64::max).ceil() as usize;
        let mut sums = vec![[0.0; 3]; out.len()];
        // Without anything to give, `lowest` is infinite and there are no bands.
        for band in lowest as usize..=highest {
            let of_band = |level: &f64| (1.0 - (level - band as f64).abs()).max(0.0);
            let membership: Vec<f64> = level.iter().map(of_band).collect();
            let share: Vec<f64> = share.iter().zip(&membership).map(|(s, m)| s * m).collect();
            let whole = box_sums(width, &share);
            for c in 0..3 {
                let part = |((t, whole), m): ((&[f32; 3], &f64), &f64)| {
                    if *m > 0.0 { m * f64::from(t[c]) / whole } else { 0.0 }
                };
                let parts: Vec<f64> = taken.iter().zip(&whole).zip(&membership).map(part).collect();
                let got = box_sums(width, &parts).into_iter().zip(&share).skip((first - top) * width);
                sums.iter_mut().zip(got).for_each(|(sum, (part, share))| sum[c] += part * share);
            }
        }
        for (out, sum) in out.iter_mut().zip(&sums) {
            *out = sum.map(|s| s.clamp(-f64::from(f32::MAX), f64::from(f32::MAX)) as f32);
        }
    }
}

/// A luminance in bands above the floor.
fn level(luminance: f64) -> f64 {
    ((luminance / BAND_FLOOR).ln_1p() / (BAND * std::f64::consts::LN_2)).min(MOST_BANDS)
}

/// Sums over squares of side `2 RADIUS + 1`, cut at the border. Added in an order that depends on the square only.
fn box_sums(width: usize, values: &[f64]) -> Vec<f64> {
    let mut lines = vec![0.0; values.len()];
    let mut line = vec![0.0; width + 2 * RADIUS];
    for (out, row) in lines.chunks_mut(width).zip(values.chunks(width)) {
        line[RADIUS..RADIUS + width].copy_from_slice(row);
        for shift in 0..=2 * RADIUS {
            out.iter_mut().zip(&line[shift..]).for_each(|(o, v)| *o += v);
        }
    }
    let height = values.len() / width;
    let mut sums = vec![0.0; values.len()];
    for (y, out) in sums.chunks_mut(width).enumerate() {
        for row in y.saturating_sub(RADIUS)..(y + RADIUS + 1).min(height) {
            out.iter_mut().zip(&lines[row * width..]).for_each(|(o, v)| *o += v);
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::Statistics;

    fn view(width: usize, height: usize, error: impl Fn(usize) -> f32) -> View {
        let pixels = (0..width * height).map(|i| Statistics { error: [error(i); 3], ..Default::default() });
        View { width, height, exposure: 1.0, error_scale: 1.0, pixels: pixels.collect() }
    }

    #[test]
    fn nothing_is_lost_or_made() {
        for (width, height) in [(1, 1), (3, 2), (30, 20), (1, 40)] {
            let view = view(width, height, |i| [0.0, 1e-3, 2.0, 1e10][i % 7 % 4]);
            let taken: Vec<[f32; 3]> = (0..width * height)
                .map(|i| [(i % 5) as f32, -((i % 3) as f32), 1e4 * (i % 11) as f32])
                .collect();
            let out = shares(&view, &taken);
            for c in 0..3 {
                let sum = |v: &[[f32; 3]]| v.iter().map(|p| f64::from(p[c])).sum::<f64>();
                let scale: f64 = taken.iter().map(|p| f64::from(p[c].abs())).sum();
                assert!((sum(&out) - sum(&taken)).abs() <= 1e-6 * scale, "{width}x{height} {c}");
            }
        }
    }

    #[test]
    fn an_outlier_goes_to_uncertain_neighbours() {
        // The right half shows no error.
        let view = view(21, 21, |i| if i % 21 < 12 { 1.0 } else { 0.0 });
        let mut taken = vec![[0.0; 3]; 21 * 21];
        taken[10 * 21 + 10] = [54.0, 0.0, 0.0];
        let out = shares(&view, &taken);
        assert!((out[10 * 21 + 10][0] - 54.0 / 63.0).abs() < 0.1, "{}", out[10 * 21 + 10][0]);
        assert!(out[10 * 21 + 14][0] < 1e-3 && out[10 * 21 + 5][0] == 0.0);
    }

    #[test]
    fn light_stays_where_it_is_as_bright() {
        // The right half is a hundred times brighter, and its error is.
        let mut view = view(21, 21, |i| if i % 21 < 10 { 0.1 } else { 10.0 });
        for (i, pixel) in view.pixels.iter_mut().enumerate() {
            pixel.mean = [if i % 21 < 10 { 0.05 } else { 5.0 }; 3];
        }
        let mut taken = vec![[0.0; 3]; 21 * 21];
        taken[10 * 21 + 7] = [1.0; 3];
        let out = shares(&view, &taken);
        let sum = |columns: std::ops::Range<usize>| -> f32 {
            out.iter().enumerate().filter(|(i, _)| columns.contains(&(i % 21))).map(|(_, c)| c[1]).sum()
        };
        // The 3 by 3 of the border's pixels see the other side.
        assert!((sum(0..21) - 1.0).abs() < 1e-6);
        assert!(sum(0..9) > 0.9 && sum(10..21) < 1e-6, "{} {}", sum(0..9), sum(10..21));
    }

    #[test]
    fn huge_errors_stay_finite() {
        let view = view(9, 9, |_| f32::MAX);
        for taken in [1.0, f32::MAX, -f32::MAX] {
            let out = spread_out(&view, &[[taken; 3]; 81]);
            assert!(out.iter().flatten().all(|v| v.is_finite()), "{taken}");
        }
    }

    #[test]
    fn no_pixel_changes_by_much() {
        let view = view(9, 9, |_| 1.0);
        let out = spread_out(&view, &[[1e3; 3]; 81]);
        assert!(out.iter().all(|c| (luminance(*c) - MOST * DARK).abs() < 1e-6), "black pixels");
        let out = spread_out(&view, &[[1e-3; 3]; 81]);
        let mean = out.iter().map(|c| f64::from(c[1])).sum::<f64>() / 81.0;
        assert!((mean - 1e-3).abs() < 1e-8, "small changes are not bounded: {mean}");
    }
}
