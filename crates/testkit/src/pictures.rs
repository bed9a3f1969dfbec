//! Whether two noisy pictures could be of the same scene, and what to look at if not.
//!
//! A picture is a mean and the variance of that mean per pixel and channel. Differences are tested at several
//! scales, since errors have several: single pixels (an edge, an outlier), blocks of 4 x 4 and 16 x 16 (one material
//! a few per cent off), the whole picture, and its brightness: the factor that fits best, blocks weighted by how
//! well they are known, so that noisy highlights do not hide a light a few per mille off. Each is a Z-test of
//! [`sparing_image::metrics::z_test`] with Šidák's correction for the number of its pixels.
//!
//! A Z-test wants normal means and true variances; path tracing with few samples has neither where light is found
//! seldom. Three things keep it honest:
//!
//! * A pixel that missed the rare bright paths has too low a mean *and* too low a variance. The
//!   reference, of many more samples, knows better: the picture's variance is taken as at least the reference's,
//!   scaled by the ratio of sample counts.
//! * Single pixels may reject in [`PIXEL_SHARE`] of all tests, the share that Mitsuba's regression tests allow;
//!   sums over blocks are near normal, and none of them may.
//! * Rounding to 32 bits is part of the variance, so that a constant picture needs no special case.

use sparing_image::metrics::{ErrorKind, Exposure, error_map, false_color, z_test};
use sparing_image::png::write_png;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// How many scales pictures are compared at.
pub const SCALES: usize = 5;

/// Share of the single-pixel tests that may reject.
pub const PIXEL_SHARE: f64 = 0.0025;

/// A rendered picture with the variance of its pixels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Samples per pixel.
    pub samples: u32,
    /// Linear radiance in rows.
    pub mean: Vec<[f32; 3]>,
    /// Variance of `mean`.
    pub variance: Vec<[f32; 3]>,
}

/// One scale of a comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Name for people.
    pub name: &'static str,
    /// Tests made.
    pub tests: u64,
    /// Share of them that reject.
    pub rejected: f64,
    /// Smallest p-value over the threshold below which a test rejects: under 1 means that one rejects.
    pub worst: f64,
    /// Whether the scale as a whole accepts.
    pub accepts: bool,
}

impl Estimate {
    /// This picture times a factor.
    #[must_use]
    pub fn scaled(&self, factor: f32) -> Self {
        let mut e = self.clone();
        e.mean.iter_mut().flatten().for_each(|v| *v *= factor);
        e.variance.iter_mut().flatten().for_each(|v| *v *= factor * factor);
        e
    }

    /// The weighted sum of independent pictures of one size. The sample count is that of the first.
    #[must_use]
    pub fn sum(parts: &[(f32, &Self)]) -> Self {
        let mut e = parts[0].1.scaled(parts[0].0);
        for (weight, part) in &parts[1..] {
            let scaled = part.scaled(*weight);
            e.mean.iter_mut().flatten().zip(scaled.mean.iter().flatten()).for_each(|(a, b)| *a += b);
            e.variance.iter_mut().flatten().zip(scaled.variance.iter().flatten()).for_each(|(a, b)| *a += b);
        }
        e
    }

    /// Mean over all pixels and channels, and the variance of it.
    #[must_use]
    pub fn brightness(&self) -> (f64, f64) {
        let n = (3 * self.mean.len()) as f64;
        let sum = |values: &[[f32; 3]]| values.iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
        (sum(&self.mean) / n, sum(&self.variance) / (n * n))
    }

    /// Means over blocks, those at the right and lower edge cut; 0 is one block.
    fn blocks(&self, side: u32) -> Self {
        let [bw, bh] = [self.width, self.height].map(|n| if side == 0 { n } else { side });
        let (columns, rows) = (self.width.div_ceil(bw), self.height.div_ceil(bh));
        let mut out = Self { width: columns, height: rows, samples: self.samples, ..Self::default() };
        for by in 0..rows {
            for bx in 0..columns {
                let (x1, y1) = (((bx + 1) * bw).min(self.width), ((by + 1) * bh).min(self.height));
                let (mut mean, mut variance, mut n) = ([0.0f64; 3], [0.0f64; 3], 0.0);
                for i in (by * bh..y1).flat_map(|y| (bx * bw..x1).map(move |x| y * self.width + x)) {
                    for c in 0..3 {
                        mean[c] += f64::from(self.mean[i as usize][c]);
                        variance[c] += f64::from(self.variance[i as usize][c]);
                    }
                    n += 1.0;
                }
                out.mean.push(mean.map(|v| (v / n) as f32));
                out.variance.push(variance.map(|v| (v / n / n) as f32));
            }
        }
        out
    }

    /// With the least variance that a reference allows, and that of rounding.
    fn with_known_variance(&self, reference: &Self) -> Self {
        let ratio = f64::from(reference.samples) / f64::from(self.samples.max(1));
        let mut e = self.clone();
        let known = reference.variance.iter().flatten().zip(self.mean.iter().flatten());
        for (own, (reference, mean)) in e.variance.iter_mut().flatten().zip(known) {
            let rounding = (f64::from(*mean) * 2.0 * f64::from(f32::EPSILON)).powi(2);
            *own = (f64::from(*own).max(f64::from(*reference) * ratio) + rounding) as f32;
        }
        e
    }
}

