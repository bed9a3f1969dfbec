//! Support vectors laid out for the kernel: groups of lanes, tiles that fit the first-level cache.

use super::kernel::{CHAINS, sum_depth};
use super::simd::Real;
use std::ops::Range;

/// Bytes of a tile: with a few queries and sums beside it, within the first-level data cache of all usual machines.
const TILE_BYTES: usize = 32 << 10;

/// One support vector as the kernel wants it.
#[derive(Clone, Debug)]
pub(crate) struct Item {
    /// RBF: logarithm of the weight and whatever else belongs to the start of the exponent; others: the weight.
    pub(crate) start: f64,
    /// Magnitude of the weight.
    pub(crate) weight: f64,
    /// The vector, scaled.
    pub(crate) vector: Vec<f64>,
}

/// Vectors that are evaluated for a batch of queries before the next ones are touched, and what the error bound needs.
#[derive(Clone, Debug)]
pub(crate) struct Tile {
    /// Where in [`Packed::rows`].
    pub(crate) rows: Range<usize>,
    /// What its sum counts: the sign, times 2 to the part that all exponents of the tile have in common.
    pub(crate) factor: f64,
    /// Groups, and so padding, in it.
    pub(crate) groups: usize,
    /// Rounded additions a kernel value goes through.
    pub(crate) depth: f64,
    /// Largest magnitude of a start value.
    pub(crate) start: f64,
    /// Largest Euclidean norm of a vector.
    pub(crate) norm: f64,
    /// Sum of the weights: no sum of kernel values below 1 is larger.
    pub(crate) weight: f64,
}

/// All vectors of one machine in one precision.
#[derive(Clone, Debug)]
pub(crate) struct Packed<R: Real> {
    /// Groups of `1 + features` rows.
    pub(crate) rows: Vec<R::Row>,
    /// Tiles, one after the other.
    pub(crate) tiles: Vec<Tile>,
    /// Features, padded to a multiple of [`CHAINS`], at least one of them.
    pub(crate) features: usize,
}

impl<R: Real> Packed<R> {
    /// Nothing yet, for vectors of `features` features.
    pub(crate) fn new(features: usize) -> Self {
        Self { rows: Vec::new(), tiles: Vec::new(), features: features.max(1).next_multiple_of(CHAINS) }
    }

    /// Appends vectors of one sign; lanes left over start at `padding`. Vectors are sorted by the magnitude of their
    /// start, so that the bounds of a tile are tight; with `shift`, the middle of a tile's starts becomes its factor, and what
    /// is left of them is small.
    pub(crate) fn append(&mut self, mut items: Vec<Item>, sign: f64, padding: f64, shift: bool) {
        items.sort_by(|a, b| a.start.abs().total_cmp(&b.start.abs()));
        let stride = 1 + self.features;
        let groups_per_tile = (TILE_BYTES / (64 * stride)).max(2).next_multiple_of(2);
        for tile in items.chunks_mut(groups_per_tile * R::LANES) {
            let common = if shift { middle(tile) } else { 0.0 };
            tile.iter_mut().for_each(|i| i.start -= common);
            let first = self.rows.len();
            for group in tile.chunks(R::LANES) {
                self.push_group(group, padding);
            }
            let groups = tile.len().div_ceil(R::LANES);
            let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
            self.tiles.push(Tile {
                rows: first..self.rows.len(),
                factor: sign * common.exp2(),
                groups,
                depth: sum_depth(groups),
                start: tile.iter().map(|i| i.start.abs()).fold(0.0, f64::max),
                norm: tile.iter().map(|i| norm(&i.vector)).fold(0.0, f64::max),
                weight: tile.iter().map(|i| i.weight).sum(),
            });
        }
    }

    fn push_group(&mut self, group: &[Item], padding: f64) {
        let mut lanes = vec![R::from_f64(padding); R::LANES];
        for (lane, item) in lanes.iter_mut().zip(group) {
            *lane = R::from_f64(item.start);
        }
        self.rows.push(R::row(&lanes));
        for feature in 0..self.features {
            lanes.fill(R::from_f64(0.0));
            for (lane, item) in lanes.iter_mut().zip(group) {
                *lane = flushed(item.vector.get(feature).copied().unwrap_or(0.0));
            }
            self.rows.push(R::row(&lanes));
        }
    }

    /// Bytes of the rows.
    pub(crate) fn bytes(&self) -> usize {
        self.rows.len() * size_of::<R::Row>()
    }
}

/// The middle of the starts, within what exponents can make up for: a shifted exponent stays below 60.
fn middle(items: &[Item]) -> f64 {
    let starts = items.iter().map(|i| i.start);
    let (low, high) =
        (starts.clone().fold(f64::INFINITY, f64::min), starts.fold(f64::NEG_INFINITY, f64::max));
    (low / 2.0 + high / 2.0).clamp(-60.0, 0.0)
}

/// The nearest number; zero where f32 has only denormal ones, which some machines compute slowly.
#[inline(always)]
pub(crate) fn flushed<R: Real>(x: f64) -> R {
    let kept = R::MANTISSA_BITS > 23 || x.abs() >= f64::from(f32::MIN_POSITIVE) || x.is_nan();
    R::from_f64(if kept { x } else { 0.0 })
}
