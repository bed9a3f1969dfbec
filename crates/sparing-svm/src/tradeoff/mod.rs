//! What each way to prune costs and keeps: accuracy, agreement, time and memory of many reduced machines.
//!
//! With labelled data, one random half is there for fits and the other half is measured: no figure comes from
//! data that a fit has seen (whether the model itself was trained on it, only the user knows). Without data,
//! queries are sampled around the support vectors ([`crate::prune::samples`]); then there is agreement with the
//! full machine, but no accuracy.

mod measure;
mod metrics;
mod pareto;
mod write;

pub use metrics::{Quality, area_under_curve, quality};

use crate::model::Model;
use crate::prune::certified::{CascadeOptions, CertifiedCascade};
use crate::prune::{Examples, Machine, Method, Options, PruneError, Random, Sweep, check, samples};
use serde::Serialize;
use std::ops::ControlFlow;

/// Sampled queries to fit at and to measure at, when there is no data.
const SAMPLES: [usize; 2] = [8_000, 20_000];
/// Most rows of data to fit at: more change nothing that half a point shows.
const MOST_FIT_ROWS: usize = 20_000;

/// What to compare.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TradeoffOptions {
    /// Ways to prune.
    pub methods: Vec<Method>,
    /// Numbers of vectors; those not below the model's are left out.
    pub sizes: Vec<usize>,
    /// Seed of all random choices.
    pub seed: u64,
    /// Whether the certified cascade is measured too (RBF only).
    pub certified: bool,
}

/// Labelled rows, scaled as the model wants them.
#[derive(Clone, Copy, Debug)]
pub struct Labelled<'a> {
    /// Row by row.
    pub rows: &'a [f64],
    /// One a row, as in the model's labels (one-class: above 0 is inside).
    pub labels: &'a [f64],
}

/// Where the queries came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// Labelled data.
    Data,
    /// Samples around the support vectors; labels were not given.
    Samples,
}

/// One machine, measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Point {
    /// `full`, `certified` or a [`Method`]'s name.
    pub method: String,
    /// Number of vectors that was asked for; for the cascade the largest level's.
    pub size: usize,
    /// Vectors that the machine has; a cascade has all.
    pub vectors: usize,
    /// Accuracy and its kin; absent without labels.
    #[serde(flatten)]
    pub quality: Option<Quality>,
    /// Share of the queries with the full machine's sign, 0 to 1.
    pub agreement: f64,
    /// Queries with the other sign.
    pub flips: usize,
    /// Nanoseconds a query, one thread, in batches; median of several runs.
    pub ns_per_query: f64,
    /// Memory of the compiled machine.
    pub bytes: usize,
    /// Whether no other machine is both faster and at least as good.
    pub pareto: bool,
    /// Effect on the error of rendered pictures (relative to the full machine's), for when a renderer has
    /// measured it: set it, and it appears in all outputs; absent until then.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rendered_error: Option<f64>,
    /// The reduced machine; absent for the cascade.
    #[serde(skip)]
    pub model: Option<Model>,
}

impl Point {
    /// What counts, 0 to 1: accuracy where labels are known, else agreement.
    #[must_use]
    pub fn score(&self) -> f64 {
        self.quality.map_or(self.agreement, |q| q.accuracy)
    }
}

/// A method and size that gave nothing, and why.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Skipped {
    /// Name of the method.
    pub method: String,
    /// Number of vectors that was asked for.
    pub size: usize,
    /// Why.
    pub reason: String,
}

/// Everything that was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tradeoff {
    /// Name of the model's kernel.
    pub kernel: &'static str,
    /// Features of a query.
    pub features: usize,
    /// Where the queries came from.
    pub source: Source,
    /// Rows that fits have seen.
    pub fit_rows: usize,
    /// Rows that were measured.
    pub measured_rows: usize,
    /// Seed of all random choices.
    pub seed: u64,
    /// The full machine.
    pub full: Point,
    /// The others: by method in the order asked for, then by size.
    pub points: Vec<Point>,
    /// What could not be made.
    pub skipped: Vec<Skipped>,
}