/// Tests a picture against a reference at [`SCALES`] scales, each at its share of `level`.
///
/// # Panics
/// If the sizes differ, or anything is not finite.
#[must_use]
pub fn compare(picture: &Estimate, reference: &Estimate, level: f64) -> Vec<Scale> {
    assert_eq!((picture.width, picture.height), (reference.width, reference.height), "sizes");
    let picture = picture.with_known_variance(reference);
    let test = |name, p: &Estimate, r: &Estimate, allowed| {
        let z = z_test(&p.mean, &p.variance, &r.mean, &r.variance, level / SCALES as f64)
            .unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(z.skipped, 0, "a value or variance is not finite");
        let rejected = 1.0 - z.accepted;
        let accepts = z.tests > 0 && rejected <= allowed;
        Scale { name, tests: z.tests, rejected, worst: z.min_p / z.threshold, accepts }
    };
    let of_blocks = |name, side| test(name, &picture.blocks(side), &reference.blocks(side), 0.0);
    let factor = best_factor(&picture.blocks(4), &reference.blocks(4));
    let one = Estimate { width: 1, height: 1, samples: 1, mean: vec![[1.0; 3]], variance: vec![[0.0; 3]] };
    vec![
        test("pixels", &picture, reference, PIXEL_SHARE),
        of_blocks("blocks of 4 x 4", 4),
        of_blocks("blocks of 16 x 16", 16),
        of_blocks("whole picture", 0),
        test("brightness", &factor, &one, 0.0),
    ]
}

/// The factor by channel that fits a picture to a reference best (least squares, weighted by variance), as one
/// pixel. Only the reference's variance weighs: the picture's own is not independent of its noise.
fn best_factor(picture: &Estimate, reference: &Estimate) -> Estimate {
    let mut out = Estimate { width: 1, height: 1, samples: picture.samples, ..Estimate::default() };
    let (mut mean, mut variance) = ([1.0f32; 3], [0.0f32; 3]);
    for c in 0..3 {
        let (mut difference, mut norm, mut noise) = (0.0, 0.0, 0.0);
        for i in 0..picture.mean.len() {
            let value = |v: &[[f32; 3]]| f64::from(v[i][c]);
            let (p, r) = (value(&picture.mean), value(&reference.mean));
            let known = value(&reference.variance);
            // A block without noise must not outweigh all others: a per mille of its value counts as noise.
            let weight = r / (known + 1e-6 * r * r);
            if weight.is_finite() {
                difference += weight * (p - r);
                norm += weight * r;
                noise += weight * weight * (value(&picture.variance) + known);
            }
        }
        if norm > 0.0 {
            mean[c] = (1.0 + difference / norm) as f32;
            variance[c] = (noise / (norm * norm) + f64::from(f32::EPSILON).powi(2)) as f32;
        }
    }
    out.mean.push(mean);
    out.variance.push(variance);
    out
}

/// Compares, and on rejection writes picture, reference, relative error and Z map as PNG into `folder`.
///
/// # Errors
/// A message that names the scales that reject and the files written.
pub fn check(
    name: &str,
    picture: &Estimate,
    reference: &Estimate,
    level: f64,
    folder: &Path,
) -> Result<(), String> {
    let scales = compare(picture, reference, level);
    if scales.iter().all(|s| s.accepts) {
        return Ok(());
    }
    let mut message = format!("{name} differs from its reference:");
    for s in scales {
        let verdict = if s.accepts { "accepts" } else { "REJECTS" };
        let what = s.name;
        let _ = write!(
            message,
            "\n  {verdict} {what}: {:.3} % of {} tests, smallest p-value {:.1e} of the threshold",
            100.0 * s.rejected,
            s.tests,
            s.worst
        );
    }
    let (a, b) = (picture.brightness(), reference.brightness());
    let _ = write!(
        message,
        "\n  mean {:.6} +- {:.6}, reference {:.6} +- {:.6}",
        a.0,
        a.1.sqrt(),
        b.0,
        b.1.sqrt()
    );
    for file in write_failure(name, picture, reference, folder)? {
        let _ = write!(message, "\n  {}", file.display());
    }
    Err(message)
}

