//! The certified cascade: small machines decide what they provably can, the full machine the rest.
//!
//! A reduced machine g of m vectors, with the norm of what it leaves out, bounds the full machine f everywhere
//! ([`ErrorBound`]). Where `|g|` is above the bound, its sign is f's sign. First the bound that holds anywhere
//! is tried; only where it fails, and where that was found to pay, the nearest of the vectors gives a sharper
//! one. Queries that stay open go to the next level, at last to the full machine.
//!
//! The truth is the sign of [`Model::decision_value`], rounding included: every bound has the evaluator's
//! proven error of g and the allowance for f64 sums of both machines added. No sign can differ, whatever the
//! query, infinity and NaN included (NaN decides nothing and goes to the full machine).

mod bound;
mod build;
mod nearest;
pub(crate) mod rounding;

pub use bound::ErrorBound;
pub use build::CascadeOptions;

use super::{Machine, PruneError};
use crate::model::Model;
use nearest::Nearest;

/// Queries that pass through the levels together.
const CHUNK: usize = 256;

/// Most levels below the full machine.
pub const MAX_LEVELS: usize = 3;

/// A machine whose decisions are those of a model, most of them made by fewer vectors.
#[derive(Debug)]
pub struct CertifiedCascade {
    levels: Vec<Level>,
    full: Machine,
    features: usize,
}

/// One reduced machine.
#[derive(Debug)]
struct Level {
    machine: Machine,
    model: Model,
    bound: ErrorBound,
    /// Rounding of both machines in f64.
    rounding: f64,
    nearest: Option<Nearest>,
}

/// What a level is, for reports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelInfo {
    /// Vectors.
    pub size: usize,
    /// Bound of `|f - g|`.
    pub bound: ErrorBound,
    /// Whether the nearest vector is looked for where the bound that holds anywhere does not decide.
    pub nearest: bool,
}

/// How many queries each level decided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CascadeStatistics {
    /// By each level with the bound that holds anywhere.
    pub anywhere: [u64; MAX_LEVELS],
    /// By each level with the bound near a vector.
    pub near: [u64; MAX_LEVELS],
    /// By the full machine.
    pub full: u64,
}

impl CascadeStatistics {
    /// All queries.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.full + self.anywhere.iter().chain(&self.near).sum::<u64>()
    }
}

impl std::ops::AddAssign for CascadeStatistics {
    fn add_assign(&mut self, other: Self) {
        for i in 0..MAX_LEVELS {
            self.anywhere[i] += other.anywhere[i];
            self.near[i] += other.near[i];
        }
        self.full += other.full;
    }
}

/// Memory for [`CertifiedCascade::decide_with`], one for each thread, used again and again.
#[derive(Clone, Debug)]
pub struct CascadeScratch {
    rows: Vec<f64>,
    open: Vec<usize>,
}

impl CertifiedCascade {
    /// Builds the cascade. With n support vectors this computes n^2 kernel values (30,000 vectors: seconds).
    ///
    /// A cascade without levels, just the full machine, comes out when no level pays.
    ///
    /// # Errors
    /// The model has several machines, is a regression or broken, or its kernel is not RBF.
    pub fn new(model: &Model, options: &CascadeOptions) -> Result<Self, PruneError> {
        let (full, levels) = build::build(model, options)?;
        Ok(Self { levels, full, features: model.features })
    }

    /// Features of a query.
    #[must_use]
    pub fn features(&self) -> usize {
        self.features
    }

    /// The levels below the full machine.
    #[must_use]
    pub fn levels(&self) -> Vec<LevelInfo> {
        let info =
            |l: &Level| LevelInfo { size: l.model.len(), bound: l.bound, nearest: l.nearest.is_some() };
        self.levels.iter().map(info).collect()
    }

    /// The reduced machine of a level.
    #[must_use]
    pub fn level_model(&self, level: usize) -> Option<&Model> {
        self.levels.get(level).map(|l| &l.model)
    }

