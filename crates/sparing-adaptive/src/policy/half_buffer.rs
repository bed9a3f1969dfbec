//! The half-buffer rule, for studies: Dammertz, Hanika, Keller and Lensch 2010, "A hierarchical automatic stopping
//! condition for Monte Carlo global illumination", section 2.1, for single pixels as in Blender's Cycles.
//!
//! The error of a pixel is the difference between its mean and the mean of half of its samples, over the square root of
//! its brightness. Cycles keeps every other sample in a second buffer; here the half are the even ones of the film's
//! eight blocks, which are as many samples. A pixel stops when its error is below the threshold; neighbours of a pixel
//! that goes on go on too (Cycles' filter of 3 by 3).

use super::{Barrier, Decisions, Policy, doubled};
use crate::goal::Bounds;
use crate::pooling::Plane;
use sparing_image::film::Pixel;

/// Samples before the first look: with eight, four samples against eight say next to nothing.
const MIN_SPP: u32 = 16;
/// Added to the square root of the brightness, against division by zero; Cycles' value.
const EPSILON: f64 = 1e-4;

/// A pixel goes on while it, or one of its eight neighbours, differs from its half by more than the threshold.
#[derive(Clone, Copy, Debug)]
pub struct HalfBuffer {
    /// The "noise threshold" of Cycles, there 0.01 by default.
    pub threshold: f64,
}

impl HalfBuffer {
    /// The error of one pixel: sum over the channels of the difference of the means, over the square root of their sum.
    /// Radiance is multiplied by `exposure`.
    #[must_use]
    pub fn error(pixel: &Pixel, exposure: f32) -> f64 {
        let mut half = [0.0; 3];
        let mut count = 0;
        for (sum, n) in pixel.blocks().step_by(2) {
            half.iter_mut().zip(sum.to_array()).for_each(|(h, s)| *h += s);
            count += n;
        }
        let scale = f64::from(exposure);
        let half = half.map(|h| h / f64::from(count.max(1)) * scale);
        let mean = (pixel.mean() * scale).to_array();
        let difference: f64 = mean.iter().zip(half).map(|(m, h)| (m - h).abs()).sum();
        difference / (EPSILON + mean.iter().sum::<f64>().sqrt())
    }
}

impl Policy for HalfBuffer {
    fn name(&self) -> &'static str {
        "half-buffer"
    }

    fn first_target(&self, bounds: Bounds) -> u32 {
        bounds.min_spp.max(MIN_SPP).min(bounds.max_spp)
    }

    fn decide(&mut self, barrier: &Barrier<'_>) -> Decisions {
        let film = barrier.film;
        let values = film.map(|t, i| Self::error(&t.pixels[i], barrier.exposure).min(1e30) as f32);
        let plane = Plane { width: film.width() as usize, height: film.height() as usize, values };
        let error = plane.dilated();
        let counts = film.map(|t, i| t.pixels[i].count());
        let go_on = |e: f32| f64::from(e) > self.threshold;
        Decisions {
            targets: counts
                .iter()
                .zip(&error.values)
                .map(|(&n, &e)| if go_on(e) { doubled(n, barrier.bounds) } else { n })
                .collect(),
            values: error.values.iter().map(|&e| (f64::from(e) - self.threshold) as f32).collect(),
            lambda: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn pixel(samples: &[f32]) -> Pixel {
        let mut pixel = Pixel::default();
        samples.iter().for_each(|s| pixel.add(Vec3::splat(*s)));
        pixel
    }

    #[test]
    fn the_half_are_the_even_blocks() {
        // Blocks of two: the even ones hold samples 0, 1, 4, 5, ...
        let samples: Vec<f32> = (0..16).map(|i| if i / 2 % 2 == 0 { 1.0 } else { 0.0 }).collect();
        // Mean 1/2, half 1, three channels: 3 * 1/2 / sqrt(3/2).
        let expected = 1.5 / (EPSILON + 1.5_f64.sqrt());
        assert!((HalfBuffer::error(&pixel(&samples), 1.0) - expected).abs() < 1e-12);
        // Brightness enters by its square root.
        let four = HalfBuffer::error(&pixel(&samples), 4.0);
        assert!((four / expected - 2.0).abs() < 1e-3, "{four}");
    }

    #[test]
    fn constant_black_and_empty_pixels_have_no_error() {
        for samples in [&[0.5; 16][..], &[0.0; 16], &[], &[3.0]] {
            assert_eq!(HalfBuffer::error(&pixel(samples), 1.0), 0.0, "{samples:?}");
        }
    }
}
