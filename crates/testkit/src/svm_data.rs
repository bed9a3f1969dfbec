//! Made-up data for support vector machines: the same numbers for the same seed, on every machine.
//!
//! Values are multiples of 1e-6, so that they survive a short text and do not depend on a platform's `exp`.

use std::fmt::Write as _;

/// Labelled rows of one length.
#[derive(Clone, Debug, PartialEq)]
pub struct SvmData {
    /// Features of a row.
    pub features: usize,
    /// Row by row, `labels.len() * features` values.
    pub rows: Vec<f64>,
    /// One a row: a class (a whole number) or the value to be learned.
    pub labels: Vec<f64>,
}

impl SvmData {
    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.labels.len()
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.labels.is_empty()
    }

    /// Row `i`, `features` values.
    #[must_use]
    pub fn row(&self, i: usize) -> &[f64] {
        &self.rows[i * self.features..(i + 1) * self.features]
    }

    /// The same data with a share (0 to 1) of its values set to zero, which text files leave out.
    #[must_use]
    pub fn with_zeros(mut self, share: f64, seed: u64) -> Self {
        let mut random = Random::new(seed);
        for value in &mut self.rows {
            if random.uniform() < share {
                *value = 0.0;
            }
        }
        self
    }

    /// As a libSVM data file, zeros left out.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        for (i, label) in self.labels.iter().enumerate() {
            let _ = write!(text, "{label}");
            for (j, value) in self.row(i).iter().enumerate().filter(|(_, value)| **value != 0.0) {
                let _ = write!(text, " {}:{value}", j + 1);
            }
            text.push('\n');
        }
        text
    }
}

/// Names of the features of [`pixels`].
pub const PIXEL_FEATURES: [&str; 8] = [
    "mean",
    "variance",
    "variance_of_neighbours",
    "difference_to_neighbours",
    "range",
    "depth_variance",
    "normal_variance",
    "samples",
];

/// Pixel statistics as a path tracer's adaptive sampler would see them, most of them in \[0, 1\], and the
/// label 1 (sample more) or -1. The label is noisy, as a single measured error is: an RBF machine makes about
/// 40 % of the rows support vectors.
#[must_use]
pub fn pixels(rows: usize, seed: u64) -> SvmData {
    let mut random = Random::new(seed);
    let (mut values, mut labels) = (Vec::with_capacity(rows * 8), Vec::with_capacity(rows));
    for _ in 0..rows {
        let light = random.normal();
        let edge = if random.uniform() < 0.2 { 1.0 + random.normal().abs() } else { 0.0 };
        let noise = 0.8 * random.normal() + 0.3 * light;
        let samples = random.uniform();
        // Few samples: the measured variance says less of the true one.
        let blur = 0.9 - 0.6 * samples;
        let measured = noise + blur * random.normal();
        let mean = (0.6 * light - 1.2).exp();
        let variance = 0.1 * (1.2 * measured - 1.0).exp();
        let neighbours = 0.1 * (1.1 * (noise + 0.3 * random.normal()) - 1.0).exp();
        let difference = 0.05 * (0.7 * edge + 0.6 * random.normal()).exp();
        let range = (2.0 * variance.sqrt() * (0.9 + 0.2 * random.uniform())).min(2.0);
        let depth = if edge > 0.0 { 0.02 * (edge + random.normal()).exp() } else { 1e-4 * random.uniform() };
        let normal = if edge > 0.0 { 0.3 * random.uniform() * edge } else { 0.02 * random.uniform() };
        for value in [mean, variance, neighbours, difference, range, depth, normal, samples] {
            values.push(short(value));
        }
        let error = noise + 0.9 * edge - 1.2 * samples + 0.35 * (2.0 * light).sin() + 0.5 * random.normal();
        labels.push(if error > -0.3 { 1.0 } else { -1.0 });
    }
    SvmData { features: 8, rows: values, labels }
}

/// `classes` overlapping normal blobs around random centres in the unit cube; labels are 0 to `classes - 1`,
/// in turn.
#[must_use]
pub fn blobs(rows: usize, features: usize, classes: usize, seed: u64) -> SvmData {
    let mut random = Random::new(seed);
    let centres: Vec<f64> = (0..classes * features).map(|_| random.uniform()).collect();
    let (mut values, mut labels) = (Vec::with_capacity(rows * features), Vec::with_capacity(rows));
    for row in 0..rows {
        let class = row % classes;
        for centre in &centres[class * features..(class + 1) * features] {
            values.push(short(centre + 0.2 * random.normal()));
        }
        labels.push(class as f64);
    }
    SvmData { features, rows: values, labels }
}

/// A smooth curve over `features` uniform values in \[-1, 1\], with noise of standard deviation 0.05.
#[must_use]
pub fn curve(rows: usize, features: usize, seed: u64) -> SvmData {
    let mut random = Random::new(seed);
    let (mut values, mut labels) = (Vec::with_capacity(rows * features), Vec::with_capacity(rows));
    for _ in 0..rows {
        let mut sum = 0.0;
        for j in 0..features {
            let value = short(2.0 * random.uniform() - 1.0);
            sum += (3.0 * value + j as f64).sin();
            values.push(value);
        }
        labels.push(short(sum / (features as f64).sqrt() + 0.05 * random.normal()));
    }
    SvmData { features, rows: values, labels }
}

/// Six decimals.
fn short(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// SplitMix64 (Steele, Lea and Flood 2014, figure 17).
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// A stream of its own for each seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Standard normal, nearly: the sum of twelve uniform numbers, which needs no platform's `ln`.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn same_seed_same_data() {
        assert_eq!(pixels(50, 3), pixels(50, 3));
        assert_ne!(pixels(50, 3), pixels(50, 4));
        // The first rows do not depend on how many follow.
        assert_eq!(pixels(50, 3).rows[..80], pixels(10, 3).rows[..]);
    }

    #[test]
    fn shapes_and_classes() {
        let data = blobs(30, 5, 3, 1);
        assert_eq!((data.len(), data.rows.len(), data.row(29).len()), (30, 150, 5));
        assert_eq!(data.labels[..4], [0.0, 1.0, 2.0, 0.0]);
        let positive = pixels(10_000, 1).labels.iter().filter(|l| **l > 0.0).count();
        assert!((3_000..7_000).contains(&positive), "{positive} of 10,000");
        let zeros = curve(1000, 4, 1).with_zeros(0.5, 2).rows.iter().filter(|v| **v == 0.0).count();
        assert!((1_800..2_200).contains(&zeros), "{zeros} of 4,000");
        assert!(pixels(1000, 1).rows.iter().all(|v| v.is_finite()));
    }

    #[test]
    fn text_leaves_zeros_out() {
        let data =
            SvmData { features: 3, rows: vec![0.0, 0.5, 0.0, 1.0, 0.0, -2.0], labels: vec![1.0, -1.0] };
        assert_eq!(data.to_text(), "1 2:0.5\n-1 1:1 3:-2\n");
    }
}