/// Writes `NAME-picture.png`, `-reference`, `-error` (relative error) and `-z` (standard deviations, black is 0,
/// near white 6) into a folder, which is made if missing.
///
/// # Errors
/// What could not be written.
pub fn write_failure(
    name: &str,
    picture: &Estimate,
    reference: &Estimate,
    folder: &Path,
) -> Result<Vec<PathBuf>, String> {
    std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let (w, h) = (picture.width, picture.height);
    let ev = Exposure::Auto.scale(&reference.mean).log2();
    let map = error_map(&picture.mean, &reference.mean, w, h, Exposure::Auto, ErrorKind::Relative)
        .map_err(|e| e.to_string())?;
    let known = picture.with_known_variance(reference);
    let z = (0..known.mean.len()).map(|i| {
        let largest = (0..3).map(|c| {
            let sigma = (known.variance[i][c] + reference.variance[i][c]).sqrt();
            (known.mean[i][c] - reference.mean[i][c]).abs() / sigma.max(f32::MIN_POSITIVE)
        });
        false_color(largest.fold(0.0, f32::max) / 6.0)
    });
    let files = [
        ("picture", picture.mean.clone(), ev),
        ("reference", reference.mean.clone(), ev),
        ("error", map, 0.0),
        ("z", z.collect(), 0.0),
    ];
    files
        .into_iter()
        .map(|(kind, pixels, ev)| {
            let path = folder.join(format!("{name}-{kind}.png"));
            write_png(&path, w, h, &pixels, ev).map_err(|e| e.to_string())?;
            Ok(path)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uniform numbers in 0..1 (a linear congruential generator, high bits).
    fn random(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A gradient whose samples are exponential: variance is the square of the mean.
    fn picture(samples: u32, seed: u64, mean_of: impl Fn(u32, u32) -> f64) -> Estimate {
        let (width, height) = (48, 36);
        let mut e = Estimate { width, height, samples, ..Estimate::default() };
        let mut state = seed;
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let pixel = [(); 3].map(|()| {
                let (mut sum, mut squares) = (0.0, 0.0);
                for _ in 0..samples {
                    let v = -mean_of(x, y) * (1.0 - random(&mut state)).ln();
                    sum += v;
                    squares += v * v;
                }
                let n = f64::from(samples);
                (sum / n, (squares / n - (sum / n).powi(2)) / (n - 1.0))
            });
            e.mean.push(pixel.map(|p| p.0 as f32));
            e.variance.push(pixel.map(|p| p.1 as f32));
        }
        e
    }

    fn gradient(x: u32, y: u32) -> f64 {
        0.1 + f64::from(x + y) / 40.0
    }

    fn accepted(picture: &Estimate, reference: &Estimate) -> Vec<bool> {
        compare(picture, reference, 1e-3).iter().map(|s| s.accepts).collect()
    }

    #[test]
    fn equal_scenes_pass_for_every_seed() {
        let reference = picture(1024, 1, gradient);
        for seed in 2..22 {
            assert_eq!(accepted(&picture(64, seed, gradient), &reference), [true; SCALES], "seed {seed}");
        }
    }

    #[test]
    fn errors_of_each_scale_are_found_at_that_scale() {
        let reference = picture(1024, 1, gradient);
        let whole = picture(64, 2, gradient).scaled(1.02);
        assert!(!accepted(&whole, &reference)[3], "2 % of the whole picture");
        assert!(!accepted(&whole, &reference)[4], "2 % of brightness");
        let patch = |x: u32, y: u32| if x >= 32 && y < 16 { 1.08 } else { 1.0 };
        let patch = picture(64, 3, |x, y| gradient(x, y) * patch(x, y));
        assert!(!accepted(&patch, &reference)[2], "8 % of a patch");
        let dots =
            picture(64, 4, |x, y| gradient(x, y) * if (x * 31 + y * 17) % 97 == 0 { 5.0 } else { 1.0 });
        assert!(!accepted(&dots, &reference)[0], "one pixel in a hundred");
    }

    #[test]
    fn constants_need_no_noise() {
        let flat = |v: f32| Estimate {
            width: 5,
            height: 7,
            samples: 9,
            mean: vec![[v; 3]; 35],
            variance: vec![[0.0; 3]; 35],
        };
        assert_eq!(accepted(&flat(0.3), &flat(0.3)), [true; SCALES]);
        assert_eq!(accepted(&flat(f32::from_bits(0.3f32.to_bits() + 1)), &flat(0.3)), [true; SCALES]);
        assert_eq!(accepted(&flat(0.3001), &flat(0.3)), [false; SCALES]);
        assert_eq!(accepted(&flat(0.0), &flat(0.0)), [true; SCALES]);
    }

    #[test]
    fn sums_add_means_and_variances() {
        let a = Estimate { width: 1, height: 1, samples: 4, mean: vec![[1.0; 3]], variance: vec![[0.5; 3]] };
        let s = Estimate::sum(&[(2.0, &a), (-1.0, &a)]);
        assert_eq!((s.mean[0], s.variance[0]), ([1.0; 3], [2.5; 3]));
        assert_eq!(a.brightness(), (1.0, 0.5 / 3.0));
    }

    #[test]
    fn failures_leave_pictures() {
        let folder = tempfile::tempdir().expect("a folder");
        let folder = folder.path().join("new");
        let reference = picture(64, 1, gradient);
        assert_eq!(check("same", &reference, &reference, 1e-3, &folder), Ok(()));
        assert!(!folder.exists());
        let message =
            check("off", &reference.scaled(2.0), &reference, 1e-3, &folder).expect_err("twice as bright");
        assert!(message.contains("REJECTS whole picture") && message.contains("off-z.png"), "{message}");
        for kind in ["picture", "reference", "error", "z"] {
            assert!(folder.join(format!("off-{kind}.png")).exists());
        }
    }
}
