//! A machine from rows.

use super::{Label, Row};
use crate::features::Feature;
use crate::machine::scale;
use sparing_svm::prune::{Examples, Options, PruneError, reduce};
use sparing_svm::range::Interval;
use sparing_svm::train::{ConstantFeatures, Control, Folds, Grid, Progress, grid_search};
use sparing_svm::{Data, Model, Parameters, Scaling, SvmError};
use std::collections::BTreeMap;

/// How to fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// What the machine is told.
    pub label: Label,
    /// The features to use.
    pub features: Vec<Feature>,
    /// Rows that the machine is trained on, drawn by weight.
    pub rows: usize,
    /// Penalties and kernel widths to try; widths are divided by the number of features.
    pub grid: Grid,
    /// Folds of the cross-validation, by scene.
    pub folds: usize,
    /// Most support vectors of the result.
    pub vectors: usize,
    /// Seed of all random choices.
    pub seed: u64,
}

impl Default for Fit {
    fn default() -> Self {
        Self {
            label: Label::default(),
            features: Feature::DEFAULT.to_vec(),
            rows: 4000,
            grid: Grid { c: vec![0.125, 0.5, 2.0], gamma: vec![0.25, 1.0, 3.0] },
            folds: 5,
            vectors: 128,
            seed: 1,
        }
    }
}

/// Why nothing was fitted.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// Training refused the rows.
    #[error(transparent)]
    Svm(#[from] SvmError),
    /// Pruning failed.
    #[error("the machine cannot be pruned: {0}")]
    Prune(#[from] PruneError),
    /// Nothing to learn from.
    #[error("{0}")]
    Rows(String),
}

/// A machine and what is known of it.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The machine, pruned; +1 is "goes on".
    pub model: Model,
    /// Scaling of its features.
    pub scaling: Scaling,
    /// The chosen C, kernel width, cross-validation figures and so on, by name.
    pub metrics: BTreeMap<String, f64>,
}

/// z-scores are held within these.
const MOST_DEVIATIONS: f64 = 4.0;
/// Weights of rows are held within these: those at the boundary hardly matter, fireflies must not rule.
const WEIGHTS: [f64; 2] = [0.02, 8.0];

/// Fits a machine to the rows of scenes (one list a scene). Bit for bit the same for the same input.
///
/// The class is whether the gain exceeds what it is on average where the rule is undecided; the weight is by how much.
///
/// # Errors
/// Too few rows or scenes, one class only, features that are constant.
pub fn fit(
    scenes: &[Vec<Row>],
    what: &Fit,
    progress: Option<&(dyn Fn(Progress) + Sync)>,
) -> Result<Fitted, FitError> {
    let count: usize = scenes.iter().map(Vec::len).sum();
    if count == 0 || what.features.is_empty() {
        return Err(FitError::Rows("there are no rows to learn from".into()));
    }
    let columns: Vec<usize> =
        what.features.iter().filter_map(|f| Feature::ALL.iter().position(|g| g == f)).collect();
    let label = Label::ALL.iter().position(|l| *l == what.label).unwrap_or(0);
    let unit = gain_unit(scenes, label);
    if !(unit.is_finite() && unit > 0.0) {
        return Err(FitError::Rows("no pixel gains by more samples".into()));
    }
    let mut data = Data { features: columns.len() + 1, ..Data::default() };
    let mut weights = Vec::new();
    for (scene, rows) in scenes.iter().enumerate() {
        for row in rows {
            data.rows.extend(columns.iter().map(|&c| row.features.get(c).copied().unwrap_or(f64::NAN)));
            data.rows.push(scene as f64);
            let ratio = row.gains[label] / unit;
            data.labels.push(if ratio > 1.0 { 1.0 } else { -1.0 });
            weights.push((ratio - 1.0).abs().clamp(WEIGHTS[0], WEIGHTS[1]));
        }
    }
    let positive = data.labels.iter().filter(|l| **l > 0.0).count();
    data.weights = Some(weights);
    let data = data.resampled(what.rows.min(4 * count), what.seed)?;
    let (mut data, groups) = without_last_column(&data);
    let scaling = z_scores(&data);
    data.rows.chunks_exact_mut(columns.len()).for_each(|row| scale(&scaling, row));

    let distinct = groups.iter().collect::<std::collections::BTreeSet<_>>().len();
    let folds = Folds::by_group(&groups, what.folds.min(distinct), what.seed)?;
    let width = columns.len() as f64;
    let grid = Grid { c: what.grid.c.clone(), gamma: what.grid.gamma.iter().map(|g| g / width).collect() };
    // What is constant in a few scenes, such as the share of black blocks, is no mistake.
    let parameters =
        Parameters { constant_features: ConstantFeatures::Allow, ..Parameters::rbf(1.0, 1.0 / width) };
    let found = grid_search(
        &parameters,
        &grid,
        &data,
        &folds,
        &Control { progress: progress.map(|p| p as _), deadline: None },
    )?;
    let full = found.best.train(&data)?;
    let full_vectors = full.len();
    let model = if full_vectors > what.vectors {
        let examples = Examples { rows: &data.rows, labels: Some(&data.labels) };
        let method = "greedy-fit".parse()?;
        reduce(&full, method, what.vectors, examples, Options { seed: what.seed })?
    } else {
        full
    };
    let mut metrics = BTreeMap::new();
    let mut put = |name: &str, value: f64| metrics.insert(name.to_owned(), value);
    put("c", found.best_point.c);
    put("gamma", found.best_point.gamma);
    put("cross-validation accuracy", found.best_point.scores.map_or(0.0, |s| s.merit()));
    put("support vectors before pruning", full_vectors as f64);
    put("rows collected", count as f64);
    put("share of rows that go on", positive as f64 / count as f64);
    put("gain unit", unit);
    Ok(Fitted { model, scaling, metrics })
}

