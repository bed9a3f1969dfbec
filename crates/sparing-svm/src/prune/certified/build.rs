//! Levels of a cascade: which sizes pay is measured on sampled queries.
//!
//! The choice affects speed only; signs are the full machine's whatever is chosen.

use super::{ErrorBound, Level, MAX_LEVELS, Nearest, rounding};
use crate::model::{Kernel, Model};
use crate::prune::dense::{Rows, compensated, expansion, kernel_matrix};
use crate::prune::refit::solve_ridge;
use crate::prune::select::{norm2, order_with};
use crate::prune::{Machine, PruneError, check, samples, with_vectors};
use std::hint::black_box;
use std::time::Instant;

/// How a cascade is built.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CascadeOptions {
    /// Sizes of the levels in the order of their use, at most [`MAX_LEVELS`]; without, those that were fastest
    /// on the samples.
    pub sizes: Option<Vec<usize>>,
    /// Sampled queries to choose with.
    pub samples: usize,
    /// Seed of the samples.
    pub seed: u64,
}

impl Default for CascadeOptions {
    fn default() -> Self {
        Self { sizes: None, samples: 2000, seed: 0 }
    }
}

/// Sizes that are tried.
const SIZES: [usize; 8] = [8, 16, 32, 64, 128, 256, 512, 1024];
/// Larger ridges make smaller coefficients, hence a smaller rounding error of g, at the price of a larger norm.
const RIDGES: [f64; 4] = [1e-13, 1e-10, 1e-8, 1e-6];
/// Below, a squared distance that overflows might still have a kernel value above zero.
const LEAST_GAMMA: f64 = 1e-200;

/// A level with what it does to the samples.
struct Candidate {
    level: Level,
    /// Decided by the bound that holds anywhere, and by either bound.
    anywhere: Vec<bool>,
    near: Vec<bool>,
    /// Nanoseconds a query of g, and of the search for the nearest vector.
    cost: f64,
    search: f64,
}

pub(super) fn build(model: &Model, options: &CascadeOptions) -> Result<(Machine, Vec<Level>), PruneError> {
    check(model)?;
    let Kernel::Rbf { gamma } = model.kernel else { return Err(PruneError::NotRbf(model.kernel.name())) };
    let full = Machine::new(model)?;
    let rounding = rounding::decision(model);
    if !(gamma >= LEAST_GAMMA && gamma.is_finite() && rounding.is_finite()) {
        return Ok((full, Vec::new()));
    }
    let automatic = options.sizes.is_none();
    let sizes: Vec<usize> = match &options.sizes {
        Some(sizes) => sizes.iter().copied().filter(|m| *m > 0).take(MAX_LEVELS).collect(),
        None => SIZES.into_iter().filter(|m| m * 3 < model.len()).collect(),
    };
    let Some(&largest) = sizes.iter().max() else { return Ok((full, Vec::new())) };
    let rows = Rows::new(&model.support_vectors, model.features);
    let values = expansion(model.kernel, rows, &model.coefficients[0], rows);
    let indices = order_with(model, rows, values.clone(), largest).indices;
    let centres = crate::prune::select::gather(model, &indices);
    let base = Base {
        model,
        rounding,
        gamma,
        norm2: norm2(model, &values),
        values: indices.iter().map(|&i| values[i]).collect(),
        kernel: kernel_matrix(
            model.kernel,
            Rows::new(&centres, model.features),
            Rows::new(&centres, model.features),
        ),
        centres,
        queries: samples::queries(model, options.samples.max(1), options.seed),
    };
    let mut candidates: Vec<Candidate> = sizes.iter().filter_map(|&m| base.candidate(m)).collect();
    candidates.dedup_by_key(|c| c.level.model.len());
    let chosen = if automatic {
        let cost = time(&base.queries, |q, out| full.decide(q, out), model.features);
        cheapest(&candidates, cost, options.samples.max(1))
    } else {
        let near = |c: &Candidate| {
            let gained = c.near.iter().zip(&c.anywhere).filter(|(n, a)| **n && !**a).count();
            if gained > 0 { Use::Near } else { Use::Anywhere }
        };
        candidates.iter().map(near).collect()
    };
    let mut levels = Vec::new();
    for (candidate, use_) in candidates.into_iter().zip(chosen) {
        let mut level = candidate.level;
        match use_ {
            Use::No => continue,
            Use::Anywhere => level.nearest = None,
            Use::Near => {}
        }
        levels.push(level);
    }
    Ok((full, levels))
}

/// How a candidate is used.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Use {
    No,
    Anywhere,
    Near,
}

/// What all candidates share.
struct Base<'a> {
    model: &'a Model,
    /// Of the full machine's sum.
    rounding: f64,
    gamma: f64,
    norm2: f64,
    /// The greedy order's vectors, f without rho there, and their kernel values.
    centres: Vec<f64>,
    values: Vec<f64>,
    kernel: Vec<f64>,
    queries: Vec<f64>,
}

