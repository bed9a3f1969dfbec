//! The eight features of Lin and Wu (2015, section III.D): of one pixel, raw, without its neighbours.
//!
//! Radiance enters as it is, in XYZ with white Y = 1. The older samples of a pixel are the first half of them, the new ones
//! the second, as a pixel always doubles.

use crate::features::FeatureMatrix;
use sparing_image::color::rgb_to_xyz;
use sparing_image::film::{Film, FilmOptions, Tile};

/// Number of features.
pub const COUNT: usize = 8;

/// Their names in cards, in the order of the columns.
pub const NAMES: [&str; COUNT] =
    ["shapes", "difference-x", "difference-y", "difference-z", "mean-x", "mean-y", "mean-z", "variance-y"];

/// What a film must keep for them.
pub const FILM: FilmOptions = FilmOptions { auxiliary: false, shapes: true, luminance: true };

/// The features of one pixel: distinct shapes that its camera rays met (a miss is one), the absolute differences of the
/// means of both halves, the means, and the variance of Y over the samples. All finite.
///
/// The report computes the variance by merging sets of equal size; of all samples, that is their population variance.
#[must_use]
pub fn features(tile: &Tile, index: usize) -> [f64; COUNT] {
    let pixel = &tile.pixels[index];
    let count = f64::from(pixel.count().max(1));
    let mean = rgb_to_xyz(pixel.mean().to_array());
    let difference = rgb_to_xyz(difference(tile, index));
    let squares = tile.luminance_squares.get(index).copied().unwrap_or(0.0);
    // Cancellation can leave a few ulp below zero.
    let variance = (squares / count - mean[1] * mean[1]).max(0.0);
    let shapes = tile.shapes.get(index).map_or(0, |s| s.len());
    [
        f64::from(shapes),
        difference[0].abs(),
        difference[1].abs(),
        difference[2].abs(),
        mean[0],
        mean[1],
        mean[2],
        variance,
    ]
}

/// Mean of the second half of the blocks less that of the first; 0 without two blocks.
fn difference(tile: &Tile, index: usize) -> [f64; 3] {
    let blocks = || tile.pixels[index].blocks();
    let half = blocks().count() / 2;
    let mean = |skip: usize| {
        let (mut sum, mut count) = ([0.0; 3], 0);
        for (block, n) in blocks().skip(skip).take(half) {
            sum.iter_mut().zip(block.to_array()).for_each(|(s, b)| *s += b);
            count += n;
        }
        sum.map(|s| s / f64::from(count.max(1)))
    };
    let (old, new) = (mean(0), mean(half));
    std::array::from_fn(|c| new[c] - old[c])
}

/// The features of all pixels of a film, in rows.
#[must_use]
pub fn matrix(film: &Film) -> FeatureMatrix {
    FeatureMatrix { features: COUNT, values: film.map(features).into_flattened() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn film(samples: &[Vec3]) -> Film {
        let mut film = Film::new([1, 1], [0, 0, 1, 1], FILM);
        for (i, sample) in samples.iter().enumerate() {
            film.tiles[0].add_sample(0, i as u32, *sample, 1.0);
        }
        film
    }

    fn values(samples: &[Vec3]) -> [f64; COUNT] {
        features(&film(samples).tiles[0], 0)
    }

    fn y(rgb: Vec3) -> f64 {
        rgb_to_xyz(rgb.as_dvec3().to_array())[1]
    }

    /// Mean and variance by the report's merging of halves.
    fn merged(values: &[f64]) -> (f64, f64) {
        if let [value] = values {
            return (*value, 0.0);
        }
        let (a, b) = values.split_at(values.len() / 2);
        let ((ma, va), (mb, vb)) = (merged(a), merged(b));
        (0.5 * (ma + mb), 0.25 * (2.0 * va + 2.0 * vb + (ma - mb).powi(2)))
    }

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() <= 1e-12 * b.abs().max(1.0), "{a} {b}");
    }

    #[test]
    fn known_values() {
        // Grey 1 four times, then grey 3: X, Y and Z of grey v are v times those of white.
        let mut film = film(&[[Vec3::ONE; 4], [Vec3::splat(3.0); 4]].concat());
        [7, 7, 0].iter().for_each(|id| film.tiles[0].shapes[0].insert(*id));
        let white = rgb_to_xyz([1.0; 3]);
        let found = features(&film.tiles[0], 0);
        assert_eq!(found[0], 2.0);
        for c in 0..3 {
            close(found[1 + c], 2.0 * white[c]);
            close(found[4 + c], 2.0 * white[c]);
        }
        close(found[7], white[1] * white[1]);
        // Differences have no sign; one channel moves all three of XYZ.
        let red = values(&[Vec3::X, Vec3::ZERO]);
        close(red[1], rgb_to_xyz([1.0, 0.0, 0.0])[0]);
        assert!(red[3] > 0.0);
    }

    #[test]
    fn merging_halves_gives_the_variance_of_all_samples() {
        let samples: Vec<Vec3> =
            (0..256).map(|i| Vec3::new((i * 37 % 101) as f32, 0.25 * (i % 7) as f32, 3.0)).collect();
        for n in [8, 16, 32, 64, 128, 256] {
            let ys: Vec<f64> = samples[..n].iter().map(|s| y(*s)).collect();
            let (mean, variance) = merged(&ys);
            let found = values(&samples[..n]);
            close(found[5], mean);
            close(found[7], variance);
            let population = ys.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n as f64;
            close(variance, population);
        }
    }

    #[test]
    fn hostile_pixels_have_finite_features() {
        let hostile = [Vec3::splat(f32::MAX), Vec3::splat(f32::NAN), Vec3::NEG_ONE, Vec3::splat(1e-45)];
        for n in [0, 1, 2, 3, 8, 9, 64] {
            for first in 0..hostile.len() {
                let samples: Vec<Vec3> = (0..n).map(|i| hostile[(first + i) % 4]).collect();
                assert!(values(&samples).iter().all(|v| v.is_finite() && *v >= 0.0), "{n} {first}");
            }
        }
        let bare = Film::new([3, 2], [0, 0, 3, 2], FilmOptions::default());
        assert_eq!(matrix(&bare).values, [0.0; 6 * COUNT]);
    }
}