    /// Memory of all compiled machines.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let level = |l: &Level| l.machine.bytes() + l.nearest.as_ref().map_or(0, Nearest::bytes);
        self.full.bytes() + self.levels.iter().map(level).sum::<usize>()
    }

    /// Memory for [`Self::decide_with`].
    #[must_use]
    pub fn scratch(&self) -> CascadeScratch {
        CascadeScratch { rows: vec![0.0; CHUNK * self.features], open: Vec::with_capacity(CHUNK) }
    }

    /// A value for each query (row by row) whose sign, `> 0` or not, is that of [`Model::decision_value`]; its
    /// size is that of the machine that decided. Says who decided how many.
    ///
    /// # Panics
    /// When `queries` does not hold `out.len() * features()` values.
    pub fn decide(&self, queries: &[f64], out: &mut [f64]) -> CascadeStatistics {
        self.decide_with(&mut self.scratch(), queries, out)
    }

    /// [`Self::decide`] without allocating.
    ///
    /// # Panics
    /// When `queries` does not hold `out.len() * features()` values.
    pub fn decide_with(
        &self,
        scratch: &mut CascadeScratch,
        queries: &[f64],
        out: &mut [f64],
    ) -> CascadeStatistics {
        assert_eq!(queries.len(), out.len() * self.features, "as many queries as values");
        let mut statistics = CascadeStatistics::default();
        if self.levels.is_empty() {
            self.full.decide(queries, out);
            statistics.full = out.len() as u64;
            return statistics;
        }
        scratch.rows.resize(CHUNK * self.features, 0.0);
        for (queries, out) in queries.chunks(CHUNK * self.features).zip(out.chunks_mut(CHUNK)) {
            self.decide_chunk(scratch, queries, out, &mut statistics);
        }
        statistics
    }

    fn decide_chunk(
        &self,
        scratch: &mut CascadeScratch,
        queries: &[f64],
        out: &mut [f64],
        statistics: &mut CascadeStatistics,
    ) {
        let features = self.features;
        let (rows, open) = (&mut scratch.rows, &mut scratch.open);
        let (mut values, mut bounds) = ([0.0; CHUNK], [0.0; CHUNK]);
        open.clear();
        open.extend(0..out.len());
        for (l, level) in self.levels.iter().enumerate() {
            let count = open.len();
            if count == 0 {
                return;
            }
            let (values, bounds) = (&mut values[..count], &mut bounds[..count]);
            let input = if l == 0 { queries } else { &rows[..count * features] };
            level.machine.decision_values_with_bounds(input, values, bounds);
            let mut k = 0;
            let anywhere = level.bound.anywhere();
            open.retain(|&i| {
                let (value, rounding) = (values[k], bounds[k] + level.rounding);
                k += 1;
                if value.abs() > (anywhere + rounding) * (1.0 + 4.0 * rounding::U) {
                    statistics.anywhere[l] += 1;
                } else if level.near_decides(value, rounding, &queries[i * features..(i + 1) * features]) {
                    statistics.near[l] += 1;
                } else {
                    return true;
                }
                out[i] = value;
                false
            });
            gather(queries, open, features, rows);
        }
        let count = open.len();
        statistics.full += count as u64;
        self.full.decide(&rows[..count * features], &mut values[..count]);
        for (&i, value) in open.iter().zip(&values) {
            out[i] = *value;
        }
    }
}

/// The rows of the open queries, one after the other.
fn gather(queries: &[f64], open: &[usize], features: usize, rows: &mut [f64]) {
    for (row, &i) in rows.chunks_exact_mut(features).zip(open) {
        row.copy_from_slice(&queries[i * features..(i + 1) * features]);
    }
}

impl Level {
    /// Whether the bound near a vector shows that f has g's sign.
    fn near_decides(&self, value: f64, rounding: f64, query: &[f64]) -> bool {
        let Some(nearest) = &self.nearest else { return false };
        // No vector gives a bound below the smallest of both ends of (1).
        if value.abs() <= rounding {
            return false;
        }
        let bound = self.bound.near(nearest.distance2(query));
        value.abs() > (bound + rounding) * (1.0 + 4.0 * rounding::U)
    }
}

#[cfg(test)]
mod tests;
