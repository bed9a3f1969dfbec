//! Sample points, and policies on films that nothing good can be learnt from.

use super::case::{Case, Effort};
use crate::commands::machine::{shipped, shipped_paper};
use glam::Vec3;
use sparing_adaptive::goal::{Bounds, Goal};
use sparing_adaptive::ledger::Ledger;
use sparing_adaptive::policy::{Barrier, Planned, Policy, Shapes, Svm, Threshold, Uniform};
use sparing_image::film::{Film, FilmOptions};
use sparing_render::sampler::sobol::owen_sobol_2d;
use sparing_render::sampler::{Dimension, PixelSampler, SamplerKind};

const AREA: &str = "Sampling and policies";

pub(super) const CASES: &[Case] = &[
    Case {
        area: AREA,
        name: "stratification",
        does: "Owen-scrambled Sobol points: elementary intervals of area 1/n that do not hold one of the first n, n = 2 to 2^20 (quick \
               2^14).",
        unit: "intervals",
        bound: 0.0,
        measure: |e| Ok(stratification(e)),
    },
    Case {
        area: AREA,
        name: "late-samples",
        does: "The same for any aligned block of 2^10 points up to sample 2^30.",
        unit: "intervals",
        bound: 0.0,
        measure: |e| Ok(late(e)),
    },
    Case {
        area: AREA,
        name: "a-thousand-dimensions",
        does: "Correlation of a sample's values at vertices 0 to 200 (1,200 uses) with those at the next vertex, over 4,096 samples.",
        unit: "largest, in standard errors",
        bound: 6.0,
        measure: |e| Ok(dimensions(e)),
    },
    Case {
        area: AREA,
        name: "seeds",
        does: "Correlation between renders with neighbouring seeds, over 2^16 pixels.",
        unit: "largest, in standard errors",
        bound: 5.0,
        measure: |_| Ok(seeds()),
    },
    Case {
        area: AREA,
        name: "neighbouring-pixels",
        does: "Correlation between a pixel and its right, lower and diagonal neighbour, over 2^16 pixels.",
        unit: "largest, in standard errors",
        bound: 5.0,
        measure: |_| Ok(neighbours()),
    },
    Case {
        area: AREA,
        name: "policies-on-hostile-films",
        does: "Every policy on films that are constant, one pixel, all NaN, all 0, alternating 0 and 1e30, with every kind of goal: \
               targets out of bounds, values that are NaN.",
        unit: "pixels",
        bound: 0.0,
        measure: |_| policies(),
    },
];

/// Elementary intervals (2^a by 2^b of them) without a point.
fn empty(points: &[[u32; 2]]) -> u64 {
    let bits = points.len().ilog2();
    let mut missing = 0;
    for a in 0..=bits {
        let mut hit = vec![false; points.len()];
        for [x, y] in points {
            let column = if a == 0 { 0 } else { x >> (32 - a) };
            let row = if a == bits { 0 } else { y >> (32 - (bits - a)) };
            hit[((column as usize) << (bits - a)) + row as usize] = true;
        }
        missing += hit.iter().filter(|h| !**h).count() as u64;
    }
    missing
}

fn stratification(effort: Effort) -> f64 {
    let mut missing = 0;
    for seed in [0, 1, u32::MAX] {
        for k in 1..=effort.of(14, 20) {
            let points: Vec<[u32; 2]> = (0..1 << k).map(|i| owen_sobol_2d(i, seed)).collect();
            missing += empty(&points);
        }
    }
    missing as f64
}

fn late(effort: Effort) -> f64 {
    let mut missing = 0;
    for k in 0..effort.of(40, 2000_u32) {
        let block = k.wrapping_mul(0x9e37_79b9) >> 12; // of 2^20 blocks
        let points: Vec<[u32; 2]> = (0..1024).map(|i| owen_sobol_2d(block << 10 | i, 7)).collect();
        missing += empty(&points);
    }
    missing as f64
}

const USES: [Dimension; 6] = [
    Dimension::Pixel,
    Dimension::Lens,
    Dimension::Bsdf,
    Dimension::Light,
    Dimension::Choice,
    Dimension::Roulette,
];