/// How far it is.
#[derive(Clone, Debug)]
pub struct Progress<'a> {
    /// Machines measured.
    pub done: usize,
    /// Machines in all.
    pub total: usize,
    /// What comes next.
    pub next: &'a str,
}

/// Measures all methods at all sizes. `progress` is called before each machine and can stop the work.
///
/// # Errors
/// The model cannot be pruned, the data does not fit it, or `progress` stopped the work.
pub fn tradeoff(
    model: &Model,
    data: Option<Labelled<'_>>,
    options: &TradeoffOptions,
    progress: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
) -> Result<Tradeoff, PruneError> {
    check(model)?;
    let [fit, measured] = match data {
        Some(data) => split(model, data, options.seed)?,
        None => [0, 1].map(|i| Rows {
            rows: samples::queries(model, SAMPLES[i], options.seed.wrapping_add(i as u64)),
            labels: None,
        }),
    };
    let sizes: Vec<usize> = options.sizes.iter().copied().filter(|s| *s < model.len()).collect();
    let total = options.methods.len() * sizes.len() + 1 + usize::from(options.certified);
    let mut done = 0;
    let mut step = |next: &str| {
        let stop = progress(&Progress { done, total, next }).is_break();
        done += 1;
        if stop { Err(PruneError::Stopped) } else { Ok(()) }
    };
    step("full machine")?;
    let machine = Machine::new(model)?;
    let reference = measure::decisions(&machine, &measured.rows);
    let ns = measure::nanoseconds(&measured.rows, model.features, |q, out| machine.decide(q, out));
    let mut full = point("full", model.len(), model, &reference, &reference, &measured, ns, machine.bytes());
    full.model = Some(model.clone());
    let (mut points, mut skipped) = (Vec::new(), Vec::new());
    let examples = Examples { rows: &fit.rows, labels: fit.labels.as_deref() };
    let largest = sizes.iter().copied().max().unwrap_or(1);
    let mut sweep = Sweep::new(model, examples, largest, Options { seed: options.seed })?;
    for method in &options.methods {
        for &size in &sizes {
            let name = method.to_string();
            step(&format!("{name} {size}"))?;
            match sweep.reduce(*method, size).and_then(|reduced| Ok((Machine::new(&reduced)?, reduced))) {
                Ok((machine, reduced)) => {
                    let decisions = measure::decisions(&machine, &measured.rows);
                    let ns = measure::nanoseconds(&measured.rows, model.features, |q, out| {
                        machine.decision_values(q, out);
                    });
                    let mut p =
                        point(&name, size, &reduced, &decisions, &reference, &measured, ns, machine.bytes());
                    p.model = Some(reduced);
                    points.push(p);
                }
                Err(reason) => skipped.push(Skipped { method: name, size, reason: reason.to_string() }),
            }
        }
    }
    if options.certified {
        step("certified cascade")?;
        let cascade =
            CertifiedCascade::new(model, &CascadeOptions { seed: options.seed, ..Default::default() });
        match cascade {
            Ok(cascade) => {
                let decisions = measure::cascade(&cascade, &measured.rows);
                let mut scratch = cascade.scratch();
                let ns = measure::nanoseconds(&measured.rows, model.features, |q, out| {
                    cascade.decide_with(&mut scratch, q, out);
                });
                let size = cascade.levels().iter().map(|l| l.size).max().unwrap_or(model.len());
                let bytes = cascade.bytes();
                points.push(point("certified", size, model, &decisions, &reference, &measured, ns, bytes));
            }
            Err(reason) => skipped.push(Skipped {
                method: "certified".into(),
                size: model.len(),
                reason: reason.to_string(),
            }),
        }
    }
    pareto::mark(&mut full, &mut points);
    Ok(Tradeoff {
        kernel: model.kernel.name(),
        features: model.features,
        source: if data.is_some() { Source::Data } else { Source::Samples },
        fit_rows: fit.rows.len() / model.features,
        measured_rows: reference.len(),
        seed: options.seed,
        full,
        points,
        skipped,
    })
}