impl Base<'_> {
    /// The level of the first `m` vectors, with the ridge that decides most samples.
    fn candidate(&self, m: usize) -> Option<Candidate> {
        let m = m.min(self.values.len());
        let all = self.values.len();
        let kernel: Vec<f64> =
            (0..m).flat_map(|i| self.kernel[i * all..i * all + m].iter().copied()).collect();
        let tried = RIDGES.iter().filter_map(|&ridge| {
            let coefficients = solve_ridge(&kernel, m, m, &self.values[..m], ridge)?;
            let level = self.level(m, &kernel, &coefficients)?;
            let (anywhere, near) = self.decided(&level);
            Some((near.iter().chain(&anywhere).filter(|d| **d).count(), level, anywhere, near))
        });
        let mut best: Option<(usize, Level, Vec<bool>, Vec<bool>)> = None;
        for candidate in tried {
            if best.as_ref().is_none_or(|b| candidate.0 > b.0) {
                best = Some(candidate);
            }
        }
        let (_, level, anywhere, near) = best?;
        let features = self.model.features;
        let mut bounds = vec![0.0; self.queries.len() / features];
        let cost = time(
            &self.queries,
            |q, out| level.machine.decision_values_with_bounds(q, out, &mut bounds),
            features,
        );
        let search = time(
            &self.queries,
            |q, out| {
                let Some(nearest) = &level.nearest else { return };
                out.iter_mut().zip(q.chunks_exact(features)).for_each(|(o, q)| *o = nearest.distance2(q));
            },
            features,
        );
        Some(Candidate { level, anywhere, near, cost, search })
    }

    /// The machine of these coefficients with its bound.
    fn level(&self, m: usize, kernel: &[f64], coefficients: &[f64]) -> Option<Level> {
        let features = self.model.features;
        let model = with_vectors(self.model, &self.centres[..m * features], coefficients, self.model.rho[0]);
        if model.is_empty() {
            return None;
        }
        let g: Vec<f64> = kernel
            .chunks_exact(m)
            .map(|row| compensated(row.iter().zip(coefficients).map(|(k, c)| k * c)))
            .collect();
        let values = &self.values[..m];
        let terms = |v: &[f64]| compensated(coefficients.iter().zip(v).map(|(c, v)| c * v));
        let delta2 = self.norm2 - 2.0 * terms(values) + terms(&g);
        let at_vectors = values.iter().zip(&g).map(|(f, g)| (f - g).abs()).fold(0.0, f64::max);
        let mass = rounding::mass(self.model) + rounding::mass(&model);
        let bound = ErrorBound::new(self.gamma, features, delta2, at_vectors, mass);
        let rounding = self.rounding + rounding::decision(&model);
        if !(bound.anywhere() + rounding).is_finite() {
            return None;
        }
        let nearest = Some(Nearest::new(&model.support_vectors, features));
        Some(Level { machine: Machine::new(&model).ok()?, model, bound, rounding, nearest })
    }

    /// Which samples each of the bounds decides.
    fn decided(&self, level: &Level) -> (Vec<bool>, Vec<bool>) {
        let features = self.model.features;
        let n = self.queries.len() / features;
        let (mut values, mut bounds) = (vec![0.0; n], vec![0.0; n]);
        level.machine.decision_values_with_bounds(&self.queries, &mut values, &mut bounds);
        let at = values.iter().zip(&bounds).zip(self.queries.chunks_exact(features));
        at.map(|((value, bound), query)| {
            let rounding = bound + level.rounding;
            let anywhere = value.abs() > level.bound.anywhere() + rounding;
            (anywhere, anywhere || level.near_decides(*value, rounding, query))
        })
        .unzip()
    }
}

/// Nanoseconds a query: the least of five runs.
fn time(queries: &[f64], mut run: impl FnMut(&[f64], &mut [f64]), features: usize) -> f64 {
    let mut out = vec![0.0; queries.len() / features];
    let once = |_| {
        let start = Instant::now();
        run(black_box(queries), black_box(&mut out));
        start.elapsed().as_secs_f64()
    };
    (0..5).map(once).fold(f64::INFINITY, f64::min) * 1e9 / (queries.len() / features) as f64
}

/// The use of each candidate that costs least on the samples: all combinations of up to [`MAX_LEVELS`] are
/// tried.
fn cheapest(candidates: &[Candidate], full: f64, samples: usize) -> Vec<Use> {
    let mut best = (full * samples as f64, vec![Use::No; candidates.len()]);
    let mut uses = vec![Use::No; candidates.len()];
    try_all(candidates, full, 0, &vec![true; samples], 0.0, &mut uses, &mut best);
    best.1
}

fn try_all(
    candidates: &[Candidate],
    full: f64,
    first: usize,
    open: &[bool],
    spent: f64,
    uses: &mut Vec<Use>,
    best: &mut (f64, Vec<Use>),
) {
    let count = open.iter().filter(|o| **o).count() as f64;
    if spent + count * full < best.0 {
        *best = (spent + count * full, uses.clone());
    }
    if spent >= best.0 || uses.iter().filter(|u| **u != Use::No).count() == MAX_LEVELS {
        return;
    }
    for (i, candidate) in candidates.iter().enumerate().skip(first) {
        let after =
            |decided: &[bool]| -> Vec<bool> { open.iter().zip(decided).map(|(o, d)| *o && !d).collect() };
        let anywhere = after(&candidate.anywhere);
        let left = anywhere.iter().filter(|o| **o).count() as f64;
        uses[i] = Use::Anywhere;
        try_all(candidates, full, i + 1, &anywhere, spent + count * candidate.cost, uses, best);
        uses[i] = Use::Near;
        let cost = count * candidate.cost + left * candidate.search;
        try_all(candidates, full, i + 1, &after(&candidate.near), spent + cost, uses, best);
        uses[i] = Use::No;
    }
}

/// The norm of the difference of two machines with the same kernel, straight from the definition, for tests.
#[cfg(test)]
pub(super) fn difference_norm2(a: &Model, b: &Model) -> f64 {
    let rows: Vec<f64> = a.support_vectors.iter().chain(&b.support_vectors).copied().collect();
    let beta: Vec<f64> =
        a.coefficients[0].iter().copied().chain(b.coefficients[0].iter().map(|c| -c)).collect();
    let rows = Rows::new(&rows, a.features);
    crate::prune::dense::dot(&beta, &expansion(a.kernel, rows, &beta, rows))
}