/// The mean of a row's gain over the square of the rule's gain: what the rule's threshold stands for in units of labels. The
/// largest hundredth counts as much as the smallest of it, so that fireflies do not set it.
fn gain_unit(scenes: &[Vec<Row>], label: usize) -> f64 {
    let column = Feature::ALL.iter().position(|f| *f == Feature::Gain).unwrap_or(0);
    let ratio = |row: &Row| Some(row.gains[label] / (2.0 * row.features.get(column)?).exp());
    let mut ratios: Vec<f64> = scenes.iter().flatten().filter_map(ratio).filter(|r| r.is_finite()).collect();
    ratios.sort_by(f64::total_cmp);
    let (first, last) = (ratios.len() / 100, ratios.len() - ratios.len() / 100);
    let (low, high) = match (ratios.get(first), ratios.get(last.saturating_sub(1))) {
        (Some(low), Some(high)) => (*low, *high),
        _ => return 0.0,
    };
    ratios.iter().map(|r| r.clamp(low, high)).sum::<f64>() / ratios.len() as f64
}

/// The last column holds the scene through the resampling.
fn without_last_column(data: &Data) -> (Data, Vec<u64>) {
    let width = data.features;
    let mut out = Data { features: width - 1, labels: data.labels.clone(), ..Data::default() };
    let mut groups = Vec::with_capacity(data.len());
    for row in data.rows.chunks_exact(width) {
        out.rows.extend(&row[..width - 1]);
        groups.push(row[width - 1] as u64);
    }
    (out, groups)
}

/// Brings mean -+ [`MOST_DEVIATIONS`] standard deviations to -+ [`MOST_DEVIATIONS`].
fn z_scores(data: &Data) -> Scaling {
    let n = data.len().max(1) as f64;
    let column = |j: usize| data.rows.iter().skip(j).step_by(data.features).copied();
    let features = (0..data.features)
        .map(|j| {
            let mean = column(j).sum::<f64>() / n;
            let deviation = (column(j).map(|v| (v - mean) * (v - mean)).sum::<f64>() / n).sqrt();
            let half = MOST_DEVIATIONS * deviation;
            Some(Interval { min: mean - half, max: mean + half }).filter(|i| i.min < i.max)
        })
        .collect();
    Scaling { lower: -MOST_DEVIATIONS, upper: MOST_DEVIATIONS, features, target: None }
}
