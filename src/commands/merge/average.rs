//! Pictures with different seeds, averaged by their numbers of samples.

use glam::DVec3;
use sparing_image::exr::{ExrAttribute, ExrImage};
use sparing_image::film::Film;

/// Sums over pictures, one a pixel.
#[derive(Clone, Copy, Default)]
struct Sums {
    radiance: DVec3,
    squares: DVec3,
    /// Corrections times samples.
    correction: DVec3,
    count: u64,
}

/// Adds up films of the same pixels.
pub(super) struct Average {
    full_size: [u32; 2],
    crop: [u32; 4],
    pixels: Vec<Sums>,
}

impl Average {
    /// Of one film so far.
    pub(super) fn new(film: &Film) -> Self {
        let pixels = vec![Sums::default(); film.width() as usize * film.height() as usize];
        let mut average = Self { full_size: film.full_size, crop: film.crop, pixels };
        average.add(film);
        average
    }

    /// Adds another one. Its pixels are the same: the parts agree on size and crop.
    pub(super) fn add(&mut self, film: &Film) {
        let pixels = film.map(|t, i| {
            let p = &t.pixels[i];
            (p.sum(), p.squares(), p.count())
        });
        for (at, (sums, (radiance, squares, count))) in self.pixels.iter_mut().zip(pixels).enumerate() {
            sums.radiance += radiance;
            sums.squares += squares;
            sums.count += u64::from(count);
            if let Some(correction) = film.correction.get(at) {
                sums.correction += DVec3::from(correction.map(f64::from)) * f64::from(count);
            }
        }
    }

    /// The picture: radiance, numbers of samples and variance of the means.
    pub(super) fn image(&self, mut attributes: Vec<(String, ExrAttribute)>) -> ExrImage {
        let [x0, y0, x1, y1] = self.crop;
        let samples: u64 = self.pixels.iter().map(|p| p.count).sum();
        attributes.push(("sparing.samples".to_owned(), ExrAttribute::Double(samples as f64)));
        let mut image = ExrImage {
            width: x1 - x0,
            height: y1 - y0,
            data_origin: [x0 as i32, y0 as i32],
            display_size: self.full_size,
            channels: Vec::new(),
            attributes,
        };
        let beauty: Vec<[f32; 3]> = self.pixels.iter().map(|p| p.mean().as_vec3().to_array()).collect();
        let variance: Vec<[f32; 3]> = self.pixels.iter().map(|p| p.variance().as_vec3().to_array()).collect();
        image.push_vector("", ["R", "G", "B"], &beauty);
        image.push("A", vec![1.0; beauty.len()]);
        image.push_uint("SampleCount.Y", self.pixels.iter().map(|p| p.count as f32).collect());
        image.push_vector("Variance", ["R", "G", "B"], &variance);
        image
    }
}

impl Sums {
    fn mean(&self) -> DVec3 {
        if self.count == 0 {
            return DVec3::ZERO;
        }
        let sum = self.radiance + self.correction;
        (sum / self.count as f64).clamp(DVec3::ZERO, DVec3::splat(f32::MAX.into()))
    }

    /// Of the mean, samples taken as independent; as of one film.
    fn variance(&self) -> DVec3 {
        if self.count < 2 {
            return DVec3::ZERO;
        }
        let n = self.count as f64;
        let mean = self.radiance / n;
        ((self.squares / n - mean * mean) / (n - 1.0)).max(DVec3::ZERO)
    }
}
