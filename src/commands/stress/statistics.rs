//! Sums and variances.

use super::case::{Case, Effort, Random};
use glam::Vec3;
use sparing_adaptive::paper_features;
use sparing_adaptive::view::View;
use sparing_image::film::{Film, FilmOptions, Pixel};

const AREA: &str = "Statistics";

pub(super) const CASES: &[Case] = &[
    Case {
        area: AREA,
        name: "constant-1e8-mean",
        does: "Mean of 2^24 samples (quick 2^20) of 123,456,792: sums are f64, and exact here.",
        unit: "relative error",
        bound: 1e-15,
        measure: |e| Ok((constant(e).mean().x / f64::from(OFFSET) - 1.0).abs()),
    },
    Case {
        area: AREA,
        name: "constant-1e8-variance",
        does: "Variance of one sample of the same: what squares leave when they cancel is n 2^-53 of the squared mean at most.",
        unit: "variance over squared mean",
        bound: 2e-9,
        measure: |e| {
            let p = constant(e);
            Ok(p.variance_of_mean().x * f64::from(p.count() - 1) / f64::from(OFFSET).powi(2))
        },
    },
    Case {
        area: AREA,
        name: "block-means-of-constants",
        does: "Spread of block means of constants from 1e-30 to 1e30: not by squares less squares, so exactly 0.",
        unit: "pixels with an error",
        bound: 0.0,
        measure: |_| Ok(block_means_of_constants()),
    },
    Case {
        area: AREA,
        name: "billion-samples",
        does: "Mean of 2^30 samples (quick 2^22) of 0.1: sequential sums of 2^27 in a block, n / 8 2^-53 at most.",
        unit: "relative error",
        bound: 1.5e-8,
        measure: |e| Ok(billion(e)),
    },
    Case {
        area: AREA,
        name: "mixed-magnitudes",
        does: "Sums of 4,096 samples of 1e-30 to 1e30 in random order against a sum that keeps every bit.",
        unit: "relative error (n 2^-53 = 4.5e-13)",
        bound: 4.5e-13,
        measure: |e| Ok(mixed(e)),
    },
    Case {
        area: AREA,
        name: "merge-trees",
        does: "Sums of ranges of samples, 1e-30 to 1e30 or even, merged in trees of any shape: mean and variance against sums that keep \
               every bit.",
        unit: "relative error over n 2^-53 (variance: over 4 n 2^-53)",
        bound: 1.0,
        measure: |e| Ok(trees(e)),
    },
    Case {
        area: AREA,
        name: "variance-not-negative",
        does: "Random offsets, spreads and counts: variances below 0.",
        unit: "cases",
        bound: 0.0,
        measure: |e| Ok(negative(e)),
    },
    Case {
        area: AREA,
        name: "equal-halves-against-general",
        does: "Variance of Lin and Wu (2015) from sums of squares against two passes, spread 1e-3 of the mean.",
        unit: "relative error (n 2^-53 over the relative variance)",
        bound: 2e-7,
        measure: |e| Ok(equal_halves(e)),
    },
    Case {
        area: AREA,
        name: "hostile-films",
        does: "Statistics of films that are constant, black, alternating between 0 and 1e30, all NaN, one sample: values not finite.",
        unit: "values",
        bound: 0.0,
        measure: |_| Ok(hostile()),
    },
];

/// About 1e8, with a square that f64 must round.
const OFFSET: f32 = 123_456_792.0;

fn constant(effort: Effort) -> Pixel {
    let mut p = Pixel::default();
    for _ in 0..effort.of(1 << 20, 1 << 24) {
        p.add(Vec3::splat(OFFSET));
    }
    p
}

fn block_means_of_constants() -> f64 {
    let mut wrong = 0;
    for exponent in -30..=30 {
        let value = 10_f64.powi(exponent) as f32;
        let mut film = Film::new([8, 8], [0, 0, 8, 8], FilmOptions::default());
        for pixel in &mut film.tiles[0].pixels {
            (0..64).for_each(|_| pixel.add(Vec3::splat(value)));
        }
        wrong += View::new(&film, 1.0).pixels.iter().filter(|p| p.error != [0.0; 3]).count();
    }
    wrong as f64
}

fn billion(effort: Effort) -> f64 {
    let mut pixel = Pixel::default();
    for _ in 0..effort.of(1 << 22, 1 << 30) {
        pixel.add(Vec3::splat(0.1));
    }
    (pixel.mean().x / f64::from(0.1_f32) - 1.0).abs()
}

/// A sum without rounding: non-overlapping parts (Shewchuk 1997, grow-expansion).
fn exact(values: impl Iterator<Item = f64>) -> f64 {
    let mut parts: Vec<f64> = Vec::new();
    for mut x in values {
        let mut kept = 0;
        for k in 0..parts.len() {
            let y = parts[k];
            let sum = x + y;
            let z = sum - x;
            let error = (x - (sum - z)) + (y - z);
            if error != 0.0 {
                parts[kept] = error;
                kept += 1;
            }
            x = sum;
        }
        parts.truncate(kept);
        parts.push(x);
    }
    parts.iter().sum()
}