/// Correlation of two lists of uniform numbers, times the root of their length.
fn correlation(pairs: impl Iterator<Item = [f32; 2]>) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for [a, b] in pairs {
        sum += (f64::from(a) - 0.5) * (f64::from(b) - 0.5) * 12.0;
        n += 1.0;
    }
    (sum / f64::sqrt(n)).abs()
}

fn dimensions(effort: Effort) -> f64 {
    let mut worst: f64 = 0.0;
    for kind in [SamplerKind::Sobol, SamplerKind::Independent] {
        let sampler = PixelSampler::new(kind, 3, 17, 5);
        for vertex in 0..effort.of(40, 200) {
            for dimension in USES {
                let pairs = (0..4096).map(|i| {
                    [sampler.get_2d(i, vertex, dimension)[0], sampler.get_2d(i, vertex + 1, dimension)[0]]
                });
                worst = worst.max(correlation(pairs));
            }
        }
    }
    worst
}

/// Pairs over pixels of a picture of 256 by 256.
fn over_pixels(pair: impl Fn(u32, u32) -> [PixelSampler; 2]) -> f64 {
    let mut worst: f64 = 0.0;
    for (index, dimension) in [(0, Dimension::Pixel), (0, Dimension::Light), (5, Dimension::Bsdf)] {
        let pairs = (0..1 << 16).map(|k| pair(k % 256, k / 256).map(|s| s.get_2d(index, 1, dimension)[1]));
        worst = worst.max(correlation(pairs));
    }
    worst
}

fn seeds() -> f64 {
    let mut worst: f64 = 0.0;
    for [a, b] in [[0, 1], [1, 2], [7, 1 << 32 | 7], [0, u64::MAX]] {
        worst = worst
            .max(over_pixels(|x, y| [a, b].map(|seed| PixelSampler::new(SamplerKind::Sobol, seed, x, y))));
    }
    worst
}

fn neighbours() -> f64 {
    let mut worst: f64 = 0.0;
    for [dx, dy] in [[1, 0], [0, 1], [1, 1], [8, 0]] {
        worst = worst.max(over_pixels(|x, y| {
            [[x, y], [x + dx, y + dy]].map(|[x, y]| PixelSampler::new(SamplerKind::Sobol, 1, x, y))
        }));
    }
    worst
}

fn policies() -> anyhow::Result<f64> {
    let bounds = Bounds { min_spp: 8, max_spp: 512 };
    let goals = [Goal::Average(64.0), Goal::Tolerance(1e-6), Goal::Tolerance(1e6), Goal::Threshold(0.0)];
    let kinds: [fn(u32, u32) -> f32; 6] = [
        |_, _| 0.7,
        |_, _| 0.0,
        |_, _| f32::NAN,
        |i, n| if (i + n) % 2 == 0 { 0.0 } else { 1e30 },
        |_, n| if n == 3 { f32::MAX } else { 1e-38 },
        |i, _| if i == 5 { 1e20 } else { 0.0 },
    ];
    let mut wrong = 0;
    for size in [[1, 1], [3, 3], [17, 9]] {
        for sample in kinds {
            for goal in goals {
                let all: [Box<dyn Policy>; 6] = [
                    Box::new(Uniform),
                    Box::new(Shapes),
                    Box::new(Threshold::new(goal)),
                    Box::new(Planned { goal }),
                    Box::new(Svm::new(goal, shipped()?)),
                    Box::new(shipped_paper()?),
                ];
                for mut policy in all {
                    let options = FilmOptions { shapes: true, ..policy.film_options() };
                    let mut film = Film::new(size, [0, 0, size[0], size[1]], options);
                    for tile in &mut film.tiles {
                        for i in tile.indices().collect::<Vec<_>>() {
                            (0..8).for_each(|n| tile.add_sample(i, n, Vec3::splat(sample(i as u32, n)), 1.0));
                            tile.shapes[i].insert(1);
                        }
                    }
                    let ledger = Ledger::default();
                    let decisions = policy.decide(&Barrier::new(&film, &ledger, bounds, 1.0));
                    wrong += decisions.targets.iter().filter(|t| !(8..=512).contains(*t)).count();
                    wrong += decisions.values.iter().filter(|v| v.is_nan()).count();
                    wrong += usize::from(decisions.targets.len() != (size[0] * size[1]) as usize);
                }
            }
        }
    }
    Ok(wrong as f64)
}