impl Tradeoff {
    /// The reduced machine of at most `size` vectors with the best score, the smaller of equals.
    #[must_use]
    pub fn pick_size(&self, size: usize) -> Option<&Point> {
        let fitting = self.points.iter().filter(|p| p.model.is_some() && p.vectors <= size);
        fitting.max_by(|a, b| a.score().total_cmp(&b.score()).then(b.vectors.cmp(&a.vectors)))
    }

    /// The smallest reduced machine whose score is at most `points` percentage points below the full machine's,
    /// the best of equals.
    #[must_use]
    pub fn pick_loss(&self, points: f64) -> Option<&Point> {
        let least = self.full.score() - points / 100.0;
        let fitting = self.points.iter().filter(|p| p.model.is_some() && p.score() >= least - 1e-12);
        fitting.min_by(|a, b| a.vectors.cmp(&b.vectors).then(b.score().total_cmp(&a.score())))
    }
}

/// Rows, and the sign of each where it is known.
struct Rows {
    rows: Vec<f64>,
    labels: Option<Vec<f64>>,
}

/// Two random halves: to fit and to measure.
fn split(model: &Model, data: Labelled<'_>, seed: u64) -> Result<[Rows; 2], PruneError> {
    let n = data.labels.len();
    let features = model.features;
    if data.rows.len() != n * features {
        return Err(PruneError::Examples { found: data.rows.len(), rows: n, features });
    }
    if n < 2 {
        return Err(PruneError::TooFewRows(n));
    }
    let finite = |i: &usize| data.rows[i * features..(i + 1) * features].iter().all(|v| v.is_finite());
    if let Some(row) = (0..n).find(|i| !finite(i)) {
        return Err(PruneError::NotFinite(row));
    }
    let signs: Vec<f64> = (0..n).map(|i| sign(model, data.labels[i], i)).collect::<Result<_, _>>()?;
    let order = Random::stream(seed, 0x0073_706c_6974).choose(n, n);
    let (fit, measured) = order.split_at(n / 2);
    Ok([&fit[..fit.len().min(MOST_FIT_ROWS)], measured].map(|part| Rows {
        rows: part
            .iter()
            .flat_map(|&i| data.rows[i * features..(i + 1) * features].iter().copied())
            .collect(),
        labels: Some(part.iter().map(|&i| signs[i]).collect()),
    }))
}

/// The sign that a decision value should have.
fn sign(model: &Model, label: f64, row: usize) -> Result<f64, PruneError> {
    if !model.svm_type.is_classifier() && label.is_finite() {
        return Ok(if label > 0.0 { 1.0 } else { -1.0 });
    }
    match model.labels.iter().position(|l| f64::from(*l) == label) {
        Some(0) => Ok(1.0),
        Some(_) => Ok(-1.0),
        None => {
            let known = model.labels.iter().map(ToString::to_string).collect::<Vec<_>>().join(" and ");
            Err(PruneError::UnknownLabel { row, label: label.to_string(), known })
        }
    }
}

/// A machine's figures from its decisions.
fn point(
    method: &str,
    size: usize,
    model: &Model,
    decisions: &[f64],
    reference: &[f64],
    measured: &Rows,
    ns_per_query: f64,
    bytes: usize,
) -> Point {
    let flips = decisions.iter().zip(reference).filter(|(d, r)| (**d > 0.0) != (**r > 0.0)).count();
    Point {
        method: method.to_owned(),
        size,
        vectors: model.len(),
        quality: measured.labels.as_ref().map(|labels| quality(decisions, labels)),
        agreement: 1.0 - flips as f64 / reference.len().max(1) as f64,
        flips,
        ns_per_query,
        bytes,
        pareto: false,
        rendered_error: None,
        model: None,
    }
}

#[cfg(test)]
mod tests;