fn mixed(effort: Effort) -> f64 {
    let mut random = Random::new(1);
    let mut worst: f64 = 0.0;
    for _ in 0..effort.of(50, 2000) {
        let samples: Vec<f32> = (0..4096).map(|_| 10_f64.powf(random.between(-30.0, 30.0)) as f32).collect();
        let mut p = Pixel::default();
        samples.iter().for_each(|s| p.add(Vec3::splat(*s)));
        let truth = exact(samples.iter().map(|s| f64::from(*s)));
        worst = worst.max((p.sum().x / truth - 1.0).abs());
    }
    worst
}

/// Samples `from..to`, summed in a tree of random shape.
fn tree(samples: &[f32], from: usize, to: usize, random: &mut Random) -> Pixel {
    if to - from < 2 || random.uniform() < 0.2 {
        let mut p = Pixel::starting_at(from as u32);
        samples[from..to].iter().for_each(|s| p.add(Vec3::splat(*s)));
        return p;
    }
    let middle = from + 1 + (random.uniform() * (to - from - 1) as f64) as usize;
    let mut whole = tree(samples, from, middle, random);
    whole.append(&tree(samples, middle, to, random));
    whole
}

fn trees(effort: Effort) -> f64 {
    let mut random = Random::new(4);
    let mut worst: f64 = 0.0;
    for k in 0..effort.of(50, 2000) {
        let reach = [30.0, 3.0, 0.1][k % 3];
        let n = 2 + (random.uniform() * 4094.0) as usize;
        let samples: Vec<f32> = (0..n).map(|_| 10_f64.powf(random.between(-reach, reach)) as f32).collect();
        let p = tree(&samples, 0, n, &mut random);
        let values = || samples.iter().map(|s| f64::from(*s));
        let (count, sum) = (n as f64, exact(values()));
        // The square of an f32 is exact in f64.
        let mean = sum / count;
        let variance = (exact(values().map(|v| v * v)) / count - mean * mean) / (count - 1.0);
        let unit = count * 0.5 * f64::EPSILON;
        // What cancels is relative to the squares, not to the variance.
        let condition = 1.0 + mean * mean / (variance * (count - 1.0));
        worst = worst.max((p.mean().x / mean - 1.0).abs() / unit);
        worst = worst.max((p.variance_of_mean().x / variance - 1.0).abs() / (4.0 * unit * condition));
        worst = worst.max(f64::from(u32::from(p.count() as usize != n)) * 9.0);
    }
    worst
}

fn negative(effort: Effort) -> f64 {
    let mut random = Random::new(2);
    let mut wrong = 0;
    for _ in 0..effort.of(2_000, 100_000) {
        let offset = 10_f64.powf(random.between(-30.0, 18.0));
        let spread = offset * 10_f64.powf(random.between(-12.0, 0.0));
        let mut p = Pixel::default();
        for _ in 0..2 + (random.uniform() * 200.0) as u32 {
            p.add(Vec3::splat((offset + spread * random.uniform()) as f32));
        }
        let variance = p.variance_of_mean().min_element();
        wrong += u32::from(variance < 0.0 || variance.is_nan());
    }
    f64::from(wrong)
}

fn equal_halves(effort: Effort) -> f64 {
    let mut random = Random::new(3);
    let mut worst: f64 = 0.0;
    for _ in 0..effort.of(20, 1000) {
        let mut film = Film::new([1, 1], [0, 0, 1, 1], paper_features::FILM);
        let mean = 10_f64.powf(random.between(-6.0, 6.0));
        let mut values = Vec::new();
        for n in 0..512 {
            let v = (mean * (1.0 + 1e-3 * random.between(-1.0, 1.0))) as f32;
            film.tiles[0].add_sample(0, n, Vec3::splat(v), 1.0);
            values.push(f64::from(v));
        }
        let average = values.iter().sum::<f64>() / 512.0;
        let variance = values.iter().map(|v| (v - average) * (v - average)).sum::<f64>() / 512.0;
        // Grey of 1 has Y = 1 to the rounding of the matrix.
        let found = paper_features::features(&film.tiles[0], 0)[7];
        worst = worst.max((found / variance - 1.0).abs());
    }
    worst
}

fn hostile() -> f64 {
    let kinds: [fn(u32) -> f32; 6] = [
        |_| 3.0,
        |_| 0.0,
        |n| if n % 2 == 0 { 0.0 } else { 1e30 },
        |_| f32::NAN,
        |_| f32::MAX,
        |n| if n == 0 { 1e-38 } else { f32::INFINITY },
    ];
    let mut wrong = 0;
    for sample in kinds {
        for count in [1, 2, 7, 8, 9, 64, 1000] {
            let mut film = Film::new([3, 2], [0, 0, 3, 2], paper_features::FILM);
            for i in film.tiles[0].indices().collect::<Vec<_>>() {
                (0..count).for_each(|n| film.tiles[0].add_sample(i, n, Vec3::splat(sample(n)), 1.0));
            }
            for exposure in [1e-6, 1.0, 1e6] {
                for p in View::new(&film, exposure).pixels {
                    let numbers =
                        [p.relative_error, p.perceived_error, p.perceived_half_difference, p.peak, p.zeros];
                    let all = numbers
                        .into_iter()
                        .chain(p.mean)
                        .chain(p.error)
                        .chain(p.lab)
                        .chain(p.half_difference);
                    wrong += all.filter(|v| !v.is_finite()).count();
                }
            }
            let features = paper_features::matrix(&film).values;
            wrong += features.iter().filter(|v| !v.is_finite()).count();
        }
    }
    wrong as f64
}
